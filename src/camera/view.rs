//! A camera and the picture it makes: the projection from eye-relative metres to clip space.

use glam::DVec3;

use super::{Camera, sin_cos_degrees};
use crate::error::{Error, ErrorKind, Result};

/// The greatest width and height of a picture in pixels: WebGPU's default limit of a texture.
pub const MAX_PICTURE_PX: u32 = 8192;

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

/// A camera and the size of its picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The camera.
    pub camera: Camera,
    /// Width and height of the picture.
    pub size_px: [u32; 2],
}

impl View {
    /// The view of `camera` in a picture of `size_px` pixels.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] for a camera that [`Camera::check`] refuses or a picture of no or too many pixels.
    pub fn new(camera: Camera, size_px: [u32; 2]) -> Result<Self> {
        camera.check()?;
        check_picture(size_px)?;
        Ok(Self { camera, size_px })
    }

    /// Tangents of half the horizontal and half the vertical field of view.
    pub fn half_tangents(&self) -> [f64; 2] {
        // tan(a / 2) = sin a / (1 + cos a): exact at the angles where sine and cosine are.
        let (sin, cos) = sin_cos_degrees(self.camera.fov_deg);
        let vertical = sin / (1.0 + cos);
        let aspect = f64::from(self.size_px[0]) / f64::from(self.size_px[1]);
        [vertical * aspect, vertical]
    }

    /// What takes a point, in metres east, up and south of the eye, to clip space: clip x, clip y and clip w
    /// are the dot products with these rows. Clip w is the distance along the view axis; clip z is the near
    /// distance, whatever the point (reversed, infinite depth).
    pub fn clip_rows(&self) -> [DVec3; 3] {
        let axes = self.camera.axes();
        let [tan_x, tan_y] = self.half_tangents();
        [axes.col(0) / tan_x, axes.col(1) / tan_y, axes.col(2)]
    }

    /// The ray from the eye through a place of the picture, in pixels east and south of its upper left corner: the
    /// centre of the first pixel is at 0.5, 0.5. It is metres east, up and south of the eye as drawn, after vertical
    /// scale, and one metre long along the view axis: a multiple of it is as far along the axis as it says.
    pub fn ray(&self, pixel: [f64; 2]) -> DVec3 {
        let axes = self.camera.axes();
        let [tan_x, tan_y] = self.half_tangents();
        let x = 2.0 * pixel[0] / f64::from(self.size_px[0]) - 1.0;
        let y = 1.0 - 2.0 * pixel[1] / f64::from(self.size_px[1]);
        axes.col(0) * (tan_x * x) + axes.col(1) * (tan_y * y) + axes.col(2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_frustum_s_corner_is_at_one() {
        let camera = Camera {
            eye: DVec3::ZERO,
            heading_deg: 0.0,
            pitch_deg: 0.0,
            roll_deg: 0.0,
            fov_deg: 90.0,
        };
        let view = View::new(camera, [200, 100]).unwrap();
        let [x, y, w] = view.clip_rows().map(|row| row.dot(DVec3::new(2.0, 1.0, -1.0)));
        assert!(
            (x - 1.0).abs() < 1e-15 && (y - 1.0).abs() < 1e-15 && w == 1.0,
            "{x} {y} {w}"
        );
    }

    #[test]
    fn a_ray_projects_to_its_pixel() {
        let camera = Camera {
            eye: DVec3::new(5.0, -7.0, 1e6),
            heading_deg: 123.0,
            pitch_deg: -31.0,
            roll_deg: 12.0,
            fov_deg: 70.0,
        };
        let view = View::new(camera, [320, 200]).unwrap();
        for pixel in [[0.0, 0.0], [320.0, 0.0], [160.0, 100.0], [17.5, 191.25]] {
            let ray = view.ray(pixel);
            let [x, y, w] = view.clip_rows().map(|row| row.dot(ray));
            let back = [(x / w + 1.0) * 160.0, (1.0 - y / w) * 100.0];
            assert!((w - 1.0).abs() < 1e-14);
            assert!(
                (0..2).all(|k| (back[k] - pixel[k]).abs() < 1e-11),
                "{pixel:?}: {back:?}"
            );
        }
        assert_eq!(
            view.ray([160.0, 100.0]),
            camera.axes().col(2),
            "the axis is in the middle"
        );
    }

    #[test]
    fn pictures_without_pixels_are_refused() {
        let camera = Camera {
            eye: DVec3::ZERO,
            heading_deg: 0.0,
            pitch_deg: 0.0,
            roll_deg: 0.0,
            fov_deg: 90.0,
        };
        assert!(View::new(camera, [0, 5]).is_err());
        assert!(View::new(camera, [5, MAX_PICTURE_PX + 1]).is_err());
    }
}
