//! Lights a terrain file anew: its heights and bounds are copied, its light is traced and filtered again.

use std::io::BufWriter;
use std::path::Path;
use std::time::Instant;

use super::day;
use super::light::trace;
use super::memory::{self, needed_bytes, peak_rss_bytes};
use super::output::Output;
use super::preprocess::{PreprocessOptions, PreprocessReport, check_day};
use super::threads::Threads;
use crate::error::{Error, ErrorKind, Result};
use crate::grid::{Grid, Rect};
use crate::levels::{Arrival, Bounds, DaySample, Levels, LightSample};
use crate::light::Earth;
use crate::progress::Progress;
use crate::pyramid::{Filter, FilterKind};
use crate::terrain::{self, LightMeta, Meta, TerrainFile};

/// Makes the terrain file `out` of `file`, with the light and day that `options` say, or none, in place of its own. Heights and
/// bounds are those of `file`, to the bit, and so are the bytes of their tiles where this version made them. `out` may
/// be `file` itself, where `force` is set: it is replaced when the new file is whole.
///
/// Of `options`, those on the DEM (filter, source) are not used: light is filtered as the file's levels were.
///
/// # Errors
/// [`ErrorKind::Misuse`] where `out` exists and `force` is not set, or the options make no sense;
/// [`ErrorKind::Unsupported`] where the file's filter is not known; [`ErrorKind::Limit`] where that takes more memory
/// than is allowed; [`ErrorKind::Cancelled`]; and what reading and writing meet.
pub fn relight(
    file: &TerrainFile,
    out: &Path,
    options: &PreprocessOptions,
    progress: &dyn Progress,
) -> Result<PreprocessReport> {
    let Meta { grid, place, .. } = file.meta();
    let filter = filter_of(file)?;
    if let Some(light) = &options.light {
        light.sun.check()?;
        check_day(options)?;
        let needed = |grid: &Grid| match options.day {
            Some(_) => memory::day_bytes(grid),
            None => needed_bytes(grid, true),
        };
        memory::check(
            file.name(),
            grid,
            needed,
            options.memory_bytes,
            "or leave out the light",
        )?;
    }
    let earth = Earth::of(grid, place.as_ref(), options.curvature).map_err(|e| e.about(file.name()))?;
    let threads = Threads::new(options.threads)?;
    let start = Instant::now();
    let (output, target) = Output::create(out, options.force)?;
    let mut report = PreprocessReport {
        samples: grid.size.samples() as u64,
        threads: threads.count(),
        ..PreprocessReport::default()
    };
    let steps = |report: &mut PreprocessReport| -> Result<()> {
        let light = match &options.light {
            Some(light) => {
                let (light, took) = trace(file, light, &earth, &filter, &threads, progress)?;
                (report.sun_s, report.sky_s) = (took.sun_s, took.sky_s);
                light
            }
            None => Vec::new(),
        };
        let traced = Instant::now();
        let day = match &options.day {
            Some(day) => day::trace(file, day, &earth, &filter, &threads, progress)?,
            None => Vec::new(),
        };
        report.day_s = traced.elapsed().as_secs_f64();
        let written = Instant::now();
        let meta = describe(file, options, &earth);
        let relit = Relit { file, light, day };
        terrain::write(
            BufWriter::with_capacity(1 << 20, &target),
            &meta,
            &relit,
            &threads,
            progress,
        )
        .map_err(|e| match e.subject() {
            "terrain file" => e.about(out.display()),
            _ => e,
        })?;
        output.publish(&target)?;
        report.write_s = written.elapsed().as_secs_f64();
        Ok(())
    };
    match steps(&mut report) {
        Err(e) if e.kind() == ErrorKind::Cancelled => Err(Error::cancelled(file.name())),
        Err(e) => Err(e),
        Ok(()) => {
            report.total_s = start.elapsed().as_secs_f64();
            report.peak_rss_bytes = peak_rss_bytes();
            Ok(report)
        }
    }
}

/// The filter that made the levels of a file.
fn filter_of(file: &TerrainFile) -> Result<Filter> {
    let Meta { filter, lobes, .. } = file.meta();
    let known = filter.parse::<FilterKind>().ok().map(Filter::from);
    known.filter(|known| known.lobes() == *lobes).ok_or_else(|| {
        let what = format!(
            "its levels were made by the filter {filter:?} of {lobes} lobes, which is not known here"
        );
        Error::new(ErrorKind::Unsupported, file.name(), what).advice("preprocess the DEM that it was made of")
    })
}

/// What the new file says of itself.
fn describe(file: &TerrainFile, options: &PreprocessOptions, earth: &Earth) -> Meta {
    let mut meta = file.meta().clone();
    meta.light = options.light.map(|light| LightMeta {
        sun_azimuth_deg: light.sun.azimuth_deg,
        sun_altitude_deg: light.sun.altitude_deg,
        sky_directions: light.sky_directions,
    });
    meta.day = options.day;
    meta.tool = terrain::TOOL.into();
    let earth = options.light.map(|_| *earth);
    Earth::assume(earth.as_ref(), meta.place.as_ref(), &meta.grid, &mut meta.assumed);
    meta
}

/// A terrain file with other light, or none.
struct Relit<'a> {
    file: &'a TerrainFile,
    light: Vec<Vec<LightSample>>,
    day: Vec<Vec<DaySample>>,
}

impl Levels for Relit<'_> {
    fn grid(&self) -> &Grid {
        self.file.grid()
    }

    fn heights(&self, level: u32, rect: Rect, out: &mut [f32]) -> Result<Arrival> {
        self.file.heights(level, rect, out)
    }

    fn bounds(&self, level: u32, patches: Rect, out: &mut [Bounds]) -> Result<Arrival> {
        self.file.bounds(level, patches, out)
    }

    fn has_light(&self) -> bool {
        !self.light.is_empty()
    }

    fn light(&self, level: u32, rect: Rect, out: &mut [LightSample]) -> Result<Arrival> {
        copy(
            &self.light[level as usize],
            self.grid().level(level).width,
            rect,
            out,
        );
        Ok(Arrival::Arrived)
    }

    fn has_day(&self) -> bool {
        !self.day.is_empty()
    }

    fn day(&self, level: u32, rect: Rect, out: &mut [DaySample]) -> Result<Arrival> {
        copy(
            &self.day[level as usize],
            self.grid().level(level).width,
            rect,
            out,
        );
        Ok(Arrival::Arrived)
    }
}

/// Copies `rect` of samples that lie in rows of `width` into `out`.
fn copy<T: Copy>(from: &[T], width: i64, rect: Rect, out: &mut [T]) {
    let rows = out.chunks_mut(rect.width().max(1) as usize);
    for (z, row) in (rect.z0..rect.z1).zip(rows) {
        let first = (z * width + rect.x0) as usize;
        row.copy_from_slice(&from[first..first + row.len()]);
    }
}
