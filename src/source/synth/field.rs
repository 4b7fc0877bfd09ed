//! The shape of procedural mountains: octaves of noise, ridged where mountains are, weighted by altitude.
//!
//! With octave k on a lattice of 2^k samples, `n_k` its noise and `A_k` its amplitude, the height at level l is
//!
//! ```text
//! B = MEAN + sum over k >= max(l + 2, SPLIT) of A_k s_k      the lie of the land
//! P = (B + sqrt(B^2 + SOFT^2)) / 2                           lowlands flattened, never below 0
//! D = sum over l + 2 <= k < SPLIT of A_k s_k                 ridges and gullies
//! H_l = P + w(P) D
//! ```
//!
//! with `s = n` for the coarsest octaves and `s = RIDGE_MEAN - sqrt(n^2 + SHARP^2)` for the others: a crest
//! wherever n crosses 0. The weight w rises from [`CALM`] in the lowlands to 1 in the mountains, after F. K.
//! Musgrave's heterogeneous terrain (Ebert and others, Texturing and Modeling, 3rd edition, 2003, chapter 16).
//! Level l leaves out the octaves whose lattice is finer than 4 of its steps, their wavelength with it; as each
//! s has a mean near 0, this moves no level up or down. The weight depends on the octaves of B alone, and these
//! are left out only after all of D.

use super::noise::{Cell, FIRST, Octave, PEAK, SECOND};

/// Lattices of the finest octave: 2^2 samples.
pub(super) const FINEST: u32 = 2;
/// The first octave that shapes the land rather than its ridges.
pub(super) const SPLIT: u32 = 9;
/// The last ridged octave.
const LAST_RIDGED: u32 = 11;

/// Amplitudes in metres, from octave [`FINEST`] on. Within the mountains they fall by 0.53 an octave, as the
/// relief of real ranges does.
const AMPLITUDES_M: [f64; 18] = [
    6.0, 16.0, 50.0, 150.0, 420.0, 1050.0, 2000.0, 2900.0, 3000.0, 2400.0, 1300.0, 1000.0, 700.0, 500.0,
    400.0, 300.0, 300.0, 300.0,
];
/// The number of octaves.
pub(super) const OCTAVES: usize = AMPLITUDES_M.len();

/// Height of the land in the mean, in metres.
const MEAN_M: f64 = 1700.0;
/// Width of the bend at which lowlands flatten, in metres.
const SOFT_M: f64 = 300.0;
/// Roundness of crests, in units of the noise.
const SHARP: f64 = 0.05;
/// Mean of `sqrt(n^2 + SHARP^2)`.
const RIDGE_MEAN: f64 = 0.199;
/// Weight of ridges in the lowlands.
const CALM: f64 = 0.1;
/// Altitudes between which the weight rises, in metres.
const RISE_M: [f64; 2] = [200.0, 2200.0];

/// An interval of numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Range {
    pub(super) lo: f64,
    pub(super) hi: f64,
}

impl Range {
    fn new(lo: f64, hi: f64) -> Self {
        Self { lo, hi }
    }

    fn plus(self, other: Self) -> Self {
        Self::new(self.lo + other.lo, self.hi + other.hi)
    }

    /// The least magnitude within it.
    fn least_magnitude(self) -> f64 {
        if self.lo <= 0.0 && self.hi >= 0.0 {
            0.0
        } else {
            self.lo.abs().min(self.hi.abs())
        }
    }

    /// Times a range that is nowhere negative.
    fn times(self, other: Self) -> Self {
        Self::new(
            (self.lo * other.lo).min(self.lo * other.hi),
            (self.hi * other.lo).max(self.hi * other.hi),
        )
    }
}

/// What is known of an octave's term `A s` within a region: bounds that grow with the region.
///
/// With n the octave's noise, `|n'| <= FIRST / cell`, `|n''| <= SECOND / cell^2` in any direction, per sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Term {
    /// Least and greatest value in metres, 0 among them where the region's level leaves the octave out.
    pub(super) range: Range,
    /// Upper bound of |A ds/dn n'|.
    pub(super) first: f64,
    /// Upper bound of |A ds/dn n''|.
    pub(super) curve: f64,
    /// Upper bound of |A d2s/dn2 n'^2|, great only where there may be a crest.
    pub(super) crest: f64,
    /// Upper bound of |A n'| times the change of ds/dn over the region.
    pub(super) bend: f64,
}

/// What is known of the field within a region.
#[derive(Clone, Debug)]
pub(super) struct Region {
    /// The terms, from octave [`FINEST`] on.
    pub(super) terms: [Term; OCTAVES],
    /// Range of the height in metres, of the region's level and of all finer ones.
    pub(super) heights: Range,
    /// Range of the weight w.
    pub(super) weight: Range,
}

/// No height is greater in magnitude: peaks of the ridges are below their amplitude, and P <= B + SOFT / 2 + MEAN.
pub(super) const HIGHEST_M: f64 = {
    let mut sum = MEAN_M + SOFT_M;
    let mut i = 0;
    while i < OCTAVES {
        sum += AMPLITUDES_M[i];
        i += 1;
    }
    sum
};

