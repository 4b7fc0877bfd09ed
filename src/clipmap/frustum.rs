//! Conservative culling: whether a box of terrain lies wholly outside what the camera sees.

use glam::DVec3;

use crate::camera::View;

/// The share of a box's extent by which it must lie outside a plane: far more than f32 loses of a position on its way
/// to the screen (a handful of roundings of 2^-24 each), so that culling never changes a picture.
const SLACK: f64 = 1e-5;

/// The planes of a view, all through the eye, in metres east, up and south of it.
#[derive(Clone, Copy, Debug)]
pub struct Frustum {
    /// Inward normals.
    planes: [DVec3; 5],
}

impl Frustum {
    /// The frustum of a view.
    pub fn new(view: &View) -> Self {
        let [x, y, w] = view.clip_rows();
        Self {
            planes: [w, w - x, w + x, w - y, w + y],
        }
    }

    /// Whether the box from `low` to `high` (metres from the eye) is seen nowhere. Infinite extents are never outside
    /// by their infinite side.
    pub fn excludes(&self, low: DVec3, high: DVec3) -> bool {
        self.planes.iter().any(|&normal| {
            let (mut inward, mut extent) = (0.0, 0.0);
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
    use crate::camera::Camera;

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
}
