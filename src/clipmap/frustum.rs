//! Conservative culling: whether a box of terrain lies wholly outside what the camera sees.

use glam::DVec3;

use crate::camera::View;

/// The share of a box's extent by which it must lie outside a plane: far more than f32 loses of a position on its way
/// to the screen (a handful of roundings of 2^-24 each), so that culling never changes a picture.
const SLACK: f64 = 1e-5;

/// The planes of a view, in metres east, up and south of the eye.
#[derive(Clone, Copy, Debug)]
pub struct Frustum {
    /// Inward normals, and how far inside the eye is along each: the sides go through it, the near plane lies ahead.
    planes: [(DVec3, f64); 6],
}

impl Frustum {
    /// The frustum of a view.
    pub fn new(view: &View) -> Self {
        let [x, y, w] = view.clip_rows();
        // Without a depth of its own a view is cut at the DEM's near distance, which is next to nothing.
        let (near_m, far_m) = view
            .depth()
            .map_or((0.0, f64::INFINITY), |d| (d.near_m(), d.far_m()));
        Self {
            planes: [
                (w, -near_m),
                (w - x, 0.0),
                (w + x, 0.0),
                (w - y, 0.0),
                (w + y, 0.0),
                (-w, far_m),
            ],
        }
    }

    /// Whether the box from `low` to `high` (metres from the eye) is seen nowhere. Infinite extents are never outside
    /// by their infinite side.
    pub fn excludes(&self, low: DVec3, high: DVec3) -> bool {
        self.planes.iter().any(|&(normal, inside)| {
            let (mut inward, mut extent) = (inside, inside.abs());
            for axis in 0..3 {
                if normal[axis] == 0.0 {
                    continue; // 0 times an infinite extent would be NaN
                }
                inward += (normal[axis] * low[axis]).max(normal[axis] * high[axis]);
                extent += normal[axis].abs() * low[axis].abs().max(high[axis].abs());
            }
            inward < -SLACK * extent
        })
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
        let excludes = |(low, high)| frustum.excludes(low, high);
        assert!(!excludes(cube(0.0, -10.0)), "ahead");
        assert!(excludes(cube(0.0, 10.0)), "behind");
        assert!(excludes(cube(30.0, -10.0)), "to the right");
        assert!(excludes(cube(-30.0, -10.0)), "to the left");
        assert!(!excludes(cube(10.5, -10.0)), "across the right plane");
        assert!(!excludes(cube(0.0, 0.0)), "around the eye");
        let (mut low, mut high) = cube(0.0, -10.0);
        (low.y, high.y) = (f64::NEG_INFINITY, f64::INFINITY);
        assert!(!excludes((low, high)), "of unknown height ahead");
        let (mut low, mut high) = cube(0.0, 10.0);
        (low.y, high.y) = (f64::NEG_INFINITY, f64::INFINITY);
        assert!(excludes((low, high)), "of unknown height behind");
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
