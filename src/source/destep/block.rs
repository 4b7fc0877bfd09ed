//! A block of samples smoothed: from the heights as read, around it, to heights within half a step of them.

use super::{DISTANCES, PARTS, REACH, TRUST};
use crate::grid::Rect;

/// A block that is to be smoothed.
pub(super) struct Block<'a> {
    /// All of the DEM.
    pub(super) dem: Rect,
    /// The samples wanted.
    pub(super) rect: Rect,
    /// Heights as read, in units of height as those of the result: of `raw_rect`, which holds all of the DEM within
    /// [`REACH`] of `rect`.
    pub(super) raw: &'a [f32],
    pub(super) raw_rect: Rect,
    /// The step of the heights, and what moves are rounded to.
    pub(super) step: f64,
    pub(super) quantum: f64,
}

impl Block<'_> {
    /// Bytes that smoothing a block of so many samples holds.
    pub(super) fn held_bytes(columns: i64, rows: i64) -> u64 {
        2 * 4 * ((columns + 2 * REACH) * (rows + 2 * REACH)) as u64
    }

    /// Puts the new heights of the block into `out`, row by row.
    pub(super) fn smooth(&self, out: &mut [&mut [f32]]) {
        let step = self.step as f32;
        let trust = 1.0 / (TRUST * step);
        let half = 0.5 * step;
        let mut around = self.rect.grown(REACH).intersection(self.dem);
        let (first, width) = (around, around.width() as usize);
        let at = |x: i64, z: i64| (z - first.z0) as usize * width + (x - first.x0) as usize;
        let mut heights: Vec<f32> = Vec::with_capacity(around.area() as usize);
        for z in around.z0..around.z1 {
            heights.extend_from_slice(&self.raw_row(z)[self.columns(around)]);
        }
        let mut along = heights.clone();
        let missing = vec![f32::NAN; width];
        let mut padded = Vec::with_capacity(width + 4 * DISTANCES[0] as usize);
        let mut left = REACH;
        for distance in DISTANCES {
            left -= 2 * distance;
            let next = self.rect.grown(left).intersection(self.dem);
            let columns = next.width() as usize;
            // Along rows. What lies beyond the DEM is no data; all else that is asked for is there.
            let pad = 2 * distance;
            for z in around.z0..around.z1 {
                padded.clear();
                padded.resize((around.x0 - (next.x0 - pad)) as usize, f32::NAN);
                padded.extend_from_slice(&heights[at(around.x0, z)..][..around.width() as usize]);
                padded.resize(columns + 2 * pad as usize, f32::NAN);
                let row = |from: i64| &padded[(pad + from) as usize..][..columns];
                let five = [-pad, -distance, 0, distance, pad].map(row);
                bend(five, trust, &mut along[at(next.x0, z)..][..columns]);
            }
            // Along columns, and back to within half a step.
            for z in next.z0..next.z1 {
                let row = |from: i64| match z + from {
                    beyond if !(self.dem.z0..self.dem.z1).contains(&beyond) => &missing[..columns],
                    z => &along[at(next.x0, z)..][..columns],
                };
                let five = [-pad, -distance, 0, distance, pad].map(row);
                let out = &mut heights[at(next.x0, z)..][..columns];
                bend(five, trust, out);
                for (h, raw) in out.iter_mut().zip(&self.raw_row(z)[self.columns(next)]) {
                    // Of NaN and a number max and min take the number: both are NaN here, or none.
                    *h = h.max(raw - half).min(raw + half);
                }
            }
            around = next;
        }
        for (z, out) in (self.rect.z0..self.rect.z1).zip(out) {
            let smooth = &heights[at(self.rect.x0, z)..];
            let raw = &self.raw_row(z)[self.columns(self.rect)];
            for ((out, smooth), raw) in out.iter_mut().zip(smooth).zip(raw) {
                *out = rounded(*raw, *smooth, self.step, self.quantum);
            }
        }
    }

    fn raw_row(&self, z: i64) -> &[f32] {
        let width = self.raw_rect.width() as usize;
        &self.raw[(z - self.raw_rect.z0) as usize * width..][..width]
    }

    /// Where the columns of `rect` stand in a row as read.
    fn columns(&self, rect: Rect) -> std::ops::Range<usize> {
        (rect.x0 - self.raw_rect.x0) as usize..(rect.x1 - self.raw_rect.x0) as usize
    }
}

/// Moves samples halfway to where a cubic through the two samples on either side has them; `trust` is the reciprocal of
/// the difference that is taken for rounding.
///
/// With samples a2, a1, c, b1, b2 at equal distances the cubic's value at c is (4 (a1 + b1) - (a2 + b2)) / 6. Beside no
/// data it is the mean of a1 and b1 where these are there, else c. It counts as far as all of `(a1 + b1) / 2 - c`,
/// `(a2 + c) / 2 - a1` and `(b2 + c) / 2 - b1` can be rounding: not across a crest or the foot of a slope.
#[inline]
fn bend([a2, a1, c, b1, b2]: [&[f32]; 5], trust: f32, out: &mut [f32]) {
    let greater = |a: f32, b: f32| if a > b { a } else { b };
    let counts = |difference: f32| {
        let share = 2.0 - difference * trust;
        let share = if share < 1.0 { share } else { 1.0 };
        greater(share, 0.0)
    };
    let all = a2.iter().zip(a1).zip(c).zip(b1).zip(b2);
    for (out, ((((&a2, &a1), &c), &b1), &b2)) in out.iter_mut().zip(all) {
        let near = 0.5 * (a1 + b1) - c;
        let far = 0.5 * (a2 + b2) - c;
        let sides = greater((0.5 * (a2 + c) - a1).abs(), (0.5 * (b2 + c) - b1).abs());
        let cubic = (4.0 * near - far) * (1.0 / 3.0) * counts(greater(sides, near.abs()));
        let mean = near * counts(near.abs());
        let move_ = if far.is_nan() { mean } else { cubic };
        *out = if move_.is_nan() { c } else { c + 0.5 * move_ };
    }
}

/// The height `raw` moved to `smooth` in whole quanta, by half a step at most.
fn rounded(raw: f32, smooth: f32, step: f64, quantum: f64) -> f32 {
    // A step has fewer than 2 PARTS quanta, and adding this to a number of so few leaves its whole part alone.
    const TO_WHOLE: f32 = 1.5 * (1 << 23) as f32;
    let most = (0.5 * step / quantum).floor().min(PARTS) as f32;
    let quanta = (smooth - raw) * (1.0 / quantum) as f32;
    let quanta = ((quanta + TO_WHOLE) - TO_WHOLE).max(-most).min(most);
    let moved = raw + quanta * quantum as f32;
    // Where f32 has no height so near, it stays.
    if (f64::from(moved) - f64::from(raw)).abs() <= 0.5 * step {
        moved
    } else {
        raw
    }
}
