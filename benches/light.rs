//! The sun's share and the sky's share of a DEM, on all cores and on one: how long, a sample and in all.
//!
//!     cargo bench --bench light [-- ROUNDS [DEM...]]
//!
//! Printed are medians over the rounds. Results of one core and of all must be the same, to the bit.
#![allow(clippy::print_stdout, reason = "a bench prints its table")]

#[path = "support/rounds.rs"]
mod rounds;

use std::path::PathBuf;
use std::time::Instant;

use clipscape::Result;
use clipscape::build::Threads;
use clipscape::light::{Sun, sky_share, sun_share};
use clipscape::progress::Silent;
use clipscape::source;
use clipscape::work::{Serial, Work};
use rounds::{median, rounds_and_dems};

fn main() {
    let (rounds, dems) = rounds_and_dems(3, "synth:2048:7");
    println!("DEM, size, light: s and ns a sample on all cores, on one");
    for dem in &dems {
        if let Err(error) = table(dem, rounds) {
            println!("light: {error}");
            std::process::exit(1);
        }
    }
}

fn table(dem: &str, rounds: usize) -> Result<()> {
    let source = source::open_with(&[PathBuf::from(dem)], &source::OpenOptions::default())?;
    let grid = source.description().grid;
    let mut heights = vec![0.0; grid.size.samples() as usize];
    source.read(grid.size.rect(), &mut heights)?;
    let threads = Threads::new(0)?;
    let suns =
        [(135.0, 3.0), (120.0, 3.0), (120.0, 0.5), (315.0, 45.0)].map(|(azimuth_deg, altitude_deg)| {
            let sun = Sun {
                azimuth_deg,
                altitude_deg,
            };
            (format!("sun {azimuth_deg}, {altitude_deg}"), Some(sun))
        });
    for (name, sun) in suns.into_iter().chain([("sky 4".to_string(), None)]) {
        let trace = |work: &dyn Work| {
            let start = Instant::now();
            let share = match sun {
                Some(sun) => sun_share(&heights, &grid, sun, work, &Silent)?,
                None => sky_share(&heights, &grid, 4, work, &Silent)?,
            };
            Ok::<_, clipscape::Error>((start.elapsed().as_secs_f64(), share))
        };
        let (mut all_s, mut one_s, mut same) = (Vec::new(), Vec::new(), true);
        for _ in 0..rounds {
            let (all, one) = (trace(&threads)?, trace(&Serial)?);
            same &= all.1.iter().zip(&one.1).all(|(a, b)| a.to_bits() == b.to_bits());
            all_s.push(all.0);
            one_s.push(one.0);
        }
        let (all, one) = (median(&all_s), median(&one_s));
        let ns = |seconds: f64| seconds * 1e9 / grid.size.samples() as f64;
        println!(
            "{dem}, {} x {}, {name}: {all:.3} s, {:.0} ns; {one:.3} s, {:.0} ns{}",
            grid.size.width,
            grid.size.height,
            ns(all),
            ns(one),
            if same { "" } else { "; THEY DIFFER" }
        );
    }
    Ok(())
}
