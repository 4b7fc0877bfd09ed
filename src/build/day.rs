//! The fourth pass: light over a day traced over the heights of a terrain file, put as tiles where that was just written.
//!
//! Level 0 and all that is known of its day are held whole, which [`super::memory`] counts.

use std::io::{Seek, Write};
use std::time::Instant;

use super::tiles::{Tiles, put_tiles};
use crate::error::{Error, Result};
use crate::grid::Rect;
use crate::levels::{Arrival, DaySample, Levels};
use crate::light::{Day, Earth, day_levels, trace_day};
use crate::progress::Progress;
use crate::pyramid::Filter;
use crate::terrain::layout::{Kind, TILE};
use crate::terrain::{DAY_FIELDS, TerrainFile, TerrainWriter};
use crate::work::Work;

/// Traces the light of `day` over `heights` on `earth`, filters it into all levels and puts them. Returns the seconds of
/// tracing and filtering, and of writing.
///
/// # Errors
/// Those of tracing and of the file; [`crate::ErrorKind::Cancelled`].
pub(super) fn write_day<W: Write + Seek + Sync + Send>(
    heights: &TerrainFile,
    writer: &mut TerrainWriter<W>,
    day: &Day,
    earth: &Earth,
    filter: &Filter,
    work: &dyn Work,
    progress: &dyn Progress,
) -> Result<[f64; 2]> {
    let start = Instant::now();
    let levels = trace(heights, day, earth, filter, work, progress)?;
    let traced_s = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let grid = *heights.grid();
    let order = writer.layout().order_of(Kind::Day);
    progress.begin("write day", order.len() as u64);
    for row in order {
        let level = writer.layout().parts()[row.part].level;
        let size = grid.level(level);
        let rows = row.y * TILE..((row.y + 1) * TILE).min(size.height);
        let samples =
            &levels[level as usize][(rows.start * size.width) as usize..(rows.end * size.width) as usize];
        let samples: Vec<[u16; 5]> = samples.iter().map(fields).collect();
        let tiles = Tiles {
            row,
            width: size.width,
            samples: &samples,
            fields: DAY_FIELDS,
        };
        put_tiles(writer, &tiles, work, progress)?;
        progress.advance(1);
    }
    Ok([traced_s, start.elapsed().as_secs_f64()])
}

/// A sample without what only fills its words.
fn fields(sample: &DaySample) -> [u16; 5] {
    let all: [u16; 6] = bytemuck::cast(*sample);
    [all[0], all[1], all[2], all[3], all[4]]
}

/// The light over `day` of all levels of `heights` on `earth`.
///
/// # Errors
/// Those of tracing and of the file; [`crate::ErrorKind::Cancelled`].
fn trace(
    heights: &TerrainFile,
    day: &Day,
    earth: &Earth,
    filter: &Filter,
    work: &dyn Work,
    progress: &dyn Progress,
) -> Result<Vec<Vec<DaySample>>> {
    let level_0 = read_level_0(heights, progress)?;
    let traced = trace_day(&level_0, heights.grid(), earth, day, work, progress)?;
    day_levels(heights.grid(), &level_0, traced, filter, work, progress)
}

/// All heights of level 0, a row of tiles at a time.
fn read_level_0(file: &TerrainFile, progress: &dyn Progress) -> Result<Vec<f32>> {
    let size = file.grid().size;
    let mut heights = vec![f32::NAN; size.samples() as usize];
    progress.begin("read back", heights.len() as u64);
    let rows = heights.chunks_mut((TILE * size.width) as usize);
    for (z0, rows) in (0..size.height).step_by(TILE as usize).zip(rows) {
        if progress.cancelled() {
            return Err(Error::cancelled(file.name()));
        }
        let rect = Rect::new(0, z0, size.width, (z0 + TILE).min(size.height));
        let arrival = file.heights(0, rect, rows)?;
        debug_assert_eq!(arrival, Arrival::Arrived, "a file has all of its tiles");
        progress.advance(rows.len() as u64);
    }
    Ok(heights)
}
