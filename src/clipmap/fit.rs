//! The smallest clip size whose frames keep a promised error.
//!
//! A certificate needs no picture, so a flight is tried on the CPU alone, from the smallest clip size up. A size is given up
//! at the first frame that does not keep the promise, so those that are too small cost little.

use super::{Clipmap, ClipmapOptions, Wait, certify};
use crate::camera::View;
use crate::error::{Error, ErrorKind, Result};
use crate::levels::Levels;
use crate::progress::Progress;

/// The clip sizes that are tried, smallest first.
const CLIP_SIZES: [i64; 6] = [64, 128, 256, 512, 1024, 2048];

/// What was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClipSizeFit {
    /// The smallest clip size that keeps the promise, or the greatest there is.
    pub clip_size: i64,
    /// The first view whose frame does not keep it even so, by its place in the list; none where all do.
    pub broken_at: Option<usize>,
}

/// The smallest clip size for which every frame of `views` certifies at most the error that `options` promise.
///
/// # Errors
/// [`ErrorKind::Misuse`] where none is promised, and as [`Clipmap::new`] and [`Clipmap::update`];
/// [`ErrorKind::Cancelled`].
pub fn fit_clip_size(
    levels: &dyn Levels,
    views: &[View],
    options: &ClipmapOptions,
    progress: &dyn Progress,
) -> Result<ClipSizeFit> {
    let Some(max_error_px) = options.max_error_px else {
        return Err(Error::new(
            ErrorKind::Misuse,
            "clip size",
            "no error is promised that one could keep",
        )
        .advice("promise one"));
    };
    let mut fit = ClipSizeFit {
        clip_size: CLIP_SIZES[0],
        broken_at: None,
    };
    progress.begin("clip size", CLIP_SIZES.len() as u64);
    for clip_size in CLIP_SIZES {
        let options = ClipmapOptions {
            clip_size,
            wait: Wait::All,
            upload_budget_bytes: None,
            ..*options
        };
        // A transition that is asked for may be too wide for small windows.
        if options.ring().is_err() && clip_size != CLIP_SIZES[CLIP_SIZES.len() - 1] {
            continue;
        }
        let mut clipmap = Clipmap::new(levels, &options)?;
        fit = ClipSizeFit {
            clip_size,
            broken_at: None,
        };
        for (k, view) in views.iter().enumerate() {
            if progress.cancelled() {
                return Err(Error::cancelled("clip size"));
            }
            clipmap.update(levels, view, 0.0)?;
            if !certify(&clipmap)?.keeps(max_error_px) {
                fit.broken_at = Some(k);
                break;
            }
        }
        progress.advance(1);
        if fit.broken_at.is_none() {
            break;
        }
    }
    Ok(fit)
}
