//! Frames of terrain with light over a day: at the time of one of its suns as a file made for that sun is drawn, and what
//! the shader makes of it against its twin.
#![cfg(all(feature = "gpu", feature = "dem"))]
#![allow(clippy::print_stderr, reason = "says what it found")]

mod support;

use std::path::{Path, PathBuf};

use clipscape::build::{PreprocessOptions, preprocess, relight};
use clipscape::camera::Camera;
use clipscape::clipmap::ClipmapOptions;
use clipscape::grid::Rect;
use clipscape::levels::Levels;
use clipscape::light::{Day, LightOptions};
use clipscape::progress::Silent;
use clipscape::render::{Headless, HeadlessOptions};
use clipscape::shade::ViewMode;
use clipscape::source::{self, OpenOptions};
use clipscape::stream::Terrain;
use clipscape::terrain::TerrainFile;
use glam::DVec3;
use support::gpu;

const SIZE_PX: [u32; 2] = [320, 180];

struct Made {
    _folder: tempfile::TempDir,
    day: Day,
    with_day: Terrain,
    position: u32,
    single: Terrain,
    later: Terrain,
}

fn open(path: &Path) -> Terrain {
    Terrain::open(path, &Silent).unwrap()
}

/// A part of the shipped DEM with a day, and the same for the sun of one of its positions, and of one later.
fn made() -> Made {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let options = OpenOptions {
        crop: Some(source::Crop::Samples(Rect::new(200, 200, 800, 800))),
        ..Default::default()
    };
    let dem = source::open_with(&[PathBuf::from("data/N42E001.hgt")], &options).unwrap();
    let day = Day::of("2026-10-10T12:00Z".parse().unwrap(), 42.5, 1.5, 24).unwrap();
    let lit = |k: u32, day: Option<Day>, of: &Day| PreprocessOptions {
        light: Some(LightOptions {
            sun: of.sun(of.time_of_position(k)).unwrap(),
            sky_directions: 0,
        }),
        day,
        ..Default::default()
    };
    let position = 4;
    preprocess(
        dem.as_ref(),
        &path("day.exr"),
        &lit(position, Some(day), &day),
        &Silent,
    )
    .unwrap();
    let file = TerrainFile::open(
        "day.exr",
        std::sync::Arc::new(std::fs::read(path("day.exr")).unwrap()),
    )
    .unwrap();
    assert!(file.verify(&Silent).unwrap().is_empty());
    // Lighting anew makes the same bytes, with the day, and leaves it out where none is asked for.
    relight(
        &file,
        &path("again.exr"),
        &lit(position, Some(day), &day),
        &Silent,
    )
    .unwrap();
    let bytes = |name: &str| std::fs::read(path(name)).unwrap();
    assert!(bytes("day.exr") == bytes("again.exr"));
    relight(&file, &path("single.exr"), &lit(position, None, &day), &Silent).unwrap();
    relight(&file, &path("later.exr"), &lit(position + 2, None, &day), &Silent).unwrap();
    let made = Made {
        day,
        with_day: open(&path("day.exr")),
        position,
        single: open(&path("single.exr")),
        later: open(&path("later.exr")),
        _folder: folder,
    };
    assert_eq!((made.with_day.day(), made.single.day()), (Some(day), None));
    assert!(made.with_day.has_day() && !made.single.has_day());
    made
}

fn camera() -> Camera {
    Camera {
        eye: DVec3::new(20_000.0, 5_000.0, 40_000.0),
        heading_deg: 340.0,
        pitch_deg: -20.0,
        roll_deg: 0.0,
        fov_deg: 60.0,
    }
}

/// A frame of the bare light, at a time of its day if it has one.
fn draw(gpu: &clipscape::gpu::Gpu, terrain: &Terrain, clip_size: i64, time: Option<f64>) -> Vec<u8> {
    let options = HeadlessOptions {
        size_px: SIZE_PX,
        view_mode: ViewMode::Light,
        tint: false,
        haze: false,
        sun: terrain.sun().unwrap(),
        clipmap: ClipmapOptions {
            clip_size,
            day: time.is_some(),
            ..Default::default()
        },
        ..Default::default()
    };
    let mut headless = Headless::new(gpu.clone(), terrain, &options).unwrap();
    if let Some(time) = time {
        headless.set_day(terrain.day().unwrap()).unwrap();
        headless.set_time_of_day(time).unwrap();
    }
    let frame = headless.frame(terrain, &camera(), 0.0).unwrap();
    assert_eq!(frame.upload.bytes, frame.update.upload_bytes);
    assert_eq!(frame.upload.bytes, frame.update.upload_bytes_exposed);
    frame.rgba8
}

/// Mean and root mean square of the differences of all channels, of 255.
fn difference(a: &[u8], b: &[u8]) -> [f64; 2] {
    let pairs = a
        .chunks(4)
        .zip(b.chunks(4))
        .flat_map(|(a, b)| (0..3).map(|c| f64::from(a[c]) - f64::from(b[c])));
    let (sum, squares, count) = pairs.fold((0.0, 0.0, 0.0), |(s, q, n), d| (s + d, q + d * d, n + 1.0));
    [sum / count, f64::sqrt(squares / count)]
}

#[test]
fn at_a_position_frames_are_those_of_a_file_made_for_that_sun() {
    let Some(gpu) = gpu() else { return };
    let made = made();
    let time = made.day.time_of_position(made.position);
    // All of it at full resolution, and coarse levels from nearby on.
    for (clip_size, wanted) in [(1024, 6.0), (64, 8.0)] {
        let of_day = draw(&gpu, &made.with_day, clip_size, Some(time));
        let single = draw(&gpu, &made.single, clip_size, None);
        let [mean, rms] = difference(&of_day, &single);
        let [_, control] = difference(&of_day, &draw(&gpu, &made.later, clip_size, None));
        eprintln!(
            "clip size {clip_size}: mean {mean:+.2}, RMS {rms:.2} of 255; two positions later {control:.2}"
        );
        assert!(mean.abs() < 4.0 && rms < wanted, "{mean}, {rms}");
        assert!(control > 2.0 * rms, "{control}");
        // A file with a day, drawn without a time, is drawn as before.
        assert!(draw(&gpu, &made.with_day, clip_size, None) == single);
    }
    let night = draw(&gpu, &made.with_day, 256, Some(made.day.time_of_hour(0.0)));
    let noon = draw(&gpu, &made.with_day, 256, Some(0.0));
    let mean = |rgba8: &[u8]| rgba8.iter().map(|v| f64::from(*v)).sum::<f64>() / rgba8.len() as f64;
    assert!(
        mean(&night) + 20.0 < mean(&noon),
        "{} {}",
        mean(&night),
        mean(&noon)
    );
}

#[test]
fn a_terrain_without_a_day_says_so() {
    let Some(gpu) = gpu() else { return };
    let terrain = Terrain::open("data/N42E001.hgt", &Silent).unwrap();
    let options = HeadlessOptions {
        size_px: [8, 8],
        view_mode: ViewMode::Light,
        tint: false,
        haze: false,
        clipmap: ClipmapOptions {
            clip_size: 64,
            day: true,
            ..Default::default()
        },
        ..Default::default()
    };
    let mut headless = Headless::new(gpu, &terrain, &options).unwrap();
    let day = Day::of("2026-10-10T12:00Z".parse().unwrap(), 42.5, 1.5, 24).unwrap();
    assert!(headless.set_day(day).unwrap_err().to_string().contains("--day N"));
    assert!(headless.set_time_of_day(0.0).is_err());
}
