//! The ground under queries: grid lines along a ray's track, and the quad over a place.
//!
//! Distances to grid lines are taken from an integer anchor and a fraction ([`Eye`]), exact however large the indices.
//! The time at which a track reaches a line is one product of that distance, monotone in the index, and the same bits
//! for all who ask: so neighbouring rectangles share their borders' times.

use super::{Quad, Reader, Surface};
use crate::clipmap::{Eye, Place};
use crate::error::Result;
use crate::grid::{Grid, PATCH, Patch, Rect};

/// One axis of a ray's track over the ground, in samples of level 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    anchor: i64,
    fraction: f64,
    /// Samples per unit of time; 0 where the track follows a grid line.
    pub(super) speed: f64,
    inverse: f64,
    /// The DEM's last sample, where the surface ends.
    last: i64,
}

impl Axis {
    pub(super) fn new(grid: &Grid, eye: &Eye, axis: usize, metres: f64) -> Self {
        let speed = metres / grid.spacing_m[axis];
        // Slower than this, no time that f64 holds leads to the next line.
        let still = speed.abs() < f64::MIN_POSITIVE * (1u64 << 62) as f64;
        Self {
            anchor: eye.anchor[axis],
            fraction: eye.fraction[axis],
            speed: if still { 0.0 } else { speed },
            inverse: if still { 0.0 } else { 1.0 / speed },
            last: [grid.size.width, grid.size.height][axis] - 1,
        }
    }

    /// Samples from the origin to the line of sample `i` of level 0.
    fn to(&self, i: i64) -> f64 {
        (i - self.anchor) as f64 - self.fraction
    }

    fn time(&self, i: i64) -> f64 {
        self.to(i) * self.inverse
    }

    /// Cuts a span of time to when the track is between the lines `first` and `end`, the latter excluded where the
    /// track follows it, unless the surface ends there. Whether anything is left.
    fn clip(&self, first: i64, end: i64, span: &mut [f64; 2]) -> bool {
        let end = end.min(self.last);
        if first >= end {
            return false; // a DEM of one column or row has no area
        }
        if self.speed == 0.0 {
            return self.to(first) <= 0.0
                && (self.to(end) > 0.0 || (end == self.last && self.to(end) == 0.0));
        }
        let (enter, leave) = if self.speed > 0.0 {
            (first, end)
        } else {
            (end, first)
        };
        span[0] = span[0].max(self.time(enter));
        span[1] = span[1].min(self.time(leave));
        span[0] < span[1]
    }

    /// When the track leaves cell `i` of a grid with this step.
    fn leaves(&self, i: i64, step: i64) -> f64 {
        if self.speed == 0.0 {
            return f64::INFINITY;
        }
        self.time(if self.speed > 0.0 { i + 1 } else { i } * step)
    }

    /// When the track passes from the half of a square that it meets first to the other one, the halves meeting at the
    /// line of sample `i`; where it follows grid lines, the half before the line is the first, and the whole at the end
    /// of the surface.
    pub(super) fn passes(&self, i: i64) -> f64 {
        if self.speed != 0.0 {
            self.time(i)
        } else if self.to(i) > 0.0 || i >= self.last {
            f64::INFINITY
        } else {
            f64::NEG_INFINITY
        }
    }

    /// The cell between `first` and `end` of a grid with this step in which the track is just after time `t`.
    fn cell(&self, first: i64, end: i64, step: i64, t: f64) -> i64 {
        let from = (self.speed * t - self.to(first * step)) / step as f64;
        let mut i = first + from.clamp(0.0, (end - 1 - first) as f64) as i64;
        // The place is rounded, the lines' times decide.
        if self.speed > 0.0 {
            while i > first && self.leaves(i - 1, step) > t {
                i -= 1;
            }
            while i + 1 < end && self.leaves(i, step) <= t {
                i += 1;
            }
        } else if self.speed < 0.0 {
            while i + 1 < end && self.leaves(i + 1, step) > t {
                i += 1;
            }
            while i > first && self.leaves(i, step) <= t {
                i -= 1;
            }
        }
        i
    }

    /// Where in cell `i` the track is at time `t`: 0 to 1.
    fn within(&self, i: i64, step: i64, t: f64) -> f64 {
        ((self.speed * t - self.to(i * step)) / step as f64).clamp(0.0, 1.0)
    }
}

/// A ray's track over the ground.
#[derive(Clone, Copy, Debug)]
pub(super) struct Track {
    pub(super) x: Axis,
    pub(super) z: Axis,
}

impl Track {
    /// Whether it stays over one place.
    pub(super) fn stands(&self) -> bool {
        self.x.speed == 0.0 && self.z.speed == 0.0
    }

