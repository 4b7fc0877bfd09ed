//! What a vertical segment spans on the screen, bounded over all places of a box.
//!
//! A segment stands at horizontal distance h from the eye; one end P lies in the box at distance z along the view axis,
//! the other, Q, at most e metres above or below it. With u the unit vector up, s the signed length and W the axis (a
//! unit vector), the screen positions differ by `s (x, y) / (z (z + s W.u))`, where x and y are two products of the
//! shape `(X.P) (W.u) - (X.u) (W.P) = (X x W).(P x u)` and X is the row of clip x or y in pixels. `P x u` is horizontal
//! and as long as h. The rows `X x W` map it to the screen; with f the greatest stretch of that map (the focal length
//! in pixels where pixels are square) the segment spans at most
//!
//! `f e h / (z (z - e |W.u|))` pixels, infinite where the bracket is not positive.
//!
//! *Over a box.* z is at least z0, the greater of the least value that `W.P` takes in the box and of a bound that the
//! caller knows; and where P is seen, at least kappa r, with r its distance and kappa the cosine of the widest angle
//! between the axis and a place of the picture. With y the least `|P.y|` in the box, r is at least `sqrt(h^2 + y^2)`. So
//! z is at least `Z(h) = max(z0, kappa sqrt(h^2 + y^2))`, which grows with h, over the h0 to h1 of the box:
//!
//! `f e h / (z (z - e |W.u|)) <= f e (h / Z(h)^2) (Z(h0) / (Z(h0) - e |W.u|))`,
//!
//! as `z / (z - e |W.u|)` falls with z. `h / Z^2` rises while Z is z0 and while `h <= y`, and falls beyond both: its
//! greatest value is at `max(y, sqrt((z0 / kappa)^2 - y^2))`, clamped to h0 to h1.
//!
//! *It nests.* For a box within another and an e not above the other's, h0, y, z0 are not below and h1 and e not above
//! the other's: every factor is at most the other's, and if the other's e is g times as great the bound is at least g
//! times as great. It is continuous in eye, rotation, box and e, and rises to infinity without a jump. The dial rests
//! on both.

use glam::DVec3;

use super::near_of_m;
use crate::camera::View;
use crate::grid::Grid;

/// What of a view decides how long a vertical segment appears.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Screen {
    /// The greatest stretch from tangents to pixels: the focal length in pixels where pixels are square.
    focal_px: f64,
    /// Unit vector along the view axis: east, up, south.
    axis: DVec3,
    /// Cosine of the widest angle between the axis and what is seen.
    kappa: f64,
    /// Nearest drawn distance along the axis in metres.
    near_m: f64,
}

impl Screen {
    /// That of `view` over `grid`.
    pub fn new(view: &View, grid: &Grid) -> Self {
        let [x, y, axis] = view.clip_rows();
        let half_px = view.size_px.map(|s| f64::from(s) / 2.0);
        let (across, down) = (x.cross(axis) * half_px[0], y.cross(axis) * half_px[1]);
        // The greatest eigenvalue of the rows' products with each other.
        let (aa, bb, ab) = (across.dot(across), down.dot(down), across.dot(down));
        let greatest = (aa + bb) / 2.0 + ((aa - bb) / 2.0).hypot(ab);
        let [right, up, middle] = view.rays();
        let corners = [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)];
        let lengths = corners.map(|(a, b)| (right * a + up * b + middle).length());
        Self {
            focal_px: greatest.sqrt(),
            axis,
            kappa: 1.0 / lengths.into_iter().fold(0.0, f64::max),
            near_m: near_of_m(view, grid),
        }
    }

    /// The most pixels that a segment spans of which one end is *seen* in the box from `low` to `high` (metres east, up
    /// and south of the eye, as drawn) and the other is at most `error_m` above or below it.
    pub fn seen_px(&self, low: DVec3, high: DVec3, error_m: f64) -> f64 {
        self.span_px(low, high, error_m, self.near_m)
    }

    /// The same as if all directions were seen as the picture's corners are, and without a near plane: continuous in
    /// eye and rotation.
    pub fn nearby_px(&self, low: DVec3, high: DVec3, error_m: f64) -> f64 {
        self.span_px(low, high, error_m, 0.0)
    }

    fn span_px(&self, low: DVec3, high: DVec3, error_m: f64, least_m: f64) -> f64 {
        if error_m == 0.0 {
            return 0.0;
        }
        let nearest = |axis: usize| low[axis].max(-high[axis]).max(0.0);
        let farthest = |axis: usize| high[axis].max(-low[axis]);
        let along = |axis: usize| match self.axis[axis] {
            0.0 => 0.0, // times an infinite extent it would be NaN
            a => (a * low[axis]).min(a * high[axis]),
        };
        let (h0, h1) = (nearest(0).hypot(nearest(2)), farthest(0).hypot(farthest(2)));
        let y = nearest(1);
        let z0 = (along(0) + along(1) + along(2)).max(least_m);
        let z = |h: f64| z0.max(self.kappa * h.hypot(y));
        let lean_m = error_m * self.axis.y.abs();
        let first = z(h0);
        if !(first > lean_m && first > 0.0) {
            return f64::INFINITY;
        }
        let kink = ((z0 / self.kappa).powi(2) - y * y).max(0.0).sqrt();
        let h = kink.max(y).clamp(h0, h1);
        let z = z(h);
        self.focal_px * error_m * (h / z) / z * (first / (first - lean_m))
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
