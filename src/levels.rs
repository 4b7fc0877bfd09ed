//! The trait `Levels`: the pyramid as everything downstream sees it, wherever it comes from.

use bytemuck::{Pod, Zeroable};
use half::f16;

use crate::error::{Error, ErrorKind, Result};
use crate::grid::{Grid, Rect};

/// Bounds of one patch of a level, rounded outwards.
///
/// `min`, `max` and `error` are NaN where the patch is wholly void. The saturated ones are NaN only where nothing was
/// handed up to it either: a coarse sample may be void over ground that finer levels have.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Bounds {
    /// Least height of the patch's valid samples, metres less `base_m`.
    pub min: f32,
    /// Greatest height of the patch's valid samples, metres less `base_m`.
    pub max: f32,
    /// Upper bound of `|S_l - S0|` in metres, over the patch's ground where both exist and at every vertex of
    /// the next finer level whose morph target on this level is not void.
    pub error: f32,
    /// `min`, saturated upwards: never above that of the children and their neighbours.
    pub need_min: f32,
    /// `max`, saturated upwards: never below that of the children and their neighbours.
    pub need_max: f32,
    /// `error`, saturated upwards: at least 1.3 times that of the children and their neighbours.
    pub need_error: f32,
}

impl Bounds {
    /// The bounds of a patch without any valid sample, on its own level and below.
    pub const VOID: Self = Self {
        min: f32::NAN,
        max: f32::NAN,
        error: f32::NAN,
        need_min: f32::NAN,
        need_max: f32::NAN,
        need_error: f32::NAN,
    };

    /// Whether the patch has no valid sample.
    pub fn is_void(&self) -> bool {
        self.min.is_nan()
    }
}

/// Light at a sample: both values in 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct LightSample {
    /// Share of the sun's disc above the horizon, times the cosine between normal and sun.
    pub sun: f16,
    /// Cosine-weighted share of the sky dome that is seen.
    pub sky: f16,
}

/// Light over a day at a sample. Times are of [`crate::light::Day`]: 0 at the sun's noon, -1 and 1 at the day's ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct DaySample {
    /// When the middle of the sun's disc first stands over the horizon, in the mean of the ground of the sample.
    pub first: f16,
    /// How long before and after `first` some of the disc stands over it, or some of the ground is lit: see
    /// [`crate::light::sun_of_day`].
    pub first_soft: f16,
    /// When it last does; as `first` where it never does.
    pub last: f16,
    /// The same about `last`.
    pub last_soft: f16,
    /// Root of the mean squared slope of level 0 under the sample, rise over run.
    pub slope: f16,
    /// Fills the struct to whole words; 0.
    pub unused: f16,
}

/// Whether what was asked for is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub enum Arrival {
    /// The output holds it.
    Arrived,
    /// It is not there yet; the output is unspecified. Only sources that never wait answer so.
    Missing,
}

/// What levels hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Data {
    /// [`Levels::heights`].
    Heights,
    /// [`Levels::bounds`]: rectangles are of patches.
    Bounds,
    /// [`Levels::light`].
    Light,
    /// [`Levels::day`].
    Day,
}

/// What will be asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Wanted {
    /// What of it.
    pub data: Data,
    /// Of which level.
    pub level: u32,
    /// Samples, or patches for bounds.
    pub rect: Rect,
}

/// The levels of a DEM: sizes, heights, bounds and light, by rectangles.
///
/// Rectangles must lie within the level. Outputs are row by row, `rect.area()` long. Heights are metres less
/// [`Grid::base_m`], NaN for no data.
pub trait Levels: Send + Sync {
    /// Where the samples lie.
    fn grid(&self) -> &Grid;

    /// The number of levels, at least 1: those of [`Grid::file_levels`].
    fn level_count(&self) -> u32 {
        self.grid().file_levels()
    }

    /// The heights of `rect` of level `level`.
    ///
    /// # Errors
    /// Where the data are damaged or cannot be read.
    fn heights(&self, level: u32, rect: Rect, out: &mut [f32]) -> Result<Arrival>;

    /// The bounds of the patches in `patches` (patch indices) of level `level`.
    ///
    /// # Errors
    /// Where the data are damaged or cannot be read.
    fn bounds(&self, level: u32, patches: Rect, out: &mut [Bounds]) -> Result<Arrival>;

    /// Whether there is light. Without it [`Levels::light`] must not be called.
    fn has_light(&self) -> bool;

    /// The light of `rect` of level `level`.
    ///
    /// # Errors
    /// Where the data are damaged or cannot be read, or there is no light.
    fn light(&self, level: u32, rect: Rect, out: &mut [LightSample]) -> Result<Arrival>;

    /// Whether there is light over a day. Without it [`Levels::day`] must not be called.
    fn has_day(&self) -> bool {
        false
    }

    /// The light over a day of `rect` of level `level`.
    ///
    /// # Errors
    /// Where the data are damaged or cannot be read, or there is no day.
    fn day(&self, level: u32, rect: Rect, out: &mut [DaySample]) -> Result<Arrival> {
        let _ = (level, rect, out);
        Err(Error::new(
            ErrorKind::Misuse,
            "terrain",
            "it has no light over a day",
        ))
    }

    /// Hears what will soon be asked for, most urgent first, in place of what it was told before: what is not among it is
    /// no longer wanted. A source that reads at once ignores it.
    fn want(&self, wanted: &[Wanted]) {
        let _ = wanted;
    }

    /// Waits until all of this has arrived, or has been found damaged. A source that reads at once ignores it.
    fn wait_for(&self, wanted: &[Wanted]) {
        let _ = wanted;
    }

    /// Changes when better data take the place of those that were given so far: whoever holds any asks for them anew. It
    /// never changes but in this call, so that whoever calls it once a frame sees no two editions in one.
    fn edition(&self) -> u64 {
        0
    }

    /// Whether what is given stands in for data that are not there yet: its errors are not known.
    fn is_provisional(&self) -> bool {
        false
    }

    /// Takes the faults that were met since the last call and did not end a call.
    fn faults(&self) -> Vec<Error> {
        Vec::new()
    }
}
