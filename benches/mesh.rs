//! The clipmap against the whole DEM as one full-resolution mesh, and how wrong the clipmap's frame is.
//!
//!     cargo bench --bench mesh [-- ROUNDS [SIZE [WxH]]]
//!
//! The DEM is `synth:SIZE:7` (4096 if none is given: 33.5 million triangles), filtered into a pyramid as any DEM is. The
//! mesh fetches its heights from one texture, in strips of rows that share an index buffer, and is shaded by the same
//! function as the clipmap, its slopes taken from a texture of the whole DEM. Cameras, size and run are the same; both
//! are drawn in turn, and printed are medians over the rounds, in wall milliseconds from recording to completion.
//!
//! *Error*: for each pixel of terrain in the clipmap's frame, P is the point drawn there, by its depth read back, Q the
//! point of the full-resolution surface above or below it, and the error the distance between their projections in
//! pixels. Measured likewise on the mesh's own frame it tells what the rasteriser's grid and f32 depth make of no error: nothing, but
//! where a pixel falls on a triangle seen on edge, whose depth there is anything.
#![allow(clippy::print_stdout, reason = "a bench prints its table")]

mod support;

use clipscape::Result;
use clipscape::camera::{Camera, View};
use clipscape::clipmap::near_m;
use clipscape::grid::Grid;
use clipscape::levels::Levels;
use clipscape::progress::Silent;
use clipscape::pyramid::{Filter, Pyramid};
use clipscape::render::Headless;
use clipscape::source::Synth;
use glam::DVec3;
use support::mesh::Mesh;
use support::rounds::{median, percentile};
use support::{Targets, met, options};

/// Screen errors of a frame's terrain pixels in pixels.
fn screen_errors(depth: &[f32], view: &View, pyramid: &Pyramid) -> Vec<f64> {
    let grid = pyramid.grid();
    let [x_row, y_row, w_row] = view.clip_rows();
    let size = view.size_px.map(f64::from);
    let project = |from_eye: DVec3| {
        let w = w_row.dot(from_eye);
        [
            (x_row.dot(from_eye) / w + 1.0) / 2.0 * size[0],
            (1.0 - y_row.dot(from_eye) / w) / 2.0 * size[1],
        ]
    };
    let mut errors = Vec::new();
    for (k, &depth) in depth.iter().enumerate().filter(|(_, d)| **d > 0.0) {
        let pixel = [k % view.size_px[0] as usize, k / view.size_px[0] as usize].map(|p| p as f64 + 0.5);
        let distance = near_m(grid) / f64::from(depth);
        let mut from_eye = view.ray(pixel) * distance;
        let place = view.eye + from_eye;
        let Some(height) = surface(pyramid, grid, place) else {
            continue; // beyond the last column or row by less than a rounding
        };
        from_eye.y = height - view.eye.y;
        let [qx, qy] = project(from_eye);
        errors.push((qx - pixel[0]).hypot(qy - pixel[1]));
    }
    errors
}

/// The height of the full-resolution surface at a place's x and z, none beside the DEM.
fn surface(pyramid: &Pyramid, grid: &Grid, place: DVec3) -> Option<f64> {
    let side = grid.size.width;
    let (x, z) = (place.x / grid.spacing_m[0], place.z / grid.spacing_m[1]);
    let last = (side - 1) as f64;
    if !((0.0..=last).contains(&x) && (0.0..=last).contains(&z)) {
        return None;
    }
    let (i, j) = ((x as i64).min(side - 2), (z as i64).min(side - 2));
    let (u, v) = (x - i as f64, z - j as f64);
    let at = |i: i64, j: i64| f64::from(pyramid.level(0)[(j * side + i) as usize]);
    let middle = if u >= v { at(i + 1, j) } else { at(i, j + 1) };
    let height = at(i, j) * (1.0 - u.max(v)) + middle * (u - v).abs() + at(i + 1, j + 1) * u.min(v);
    Some(height + grid.base_m)
}

