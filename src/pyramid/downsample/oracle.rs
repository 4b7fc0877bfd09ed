//! The plain version of [`downsample`](super::downsample): one coarse sample at a time, straight from the
//! design's words. It shares nothing with the version in use but the weights.

use super::Filter;
use crate::grid::Size;

/// What may be varied to build controls that tests must catch.
pub(crate) struct Oracle<'a> {
    pub(crate) fine: &'a [f32],
    pub(crate) size: Size,
    pub(crate) filter: &'a Filter,
    pub(crate) rounding_m: Option<f64>,
}

impl Oracle<'_> {
    fn fine_at(&self, i: i64, j: i64) -> Option<f64> {
        let h = self.fine[(j * self.size.width + i) as usize];
        (!h.is_nan()).then_some(f64::from(h))
    }

    /// The one rule along an axis of `n` samples at coarse index `i`.
    fn along(&self, n: i64, i: i64, at: &dyn Fn(i64) -> Option<f64>) -> Option<f64> {
        if 2 * i > n - 1 {
            let last = at(n - 1)?;
            let two = if n == 2 {
                (at(1), at(0))
            } else {
                (self.along(n, i - 1, at), self.along(n, i - 2, at))
            };
            return Some(match two {
                (Some(next), Some(before)) => 2.0 * next - before,
                _ => last,
            });
        }
        let centre = at(2 * i)?;
        let mut sum = self.filter.centre() * centre;
        let mut used = vec![centre];
        for (k, weight) in self.filter.pairs().iter().enumerate() {
            let t = 2 * k as i64 + 1;
            let tap = |at_index: i64| {
                if (0..n).contains(&at_index) {
                    at(at_index)
                } else {
                    None
                }
            };
            let pair = match (tap(2 * i - t), tap(2 * i + t)) {
                (Some(a), Some(b)) => {
                    used.extend([a, b]);
                    a + b
                }
                _ => 2.0 * centre,
            };
            sum += weight * pair;
        }
        if self.filter.is_clamped() {
            let low = used.iter().fold(centre, |low, h| low.min(*h));
            let high = used.iter().fold(centre, |high, h| high.max(*h));
            sum = sum.clamp(low, high);
        }
        Some(sum)
    }

    /// Coarse sample (i, j).
    pub(crate) fn at(&self, i: i64, j: i64) -> f32 {
        let row = |z: i64| self.along(self.size.width, i, &|x| self.fine_at(x, z));
        match self.along(self.size.height, j, &row) {
            None => f32::NAN,
            Some(h) => match self.rounding_m {
                Some(step) => ((h / step).round_ties_even() * step) as f32,
                None => h as f32,
            },
        }
    }

    /// The whole coarse level.
    pub(crate) fn level(&self) -> Vec<f32> {
        self.size
            .level(1)
            .rect()
            .cells()
            .map(|(i, j)| self.at(i, j))
            .collect()
    }
}
