//! Streaming: what a flight that does not wait costs the frame's thread, how fast one may fly, and that size costs nothing.
//!
//! ```sh
//! cargo bench --bench streaming              # all of it, a short form
//! cargo bench --bench streaming -- flight    # 3,000 frames with a cold page cache: CPU and wall time of an update
//! cargo bench --bench streaming -- speeds    # the share of complete frames by speed, and what is predicted
//! cargo bench --bench streaming -- size      # a terrain of 2^20 x 2^20 against one of 4096 x 4096, frames in turn
//! ```
//!
//! `CLIPSCAPE_TERRAIN=FILE` flies over another terrain file than one that is made of `synth:4096:1`.
#![allow(clippy::print_stdout, reason = "a bench prints tables")]

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clipscape::build::{PreprocessOptions, preprocess};
use clipscape::camera::{Camera, View};
use clipscape::clipmap::{Clipmap, ClipmapOptions, Wait};
use clipscape::gpu;
use clipscape::levels::Levels;
use clipscape::light::{LightOptions, Sun};
use clipscape::progress::Silent;
use clipscape::query::{S0, Surface};
use clipscape::render::{Headless, HeadlessOptions};
use clipscape::shade::ViewMode;
use clipscape::source::Synth;
use clipscape::stats::percentile;
use clipscape::stream::{Flown, Terrain, TileOptions};
use clipscape::{Error, Result};
use glam::DVec3;

const FPS: f64 = 30.0;

fn main() -> Result<()> {
    let asked: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let all = asked.is_empty();
    let wants = |what: &str| all || asked.iter().any(|a| a == what);
    let folder = std::env::temp_dir().join(format!("clipscape-bench-{}", std::process::id()));
    let made = if wants("flight") || wants("speeds") {
        Some(terrain_file(&folder)?)
    } else {
        None
    };
    let done = (|| {
        if let Some(path) = &made {
            if wants("flight") {
                flight(path, if all { 600 } else { 3000 })?;
            }
            if wants("speeds") {
                speeds(path, if all { 90 } else { 300 })?;
            }
        }
        if wants("size") {
            size(if all { 8 } else { 16 })?;
        }
        Ok(())
    })();
    // Nothing of it is of use to anybody.
    let _ = std::fs::remove_dir_all(&folder);
    done
}

/// The terrain file that is asked for, or one that is made.
fn terrain_file(folder: &Path) -> Result<PathBuf> {
    if let Some(path) = std::env::var_os("CLIPSCAPE_TERRAIN") {
        return Ok(path.into());
    }
    let path = folder.join("a.terrain.exr");
    std::fs::create_dir_all(folder).map_err(|e| Error::io(folder.display(), e))?;
    let options = PreprocessOptions {
        memory_bytes: 4 << 30,
        light: Some(LightOptions {
            sky_directions: 0,
            ..Default::default()
        }),
        ..Default::default()
    };
    preprocess(&Synth::new(4096, 1)?, &path, &options, &Silent)?;
    Ok(path)
}

/// Asks the system to forget what it holds of a file (`posix_fadvise`, by `dd`); whether it did.
fn forget(path: &Path) -> bool {
    let of = format!("of={}", path.display());
    let dd = std::process::Command::new("dd")
        .args([&of, "oflag=nocache", "conv=notrunc,fdatasync", "count=0"])
        .stderr(std::process::Stdio::null())
        .status();
    dd.is_ok_and(|status| status.success())
}

/// CPU time of this thread so far, where the system tells (Linux): it does its sums when a thread yields.
fn cpu_ms() -> Option<f64> {
    std::thread::yield_now();
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let ns: f64 = text.split_whitespace().next()?.parse().ok()?;
    Some(ns / 1e6)
}

/// Round and round, 300 m over the middle of the DEM's heights, at a speed in m/s, starting at the centre.
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

/// How high these flights are: over all ground.
fn height_m(terrain: &Terrain) -> Result<f64> {
    let [_, high] = clipscape::clipmap::height_range_m(terrain)?;
    Ok(f64::from(high) + terrain.grid().base_m + 100.0)
}

fn flight(path: &Path, frames: u32) -> Result<()> {
    let cold = forget(path);
    let tiles = TileOptions::default();
    let terrain = Terrain::open(path, &Silent)?.with_tiles(&tiles)?;
    let height_m = height_m(&terrain)?;
    let arriving = terrain.arriving();
    let mut clipmap = Clipmap::new(&arriving, &options())?;
    let (mut cpu, mut wall) = (Vec::new(), Vec::new());
    let mut complete = 0;
    for k in 0..frames {
        let time_s = f64::from(k) / FPS;
        let view = view(&arriving, height_m, 300.0, time_s)?;
        let (before, start) = (cpu_ms(), Instant::now());
        let report = *clipmap.update(&arriving, &view, time_s)?;
        let took = start.elapsed();
        wall.push(took.as_secs_f64() * 1e3);
        cpu.extend(cpu_ms().zip(before).map(|(after, before)| after - before));
        complete += u32::from(report.complete);
        // Frames come when they are due.
        std::thread::sleep(Duration::from_secs_f64(1.0 / FPS).saturating_sub(took));
    }
    let page_cache = if cold { "cold" } else { "as it was" };
    println!("\n{frames} frames at 300 m/s, 30 a second, page cache {page_cache}: milliseconds of an update");
    println!("| | median | p99 | p99.9 | greatest | share below 4 ms |");
    println!("|---|---|---|---|---|---|");
    for (name, mut of) in [("CPU", cpu), ("wall", wall)] {
        if of.is_empty() {
            continue;
        }
        // The first frame waits for its coarsest level.
        of.remove(0);
        of.sort_by(f64::total_cmp);
        let below = of.iter().filter(|ms| **ms < 4.0).count() as f64 / of.len() as f64;
        let at = |p| percentile(&of, p);
        println!(
            "| {name} | {:.3} | {:.3} | {:.3} | {:.3} | {:.4} |",
            at(50.0),
            at(99.0),
            at(99.9),
            at(100.0),
            below
        );
    }
    println!(
        "complete: {complete} of {frames} frames; most memory for tiles {:.1} of {:.1} MiB",
        terrain.most_tile_bytes() as f64 / 1_048_576.0,
        tiles.memory_bytes as f64 / 1_048_576.0
    );
    Ok(())
}

