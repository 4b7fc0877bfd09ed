//! Golden frames of the shipped DEM.
//!
//! The references were drawn by lavapipe (Mesa 22.3.6, LLVM 15). Adapters round filtering, interpolation and `exp`
//! differently, by far less than a step of 8 bits a channel, but a pixel at an outline may fall on its other side. So:
//! the mean difference is at most 0.25 of 255, and at most 0.5 % of the pixels differ by more than 4.
//!
//! `CLIPSCAPE_BLESS=1 cargo test --test golden` writes the references anew, and fails.
#![cfg(feature = "gpu")]

mod support;

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use clipscape::build::Threads;
use clipscape::camera::{Camera, overview};
use clipscape::clipmap::ClipmapOptions;
use clipscape::levels::Levels;
use clipscape::light::{LightOptions, Sun, trace_light};
use clipscape::progress::Silent;
use clipscape::pyramid::{Filter, Pyramid};
use clipscape::render::pictures::write_png;
use clipscape::render::{Headless, HeadlessOptions};
use clipscape::shade::ViewMode;
use glam::DVec3;
use support::gpu;

const SIZE_PX: [u32; 2] = [256, 144];
const MEAN_LIMIT: f64 = 0.25;
const FAR_SHARE_LIMIT: f64 = 0.005;
const FAR: u8 = 4;

/// The shipped DEM with its light, built once.
fn pyrenees() -> &'static Pyramid {
    static PYRAMID: OnceLock<Pyramid> = OnceLock::new();
    PYRAMID.get_or_init(|| {
        let source = clipscape::source::open(Path::new("data/N42E001.hgt")).unwrap();
        let description = source.description().clone();
        let mut heights = vec![0.0; description.grid.size.samples() as usize];
        source.read(description.grid.size.rect(), &mut heights).unwrap();
        let (work, filter) = (Threads::new(0).unwrap(), Filter::default());
        let light = trace_light(
            &description.grid,
            &heights,
            &LightOptions::default(),
            &filter,
            &work,
            &Silent,
        );
        let mut pyramid = Pyramid::new(
            description.grid,
            heights,
            description.step_m,
            &filter,
            &work,
            &Silent,
        )
        .unwrap();
        pyramid.bound(&work, &Silent).unwrap();
        pyramid.set_light(light.unwrap()).unwrap();
        pyramid
    })
}

fn options() -> HeadlessOptions {
    HeadlessOptions {
        size_px: SIZE_PX,
        clipmap: ClipmapOptions::default(),
        ..Default::default()
    }
}

fn near() -> Camera {
    let eye = DVec3::new(40_000.0, 3_200.0, 75_000.0);
    Camera {
        eye,
        heading_deg: 330.0,
        pitch_deg: -12.0,
        roll_deg: 0.0,
        fov_deg: 60.0,
    }
}

fn draw(options: &HeadlessOptions, camera: &Camera) -> Option<Vec<u8>> {
    let mut headless = Headless::new(gpu()?, pyrenees(), options).unwrap();
    Some(headless.frame(pyrenees(), camera, 0.0).unwrap().rgba8)
}

/// Mean difference of the channels, and the share of pixels of which one differs by more than [`FAR`].
fn difference(a: &[u8], b: &[u8]) -> (f64, f64) {
    assert!(a.len() == b.len() && !a.is_empty());
    let sum: u64 = a.iter().zip(b).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    let far = |(a, b): &(&[u8], &[u8])| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > FAR);
    let far = a.chunks(4).zip(b.chunks(4)).filter(far).count();
    (sum as f64 / a.len() as f64, far as f64 / (a.len() / 4) as f64)
}

