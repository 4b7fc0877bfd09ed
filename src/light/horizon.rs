//! How high the terrain stands in one direction, exactly, over the triangulated surface of level 0.
//!
//! Along a ray from a sample the surface is linear between its crossings with the edges of triangles: columns,
//! rows and the diagonals from north-west to south-east. With H the height over the ray at distance t and h
//! the sample's, `(H - h) / t` is monotone on each such piece, so its greatest value is taken at a crossing.
//! An edge counts where its two ends are valid, a sample that the ray hits where it is; what is void or beyond
//! the DEM does not stand in the way.
//!
//! Where those crossings lie is the same for every sample of the grid, so they are computed once for an azimuth:
//! two ends, the share between them, the distance. A sample walks them outward. It stops where the highest
//! ground of the DEM could not raise its horizon any more, and leaves out runs of crossings of which the same
//! holds for the highest ground near them (maxima over blocks). Both are exact: with H never above M, `(M - h)
//! / t` for the nearest t of a run bounds all of the run, as long as the tangent sought is at least 0.

use std::sync::atomic::{AtomicBool, Ordering};

use super::{BAND, check, misuse};
use crate::error::{Error, Result};
use crate::grid::{Grid, MAX_SIZE, Rect};
use crate::progress::Progress;
use crate::work::{Work, each_chunk};

#[cfg(test)]
mod tests;

/// Samples from one block's corner to the next; a block is twice as wide, so that any run of crossings within
/// `BLOCK` cells lies in the block of its north-west corner.
const BLOCK: i64 = 16;

/// The part of a cell that counts as no part: a crossing this near to a sample passes through it.
const SNAP: f64 = 1e-9;

/// The tangent of the elevation of the horizon at `azimuth_deg` (clockwise from north), for every sample; at
/// least 0, as a plain that goes on beyond the DEM would show it; NaN at voids.
///
/// # Errors
/// [`crate::ErrorKind::Misuse`] where the grid is impossible, `heights` has another length, or the azimuth is
/// not finite; [`crate::ErrorKind::Cancelled`].
pub fn horizon_tangents(
    heights: &[f32],
    grid: &Grid,
    azimuth_deg: f64,
    work: &dyn Work,
    progress: &dyn Progress,
) -> Result<Vec<f32>> {
    check(grid, heights.len())?;
    if !azimuth_deg.is_finite() {
        return Err(misuse(format!(
            "an azimuth of {azimuth_deg} degrees is not finite"
        )));
    }
    progress.begin("horizon", grid.size.height as u64);
    let relief = Relief::new(heights, grid);
    let rays = Rays::new(grid, azimuth_deg);
    let mut tangents = vec![f32::NAN; heights.len()];
    each_band(&mut tangents, grid, "horizon", work, progress, |i, j, tangent| {
        if !heights[j * grid.size.width as usize + i].is_nan() {
            *tangent = relief.tangent(&rays, i, j, 0.0, f64::INFINITY) as f32;
        }
    })?;
    Ok(tangents)
}

/// Runs `task` on every element of `values` at column i and row j, over bands of rows; progress advances by
/// rows. `subject` is what is cancelled.
pub(super) fn each_band<T: Send>(
    values: &mut [T],
    grid: &Grid,
    subject: &str,
    work: &dyn Work,
    progress: &dyn Progress,
    task: impl Fn(usize, usize, &mut T) + Sync,
) -> Result<()> {
    let width = grid.size.width as usize;
    let cancelled = AtomicBool::new(false);
    each_chunk(work, values, BAND * width, |band, values| {
        if cancelled.load(Ordering::Relaxed) || progress.cancelled() {
            cancelled.store(true, Ordering::Relaxed);
            return;
        }
        for (j, row) in (band * BAND..).zip(values.chunks_mut(width)) {
            for (i, value) in row.iter_mut().enumerate() {
                task(i, j, value);
            }
        }
        progress.advance((values.len() / width) as u64);
    });
    if cancelled.into_inner() {
        Err(Error::cancelled(subject))
    } else {
        Ok(())
    }
}

/// The horizontal unit vector of an azimuth in the world: east and south. Exact at multiples of 45 degrees up
/// to the rounding of the square root of 1/2.
pub(super) fn direction(azimuth_deg: f64) -> [f64; 2] {
    let turned = azimuth_deg.rem_euclid(360.0);
    let quarter = (turned / 90.0).round();
    let rest = turned - 90.0 * quarter;
    let (sin, cos) = if rest.abs() == 45.0 {
        (
            rest.signum() * std::f64::consts::FRAC_1_SQRT_2,
            std::f64::consts::FRAC_1_SQRT_2,
        )
    } else {
        rest.to_radians().sin_cos()
    };
    let (east, north) = match quarter as i64 % 4 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    };
    [east, -north]
}