    /// When the track is over cells of a step of `step` samples, within `span`; none where never.
    pub(super) fn over(&self, cells: Rect, step: i64, mut span: [f64; 2]) -> Option<[f64; 2]> {
        (self.x.clip(cells.x0 * step, cells.x1 * step, &mut span)
            && self.z.clip(cells.z0 * step, cells.z1 * step, &mut span))
        .then_some(span)
    }

    /// Where in cell (i, j) the track is at time `t`.
    pub(super) fn within(&self, i: i64, j: i64, step: i64, t: f64) -> [f64; 2] {
        [self.x.within(i, step, t), self.z.within(j, step, t)]
    }

    /// A patch's children in the order in which a track meets them.
    pub(super) fn children(&self, patch: Patch) -> [Patch; 4] {
        let children = patch.children();
        let first = usize::from(self.x.speed < 0.0) | usize::from(self.z.speed < 0.0) << 1;
        [0, 1, 2, 3].map(|k| children[k ^ first])
    }

    /// The cells of a step of `step` samples that the track passes during `span`, which must be as [`Track::over`]
    /// says, with the span of each, one after another without gaps, until `visit` has found something.
    pub(super) fn cells<T, E>(
        &self,
        cells: Rect,
        step: i64,
        span: [f64; 2],
        mut visit: impl FnMut(i64, i64, [f64; 2]) -> Result<Option<T>, E>,
    ) -> Result<Option<T>, E> {
        let mut i = self.x.cell(cells.x0, cells.x1, step, span[0]);
        let mut j = self.z.cell(cells.z0, cells.z1, step, span[0]);
        let mut t = span[0];
        while cells.contains(i, j) {
            let (east, south) = (self.x.leaves(i, step), self.z.leaves(j, step));
            let next = east.min(south).min(span[1]).max(t);
            // Through a corner, the cell beside it is met for no time at all.
            if next > t
                && let Some(found) = visit(i, j, [t, next])?
            {
                return Ok(Some(found));
            }
            if next >= span[1] {
                break;
            }
            t = next;
            if east <= south {
                i += self.x.speed.signum() as i64;
            } else {
                j += self.z.speed.signum() as i64;
            }
        }
        Ok(None)
    }
}

/// A quad over a place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    pub(super) quad: Quad,
    pub(super) level: u32,
    /// Column and row in samples of the level.
    pub(super) cell: [i64; 2],
    /// Where in it the place is.
    pub(super) at: [f64; 2],
}

/// The quad of `surface` over the place of `eye`; none off the surface.
pub(super) fn find<S: Surface + ?Sized>(
    surface: &S,
    reader: &mut dyn Reader,
    eye: &Eye,
) -> Result<Option<Found>> {
    let grid = surface.grid();
    let (mut level, roots) = surface.roots();
    // The cell of level 0 over whose ground the place is: its last ones own the DEM's edge.
    let mut cell = [0; 2];
    for axis in 0..2 {
        let last = [grid.size.width, grid.size.height][axis] - 1;
        let beyond = (eye.anchor[axis] - last) as f64 + eye.fraction[axis];
        let before = eye.anchor[axis] as f64 + eye.fraction[axis];
        if before < 0.0 || beyond > 0.0 || last == 0 {
            return Ok(None);
        }
        // Rounding may have made the fraction a whole sample.
        cell[axis] = (eye.anchor[axis] + eye.fraction[axis].floor() as i64).clamp(0, last - 1);
    }
    let patch_of = |level: u32| {
        let index = |axis: usize| (cell[axis] >> level).div_euclid(PATCH);
        Patch::new(level, index(0), index(1))
    };
    let mut patch = patch_of(level);
    if !roots.contains(patch.a, patch.b) {
        return Ok(None);
    }
    loop {
        match reader.place(patch) {
            Place::Nothing => return Ok(None),
            Place::Patch => break,
            Place::Finer => {
                level -= 1;
                patch = patch_of(level);
            }
        }
    }
    let step = 1i64 << level;
    let [i, j] = cell.map(|c| c >> level);
    let at = |axis: usize, index: i64| {
        (((eye.anchor[axis] - index * step) as f64 + eye.fraction[axis]) / step as f64).clamp(0.0, 1.0)
    };
    let corners = reader.corners(patch)?;
    let quad = Quad::of(
        corners,
        (i - patch.a * PATCH) as usize,
        (j - patch.b * PATCH) as usize,
    );
    Ok(Some(Found {
        quad,
        level,
        cell: [i, j],
        at: [at(0, i), at(1, j)],
    }))
}
