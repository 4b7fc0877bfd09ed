#!/usr/bin/env python3
"""Makes the broken DEMs of data/invalid, each with one fault, which its name tells; tests/invalid.rs says how each is
refused. Nothing but Python's own library is needed, and the files are the same from run to run:

    python3 tools/make_invalid.py [FOLDER]
"""

import gzip
import io
import os
import struct
import sys
import zipfile
import zlib

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))

FILES = {}


def put(name, data):
    FILES[name] = data.encode() if isinstance(data, str) else bytes(data)


# GeoTIFF: a little-endian file of one directory, whose entries are (tag, type, values).

SHORT, LONG, RATIONAL, DOUBLE = 3, 4, 5, 12
FORMATS = {2: "c", SHORT: "H", LONG: "I", DOUBLE: "d"}


def tiff(changes=(), without=(), data=bytes(range(16)), data_offset=8, size=(4, 4)):
    """A 4 x 4 image of bytes in one strip, but for `changes` of its entries."""
    entries = {
        256: (SHORT, [size[0]]),
        257: (SHORT, [size[1]]),
        258: (SHORT, [8]),
        259: (SHORT, [1]),
        262: (SHORT, [1]),
        273: (LONG, [data_offset]),
        277: (SHORT, [1]),
        278: (SHORT, [size[1]]),
        279: (LONG, [len(data)]),
        339: (SHORT, [1]),
    }
    entries.update(dict(changes))
    for tag in without:
        del entries[tag]
    directory_at = 8 + len(data) + len(data) % 2
    body = data + bytes(len(data) % 2)
    extra_at = directory_at + 2 + 12 * len(entries) + 4
    directory, extra = struct.pack("<H", len(entries)), b""
    for tag, (kind, values) in sorted(entries.items()):
        packed = b"".join(struct.pack("<" + FORMATS[kind], v) for v in values)
        directory += struct.pack("<HHI", tag, kind, len(values))
        if len(packed) <= 4:
            directory += packed.ljust(4, b"\0")
        else:
            directory += struct.pack("<I", extra_at + len(extra))
            extra += packed
    return struct.pack("<2sHI", b"II", 42, directory_at) + body + directory + struct.pack("<I", 0) + extra


def geo_keys(*keys):
    values = [1, 1, 0, len(keys)]
    for key, value in keys:
        values += [key, 0, 1, value]
    return (SHORT, values)


