//! The second look at a pixel that measures an error and whose depth is not on the surface that was drawn.
//!
//! Beside triangles seen edge on, and on slivers, f32 and the rasteriser's grid move a depth by more than the floor allows for,
//! which knows the DEM's triangles and not the drawn ones: about one pixel in a million measures some hundredths of a
//! pixel where nothing is drawn at a wrong place, at 200 km one in 300,000 more than a pixel. So:
//!
//! - Where the point P that the depth gives lies on the drawn surface, but for the floor, its error stands.
//! - Else rays within 1/128 pixel of the centre are cast, and all that they hit looked at, nearest rays first (`beside.rs`).
//!   If the depth is that of the plane of a triangle so hit, but for what [`Facet`] explains, the device drew that
//!   triangle there, and the point that the ray meets on it is measured in P's place.
//! - Else its error stands.
//!
//! *What is excused is the rasteriser's.* A point measured in P's place lies on the drawn surface, of which the
//! certificate speaks: if that surface is wrong, so is the point. A depth that no triangle explains keeps its error.

use glam::DVec3;

use super::beside::{RINGS_PX, edges, find_hit, five, ring};
use super::measured::{Screen, to_f32};
use super::{DepthImage, Facet, PixelError};
use crate::clipmap::Drawn;
use crate::error::Result;
use crate::query::{Crossing, Picker, Probe, Surface};

/// Looks at pixels of one frame, for one thread.
pub(super) struct SecondLook<'a> {
    drawn: &'a Drawn<'a>,
    image: &'a DepthImage<'a>,
    picker: Option<Picker<'a, Drawn<'a>>>,
}

impl<'a> SecondLook<'a> {
    pub(super) fn new(drawn: &'a Drawn<'a>, image: &'a DepthImage<'a>) -> Self {
        Self {
            drawn,
            image,
            picker: None,
        }
    }

    /// What is measured at a pixel in place of `first`.
    ///
    /// # Errors
    /// Those of reading.
    pub(super) fn at_pixel(
        &mut self,
        probe: &mut Probe<'_>,
        centre: [f64; 2],
        depth: f64,
        first: PixelError,
    ) -> Result<PixelError> {
        if self.is_on_drawn(centre, probe.near_m() / depth, f64::from(first.floor_px))? {
            return Ok(first);
        }
        let Some((ray, along_m)) = self.explain(centre, probe.near_m(), depth)? else {
            return Ok(first);
        };
        let (view, scale) = (self.image.view(), self.drawn.clipmap().vertical_scale());
        let point = view.ray(ray) * along_m;
        let under = probe.under([point.x, point.z])?;
        let Some(height_m) = under.and_then(|u| u.height_m()) else {
            return Ok(first);
        };
        let gap_m = point.y - (height_m - probe.eye().height_m) * scale;
        let error_px = to_f32(Screen::new(view, ray, along_m).px(gap_m));
        if error_px >= first.error_px {
            return Ok(first);
        }
        Ok(PixelError {
            error_px,
            error_m: to_f32((gap_m / scale).abs()),
            beside: true,
            ..first
        })
    }

    /// Whether the point at a distance along the view axis lies on the drawn surface, but for some pixels.
    fn is_on_drawn(&self, centre: [f64; 2], away_m: f64, floor_px: f64) -> Result<bool> {
        let (view, scale) = (self.image.view(), self.drawn.clipmap().vertical_scale());
        if scale == 0.0 {
            return Ok(true); // a plane through the eye: whatever it measures is nothing
        }
        let point = view.ray(centre) * away_m;
        let place = view.eye + DVec3::new(point.x, 0.0, point.z);
        let height_m = self.drawn.height_at(place.x, place.z)?;
        Ok(height_m.is_some_and(|height_m| {
            let gap_m = point.y - (height_m - view.eye.y) * scale;
            Screen::new(view, centre, away_m).px(gap_m) <= floor_px
        }))
    }

    /// The ray, and where on it along the view axis, that meets a triangle whose plane has the pixel's depth.
    fn explain(&mut self, centre: [f64; 2], near_m: f64, depth: f64) -> Result<Option<([f64; 2], f64)>> {
        let (drawn, image) = (self.drawn, self.image);
        let picker = match &mut self.picker {
            Some(picker) => picker,
            none => none.insert(Picker::new(drawn, image.view())?),
        };
        let scale = drawn.clipmap().vertical_scale();
        let explains = |hit: &Crossing| {
            let facet = Facet::new(drawn.grid(), image.view(), scale, hit, centre)?;
            ((facet.depth - depth).abs() <= facet.rounding()).then_some(hit.along)
        };
        let [inner, outer] = RINGS_PX.map(|radius| ring(centre, radius));
        let rays = [&[centre], &inner[..], &outer, &five(centre)[1..]].concat();
        let find = |picker: &mut Picker<'_, Drawn<'_>>, rays: &[[f64; 2]]| {
            for &ray in rays {
                if let Some(along_m) = find_hit(picker, ray, near_m, explains)? {
                    return Ok(Some((ray, along_m)));
                }
            }
            Ok(None)
        };
        match find(picker, &rays)? {
            None => {
                let edges = edges(picker, centre, &rays)?;
                find(picker, &edges)
            }
            found => Ok(found),
        }
    }
}
