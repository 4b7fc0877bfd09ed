//! Tells a release build which commit it is made from, in `CLIPSCAPE_COMMIT`, for the reports of `measure`.
//!
//! What is set in the environment is taken as it is. Else git is asked, if this folder is its work tree's top: not where the
//! package lies in another's tree or came without one. `-dirty` tells of sources that were changed. Other builds are not
//! told: each commit would make them anew.
#![allow(clippy::print_stdout, reason = "cargo reads it")]

use std::path::Path;
use std::process::Command;

fn main() {
    println!("cargo::rerun-if-env-changed=CLIPSCAPE_COMMIT");
    println!("cargo::rerun-if-changed=build.rs");
    let release = std::env::var("PROFILE").is_ok_and(|profile| profile == "release");
    if !release || std::env::var_os("CLIPSCAPE_COMMIT").is_some() {
        return;
    }
    let top = git(&["rev-parse", "--show-toplevel"]);
    let here = std::env::var("CARGO_MANIFEST_DIR").unwrap_or_default();
    let same = |top: &String| {
        let [top, here] = [top, &here].map(|path| Path::new(path).canonicalize().ok());
        top.is_some() && top == here
    };
    if top.filter(same).is_none() {
        return;
    }
    for watched in ["src", "shaders", "Cargo.toml"] {
        println!("cargo::rerun-if-changed={watched}");
    }
    // Written by every commit and checkout.
    for file in ["HEAD", "logs/HEAD"] {
        if let Some(path) = git(&["rev-parse", "--git-path", file]).filter(|path| Path::new(path).exists()) {
            println!("cargo::rerun-if-changed={path}");
        }
    }
    if let Some(commit) = git(&["describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]) {
        println!("cargo::rustc-env=CLIPSCAPE_COMMIT={commit}");
    }
}

/// What git answers; none where it is not there or knows nothing.
fn git(arguments: &[&str]) -> Option<String> {
    let answer = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(answer.stdout).ok()?.trim().to_string();
    (answer.status.success() && !text.is_empty()).then_some(text)
}
