//! Extreme views and parameters: fields of view, angles, pictures, clip sizes, levels, transitions, vertical scales.

use clipscape::ErrorKind;
use clipscape::camera::{Camera, View};
use clipscape::clipmap::{ClipmapOptions, Ring};
use clipscape::grid::Grid;
use clipscape::pyramid::Pyramid;
use glam::DVec3;

use crate::harness::{Subject, camera, pyramid, rough, small, unfit_numbers, updated};

fn terrain() -> Pyramid {
    pyramid(Grid::new(500, 380, [10.0, 10.0]), rough)
}

fn eyes() -> [DVec3; 3] {
    [
        DVec3::new(2003.0, 300.0, 1901.0),
        DVec3::new(2490.0, 2600.0, 1900.0),
        DVec3::new(100.0, 90.0, 3700.0),
    ]
}

#[test]
fn fields_of_view_pitches_and_rolls() {
    let levels = terrain();
    let mut cameras = Vec::new();
    for eye in eyes() {
        for fov_deg in [0.01, 1.0, 90.0, 179.0, 179.99] {
            for (heading_deg, pitch_deg, roll_deg) in [
                (0.0, -90.0, 0.0),
                (77.0, 90.0, 0.0),
                (33.0, -12.0, 90.0),
                (190.0, -45.0, 180.0),
                (281.0, -3.0, -77.7),
            ] {
                cameras.push(Camera {
                    eye,
                    heading_deg,
                    pitch_deg,
                    roll_deg,
                    fov_deg,
                });
            }
        }
    }
    Subject::new("views", &levels).check(&cameras);
}

#[test]
fn pictures_of_a_pixel_and_of_a_line() {
    let levels = terrain();
    let cameras = eyes().map(|eye| camera(eye, 60.0, -20.0));
    for size_px in [[1, 1], [8192, 16], [16, 8192], [1, 64], [3, 1]] {
        let mut subject = Subject::new(format!("{size_px:?} pixels"), &levels);
        subject.size_px = size_px;
        let drawn = subject.check(&cameras);
        assert!(
            drawn.is_none_or(|d| d.iter().any(|pixels| *pixels > 0)),
            "{size_px:?}"
        );
    }
}

#[test]
fn clip_sizes_levels_and_transitions() {
    let levels = terrain();
    let cameras = eyes().map(|eye| camera(eye, 60.0, -20.0));
    for clip_size in [64, 256] {
        for levels_kept in [None, Some(1), Some(2)] {
            for transition in [0, 1, Ring::transition_limit(clip_size)] {
                let mut subject = Subject::new("", &levels);
                subject.options = ClipmapOptions {
                    clip_size,
                    levels: levels_kept,
                    transition: Some(transition),
                    ..subject.options
                };
                subject.what = format!("{:?}", subject.options);
                subject.check(&cameras);
            }
        }
    }
}

#[test]
fn the_greatest_clip_size() {
    let levels = pyramid(Grid::new(2200, 90, [10.0, 10.0]), rough);
    let cameras = [
        camera(DVec3::new(2003.0, 300.0, 401.0), 60.0, -20.0),
        camera(DVec3::new(21_000.0, 900.0, 401.0), 270.0, -30.0),
    ];
    let mut subject = Subject::new("clip size 2048", &levels);
    subject.options = ClipmapOptions {
        clip_size: 2048,
        transition: Some(Ring::transition_limit(2048)),
        ..subject.options
    };
    let drawn = subject.check(&cameras);
    assert!(drawn.is_none_or(|d| d.iter().all(|pixels| *pixels > 100)));
}

#[test]
fn vertical_scales() {
    let levels = terrain();
    for vertical_scale in [0.0, 1000.0, -1.0, -3.0, 1e-3, -1000.0] {
        let mut subject = Subject::new(format!("vertical scale {vertical_scale}"), &levels);
        subject.options.vertical_scale = vertical_scale;
        let cameras = eyes().map(|eye| camera(eye, 60.0, -20.0));
        let upward = eyes().map(|eye| camera(eye, 240.0, 35.0));
        subject.check(&cameras);
        subject.check(&upward);
    }
}

#[test]
fn vertical_scales_beyond_f32_are_refused() {
    for vertical_scale in [f64::NAN, f64::INFINITY, -1e37, 1e300] {
        let options = ClipmapOptions {
            vertical_scale,
            ..small()
        };
        assert_eq!(
            options.check().unwrap_err().kind(),
            ErrorKind::Misuse,
            "{vertical_scale}"
        );
    }
}

#[test]
fn control_numbers_that_are_not_finite_are_seen() {
    let levels = terrain();
    let view = View::new(camera(eyes()[0], 60.0, -20.0), [48, 32]).unwrap();
    let mut clipmap = updated(&levels, &small(), &view);
    assert!(unfit_numbers(&clipmap).is_empty());
    clipmap.frame_mut().0.vertical_scale = 1e37;
    assert!(!unfit_numbers(&clipmap).is_empty());
}

/// The check of pictures must see colours that are no number or none of a picture.
#[cfg(feature = "gpu")]
#[test]
fn control_colours_that_are_no_number_are_seen() {
    let Some(gpu) = crate::support::gpu() else { return };
    let levels = terrain();
    let mut headless = crate::draw::headless(&gpu, &levels, &crate::draw::options([48, 32]));
    let picture = crate::draw::frame(&mut headless, &levels, &camera(eyes()[0], 60.0, 0.0));
    let beside = 48 * 32 - picture.terrain_pixels();
    assert!(beside > 100);
    let mut floats = crate::draw::Floats::new(&headless, [48, 32]);
    for (background, seen) in [
        (0.5, 0),
        (f64::NAN, beside),
        (f64::INFINITY, beside),
        (-0.5, beside),
    ] {
        floats.background = background;
        assert_eq!(floats.unfit_pixels(&headless), seen, "{background}");
    }
}
