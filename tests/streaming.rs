//! Terrain that is streamed: with everything waited for the same bytes for any number of loaders; without waiting a surface
//! that is watertight, never made up, and in the end the same.

mod support;

use std::sync::Arc;

use clipscape::clipmap::{Clipmap, ClipmapOptions, UpdateReport, Wait, displace};
use clipscape::levels::Levels;
use clipscape::progress::Silent;
use clipscape::source::{ReadAt, Synth};
use clipscape::stream::{LEAST_TILE_BYTES, Terrain, TileOptions};
use support::flights::{Rough, Wander, bytes_of, garbage, make_file, settle, view};
use support::{facts, seed};

const CLIP_SIZE: i64 = 64;

fn options(wait: Wait) -> ClipmapOptions {
    ClipmapOptions {
        clip_size: CLIP_SIZE,
        wait,
        cull: false,
        ..Default::default()
    }
}

fn with_loaders(terrain: Terrain, loaders: usize) -> Terrain {
    let options = TileOptions {
        memory_bytes: LEAST_TILE_BYTES,
        loaders,
    };
    terrain.with_tiles(&options).unwrap()
}

/// All that a frame is made of: the report, the mirrors' bits, and the vertices.
fn bits_of(clipmap: &Clipmap) -> (UpdateReport, u32, usize) {
    let mut crc = 0;
    for window in clipmap.windows() {
        crc = crc32c::crc32c_append(crc, bytemuck::cast_slice(window.heights()));
        crc = crc32c::crc32c_append(crc, bytemuck::cast_slice(window.light()));
    }
    let mut vertices = 0;
    for instance in clipmap.selection().instances() {
        for k in 0..81 {
            let vertex = displace(clipmap, instance, k % 9, k / 9);
            let numbers = vertex.clip.iter().chain([&vertex.height, &vertex.alpha]);
            let numbers: Vec<u32> = numbers.map(|n| n.to_bits()).collect();
            crc = crc32c::crc32c_append(crc, bytemuck::cast_slice(&numbers));
            vertices += 1;
        }
    }
    (*clipmap.report(), crc, vertices)
}

#[test]
fn frames_that_wait_do_not_depend_on_who_loads() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.terrain.exr");
    make_file(&Rough::new(900, 700), &path);
    let fly = |loaders| {
        let terrain = with_loaders(Terrain::open(&path, &Silent).unwrap(), loaders);
        let mut clipmap = Clipmap::new(&terrain, &options(Wait::All)).unwrap();
        let mut wander = Wander::new(seed(41), terrain.grid(), 150.0, 0.1);
        let mut frame = |k: i32| {
            let update = clipmap.update(&terrain, &view(wander.step()), f64::from(k) / 30.0);
            assert!(update.unwrap().complete);
            bits_of(&clipmap)
        };
        (0..60).map(&mut frame).collect::<Vec<_>>()
    };
    let one = fly(1);
    for loaders in [1, 2, 4] {
        assert!(fly(loaders) == one, "{loaders} loaders");
    }
}

#[cfg(feature = "gpu")]
#[test]
fn pictures_that_wait_do_not_depend_on_who_loads() {
    use clipscape::render::{Headless, HeadlessOptions};

    let Some(gpu) = support::gpu() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.terrain.exr");
    make_file(&Rough::new(900, 700), &path);
    let headless_options = HeadlessOptions {
        size_px: [160, 90],
        clipmap: options(Wait::All),
        ..Default::default()
    };
    let fly = |loaders| {
        let terrain = with_loaders(Terrain::open(&path, &Silent).unwrap(), loaders);
        let mut headless = Headless::new(gpu.clone(), &terrain, &headless_options).unwrap();
        let mut wander = Wander::new(seed(42), terrain.grid(), 150.0, 0.1);
        let mut frame = |k: i32| {
            let camera = clipscape::Camera {
                eye: wander.step(),
                heading_deg: 30.0,
                pitch_deg: -20.0,
                roll_deg: 0.0,
                fov_deg: 60.0,
            };
            headless
                .frame(&terrain, &camera, f64::from(k) / 30.0)
                .unwrap()
                .rgba8
        };
        (0..20).map(&mut frame).collect::<Vec<_>>()
    };
    let one = fly(1);
    assert!(fly(1) == one && fly(2) == one);
    assert!(one[0] != one[19], "the camera moved");
}

