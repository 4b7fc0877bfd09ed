//! A steady-state frame's selection and update plan take nothing from the heap.
//!
//! After a lap over a closed path, whose longest lists are then known, a second lap over the same path allocates
//! nothing, neither where windows move nor where the camera only turns. Counted is what this thread asks of the
//! allocator.
#![allow(clippy::print_stdout, reason = "the counts are printed")]

mod support;

use clipscape::Result;
use clipscape::camera::{Camera, View};
use clipscape::clipmap::{Clipmap, ClipmapOptions};
use clipscape::grid::{Grid, Rect};
use clipscape::levels::{Arrival, Bounds, Levels, LightSample};
use clipscape::progress::Silent;
use clipscape::pyramid::{Filter, Pyramid};
use clipscape::work::Serial;
use glam::DVec3;
use support::{hash, hills};

const FRAMES: u32 = 240;

/// Rough ground in memory: answers by copying.
fn terrain() -> Pyramid {
    let grid = Grid::new(1201, 1013, [10.0, 12.0]);
    let height = |(i, j)| {
        let void = hash(9, i / 16, j / 16) < 0.03;
        if void { f32::NAN } else { hills(0, i, j) }
    };
    let heights = grid.size.rect().cells().map(height).collect();
    let filter = Filter::default();
    let mut pyramid = Pyramid::new(grid, heights, None, &filter, &Serial, &Silent).unwrap();
    pyramid.bound(&Serial, &Silent).unwrap();
    pyramid
}

/// The same, but each answer costs an allocation.
struct Wasteful(Pyramid);

impl Levels for Wasteful {
    fn grid(&self) -> &Grid {
        self.0.grid()
    }

    fn heights(&self, level: u32, rect: Rect, out: &mut [f32]) -> Result<Arrival> {
        let mut copy = vec![0.0; out.len()];
        let arrival = self.0.heights(level, rect, &mut copy)?;
        out.copy_from_slice(&copy);
        Ok(arrival)
    }

    fn bounds(&self, level: u32, patches: Rect, out: &mut [Bounds]) -> Result<Arrival> {
        self.0.bounds(level, patches, out)
    }

    fn has_light(&self) -> bool {
        false
    }

    fn light(&self, level: u32, rect: Rect, out: &mut [LightSample]) -> Result<Arrival> {
        self.0.light(level, rect, out)
    }
}

/// Frame `k` of a lap: round and round on a closed curve that climbs and sinks, stopping now and then to turn.
fn view(k: u32) -> View {
    // Of eight frames two stand still.
    let place = f64::from(k - (k % 8).saturating_sub(5)) / f64::from(FRAMES) * std::f64::consts::TAU;
    let camera = Camera {
        eye: DVec3::new(
            6000.0 + 4500.0 * place.cos(),
            500.0 + 400.0 * (2.0 * place).sin(),
            6000.0 + 4000.0 * (3.0 * place).sin(),
        ),
        heading_deg: f64::from(k * 7),
        pitch_deg: -20.0 + 15.0 * (5.0 * place).sin(),
        roll_deg: 0.0,
        fov_deg: 60.0,
    };
    View::new(camera, [1280, 720]).unwrap()
}

/// Allocations of a lap after `warm` laps, and the frames of it that moved a window.
fn allocations(levels: &dyn Levels, clip_size: i64, warm: u32) -> (u64, u32) {
    let options = ClipmapOptions {
        clip_size,
        ..Default::default()
    };
    let mut clipmap = Clipmap::new(levels, &options).unwrap();
    let mut moved = 0;
    let mut lap = |count: &mut u32| {
        for k in 0..FRAMES {
            let report = clipmap.update(levels, &view(k), 0.0).unwrap();
            *count += u32::from(report.uploads > 0);
        }
    };
    for _ in 0..warm {
        lap(&mut 0);
    }
    let info = allocation_counter::measure(|| lap(&mut moved));
    (info.count_total, moved)
}

#[test]
fn a_steady_state_frame_allocates_nothing() {
    let levels = terrain();
    for clip_size in [64, 256] {
        let (count, moved) = allocations(&levels, clip_size, 1);
        println!(
            "clip size {clip_size}: {count} allocations in {FRAMES} frames, of which {moved} moved a window"
        );
        assert_eq!(count, 0, "clip size {clip_size}");
        assert!(
            moved > FRAMES / 2 && moved < FRAMES,
            "{moved} frames moved a window"
        );
    }
}

#[test]
fn control_an_allocating_source_and_a_first_lap_are_counted() {
    let (count, moved) = allocations(&Wasteful(terrain()), 64, 1);
    println!("a wasteful source: {count} allocations");
    assert!(
        count >= u64::from(moved) && moved > 0,
        "{count} of {moved} frames"
    );
    let (count, _) = allocations(&terrain(), 64, 0);
    assert!(count > 0, "the first lap grows its lists");
}
