//! Measured error: how far on the screen each drawn point lies from the DEM's own surface.
//!
//! A pixel's drawn depth gives a point P of the ground, on the ray through the pixel's centre. Q is the point of `S0`
//! with the same x and z. The error is the distance on the screen between the projections of P and Q, less a *floor*,
//! never below 0; in metres it is |P.y - Q.y|, before vertical scale.
//!
//! *On the screen.* With g = P.y - Q.y (as drawn), clip rows x, y, w (their up components x', y', w') and P's own clip
//! coordinates X, Y, W, Q projects to (X - g x') / (W - g w'): P and Q are
//! `|g| / (W - g w') hypot((X/W w' - x') width / 2, (Y/W w' - y') height / 2)` pixels apart, a form in which nothing
//! cancels. Where the bracket is not positive, Q is not before the camera, and no number of pixels is enough.
//!
//! *The floor* is what the rasteriser's grid and f32 can add at the pixel, given the slope of `S0` at Q and within the grid's
//! shift of it, whichever makes it greatest. [`Facet`] bounds
//! by how much the depth of a triangle may be off: by r at one place, and by what its gradient makes of a shift of s
//! pixels along each axis. Let the plane of the triangle of `S0` lie A below the eye, with normal n, and let e and s be
//! what a step of a pixel to the east and to the south adds to the ray. A point at depth d on the ray is then
//! `A (depth of the plane / d - 1)` above the plane, and depths off by r and shifts by s move that by at most
//! `(|A| r + near s (|n.e| + |n.s|) / |n.y|) / d`. On the screen it counts as g does. What a drawn triangle that is
//! steeper or larger than that of `S0` may add to it counts as error.
//!
//! `S0` may be void where something is drawn: such a pixel, and each at which the exact image and the drawn one disagree
//! about being terrain, is one of the *silhouette*.

use glam::DVec3;

use super::exact::each_row;
use super::second_look::SecondLook;
use super::{DepthImage, Facet, RASTER_PX};
use crate::camera::View;
use crate::clipmap::Drawn;
use crate::error::Result;
use crate::query::{Crossing, Probe, Truth};
use crate::work::Work;

/// What was found at a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelError {
    /// The error in pixels, floor taken off: 0 or more, [`f32::MAX`] where the point of `S0` is not before the camera,
    /// NaN where there is none: no terrain is drawn, or `S0` is void there.
    pub error_px: f32,
    /// The floor in pixels; 0 where there is no error.
    pub floor_px: f32,
    /// The error in metres; NaN where there is none.
    pub error_m: f32,
    /// Whether drawn and exact image disagree about being terrain.
    pub silhouette: bool,
    /// Whether the depth is that of a triangle beside the pixel's centre, and the error that of the point which a ray meets
    /// on it, see [`measure_drawn`].
    pub beside: bool,
}

/// The measured errors of a frame.
#[derive(Clone, Debug)]
pub struct FrameErrors {
    /// A pixel each, row by row from the upper left.
    pub pixels: Vec<PixelError>,
    /// Their figures.
    pub summary: ErrorSummary,
}

/// What a frame's pixels, or those of several frames, come to. Without a pixel of terrain all is 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ErrorSummary {
    /// Pixels that have an error.
    pub terrain_px: u64,
    /// Greatest error in pixels; [`f64::MAX`] where a point of `S0` is not before the camera.
    pub error_px_max: f64,
    /// The 99th percentile, by nearest rank.
    pub error_px_p99: f64,
    /// Root of the mean square.
    pub error_px_rms: f64,
    /// Greatest error in metres, before vertical scale.
    pub error_m_max: f64,
    /// The greatest floor that was taken off an error.
    pub error_floor_px: f64,
    /// Pixels at which the exact image and the drawn one disagree about being terrain.
    pub silhouette_px: u64,
    /// Pixels whose depth is that of a triangle beside them, measured on it, see [`measure_drawn`].
    pub beside_px: u64,
}

/// Measures a drawn frame against `truth`.
///
/// # Errors
/// [`crate::ErrorKind::Misuse`] for a view of other than finite numbers; those of reading.
pub fn measure(truth: &Truth<'_>, image: &DepthImage<'_>, work: &dyn Work) -> Result<FrameErrors> {
    measure_by(
        truth,
        image,
        work,
        || (),
        |probe, (), pixel, depth| at_pixel(truth, probe, image.view(), pixel, depth),
    )
}

