//! What is typed, and what is said of it.

use std::fs;
use std::process::Stdio;

use crate::{done, fails, names, program};

#[test]
fn help_and_version_go_to_standard_output() {
    let folder = tempfile::tempdir().unwrap();
    let help = done(folder.path(), &["--help"]);
    for command in [
        "info",
        "preprocess",
        "Exit status: 0 done, 1 could not, 2 usage, 130 interrupted",
    ] {
        assert!(help.contains(command), "{help}");
    }
    assert!(done(folder.path(), &["preprocess", "--help"]).contains("--sky-directions"));
    assert!(done(folder.path(), &["info", "--help"]).contains("--verify"));
    assert_eq!(
        done(folder.path(), &["--version"]),
        format!("clipscape {}\n", env!("CARGO_PKG_VERSION"))
    );
}

#[test]
fn a_wrong_usage_is_status_2_and_one_line() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, says) in [
        (&[][..], "no command"),
        (&["flyy"], "unrecognized subcommand 'flyy'"),
        (&["info"], "<INPUT>"),
        (&["info", "a.tif", "--jsn"], "did you mean --json?"),
        (&["preprocess", "a.tif", "--sun", "10,100"], "-90 to 90"),
        (&["preprocess", "a.tif", "--memory", "lots"], "512M"),
        (
            &["preprocess", "a.tif", "--filter", "lanczos"],
            "did you mean lanczos3?",
        ),
        (
            &["preprocess", "a.tif", "--sky-directions", "-1"],
            "--sky-directions",
        ),
        (
            &["preprocess", "a.tif", "--no-light", "--sun", "10,10"],
            "cannot be used with",
        ),
    ] {
        fails(folder.path(), 2, arguments, &[says]);
    }
    assert!(names(folder.path()).is_empty());
}

#[test]
fn inputs_that_are_none_get_one_line_and_leave_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    fs::write(
        here.join("text.tif"),
        "These are not the heights you are looking for.\n",
    )
    .unwrap();
    fs::write(here.join("empty.tif"), "").unwrap();
    for command in ["info", "preprocess"] {
        fails(here, 1, &[command, "none.tif"], &["none.tif: no such file"]);
        fails(here, 1, &[command, "text.tif"], &["text.tif: "]);
        fails(here, 1, &[command, "empty.tif"], &["empty.tif: "]);
        fails(here, 1, &[command, "synth:0"], &["synth:0"]);
        fails(here, 1, &[command, "."], &["./empty.tif: is empty"]);
    }
    assert_eq!(names(here), ["empty.tif", "text.tif"]);
}

#[cfg(feature = "dem")]
#[test]
fn a_tiff_that_ends_too_early_gets_one_line_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    done(here, &["synth", "300:7", "-o", "a.tif", "--quiet"]);
    let whole = fs::read(here.join("a.tif")).unwrap();
    for left in [whole.len() / 2, whole.len() - 1, 100, 8, 5] {
        fs::write(here.join("cut.tif"), &whole[..left]).unwrap();
        fails(
            here,
            1,
            &["preprocess", "cut.tif", "--no-light", "--quiet"],
            &["cut.tif: "],
        );
        fails(here, 1, &["info", "cut.tif"], &["cut.tif: "]);
    }
    assert_eq!(names(here), ["a.tif", "cut.tif"]);
    done(here, &["preprocess", "a.tif", "--no-light", "--quiet"]);
    assert_eq!(
        names(here),
        ["a.terrain.exr", "a.tif", "cut.tif"],
        "control: the whole one gives a file"
    );
}

#[test]
fn a_reader_that_stops_reading_is_no_failure() {
    let folder = tempfile::tempdir().unwrap();
    for arguments in [&["--help"][..], &["info", "synth:64"]] {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let mut command = program();
        command
            .args(arguments)
            .current_dir(folder.path())
            .stdout(writer)
            .stderr(Stdio::piped());
        let output = command.spawn().unwrap().wait_with_output().unwrap();
        let err = String::from_utf8(output.stderr).unwrap();
        assert_eq!(
            (output.status.code(), err.as_str()),
            (Some(0), ""),
            "{arguments:?}"
        );
    }
}
