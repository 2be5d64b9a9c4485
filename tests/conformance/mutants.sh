#!/usr/bin/env bash
# Makes mistakes in a copy of the crate on purpose, one at a time, runs the tests on a rasteriser, and prints which of them
# fail, as a table in Markdown. Ends with 0 only if each mistake is caught. With an argument: only the mistakes whose names
# contain it. `tests/conformance/src/mutants.md` is what it prints.
set -euo pipefail
cd "$(dirname "$0")/../.."
# A folder of its own: cargo would take what it built from a mistake for what it built from the crate.
export NODEVICE_SELECT=1 CARGO_TARGET_DIR="$PWD/target/mutants"
pristine=$(mktemp -d) copy=$(mktemp -d)
trap 'rm -rf "$pristine" "$copy"' EXIT
git archive HEAD | tar -x -C "$pristine"
cp -r "$pristine/." "$copy"
# Which tests fail, one on each line; nothing where all pass.
log=$(mktemp)
failed_tests() {
    (cd "$copy" && timeout 1800 cargo test --quiet --release --package conformance --test gpu) >"$log" 2>&1 && return
    sed -n 's/^    \([a-z_]*\)$/\1/p' "$log" | sort -u | grep . || { cat "$log" >&2; echo "(it does not build, or end)"; }
}

# What the mistake is; the file; what stands there; what it becomes.
mutants=(
    "a sign of the warp's row, \`w = 1 - eta t\`|src/fit.rs|row(space.z * (eta / d), 1.0 - eta / d * along.low)|row(space.z * (-eta / d), 1.0 + eta / d * along.low)"
    "a sign of the warp's row, its constant|src/fit.rs|1.0 - eta / d * along.low|1.0 + eta / d * along.low"
    "near and far depth swapped|src/fit.rs|(depths.high * w - above_middle) / depths.size()|(above_middle - depths.low * w) / depths.size()"
    "near and far of the body swapped in the rule|src/fit.rs|Slab { near, far, extent: d|Slab { near: far, far: near, extent: d"
    "half a texel (of 1024) forgotten in texture space|src/clip_space.rs|DVec4::new(0.5, 0.0, 0.0, 0.5)|DVec4::new(0.5, 0.0, 0.0, 0.5 + 0.5 / 1024.0)"
    "x mirrored|src/clip_space.rs|[x, if self.y_down|[-x, if self.y_down"
    "equation (2) of the LiSPSM paper as printed, with a plus|src/fit.rs|y = row(space.z, -along.low) * ((2.0 + eta) / d) - DVec4::W;|y = if eta > 0.0 { (w + DVec4::W) * (2.0 * (1.0 + eta) / eta) - w } else { row(space.z, -along.low) * (2.0 / d) - DVec4::W };"
    "the middle of x taken for the eye's, \`p_x = 0\`, in the fit alone|src/fit.rs|x = fitted(offset, side, w);|x = fitted(row(space.x, 0.0), side, w);"
    "y not turned for Vulkan|src/clip_space.rs|if self.y_down { -y } else { y }|y"
    "v turned for the wrong interfaces|src/clip_space.rs|self.y_down == self.texture_top_first|self.y_down"
    "depth not reversed|src/clip_space.rs|DepthRange::OneToZero => w - z|DepthRange::OneToZero => z"
    "depth of OpenGL from 0|src/clip_space.rs|z + z - w|z"
    "the near plane at the receivers, whatever the casters|src/fit.rs|depths.high = max(reach, depths.high);|let _ = reach;"
    "texel extent along the warp without its square|src/map.rs|length(w * texel.x, w * w * texel.y)|length(w * texel.x, w * texel.y)"
    "the bound on rounding a hundredth|src/margin.rs|6.0 * U / (1.0 - 6.0 * U)|0.06 * U"
    "light space a thousandth of a radian off the light|src/basis.rs|return Self { x, y, z: y.cross(x), sin_gamma: sine };|return Self { x, y, z: (y.cross(x) + 0.001 * y).normalize(), sin_gamma: sine };"
)

[ -z "$(failed_tests)" ] || { echo "tests fail without any mistake" >&2; exit 1; }
caught_all=true count=0
echo "## Mistakes, and what catches them"
echo
echo "Each of these was made in the crate on purpose, alone, and the tests on lavapipe were run, by"
echo "\`bash tests/conformance/mutants.sh\`."
echo
echo "| mistake | caught by |"
echo "|---|---|"
for mutant in "${mutants[@]}"; do
    IFS='|' read -r what file from to <<<"$mutant"
    case "$what" in *"${1:-}"*) count=$((count + 1)) ;; *) continue ;; esac
    FROM="$from" TO="$to" perl -0pe '$n += s/\Q$ENV{FROM}\E/$ENV{TO}/g; END { exit($n == 1 ? 0 : 3) }' \
        "$pristine/$file" >"$copy/$file" || { echo "$file: not one place reads: $from" >&2; exit 1; }
    caught=$(failed_tests | sed 's/.*/`&`/' | paste -sd, - | sed 's/,/, /g')
    case "$caught" in '' | *'('*) caught_all=false caught="**${caught:-nothing}**" ;; esac
    echo "| $what | $caught |"
    cp "$pristine/$file" "$copy/$file"
done
[ "$count" -gt 0 ] && $caught_all
