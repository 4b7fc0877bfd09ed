//! From a fine level to the next coarser one: rows, then columns, with one rule for edges and voids.
//!
//! Coarse sample (i, j) is centred on fine sample (2i, 2j). Along one axis it is
//!
//! `C[i] = w f[2i] + sum over k of w_k (f[2i - 2k - 1] + f[2i + 2k + 1])`
//!
//! with the weights `w` and `w_k` of [`Filter`], kept within the range of the samples in it where the filter clamps. *The one rule:* a pair of which either sample is missing (off the
//! grid, or no data) counts as twice the centre, so the signal is continued by point reflection about the
//! centre. Every pair of a linear signal sums to twice its centre, missing or not; hence a plane is reproduced
//! up to the very edge, and a coarse sample is void exactly where its centre is.
//!
//! Where a fine row has an even number of samples, the last coarse sample is centred one past its end. With n
//! coarse samples in the row, it continues them: `C[n-1] = 2 C[n-2] - C[n-3]`; void exactly if the last fine
//! sample is, and equal to that sample where C[n-2] or C[n-3] is void. A coarse row of two samples (hence a
//! fine one of two) continues the fine row instead. Extrapolating the fine row everywhere would repeat from
//! level to level and explode on noise.
//!
//! All arithmetic is f64, unrounded from rows to columns; a height is rounded once, when it is stored: to f32
//! and, for an integer DEM, to a multiple of its rounding step in the same place. The next level is computed
//! from the stored one.

use std::sync::atomic::{AtomicBool, Ordering};

use super::filter::Filter;
use crate::error::{Error, ErrorKind, Result};
use crate::grid::Size;
use crate::progress::Progress;
use crate::work::{Work, each_chunk};

#[cfg(test)]
pub(super) mod oracle;
#[cfg(test)]
mod tests;

/// Coarse rows in a band: the unit of work. A band filters `4 lobes` fine rows more than it has to itself.
const BAND: usize = 64;

/// Columns that are summed together, so that they stay in the processor's first cache.
const BLOCK: usize = 512;

/// The greatest height that is stored: [`f32::MIN`] is the GPU's sentinel for no data, and its size is kept
/// free on both sides.
const GREATEST: f64 = f32::MAX.next_down() as f64;

/// 1/4 of the greatest power of two not above `step_m`: what levels above 0 of an integer DEM with heights
/// in multiples of `step_m` are rounded to. `step_m` must be finite, above 0 and not subnormal.
///
/// The mean of two such heights is still exact. Level 1's samples are two of level 0's apart, so its slopes come in an
/// eighth of the steps of level 0's own, those of coarser levels in finer ones yet. Each bit less is worth 3 to 4 MB of a
/// file of the Sierra (13201 x 4801 whole metres): 1/64 takes 47 MB above level 0, 1/8 31 MB, 1/4 27 MB.
pub fn rounding_step(step_m: f64) -> Option<f64> {
    // Clearing the fraction's bits leaves the power of two.
    let power = f64::from_bits(step_m.to_bits() & 0x7ff0_0000_0000_0000);
    (step_m.is_normal() && step_m > 0.0).then_some(power / 4.0)
}

/// The level of `size.level(1)` samples, row by row, that `filter` makes of `fine`, a level of `size` samples,
/// row by row, finite or NaN for no data. With `rounding_m` (a power of two) heights are rounded to its
/// multiples. Progress advances by the coarse samples.
///
/// The result does not depend on how `work` shares it out.
///
/// # Errors
/// [`ErrorKind::Misuse`] where `fine` is not as long as `size` says; [`ErrorKind::Cancelled`].
pub fn downsample(
    fine: &[f32],
    size: Size,
    filter: &Filter,
    rounding_m: Option<f64>,
    work: &dyn Work,
    progress: &dyn Progress,
) -> Result<Vec<f32>> {
    if size.width < 1 || size.height < 1 || fine.len() as i64 != size.samples() {
        let Size { width, height } = size;
        let what = format!("{} samples given for a level of {width} x {height}", fine.len());
        return Err(Error::new(ErrorKind::Misuse, "pyramid", what));
    }
    let coarse_size = size.level(1);
    let width = coarse_size.width as usize;
    let mut coarse = vec![f32::NAN; coarse_size.samples() as usize];
    let cancelled = AtomicBool::new(false);
    each_chunk(work, &mut coarse, BAND * width, |band, rows| {
        if cancelled.load(Ordering::Relaxed) || progress.cancelled() {
            cancelled.store(true, Ordering::Relaxed);
            return;
        }
        filter_band(fine, size, filter, rounding_m, band * BAND, rows);
        progress.advance(rows.len() as u64);
    });
    if cancelled.into_inner() {
        Err(Error::cancelled("pyramid"))
    } else {
        Ok(coarse)
    }
}

