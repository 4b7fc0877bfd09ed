//! How high the terrain stands in one direction, exactly, over the triangulated surface of level 0.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use super::crests::Crests;
use super::earth::Earth;
use super::rays::Rays;
use super::relief::{BLOCK, Relief, Scratch, Whole};
use super::{check, misuse};
use crate::error::{Error, Result};
use crate::grid::{Grid, Rect};
use crate::progress::Progress;
use crate::work::{Work, each_chunk, split_columns};

#[cfg(test)]
mod tests;

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
    let whole = Whole::of(heights, grid);
    let relief = Relief::new(grid, &whole, Crests::of(heights, grid, work));
    let rays = Rays::new(grid, earth.on_grid_deg(azimuth_deg), earth.radius_m, 0.0, 1);
    all_rows(grid, "horizon", progress, |rows, tangents| {
        each_block(&relief, rows, tangents, work, |block, scratch, tangents| {
            relief.settle(block, scratch)?;
            relief.raise(&rays, block, f32::INFINITY, tangents, scratch)?;
            for tangent in tangents {
                // No ground stands at a right angle: it is a void that does.
                *tangent = if *tangent == f32::INFINITY {
                    f32::NAN
                } else {
                    *tangent
                };
            }
            Ok(())
        })
    })
}

/// One value a sample of all of `grid`, of which `make` gives so many rows as blocks are high at once; progress advances
/// by rows. `subject` is what is cancelled.
pub(super) fn all_rows<T: Copy + Default>(
    grid: &Grid,
    subject: &str,
    progress: &dyn Progress,
    mut make: impl FnMut(Range<i64>, &mut [T]) -> Result<()>,
) -> Result<Vec<T>> {
    let width = grid.size.width as usize;
    let mut values = vec![T::default(); grid.size.samples() as usize];
    for (rows, z0) in values.chunks_mut(BLOCK[1] * width).zip((0..).step_by(BLOCK[1])) {
        if progress.cancelled() {
            return Err(Error::cancelled(subject));
        }
        let count = (rows.len() / width) as i64;
        make(z0..z0 + count, rows)?;
        progress.advance(count as u64);
    }
    Ok(values)
}

/// Has `task` make the values of every block of `rows`, which begin with one. It is given defaults in rows of
/// [`BLOCK`]`[0]`, of which those within the block are put into `out`, row by row. Blocks below each other, which look at
/// much the same ground, come one after another.
pub(super) fn each_block<T: Copy + Default + Send>(
    relief: &Relief<'_>,
    rows: Range<i64>,
    out: &mut [T],
    work: &dyn Work,
    task: impl Fn(Rect, &mut Scratch, &mut [T]) -> Result<()> + Sync,
) -> Result<()> {
    debug_assert_eq!(rows.start % BLOCK[1] as i64, 0);
    let width = relief.grid().size.width;
    let mut blocks = split_columns(out, width as usize, BLOCK[0]);
    let failed = Mutex::new(None);
    each_chunk(work, &mut blocks, 1, |x, out| {
        let x0 = (x * BLOCK[0]) as i64;
        let mut values = Vec::new();
        let mut scratch = relief.scratch();
        for (z0, out) in (rows.start..).step_by(BLOCK[1]).zip(out[0].chunks_mut(BLOCK[1])) {
            let block = Rect::new(x0, z0, (x0 + BLOCK[0] as i64).min(width), z0 + out.len() as i64);
            values.clear();
            values.resize(BLOCK[0] * out.len(), T::default());
            if let Err(error) = task(block, &mut scratch, &mut values) {
                *failed.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
                break;
            }
            for (row, values) in out.iter_mut().zip(values.chunks(BLOCK[0])) {
                row.copy_from_slice(&values[..row.len()]);
            }
        }
        relief.give_back(scratch);
    });
    failed
        .into_inner()
        .unwrap_or_else(PoisonError::into_inner)
        .map_or(Ok(()), Err)
}
