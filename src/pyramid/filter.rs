//! The kernel that halves a level: a symmetric one on the centre and the odd taps, by default a windowed sinc.

mod kind;

pub use kind::FilterKind;

/// Lobes a side of the default filter.
///
/// Decided by `cargo bench --bench filters` over six real DEMs: the RMS of `S_l - S0` over all levels falls by 2.3 % from
/// 3 lobes to 4, by 0.9 % from 4 to 5 and by 0.2 % from 5 to 6, while what the kernel rings grows by 39, 27 and 17 %. The
/// last lobe that gains more than 1 % is the fourth.
pub const DEFAULT_LOBES: u32 = 4;

/// The greatest number of lobes a side that a filter may have.
pub const MAX_LOBES: u32 = 32;

/// Taps are integer multiples of this: then a tap times an f32 is exact in f64, and so is the sum of such
/// products of samples of one size. The 2^-29 by which a tap is off is far below the filter's own ripple.
const TAP_STEP: f64 = 1.0 / (1u64 << 28) as f64;

/// A symmetric kernel, centred on a fine sample: the centre and pairs of taps at the odd distances.
///
/// The weights of all sum to exactly 1, so a constant is kept without rounding. Those of most kinds are half-band
/// filters: the centre is exactly 1/2 and the odd taps sum exactly to 1/2, so the fine Nyquist wave vanishes without
/// rounding too.
///
/// A pair of taps of which either is missing counts as twice the centre (see
/// [`downsample`](super::downsample())).
#[derive(Clone, Debug, PartialEq)]
pub struct Filter {
    kind: FilterKind,
    centre: f64,
    /// Weight of the pair of samples at distance `2k + 1`, for k from 0.
    pairs: Vec<f64>,
}

impl Default for Filter {
    fn default() -> Self {
        Self::sinc_blackman(DEFAULT_LOBES)
    }
}

impl From<FilterKind> for Filter {
    /// The filter of that name, with [`DEFAULT_LOBES`] where it may have any number.
    fn from(kind: FilterKind) -> Self {
        Self::new(kind, DEFAULT_LOBES)
    }
}

impl Filter {
    /// The sinc windowed by Blackman over `lobes` lobes a side, from 1 (the kernel 1/4 1/2 1/4) to
    /// [`MAX_LOBES`]; what lies outside counts as the nearest of them, as [`Filter::lobes`] then says.
    ///
    /// With `t` the distance from the centre in fine samples and `a` the lobes a side (counted in coarse
    /// samples, so that the kernel ends at `t = 2a`), a tap is
    ///
    /// `sin(pi t / 2) / (pi t) * (0.42 + 0.5 cos(pi t / 2a) + 0.08 cos(pi t / a))`
    ///
    /// the sinc whose cut-off is half the fine Nyquist frequency, times Blackman's window (Blackman and Tukey,
    /// The Measurement of Power Spectra, 1958, section B.5). It is 0 at every even `t` but the centre.
    pub fn sinc_blackman(lobes: u32) -> Self {
        Self::new(FilterKind::SincBlackman, lobes.clamp(1, MAX_LOBES))
    }

    fn new(kind: FilterKind, lobes: u32) -> Self {
        let (raw, side) = kind.side(lobes);
        let sum: f64 = raw.iter().sum();
        let on_step = |w: f64| (w / TAP_STEP).round() * TAP_STEP;
        let mut pairs: Vec<f64> = raw.iter().map(|w| on_step(w / sum * side)).collect();
        if let Some(greatest) = pairs.first_mut() {
            *greatest = on_step(side);
        }
        // What rounding left over goes to the greatest tap; all of this is exact.
        for k in 1..pairs.len() {
            pairs[0] -= pairs[k];
        }
        Self {
            kind,
            centre: 1.0 - 2.0 * on_step(side),
            pairs,
        }
    }

    /// Its name.
    pub fn kind(&self) -> FilterKind {
        self.kind
    }

    /// How far the kernel reaches a side, in coarse samples; also the number of pairs of taps. For the windowed sincs
    /// these are its lobes, for others what lobes would reach as far: 0 for `point`, 1 for `box` and `bilinear`, 2 for
    /// `cubic`, 3 for `lanczos3`.
    pub fn lobes(&self) -> u32 {
        self.pairs.len() as u32
    }

    /// Weight of the centre.
    pub fn centre(&self) -> f64 {
        self.centre
    }

    /// Whether results are kept within the range of the samples that are weighed, along each axis in turn.
    pub fn is_clamped(&self) -> bool {
        self.kind == FilterKind::SincBlackmanClamped
    }

    /// Weights of the pairs at distances 1, 3, 5, ... fine samples.
    pub fn pairs(&self) -> &[f64] {
        &self.pairs
    }

    /// The share of the range of the samples under the kernel by which a result, in two dimensions, may leave
    /// that range at either end.
    ///
    /// Let `n` be the sum of the negative weights' sizes in one dimension; the positive ones then sum to
    /// `1 + n`. On samples in 0 to 1 a result lies in `-n` to `1 + n`. Voids and edges do not widen that: a
    /// missing pair moves its weight to the centre, which (as `n` is below its weight) stays positive, so a missing positive
    /// pair leaves both sums as they are and a missing negative one shrinks both. Rows thus give values in an
    /// interval of width `1 + 2n`, and columns of those exceed it by `n (1 + 2n)` more: in all
    /// `n + n (1 + 2n) = 2n (1 + n)`, which is also the sum of the negative weights of the product kernel,
    /// hence attained. A filter that clamps has none: rows stay within their samples, columns within those rows.
    ///
    /// It does not speak of a last row or column that lies beyond the fine level (it continues the coarse row
    /// in a straight line), nor of the rounding of a stored height.
    pub fn overshoot(&self) -> f64 {
        if self.is_clamped() {
            return 0.0;
        }
        let n: f64 = self.pairs.iter().map(|w| 2.0 * (-w).max(0.0)).sum();
        2.0 * n * (1.0 + n)
    }

