//! The terrain over which light is traced: where its heights come from, and what is reused from block to block.

use std::sync::{Mutex, PoisonError};

use super::crests::Crests;
use super::sight::Sight;
use super::stage::STRIDE;
use crate::error::Result;
use crate::grid::{Grid, Rect};

/// Samples that are traced at once.
pub(super) const LANES: usize = 8;

/// Columns and rows of a block: what is traced together. Results may depend on where blocks begin: always at multiples.
pub(super) const BLOCK: [usize; 2] = [256, 128];

/// Groups of samples in a row of a block.
pub(super) const GROUPS: usize = BLOCK[0] / LANES;

/// Where the heights of level 0 come from while light is traced over them.
pub trait Ground: Sync {
    /// Copies the heights of `rect`, which lies on the grid, into `out`, whose rows are `stride` samples apart.
    ///
    /// # Errors
    /// What reading them meets.
    fn copy(&self, rect: Rect, stride: usize, out: &mut [f32]) -> Result<()>;
}

/// All heights of level 0, row by row.
pub(super) struct Whole<'a> {
    heights: &'a [f32],
    width: usize,
}

impl<'a> Whole<'a> {
    pub(super) fn of(heights: &'a [f32], grid: &Grid) -> Self {
        Self {
            heights,
            width: grid.size.width as usize,
        }
    }
}

impl Ground for Whole<'_> {
    fn copy(&self, rect: Rect, stride: usize, out: &mut [f32]) -> Result<()> {
        let count = rect.width() as usize;
        for (z, row) in (rect.z0..rect.z1).zip(out.chunks_mut(stride)) {
            let from = z as usize * self.width + rect.x0 as usize;
            row[..count].copy_from_slice(&self.heights[from..from + count]);
        }
        Ok(())
    }
}

/// The terrain over which light is traced.
pub struct Relief<'a> {
    grid: Grid,
    ground: &'a dyn Ground,
    pub(super) crests: Crests,
    /// What is not in use.
    scratches: Mutex<Vec<Scratch>>,
}

/// A block's own heights, and what its samples look at: reused from block to block.
pub(super) struct Scratch {
    /// The block and a sample around it, rows [`STRIDE`] apart; NaN beyond the DEM.
    pub(super) own: Vec<f32>,
    pub(super) sight: Sight,
    /// Of each sample of a block what its maker likes to keep.
    pub(super) kept: [Vec<f32>; 2],
}

impl Default for Scratch {
    fn default() -> Self {
        Self {
            own: vec![f32::NAN; (BLOCK[1] + 2) * STRIDE],
            sight: Sight::default(),
            kept: Default::default(),
        }
    }
}

impl<'a> Relief<'a> {
    /// The terrain of `grid` whose heights are those of `ground`, and whose crests are `crests`.
    pub fn new(grid: &Grid, ground: &'a dyn Ground, crests: Crests) -> Self {
        Self {
            grid: *grid,
            ground,
            crests,
            scratches: Mutex::default(),
        }
    }

    /// Room to work in, to be given back.
    pub(super) fn scratch(&self) -> Scratch {
        let mut scratches = self.scratches.lock().unwrap_or_else(PoisonError::into_inner);
        scratches.pop().unwrap_or_default()
    }

    pub(super) fn give_back(&self, scratch: Scratch) {
        self.scratches
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(scratch);
    }

    pub(super) fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Fetches a block's own heights.
    pub(super) fn settle(&self, block: Rect, scratch: &mut Scratch) -> Result<()> {
        self.fetch(block.grown(1), &mut scratch.own)
    }

    /// Copies the heights of `rect` into rows [`STRIDE`] apart, NaN where there is no DEM.
    pub(super) fn fetch(&self, rect: Rect, out: &mut [f32]) -> Result<()> {
        let on = rect.intersection(self.grid.size.rect());
        if on != rect {
            out.fill(f32::NAN);
        }
        if on.is_empty() {
            return Ok(());
        }
        let at = (on.z0 - rect.z0) as usize * STRIDE + (on.x0 - rect.x0) as usize;
        self.ground.copy(on, STRIDE, &mut out[at..])
    }

    /// The slopes at a block's samples, whose own heights have been fetched.
    pub(super) fn slopes<'b>(&self, scratch: &'b Scratch) -> super::normal::Slopes<'b> {
        super::normal::Slopes::new(&scratch.own, STRIDE, self.grid.spacing_m)
    }
}

/// Column and row, in a block, of the first sample of a group.
pub(super) fn place(group: u32) -> [usize; 2] {
    [group as usize % GROUPS * LANES, group as usize / GROUPS]
}

/// [`LANES`] values from index `at` on.
pub(super) fn lanes(values: &[f32], at: usize) -> &[f32; LANES] {
    values[at..at + LANES].try_into().expect("the range is as long")
}

pub(super) fn lanes_mut(values: &mut [f32], at: usize) -> &mut [f32; LANES] {
    (&mut values[at..at + LANES])
        .try_into()
        .expect("the range is as long")
}

/// The greater of two; `most` where the other is no number.
pub(super) fn greater(most: f32, other: f32) -> f32 {
    if other > most { other } else { most }
}
