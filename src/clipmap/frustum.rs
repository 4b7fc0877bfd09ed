//! Conservative culling: whether a box of terrain lies wholly outside what the camera sees.

use glam::DVec3;

use crate::camera::View;

/// The share of a box's extent by which it must lie outside a plane: far more than f32 loses of a position on its way
/// to the screen (a handful of roundings of 2^-24 each), so that culling never changes a picture. The extent is that of the
/// two clip coordinates that the plane compares: what cancels between them is rounded all the same.
const SLACK: f64 = 1e-5;

/// The planes of a view, in metres east, up and south of the eye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frustum {
    /// The sides go through the eye, the near plane lies ahead.
    planes: [Plane; 6],
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Plane {
    /// Inward.
    normal: DVec3,
    /// What a step along each axis may add to the two clip coordinates that it compares.
    extent: DVec3,
    /// How far inside the eye is along the normal.
    inside: f64,
}

impl Frustum {
    /// The frustum of a view.
    pub fn new(view: &View) -> Self {
        let [x, y, w] = view.clip_rows();
        // Without a depth of its own a view is cut at the DEM's near distance, which is next to nothing.
        let (near_m, far_m) = view
            .depth()
            .map_or((0.0, f64::INFINITY), |d| (d.near_m(), d.far_m()));
        let plane = |normal: DVec3, other: DVec3, inside| Plane {
            normal: normal + other,
            extent: normal.abs() + other.abs(),
            inside,
        };
        Self {
            planes: [
                plane(w, DVec3::ZERO, -near_m),
                plane(w, -x, 0.0),
                plane(w, x, 0.0),
                plane(w, -y, 0.0),
                plane(w, y, 0.0),
                plane(-w, DVec3::ZERO, far_m),
            ],
        }
    }

    /// A bit for each plane.
    pub(super) const ALL: u8 = (1 << 6) - 1;

    /// Whether the box from `low` to `high` (metres from the eye) is seen nowhere. Infinite extents are never outside
    /// by their infinite side.
    pub fn excludes(&self, low: DVec3, high: DVec3) -> bool {
        self.cutting(low, high, Self::ALL).is_none()
    }

    /// Which of `planes` (a bit for each) cut through the box from `low` to `high`: those that it is not wholly inside
    /// of. What lies within a box is cut by no other planes than it. None where the box is seen nowhere.
    pub(super) fn cutting(&self, low: DVec3, high: DVec3, planes: u8) -> Option<u8> {
        let mut cutting = 0;
        for (k, plane) in self
            .planes
            .iter()
            .enumerate()
            .filter(|(k, _)| planes >> k & 1 == 1)
        {
            let (mut most, mut extent) = (plane.inside, plane.inside.abs());
            let mut least = plane.inside;
            for axis in 0..3 {
                if plane.extent[axis] == 0.0 {
                    continue; // 0 times an infinite extent would be NaN
                }
                extent += plane.extent[axis] * low[axis].abs().max(high[axis].abs());
                if plane.normal[axis] != 0.0 {
                    let ends = [plane.normal[axis] * low[axis], plane.normal[axis] * high[axis]];
                    most += ends[0].max(ends[1]);
                    least += ends[0].min(ends[1]);
                }
            }
            if most < -SLACK * extent {
                return None;
            }
            cutting |= u8::from(least.is_nan() || least < 0.0) << k;
        }
        Some(cutting)
    }

    /// A bit for each plane that a point lies outside of, by the same share of its own extent. What hangs together
    /// between points that lie outside one plane is seen nowhere: inwardness is linear, and their extents add up to at
    /// least its own.
    pub(super) fn outside(&self, point: DVec3) -> u8 {
        let bit = |(k, plane): (usize, &Plane)| {
            let extent = plane.inside.abs() + plane.extent.dot(point.abs());
            u8::from(plane.normal.dot(point) + plane.inside < -SLACK * extent) << k
        };
        self.planes.iter().enumerate().map(bit).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Camera, Depth, DepthDirection};

    #[test]
    fn boxes_beside_behind_and_inside() {
        let camera = Camera {
            eye: DVec3::ZERO,
            heading_deg: 0.0,
            pitch_deg: 0.0,
            roll_deg: 0.0,
            fov_deg: 90.0,
        };
        let frustum = Frustum::new(&View::new(camera, [100, 100]).unwrap());
        let cube = |x: f64, z: f64| {
            (
                DVec3::new(x - 1.0, -1.0, z - 1.0),
                DVec3::new(x + 1.0, 1.0, z + 1.0),
            )
        };
        let excludes = |(low, high): (DVec3, DVec3)| {
            let ends = |k: usize, bit: usize| if k >> bit & 1 == 0 { low } else { high };
            let corners = (0..8).map(|k| DVec3::new(ends(k, 0).x, ends(k, 1).y, ends(k, 2).z));
            let all = corners.map(|c| frustum.outside(c)).fold(u8::MAX, |a, b| a & b);
            assert_eq!(all != 0, frustum.excludes(low, high), "{low} to {high}");
            frustum.excludes(low, high)
        };
        assert!(!excludes(cube(0.0, -10.0)), "ahead");
        assert!(excludes(cube(0.0, 10.0)), "behind");
        assert!(excludes(cube(30.0, -10.0)), "to the right");
        assert!(excludes(cube(-30.0, -10.0)), "to the left");
        assert!(!excludes(cube(10.5, -10.0)), "across the right plane");
        assert!(!excludes(cube(0.0, 0.0)), "around the eye");
        // Turned by half its field of view a plane is level, but for what cancels.
        let camera = Camera {
            pitch_deg: -30.0,
            fov_deg: 60.0,
            ..camera
        };
        let tilted = Frustum::new(&View::new(camera, [100, 100]).unwrap());
        let on_it = DVec3::new(0.0, 0.0, -100.0);
        assert!(!tilted.excludes(on_it, on_it), "on a plane that cancels");
        assert!(tilted.excludes(on_it + DVec3::Y, on_it + DVec3::Y), "above it");
        let (mut low, mut high) = cube(0.0, -10.0);
        (low.y, high.y) = (f64::NEG_INFINITY, f64::INFINITY);
        assert!(!frustum.excludes(low, high), "of unknown height ahead");
        let (mut low, mut high) = cube(0.0, 10.0);
        (low.y, high.y) = (f64::NEG_INFINITY, f64::INFINITY);
        assert!(frustum.excludes(low, high), "of unknown height behind");
    }

    #[test]
    fn boxes_before_the_near_and_behind_the_far_plane() {
        let camera = Camera {
            eye: DVec3::ZERO,
            heading_deg: 0.0,
            pitch_deg: 0.0,
            roll_deg: 0.0,
            fov_deg: 90.0,
        };
        let view = View::new(camera, [100, 100]).unwrap();
        for direction in [DepthDirection::Reversed, DepthDirection::Forward] {
            let frustum = Frustum::new(&view.with_depth(Depth::new(direction, 20.0, 50.0).unwrap()));
            let at = |z: f64| {
                frustum.excludes(
                    DVec3::new(-1.0, -1.0, z - 1.0),
                    DVec3::new(1.0, f64::INFINITY, z + 1.0),
                )
            };
            assert!(at(-18.5) && at(-51.5) && at(10.0), "{direction:?}");
            assert!(!at(-19.5) && !at(-30.0) && !at(-50.5), "{direction:?}");
        }
    }
}
