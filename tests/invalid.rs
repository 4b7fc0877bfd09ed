//! Broken DEMs, each with one fault (`data/invalid`, made by `tools/make_invalid.py`): each is refused with the right kind
//! of error, in one line that names the file and what is wrong with it.
#![cfg(feature = "dem")]

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use clipscape::ErrorKind::{self, Broken, Device, Limit, Misuse, Unsupported};
use clipscape::grid::{Rect, Size};
use clipscape::source::{HeightSource, open};

/// Files and folders, kind, and a part of the message.
const CASES: &[(&str, ErrorKind, &str)] = &[
    ("tif-empty.tif", Broken, "is empty"),
    ("tif-is-text.tif", Broken, "is no TIFF"),
    ("tif-directory-beyond-end.tif", Broken, ""),
    ("tif-directory-cut.tif", Broken, ""),
    ("tif-no-width.tif", Broken, ""),
    ("tif-no-strip-offsets.tif", Broken, ""),
    ("tif-zero-width.tif", Broken, ""),
    ("tif-huge.tif", Limit, "claims"),
    ("tif-beyond-2-30-a-side.tif", Limit, "3221225472"),
    ("tif-strip-beyond-end.tif", Broken, ""),
    ("tif-deflate-damaged.tif", Broken, ""),
    ("tif-deflate-cut.tif", Broken, ""),
    ("tif-compression-unknown.tif", Unsupported, "60000"),
    ("tif-compression-jpeg.tif", Unsupported, "JPEG"),
    ("tif-complex.tif", Unsupported, "complex"),
    ("tif-33-bits.tif", Unsupported, "33"),
    ("tif-rotated.tif", Unsupported, "rotated"),
    ("tif-matrix-of-3-numbers.tif", Broken, "3 numbers"),
    ("tif-geocentric.tif", Unsupported, "geocentric"),
    ("tif-half-placed.tif", Broken, ""),
    ("tif-latitude-95.tif", Broken, "latitudes"),
    ("tif-2-bands.tif", Unsupported, "2 bands"),
    ("png-cut.png", Broken, "ends too early"),
    ("png-checksum.png", Broken, "CRC"),
    ("png-rows-missing.png", Broken, "not have enough data"),
    ("png-huge.png", Limit, "1073741824 x 1073741824"),
    ("png-palette.png", Unsupported, "palette"),
    ("png-rgb.png", Unsupported, "RGB"),
    ("png-4-bits.png", Unsupported, "4 bits"),
    ("png-is-gif.png", Broken, "is no PNG"),
    ("exr-cut.exr", Broken, ""),
    ("exr-header-cut.exr", Broken, ""),
    ("exr-no-height-channel.exr", Unsupported, "among A, B"),
    ("exr-lossy.exr", Unsupported, "with loss"),
    ("exr-huge.exr", Limit, "536870912 x 536870912"),
    ("exr-is-text.exr", Broken, "is no OpenEXR"),
    ("asc-no-rows.asc", Broken, "no nrows"),
    ("asc-values-missing.asc", Broken, "after 5 of 3 x 2"),
    ("asc-values-spare.asc", Broken, "line 8: \"7\""),
    ("asc-letters.asc", Broken, "line 8: \"five\""),
    ("asc-half-a-column.asc", Broken, "3.5"),
    ("asc-huge.asc", Broken, "97 bytes"),
    ("asc-no-cell-size.asc", Broken, "neither cellsize"),
    ("asc-zero-cell-size.asc", Broken, "0 x 0"),
    ("asc-two-widths.asc", Broken, "twice"),
    ("n43-no-uhl.dt0", Broken, "no UHL"),
    ("n43-no-acc.dt0", Broken, "no ACC"),
    ("n43-cut.dt0", Broken, "within column 2"),
    ("n43-column-of-another.dt0", Broken, "column 9 of 3"),
    ("n43-record-mark.dt0", Broken, "0x00"),
    ("n43-no-rows.dt0", Broken, "3 x 0"),
    ("n43-latitude-99.dt0", Broken, "latitudes"),
    ("N43W080.hgt", Broken, "1000 bytes"),
    ("hills.hgt.zip", Broken, "tell its place"),
    ("dem-header-cut.dem", Broken, "within its header"),
    ("dem-is-text.dem", Broken, "no USGS DEM"),
    ("dem-no-profile.dem", Broken, "no first profile"),
    ("dem-profiles-missing.dem", Broken, "within profile 2"),
    ("dem-99999-profiles.dem", Broken, "99999 profiles"),
    ("dem-letters.dem", Broken, "\"x\""),
    ("dem-no-step.dem", Broken, "steps of [0.0"),
    ("bil-short.bil", Broken, "need 12 bytes, it has 11"),
    ("bil-12-bits.bil", Unsupported, "12 bits"),
    ("bil-layout.bil", Broken, "BIX"),
    ("bil-rows-beyond-all.bil", Broken, "no whole number"),
    ("bil-3-bands.bil", Unsupported, "--band 1 to 3"),
    ("bil-header-of-what.bil", Unsupported, ".hdr"),
    ("bil-no-header.bil", Broken, ".hdr"),
    ("bil-short.hdr", Misuse, "header"),
    ("envi-short.bil", Broken, "need 12 bytes, it has 11"),
    ("envi-complex.bil", Unsupported, "data type 6"),
    ("envi-rotated.bil", Unsupported, "rotated"),
    ("raw-untold.r16", Misuse, "--raw"),
    ("zip-without-dem.zip", Unsupported, "without any DEM"),
    ("zip-of-two.zip", Unsupported, "a.asc and b.asc"),
    ("zip-in-zip.zip", Unsupported, "another archive"),
    ("zip-bzip2.zip", Unsupported, "Bzip2"),
    ("zip-of-broken.zip", Broken, "line 8: \"five\""),
    ("zip-cut.zip", Broken, "ZIP"),
    ("zip-damaged.zip", Broken, ""),
    ("zip-claims-2-gib.zip", Limit, "2147483647"),
    ("zip-encrypted.zip", Unsupported, "assword"),
    ("gz-cut.asc.gz", Broken, "unpacked"),
    ("gz-checksum.asc.gz", Broken, "checksum"),
    ("gz-without-dem.gz", Unsupported, "no DEM of a known format"),
    ("mosaic-off-grid", Unsupported, "b.asc: lies 3.300 steps"),
    (
        "mosaic-unplaced",
        Unsupported,
        "b.asc: does not say where it lies",
    ),
    ("mosaic-empty", Misuse, "without any DEM"),
];

