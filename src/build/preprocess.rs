//! The steps from a DEM to a terrain file: heights, bounds, light.

use std::io::BufWriter;
use std::path::Path;
use std::time::Instant;

use super::blocks::Blocks;
use super::bounds::write_bounds;
use super::day::write_day;
use super::heights::write_heights;
use super::light::{Lit, write_light};
use super::memory::{self, DEFAULT_MEMORY_BYTES, peak_rss_bytes, preprocess_bytes};
use super::output::Output;
use super::rounding::rounding_m;
use super::threads::Threads;
use super::tiles::put_checks;
use crate::error::{Error, ErrorKind, Result};
use crate::grid::Grid;
use crate::light::{Day, Earth, LightOptions};
use crate::progress::Progress;
use crate::pyramid::{Filter, rounding_step};
use crate::source::{self, Description, Destepped, HeightSource};
use crate::terrain::layout::Layout;
use crate::terrain::{self, LightMeta, Meta, SourceStamp, TerrainWriter};

/// How to make a terrain file.
#[derive(Clone, Debug, PartialEq)]
pub struct PreprocessOptions {
    /// The light to trace; none leaves it out of the file.
    pub light: Option<LightOptions>,
    /// The day whose light is traced beside that; only with light, whose sky it shares.
    pub day: Option<Day>,
    /// Whether light is traced over the earth's curve, with which coefficient of refraction; see [`Earth::of`].
    pub curvature: Option<f64>,
    /// The filter that makes the levels above 0.
    pub filter: Filter,
    /// Whether level 0 is freed of the steps of whole numbers first, by [`Destepped`].
    pub destep: bool,
    /// Whether to replace a target that exists.
    pub force: bool,
    /// A DEM that needs more memory than this is refused.
    pub memory_bytes: u64,
    /// Threads to work on; 0 stands for one a processor. The file does not depend on it.
    pub threads: usize,
    /// The DEM's file. Without a name, the source's own.
    pub source: SourceStamp,
}

impl Default for PreprocessOptions {
    fn default() -> Self {
        Self {
            light: Some(LightOptions::default()),
            day: None,
            curvature: None,
            filter: Filter::default(),
            destep: false,
            force: false,
            memory_bytes: DEFAULT_MEMORY_BYTES,
            threads: 0,
            source: SourceStamp::default(),
        }
    }
}

/// What preprocessing took and cost.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PreprocessReport {
    /// Seconds that the work waited for the DEM to be read, which goes on beside it.
    pub read_s: f64,
    /// Seconds to filter the heights into levels.
    pub pyramid_s: f64,
    /// Seconds to read heights back and measure the bounds.
    pub bounds_s: f64,
    /// Seconds to read heights back and trace the sun's share.
    pub sun_s: f64,
    /// Seconds to trace the sky's share, and to filter both into levels.
    pub sky_s: f64,
    /// Seconds to trace the light of a day, and to filter it into levels.
    pub day_s: f64,
    /// Seconds to compress and write the file, and to have it on the disk.
    pub write_s: f64,
    /// Seconds in all.
    pub total_s: f64,
    /// Samples of the DEM.
    pub samples: u64,
    /// The most, in metres, by which a sample of a level above 0 leaves the range of level 0.
    pub overshoot_m: f64,
    /// Upper bound of what rounding the source's heights to f32 cost, in metres; 0 where none was rounded.
    pub rounding_m: f64,
    /// Patches whose stored error was found anew by brute force, which is never above it; 0 where bounds were copied.
    pub checked_patches: u64,
    /// The median of true over stored error of these patches; none where all errors are 0.
    pub error_ratio_median: Option<f64>,
    /// The least of these.
    pub error_ratio_least: Option<f64>,
    /// The most memory that the process has held at once, where the system tells.
    pub peak_rss_bytes: Option<u64>,
    /// Threads worked on.
    pub threads: usize,
}

