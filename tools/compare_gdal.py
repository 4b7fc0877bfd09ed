#!/usr/bin/env python3
"""Compares every sample of DEMs with what GDAL reads of the same files, and watches time and memory.

    python3 tools/compare_gdal.py [FILE|FOLDER ...]

A folder stands for the files in it, a folder given as FOLDER/ (with the slash) for the mosaic of them, which is compared
with GDAL's virtual raster of the same files. Without arguments: ../shared/data/small and ../shared/data/odd. Needs GDAL's
Python bindings and numpy (Debian: python3-gdal) and builds the example `heights`, unless CLIPSCAPE_HEIGHTS names it.

A sample agrees if it is GDAL's raw value times its scale, plus its offset, in metres, less our base height, rounded once
to f32; of texts, scales and units, which GDAL itself rounds to f32, if it is one such rounding away. Samples equal to the
no-data value, masked or not finite must be void in both. A file that is refused must be so in one line, within the time.
The exit status is 1 if any sample differs, a message has several lines, or a limit is exceeded.
"""

import os
import subprocess
import sys
import tempfile

import numpy
from osgeo import gdal

gdal.UseExceptions()
gdal.PushErrorHandler("CPLQuietErrorHandler")

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
SECONDS = 20
FREE_BYTES = 64 << 20
UNITS_M = {"ft": 0.3048, "foot": 0.3048, "US survey foot": 1200 / 3937, "us-ft": 1200 / 3937}
SIDECARS = (".hdr", ".prj", ".tsv", ".md", ".xml")


def binary():
    built = os.environ.get("CLIPSCAPE_HEIGHTS")
    if built:
        return built
    command = "cargo build --quiet --release --no-default-features --features dem --example heights"
    subprocess.run(command.split(), cwd=ROOT, check=True)
    target = os.environ.get("CARGO_TARGET_DIR", os.path.join(ROOT, "target"))
    return os.path.join(target, "release", "examples", "heights")


# A process's greatest memory counts that of the one it was forked from: a small one forks, and prints status and bytes.
RUNNER = """
import resource, subprocess, sys
address, seconds, program = int(sys.argv[1]), float(sys.argv[2]), sys.argv[3:]
limit = lambda: resource.setrlimit(resource.RLIMIT_AS, (address, address))
try:
    status = subprocess.run(program, timeout=seconds, preexec_fn=limit).returncode
except subprocess.TimeoutExpired:
    status = "slow"
print()
print(status, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024)
"""


class Ran:
    """One run of the example: its heights, or why there are none; its greatest memory in bytes."""

    def __init__(self, program, inputs, band, address_bytes):
        with tempfile.NamedTemporaryFile() as out:
            arguments = [program, out.name, *inputs] + (["--band", str(band)] if band else [])
            runner = [sys.executable, "-c", RUNNER, str(address_bytes), str(SECONDS)]
            ran = subprocess.run(runner + arguments, capture_output=True, text=True, errors="replace", check=True)
            *said, last = ran.stdout.strip().splitlines()
            status, peak = last.split()
            self.slow = status == "slow"
            self.status = None if self.slow else int(status)
            self.peak_bytes = int(peak)
            self.error = ran.stderr.rstrip("\n")
            self.heights = None
            if self.status == 0:
                width, height, base, _ = said[0].split(" ", 3)
                self.base = float(base)
                self.heights = numpy.fromfile(out.name, dtype="<f8").reshape(int(height), int(width))


def gdal_open(inputs):
    """GDAL's dataset of the inputs, or what it says."""
    try:
        if len(inputs) > 1:
            return gdal.BuildVRT("", inputs), ""
        name = inputs[0]
        if name.endswith(".gz"):
            name = "/vsigzip/" + name
        return gdal.Open(name), ""
    except RuntimeError as error:
        return None, str(error).splitlines()[0]


