//! The crack counter: pixels that see through the drawn surface.
//!
//! A pixel is a crack if the depth that was drawn lies behind the first hit with the drawn surface of every one of five
//! rays, the pixel's centre and 1/128 pixel to each side of it, by more than f32 and the rasteriser's grid explain. Rays
//! start at the near plane; a pixel without terrain is infinitely far away. The centre's ray is cast first, the others
//! only where it disagrees.
//!
//! What f32 and the grid explain is [`Facet::rounding`]. A pixel is drawn at its centre, not where a ray beside it is:
//! what such a ray has hit is compared at the centre, by the plane of its triangle. Else a pixel beside a silhouette
//! would count where the one ray that passes it meets a slope that comes nearer on its way of 1/128 pixel. What f32 may
//! move before the near plane explains anything.
//!
//! *Second look.* Five rays may miss what rounding lets a pixel see within 1/512 pixel of its centre, on rough ground
//! about once in 50 pictures of 128 x 128; and of a triangle that is far larger than its distance from the eye, f32
//! moves more than 1/128 pixel. A pixel that five rays call a crack is looked at again:
//!
//! - by more rays, on two rings between centre and sides, for strips of a triangle and gaps that are narrower than
//!   1/128 pixel, and on a third one, as far out as rounding moves what the five have hit;
//! - by what is behind: where rounding moves the silhouette of one hill away from that of another behind it, a pixel
//!   sees between them what no ray sees. So it is a crack only if some distance, nearer than the depth that was drawn,
//!   lies behind the surface on all the rays: then one sheet of ground covers them all;
//! - by what lies before that sheet: a triangle seen almost edge on may hide behind the nearer ones on every ray, and
//!   still be drawn where the grid bares it, at a depth that its plane takes a little beside it. So what was drawn must
//!   lie behind all that the rays meet before the sheet, one hit after another, see `beside.rs`.

use super::beside::{RINGS_PX, edges, find_hit, five, ring};
use super::{DepthImage, Facet};
use crate::clipmap::{Drawn, near_of_m};
use crate::error::Result;
use crate::query::{Crossing, Picker};
use crate::work::{Work, each_chunk};

/// The pixels of `image`, column and row, that are cracks in `drawn`, row by row.
///
/// # Errors
/// [`crate::ErrorKind::Misuse`] where the surface is drawn for another eye than the image's.
pub fn cracks(drawn: &Drawn<'_>, image: &DepthImage<'_>, work: &dyn Work) -> Result<Vec<[u32; 2]>> {
    image.check_eye_of(drawn)?;
    let view = image.view();
    let mut rows: Vec<Result<Vec<[u32; 2]>>> = (0..view.size_px[1]).map(|_| Ok(Vec::new())).collect();
    each_chunk(work, &mut rows, 1, |y, row| {
        row[0] = cracks_in_row(drawn, image, y as u32);
    });
    let rows: Result<Vec<_>> = rows.into_iter().collect();
    Ok(rows?.concat())
}

fn cracks_in_row(drawn: &Drawn<'_>, image: &DepthImage<'_>, y: u32) -> Result<Vec<[u32; 2]>> {
    let mut found = Vec::new();
    let mut picker = Picker::new(drawn, image.view())?;
    for (x, &depth) in image.row(y).iter().enumerate() {
        let mut pixel = Pixel {
            drawn,
            image,
            picker: &mut picker,
            depth: f64::from(depth),
            centre: [x as f64 + 0.5, f64::from(y) + 0.5],
        };
        if pixel.is_crack()? {
            found.push([x as u32, y]);
        }
    }
    Ok(found)
}

struct Pixel<'a, 'p> {
    drawn: &'a Drawn<'a>,
    image: &'a DepthImage<'a>,
    picker: &'a mut Picker<'p, Drawn<'p>>,
    depth: f64,
    centre: [f64; 2],
}

impl Pixel<'_, '_> {
    fn is_crack(&mut self) -> Result<bool> {
        let five = five(self.centre);
        let mut moved_px = 0.0f64;
        for ray in five {
            let hit = self.picker.cast(ray)?;
            match hit.and_then(|hit| self.before(&hit)) {
                None => return Ok(false),
                Some(facet) => moved_px = moved_px.max(facet.place_rounding_px),
            }
        }
        let [inner, outer] = RINGS_PX;
        let farthest = outer.max(moved_px * std::f64::consts::SQRT_2);
        let rings = [inner, outer, farthest];
        let mut rays: Vec<_> = rings.into_iter().flat_map(|r| ring(self.centre, r)).collect();
        rays.extend(five);
        match self.sheet_m(&rays)? {
            None => Ok(false),
            Some(sheet_m) => {
                let edges = edges(self.picker, self.centre, &rays)?;
                Ok(self.all_lie_before(&rays, sheet_m)? && self.all_lie_before(&edges, sheet_m)?)
            }
        }
    }

    /// The triangle that was hit, if it lies before what was drawn.
    fn before(&self, hit: &Crossing) -> Option<Facet> {
        before(self.drawn, self.image, self.depth, self.centre, hit)
    }

    /// Where the surface begins to be before all rays at once, nearer than what was drawn; none where it never is.
    fn sheet_m(&mut self, rays: &[[f64; 2]]) -> Result<Option<f64>> {
        let end_m = near_of_m(self.image.view(), self.drawn.grid()) / self.depth; // infinite where nothing was drawn
        let mut common = vec![[0.0, end_m]];
        for &ray in rays {
            let behind = self.picker.behind(ray, end_m)?;
            common = common
                .iter()
                .flat_map(|a| behind.iter().map(|b| [a[0].max(b[0]), a[1].min(b[1])]))
                .filter(|span| span[0] < span[1])
                .collect();
        }
        Ok(common.first().map(|span| span[0]))
    }

    /// Whether all that the rays hit up to a distance lies before what was drawn.
    fn all_lie_before(&mut self, rays: &[[f64; 2]], end_m: f64) -> Result<bool> {
        let near_m = near_of_m(self.image.view(), self.drawn.grid());
        for &ray in rays {
            // The first hit that does not lie before what was drawn, or that is beyond the end: whether it is the former.
            let (drawn, image, depth, centre) = (self.drawn, self.image, self.depth, self.centre);
            let before = |hit: &Crossing| before(drawn, image, depth, centre, hit).is_some();
            let found = find_hit(self.picker, ray, near_m, |hit| match hit.along <= end_m {
                true if before(hit) => None,
                within => Some(within),
            })?;
            if found == Some(true) {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

/// The triangle that was hit, if it lies before what was drawn at a pixel.
fn before(
    drawn: &Drawn<'_>,
    image: &DepthImage<'_>,
    depth: f64,
    centre: [f64; 2],
    hit: &Crossing,
) -> Option<Facet> {
    let (grid, view) = (drawn.grid(), image.view());
    let hit_depth = near_of_m(view, grid) / hit.along;
    if depth >= hit_depth {
        return None;
    }
    // Seen exactly edge on, a triangle has any depth.
    let facet = Facet::new(grid, view, drawn.clipmap().vertical_scale(), hit, centre)?;
    let drawable = hit.along - facet.vertex_rounding_m > near_of_m(view, grid);
    (drawable && depth < facet.depth.min(hit_depth) - facet.rounding()).then_some(facet)
}
