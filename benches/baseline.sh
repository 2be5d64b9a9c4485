#!/usr/bin/env bash
# Counts the instructions of every bench in benches/instructions.rs.
#   bash benches/baseline.sh            compares with benches/baseline.txt; over 2 % worse fails
#   bash benches/baseline.sh --write    renews that file
#   bash benches/baseline.sh --print    prints what would be written
#
# The file names what its counts were measured with. Where that differs here, the commit that last
# changed the file is measured too, and compared with.
set -euo pipefail
cd "$(dirname "$0")/.."
file=benches/baseline.txt
# What changes the code that is measured, or the way it is counted.
unset RUSTFLAGS CARGO_ENCODED_RUSTFLAGS CARGO_BUILD_RUSTFLAGS CARGO_BUILD_TARGET
export CARGO_INCREMENTAL=0

install_tools() {
    if ! command -v valgrind >/dev/null; then
        if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
            export DEBIAN_FRONTEND=noninteractive
            local install=(apt-get install -qq -y --no-install-recommends valgrind libc6-dbg)
            { "${install[@]}" || { apt-get update -qq && "${install[@]}"; }; } >&2 || true
        fi
        command -v valgrind >/dev/null || {
            echo "Counting instructions needs valgrind. Install it, for example the packages valgrind and" \
                "libc6-dbg (Debian, Ubuntu: apt-get install valgrind libc6-dbg)." >&2
            exit 1
        }
    fi
    # The runner must have the version of the library.
    gungraun=$(cargo pkgid --locked gungraun)
    gungraun=${gungraun##*[@#]}
    PATH=$PWD/target/tools/bin:$PATH
    if [ "$(gungraun-runner --version 2>/dev/null)" != "gungraun-runner $gungraun" ]; then
        local install=(cargo install --quiet --locked gungraun-runner --version "$gungraun")
        "${install[@]}" --root target/tools >&2 || {
            echo "Counting instructions needs gungraun's runner: ${install[*]}" >&2
            exit 1
        }
    fi
}

# What the counts depend on besides the code. Not on the processor: see benches/instructions.rs.
measured_with() {
    echo "# Instructions of a thousand jobs each. Renew with: bash benches/baseline.sh --write"
    echo "# $(rustc --version), $(rustc -vV | sed -n 's/^host: //p')"
    echo "# $(getconf GNU_LIBC_VERSION 2>/dev/null || echo "another libc"), $(valgrind --version), gungraun-$gungraun"
}

counts() {
    local options=(--callgrind-metrics=ir --nosummary --parallel)
    cargo bench --locked --bench instructions -- "${options[@]}" >target/instructions.txt
    awk '/^instructions::/ { name = $1; sub(/.*::/, "", name) }
        /^ *Instructions:/ { split($2, count, "|"); print name, count[1] }' target/instructions.txt
}

# Compares the counts in $2 with those in $1, and prints which differ. Fails where one is worse.
compare() {
    awk -v limit=2 '
        /^#/ { next }
        NR == FNR { before[$1] = $2; next }
        !($1 in before) { print "  new: " $1; next }
        {
            both++
            change = 100 * ($2 / before[$1] - 1)
            if (change > limit) worse++
            if (change > limit || change < -limit)
                printf "  %s: %s instructions in place of %s, %+.1f %%\n", $1, $2, before[$1], change
        }
        END {
            if (!both) print "  nothing to compare"
            exit worse > 0 || !both
        }' "$1" "$2"
}

advice="If this is meant, run 'bash benches/baseline.sh --write', commit $file, and say why in the message."

install_tools
mkdir -p target
{ measured_with; counts; } >target/counts.txt
case "${1:-}" in
--print) cat target/counts.txt; exit ;;
--write) cp target/counts.txt "$file"; exit ;;
esac

names() {
    grep -v '^#' "$1" | cut -d' ' -f1 | sort
}
if ! diff <(names "$file") <(names target/counts.txt); then
    echo "The benches are not those of $file. $advice" >&2
    exit 1
fi
base=$file
if ! diff -q <(grep '^#' "$file") <(grep '^#' target/counts.txt) >/dev/null; then
    [ "$(git rev-parse --is-shallow-repository)" = false ] ||
        { echo "$file was measured elsewhere; the whole history is needed: git fetch --unshallow" >&2; exit 1; }
    commit=$(git log -1 --format=%H -- "$file")
    [ -n "$commit" ] || { echo "$file is not committed" >&2; exit 1; }
    echo "$file was measured elsewhere, so commit $commit is measured too."
    there=target/baseline
    rm -rf "$there"
    mkdir -p "$there"
    git archive "$commit" | tar -x -C "$there"
    base=target/baseline.txt
    # Its own build: cargo could take what was built here for it.
    CARGO_TARGET_DIR=$PWD/$there/target bash "$there/benches/baseline.sh" --print >"$base"
fi
if ! compare "$base" target/counts.txt; then
    echo "More than 2 % more instructions than in $base. $advice" >&2
    exit 1
fi
echo "no bench needs more than 2 % more instructions than in $base"
