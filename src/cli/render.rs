//! `clipscape render`: one picture, or the frames of a flight.

mod asked;
mod statistics;
mod told;

use std::sync::Arc;

use self::asked::{Asked, clipmap_options, day_of};
pub(super) use self::asked::{no_day, read_flight, tile_options};
pub(super) use self::statistics::{checksum, command_line, files_checksum};
use self::statistics::{fastest_fresh_m_s, pooled_errors, write_stats};
use self::told::{distinct, warn_of_faults, warn_of_frames, warn_of_sun};
use super::args::{RenderArgs, ViewArgs};
use super::progress::Terminal;
use super::shots::Shots;
use super::view_values::ClipSize;
use super::{Failure, Outcome};
use crate::build::Output;
use crate::clipmap::{ClipmapOptions, Wait, fit_clip_size};
use crate::error::Result;
use crate::gpu;
use crate::levels::Levels;
use crate::light::LightOptions;
use crate::progress::Progress as _;
use crate::render::{Headless, HeadlessOptions, picture};
use crate::shade::ViewMode;
use crate::source;
use crate::stats::Run;
use crate::stream::{AtOnce, CacheFolder, Terrain, TileOptions};

/// Runs the command.
pub(super) fn run(args: &RenderArgs, terminal: &Terminal) -> Outcome {
    let Asked {
        out,
        flight_json,
        flight,
        recording,
    } = Asked::of(args)?;
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
    let shots = Shots::of(args, flight, &terrain)?;
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
    warn_of_frames(&frames, &terrain, terminal);
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
    let what = if frames.len() == 1 {
        "1 frame".to_string()
    } else {
        format!("{} frames", frames.len())
    };
    terminal.note(&format!("{} holds {what}", out.display()));
    Ok(())
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
