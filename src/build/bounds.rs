//! The second pass: the heights that were just written are read back, and the bounds of all levels put.
//!
//! A patch's error is the greatest difference between its level and level 0 over its ground, and a coarse level is known
//! only when level 0 has long gone by: hence a pass of its own. Level 0 is read tile by tile, once, and each tile measured
//! against every level ([`measure`]); of the coarser levels the rows beside it are held (for each column of level 0
//! 1.4 KiB), and rows of bounds until a row of tiles of them is due (1.7 KiB).

use std::io::{Seek, Write};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use super::tightness::{Tight, Tightness};
use super::tiles::{Tiles, put_tiles};
use crate::error::{Error, Result};
use crate::grid::{Grid, Rect, Size};
use crate::levels::{Arrival, Levels};
use crate::light::Crests;
use crate::progress::Progress;
use crate::pyramid::{BoundsRows, Rows, Share, measure};
use crate::terrain::layout::{Kind, TILE};
use crate::terrain::{BOUNDS_FIELDS, TerrainFile, TerrainWriter};
use crate::work::Work;

/// What the second pass took, in seconds, and found.
#[derive(Debug, Default)]
pub(super) struct Took {
    /// Reading back and measuring.
    pub(super) bounds_s: f64,
    /// Compressing and writing.
    pub(super) write_s: f64,
    /// What a look at some of the stored errors found.
    pub(super) tight: Tight,
}

/// Puts the bounds of all levels, of the heights in `heights`, and returns how high these reach near each place.
///
/// # Errors
/// What the file meets; [`crate::ErrorKind::Broken`] where a stored error is found too small;
/// [`crate::ErrorKind::Cancelled`].
pub(super) fn write_bounds<W: Write + Seek + Sync + Send>(
    heights: &TerrainFile,
    writer: &mut TerrainWriter<W>,
    work: &dyn Work,
    progress: &dyn Progress,
) -> Result<(Took, Crests)> {
    let grid = *heights.grid();
    let Size { width, height } = grid.size;
    progress.begin("bounds", grid.size.samples() as u64);
    let mut windows: Vec<Window> = (1..grid.file_levels()).map(|l| Window::new(&grid, l)).collect();
    let mut bounds = BoundsRows::new(&grid);
    let mut due = writer.layout().order_of(Kind::Bounds).into_iter().peekable();
    let mut took = Took::default();
    let mut crests = Crests::new(&grid);
    let mut tightness = Tightness::new(&grid);
    for z0 in (0..height).step_by(TILE as usize) {
        if progress.cancelled() {
            return Err(Error::cancelled(heights.name()));
        }
        let start = Instant::now();
        let z1 = (z0 + TILE).min(height);
        for window in &mut windows {
            window.slide(z0, z1, z1 == height, heights, work)?;
        }
        let rows: Vec<Rows<'_>> = windows.iter().map(Window::rows).collect();
        let shares = each_tile(width, work, |x0, x1| {
            let block = Rect::new(x0, z0, x1, z1);
            let mut truth = vec![0.0; block.area() as usize];
            arrived(heights.heights(0, block, &mut truth)?);
            let highest = Crests::measure(&truth, block.width() as usize);
            let found = tightness.look(block, &truth, &rows);
            Ok((block, highest, measure(&grid, block, &truth, &rows), found))
        })?;
        for (block, highest, shares, found) in &shares {
            crests.put(*block, highest);
            shares.iter().for_each(|share: &Share| bounds.add(share));
            tightness.add(found);
        }
        bounds.advance(z1);
        took.bounds_s += start.elapsed().as_secs_f64();

        let start = Instant::now();
        while let Some(row) = due.next_if(|row| row.seen <= z1) {
            let level = writer.layout().parts()[row.part].level;
            let made = bounds
                .take(level, TILE)
                .expect("the order says when a row is known");
            let width = grid.patches(level).width;
            tightness.stored(level, row.y * TILE, width, &made);
            let tiles = Tiles {
                row,
                width,
                samples: bytemuck::cast_slice::<_, [f32; 6]>(&made),
                fields: BOUNDS_FIELDS,
            };
            put_tiles(writer, &tiles, work, progress)?;
        }
        took.write_s += start.elapsed().as_secs_f64();
        progress.advance((width * (z1 - z0)) as u64);
    }
    took.tight = tightness.finish(heights.name())?;
    Ok((took, crests))
}

/// Rows of a level above 0 that pass by.
struct Window {
    level: u32,
    size: Size,
    first: i64,
    heights: Vec<f32>,
}

impl Window {
    fn new(grid: &Grid, level: u32) -> Self {
        Self {
            level,
            size: grid.level(level),
            first: 0,
            heights: Vec::new(),
        }
    }

    fn rows(&self) -> Rows<'_> {
        Rows {
            size: self.size,
            first: self.first,
            heights: &self.heights,
        }
    }

    /// Holds the rows over rows `z0..z1` of level 0 and the next one, and all that are left where those are the `last`.
    fn slide(&mut self, z0: i64, z1: i64, last: bool, file: &TerrainFile, work: &dyn Work) -> Result<()> {
        let Size { width, height } = self.size;
        let end = if last {
            height
        } else {
            (((z1 - 1) >> self.level) + 2).min(height)
        };
        loop {
            let held = self.first + self.heights.len() as i64 / width;
            if held >= end {
                return Ok(());
            }
            let passed = (z0 >> self.level).min(held) - self.first;
            self.heights.drain(..(passed * width) as usize);
            self.first += passed;
            let until = (held + TILE).min(height);
            let start = self.heights.len();
            let count = ((until - held) * width) as usize;
            self.heights.reserve_exact(count);
            self.heights.resize(start + count, f32::NAN);
            let read = each_tile(width, work, |x0, x1| {
                let rect = Rect::new(x0, held, x1, until);
                let mut heights = vec![0.0; rect.area() as usize];
                arrived(file.heights(self.level, rect, &mut heights)?);
                Ok(heights)
            })?;
            for (x0, tile) in (0..width).step_by(TILE as usize).zip(&read) {
                let columns = TILE.min(width - x0) as usize;
                let rows = self.heights[start..].chunks_exact_mut(width as usize);
                for (row, from) in rows.zip(tile.chunks_exact(columns)) {
                    row[x0 as usize..][..columns].copy_from_slice(from);
                }
            }
        }
    }
}

/// What `task` makes of the columns of each tile, in their order.
pub(super) fn each_tile<T: Send>(
    width: i64,
    work: &dyn Work,
    task: impl Fn(i64, i64) -> Result<T> + Sync,
) -> Result<Vec<T>> {
    let slots: Vec<Mutex<Option<Result<T>>>> = (0..width)
        .step_by(TILE as usize)
        .map(|_| Mutex::default())
        .collect();
    work.each(slots.len(), &|index| {
        let x0 = index as i64 * TILE;
        let made = task(x0, (x0 + TILE).min(width));
        *slots[index].lock().unwrap_or_else(PoisonError::into_inner) = Some(made);
    });
    let made = |slot: Mutex<Option<Result<T>>>| {
        let made = slot.into_inner().unwrap_or_else(PoisonError::into_inner);
        made.expect("every task ran and left its result")
    };
    slots.into_iter().map(made).collect()
}

/// A file has all of its tiles.
fn arrived(arrival: Arrival) {
    debug_assert_eq!(arrival, Arrival::Arrived);
}
