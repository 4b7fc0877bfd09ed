//! The eye as the clipmap knows it: an integer sample and a fraction, so that nothing on the GPU is absolute.

use glam::DVec3;

use crate::grid::Grid;

/// An eye farther than this many samples from the DEM is anchored at the DEM's nearest sample, so that indices from the
/// anchor stay exact in f32. Its fraction is then the whole distance, rounded to f32 once, and so is every position's
/// difference from it: each position is off by at most `2^-23` of its distance, which is less than a thousandth of a
/// pixel in any picture of at most 8192 pixels with a field of view above 1 degree.
const FAR_SAMPLES: f64 = (1i64 << 23) as f64;

/// The eye in samples of level 0 and metres above the DEM's base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eye {
    /// The sample of level 0 to whose south-east the eye lies, in the DEM's own indices.
    pub anchor: [i64; 2],
    /// What remains, in samples: 0 to 1, unless the eye is very far from the DEM.
    pub fraction: [f64; 2],
    /// Height in metres above the DEM's base, before vertical scale.
    pub height_m: f64,
}

impl Eye {
    /// The eye at `position`, in world metres before vertical scale, over `grid`.
    pub fn new(position: DVec3, grid: &Grid) -> Self {
        let axis = |metres: f64, spacing_m: f64, samples: i64| {
            let at = metres / spacing_m;
            let nearest = at.clamp(0.0, (samples - 1) as f64);
            let anchor = if (at - nearest).abs() > FAR_SAMPLES {
                nearest
            } else {
                at.floor()
            };
            (anchor as i64, at - anchor)
        };
        let x = axis(position.x, grid.spacing_m[0], grid.size.width);
        let z = axis(position.z, grid.spacing_m[1], grid.size.height);
        Self {
            anchor: [x.0, z.0],
            fraction: [x.1, z.1],
            height_m: position.y - grid.base_m,
        }
    }

    /// The eye's position in samples of level 0, east and south of sample (0, 0).
    pub fn samples(&self) -> [f64; 2] {
        [
            self.anchor[0] as f64 + self.fraction[0],
            self.anchor[1] as f64 + self.fraction[1],
        ]
    }

    /// Where the eye will be in `ahead_s` seconds, if it goes on as it has since it was at `last`, in samples of level 0,
    /// `passed_s` seconds ago; where it is, if no time has passed. Heights stay.
    pub(super) fn ahead(&self, last: [f64; 2], passed_s: f64, ahead_s: f64) -> Self {
        let mut eye = *self;
        if passed_s > 0.0 {
            for (axis, at) in self.samples().into_iter().enumerate() {
                let moved = (at - last[axis]) / passed_s * ahead_s;
                let there = (at + moved).clamp(-FAR_SAMPLES * 256.0, FAR_SAMPLES * 256.0);
                (eye.anchor[axis], eye.fraction[axis]) = (there.floor() as i64, there - there.floor());
            }
        }
        eye
    }

    /// The height as the sum of two f32, so that heights near it subtract without loss.
    pub fn height_high_low(&self) -> [f32; 2] {
        let high = self.height_m as f32;
        [high, (self.height_m - f64::from(high)) as f32]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn eye(x: f64, z: f64) -> Eye {
        Eye::new(DVec3::new(x, 7.5, z), &Grid::new(100, 50, [2.0, 4.0]))
    }

    #[test]
    fn anchor_and_fraction_make_up_the_position() {
        let e = eye(-3.0, 9.0);
        assert_eq!((e.anchor, e.fraction), ([-2, 2], [0.5, 0.25]));
        assert_eq!(e.samples(), [-1.5, 2.25]);
    }

    #[test]
    fn a_far_eye_is_anchored_at_the_nearest_sample() {
        let e = eye(1e30, -1e30);
        assert_eq!(e.anchor, [99, 0]);
        assert!(e.fraction[0] > 1e29 && e.fraction[1] < -1e29);
        let e = eye(2.0 * (FAR_SAMPLES + 99.0), -4.0 * FAR_SAMPLES);
        assert_eq!(
            (e.anchor, e.fraction),
            ([99 + (1 << 23), -(1 << 23)], [0.0, 0.0]),
            "the last that are near"
        );
    }

    #[test]
    fn an_eye_goes_on_as_it_went() {
        let e = eye(20.0, 40.0);
        let last = [9.0, 10.0];
        assert_eq!(e.ahead(last, 0.5, 1.0).samples(), [12.0, 10.0]);
        assert_eq!(e.ahead(last, 0.0, 1.0), e);
    }

    #[test]
    fn heights_split_without_loss_of_what_f32_can_show() {
        let mut e = eye(0.0, 0.0);
        e.height_m = 1e7 + 0.123_456_789;
        let [high, low] = e.height_high_low();
        assert!((f64::from(high) + f64::from(low) - e.height_m).abs() < 1e-8);
    }
}
