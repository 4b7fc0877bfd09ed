//! The sun's share: how much of its disc stands over the horizon, times the cosine of its incidence.

use std::ops::Range;

use super::crests::Crests;
use super::earth::Earth;
use super::horizon::{all_rows, each_block};
use super::rays::{Rays, direction};
use super::relief::{LANES, Relief, Whole, place};
use super::{check, misuse};
use crate::error::{Error, Result};
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
    sun_share_on(heights, grid, &Earth::default(), sun, work, progress)
}

/// The same over `earth`: the sun's azimuth is turned to its grid, and it curves; see [`super::horizon_tangents_on`].
///
/// # Errors
/// Those of [`sun_share`].
pub fn sun_share_on(
    heights: &[f32],
    grid: &Grid,
    earth: &Earth,
    sun: Sun,
    work: &dyn Work,
    progress: &dyn Progress,
) -> Result<Vec<f32>> {
    check(grid, heights.len())?;
    let light = Sunlight::new(grid, earth, sun)?;
    progress.begin("sun", grid.size.height as u64);
    let whole = Whole::of(heights, grid);
    let relief = Relief::new(grid, &whole, Crests::of(heights, grid, work));
    all_rows(grid, "sun", progress, |rows, out| {
        light.rows(&relief, rows, out, work, progress)
    })
}

/// The light of a sun over a grid.
pub struct Sunlight {
    rays: Rays,
    altitude: f64,
    /// Horizons up to the first tangent hide nothing, those from the second on all of the disc.
    from: f32,
    until: f32,
    /// The share of the disc over the first.
    lowest: f32,
    to_sun: [f32; 3],
}

impl Sunlight {
    /// That of `sun` over `grid` on `earth`.
    ///
    /// # Errors
    /// Those of [`Sun::check`].
    pub fn new(grid: &Grid, earth: &Earth, sun: Sun) -> Result<Self> {
        sun.check()?;
        let sun = Sun {
            azimuth_deg: earth.on_grid_deg(sun.azimuth_deg),
            ..sun
        };
        let altitude = sun.altitude_deg.to_radians();
        let radius = (DISC_DEG / 2.0).to_radians();
        // Horizons below the disc hide nothing, those above it all. Beyond a right angle tangents turn negative.
        let from = (altitude - radius).tan().max(0.0) as f32;
        let until = if altitude + radius < std::f64::consts::FRAC_PI_2 {
            (altitude + radius).tan() as f32
        } else {
            f32::INFINITY
        };
        // Of a sun that has set nothing is left, not even over flat ground.
        let from = if altitude <= -radius { f32::INFINITY } else { from };
        Ok(Self {
            rays: Rays::new(grid, sun.azimuth_deg, earth.radius_m, 0.0, 1),
            altitude,
            from,
            until,
            lowest: disc_share(f64::from(from).atan(), altitude) as f32,
            to_sun: sun.direction().map(|c| c as f32),
        })
    }

    /// Its shares (see [`sun_share`]) of `rows`, row by row, beginning with a multiple of [`super::ROWS`].
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
        each_block(relief, rows, out, work, |block, scratch, shares| {
            if progress.cancelled() {
                return Err(Error::cancelled("sun"));
            }
            relief.settle(block, scratch)?;
            let mut cosines = std::mem::take(&mut scratch.kept[0]);
            cosines.clear();
            let slopes = relief.slopes(scratch);
            for (at, tangents) in shares.chunks_exact_mut(LANES).enumerate() {
                let here = slopes.cosines(place(at as u32), self.to_sun);
                // What turns away from the sun needs no ray.
                tangents.copy_from_slice(
                    &here.map(|cosine| if cosine > 0.0 { self.from } else { f32::INFINITY }),
                );
                cosines.extend(here);
            }
            relief.raise(&self.rays, block, self.until, shares, scratch)?;
            for (share, &cosine) in shares.iter_mut().zip(&cosines) {
                let tangent = *share;
                *share = if cosine.is_nan() {
                    f32::NAN
                } else if tangent == f32::INFINITY {
                    0.0
                } else if tangent <= self.from {
                    (self.lowest * cosine).min(1.0)
                } else {
                    ((disc_share(f64::from(tangent).atan(), self.altitude) as f32) * cosine).min(1.0)
                };
            }
            scratch.kept[0] = cosines;
            Ok(())
        })
    }
}
