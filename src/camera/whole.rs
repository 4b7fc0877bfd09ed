//! Cameras that show the whole DEM: one picture of it, and a flight around it.
//!
//! The DEM's box is `[0, (W-1) dx] x [min, max] x [0, (H-1) dz]`. A camera of fixed direction (axes right r,
//! up u, forward f) sees a point c from the eye e within its left and right edges where
//! `|(c - e).r| <= h (c - e).f`, with h the tangent of half the horizontal field of view; likewise up and down.
//! Over all corners these are linear bounds on e.r, e.u and e.f, so the closest such eye has a closed form.

use glam::{DMat3, DVec3};

use super::{Camera, Flight, Key};
use crate::grid::Grid;

/// Vertical field of view of these cameras, degrees.
const FOV_DEG: f64 = 45.0;

/// How far down the overview looks, degrees.
const OVERVIEW_PITCH_DEG: f64 = -35.0;

/// How far down the orbit looks, degrees.
const ORBIT_PITCH_DEG: f64 = -30.0;

/// Frames of an orbit, and frames a second.
const ORBIT_FRAMES: u32 = 120;
const ORBIT_FPS: f64 = 30.0;

/// The narrowest picture, width over height, in which an orbit keeps the whole DEM.
const ORBIT_ASPECT: f64 = 4.0 / 3.0;

/// The share of the frame that the box may fill in each direction.
const FILL: f64 = 0.94;

/// A camera that shows the whole DEM from the south, looking north and down, in a picture of `aspect` (width
/// over height, above 0 and finite).
///
/// `min_m` and `max_m` are the DEM's heights; where it has none (NaN), 0 m is taken. A DEM of one sample is
/// shown as if it were two samples wide.
pub fn overview(grid: &Grid, min_m: f64, max_m: f64, aspect: f64) -> Camera {
    let (low, high) = ground_box(grid, min_m, max_m);
    let camera = looking((low + high) / 2.0, 0.0, OVERVIEW_PITCH_DEG);
    let offset = closest([camera], low, high, aspect);
    Camera {
        eye: camera.eye + camera.axes() * offset,
        ..camera
    }
}

impl Flight {
    /// A circle around the DEM in 120 frames at 30 frames a second, looking at the vertical through its middle,
    /// with the whole DEM in every frame of pictures at least 4 : 3 wide. After the last frame comes the first
    /// again.
    ///
    /// It begins in the south and turns eastwards. Heights as in [`overview`].
    pub fn orbit(grid: &Grid, min_m: f64, max_m: f64) -> Self {
        let (low, high) = ground_box(grid, min_m, max_m);
        let cameras = (0..ORBIT_FRAMES).map(|k| {
            let heading_deg = 360.0 - 360.0 * f64::from(k) / f64::from(ORBIT_FRAMES);
            looking((low + high) / 2.0, heading_deg.rem_euclid(360.0), ORBIT_PITCH_DEG)
        });
        // One place behind the middle and above the line of sight, the same for all headings: a circle.
        let offset = closest(cameras.clone(), low, high, ORBIT_ASPECT).with_x(0.0);
        let keys = cameras.zip(0..).map(|(camera, k)| {
            let eye = camera.eye + camera.axes() * offset;
            Key::new(f64::from(k) / ORBIT_FPS, &Camera { eye, ..camera })
        });
        Self::new(ORBIT_FPS, keys.collect()).expect("times rise and the box is finite")
    }
}

/// How far right, up and forward cameras that stand in the middle of the box must move, all alike, to be as
/// close as they may with the whole box in their frames.
fn closest(cameras: impl IntoIterator<Item = Camera>, low: DVec3, high: DVec3, aspect: f64) -> DVec3 {
    let along = (FOV_DEG / 2.0).to_radians().tan() * FILL;
    let across = along * aspect;
    let relative = |camera: Camera| corners(low, high).map(move |c| seen(camera.axes(), c - camera.eye));
    let points: Vec<[f64; 3]> = cameras.into_iter().flat_map(relative).collect();
    // Least values of b in `e.r - across e.f >= b` and of its three siblings, relative to the middle.
    let mut bounds = [f64::NEG_INFINITY; 4];
    for &[right, up, forward] in &points {
        let here = [
            right - across * forward,
            -right - across * forward,
            up - along * forward,
            -up - along * forward,
        ];
        bounds = std::array::from_fn(|k| bounds[k].max(here[k]));
    }
    let [east, west, above, below] = bounds;
    let back = ((east + west) / (2.0 * across)).max((above + below) / (2.0 * along));
    let up = centred(&points, back, [above - along * back, along * back - below]);
    DVec3::new((east - west) / 2.0, up, -back)
}

