//! The program as a user meets it: exit status, standard output, standard error, and what is left in the folder.
#![cfg(feature = "cli")]

mod outputs;
#[cfg(feature = "gpu")]
mod render;
mod terrain_files;
mod usage;

use std::ffi::OsStr;
use std::fs;
use std::path::Path;
use std::process::Command;

/// What a run of the program gave.
struct Ran {
    status: i32,
    out: String,
    err: String,
}

fn program() -> Command {
    Command::new(env!("CARGO_BIN_EXE_clipscape"))
}

fn run<S: AsRef<OsStr>>(folder: &Path, arguments: &[S]) -> Ran {
    let output = program()
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("the program starts");
    Ran {
        status: output.status.code().expect("no signal ended it"),
        out: String::from_utf8(output.stdout).expect("text"),
        err: String::from_utf8(output.stderr).expect("text"),
    }
}

/// Runs, and expects success with nothing on standard error.
fn done(folder: &Path, arguments: &[&str]) -> String {
    let ran = run(folder, arguments);
    assert_eq!((ran.status, ran.err.as_str()), (0, ""), "{arguments:?}");
    ran.out
}

/// Runs, and expects failure: nothing on standard output, one line with all of `says` on standard error.
fn fails(folder: &Path, status: i32, arguments: &[&str], says: &[&str]) {
    let ran = run(folder, arguments);
    assert_eq!(ran.status, status, "{arguments:?}: {}", ran.err);
    assert_eq!(ran.out, "", "{arguments:?}");
    assert!(
        ran.err.starts_with("clipscape: ") && ran.err.ends_with('\n'),
        "{arguments:?}: {}",
        ran.err
    );
    assert_eq!(ran.err.lines().count(), 1, "{arguments:?}: {}", ran.err);
    for part in says {
        assert!(
            ran.err.contains(part),
            "{arguments:?}: {} should say {part}",
            ran.err
        );
    }
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}
