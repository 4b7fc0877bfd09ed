//! The box of a piece of ground, in metres east, up and south of the eye, as it is drawn.

use glam::DVec3;

use super::eye::Eye;
use crate::grid::{Grid, Rect};

/// What takes samples and heights to metres from the eye.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent<'a> {
    pub(super) grid: &'a Grid,
    pub(super) eye: &'a Eye,
    /// Factor on heights relative to the eye.
    pub(super) vertical_scale: f64,
}

impl Extent<'_> {
    /// Low and high corner of the box over the ground between the first and the last (excluded from no side: their
    /// ground, not their cells) of the samples `ends` of level `level`, with heights in metres above the DEM's base.
    pub(super) fn of(&self, level: u32, ends: Rect, heights: [f32; 2]) -> [DVec3; 2] {
        let x = [ends.x0, ends.x1].map(|i| self.along(0, i << level));
        let z = [ends.z0, ends.z1].map(|j| self.along(1, j << level));
        let [a, b] = heights.map(|h| self.up(f64::from(h)));
        [DVec3::new(x[0], a.min(b), z[0]), DVec3::new(x[1], a.max(b), z[1])]
    }

    /// The place of sample (i, j) of level `level` at a height in metres above the DEM's base.
    pub(super) fn place(&self, level: u32, [i, j]: [i64; 2], height_m: f64) -> DVec3 {
        DVec3::new(
            self.along(0, i << level),
            self.up(height_m),
            self.along(1, j << level),
        )
    }

    /// Metres east or south of the eye to a column or row of level 0: from the integer anchor first, which is exact
    /// however far from the DEM's corner.
    fn along(&self, axis: usize, index: i64) -> f64 {
        ((index - self.eye.anchor[axis]) as f64 - self.eye.fraction[axis]) * self.grid.spacing_m[axis]
    }

    fn up(&self, height_m: f64) -> f64 {
        if self.vertical_scale == 0.0 {
            0.0 // an unknown height is infinite
        } else {
            (height_m - self.eye.height_m) * self.vertical_scale
        }
    }
}
