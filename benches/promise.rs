//! A promised error against plain clipmaps and against the whole DEM as one mesh: triangles, time, and how wrong each is.
//!
//!     cargo bench --bench promise [-- ROUNDS [INPUT [X,Y,W,H [PIXELS]]]]
//!
//! INPUT (the shipped DEM if none is given) may be cut to W x H samples from column X and row Y, so that its mesh fits into
//! one texture. Six cameras look over it, from 200 m to 4 km above its ground. For each, the mesh, plain clipmaps of
//! growing clip size and clipmaps that promise PIXELS (1) are drawn in turn; printed are triangles and wall milliseconds from
//! recording to completion (medians over cameras and rounds), the errors of all cameras' frames pooled, measured alike, and
//! what was certified of them. Then the smallest plain clipmap that measures no more than each promise.
#![allow(clippy::print_stdout, reason = "a bench prints its table")]

mod support;

use std::path::PathBuf;

use clipscape::accuracy::{DepthImage, ErrorPool, ErrorSummary, measure, measure_drawn};
use clipscape::build::Threads;
use clipscape::camera::{Camera, View};
use clipscape::clipmap::{ClipmapOptions, Drawn, certify};
use clipscape::grid::Rect;
use clipscape::levels::{Arrival, Levels};
use clipscape::progress::Silent;
use clipscape::query::{S0, Surface, Truth};
use clipscape::render::{Headless, HeadlessOptions};
use clipscape::source::{Crop, OpenOptions};
use clipscape::stream::Terrain;
use clipscape::{Error, ErrorKind, Result};
use glam::DVec3;
use support::mesh::Mesh;
use support::rounds::median;
use support::{Targets, met, options};

const SIZE_PX: [u32; 2] = [1280, 720];

const PLAIN: [i64; 5] = [128, 256, 512, 1024, 2048];

const PROMISING: [i64; 3] = [512, 1024, 2048];

/// Metres above the ground, heading and pitch in degrees.
const CAMERAS: [[f64; 3]; 6] = [
    [200.0, 25.0, -8.0],
    [200.0, 205.0, -4.0],
    [1000.0, 115.0, -12.0],
    [1000.0, 295.0, -8.0],
    [4000.0, 25.0, -30.0],
    [4000.0, 205.0, -20.0],
];

/// A way to draw, and what became of it.
struct Case {
    name: String,
    /// None for the mesh.
    headless: Option<Headless>,
    promised: bool,
    triangles: Vec<f64>,
    ms: Vec<f64>,
    pool: ErrorPool,
    certified_px: f64,
    /// Frames that certify what is promised.
    kept: usize,
}

