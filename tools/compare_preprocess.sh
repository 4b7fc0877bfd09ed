#!/bin/sh
# Pyramid, bounds and compressed terrain file beside gdal_translate to a cloud-optimised GeoTIFF with Lanczos overviews,
# deflate, predictor and two threads, of the same file in the same run: wall times in turns, medians, and the sizes.
#
#   tools/compare_preprocess.sh [FILE...]
#
# Without a FILE, the Sierra of ../shared/data as int16 and float32. ROUNDS (default 5) says how often. Needs gdal-bin,
# GNU time and unzip.
set -eu
cd "$(dirname "$0")/.."
cargo build --release --quiet --no-default-features --features dem,cli
own=$PWD/target/release/clipscape
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
if [ $# -eq 0 ]; then
    for zip in ../shared/data/sierra/*.zip; do unzip -qo "$zip" -d "$work/hgt"; done
    gdalbuildvrt -q "$work/sierra.vrt" "$work"/hgt/*.hgt
    for type in Int16 Float32; do
        gdal_translate -q -ot $type "$work/sierra.vrt" "$work/sierra_$type.tif"
    done
    set -- "$work/sierra_Int16.tif" "$work/sierra_Float32.tif"
fi
median() { sort -n "$1" | awk '{ v[NR] = $1 } END { print v[int((NR + 1) / 2)] }'; }
for file; do
    cat "$file" > /dev/null
    rm -f "$work"/*.s
    for _ in $(seq "${ROUNDS:-5}"); do
        /usr/bin/time -a -o "$work/own.s" -f %e "$own" preprocess "$file" --no-light --quiet --force -o "$work/t.terrain.exr"
        /usr/bin/time -a -o "$work/gdal.s" -f %e gdal_translate -q -of COG -co COMPRESS=DEFLATE -co PREDICTOR=YES \
            -co OVERVIEW_RESAMPLING=LANCZOS -co NUM_THREADS=2 "$file" "$work/t.tif"
    done
    awk -v file="$file" -v own="$(median "$work/own.s")" -v gdal="$(median "$work/gdal.s")" \
        -v own_bytes="$(stat -c %s "$work/t.terrain.exr")" -v gdal_bytes="$(stat -c %s "$work/t.tif")" 'BEGIN {
        printf "%s: %.2f s and %.1f MB, gdal_translate %.2f s and %.1f MB: %.2f times as fast, %.2f times the size\n",
            file, own, own_bytes / 1e6, gdal, gdal_bytes / 1e6, gdal / own, own_bytes / gdal_bytes
    }'
done
