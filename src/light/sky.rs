//! The sky's share: how much of the sky dome a sample sees, weighted by the cosine to its normal.

use std::ops::Range;

use super::check;
use super::crests::Crests;
use super::earth::Earth;
use super::horizon::{all_rows, each_block};
use super::rays::{Rays, direction};
use super::relief::{LANES, Relief, Whole, place};
use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::progress::Progress;
use crate::work::Work;

#[cfg(test)]
mod tests;

/// Terrain that could raise a horizon's tangent by no more than this, a twentieth of a degree, is left out: the
/// share changes by less than 0.002.
const SLACK: f64 = 0.0009;

/// The sky's share for every sample of `heights` (level 0 of `grid`), 0 to 1, from the horizon in `directions`
/// azimuths, evenly spread from north. NaN at voids; without directions 1 everywhere.
///
/// The sky view factor of Dozier and Frew (Rapid calculation of terrain parameters for radiation modeling from
/// digital elevation data, IEEE Transactions on Geoscience and Remote Sensing 28, 1990):
///
/// `1 / (2 pi) * integral over phi of cos S sin^2 H + sin S cos(phi - A) (H - sin H cos H)`
///
/// with slope S, aspect A (both of the normal) and H the angle from the zenith down to the horizon at azimuth
/// phi. The sky ends at a level horizon, and where the surface's own tangent plane, `n . s = 0`, stands above the
/// terrain: its far side is not lit. So a plane of slope S has `(1 + cos S) / 2`, and no term is negative.
///
/// The integral is a sum over the directions: on planes of up to 85 degrees it is off by at most 0.087 with 4 of
/// them, 0.017 with 8, 0.0026 with 16.
///
/// # Errors
/// [`crate::ErrorKind::Misuse`] where the grid is impossible or `heights` has another length;
/// [`crate::ErrorKind::Cancelled`].
pub fn sky_share(
    heights: &[f32],
    grid: &Grid,
    directions: u32,
    work: &dyn Work,
    progress: &dyn Progress,
) -> Result<Vec<f32>> {
    sky_share_on(heights, grid, &Earth::default(), directions, work, progress)
}

/// The same over `earth`, with the azimuths spread from grid north; see [`super::horizon_tangents_on`].
///
/// # Errors
/// Those of [`sky_share`].
pub fn sky_share_on(
    heights: &[f32],
    grid: &Grid,
    earth: &Earth,
    directions: u32,
    work: &dyn Work,
    progress: &dyn Progress,
) -> Result<Vec<f32>> {
    check(grid, heights.len())?;
    progress.begin("sky", grid.size.height as u64);
    if directions == 0 {
        return Ok(vec![1.0; heights.len()]);
    }
    let light = Skylight::new(grid, earth, directions);
    let whole = Whole::of(heights, grid);
    let relief = Relief::new(grid, &whole, Crests::of(heights, grid, work));
    all_rows(grid, "sky", progress, |rows, out| {
        light.rows(&relief, rows, out, work, progress)
    })
}

/// The light of the sky over a grid.
pub struct Skylight {
    /// East and south of each direction, and its rays.
    directions: Vec<([f32; 2], Rays)>,
}

impl Skylight {
    /// That from `directions` azimuths, at least 1, over `grid` on `earth`.
    pub fn new(grid: &Grid, earth: &Earth, directions: u32) -> Self {
        let rays = |k: u32| {
            let azimuth_deg = f64::from(k) * 360.0 / f64::from(directions);
            let towards = direction(azimuth_deg).map(|c| c as f32);
            (
                towards,
                Rays::new(grid, azimuth_deg, earth.radius_m, SLACK, directions),
            )
        };
        Self {
            directions: (0..directions).map(rays).collect(),
        }
    }

    /// Its shares (see [`sky_share`]) of `rows`, row by row, beginning with a multiple of [`super::ROWS`].
    ///
    /// # Errors
    /// What the ground meets; [`crate::ErrorKind::Cancelled`].
    pub fn rows(
        &self,
        relief: &Relief<'_>,
        rows: Range<i64>,
        out: &mut [f32],
        work: &dyn Work,
        progress: &dyn Progress,
    ) -> Result<()> {
        each_block(relief, rows, out, work, |block, scratch, sums| {
            relief.settle(block, scratch)?;
            let [mut tangents, mut rises] = std::mem::take(&mut scratch.kept);
            tangents.resize(sums.len(), 0.0);
            rises.clear();
            let slopes = relief.slopes(scratch);
            for group in 0..sums.len() / LANES {
                slopes
                    .rises(place(group as u32))
                    .iter()
                    .for_each(|rises_of| rises.extend(rises_of));
            }
            for ([east, south], rays) in &self.directions {
                if progress.cancelled() {
                    return Err(Error::cancelled("sky"));
                }
                let towards = |rises: &[f32], l: usize| rises[l] * east + rises[LANES + l] * south;
                for (tangents, rises) in tangents
                    .chunks_exact_mut(LANES)
                    .zip(rises.chunks_exact(2 * LANES))
                {
                    for (l, tangent) in tangents.iter_mut().enumerate() {
                        *tangent = towards(rises, l).max(0.0); // 0 at voids too
                    }
                }
                relief.raise(rays, block, f32::INFINITY, &mut tangents, scratch)?;
                let groups = tangents.chunks_exact(LANES).zip(rises.chunks_exact(2 * LANES));
                for (sums, (tangents, rises)) in sums.chunks_exact_mut(LANES).zip(groups) {
                    for l in 0..LANES {
                        let (e, s) = (rises[l], rises[LANES + l]);
                        // cos S, and sin S cos(phi - A), as the normal leans down the slope.
                        let up = 1.0 / (1.0 + e * e + s * s).sqrt();
                        let lean = -towards(rises, l) * up;
                        let tangent = tangents[l].min(1e9);
                        let sin_h_squared = 1.0 / (1.0 + tangent * tangent);
                        let h = arc_cotangent(tangent);
                        sums[l] += up * sin_h_squared + lean * (h - tangent * sin_h_squared);
                    }
                }
            }
            for share in sums {
                // Voids stay NaN.
                *share = (*share / self.directions.len() as f32).clamp(0.0, 1.0);
            }
            scratch.kept = [tangents, rises];
            Ok(())
        })
    }
}

/// The angle whose cotangent is `x`, at least 0, within 1e-6: by formula 4.4.49 of M. Abramowitz and I. A. Stegun,
/// Handbook of Mathematical Functions, 1964, for the arc tangent from 0 to 1.
fn arc_cotangent(x: f32) -> f32 {
    let small = x <= 1.0;
    let z = if small { x } else { 1.0 / x };
    let z2 = z * z;
    let series = [
        0.002_866_225_7_f32,
        -0.016_165_737,
        0.042_909_614,
        -0.075_289_64,
        0.106_562_64,
        -0.142_089,
        0.199_935_51,
        -0.333_331_45,
        1.0,
    ];
    let arc = z * series.iter().fold(0.0, |sum, c| sum * z2 + c);
    if small {
        std::f32::consts::FRAC_PI_2 - arc
    } else {
        arc
    }
}
