#!/usr/bin/env bash
# Runs all tests. Needs cargo (Rust 1.88 or newer; the library itself needs 1.85) a C linker, and the network for the first
# build.
# Ends with 0 only if everything ran and passed.
set -euo pipefail
cd "$(dirname "$0")/.."
command -v cargo >/dev/null || { echo "cargo is missing: install Rust" >&2; exit 1; }

echo "== workspace: unit, integration and documentation tests"
cargo test --locked --workspace

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
