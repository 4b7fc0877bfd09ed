//! How the camera moves: at a speed that grows with its height above the ground, and not below the ground unless asked.
//!
//! Lengths are metres as drawn, with the vertical scale; an eye's own height is before it. With `above_m` the height
//! above the ground, the camera moves at `0.6 max(above_m, 8 spacings) * 1.25^notches` metres a second, four times or a
//! quarter of that where asked. It takes up a speed, and comes to rest, within a few tenths of a second: the velocity v
//! follows the wanted one w by `v += (w - v) (1 - exp(-t / 0.1 s))`.

use glam::DVec3;

use super::controls::{Held, Motion};
use crate::camera::Camera;
use crate::grid::Grid;

/// The share of the height above ground that is flown in a second.
const SPEED_PER_S: f64 = 0.6;

/// The height in spacings from which speeds do not fall any further.
const LEAST_HEIGHT_SPACINGS: f64 = 8.0;

/// The factor of a notch of the wheel, and the most notches either way.
const NOTCH: f64 = 1.25;
const NOTCHES: i32 = 32;

/// The factor of Shift, and one over that of Ctrl.
const GEAR: f64 = 4.0;

/// Seconds in which a velocity comes within 1/e of what is wanted.
const INERTIA_S: f64 = 0.1;

/// The share of the speed below which the camera rests.
const REST: f64 = 1e-3;

/// Heights of the picture turned in a second by key.
const TURN_PER_S: f64 = 1.0;

/// The least height above the ground: this share of the spacing, but no more than a person's eyes.
const CLEARANCE_SPACINGS: f64 = 0.05;
const CLEARANCE_MOST_M: f64 = 2.0;

/// How far away from the DEM the camera may fly, in the DEM's greatest side.
const FARTHEST_SIDES: f64 = 20.0;

/// The least vertical scale by which heights as drawn are taken back to heights: below it all is a plane.
const LEAST_SCALE: f64 = 1e-6;

/// Where the ground is under the camera, and how the world is drawn.
pub(super) struct Ground<'a> {
    pub(super) grid: &'a Grid,
    /// Factor on heights.
    pub(super) vertical_scale: f64,
    /// Least and greatest height of the DEM in metres.
    pub(super) range_m: [f64; 2],
    /// The ground's height in metres at x, z; none in a hole and off the DEM.
    pub(super) height_m: &'a dyn Fn(f64, f64) -> Option<f64>,
}

impl Ground<'_> {
    fn spacing_m(&self) -> f64 {
        (self.grid.spacing_m[0] * self.grid.spacing_m[1]).sqrt()
    }

    /// Metres of an eye above the ground as drawn; over no ground above the DEM's least height.
    pub(super) fn above_m(&self, eye: DVec3) -> f64 {
        let ground = (self.height_m)(eye.x, eye.z).unwrap_or(self.range_m[0]);
        (eye.y - ground) * self.vertical_scale
    }

    /// The least height above the ground, metres as drawn.
    pub(super) fn clearance_m(&self) -> f64 {
        (CLEARANCE_SPACINGS * self.spacing_m()).min(CLEARANCE_MOST_M)
    }

    /// The eye, lifted to the least height above the ground where it is lower. Of no vertical scale all is one plane
    /// through the eye, and over a hole there is nothing to be kept from.
    pub(super) fn lifted(&self, eye: DVec3) -> DVec3 {
        let scale = self.vertical_scale;
        let Some(ground) = (self.height_m)(eye.x, eye.z).filter(|_| scale.abs() >= LEAST_SCALE) else {
            return eye;
        };
        if (eye.y - ground) * scale >= self.clearance_m() {
            return eye;
        }
        DVec3::new(eye.x, ground + self.clearance_m() / scale, eye.z)
    }

    /// The eye, kept where the DEM can still be found.
    fn fenced(&self, eye: DVec3) -> DVec3 {
        let size = self.grid.size;
        let [width, depth] = [
            (size.width - 1) as f64 * self.grid.spacing_m[0],
            (size.height - 1) as f64 * self.grid.spacing_m[1],
        ];
        let relief = self.range_m[1] - self.range_m[0];
        let far = FARTHEST_SIDES * width.max(depth).max(relief).max(self.spacing_m());
        let up = far / self.vertical_scale.abs().max(LEAST_SCALE);
        DVec3::new(
            eye.x.clamp(-far, width + far),
            eye.y.clamp(self.range_m[0] - up, self.range_m[1] + up),
            eye.z.clamp(-far, depth + far),
        )
    }
}

