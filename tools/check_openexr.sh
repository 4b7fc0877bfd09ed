#!/bin/sh
# Reads a terrain file by OpenEXR's own tools and Python package: parts and their names, sizes, channels and tiles as the
# layout says, and every height of level 0 against GDAL's reading of the DEM.
#
#   tools/check_openexr.sh [DEM]      (default: data/N42E001.hgt)
#
# Needs gdal-bin, openexr (exrinfo), and a python3 with the packages OpenEXR and numpy (PYTHON names another one).
set -eu
cd "$(dirname "$0")/.."
dem=$(realpath "${1:-data/N42E001.hgt}")
cargo build --release --quiet --no-default-features --features dem,cli
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
target/release/clipscape preprocess "$dem" -o "$work/t.terrain.exr" --no-light --quiet
# The status of version 3.1 means nothing: it differs from run to run, for files of OpenEXR's own making too. What it
# prints is looked at below.
exrinfo "$work/t.terrain.exr" > "$work/exrinfo" 2>&1 || true
gdal_translate -q -of ENVI -ot Float32 "$dem" "$work/raw"
${PYTHON:-python3} - "$work/t.terrain.exr" "$work/raw" "$work/exrinfo" <<'PYTHON'
import sys

import numpy
import OpenEXR

file, raw, told = sys.argv[1:]
parts = {part.name(): part for part in OpenEXR.File(file, separate_channels=True).parts}
height = parts["height.0"].channels["Y"].pixels
rows, columns = height.shape
levels = 1
while max(columns, rows) > 64:
    columns, rows = (columns + 2) // 2 if columns > 1 else 1, (rows + 2) // 2 if rows > 1 else 1
    levels += 1
rows, columns = height.shape
size = lambda n, l: -(-(n - 1) // 2**l) + 1
tiles = lambda n: -(-n // 256)
want = {}
patches = []
for l in range(levels):
    w, h = size(columns, l), size(rows, l)
    a, b = max(1, -(-(w - 1) // 8)), max(1, -(-(h - 1) // 8))
    want[f"height.{l}"] = ((h, w), {"Y": "float32"})
    want[f"bounds.{l}"] = ((b, a), dict.fromkeys("error max min need_error need_max need_min".split(), "float32"))
    want[f"check.{l}"] = ((tiles(h), tiles(w)), {"height": "uint32", "light": "uint32"})
    patches.append(tiles(a) * tiles(b))
want["check.bounds"] = ((levels, patches[0]), {"bounds": "uint32"})
assert sorted(parts) == sorted(want), (sorted(parts), sorted(want))
for name, (shape, channels) in want.items():
    part = parts[name]
    found = {c: str(v.pixels.dtype) for c, v in part.channels.items()}
    assert found == channels, (name, found)
    assert all(v.pixels.shape == shape for v in part.channels.values()), (name, shape)
    assert part.header["type"] == OpenEXR.Storage.tiledimage and part.header["compression"] == OpenEXR.ZIP_COMPRESSION
    tile = part.header["tiles"]
    assert (tile.xSize, tile.ySize) == (256, 256), name
    assert f": {name}\n" in open(told).read(), f"exrinfo does not name {name}"
truth = numpy.fromfile(raw, dtype="<f4").reshape(height.shape)
void = numpy.isnan(height)
assert numpy.array_equal(height[~void], truth[~void]), "heights differ from GDAL's"
for l in range(levels):
    b = parts[f"bounds.{l}"].channels
    assert not (b["min"].pixels > b["max"].pixels).any() and not (b["need_error"].pixels < b["error"].pixels).any(), l
print(f"{len(parts)} parts, {levels} levels, {height.size} heights the same as GDAL's, {void.sum()} of no data")
PYTHON