/// How far up, within `range`, an eye that stands `back` behind must be for as much room above as below in its frame.
fn centred(points: &[[f64; 3]], back: f64, range: [f64; 2]) -> f64 {
    // Raising the eye lowers what it sees, so the difference falls and is halved down to where it changes sign.
    let excess_above = |eye_up: f64| {
        let slopes = points
            .iter()
            .map(|[_, up, forward]| (up - eye_up) / (forward + back));
        let (least, most) = slopes.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), s| {
            (a.min(s), b.max(s))
        });
        least + most
    };
    let [mut low, mut high] = range;
    for _ in 0..60 {
        let middle = low + (high - low) / 2.0;
        *(if excess_above(middle) > 0.0 {
            &mut low
        } else {
            &mut high
        }) = middle;
    }
    low + (high - low) / 2.0
}

fn looking(eye: DVec3, heading_deg: f64, pitch_deg: f64) -> Camera {
    Camera {
        eye,
        heading_deg,
        pitch_deg,
        roll_deg: 0.0,
        fov_deg: FOV_DEG,
    }
}

/// The DEM's box; never a point, so that there is a distance from which to see it.
fn ground_box(grid: &Grid, min_m: f64, max_m: f64) -> (DVec3, DVec3) {
    let [dx, dz] = grid.spacing_m;
    let (width, height) = (grid.size.width as f64 - 1.0, grid.size.height as f64 - 1.0);
    let finite = |v: f64| if v.is_finite() { v } else { 0.0 };
    let (min_m, max_m) = (finite(min_m), finite(max_m));
    let mut low = DVec3::new(0.0, min_m.min(max_m), 0.0);
    let mut high = DVec3::new(width * dx, min_m.max(max_m), height * dz);
    if width == 0.0 && height == 0.0 {
        low -= DVec3::new(dx, 0.0, dz) / 2.0;
        high += DVec3::new(dx, 0.0, dz) / 2.0;
    }
    (low, high)
}

fn corners(low: DVec3, high: DVec3) -> impl Iterator<Item = DVec3> {
    (0..8).map(move |k| {
        let pick = |bit: u32, low: f64, high: f64| if k >> bit & 1 == 0 { low } else { high };
        DVec3::new(
            pick(0, low.x, high.x),
            pick(1, low.y, high.y),
            pick(2, low.z, high.z),
        )
    })
}

