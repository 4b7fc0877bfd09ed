//! `clipscape preprocess`: a terrain file of a DEM.

use std::io::Write;

use super::Outcome;
use super::args::PreprocessArgs;
use super::input::{self, Input};
use super::progress::Terminal;
use crate::build::{self, Output, PreprocessOptions};
use crate::error::{Error, ErrorKind};
use crate::light::{self, Day, LightOptions, Sun};
use crate::progress::Progress;

/// Runs the command.
pub(super) fn run(args: &PreprocessArgs, terminal: &Terminal) -> Outcome {
    let input = input::open(&args.input)?;
    let out = args
        .output
        .clone()
        .unwrap_or_else(|| input::beside(input::first(&args.input), ".terrain.exr"));
    let (grid, place, name) = match &input {
        Input::Dem(source) => {
            input::refuse_own(&args.input, &out)?;
            let description = source.description();
            (
                description.grid,
                description.place.clone(),
                description.name.clone(),
            )
        }
        Input::Terrain(file) => {
            for (given, what, flag) in [
                (args.filter.is_some(), "filter is fixed", "--filter"),
                (args.destep, "heights are fixed", "--destep"),
            ] {
                if given {
                    let what = format!("is a terrain file, whose {what}");
                    let error = Error::new(ErrorKind::Misuse, file.name(), what);
                    return Err(error.advice(format!("give {flag} when it is made")).into());
                }
            }
            (
                file.meta().grid,
                file.meta().place.clone(),
                file.name().to_string(),
            )
        }
    };
    let mut day = None;
    let sun = match args.sun_at {
        None => args.sun.unwrap_or_default(),
        Some(moment) => {
            let given = args.lat.zip(args.lon);
            let found = || place.as_ref().and_then(|place| light::middle(&grid, place));
            let Some((latitude_deg, longitude_deg)) =
                given.or_else(|| found().map(|at| (at.latitude_deg, at.longitude_deg)))
            else {
                let what = "its reference system does not say where on the earth it lies";
                let error = Error::new(ErrorKind::Misuse, name, what);
                return Err(error.advice("give --lat and --lon").into());
            };
            let sun = Sun::at(moment, latitude_deg, longitude_deg)?;
            day = args
                .day
                .map(|positions| Day::of(moment, latitude_deg, longitude_deg, positions))
                .transpose()?;
            terminal.note(&format!(
                "the sun stands at azimuth {:.2}, altitude {:.2} degrees, seen from {latitude_deg:.4}, {longitude_deg:.4}",
                sun.azimuth_deg, sun.altitude_deg
            ));
            if let Some(day) = &day {
                let hours = [-1.0, 1.0].map(|end| clock(day.hour_of_time(end)));
                terminal.note(&format!(
                    "the day runs from {} to {} by the sun, its noon is {}",
                    hours[0], hours[1], day.noon
                ));
            }
            sun
        }
    };
    let defaults = PreprocessOptions::default();
    let options = PreprocessOptions {
        light: (!args.no_light).then_some(LightOptions {
            sun,
            sky_directions: args.sky_directions,
        }),
        day,
        curvature: args.curvature,
        filter: args.filter.unwrap_or_default().into(),
        destep: args.destep,
        force: args.force,
        memory_bytes: args.memory.unwrap_or(defaults.memory_bytes),
        source: input::stamp(&args.input.inputs),
        ..defaults
    };
    // Made first: where it cannot be, that is said before the work and not after it.
    let stats = args
        .stats
        .as_deref()
        .map(|path| Output::create(path, args.force))
        .transpose()?;
    let report = match &input {
        Input::Dem(source) => {
            for remark in source.remarks(terminal)? {
                terminal.warn(&format!("{}: {remark}", source.description().name));
            }
            build::preprocess(source.as_ref(), &out, &options, terminal)?
        }
        Input::Terrain(file) => build::relight(file, &out, &options, terminal)?,
    };
    if let (Some((output, mut file)), Some(path)) = (stats, &args.stats) {
        let line = serde_json::to_string(&report).expect("numbers are valid JSON") + "\n";
        file.write_all(line.as_bytes())
            .map_err(|e| Error::io(path.display(), e))?;
        output.publish(&file)?;
    }
    if let (Some(median), Some(least)) = (report.error_ratio_median, report.error_ratio_least) {
        terminal.note(&format!(
            "errors of {} patches were found anew: true over stored {median:.6} in the median, {least:.6} at least, none above 1",
            report.checked_patches
        ));
    }
    terminal.note(&format!("{} is made, in {:.1} s", out.display(), report.total_s));
    Ok(())
}

/// An hour as clocks show it.
pub(super) fn clock(hour: f64) -> String {
    let minutes = (hour * 60.0).round() as i64;
    format!("{}:{:02}", minutes.div_euclid(60), minutes.rem_euclid(60))
}
