//! Rays beside a pixel's centre, and all that they hit of the drawn surface: for pixels that one ray does not explain.
//!
//! A rasteriser snaps corners to 1/256 pixel and rounds to f32, so it may draw at a pixel what passes a little beside its
//! centre, and what lies behind that: a triangle seen almost edge on may hide behind the nearer ones on every ray, and
//! still be drawn where the grid bares it. Such a triangle may be narrower than any ring of rays: it is looked for by halving
//! the way between two rays that hit different triangles.

use crate::clipmap::Drawn;
use crate::error::Result;
use crate::query::{Crossing, Picker, Triangle};

/// Pixels from a pixel's centre to the rays beside it.
pub(super) const BESIDE_PX: f64 = 1.0 / 128.0;

/// Pixels from a pixel's centre to the rings between it and those rays.
pub(super) const RINGS_PX: [f64; 2] = [1.0 / 512.0, 1.0 / 256.0];

/// Halvings of the way between two rays: from 1/256 pixel to the 2^-32nd of one.
const HALVINGS: usize = 24;

/// The share of a distance by which a ray goes on from one hit to look for the next: more than its rounding, less
/// than what lies between two triangles at the end of the halvings.
const STEP: f64 = 1e-12;

/// The most hits of a ray that are looked at: rounding may find one twice.
const MOST_HITS: usize = 64;

/// Five places of the picture: a pixel's centre and [`BESIDE_PX`] to each side of it.
pub(super) fn five([x, y]: [f64; 2]) -> [[f64; 2]; 5] {
    [[0.0, 0.0], [-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0]]
        .map(|[east, south]| [x + east * BESIDE_PX, y + south * BESIDE_PX])
}

/// Eight places of the picture around a pixel's centre.
pub(super) fn ring([x, y]: [f64; 2], radius_px: f64) -> [[f64; 2]; 8] {
    std::array::from_fn(|k| {
        let turn = k as f64 * std::f64::consts::FRAC_PI_4;
        [x + radius_px * turn.cos(), y + radius_px * turn.sin()]
    })
}

/// Rays on both sides of, and as near as f64 allows to, the edges of the triangles that the ray at `centre` and others hit.
pub(super) fn edges(
    picker: &mut Picker<'_, Drawn<'_>>,
    centre: [f64; 2],
    rays: &[[f64; 2]],
) -> Result<Vec<[f64; 2]>> {
    let mut edges = Vec::new();
    let at_centre = triangle_at(picker, centre)?;
    for &ray in rays {
        let at_ray = triangle_at(picker, ray)?;
        if at_ray == at_centre {
            continue;
        }
        for (from, at_from, to) in [(centre, at_centre, ray), (ray, at_ray, centre)] {
            let (mut inside, mut outside) = (from, to);
            for _ in 0..HALVINGS {
                let middle = [0, 1].map(|k| (inside[k] + outside[k]) / 2.0);
                if triangle_at(picker, middle)? == at_from {
                    inside = middle;
                } else {
                    outside = middle;
                }
            }
            edges.extend([inside, outside]);
        }
    }
    Ok(edges)
}

fn triangle_at(
    picker: &mut Picker<'_, Drawn<'_>>,
    ray: [f64; 2],
) -> Result<Option<(u32, [i64; 2], Triangle)>> {
    Ok(picker.cast(ray)?.map(|hit| (hit.level, hit.cell, hit.triangle)))
}

/// Hands all that a ray hits, near to far from `start_m` along the view axis on, to `look`, until that finds something.
pub(super) fn find_hit<T>(
    picker: &mut Picker<'_, Drawn<'_>>,
    ray: [f64; 2],
    mut start_m: f64,
    mut look: impl FnMut(&Crossing) -> Option<T>,
) -> Result<Option<T>> {
    for _ in 0..MOST_HITS {
        let Some(hit) = picker.cast_from(ray, start_m)? else {
            break;
        };
        if let Some(found) = look(&hit) {
            return Ok(Some(found));
        }
        start_m = hit.along * (1.0 + STEP);
    }
    Ok(None)
}
