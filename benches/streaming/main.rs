//! Streaming: what a flight that does not wait costs the frame's thread, how fast one may fly, and that size costs nothing.
//!
//! ```sh
//! cargo bench --bench streaming              # all of it, a short form
//! cargo bench --bench streaming -- flight    # 3,000 frames with a cold page cache: CPU and wall time of an update
//! cargo bench --bench streaming -- speeds    # the share of complete frames by speed, and what is predicted
//! cargo bench --bench streaming -- size      # a terrain of 2^20 x 2^20 against one of 4096 x 4096, frames in turn
//! ```
//!
//! `CLIPSCAPE_TERRAIN=FILE` flies over another terrain file than one that is made of `synth:4096:1`; `CLIPSCAPE_FRAMES=N`
//! makes a flight of N frames.
#![allow(clippy::print_stdout, reason = "a bench prints tables")]

mod flight;
mod process;
mod size;

use std::path::{Path, PathBuf};
use std::process::Command;

use clipscape::build::{PreprocessOptions, preprocess};
use clipscape::light::LightOptions;
use clipscape::progress::Silent;
use clipscape::source::Synth;
use clipscape::{Error, Result};

/// Frames a second.
const FPS: f64 = 30.0;

fn main() -> Result<()> {
    let asked: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    if let [what, path] = &asked[..]
        && what == "make"
    {
        return make(Path::new(path));
    }
    let all = asked.is_empty();
    let wants = |what: &str| all || asked.iter().any(|a| a == what);
    let frames = std::env::var("CLIPSCAPE_FRAMES")
        .ok()
        .and_then(|n| n.parse().ok());
    let folder = std::env::temp_dir().join(format!("clipscape-bench-{}", std::process::id()));
    let made = if wants("flight") || wants("speeds") {
        Some(terrain_file(&folder)?)
    } else {
        None
    };
    let done = (|| {
        if let Some(path) = &made {
            if wants("flight") {
                flight::flight(path, frames.unwrap_or(if all { 600 } else { 3000 }))?;
            }
            if wants("speeds") {
                flight::speeds(path, if all { 90 } else { 300 })?;
            }
        }
        if wants("size") {
            size::size(if all { 2 } else { 6 })?;
        }
        Ok(())
    })();
    // Nothing of it is of use to anybody.
    let _ = std::fs::remove_dir_all(&folder);
    done
}

/// The terrain file that is asked for, or one that is made: by a process of its own, whose memory is not this one's.
fn terrain_file(folder: &Path) -> Result<PathBuf> {
    if let Some(path) = std::env::var_os("CLIPSCAPE_TERRAIN") {
        return Ok(path.into());
    }
    let path = folder.join("a.terrain.exr");
    std::fs::create_dir_all(folder).map_err(|e| Error::io(folder.display(), e))?;
    let own = std::env::current_exe().map_err(|e| Error::io("the bench", e))?;
    let status = Command::new(own).arg("make").arg(&path).status();
    let status = status.map_err(|e| Error::io("the bench", e))?;
    if !status.success() {
        return Err(Error::new(
            clipscape::ErrorKind::Io,
            path.display(),
            "was not made",
        ));
    }
    Ok(path)
}

fn make(path: &Path) -> Result<()> {
    let options = PreprocessOptions {
        memory_bytes: 4 << 30,
        light: Some(LightOptions {
            sky_directions: 0,
            ..Default::default()
        }),
        ..Default::default()
    };
    preprocess(&Synth::new(4096, 1)?, path, &options, &Silent).map(drop)
}
