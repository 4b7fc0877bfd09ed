//! What the arguments of `render` ask for, and what of it is refused before the terrain is read.

use std::fs;
use std::path::{Path, PathBuf};

use crate::build::refuse_existing;
use crate::camera::{Flight, check_picture};
use crate::cli::args::{RenderArgs, ViewArgs};
use crate::cli::input::{beside, first};
use crate::cli::shots::Planned;
use crate::cli::view_values::ClipSize;
use crate::clipmap::ClipmapOptions;
use crate::error::{Error, ErrorKind, Result};
use crate::grid::Grid;
use crate::light::Day;
use crate::render::Recording;
use crate::source;
use crate::stream::{Terrain, TileOptions};

/// Clip size where none is given and the camera is among the terrain.
const CLIP_SIZE: i64 = 256;

/// What is asked for, as far as that can be told before the terrain is read and its pyramid built.
pub(super) struct Asked {
    /// Where the picture or the folder of frames goes.
    pub(super) out: PathBuf,
    /// The flight's file: its name and its text.
    pub(super) flight_json: Option<(String, String)>,
    pub(super) flight: Option<Planned>,
    pub(super) recording: Recording,
}

impl Asked {
    /// # Errors
    /// For what can be refused at once.
    pub(super) fn of(args: &RenderArgs) -> Result<Self> {
        let out = args.output.clone().unwrap_or_else(|| default_output(args));
        let flight_file = args.flight.as_deref().filter(|f| *f != Path::new("orbit"));
        let flight_json = flight_file.map(read_flight).transpose()?;
        refuse_same_files(args, &out)?;
        check_picture(args.view.size)?;
        let flight = flight_json
            .as_ref()
            .map(|(name, json)| Planned::parse(name, json))
            .transpose()?;
        let recording = Recording {
            folder: out.clone(),
            frames: args.frames.clone(),
            contact_sheet: args.contact_sheet.clone(),
            animation: args.animation.clone(),
            force: args.force,
        };
        match (&flight, args.flight.is_some()) {
            (Some(flight), _) => {
                recording.check(flight.times())?;
            }
            (None, true) => {
                // An orbit has the same frames around any DEM.
                recording.check(&Flight::orbit(&Grid::new(2, 2, [1.0, 1.0]), 0.0, 0.0))?;
            }
            (None, false) if !args.force => refuse_existing(&out)?,
            (None, false) => {}
        }
        Ok(Self {
            out,
            flight_json,
            flight,
            recording,
        })
    }
}

/// Refuses outputs that are one another or an input: `--force` replaces earlier results, never what they are made of.
fn refuse_same_files(args: &RenderArgs, out: &Path) -> Result<()> {
    let same = |a: &Path, b: &Path| {
        // What exists is told by where it leads, what does not by its name.
        a == b || fs::canonicalize(a).is_ok_and(|a| fs::canonicalize(b).is_ok_and(|b| a == b))
    };
    let outputs: Vec<&Path> = [Some(out), args.view.stats.as_deref()]
        .into_iter()
        .chain([args.animation.as_deref(), args.contact_sheet.as_deref()])
        .flatten()
        .collect();
    let files = source::files_of(&args.input.inputs)?;
    let inputs = files.iter().map(PathBuf::as_path).chain(args.flight.as_deref());
    for (k, output) in outputs.iter().enumerate() {
        let misuse =
            |what| Err(Error::new(ErrorKind::Misuse, output.display(), what).advice("choose another name"));
        if inputs.clone().any(|input| same(input, output)) {
            return misuse("is an input, so it is not replaced");
        }
        if outputs[..k].iter().any(|other| same(other, output)) {
            return misuse("is asked for twice");
        }
    }
    Ok(())
}

fn default_output(args: &RenderArgs) -> PathBuf {
    let ending = if args.flight.is_some() { "" } else { ".png" };
    let input = first(&args.input);
    let out = beside(input, ending);
    // An input without an ending of its own is no folder for frames.
    if out == input {
        beside(input, ".frames")
    } else {
        out
    }
}

pub(in crate::cli) fn read_flight(path: &Path) -> Result<(String, String)> {
    let name = path.display().to_string();
    let json = fs::read_to_string(path).map_err(|e| match e.kind() {
        std::io::ErrorKind::InvalidData => Error::new(ErrorKind::Broken, &name, "is no text, so no flight")
            .advice("give a flight's JSON file, or `orbit`"),
        _ => Error::io(&name, e),
    })?;
    Ok((name, json))
}

/// The clip size asked for, or one that suits the picture.
///
/// Where the whole DEM is shown from afar, a level is dropped once the climb exceeds its reach: with reach R = N/2 - 2
/// and the camera a distance D away, steps of `1.25 D / R` remain. They are to be about two pixels of the picture,
/// `2 D tan(fov/2) / height` each, at the overview's 45 degrees: N = 1.5 times the picture's height.
fn clip_size(args: &RenderArgs) -> i64 {
    let whole = args.camera.eye.is_none()
        && args.camera.eye_at.is_none()
        && args.flight.as_deref().is_none_or(|f| f == Path::new("orbit"));
    match args.view.clip_size {
        Some(ClipSize::Fixed(asked)) => asked,
        // Found once the terrain is known; until then a size whose transition may be as wide as any.
        Some(ClipSize::Auto) => 2048,
        None if whole => {
            let wanted = 1.5 * f64::from(args.view.size[1]);
            (1i64 << (wanted.log2().round() as u32)).clamp(CLIP_SIZE, 2048)
        }
        None => CLIP_SIZE,
    }
}

pub(super) fn clipmap_options(args: &RenderArgs) -> Result<ClipmapOptions> {
    let view = &args.view;
    if view.clip_size == Some(ClipSize::Auto) && view.max_error_px.is_none() {
        let what = "auto keeps a promised error, and none is promised";
        return Err(Error::new(ErrorKind::Misuse, "--clip-size", what).advice("give --max-error-px too"));
    }
    view.clipmap_options(clip_size(args))
}

pub(in crate::cli) fn tile_options(view: &ViewArgs) -> Result<TileOptions> {
    let defaults = TileOptions::default();
    let options = TileOptions {
        memory_bytes: view.memory.map_or(defaults.memory_bytes, |b| {
            usize::try_from(b).unwrap_or(usize::MAX)
        }),
        ..defaults
    };
    options.check().map_err(|e| e.about("--memory"))?;
    Ok(options)
}

/// The day whose light is shown, if a time of one is asked for.
pub(super) fn day_of(args: &RenderArgs, flight: Option<&Flight>, terrain: &Terrain) -> Result<Option<Day>> {
    let in_keys = flight.is_some_and(|flight| flight.sun_hour_at(0.0).is_some());
    let asker = match (args.view.sun_time, in_keys) {
        (None, false) => return Ok(None),
        (Some(_), true) => {
            let what = "is given, and the flight's keys have a sun_time of their own";
            return Err(Error::new(ErrorKind::Misuse, "--sun-time", what).advice("leave one of them out"));
        }
        (Some(_), false) => "--sun-time",
        (None, true) => "sun_time in the flight",
    };
    terrain.day().map(Some).ok_or_else(|| no_day(terrain, asker))
}

/// Terrain without light over a day was asked for its time.
pub(in crate::cli) fn no_day(terrain: &Terrain, asker: &str) -> Error {
    let what = format!("has no light over a day, so {asker} has no meaning");
    Error::new(ErrorKind::Misuse, terrain.name(), what)
        .advice("make it with clipscape preprocess --sun-at TIME --day N")
}