fn speeds(path: &Path, frames: u32) -> Result<()> {
    println!("\nshare of complete frames of {frames}, 30 a second, cold page cache");
    println!("| m/s | complete | fresh up to, predicted m/s |");
    println!("|---|---|---|");
    for speed in [100.0, 300.0, 1000.0, 3000.0, 10_000.0] {
        forget(path);
        let terrain = Terrain::open(path, &Silent)?;
        let height_m = height_m(&terrain)?;
        let arriving = terrain.arriving();
        let mut clipmap = Clipmap::new(&arriving, &options())?;
        let mut complete = 0;
        // A second to arrive.
        for k in 0..30 + frames {
            let start = Instant::now();
            let time_s = f64::from(k) / FPS;
            let flown_s = (time_s - 1.0).max(0.0);
            let view = view(&arriving, height_m, speed, flown_s)?;
            let report = *clipmap.update(&arriving, &view, time_s)?;
            complete += u32::from(k >= 30 && report.complete);
            std::thread::sleep(Duration::from_secs_f64(1.0 / FPS).saturating_sub(start.elapsed()));
        }
        let flown = Flown {
            clip_size: 256,
            levels: clipmap.windows().len() as u32,
            upload_budget_bytes: None,
            fps: FPS,
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

/// Frames over both terrains in turn, at their centres, with as many levels as fit the smaller one.
fn size(rounds: u32) -> Result<()> {
    let gpu = match gpu::open() {
        Ok(gpu) => gpu,
        Err(error) => {
            println!("\nno frames of two sizes: {error}");
            return Ok(());
        }
    };
    let terrains = [4096, 1 << 20].map(|size| Synth::new(size, 1).map(Terrain::from_synth));
    let [small, large] = terrains;
    let terrains = [small?, large?];
    let levels = terrains[0].grid().levels_until(256);
    let mut headless = Vec::new();
    for terrain in &terrains {
        let options = HeadlessOptions {
            size_px: [640, 360],
            sample_count: 1,
            view_mode: ViewMode::Shaded,
            tint: true,
            haze: true,
            traced_light: false,
            sun: Sun::default(),
            clipmap: ClipmapOptions {
                levels: Some(levels),
                ..Default::default()
            },
        };
        headless.push(Headless::new(gpu.clone(), terrain, &options)?);
    }
    // As high over the ground of the one as of the other.
    let mut start = Vec::new();
    for terrain in &terrains {
        let grid = terrain.grid();
        let centre = grid.size.width as f64 / 2.0 * grid.spacing_m[0];
        let ground = S0::new(terrain).height_at(centre, centre)?;
        start.push(DVec3::new(centre, ground.unwrap_or_default() + 1500.0, centre));
    }
    let mut times = [Vec::new(), Vec::new()];
    let mut triangles = [0, 0];
    let frames = 30;
    for round in 0..rounds {
        for k in 0..frames {
            for (which, terrain) in terrains.iter().enumerate() {
                let at = f64::from(round * frames + k);
                let camera = Camera {
                    eye: start[which] + DVec3::new(20.0 * at, 0.0, -10.0 * at),
                    heading_deg: 5.0 * at,
                    pitch_deg: -15.0,
                    roll_deg: 0.0,
                    fov_deg: 60.0,
                };
                let frame = headless[which].frame(terrain, &camera, 0.0)?;
                // The first fills the windows.
                if round > 0 || k > 0 {
                    times[which].push(frame.frame_ms);
                    triangles[which] += frame.draw.triangles;
                }
            }
        }
    }
    let [small, large] = times.map(|mut of| {
        of.sort_by(f64::total_cmp);
        (percentile(&of, 50.0), percentile(&of, 99.0))
    });
    println!(
        "\nframe time, {levels} levels, 640x360, {} frames each in turn: milliseconds",
        rounds * frames - 1
    );
    println!("| synth | median | p99 |");
    println!("|---|---|---|");
    println!("| 4096 | {:.2} | {:.2} |", small.0, small.1);
    println!("| 1048576 | {:.2} | {:.2} |", large.0, large.1);
    let [small_count, large_count] = triangles.map(|n| n as f64);
    println!("| ratio | {:.3} | {:.3} |", large.0 / small.0, large.1 / small.1);
    println!("triangles: {:.3} times as many", large_count / small_count);
    Ok(())
}
