#!/usr/bin/env bash
# Runs all tests. Needs cargo (Rust 1.88 or newer; the library itself needs 1.85), a C linker, the network for the first
# build, and a Vulkan driver, which it installs where it may.
# Ends with 0 only if everything ran and passed.
set -euo pipefail
cd "$(dirname "$0")/.."
command -v cargo >/dev/null || { echo "cargo is missing: install Rust" >&2; exit 1; }

echo "== a Vulkan driver: lavapipe, in software"
if ! compgen -G "/usr/share/vulkan/icd.d/lvp_icd*.json" >/dev/null && [ -z "${VK_DRIVER_FILES:-${VK_ICD_FILENAMES:-}}" ]; then
    if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
        export DEBIAN_FRONTEND=noninteractive
        install=(apt-get install -qq -y --no-install-recommends libvulkan1 mesa-vulkan-drivers)
        "${install[@]}" || { apt-get update -qq && "${install[@]}"; }
    elif ! compgen -G "/usr/share/vulkan/icd.d/*.json" >/dev/null; then
        echo "The tests on a rasteriser need a Vulkan driver. Install one, for example the packages libvulkan1 and" \
            "mesa-vulkan-drivers (Debian, Ubuntu: apt-get install libvulkan1 mesa-vulkan-drivers)." >&2
        exit 1
    fi
fi
# Mesa's layer that sorts devices is of no use here, and complains of a missing XDG_RUNTIME_DIR.
export NODEVICE_SELECT=1

echo "== the library: unit, integration and documentation tests"
cargo test --locked --package shadow-warp

echo "== the report and the matrices on a rasteriser (in the release profile, as the report runs in)"
cargo test --locked --release --package scenes --package conformance --package report

echo "== the same library with libm in place of std"
cargo test --locked --package shadow-warp --no-default-features --features libm

echo "== with every feature"
cargo check --locked --package shadow-warp --all-features

echo "== a program without std links and runs"
cargo run --locked --quiet --manifest-path tests/no_std/Cargo.toml
cargo run --locked --quiet --manifest-path tests/no_std/Cargo.toml --release

echo "== projects on either version of glam build and run"
for project in tests/glam_versions/*/; do
    cargo run --locked --quiet --manifest-path "$project/Cargo.toml"
done

echo "all tests passed"