impl Case {
    fn errors(&self) -> ErrorSummary {
        self.pool.summary()
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let number = |k: usize| arguments.get(k).and_then(|a| a.parse::<f64>().ok());
    let rounds = number(0).map_or(3, |n| n as usize).max(1);
    let input = arguments.get(1).map_or("data/N42E001.hgt", String::as_str);
    let part = arguments
        .get(2)
        .map(|a| a.split(',').filter_map(|n| n.parse().ok()).collect());
    if let Err(error) = run(rounds, input, part, number(3).unwrap_or(1.0)) {
        println!("promise: {error}");
        std::process::exit(1);
    }
}

fn run(rounds: usize, input: &str, part: Option<Vec<i64>>, promised_px: f64) -> Result<()> {
    let crop = match part.as_deref() {
        None => None,
        Some(&[x, y, width, height]) => Some(Crop::Samples(Rect::new(x, y, x + width, y + height))),
        Some(_) => return Err(Error::new(ErrorKind::Misuse, "part", "it is not X,Y,W,H")),
    };
    let open = OpenOptions {
        crop,
        ..Default::default()
    };
    let terrain = Terrain::open_with(&[PathBuf::from(input)], &open, &Silent)?;
    let grid = *terrain.grid();
    let mut heights = vec![0.0; grid.size.samples() as usize];
    if terrain.heights(0, grid.size.rect(), &mut heights)? == Arrival::Missing {
        return Err(Error::new(
            ErrorKind::Unsupported,
            input,
            "its level 0 is not there",
        ));
    }
    let gpu = clipscape::gpu::open()?;
    let targets = Targets::new(&gpu, SIZE_PX);
    let headless = |clip_size, max_error_px| {
        let plain = options(SIZE_PX, true);
        let options = HeadlessOptions {
            clipmap: ClipmapOptions {
                clip_size,
                max_error_px,
                ..plain.clipmap
            },
            ..plain
        };
        Headless::new(gpu.clone(), &terrain, &options)
    };
    // It lends the mesh its view.
    let mut lender = headless(PLAIN[0], None)?;
    let mesh = Mesh::new(&gpu, &grid, &heights, &lender)?;
    let case = |name: String, headless: Option<Headless>, promised| Case {
        name,
        headless,
        promised,
        triangles: Vec::new(),
        ms: Vec::new(),
        pool: ErrorPool::default(),
        certified_px: 0.0,
        kept: 0,
    };
    let mut cases = vec![case("mesh".into(), None, false)];
    for clip_size in PLAIN {
        cases.push(case(
            format!("plain {clip_size}"),
            Some(headless(clip_size, None)?),
            false,
        ));
    }
    for clip_size in PROMISING {
        let name = format!("promise {promised_px} px, {clip_size}");
        cases.push(case(name, Some(headless(clip_size, Some(promised_px))?), true));
    }

    let (truth, threads) = (Truth::new(&terrain, 1.0), Threads::new(0)?);
    for (k, view) in views(&terrain)?.into_iter().enumerate() {
        lender.frame_of(&terrain, &view, 0.0)?;
        for case in &mut cases {
            if let Some(headless) = &mut case.headless {
                headless.frame_of(&terrain, &view, 0.0)?;
                let certified_px = certify(headless.clipmap())?.error_px.unwrap_or(f64::INFINITY);
                case.certified_px = case.certified_px.max(certified_px);
                case.kept += usize::from(certified_px <= promised_px);
            }
        }
        for round in 0..rounds {
            for case in &mut cases {
                let (ms, triangles) = match &case.headless {
                    None => (
                        targets.draw_ms(|pass| mesh.draw(pass, &lender))?,
                        mesh.triangles() as f64,
                    ),
                    Some(headless) => {
                        targets.clipmap_ms(headless)?; // what the one before left in caches is not this one's
                        let triangles = headless.clipmap().selection().triangles();
                        (targets.clipmap_ms(headless)?, triangles as f64)
                    }
                };
                case.ms.push(ms);
                case.triangles.push(triangles);
                if round == 0 {
                    let (_, depths) = targets.read()?;
                    let image = DepthImage::new(&depths, &view)?;
                    let errors = match &case.headless {
                        None => measure(&truth, &image, &threads)?,
                        Some(headless) => {
                            measure_drawn(&truth, &Drawn::new(headless.clipmap())?, &image, &threads)?
                        }
                    };
                    case.pool.add(k as u64, &errors);
                }
            }
        }
    }
    let size = grid.size;
    println!(
        "{} ({}), {}x{} pixels, {} x {} samples, {} cameras, {rounds} rounds",
        gpu.info.name,
        gpu.driver(),
        SIZE_PX[0],
        SIZE_PX[1],
        size.width,
        size.height,
        CAMERAS.len()
    );
    print(&cases);
    Ok(())
}

fn print(cases: &[Case]) {
    println!(
        "setting: triangles, ms; error max, 99th percentile, rms px; certified px (frames that keep the promise)"
    );
    for case in cases {
        let errors = case.errors();
        let certified = match &case.headless {
            None => String::new(),
            Some(_) => format!("; {:.2} ({} of {})", case.certified_px, case.kept, CAMERAS.len()),
        };
        println!(
            "{}: {:.0}, {:.1}; {:.3}, {:.3}, {:.4}{certified}",
            case.name,
            median(&case.triangles),
            median(&case.ms),
            errors.error_px_max,
            errors.error_px_p99,
            errors.error_px_rms
        );
    }
    for case in cases.iter().filter(|c| c.promised) {
        let plain = cases.iter().filter(|c| c.headless.is_some() && !c.promised);
        let mut enough = plain.filter(|c| c.errors().error_px_max <= case.errors().error_px_max);
        let Some(plain) = enough.next() else {
            println!("{}: no plain clipmap measures as little", case.name);
            continue;
        };
        let [triangles, ms] = [
            median(&plain.triangles) / median(&case.triangles),
            median(&plain.ms) / median(&case.ms),
        ];
        println!(
            "{}: {} measures no more, with {triangles:.2} times the triangles (aim 2, {}) and {ms:.2} times the time",
            case.name,
            plain.name,
            met(triangles >= 2.0)
        );
    }
}

/// Over the middle of the DEM.
fn views(terrain: &Terrain) -> Result<Vec<View>> {
    let (grid, ground) = (terrain.grid(), S0::new(terrain));
    let x = 0.47 * (grid.size.width - 1) as f64 * grid.spacing_m[0];
    let z = 0.53 * (grid.size.height - 1) as f64 * grid.spacing_m[1];
    let height_m = ground.height_at(x, z)?.unwrap_or(0.0);
    CAMERAS
        .iter()
        .map(|&[above_m, heading_deg, pitch_deg]| {
            let camera = Camera {
                eye: DVec3::new(x, height_m + above_m, z),
                heading_deg,
                pitch_deg,
                roll_deg: 0.0,
                fov_deg: 60.0,
            };
            View::new(camera, SIZE_PX)
        })
        .collect()
}