fn read(path: &Path) -> Vec<u8> {
    let file =
        File::open(path).unwrap_or_else(|e| panic!("{}: {e}; CLIPSCAPE_BLESS=1 writes it", path.display()));
    let mut reader = png::Decoder::new(BufReader::new(file)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    assert_eq!((info.width, info.height), (SIZE_PX[0], SIZE_PX[1]));
    pixels
        .chunks(info.color_type.samples())
        .flat_map(|p| [p[0], p[1], p[2], 255])
        .collect()
}

fn compare(name: &str, pixels: &[u8]) {
    let path = Path::new("tests/golden").join(format!("{name}.png"));
    if std::env::var_os("CLIPSCAPE_BLESS").is_some_and(|v| v == "1") {
        write_png(&path, SIZE_PX[0], SIZE_PX[1], pixels).unwrap();
        panic!(
            "wrote {}; look at it, then run again without CLIPSCAPE_BLESS",
            path.display()
        );
    }
    let golden = read(&path);
    let (mean, far) = difference(pixels, &golden);
    if mean > MEAN_LIMIT || far > FAR_SHARE_LIMIT {
        let seen = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.png"));
        write_beside(&seen, &golden, pixels);
        panic!(
            "{name}: mean difference {mean:.3}, {:.3} % differ by more than {FAR}; see {}",
            far * 1e2,
            seen.display()
        );
    }
}

/// Expected, difference, actual, beside each other in one picture.
fn write_beside(path: &Path, expected: &[u8], actual: &[u8]) {
    let row = 4 * SIZE_PX[0] as usize;
    let mut all = Vec::new();
    for (e, a) in expected.chunks(row).zip(actual.chunks(row)) {
        all.extend_from_slice(e);
        all.extend(e.iter().zip(a).map(|(e, a)| e.abs_diff(*a).saturating_mul(8)));
        all.extend_from_slice(a);
    }
    write_png(path, 3 * SIZE_PX[0], SIZE_PX[1], &all).unwrap();
}

#[test]
fn the_whole_dem() {
    let camera = overview(pyrenees().grid(), 349.0, 3100.0, 16.0 / 9.0);
    let mut options = options();
    options.clipmap.clip_size = 512;
    let Some(pixels) = draw(&options, &camera) else {
        return;
    };
    compare("whole", &pixels);
}

#[test]
fn a_view_from_among_the_mountains() {
    let Some(pixels) = draw(&options(), &near()) else {
        return;
    };
    compare("near", &pixels);
}

#[test]
fn the_bare_light_at_four_samples_a_pixel() {
    let options = HeadlessOptions {
        view_mode: ViewMode::Light,
        sample_count: 4,
        ..options()
    };
    let Some(pixels) = draw(&options, &near()) else {
        return;
    };
    compare("light", &pixels);
}

#[test]
fn levels_and_the_bands_between_them() {
    let mut options = HeadlessOptions {
        view_mode: ViewMode::Level,
        ..options()
    };
    options.clipmap.clip_size = 64;
    let Some(pixels) = draw(&options, &near()) else {
        return;
    };
    compare("level", &pixels);
}

#[test]
fn light_from_slopes_where_none_was_traced() {
    let sun = Sun {
        azimuth_deg: 90.0,
        altitude_deg: 30.0,
    };
    let options = HeadlessOptions {
        traced_light: false,
        sun,
        ..options()
    };
    let Some(pixels) = draw(&options, &near()) else {
        return;
    };
    compare("slopes", &pixels);
}

#[test]
fn control_a_slightly_different_frame_is_caught() {
    let Some(pixels) = draw(&options(), &near()) else {
        return;
    };
    let turned = Camera {
        heading_deg: 330.3,
        ..near()
    };
    let (mean, far) = difference(&pixels, &draw(&options(), &turned).unwrap());
    assert!(mean > MEAN_LIMIT || far > FAR_SHARE_LIMIT, "{mean} {far}");
    let no_haze = HeadlessOptions {
        haze: false,
        ..options()
    };
    let (mean, far) = difference(&pixels, &draw(&no_haze, &near()).unwrap());
    assert!(mean > MEAN_LIMIT || far > FAR_SHARE_LIMIT, "{mean} {far}");
}

/// Frames of the shipped flight in which triangles that close a side cover a pixel, by clip size.
const CLOSED: [(i64, u64); 7] = [
    (256, 23),
    (64, 10),
    (64, 83),
    (64, 91),
    (64, 93),
    (64, 95),
    (64, 115),
];

#[test]
fn what_closing_triangles_cover_is_coloured_like_the_ground_beside_it() {
    let Some(gpu) = gpu() else { return };
    let json = std::fs::read_to_string("data/pyrenees.json").unwrap();
    let flight = clipscape::Flight::parse("data/pyrenees.json", &json).unwrap();
    for (clip_size, k) in CLOSED {
        let mut options = HeadlessOptions {
            size_px: [1280, 720],
            ..options()
        };
        options.clipmap.clip_size = clip_size;
        let mut headless = Headless::new(gpu.clone(), pyrenees(), &options).unwrap();
        let frame = headless
            .frame(pyrenees(), &flight.camera_at_frame(k), 0.0)
            .unwrap();
        // Neither sky nor ground is ever black.
        let black = frame.rgba8.chunks(4).filter(|p| p[..3] == [0, 0, 0]).count();
        assert_eq!(black, 0, "frame {k}, clip size {clip_size}");
    }
}

#[test]
fn frames_are_the_same_bytes_from_run_to_run_and_without_culling() {
    let Some(pixels) = draw(&options(), &near()) else {
        return;
    };
    assert!(
        pixels == draw(&options(), &near()).unwrap(),
        "another run draws other bytes"
    );
    let mut all = options();
    all.clipmap.cull = false;
    assert!(
        pixels == draw(&all, &near()).unwrap(),
        "without culling the picture is another"
    );
}
