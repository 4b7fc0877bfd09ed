//! What is seen: an eye, the projection from metres around it to clip space, and the size of the picture.
//!
//! A view is made of a [`Camera`], or of the matrices that a program has already. Whatever follows takes it from the
//! rows that this file computes: for a point p, in metres east, up and south of the eye, clip x, y and w are the dot
//! products of p with three rows, and clip z is `a w + b` ([`Depth`]).

use glam::{DMat3, DMat4, DVec3, DVec4};

use super::{Camera, Depth, check_eye, sin_cos_degrees};
use crate::error::{Error, ErrorKind, Result};

/// The greatest width and height of a picture in pixels: WebGPU's default limit of a texture.
pub const MAX_PICTURE_PX: u32 = 8192;

/// The share by which a matrix may miss what it must be: matrices are often made in f32.
const SLACK: f64 = 1e-5;

/// Refuses a picture of no or too many pixels.
///
/// # Errors
/// [`ErrorKind::Misuse`], naming the size and what is allowed.
pub fn check_picture(size_px: [u32; 2]) -> Result<()> {
    if size_px.iter().all(|s| (1..=MAX_PICTURE_PX).contains(s)) {
        return Ok(());
    }
    let [w, h] = size_px;
    Err(Error::new(
        ErrorKind::Misuse,
        "picture",
        format!("a size of {w}x{h} pixels cannot be drawn"),
    )
    .advice(format!("each side may be 1 to {MAX_PICTURE_PX}")))
}

/// What is seen, and the size of its picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Position of the eye in world metres, before vertical scale.
    pub eye: DVec3,
    /// Width and height of the picture in pixels.
    pub size_px: [u32; 2],
    clip_rows: [DVec3; 3],
    rays: [DVec3; 3],
    depth: Option<Depth>,
}

impl View {
    /// The view of `camera` in a picture of `size_px` pixels. Its depth is reversed and without a far end, from the
    /// DEM's own near distance on ([`crate::clipmap::near_m`]); [`View::with_depth`] sets another.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] for a camera that [`Camera::check`] refuses or a picture of no or too many pixels.
    pub fn new(camera: Camera, size_px: [u32; 2]) -> Result<Self> {
        camera.check()?;
        check_picture(size_px)?;
        let axes = camera.axes();
        // tan(a / 2) = sin a / (1 + cos a): exact at the angles where sine and cosine are.
        let (sin, cos) = sin_cos_degrees(camera.fov_deg);
        let tan_y = sin / (1.0 + cos);
        let tan_x = tan_y * (f64::from(size_px[0]) / f64::from(size_px[1]));
        Ok(Self {
            eye: camera.eye,
            size_px,
            clip_rows: [axes.col(0) / tan_x, axes.col(1) / tan_y, axes.col(2)],
            rays: [axes.col(0) * tan_x, axes.col(1) * tan_y, axes.col(2)],
            depth: None,
        })
    }

    /// The view of a program that has matrices of its own.
    ///
    /// `view` takes world metres (x east, y up, z south; before vertical scale) to the eye's: right-handed, x to the
    /// right, y up, z backward. It must be rigid: a rotation and a translation.
    ///
    /// `projection` takes the eye's metres to wgpu's clip space: x to the right, y up, depth 0 to 1. Any perspective is
    /// good: off-axis (a tile of a picture, one eye of two), of any aspect whatever the picture's, rotated within the
    /// picture, depth reversed or forward, its far end finite or not. The terrain's depths are those of the projection,
    /// so that it and whatever else is drawn with the same matrices share one depth buffer.
    ///
    /// Make the matrices in f64: far from the world's origin a translation in f32 is too coarse.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] for matrices that are not finite, a view that scales, shears or mirrors, a projection that is
    /// orthographic, left-handed, mirrored or singular or that has an oblique near plane, an eye too far away, and a
    /// picture of no or too many pixels.
    pub fn from_matrices(view: DMat4, projection: DMat4, size_px: [u32; 2]) -> Result<Self> {
        check_picture(size_px)?;
        let (rotation, eye) = rigid(view)?;
        check_eye(eye)?;
        let ([xx, xy, xz], [yx, yy, yz], depth) = perspective(projection)?;
        // Rows of the rotation are the eye's axes in the world: right, up, backward.
        let [right, up, backward] = [0, 1, 2].map(|k| rotation.row(k));
        let clip_rows = [
            right * xx + up * xy + backward * xz,
            right * yx + up * yy + backward * yz,
            -backward,
        ];
        let from_rows = |[x, y, w]: [DVec3; 3]| DMat3::from_cols(x, y, w).transpose();
        // The direction whose clip x, y, w are given: its inverse's columns are those of 1, 0, 0 and so on.
        let rays = from_rows(clip_rows).inverse();
        let rays = [rays.x_axis, rays.y_axis, rays.z_axis];
        if !(rays.iter().chain(&clip_rows)).all(|r| r.is_finite() && r.length_squared() > 0.0) {
            return Err(projection_error("is singular"));
        }
        Ok(Self {
            eye,
            size_px,
            clip_rows,
            rays,
            depth: Some(depth),
        })
    }

    /// The same view with another depth.
    #[must_use]
    pub fn with_depth(mut self, depth: Depth) -> Self {
        self.depth = Some(depth);
        self
    }

