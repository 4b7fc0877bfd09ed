//! Writes all heights of a DEM, as a program of one's own would read them: metres as little-endian f64, row by row from
//! the north, NaN for no data. Comparisons with other programs read them.
//!
//! `cargo run --example heights -- OUT INPUT... [--band N|NAME]`; prints columns, rows, the base height and the type of
//! samples.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program's own output")]

use std::fs::File;
use std::io::{BufWriter, Write};
use std::process::ExitCode;

use clipscape::error::{Error, Result};
use clipscape::grid::Rect;
use clipscape::source::{Band, OpenOptions, open_with};

fn main() -> ExitCode {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let mut options = OpenOptions::default();
    if let Some(at) = arguments
        .iter()
        .position(|a| a == "--band")
        .filter(|at| at + 1 < arguments.len())
    {
        let band = arguments.drain(at..at + 2).nth(1).unwrap_or_default();
        options.band = Some(band.parse().map_or(Band::Name(band), Band::Number));
    }
    let [out, inputs @ ..] = &arguments[..] else {
        eprintln!("usage: heights OUT INPUT... [--band N|NAME]");
        return 2.into();
    };
    match write(out, inputs, &options) {
        Ok(line) => {
            println!("{line}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn write(out: &str, inputs: &[String], options: &OpenOptions) -> Result<String> {
    let source = open_with(inputs, options)?;
    let description = source.description();
    let (size, base_m) = (description.grid.size, description.grid.base_m);
    let failed = |error| Error::io(out, error);
    let mut file = BufWriter::new(File::create(out).map_err(failed)?);
    let rows = ((1 << 20) / size.width).clamp(1, size.height);
    let mut band = Vec::new();
    for z in (0..size.height).step_by(rows as usize) {
        let rect = Rect::new(0, z, size.width, (z + rows).min(size.height));
        band.resize(rect.area() as usize, 0.0);
        source.read(rect, &mut band)?;
        for height in &band {
            let height_m = f64::from(*height) + base_m;
            file.write_all(&height_m.to_le_bytes()).map_err(failed)?;
        }
    }
    file.flush().map_err(failed)?;
    let kind = &description.sample_type;
    Ok(format!("{} {} {base_m:?} {kind}", size.width, size.height))
}
