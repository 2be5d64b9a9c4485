#!/usr/bin/env bash
# Makes mistakes in a copy of the crate on purpose, one at a time, runs tests, and prints which of them fail, as a table in
# Markdown. The library's tests run in three groups, the quick ones first, up to the first group that fails. Ends with 0 only
# if each mistake is caught.
#     bash tests/mutants.sh library > docs/mutants.md                                  the library's own tests, some 25 minutes
#     bash tests/mutants.sh rasteriser > tests/conformance/src/mutants.md             the tests on a rasteriser, some 20 minutes
# With a second argument: only the mistakes whose names contain it. The mistakes stand in tests/mutants/*.txt, one on each line:
# what it is, the file, what stands there in one place, and what it becomes.
set -euo pipefail
cd "$(dirname "$0")/.."
suite=${1:?library or rasteriser}
case "$suite" in
    library)
        quick="--lib --test cases --test accuracy --test published --test bias --test errors --test middle"
        groups=("$quick" "--test properties --test optimal --test margins" "--tests")
        groups=("${groups[@]/#/--package shadow-warp --no-fail-fast }") title="# Mistakes, and what catches them"
        ;;
    rasteriser) groups=("--release --package conformance --test gpu") title="## Mistakes, and what catches them" ;;
    *) echo "library or rasteriser" >&2 && exit 2 ;;
esac
# A folder of its own: cargo would take what it built from a mistake for what it built from the crate.
# Built quickly, run quickly.
export CARGO_PROFILE_DEV_DEBUG=0 CARGO_PROFILE_DEV_OPT_LEVEL=1
export NODEVICE_SELECT=1 RUST_BACKTRACE=0 CARGO_TARGET_DIR="$PWD/target/mutants"
pristine=$(mktemp -d) copy=$(mktemp -d) log=$(mktemp)
trap 'rm -rf "$pristine" "$copy" "$log"' EXIT
git archive HEAD | tar -x -C "$pristine"
cp -r "$pristine/." "$copy"
# Which tests fail, one on each line, of the first group where any do; nothing where all pass.
failed_tests() {
    local group
    for group in "${groups[@]}"; do
        # shellcheck disable=SC2086
        (cd "$copy" && timeout 1800 cargo test --quiet $group) >"$log" 2>&1 && continue
        sed -n 's/^    \([a-z_:0-9]*\)$/\1/p' "$log" | sort -u | grep . ||
            { tail -40 "$log" >&2; echo "(it does not build, or end)"; }
        return
    done
}

[ -z "$(failed_tests)" ] || { cat "$log" >&2; echo "tests fail without any mistake" >&2; exit 1; }
all_caught=true count=0
printf '%s\n\nEach of these was made in the crate on purpose, alone, and the tests were run, by\n`bash tests/mutants.sh %s`.\n\n| mistake | caught by |\n|---|---|\n' "$title" "$suite"
while IFS=$'\t' read -r what file from to; do
    case "$what" in *"${2:-}"*) count=$((count + 1)) ;; *) continue ;; esac
    FROM="$from" TO="$to" perl -0pe '$n += s/\Q$ENV{FROM}\E/$ENV{TO}/g; END { exit($n == 1 ? 0 : 3) }' \
        "$pristine/$file" >"$copy/$file" || { echo "$file: not one place reads: $from" >&2; exit 1; }
    caught=$(failed_tests | sed 's/.*/`&`/' | paste -sd, - | sed 's/,/, /g')
    case "$caught" in '' | *'('*) all_caught=false caught="**${caught:-nothing}**" ;; esac
    # A change that breaks nearly everything needs no list.
    number=$(tr -cd '`' <<<"$caught" | wc -c)
    [ "$number" -le 24 ] || caught="$(cut -d, -f1-8 <<<"$caught"), and $((number / 2 - 8)) more"
    echo "| $what | $caught |"
    cp "$pristine/$file" "$copy/$file"
    # Inputs that failed are kept; those of one mistake are nothing to the next.
    rm -rf "$copy/tests/regressions"
done <"$pristine/tests/mutants/$suite.txt"
[ "$count" -gt 0 ] && $all_caught
