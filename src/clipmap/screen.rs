//! What a vertical segment spans on the screen, bounded over all places of a box or of a triangle.
//!
//! A segment stands at horizontal distance h from the eye; one end P is seen at distance z along the view axis,
//! the other, Q, at most e metres above or below it. With u the unit vector up, s the signed length and W the axis (a
//! unit vector), the screen positions differ by `s (x, y) / (z (z + s W.u))`, where x and y are two products of the
//! shape `(X.P) (W.u) - (X.u) (W.P) = (X x W).(P x u)` and X is the row of clip x or y in pixels. The rows `X x W` map
//! what of `P x u` is at right angles to W to the screen, with f the greatest stretch of that map (the focal length in
//! pixels where pixels are square). `P x u` is horizontal and as long as h. Along W it is `P.(u x W) = c b`, with c the length of W', what of
//! W is horizontal, and b how far P is beside the vertical plane through the axis; as `h^2 = (P.W' / c)^2 + b^2` and
//! `c^2 + (W.u)^2 = 1`, what is left is `n^2 = h^2 - c^2 b^2 = (P.W')^2 + (W.u)^2 h^2`. So the segment spans at most
//!
//! `f e n / (z (z - e |W.u|))` pixels, infinite where the bracket is not positive, and n is at most h.
//!
//! *Over a box.* z is at least z0, the greater of the least value that `W.P` takes in the box and of a bound that the
//! caller knows; and where P is seen, at least kappa r, with r its distance and kappa the cosine of the widest angle
//! between the axis and a place of the picture. With y the least `|P.y|` in the box, r is at least `sqrt(h^2 + y^2)`. So
//! z is at least `Z(h) = max(z0, kappa sqrt(h^2 + y^2))`, which grows with h, over the h0 to h1 of the box. The least of
//! two bounds is taken:
//!
//! 1. `f e n / (z (z - e |W.u|)) <= f e (h / Z(h)^2) (Z(h0) / (Z(h0) - e |W.u|))`, as `z / (z - e |W.u|)` falls with z.
//!    `h / Z^2` rises while Z is z0 and while `h <= y`, and falls beyond both: its greatest value is at
//!    `max(y, sqrt((z0 / kappa)^2 - y^2))`, clamped to h0 to h1. It is good for what is large or near.
//! 2. `f e N / (Z(h0) (Z(h0) - e |W.u|))` with N the greatest n. n is the length of a linear function of P, thus convex:
//!    greatest at a corner. It is good for what is small for its distance, and to the picture's sides.
//!
//! *Over a triangle* the same, z0 the least of its corners' distances along the axis. What all lies outside one plane
//! of the frustum is not seen.
//!
//! *It nests.* For a box within another and an e not above the other's, h0, y, z0 are not below and h1, N and e not
//! above the other's: every factor is at most the other's, and if the other's e is g times as great the bounds are at least
//! g times as great. They are continuous in eye, rotation, box and e, and rise to infinity without a jump. The dial rests
//! on both.

use glam::DVec3;

use super::frustum::Frustum;
use super::near_of_m;
use crate::camera::View;
use crate::grid::Grid;

/// What of a view decides how long a vertical segment appears.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Screen {
    /// The greatest stretch from tangents to pixels: the focal length in pixels where pixels are square.
    focal_px: f64,
    /// The least stretch.
    least_focal_px: f64,
    /// Unit vector along the view axis: east, up, south.
    axis: DVec3,
    /// Cosine of the widest angle between the axis and what is seen.
    kappa: f64,
    /// Nearest drawn distance along the axis in metres.
    near_m: f64,
    frustum: Frustum,
}

/// A point as [`Screen`] sees it, in metres from the eye.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sight {
    point: DVec3,
    /// Along the view axis.
    away_m: f64,
    /// h, and n of the head of this file.
    level_m: f64,
    across_m: f64,
    /// A bit for each plane of the frustum that it lies outside of.
    outside: u8,
}

