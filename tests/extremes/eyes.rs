//! Extreme places of the eye: on a sample, an edge, the surface, below it, very high, very far, nowhere.

use clipscape::ErrorKind;
use clipscape::camera::{Camera, View};
use clipscape::clipmap::{Clipmap, displace};
use clipscape::grid::Grid;
use clipscape::pyramid::Pyramid;
use glam::DVec3;

use crate::harness::{Subject, camera, pyramid, rough, small, updated};
use crate::support::hills;

const SPACING_M: [f64; 2] = [10.0, 12.5];

fn terrain() -> Pyramid {
    pyramid(Grid::new(400, 333, SPACING_M), rough)
}

/// Every heading and pitch that matters from `eye`, `eye` in samples, metres and samples.
fn around(eye: [f64; 3]) -> Vec<Camera> {
    let eye = DVec3::new(eye[0] * SPACING_M[0], eye[1], eye[2] * SPACING_M[1]);
    [
        (0.0, -90.0),
        (45.0, -20.0),
        (180.0, 0.0),
        (270.0, 90.0),
        (123.4, -5.6),
    ]
    .map(|(heading, pitch)| camera(eye, heading, pitch))
    .to_vec()
}

#[test]
fn exactly_over_samples_edges_and_borders() {
    let levels = terrain();
    let mut cameras = Vec::new();
    for at in [
        [160.0, 128.0], // a sample of every level
        [161.0, 129.0], // of level 0 alone
        [160.5, 128.0], // on an edge
        [160.5, 128.5], // on a diagonal
        [0.0, 0.0],
        [399.0, 332.0], // the last sample
        [399.0, 0.0],
        [160.0, 332.0],
    ] {
        for above_m in [0.001, 40.0, 700.0] {
            let ground = f64::from(hills(0, at[0] as i64, at[1] as i64)) + 60.0;
            cameras.extend(around([at[0], ground + above_m, at[1]]));
        }
    }
    Subject::new("over", &levels).check(&cameras);
}

#[test]
fn on_the_surface_and_below_it() {
    let levels = pyramid(Grid::new(400, 333, SPACING_M), |i, j| hills(0, i, j));
    let mut cameras = Vec::new();
    for [i, j] in [[160, 128], [201, 77]] {
        let ground = f64::from(hills(0, i, j));
        for height in [ground, ground - 1e-9, ground - 30.0, ground - 5000.0] {
            cameras.extend(around([i as f64, height, j as f64]));
        }
    }
    Subject::new("on the ground", &levels).check(&cameras);
    let flat = pyramid(Grid::new(400, 333, SPACING_M), |_, _| 100.0);
    Subject::new("in the plane of level ground", &flat).check(&around([160.25, 100.0, 128.0]));
}

#[test]
fn a_million_kilometres_up() {
    let levels = terrain();
    let mut cameras = Vec::new();
    for height in [1e5, 1e9, -1e9, 1e12] {
        cameras.extend(around([200.0, height, 150.0]));
        cameras.extend(around([-3e4, height, 900.0]));
    }
    Subject::new("high up", &levels).check(&cameras);
}

#[test]
fn far_outside() {
    let levels = terrain();
    let mut cameras = Vec::new();
    for far in [1e3, 8e6, 9e6, 1e9, 1e15, 1e28] {
        for [x, z] in [[far, 150.0], [-far, -far], [200.0, far]] {
            cameras.extend(around([x, 300.0, z]));
        }
    }
    Subject::new("far outside", &levels).check(&cameras);
}

/// The greatest of `|from_eye - exact|`, over the exact distance, among the twin's vertices.
fn worst_place(clipmap: &Clipmap, eye: [f64; 2]) -> f64 {
    let mut worst = 0.0f64;
    for instance in clipmap.selection().instances() {
        for k in 0..81 {
            let vertex = displace(clipmap, instance, k % 9, k / 9);
            let last = clipmap.level_constants()[instance.level as usize].last;
            for axis in 0..2 {
                let corner = [k % 9, k / 9][axis];
                let index = i64::from((instance.origin[axis] + corner).min(last[axis])) << instance.level;
                let exact = index as f64 - eye[axis];
                let difference = (f64::from(vertex.from_eye[axis]) - exact).abs();
                if difference > 0.0 {
                    worst = worst.max(difference / exact.abs());
                }
            }
        }
    }
    worst
}

#[test]
fn a_far_eye_s_vertices_are_off_by_less_than_2_23_of_their_distance() {
    let levels = terrain();
    let mut worst = 0.0f64;
    for far in [8_388_608.0, 8_388_609.0, 8_389_100.5, 1e8 / 3.0, 1e12 / 7.0, 1e28] {
        for eye in [[far, -far], [-far, far], [-far / 3.0, far]] {
            let at = DVec3::new(eye[0] * SPACING_M[0], 500.0, eye[1] * SPACING_M[1]);
            // As the eye is known: metres over spacing.
            let eye = [at.x / SPACING_M[0], at.z / SPACING_M[1]];
            let view = View::new(camera(at, 0.0, 0.0), [48, 32]).unwrap();
            worst = worst.max(worst_place(&updated(&levels, &small(), &view), eye));
        }
    }
    println!(
        "far eye: places off by {:.3} of 2^-23 of their distance",
        worst * 2f64.powi(23)
    );
    assert!(worst > 0.0 && worst <= 2f64.powi(-23), "{worst}");
}

#[test]
fn an_eye_that_is_nowhere_is_refused() {
    let levels = terrain();
    let good = camera(DVec3::new(2000.0, 300.0, 2000.0), 0.0, -30.0);
    let view = View::new(good, [48, 32]).unwrap();
    let mut clipmap = Clipmap::new(&levels, &small()).unwrap();
    clipmap.update(&levels, &view, 0.0).unwrap();
    for axis in 0..3 {
        for nowhere in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let mut bad = good;
            bad.eye[axis] = nowhere;
            assert_eq!(View::new(bad, [48, 32]).unwrap_err().kind(), ErrorKind::Misuse);
            // Nor does a view get by whose fields were set.
            let mut view = view;
            view.eye[axis] = nowhere;
            assert_eq!(
                clipmap.update(&levels, &view, 0.0).unwrap_err().kind(),
                ErrorKind::Misuse
            );
        }
    }
    // What was refused left nothing behind.
    let again = clipmap.update(&levels, &view, 0.0).unwrap();
    assert!(again.complete && again.uploads == 0);
}

/// Finite, but beyond what f32 holds: refused, or drawn without a number that is none.
#[test]
fn an_eye_beyond_f32_is_refused() {
    let levels = terrain();
    for eye in [
        DVec3::new(1e300, 0.0, 0.0),
        DVec3::new(0.0, 1e300, 0.0),
        DVec3::new(0.0, -1e39, 0.0),
        DVec3::new(0.0, 0.0, -1e60),
    ] {
        let view = View::new(camera(eye, 0.0, 0.0), [48, 32]);
        assert_eq!(view.unwrap_err().kind(), ErrorKind::Misuse, "{eye}");
    }
    let eye = DVec3::new(1e31, -1e31, 1e31);
    Subject::new("the farthest", &levels).check(&[camera(eye, 225.0, 35.0)]);
}
