#!/bin/sh
# Draws a DEM with `--wait none` while the cache folder is too small for its terrain file, then while it may only be read:
# the frames are drawn, one line says that nothing is kept, and nothing is left half-written. A file that was kept before is
# drawn from a folder that may only be read.
#
#   tools/check_cache.sh [DEM]      (default: data/N42E001.hgt)
#
# Mounts a tmpfs of 2 MB, so it needs root (Linux); where that is not permitted it says so and checks nothing.
set -eu
cd "$(dirname "$0")/.."
dem=$(realpath "${1:-data/N42E001.hgt}")
cargo build --release --quiet --no-default-features --features gpu,dem,cli
own=$PWD/target/release/clipscape
work=$(mktemp -d)
mkdir "$work/cache" "$work/drawn"
if ! mount -t tmpfs -o size=2m tmpfs "$work/cache"; then
    echo "skipped: no file system may be mounted here"
    exit 0
fi
trap 'umount "$work/cache"; rm -rf "$work"' EXIT
export CLIPSCAPE_CACHE="$work/cache"
fail() { echo "FAILED: $1"; cat "$work/err"; exit 1; }
draw() {
    "$own" render "$dem" --wait none --flight orbit --frames 0..40 --size 320x180 --force -o "$work/drawn" \
        --stats "$work/stats" 2> "$work/err" || fail "status $?"
    [ "$(ls "$work/drawn" | wc -l)" -eq 40 ] || fail "frames are missing"
}
nothing_kept() {
    [ "$(grep -c 'nothing is kept for the next run' "$work/err")" -eq 1 ] || fail "$1: not said once"
    [ -z "$(ls -A "$work/cache")" ] || { ls -lA "$work/cache"; fail "$1: something is left"; }
    echo "ok: $1: $(grep 'nothing is kept' "$work/err")"
}
draw
nothing_kept "a full folder"
mount -o remount,size=2m,ro "$work/cache"
draw
nothing_kept "a folder that may only be read"
mount -o remount,size=64m,rw "$work/cache"
draw
[ "$(ls "$work/cache" | grep -c 'terrain.exr$')" -eq 1 ] || fail "with room, nothing was kept"
mount -o remount,ro "$work/cache"
draw
grep -q '"provisional":true' "$work/stats" && fail "what is kept was not drawn"
echo "ok: a file that was kept is drawn from a folder that may only be read"