def make_tiffs():
    put("tif-empty.tif", b"")
    put("tif-is-text.tif", "These are not the heights you are looking for.\n")
    put("tif-directory-beyond-end.tif", struct.pack("<2sHI", b"II", 42, 4000) + bytes(8))
    put("tif-directory-cut.tif", tiff()[:60])
    put("tif-no-width.tif", tiff(without=[256]))
    put("tif-no-strip-offsets.tif", tiff(without=[273]))
    put("tif-zero-width.tif", tiff([(256, (SHORT, [0]))]))
    huge = [(256, (LONG, [1 << 29])), (257, (LONG, [1 << 29])), (278, (LONG, [1 << 29])), (259, (SHORT, [8]))]
    put("tif-huge.tif", tiff(huge, data=zlib.compress(bytes(range(16)))))
    put("tif-beyond-2-30-a-side.tif", tiff([(256, (LONG, [3 << 30]))]))
    put("tif-strip-beyond-end.tif", tiff([(273, (LONG, [1 << 20]))]))
    put("tif-deflate-damaged.tif", tiff([(259, (SHORT, [8]))], data=b"\x78\x9c" + b"\xff" * 20))
    put("tif-deflate-cut.tif", tiff([(259, (SHORT, [8]))], data=zlib.compress(bytes(range(16)))[:9]))
    put("tif-compression-unknown.tif", tiff([(259, (SHORT, [60000]))]))
    put("tif-compression-jpeg.tif", tiff([(259, (SHORT, [7]))]))
    put("tif-complex.tif", tiff([(258, (SHORT, [32])), (339, (SHORT, [5]))], data=bytes(64)))
    put("tif-33-bits.tif", tiff([(258, (SHORT, [33]))], data=bytes(80)))
    put("tif-rotated.tif", tiff([(34264, (DOUBLE, [2, 1, 0, 9, 1, -2, 0, 9, 0, 0, 0, 0, 0, 0, 0, 1]))]))
    put("tif-matrix-of-3-numbers.tif", tiff([(34264, (DOUBLE, [2.0, 0.0, 0.0]))]))
    placed = [(33550, (DOUBLE, [1, 1, 0])), (33922, (DOUBLE, [0, 0, 0, 5, 50, 0]))]
    put("tif-geocentric.tif", tiff([*placed, (34735, geo_keys((1024, 3)))]))
    put("tif-half-placed.tif", tiff([(33550, (DOUBLE, [1, 1, 0]))]))
    off_earth = [(33550, (DOUBLE, [1, 1, 0])), (33922, (DOUBLE, [0, 0, 0, 5, 95, 0]))]
    put("tif-latitude-95.tif", tiff([*off_earth, (34735, geo_keys((1024, 2), (2048, 4326)))]))
    put("tif-2-bands.tif", tiff([(277, (SHORT, [2])), (258, (SHORT, [8, 8])), (339, (SHORT, [1, 1]))], data=bytes(32)))


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(width=4, height=4, depth=8, colour=0, rows=None):
    rows = bytes(height * (1 + width)) if rows is None else rows
    head = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def make_pngs():
    put("png-cut.png", png()[:50])
    flipped = bytearray(png())
    flipped[45] ^= 0x10
    put("png-checksum.png", flipped)
    put("png-rows-missing.png", png(rows=bytes(10)))
    put("png-huge.png", png(1 << 30, 1 << 30, rows=bytes(10)))
    put("png-palette.png", png(colour=3))
    put("png-rgb.png", png(colour=2, rows=bytes(4 * 13)))
    put("png-4-bits.png", png(depth=4, rows=bytes(4 * 3)))
    put("png-is-gif.png", b"GIF89a" + bytes(20))


def attribute(name, kind, value):
    return name + b"\0" + kind + b"\0" + struct.pack("<i", len(value)) + value


def exr(channels=(b"Y",), compression=0, window=(0, 0, 3, 1), rows=2, sampling=1):
    """Scan lines of f32 zeros."""
    entries = b"".join(n + b"\0" + struct.pack("<iBBBBii", 2, 0, 0, 0, 0, sampling, sampling) for n in channels)
    box = struct.pack("<iiii", *window)
    head = b"\x76\x2f\x31\x01" + struct.pack("<I", 2)
    head += attribute(b"channels", b"chlist", entries + b"\0")
    head += attribute(b"compression", b"compression", bytes([compression]))
    head += attribute(b"dataWindow", b"box2i", box) + attribute(b"displayWindow", b"box2i", box)
    head += attribute(b"lineOrder", b"lineOrder", b"\0")
    head += attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1))
    head += attribute(b"screenWindowCenter", b"v2f", bytes(8))
    head += attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1)) + b"\0"
    line = bytes(4 * 4 * len(channels))
    table_at, line_bytes = len(head), 8 + len(line)
    table = b"".join(struct.pack("<Q", table_at + 8 * rows + k * line_bytes) for k in range(rows))
    return head + table + b"".join(struct.pack("<ii", k, len(line)) + line for k in range(rows))


def make_exrs():
    put("exr-cut.exr", exr()[:-5])
    put("exr-header-cut.exr", exr()[:70])
    put("exr-no-height-channel.exr", exr([b"A", b"B"]))
    put("exr-lossy.exr", exr(compression=6))
    put("exr-huge.exr", exr(window=(0, 0, (1 << 29) - 1, (1 << 29) - 1)))
    put("exr-is-text.exr", "no picture\n")


