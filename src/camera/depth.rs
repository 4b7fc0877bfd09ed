//! How distance becomes depth: `depth = a + b / w`, with w the distance along the view axis.
//!
//! Every perspective projection for wgpu's clip space (depth 0 to 1) writes clip z = `a w + b`. With near distance n and
//! far distance f: reversed, `a = -n / (f - n)` and `b = f n / (f - n)`, for an infinite f `a = 0` and `b = n`; forward,
//! `a = f / (f - n)` and `b = -f n / (f - n)`, for an infinite f `a = 1` and `b = -n`.

use crate::error::{Error, ErrorKind, Result};

/// Which way depth runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum DepthDirection {
    /// 1 at the near distance, falling with distance: a buffer is cleared to 0, and the greater depth is nearer.
    #[default]
    Reversed,
    /// 0 at the near distance, rising with distance: a buffer is cleared to 1, and the lesser depth is nearer.
    Forward,
}

/// Depth by distance along the view axis: `a + b / w`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Depth {
    a: f64,
    b: f64,
}

impl Depth {
    /// Reversed, without a far end: `near_m / w`.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] for a near distance that is not above 0, finite, and a normal f32.
    pub fn reversed(near_m: f64) -> Result<Self> {
        Self::from_terms(0.0, near_m)
    }

    /// From `near_m` to `far_m` (infinity for none) along the view axis.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] for distances that are no numbers, not above 0, or not in this order.
    pub fn new(direction: DepthDirection, near_m: f64, far_m: f64) -> Result<Self> {
        if !(near_m > 0.0 && near_m < far_m) {
            let what = format!("from {near_m} to {far_m} m there is no depth");
            return Err(Error::new(ErrorKind::Misuse, "projection", what).advice("use 0 < near < far"));
        }
        // n / (f - n), written so that an infinite f gives 0.
        let share = (near_m / far_m) / (1.0 - near_m / far_m);
        match direction {
            DepthDirection::Reversed => Self::from_terms(-share, near_m + near_m * share),
            DepthDirection::Forward => Self::from_terms(1.0 + share, -(near_m + near_m * share)),
        }
    }

    /// From the terms of clip z = `a w + b`.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] where these are no depths of f32: not finite, the same at all distances, or without a near
    /// distance ahead of the eye.
    pub fn from_terms(a: f64, b: f64) -> Result<Self> {
        let misuse = |what: String| Err(Error::new(ErrorKind::Misuse, "projection", what));
        // `+ 0.0` turns a -0 into 0.
        let depth = Self { a: a + 0.0, b };
        let normal = |v: f64| (v as f32).is_normal();
        if !(a.is_finite() && (a == 0.0 || normal(a)) && normal(b)) {
            return misuse(format!(
                "a clip z of {a} w + {b} is not a depth that falls or rises with distance"
            ));
        }
        if !(depth.near_m() > 0.0 && normal(depth.near_m())) {
            return misuse(format!(
                "a clip z of {a} w + {b} has no near distance; map depth to 0 to 1"
            ));
        }
        Ok(depth)
    }

    /// Which way it runs.
    pub fn direction(&self) -> DepthDirection {
        if self.b > 0.0 {
            DepthDirection::Reversed
        } else {
            DepthDirection::Forward
        }
    }

    /// The nearest distance that is drawn, in metres along the view axis.
    pub fn near_m(&self) -> f64 {
        match self.direction() {
            DepthDirection::Reversed => self.b / (1.0 - self.a),
            DepthDirection::Forward => -self.b / self.a,
        }
    }

    /// The farthest distance that is drawn, in metres along the view axis; infinity where there is none.
    pub fn far_m(&self) -> f64 {
        let far = match self.direction() {
            DepthDirection::Reversed => -self.b / self.a,
            DepthDirection::Forward => self.b / (1.0 - self.a),
        };
        if far > 0.0 { far } else { f64::INFINITY }
    }

    /// The terms a and b of clip z = `a w + b`.
    pub fn terms(&self) -> [f64; 2] {
        [self.a, self.b]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_and_far_are_where_depth_ends() {
        for direction in [DepthDirection::Reversed, DepthDirection::Forward] {
            for (near, far) in [(0.5, 4.0), (1.0, 1e9), (0.25, f64::INFINITY)] {
                let depth = Depth::new(direction, near, far).unwrap();
                assert_eq!(depth.direction(), direction);
                assert!((depth.near_m() / near - 1.0).abs() < 1e-12, "{depth:?}");
                let [a, b] = depth.terms();
                let ends = [a + b / near, a + b / far];
                let want = if direction == DepthDirection::Reversed {
                    [1.0, 0.0]
                } else {
                    [0.0, 1.0]
                };
                assert!(
                    (ends[0] - want[0]).abs() < 1e-12 && (ends[1] - want[1]).abs() < 1e-12,
                    "{depth:?}: {ends:?}"
                );
                // a and 1 - a are rounded where far is very far.
                let there = depth.far_m() == far || (depth.far_m() / far - 1.0).abs() < 1e-6;
                assert!(there, "{depth:?}: {} for {far}", depth.far_m());
            }
        }
        let infinite = Depth::reversed(0.125).unwrap();
        assert_eq!((infinite.terms(), infinite.near_m()), ([0.0, 0.125], 0.125));
        assert_eq!(
            infinite,
            Depth::new(DepthDirection::Reversed, 0.125, f64::INFINITY).unwrap()
        );
    }

    #[test]
    fn what_is_no_depth_is_refused() {
        let nan = f64::NAN;
        for (a, b) in [
            (nan, 1.0),
            (0.0, nan),
            (0.0, 0.0),
            (1.0, 0.0),
            (0.0, -1.0),
            (2.0, 1.0),
            (-1.0, -1.0),
            (0.0, 1e300),
            (0.0, 1e-300),
            (f64::INFINITY, 1.0),
        ] {
            let error = Depth::from_terms(a, b).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::Misuse, "{a} {b}");
        }
        for (near, far) in [(0.0, 1.0), (2.0, 1.0), (1.0, 1.0), (nan, 1.0), (1.0, nan)] {
            assert!(
                Depth::new(DepthDirection::Forward, near, far).is_err(),
                "{near} {far}"
            );
        }
    }
}
