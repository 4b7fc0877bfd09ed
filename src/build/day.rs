//! The fourth pass: light over a day, traced over the heights of a terrain file.
//!
//! What is held depends on the DEM's width alone: for each column of level 0 10 KiB.

use std::io::{Seek, Write};
use std::ops::Range;
use std::time::Instant;

use super::blocks::{Blocks, Traced};
use crate::error::Result;
use crate::grid::Grid;
use crate::levels::Levels;
use crate::light::{Day, DayLevels, Daylight, Earth, LitTimes, Relief};
use crate::progress::Progress;
use crate::pyramid::Filter;
use crate::terrain::layout::Kind;
use crate::terrain::{DAY_FIELDS, TerrainWriter, pack_columns};
use crate::work::Work;

/// Traces the light of `day` over `blocks` on `earth`, filters it into all levels and puts them. Returns the seconds of
/// tracing and filtering, and of writing.
///
/// # Errors
/// Those of tracing and of the file; [`crate::ErrorKind::Cancelled`].
pub(super) fn write_day<W: Write + Seek + Sync + Send>(
    blocks: &Blocks<'_>,
    writer: &mut TerrainWriter<W>,
    day: &Day,
    earth: &Earth,
    filter: &Filter,
    work: &dyn Work,
    progress: &dyn Progress,
) -> Result<[f64; 2]> {
    let start = Instant::now();
    let grid = *blocks.heights().grid();
    let mut times = Times {
        grid,
        light: Daylight::new(&grid, earth, day)?,
        levels: DayLevels::new(&grid, filter),
        traced: Vec::new(),
        ready: (0, 0..0),
    };
    let write_s = blocks.write(&mut times, writer, work, progress)?;
    Ok([start.elapsed().as_secs_f64() - write_s, write_s])
}

/// The times of first and last light.
struct Times {
    grid: Grid,
    light: Daylight,
    levels: DayLevels,
    /// Of the rows that were traced last.
    traced: Vec<LitTimes>,
    /// The level and its rows that are ready.
    ready: (u32, Range<i64>),
}

impl Traced for Times {
    const KIND: Kind = Kind::Day;
    const NAME: &str = "day";
    const SAMPLE_BYTES: usize = 10;

    fn trace(
        &mut self,
        relief: &Relief<'_>,
        rows: Range<i64>,
        work: &dyn Work,
        progress: &dyn Progress,
    ) -> Result<()> {
        let count = (rows.end - rows.start) * self.grid.size.width;
        self.traced.resize(count as usize, LitTimes::default());
        self.light.rows(relief, rows, &mut self.traced, work, progress)
    }

    fn filter(&mut self, rows: Range<i64>, work: &dyn Work) {
        let width = self.grid.size.width;
        let rows = (rows.start * width) as usize..(rows.end * width) as usize;
        self.levels.take(&self.traced[rows], work);
    }

    fn known(&self, level: u32) -> i64 {
        self.levels.known(level)
    }

    fn ready(&mut self, level: u32, rows: Range<i64>, _work: &dyn Work) {
        self.ready = (level, rows);
    }

    fn pack(&self, columns: Range<i64>) -> Vec<u8> {
        let (level, rows) = self.ready.clone();
        let width = self.grid.level(level).width;
        let samples: &[[u16; 5]] = bytemuck::cast_slice(self.levels.rows(level, rows));
        pack_columns(samples, width, columns, DAY_FIELDS)
    }

    fn forget(&mut self) {
        let (level, rows) = &self.ready;
        self.levels.forget(*level, rows.end);
    }
}
