#!/bin/sh
# Reads GeoTIFFs through windows from north to south, beside gdal_translate on the same file in the same run: a rate
# each, in turns, and their medians. gdal_translate writes what it reads to memory, uncompressed; python3-gdal, where it
# is there, reads windows of the same rows and writes nothing.
#
#   tools/compare_read.sh [FILE...]
#
# Without a FILE, one of 16384 x 16384 samples of int16 in strips of deflate is made of ../shared/data/sierra. Needs
# gdal-bin and GNU time.
set -eu
cd "$(dirname "$0")/.."
cargo build --release --no-default-features --features dem,cli --example read_dem
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
if [ $# -eq 0 ]; then
    for zip in ../shared/data/sierra/*.zip; do unzip -qo "$zip" -d "$work/hgt"; done
    gdalbuildvrt -q "$work/sierra.vrt" "$work"/hgt/*.hgt
    for predictor in 1 2; do
        gdal_translate -q -ot Int16 -outsize 16384 16384 -r bilinear -co COMPRESS=DEFLATE -co PREDICTOR=$predictor \
            "$work/sierra.vrt" "$work/i16-predictor-$predictor.tif"
    done
    gdal_translate -q -ot Float32 -outsize 16384 16384 -r bilinear -co COMPRESS=DEFLATE -co PREDICTOR=3 \
        "$work/sierra.vrt" "$work/f32-predictor-3.tif"
    set -- "$work"/*.tif
fi
cat > "$work/windows.py" <<'PYTHON'
import sys
import time

from osgeo import gdal

dataset = gdal.Open(sys.argv[1])
width, height = dataset.RasterXSize, dataset.RasterYSize
start = time.time()
for z in range(0, height, 256):
    dataset.ReadRaster(0, z, width, min(256, height - z), buf_type=gdal.GDT_Float32, band_list=[1])
print(f"{time.time() - start:.3f}")
PYTHON
median() { sort -n | awk '{ v[NR] = $1 } END { print v[int((NR + 1) / 2)] }'; }
for file; do
    rm -f "$work"/*.s
    for _ in 1 2 3 4 5; do
        line=$(target/release/examples/read_dem "$file")
        echo "$line" | sed 's/.* decoded, \([0-9.]*\) s.*/\1/' >> "$work/own.s"
        /usr/bin/time -o "$work/gdal.time" -f %e gdal_translate -q "$file" /vsimem/x.tif
        cat "$work/gdal.time" >> "$work/gdal.s"
        /usr/bin/python3 "$work/windows.py" "$file" >> "$work/windows.s" 2>/dev/null || true
    done
    samples=$(gdalinfo "$file" | sed -n 's/^Size is \([0-9]*\), \([0-9]*\)/\1 \2/p' | awk '{ print $1 * $2 / 1e6 }')
    echo "$line"
    for who in own gdal windows; do
        [ -s "$work/$who.s" ] || continue
        median < "$work/$who.s" | awk -v who=$who -v samples="$samples" \
            '{ printf "  %-8s median of 5: %.3f s, %.1f Msample/s\n", who, $1, samples / $1 }'
    done
done