/// Makes the terrain file `out` of `source`.
///
/// The file is written beside `out` under another name and gets its own when it is whole; after an error or a
/// cancellation nothing is left. The same input and options give the same bytes.
///
/// # Errors
/// [`ErrorKind::Misuse`] where `out` exists and `force` is not set, is the source itself, or the options make
/// no sense; [`ErrorKind::Limit`] where the DEM needs more memory than is allowed; [`ErrorKind::Cancelled`]; and
/// what reading and writing meet.
pub fn preprocess(
    source: &dyn HeightSource,
    out: &Path,
    options: &PreprocessOptions,
    progress: &dyn Progress,
) -> Result<PreprocessReport> {
    let destepped = options.destep.then(|| Destepped::new(source)).transpose()?;
    let description = source.description();
    let stamp = match options.source.name.as_str() {
        "" => SourceStamp {
            name: description.name.clone(),
            ..options.source.clone()
        },
        _ => options.source.clone(),
    };
    refuse_own_input(&stamp.name, out)?;
    if let Some(light) = &options.light {
        light.sun.check()?;
    }
    let earth = Earth::of(&description.grid, description.place.as_ref(), options.curvature)
        .map_err(|e| e.about(&description.name))?;
    check_day(options)?;
    let read: &dyn HeightSource = destepped.as_ref().map_or(source, |destepped| destepped);
    let (light, day) = (options.light.is_some(), options.day.is_some());
    let needed = |grid: &Grid| preprocess_bytes(grid, light, day, read.held_bytes());
    let advice = match (light, day) {
        (_, true) => "leave out the day, or cut the DEM",
        (true, _) => "leave out the light, or cut the DEM",
        _ => "or cut the DEM",
    };
    memory::check(
        &description.name,
        &description.grid,
        needed,
        options.memory_bytes,
        advice,
    )?;
    let rounding_step_m = description
        .step_m
        .map(|step| {
            let what = || format!("a height step of {step} m is not above 0 and finite");
            rounding_step(step).ok_or_else(|| Error::new(ErrorKind::Misuse, &description.name, what()))
        })
        .transpose()?;
    // A step of level 1 is two of level 0: twice the quantum there is the same of slopes.
    let quanta_m = destepped.as_ref().map(|destepped| 2.0 * destepped.quantum_m());
    let rounding_step_m = quanta_m.or(rounding_step_m);
    Layout::new(&description.grid, light, day)
        .map_err(|what| Error::new(ErrorKind::Limit, &description.name, what).advice("cut the DEM"))?;
    let threads = Threads::new(options.threads)?;
    let (output, file) = Output::create(out, options.force)?;

    let meta = Meta {
        destep_m: destepped.as_ref().map(Destepped::step_m),
        ..describe(description, rounding_step_m, options, &earth, stamp)
    };
    let steps = || {
        let clock = Clock::start();
        let mut report = PreprocessReport {
            samples: description.grid.size.samples() as u64,
            threads: threads.count(),
            ..PreprocessReport::default()
        };
        let buffered = BufWriter::with_capacity(1 << 20, &file);
        let mut writer = TerrainWriter::new(buffered, &meta)?;
        let found = write_heights(
            read,
            &mut writer,
            &options.filter,
            rounding_step_m,
            &threads,
            progress,
        )?;
        report.overshoot_m = found.overshoot_m.into();
        report.rounding_m = rounding_m(description, found.greatest_m);
        (report.read_s, report.pyramid_s, report.write_s) = (found.read_s, found.pyramid_s, found.write_s);

        let name = out.display().to_string();
        let heights = writer.readable(&name, &meta, || source::open_file(output.temporary()))?;
        // Each pass reads a tile once, so that nothing is kept unless all of it can be, for light to be traced over.
        let left = options.memory_bytes - needed(&description.grid);
        let (rows, cache_bytes) = match options.light {
            Some(_) => memory::light_room(&description.grid, options.day.is_some(), left),
            None => (0, 0),
        };
        let all = memory::decoded_bytes(&description.grid) <= cache_bytes as u64;
        let heights = heights.with_cache(if all { cache_bytes } else { 0 });
        let (took, crests) = write_bounds(&heights, &mut writer, &threads, progress)?;
        report.bounds_s = took.bounds_s;
        report.write_s += took.write_s;
        report.checked_patches = took.tight.patches;
        [report.error_ratio_median, report.error_ratio_least] = match took.tight.median_and_least {
            Some(ratios) => ratios.map(Some),
            None => [None; 2],
        };
        if let Some(light) = &options.light {
            let heights = if all {
                heights
            } else {
                heights.with_cache(cache_bytes)
            };
            let lit = Lit {
                options: light,
                earth: &earth,
                filter: &options.filter,
            };
            let blocks = Blocks::new(&heights, crests, rows);
            let took = write_light(&blocks, &mut writer, &lit, &threads, progress)?;
            (report.sun_s, report.sky_s) = (took.sun_s, took.sky_s);
            report.write_s += took.write_s;
            if let Some(day) = &options.day {
                let filter = &options.filter;
                let [day_s, write_s] =
                    write_day(&blocks, &mut writer, day, &earth, filter, &threads, progress)?;
                report.day_s = day_s;
                report.write_s += write_s;
            }
        }
        let mut clock = clock;
        clock.lap();
        put_checks(&mut writer, &threads, progress)?;
        writer.finish()?;
        Ok((report, clock))
    };
    let result: Result<(PreprocessReport, Clock)> = steps();
    let (mut report, mut clock) = match result {
        Err(e) if e.kind() == ErrorKind::Cancelled => return Err(Error::cancelled(&description.name)),
        Err(e) if e.subject() == "terrain file" => return Err(e.about(out.display())),
        other => other?,
    };
    output.publish(&file)?;
    report.write_s += clock.lap();
    report.total_s = clock.total();
    report.peak_rss_bytes = peak_rss_bytes();
    Ok(report)
}

