//! `render --wait none` of a DEM, and the files that it keeps, as a user meets them.
#![cfg(all(feature = "cli", feature = "gpu"))]

mod support;

use std::fs;
use std::path::Path;
use std::process::Command;

const DEM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/data/N42E001.hgt");

/// Runs the program, and returns standard output and error of a success.
fn done(folder: &Path, arguments: &[&str]) -> (String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_clipscape"))
        .args(arguments)
        .current_dir(folder)
        .env("CLIPSCAPE_CACHE", folder.join("cache"))
        .output()
        .expect("the program starts");
    let text = |bytes| String::from_utf8(bytes).expect("text");
    let (out, err) = (text(output.stdout), text(output.stderr));
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {err}");
    (out, err)
}

fn kept(folder: &Path) -> usize {
    fs::read_dir(folder.join("cache")).map_or(0, Iterator::count)
}

#[test]
fn a_dem_is_drawn_at_once_and_its_file_kept_listed_and_cleared() {
    if support::gpu().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let draw = |out: &str, more: &[&str]| {
        let common = ["render", DEM, "--size", "160x90", "--wait", "none", "-o", out];
        let (_, err) = done(folder, &[&common[..], more].concat());
        err
    };
    // Frames that wait keep nothing, nor does who is asked not to.
    done(folder, &["render", DEM, "--size", "160x90", "-o", "waited.png"]);
    let err = draw("none.png", &["--no-cache"]);
    assert!(err.contains("drafts") && !err.contains("kept as"), "{err}");
    assert_eq!(kept(folder), 0);
    assert_eq!(done(folder, &["cache", "list"]), (String::new(), String::new()));

    let err = draw("first.png", &["--stats", "first.jsonl"]);
    assert_eq!(err.matches("kept as").count(), 1, "{err}");
    assert_eq!(kept(folder), 1);
    let stats = fs::read_to_string(folder.join("first.jsonl")).unwrap();
    let frame = stats.lines().next().unwrap();
    for part in [
        "\"provisional\":true",
        "\"certified_error_px\":null",
        "\"certificate_reason\":\"what is drawn is provisional\"",
    ] {
        assert!(frame.contains(part), "{frame}");
    }
    let (list, _) = done(folder, &["cache", "list"]);
    assert!(
        list.lines().count() == 1 && list.contains("N42E001.hgt-"),
        "{list}"
    );

    // The next run opens it: its heights at least are there.
    let err = draw("second.png", &["--stats", "second.jsonl"]);
    assert!(!err.contains("kept as"), "{err}");
    let stats = fs::read_to_string(folder.join("second.jsonl")).unwrap();
    assert!(
        stats.lines().next().unwrap().contains("\"provisional\":false"),
        "{stats}"
    );

    let (_, err) = done(folder, &["cache", "clear"]);
    assert!(err.contains("1 file removed"), "{err}");
    assert_eq!(kept(folder), 0);
}