/// Where rays of one azimuth cross the edges of triangles, relative to their sample, outward.
pub(super) struct Rays {
    crossings: Vec<Crossing>,
    runs: Vec<Run>,
    /// The number of leading crossings that stay on the grid, by the cells from the sample to its edge.
    on_grid: [Vec<usize>; 2],
    /// Whether the rays run towards the last column, and the last row.
    forward: [bool; 2],
}

/// A crossing: height = that of end `a` + `weight` (that of end `b` - that of end `a`).
struct Crossing {
    /// The ends, as offsets in the array of samples.
    a: isize,
    b: isize,
    weight: f64,
    /// One over the distance in metres.
    per_m: f64,
}

/// Consecutive crossings whose ends lie within [`BLOCK`] cells of the north-west corner of them all.
struct Run {
    first: usize,
    end: usize,
    /// That corner, relative to the sample.
    corner: [i64; 2],
}

impl Rays {
    /// The rays at `azimuth_deg`, as far as `grid` reaches.
    pub(super) fn new(grid: &Grid, azimuth_deg: f64) -> Self {
        let [east, south] = direction(azimuth_deg);
        // Cells a metre.
        let (gx, gz) = (east / grid.spacing_m[0], south / grid.spacing_m[1]);
        let rates = [gx, gz, gx - gz]; // of crossing columns, rows, diagonals
        let limits = [grid.size.width - 1, grid.size.height - 1];
        let mut next = [1i64; 3];
        let mut crossings = Vec::new();
        let mut boxes = Vec::new();
        // The greatest distance in cells from the sample to an end of any crossing so far.
        let mut reach = [0i64; 2];
        let mut reaches = [Vec::new(), Vec::new()];
        let mut last_sample = None;
        loop {
            let distance = |kind: usize| next[kind] as f64 / rates[kind].abs(); // infinite where never crossed
            let kind = (0..3).fold(0, |best, k| if distance(k) < distance(best) { k } else { best });
            let t = distance(kind);
            let line = if rates[kind] < 0.0 {
                -next[kind]
            } else {
                next[kind]
            };
            next[kind] += 1;
            let Some((at, weight)) = between(if kind == 0 { gz * t } else { gx * t }) else {
                break;
            };
            let on = i64::from(weight > 0.0);
            let (a, b) = match kind {
                0 => ([line, at], [line, at + on]),
                1 => ([at, line], [at + on, line]),
                // On a diagonal, column less row is its number.
                _ => ([at, at - line], [at + on, at - line + on]),
            };
            for axis in 0..2 {
                reach[axis] = reach[axis].max(a[axis].abs()).max(b[axis].abs());
            }
            if reach[0] > limits[0] || reach[1] > limits[1] {
                break;
            }
            // Three lines meet in a sample.
            if weight == 0.0 && last_sample == Some(a) {
                continue;
            }
            last_sample = (weight == 0.0).then_some(a);
            let offset = |end: [i64; 2]| (end[1] * grid.size.width + end[0]) as isize;
            crossings.push(Crossing {
                a: offset(a),
                b: offset(b),
                weight,
                per_m: 1.0 / t,
            });
            boxes.push(Rect::new(
                a[0].min(b[0]),
                a[1].min(b[1]),
                a[0].max(b[0]) + 1,
                a[1].max(b[1]) + 1,
            ));
            reaches[0].push(reach[0]);
            reaches[1].push(reach[1]);
        }
        let on_grid = [0, 1].map(|axis: usize| {
            (0..=limits[axis])
                .map(|cells| reaches[axis].partition_point(|&r| r <= cells))
                .collect()
        });
        Self {
            crossings,
            runs: runs(&boxes),
            on_grid,
            forward: [gx > 0.0, gz > 0.0],
        }
    }
}

/// Position `p`, in cells, as a sample and the share of the way to the next; none where there is no such sample.
fn between(p: f64) -> Option<(i64, f64)> {
    let nearest = p.round();
    if nearest.is_nan() || nearest.abs() >= MAX_SIZE as f64 {
        None
    } else if (p - nearest).abs() <= SNAP {
        Some((nearest as i64, 0.0))
    } else {
        Some((p.floor() as i64, p - p.floor()))
    }
}

