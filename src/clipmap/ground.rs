//! The ground under the eye, level by level, from which each level measures the camera's climb.
//!
//! `G_m` is `S_m` with every sample that is void or not resident replaced by the next coarser level's value there, on
//! the coarsest level by the DEM's least height. The ground for level `l` is the highest of `G_1` to `G_{l+1}` under
//! the eye (clamped to the DEM): it never falls from level to level, so the climb in steps at least halves, as fact
//! (c) of [`super::alpha`] needs.

use super::eye::Eye;
use super::window::Window;
use crate::grid::Grid;

/// The ground for each level but the coarsest, finest first, in metres above the DEM's base.
pub(super) fn grounds(windows: &[Window], grid: &Grid, eye: &Eye, least_m: f32, out: &mut Vec<f64>) {
    let [x, z] = eye.samples();
    let x = x.clamp(0.0, (grid.size.width - 1) as f64);
    let z = z.clamp(0.0, (grid.size.height - 1) as f64);
    out.clear();
    let mut highest = f64::NEG_INFINITY;
    for m in 1..windows.len() {
        let step = (1i64 << m) as f64;
        highest = highest.max(surface(windows, m, x / step, z / step, least_m));
        out.push(highest);
    }
}

/// `G_m` at (x, z) in steps of level `m`.
fn surface(windows: &[Window], m: usize, x: f64, z: f64, least_m: f32) -> f64 {
    let (i, j) = (x.floor(), z.floor());
    let (u, v) = (x - i, z - j);
    let at = |di: i64, dj: i64| sample(windows, m, i as i64 + di, j as i64 + dj, least_m);
    // The corners that carry no weight may not exist.
    let (near, far) = (at(0, 0), if u > 0.0 && v > 0.0 { at(1, 1) } else { 0.0 });
    if u >= v {
        let east = if u > 0.0 { at(1, 0) } else { 0.0 };
        near * (1.0 - u) + east * (u - v) + far * v
    } else {
        let south = at(0, 1);
        near * (1.0 - v) + south * (v - u) + far * u
    }
}

/// The value of `G_m` at sample (i, j).
fn sample(windows: &[Window], m: usize, i: i64, j: i64, least_m: f32) -> f64 {
    if let Some(height) = windows[m].height(i, j).filter(|h| !h.is_nan()) {
        return f64::from(height);
    }
    if m + 1 == windows.len() {
        return f64::from(least_m);
    }
    let coarse = |i, j| sample(windows, m + 1, i, j, least_m);
    (coarse(i >> 1, j >> 1) + coarse((i + 1) >> 1, (j + 1) >> 1)) / 2.0
}
