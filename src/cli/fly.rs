//! `clipscape fly`: the window.

use std::path::{Path, PathBuf};

use super::args::FlyArgs;
use super::input::beside;
use super::progress::Terminal;
use super::view_values::ClipSize;
use super::{Failure, Outcome, render, shots};
use crate::clipmap::{ClipmapOptions, Wait};
use crate::error::{Error, ErrorKind, Result};
use crate::light::LightOptions;
use crate::source;
use crate::stream::{AtOnce, CacheFolder, Terrain};
use crate::window::{self, WindowOptions};

/// What is flown through where nothing is named.
const INPUT: &str = "synth:16384:1";

/// Clip size where none is given: a whole DEM is seen from afar, and many have a graphics card.
const CLIP_SIZE: i64 = 512;

/// Runs the command.
pub(super) fn run(args: &FlyArgs, terminal: &Terminal) -> Outcome {
    let inputs = if args.inputs.is_empty() {
        vec![PathBuf::from(INPUT)]
    } else {
        args.inputs.clone()
    };
    let clipmap = clipmap_options(args).map_err(Failure::Usage)?;
    let tiles = render::tile_options(&args.view)?;
    // What is not there is said before a window appears.
    for file in source::files_of(&inputs)? {
        std::fs::metadata(&file).map_err(|e| Error::io(file.display(), e))?;
    }
    if !args.output_dir.is_dir() {
        let what = "is no folder to write flights and pictures into";
        let error = Error::new(ErrorKind::Io, args.output_dir.display(), what);
        return Err(error
            .advice("make it, or choose another with --output-dir")
            .into());
    }
    let options = WindowOptions {
        title: title(&inputs),
        size_px: args.view.size,
        sample_count: args.view.msaa,
        view_mode: args.view.view,
        tint: !args.view.no_tint,
        haze: !args.view.no_haze,
        sun: args.view.sun.unwrap_or_default(),
        sun_time: args.view.sun_time,
        clipmap,
        folder: folder(&args.output_dir),
        stem: stem(&inputs[0]),
        replay: replay(&inputs, !args.read.options().is_default()),
        loses_device: args.loses_device,
    };
    let read = args.read.options();
    let (sun, sun_time) = (args.view.sun, args.view.sun_time);
    let at_once = match args.view.wait {
        Wait::All => None,
        Wait::None => Some(AtOnce {
            folder: if args.view.no_cache {
                None
            } else {
                CacheFolder::of_user()?
            },
            light: LightOptions {
                sun: sun.unwrap_or_default(),
                ..Default::default()
            },
            tiles,
            ..Default::default()
        }),
    };
    let open: window::Open = Box::new(move |progress| {
        let terrain = match &at_once {
            Some(at_once) => Terrain::open_at_once(&inputs, &read, at_once, progress)?,
            None => Terrain::open_with(&inputs, &read, progress)?.with_tiles(&tiles)?,
        };
        if sun_time.is_some() && terrain.day().is_none() {
            return Err(render::no_day(&terrain, "--sun-time"));
        }
        if sun.is_some_and(|sun| terrain.sun().is_some_and(|traced| traced != sun)) {
            progress.warn(&format!(
                "{}: its light is traced already, so --sun changes nothing",
                terrain.name()
            ));
        }
        Ok(terrain)
    });
    let (camera, vertical_scale) = (args.camera.clone(), args.view.vertical_scale);
    let place: window::Place = Box::new(move |terrain| shots::camera(&camera, vertical_scale, terrain));
    window::run(&options, open, place, terminal)?;
    Ok(())
}

fn clipmap_options(args: &FlyArgs) -> Result<ClipmapOptions> {
    let view = &args.view;
    let misuse = |subject: &str, what: &str| Error::new(ErrorKind::Misuse, subject, what);
    if view.stats.is_some() {
        return Err(misuse("--stats", "a window writes no statistics")
            .advice("record a flight with R, and give --stats to render"));
    }
    let clip_size = match view.clip_size {
        None => CLIP_SIZE,
        Some(ClipSize::Fixed(size)) => size,
        Some(ClipSize::Auto) => {
            return Err(misuse(
                "--clip-size",
                "auto is found for a flight that is known beforehand",
            )
            .advice("give a number; the panel turns it while flying"));
        }
    };
    view.clipmap_options(clip_size)
}

/// What the window is called after: the first input, and how many more there are.
fn title(inputs: &[PathBuf]) -> String {
    let first = &inputs[0];
    let name = first.file_name().unwrap_or(first.as_os_str()).to_string_lossy();
    match inputs.len() - 1 {
        0 => name.into_owned(),
        more => format!("{name} and {more} more"),
    }
}

/// How the names of flights and pictures begin.
fn stem(input: &Path) -> String {
    let path = beside(input, "");
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}

/// The folder as paths in it are said: the current one is not named.
fn folder(path: &Path) -> PathBuf {
    if path == Path::new(".") {
        PathBuf::new()
    } else {
        path.into()
    }
}

/// The command that replays flights over `inputs`; how they are read is not repeated.
fn replay(inputs: &[PathBuf], read: bool) -> String {
    let words = inputs
        .iter()
        .map(|input| window::quoted(&input.display().to_string()));
    let mut command = format!("clipscape render {}", words.collect::<Vec<_>>().join(" "));
    if read {
        command += " [how it is read]";
    }
    command
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_follow_the_input() {
        for (input, name) in [
            ("a/N42E001.hgt", "N42E001"),
            ("b.terrain.exr", "b"),
            ("synth:64:2", "synth-64-2"),
            ("src/cli", "cli"),
        ] {
            assert_eq!(stem(Path::new(input)), name);
        }
        let inputs = [PathBuf::from("a/b c.tif"), "d.tif".into()];
        assert_eq!(title(&inputs), "b c.tif and 1 more");
        assert_eq!(replay(&inputs, false), "clipscape render 'a/b c.tif' d.tif");
        assert_eq!(folder(Path::new(".")).join("x"), Path::new("x"));
    }
}
