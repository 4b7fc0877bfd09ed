//! How high the terrain reaches near each place, coarsely, for all of a DEM: what tells which of it need be looked at.

use crate::grid::{Grid, Rect};
use crate::work::{Work, each_chunk};

use super::relief::greater;

/// Samples along a block's side.
pub const CREST: usize = 32;

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

    /// The greatest height of the blocks of `rect`; minus infinity where there are none.
    pub(super) fn over(&self, rect: Rect) -> f32 {
        let across = blocks(rect.x0, rect.x1, self.wide);
        let rows = blocks(rect.z0, rect.z1, self.high);
        rows.flat_map(|z| &self.highest[z * self.wide..][across.clone()])
            .fold(f32::NEG_INFINITY, |most, &h| greater(most, h))
    }
}

/// The blocks that hold the samples from one to another, of `count`.
fn blocks(from: i64, until: i64, count: usize) -> std::ops::Range<usize> {
    let side = CREST as i64;
    let within = |block: i64| block.clamp(0, count as i64) as usize;
    within(from.div_euclid(side))..within((until + side - 1).div_euclid(side))
}