def gdal_metres(dataset, number):
    """GDAL's samples as metres, NaN for no data, rows from the north; whether they are exact."""
    band = dataset.GetRasterBand(number)
    raw = band.ReadAsArray()
    void = numpy.zeros(raw.shape, bool)
    if raw.dtype.kind == "f":
        void |= ~numpy.isfinite(raw)
    nodata = band.GetNoDataValue()
    if nodata is not None and nodata == nodata:
        void |= raw == raw.dtype.type(nodata) if raw.dtype.kind == "f" else raw == nodata
    if band.GetMaskFlags() & gdal.GMF_PER_DATASET and not band.GetMaskFlags() & gdal.GMF_ALPHA:
        void |= band.GetMaskBand().ReadAsArray() == 0
    scale, offset = band.GetScale() or 1.0, band.GetOffset() or 0.0
    unit = UNITS_M.get(band.GetUnitType(), 1.0)
    metres = (raw.astype("f8") * scale + offset) * unit
    metres[void] = numpy.nan
    if dataset.GetGeoTransform()[5] > 0 and dataset.GetGeoTransform() != (0, 1, 0, 0, 0, 1):
        metres = metres[::-1]
    text = dataset.GetDriver().ShortName in ("AAIGrid", "USGSDEM")
    return metres, scale == 1 and offset == 0 and unit == 1 and not text


def agree(ran, metres, exact):
    """What differs, as a phrase; empty if nothing does."""
    if ran.heights.shape != metres.shape:
        return "%s samples, GDAL has %s" % (ran.heights.shape[::-1], metres.shape[::-1])
    with numpy.errstate(all="ignore"):
        less = metres - ran.base
        wanted = less.astype("f4")
        # What lies beyond f32 is void.
        wanted[~numpy.isfinite(wanted)] = numpy.nan
        got = (ran.heights - ran.base).astype("f4")
        slack = 0 if exact else numpy.spacing(numpy.maximum(abs(wanted), abs(metres.astype("f4"))))
        wrong = ~(abs(got.astype("f8") - wanted) <= slack) & ~(numpy.isnan(got) & numpy.isnan(wanted))
    count = int(wrong.sum())
    if count == 0:
        return ""
    z, x = (int(v[0]) for v in numpy.nonzero(wrong))
    return "%d samples differ, as column %d, row %d: %r, GDAL has %r" % (count, x, z, ran.heights[z, x], metres[z, x])


def check(program, label, inputs):
    """Compares one DEM, each of its bands; returns the number of faults."""
    dataset, refusal = gdal_open(inputs)
    bands = dataset.RasterCount if dataset else 1
    faults = 0
    for number in range(1, bands + 1):
        band = number if bands > 1 else None
        claim = 0
        if dataset:
            sample = gdal.GetDataTypeSize(dataset.GetRasterBand(1).DataType) // 8
            claim = dataset.RasterXSize * dataset.RasterYSize * bands * sample
        length = sum(os.path.getsize(i) for i in inputs)
        limit = FREE_BYTES + 4 * min(claim, 1000 * length)
        ran = Ran(program, inputs, band, limit + (256 << 20))
        name = label if band is None else "%s band %d" % (label, number)
        memory = "%.0f of %.0f MiB" % (ran.peak_bytes / 2**20, limit / 2**20)
        if ran.slow or ran.peak_bytes > limit or ran.status not in (0, 1):
            verdict = "FAULT   status %s, %s%s" % (ran.status, memory, ", slow" if ran.slow else "")
        elif ran.status == 1:
            one = ran.error.count("\n") == 0 and ran.error != ""
            verdict = ("refused " if one else "FAULT   ") + ran.error
        elif dataset is None:
            verdict = "read    (GDAL does not: %s)" % refusal[:60]
        else:
            try:
                metres, exact = gdal_metres(dataset, number)
                difference = agree(ran, metres, exact)
                verdict = "FAULT   " + difference if difference else "equal   %d samples" % metres.size
                if not difference and not exact:
                    verdict += " to f32 rounding"
            except RuntimeError as error:
                verdict = "read    (GDAL fails: %s)" % str(error).splitlines()[0][:60]
        faults += verdict.startswith("FAULT")
        print("%-60s %s" % (name[-60:], verdict))
    return faults


def cases(arguments):
    for argument in arguments:
        if argument.endswith("/"):
            names = sorted(n for n in os.listdir(argument) if not n.endswith(SIDECARS))
            yield argument, [os.path.join(argument, n) for n in names]
        elif os.path.isdir(argument):
            for name in sorted(os.listdir(argument)):
                if not name.endswith(SIDECARS):
                    yield name, [os.path.join(argument, name)]
        else:
            yield argument, [argument]


def main():
    data = os.path.join(ROOT, "..", "shared", "data")
    arguments = sys.argv[1:] or [os.path.join(data, "small"), os.path.join(data, "odd")]
    program = binary()
    faults = sum([check(program, label, inputs) for label, inputs in cases(arguments)])
    print("%d faults" % faults)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