/// Upper bounds of w' and w''.
pub(super) const WEIGHT_FIRST: f64 = (1.0 - CALM) * 1.5 / (RISE_M[1] - RISE_M[0]);
/// See [`WEIGHT_FIRST`].
pub(super) const WEIGHT_SECOND: f64 =
    (1.0 - CALM) * 6.0 / ((RISE_M[1] - RISE_M[0]) * (RISE_M[1] - RISE_M[0]));
/// Upper bound of the second derivative of P over B; its first is at most 1.
pub(super) const SOFT_SECOND: f64 = 1.0 / (2.0 * SOFT_M);

/// The first octave that level `level` carries.
pub(super) fn first_octave(level: u32) -> u32 {
    FINEST + level
}

fn is_ridged(k: u32) -> bool {
    k <= LAST_RIDGED
}

fn amplitude_m(k: u32) -> f64 {
    AMPLITUDES_M[(k - FINEST) as usize]
}

/// s for a noise n.
fn shape(k: u32, n: f64) -> f64 {
    if is_ridged(k) {
        RIDGE_MEAN - (n * n + SHARP * SHARP).sqrt()
    } else {
        n
    }
}

/// The term of octave k where its noise has range `n`.
///
/// A crest, `s = c - sqrt(n^2 + e^2)`, has `ds/dn = -n / sqrt(n^2 + e^2)`, of magnitude below 1 and falling
/// with n, and `d2s/dn2 = -e^2 / (n^2 + e^2)^(3/2)`, greatest in magnitude where |n| is least.
fn term(k: u32, n: Range) -> Term {
    let slope = amplitude_m(k) * FIRST / (1u64 << k) as f64;
    let curve = amplitude_m(k) * SECOND / ((1u64 << k) as f64 * (1u64 << k) as f64);
    let range = shaped(k, n);
    if !is_ridged(k) {
        return Term {
            range,
            first: slope,
            curve,
            crest: 0.0,
            bend: 0.0,
        };
    }
    let e2 = SHARP * SHARP;
    let rise = |n: f64| n / (n * n + e2).sqrt();
    let steepest = rise(n.lo.abs().max(n.hi.abs()));
    let near = n.least_magnitude();
    let w2 = near * near + e2;
    let sharp = e2 / (w2 * w2.sqrt());
    Term {
        range,
        first: slope * steepest,
        curve: curve * steepest,
        crest: slope * FIRST / (1u64 << k) as f64 * sharp,
        bend: slope * (rise(n.hi) - rise(n.lo)),
    }
}

/// The range of octave k's term where its noise has range `n`.
fn shaped(k: u32, n: Range) -> Range {
    let a = amplitude_m(k);
    if !is_ridged(k) {
        return Range::new(a * n.lo, a * n.hi);
    }
    let nearest = n.least_magnitude();
    let farthest = n.lo.abs().max(n.hi.abs());
    Range::new(a * shape(k, farthest), a * shape(k, nearest))
}

fn flattened(b: f64) -> f64 {
    0.5 * (b + (b * b + SOFT_M * SOFT_M).sqrt())
}

fn weight(height_m: f64) -> f64 {
    let t = ((height_m - RISE_M[0]) / (RISE_M[1] - RISE_M[0])).clamp(0.0, 1.0);
    CALM + (1.0 - CALM) * (t * t * (3.0 - 2.0 * t))
}

/// All octaves of a seed.
#[derive(Clone, Debug)]
pub(super) struct Field {
    octaves: [Octave; OCTAVES],
}

/// The cells that the octaves were last asked for.
pub(super) type Cells = [Cell; OCTAVES];

impl Field {
    pub(super) fn new(seed: u64) -> Self {
        Self {
            octaves: std::array::from_fn(|i| Octave::new(FINEST + i as u32, seed)),
        }
    }

    /// The height at column x, row z of level 0, with the octaves of `level`, in metres.
    pub(super) fn height(&self, level: u32, x: i64, z: i64, cells: &mut Cells) -> f64 {
        let (x, z) = (x as f64, z as f64);
        let mut sum = |from: u32, to: u32, start: f64| {
            let mut sum = start;
            for k in (from..to).rev() {
                let i = (k - FINEST) as usize;
                sum += amplitude_m(k) * shape(k, self.octaves[i].at(x, z, &mut cells[i]));
            }
            sum
        };
        let first = first_octave(level);
        let land = flattened(sum(first.max(SPLIT), FINEST + OCTAVES as u32, MEAN_M));
        if first >= SPLIT {
            return land;
        }
        land + weight(land) * sum(first, SPLIT, 0.0)
    }