/// The same for a frame of which it is known what surface it draws: where a pixel's depth is not on that surface, but is the
/// depth of a triangle that rays beside its centre meet, the point that such a ray meets is measured in its place
/// (`second_look.rs`).
///
/// # Errors
/// As [`measure`], and [`crate::ErrorKind::Misuse`] where the surface is drawn for another eye than the image's.
pub fn measure_drawn(
    truth: &Truth<'_>,
    drawn: &Drawn<'_>,
    image: &DepthImage<'_>,
    work: &dyn Work,
) -> Result<FrameErrors> {
    image.check_eye_of(drawn)?;
    measure_by(
        truth,
        image,
        work,
        || SecondLook::new(drawn, image),
        |probe, second_look, pixel, depth| {
            let first = at_pixel(truth, probe, image.view(), pixel, depth)?;
            if first.error_px > 0.0 {
                second_look.at_pixel(probe, pixel, depth, first)
            } else {
                Ok(first)
            }
        },
    )
}

fn measure_by<M>(
    truth: &Truth<'_>,
    image: &DepthImage<'_>,
    work: &dyn Work,
    memory: impl Fn() -> M + Sync,
    at_pixel: impl Fn(&mut Probe<'_>, &mut M, [f64; 2], f64) -> Result<PixelError> + Sync,
) -> Result<FrameErrors> {
    let view = image.view();
    let mut pixels = vec![PixelError::default(); view.size_px.iter().map(|&n| n as usize).product()];
    each_row(
        truth,
        view,
        work,
        &mut pixels,
        memory,
        |probe, memory, pixel, out| {
            let depth = image.row(pixel[1] as u32)[pixel[0] as usize];
            *out = at_pixel(probe, memory, pixel, f64::from(depth))?;
            Ok(())
        },
    )?;
    let summary = ErrorSummary::of(&pixels);
    Ok(FrameErrors { pixels, summary })
}

fn at_pixel(
    truth: &Truth<'_>,
    probe: &mut Probe<'_>,
    view: &View,
    pixel: [f64; 2],
    depth: f64,
) -> Result<PixelError> {
    let is_terrain = probe.cast(pixel)?.is_some();
    let none = PixelError {
        error_px: f32::NAN,
        floor_px: 0.0,
        error_m: f32::NAN,
        silhouette: is_terrain,
        beside: false,
    };
    let away_m = probe.near_m() / depth;
    // Also where the depth is no number.
    if !(depth > 0.0 && away_m.is_finite()) {
        return Ok(none);
    }
    let ray = view.ray(pixel);
    let point = ray * away_m;
    let under = probe.under([point.x, point.z])?;
    let Some((under, height_m)) = under.and_then(|u| Some((u, u.height_m()?))) else {
        return Ok(PixelError {
            silhouette: true,
            ..none
        });
    };
    let (grid, scale) = (truth.grid(), truth.vertical_scale());
    let up = (height_m - probe.eye().height_m) * scale;
    let gap_m = if scale == 0.0 { point.y } else { point.y - up };
    let rounding = Rounding::new(truth, view, &under.crossing(away_m, height_m), pixel, depth);
    let across = [[1.0, 0.0], [0.0, 1.0]].map(|[dx, dy]| view.ray([pixel[0] + dx, pixel[1] + dy]) - ray);
    let shift_m = (across[0].length() + across[1].length()) * rounding.place_px * away_m;
    let mut floor_m = 0.0f64;
    for [dx, dz] in AROUND.map(|d| d.map(|d| d * shift_m)) {
        let Some(beside) = probe.under([point.x + dx, point.z + dz])? else {
            continue;
        };
        let [east, south] = beside.slopes(grid.spacing_m).map(|s| s * scale);
        // The triangle's plane over or under the eye, and its normal for an up component of 1.
        let plane_up = up - (point.x * east + point.z * south);
        let normal = DVec3::new(-east, 1.0, -south);
        let shifted =
            away_m * (normal.dot(across[0]).abs() + normal.dot(across[1]).abs()) * rounding.place_px;
        floor_m = floor_m.max(plane_up.abs() * rounding.depth / depth + shifted); // leaves out voids
    }
    let screen = Screen::new(view, pixel, away_m);
    let floor_px = screen.least_px(floor_m);
    Ok(PixelError {
        error_px: to_f32((screen.px(gap_m) - floor_px).max(0.0)),
        floor_px: to_f32(floor_px),
        error_m: to_f32(if scale == 0.0 { 0.0 } else { (gap_m / scale).abs() }),
        silhouette: !is_terrain,
        beside: false,
    })
}

/// Within f32, as large as need be: JSON knows no infinity.
pub(super) fn to_f32(value: f64) -> f32 {
    value.min(f64::from(f32::MAX)) as f32
}

/// The place itself and those around it, in shifts of the rasteriser's grid: what is drawn at a pixel may be the triangle
/// of any of them.
const AROUND: [[f64; 2]; 9] = [
    [0.0, 0.0],
    [-1.0, 0.0],
    [1.0, 0.0],
    [0.0, -1.0],
    [0.0, 1.0],
    [-1.0, -1.0],
    [1.0, -1.0],
    [-1.0, 1.0],
    [1.0, 1.0],
];

/// By how much a device's depths may be off at one place, and places on the screen in pixels.
#[derive(Clone, Copy)]
struct Rounding {
    depth: f64,
    place_px: f64,
}

impl Rounding {
    /// That of the triangle of `S0` that is crossed.
    fn new(truth: &Truth<'_>, view: &View, crossing: &Crossing, pixel: [f64; 2], depth: f64) -> Self {
        let facet = Facet::new(truth.grid(), view, truth.vertical_scale(), crossing, pixel);
        match facet {
            // Its plane goes through the eye: depths at one place do not matter.
            None => Self {
                depth: 0.0,
                place_px: RASTER_PX,
            },
            Some(f) => Self {
                depth: depth * (f.vertex_rounding_m / crossing.along + 1.0 / (1u64 << 22) as f64),
                place_px: f.place_rounding_px,
            },
        }
    }
}

/// Vertical distances on the screen, from a point on the ray through a pixel.
pub(super) struct Screen {
    /// Pixels, times the distance along the view axis, of a metre up.
    per_m: f64,
    away_m: f64,
    /// How much farther along the view axis a metre up is.
    forward: f64,
}

impl Screen {
    pub(super) fn new(view: &View, pixel: [f64; 2], away_m: f64) -> Self {
        let [x, y, w] = view.clip_rows();
        let size = view.size_px.map(f64::from);
        let place = [2.0 * pixel[0] / size[0] - 1.0, 1.0 - 2.0 * pixel[1] / size[1]];
        let across = (place[0] * w.y - x.y) * size[0] / 2.0;
        let down = (place[1] * w.y - y.y) * size[1] / 2.0;
        Self {
            per_m: across.hypot(down),
            away_m,
            forward: w.y,
        }
    }

    /// Pixels to the point `gap_m` metres below.
    pub(super) fn px(&self, gap_m: f64) -> f64 {
        let away_m = self.away_m - gap_m * self.forward;
        if gap_m == 0.0 {
            0.0
        } else if away_m > 0.0 {
            gap_m.abs() * self.per_m / away_m
        } else {
            f64::INFINITY
        }
    }

    /// The lesser of the pixels to the points `gap_m` metres below and above.
    fn least_px(&self, gap_m: f64) -> f64 {
        self.px(gap_m).min(self.px(-gap_m))
    }
}

impl ErrorSummary {
    /// What `pixels` come to.
    pub fn of(pixels: &[PixelError]) -> Self {
        let mut errors: Vec<f32> = pixels
            .iter()
            .map(|p| p.error_px)
            .filter(|e| !e.is_nan())
            .collect();
        let mut summary = Self {
            terrain_px: errors.len() as u64,
            silhouette_px: pixels.iter().filter(|p| p.silhouette).count() as u64,
            beside_px: pixels.iter().filter(|p| p.beside).count() as u64,
            ..Self::default()
        };
        if errors.is_empty() {
            return summary;
        }
        let greatest = |of: fn(&PixelError) -> f32| pixels.iter().map(of).fold(0.0, f32::max);
        summary.error_px_max = from_f32(greatest(|p| p.error_px));
        summary.error_m_max = from_f32(greatest(|p| p.error_m));
        summary.error_floor_px = from_f32(greatest(|p| p.floor_px));
        let squares: f64 = errors.iter().map(|&e| f64::from(e) * f64::from(e)).sum();
        summary.error_px_rms = (squares / errors.len() as f64).sqrt();
        // By nearest rank, as `stats::percentile`.
        let rank = (99 * errors.len()).div_ceil(100).max(1) - 1;
        let (_, p99, _) = errors.select_nth_unstable_by(rank, f32::total_cmp);
        summary.error_px_p99 = from_f32(*p99);
        summary
    }
}

/// As f64 says it: what is beyond all numbers stays so.
fn from_f32(value: f32) -> f64 {
    if value == f32::MAX {
        f64::MAX
    } else {
        f64::from(value)
    }
}
