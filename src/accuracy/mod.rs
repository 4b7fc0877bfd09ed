//! Accuracy: what a drawn frame's depths say about the picture, checked against the surfaces it should show.
//!
//! A [`DepthImage`] is what the device left. [`cracks()`] counts the pixels that see through the drawn surface; what f32
//! and the rasteriser's grid may do to a depth is stated, and derived, by [`Facet`]. [`measure`] compares each drawn point
//! with `S0`, pixel by pixel ([`measure_drawn`] knows the surface that was drawn, and looks twice where a pixel misses it), and
//! an [`ErrorPool`] takes frames together. [`ExactImage`] is what should have been
//! drawn, and [`Shading`] its picture.

mod beside;
mod cracks;
mod exact;
mod facet;
mod foreign;
mod measured;
mod pool;
mod second_look;
mod shaded;

pub use cracks::cracks;
pub use exact::ExactImage;
pub use facet::{Facet, INTERPOLATION, RASTER_PX, ROUNDING};
pub use foreign::{Distances, parse_camera};
pub use measured::{ErrorSummary, FrameErrors, PixelError, measure, measure_drawn};
pub use pool::{ErrorPool, RESOLUTION};
pub use shaded::{Look, Shading, psnr_db};

use crate::camera::View;
use crate::clipmap::{Drawn, Eye};
use crate::error::{Error, ErrorKind, Result};

/// The depths of a picture: one a pixel, row by row from the upper left, near distance over distance along the view
/// axis, 0 where no terrain is.
#[derive(Clone, Copy, Debug)]
pub struct DepthImage<'a> {
    depths: &'a [f32],
    view: View,
}

impl<'a> DepthImage<'a> {
    /// The depths of the picture of `view`.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] where they are not as many as the picture has pixels, and for a view whose depth has a far
    /// end or runs forward.
    pub fn new(depths: &'a [f32], view: &View) -> Result<Self> {
        let [width, height] = view.size_px;
        if depths.len() as u64 != u64::from(width) * u64::from(height) {
            let what = format!(
                "{} depths are not those of {width} x {height} pixels",
                depths.len()
            );
            return Err(Error::new(ErrorKind::Misuse, "depth image", what));
        }
        if view.depth().is_some_and(|depth| depth.terms()[0] != 0.0) {
            let what = "its depths are not near distance over distance";
            return Err(Error::new(ErrorKind::Misuse, "depth image", what)
                .advice("draw with reversed depth without a far end"));
        }
        Ok(Self { depths, view: *view })
    }

    /// The view.
    pub fn view(&self) -> &View {
        &self.view
    }

    /// Refuses a surface that is drawn for another eye.
    fn check_eye_of(&self, drawn: &Drawn<'_>) -> Result<()> {
        if Eye::new(self.view.eye, drawn.grid()) == *drawn.eye() {
            return Ok(());
        }
        let what = "is of another eye than the drawn surface";
        Err(Error::new(ErrorKind::Misuse, "depth image", what))
    }

    /// A row of depths.
    pub fn row(&self, y: u32) -> &'a [f32] {
        let width = self.view.size_px[0] as usize;
        &self.depths[y as usize * width..][..width]
    }
}
