//! Reads a DEM through windows from north to south, as preprocessing does, and says how fast: one line a file.
//!
//! `cargo run --release --example read_dem -- FILE [ROWS]`, with windows of ROWS rows (256).
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program's own output")]

use std::path::Path;
use std::time::Instant;

use clipscape::grid::Rect;
use clipscape::source::{self, HeightSource};

fn main() -> std::process::ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some(file) = arguments.first() else {
        eprintln!("usage: read_dem FILE [ROWS]");
        return 2.into();
    };
    let rows = arguments.get(1).and_then(|rows| rows.parse().ok());
    let read = source::open(Path::new(file)).map_err(|e| e.to_string());
    let line = read.and_then(|source| pass(source.as_ref(), rows.unwrap_or(256)));
    match line {
        Ok(line) => println!("{line}"),
        Err(line) => {
            eprintln!("{line}");
            return 1.into();
        }
    }
    0.into()
}

/// Reads all of `source`, `rows` rows at once.
fn pass(source: &dyn HeightSource, rows: i64) -> Result<String, String> {
    let description = source.description();
    let (size, base_m) = (description.grid.size, description.grid.base_m);
    let rows = rows.clamp(1, size.height);
    let mut window = vec![0.0f32; (rows * size.width) as usize];
    let start = Instant::now();
    let mut voids = 0;
    for z in (0..size.height).step_by(rows as usize) {
        let rect = Rect::new(0, z, size.width, size.height.min(z + rows));
        let window = &mut window[..rect.area() as usize];
        source.read(rect, window).map_err(|e| e.to_string())?;
        voids += window.iter().filter(|h| h.is_nan()).count();
    }
    let seconds = start.elapsed().as_secs_f64();
    let reads = source.reads();
    let peak =
        clipscape::build::peak_rss_bytes().map_or("unknown".into(), |b| format!("{} MB", b / 1_000_000));
    Ok(format!(
        "{}: {} x {} samples, base {base_m:?}, {voids} voids, {} blocks, {} decoded, {seconds:.3} s, {:.1} Msample/s, \
         peak memory {peak}",
        description.name,
        size.width,
        size.height,
        reads.blocks,
        reads.decoded,
        size.samples() as f64 / seconds / 1e6,
    ))
}
