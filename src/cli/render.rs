//! `clipscape render`: one picture, or the frames of a flight.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::args::{RenderArgs, ViewArgs};
use super::input::{beside, first};
use super::progress::Terminal;
use super::shots::{Planned, Shots, camera};
use super::view_values::ClipSize;
use super::{Failure, Outcome};
use crate::build::{Output, refuse_existing};
use crate::camera::{Flight, MAX_EYE_M, check_picture, overview};
use crate::clipmap::{AHEAD_S, ClipmapOptions, FRAME_BYTES, Wait, fit_clip_size, height_range_m};
use crate::error::{Error, ErrorKind, Result};
use crate::gpu;
use crate::grid::Grid;
use crate::levels::Levels;
use crate::light::{Day, LightOptions};
use crate::progress::Progress;
use crate::render::{Headless, HeadlessOptions, Recording, picture};
use crate::shade::ViewMode;
use crate::source;
use crate::stats::{FrameStats, PooledErrors, Run, SummaryStats};
use crate::stream::{AtOnce, CacheFolder, Flown, Terrain, TileOptions};

/// Clip size where none is given and the camera is among the terrain.
const CLIP_SIZE: i64 = 256;

/// Faults of data that are said one by one.
const SHOWN_FAULTS: usize = 4;

/// Runs the command.
pub(super) fn run(args: &RenderArgs, terminal: &Terminal) -> Outcome {
    // What can be refused at once is, before the terrain is read and its pyramid built.
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
    let mut clipmap = clipmap_options(args).map_err(Failure::Usage)?;
    let tiles = tile_options(&args.view)?;
    let stats = args
        .view
        .stats
        .as_deref()
        .map(|path| Output::create(path, args.force))
        .transpose()?;
    let gpu = gpu::open()?;

    let folder = cache_folder(args)?;
    let terrain = Arc::new(open(args, folder.clone(), &tiles, terminal)?);
    warn_of_sun(args, &terrain, terminal);
    let flight = flight.map(|flight| flight.over(&terrain)).transpose()?;
    let day = day_of(args, flight.as_ref(), &terrain)?;
    clipmap.day = day.is_some();
    let camera = camera(&args.camera, args.view.vertical_scale, &terrain)?;
    let scale = args.view.vertical_scale;
    let heights = height_range_m(terrain.as_ref())?.map(|h| (f64::from(h) + terrain.grid().base_m) * scale);
    let (low, high) = (heights[0].min(heights[1]), heights[0].max(heights[1]));
    let aspect = f64::from(args.view.size[0]) / f64::from(args.view.size[1]);
    if camera.is_none() && flight.is_none() {
        check_heights(&terrain, low, high)?;
    }
    let shots = match (flight, args.flight.is_some(), camera) {
        (Some(flight), ..) => Shots::Flight(flight),
        (None, true, _) => Shots::Flight(Flight::orbit(terrain.grid(), low, high).scaled_down(scale)?),
        (None, false, Some(camera)) => Shots::Still(camera),
        (None, false, None) => Shots::Still(overview(terrain.grid(), low, high, aspect).scaled_down(scale)),
    };
    if args.view.clip_size == Some(ClipSize::Auto) {
        clipmap.clip_size = fitting_clip_size(args, &shots, &terrain, &clipmap, terminal)?;
    }
    let arriving = terrain.arriving();
    let levels: &dyn Levels = match clipmap.wait {
        Wait::All => terrain.as_ref(),
        Wait::None => &arriving,
    };
    let mut headless = Headless::new(gpu, levels, &headless_options(&args.view, &terrain, &clipmap))?;
    headless.set_truth(terrain.clone());
    if let Some(day) = day {
        headless.set_day(day)?;
        if let Some(time) = args.view.sun_time {
            headless.set_time_of_day(time.in_day(&day))?;
        }
    }
    if args.measure {
        headless.measure()?;
    }
    if args.view.stats.is_some() || args.view.max_error_px.is_some() {
        headless.certify();
    }
    let frames = match &shots {
        Shots::Flight(flight) => recording.record(&mut headless, levels, flight, terminal)?,
        Shots::Still(camera) => {
            vec![picture(
                &out,
                args.force,
                &mut headless,
                levels,
                camera,
                terminal,
            )?]
        }
    };
    if folder.is_some() {
        // The next run opens what was begun; light takes longer than a picture is worth.
        terrain.wait_for_heights(terminal)?;
    }
    for warning in terrain.take_warnings() {
        terminal.warn(&warning);
    }
    warn_of_promise(&frames, terminal);
    if frames.iter().all(|f| f.patches == 0) {
        terminal.warn(&format!("{}: no terrain is seen", terrain.name()));
    } else if frames.iter().any(|f| f.cut) {
        terminal.warn("coarser levels are left out, so the terrain ends at a border; see --levels");
    }
    let faults = distinct(headless.take_faults().into_iter().chain(terrain.faults()));
    if let (Some((output, file)), Some(path)) = (stats, &args.view.stats) {
        let run = Run {
            device: headless.gpu().info.name.clone(),
            driver: headless.gpu().driver(),
            command: command_line(),
            flight_checksum: flight_json.as_ref().map(|(_, json)| checksum(json.as_bytes())),
            input_checksum: files_checksum(&source::files_of(&args.input.inputs)?)?,
            faults: faults.len() as u64,
            fastest_fresh_m_s: fastest_fresh_m_s(&terrain, &headless, &clipmap, &shots),
            errors: pooled_errors(&headless, &frames),
        };
        write_stats(&file, path, &frames, run)?;
        output.publish(&file)?;
    }
    warn_of_faults(&faults, terminal);
    if frames.iter().any(|f| f.provisional) {
        terminal.warn("some frames are drafts: the terrain file was not built yet");
    } else if frames.iter().any(|f| !f.complete) {
        terminal.warn("some frames were drawn before all of their data were there; see --wait");
    }
    let what = if frames.len() == 1 {
        "1 frame".to_string()
    } else {
        format!("{} frames", frames.len())
    };
    terminal.note(&format!("{} holds {what}", out.display()));
    Ok(())
}