fn main() {
    let mut arguments = std::env::args().skip(1).filter(|a| a != "--bench");
    let rounds = arguments.next().and_then(|a| a.parse().ok()).unwrap_or(3).max(1);
    let side = arguments.next().and_then(|a| a.parse().ok()).unwrap_or(4096);
    let size_px = arguments.next().and_then(|a| {
        let (width, height) = a.split_once('x')?;
        Some([width.parse().ok()?, height.parse().ok()?])
    });
    if let Err(error) = run(rounds, side, size_px.unwrap_or([1280, 720])) {
        println!("mesh: {error}");
        std::process::exit(1);
    }
}

fn run(rounds: usize, side: i64, size_px: [u32; 2]) -> Result<()> {
    let pyramid = clipscape::build::build_pyramid(&Synth::new(side, 7)?, &Filter::default(), &Silent)?;
    let gpu = clipscape::gpu::open()?;
    let mut headless = Headless::new(gpu.clone(), &pyramid, &options(size_px, true))?;
    let mesh = Mesh::new(&gpu, pyramid.grid(), pyramid.level(0), &headless)?;
    let targets = Targets::new(&gpu, size_px);
    println!(
        "{} ({}), {}x{} pixels, {side} x {side} samples, {} triangles in the mesh, medians of {rounds} rounds",
        gpu.info.name,
        gpu.driver(),
        size_px[0],
        size_px[1],
        mesh.triangles()
    );
    println!("ms: clipmap, mesh, times as fast (aim: at least 20); error of the frame in pixels");
    for (name, camera) in cameras(&pyramid) {
        headless.frame(&pyramid, &camera, 0.0)?;
        let triangles = headless.clipmap().selection().triangles();
        let (mut ours, mut theirs) = (Vec::new(), Vec::new());
        for _ in 0..rounds {
            targets.clipmap_ms(&headless)?;
            ours.push(targets.clipmap_ms(&headless)?);
            theirs.push(targets.draw_ms(|pass| mesh.draw(pass, &headless))?);
        }
        let (full_colour, full_depth) = targets.read()?;
        targets.clipmap_ms(&headless)?;
        let (colour, depth) = targets.read()?;
        let view = View::new(camera, size_px)?;
        let ratio = median(&theirs) / median(&ours);
        println!(
            "{name}: {:.1}, {:.0}, {ratio:.1} {}; {triangles} triangles",
            median(&ours),
            median(&theirs),
            met(ratio >= 20.0)
        );
        for (what, depth) in [("the clipmap's frame", &depth), ("the mesh's own", &full_depth)] {
            let errors = screen_errors(depth, &view, &pyramid);
            if errors.is_empty() {
                println!("  {what}: no terrain");
                continue;
            }
            let rms = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
            println!(
                "  {what}: max {:.3}, 99th percentile {:.3}, rms {rms:.4} px, over {} pixels, {} of them above 1 px",
                percentile(&errors, 100.0),
                percentile(&errors, 99.0),
                errors.len(),
                errors.iter().filter(|e| **e > 1.0).count()
            );
        }
        let apart = colour
            .iter()
            .zip(&full_colour)
            .map(|(a, b)| f64::from(a.abs_diff(*b)));
        println!(
            "  colours differ by {:.2} of 255 in the mean",
            apart.sum::<f64>() / colour.len() as f64
        );
    }
    Ok(())
}

/// Cameras over the middle of the DEM: low, looking to the horizon, and high, looking down.
fn cameras(pyramid: &Pyramid) -> [(&'static str, Camera); 2] {
    let grid = pyramid.grid();
    let middle = grid.spacing_m.map(|s| (0.5 * grid.size.width as f64 + 0.3) * s);
    let at = |above_m: f64| {
        let place = DVec3::new(middle[0], 0.0, middle[1]);
        let ground = surface(pyramid, grid, place).unwrap_or(0.0);
        DVec3::new(place.x, ground + above_m, place.z)
    };
    let camera = |eye, pitch_deg| Camera {
        eye,
        heading_deg: 25.0,
        pitch_deg,
        roll_deg: 0.0,
        fov_deg: 60.0,
    };
    [
        ("low", camera(at(300.0), -8.0)),
        ("high", camera(at(6000.0), -30.0)),
    ]
}
