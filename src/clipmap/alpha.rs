//! Alpha: the one number that slides a vertex from its own level to the surface of the next coarser one.
//!
//! `alpha_l = max(ring, held)`, each in 0 to 1; 0 on the coarsest level. With `d` the distance from the eye in steps
//! of level `l` (the greatest of the distance east-west, that north-south, and the camera's climb),
//! `ring = clamp((d - (R - T)) / T, 0, 1)`, or `d >= R` where T = 0. `held` is bilinear over the parent patch between
//! the values at its corners ([`super::HeldField`]). The height drawn is `h` where alpha is 0, `c` where alpha is 1,
//! else `h + alpha (c - h)`: `h` the level's own sample, `c` the next coarser surface at the vertex.
//! Sources: Losasso and Hoppe 2004, section 6 (transition regions, and the altitude term with its factor 0.4, of which
//! 1.25 = 0.5 / 0.4 is the inverse in units of a half window); Holkner 2004, section 4.
//!
//! A patch of level `l + 1` is *refined*, its four children being drawn instead of it, unless the ring or the held
//! value of level `l` is 1 on all of it. Three facts make the surface watertight:
//!
//! (a) *Neighbours of one level agree bit for bit.* Alpha at a vertex depends on the vertex's indices, the frame's
//! constants, and corner values read by index. On a side or corner of the parent patch the bilinear value is selected
//! from those of that side alone ([`lerp`] returns its ends exactly), so both patches that share it compute the same.
//!
//! (b) *Where a finer patch meets an unrefined one, alpha is exactly 1 along the shared side*, so both lie on
//! `S_{l+1}`. The unrefined patch U has ring 1 or held 1 on all of it, its closed sides included. If by ring, the
//! selection found `d >= R + MARGIN` on all of U, and [`MARGIN`] exceeds what f32 loses in `d`, so the shader finds
//! `d >= R` and *selects* 1. If by held, all four corners of U are 1, thus so are both ends of the shared side, and
//! the bilinear value there is their lerp, `1 + (1 - 1) k = 1` exactly.
//!
//! (c) *Wherever children are drawn, alpha of their parents' level is exactly 0 on the closed parent patch.* The
//! refined parent, of level `l + 1`, has a point with `d_l < R + MARGIN`; it is 16 steps of level `l` wide, so each
//! of its points has `d_{l+1} < (R + MARGIN) / 2 + 8` (the climb at least halves from level to level, because the
//! ground it is measured from never falls, see [`super::Clipmap`]). From `T <= N/4 - 10` and `R = N/2 - 2`:
//! `R - T >= N/4 + 8`, and `R/2 + 8 = N/4 + 7`: a whole step to spare, so the ring of level `l + 1` is selected 0.
//! For the held field, (c) rests on the order in which patches fade in, see [`super::HeldField`], and on the nesting of
//! need, see `need.rs`: children are drawn where a corner has both below 1, and each by itself makes its share 0.
//!
//! From (b) and (c): neighbours differ by one level at most, and what the finer morphs towards is what is drawn.

use super::constants::ViewConstants;
use super::held::HeldField;

/// Steps by which the selection refines beyond the reach, so that rounding in the shader cannot contradict (b).
///
/// The shader computes `d` from `f32(k) - fraction`, exact but for one rounding of the fraction and one of the
/// difference: at most `2^-24 d + 2^-25` steps each, and refined patches lie within `d < 2^11`. In all below 2^-12.
pub const MARGIN: f64 = 1.0 / 256.0;

/// The ring's share of alpha at distance `d` in steps of the level.
pub fn ring(view: &ViewConstants, d: f32) -> f32 {
    let start = view.reach - view.transition;
    // Selected, not computed, at the ends: a division may be off by an ulp.
    if d >= view.reach {
        1.0
    } else if d > start {
        ((d - start) / view.transition).clamp(0.0, 1.0)
    } else {
        0.0
    }
}

/// From `s` at k = 0 to `t` at k = 1, both exactly.
pub fn lerp(s: f32, t: f32, k: f32) -> f32 {
    if k == 1.0 { t } else { s + (t - s) * k }
}

/// The held field of `level` at its vertex (i, j); `parent_last` is the last patch of the next coarser level.
pub fn held(field: &HeldField, parent_last: [i32; 2], level: u32, i: i32, j: i32) -> f32 {
    between_corners(parent_last, i, j, |x, z| field.corner(level, x, z))
}

/// The fade's share of the held field, likewise.
pub(super) fn faded(field: &HeldField, parent_last: [i32; 2], level: u32, i: i32, j: i32) -> f32 {
    between_corners(parent_last, i, j, |x, z| field.faded(level, x, z))
}

/// Bilinear at vertex (i, j) between the corners of the next coarser level's patch that holds it.
fn between_corners(parent_last: [i32; 2], i: i32, j: i32, at: impl Fn(i64, i64) -> f32) -> f32 {
    // A parent patch is 16 vertices wide; the last one also owns its far side.
    let x = (i >> 4).min(parent_last[0]);
    let z = (j >> 4).min(parent_last[1]);
    let u = (i - (x << 4)) as f32 * 0.0625;
    let v = (j - (z << 4)) as f32 * 0.0625;
    let corner = |dx: i32, dz: i32| at(i64::from(x + dx), i64::from(z + dz));
    lerp(
        lerp(corner(0, 0), corner(1, 0), u),
        lerp(corner(0, 1), corner(1, 1), u),
        v,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;

    fn view(reach: f32, transition: f32) -> ViewConstants {
        ViewConstants {
            reach,
            transition,
            ..ViewConstants::zeroed()
        }
    }

    #[test]
    fn the_ring_is_exactly_0_and_1_at_the_band_s_ends() {
        for t in 1..60 {
            let view = view(126.0, t as f32);
            assert_eq!(ring(&view, 126.0 - t as f32), 0.0);
            assert_eq!(ring(&view, 126.0), 1.0);
            assert!(ring(&view, (126.0f32).next_down()) <= 1.0);
            let middle = ring(&view, 126.0 - t as f32 * 0.5);
            assert!((middle - 0.5).abs() < 1e-6, "transition {t}: {middle}");
        }
        assert_eq!(ring(&view(30.0, 0.0), 30.0f32.next_down()), 0.0);
        assert_eq!(ring(&view(30.0, 0.0), 30.0), 1.0);
    }

    #[test]
    fn patches_that_share_a_side_read_the_same_held_value() {
        let mut field = HeldField::new(1, 8);
        let mut value = 0.1f32;
        for z in 0..6 {
            for x in 0..6 {
                value = (value * 7.31).fract();
                field.set_corner(0, x, z, value);
            }
        }
        // Vertex 32 belongs to parent 2; made the far side of parent 1 it must come out the same.
        for j in 0..32 {
            let own = held(&field, [4, 4], 0, 32, j);
            assert_eq!(own.to_bits(), held(&field, [1, 4], 0, 32, j).to_bits(), "row {j}");
        }
    }

    #[test]
    fn a_constant_is_returned_exactly_as_the_usual_blend_does_not() {
        let mixed = |s: f32, t: f32, k: f32| s * (1.0 - k) + t * k;
        assert!((0..100).any(|k| mixed(0.7, 0.7, k as f32 / 100.0) != 0.7));
        assert!((0..100).all(|k| lerp(0.7, 0.7, k as f32 / 100.0) == 0.7));
    }
}
