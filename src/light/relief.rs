//! The heights of level 0 and how high they reach, everywhere and near each place; horizons are traced over them.
//!
//! With H the height over a ray at distance t and h its sample's, `(H - h) / t` is monotone between two crossings, so
//! its greatest value is taken at a crossing. (On a curved earth that is short of the truth by at most half a
//! crossing's distance from the last over the earth's radius: 1e-5 for cells of 100 m.) An edge counts where its two
//! ends are valid, a sample that the ray hits where it is; what is void or beyond the DEM does not stand in the way.
//!
//! A few samples beside each other walk their rays at once. A run of crossings is left out where the highest ground
//! near them could not raise the horizon of any: with H never above M, `(M - h) / t` for the nearest t of a run bounds
//! all of it, as long as the tangent sought is at least 0. That is exact.
//!
//! Differences of heights are formed first, so that in f32 a rise is off by at most 2^-22 of the differences it is made
//! of; heights must lie within 1e38 m of each other.

use super::rays::{Rays, SPANS};
use crate::grid::Grid;
use crate::work::{Work, each_chunk};

/// Samples that are traced at once.
pub(super) const LANES: usize = 8;

/// Samples from one window of maxima to the next, for each of [`SPANS`].
const STEPS: [usize; SPANS.len()] = [64, 16, 4, 4];

/// Heights and their greatest over windows.
pub(super) struct Relief<'a> {
    pub(super) heights: &'a [f32],
    pub(super) grid: &'a Grid,
    /// The greatest height; minus infinity where all is void.
    greatest: f32,
    windows: [Windows; SPANS.len()],
}

/// The greatest heights over windows from each multiple of a step that hold a run of a span as [`LANES`] samples see
/// it, row by row.
#[derive(Default)]
struct Windows {
    wide: usize,
    highest: Vec<f32>,
}

impl<'a> Relief<'a> {
    /// The relief of `heights`, as many as `grid` has samples.
    pub(super) fn new(heights: &'a [f32], grid: &'a Grid, work: &dyn Work) -> Self {
        let width = grid.size.width as usize;
        let finest = STEPS[SPANS.len() - 1];
        let wide = width.div_ceil(finest);
        let mut blocks = vec![f32::NEG_INFINITY; wide * heights.len().div_ceil(finest * width)];
        each_chunk(work, &mut blocks, wide, |z, blocks| {
            let rows = heights[z * finest * width..].chunks(width).take(finest);
            for row in rows {
                for (block, part) in blocks.iter_mut().zip(row.chunks(finest)) {
                    *block = part.iter().fold(*block, |most, &h| greater(most, h));
                }
            }
        });
        let mut windows = <[Windows; SPANS.len()]>::default();
        each_chunk(work, &mut windows, 1, |depth, windows| {
            let step = STEPS[depth] / finest;
            let (blocks, wide) = if step == 1 {
                (blocks.clone(), wide)
            } else {
                (thinned(&blocks, wide, step), wide.div_ceil(step))
            };
            // A run's samples begin anywhere in a block.
            let count = |samples: i64| (samples as usize + STEPS[depth] - 1).div_ceil(STEPS[depth]);
            let across = slide(&blocks, wide, false, count(SPANS[depth] + LANES as i64));
            windows[0] = Windows {
                wide,
                highest: slide(&across, wide, true, count(SPANS[depth] + 1)),
            };
        });
        Self {
            heights,
            grid,
            greatest: blocks.iter().fold(f32::NEG_INFINITY, |most, &h| greater(most, h)),
            windows,
        }
    }

    /// Raises each of `tangents`, at least 0, to the tangent of the elevation of the terrain along `rays` over its
    /// sample; the samples are those from (i, j) eastward. Where one is void or its tangent not below `until`, the
    /// tangent becomes infinite.
    pub(super) fn raise(&self, rays: &Rays, [i, j]: [usize; 2], until: f32, tangents: &mut [f32]) {
        if let Ok(tangents) = <&mut [f32; LANES]>::try_from(&mut *tangents) {
            let common = rays.on_grid(i, j, LANES);
            self.walk(rays, [i, j], 0..common, until, tangents);
            // Beyond the edge that the first of them meets, each goes on alone.
            for (i, tangent) in (i..).zip(tangents) {
                let own = rays.on_grid(i, j, 1);
                if own > common && *tangent < f32::INFINITY {
                    self.walk(rays, [i, j], common..own, until, std::array::from_mut(tangent));
                }
            }
        } else {
            for (i, tangent) in (i..).zip(tangents) {
                let own = rays.on_grid(i, j, 1);
                self.walk(rays, [i, j], 0..own, until, std::array::from_mut(tangent));
            }
        }
    }

