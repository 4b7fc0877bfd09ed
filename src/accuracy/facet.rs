//! A triangle of the drawn surface as a plane on the screen, and what f32 and the rasteriser's grid do to its depths.
//!
//! Depth is near / w, w the distance along the view axis. Over a plane it is linear on the screen (1 / w is), so a
//! facet is a depth and a gradient per pixel. What a device draws of it differs from that plane for three reasons.
//!
//! 1. *Vertices are rounded to f32.* A position from the eye takes the fraction's rounding, the difference, the
//!    spacing's rounding and their product, a height two differences, the scale's rounding and a product; the clip
//!    coefficients, their products and two sums follow: at most 8 roundings of 2^-24 of a term each, and by Cauchy and
//!    Schwarz the terms of clip w add up to at most the vertex's distance r. [`ROUNDING`] is twice that, for what
//!    follows from clipping at the near plane, which rounds its new vertices likewise. A point of a triangle moves no
//!    farther than the worst of its corners: with r that of the farthest, w is off by `ROUNDING r`, the depth by
//!    `depth ROUNDING r / w`, and the place on the screen by `ROUNDING (r / w) (f + size / 2)` pixels, f the focal
//!    length in pixels. Adapters that contract products and sums may also move a morphing vertex by
//!    `2^-23 (|h| + |c|)` upwards, see [`crate::clipmap::displace`]: both within the heights of the triangle, about.
//! 2. *Vertices are snapped* to a grid of 1/256 pixel: by half a step along each axis, so the place on the screen is
//!    off by at most [`RASTER_PX`].
//! 3. *Depth is interpolated in f32*, from a corner of the triangle by its gradient. The corner and the sum are off by
//!    2^-24 of the greatest depth of what lies before the near plane. The gradient is a quotient of differences of
//!    products: with L the triangle's extent on the screen, A its area and D its range of depths, each product is at
//!    most D L and off by 2^-24 of it, as the corners' places are by 2^-24 of L and the picture's size S; over 2 A,
//!    and along L, that is `2^-24 D L (L + S) / (2 A)`, some 16 times: twice two products for each part of the gradient,
//!    as many for the area, and the corners' places. For a sliver that is much; and a device may cut triangles that reach
//!    far over the picture's sides into slimmer ones, with corners rounded anew. [`INTERPOLATION`] is 256 times 2^-24:
//!    over 18,000 pictures, of noise as steep as 9 km in 20 m too, the most that a pixel took was 90. It never exceeds D, the
//!    depths at the corners being what they are.
//!
//! A rasteriser may take coverage from snapped corners and depth from the others: then what it draws at a pixel is the
//! plane of a triangle that ends up to [`RASTER_PX`] beside it. So planes are compared at the pixel's centre.

use glam::DVec3;

use crate::camera::View;
use crate::clipmap::{Eye, near_of_m};
use crate::grid::Grid;
use crate::query::{Crossing, Triangle};

/// What a vertex's distance is multiplied by to bound its displacement by f32 arithmetic.
pub const ROUNDING: f64 = 16.0 / (1u64 << 24) as f64;

/// By how much the rasteriser's grid moves a place on the screen: half a step of 1/256 pixel along each axis.
pub const RASTER_PX: f64 = 1.0 / 512.0;

/// What the extent of a triangle, in its own width, is multiplied by to bound the rounding of depths across it.
pub const INTERPOLATION: f64 = 256.0 / (1u64 << 24) as f64;

/// A triangle of the drawn surface as a plane on the screen.
#[derive(Clone, Copy, Debug)]
pub struct Facet {
    /// Depth of its plane at the pixel.
    pub depth: f64,
    /// How it changes per pixel to the east and to the south.
    pub gradient: [f64; 2],
    /// How far the device's vertices may be off, in metres.
    pub vertex_rounding_m: f64,
    /// How far a device's depth may be off at one place, whatever the gradient.
    pub depth_rounding: f64,
    /// By how many pixels a device's place on the screen may be off, along each axis.
    pub place_rounding_px: f64,
}

