//! How a clipmap is laid out: clip size, levels, transition, vertical scale, culling, promised error, waiting.

use std::ops::RangeInclusive;

use super::arrivals::Wait;
use super::constants::Ring;
use crate::error::{Error, ErrorKind, Result};

/// The greatest factor on heights, either way: heights up to 1e30 m times it stay within f32.
pub const MAX_VERTICAL_SCALE: f64 = 1e6;

/// The errors in pixels that can be promised.
pub const MAX_ERROR_PX: RangeInclusive<f64> = 1e-6..=1e6;

/// How a clipmap is laid out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClipmapOptions {
    /// Clip size N, samples along a window's side: a power of two, 64 to 2048.
    pub clip_size: i64,
    /// Keep only this many levels, the finest. Where none, all up to the first that fits into one window, and with a
    /// promised error all that the DEM has.
    pub levels: Option<u32>,
    /// Width of the transition band in steps, 0 to `N/4 - 10`; `N/10` rounded down where none.
    pub transition: Option<i64>,
    /// Factor on heights relative to the eye; may be 0 or negative, within [`MAX_VERTICAL_SCALE`] of 0.
    pub vertical_scale: f64,
    /// Whether patches that are not seen are left out: those beside the picture and, if [`ClipmapOptions::occlusion`] is
    /// set, those behind nearer ground.
    pub cull: bool,
    /// Whether what nearer ground hides counts as not seen. To be cleared where ground is looked through: where a surface
    /// function of the caller's discards, or what it returns is blended.
    pub occlusion: bool,
    /// The promised error in pixels: detail that it does not need is left out; none draws all that the rings reach.
    pub max_error_px: Option<f64>,
    /// Whether frames wait for their data.
    pub wait: Wait,
    /// The most bytes of samples that an update writes, beside the coarsest level; where none, as many as take about 2 ms,
    /// and no limit for the first. Only without waiting.
    pub upload_budget_bytes: Option<u64>,
    /// Whether windows hold light over a day too, where the terrain has it: 8 bytes a light texel more.
    pub day: bool,
}

impl Default for ClipmapOptions {
    fn default() -> Self {
        Self {
            clip_size: 256,
            levels: None,
            transition: None,
            vertical_scale: 1.0,
            cull: true,
            occlusion: true,
            max_error_px: None,
            wait: Wait::All,
            upload_budget_bytes: None,
            day: false,
        }
    }
}

impl ClipmapOptions {
    /// Clip size and transition.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] where they are out of range.
    pub fn ring(&self) -> Result<Ring> {
        let transition = self
            .transition
            .unwrap_or((self.clip_size / 10).min(Ring::transition_limit(self.clip_size)));
        let ring = Ring {
            clip_size: self.clip_size,
            transition,
        };
        ring.check()?;
        Ok(ring)
    }

    /// Refuses options that are out of range or contradict each other.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`], naming the option.
    pub fn check(&self) -> Result<()> {
        self.ring()?;
        let misuse = |subject: &str, what: String| Error::new(ErrorKind::Misuse, subject, what);
        if self.vertical_scale.is_nan() || self.vertical_scale.abs() > MAX_VERTICAL_SCALE {
            let what = format!(
                "{:?} is not within {MAX_VERTICAL_SCALE} of 0",
                self.vertical_scale
            );
            return Err(misuse("vertical scale", what));
        }
        if self.levels == Some(0) {
            return Err(misuse("levels", "0 levels draw nothing".into()).advice("ask for at least 1"));
        }
        if let Some(px) = self.max_error_px.filter(|px| !(MAX_ERROR_PX.contains(px))) {
            let what = format!("{px:?} pixels cannot be promised");
            let [least, most] = [MAX_ERROR_PX.start(), MAX_ERROR_PX.end()];
            return Err(misuse("greatest error", what).advice(format!("ask for {least} to {most} pixels")));
        }
        if self.upload_budget_bytes.is_some() && self.wait == Wait::All {
            let what = "a frame that waits for all of its data can keep no budget";
            return Err(
                misuse("upload budget", what.into()).advice("set wait to none, or leave the budget out")
            );
        }
        Ok(())
    }
}