#[test]
fn what_has_not_been_loaded_is_drawn_coarser_and_never_made_up() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.terrain.exr");
    make_file(&Rough::new(900, 700), &path);
    let truth = Terrain::open(&path, &Silent).unwrap();
    for (speed_m, teleports) in [(20.0, 0.0), (300.0, 0.05), (3000.0, 0.3)] {
        let terrain = with_loaders(Terrain::open(&path, &Silent).unwrap(), 1);
        let arriving = terrain.arriving();
        let mut clipmap = Clipmap::new(&arriving, &options(Wait::None)).unwrap();
        let mut wander = Wander::new(seed(43), terrain.grid(), speed_m, teleports);
        let (mut late, mut now) = (0, 0.0);
        for k in 0..40 {
            now = f64::from(k) / 30.0;
            let report = *clipmap.update(&arriving, &view(wander.step()), now).unwrap();
            late += u32::from(!report.complete);
            assert!(report.patches > 0, "the coarsest level is waited for");
            assert_eq!(garbage(&clipmap, &truth), 0, "frame {k}");
            let faults = facts::faults(&clipmap, &clipmap);
            assert!(
                faults.is_empty(),
                "frame {k}: {:?}",
                &faults[..faults.len().min(3)]
            );
        }
        assert!(late > 0, "at {speed_m} m a frame nothing was late");
        // On the spot, all of it comes, and fades in.
        for _ in 0..200 {
            settle(&arriving);
            now += 0.1;
            if clipmap
                .update(&arriving, &view(wander.eye), now)
                .unwrap()
                .complete
                && clipmap.windows().iter().all(|w| w.missing().next().is_none())
            {
                break;
            }
        }
        let mut waiting = Clipmap::new(&truth, &options(Wait::All)).unwrap();
        waiting.update(&truth, &view(wander.eye), 0.0).unwrap();
        assert!(clipmap.report().complete && clipmap.take_faults().is_empty());
        let drawn = |c: &Clipmap| {
            let patch = |i: &clipscape::clipmap::Instance| {
                (0..81).map(|k| displace(c, i, k % 9, k / 9)).collect::<Vec<_>>()
            };
            c.selection()
                .instances()
                .map(|i| (*i, patch(i)))
                .collect::<Vec<_>>()
        };
        assert!(drawn(&clipmap) == drawn(&waiting), "at {speed_m} m a frame");
        assert!(terrain.most_tile_bytes() <= LEAST_TILE_BYTES);
    }
}

#[test]
fn what_the_camera_flies_towards_is_there_before_it() {
    let synth = || Terrain::from_synth(Synth::new(20_000, 5).unwrap());
    // A quarter of a second between frames that are far apart: with what is wanted ahead, frames are complete; without, as
    // a camera does that jumps from place to place in no time, none is.
    let fly = |passed_s: f64| {
        let terrain = synth();
        let arriving = terrain.arriving();
        let mut clipmap = Clipmap::new(&arriving, &options(Wait::None)).unwrap();
        let mut complete = 0;
        for k in 0..20 {
            let eye = glam::DVec3::new(100_000.0 + 240.0 * f64::from(k), 2500.0, 300_000.0);
            let report = clipmap.update(&arriving, &view(eye), passed_s * f64::from(k));
            complete += u32::from(report.unwrap().complete && k >= 10);
            settle(&arriving);
        }
        complete
    };
    let (with, without) = (fly(0.25), fly(0.0));
    assert!(
        with == 10 && without < 10,
        "{with} and {without} of 10 frames are complete"
    );
}

#[test]
fn views_share_what_was_loaded() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.terrain.exr");
    make_file(&Rough::new(600, 500), &path);
    let terrain = Terrain::from_bytes("a", bytes_of(&path), &Silent).unwrap();
    let terrain = Arc::new(terrain);
    let first = terrain.arriving();
    let mut clipmap = Clipmap::new(&first, &options(Wait::None)).unwrap();
    let spot = view(glam::DVec3::new(8000.0, 300.0, 5000.0));
    for k in 0..60 {
        clipmap.update(&first, &spot, f64::from(k)).unwrap();
        settle(&first);
    }
    assert!(clipmap.report().complete);
    // Another view is complete in its first frame.
    let second = terrain.arriving();
    let mut other = Clipmap::new(&second, &options(Wait::None)).unwrap();
    assert!(other.update(&second, &spot, 0.0).unwrap().complete);
    // Of a file that is slow to read, and of which nothing has been loaded, it is not.
    let slow = Arc::new(Slow(bytes_of(&path)));
    let fresh = Terrain::from_bytes("a", slow, &Silent).unwrap();
    let third = fresh.arriving();
    let mut other = Clipmap::new(&third, &options(Wait::None)).unwrap();
    assert!(!other.update(&third, &spot, 0.0).unwrap().complete, "control");
}

/// Bytes of which each piece takes a while.
struct Slow(Arc<Vec<u8>>);

impl ReadAt for Slow {
    fn size_bytes(&self) -> u64 {
        self.0.size_bytes()
    }

    fn read_exact_at(&self, offset: u64, out: &mut [u8]) -> std::io::Result<()> {
        std::thread::sleep(std::time::Duration::from_millis(20));
        self.0.read_exact_at(offset, out)
    }
}

#[test]
fn a_first_frame_reads_no_level_that_it_does_not_show() {
    let terrain = Terrain::from_synth(Synth::new(2000, 5).unwrap());
    let high = view(glam::DVec3::new(30_000.0, 30_000.0, 30_000.0));
    let mut clipmap = Clipmap::new(&terrain, &options(Wait::None)).unwrap();
    let mut waiting = Clipmap::new(&terrain, &options(Wait::All)).unwrap();
    let report = *clipmap.update(&terrain, &high, 0.0).unwrap();
    waiting.update(&terrain, &high, 0.0).unwrap();
    let missing = |c: &Clipmap| {
        c.windows()
            .iter()
            .filter(|w| w.missing().next().is_some())
            .count()
    };
    assert!(report.complete && missing(&clipmap) > 0 && missing(&waiting) == 0);
    let drawn = |c: &Clipmap| c.selection().instances().copied().collect::<Vec<_>>();
    assert!(drawn(&clipmap) == drawn(&waiting));
    // What it may show from lower down comes with the frames that follow.
    for k in 1..60 {
        clipmap.update(&terrain, &high, f64::from(k)).unwrap();
    }
    assert_eq!(missing(&clipmap), 0);
}
