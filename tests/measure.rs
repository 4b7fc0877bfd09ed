//! `clipscape measure` as a user meets it: its files, what they agree on, and what it refuses.
#![cfg(all(feature = "gpu", feature = "cli"))]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

mod support;

const FLIGHT: &str = r#"{"fps": 4, "keys": [
  {"t": 0, "eye": [2000, 1500, 3000], "heading": 20, "pitch": -20},
  {"t": 1, "eye": [2600, 1400, 2500], "heading": 60, "pitch": -10}]}"#;

const FILES: [&str; 4] = [
    "report.html",
    "summary.json",
    "tradeoff.csv",
    "tradeoff.schema.json",
];

fn measure(folder: &Path, arguments: &str) -> Output {
    let base = "measure synth:200:3 --flight f.json --quiet --quick --size 64x48 --clip-size 64,128 --transition 1 \
        --levels none --filter point --rounds 1 --measured-frames 2";
    Command::new(env!("CARGO_BIN_EXE_clipscape"))
        .args(base.split_whitespace())
        .args(arguments.split_whitespace())
        .current_dir(folder)
        .output()
        .expect("the program starts")
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

fn says(output: &Output, status: i32, words: &[&str]) {
    let err = String::from_utf8(output.stderr.clone()).unwrap();
    assert_eq!(output.status.code(), Some(status), "{err}");
    assert_eq!(err.lines().count(), usize::from(status != 0), "{err}");
    for word in words {
        assert!(err.contains(word), "{err} should say {word}");
    }
}

#[test]
fn the_files_agree_and_nothing_is_replaced_unless_forced() {
    if support::gpu().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    fs::write(here.join("f.json"), FLIGHT).unwrap();
    says(&measure(here, "--max-error-px off,1 -o out"), 0, &[]);
    let out = here.join("out");
    assert_eq!(names(&out), FILES);

    let csv = fs::read_to_string(out.join("tradeoff.csv")).unwrap();
    let schema: serde_json::Value =
        serde_json::from_slice(&fs::read(out.join("tradeoff.schema.json")).unwrap()).unwrap();
    let mut lines = csv.lines();
    let heads: Vec<&str> = lines.next().unwrap().split(',').collect();
    let fields: Vec<&str> = schema["fields"]
        .as_array()
        .unwrap()
        .iter()
        .map(|f| f["name"].as_str().unwrap())
        .collect();
    assert_eq!(heads, fields);
    let rows: Vec<Vec<&str>> = lines.map(|l| l.split(',').collect()).collect();
    // Two clip sizes, each with and without a promise, one transition, one filter.
    assert_eq!(rows.len(), 6, "{csv}");
    let cell = |row: usize, name: &str| rows[row][heads.iter().position(|h| *h == name).unwrap()];
    let number = |row: usize, name: &str| cell(row, name).parse::<f64>().unwrap();
    for row in 0..rows.len() {
        assert_eq!(number(row, "cracks"), 0.0, "{csv}");
        assert!(
            number(row, "frame_ms_median") > 0.0
                && number(row, "frame_ms_p99") >= number(row, "frame_ms_median")
        );
        assert!(number(row, "terrain_px") > 100.0, "{csv}");
        assert!(number(row, "error_px_max") >= number(row, "error_px_p99"));
        assert!(
            number(row, "error_px_p99") >= 0.0 && number(row, "error_px_rms") <= number(row, "error_px_max")
        );
        if let Ok(certified) = cell(row, "certified_error_px").parse::<f64>() {
            assert!(number(row, "error_px_max") <= certified, "{csv}");
        }
    }
    assert!(rows.iter().enumerate().any(|(k, _)| cell(k, "pareto") == "true"));
    // A larger window and a promise: no fewer, and no more triangles.
    let triangles = |clip_size: &str, promise: &str| {
        let found = (0..rows.len()).find(|k| {
            cell(*k, "family") == "grid"
                && cell(*k, "clip_size") == clip_size
                && cell(*k, "max_error_px") == promise
        });
        number(found.unwrap(), "triangles_median")
    };
    assert!(triangles("128", "") > triangles("64", ""));
    assert!(triangles("128", "1") <= triangles("128", ""));

    let summary: serde_json::Value =
        serde_json::from_slice(&fs::read(out.join("summary.json")).unwrap()).unwrap();
    assert_eq!(summary["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(summary["settings"], 6);
    assert!(
        summary["flight_checksum"]
            .as_str()
            .unwrap()
            .starts_with("crc32c:")
    );
    assert!(summary["input_checksum"].is_null(), "it is no file");
    for line in summary["stability"].as_array().unwrap() {
        assert_eq!(line["holds"], true, "{line}");
    }
    assert_eq!(summary["stability"].as_array().unwrap().len(), 15);
    let costs = summary["storage"].as_array().unwrap();
    assert_eq!(costs[0]["change_m_max"], 0.0);
    assert!(costs[1]["change_m_max"].as_f64() > Some(0.0));
    let html = fs::read_to_string(out.join("report.html")).unwrap();
    assert!(html.contains("Which setting to use") && html.ends_with("</html>\n"));

    says(
        &measure(here, "--max-error-px off -o out"),
        1,
        &["out: has files in it already", "--force"],
    );
    assert_eq!(fs::read_to_string(out.join("tradeoff.csv")).unwrap(), csv);
    says(&measure(here, "--max-error-px off -o out --force"), 0, &[]);
    assert_ne!(fs::read_to_string(out.join("tradeoff.csv")).unwrap(), csv);
    assert_eq!(
        (names(&out), names(here)),
        (
            FILES.map(String::from).to_vec(),
            vec!["f.json".into(), "out".into()]
        )
    );
}

#[test]
fn what_cannot_be_measured_gets_one_line_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    fs::write(here.join("f.json"), FLIGHT).unwrap();
    fs::write(here.join("bad.json"), r#"{"keys": []}"#).unwrap();
    let program = |line: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_clipscape"));
        command
            .args(line.split_whitespace())
            .current_dir(here)
            .output()
            .unwrap()
    };
    for (line, status, words) in [
        ("measure a.hgt -o out", 2, &["--flight"][..]),
        ("measure a.hgt --flight f.json", 2, &["--output"]),
        ("measure a.hgt --flight none.json -o out", 1, &["none.json"]),
        ("measure a.hgt --flight bad.json -o out", 1, &["bad.json", "keys"]),
        (
            "measure a.hgt --flight f.json -o f.json",
            1,
            &["f.json", "folder"],
        ),
        ("measure a.hgt --flight f.json -o none/out", 1, &["none/out"]),
        (
            "measure a.hgt --flight f.json -o out --transition 900",
            1,
            &["900"],
        ),
        (
            "measure a.hgt --flight f.json -o out --max-error-px 0",
            1,
            &["promised"],
        ),
        (
            "measure a.hgt --flight f.json -o out --filter boxy",
            2,
            &["sinc-blackman"],
        ),
    ] {
        says(&program(line), status, words);
    }
    if support::gpu().is_some() {
        says(
            &program("measure a.hgt --flight f.json -o out"),
            1,
            &["a.hgt: no such file"],
        );
        let little = "measure synth:200 --flight f.json -o out --memory 1M";
        says(&program(little), 1, &["synth:200", "--memory"]);
    }
    assert_eq!(names(here), ["bad.json", "f.json"]);
}
