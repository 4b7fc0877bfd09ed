//! Comparisons of numbers: displaced vertices against f64, planes and extreme heights in the pyramid, bounds.

use super::Comparison;
use super::ground::{camera, hash, noise, pyramid, pyramid_with, rough};
use crate::camera::View;
use crate::clipmap::{Clipmap, ClipmapOptions, Eye, displace};
use crate::error::Result;
use crate::grid::{Grid, Rect};
use crate::pyramid::{FilterKind, Pyramid};

/// Half a unit in the last place of an f32, over its value.
const HALF_ULP: f64 = 1.0 / (1u64 << 24) as f64;

/// Frames whose vertices are compared.
const FRAMES: i64 = 12;

fn grid() -> Grid {
    Grid::new(501, 423, [9.0, 11.0])
}

/// Every vertex of [`FRAMES`] frames over white noise: `visit(clipmap, eye, level, [i, j], vertex)`.
fn each_vertex(mut visit: impl FnMut(&Clipmap, &Eye, u32, [i64; 2], &crate::clipmap::Vertex)) -> Result<()> {
    let levels = pyramid(grid(), noise)?;
    let options = ClipmapOptions {
        clip_size: 64,
        ..Default::default()
    };
    for k in 0..FRAMES {
        let mut clipmap = Clipmap::new(&levels, &options)?;
        clipmap.update(
            &levels,
            &View::new(camera(k, &grid(), 0.0, 9000.0), [96, 64])?,
            0.0,
        )?;
        let Some(eye) = clipmap.eye().copied() else {
            continue;
        };
        for instance in clipmap.selection().instances() {
            let last = clipmap.level_constants()[instance.level as usize].last;
            for corner in 0..81 {
                let (x, z) = (corner % 9, corner / 9);
                let vertex = displace(&clipmap, instance, x, z);
                let at = [
                    (instance.origin[0] + x).min(last[0]),
                    (instance.origin[1] + z).min(last[1]),
                ];
                visit(&clipmap, &eye, instance.level, at.map(i64::from), &vertex);
            }
        }
    }
    Ok(())
}

/// Heights of displaced vertices against the same in f64.
///
/// With d the distance in steps, at most N, alpha in f32 is off by at most `4 half-ulps of N / T` and 2 of its own; the
/// height by that times |c - h|, and by 4 half-ulps of |h| + |c|.
pub(super) fn twin_heights() -> Result<Comparison> {
    let (mut worst_m, mut share, mut count) = (0.0f64, 0.0f64, 0u64);
    each_vertex(|clipmap, eye, level, [i, j], vertex| {
        let constants = &clipmap.level_constants()[level as usize];
        if vertex.void || constants.has_coarser == 0 {
            return;
        }
        let height =
            |level: u32, i: i64, j: i64| clipmap.windows()[level as usize].height(i, j).map(f64::from);
        let ends = [
            height(level, i, j),
            height(level + 1, i >> 1, j >> 1),
            height(level + 1, (i + 1) >> 1, (j + 1) >> 1),
        ];
        let [Some(h), Some(c0), Some(c1)] = ends else {
            return;
        };
        let c = (c0 + c1) / 2.0;
        let step = (1i64 << level) as f64;
        let away = |index: i64, axis: usize| ((index << level) as f64 - eye.samples()[axis]).abs() / step;
        let d = away(i, 0).max(away(j, 1)).max(f64::from(constants.climb));
        let (reach, transition) = (clipmap.ring().reach() as f64, clipmap.ring().transition as f64);
        let alpha = ((d - (reach - transition)) / transition).clamp(0.0, 1.0);
        let exact = h + alpha * (c - h);
        let difference = (f64::from(vertex.height) - exact).abs();
        let alpha_off = 4.0 * HALF_ULP * clipmap.ring().clip_size as f64 / transition + 2.0 * HALF_ULP;
        let allowed = alpha_off * (c - h).abs() + 4.0 * HALF_ULP * (h.abs() + c.abs());
        worst_m = worst_m.max(difference);
        share = share.max(if difference == 0.0 {
            0.0
        } else {
            difference / allowed
        });
        count += 1;
    })?;
    let compared = format!(
        "heights of {count} vertices over white noise against f64, {worst_m:.5} m apart at most, over the bound of its \
         rounding"
    );
    Ok(Comparison::new(
        "the vertex function in f32",
        compared,
        share,
        1.0,
        "of the bound",
    ))
}

