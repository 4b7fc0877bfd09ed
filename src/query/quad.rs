//! A quad of a surface: two triangles, split from its north-west to its south-east corner.

use glam::DVec3;

use crate::clipmap::{CORNERS, Corners};

/// One of the two triangles of a quad.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Triangle {
    /// North-west, south-west, south-east.
    SouthWest,
    /// North-west, south-east, north-east.
    NorthEast,
}

impl Triangle {
    /// The triangle that holds a place in a quad; the north-eastern one on the diagonal.
    pub fn holding([u, v]: [f64; 2]) -> Self {
        if u >= v { Self::NorthEast } else { Self::SouthWest }
    }
}

/// Heights at the corners of a quad, metres above the DEM's base; NaN for no data. Places in it are 0 to 1 from west to
/// east and from north to south.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quad {
    /// North-west.
    pub nw: f64,
    /// North-east.
    pub ne: f64,
    /// South-west.
    pub sw: f64,
    /// South-east.
    pub se: f64,
}

impl Quad {
    /// Quad (x, z) of a patch, each 0 to 7.
    pub(super) fn of(corners: &Corners, x: usize, z: usize) -> Self {
        let at = |x: usize, z: usize| f64::from(corners[z * CORNERS + x]);
        Self {
            nw: at(x, z),
            ne: at(x + 1, z),
            sw: at(x, z + 1),
            se: at(x + 1, z + 1),
        }
    }

    /// The height of `triangle` at a place in it; none where a corner that has weight there is void.
    pub fn height_in(&self, triangle: Triangle, [u, v]: [f64; 2]) -> Option<f64> {
        // The third corner of each triangle, and the weights of all three; never below 0 by rounding.
        let (third, weights) = match triangle {
            Triangle::SouthWest => (self.sw, [1.0 - v, (v - u).max(0.0), u]),
            Triangle::NorthEast => (self.ne, [1.0 - u, (u - v).max(0.0), v]),
        };
        let heights = [self.nw, third, self.se];
        let sum = heights[0] * weights[0] + heights[1] * weights[1] + heights[2] * weights[2];
        if !sum.is_nan() {
            return Some(sum);
        }
        let (mut sum, mut void) = (0.0, false);
        for (height, weight) in heights.into_iter().zip(weights) {
            if weight != 0.0 {
                void |= height.is_nan();
                sum += height * weight;
            }
        }
        (!void).then_some(sum)
    }

    /// The height at a place; none where a corner that has weight there is void.
    pub fn height(&self, at: [f64; 2]) -> Option<f64> {
        self.height_in(Triangle::holding(at), at)
    }

    /// The unit normal, upwards, of a triangle of a quad of level `level`; none where a corner of it is void.
    pub fn normal(&self, triangle: Triangle, level: u32, spacing_m: [f64; 2]) -> Option<DVec3> {
        let [east, south] = match triangle {
            Triangle::SouthWest => [self.se - self.sw, self.sw - self.nw],
            Triangle::NorthEast => [self.ne - self.nw, self.se - self.ne],
        };
        let step = (1i64 << level) as f64;
        let slope = |rise: f64, axis: usize| -rise / (spacing_m[axis] * step);
        let normal = DVec3::new(slope(east, 0), 1.0, slope(south, 1));
        (!normal.is_nan()).then(|| normal.normalize())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const QUAD: Quad = Quad {
        nw: 1.0,
        ne: 2.0,
        sw: 4.0,
        se: 8.0,
    };

    #[test]
    fn heights_are_linear_in_each_triangle() {
        for (at, want) in [
            ([0.0, 0.0], 1.0),
            ([1.0, 0.0], 2.0),
            ([0.0, 1.0], 4.0),
            ([1.0, 1.0], 8.0),
            ([0.5, 0.5], 4.5),
            ([0.75, 0.25], 0.25 + 0.5 * 2.0 + 0.25 * 8.0),
            ([0.25, 0.75], 0.25 + 0.5 * 4.0 + 0.25 * 8.0),
        ] {
            assert_eq!(QUAD.height(at), Some(want), "{at:?}");
        }
    }

    #[test]
    fn a_hole_begins_where_a_void_corner_has_weight() {
        let quad = Quad { sw: f64::NAN, ..QUAD };
        assert_eq!(quad.height([0.2, 0.3]), None);
        assert_eq!(quad.height([0.3, 0.2]), QUAD.height([0.3, 0.2]));
        assert_eq!(
            quad.height_in(Triangle::SouthWest, [0.5, 0.5]),
            Some(4.5),
            "the diagonal"
        );
        assert_eq!(quad.height([0.0, 1.0]), None);
        assert!(quad.normal(Triangle::SouthWest, 0, [1.0; 2]).is_none());
        assert!(quad.normal(Triangle::NorthEast, 0, [1.0; 2]).is_some());
    }

    #[test]
    fn normals_stand_on_their_triangles() {
        let spacing_m = [3.0, 5.0];
        let point = |x: f64, z: f64, h: f64| DVec3::new(x * 3.0 * 4.0, h, z * 5.0 * 4.0);
        let (nw, ne) = (point(0.0, 0.0, 1.0), point(1.0, 0.0, 2.0));
        let (sw, se) = (point(0.0, 1.0, 4.0), point(1.0, 1.0, 8.0));
        for (triangle, third) in [(Triangle::SouthWest, sw), (Triangle::NorthEast, ne)] {
            let normal = QUAD.normal(triangle, 2, spacing_m).unwrap();
            for edge in [third - nw, se - nw] {
                assert!(normal.dot(edge).abs() < 1e-12);
            }
            assert!(normal.y > 0.0 && (normal.length() - 1.0).abs() < 1e-15);
        }
    }
}
