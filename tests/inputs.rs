//! What a user may name as a DEM and say of it: mosaics, folders, archives, crops, bands, bare samples.
#![cfg(all(feature = "cli", feature = "dem"))]
#![allow(clippy::print_stderr, reason = "what is skipped is said")]

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::Command;

use clipscape::grid::Rect;
use clipscape::progress::Silent;
use clipscape::source::{Crop, HeightSource, OpenOptions, open, open_with};
use serde_json::{Value, json};

fn run(folder: &Path, arguments: &[&str]) -> (i32, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_clipscape"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("the program starts");
    let text = |bytes| String::from_utf8(bytes).expect("text");
    (
        output.status.code().expect("no signal"),
        text(output.stdout),
        text(output.stderr),
    )
}

/// What `info --json` says.
fn info(folder: &Path, arguments: &[&str]) -> Value {
    let all = [&["info", "--json"], arguments].concat();
    let (status, out, err) = run(folder, &all);
    assert_eq!((status, err.as_str()), (0, ""), "{arguments:?}");
    serde_json::from_str(&out).expect("JSON")
}

/// A grid of 4 x 3 whose first sample lies at (x, 1000) with steps of 10, `height` of column and row.
fn grid(x: f64, height: impl Fn(i32, i32) -> i32) -> String {
    let mut text = format!("ncols 4\nnrows 3\nxllcenter {x}\nyllcenter 980\ncellsize 10\n");
    for row in 0..3 {
        let values: Vec<String> = (0..4).map(|column| height(column, row).to_string()).collect();
        text += &(values.join(" ") + "\n");
    }
    text
}

fn read(source: &dyn HeightSource) -> Vec<f32> {
    let rect = source.description().grid.size.rect();
    let mut out = vec![0.0; rect.area() as usize];
    source.read(rect, &mut out).unwrap();
    out
}

#[test]
fn files_and_folders_are_one_dem_and_disagreement_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let tiles = here.join("tiles");
    fs::create_dir(&tiles).unwrap();
    // They share a column, in which one sample of three differs.
    fs::write(tiles.join("a.asc"), grid(500.0, |x, z| x + 10 * z)).unwrap();
    fs::write(
        tiles.join("b.asc"),
        grid(530.0, |x, z| x + 3 + 10 * z + i32::from((x, z) == (0, 1))),
    )
    .unwrap();
    fs::write(tiles.join("notes.txt"), "not a tile").unwrap();
    for arguments in [&["tiles"][..], &["tiles/a.asc", "tiles/b.asc"]] {
        let info = info(here, arguments);
        assert_eq!(
            (&info["width"], &info["height"], &info["max"]),
            (&json!(7), &json!(3), &json!(26.0))
        );
        assert_eq!(
            (&info["origin"], &info["voids"]),
            (&json!([500.0, 1000.0]), &json!(0))
        );
        let noticed = info["noticed"][0].as_str().unwrap();
        assert!(
            noticed.starts_with("Of 3 samples that several tiles hold, 1 differ, by up to 1 m"),
            "{noticed}"
        );
    }
    let (status, _, err) = run(here, &["preprocess", "tiles", "--no-light"]);
    assert_eq!(status, 0, "{err}");
    assert!(
        err.contains("tiles: Of 3 samples") && here.join("tiles.terrain.exr").exists(),
        "{err}"
    );
    // What was made lies beside the folder; inside it would be no tile either.
    fs::copy(here.join("tiles.terrain.exr"), tiles.join("x.terrain.exr")).unwrap();
    assert_eq!(info(here, &["tiles"])["width"], 7);
    let heights = read(
        open_with(
            &[tiles.join("b.asc"), tiles.join("a.asc")],
            &OpenOptions::default(),
        )
        .unwrap()
        .as_ref(),
    );
    assert_eq!(heights[7 + 3], 13.0, "the later file wins");
    let (status, _, err) = run(
        here,
        &[
            "preprocess",
            "tiles",
            "--no-light",
            "--force",
            "-o",
            "tiles/a.asc",
        ],
    );
    assert_eq!(status, 1);
    assert!(err.contains("is an input"), "{err}");
}

