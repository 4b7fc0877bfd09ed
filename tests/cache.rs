//! `render --wait none` of a DEM, and the files that it keeps, as a user meets them.
#![cfg(all(feature = "cli", feature = "gpu"))]

mod support;

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const DEM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/data/N42E001.hgt");

/// The program with these arguments, in a folder with a cache of its own.
fn program(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_clipscape"));
    command
        .args(arguments)
        .current_dir(folder)
        .env("CLIPSCAPE_CACHE", folder.join("cache"));
    command
}

/// Runs the program, and returns standard output and error of a success.
fn done(folder: &Path, arguments: &[&str]) -> (String, String) {
    let output = program(folder, arguments).output().expect("the program starts");
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

/// Whether the frame in a file of statistics was drawn from a draft.
fn was_draft(folder: &Path, stats: &str) -> bool {
    let stats = fs::read_to_string(folder.join(stats)).unwrap();
    stats.lines().next().unwrap().contains("\"provisional\":true")
}

#[test]
fn two_processes_on_one_dem_do_not_harm_each_other() {
    if support::gpu().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let draw = |name: &str| {
        let (out, stats) = (format!("{name}.png"), format!("{name}.jsonl"));
        let arguments = [
            "render", DEM, "--size", "160x90", "--wait", "none", "--stats", &stats, "-o", &out,
        ];
        let mut command = program(folder, &arguments);
        command
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts")
    };
    let both = [draw("first"), draw("second")].map(|child| child.wait_with_output().unwrap());
    for output in both {
        let err = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(0), "{err}");
        assert!(err.lines().all(|line| !line.contains("nothing is kept")), "{err}");
    }
    let pictures = ["first.png", "second.png"].map(|name| fs::read(folder.join(name)).unwrap());
    let drafts = ["first.jsonl", "second.jsonl"].map(|stats| was_draft(folder, stats));
    assert!(
        drafts != [true; 2] || pictures[0] == pictures[1],
        "both are of the same draft"
    );
    assert_eq!(kept(folder), 1, "one file, and nothing unfinished");
    // What they have left is whole.
    assert!(draw("third").wait().unwrap().success());
    assert!(drafts != [false; 2] && !was_draft(folder, "third.jsonl"));
    for entry in fs::read_dir(folder.join("cache")).unwrap() {
        let path = entry.unwrap().path();
        done(folder, &["info", path.to_str().unwrap(), "--verify"]);
    }
}

#[test]
fn what_a_killed_run_left_half_written_is_built_again() {
    if support::gpu().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let arguments = [
        "render", DEM, "--size", "160x90", "--wait", "none", "--force", "--stats", "s.jsonl",
    ];
    let mut child = program(folder, &arguments).stderr(Stdio::null()).spawn().unwrap();
    let start = Instant::now();
    while kept(folder) == 0 && child.try_wait().unwrap().is_none() {
        assert!(start.elapsed() < Duration::from_secs(120), "nothing is built");
        std::thread::sleep(Duration::from_micros(200));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    // Under its name there is nothing that is not whole: the next run draws that, or builds it.
    done(folder, &arguments);
    done(folder, &arguments);
    assert!(!was_draft(folder, "s.jsonl"));
    assert_eq!(kept(folder), 1, "what was left is gone");
    // The same of a file that lost its end, and of one that holds something else.
    let entry = fs::read_dir(folder.join("cache"))
        .unwrap()
        .next()
        .unwrap()
        .unwrap();
    let whole = fs::read(entry.path()).unwrap();
    for half in [&whole[..whole.len() / 2], &whole[..100], b"something else", b""] {
        fs::write(entry.path(), half).unwrap();
        let (_, err) = done(folder, &arguments);
        assert!(err.contains("it is built again"), "{} bytes: {err}", half.len());
        assert!(was_draft(folder, "s.jsonl"), "{} bytes", half.len());
        done(folder, &arguments);
        assert!(!was_draft(folder, "s.jsonl"), "{} bytes", half.len());
    }
}
