//! Light on the terrain: the sun's share and the sky's share of every sample, traced over the DEM's surface.
//!
//! `rays`, `strips` and `crests` say where to look for how high the terrain stands in a direction, `sight` looks;
//! `sun`, `sky` and `day` make light of it, [`light_levels`] and, row by row, [`LightLevels`] filter it into levels
//! like the heights, and `fill` spreads each under its voids. All of it is traced over `S0`, level 0; no data, and
//! what lies beyond the DEM, neither casts a shadow nor blocks the sky.
//!
//! Azimuths are degrees clockwise from true north; [`Earth`] says where the grid's north is, and how the ground
//! curves. [`Sun::at`] is the sun of a time and place. Heights are metres less [`Grid::base_m`], row by row, finite or
//! NaN for no data.

use half::f16;

use crate::error::{Error, ErrorKind, Result};
use crate::grid::{Grid, Size};
use crate::levels::LightSample;
use crate::progress::Progress;
use crate::pyramid::{Filter, downsample};
use crate::work::Work;

mod crests;
mod day;
mod earth;
mod fill;
mod horizon;
mod levels;
mod normal;
mod rays;
mod region;
mod relief;
mod sight;
mod sky;
mod stage;
mod strips;
mod sun;
mod sun_at;
mod tops;

pub use crests::{CREST, Crests};
pub(crate) use day::disc_coefficients;
#[cfg(test)]
pub(crate) use day::plain as plain_day;
pub use day::{
    DAY_POSITIONS, Day, DayLevels, Daylight, LitTimes, SunTime, day_levels, disc, disc_integral, sun_of_day,
    trace_day,
};
pub use earth::{DEFAULT_REFRACTION, Earth, middle};
pub use fill::fill_voids;
pub use horizon::{horizon_tangents, horizon_tangents_on};
pub use levels::{LIGHT_ROWS_BESIDE, LightLevels};
pub use relief::{Ground, Relief};
pub use sky::{Skylight, sky_share, sky_share_on};
pub use sun::{DISC_DEG, Sun, Sunlight, disc_share, sun_share, sun_share_on};
pub use sun_at::Moment;

/// Sky directions unless others are asked for.
pub const DEFAULT_SKY_DIRECTIONS: u32 = 16;

/// Rows of a block, whose light is traced together.
pub const ROWS: usize = relief::BLOCK[1];

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

/// The light of all of [`Grid::file_levels`] from that of level 0, `heights` saying where that is void: filtered like
/// heights in f32 and clamped to 0 to 1 on each level, voids left out as they are there; only what is returned is
/// rounded to f16, and filled outward from valid samples under the voids. See [`LightLevels`], which makes the same
/// row by row.
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
    let mut levels: Vec<Vec<LightSample>> = (0..count)
        .map(|l| vec![LightSample::default(); grid.level(l).samples() as usize])
        .collect();
    let fields: [fn(&mut LightSample) -> &mut f16; 2] = [|l| &mut l.sun, |l| &mut l.sky];
    for (mut share, field) in [sun, sky].into_iter().zip(fields) {
        share.iter_mut().zip(heights).for_each(|(s, h)| {
            *s = if h.is_nan() { f32::NAN } else { s.clamp(0.0, 1.0) };
        });
        for (l, samples) in (0..count).zip(&mut levels) {
            if l > 0 {
                share = downsample(&share, grid.level(l - 1), filter, None, work, progress)?;
                share.iter_mut().for_each(|s| *s = s.clamp(0.0, 1.0));
            }
            // As a file has them.
            let mut stored: Vec<f32> = share.iter().map(|&s| f16::from_f32(s).to_f32()).collect();
            if stored.iter().any(|s| s.is_nan()) {
                fill_voids(&mut stored, grid.level(l));
            }
            for (sample, &s) in samples.iter_mut().zip(&stored) {
                *field(sample) = f16::from_f32(s);
            }
        }
    }
    Ok(levels)
}

#[cfg(test)]
mod tests;