/// Fills `rows`, whole coarse rows from row `first`.
fn filter_band(
    fine: &[f32],
    size: Size,
    filter: &Filter,
    rounding_m: Option<f64>,
    first: usize,
    rows: &mut [f32],
) {
    let (width, height) = (size.width as usize, size.height as usize);
    let coarse_width = size.level(1).width as usize;
    let end = first + rows.len() / coarse_width;
    let centred = height.div_ceil(2); // coarse rows whose centre is a fine row
    let pairs = filter.pairs().len();
    let reach = (2 * pairs).saturating_sub(1);

    // The fine rows under the kernels of this band, filtered along the row. A continued last row needs the
    // two coarse rows before it, which may lie in the band above.
    let needs = if end > centred {
        first.min(centred.saturating_sub(2))
    } else {
        first
    };
    let low = (2 * needs).saturating_sub(reach);
    let high = (2 * (end - 1) + reach + 1).min(height);
    let mut filtered = vec![0.0; (high - low) * coarse_width];
    let mut scratch = RowScratch::default();
    for (row, out) in filtered.chunks_mut(coarse_width).enumerate() {
        let start = (low + row) * width;
        filter_row(&fine[start..start + width], filter, &mut scratch, out);
    }
    let filtered_row = |row: usize| &filtered[(row - low) * coarse_width..][..coarse_width];

    let missing = vec![f64::NAN; coarse_width];
    let column_sums = |j: usize, out: &mut [f64]| {
        let centre = filtered_row(2 * j);
        let pair_rows: Vec<(&[f64], &[f64])> = (0..pairs)
            .map(|k| match (2 * j).checked_sub(2 * k + 1) {
                Some(above) if 2 * j + 2 * k + 1 < height => {
                    (filtered_row(above), filtered_row(2 * j + 2 * k + 1))
                }
                _ => (&missing[..], &missing[..]),
            })
            .collect();
        for start in (0..coarse_width).step_by(BLOCK) {
            let block = start..(start + BLOCK).min(coarse_width);
            let taps = pair_rows
                .iter()
                .map(|(above, below)| (&above[block.clone()], &below[block.clone()]));
            weigh(filter, &centre[block.clone()], taps, &mut out[block.clone()]);
        }
    };

    let mut sums = vec![0.0; coarse_width];
    for (j, out) in (first..end).zip(rows.chunks_mut(coarse_width)) {
        if j < centred {
            column_sums(j, &mut sums);
        } else if height == 2 {
            for (i, sum) in sums.iter_mut().enumerate() {
                *sum = continued(filtered_row(1)[i], filtered_row(0)[i], filtered_row(1)[i]);
            }
        } else {
            let mut before = vec![0.0; coarse_width];
            column_sums(j - 1, &mut sums);
            column_sums(j - 2, &mut before);
            let last = filtered_row(height - 1);
            for (i, sum) in sums.iter_mut().enumerate() {
                *sum = continued(*sum, before[i], last[i]);
            }
        }
        for (out, &sum) in out.iter_mut().zip(&sums) {
            *out = stored(sum, rounding_m);
        }
    }
}

/// Room for one fine row, its even samples apart from its odd ones.
#[derive(Default)]
struct RowScratch {
    even: Vec<f64>,
    /// Odd samples, with as many missing ones on either side as there are pairs.
    odd: Vec<f64>,
}

