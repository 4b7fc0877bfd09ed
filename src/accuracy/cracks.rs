//! The crack counter: pixels that see through the drawn surface.
//!
//! A pixel is a crack if the depth that was drawn lies behind the first hit with the drawn surface of every one of five
//! rays, the pixel's centre and 1/128 pixel to each side of it, by more than f32 and the rasteriser's grid explain. Rays
//! start at the near plane; a pixel without terrain is infinitely far away. The centre's ray is cast first, the others
//! only where it disagrees.
//!
//! *The bound.* A pixel is drawn at its centre, not where a side's ray is: what a ray has hit is compared there, by the
//! plane of the triangle that it met, less [`Facet::rounding`]. Without that, a pixel beside a silhouette would count
//! where all rays but one hit the nearer ground and that one a slope behind it which comes nearer from the pixel's
//! centre to the ray, by 1/128 pixel of slope.

use super::{DepthImage, Facet};
use crate::clipmap::{Drawn, Eye};
use crate::error::{Error, ErrorKind, Result};
use crate::query::{Crossing, Picker};
use crate::work::{Work, each_chunk};

/// Pixels from a pixel's centre to the rays beside it.
const BESIDE_PX: f64 = 1.0 / 128.0;

/// The pixels of `image`, column and row, that are cracks in `drawn`, row by row.
///
/// # Errors
/// [`ErrorKind::Misuse`] where the surface is drawn for another eye than the image's.
pub fn cracks(drawn: &Drawn<'_>, image: &DepthImage<'_>, work: &dyn Work) -> Result<Vec<[u32; 2]>> {
    let view = image.view();
    if Eye::new(view.eye, drawn.grid()) != *drawn.eye() {
        return Err(Error::new(
            ErrorKind::Misuse,
            "depth image",
            "is of another eye than the drawn surface",
        ));
    }
    let [_, height] = view.size_px;
    let mut rows: Vec<Result<Vec<[u32; 2]>>> = (0..height).map(|_| Ok(Vec::new())).collect();
    each_chunk(work, &mut rows, 1, |y, row| {
        row[0] = cracks_in_row(drawn, image, y as u32)
    });
    let rows: Result<Vec<_>> = rows.into_iter().collect();
    Ok(rows?.concat())
}

fn cracks_in_row(drawn: &Drawn<'_>, image: &DepthImage<'_>, y: u32) -> Result<Vec<[u32; 2]>> {
    let mut found = Vec::new();
    let mut picker = Picker::new(drawn, image.view())?;
    for (x, &depth) in image.row(y).iter().enumerate() {
        let centre = [x as f64 + 0.5, f64::from(y) + 0.5];
        let mut behind = true;
        for (east, south) in [(0.0, 0.0), (-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0)] {
            let ray = [centre[0] + east * BESIDE_PX, centre[1] + south * BESIDE_PX];
            let hit = picker.cast(ray)?;
            behind = hit.is_some_and(|hit| lies_behind(drawn, image, f64::from(depth), &hit, centre));
            if !behind {
                break;
            }
        }
        if behind {
            found.push([x as u32, y]);
        }
    }
    Ok(found)
}

/// Whether a drawn depth lies behind what a ray has hit.
fn lies_behind(
    drawn: &Drawn<'_>,
    image: &DepthImage<'_>,
    depth: f64,
    hit: &Crossing,
    centre: [f64; 2],
) -> bool {
    let grid = drawn.grid();
    let hit_depth = crate::clipmap::near_of_m(image.view(), grid) / hit.along;
    if depth >= hit_depth {
        return false;
    }
    let scale = drawn.clipmap().vertical_scale();
    match Facet::new(grid, image.view(), scale, hit, centre) {
        // Seen exactly edge on, a triangle has any depth.
        None => false,
        Some(facet) => depth < facet.depth.min(hit_depth) - facet.rounding(),
    }
}