GRID = "ncols 3\nnrows 2\nxllcorner 500000\nyllcorner 4000000\ncellsize 10\nNODATA_value -9999\n1 2 3\n4 5 6\n"


def make_grids():
    put("asc-no-rows.asc", GRID.replace("nrows 2\n", ""))
    put("asc-values-missing.asc", GRID.replace(" 6", ""))
    put("asc-values-spare.asc", GRID.replace(" 6", " 6 7"))
    put("asc-letters.asc", GRID.replace("5", "five", 2).replace("five00000", "500000"))
    put("asc-half-a-column.asc", GRID.replace("ncols 3", "ncols 3.5"))
    put("asc-huge.asc", GRID.replace("ncols 3", "ncols 1e12"))
    put("asc-no-cell-size.asc", GRID.replace("cellsize 10\n", ""))
    put("asc-zero-cell-size.asc", GRID.replace("cellsize 10", "cellsize 0"))
    put("asc-two-widths.asc", GRID.replace("nrows 2", "ncols 2"))


def dted(width=3, height=4):
    """A tile at 80 W, 43 N."""
    uhl = b"UHL10800000W0430000N03000300" + b" " * 19 + b"%04d%04d" % (width, height)
    data = uhl.ljust(80) + b"DSI".ljust(648) + b"ACC".ljust(2700)
    for x in range(width):
        record = struct.pack(">BxHHH", 0xAA, x, x, 0) + struct.pack(">%dh" % height, *range(height))
        data += record + struct.pack(">I", sum(record))
    return data


def changed(data, at, new):
    return data[:at] + new + data[at + len(new) :]


def make_tiles():
    put("n43-no-uhl.dt0", changed(dted(), 0, b"UHX"))
    put("n43-no-acc.dt0", changed(dted(), 728, b"XCC"))
    put("n43-cut.dt0", dted()[:-1])
    put("n43-column-of-another.dt0", changed(dted(), 3428 + 5, b"\x09"))
    put("n43-record-mark.dt0", changed(dted(), 3428, b"\x00"))
    put("n43-no-rows.dt0", changed(dted(), 51, b"0000"))
    put("n43-latitude-99.dt0", changed(dted(), 12, b"099"))
    put("N43W080.hgt", bytes(1000))
    archive("hills.hgt.zip", [("hills.hgt", bytes(2 * 1201 * 1201))])


def usgs_dem():
    head = bytearray(b" " * 1024)

    def field(at, text):
        head[at : at + len(text)] = text.encode()

    field(0, "A TEST")
    field(150, "     1     1    10")
    field(528, "     2     2     4")
    corners = [(1000, 2000), (1000, 2060), (1060, 2060), (1060, 2000)]
    for k, (x, y) in enumerate(corners):
        field(546 + 48 * k, "%24.6f%24.6f" % (x, y))
    field(816, "0.300000E+020.300000E+020.100000E+01     1     3")
    field(890, " 4")
    data = bytes(head)
    for k in range(3):
        profile = "     1%6d     3     1" % (k + 1)
        profile += "".join("%24.6f" % v for v in (1000 + 30 * k, 2000, 0, 0, 0)) + "     7     8     9"
        data += profile.encode().ljust(1024)
    return data


def make_dems():
    put("dem-header-cut.dem", usgs_dem()[:500])
    put("dem-is-text.dem", "A digital elevation model, but not one of the USGS.\n" * 30)
    put("dem-no-profile.dem", changed(usgs_dem(), 1024, b"     2"))
    put("dem-profiles-missing.dem", usgs_dem()[: 2 * 1024 + 100])
    put("dem-99999-profiles.dem", changed(usgs_dem(), 858, b" 99999"))
    put("dem-letters.dem", changed(usgs_dem(), 1024 + 144, b"     x"))
    put("dem-no-step.dem", changed(usgs_dem(), 816, b"0.000000E+02"))


