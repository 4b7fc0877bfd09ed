//! The first pass: bands of the DEM in, the heights of all levels out, as tiles.
//!
//! Each level takes rows from the next finer one as they come to be known ([`Halving`]) and holds them until a row of
//! tiles is due in the order of the file. Of level 0 a band is a row of tiles. What is held does not depend on the DEM's
//! height: for each column of level 0 two bands (2 KiB), and of the coarser levels 384, 320, 320, ... rows, in all 1.4 KiB.

use std::io::{Seek, Write};
use std::time::Instant;

use super::bands::{BAND_ROWS, Band, each_band};
use super::tiles::{Tiles, put_tiles};
use crate::error::Result;
use crate::grid::Size;
use crate::progress::Progress;
use crate::pyramid::{Filter, Halving, excess, range, valid};
use crate::source::HeightSource;
use crate::terrain::TerrainWriter;
use crate::terrain::layout::{Kind, TILE, TileRow};
use crate::work::{Work, each_chunk};

/// Rows of a coarser level that are held at the most: those of a row of tiles, and what is known beyond it when it is due.
const HELD_ROWS: i64 = 400;

/// What the first pass found and took.
#[derive(Debug, Default)]
pub(super) struct Found {
    /// The most by which a level above 0 leaves the range of level 0, in metres.
    pub(super) overshoot_m: f32,
    /// The greatest finite height in size, in metres, as the source gave it.
    pub(super) greatest_m: f32,
    /// Seconds that the work waited for the source.
    pub(super) read_s: f64,
    /// Seconds of filtering.
    pub(super) pyramid_s: f64,
    /// Seconds of compressing and writing.
    pub(super) write_s: f64,
}

/// A level above 0.
struct Level {
    size: Size,
    /// Makes this level of the next finer one.
    halving: Halving,
    /// Rows that are not yet written, from `first` on.
    rows: Vec<f32>,
    first: i64,
    range: (f32, f32),
}

/// Reads `source`, filters it into all levels, rounded to `rounding_m` above level 0, and puts their tiles.
///
/// # Errors
/// What reading and writing meet; [`crate::ErrorKind::Cancelled`].
pub(super) fn write_heights<W: Write + Seek + Sync + Send>(
    source: &dyn HeightSource,
    writer: &mut TerrainWriter<W>,
    filter: &Filter,
    rounding_m: Option<f64>,
    work: &dyn Work,
    progress: &dyn Progress,
) -> Result<Found> {
    let grid = source.description().grid;
    progress.begin("heights", grid.size.samples() as u64);
    let mut levels: Vec<Level> = (1..grid.file_levels())
        .map(|l| {
            let size = grid.level(l);
            Level {
                size,
                halving: Halving::new(grid.level(l - 1), filter, rounding_m),
                rows: Vec::with_capacity((HELD_ROWS.min(size.height) * size.width) as usize),
                first: 0,
                range: (f32::NAN, f32::NAN),
            }
        })
        .collect();
    let mut due = writer.layout().order_of(Kind::Height).into_iter().peekable();
    let mut found = Found::default();
    let mut range_of_0 = (f32::NAN, f32::NAN);

    let waited_s = each_band(source, progress, |band| {
        let start = Instant::now();
        let (greatest, range) = clean(band, grid.size.width, work);
        found.greatest_m = found.greatest_m.max(greatest);
        range_of_0 = joined(range_of_0, range);
        let mut from = (&band.heights[..], 0);
        for level in &mut levels {
            let known = level.rows.len();
            level.halving.take(&from.0[from.1..], work, &mut level.rows);
            level.range = joined(level.range, range_of(&level.rows[known..], work));
            from = (&level.rows, known);
        }
        found.pyramid_s += start.elapsed().as_secs_f64();

        let start = Instant::now();
        let seen = band.z0 + band.heights.len() as i64 / grid.size.width;
        while let Some(row) = due.next_if(|row| row.seen <= seen) {
            let l = writer.layout().parts()[row.part].level as usize;
            if l == 0 {
                debug_assert_eq!((row.y * TILE, BAND_ROWS), (band.z0, TILE));
                put_heights(writer, row, grid.size, &band.heights, work, progress)?;
            } else {
                let level = &mut levels[l - 1];
                let count = TILE.min(level.size.height - level.first) * level.size.width;
                put_heights(
                    writer,
                    row,
                    level.size,
                    &level.rows[..count as usize],
                    work,
                    progress,
                )?;
                level.rows.drain(..count as usize);
                level.first += TILE;
            }
        }
        found.write_s += start.elapsed().as_secs_f64();
        progress.advance(band.heights.len() as u64);
        Ok(())
    })?;
    found.read_s = waited_s;
    found.overshoot_m = levels
        .iter()
        .fold(0.0, |most, l| most.max(excess(range_of_0, l.range)));
    Ok(found)
}

/// Puts a row of tiles of a level of `size` samples, whose rows are `heights`.
fn put_heights<W: Write + Seek + Sync + Send>(
    writer: &mut TerrainWriter<W>,
    row: TileRow,
    size: Size,
    heights: &[f32],
    work: &dyn Work,
    progress: &dyn Progress,
) -> Result<()> {
    let tiles = Tiles {
        row,
        width: size.width,
        samples: bytemuck::cast_slice::<f32, [f32; 1]>(heights),
        fields: [0],
    };
    put_tiles(writer, &tiles, work, progress)
}

/// Makes a band's heights as they are stored, with one NaN for no data; their greatest size as given, and their range.
fn clean(band: &mut Band, width: i64, work: &dyn Work) -> (f32, (f32, f32)) {
    let found = std::sync::Mutex::new((0f32, (f32::NAN, f32::NAN)));
    each_chunk(work, &mut band.heights, 16 * width as usize, |_, heights| {
        let mut greatest = 0f32;
        for h in heights.iter_mut() {
            let size = h.abs();
            greatest = if size > greatest && size < f32::INFINITY {
                size
            } else {
                greatest
            };
            *h = valid(*h);
            *h = if h.is_nan() { f32::NAN } else { *h };
        }
        let range = range(heights);
        let mut found = found.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        *found = (found.0.max(greatest), joined(found.1, range));
    });
    found
        .into_inner()
        .unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// The range of many samples.
fn range_of(samples: &[f32], work: &dyn Work) -> (f32, f32) {
    const CHUNK: usize = 1 << 16;
    let found = std::sync::Mutex::new((f32::NAN, f32::NAN));
    work.each(samples.len().div_ceil(CHUNK), &|n| {
        let range = range(&samples[n * CHUNK..samples.len().min((n + 1) * CHUNK)]);
        let mut found = found.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        *found = joined(*found, range);
    });
    found
        .into_inner()
        .unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// The range of both; f32's min and max take the other where one is NaN.
fn joined(a: (f32, f32), b: (f32, f32)) -> (f32, f32) {
    (a.0.min(b.0), a.1.max(b.1))
}
