//! The ground under the eye, level by level, from which each level measures the camera's climb.
//!
//! `G_m` is `S_m` with every sample that is void or has not arrived replaced by the next coarser level's value there,
//! on the coarsest level by the DEM's least height, and moved towards that value by as much as fade holds level `m`
//! back there: so data that arrive never move it at once. The ground for level `l` is the highest of `G_1` to `G_{l+1}` under
//! the eye (clamped to the DEM): it never falls from level to level, so the climb in steps at least halves, as fact
//! (c) of [`super::alpha`] needs.

use super::alpha;
use super::eye::Eye;
use super::held::HeldField;
use super::window::Window;
use crate::grid::Grid;

/// What the ground is made of.
#[derive(Clone, Copy)]
pub(super) struct Ground<'a> {
    pub(super) windows: &'a [Window],
    pub(super) grid: &'a Grid,
    pub(super) held: &'a HeldField,
    /// The DEM's least height in metres above its base.
    pub(super) least_m: f32,
}

/// The ground for each level but the coarsest, finest first, in metres above the DEM's base.
pub(super) fn grounds(ground: &Ground<'_>, eye: &Eye, out: &mut Vec<f64>) {
    let Ground { windows, grid, .. } = *ground;
    let [x, z] = eye.samples();
    let x = x.clamp(0.0, (grid.size.width - 1) as f64);
    let z = z.clamp(0.0, (grid.size.height - 1) as f64);
    out.clear();
    let mut highest = f64::NEG_INFINITY;
    for m in 1..windows.len() {
        let step = (1i64 << m) as f64;
        highest = highest.max(surface(ground, m, x / step, z / step));
        out.push(highest);
    }
}

/// `G_m` at (x, z) in steps of level `m`.
fn surface(ground: &Ground<'_>, m: usize, x: f64, z: f64) -> f64 {
    let (i, j) = (x.floor(), z.floor());
    let (u, v) = (x - i, z - j);
    let at = |di: i64, dj: i64| sample(ground, m, i as i64 + di, j as i64 + dj);
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
fn sample(ground: &Ground<'_>, m: usize, i: i64, j: i64) -> f64 {
    let Ground {
        windows,
        grid,
        held,
        least_m,
    } = *ground;
    let own = windows[m].height(i, j).filter(|h| !h.is_nan()).map(f64::from);
    if m + 1 == windows.len() {
        return own.unwrap_or(f64::from(least_m));
    }
    let coarse = || {
        let at = |i, j| sample(ground, m + 1, i, j);
        (at(i >> 1, j >> 1) + at((i + 1) >> 1, (j + 1) >> 1)) / 2.0
    };
    let back = if held.has_faded_in() {
        0.0
    } else {
        let parents = grid.patches(m as u32 + 1);
        let last = [parents.width as i32 - 1, parents.height as i32 - 1];
        f64::from(alpha::faded(held, last, m as u32, i as i32, j as i32))
    };
    match own {
        Some(own) if back == 0.0 => own,
        Some(own) if back < 1.0 => own + back * (coarse() - own),
        _ => coarse(),
    }
}