HEADER = "NROWS 2\nNCOLS 3\nNBITS 16\nPIXELTYPE SIGNEDINT\nBYTEORDER I\nULXMAP 0\nULYMAP 0\nXDIM 10\nYDIM 10\n"
ENVI = "ENVI\nsamples = 3\nlines = 2\nbands = 1\ndata type = 2\nbyte order = 0\n"


def make_bare():
    for name, header, data in [
        ("bil-short", HEADER, bytes(11)),
        ("bil-12-bits", HEADER.replace("16", "12"), bytes(12)),
        ("bil-layout", HEADER + "LAYOUT BIX\n", bytes(12)),
        ("bil-rows-beyond-all", HEADER.replace("NROWS 2", "NROWS 99999999999999999999"), bytes(12)),
        ("bil-3-bands", HEADER + "NBANDS 3\n", bytes(36)),
        ("bil-header-of-what", "just some text\n", bytes(12)),
        ("envi-short", ENVI, bytes(11)),
        ("envi-complex", ENVI.replace("data type = 2", "data type = 6"), bytes(48)),
        ("envi-rotated", ENVI + "map info = {UTM, 1, 1, 0, 0, 10, 10, 11, North, rotation=30}\n", bytes(12)),
    ]:
        put(name + ".hdr", header)
        put(name + ".bil", data)
    put("bil-no-header.bil", bytes(12))
    put("raw-untold.r16", bytes(12))


def archive(name, files, method=zipfile.ZIP_DEFLATED):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as packed:
        for file, data in files:
            packed.writestr(zipfile.ZipInfo(file), data, method)
    put(name, out.getvalue())


def make_archives():
    archive("zip-without-dem.zip", [("readme.txt", b"nothing here")])
    archive("zip-of-two.zip", [("a.asc", GRID), ("b.asc", GRID)])
    archive("zip-in-zip.zip", [("a.tif", FILES["zip-without-dem.zip"])])
    archive("zip-bzip2.zip", [("a.asc", GRID)], zipfile.ZIP_BZIP2)
    archive("zip-of-broken.zip", [("a.asc", FILES["asc-letters.asc"])])
    archive("a.zip", [("a.asc", GRID * 3)])
    whole = FILES.pop("a.zip")
    put("zip-cut.zip", whole[:-20])
    at = whole.index(b"a.asc") + 5 + 10
    put("zip-damaged.zip", changed(whole, at, bytes([whole[at] ^ 0x55])))
    entry = whole.index(b"PK\x01\x02")
    put("zip-claims-2-gib.zip", changed(whole, entry + 24, struct.pack("<I", 0x7FFFFFFF)))
    encrypted = changed(whole, entry + 8, b"\x01\x00")
    put("zip-encrypted.zip", changed(encrypted, 6, b"\x01\x00"))
    packed = gzip.compress(GRID.encode(), mtime=0)
    put("gz-cut.asc.gz", packed[:-6])
    put("gz-checksum.asc.gz", changed(packed, len(packed) - 8, bytes([packed[-8] ^ 1])))
    put("gz-without-dem.gz", gzip.compress(b"nothing here", mtime=0))


def make_mosaics():
    put("mosaic-off-grid/a.asc", GRID)
    put("mosaic-off-grid/b.asc", GRID.replace("500000", "500033"))
    put("mosaic-unplaced/a.asc", GRID)
    put("mosaic-unplaced/b.asc", GRID.replace("xllcorner 500000\nyllcorner 4000000\n", ""))
    put("mosaic-empty/readme.txt", "No DEM is here.\n")


def main():
    folder = sys.argv[1] if len(sys.argv) > 1 else os.path.join(ROOT, "data", "invalid")
    for make in (make_tiffs, make_pngs, make_exrs, make_grids, make_tiles, make_dems, make_bare, make_archives, make_mosaics):
        make()
    for name, data in FILES.items():
        path = os.path.join(folder, name)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "wb") as file:
            file.write(data)
    print("%d files, %d bytes" % (len(FILES), sum(map(len, FILES.values()))))


if __name__ == "__main__":
    main()