    /// The same for `L` samples whose crossings `crossings` all lie on the grid, over those alone.
    fn walk<const L: usize>(
        &self,
        rays: &Rays,
        [i, j]: [usize; 2],
        crossings: std::ops::Range<usize>,
        until: f32,
        tangents: &mut [f32; L],
    ) {
        let base = j * self.grid.size.width as usize + i;
        let row: &[f32; L] = self.lanes(base);
        let mut h = [0.0; L];
        for l in 0..L {
            // What is decided can be raised no more.
            if row[l].is_nan() || tangents[l] >= until {
                tangents[l] = f32::INFINITY;
            } else {
                h[l] = row[l];
            }
        }
        let mut at = 0;
        while let Some(run) = rays.runs.get(at) {
            if run.first as usize >= crossings.end {
                break;
            }
            let could_rise = |most: f32| {
                (0..L).fold(false, |any, l| {
                    any | ((most - h[l]) * run.per_m - run.drop > tangents[l])
                })
            };
            if run.end as usize <= crossings.start {
                at = run.next as usize;
                continue;
            }
            if run.depth == 0 && !could_rise(self.greatest) {
                break;
            }
            let depth = usize::from(run.depth);
            let x = (i as i64 + i64::from(run.corner[0])).max(0) as usize / STEPS[depth];
            let z = (j as i64 + i64::from(run.corner[1])).max(0) as usize / STEPS[depth];
            let windows = &self.windows[depth];
            if !could_rise(windows.highest[z * windows.wide + x]) {
                at = run.next as usize;
                continue;
            }
            at += 1;
            if depth + 1 < SPANS.len() {
                continue;
            }
            let own = (run.first as usize).max(crossings.start)..(run.end as usize).min(crossings.end);
            for crossing in &rays.crossings[own] {
                let a: &[f32; L] = self.lanes(base.wrapping_add_signed(crossing.a));
                let b: &[f32; L] = self.lanes(base.wrapping_add_signed(crossing.b));
                for l in 0..L {
                    let rise = (a[l] - h[l]) + crossing.weight * (b[l] - a[l]);
                    // The second where an end is void.
                    tangents[l] = greater(tangents[l], rise * crossing.per_m - crossing.drop);
                }
            }
            for tangent in tangents.iter_mut() {
                *tangent = if *tangent >= until {
                    f32::INFINITY
                } else {
                    *tangent
                };
            }
        }
    }

    /// `L` heights from index `at` on.
    fn lanes<const L: usize>(&self, at: usize) -> &[f32; L] {
        self.heights[at..at + L].try_into().expect("the range is L long")
    }
}

/// The greater of two; `most` where the other is no number.
fn greater(most: f32, other: f32) -> f32 {
    if other > most { other } else { most }
}

/// The greatest of `step` x `step` values each.
fn thinned(values: &[f32], width: usize, step: usize) -> Vec<f32> {
    let mut out = Vec::with_capacity(width.div_ceil(step) * values.len().div_ceil(step * width));
    for rows in values.chunks(step * width) {
        for x in (0..width).step_by(step) {
            let parts = rows.chunks(width).map(|row| &row[x..(x + step).min(width)]);
            out.push(
                parts
                    .flatten()
                    .fold(f32::NEG_INFINITY, |most, &h| greater(most, h)),
            );
        }
    }
    out
}

/// The greatest of `count` values from each on, fewer at the end, down columns or along rows of `width`.
fn slide(values: &[f32], width: usize, down: bool, count: usize) -> Vec<f32> {
    let mut values = values.to_vec();
    let (stride, length) = if down { (width, values.len()) } else { (1, width) };
    for values in values.chunks_mut(length) {
        // Windows of 1, 2, 4, ... values, then two of the largest that together are `count`.
        let mut done = 1;
        while done < count && done * stride < length {
            let by = done.min(count - done);
            // In pieces that do not reach into what they read: vectorised.
            let mut at = 0;
            while at + by * stride < length {
                let (here, there) = values[at..].split_at_mut(by * stride);
                here.iter_mut()
                    .zip(&*there)
                    .for_each(|(most, &h)| *most = greater(*most, h));
                at += by * stride;
            }
            done += by;
        }
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pyramid::random::Random;

    #[test]
    fn windows_slide_over_all_that_they_hold() {
        let mut random = Random::new(5);
        for _ in 0..200 {
            let (width, height) = (1 + random.below(40) as usize, 1 + random.below(30) as usize);
            let (count, down) = (1 + random.below(20) as usize, random.unit() < 0.5);
            let values = random.heights((width * height) as i64, -1.0, 1.0, 0.0);
            let got = slide(&values, width, down, count);
            for (at, &got) in got.iter().enumerate() {
                let (x, z) = (at % width, at / width);
                let held = (0..count).filter_map(|k| {
                    let (x, z) = if down { (x, z + k) } else { (x + k, z) };
                    (x < width && z < height).then(|| values[z * width + x])
                });
                assert_eq!(
                    got,
                    held.fold(f32::NEG_INFINITY, f32::max),
                    "{width} x {height}, {count}"
                );
            }
        }
    }
}
