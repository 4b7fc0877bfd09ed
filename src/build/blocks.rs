//! Light of any kind traced over the heights of a terrain file, and put as tiles where those were just written.
//!
//! The heights are read back through the file's cache of tiles: some rows of blocks at once, and whatever lies towards
//! the light as far as it may matter. How many rows and how much of that is kept changes the time, and nothing else: a far
//! tile is read again for the next rows where it has not stayed.
//! Few rows at a time are then filtered: each level takes rows from the next finer one as they come to be known, and a row
//! of tiles is put as soon as it is known whole and all before it are put. So what is held does not depend on the DEM's
//! height.

use std::io::{Seek, Write};
use std::ops::Range;
use std::time::Instant;

use super::tiles::put_packed;
use crate::error::{Error, Result};
use crate::grid::Rect;
use crate::levels::Levels;
use crate::light::{Crests, Ground, Relief};
use crate::progress::Progress;
use crate::terrain::layout::{Kind, TILE};
use crate::terrain::{TerrainFile, TerrainWriter};
use crate::work::Work;

/// Rows that are filtered at once.
const BAND: i64 = 16;

/// The heights of a terrain file as light is traced over them.
pub(super) struct Blocks<'a> {
    heights: &'a TerrainFile,
    relief: Relief<'a>,
    /// Rows that are traced at once.
    rows: i64,
}

/// A kind of light while it is traced and filtered.
pub(super) trait Traced: Sync {
    /// What is put.
    const KIND: Kind;

    /// What it is called while it is made.
    const NAME: &str;

    /// Bytes of a sample of it.
    const SAMPLE_BYTES: usize;

    /// Traces `rows` of level 0 over `relief`: the next ones.
    ///
    /// # Errors
    /// What the ground meets; [`crate::ErrorKind::Cancelled`].
    fn trace(
        &mut self,
        relief: &Relief<'_>,
        rows: Range<i64>,
        work: &dyn Work,
        progress: &dyn Progress,
    ) -> Result<()>;

    /// Filters some of the rows that were traced last, by their numbers among these: the next ones.
    fn filter(&mut self, rows: Range<i64>, work: &dyn Work);

    /// The rows of `level`, from the north, that can be packed.
    fn known(&self, level: u32) -> i64;

    /// Makes rows of `level` ready to be packed.
    fn ready(&mut self, level: u32, rows: Range<i64>, work: &dyn Work);

    /// Lays columns of the rows that are ready out as a tile.
    fn pack(&self, columns: Range<i64>) -> Vec<u8>;

    /// Forgets the rows that are ready, as they are put.
    fn forget(&mut self);
}

impl Ground for TerrainFile {
    fn copy(&self, rect: Rect, stride: usize, out: &mut [f32]) -> Result<()> {
        self.heights_strided(0, rect, stride, out)
    }
}

impl<'a> Blocks<'a> {
    /// Those of `heights`, whose crests are `crests`, traced `rows` at once, a multiple of [`crate::light::ROWS`].
    pub(super) fn new(heights: &'a TerrainFile, crests: Crests, rows: i64) -> Self {
        Self {
            heights,
            relief: Relief::new(heights.grid(), heights, crests),
            rows,
        }
    }

    /// The file.
    pub(super) fn heights(&self) -> &TerrainFile {
        self.heights
    }

    /// Traces and filters `traced`, and puts all of its tiles. Returns the seconds of compressing and writing.
    ///
    /// # Errors
    /// Those of tracing and of the file; [`crate::ErrorKind::Cancelled`].
    pub(super) fn write<W: Write + Seek + Sync + Send, T: Traced>(
        &self,
        traced: &mut T,
        writer: &mut TerrainWriter<W>,
        work: &dyn Work,
        progress: &dyn Progress,
    ) -> Result<f64> {
        let mut write_s = 0.0;
        let grid = *self.heights.grid();
        let mut due = writer.layout().order_of(T::KIND).into_iter().peekable();
        progress.begin(T::NAME, grid.size.samples() as u64);
        for z0 in (0..grid.size.height).step_by(self.rows as usize) {
            if progress.cancelled() {
                return Err(Error::cancelled(self.heights.name()));
            }
            let z1 = (z0 + self.rows).min(grid.size.height);
            hold(self.heights, z0..z1, work)?;
            traced.trace(&self.relief, z0..z1, work, progress)?;
            for from in (0..z1 - z0).step_by(BAND as usize) {
                traced.filter(from..(from + BAND).min(z1 - z0), work);
                let start = Instant::now();
                let end = |y: i64, level: u32| ((y + 1) * TILE).min(grid.level(level).height);
                while let Some(row) = due.peek().copied() {
                    let level = writer.layout().parts()[row.part].level;
                    let rows = row.y * TILE..end(row.y, level);
                    if traced.known(level) < rows.end {
                        break;
                    }
                    due.next();
                    traced.ready(level, rows, work);
                    let width = grid.level(level).width;
                    put_packed(writer, row, T::SAMPLE_BYTES, work, progress, |x| {
                        traced.pack(x * TILE..((x + 1) * TILE).min(width))
                    })?;
                    traced.forget();
                }
                write_s += start.elapsed().as_secs_f64();
            }
            progress.advance((grid.size.width * (z1 - z0)) as u64);
        }
        debug_assert!(due.next().is_none(), "all is known in the end");
        Ok(write_s)
    }
}

/// Has the tiles in the cache that `rows` are likely to ask for next, each read once.
fn hold(heights: &TerrainFile, rows: Range<i64>, work: &dyn Work) -> Result<()> {
    let size = heights.grid().size;
    let wide = (size.width as u64).div_ceil(TILE as u64) as usize;
    // Their own, of which the rows before have asked for the first, and the next, which lie in the way of half of all
    // light.
    let first = if rows.start == 0 { 0 } else { rows.start / TILE + 1 };
    let tiles = first..(rows.end - 1) / TILE + 2;
    for z in tiles.filter(|z| z * TILE < size.height) {
        let failed = std::sync::Mutex::new(None);
        work.each(wide, &|x| {
            if let Err(error) = heights.hold_heights(0, x as i64, z) {
                *failed.lock().unwrap_or_else(std::sync::PoisonError::into_inner) = Some(error);
            }
        });
        if let Some(error) = failed
            .into_inner()
            .unwrap_or_else(std::sync::PoisonError::into_inner)
        {
            return Err(error);
        }
    }
    Ok(())
}

/// The crests of a terrain file, whose heights are read once for them.
///
/// # Errors
/// Those of the file; [`crate::ErrorKind::Cancelled`].
pub(super) fn crests(heights: &TerrainFile, work: &dyn Work, progress: &dyn Progress) -> Result<Crests> {
    let grid = heights.grid();
    let mut crests = Crests::new(grid);
    progress.begin("crests", grid.size.samples() as u64);
    for z0 in (0..grid.size.height).step_by(TILE as usize) {
        if progress.cancelled() {
            return Err(Error::cancelled(heights.name()));
        }
        let z1 = (z0 + TILE).min(grid.size.height);
        let measured = super::bounds::each_tile(grid.size.width, work, |x0, x1| {
            let rect = Rect::new(x0, z0, x1, z1);
            let mut samples = vec![0.0; rect.area() as usize];
            heights.heights_strided(0, rect, rect.width() as usize, &mut samples)?;
            Ok((rect, Crests::measure(&samples, rect.width() as usize)))
        })?;
        measured.iter().for_each(|(rect, most)| crests.put(*rect, most));
        progress.advance((grid.size.width * (z1 - z0)) as u64);
    }
    Ok(crests)
}
