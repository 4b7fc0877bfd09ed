//! [`downsample`](super::downsample()) row by row: fine rows go in from the north, coarse rows come out as soon as they
//! are known, bit for bit the same, and only the rows under the kernel are held.
//!
//! A level is cut into stripes of columns that know nothing of each other. Each filters its part of every fine row
//! along the row and keeps the results that later coarse rows may still ask for: `2 reach + 6` of them, where the
//! kernel reaches that many fine samples a side. So a stripe's working set stays in a processor's second cache, and
//! stripes are what threads share out.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use super::downsample::{continued, stored, weigh};
use super::filter::Filter;
use crate::grid::Size;
use crate::work::Work;

/// Coarse columns of a stripe; its last may have two more.
const STRIPE: usize = 256;

/// A level that is being halved.
pub struct Halving {
    size: Size,
    filter: Filter,
    rounding_m: Option<f64>,
    stripes: Vec<Mutex<Stripe>>,
    /// Fine rows taken, and coarse rows made.
    taken: usize,
    made: usize,
}

/// Some columns of the coarse level.
struct Stripe {
    columns: Range<usize>,
    /// Fine rows filtered along the row: row r at `r % held`.
    rows: Vec<f64>,
    held: usize,
    even: Vec<f64>,
    /// Odd samples of the fine row, with as many on either side as there are pairs.
    odd: Vec<f64>,
    sums: Vec<f64>,
    before: Vec<f64>,
    /// A row of no data.
    missing: Vec<f64>,
}

impl Halving {
    /// A level of `size` samples of which nothing has been seen, to be halved by `filter`; with `rounding_m` (a power
    /// of two) heights are rounded to its multiples.
    pub fn new(size: Size, filter: &Filter, rounding_m: Option<f64>) -> Self {
        let width = size.level(1).width as usize;
        let held = 2 * reach(filter) + 6;
        let mut starts: Vec<usize> = (0..width).step_by(STRIPE).collect();
        // A continued last column asks for the two before it.
        if starts.len() > 1 && starts.last().is_some_and(|start| width - start < 3) {
            starts.pop();
        }
        let ends = starts.iter().copied().skip(1).chain([width]);
        let stripe = |(start, end): (usize, usize)| {
            let count = end - start;
            Mutex::new(Stripe {
                columns: start..end,
                rows: vec![0.0; held * count],
                held,
                even: Vec::new(),
                odd: Vec::new(),
                sums: vec![0.0; count],
                before: vec![0.0; count],
                missing: vec![f64::NAN; count],
            })
        };
        Self {
            size,
            filter: filter.clone(),
            rounding_m,
            stripes: starts.iter().copied().zip(ends).map(stripe).collect(),
            taken: 0,
            made: 0,
        }
    }

    /// Takes the next whole rows of the fine level, finite or NaN for no data, and appends the coarse rows that are
    /// known by them to `out`.
    pub fn take(&mut self, fine: &[f32], work: &dyn Work, out: &mut Vec<f32>) {
        let (width, coarse_width) = (self.size.width as usize, self.size.level(1).width as usize);
        debug_assert_eq!(fine.len() % width, 0);
        let end = self.taken + fine.len() / width;
        let known = self.known(end);
        let start = out.len();
        out.resize(start + (known - self.made) * coarse_width, f32::NAN);
        let mut parts: Vec<Vec<&mut [f32]>> = self.stripes.iter().map(|_| Vec::new()).collect();
        for row in out[start..].chunks_exact_mut(coarse_width) {
            let mut rest = row;
            for (part, stripe) in parts.iter_mut().zip(&mut self.stripes) {
                let stripe = stripe.get_mut().unwrap_or_else(PoisonError::into_inner);
                let (own, others) = rest.split_at_mut(stripe.columns.len());
                part.push(own);
                rest = others;
            }
        }
        let parts: Vec<Mutex<Vec<&mut [f32]>>> = parts.into_iter().map(Mutex::new).collect();
        work.each(self.stripes.len(), &|index| {
            // Each task has its own stripe.
            let mut stripe = self.stripes[index].lock().unwrap_or_else(PoisonError::into_inner);
            let mut part = parts[index].lock().unwrap_or_else(PoisonError::into_inner);
            let mut rows = part.iter_mut();
            let mut made = self.made;
            for (row, fine) in (self.taken..).zip(fine.chunks_exact(width)) {
                stripe.filter_row(fine, row, &self.filter);
                for (j, out) in (made..self.known(row + 1)).zip(&mut rows) {
                    self.coarse_row(&mut stripe, j, out);
                    made += 1;
                }
            }
        });
        (self.taken, self.made) = (end, known);
    }

    /// The coarse rows that are known once `seen` fine rows are.
    fn known(&self, seen: usize) -> usize {
        if seen == self.size.height as usize {
            return self.size.level(1).height as usize;
        }
        match seen.checked_sub(1 + reach(&self.filter)) {
            Some(centre) => centre / 2 + 1,
            None => 0,
        }
    }

    /// One row of a stripe of the coarse level.
    fn coarse_row(&self, stripe: &mut Stripe, j: usize, out: &mut [f32]) {
        let height = self.size.height as usize;
        let Stripe { sums, before, .. } = stripe;
        let (mut sums, mut before) = (std::mem::take(sums), std::mem::take(before));
        if j < height.div_ceil(2) {
            stripe.column_sums(j, height, &self.filter, &mut sums);
        } else {
            // One past the last fine row: see `downsample`.
            let last = stripe.row(height - 1);
            if height == 2 {
                for (i, sum) in sums.iter_mut().enumerate() {
                    *sum = continued(last[i], stripe.row(0)[i], last[i]);
                }
            } else {
                stripe.column_sums(j - 1, height, &self.filter, &mut sums);
                stripe.column_sums(j - 2, height, &self.filter, &mut before);
                for (i, sum) in sums.iter_mut().enumerate() {
                    *sum = continued(*sum, before[i], last[i]);
                }
            }
        }
        for (out, &sum) in out.iter_mut().zip(&sums) {
            *out = stored(sum, self.rounding_m);
        }
        (stripe.sums, stripe.before) = (sums, before);
    }
}