/// Ground places of displaced vertices against the same in f64: one rounding of the eye's fraction and one of the
/// difference.
pub(super) fn twin_places() -> Result<Comparison> {
    let (mut worst, mut count) = (0.0f64, 0u64);
    each_vertex(|_, eye, level, at, vertex| {
        for (axis, (index, from_eye)) in at.into_iter().zip(vertex.from_eye).enumerate() {
            let exact = (index << level) as f64 - eye.samples()[axis];
            let difference = (f64::from(from_eye) - exact).abs();
            worst = worst.max(difference / (HALF_ULP * (exact.abs() + 1.0)));
        }
        count += 1;
    })?;
    let compared =
        format!("places of {count} vertices against f64, in half-ulps of their distance from the eye");
    Ok(Comparison::new(
        "the vertex function in f32",
        compared,
        worst,
        2.0,
        "half-ulp",
    ))
}

/// Greatest difference between a level and a plane given at level 0.
fn from_plane(made: &Pyramid, level: u32, plane: &dyn Fn(i64, i64) -> f64) -> f64 {
    let size = crate::levels::Levels::grid(made).level(level);
    let cells = size.rect().cells().zip(made.level(level));
    cells
        .map(|((i, j), &h)| (f64::from(h) - plane(i << level, j << level)).abs())
        .fold(0.0, f64::max)
}

const PLANE_SIZES: [(i64, i64); 4] = [(1000, 130), (257, 256), (300, 2), (66, 1013)];

/// Planes whose heights f32 holds, on every level of every filter.
pub(super) fn whole_planes() -> Result<Comparison> {
    let plane = |x: i64, z: i64| (3 * x - 2 * z + 1000) as f64;
    let mut worst = 0.0f64;
    for (width, height) in PLANE_SIZES {
        let grid = Grid::new(width, height, [30.0, 30.0]);
        for kind in FilterKind::ALL {
            let made = pyramid_with(&kind.into(), grid, |x, z| plane(x, z) as f32)?;
            for level in 0..grid.file_levels() {
                worst = worst.max(from_plane(&made, level, &plane));
            }
        }
    }
    let compared =
        "heights of every level, every filter, up to the edge and beyond it, against the plane".into();
    Ok(Comparison::new(
        "planes of whole metres",
        compared,
        worst,
        0.0,
        "m",
    ))
}

/// Planes of any slope: each level rounds once; past the edge and on levels of two columns that is doubled, see the
/// pyramid's tests.
pub(super) fn planes() -> Result<Comparison> {
    let plane = |x: i64, z: i64| 1234.567 + 0.731 * x as f64 - 0.419 * z as f64;
    let mut worst = 0.0f64;
    for (width, height) in PLANE_SIZES {
        let grid = Grid::new(width, height, [30.0, 30.0]);
        for kind in FilterKind::ALL {
            let made = pyramid_with(&kind.into(), grid, |x, z| plane(x, z) as f32)?;
            for level in 0..grid.file_levels() {
                let greatest = made.level(level).iter().fold(0.0f32, |most, h| most.max(h.abs()));
                let unit = f64::from(greatest) * HALF_ULP;
                worst = worst.max(from_plane(&made, level, &plane) / unit);
            }
        }
    }
    let compared = "the same, in half-ulps of the level's greatest height".into();
    Ok(Comparison::new(
        "planes of any slope",
        compared,
        worst,
        16.0,
        "half-ulp",
    ))
}

/// Samples of all levels that differ in any bit once both are at one scale.
fn scaled_levels(what: &str, power: i32, height: impl Fn(i64, i64) -> f32 + Copy) -> Result<Comparison> {
    let factor = 2f64.powi(power);
    let plain = pyramid(grid(), height)?;
    let scaled = pyramid(grid(), |i, j| (f64::from(height(i, j)) * factor) as f32)?;
    let (mut differ, mut count) = (0u64, 0u64);
    for level in 0..grid().file_levels() {
        for (a, b) in plain.level(level).iter().zip(scaled.level(level)) {
            let a = (f64::from(*a) * factor) as f32;
            differ += u64::from(a.to_bits() != b.to_bits() && !(a.is_nan() && b.is_nan()));
            count += 1;
        }
    }
    let compared = format!(
        "samples of all levels, of {count}, that differ in any bit from the same heights times 2^{}",
        -power
    );
    Ok(Comparison::new(what, compared, differ as f64, 0.0, "samples"))
}