    /// The factor by which the filter multiplies a wave of `frequency` times the fine Nyquist frequency
    /// (0 to 1; the coarse Nyquist frequency is 0.5), along one axis and away from edges and voids, before any
    /// clamping.
    ///
    /// The default, of 4 lobes: 0.999 at 0.1, 0.989 at 0.25, 0.858 at 0.375, 0.5 at 0.5, 0.142 at 0.625, 0.011 at 0.75,
    /// and at most 0.012 from there to 1, where it is 0.
    pub fn response(&self, frequency: f64) -> f64 {
        let wave = |k: usize| (std::f64::consts::PI * frequency * (2 * k + 1) as f64).cos();
        self.centre
            + self
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

    /// All kinds, and the default's with every number of lobes.
    fn all() -> impl Iterator<Item = Filter> {
        let kinds = FilterKind::ALL.into_iter().map(Filter::from);
        kinds.chain((1..=MAX_LOBES).map(Filter::sinc_blackman))
    }

    #[test]
    fn weights_sum_exactly_and_vanish_exactly_at_nyquist() {
        for filter in all() {
            let name = format!("{} of {} lobes", filter.kind(), filter.lobes());
            let mut plus = filter.centre();
            let mut minus = filter.centre();
            for w in filter.pairs().iter().chain([&filter.centre()]) {
                assert_eq!(
                    (w / TAP_STEP).fract(),
                    0.0,
                    "{name}: {w} is not a multiple of the step"
                );
            }
            for w in filter.pairs() {
                plus += w * 2.0;
                minus += w * -2.0;
            }
            assert_eq!(plus, 1.0, "{name}");
            match filter.kind() {
                FilterKind::Point => assert_eq!(minus, 1.0),
                FilterKind::Box => assert!((minus + 1.0 / 3.0).abs() < 2.0 * TAP_STEP, "{minus}"),
                _ => assert_eq!(minus, 0.0, "{name}"),
            }
        }
        assert_eq!(Filter::sinc_blackman(1).pairs(), [0.25]);
        assert_eq!(Filter::sinc_blackman(0), Filter::sinc_blackman(1));
        assert_eq!(Filter::sinc_blackman(u32::MAX).lobes(), MAX_LOBES);
        assert_eq!(Filter::default(), FilterKind::default().into());
    }

    #[test]
    fn the_others_have_the_taps_of_their_sources() {
        // By distance from the centre; worked out by hand from the sources' formulas.
        let table: [(&str, f64, &[f64]); 5] = [
            ("point", 1.0, &[]),
            ("box", 1.0 / 3.0, &[1.0 / 3.0]),
            ("bilinear", 0.5, &[0.25]),
            ("cubic", 0.5, &[0.28125, -0.03125]),
            ("lanczos3", 0.5, &[0.305707, -0.067935, 0.012229]),
        ];
        for (name, centre, pairs) in table {
            let filter = Filter::from(name.parse::<FilterKind>().unwrap());
            assert_eq!(filter.pairs().len(), pairs.len(), "{name}");
            let taps = filter.pairs().iter().zip(pairs);
            for (got, want) in taps.chain([(&filter.centre(), &centre)]) {
                assert!((got - want).abs() < 1e-6, "{name}: {got} against {want}");
            }
        }
        let clamped = Filter::from(FilterKind::SincBlackmanClamped);
        assert_eq!(clamped.pairs(), Filter::default().pairs());
        assert!(clamped.is_clamped() && !Filter::default().is_clamped());
    }

    #[test]
    fn names_come_back_and_others_are_refused() {
        for kind in FilterKind::ALL {
            assert_eq!(kind.name().parse::<FilterKind>().unwrap(), kind);
        }
        let error = "Lanczos".parse::<FilterKind>().unwrap_err().to_string();
        assert!(error.contains("Lanczos") && error.contains("lanczos3"), "{error}");
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
        for filter in all().filter(|filter| !filter.is_clamped()) {
            let name = format!("{} of {} lobes", filter.kind(), filter.lobes());
            // Samples of 1 under negative weights of the product kernel, 0 elsewhere.
            let axis: Vec<f64> = filter
                .pairs()
                .iter()
                .flat_map(|w| [*w, *w])
                .chain([filter.centre()])
                .collect();
            let worst: f64 = axis
                .iter()
                .flat_map(|a| axis.iter().map(move |b| (a * b).min(0.0)))
                .sum();
            assert!((filter.overshoot() + worst).abs() < 1e-12, "{name}");
            let negative: f64 = filter.pairs().iter().map(|w| 2.0 * (-w).max(0.0)).sum();
            assert!(
                negative < filter.centre(),
                "{name}: the centre could turn negative"
            );
        }
        assert_eq!(Filter::from(FilterKind::SincBlackmanClamped).overshoot(), 0.0);
    }
}