/// Fine samples that the kernel reaches a side.
fn reach(filter: &Filter) -> usize {
    (2 * filter.pairs().len()).saturating_sub(1)
}

impl Stripe {
    fn row(&self, row: usize) -> &[f64] {
        let count = self.columns.len();
        &self.rows[row % self.held * count..][..count]
    }

    /// Filters its part of fine row number `row` along the row.
    fn filter_row(&mut self, fine: &[f32], row: usize, filter: &Filter) {
        let pad = filter.pairs().len();
        let Range { start, end } = self.columns;
        let centred = end.min(fine.len().div_ceil(2));
        let count = centred - start;
        self.even.clear();
        let own = &fine[2 * start..(2 * centred).min(fine.len())];
        self.even.extend(own.iter().step_by(2).map(|&h| f64::from(h)));
        self.odd.clear();
        // Odd sample m lies at fine index 2 m + 1, here at m + pad - start.
        let odds = fine.len() / 2;
        self.odd.resize(pad.saturating_sub(start), f64::NAN);
        let there = start.saturating_sub(pad)..(start + count + pad).min(odds);
        let there = &fine[2 * there.start.min(odds)..2 * there.end.max(there.start.min(odds))];
        self.odd
            .extend(there.chunks_exact(2).map(|pair| f64::from(pair[1])));
        self.odd.resize(count + 2 * pad, f64::NAN);

        let width = self.columns.len();
        let out = &mut self.rows[row % self.held * width..][..width];
        let odd = &self.odd;
        let taps = (0..pad).map(|k| (&odd[pad - 1 - k..][..count], &odd[pad + k..][..count]));
        weigh(filter, &self.even, taps, &mut out[..count]);
        if width > count {
            let last = f64::from(fine[fine.len() - 1]);
            let (next, before) = if centred == 1 {
                (last, self.even[0])
            } else {
                (out[count - 1], out[count - 2])
            };
            out[count] = continued(next, before, last);
        }
    }

    /// The sums of coarse row `j`, which is centred on a fine row of the `height`.
    fn column_sums(&self, j: usize, height: usize, filter: &Filter, sums: &mut [f64]) {
        let taps = (0..filter.pairs().len()).map(|k| match (2 * j).checked_sub(2 * k + 1) {
            Some(above) if 2 * j + 2 * k + 1 < height => (self.row(above), self.row(2 * j + 2 * k + 1)),
            _ => (&self.missing[..], &self.missing[..]),
        });
        weigh(filter, self.row(2 * j), taps, sums);
    }
}

#[cfg(test)]
mod tests {
    use super::super::random::Random;
    use super::super::{FilterKind, downsample};
    use super::*;
    use crate::progress::Silent;
    use crate::work::Serial;

    fn in_pieces(fine: &[f32], size: Size, filter: &Filter, rounding: Option<f64>, rows: i64) -> Vec<f32> {
        let mut halving = Halving::new(size, filter, rounding);
        let mut out = Vec::new();
        for piece in fine.chunks((rows * size.width) as usize) {
            halving.take(piece, &Serial, &mut out);
        }
        out
    }

    #[test]
    fn rows_in_pieces_give_the_same_bits_as_the_whole() {
        let bits = |level: &[f32]| -> Vec<u32> {
            let one = |h: &f32| if h.is_nan() { f32::NAN } else { *h };
            level.iter().map(|h| one(h).to_bits()).collect()
        };
        let kinds = FilterKind::ALL.into_iter().map(Filter::from);
        let filters: Vec<Filter> = kinds.chain([1, 2, 8, 32].map(Filter::sinc_blackman)).collect();
        let sizes = [
            (1, 1),
            (2, 1),
            (1, 2),
            (2, 2),
            (3, 3),
            (1, 700),
            (700, 1),
            (64, 64),
            (513, 40),
            (514, 41),
            (515, 6),
            (1024, 5),
            (1026, 33),
            (1537, 18),
        ];
        for (seed, (width, height)) in sizes.into_iter().enumerate() {
            let size = Size { width, height };
            for filter in &filters {
                for (voids, rounding, rows) in [
                    (0.0, None, 1),
                    (0.3, Some(0.25), 7),
                    (0.05, Some(1.0), 256),
                    (0.3, None, 16),
                ] {
                    let fine = Random::new(seed as u64).heights(size.samples(), -500.0, 9000.0, voids);
                    let want = downsample(&fine, size, filter, rounding, &Serial, &Silent).unwrap();
                    let got = in_pieces(&fine, size, filter, rounding, rows);
                    let case = format!(
                        "{width} x {height}, {}, {voids} {rounding:?} {rows}",
                        filter.kind()
                    );
                    assert!(bits(&got) == bits(&want), "{case}");
                }
            }
        }
    }

    #[test]
    fn a_row_comes_out_as_soon_as_it_is_known_and_not_before() {
        let size = Size {
            width: 5,
            height: 100,
        };
        let mut halving = Halving::new(size, &Filter::sinc_blackman(4), None);
        let mut out = Vec::new();
        for z in 0..100 {
            halving.take(&[z as f32; 5], &Serial, &mut out);
            let rows = out.len() / 3;
            // Row j needs fine row 2 j + 7.
            let want = if z == 99 { 51 } else { (z - 5).max(0) / 2 };
            assert_eq!(rows, want as usize, "after row {z}");
        }
    }
}
