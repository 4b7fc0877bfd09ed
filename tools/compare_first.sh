#!/bin/sh
# From the start of the program to its first frame of 1280x720 on disk, with `--wait none`: of DEMs as they are and an
# empty cache (at most 1.5 s), and of their terrain files (0.6 s). Then how that frame differs from the one that waits:
# its PSNR (at least 20 dB), and the pixels that show sky where that one shows ground, more than 2 pixels from its
# outline (none: crests of a draft may be a little lower, holes it has none).
#
#   tools/compare_first.sh [INPUT...]      (ROUNDS, default 3)
#
# Without an INPUT, the Sierra of ../shared/data as a GeoTIFF and as a folder of .hgt.zip; with FULL=1 also a GeoTIFF of
# 16384 x 16384 in strips of deflate that is made of it. A terrain file is taken as it is, a DEM is preprocessed without
# light too. Needs python3-gdal (PYTHON names a python that has it), unzip and gdal-bin where nothing is named. Exit status
# 1 where a limit is not kept.
set -eu
cd "$(dirname "$0")/.."
cargo build --release --quiet --no-default-features --features gpu,dem,cli
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
if [ $# -eq 0 ]; then
    sierra=../shared/data/sierra
    for zip in "$sierra"/*.zip; do unzip -qo "$zip" -d "$work/hgt"; done
    gdalbuildvrt -q "$work/sierra.vrt" "$work"/hgt/*.hgt
    gdal_translate -q "$work/sierra.vrt" "$work/sierra.tif"
    set -- "$work/sierra.tif" "$sierra"
    if [ "${FULL:-}" = 1 ]; then
        gdal_translate -q -ot Int16 -outsize 16384 16384 -r bilinear -co COMPRESS=DEFLATE -co PREDICTOR=2 \
            "$work/sierra.vrt" "$work/16384.tif"
        set -- "$@" "$work/16384.tif"
    fi
fi
for python in "${PYTHON:-python3}" /usr/bin/python3; do
    if "$python" -c "from osgeo import gdal, gdal_array" 2>/dev/null; then break; fi
done
ROUNDS=${ROUNDS:-3} "$python" - target/release/clipscape "$work" "$@" <<'PYTHON'
import math
import os
import shutil
import statistics
import subprocess
import sys
import time

import numpy as np
from osgeo import gdal

gdal.UseExceptions()
program, work, inputs = sys.argv[1], sys.argv[2], sys.argv[3:]
cache = f"{work}/cache"
environment = dict(os.environ, CLIPSCAPE_CACHE=cache)
failed = 0


def run(*arguments):
    subprocess.run([program, *arguments, "--quiet", "--force"], check=True, env=environment)


def picture(path):
    return gdal.Open(path).ReadAsArray()[:3].astype(np.int64)


def first_s(input, out):
    """Seconds until the frame is there; it appears whole. The process may live on, to keep what it builds."""
    shutil.rmtree(cache, ignore_errors=True)
    if os.path.exists(out):
        os.remove(out)
    command = [program, "render", input, "--wait", "none", "--quiet", "-o", out]
    start = time.monotonic()
    process = subprocess.Popen(command, env=environment)
    while not os.path.exists(out) and process.poll() is None:
        time.sleep(0.001)
    took = time.monotonic() - start
    if process.wait() != 0:
        sys.exit(f"{' '.join(command)} failed")
    return took


def grown(mask, reach):
    """The pixels that have one of the mask's within reach, diagonals included."""
    padded = np.pad(mask, reach)
    rows, columns = mask.shape
    shifts = range(2 * reach + 1)
    return np.any([padded[y:y + rows, x:x + columns] for y in shifts for x in shifts], axis=0)


def measure(input, whole, limit_s):
    global failed
    out = f"{work}/first.png"
    took = [first_s(input, out) for _ in range(int(os.environ["ROUNDS"]))]
    took_s = statistics.median(took)
    first = picture(out)
    run("render", whole, "--wait", "all", "-o", f"{work}/whole.png")
    mean = np.mean((first - picture(f"{work}/whole.png")) ** 2)
    psnr_db = 10 * math.log10(255**2 / mean) if mean else math.inf
    # Views of levels have no sky: what shows no ground is black.
    shutil.rmtree(cache, ignore_errors=True)
    run("render", input, "--wait", "none", "--view", "level", "-o", f"{work}/first_level.png")
    run("render", whole, "--wait", "all", "--view", "level", "-o", f"{work}/whole_level.png")
    sky, sky_whole = (picture(f"{work}/{name}_level.png").sum(axis=0) == 0 for name in ("first", "whole"))
    lower, holes = int((sky & ~sky_whole).sum()), int((sky & ~grown(sky_whole, 2)).sum())
    met = took_s <= limit_s and psnr_db >= 20 and holes == 0 and (~sky_whole).any()
    failed += not met
    print(
        f"{input}: first frame after {took_s:.2f} s (limit {limit_s} s; {', '.join(f'{t:.2f}' for t in took)}), "
        f"PSNR {psnr_db:.1f} dB, {holes} pixels of holes, {lower} beside the outline, of {int((~sky_whole).sum())} of "
        f"ground: {'met' if met else 'NOT met'}",
        flush=True,
    )


for k, input in enumerate(inputs):
    if input.endswith(".terrain.exr"):
        measure(input, input, 0.6)
        continue
    whole = f"{work}/{k}.terrain.exr"
    run("preprocess", input, "--no-light", "--memory", "4G", "-o", whole)
    measure(input, whole, 1.5)
    measure(whole, whole, 0.6)
sys.exit(1 if failed else 0)
PYTHON
