#!/bin/sh
# Preprocesses onto a file system of 20 MB that is too small for the result: one line, status 1, and nothing left.
#
#   tools/check_full_disk.sh
#
# Mounts a tmpfs, so it needs root (Linux).
set -eu
cd "$(dirname "$0")/.."
cargo build --release --quiet --no-default-features --features dem,cli
work=$(mktemp -d)
mount -t tmpfs -o size=20m tmpfs "$work"
trap 'umount "$work"; rmdir "$work"' EXIT
status=0
target/release/clipscape preprocess synth:4096 --no-light -o "$work/t.terrain.exr" 2> "$work.err" || status=$?
line=$(cat "$work.err")
rm -f "$work.err"
[ "$status" -eq 1 ] || { echo "status $status"; exit 1; }
[ "$(printf '%s\n' "$line" | wc -l)" -eq 1 ] || { echo "more than a line: $line"; exit 1; }
[ -z "$(ls -A "$work")" ] || { ls -lA "$work"; echo 'something is left'; exit 1; }
echo "said: $line"