    /// What is known of all points within `radius` columns and rows of (x, z), for the field of `level` and of
    /// every finer level.
    ///
    /// Each octave's noise lies within `n(x, z) +- 2 radius FIRST / cell`, and within its peak, and the term is
    /// 0 where a level leaves it out. All steps are monotone under inclusion: what is said of a region within
    /// another, or of a finer level, is never wider (up to rounding).
    pub(super) fn region(&self, level: u32, x: i64, z: i64, radius: i64) -> Region {
        let mut base = Range::new(MEAN_M, MEAN_M);
        let mut detail = Range::new(0.0, 0.0);
        let terms = std::array::from_fn(|i| {
            let (octave, k) = (&self.octaves[i], FINEST + i as u32);
            let n = octave.at(x as f64, z as f64, &mut { Cell::NONE });
            let reach = 2.0 * radius as f64 * FIRST / octave.cell;
            let mut term = term(k, Range::new((n - reach).max(-PEAK), (n + reach).min(PEAK)));
            if k < first_octave(level) {
                term.range = Range::new(term.range.lo.min(0.0), term.range.hi.max(0.0));
            }
            let sum = if k >= SPLIT { &mut base } else { &mut detail };
            *sum = sum.plus(term.range);
            term
        });
        let land = Range::new(flattened(base.lo), flattened(base.hi));
        let weight = Range::new(weight(land.lo), weight(land.hi));
        Region {
            terms,
            heights: land.plus(detail.times(weight)),
            weight,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Greatest first and second difference quotients of `f` over `from` to `to`, in steps of `h`.
    fn quotients(f: impl Fn(f64) -> f64, from: f64, to: f64, h: f64) -> [f64; 2] {
        let mut most = [0.0f64; 2];
        let mut x = from;
        while x < to {
            most[0] = most[0].max(((f(x + h) - f(x - h)) / (2.0 * h)).abs());
            most[1] = most[1].max(((f(x + h) - 2.0 * f(x) + f(x - h)) / (h * h)).abs());
            x += h;
        }
        most
    }

    #[test]
    fn the_shapes_have_the_derivatives_that_the_bounds_use() {
        let [first, second] = quotients(flattened, -3000.0, 3000.0, 0.5);
        assert!(first <= 1.0 + 1e-9 && second <= SOFT_SECOND * 1.0001 && second > 0.99 * SOFT_SECOND);
        let [first, second] = quotients(weight, -500.0, 3500.0, 0.5);
        assert!(
            first <= WEIGHT_FIRST * 1.0001 && first > 0.99 * WEIGHT_FIRST,
            "{first}"
        );
        assert!(
            second <= WEIGHT_SECOND * 1.0001 && second > 0.9 * WEIGHT_SECOND,
            "{second}"
        );
        let [first, second] = quotients(|n| shape(FINEST, n), -1.0, 1.0, 1e-4);
        assert!(
            first < 1.0 && second <= 1.0001 / SHARP && second > 0.99 / SHARP,
            "{second}"
        );
    }

    #[test]
    fn ridges_have_a_mean_near_0_so_that_no_level_sinks() {
        let field = Field::new(5);
        for k in [FINEST, 6, LAST_RIDGED] {
            let octave = &field.octaves[(k - FINEST) as usize];
            let mut cell = Cell::NONE;
            let step = octave.cell * 0.37;
            let sum: f64 = (0..40_000)
                .map(|i| {
                    shape(
                        k,
                        octave.at(f64::from(i % 200) * step, f64::from(i / 200) * step, &mut cell),
                    )
                })
                .sum();
            assert!(
                (sum / 40_000.0).abs() < 0.01,
                "octave {k}: mean {}",
                sum / 40_000.0
            );
        }
    }

    #[test]
    fn ranges_hold_every_height_and_nest() {
        let field = Field::new(3);
        let mut cells = [Cell::NONE; OCTAVES];
        let mut tight = f64::INFINITY;
        for case in 0..400i64 {
            let (level, radius) = ((case % 9) as u32, 1 + case * case % 700);
            let (x, z) = (case * 7919 % 100_000, case * 104_729 % 90_000);
            let Region {
                heights: outer,
                weight,
                ..
            } = field.region(level, x, z, radius);
            assert!(weight.lo >= CALM && weight.hi <= 1.0 + 1e-12);
            let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
            for step in 0..50 {
                let dx = (step * 37 % 101) * 2 * radius / 100 - radius;
                let dz = (step * 53 % 101) * 2 * radius / 100 - radius;
                let finer = (step as u32) % (level + 1);
                let height = field.height(finer, x + dx, z + dz, &mut cells);
                assert!(
                    (outer.lo..=outer.hi).contains(&height),
                    "case {case}: {height} outside {outer:?}"
                );
                (least, most) = (least.min(height), most.max(height));
                let inner = radius - dx.abs().max(dz.abs());
                let range = field.region(finer, x + dx, z + dz, inner).heights;
                assert!(
                    range.lo >= outer.lo - 1e-6 && range.hi <= outer.hi + 1e-6,
                    "case {case}"
                );
            }
            tight = tight.min((outer.hi - outer.lo) / (most - least));
        }
        // The ranges say something: somewhere they are less than 4 times what is there.
        assert!(tight < 4.0, "{tight}");
    }
}
