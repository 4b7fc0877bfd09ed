//! `render` with everything waited for makes the same PNG files on every run, with one loader thread and with two.
//!
//! The shipped flight of 120 frames at 160x90; at another size by
//!
//! ```sh
//! CLIPSCAPE_SIZE=1280x720 cargo test --release --test repeat
//! ```
//!
//! There are as many loaders as processors, up to four: with one, the program is confined to one processor (Linux).
#![cfg(all(feature = "cli", feature = "gpu"))]

mod support;

use std::fs;
use std::path::Path;
use std::process::Command;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// Runs the program, which must succeed.
fn done(folder: &Path, arguments: &[&str]) {
    let output = Command::new(env!("CARGO_BIN_EXE_clipscape"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("the program starts");
    let err = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {err}");
}

/// The files in a folder, by name.
fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| {
            let entry = entry.unwrap();
            let name = entry.file_name().into_string().unwrap();
            (name, fs::read(entry.path()).unwrap())
        })
        .collect();
    files.sort();
    files
}

/// Confines what this thread starts to `processors` of those that it may use, as far as there are so many.
#[cfg(target_os = "linux")]
fn confined<T>(processors: usize, work: impl FnOnce() -> T) -> T {
    use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};

    let all = sched_getaffinity(None).unwrap();
    let mut some = CpuSet::new();
    let allowed = (0..CpuSet::MAX_CPU).filter(|cpu| all.is_set(*cpu));
    allowed.take(processors).for_each(|cpu| some.set(cpu));
    sched_setaffinity(None, &some).unwrap();
    let result = work();
    sched_setaffinity(None, &all).unwrap();
    result
}

#[cfg(not(target_os = "linux"))]
fn confined<T>(_: usize, work: impl FnOnce() -> T) -> T {
    work()
}

#[test]
fn frames_that_wait_are_the_same_files_on_every_run_and_for_any_number_of_loaders() {
    if support::gpu().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let [dem, flight] = ["data/N42E001.hgt", "data/pyrenees.json"].map(|file| format!("{ROOT}/{file}"));
    let preprocess = ["preprocess", &dem, "-o", "a.terrain.exr", "--sky-directions", "0"];
    done(folder, &[&preprocess[..], &["--quiet"]].concat());
    let size = std::env::var("CLIPSCAPE_SIZE").unwrap_or_else(|_| "160x90".into());
    let fly = |out: &str, processors, more: &[&str]| {
        let common = ["render", "a.terrain.exr", "--flight", &flight, "--size", &size];
        let all = [&common[..], &["--wait", "all", "--quiet", "-o", out], more].concat();
        confined(processors, || done(folder, &all));
        files(&folder.join(out))
    };
    let two = fly("two", 2, &[]);
    assert!(two.len() >= 120 && two[0].1 != two[100].1, "{} files", two.len());
    assert!(fly("again", 2, &[]) == two, "a second run");
    assert!(fly("one", 1, &[]) == two, "one loader");
    // Control: smaller windows draw far ground coarser, and files differ.
    let other = fly("other", 2, &["--clip-size", "64", "--frames", "60..61"]);
    let same = two.iter().find(|(name, _)| *name == other[0].0);
    assert!(same.is_some_and(|(_, bytes)| *bytes != other[0].1));
}
