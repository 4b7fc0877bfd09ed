//! The third pass: light traced over the heights of a terrain file, put as tiles where that was just written.
//!
//! What traces it sees the heights of the file alone, all levels of them, and gives the light of each level in the order
//! of the file: [`trace`] is all that a tracer which holds less would replace. Today's holds level 0 and its light whole,
//! which [`super::needed_bytes`] counts.

use std::io::{Seek, Write};
use std::time::Instant;

use super::tiles::{Tiles, put_tiles};
use crate::error::{Error, Result};
use crate::grid::Rect;
use crate::levels::{Arrival, Levels, LightSample};
use crate::light::{Earth, LightOptions, light_levels, sky_share_on, sun_share_on};
use crate::progress::Progress;
use crate::pyramid::Filter;
use crate::terrain::layout::{Kind, TILE};
use crate::terrain::{LIGHT_FIELDS, TerrainFile, TerrainWriter};
use crate::work::Work;

/// Seconds that the third pass took.
#[derive(Debug, Default)]
pub(super) struct Took {
    /// Reading heights back and tracing the sun's share.
    pub(super) sun_s: f64,
    /// Tracing the sky's share, and filtering both.
    pub(super) sky_s: f64,
    /// Compressing and writing.
    pub(super) write_s: f64,
}

/// Traces the light of `heights` on `earth` as `options` say, filters it into all levels and puts them.
///
/// # Errors
/// Those of tracing and of the file; [`crate::ErrorKind::Cancelled`].
pub(super) fn write_light<W: Write + Seek + Sync + Send>(
    heights: &TerrainFile,
    writer: &mut TerrainWriter<W>,
    options: &LightOptions,
    earth: &Earth,
    filter: &Filter,
    work: &dyn Work,
    progress: &dyn Progress,
) -> Result<Took> {
    let (levels, mut took) = trace(heights, options, earth, filter, work, progress)?;
    let start = Instant::now();
    let grid = *heights.grid();
    let order = writer.layout().order_of(Kind::Light);
    progress.begin("write light", order.len() as u64);
    for row in order {
        let level = writer.layout().parts()[row.part].level;
        let size = grid.level(level);
        let rows = row.y * TILE..((row.y + 1) * TILE).min(size.height);
        let samples =
            &levels[level as usize][(rows.start * size.width) as usize..(rows.end * size.width) as usize];
        let tiles = Tiles {
            row,
            width: size.width,
            samples: bytemuck::cast_slice::<_, [u16; 2]>(samples),
            fields: LIGHT_FIELDS,
        };
        put_tiles(writer, &tiles, work, progress)?;
        progress.advance(1);
    }
    took.write_s = start.elapsed().as_secs_f64();
    Ok(took)
}

/// The light of all levels of `heights` on `earth`, as `options` say, and the seconds that its parts took.
///
/// # Errors
/// Those of tracing and of the file; [`crate::ErrorKind::Cancelled`].
pub(super) fn trace(
    heights: &TerrainFile,
    options: &LightOptions,
    earth: &Earth,
    filter: &Filter,
    work: &dyn Work,
    progress: &dyn Progress,
) -> Result<(Vec<Vec<LightSample>>, Took)> {
    let mut took = Took::default();
    let start = Instant::now();
    let grid = heights.grid();
    let level_0 = read_level_0(heights, progress)?;
    let sun = sun_share_on(&level_0, grid, earth, options.sun, work, progress)?;
    took.sun_s = start.elapsed().as_secs_f64();

    let start = Instant::now();
    let sky = sky_share_on(&level_0, grid, earth, options.sky_directions, work, progress)?;
    let levels = light_levels(grid, &level_0, sun, sky, filter, work, progress)?;
    took.sky_s = start.elapsed().as_secs_f64();
    Ok((levels, took))
}

/// All heights of level 0, a row of tiles at a time.
pub(super) fn read_level_0(file: &TerrainFile, progress: &dyn Progress) -> Result<Vec<f32>> {
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
