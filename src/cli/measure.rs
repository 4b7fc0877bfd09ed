//! `clipscape measure`: one flight over many settings, and a report.

use super::args::MeasureArgs;
use super::progress::Terminal;
use super::render::{checksum, command_line, files_checksum, read_flight};
use super::{Outcome, measure_depth};
use crate::build::HELD_MEMORY_BYTES;
use crate::camera::{Flight, check_picture};
use crate::clipmap::ClipmapOptions;
use crate::error::{Error, ErrorKind};
use crate::gpu;
use crate::levels::Levels;
use crate::measure::{Effort, FILES, Folder, MeasureOptions, SettingLists, measure};
use crate::progress::Progress;
use crate::render::HeadlessOptions;
use crate::source;
use crate::stats::Run;
use crate::stream::Terrain;

/// Runs the command.
pub(super) fn run(args: &MeasureArgs, terminal: &Terminal) -> Outcome {
    if let Some((depth, camera)) = args.depth.as_deref().zip(args.camera.as_deref()) {
        return measure_depth::run(args, [depth, camera], terminal);
    }
    let (Some(flight), Some(output)) = (&args.flight, &args.output) else {
        let what = "neither a flight with a folder nor the depth of a frame is given";
        return Err(Error::new(ErrorKind::Misuse, "measure", what).into());
    };
    // What can be refused at once is, before the terrain is read and its pyramid built.
    let lists = lists(args);
    lists.settings()?;
    let size_px = args
        .size
        .unwrap_or(if args.quick { [640, 360] } else { [1280, 720] });
    check_picture(size_px)?;
    let clipmap = ClipmapOptions {
        vertical_scale: args.vertical_scale,
        ..Default::default()
    };
    clipmap.check()?;
    let (name, json) = read_flight(flight)?;
    let flight = Flight::parse(&name, &json)?;
    let folder = Folder::create(output, &FILES, args.force)?;
    let gpu = gpu::open()?;

    let terrain = Terrain::open_with(&args.input.inputs, &args.input.read.options(), terminal)?;
    let options = MeasureOptions {
        lists,
        effort: effort(args),
        headless: HeadlessOptions {
            size_px,
            tint: !args.no_tint,
            haze: !args.no_haze,
            traced_light: terrain.has_light(),
            sun: terrain.sun().or(args.sun).unwrap_or_default(),
            clipmap,
            ..Default::default()
        },
        memory_bytes: args.memory.unwrap_or(HELD_MEMORY_BYTES),
    };
    let run = Run {
        device: gpu.info.name.clone(),
        driver: gpu.driver(),
        command: command_line(),
        flight_checksum: Some(checksum(json.as_bytes())),
        input_checksum: files_checksum(&source::files_of(&args.input.inputs)?)?,
        ..Run::default()
    };
    let contents = measure(&gpu, &terrain, &flight, &options, &run, terminal)?;
    folder.publish(&contents)?;
    for fault in terrain.faults() {
        terminal.warn(&fault.to_string());
    }
    terminal.note(&format!("{} is made", output.join("report.html").display()));
    Ok(())
}

fn lists(args: &MeasureArgs) -> SettingLists {
    let mut lists = if args.quick {
        SettingLists::quick()
    } else {
        SettingLists::full()
    };
    if let Some(clip_sizes) = &args.clip_size {
        lists.clip_sizes.clone_from(clip_sizes);
    }
    if let Some(promises) = &args.max_error_px {
        lists.max_errors_px = promises.iter().map(|p| p.0).collect();
    }
    if let Some(transitions) = &args.transition {
        lists.transitions.clone_from(&transitions.0);
    }
    if let Some(levels) = &args.levels {
        lists.levels.clone_from(&levels.0);
    }
    if let Some(filters) = &args.filter {
        lists.filters.clone_from(&filters.0);
    }
    lists
}

fn effort(args: &MeasureArgs) -> Effort {
    let effort = if args.quick { Effort::QUICK } else { Effort::FULL };
    Effort {
        rounds: args.rounds.unwrap_or(effort.rounds),
        measured_frames: args.measured_frames.unwrap_or(effort.measured_frames),
        ..effort
    }
}