/// Heights 1e-30 apart.
pub(super) fn small_heights() -> Result<Comparison> {
    let height = |i, j| (10.0 * hash(7, i, j)).floor() as f32 * 1.25;
    scaled_levels("heights 1e-30 m apart", -100, height)
}

/// Heights up to 1e30.
pub(super) fn large_heights() -> Result<Comparison> {
    scaled_levels("heights up to 1e30 m", 97, |i, j| (7.0 * hash(8, i, j)) as f32)
}

/// White noise through all levels, on sizes that are even on every level.
pub(super) fn white_noise() -> Result<Comparison> {
    let mut greatest = 0.0f64;
    for (width, height) in [(1026, 130), (514, 1000), (131, 66)] {
        let grid = Grid::new(width, height, [30.0, 30.0]);
        let made = pyramid(grid, noise)?;
        for level in 1..grid.file_levels() {
            let most = made.level(level).iter().fold(0.0f32, |most, h| most.max(h.abs()));
            greatest = greatest.max(f64::from(most));
        }
    }
    // An inner sample obeys the kernel, a continued one leaves its row by less than the range.
    let compared = "the greatest height of any level, edges extrapolated, of noise of 0 to 9000 m".into();
    Ok(Comparison::new(
        "white noise at the edges",
        compared,
        greatest,
        18_000.0,
        "m",
    ))
}

/// What levels stray from the DEM against the bounds that say how far they may.
pub(super) fn bounds() -> Result<Comparison> {
    let mut share = 0.0f64;
    let mut count = 0u64;
    for height in [rough as fn(i64, i64) -> f32, noise] {
        let made = pyramid(grid(), height)?;
        for level in 1..grid().file_levels() {
            let (size, patches, step) = (grid().level(level), grid().patches(level), 1i64 << level);
            for (k, bounds) in made.level_bounds(level).iter().enumerate() {
                let (a, b) = (k as i64 % patches.width, k as i64 / patches.width);
                let ground = Rect::new(
                    8 * a * step,
                    8 * b * step,
                    8 * (a + 1) * step + 1,
                    8 * (b + 1) * step + 1,
                );
                for (x, z) in ground.intersection(grid().size.rect()).cells() {
                    let truth = f64::from(made.level(0)[(z * grid().size.width + x) as usize]);
                    let stray = (surface(made.level(level), size.width, [x, z], step) - truth).abs();
                    if stray > 0.0 {
                        share = share.max(stray / f64::from(bounds.error));
                        count += 1;
                    }
                }
            }
        }
    }
    let compared = format!("what levels stray from the DEM at {count} samples over the bound of their patch");
    Ok(Comparison::new(
        "bounds of hills with voids and of white noise",
        compared,
        share,
        1.0,
        "of the bound",
    ))
}

/// `S_l` at a sample of level 0; NaN where it does not exist.
fn surface(level: &[f32], width: i64, [x, z]: [i64; 2], step: i64) -> f64 {
    let (i, j, u, v) = (x / step, z / step, x % step, z % step);
    let weighed = |di: i64, dj: i64, weight: i64| match weight {
        0 => 0.0,
        _ => f64::from(level[((j + dj) * width + i + di) as usize]) * weight as f64,
    };
    let sum = if u >= v {
        weighed(0, 0, step - u) + weighed(1, 0, u - v) + weighed(1, 1, v)
    } else {
        weighed(0, 0, step - v) + weighed(0, 1, v - u) + weighed(1, 1, u)
    };
    sum / step as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn controls_are_caught() {
        // A filter half a sample off does not keep planes, and heights that round when scaled differ.
        let plane = |x: i64, z: i64| (3 * x - 2 * z) as f64;
        let made = pyramid(Grid::new(65, 65, [1.0, 1.0]), |x, z| plane(x, z) as f32).unwrap();
        assert_eq!(from_plane(&made, 1, &plane), 0.0);
        assert!(from_plane(&made, 1, &|x, z| plane(x + 1, z)) > 1.0);
        let subnormal = scaled_levels("control", -148, |i, j| (7.0 * hash(8, i, j)) as f32).unwrap();
        assert!(!subnormal.holds());
        // Bounds halved would be overstepped: the worst sample is at more than half of its bound.
        assert!(bounds().unwrap().largest > 0.5);
    }
}
