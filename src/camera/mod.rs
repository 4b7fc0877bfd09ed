//! The camera: where it stands, where it looks, and how it projects.
//!
//! The world is right-handed in metres: x east, y up, z south. Heading turns clockwise from north (north is
//! -z), pitch turns up, roll tilts the camera's right side down. Depth is reversed and has no far end, near / distance
//! along the view axis, unless a [`View`] says otherwise.

mod crs_flight;
mod depth;
mod flight;
mod view;
mod whole;

pub use crs_flight::{CrsFlight, CrsPlace};
pub use depth::{Depth, DepthDirection};
pub use flight::{Flight, Key, is_crs};
pub use view::{MAX_PICTURE_PX, View, check_picture};
pub use whole::overview;

use glam::{DMat3, DVec3};

use crate::error::{Error, ErrorKind, Result};

/// The greatest coordinate of an eye in metres, either way.
///
/// On the GPU all numbers are f32, which ends at 3.4e38. A distance of 1e31 m stays within it in samples of a
/// millimetre, and times what the narrowest field of view magnifies in the slimmest picture: 1e31 * 1.15e4 * 512.
pub const MAX_EYE_M: f64 = 1e31;

/// The narrowest field of view in degrees, see [`MAX_EYE_M`].
pub const MIN_FOV_DEG: f64 = 0.01;

/// A camera in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Position in metres, before vertical scale.
    pub eye: DVec3,
    /// Degrees clockwise from north.
    pub heading_deg: f64,
    /// Degrees above the horizon, -90 to 90.
    pub pitch_deg: f64,
    /// Degrees by which the right side is tilted down.
    pub roll_deg: f64,
    /// Vertical field of view in degrees, [`MIN_FOV_DEG`] or more and below 180.
    pub fov_deg: f64,
}

impl Camera {
    /// Refuses positions that are not finite or beyond [`MAX_EYE_M`], angles that are not finite, and fields of view
    /// that show nothing.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`], naming the value.
    pub fn check(&self) -> Result<()> {
        let misuse = |what: String| Err(Error::new(ErrorKind::Misuse, "camera", what));
        check_eye(self.eye)?;
        for (name, angle) in [
            ("heading", self.heading_deg),
            ("pitch", self.pitch_deg),
            ("roll", self.roll_deg),
        ] {
            if !angle.is_finite() {
                return misuse(format!("a {name} of {angle} degrees is not finite"));
            }
        }
        if self.pitch_deg.abs() > 90.0 {
            return misuse(format!(
                "a pitch of {} degrees is outside -90 to 90",
                self.pitch_deg
            ));
        }
        if !(self.fov_deg >= MIN_FOV_DEG && self.fov_deg < 180.0) {
            return misuse(format!(
                "a field of view of {} degrees is outside {MIN_FOV_DEG} to 180",
                self.fov_deg
            ));
        }
        Ok(())
    }

    /// The camera's axes in the world, as columns: right, up, forward. Orthonormal.
    pub fn axes(&self) -> DMat3 {
        let (sin_h, cos_h) = sin_cos_degrees(self.heading_deg);
        let (sin_p, cos_p) = sin_cos_degrees(self.pitch_deg);
        let (sin_r, cos_r) = sin_cos_degrees(self.roll_deg);
        let forward = DVec3::new(sin_h * cos_p, sin_p, -cos_h * cos_p);
        let level_right = DVec3::new(cos_h, 0.0, sin_h);
        let level_up = level_right.cross(forward);
        let right = level_right * cos_r - level_up * sin_r;
        let up = level_up * cos_r + level_right * sin_r;
        DMat3::from_cols(right, up, forward)
    }

    /// The camera that sees terrain drawn with `vertical_scale` as this one would see it if its heights were scaled:
    /// a camera's height is in metres before the scale. Unchanged for a scale of 0, which puts every eye into the
    /// plane that the terrain then is.
    #[must_use]
    pub fn scaled_down(mut self, vertical_scale: f64) -> Self {
        if vertical_scale != 0.0 {
            self.eye.y /= vertical_scale;
        }
        self
    }

