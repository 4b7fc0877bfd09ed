//! What the dial and the certificate cost on the CPU.
//!
//!     cargo bench --no-default-features --bench dial [-- ROUNDS [INPUT FLIGHT]]
//!
//! Along a flight (the shipped one over the shipped DEM if none is given) every frame is updated three times: windows moved
//! and patches selected; the same once more, when nothing is left to be read, which is the selection alone, the dial
//! included; then certified. Printed are medians over frames and rounds, in milliseconds, for clip sizes 256 and 1024 and
//! three promises, flown in turn. The bench checks that a frame that is updated again draws the same.
#![allow(clippy::print_stdout, reason = "a bench prints its table")]

#[path = "support/rounds.rs"]
mod rounds;

use std::time::Instant;

use clipscape::camera::{Flight, View};
use clipscape::clipmap::{Clipmap, ClipmapOptions, certify};
use clipscape::progress::Silent;
use clipscape::stream::Terrain;
use clipscape::{Error, Result};
use rounds::median;

const SIZE_PX: [u32; 2] = [1280, 720];

/// Every how many frames of the flight one is flown.
const STRIDE: u64 = 4;

const CLIP_SIZES: [i64; 2] = [256, 1024];

const PROMISES_PX: [Option<f64>; 3] = [None, Some(1.0), Some(4.0)];

/// What a setting's frames took, and what they came to.
#[derive(Default)]
struct Row {
    update_ms: Vec<f64>,
    select_ms: Vec<f64>,
    certify_ms: Vec<f64>,
    triangles: Vec<f64>,
    certified_px: Vec<f64>,
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let rounds = arguments.first().and_then(|a| a.parse().ok()).unwrap_or(3);
    let named = |k: usize, other: &str| arguments.get(k).cloned().unwrap_or_else(|| other.into());
    let (input, flight) = (named(1, "data/N42E001.hgt"), named(2, "data/pyrenees.json"));
    if let Err(error) = run(rounds, &input, &flight) {
        println!("dial: {error}");
        std::process::exit(1);
    }
}

fn run(rounds: usize, input: &str, flight: &str) -> Result<()> {
    let terrain = Terrain::open(input, &Silent)?;
    let json = std::fs::read_to_string(flight).map_err(|e| Error::io(flight, e))?;
    let flight = Flight::parse(flight, &json)?;
    // A flight of a few frames is flown whole.
    let stride = if flight.frame_count() > 40 { STRIDE } else { 1 };
    let frames: Vec<u64> = (0..flight.frame_count()).step_by(stride as usize).collect();
    let size = clipscape::levels::Levels::grid(&terrain).size;
    println!(
        "{input}, {} x {} samples, {} frames of {}x{}, medians of {rounds} rounds",
        size.width,
        size.height,
        frames.len(),
        SIZE_PX[0],
        SIZE_PX[1]
    );
    println!(
        "clip size, promise: ms to move and select, to select alone, to certify; triangles; certified px (median, most)"
    );
    let settings: Vec<(i64, Option<f64>)> = CLIP_SIZES
        .iter()
        .flat_map(|size| PROMISES_PX.map(|promise| (*size, promise)))
        .collect();
    let mut rows: Vec<Row> = settings.iter().map(|_| Row::default()).collect();
    for _ in 0..rounds {
        for ((clip_size, max_error_px), row) in settings.iter().zip(&mut rows) {
            let options = ClipmapOptions {
                clip_size: *clip_size,
                max_error_px: *max_error_px,
                ..Default::default()
            };
            let mut clipmap = Clipmap::new(&terrain, &options)?;
            for &frame in &frames {
                let view = View::new(flight.camera_at_frame(frame), SIZE_PX)?;
                fly(&mut clipmap, &terrain, &view, flight.time_of_frame_s(frame), row)?;
            }
        }
    }
    for ((clip_size, max_error_px), row) in settings.iter().zip(rows) {
        let promise = max_error_px.map_or_else(|| "none".into(), |px| format!("{px} px"));
        let most = row.certified_px.iter().copied().fold(0.0, f64::max);
        println!(
            "{clip_size}, {promise}: {:.2}, {:.2}, {:.2}; {:.0}; {:.2}, {most:.2}",
            median(&row.update_ms),
            median(&row.select_ms),
            median(&row.certify_ms),
            median(&row.triangles),
            median(&row.certified_px)
        );
    }
    Ok(())
}

fn fly(clipmap: &mut Clipmap, terrain: &Terrain, view: &View, time_s: f64, row: &mut Row) -> Result<()> {
    let start = Instant::now();
    let triangles = clipmap.update(terrain, view, time_s)?.triangles;
    let moved = Instant::now();
    let again = clipmap.update(terrain, view, time_s)?.triangles;
    let selected = Instant::now();
    let certificate = certify(clipmap)?;
    let ms = |from: Instant, to: Instant| (to - from).as_secs_f64() * 1e3;
    row.update_ms.push(ms(start, moved));
    row.select_ms.push(ms(moved, selected));
    row.certify_ms.push(ms(selected, Instant::now()));
    row.triangles.push(triangles as f64);
    row.certified_px
        .push(certificate.error_px.unwrap_or(f64::INFINITY));
    if triangles != again {
        let what = format!("{triangles} and {again} triangles of one view");
        return Err(Error::new(clipscape::ErrorKind::Misuse, "selection", what));
    }
    Ok(())
}
