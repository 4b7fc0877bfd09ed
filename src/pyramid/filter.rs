//! The kernel that halves a level: a sinc windowed by Blackman, as a half-band filter.

/// Lobes a side of the default filter.
pub const DEFAULT_LOBES: u32 = 4;

/// The greatest number of lobes a side that a filter may have.
pub const MAX_LOBES: u32 = 32;

/// Taps are integer multiples of this: then a tap times an f32 is exact in f64, and so is the sum of such
/// products of samples of one size. The 2^-29 by which a tap is off is far below the filter's own ripple.
const TAP_STEP: f64 = 1.0 / (1u64 << 28) as f64;

/// A symmetric half-band kernel, centred on a fine sample.
///
/// With `t` the distance from the centre in fine samples and `a` the lobes a side (counted in coarse
/// samples, so that the kernel ends at `t = 2a`), a tap is
///
/// `sin(pi t / 2) / (pi t) * (0.42 + 0.5 cos(pi t / 2a) + 0.08 cos(pi t / a))`
///
/// the sinc whose cut-off is half the fine Nyquist frequency, times Blackman's window (Blackman and Tukey,
/// The Measurement of Power Spectra, 1958, section B.5). It is 0 at every even `t` but the centre. The centre is exactly 1/2
/// and the odd taps are normalised to sum exactly 1/2: a constant is kept and the fine Nyquist wave vanishes,
/// both without rounding.
///
/// A pair of taps of which either is missing counts as twice the centre (see
/// [`downsample`](super::downsample())).
#[derive(Clone, Debug, PartialEq)]
pub struct Filter {
    /// Weight of the pair of samples at distance `2k + 1`, for k from 0; they sum to 1/4.
    pairs: Vec<f64>,
}

impl Default for Filter {
    fn default() -> Self {
        Self::sinc_blackman(DEFAULT_LOBES)
    }
}

impl Filter {
    /// The sinc windowed by Blackman over `lobes` lobes a side, from 1 (the kernel 1/4 1/2 1/4) to
    /// [`MAX_LOBES`]; what lies outside counts as the nearest of them, as [`Filter::lobes`] then says.
    pub fn sinc_blackman(lobes: u32) -> Self {
        use std::f64::consts::PI;
        let lobes = lobes.clamp(1, MAX_LOBES);
        let reach = f64::from(2 * lobes);
        let raw: Vec<f64> = (0..lobes)
            .map(|k| {
                let t = f64::from(2 * k + 1);
                let sinc = (PI * t / 2.0).sin() / (PI * t);
                sinc * (0.42 + 0.5 * (PI * t / reach).cos() + 0.08 * (2.0 * PI * t / reach).cos())
            })
            .collect();
        let sum: f64 = raw.iter().sum();
        let mut pairs: Vec<f64> = raw
            .iter()
            .map(|w| (w / sum * 0.25 / TAP_STEP).round() * TAP_STEP)
            .collect();
        // What rounding left over goes to the greatest tap; all of this is exact.
        let rest: f64 = pairs[1..].iter().sum();
        pairs[0] = 0.25 - rest;
        Self { pairs }
    }

    /// Lobes a side, in coarse samples; also the number of pairs of taps.
    pub fn lobes(&self) -> u32 {
        self.pairs.len() as u32
    }

