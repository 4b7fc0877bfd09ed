//! How high the terrain stands in one direction, exactly, over the triangulated surface of level 0.

use std::sync::atomic::{AtomicBool, Ordering};

use super::earth::Earth;
use super::rays::Rays;
use super::relief::{LANES, Relief};
use super::{BAND, check, misuse};
use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::progress::Progress;
use crate::work::{Work, each_chunk};

#[cfg(test)]
mod tests;

/// Columns that are traced over all rows of a band before the next: what their rays read stays in the cache.
const TILE: usize = 256;

/// The tangent of the elevation of the horizon at `azimuth_deg` (clockwise from north), for every sample; at
/// least 0, as a plain that goes on beyond the DEM would show it; NaN at voids.
///
/// # Errors
/// [`crate::ErrorKind::Misuse`] where the grid is impossible, `heights` has another length, or the azimuth is
/// not finite; [`crate::ErrorKind::Cancelled`].
pub fn horizon_tangents(
    heights: &[f32],
    grid: &Grid,
    azimuth_deg: f64,
    work: &dyn Work,
    progress: &dyn Progress,
) -> Result<Vec<f32>> {
    horizon_tangents_on(heights, grid, &Earth::default(), azimuth_deg, work, progress)
}

/// The same over `earth`: what lies at distance t stands `t^2 / 2R` lower, R its radius. Between two crossings of
/// edges a step s apart the horizon of a curved earth may stand higher than what is found, by at most `s / 2R`.
///
/// # Errors
/// Those of [`horizon_tangents`].
pub fn horizon_tangents_on(
    heights: &[f32],
    grid: &Grid,
    earth: &Earth,
    azimuth_deg: f64,
    work: &dyn Work,
    progress: &dyn Progress,
) -> Result<Vec<f32>> {
    check(grid, heights.len())?;
    if !azimuth_deg.is_finite() {
        return Err(misuse(format!(
            "an azimuth of {azimuth_deg} degrees is not finite"
        )));
    }
    progress.begin("horizon", grid.size.height as u64);
    let relief = Relief::new(heights, grid, work);
    let rays = Rays::new(grid, earth.on_grid_deg(azimuth_deg), earth.radius_m, 0.0);
    let mut tangents = vec![0.0; heights.len()];
    each_lanes(
        &mut tangents,
        grid,
        "horizon",
        work,
        progress,
        |[i, j], tangents| {
            relief.raise(&rays, [i, j], f32::INFINITY, tangents);
            let here = &heights[j * grid.size.width as usize + i..];
            for (tangent, h) in tangents.iter_mut().zip(here) {
                *tangent = if h.is_nan() { f32::NAN } else { *tangent };
            }
        },
    )?;
    Ok(tangents)
}

/// Runs `task` on the values of [`LANES`] samples in a row, or where fewer are left on each alone, with column and
/// row of the first, over bands of rows; progress advances by rows. `subject` is what is cancelled.
pub(super) fn each_lanes(
    values: &mut [f32],
    grid: &Grid,
    subject: &str,
    work: &dyn Work,
    progress: &dyn Progress,
    task: impl Fn([usize; 2], &mut [f32]) + Sync,
) -> Result<()> {
    let width = grid.size.width as usize;
    let cancelled = AtomicBool::new(false);
    each_chunk(work, values, BAND * width, |band, values| {
        if cancelled.load(Ordering::Relaxed) || progress.cancelled() {
            cancelled.store(true, Ordering::Relaxed);
            return;
        }
        for first in (0..width).step_by(TILE) {
            let end = (first + TILE).min(width);
            for (j, row) in (band * BAND..).zip(values.chunks_mut(width)) {
                for (i, lanes) in (first..).step_by(LANES).zip(row[first..end].chunks_mut(LANES)) {
                    task([i, j], lanes);
                }
            }
        }
        progress.advance((values.len() / width) as u64);
    });
    if cancelled.into_inner() {
        Err(Error::cancelled(subject))
    } else {
        Ok(())
    }
}