fn folder() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/data/invalid"))
}

/// Opens a DEM and reads all of it, or the beginning of one that claims to be large.
fn read(path: &Path) -> clipscape::Result<Vec<f32>> {
    let source: Box<dyn HeightSource> = open(path)?;
    let Size { width, height } = source.description().grid.size;
    let rect = Rect::new(0, 0, width.min(1000), height.min(1000));
    let mut heights = vec![0.0; rect.area() as usize];
    source.read(rect, &mut heights)?;
    Ok(heights)
}

/// How a case is not refused as it should be, if so.
fn fault(name: &str, kind: ErrorKind, part: &str) -> Option<String> {
    let path = folder().join(name);
    let error = match read(&path) {
        Ok(heights) => return Some(format!("{name} is read: {:?}", &heights[..heights.len().min(9)])),
        Err(error) => error,
    };
    let line = error.to_string();
    let named = line.starts_with(&path.display().to_string());
    let right = error.kind() == kind && named && line.contains(part) && !line.contains('\n');
    (!right).then(|| format!("{name} is {:?}, not {kind:?} with {part:?}: {line}", error.kind()))
}

#[test]
fn each_fault_is_refused_as_what_it_is() {
    let faults: Vec<String> = CASES
        .iter()
        .filter_map(|(name, kind, part)| fault(name, *kind, part))
        .collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    // Control: another kind, or another message, would be noticed.
    let (name, kind, part) = CASES[0];
    assert!(fault(name, Device, part).is_some() && fault(name, kind, "is whole").is_some());
}

#[test]
fn no_broken_file_is_left_out() {
    let known: BTreeSet<&str> = CASES.iter().map(|(name, ..)| *name).collect();
    assert_eq!(known.len(), CASES.len(), "one stands there twice");
    for entry in fs::read_dir(folder()).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        assert!(
            name.ends_with(".hdr") || known.contains(name.as_str()),
            "{name} is in no case"
        );
    }
}

/// The files are broken by their faults alone: what they are made of is read.
#[test]
fn control_without_the_fault_they_are_read() {
    let grid = fs::read_to_string(folder().join("asc-values-spare.asc")).unwrap();
    let scratch = tempfile::tempdir().unwrap();
    let mend = |name: &str, bytes: &[u8]| {
        let path = scratch.path().join(name);
        fs::write(&path, bytes).unwrap();
        path
    };
    let whole = mend("a.asc", grid.replace(" 6 7", " 6").as_bytes());
    assert_eq!(read(&whole).unwrap(), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    let mut dted = fs::read(folder().join("n43-cut.dt0")).unwrap();
    dted.push(0xf0);
    assert!(read(&mend("n43.dt0", &dted)).is_ok());
    let mut bil = fs::read(folder().join("bil-short.bil")).unwrap();
    bil.push(0);
    mend("bil.hdr", &fs::read(folder().join("bil-short.hdr")).unwrap());
    assert!(read(&mend("bil.bil", &bil)).is_ok());
    let mut png = fs::read(folder().join("png-checksum.png")).unwrap();
    png[45] ^= 0x10;
    assert_eq!(read(&mend("a.png", &png)).unwrap(), [0.0; 16]);
    let mut tiff = fs::read(folder().join("tif-zero-width.tif")).unwrap();
    let width = tiff.windows(4).position(|w| w == [0, 1, 3, 0]).unwrap() + 8;
    tiff[width] = 4;
    assert_eq!(read(&mend("a.tif", &tiff)).unwrap()[..4], [0.0, 1.0, 2.0, 3.0]);
}