/// The day whose light is shown, if a time of one is asked for.
fn day_of(args: &RenderArgs, flight: Option<&Flight>, terrain: &Terrain) -> Result<Option<Day>> {
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
pub(super) fn no_day(terrain: &Terrain, asker: &str) -> Error {
    let what = format!("has no light over a day, so {asker} has no meaning");
    Error::new(ErrorKind::Misuse, terrain.name(), what)
        .advice("make it with clipscape preprocess --sun-at TIME --day N")
}

/// The fastest flight at which every level would have stayed fresh, by what loading took.
fn fastest_fresh_m_s(
    terrain: &Terrain,
    headless: &Headless,
    clipmap: &ClipmapOptions,
    shots: &Shots,
) -> Option<f64> {
    let Shots::Flight(flight) = shots else { return None };
    let flown = Flown {
        clip_size: clipmap.clip_size,
        levels: headless.clipmap().windows().len() as u32,
        upload_budget_bytes: clipmap.upload_budget_bytes.or(Some(FRAME_BYTES)),
        fps: flight.fps(),
        ahead_s: AHEAD_S,
    };
    terrain.pace().map(|pace| pace.fastest_m_s(&flown))
}

/// Where terrain files are kept that are built in the background; none where nothing is built, or kept.
fn cache_folder(args: &RenderArgs) -> Result<Option<CacheFolder>> {
    if args.view.no_cache || !opens_at_once(args) {
        return Ok(None);
    }
    CacheFolder::of_user()
}

/// Whether frames do not wait for a DEM's pyramid: what is measured must be whole.
fn opens_at_once(args: &RenderArgs) -> bool {
    let view = &args.view;
    let whole = args.measure || view.view == ViewMode::Error || view.clip_size == Some(ClipSize::Auto);
    view.wait == Wait::None && !whole
}

fn open(
    args: &RenderArgs,
    folder: Option<CacheFolder>,
    tiles: &TileOptions,
    terminal: &Terminal,
) -> Result<Terrain> {
    let (inputs, options) = (&args.input.inputs, args.input.read.options());
    if !opens_at_once(args) {
        return Terrain::open_with(inputs, &options, terminal)?.with_tiles(tiles);
    }
    let at_once = AtOnce {
        folder,
        light: LightOptions {
            sun: args.view.sun.unwrap_or_default(),
            ..Default::default()
        },
        tiles: *tiles,
        ..Default::default()
    };
    Terrain::open_at_once(inputs, &options, &at_once, terminal)
}

/// The smallest clip size that keeps the promised error in all frames.
fn fitting_clip_size(
    args: &RenderArgs,
    shots: &Shots,
    terrain: &Terrain,
    clipmap: &ClipmapOptions,
    terminal: &Terminal,
) -> Result<i64> {
    let fit = fit_clip_size(terrain, &shots.views(args)?, clipmap, terminal)?;
    terminal.note(&format!("clip size {}", fit.clip_size));
    Ok(fit.clip_size)
}

/// Says how far frames that do not keep the promised error are from it.
fn warn_of_promise(frames: &[FrameStats], terminal: &Terminal) {
    let broken: Vec<_> = frames
        .iter()
        .filter(|f| f.keeps_max_error == Some(false))
        .collect();
    let Some(first) = broken.first() else { return };
    let promised = first.max_error_px.unwrap_or_default();
    let worst = broken
        .iter()
        .try_fold(0.0, |most: f64, f| f.certified_error_px.map(|px| most.max(px)));
    let certified = match worst {
        Some(px) => format!("at most {px:.3} px is certified instead"),
        None => "for some nothing can be certified".to_string(),
    };
    terminal.warn(&format!(
        "{} of {} frames do not keep {promised} px, from frame {} on: {certified}; a greater --clip-size keeps more",
        broken.len(),
        frames.len(),
        first.frame
    ));
}

/// Says what is wrong with the data, and where it is much, how much.
fn warn_of_faults(faults: &[String], terminal: &Terminal) {
    for fault in faults.iter().take(SHOWN_FAULTS) {
        terminal.warn(fault);
    }
    if faults.len() > SHOWN_FAULTS {
        let more = faults.len() - SHOWN_FAULTS;
        terminal.warn(&format!(
            "{more} more faults like these; see clipscape info --verify"
        ));
    }
}

/// What faults say, each once: ground that is met again is damaged still.
fn distinct(faults: impl Iterator<Item = Error>) -> Vec<String> {
    let mut texts = Vec::new();
    for text in faults.map(|f| f.to_string()) {
        if !texts.contains(&text) {
            texts.push(text);
        }
    }
    texts
}

/// The command line as one line, whatever its arguments are made of.
pub(super) fn command_line() -> String {
    let arguments: Vec<_> = std::env::args_os()
        .map(|a| a.to_string_lossy().into_owned())
        .collect();
    arguments.join(" ")
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

pub(super) fn read_flight(path: &Path) -> Result<(String, String)> {
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

fn clipmap_options(args: &RenderArgs) -> Result<ClipmapOptions> {
    let view = &args.view;
    if view.clip_size == Some(ClipSize::Auto) && view.max_error_px.is_none() {
        let what = "auto keeps a promised error, and none is promised";
        return Err(Error::new(ErrorKind::Misuse, "--clip-size", what).advice("give --max-error-px too"));
    }
    view.clipmap_options(clip_size(args))
}

pub(super) fn tile_options(view: &ViewArgs) -> Result<TileOptions> {
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

fn headless_options(view: &ViewArgs, terrain: &Terrain, clipmap: &ClipmapOptions) -> HeadlessOptions {
    // Traced light is that of its own sun; it moves only by preprocessing.
    let sun = terrain.sun().or(view.sun).unwrap_or_default();
    HeadlessOptions {
        size_px: view.size,
        sample_count: view.msaa,
        view_mode: view.view,
        tint: !view.no_tint,
        haze: !view.no_haze,
        // Where there is none yet, it may come.
        traced_light: true,
        sun,
        clipmap: *clipmap,
    }
}

/// Refuses to look for a place from which heights beyond any camera's would be seen: most often they stand for no data.
fn check_heights(terrain: &Terrain, low: f64, high: f64) -> Result<()> {
    let most = if -low > high { low } else { high };
    if most.abs() <= MAX_EYE_M / 8.0 {
        return Ok(());
    }
    let what = format!("has heights of {most:.1e} m as drawn, too far up or down for a view of the whole");
    Err(Error::new(ErrorKind::Limit, terrain.name(), what).advice(
        "if they stand for no data, name their value with --nodata; else place the camera with --eye",
    ))
}

fn warn_of_sun(args: &RenderArgs, terrain: &Terrain, terminal: &Terminal) {
    let other = |sun| args.view.sun.is_some_and(|asked| asked != sun);
    if terrain.sun().is_some_and(other) {
        terminal.warn(&format!(
            "{}: its light is traced already, so --sun changes nothing; preprocess the DEM with --sun instead",
            terrain.name()
        ));
    }
}

fn write_stats(mut file: &fs::File, path: &Path, frames: &[FrameStats], run: Run) -> Result<()> {
    let mut text = String::new();
    for frame in frames {
        text += &serde_json::to_string(frame).expect("numbers are valid JSON");
        text.push('\n');
    }
    text +=
        &serde_json::to_string(&SummaryStats::new(run, frames)).expect("numbers and texts are valid JSON");
    text.push('\n');
    file.write_all(text.as_bytes())
        .map_err(|e| Error::io(path.display(), e))
}

/// What the frames' errors come to, the worst frame by its own number.
fn pooled_errors(headless: &Headless, frames: &[FrameStats]) -> Option<PooledErrors> {
    let pool = headless.pooled_errors()?;
    let worst = frames.get(usize::try_from(pool.worst_frame()?).ok()?)?;
    let summary = pool.summary();
    Some(PooledErrors {
        error_px_max: summary.error_px_max,
        error_px_p99: summary.error_px_p99,
        error_px_rms: summary.error_px_rms,
        error_m_max: summary.error_m_max,
        error_floor_px: summary.error_floor_px,
        worst_frame: worst.frame,
    })
}

pub(super) fn checksum(bytes: &[u8]) -> String {
    format!("crc32c:{:08x}", crc32c::crc32c(bytes))
}

/// The checksum over inputs that are files, one after another; none where there are none.
pub(super) fn files_checksum(files: &[PathBuf]) -> Result<Option<String>> {
    let (mut crc, mut buffer) = (0, vec![0; 1 << 20]);
    for path in files {
        let mut file = fs::File::open(path).map_err(|e| Error::io(path.display(), e))?;
        loop {
            match std::io::Read::read(&mut file, &mut buffer).map_err(|e| Error::io(path.display(), e))? {
                0 => break,
                n => crc = crc32c::crc32c_append(crc, &buffer[..n]),
            }
        }
    }
    Ok((!files.is_empty()).then(|| format!("crc32c:{crc:08x}")))
}
