//! Flights that do not wait: time of each update, memory, and how fast one may fly.

use std::path::Path;
use std::time::{Duration, Instant};

use clipscape::Result;
use clipscape::camera::{Camera, View};
use clipscape::clipmap::{AHEAD_S, Clipmap, ClipmapOptions, FRAME_BYTES, Wait};
use clipscape::levels::Levels;
use clipscape::progress::Silent;
use clipscape::stats::percentile;
use clipscape::stream::{Flown, LEAST_TILE_BYTES, Terrain, TileOptions};
use glam::DVec3;

use crate::FPS;
use crate::process::{cpu_ms, forget, held_bytes};

/// What an update may take of the frame's thread.
const UPDATE_MS: f64 = 4.0;

/// Tiles that are kept: fewer than the flight meets, so that some must go.
const MEMORY_BYTES: usize = LEAST_TILE_BYTES;

/// Memory beyond tiles and windows that a flight may take: 5 MiB of tables and checks in the file's reader, what reads and
/// decodes tiles, lists of patches, stacks, and what the allocator keeps.
const REST_BYTES: u64 = 16 << 20;

/// Round and round, 100 m over the DEM's highest ground, at a speed in m/s, starting in the north.
fn view(levels: &dyn Levels, height_m: f64, speed_m_s: f64, time_s: f64) -> Result<View> {
    let grid = levels.grid();
    let half = [0, 1].map(|k| {
        let size = [grid.size.width, grid.size.height][k];
        (size - 1) as f64 * grid.spacing_m[k] / 2.0
    });
    let radius = 0.7 * half[0].min(half[1]);
    let angle = speed_m_s * time_s / radius;
    let eye = DVec3::new(
        half[0] + radius * angle.sin(),
        height_m,
        half[1] - radius * angle.cos(),
    );
    View::new(
        Camera {
            eye,
            heading_deg: 90.0 + angle.to_degrees(),
            pitch_deg: -10.0,
            roll_deg: 0.0,
            fov_deg: 60.0,
        },
        [1280, 720],
    )
}

fn options() -> ClipmapOptions {
    ClipmapOptions {
        wait: Wait::None,
        ..Default::default()
    }
}

fn height_m(terrain: &Terrain) -> Result<f64> {
    let [_, high] = clipscape::clipmap::height_range_m(terrain)?;
    Ok(f64::from(high) + terrain.grid().base_m + 100.0)
}

/// What an update took, and did.
#[derive(Clone, Copy)]
struct Took {
    frame: u32,
    cpu_ms: Option<f64>,
    wall_ms: f64,
    bytes: u64,
    uploads: u64,
}

pub(crate) fn flight(path: &Path, frames: u32) -> Result<()> {
    let cold = forget(path);
    let before = held_bytes();
    let tiles = TileOptions {
        memory_bytes: MEMORY_BYTES,
        ..Default::default()
    };
    let terrain = Terrain::open(path, &Silent)?.with_tiles(&tiles)?;
    let height_m = height_m(&terrain)?;
    let arriving = terrain.arriving();
    let mut clipmap = Clipmap::new(&arriving, &options())?;
    let mut took = Vec::new();
    let (mut complete, mut pops, mut most) = (0, 0, before);
    for k in 0..frames {
        let time_s = f64::from(k) / FPS;
        let view = view(&arriving, height_m, 300.0, time_s)?;
        let (before, start) = (cpu_ms(), Instant::now());
        let report = *clipmap.update(&arriving, &view, time_s)?;
        let (wall, after) = (start.elapsed(), cpu_ms());
        took.push(Took {
            frame: k,
            cpu_ms: after.zip(before).map(|(after, before)| after - before),
            wall_ms: wall.as_secs_f64() * 1e3,
            bytes: report.upload_bytes,
            uploads: report.uploads,
        });
        complete += u32::from(report.complete);
        pops += u32::from(report.pops > 0);
        most = most.max(held_bytes());
        // Frames come when they are due.
        std::thread::sleep(Duration::from_secs_f64(1.0 / FPS).saturating_sub(start.elapsed()));
    }
    let page_cache = if cold { "cold" } else { "as it was" };
    println!("\n{frames} frames at 300 m/s, 30 a second, page cache {page_cache}: milliseconds of an update");
    println!("| | median | p99 | p99.9 | greatest | share below {UPDATE_MS} ms | asked |");
    println!("|---|---|---|---|---|---|---|");
    // The first frame waits for its coarsest level.
    took.remove(0);
    let cpu: Option<Vec<f64>> = took.iter().map(|t| t.cpu_ms).collect();
    let wall: Vec<f64> = took.iter().map(|t| t.wall_ms).collect();
    for (name, of, asked) in [("CPU", cpu.unwrap_or_default(), 0.999), ("wall", wall, 0.99)] {
        row(name, of, asked);
    }
    took.sort_by(|a, b| {
        b.cpu_ms
            .unwrap_or(b.wall_ms)
            .total_cmp(&a.cpu_ms.unwrap_or(a.wall_ms))
    });
    println!("the longest:");
    for t in took.iter().take(5) {
        println!(
            "  frame {}: {:.3} ms of CPU, {:.3} ms in all, {} bytes in {} pieces",
            t.frame,
            t.cpu_ms.unwrap_or(f64::NAN),
            t.wall_ms,
            t.bytes,
            t.uploads
        );
    }
    println!("complete: {complete} of {frames} frames; {pops} popped");
    memory(&terrain, &clipmap, before.zip(most));
    Ok(())
}

