//! How high the terrain reaches near each place, coarsely, for all of a DEM: what tells which of it need be looked at.

use crate::grid::{Grid, Rect};
use crate::work::{Work, each_chunk};

use super::relief::{LANES, greater, slide};

/// Samples along a block's side.
pub const CREST: usize = 32;

/// Along those that windows are made of.
const COARSE: usize = 64;

/// The greatest heights over blocks of [`CREST`] samples a side: 4 bytes for each.
#[derive(Clone, Debug)]
pub struct Crests {
    wide: usize,
    high: usize,
    highest: Vec<f32>,
}

impl Crests {
    /// Those of a DEM of `grid` of which nothing is known yet, as if it were void.
    pub fn new(grid: &Grid) -> Self {
        let count = |n: i64| (n as usize).div_ceil(CREST);
        let (wide, high) = (count(grid.size.width), count(grid.size.height));
        Self {
            wide,
            high,
            highest: vec![f32::NEG_INFINITY; wide * high],
        }
    }

    /// Those of `heights`, as many as `grid` has samples.
    pub fn of(heights: &[f32], grid: &Grid, work: &dyn Work) -> Self {
        let mut crests = Self::new(grid);
        let (wide, width) = (crests.wide, grid.size.width as usize);
        each_chunk(work, &mut crests.highest, wide, |z, highest| {
            let rows = &heights[z * CREST * width..heights.len().min((z + 1) * CREST * width)];
            highest.copy_from_slice(&Self::measure(rows, width));
        });
        crests
    }

    /// The greatest heights over the blocks of `heights`, rows of `width` samples, row by row; minus infinity where
    /// all is void.
    pub fn measure(heights: &[f32], width: usize) -> Vec<f32> {
        let mut most = Vec::new();
        let mut columns = vec![0f32; width];
        for rows in heights.chunks(CREST * width) {
            columns.fill(f32::NEG_INFINITY);
            for row in rows.chunks(width) {
                columns
                    .iter_mut()
                    .zip(row)
                    .for_each(|(most, &h)| *most = greater(*most, h));
            }
            let blocks = columns.chunks(CREST);
            most.extend(
                blocks.map(|block| block.iter().fold(f32::NEG_INFINITY, |most, &h| greater(most, h))),
            );
        }
        most
    }

    /// Puts what [`Crests::measure`] says of `rect`, whose north-western corner is one of a block.
    pub fn put(&mut self, rect: Rect, measured: &[f32]) {
        let across = (rect.width() as usize).div_ceil(CREST);
        let (x, z) = (rect.x0 as usize / CREST, rect.z0 as usize / CREST);
        for (z, row) in (z..).zip(measured.chunks(across)) {
            self.highest[z * self.wide + x..][..across].copy_from_slice(row);
        }
    }

    /// The greatest of all; minus infinity where all is void.
    pub(super) fn greatest(&self) -> f32 {
        self.highest
            .iter()
            .fold(f32::NEG_INFINITY, |most, &h| greater(most, h))
    }

    /// The greatest height of the blocks of `rect`; minus infinity where there are none.
    pub(super) fn over(&self, rect: Rect) -> f32 {
        let across = blocks(rect.x0, rect.x1, CREST, self.wide);
        let rows = blocks(rect.z0, rect.z1, CREST, self.high);
        rows.flat_map(|z| &self.highest[z * self.wide..][across.clone()])
            .fold(f32::NEG_INFINITY, |most, &h| greater(most, h))
    }

    /// The greatest over windows from each coarse block on that hold a stretch of rays of `cells` cells either way,
    /// and a sample on both sides of it, as [`LANES`] samples see it.
    pub(super) fn windows(&self, cells: i64) -> CrestWindows {
        const EACH: usize = COARSE / CREST;
        let (wide, high) = (self.wide.div_ceil(EACH), self.high.div_ceil(EACH));
        let mut coarse = vec![f32::NEG_INFINITY; wide * high];
        for (z, row) in self.highest.chunks(self.wide).enumerate() {
            for (blocks, most) in row.chunks(EACH).zip(&mut coarse[z / EACH * wide..]) {
                *most = blocks.iter().fold(*most, |most, &h| greater(most, h));
            }
        }
        // It begins anywhere in a block.
        let count = |samples: usize| (samples + COARSE - 1).div_ceil(COARSE);
        let across = slide(&coarse, wide, false, count(cells as usize + 2 + LANES));
        CrestWindows {
            wide,
            high,
            highest: slide(&across, wide, true, count(cells as usize + 2)),
        }
    }
}

/// See [`Crests::windows`].
pub(super) struct CrestWindows {
    wide: usize,
    high: usize,
    highest: Vec<f32>,
}

impl CrestWindows {
    /// The greatest height of `rect`, and of what lies near it.
    pub(super) fn over(&self, rect: Rect) -> f32 {
        let (across, down) = (
            blocks(rect.x0, rect.x1, COARSE, self.wide),
            blocks(rect.z0, rect.z1, COARSE, self.high),
        );
        // Windows are more than 4 blocks long.
        down.step_by(4)
            .flat_map(|z| self.highest[z * self.wide..][across.clone()].iter().step_by(4))
            .fold(f32::NEG_INFINITY, |most, &h| greater(most, h))
    }
}

/// The blocks of `side` samples that hold those from one to another, of `count`.
fn blocks(from: i64, until: i64, side: usize, count: usize) -> std::ops::Range<usize> {
    let side = side as i64;
    let within = |block: i64| block.clamp(0, count as i64) as usize;
    within(from.div_euclid(side))..within((until + side - 1).div_euclid(side))
}
