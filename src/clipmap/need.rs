//! Need: the dial's share of the held field, which lets detail go where the promised error is kept without it.
//!
//! For a patch of level `l + 1`, q' is an upper bound, over the promised error, of the pixels by which its ground may be
//! wrong if its children are not drawn: [`Screen::nearby_px`] of its saturated error over its box, grown by one patch on
//! every side and as high as its saturated heights. Its need of *no* children is `clamp((0.9 - q') / 0.2, 0, 1)`: 0
//! where it needs them, 1 where all keep the promise without. A corner of the field takes the least over the patches
//! that touch it.
//!
//! *It nests*, which fact (c) of [`super::alpha`] rests on. Let P be a patch of level `l + 2`, and V one of its children
//! or of the patches that touch them, 4 x 4 in all. P's `need_error` is at least 1.3 times V's, its heights hold V's
//! (saturation, see [`crate::pyramid`]), and its box, 3 x 3 patches of level `l + 2`, holds V's, which reaches over 6 x 6
//! patches of level `l + 1` at most: the same ground. So by the nesting of [`Screen`], q' of P is at least 1.3 times that
//! of V. Where children of a patch U are drawn, some corner of U is below 1, thus some V that touches U has q' above
//! 0.7, thus its parent's parent P of U has q' above 0.91: more than 0.9 by far more than rounding. So need of P is 0,
//! hence the corners that P touches, all of U's parent, are 0.
//!
//! *It keeps the promise.* A patch that is drawn unrefined for need alone has corners of 1, thus q' of at most 0.7, and
//! where it morphs, for need, its parent has q' below 0.9. Morphing per vertex adds at most half the change of alpha
//! across a cell times the sum of both errors, see `stray.rs`; the field changes by at most `1 - (15/16)^2`
//! across one: below `0.0606 (0.9 / 1.3 + 0.9) = 0.097`. So what is certified of it is below `0.9 + 0.097`.
//!
//! *It is continuous* in eye and rotation, as [`Screen`] is. Where bounds have not arrived need is 0; by then the field's
//! fade is 1 there.

use super::extent::Extent;
use super::screen::Screen;
use super::window::Window;
use crate::grid::{PATCH, Rect};
use crate::levels::Bounds;

/// Below this share of the promised error a patch's children are not drawn at all.
const LOW: f64 = 0.7;

/// Above this share they are drawn in full.
const HIGH: f64 = 0.9;

/// What need is measured by.
#[derive(Clone, Copy, Debug)]
pub(super) struct Dial<'a> {
    pub(super) extent: Extent<'a>,
    pub(super) screen: &'a Screen,
    /// The promised error in pixels.
    pub(super) max_error_px: f64,
}

impl Dial<'_> {
    /// The need of patch (a, b) of the level of `window`, which is that of the patch, 0 (its children must be drawn) to 1.
    pub(super) fn need(&self, window: &Window, a: i64, b: i64) -> f32 {
        let Some(info) = window.patch(a, b) else {
            return 0.0;
        };
        let share = self.share(window.level(), a, b, &info.bounds);
        ((HIGH - share) / (HIGH - LOW)).clamp(0.0, 1.0) as f32
    }

    /// q': the bound of a patch's error without its children over the promised one.
    fn share(&self, level: u32, a: i64, b: i64, bounds: &Bounds) -> f64 {
        // Neither it nor anything below has data.
        if bounds.need_error.is_nan() {
            return 0.0;
        }
        let error_m = f64::from(bounds.need_error) * self.extent.vertical_scale.abs();
        let grown = Rect::new((a - 1) * PATCH, (b - 1) * PATCH, (a + 2) * PATCH, (b + 2) * PATCH);
        let [low, high] = self.extent.of(level, grown, [bounds.need_min, bounds.need_max]);
        self.screen.nearby_px(low, high, error_m) / self.max_error_px
    }
}
