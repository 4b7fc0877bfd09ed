#!/bin/sh
# Preprocesses the shipped DEM and renders a flight of 120 frames through it.
#
#   sh tools/demo.sh                   all frames
#   sh tools/demo.sh --frames 0..3     the short form; any other option of `clipscape render` may follow
#
# Leaves in out/ (or in the folder that CLIPSCAPE_OUT names): pyrenees.terrain.exr, flight/*.png,
# contact-sheet.png, flight.png (an animation, for any browser) and flight.jsonl (statistics).
set -eu

cd -- "$(dirname -- "$0")/.."
. tools/setup.sh

out=${CLIPSCAPE_OUT:-out}
mkdir -p "$out"

cargo build --release --locked
clipscape() {
    cargo run --release --locked --quiet -- "$@"
}

clipscape preprocess data/N42E001.hgt -o "$out/pyrenees.terrain.exr" --force
clipscape render "$out/pyrenees.terrain.exr" --flight data/pyrenees.json --size 1280x720 \
    -o "$out/flight" --contact-sheet "$out/contact-sheet.png" --animation "$out/flight.png" \
    --stats "$out/flight.jsonl" --force "$@"

echo "Frames in $out/flight, all of them on $out/contact-sheet.png; open $out/flight.png in a browser."