/// The camera, and what moves it.
#[derive(Clone, Debug)]
pub(super) struct Pilot {
    pub(super) camera: Camera,
    /// Whether the camera may be below the ground.
    pub(super) below_ground: bool,
    notches: i32,
    velocity_m_per_s: DVec3,
}

impl Pilot {
    pub(super) fn new(camera: Camera) -> Self {
        Self {
            camera,
            below_ground: false,
            notches: 0,
            velocity_m_per_s: DVec3::ZERO,
        }
    }

    /// Puts the camera elsewhere, at rest.
    pub(super) fn place(&mut self, camera: Camera) {
        self.camera = camera;
        self.velocity_m_per_s = DVec3::ZERO;
    }

    /// Makes the camera faster or slower by notches of the wheel.
    pub(super) fn shift_speed(&mut self, notches: i32) {
        self.notches = self.notches.saturating_add(notches).clamp(-NOTCHES, NOTCHES);
    }

    /// Metres a second at a height above the ground.
    pub(super) fn speed_m_per_s(&self, above_m: f64, spacing_m: f64, held: &Held) -> f64 {
        let height = above_m.abs().max(LEAST_HEIGHT_SPACINGS * spacing_m);
        let gear = GEAR.powf(held.axis(Motion::Fast, Motion::Slow));
        SPEED_PER_S * height * NOTCH.powi(self.notches) * gear
    }

    /// Looks to where the pointer drags: by as many pixels of a picture of `height_px`, to the right and downwards.
    pub(super) fn look(&mut self, pixels: [f64; 2], height_px: f64) {
        let degrees = self.camera.fov_deg / height_px.max(1.0);
        self.turn(pixels[0] * degrees, -pixels[1] * degrees);
    }

    fn turn(&mut self, right_deg: f64, up_deg: f64) {
        let camera = &mut self.camera;
        camera.heading_deg = (camera.heading_deg + right_deg).rem_euclid(360.0);
        camera.pitch_deg = (camera.pitch_deg + up_deg).clamp(-90.0, 90.0);
    }

    /// Moves by what keys say over `passed_s` seconds. Whether anything has changed.
    pub(super) fn advance(&mut self, held: &Held, passed_s: f64, ground: &Ground) -> bool {
        let before = self.camera;
        let turn = TURN_PER_S * self.camera.fov_deg * passed_s;
        let [right, up] = [
            held.axis(Motion::TurnRight, Motion::TurnLeft),
            held.axis(Motion::LookUp, Motion::LookDown),
        ];
        if right != 0.0 || up != 0.0 {
            self.turn(right * turn, up * turn);
        }

        let axes = self.camera.axes();
        let wanted = axes.col(2) * held.axis(Motion::Forward, Motion::Back)
            + axes.col(0) * held.axis(Motion::Right, Motion::Left)
            + DVec3::Y * held.axis(Motion::Up, Motion::Down);
        let speed = self.speed_m_per_s(ground.above_m(self.camera.eye), ground.spacing_m(), held);
        let wanted = wanted.normalize_or_zero() * speed;
        let follow = 1.0 - (-passed_s / INERTIA_S).exp();
        self.velocity_m_per_s += (wanted - self.velocity_m_per_s) * follow;
        if wanted == DVec3::ZERO && self.velocity_m_per_s.length() < REST * speed {
            self.velocity_m_per_s = DVec3::ZERO;
        }
        let mut step = self.velocity_m_per_s * passed_s;
        let scale = ground.vertical_scale;
        step.y = if scale.abs() < LEAST_SCALE {
            0.0
        } else {
            step.y / scale
        };
        if step != DVec3::ZERO {
            self.camera.eye = ground.fenced(self.camera.eye + step);
        }
        self.keep_above(ground);
        self.camera != before
    }

    /// Lifts the camera out of the ground, unless it may be there. Whether it had to be.
    pub(super) fn keep_above(&mut self, ground: &Ground) -> bool {
        if self.below_ground {
            return false;
        }
        let lifted = ground.lifted(self.camera.eye);
        let moved = lifted != self.camera.eye;
        self.camera.eye = lifted;
        moved
    }

    /// Whether nothing moves it on.
    pub(super) fn rests(&self, held: &Held) -> bool {
        let still = |plus, minus| held.axis(plus, minus) == 0.0;
        self.velocity_m_per_s == DVec3::ZERO
            && still(Motion::Forward, Motion::Back)
            && still(Motion::Right, Motion::Left)
            && still(Motion::Up, Motion::Down)
            && still(Motion::TurnRight, Motion::TurnLeft)
            && still(Motion::LookUp, Motion::LookDown)
    }
}

#[cfg(test)]
mod tests;
