#!/bin/sh
# Exports DEMs and checks by GDAL's reading that what comes out lies over its source: level 0 sample by sample and in
# place, coarser levels with their first sample where the source's is, and the error of a level against both.
#
#   tools/check_export.sh [FILE...]      (the DEMs of ../shared/data, where none is named)
#
# Needs gdal-bin and python3-gdal; PYTHON names a python that has it. Prints a line a check; exit status 1 if one fails.
set -eu
cd "$(dirname "$0")/.."
cargo build --release --no-default-features --features dem,cli
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
if [ $# -eq 0 ]; then
    data=../shared/data
    set -- "$data/small/lf_elev_220_mt_hood_utm.tif" "$data/small/N42E001.hgt" "$data/odd/grs-dem-hills.tiff" \
        "$data/odd/gr-south-up.tif" "$data/odd/gdal-byte_point.tif" "$data/odd/gdal-float64.tif" \
        "$data/odd/ms-int32.tif" "$data/odd/gdal-nodata_byte.tif" "$data/odd/gdal-test_with_mask_1bit.tif" \
        "$data/odd/gdal-tiff_vertcs_scale_offset.tif"
fi
for python in "${PYTHON:-python3}" /usr/bin/python3; do
    if "$python" -c "from osgeo import gdal, gdal_array" 2>/dev/null; then break; fi
done
"$python" - target/release/clipscape "$work" "$@" <<'PYTHON'
import subprocess
import sys

import numpy as np
from osgeo import gdal

gdal.UseExceptions()
program, work, files = sys.argv[1], sys.argv[2], sys.argv[3:]
failed = 0


def check(file, what, good, found=""):
    global failed
    failed += not good
    print("ok    " if good else "FAILED", file, what, found)


def export(file, part, level):
    out = f"{work}/{part}{level}.tif"
    command = [program, "export", file, "--part", part, "--level", str(level), "-o", out, "--force", "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(command)}: {done.stderr}")
    return gdal.Open(out)


def read(dataset):
    """Heights of the first band, NaN for no data, and the place of pixel corners; rows from north to south."""
    band = dataset.GetRasterBand(1)
    heights = band.ReadAsArray().astype(np.float64)
    heights[band.GetMaskBand().ReadAsArray() == 0] = np.nan
    place = list(dataset.GetGeoTransform())
    if place[5] > 0:
        heights = heights[::-1]
        place[3], place[5] = place[3] + dataset.RasterYSize * place[5], -place[5]
    return heights, place


def same(a, b):
    return ((a == b) | (np.isnan(a) & np.isnan(b))).all()


def centre(place):
    return np.array([place[0] + 0.5 * place[1], place[3] + 0.5 * place[5]])


for file in files:
    source = gdal.Open(file)
    truth, place = read(source)
    pixel = np.array([place[1], place[5]])
    dataset = export(file, "height", 0)
    heights, at = read(dataset)
    check(file, "level 0 has the source's samples", same(heights, truth), f"{truth.size} samples")
    if source.GetGeoTransform(can_return_null=True) is None:
        continue
    shift = np.abs(np.array(at) - place).max() / np.abs(pixel).min()
    check(file, "level 0 lies where the source lies", shift < 1e-7, f"{shift:.1e} pixels")
    here, there = dataset.GetSpatialRef(), source.GetSpatialRef()
    if there is not None and there.GetAuthorityCode(None):
        options = ["IGNORE_DATA_AXIS_TO_SRS_AXIS_MAPPING=YES", "CRITERION=EQUIVALENT"]
        equal = here is not None and here.IsSame(there, options) == 1
        check(file, "has the source's reference system", equal, there.GetName())
    point = [d.GetMetadataItem("AREA_OR_POINT") for d in (source, dataset)]
    check(file, "has the source's registration", point[0] in (point[1], None), point[1])
    levels = 1
    while max(truth.shape) > 64 << (levels - 1) and levels < 3:
        levels += 1
    for level in range(1, levels):
        coarse, at = read(export(file, "height", level))
        shift = np.abs((centre(at) - centre(place)) / pixel).max()
        ratio = np.abs(np.array([at[1], at[5]]) / pixel / 2**level - 1).max()
        good = shift < 1e-7 and ratio < 1e-12
        check(file, f"level {level} begins where the source does, {2**level} times as wide", good, f"{shift:.1e} pixels")
        error, at = read(export(file, "error", level))
        shift = np.abs(np.array(at) - place).max() / np.abs(pixel).min()
        check(file, f"the error of level {level} lies over the source", shift < 1e-7 and error.shape == truth.shape)
        # At samples that both have, the level's surface is its sample.
        step = 2**level
        own = truth[::step, ::step]
        want = coarse[: own.shape[0], : own.shape[1]] - own
        got = error[::step, ::step]
        both = ~np.isnan(got)
        worst = np.abs(got - want)[both].max() if both.any() else 0.0
        room = 1e-6 * np.nanmax(np.abs(own)) if both.any() else 0.0
        good = worst <= room and (both == ~np.isnan(want)).all()
        check(file, f"the error of level {level} is its height less the source's", good, f"{worst:.1e} m at most")
        moved = np.abs(got - np.roll(want, 1, axis=1))[both & ~np.isnan(np.roll(want, 1, axis=1))]
        if moved.size > 1 and np.nanmax(np.abs(want)) > room:
            check(file, "a shift of one sample would be seen", moved.max() > room)
sys.exit(1 if failed else 0)
PYTHON
