//! The synthetic DEMs and cameras of the comparisons.

use glam::DVec3;

use super::SEED;
use crate::camera::Camera;
use crate::error::Result;
use crate::grid::Grid;
use crate::progress::Silent;
use crate::pyramid::{Filter, Pyramid};
use crate::work::Serial;

/// A number in 0 to 1 that depends on all of its arguments and [`SEED`] (splitmix64's mixing).
pub(super) fn hash(salt: u64, i: i64, j: i64) -> f64 {
    let mut x =
        (i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ (j as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f);
    x = (x ^ (SEED + salt) << 48 ^ x >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ x >> 32).wrapping_mul(0x94d0_49bb_1331_11eb);
    (x >> 11) as f64 / (1u64 << 53) as f64
}

/// Hills of four sizes with rough ground, -400 to 460 m, and 7 % of it void in blocks of 16 x 16.
pub(super) fn rough(i: i64, j: i64) -> f32 {
    if hash(1, i / 16, j / 16) < 0.07 {
        return f32::NAN;
    }
    let (x, z) = (i as f64, j as f64);
    let wave = |length: f64, x: f64, z: f64| length * ((x / length).sin() + (z / length * 1.3).cos());
    (wave(160.0, x, z) + wave(31.0, z, x) + wave(7.0, x + z, x - z) + 60.0 * hash(2, i, j)) as f32
}

/// White noise of 0 to 9000 m.
pub(super) fn noise(i: i64, j: i64) -> f32 {
    (9000.0 * hash(3, i, j)) as f32
}

/// The pyramid of a DEM whose sample (i, j) is `height(i, j)`, with its bounds.
pub(super) fn pyramid(grid: Grid, height: impl Fn(i64, i64) -> f32) -> Result<Pyramid> {
    pyramid_with(&Filter::default(), grid, height)
}

/// The same by another filter.
pub(super) fn pyramid_with(filter: &Filter, grid: Grid, height: impl Fn(i64, i64) -> f32) -> Result<Pyramid> {
    let heights = grid.size.rect().cells().map(|(i, j)| height(i, j)).collect();
    let mut pyramid = Pyramid::new(grid, heights, None, filter, &Serial, &Silent)?;
    pyramid.bound(&Serial, &Silent)?;
    Ok(pyramid)
}

/// The `k`-th camera over a DEM of `grid` whose heights reach from `low_m` to `high_m`: 30 % up to 50 m above the highest
/// ground or within it, the rest up to the DEM's width above; pitch from -90 to 10 degrees, all headings.
pub(super) fn camera(k: i64, grid: &Grid, low_m: f64, high_m: f64) -> Camera {
    let random = |salt: i64, low: f64, high: f64| low + (high - low) * hash(4, k, salt);
    let side = |axis: usize, samples: i64| (samples - 1) as f64 * grid.spacing_m[axis];
    let width_m = side(0, grid.size.width);
    let eye_y_m = if random(0, 0.0, 1.0) < 0.3 {
        random(1, low_m, high_m + 50.0)
    } else {
        high_m + random(1, 0.0, 0.3) * width_m
    };
    Camera {
        eye: DVec3::new(
            random(2, 0.05, 0.95) * width_m,
            eye_y_m,
            random(3, 0.05, 0.95) * side(1, grid.size.height),
        ),
        heading_deg: random(4, 0.0, 360.0),
        pitch_deg: random(5, -90.0, 10.0),
        roll_deg: 0.0,
        fov_deg: 60.0,
    }
}