#[test]
fn crops_keep_samples_and_places() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    fs::write(here.join("a.asc"), grid(500.0, |x, z| x + 10 * z)).unwrap();
    for arguments in [&["--srcwin", "1,1,2,2"][..], &["--projwin", "510,990,520,980"]] {
        let info = info(here, &[&["a.asc"], arguments].concat());
        assert_eq!(
            (
                &info["width"],
                &info["height"],
                &info["origin"],
                &info["min"],
                &info["max"]
            ),
            (
                &json!(2),
                &json!(2),
                &json!([510.0, 990.0]),
                &json!(11.0),
                &json!(22.0)
            )
        );
    }
    for (arguments, says) in [
        (&["--srcwin", "3,1,2,2"][..], "has 4 x 3 samples"),
        (&["--projwin", "0,10,10,0"], "has no sample within"),
        (&["--nodata", "x"], "not a number"),
        (&["--band", "2"], "has no band 2"),
        (&["--raw", "2x2:int16"], "give its true size"),
    ] {
        let (status, out, err) = run(here, &[&["info", "a.asc"], arguments].concat());
        assert!(
            status > 0 && out.is_empty() && err.lines().count() == 1,
            "{arguments:?}: {err}"
        );
        assert!(err.contains(says), "{err} lacks {says}");
    }
    // A crop of procedural terrain is what the whole has there, and keeps its indices.
    let options = OpenOptions {
        crop: Some(Crop::Samples(Rect::new(3, 5, 9, 11))),
        ..OpenOptions::default()
    };
    let part = open_with(&["synth:64:3"], &options).unwrap();
    let whole = open(Path::new("synth:64:3")).unwrap();
    let mut wanted = vec![0.0; 36];
    whole.read(Rect::new(3, 5, 9, 11), &mut wanted).unwrap();
    assert_eq!(
        (read(part.as_ref()), part.description().grid.offset),
        (wanted, [3, 5])
    );
    let (status, _, err) = run(here, &["info", "synth:64:3", "--nodata", "0"]);
    assert!(status == 1 && err.contains("--nodata"), "{err}");
    let (status, _, err) = run(
        here,
        &[
            "preprocess",
            "a.asc",
            "--srcwin",
            "0,0,2,2",
            "--no-light",
            "--quiet",
        ],
    );
    assert_eq!((status, err.as_str()), (0, ""));
    assert_eq!(info(here, &["a.terrain.exr"])["width"], 2);
    let (status, _, err) = run(here, &["info", "a.terrain.exr", "--srcwin", "0,0,1,1"]);
    assert!(status == 1 && err.contains("fixed"), "{err}");
}

#[test]
fn archives_and_bare_samples_are_read_as_what_they_hold() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let text = grid(500.0, |x, z| if (x, z) == (0, 0) { -9999 } else { x + 10 * z });
    let mut writer = zip::ZipWriter::new(fs::File::create(here.join("a.zip")).unwrap());
    writer
        .start_file("deep/a.asc", zip::write::SimpleFileOptions::default())
        .unwrap();
    writer.write_all(text.as_bytes()).unwrap();
    writer.finish().unwrap();
    let mut writer = flate2::write::GzEncoder::new(
        fs::File::create(here.join("a.asc.gz")).unwrap(),
        Default::default(),
    );
    writer.write_all(text.as_bytes()).unwrap();
    writer.finish().unwrap();
    for file in ["a.zip", "a.asc.gz"] {
        let info = info(here, &[file]);
        assert_eq!(
            (&info["format"], &info["min"]),
            (&json!("ESRI ASCII"), &json!(-9999.0))
        );
        let noticed = info["noticed"][0].as_str().unwrap();
        assert!(
            noticed.starts_with("1 sample is -9999, which looks like no data"),
            "{noticed}"
        );
    }
    let info_with = info(here, &["a.zip", "--nodata", "-9999", "--spacing", "5,6"]);
    assert_eq!(
        (&info_with["voids"], &info_with["spacing"]),
        (&json!(1), &json!([5.0, 6.0]))
    );
    assert_eq!(info_with["noticed"], json!([]));

    let samples: Vec<u8> = (0..6i16).flat_map(|v| (v - 2).to_be_bytes()).collect();
    fs::write(here.join("a.raw"), samples).unwrap();
    let raw = info(here, &["a.raw", "--raw", "3x2:int16be"]);
    assert_eq!(
        (&raw["width"], &raw["min"], &raw["max"]),
        (&json!(3), &json!(-2.0), &json!(3.0))
    );
    let (status, _, err) = run(here, &["info", "a.raw"]);
    assert!(status == 1 && err.contains("--raw"), "{err}");
}

/// The forty packed tiles of the Sierra are one DEM whose missing tiles are no data; each sample is that of the last tile
/// that has it. Skipped where the data are not there.
#[test]
fn a_folder_of_srtm_tiles_is_one_dem() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/sierra");
    if !folder.is_dir() {
        eprintln!("skipped: {} is not there", folder.display());
        return;
    }
    let mosaic = open(&folder).unwrap();
    let size = mosaic.description().grid.size;
    assert_eq!((size.width, size.height), (13201, 4801));
    assert_eq!(
        mosaic.description().place.as_ref().unwrap().origin,
        [-125.0, 40.0]
    );
    // The corner where N36W118, N36W119, N37W118 and N37W119 meet: the last in order is N37W119.
    let mut corner = [0.0];
    mosaic
        .read(
            Rect::new(7 * 1200, 3 * 1200, 7 * 1200 + 1, 3 * 1200 + 1),
            &mut corner,
        )
        .unwrap();
    let last = open(&folder.join("N37W119.hgt.zip")).unwrap();
    let mut own = [0.0];
    last.read(Rect::new(1200, 1200, 1201, 1201), &mut own).unwrap();
    assert_eq!(corner, own);
    // N37W125 is missing, but for the rows and columns that its neighbours share.
    let mut ocean = vec![0.0; 1199 * 1199];
    mosaic.read(Rect::new(1, 2401, 1200, 3600), &mut ocean).unwrap();
    assert!(ocean.iter().all(|h| h.is_nan()));
    let remarks = mosaic.remarks(&Silent).unwrap();
    assert!(
        remarks.iter().any(|r| r.contains("differ, by up to 1 m")),
        "{remarks:?}"
    );
}