fn row(name: &str, mut of: Vec<f64>, asked: f64) {
    if of.is_empty() {
        return;
    }
    of.sort_by(f64::total_cmp);
    let below = of.iter().filter(|ms| **ms < UPDATE_MS).count() as f64 / of.len() as f64;
    let [median, p99, p999, most] = [50.0, 99.0, 99.9, 100.0].map(|p| percentile(&of, p));
    let met = if below >= asked { "met" } else { "not met" };
    println!("| {name} | {median:.3} | {p99:.3} | {p999:.3} | {most:.3} | {below:.4} | {asked}: {met} |");
}

/// The memory that the flight took, before it and at most, against what tiles and windows may take.
fn memory(terrain: &Terrain, clipmap: &Clipmap, held: Option<(u64, u64)>) {
    let mib = |bytes: u64| bytes as f64 / 1_048_576.0;
    let windows = clipmap.windows().iter();
    let windows: usize = windows
        .map(|w| size_of_val(w.heights()) + size_of_val(w.light()))
        .sum();
    let (budget, windows) = (MEMORY_BYTES as u64, windows as u64);
    println!(
        "tiles: at most {:.1} MiB of a budget of {:.1}; windows: {:.1} MiB",
        mib(terrain.most_tile_bytes() as u64),
        mib(budget),
        mib(windows)
    );
    if let Some((before, most)) = held {
        let grown = most.saturating_sub(before);
        println!(
            "memory: {:.1} MiB more than before at most; {:.1} of budget and windows and {:.0} for the rest allow {:.1}: {}",
            mib(grown),
            mib(budget + windows),
            mib(REST_BYTES),
            mib(budget + windows + REST_BYTES),
            if grown <= budget + windows + REST_BYTES {
                "met"
            } else {
                "not met"
            }
        );
    }
}

pub(crate) fn speeds(path: &Path, frames: u32) -> Result<()> {
    println!("\nshare of complete frames of {frames} after 2 s of flight, 30 a second, cold page cache");
    println!("| m/s | complete | fresh up to, predicted m/s |");
    println!("|---|---|---|");
    for speed in [100.0, 300.0, 1000.0, 3000.0, 10_000.0] {
        forget(path);
        let terrain = Terrain::open(path, &Silent)?;
        let height_m = height_m(&terrain)?;
        let arriving = terrain.arriving();
        let mut clipmap = Clipmap::new(&arriving, &options())?;
        let mut complete = 0;
        // Until what was met at the start has arrived, and what lies ahead is wanted.
        let start_frames = 60;
        for k in 0..start_frames + frames {
            let start = Instant::now();
            let time_s = f64::from(k) / FPS;
            let view = view(&arriving, height_m, speed, time_s)?;
            let report = *clipmap.update(&arriving, &view, time_s)?;
            complete += u32::from(k >= start_frames && report.complete);
            std::thread::sleep(Duration::from_secs_f64(1.0 / FPS).saturating_sub(start.elapsed()));
        }
        let flown = Flown {
            clip_size: 256,
            levels: clipmap.windows().len() as u32,
            upload_budget_bytes: Some(FRAME_BYTES),
            fps: FPS,
            ahead_s: AHEAD_S,
        };
        let fastest = terrain.pace().map(|pace| pace.fastest_m_s(&flown));
        println!(
            "| {speed} | {:.3} | {} |",
            f64::from(complete) / f64::from(frames),
            fastest.map_or("-".into(), |v| format!("{v:.0}"))
        );
    }
    Ok(())
}