/// Time by laps.
struct Clock {
    start: Instant,
    lap: Instant,
}

impl Clock {
    fn start() -> Self {
        let now = Instant::now();
        Self { start: now, lap: now }
    }

    /// Seconds since the last lap.
    fn lap(&mut self) -> f64 {
        let now = Instant::now();
        let lap = now - std::mem::replace(&mut self.lap, now);
        lap.as_secs_f64()
    }

    fn total(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }
}

/// Light over a day stands beside the light of one sun.
pub(super) fn check_day(options: &PreprocessOptions) -> Result<()> {
    if options.day.is_some() && options.light.is_none() {
        let what = "a day is asked for and no light";
        return Err(Error::new(ErrorKind::Misuse, "day", what).advice("trace light too"));
    }
    Ok(())
}

/// Replacing a DEM by what was made of it would lose it.
fn refuse_own_input(name: &str, out: &Path) -> Result<()> {
    match (std::fs::canonicalize(name), std::fs::canonicalize(out)) {
        (Ok(input), Ok(target)) if input == target => {
            Err(
                Error::new(ErrorKind::Misuse, out.display(), "is the input itself")
                    .advice("choose another name"),
            )
        }
        _ => Ok(()),
    }
}

fn describe(
    description: &Description,
    rounding_step_m: Option<f64>,
    options: &PreprocessOptions,
    earth: &Earth,
    source: SourceStamp,
) -> Meta {
    let mut assumed = description.assumed.clone();
    let earth = options.light.map(|_| *earth);
    Earth::assume(
        earth.as_ref(),
        description.place.as_ref(),
        &description.grid,
        &mut assumed,
    );
    Meta {
        grid: description.grid,
        place: description.place.clone(),
        vertical_unit: description.vertical_unit.clone(),
        filter: options.filter.kind().name().into(),
        lobes: options.filter.lobes(),
        rounding_step_m,
        destep_m: None,
        light: options.light.map(|light| LightMeta {
            sun_azimuth_deg: light.sun.azimuth_deg,
            sun_altitude_deg: light.sun.altitude_deg,
            sky_directions: light.sky_directions,
        }),
        day: options.day,
        source,
        tool: terrain::TOOL.into(),
        assumed,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_report_has_the_names_of_the_statistics() {
        let report = serde_json::to_value(PreprocessReport::default()).unwrap();
        let mut names: Vec<&str> = report.as_object().unwrap().keys().map(String::as_str).collect();
        names.sort_unstable();
        let mut want = vec![
            "read_s",
            "pyramid_s",
            "bounds_s",
            "sun_s",
            "sky_s",
            "day_s",
            "write_s",
            "total_s",
            "samples",
            "overshoot_m",
            "rounding_m",
            "checked_patches",
            "error_ratio_median",
            "error_ratio_least",
            "peak_rss_bytes",
            "threads",
        ];
        want.sort_unstable();
        assert_eq!(names, want);
        assert!(report["peak_rss_bytes"].is_null());
    }
}