/// `v` along the camera's right, up and forward.
fn seen(axes: DMat3, v: DVec3) -> [f64; 3] {
    (axes.transpose() * v).to_array()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Width, height, spacing, least and greatest height.
    const DEMS: [(i64, i64, [f64; 2], f64, f64); 11] = [
        (1201, 1201, [68.3, 92.6], 349.0, 3100.0),
        (1, 1, [30.0, 30.0], 512.0, 512.0),
        (1, 1, [30.0, 30.0], f64::NAN, f64::NAN),
        (1, 900, [30.0, 30.0], 0.0, 90.0),
        (900, 1, [30.0, 30.0], 7.0, 7.0),
        (257, 513, [1.0, 1.0], 0.0, 0.0),
        (64, 64, [1e-3, 1e-3], 0.0, 1e-30),
        (64, 64, [1e6, 1e6], -9e6, 9e6),
        (64, 64, [1.0, 1000.0], 1e7, 1e7 + 1.0),
        (100, 100, [30.0, 30.0], 0.0, 1e30),
        (1 << 20, 1 << 20, [30.0, 30.0], -85.0, 4404.0),
    ];

    /// The greatest |x| or |y| of the box's corners in the frame, in half frames; infinite behind the camera.
    fn extent(camera: &Camera, aspect: f64, low: DVec3, high: DVec3) -> f64 {
        let along = (camera.fov_deg / 2.0).to_radians().tan();
        let axes = camera.axes();
        let reach = corners(low, high).map(|corner| {
            let [right, up, forward] = seen(axes, corner - camera.eye);
            if forward <= 0.0 {
                return f64::INFINITY;
            }
            (right / (along * aspect * forward))
                .abs()
                .max((up / (along * forward)).abs())
        });
        reach.fold(0.0, f64::max)
    }

    #[test]
    fn an_overview_leaves_as_much_room_above_as_below() {
        let (width, height, spacing, min_m, max_m) = DEMS[0];
        let grid = Grid::new(width, height, spacing);
        let (low, high) = ground_box(&grid, min_m, max_m);
        let camera = overview(&grid, min_m, max_m, 16.0 / 9.0);
        let slopes = corners(low, high).map(|corner| {
            let [_, up, forward] = seen(camera.axes(), corner - camera.eye);
            up / forward
        });
        let (least, most) = slopes.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), s| {
            (a.min(s), b.max(s))
        });
        assert!((least + most).abs() < 1e-9 && most > 0.1, "{least} {most}");
    }

    #[test]
    fn an_overview_holds_all_corners_and_fills_the_frame() {
        for (width, height, spacing, min_m, max_m) in DEMS {
            let grid = Grid::new(width, height, spacing);
            let (low, high) = ground_box(&grid, min_m, max_m);
            for aspect in [
                0.002,
                0.1,
                0.5,
                0.75,
                1.0,
                4.0 / 3.0,
                16.0 / 9.0,
                2.4,
                10.0,
                512.0,
            ] {
                let camera = overview(&grid, min_m, max_m, aspect);
                camera.check().unwrap();
                let filled = extent(&camera, aspect, low, high);
                let what = format!("{width} x {height}, {min_m} to {max_m} m, aspect {aspect}: {filled}");
                assert!(filled <= 0.95, "{what}");
                assert!(filled >= 0.93, "too far away: {what}");
                let closer = Camera {
                    eye: camera.eye + 0.2 * ((low + high) / 2.0 - camera.eye),
                    ..camera
                };
                assert!(
                    extent(&closer, aspect, low, high) > 0.95,
                    "control, closer: {what}"
                );
            }
        }
    }

    #[test]
    fn an_overview_stands_in_the_south() {
        let camera = overview(&Grid::new(1201, 1201, [68.3, 92.6]), 349.0, 3100.0, 16.0 / 9.0);
        assert_eq!(
            (camera.heading_deg, camera.pitch_deg, camera.fov_deg),
            (0.0, -35.0, 45.0)
        );
        assert!(
            camera.eye.z > 1200.0 * 92.6 && camera.eye.y > 3100.0,
            "{}",
            camera.eye
        );
        assert!((camera.eye.x - 600.0 * 68.3).abs() < 1e-6, "{}", camera.eye);
    }

    #[test]
    fn an_orbit_keeps_the_whole_in_view_and_looks_at_the_middle() {
        for (width, height, spacing, min_m, max_m) in DEMS {
            let grid = Grid::new(width, height, spacing);
            let (low, high) = ground_box(&grid, min_m, max_m);
            let flight = Flight::orbit(&grid, min_m, max_m);
            assert_eq!(flight.frame_count(), 120);
            for aspect in [4.0 / 3.0, 16.0 / 9.0] {
                let mut widest = 0.0_f64;
                for k in 0..120 {
                    let camera = flight.camera_at_frame(k);
                    let filled = extent(&camera, aspect, low, high);
                    assert!(
                        filled <= 0.95,
                        "{width} x {height}, frame {k}, aspect {aspect}: {filled}"
                    );
                    widest = widest.max(filled);
                    let middle = (low + high) / 2.0;
                    let [right, _, forward] = seen(camera.axes(), middle - camera.eye);
                    assert!(
                        right.abs() < 1e-6 * forward,
                        "frame {k}: the middle is off the centre"
                    );
                }
                assert!(
                    widest >= 0.7,
                    "{width} x {height}, aspect {aspect}: fills only {widest}"
                );
            }
        }
    }

    #[test]
    fn an_orbit_closes_and_turns_evenly() {
        let flight = Flight::orbit(&Grid::new(1201, 1201, [68.3, 92.6]), 349.0, 3100.0);
        let eye = |k: u64| flight.camera_at_frame(k % 120).eye;
        let step = (eye(1) - eye(0)).length();
        for k in 0..120 {
            assert!(((eye(k + 1) - eye(k)).length() - step).abs() < 1e-6, "frame {k}");
        }
        assert!(eye(1).x > eye(0).x, "it turns eastwards from the south");
    }
}
