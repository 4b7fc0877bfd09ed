#!/bin/sh
# All that must hold before a change lands: format, lints, tests without and with a GPU, docs, a short demo.
set -eu

cd -- "$(dirname -- "$0")/.."
. tools/setup.sh

# A minimal Rust comes without these two.
cargo fmt --version >/dev/null 2>&1 || rustup component add rustfmt
cargo clippy --version >/dev/null 2>&1 || rustup component add clippy

# The window is tested on a screen without a monitor, where there can be one.
if [ "$(uname -s)" = Linux ] && command -v apt-get >/dev/null 2>&1 &&
    ! { command -v Xvfb && command -v xdotool; } >/dev/null 2>&1; then
    (clipscape_install 'the window is tested under Xvfb' \
        xvfb xdotool libxkbcommon-x11-0 libxcursor1 libxi6 libxrandr2) || true
fi

step() {
    printf '\n== %s\n' "$*" >&2
    "$@"
}

step cargo fmt --check
step cargo clippy --locked --all-targets -- -D warnings
step cargo clippy --locked --no-default-features --all-targets -- -D warnings
step cargo test --locked --no-default-features
step env CLIPSCAPE_REQUIRE_GPU=1 cargo test --locked
step env RUSTDOCFLAGS='-D warnings' cargo doc --locked --no-deps

CLIPSCAPE_OUT=$(mktemp -d)
export CLIPSCAPE_OUT
trap 'rm -rf "$CLIPSCAPE_OUT"' EXIT
trap 'exit 130' INT TERM
# What an embedding program takes: drawing, without the command line and the DEM formats.
step cargo run --locked --quiet --no-default-features --features gpu --example embed -- "$CLIPSCAPE_OUT/embed.png"
[ -s "$CLIPSCAPE_OUT/embed.png" ] || { echo 'clipscape: the example left no picture' >&2; exit 1; }
step sh tools/demo.sh --frames 0..3
for file in pyrenees.terrain.exr contact-sheet.png flight.png flight.jsonl; do
    [ -s "$CLIPSCAPE_OUT/$file" ] || { echo "clipscape: the demo left no $file" >&2; exit 1; }
done
[ "$(find "$CLIPSCAPE_OUT/flight" -name '*.png' | wc -l)" -eq 3 ] ||
    { echo 'clipscape: the demo did not leave 3 frames' >&2; exit 1; }

printf '\nAll passed.\n' >&2
