//! The flight that `cargo bench --bench streaming -- flight` measures, looked at: while data arrive no pixel sees through
//! the drawn surface, no height changes by more than camera and fade explain, and none is made up.
//!
//! Places: 2,000 a frame around the eye, as many at each power of the distance (`support/places.rs`); pixels: those of
//! every twelfth frame. Frames that report pops, of data that came too late for anything better, are left out, and few. A
//! short form by default, and a second one over a file that is slow to read, so that data are late all the time; the long
//! form is
//!
//! ```sh
//! CLIPSCAPE_FRAMES=3000 cargo test --release --test streamed_flight -- --nocapture
//! ```
#![allow(clippy::print_stdout, reason = "what was found is printed")]

mod support;

use std::sync::Arc;
use std::time::{Duration, Instant};

use clipscape::camera::{Camera, View};
use clipscape::clipmap::{Clipmap, ClipmapOptions, Wait, height_range_m};
use clipscape::grid::Grid;
use clipscape::progress::Silent;
use clipscape::source::{ReadAt, Synth};
use clipscape::stream::{LEAST_TILE_BYTES, Terrain, TileOptions};
use glam::DVec3;
use support::flights::{bytes_of, garbage, make_file};
use support::motion::Found;
use support::places::{Frame, Samples, compare};
use support::{Random, facts, scenes, seed};

const FPS: f64 = 30.0;

const SIZE_PX: [u32; 2] = [192, 108];

/// Frames from one that is looked at pixel by pixel to the next.
const LOOKED_AT: u32 = 12;

/// Bytes of which each piece takes a while.
struct Slow(Arc<Vec<u8>>, Duration);

impl ReadAt for Slow {
    fn size_bytes(&self) -> u64 {
        self.0.size_bytes()
    }

    fn read_exact_at(&self, offset: u64, out: &mut [u8]) -> std::io::Result<()> {
        std::thread::sleep(self.1);
        self.0.read_exact_at(offset, out)
    }
}

/// A terrain file of procedural mountains, and all of its samples.
struct Scene {
    bytes: Arc<Vec<u8>>,
    samples: Samples,
    truth: Terrain,
    height_m: f64,
}

impl Scene {
    fn new(size: i64) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.terrain.exr");
        make_file(&Synth::new(size, 1).unwrap(), &path);
        let bytes = bytes_of(&path);
        let truth = Terrain::from_bytes("truth", bytes.clone(), &Silent).unwrap();
        Self {
            samples: Samples::new(&truth),
            height_m: f64::from(height_range_m(&truth).unwrap()[1]) + 100.0,
            bytes,
            truth,
        }
    }
}

/// Round and round, as the bench flies.
fn camera(grid: &Grid, height_m: f64, speed_m_s: f64, time_s: f64) -> Camera {
    let half = [grid.size.width, grid.size.height].map(|n| (n - 1) as f64 * grid.spacing_m[0] / 2.0);
    let radius = 0.7 * half[0].min(half[1]);
    let angle = speed_m_s * time_s / radius;
    Camera {
        eye: DVec3::new(
            half[0] + radius * angle.sin(),
            height_m,
            half[1] - radius * angle.cos(),
        ),
        heading_deg: 90.0 + angle.to_degrees(),
        pitch_deg: -10.0,
        roll_deg: 0.0,
        fov_deg: 60.0,
    }
}

/// How a flight is made.
struct Flight {
    frames: u32,
    speed_m_s: f64,
    /// How long each piece of the file takes.
    slow: Duration,
    /// How long a frame lasts at least.
    pace: Duration,
    /// Seconds of flight from frame to frame: what fades in fades by them. The bound allows for 1/30.
    passed_s: f64,
    /// Places that are looked at in each frame.
    places: usize,
}

/// What was seen.
#[derive(Debug, Default)]
struct Seen {
    found: Found,
    late: u32,
    popped: u32,
    looked_at: u32,
    pixels: usize,
    cracks: usize,
}

fn fly(scene: &Scene, flight: &Flight) -> Seen {
    let bytes = Arc::new(Slow(scene.bytes.clone(), flight.slow));
    let tiles = TileOptions {
        memory_bytes: LEAST_TILE_BYTES,
        loaders: 1,
    };
    let terrain = Terrain::from_bytes("a", bytes, &Silent).unwrap();
    let terrain = terrain.with_tiles(&tiles).unwrap();
    let arriving = terrain.arriving();
    let options = ClipmapOptions {
        wait: Wait::None,
        cull: false,
        ..Default::default()
    };
    let mut clipmap = Clipmap::new(&arriving, &options).unwrap();
    let mut random = Random(seed(71));
    let mut seen = Seen::default();
    let mut pixels = Pixels::new();
    let mut before: Option<Frame> = None;
    for k in 0..flight.frames {
        let start = Instant::now();
        let camera = camera(
            clipmap.grid(),
            scene.height_m,
            flight.speed_m_s,
            f64::from(k) / FPS,
        );
        let view = View::new(camera, SIZE_PX).unwrap();
        let report = *clipmap
            .update(&arriving, &view, f64::from(k) * flight.passed_s)
            .unwrap();
        seen.late += u32::from(!report.complete);
        seen.popped += u32::from(report.pops > 0);
        let after = Frame::new(&clipmap, &camera);
        if let Some(before) = before.filter(|_| report.pops == 0) {
            let frames = [&before, &after];
            compare(
                &scene.samples,
                frames,
                1.0 / FPS,
                &mut random,
                flight.places,
                &mut seen.found,
            );
        }
        before = Some(after);
        if k % LOOKED_AT == 0 {
            let faults = facts::faults(&clipmap, &clipmap);
            assert!(
                faults.is_empty(),
                "frame {k}: {:?}",
                &faults[..faults.len().min(3)]
            );
            assert_eq!(garbage(&clipmap, &scene.truth), 0, "frame {k}");
            let (terrain, cracks) = pixels.cracks(&clipmap, &view);
            seen.looked_at += 1;
            seen.pixels += terrain;
            seen.cracks += cracks;
        }
        std::thread::sleep(flight.pace.saturating_sub(start.elapsed()));
    }
    assert!(clipmap.take_faults().is_empty());
    seen
}