    /// The filter's name, as `--filter` and the terrain file give it.
    pub fn name(&self) -> &'static str {
        "sinc-blackman"
    }

    /// Weights of the pairs at distances 1, 3, 5, ... fine samples; the centre's is 1/2.
    pub fn pairs(&self) -> &[f64] {
        &self.pairs
    }

    /// The share of the range of the samples under the kernel by which a result, in two dimensions, may leave
    /// that range at either end.
    ///
    /// Let `n` be the sum of the negative weights' sizes in one dimension; the positive ones then sum to
    /// `1 + n`. On samples in 0 to 1 a result lies in `-n` to `1 + n`. Voids and edges do not widen that: a
    /// missing pair moves its weight to the centre, which (as `n < 1/2`) stays positive, so a missing positive
    /// pair leaves both sums as they are and a missing negative one shrinks both. Rows thus give values in an
    /// interval of width `1 + 2n`, and columns of those exceed it by `n (1 + 2n)` more: in all
    /// `n + n (1 + 2n) = 2n (1 + n)`, which is also the sum of the negative weights of the product kernel,
    /// hence attained.
    ///
    /// It does not speak of a last row or column that lies beyond the fine level (it continues the coarse row
    /// in a straight line), nor of the rounding of a stored height.
    pub fn overshoot(&self) -> f64 {
        let n: f64 = self.pairs.iter().map(|w| 2.0 * (-w).max(0.0)).sum();
        2.0 * n * (1.0 + n)
    }

    /// The factor by which the filter multiplies a wave of `frequency` times the fine Nyquist frequency
    /// (0 to 1; the coarse Nyquist frequency is 0.5), along one axis and away from edges and voids.
    ///
    /// With 4 lobes: 0.999 at 0.1, 0.989 at 0.25, 0.858 at 0.375, 0.5 at 0.5, 0.142 at 0.625, 0.011 at 0.75,
    /// and at most 0.012 from there to 1, where it is 0.
    pub fn response(&self, frequency: f64) -> f64 {
        let wave = |k: usize| (std::f64::consts::PI * frequency * (2 * k + 1) as f64).cos();
        0.5 + self
            .pairs
            .iter()
            .enumerate()
            .map(|(k, w)| 2.0 * w * wave(k))
            .sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_sum_exactly_and_vanish_exactly_at_nyquist() {
        for lobes in 1..=MAX_LOBES {
            let filter = Filter::sinc_blackman(lobes);
            assert_eq!(filter.lobes(), lobes);
            let mut plus = 0.5;
            let mut minus = 0.5;
            for w in filter.pairs() {
                assert_eq!(
                    (w / TAP_STEP).fract(),
                    0.0,
                    "{lobes} lobes: {w} is not a multiple of the step"
                );
                plus += w * 2.0;
                minus += w * -2.0;
            }
            assert_eq!((plus, minus), (1.0, 0.0), "{lobes} lobes");
        }
        assert_eq!(Filter::sinc_blackman(1).pairs(), [0.25]);
        assert_eq!(Filter::sinc_blackman(0), Filter::sinc_blackman(1));
        assert_eq!(Filter::sinc_blackman(u32::MAX).lobes(), MAX_LOBES);
    }

    #[test]
    fn taps_follow_the_formula_up_to_one_factor() {
        // Independent of the code: sin(pi t / 2) for odd t is 1, -1, 1, ...
        for lobes in 2..=8u32 {
            let filter = Filter::sinc_blackman(lobes);
            let tap = |k: u32| {
                let t = f64::from(2 * k + 1);
                let x = std::f64::consts::PI * t / f64::from(2 * lobes);
                [1.0, -1.0][k as usize % 2] / t * (0.42 + 0.5 * x.cos() + 0.08 * (2.0 * x).cos())
            };
            for k in 1..lobes {
                let (got, want) = (filter.pairs()[k as usize] / filter.pairs()[0], tap(k) / tap(0));
                assert!(
                    (got - want).abs() < 1e-7,
                    "{lobes} lobes, pair {k}: {got} against {want}"
                );
            }
        }
    }

    #[test]
    fn waves_below_the_coarse_nyquist_pass_and_those_above_are_attenuated() {
        // (frequency over fine Nyquist, factor) of the default filter; the coarse Nyquist is 0.5.
        let table = [
            (0.1, 0.9995),
            (0.25, 0.9890),
            (0.375, 0.8579),
            (0.5, 0.5),
            (0.5625, 0.2986),
            (0.625, 0.1421),
            (0.7, 0.0384),
            (0.75, 0.0110),
        ];
        let filter = Filter::default();
        for (frequency, want) in table {
            let factor = filter.response(frequency);
            assert!(
                (factor - want).abs() < 1e-4,
                "{frequency}: {factor} against {want}"
            );
        }
        for step in 0..=25 {
            let frequency = 0.75 + f64::from(step) / 100.0;
            assert!(
                filter.response(frequency).abs() < 0.012,
                "{frequency}: {}",
                filter.response(frequency)
            );
        }
        // A control: the box of two samples lets much more through at the same places.
        let two_samples = |f: f64| (std::f64::consts::PI * f / 2.0).cos();
        assert!(two_samples(0.75) > 0.3);
    }

    #[test]
    fn the_overshoot_is_attained_by_the_worst_samples() {
        for lobes in 1..=MAX_LOBES {
            let filter = Filter::sinc_blackman(lobes);
            // Samples of 1 under negative weights of the product kernel, 0 elsewhere.
            let axis: Vec<f64> = filter
                .pairs()
                .iter()
                .flat_map(|w| [*w, *w])
                .chain([0.5])
                .collect();
            let worst: f64 = axis
                .iter()
                .flat_map(|a| axis.iter().map(move |b| (a * b).min(0.0)))
                .sum();
            assert!((filter.overshoot() + worst).abs() < 1e-12, "{lobes} lobes");
            let negative: f64 = filter.pairs().iter().map(|w| 2.0 * (-w).max(0.0)).sum();
            assert!(negative < 0.5, "{lobes} lobes: the centre could turn negative");
        }
    }
}