/// What the bounds go by, over the places of a box or triangle: the names of the head of this file.
struct Places {
    h: [f64; 2],
    y: f64,
    z0: f64,
    n: f64,
}

impl Screen {
    /// That of `view` over `grid`.
    pub fn new(view: &View, grid: &Grid) -> Self {
        let [x, y, axis] = view.clip_rows();
        let half_px = view.size_px.map(|s| f64::from(s) / 2.0);
        let (across, down) = (x.cross(axis) * half_px[0], y.cross(axis) * half_px[1]);
        // The eigenvalues of the rows' products with each other.
        let (aa, bb, ab) = (across.dot(across), down.dot(down), across.dot(down));
        let (mean, off) = ((aa + bb) / 2.0, ((aa - bb) / 2.0).hypot(ab));
        let [right, up, middle] = view.rays();
        let corners = [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)];
        let lengths = corners.map(|(a, b)| (right * a + up * b + middle).length());
        Self {
            focal_px: (mean + off).sqrt(),
            least_focal_px: (mean - off).max(0.0).sqrt(),
            axis,
            kappa: 1.0 / lengths.into_iter().fold(0.0, f64::max),
            near_m: near_of_m(view, grid),
            frustum: Frustum::new(view),
        }
    }

    /// An angle in radians that no pixel's side exceeds; infinite where pixels have no width.
    pub(super) fn widest_pixel(&self) -> f64 {
        1.0 / self.least_focal_px
    }

    /// All that is seen is drawn from this distance on, in metres from the eye; what is nearer may be cut away.
    pub(super) fn drawn_from_m(&self) -> f64 {
        self.near_m / self.kappa
    }

    /// The most pixels that a segment spans of which one end is *seen* in the box from `low` to `high` (metres east, up
    /// and south of the eye, as drawn) and the other is at most `error_m` above or below it.
    pub fn seen_px(&self, low: DVec3, high: DVec3, error_m: f64) -> f64 {
        if self.frustum.excludes(low, high) {
            return 0.0;
        }
        self.span_px(&self.of_box(low, high, self.near_m), error_m)
    }

    /// The same as if all directions were seen as the picture's corners are, and without a near plane: continuous in
    /// eye and rotation.
    pub fn nearby_px(&self, low: DVec3, high: DVec3, error_m: f64) -> f64 {
        self.span_px(&self.of_box(low, high, 0.0), error_m)
    }

    /// The same for an end that is seen on a triangle or any other hull of `corners`.
    pub(super) fn seen_among_px(&self, corners: &[Sight], error_m: f64) -> f64 {
        if corners.iter().fold(u8::MAX, |all, c| all & c.outside) != 0 {
            return 0.0;
        }
        let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (low, high) = corners
            .iter()
            .fold(start, |(low, high), c| (low.min(c.point), high.max(c.point)));
        let least = |of: fn(&Sight) -> f64| corners.iter().map(of).fold(f64::INFINITY, f64::min);
        let most = |of: fn(&Sight) -> f64| corners.iter().map(of).fold(0.0, f64::max);
        let nearest = |axis: usize| low[axis].max(-high[axis]).max(0.0);
        let places = Places {
            h: [nearest(0).hypot(nearest(2)), most(|c| c.level_m)],
            y: nearest(1),
            z0: least(|c| c.away_m).max(self.near_m),
            n: most(|c| c.across_m),
        };
        self.span_px(&places, error_m)
    }

    /// A point in metres east, up and south of the eye, as drawn.
    pub(super) fn sight(&self, point: DVec3) -> Sight {
        let level_m = point.x.hypot(point.z);
        Sight {
            point,
            away_m: self.axis.dot(point),
            level_m,
            across_m: self.across_m(point.x, point.z, level_m),
            outside: self.frustum.outside(point),
        }
    }

    /// n at a place east and south of the eye, of which h is known.
    fn across_m(&self, east: f64, south: f64, level_m: f64) -> f64 {
        (self.axis.x * east + self.axis.z * south).hypot(self.axis.y * level_m)
    }

    fn of_box(&self, low: DVec3, high: DVec3, least_m: f64) -> Places {
        let nearest = |axis: usize| low[axis].max(-high[axis]).max(0.0);
        let farthest = |axis: usize| high[axis].max(-low[axis]);
        let along = |axis: usize| match self.axis[axis] {
            0.0 => 0.0, // times an infinite extent it would be NaN
            a => (a * low[axis]).min(a * high[axis]),
        };
        let corners = [(low.x, low.z), (low.x, high.z), (high.x, low.z), (high.x, high.z)];
        let across = corners.map(|(x, z)| self.across_m(x, z, x.hypot(z)));
        Places {
            h: [nearest(0).hypot(nearest(2)), farthest(0).hypot(farthest(2))],
            y: nearest(1),
            z0: (along(0) + along(1) + along(2)).max(least_m),
            n: across.into_iter().fold(0.0, f64::max),
        }
    }

    fn span_px(&self, places: &Places, error_m: f64) -> f64 {
        if error_m == 0.0 {
            return 0.0;
        }
        let &Places {
            h: [h0, h1],
            y,
            z0,
            n,
        } = places;
        let z = |h: f64| z0.max(self.kappa * h.hypot(y));
        let lean_m = error_m * self.axis.y.abs();
        let first = z(h0);
        if !(first > lean_m && first > 0.0) {
            return f64::INFINITY;
        }
        let kink = ((z0 / self.kappa).powi(2) - y * y).max(0.0).sqrt();
        let h = kink.max(y).clamp(h0, h1);
        let z = z(h);
        let by_distance = (h / z) / z * (first / (first - lean_m));
        let by_place = (n / first) / (first - lean_m);
        self.focal_px * error_m * by_distance.min(by_place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::pyramid::random::Random;
    use glam::DMat4;

    fn grid() -> Grid {
        Grid::new(100, 100, [10.0, 10.0])
    }

    fn random_view(random: &mut Random) -> View {
        let camera = Camera {
            eye: DVec3::ZERO,
            heading_deg: random.between(0.0, 360.0),
            pitch_deg: random.between(-90.0, 90.0),
            roll_deg: random.between(-180.0, 180.0),
            fov_deg: random.between(5.0, 120.0),
        };
        View::new(camera, [160, 90]).unwrap()
    }

    /// Where a point lies on the screen in pixels; none where it is not before the camera.
    fn place(view: &View, p: DVec3) -> Option<[f64; 2]> {
        let [x, y, w] = view.clip_rows().map(|row| row.dot(p));
        let half = view.size_px.map(|s| f64::from(s) / 2.0);
        (w > 0.0).then(|| [x / w * half[0], y / w * half[1]])
    }

    /// The greatest measured span over the bound, for random boxes and segments of which one end is seen.
    fn worst_share(seed: u64, shrink: f64) -> (f64, u32) {
        let mut random = Random::new(seed);
        let (mut worst, mut seen) = (0.0f64, 0);
        for _ in 0..400 {
            let view = random_view(&mut random);
            let screen = Screen::new(&view, &grid());
            let near_m = near_of_m(&view, &grid());
            let at = |random: &mut Random| random.between(-300.0, 300.0);
            let low = DVec3::new(at(&mut random), at(&mut random), at(&mut random));
            let side = random.between(1.0, 200.0);
            let high = low + DVec3::new(side, random.between(0.0, 90.0), side);
            let error_m = random.between(0.0, 20.0);
            let bound = screen.seen_px(low, high, error_m * shrink);
            for _ in 0..100 {
                let t = DVec3::new(
                    random.between(0.0, 1.0),
                    random.between(0.0, 1.0),
                    random.between(0.0, 1.0),
                );
                let p = low + (high - low) * t;
                let q = p + DVec3::Y * error_m * random.between(-1.0, 1.0);
                let (Some(a), Some(b)) = (place(&view, p), place(&view, q)) else {
                    continue;
                };
                let inside = a[0].abs() <= 80.0 && a[1].abs() <= 45.0;
                if inside && view.clip_rows()[2].dot(p) >= near_m {
                    seen += 1;
                    worst = worst.max((a[0] - b[0]).hypot(a[1] - b[1]) / bound);
                }
            }
        }
        (worst, seen)
    }

    #[test]
    fn no_segment_spans_more_and_some_nearly_as_much() {
        let (worst, seen) = worst_share(1, 1.0);
        assert!(
            seen > 1000 && worst <= 1.0 + 1e-12 && worst > 0.7,
            "{worst} of {seen}"
        );
        let (worst, _) = worst_share(1, 0.5);
        assert!(worst > 1.0, "control: half of the error is caught: {worst}");
    }

    #[test]
    fn a_greater_box_with_a_greater_error_spans_as_many_times_more() {
        let mut random = Random::new(2);
        for _ in 0..2000 {
            let screen = Screen::new(&random_view(&mut random), &grid());
            let mut corner = || {
                DVec3::new(
                    random.between(-300.0, 300.0),
                    random.between(-300.0, 300.0),
                    random.between(-300.0, 300.0),
                )
            };
            let (a, b) = (corner(), corner());
            let (low, high) = (a.min(b), a.max(b));
            let [grow, error_m] = [random.between(0.0, 100.0), random.between(0.01, 9.0)];
            let inner = screen.nearby_px(low, high, error_m);
            let outer = screen.nearby_px(low - grow, high + grow * 0.5, 1.3 * error_m);
            assert!(outer >= 1.3 * inner * (1.0 - 1e-12), "{inner} in {outer}");
            assert!(screen.seen_px(low, high, error_m) <= inner * (1.0 + 1e-12));
        }
    }

    #[test]
    fn straight_ahead_it_is_focal_length_times_error_over_distance() {
        let camera = Camera {
            eye: DVec3::ZERO,
            heading_deg: 0.0,
            pitch_deg: 0.0,
            roll_deg: 0.0,
            fov_deg: 90.0,
        };
        let view = View::new(camera, [200, 100]).unwrap();
        let screen = Screen::new(&view, &grid());
        let p = DVec3::new(0.0, 0.0, -100.0);
        assert!((screen.seen_px(p, p, 2.0) - 50.0 * 2.0 / 100.0).abs() < 1e-12);
        let view = View::from_matrices(
            DMat4::IDENTITY,
            DMat4::from_cols_array(&[
                0.5, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.3, 0.1, 0.0, -1.0, 0.0, 0.0, 1.0, 0.0,
            ]),
            [200, 100],
        )
        .unwrap();
        let screen = Screen::new(&view, &grid());
        assert!((screen.focal_px - 50.0).abs() < 1e-12, "off the axis: {screen:?}");
        assert_eq!(screen.seen_px(p, p, 0.0), 0.0);
    }

    #[test]
    fn at_the_camera_plane_it_is_infinite_and_rises_to_that() {
        let camera = Camera {
            eye: DVec3::ZERO,
            heading_deg: 0.0,
            pitch_deg: -30.0,
            roll_deg: 0.0,
            fov_deg: 60.0,
        };
        let screen = Screen::new(&View::new(camera, [100, 100]).unwrap(), &grid());
        let around = DVec3::splat(10.0);
        assert_eq!(screen.nearby_px(-around, around, 1.0), f64::INFINITY);
        let p = DVec3::new(0.0, 0.0, -100.0);
        let reach_m = 100.0 * (30f64).to_radians().cos() / 0.5; // where e sin 30 is as much as the distance
        let mut last = 0.0;
        for share in [0.5, 0.9, 0.99, 0.999_999] {
            let px = screen.seen_px(p, p, reach_m * share);
            assert!(px > last && px.is_finite());
            last = px;
        }
        assert!(last > 1e5);
        assert_eq!(screen.seen_px(p, p, reach_m * 1.001), f64::INFINITY);
    }
}
