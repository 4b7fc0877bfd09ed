//! Rays over a DEM's own surface: how many a second, by the fast caster and by the plain one, and how exact.
//!
//!     cargo bench --bench rays [-- ROUNDS [DEM...]]
//!
//! For each DEM (the shipped one and a procedural one if none is given) three frames of 1280x720 are cast, one ray a
//! pixel on all cores, by both in turn; printed are medians over the rounds. The plain caster casts every 7th row. Both
//! must hit the same triangles at the same distance, to the bit; the bench counts where they do not. How far both are from
//! closed forms (a plane, a spike, a cone) is told by `cargo test --test truth -- --nocapture`.
#![allow(clippy::print_stdout, reason = "a bench prints its table")]

#[path = "support/rounds.rs"]
mod rounds;

use std::time::Instant;

use clipscape::build::Threads;
use clipscape::camera::{Camera, View, overview};
use clipscape::levels::Levels;
use clipscape::progress::Silent;
use clipscape::query::{Crossing, Picker, Probe, S0, Surface, Truth};
use clipscape::stream::Terrain;
use clipscape::work::{Work, each_chunk};
use clipscape::{Error, Result};
use glam::DVec3;
use rounds::{median, rounds_and_dems};

const SIZE_PX: [u32; 2] = [1280, 720];

/// Every how many rows the plain caster casts.
const PLAIN_ROWS: usize = 7;

fn main() {
    let (rounds, dems) = rounds_and_dems(5, "synth:4096:7");
    println!("DEM, size, frame: Mray/s fast, plain; times as fast; hits; unlike the plain caster's");
    for dem in &dems {
        if let Err(error) = table(dem, rounds) {
            println!("rays: {error}");
            std::process::exit(1);
        }
    }
}

fn table(dem: &str, rounds: usize) -> Result<()> {
    let terrain = Terrain::open(dem, &Silent)?;
    let threads = Threads::new(0)?;
    let size = terrain.grid().size;
    for (name, camera) in cameras(&terrain)? {
        let view = View::new(camera, SIZE_PX)?;
        let (truth, plain) = (Truth::new(&terrain, 1.0), S0::new(&terrain));
        let (mut fast_mray, mut plain_mray) = (Vec::new(), Vec::new());
        let (mut hits, mut unlike) = (0, 0);
        for _ in 0..rounds {
            let start = Instant::now();
            let fast = cast(&threads, 1, |row, out| {
                let mut probe = Probe::new(&truth, &view)?;
                each_pixel(row, out, |pixel| probe.cast(pixel))
            })?;
            fast_mray.push(fast.len() as f64 / 1e6 / start.elapsed().as_secs_f64());
            let start = Instant::now();
            let slow = cast(&threads, PLAIN_ROWS, |row, out| {
                let mut picker = Picker::new(&plain, &view)?;
                each_pixel(row, out, |pixel| picker.cast(pixel))
            })?;
            plain_mray.push(slow.len() as f64 / 1e6 / start.elapsed().as_secs_f64());
            hits = fast.iter().flatten().count();
            let width = SIZE_PX[0] as usize;
            let rows = fast.chunks(width).step_by(PLAIN_ROWS).flatten();
            unlike = rows.zip(&slow).filter(|(a, b)| !alike(a, b)).count();
        }
        let (fast, plain) = (median(&fast_mray), median(&plain_mray));
        println!(
            "{dem}, {} x {}, {name}: {fast:.2}, {plain:.2}; {:.1}; {hits}; {unlike}",
            size.width,
            size.height,
            fast / plain
        );
    }
    Ok(())
}

fn alike(a: &Option<Crossing>, b: &Option<Crossing>) -> bool {
    match (a, b) {
        // A void corner is unlike itself.
        (Some(a), Some(b)) => {
            (a.along, a.height_m, a.cell, a.triangle) == (b.along, b.height_m, b.cell, b.triangle)
        }
        (a, b) => a.is_none() && b.is_none(),
    }
}

/// Every `step`th row of a picture, a task each.
fn cast(
    work: &dyn Work,
    step: usize,
    row: impl Fn(usize, &mut [Option<Crossing>]) -> Result<()> + Sync,
) -> Result<Vec<Option<Crossing>>> {
    let width = SIZE_PX[0] as usize;
    let rows = (SIZE_PX[1] as usize).div_ceil(step);
    let mut out = vec![None; width * rows];
    let failed = std::sync::Mutex::new(None::<Error>);
    each_chunk(work, &mut out, width, |k, out| {
        if let Err(error) = row(k * step, out) {
            *failed.lock().expect("no task panics") = Some(error);
        }
    });
    match failed.into_inner().expect("no task panics") {
        Some(error) => Err(error),
        None => Ok(out),
    }
}

fn each_pixel(
    row: usize,
    out: &mut [Option<Crossing>],
    mut cast: impl FnMut([f64; 2]) -> Result<Option<Crossing>>,
) -> Result<()> {
    for (x, out) in out.iter_mut().enumerate() {
        *out = cast([x as f64 + 0.5, row as f64 + 0.5])?;
    }
    Ok(())
}

/// The whole DEM, a look along a valley's height, and one straight ahead close to the ground.
fn cameras(terrain: &Terrain) -> Result<[(&'static str, Camera); 3]> {
    let grid = terrain.grid();
    let s0 = S0::new(terrain);
    let at = |share: f64| [grid.size.width, grid.size.height].map(|n| share * (n - 1) as f64);
    let [i, j] = at(0.4);
    let [x, z] = [i * grid.spacing_m[0], j * grid.spacing_m[1]];
    let ground = s0.height_at(x, z)?.unwrap_or(0.0);
    let camera = |above_m: f64, pitch_deg| Camera {
        eye: DVec3::new(x, ground + above_m, z),
        heading_deg: 25.0,
        pitch_deg,
        roll_deg: 0.0,
        fov_deg: 60.0,
    };
    Ok([
        ("whole", overview(grid, 0.0, 3000.0, 16.0 / 9.0)),
        ("high", camera(2000.0, -20.0)),
        ("grazing", camera(50.0, 0.0)),
    ])
}
