//! How far a level of procedural terrain strays from level 0 within a region, from what is known of its octaves.
//!
//! Let `H_l` be the height field of level l (see `field.rs`), `S_l` its triangulation with step s = 2^l, and I
//! linear interpolation between a triangle's corners. At samples of level 0, where the two are compared,
//!
//! `|S_l - S_0| <= |I H_l - H_l| + |H_l - H_0|`.
//!
//! *Left out*, `|H_l - H_0|`: while l carries octaves of D, P and w are those of level 0, and what is missing is
//! w times at most the sum of their peaks. Later all of D is missing, and of B at most the sum of the peaks left
//! out, which P, a contraction, does not magnify.
//!
//! *Interpolated*, `|I f - f|`, at a point x with weights t_i of the corners x_i. A cell's half is a right
//! triangle with legs s: its circumradius is s / sqrt 2, so `sum t_i |x_i - x|^2 <= s^2 / 2` (it is the
//! circumradius squared less the squared distance from the circumcentre).
//! 1. If no second derivative of f in any direction exceeds M, then `|I f - f| <= M s^2 / 4` (Taylor's formula
//!    at x; S. Waldron, The error in linear interpolation at the vertices of a simplex, SIAM J. Numer. Anal. 35,
//!    1998).
//! 2. `|I g(f) - g(f)| <= max |g'| |I f - f| + max |g''| max |f'|^2 s^2 / 4` (Taylor's formula of g at f(x)).
//! 3. For a crest g, which is concave, the second term of 2 may also be the greatest gap between g and a chord
//!    over the values at the corners, which span at most `max |f'| s sqrt 2`: a quarter of that times the change
//!    of g'.
//! 4. `I (w f) - w f = w (I f - f) + sum t_i (w_i - w) (f_i - f) + f (I w - w)`, of which the middle term is at
//!    most `max |w'| max |f'| s^2 / 2`.
//! 5. Whatever f is, `|I f - f|` is at most the width of its range; `w f` with f's range around 0, at most the
//!    greatest w times that.
//!
//! All bounds grow with the region, so saturation is the greatest of the level's own bound and 1.3 times that
//! of each finer level *over the same region*, which holds those of the children and their neighbours.
//! What is sure for every seed lies far above what is usual. `Synth` therefore takes the first step down from a
//! level by its samples: its `error` is exact on level 1, and 19, 18, 16 and 15 times the greatest error found on
//! levels 2 to 5 (mean of 12 patches of `synth:65536:1`).
//!
//! Heights are rounded to f32, which adds at most 2^-24 of the greatest height twice.

use super::field::{
    FINEST, HIGHEST_M, OCTAVES, Region, SOFT_SECOND, SPLIT, Term, WEIGHT_FIRST, WEIGHT_SECOND, first_octave,
};

/// What saturation multiplies a finer level's error with: the design's 1.3 and room for rounding to f32.
const SATURATION: f64 = 1.3 * (1.0 + 1e-6);

/// Upper bound of |S_l - S_0| in the region, in metres.
pub(super) fn error(level: u32, region: &Region) -> f64 {
    if level == 0 {
        return 0.0;
    }
    let step = (1u64 << level) as f64;
    let quarter = step * step / 4.0;
    let first = (first_octave(level) - FINEST).min(OCTAVES as u32) as usize;
    let split = (SPLIT - FINEST) as usize;
    let (left_out, kept) = region.terms.split_at(first);
    let (left_out_detail, left_out_base) = left_out.split_at(first.min(split));
    let (detail, base) = kept.split_at(split.saturating_sub(first));
    let weight = region.weight.hi;

    let base_first: f64 = base.iter().map(|t| t.first).sum();
    let steepness = base_first * base_first * quarter;
    let land = base.iter().map(|t| interpolated(t, step)).sum::<f64>() + SOFT_SECOND * steepness;
    let weights = WEIGHT_FIRST * land + WEIGHT_SECOND * steepness;
    let ridges = |t: &Term| {
        let product = weight * interpolated(t, step)
            + WEIGHT_FIRST * base_first * t.first * 2.0 * quarter
            + peak(t) * weights;
        product.min(weight * (t.range.hi.max(0.0) - t.range.lo.min(0.0)))
    };
    let missing =
        weight * left_out_detail.iter().map(peak).sum::<f64>() + left_out_base.iter().map(peak).sum::<f64>();
    let rounding = HIGHEST_M * 2.0 / f64::from(1u32 << 24);
    land + detail.iter().map(ridges).sum::<f64>() + missing + rounding
}

/// The same, saturated: at least 1.3 times that of the next finer level in any region within this one.
pub(super) fn need(level: u32, region: &Region) -> f64 {
    (1..=level).fold(0.0, |need: f64, l| error(l, region).max(SATURATION * need))
}

/// Upper bound of |I f - f| of a term.
fn interpolated(term: &Term, step: f64) -> f64 {
    let quarter = step * step / 4.0;
    let crest = (term.crest * quarter).min(term.bend * step * std::f64::consts::SQRT_2 / 4.0);
    (term.curve * quarter + crest).min(term.range.hi - term.range.lo)
}

fn peak(term: &Term) -> f64 {
    term.range.lo.abs().max(term.range.hi.abs())
}

#[cfg(test)]
mod tests {
    use super::super::field::Field;
    use super::*;

    #[test]
    fn needs_are_saturated_and_lowlands_have_smaller_ones() {
        let field = Field::new(1);
        let (mut least, mut most) = (f64::INFINITY, 0.0f64);
        for case in 0..500 {
            let (x, z) = (case * 7919 % 100_000, case * 104_729 % 100_000);
            let region = field.region(8, x, z, 500);
            assert_eq!((error(0, &region), need(0, &region)), (0.0, 0.0));
            for l in 1..18 {
                assert!(need(l, &region) >= 1.3 * need(l - 1, &region));
                assert!(need(l, &region) >= error(l, &region));
            }
            least = least.min(error(1, &field.region(1, x, z, 20)));
            most = most.max(error(1, &field.region(1, x, z, 20)));
        }
        assert!(least < 0.5 * most, "{least} to {most}");
    }

    #[test]
    fn a_greater_region_has_greater_bounds() {
        let field = Field::new(6);
        for case in 0..200i64 {
            let (x, z) = (case * 7919 % 50_000, case * 104_729 % 50_000);
            let (outer, inner) = (field.region(9, x, z, 300), field.region(9, x + 100, z - 150, 150));
            for l in 1..10 {
                assert!(
                    error(l, &outer) >= error(l, &inner) * (1.0 - 1e-9),
                    "case {case}, level {l}"
                );
            }
        }
    }
}
