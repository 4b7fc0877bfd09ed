//! A soak: a long flight with random teleports over a streamed terrain keeps its memory, threads and open files.
//!
//! A short form runs with the other tests; the long one is
//!
//! ```sh
//! CLIPSCAPE_SOAK_FRAMES=20000 cargo test --release --test soak -- --nocapture
//! ```
//!
//! Only where the system tells of itself in `/proc`.
#![cfg(target_os = "linux")]
#![allow(clippy::print_stdout, reason = "the figures are printed")]

mod support;

use std::fs;

use clipscape::clipmap::{Clipmap, ClipmapOptions, Wait};
use clipscape::levels::Levels;
use clipscape::progress::Silent;
use clipscape::stream::{LEAST_TILE_BYTES, Terrain, TileOptions};
use support::flights::{Rough, Wander, make_file, view};
use support::{scenes, seed};

/// What the process takes of the system.
#[derive(Clone, Copy, Debug)]
struct Taken {
    resident_bytes: u64,
    threads: usize,
    files: usize,
}

impl Taken {
    fn now() -> Self {
        let statm = fs::read_to_string("/proc/self/statm").unwrap();
        let pages: u64 = statm.split(' ').nth(1).unwrap().parse().unwrap();
        Self {
            resident_bytes: pages * 4096,
            threads: fs::read_dir("/proc/self/task").unwrap().count(),
            files: fs::read_dir("/proc/self/fd").unwrap().count(),
        }
    }
}

/// Frames of one flight, teleports among them; now and then the terrain is opened anew.
fn soak(path: &std::path::Path, frames: u32, leak: &mut Vec<Terrain>) -> (Taken, Taken) {
    let open = || {
        let options = TileOptions {
            memory_bytes: LEAST_TILE_BYTES,
            ..Default::default()
        };
        Terrain::open(path, &Silent)
            .unwrap()
            .with_tiles(&options)
            .unwrap()
    };
    let options = ClipmapOptions {
        clip_size: 128,
        cull: false,
        wait: Wait::None,
        upload_budget_bytes: Some(200_000),
        ..Default::default()
    };
    let mut terrain = open();
    let mut arriving = terrain.arriving();
    let mut clipmap = Clipmap::new(&arriving, &options).unwrap();
    let mut wander = Wander::new(seed(61), terrain.grid(), 90.0, 0.02);
    let mut warm = Taken::now();
    for k in 0..frames {
        if k == frames / 4 {
            warm = Taken::now();
        }
        if k % (frames / 20) == 0 {
            let fresh = open();
            arriving = fresh.arriving();
            let old = std::mem::replace(&mut terrain, fresh);
            if !leak.is_empty() {
                leak.push(old); // a control
            }
            clipmap = Clipmap::new(&arriving, &options).unwrap();
        }
        let report = clipmap
            .update(&arriving, &view(wander.step()), f64::from(k) / 30.0)
            .unwrap();
        assert!(report.patches > 0);
        if k % 16 == 0 {
            std::thread::sleep(std::time::Duration::from_millis(2));
        }
    }
    (warm, Taken::now())
}

#[test]
fn a_long_flight_takes_no_more_in_the_end() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.terrain.exr");
    make_file(&Rough::new(2600, 2300), &path);
    let frames = scenes::count("CLIPSCAPE_SOAK_FRAMES", 1000).max(100) as u32;
    let (warm, end) = soak(&path, frames, &mut Vec::new());
    println!("{frames} frames: {warm:?} after a quarter, {end:?} in the end");
    assert!(end.threads <= warm.threads && end.files <= warm.files);
    // The allocator may keep some of what it was given back.
    let allowed = warm.resident_bytes + warm.resident_bytes / 10 + (8 << 20);
    assert!(end.resident_bytes <= allowed);
    // Control: terrains that are kept are seen.
    let mut leak = vec![Terrain::open(&path, &Silent).unwrap()];
    let (warm, end) = soak(&path, 200, &mut leak);
    assert!(
        end.threads > warm.threads && end.files > warm.files,
        "{warm:?}, {end:?}"
    );
}