/// The crack counter on the device, where there is one.
#[cfg(feature = "gpu")]
struct Pixels(Option<support::depths::Depths>);

#[cfg(feature = "gpu")]
impl Pixels {
    fn new() -> Self {
        Self(support::gpu().map(|gpu| support::depths::Depths::new(gpu, SIZE_PX)))
    }

    /// Pixels of terrain, and cracks among them.
    fn cracks(&mut self, clipmap: &Clipmap, view: &View) -> (usize, usize) {
        use clipscape::accuracy::{DepthImage, cracks};

        let Some(depths) = &self.0 else { return (0, 0) };
        let image = depths.draw(clipmap);
        let drawn = clipscape::clipmap::Drawn::new(clipmap).unwrap();
        let threads = clipscape::build::Threads::new(0).unwrap();
        let found = cracks(&drawn, &DepthImage::new(&image, view).unwrap(), &threads).unwrap();
        (image.iter().filter(|d| **d > 0.0).count(), found.len())
    }
}

#[cfg(not(feature = "gpu"))]
struct Pixels;

#[cfg(not(feature = "gpu"))]
impl Pixels {
    fn new() -> Self {
        Self
    }

    fn cracks(&mut self, _: &Clipmap, _: &View) -> (usize, usize) {
        (0, 0)
    }
}

fn assert_whole(what: &str, flight: &Flight, seen: &Seen) {
    println!("{what}, {} frames: {seen:?}", flight.frames);
    assert_eq!((seen.found.pops, seen.cracks), (0, 0), "{what}: {seen:?}");
    assert!(seen.popped * 50 <= flight.frames, "{what}: {seen:?}");
    assert!(seen.late > 10 && seen.found.change_m > 0.1, "{what}: {seen:?}");
}

#[test]
fn while_data_arrive_nothing_cracks_or_pops() {
    let frames = scenes::count("CLIPSCAPE_FRAMES", 0) as u32;
    let long = frames > 0;
    let scene = Scene::new(if long { 4096 } else { 1500 });
    let flight = Flight {
        frames: if long { frames } else { 150 },
        speed_m_s: 300.0,
        slow: Duration::ZERO,
        pace: Duration::from_secs_f64(1.0 / FPS),
        passed_s: 1.0 / FPS,
        places: 2000,
    };
    let quick = fly(&scene, &flight);
    assert_whole("the flight", &flight, &quick);
    let late = Flight {
        slow: Duration::from_millis(20),
        pace: Duration::ZERO,
        ..flight
    };
    let seen = fly(&scene, &late);
    assert_whole("of a slow file", &late, &seen);
    assert!(seen.late > 2 * quick.late, "{seen:?}");
    // Control: what arrives is there at once, as if a second passed from frame to frame.
    let hasty = Flight {
        frames: 60,
        slow: Duration::from_millis(2),
        passed_s: 1.0,
        ..late
    };
    let seen = fly(&scene, &hasty);
    println!("without a fade: {seen:?}");
    assert!(seen.found.pops > 100, "{seen:?}");
}

#[cfg(feature = "gpu")]
#[test]
fn control_without_the_morph_the_flight_cracks() {
    let scene = Scene::new(700);
    let options = ClipmapOptions {
        clip_size: 64,
        cull: false,
        ..Default::default()
    };
    let mut clipmap = Clipmap::new(&scene.truth, &options).unwrap();
    let camera = Camera {
        pitch_deg: -25.0,
        ..camera(clipmap.grid(), scene.height_m - 400.0, 300.0, 1.0)
    };
    let view = View::new(camera, SIZE_PX).unwrap();
    clipmap.update(&scene.truth, &view, 0.0).unwrap();
    let mut pixels = Pixels::new();
    let (terrain, cracks) = pixels.cracks(&clipmap, &view);
    assert_eq!(cracks, 0);
    for level in clipmap.frame_mut().1 {
        level.has_coarser = 0;
    }
    let (_, broken) = pixels.cracks(&clipmap, &view);
    assert!(terrain == 0 || broken > 0, "{broken} cracks in {terrain} pixels");
}
