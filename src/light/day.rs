//! A day: light at every time of it, from the sun at a number of positions between its rise and its set.
//!
//! Stored are for each sample the times at which the sun's disc first and last stands over the horizon. Those two suffice:
//! of the time in which ground is lit, by 48 positions, what lies in the dark between its first and its last light is
//! 0.002, 0.010 and 0.088 % over the Pyrenees at midsummer, equinox and midwinter (`tests/day.rs`). So a day takes ten
//! bytes a sample however many positions it is traced from, and at a time between two of these shadows stand between:
//! their edge is where the time is that of first or last light.
//!
//! *Tracing* ([`Daylight`]). At position k the disc's middle stands `m[k]` above the horizon at its azimuth; between two
//! positions m is taken as linear, so its zero is a time. How fast it rises there says how long the disc takes: `soft` is
//! the time in which it rises by the disc's radius, so that the share at time t is that of a disc cut at
//! `x = (t - first) / soft`, 0 at x = -1, 1 at 1 ([`disc`]).
//!
//! *Filtering* ([`DayLevels`]). Ground under a coarse sample is lit piece by piece, so its share rises as a distribution of
//! times does. Mean and variance of it are filtered like heights: `first`, and `first^2 + soft^2 / 4`, as the cut of a disc
//! is the distribution function of a half circle, whose standard deviation is half its radius. The coarser level's soft is
//! what these two leave, so the share of coarse ground rises over as long as its pieces take.
//!
//! *Drawing* ([`sun_of_day`]). The share is the difference of those that first and last light have reached. The cosine
//! between normal and sun follows from the sun's place at that time and the slopes of the level; those of the ground under
//! a coarse sample are spread about these, and what of them turns away from the sun is dark rather than negative: the mean
//! of `max(0, normal . sun)` over a half circle's distribution, whose width the stored mean square of level 0's slopes
//! gives. Ground that turns away is in its own shadow, which the share counts already: it is divided by the part that faces
//! the sun.

mod levels;
#[cfg(test)]
pub(crate) mod plain;
mod share;
mod time;
mod trace;

pub use levels::{DayLevels, day_levels};
pub(crate) use share::disc_coefficients;
pub use share::{disc, disc_integral, sun_of_day};
pub use time::{DAY_POSITIONS, Day, SunTime};
pub use trace::{Daylight, trace_day};

/// A time before or after any of the day: where the sun neither rises nor sets.
const NEVER: f32 = 2.0;

/// The least softness that is stored, of half a day: below what f16 tells of times.
const LEAST_SOFT: f32 = 1.0 / 4096.0;

/// Light over a day at a sample of level 0, and what of the ground is filtered with it; NaN at voids. Times and softnesses
/// as in [`crate::levels::DaySample`].
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct LitTimes {
    /// First light.
    pub first: f32,
    /// Its softness.
    pub first_soft: f32,
    /// Last light.
    pub last: f32,
    /// Its softness.
    pub last_soft: f32,
    /// The squared slope of the ground.
    pub slope_square: f32,
}

impl LitTimes {
    /// Where there is no ground.
    pub const VOID: Self = Self {
        first: f32::NAN,
        first_soft: f32::NAN,
        last: f32::NAN,
        last_soft: f32::NAN,
        slope_square: f32::NAN,
    };

    /// In the order in which they are filtered.
    fn fields(&self) -> [f32; 5] {
        bytemuck::cast(*self)
    }
}

#[cfg(test)]
mod tests;
