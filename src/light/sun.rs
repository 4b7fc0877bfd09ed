//! The sun's share: how much of its disc stands over the horizon, times the cosine of its incidence.

use super::horizon::{Rays, Relief, direction, each_band};
use super::normal::normal;
use super::{check, misuse};
use crate::error::Result;
use crate::grid::Grid;
use crate::progress::Progress;
use crate::work::Work;

/// The sun's angular diameter in degrees.
pub const DISC_DEG: f64 = 0.53;

/// Where the sun stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// Degrees clockwise from true north.
    pub azimuth_deg: f64,
    /// Degrees above the level horizon, -90 to 90.
    pub altitude_deg: f64,
}

impl Default for Sun {
    /// In the north-west at half height, from where relief is read rightly on maps with north at the top.
    fn default() -> Self {
        Self {
            azimuth_deg: 315.0,
            altitude_deg: 45.0,
        }
    }
}

impl Sun {
    /// Refuses angles that are no position of the sun.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Misuse`] where an angle is not finite or the altitude is outside of -90 to 90.
    pub fn check(&self) -> Result<()> {
        let Self {
            azimuth_deg,
            altitude_deg,
        } = self;
        if !azimuth_deg.is_finite() {
            return Err(misuse(format!("a sun at azimuth {azimuth_deg} is nowhere"))
                .advice("give degrees from north"));
        }
        if !(-90.0..=90.0).contains(altitude_deg) {
            let what = format!("a sun at altitude {altitude_deg} is nowhere");
            return Err(misuse(what).advice("give degrees from -90 to 90"));
        }
        Ok(())
    }

    /// The unit vector from the ground to the sun in the world: x east, y up, z south.
    pub fn direction(&self) -> [f64; 3] {
        let [east, south] = direction(self.azimuth_deg);
        let (sin, cos) = if self.altitude_deg.abs() == 90.0 {
            (self.altitude_deg.signum(), 0.0)
        } else {
            self.altitude_deg.to_radians().sin_cos()
        };
        [east * cos, sin, south * cos]
    }
}

/// The share of the sun's disc above a horizon that stands at `horizon_rad`, its centre at `altitude_rad`: the
/// horizon is taken as a level line across the disc, so what is hidden is a segment of a circle.
pub fn disc_share(horizon_rad: f64, altitude_rad: f64) -> f64 {
    let radius = (DISC_DEG / 2.0).to_radians();
    let x = ((altitude_rad - horizon_rad) / radius).clamp(-1.0, 1.0);
    1.0 - (x.acos() - x * (1.0 - x * x).sqrt()) / std::f64::consts::PI
}

/// The sun's share for every sample of `heights` (level 0 of `grid`), 0 to 1: the share of its disc above the
/// horizon at its azimuth, times `max(0, normal . sun)`. The horizon is nowhere below level. NaN at voids.
///
/// # Errors
/// [`crate::ErrorKind::Misuse`] where the grid or the sun is impossible or `heights` has another length;
/// [`crate::ErrorKind::Cancelled`].
pub fn sun_share(
    heights: &[f32],
    grid: &Grid,
    sun: Sun,
    work: &dyn Work,
    progress: &dyn Progress,
) -> Result<Vec<f32>> {
    check(grid, heights.len())?;
    sun.check()?;
    progress.begin("sun", grid.size.height as u64);
    let relief = Relief::new(heights, grid);
    let rays = Rays::new(grid, sun.azimuth_deg);
    let to_sun = sun.direction();
    let altitude = sun.altitude_deg.to_radians();
    let radius = (DISC_DEG / 2.0).to_radians();
    // Horizons below the disc hide nothing, those above it all. Beyond a right angle tangents turn negative.
    let from = (altitude - radius).tan().max(0.0);
    let until = if altitude + radius < std::f64::consts::FRAC_PI_2 {
        (altitude + radius).tan()
    } else {
        f64::INFINITY
    };
    let mut shares = vec![f32::NAN; heights.len()];
    each_band(&mut shares, grid, "sun", work, progress, |i, j, share| {
        if heights[j * grid.size.width as usize + i].is_nan() {
            return;
        }
        let n = normal(heights, grid, i, j);
        let cosine = n[0] * to_sun[0] + n[1] * to_sun[1] + n[2] * to_sun[2];
        *share = if cosine <= 0.0 || altitude <= -radius {
            0.0
        } else {
            let tangent = relief.tangent(&rays, i, j, from, until);
            (disc_share(tangent.atan(), altitude) * cosine).min(1.0) as f32
        };
    })?;
    Ok(shares)
}
