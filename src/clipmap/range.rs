//! The least and greatest height of a DEM, from the saturated bounds of its coarsest level.

use super::window::Window;
use crate::error::{Error, ErrorKind, Result};
use crate::levels::{Arrival, Bounds, Data, Levels, Wanted};

/// The least and greatest height of what a window knows, where that is anything.
pub(super) fn range_of(window: &Window) -> Option<[f32; 2]> {
    let patches = window.known_patches();
    let (low, high) = patches.fold((f32::NAN, f32::NAN), |(low, high), p| {
        (low.min(p.bounds.need_min), high.max(p.bounds.need_max))
    });
    (low <= high).then_some([low, high])
}

/// The least and greatest height of a DEM in metres above its base, from the saturated bounds of its coarsest level, which
/// are few; 0 where it has none.
///
/// # Errors
/// Those of `levels`; [`ErrorKind::Unsupported`] where those bounds are not there.
pub fn height_range_m(levels: &dyn Levels) -> Result<[f32; 2]> {
    let coarsest = levels.level_count() - 1;
    let patches = levels.grid().patches(coarsest).rect();
    let mut bounds = vec![Bounds::VOID; patches.area() as usize];
    levels.wait_for(&[Wanted {
        data: Data::Bounds,
        level: coarsest,
        rect: patches,
    }]);
    if levels.bounds(coarsest, patches, &mut bounds)? == Arrival::Missing {
        let what = "the bounds of its coarsest level are not there";
        return Err(Error::new(ErrorKind::Unsupported, "terrain", what).advice("wait for them first"));
    }
    let low = bounds.iter().fold(f32::NAN, |low, b| low.min(b.need_min));
    let high = bounds.iter().fold(f32::NAN, |high, b| high.max(b.need_max));
    Ok(if low.is_nan() { [0.0, 0.0] } else { [low, high] })
}
