//! Light on the terrain: the sun's share and the sky's share of every sample, traced over the DEM's surface.
//!
//! `rays` and `relief` find how high the terrain stands in a direction, `sun` and `sky` make light of it, `fill`
//! spreads it under voids, and [`light_levels`] filters it into levels like the heights. All of it is traced
//! over `S0`, level 0; no data, and what lies beyond the DEM, neither casts a shadow nor blocks the sky.
//!
//! Azimuths are degrees clockwise from true north; [`Earth`] says where the grid's north is, and how the ground curves.
//! [`Sun::at`] is the sun of a time and place. Heights are metres less [`Grid::base_m`], row by row, finite or NaN for no
//! data.

use std::sync::atomic::{AtomicBool, Ordering};

use half::f16;

use crate::error::{Error, ErrorKind, Result};
use crate::grid::{Grid, Size};
use crate::levels::LightSample;
use crate::progress::Progress;
use crate::pyramid::{Filter, downsample};
use crate::work::{Work, each_chunk};

mod day;
mod earth;
mod fill;
mod horizon;
mod normal;
mod rays;
mod relief;
mod sky;
mod sun;
mod sun_at;

pub(crate) use day::disc_coefficients;
pub use day::{
    DAY_POSITIONS, Day, DayTrace, SunTime, day_levels, disc, disc_integral, sun_of_day, trace_day,
};
pub use earth::{DEFAULT_REFRACTION, Earth, middle};
pub use fill::fill_voids;
pub use horizon::{horizon_tangents, horizon_tangents_on};
pub use sky::{sky_share, sky_share_on};
pub use sun::{DISC_DEG, Sun, disc_share, sun_share, sun_share_on};
pub use sun_at::Moment;

/// Sky directions unless others are asked for.
pub const DEFAULT_SKY_DIRECTIONS: u32 = 16;

/// Rows in a band: the unit of work.
const BAND: usize = 16;

/// Samples that are rounded at once.
const CHUNK: usize = 1 << 16;

/// What light is traced.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightOptions {
    /// Where the sun stands.
    pub sun: Sun,
    /// Azimuths in which the horizon is sought for the sky's share; 0 leaves the terrain out of it.
    pub sky_directions: u32,
}

impl Default for LightOptions {
    fn default() -> Self {
        Self {
            sun: Sun::default(),
            sky_directions: DEFAULT_SKY_DIRECTIONS,
        }
    }
}

fn misuse(what: impl std::fmt::Display) -> Error {
    Error::new(ErrorKind::Misuse, "light", what)
}

/// Refuses an impossible grid and samples that are not as many as it says.
fn check(grid: &Grid, samples: usize) -> Result<()> {
    grid.check().map_err(misuse)?;
    if samples as i64 == grid.size.samples() {
        return Ok(());
    }
    let Size { width, height } = grid.size;
    Err(misuse(format!("{samples} samples given for {width} x {height}")))
}

/// Traces the light of level 0 on a flat earth and filters it into all of [`Grid::file_levels`].
///
/// # Errors
/// [`ErrorKind::Misuse`] where the grid or the sun is impossible or `heights` has another length;
/// [`ErrorKind::Cancelled`].
pub fn trace_light(
    grid: &Grid,
    heights: &[f32],
    options: &LightOptions,
    filter: &Filter,
    work: &dyn Work,
    progress: &dyn Progress,
) -> Result<Vec<Vec<LightSample>>> {
    let sun = sun_share(heights, grid, options.sun, work, progress)?;
    let sky = sky_share(heights, grid, options.sky_directions, work, progress)?;
    light_levels(grid, heights, sun, sky, filter, work, progress)
}

/// The light of all of [`Grid::file_levels`] from that of level 0: under voids it is filled outward from valid
/// neighbours, then filtered like heights in f32 and clamped to 0 to 1 on each level; only what is returned
/// is rounded to f16.
///
/// # Errors
/// [`ErrorKind::Misuse`] where the grid is impossible or a length is not the grid's; [`ErrorKind::Cancelled`].
pub fn light_levels(
    grid: &Grid,
    heights: &[f32],
    sun: Vec<f32>,
    sky: Vec<f32>,
    filter: &Filter,
    work: &dyn Work,
    progress: &dyn Progress,
) -> Result<Vec<Vec<LightSample>>> {
    for samples in [heights.len(), sun.len(), sky.len()] {
        check(grid, samples)?;
    }
    let count = grid.file_levels();
    progress.begin(
        "light levels",
        (1..count).map(|l| 2 * grid.level(l).samples() as u64).sum(),
    );
    let filled = |mut share: Vec<f32>| {
        let voids = AtomicBool::new(false);
        each_chunk(work, &mut share, CHUNK, |chunk, share| {
            let mut any = false;
            for (s, h) in share.iter_mut().zip(&heights[chunk * CHUNK..]) {
                *s = if h.is_nan() { f32::NAN } else { s.clamp(0.0, 1.0) };
                any |= s.is_nan();
            }
            voids.fetch_or(any, Ordering::Relaxed);
        });
        if voids.into_inner() {
            fill_voids(&mut share, grid.size);
        }
        share
    };
    let (mut sun, mut sky) = (filled(sun), filled(sky));
    let mut levels = Vec::with_capacity(count as usize);
    for l in 0..count {
        if l > 0 {
            for share in [&mut sun, &mut sky] {
                // A share that is whole everywhere stays so, as every kernel's taps sum to 1.
                if share.iter().all(|&s| s == 1.0) {
                    share.truncate(grid.level(l).samples() as usize);
                    progress.advance(grid.level(l).samples() as u64);
                    continue;
                }
                *share = downsample(share, grid.level(l - 1), filter, None, work, progress)?;
                share.iter_mut().for_each(|s| *s = s.clamp(0.0, 1.0));
            }
        }
        let mut level = vec![LightSample::default(); sun.len()];
        each_chunk(work, &mut level, CHUNK, |chunk, samples| {
            let shares = sun[chunk * CHUNK..].iter().zip(&sky[chunk * CHUNK..]);
            for (sample, (&sun, &sky)) in samples.iter_mut().zip(shares) {
                *sample = LightSample {
                    sun: f16::from_f32(sun),
                    sky: f16::from_f32(sky),
                };
            }
        });
        levels.push(level);
    }
    Ok(levels)
}

#[cfg(test)]
mod tests;
