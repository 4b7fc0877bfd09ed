//! Lights a terrain file anew: its heights and bounds are copied, its light is traced and filtered again.

use std::io::BufWriter;
use std::path::Path;
use std::time::Instant;

use super::blocks::{Blocks, crests};
use super::day::write_day;
use super::light::{Lit, write_light};
use super::memory::{self, peak_rss_bytes, preprocess_bytes};
use super::output::Output;
use super::preprocess::{PreprocessOptions, PreprocessReport, check_day};
use super::threads::Threads;
use super::tiles::put_checks;
use crate::error::{Error, ErrorKind, Result};
use crate::grid::Grid;
use crate::light::Earth;
use crate::progress::Progress;
use crate::pyramid::{Filter, FilterKind};
use crate::terrain::layout::Kind;
use crate::terrain::{self, DEFAULT_CACHE_BYTES, LightMeta, Meta, TerrainFile, TerrainWriter};

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
    let mut traced_rows = 0;
    if let Some(light) = &options.light {
        light.sun.check()?;
        check_day(options)?;
        // The file's own cache is what holds tiles.
        let day = options.day.is_some();
        let needed = |grid: &Grid| preprocess_bytes(grid, true, day, DEFAULT_CACHE_BYTES as u64);
        memory::check(
            file.name(),
            grid,
            needed,
            options.memory_bytes,
            if day {
                "or leave out the day"
            } else {
                "or leave out the light"
            },
        )?;
        (traced_rows, _) = memory::light_room(grid, day, options.memory_bytes - needed(grid));
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
        let named = |e: Error| match e.subject() {
            "terrain file" => e.about(out.display()),
            _ => e,
        };
        let written = Instant::now();
        let meta = describe(file, options, &earth);
        let buffered = BufWriter::with_capacity(1 << 20, &target);
        let mut writer = TerrainWriter::new(buffered, &meta).map_err(named)?;
        let mut rows = writer.layout().order();
        rows.retain(|row| {
            matches!(
                writer.layout().parts()[row.part].kind,
                Kind::Height | Kind::Bounds
            )
        });
        let tiles: i64 = rows
            .iter()
            .map(|row| writer.layout().parts()[row.part].tiles().width)
            .sum();
        progress.begin("copy", tiles as u64);
        writer.copy(rows, file, &threads, progress).map_err(named)?;
        report.write_s = written.elapsed().as_secs_f64();
        if let Some(light) = &options.light {
            let start = Instant::now();
            let crests = crests(file, &threads, progress)?;
            report.sun_s = start.elapsed().as_secs_f64();
            let lit = Lit {
                options: light,
                earth: &earth,
                filter: &filter,
            };
            let blocks = Blocks::new(file, crests, traced_rows);
            let took = write_light(&blocks, &mut writer, &lit, &threads, progress).map_err(named)?;
            report.sun_s += took.sun_s;
            report.sky_s = took.sky_s;
            report.write_s += took.write_s;
            if let Some(day) = &options.day {
                let made = write_day(&blocks, &mut writer, day, &earth, &filter, &threads, progress);
                let [day_s, write_s] = made.map_err(named)?;
                report.day_s = day_s;
                report.write_s += write_s;
            }
        }
        let written = Instant::now();
        put_checks(&mut writer, &threads, progress).map_err(named)?;
        writer.finish().map_err(named)?;
        output.publish(&target)?;
        report.write_s += written.elapsed().as_secs_f64();
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
