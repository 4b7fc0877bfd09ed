//! The shipped flight over the shipped DEM keeps what `data/README.md` says of it.

use clipscape::camera::Flight;
use glam::DVec3;

/// Metres between columns and rows of the tile at its middle, 42.5 degrees north, on WGS84.
const SPACING_M: [f64; 2] = [68.5, 92.57];
const SIDE: i64 = 1201;
const VOID: i16 = -32768;

fn heights() -> Vec<i16> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/data/N42E001.hgt");
    let bytes = std::fs::read(path).expect("the DEM is shipped");
    bytes
        .chunks_exact(2)
        .map(|b| i16::from_be_bytes([b[0], b[1]]))
        .collect()
}

fn flight() -> Flight {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/data/pyrenees.json");
    let json = std::fs::read_to_string(path).expect("the flight is shipped");
    Flight::parse("data/pyrenees.json", &json).expect("the flight is one")
}

/// Metres from the highest valid sample within `around_m` (in both axes) up to `eye`.
fn clearance_m(heights: &[i16], eye: DVec3, around_m: f64) -> f64 {
    let span = |at: f64, spacing: f64| {
        ((at - around_m) / spacing).floor() as i64..=((at + around_m) / spacing).ceil() as i64
    };
    let mut highest = f64::NEG_INFINITY;
    for row in span(eye.z, SPACING_M[1]) {
        for column in span(eye.x, SPACING_M[0]) {
            assert!(
                (0..SIDE).contains(&row) && (0..SIDE).contains(&column),
                "the eye leaves the DEM at {eye}"
            );
            let height = heights[(row * SIDE + column) as usize];
            if height != VOID {
                highest = highest.max(f64::from(height));
            }
        }
    }
    eye.y - highest
}

#[test]
fn it_has_120_frames_above_the_ground_and_below_its_speed() {
    let (flight, heights) = (flight(), heights());
    assert_eq!(flight.frame_count(), 120);
    let mut least_m = f64::INFINITY;
    for k in 0..120 {
        let camera = flight.camera_at_frame(k);
        least_m = least_m.min(clearance_m(&heights, camera.eye, 300.0));
        if k > 0 {
            let before = flight.camera_at_frame(k - 1);
            let speed = camera.eye.distance(before.eye) * 30.0;
            let turned = camera
                .axes()
                .col(2)
                .angle_between(before.axes().col(2))
                .to_degrees()
                * 30.0;
            assert!(speed < 2100.0, "frame {k}: {speed} m/s");
            assert!(turned < 43.0, "frame {k}: {turned} degrees a second");
        }
    }
    assert!(
        (126.0..150.0).contains(&least_m),
        "{least_m} m above the ground at the lowest"
    );
    let sunk = flight.camera_at_frame(67).eye - DVec3::Y * 200.0;
    assert!(
        clearance_m(&heights, sunk, 300.0) < 0.0,
        "control: 200 m lower it hits the ground"
    );
}

#[test]
fn it_shows_high_and_low_and_climbs() {
    let (flight, heights) = (flight(), heights());
    let above = |k: u64| clearance_m(&heights, flight.camera_at_frame(k).eye, 0.0);
    assert!(
        above(0) > 1500.0 && above(119) > 700.0,
        "{} and {} m at the ends",
        above(0),
        above(119)
    );
    let low = (0..120).filter(|&k| above(k) < 600.0).count();
    assert!(low >= 30, "{low} frames of low pass");
}