    /// The view that sees terrain drawn with `vertical_scale` as this one would see it if its heights were scaled, as
    /// [`Camera::scaled_down`]: an eye's height is in metres before the scale.
    #[must_use]
    pub fn scaled_down(mut self, vertical_scale: f64) -> Self {
        if vertical_scale != 0.0 {
            self.eye.y /= vertical_scale;
        }
        self
    }

    /// Refuses an eye that is not finite or too far away and a picture of no or too many pixels: both may have been set since.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`], naming the value.
    pub fn check(&self) -> Result<()> {
        check_eye(self.eye)?;
        check_picture(self.size_px)
    }

    /// The rows of clip x, clip y and clip w: dot products with them take a point, in metres east, up and south of the
    /// eye, to clip space. Clip w is the distance along the view axis.
    pub fn clip_rows(&self) -> [DVec3; 3] {
        self.clip_rows
    }

    /// What the picture's points look along: at distance 1 along the view axis lie, in metres east, up and south of the
    /// eye, the picture's middle (the third) and from there half its width to the right (the first) and half its height
    /// up (the second).
    pub fn rays(&self) -> [DVec3; 3] {
        self.rays
    }

    /// The ray from the eye through a place of the picture, in pixels east and south of its upper left corner: the
    /// centre of the first pixel is at 0.5, 0.5. It is metres east, up and south of the eye as drawn, after vertical
    /// scale, and one metre long along the view axis: a multiple of it is as far along the axis as it says.
    pub fn ray(&self, pixel: [f64; 2]) -> DVec3 {
        let [right, up, middle] = self.rays;
        let x = 2.0 * pixel[0] / f64::from(self.size_px[0]) - 1.0;
        let y = 1.0 - 2.0 * pixel[1] / f64::from(self.size_px[1]);
        right * x + up * y + middle
    }

    /// Its depth; none where that is the DEM's own, see [`View::new`].
    pub fn depth(&self) -> Option<Depth> {
        self.depth
    }
}

/// Rotation and eye of a view matrix.
fn rigid(view: DMat4) -> Result<(DMat3, DVec3)> {
    let misuse = |what: &str| Error::new(ErrorKind::Misuse, "view matrix", what);
    if !view.is_finite() {
        return Err(misuse("is not finite"));
    }
    let rotation = DMat3::from_mat4(view);
    let bottom = view.row(3);
    if bottom.truncate() != DVec3::ZERO || bottom.w != 1.0 {
        return Err(misuse("has a last row other than 0, 0, 0, 1")
            .advice("give the projection as a matrix of its own"));
    }
    let stretch = rotation * rotation.transpose() - DMat3::IDENTITY;
    if !stretch.abs_diff_eq(DMat3::ZERO, SLACK) {
        return Err(misuse("scales or shears").advice("give a rotation and a translation in metres"));
    }
    if rotation.determinant() < 0.0 {
        return Err(misuse("mirrors: its axes are left-handed")
            .advice("use x to the right, y up and z backward, as in glam's rh views"));
    }
    // The point that it takes to the origin, also where it is rigid but for rounding.
    let eye = -(rotation.inverse() * view.w_axis.truncate());
    Ok((rotation, eye))
}

fn projection_error(what: &str) -> Error {
    Error::new(ErrorKind::Misuse, "projection matrix", what)
}

/// A perspective projection by its clip x and clip y, each the factors on the eye's x, y and z, and its depth; all of them
/// for a clip w of -z.
fn perspective(matrix: DMat4) -> Result<([f64; 3], [f64; 3], Depth)> {
    if !matrix.is_finite() {
        return Err(projection_error("is not finite"));
    }
    let [x, y, z, w] = [0, 1, 2, 3].map(|k| matrix.row(k));
    // Whether the listed entries of a row are nothing beside its others.
    let none = |row: DVec4, entries: &[usize]| {
        let greatest = row.abs().max_element();
        entries.iter().all(|&k| row[k].abs() <= SLACK * greatest)
    };
    if w.z == 0.0 && w.w != 0.0 {
        return Err(projection_error("is orthographic").advice("terrain is drawn in perspective"));
    }
    if w.z > 0.0 {
        return Err(projection_error("looks along +z: it is left-handed")
            .advice("use a right-handed one, whose clip w is -z"));
    }
    if w.z == 0.0 || !none(w, &[0, 1, 3]) {
        return Err(projection_error("has a clip w other than -z").advice("put all rotation into the view"));
    }
    if !none(x, &[3]) || !none(y, &[3]) {
        return Err(projection_error("is not centred on the eye").advice("put the translation into the view"));
    }
    if !none(z, &[0, 1]) {
        return Err(
            projection_error("has an oblique near plane").advice("use one whose clip z depends on z alone")
        );
    }
    let turn = x.x * y.y - x.y * y.x;
    if turn == 0.0 {
        return Err(projection_error("is singular"));
    }
    if turn < 0.0 {
        return Err(projection_error("mirrors the picture").advice("wgpu's clip space has y up"));
    }
    let unit = -w.z;
    let depth = Depth::from_terms(-z.z / unit, z.w / unit)?;
    let factors = |row: DVec4| [row.x / unit, row.y / unit, row.z / unit];
    Ok((factors(x), factors(y), depth))
}

#[cfg(test)]
mod tests;
