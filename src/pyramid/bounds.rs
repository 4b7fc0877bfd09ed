//! Bounds of every patch: how high it reaches, and how far its level strays from the DEM's own surface.
//!
//! *Where `S_l` exists.* Inside a triangle where all three corners are valid; on an edge or diagonal where its
//! two ends are; at a vertex where it is. In one phrase: where every corner that has weight there is valid.
//! Each cell is split from its north-west to its south-east corner.
//!
//! *`error` is true.* It is the greatest of two sets of differences.
//!
//! 1. `|S_l - S0|` at every valid sample of level 0 on the patch's closed ground (cut at the DEM's edge)
//!    where `S_l` exists. That bounds the whole ground where both exist: every edge of `S_{l+1}` is made of
//!    edges of `S_l`, hence every edge of `S_l` of edges of `S0`, and both are linear on each closed triangle
//!    of `S0`. There the difference is linear, and its extremes lie at the triangle's corners: samples of
//!    level 0, all three valid as `S0` exists inside, and in one closed triangle of `S_l`, which exists. On a
//!    lone edge or vertex the same holds with two corners or one.
//! 2. `|c - S0|` at every vertex of level l - 1 on that ground whose morph target `c` on level l is not void,
//!    at samples of level 0 that are valid. In exact arithmetic these are among the first set (a target is
//!    `S_l` on an edge, diagonal or vertex of level l); taken again because a target is rounded to f32.
//!
//! *Rounding.* With `s = 2^l`, a sample of level 0 at (u, v) in its cell and the weights `s - u`, `u - v`, `v`
//! (or with u and v exchanged), `s S_l` is a sum of three products of an f32 and an integer up to `s`, below
//! 2^30: each is exact in f64, and so is the division by `s`. Let M be the greatest height of the level on the
//! patch and e the greatest difference found, so that no height of level 0 that counts is above M + e. Three
//! additions of terms of at most `s (M + e)` leave less than `6 * 2^-53 (M + e)`; [`SLACK`] times M + e is
//! added, and the sum is rounded up to f32. Where the level's heights on the patch are all one, `s S_l` is
//! exact and only the last subtraction rounds, by less than `2^-53 e`: there M counts as 0, so that on level
//! ground the error is 0.
//!
//! *Saturation.* `need_error` is the greatest of a patch's own `error` and 1.3 times the `need_error` of its
//! four children and the patches that touch them (4 x 4 in all), rounded up; `need_min` and `need_max`
//! likewise, without the factor. The own bounds of a patch without a valid sample are NaN; its `need_*` are
//! what its children and their neighbours hand up, NaN only where those have none either. Were they NaN
//! regardless, a void coarse sample over valid fine ground would break the nesting in the middle: the patch
//! above would not know of the ground below. On a checkerboard of voids every level above 0 is such.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::{Error, Result};
use crate::grid::{Grid, PATCH, Patch, Rect, Size};
use crate::levels::Bounds;
use crate::progress::Progress;
use crate::work::{Work, each_chunk};

pub(super) mod block;
pub(super) mod rows;
#[cfg(test)]
mod tests;

/// The factor from a patch's `need_error` to those that hold it.
pub const SATURATION: f64 = 1.3;

/// What is added to an error for the rounding of its f64 sum, over the greatest height involved.
const SLACK: f64 = 1.0 / (1u64 << 50) as f64;