/// Filters one fine row into one coarse row.
fn filter_row(fine: &[f32], filter: &Filter, scratch: &mut RowScratch, out: &mut [f64]) {
    let pad = filter.pairs().len();
    let RowScratch { even, odd } = scratch;
    even.clear();
    even.extend(fine.iter().step_by(2).map(|&h| f64::from(h)));
    odd.clear();
    odd.resize(pad, f64::NAN);
    odd.extend(fine.iter().skip(1).step_by(2).map(|&h| f64::from(h)));
    odd.resize(odd.len() + pad, f64::NAN);

    let centred = even.len();
    for start in (0..centred).step_by(BLOCK) {
        let count = BLOCK.min(centred - start);
        let taps = (0..pad).map(|k| {
            // Odd sample m, at fine index 2m + 1, lies at m + pad.
            let (west, east) = (start + pad - 1 - k, start + pad + k);
            (&odd[west..west + count], &odd[east..east + count])
        });
        weigh(
            filter,
            &even[start..start + count],
            taps,
            &mut out[start..start + count],
        );
    }
    if out.len() > centred {
        let last = odd[pad + centred - 1];
        let (next, before) = if centred == 1 {
            (last, even[0])
        } else {
            (out[centred - 1], out[centred - 2])
        };
        out[centred] = continued(next, before, last);
    }
}

/// The sums of a block: centres, and for each pair of taps the samples on either side.
pub(super) fn weigh<'a>(
    filter: &Filter,
    centre: &[f64],
    taps: impl Iterator<Item = (&'a [f64], &'a [f64])> + Clone,
    sums: &mut [f64],
) {
    for (sum, c) in sums.iter_mut().zip(centre) {
        *sum = filter.centre() * c;
    }
    for (&weight, (left, right)) in filter.pairs().iter().zip(taps.clone()) {
        add_pair(weight, left, right, centre, sums);
    }
    if filter.is_clamped() {
        clamp(centre, taps, sums);
    }
}

/// Adds one pair of taps to each sum; a pair of which either is missing counts as twice the centre.
fn add_pair(weight: f64, left: &[f64], right: &[f64], centre: &[f64], sums: &mut [f64]) {
    for (((sum, l), r), c) in sums.iter_mut().zip(left).zip(right).zip(centre) {
        let pair = l + r;
        let pair = if pair.is_nan() { 2.0 * c } else { pair };
        *sum += weight * pair;
    }
}

/// Keeps each sum within the range of the samples in it: the centre, and both of each pair that is whole.
fn clamp<'a>(centre: &[f64], taps: impl Iterator<Item = (&'a [f64], &'a [f64])>, sums: &mut [f64]) {
    let (mut low, mut high) = ([0.0; BLOCK], [0.0; BLOCK]);
    let (low, high) = (&mut low[..centre.len()], &mut high[..centre.len()]);
    low.copy_from_slice(centre);
    high.copy_from_slice(centre);
    for (left, right) in taps {
        for (i, (l, r)) in left.iter().zip(right).enumerate() {
            if !(l + r).is_nan() {
                low[i] = low[i].min(*l).min(*r);
                high[i] = high[i].max(*l).max(*r);
            }
        }
    }
    for (i, sum) in sums.iter_mut().enumerate() {
        // Where the centre is void the sum is, and no comparison holds.
        if *sum < low[i] {
            *sum = low[i];
        } else if *sum > high[i] {
            *sum = high[i];
        }
    }
}

/// The sample one past the end: the row's last, `next`, and last but one, `before`, in a straight line.
/// Void where the last fine sample is, and equal to it where either of the two is void.
pub(super) fn continued(next: f64, before: f64, last: f64) -> f64 {
    let line = 2.0 * next - before;
    if last.is_nan() || line.is_nan() {
        last
    } else {
        line
    }
}

/// The one rounding.
pub(super) fn stored(height: f64, rounding_m: Option<f64>) -> f32 {
    let height = match rounding_m {
        Some(step) => round_ties_even(height / step) * step,
        None => height,
    };
    height.clamp(-GREATEST, GREATEST) as f32
}

/// `f64::round_ties_even` in plain arithmetic, which unlike it becomes wide instructions on every processor: above
/// 2^52 there are no fractions, and adding 2^52 to what is smaller rounds them away.
fn round_ties_even(x: f64) -> f64 {
    const WHOLE: f64 = (1u64 << 52) as f64;
    let size = x.abs();
    let rounded = (size + WHOLE) - WHOLE;
    (if size < WHOLE { rounded } else { size }).copysign(x)
}