    /// Heading and pitch in degrees of the direction from `eye` to `target`; north where they coincide.
    pub fn toward(eye: DVec3, target: DVec3) -> (f64, f64) {
        let d = target - eye;
        let level = d.x.hypot(d.z);
        if level == 0.0 && d.y == 0.0 {
            return (0.0, 0.0);
        }
        let heading = if level == 0.0 {
            0.0
        } else {
            d.x.atan2(-d.z).to_degrees().rem_euclid(360.0)
        };
        (heading, d.y.atan2(level).to_degrees())
    }
}

/// Refuses an eye that is not finite or beyond [`MAX_EYE_M`].
fn check_eye(eye: DVec3) -> Result<()> {
    let misuse = |what: String| Err(Error::new(ErrorKind::Misuse, "camera", what));
    if !eye.is_finite() {
        return misuse(format!("the eye at {eye} is not finite"));
    }
    if eye.abs().max_element() > MAX_EYE_M {
        let [x, y, z] = eye.to_array();
        return misuse(format!(
            "the eye at {x:e}, {y:e}, {z:e} is farther than {MAX_EYE_M:e} m"
        ));
    }
    Ok(())
}

/// Sine and cosine of an angle in degrees, exact at multiples of 90.
pub fn sin_cos_degrees(degrees: f64) -> (f64, f64) {
    let turn = degrees.rem_euclid(360.0);
    match turn {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        _ => turn.to_radians().sin_cos(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(heading_deg: f64, pitch_deg: f64, roll_deg: f64) -> Camera {
        Camera {
            eye: DVec3::ZERO,
            heading_deg,
            pitch_deg,
            roll_deg,
            fov_deg: 60.0,
        }
    }

    #[test]
    fn axes_follow_the_compass() {
        let axes = camera(0.0, 0.0, 0.0).axes();
        assert_eq!(axes.col(2), DVec3::NEG_Z, "north is -z");
        assert_eq!(axes.col(0), DVec3::X, "facing north, right is east");
        assert_eq!(
            camera(90.0, 0.0, 0.0).axes().col(2),
            DVec3::X,
            "heading 90 is east"
        );
        assert_eq!(camera(0.0, 90.0, 0.0).axes().col(2), DVec3::Y);
        assert_eq!(
            camera(0.0, 0.0, 90.0).axes().col(0),
            DVec3::NEG_Y,
            "roll puts the right side down"
        );
        let axes = camera(33.0, -12.0, 71.0).axes();
        assert!((axes * axes.transpose()).abs_diff_eq(DMat3::IDENTITY, 1e-15));
        assert!(
            (axes.col(0).cross(axes.col(1)) + axes.col(2)).length() < 1e-15,
            "right x up is backward"
        );
    }

    #[test]
    fn toward_inverts_the_axes() {
        for (heading, pitch) in [(0.0, 0.0), (123.0, -45.0), (359.0, 89.0), (200.0, 10.0)] {
            let forward = camera(heading, pitch, 0.0).axes().col(2);
            let (h, p) = Camera::toward(DVec3::ONE, DVec3::ONE + forward * 7.0);
            assert!(
                (h - heading).abs() < 1e-9 && (p - pitch).abs() < 1e-9,
                "{heading} {pitch}: {h} {p}"
            );
        }
        assert_eq!(Camera::toward(DVec3::ZERO, DVec3::NEG_Y), (0.0, -90.0));
    }

    #[test]
    fn what_is_not_finite_or_shows_nothing_is_refused() {
        let good = camera(0.0, 0.0, 0.0);
        assert!(good.check().is_ok());
        for bad in [
            Camera {
                eye: DVec3::new(f64::NAN, 0.0, 0.0),
                ..good
            },
            Camera {
                heading_deg: f64::INFINITY,
                ..good
            },
            Camera {
                pitch_deg: 91.0,
                ..good
            },
            Camera {
                fov_deg: 180.0,
                ..good
            },
            Camera { fov_deg: 0.0, ..good },
            Camera {
                fov_deg: 1e-300,
                ..good
            },
            Camera {
                eye: DVec3::new(0.0, -1.01e31, 0.0),
                ..good
            },
        ] {
            assert_eq!(bad.check().unwrap_err().kind(), ErrorKind::Misuse);
        }
    }
}