/// The bounds of every patch of level `level`, row by row: its heights and those of level 0 row by row, and
/// the bounds of the next finer level (none for level 0). Progress advances by the patches.
///
/// # Errors
/// [`crate::ErrorKind::Cancelled`].
pub(super) fn bound_level(
    grid: &Grid,
    level: u32,
    heights: &[f32],
    truth: &[f32],
    finer: Option<&[Bounds]>,
    work: &dyn Work,
    progress: &dyn Progress,
) -> Result<Vec<Bounds>> {
    let patches = grid.patches(level);
    let mut bounds = vec![Bounds::VOID; patches.samples() as usize];
    let cancelled = AtomicBool::new(false);
    let scene = Scene {
        grid,
        level,
        size: grid.level(level),
        heights,
        truth,
    };
    each_chunk(work, &mut bounds, patches.width as usize, |b, row| {
        if cancelled.load(Ordering::Relaxed) || progress.cancelled() {
            cancelled.store(true, Ordering::Relaxed);
            return;
        }
        for (a, bounds) in row.iter_mut().enumerate() {
            let patch = Patch::new(level, a as i64, b as i64);
            *bounds = scene.own(patch);
            if let Some(finer) = finer {
                let size = grid.patches(level - 1);
                saturate(patch, bounds, size, |x, z| finer[(z * size.width + x) as usize]);
            }
        }
        progress.advance(row.len() as u64);
    });
    if cancelled.into_inner() {
        Err(Error::cancelled("bounds"))
    } else {
        Ok(bounds)
    }
}

/// The least f32 not below `x`.
fn round_up(x: f64) -> f32 {
    let rounded = x as f32;
    if f64::from(rounded) < x {
        rounded.next_up()
    } else {
        rounded
    }
}

/// Widens the `need_*` of `patch` by those of its children and their neighbours.
fn saturate(patch: Patch, bounds: &mut Bounds, finer_patches: Size, finer: impl Fn(i64, i64) -> Bounds) {
    let (a, b) = (2 * patch.a, 2 * patch.b);
    let around = Rect::new(a - 1, b - 1, a + 3, b + 3).intersection(finer_patches.rect());
    for (x, z) in around.cells() {
        let below = finer(x, z);
        // f32's min and max take the other value where one is NaN.
        bounds.need_min = bounds.need_min.min(below.need_min);
        bounds.need_max = bounds.need_max.max(below.need_max);
        // next_up covers the product's own rounding.
        let error = SATURATION * f64::from(below.need_error);
        let error = if error > 0.0 {
            round_up(error.next_up())
        } else {
            below.need_error
        };
        bounds.need_error = bounds.need_error.max(error);
    }
}

/// A level beside the truth.
struct Scene<'a> {
    grid: &'a Grid,
    level: u32,
    size: Size,
    heights: &'a [f32],
    truth: &'a [f32],
}

/// A cell of the level: its corners, NaN where void or beyond the level.
struct Cell {
    nw: f64,
    ne: f64,
    sw: f64,
    se: f64,
}