/// Joins consecutive crossings, given by the samples at their ends, into runs of at most [`BLOCK`] cells a side.
fn runs(boxes: &[Rect]) -> Vec<Run> {
    let mut runs = Vec::new();
    let mut first = 0;
    let mut hull = Rect::EMPTY;
    for (at, ends) in boxes.iter().enumerate() {
        let joined = Rect::new(
            hull.x0.min(ends.x0),
            hull.z0.min(ends.z0),
            hull.x1.max(ends.x1),
            hull.z1.max(ends.z1),
        );
        if at == first {
            hull = *ends;
        } else if joined.width() <= BLOCK + 1 && joined.height() <= BLOCK + 1 {
            hull = joined;
        } else {
            runs.push(Run {
                first,
                end: at,
                corner: [hull.x0, hull.z0],
            });
            (first, hull) = (at, *ends);
        }
    }
    if first < boxes.len() {
        runs.push(Run {
            first,
            end: boxes.len(),
            corner: [hull.x0, hull.z0],
        });
    }
    runs
}

/// The heights of level 0 and how high they reach, everywhere and near each place.
pub(super) struct Relief<'a> {
    heights: &'a [f32],
    grid: &'a Grid,
    /// The greatest height.
    greatest: f64,
    /// The greatest height of the `2 BLOCK` x `2 BLOCK` samples from each multiple of [`BLOCK`], row by row.
    blocks: Vec<f32>,
    blocks_wide: i64,
}

impl<'a> Relief<'a> {
    /// The relief of `heights`, as many as `grid` has samples.
    pub(super) fn new(heights: &'a [f32], grid: &'a Grid) -> Self {
        let size = grid.size;
        let (wide, high) = ((size.width - 1) / BLOCK + 1, (size.height - 1) / BLOCK + 1);
        let mut single = vec![f32::NEG_INFINITY; (wide * high) as usize];
        for (z, row) in (0..).zip(heights.chunks(size.width as usize)) {
            for (x, part) in row.chunks(BLOCK as usize).enumerate() {
                let block = &mut single[(z / BLOCK * wide) as usize + x];
                *block = part.iter().fold(*block, |most, &h| most.max(h)); // of two, max takes the one that is no NaN
            }
        }
        let greatest = single.iter().fold(f32::NEG_INFINITY, |most, &h| most.max(h));
        let at = |x: i64, z: i64| single[(z.min(high - 1) * wide + x.min(wide - 1)) as usize];
        let four = |(x, z)| at(x, z).max(at(x + 1, z)).max(at(x, z + 1)).max(at(x + 1, z + 1));
        let blocks = Rect::new(0, 0, wide, high).cells().map(four).collect();
        Self {
            heights,
            grid,
            greatest: f64::from(greatest),
            blocks,
            blocks_wide: wide,
        }
    }

    /// The greatest of `from` (at least 0) and the tangents of the elevation of the terrain over valid sample
    /// (i, j) along `rays`; any value not below `until` where it reaches that.
    pub(super) fn tangent(&self, rays: &Rays, i: usize, j: usize, from: f64, until: f64) -> f64 {
        let here = [i as i64, j as i64];
        let last = [self.grid.size.width - 1, self.grid.size.height - 1];
        let on_grid = |axis: usize| {
            let cells = if rays.forward[axis] {
                last[axis] - here[axis]
            } else {
                here[axis]
            };
            rays.on_grid[axis][cells as usize]
        };
        let count = on_grid(0).min(on_grid(1));
        let base = here[1] * self.grid.size.width + here[0];
        let h = f64::from(self.heights[base as usize]);
        let mut tangent = from;
        for run in &rays.runs {
            if run.first >= count || tangent >= until {
                break;
            }
            let per_m = rays.crossings[run.first].per_m;
            if (self.greatest - h) * per_m <= tangent {
                break;
            }
            let [x, z] = [0, 1].map(|axis| (here[axis] + run.corner[axis]).max(0) / BLOCK);
            let near = f64::from(self.blocks[(z * self.blocks_wide + x) as usize]);
            if (near - h) * per_m <= tangent {
                continue;
            }
            for crossing in &rays.crossings[run.first..run.end.min(count)] {
                let a = f64::from(self.heights[(base as isize + crossing.a) as usize]);
                let b = f64::from(self.heights[(base as isize + crossing.b) as usize]);
                let rise = a + crossing.weight * (b - a) - h;
                // False where an end is void.
                if rise * crossing.per_m > tangent {
                    tangent = rise * crossing.per_m;
                }
            }
        }
        tangent
    }
}