impl Facet {
    /// The triangle that a ray of `view` meets, at a place of the picture (which need not be the ray's own); none where
    /// a corner of it is void, or its plane goes through the eye. Heights are multiplied by `vertical_scale`.
    pub fn new(
        grid: &Grid,
        view: &View,
        vertical_scale: f64,
        crossing: &Crossing,
        pixel: [f64; 2],
    ) -> Option<Self> {
        let eye = Eye::new(view.eye, grid);
        let step = 1i64 << crossing.level;
        let corner = |di: i64, dj: i64, height_m: f64| {
            let ground = |axis: usize, index: i64| {
                ((index * step - eye.anchor[axis]) as f64 - eye.fraction[axis]) * grid.spacing_m[axis]
            };
            let up = (height_m - eye.height_m) * vertical_scale;
            DVec3::new(
                ground(0, crossing.cell[0] + di),
                up,
                ground(1, crossing.cell[1] + dj),
            )
        };
        let quad = &crossing.quad;
        let third = match crossing.triangle {
            Triangle::SouthWest => corner(0, 1, quad.sw),
            Triangle::NorthEast => corner(1, 0, quad.ne),
        };
        let corners = [corner(0, 0, quad.nw), third, corner(1, 1, quad.se)];
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        // From the nearest corner, for the least rounding.
        let nearest = corners
            .into_iter()
            .min_by(|a, b| a.length().total_cmp(&b.length()))?;
        let distance = normal.dot(nearest);
        if distance == 0.0 || !distance.is_finite() {
            return None;
        }
        let near_m = near_of_m(view, grid);
        let depth_along = |ray: DVec3| near_m * normal.dot(ray) / distance;
        let ray = view.ray(pixel);
        let east = view.ray([pixel[0] + 1.0, pixel[1]]) - ray;
        let south = view.ray([pixel[0], pixel[1] + 1.0]) - ray;

        let farthest_m = corners.iter().map(|p| p.length()).fold(0.0, f64::max);
        let seen = Seen::new(view, near_m, corners);
        let w = crossing.along;
        let height_most = [quad.nw, quad.se, quad.ne, quad.sw]
            .into_iter()
            .filter(|h| !h.is_nan())
            .fold(0.0, |most: f64, h| most.max(h.abs()));
        let moved_m = ROUNDING * farthest_m + height_most * vertical_scale.abs() / (1u64 << 22) as f64;
        let half_px = view.size_px.map(|s| f64::from(s) / 2.0);
        let [clip_x, clip_y, _] = view.clip_rows();
        let focal_px = (clip_x.length() * half_px[0]).max(clip_y.length() * half_px[1]);
        let half_size_px = half_px[0].max(half_px[1]);
        Some(Self {
            depth: depth_along(ray),
            gradient: [depth_along(east), depth_along(south)],
            vertex_rounding_m: moved_m,
            depth_rounding: near_m / w * (moved_m / w)
                + ROUNDING * seen.depths[1]
                + seen.interpolation(2.0 * half_size_px),
            place_rounding_px: RASTER_PX + moved_m / w * (focal_px + half_size_px),
        })
    }

    /// How far a device's depth may be off at the pixel.
    pub fn rounding(&self) -> f64 {
        self.depth_rounding + (self.gradient[0].abs() + self.gradient[1].abs()) * self.place_rounding_px
    }
}

/// What lies before the near plane of a triangle, on the screen.
struct Seen {
    /// Least and greatest depth.
    depths: [f64; 2],
    extent_px: f64,
    area_px: f64,
}

impl Seen {
    fn new(view: &View, near_m: f64, corners: [DVec3; 3]) -> Self {
        let [x, y, w] = view.clip_rows();
        let mut outline: Vec<DVec3> = Vec::with_capacity(4);
        for (k, &from) in corners.iter().enumerate() {
            let to = corners[(k + 1) % 3];
            let [a, b] = [from, to].map(|p| w.dot(p) - near_m);
            if a >= 0.0 {
                outline.push(from);
            }
            if (a < 0.0) != (b < 0.0) {
                outline.push(from + (to - from) * (a / (a - b)));
            }
        }
        let size_px = view.size_px.map(f64::from);
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        let mut places = Vec::with_capacity(4);
        for &p in &outline {
            let w = w.dot(p).max(near_m);
            let place = [x.dot(p) / w * size_px[0] / 2.0, y.dot(p) / w * size_px[1] / 2.0];
            for (k, value) in [place[0], place[1], near_m / w].into_iter().enumerate() {
                low[k] = low[k].min(value);
                high[k] = high[k].max(value);
            }
            places.push(place);
        }
        let cross = |k: usize| {
            let (a, b): ([f64; 2], [f64; 2]) = (places[k], places[(k + 1) % places.len()]);
            a[0] * b[1] - a[1] * b[0]
        };
        Self {
            depths: [low[2], high[2]],
            extent_px: (high[0] - low[0]).hypot(high[1] - low[1]),
            area_px: (0..places.len()).map(cross).sum::<f64>().abs() / 2.0,
        }
    }

    /// How far depths across it may be off, in a picture of `size_px`.
    fn interpolation(&self, size_px: f64) -> f64 {
        let range = self.depths[1] - self.depths[0];
        let slenderness = self.extent_px * (self.extent_px + size_px) / (2.0 * self.area_px);
        // Also where it has no area, or is nowhere before the near plane.
        if slenderness * INTERPOLATION < 1.0 {
            range * slenderness * INTERPOLATION
        } else {
            range
        }
    }
}