impl Scene<'_> {
    fn height(&self, i: i64, j: i64) -> f32 {
        if self.size.rect().contains(i, j) {
            self.heights[(j * self.size.width + i) as usize]
        } else {
            f32::NAN
        }
    }

    fn truth_row(&self, x0: i64, x1: i64, z: i64) -> &[f32] {
        let row = z * self.grid.size.width;
        &self.truth[(row + x0) as usize..(row + x1) as usize]
    }

    /// The patch's bounds, not yet saturated.
    fn own(&self, patch: Patch) -> Bounds {
        let (mut min, mut max) = (f32::NAN, f32::NAN);
        for (i, j) in patch.samples_within(self.size).cells() {
            let h = self.height(i, j);
            min = min.min(h);
            max = max.max(h);
        }
        if min.is_nan() {
            return Bounds::VOID;
        }
        // Which of 0 and -0 is the less depends on the order in which they are met: always 0.
        let (min, max) = (min + 0.0, max + 0.0);
        let error = if self.level == 0 { 0.0 } else { self.error(patch) };
        Bounds {
            min,
            max,
            error,
            need_min: min,
            need_max: max,
            need_error: error,
        }
    }

    fn error(&self, patch: Patch) -> f32 {
        let shift = self.level;
        // The level's valid heights, for the slack.
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        let mut worst = 0.0f64;
        let cells = patch.samples();
        for j in cells.z0..cells.z1 - 1 {
            for i in cells.x0..cells.x1 - 1 {
                let corner = |di, dj| f64::from(self.height(i + di, j + dj));
                let cell = Cell {
                    nw: corner(0, 0),
                    ne: corner(1, 0),
                    sw: corner(0, 1),
                    se: corner(1, 1),
                };
                for h in [cell.nw, cell.ne, cell.sw, cell.se] {
                    low = low.min(h);
                    high = high.max(h);
                }
                let ground = Rect::new(
                    i << shift,
                    j << shift,
                    ((i + 1) << shift) + 1,
                    ((j + 1) << shift) + 1,
                );
                let ground = ground.intersection(self.grid.size.rect());
                for z in ground.z0..ground.z1 {
                    let truth = self.truth_row(ground.x0, ground.x1, z);
                    worst = worst.max(cell.worst_in_row(truth, z - (j << shift), shift));
                }
            }
        }
        worst = worst.max(self.worst_target(patch));
        let level_height = if low < high {
            low.abs().max(high.abs())
        } else {
            0.0
        };
        round_up(worst + SLACK * (level_height + worst))
    }

    /// The greatest difference between a morph target on this level, as it is rounded to f32, and the truth.
    fn worst_target(&self, patch: Patch) -> f64 {
        let finer = self.size_of_finer();
        let (x0, z0) = (2 * PATCH * patch.a, 2 * PATCH * patch.b);
        let vertices = Rect::new(x0, z0, x0 + 2 * PATCH + 1, z0 + 2 * PATCH + 1).intersection(finer.rect());
        let mut worst = 0.0f64;
        for (i, j) in vertices.cells() {
            let (x, z) = (i << (self.level - 1), j << (self.level - 1));
            if !self.grid.size.rect().contains(x, z) {
                continue;
            }
            let ends = [
                self.height(i >> 1, j >> 1),
                self.height((i + 1) >> 1, (j + 1) >> 1),
            ];
            // Halves first, so that two of the greatest heights do not overflow; else it is the same.
            let target = 0.5 * ends[0] + 0.5 * ends[1];
            let truth = self.truth[(z * self.grid.size.width + x) as usize];
            worst = worst.max((f64::from(target) - f64::from(truth)).abs());
        }
        worst
    }

    fn size_of_finer(&self) -> Size {
        self.grid.level(self.level - 1)
    }
}

impl Cell {
    /// The greatest `|S_l - S0|` over the samples `truth` of level 0, which begin at the cell's west side, in
    /// row `v` of the cell's `2^shift`; 0 where there is no place at which both exist.
    fn worst_in_row(&self, truth: &[f32], v: i64, shift: u32) -> f64 {
        let s = 1i64 << shift;
        let whole = !(self.nw + self.ne + self.sw + self.se).is_nan();
        let scale = s as f64;
        let mut worst = 0.0f64;
        // West of the diagonal the corners are nw, sw, se; east of it nw, ne, se; on it nw and se.
        let split = truth.len().min(v as usize);
        let (south_west, north_east) = truth.split_at(split);
        if whole {
            let fv = v as f64;
            let west = (scale - fv) * self.nw;
            for (u, &h) in south_west.iter().enumerate() {
                let u = u as f64;
                let surface = west + (fv - u) * self.sw + u * self.se;
                worst = worst.max((surface - scale * f64::from(h)).abs());
            }
            let east = fv * self.se;
            for (k, &h) in north_east.iter().enumerate() {
                let u = fv + k as f64;
                let surface = (scale - u) * self.nw + (u - fv) * self.ne + east;
                worst = worst.max((surface - scale * f64::from(h)).abs());
            }
        } else {
            let weighted = |weight: i64, corner: f64| if weight == 0 { 0.0 } else { weight as f64 * corner };
            for (u, &h) in truth.iter().enumerate() {
                let u = u as i64;
                let middle = if u < v {
                    weighted(v - u, self.sw)
                } else {
                    weighted(u - v, self.ne)
                };
                let surface = weighted(s - u.max(v), self.nw) + middle + weighted(u.min(v), self.se);
                worst = worst.max((surface - scale * f64::from(h)).abs());
            }
        }
        worst / scale
    }
}
