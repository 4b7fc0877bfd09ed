//! A ray as the caster knows it: its track over the ground, and its height, in time.

use glam::DVec3;

use super::ground::{Axis, Track};
use crate::clipmap::Eye;
use crate::error::{Error, ErrorKind, Result};
use crate::grid::Grid;

/// A ray over the ground, in time: multiples of its direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    pub(super) track: Track,
    pub(super) eye: Eye,
    /// Metres up per unit of time, after vertical scale.
    pub(super) rise: f64,
    scale: f64,
    /// When it begins.
    pub(super) start: f64,
    /// Units of time in the direction that was given.
    pub(super) factor: f64,
}

impl Line {
    /// The ray from `eye` along `direction` (metres east, up and south, after vertical scale), from `start` on.
    pub(super) fn new(grid: &Grid, eye: &Eye, direction: DVec3, scale: f64, start: f64) -> Result<Self> {
        if !direction.is_finite() || direction == DVec3::ZERO {
            let what = format!("a ray along {direction} leads nowhere");
            return Err(Error::new(ErrorKind::Misuse, "query", what).advice("give a finite direction"));
        }
        // So that neither its parts nor their inverses leave f64's range.
        let greatest = direction.abs().max_element();
        let factor = if (1e-9..1e9).contains(&greatest) {
            1.0
        } else {
            greatest
        };
        let direction = direction / factor;
        Ok(Self {
            track: Track {
                x: Axis::new(grid, eye, 0, direction.x),
                z: Axis::new(grid, eye, 1, direction.z),
            },
            eye: *eye,
            rise: direction.y,
            scale,
            start: start * factor,
            factor,
        })
    }

    /// A time as a multiple of the direction that was given.
    pub(super) fn along(&self, time: f64) -> f64 {
        time / self.factor
    }

    /// A height as metres above the eye, after vertical scale.
    pub(super) fn up(&self, height_m: f64) -> f64 {
        if self.scale == 0.0 {
            0.0
        } else {
            (height_m - self.eye.height_m) * self.scale
        }
    }

    /// The side on which the ray stays of all that lies between two heights; none where it may meet it.
    pub(super) fn side_of(&self, heights: [f32; 2], span: [f64; 2]) -> Option<Side> {
        let [a, b] = heights.map(|h| self.up(f64::from(h)));
        let [c, d] = span.map(|t| self.rise * t);
        // What is not known is NaN or infinite, and passes neither comparison.
        if c.min(d) > a.max(b) && !a.is_nan() && !b.is_nan() {
            Some(Side::Above)
        } else if c.max(d) < a.min(b) && !a.is_nan() && !b.is_nan() {
            Some(Side::Below)
        } else {
            None
        }
    }
}

/// The side of the surface on which a ray is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Above,
    Below,
}

impl Side {
    pub(super) fn of(surface_over_ray: f64) -> Option<Self> {
        match surface_over_ray.partial_cmp(&0.0)? {
            std::cmp::Ordering::Less => Some(Self::Above),
            std::cmp::Ordering::Greater => Some(Self::Below),
            std::cmp::Ordering::Equal => None,
        }
    }
}
