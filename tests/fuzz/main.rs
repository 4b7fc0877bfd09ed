//! Broken DEMs by the thousand: valid and invalid files of each format are damaged at random and read. Whatever comes out,
//! there is no panic, no lack of an answer, and no more memory than the file's own length justifies.
//!
//! A short form runs with the other tests. The full one, here ten minutes for each format, in any number of processes:
//!
//! ```sh
//! CLIPSCAPE_FUZZ_S=600 cargo test --release --test fuzz -- --test-threads 13   # all formats side by side
//! CLIPSCAPE_FUZZ_S=600 CLIPSCAPE_FUZZ_SEED=7 cargo test --release --test fuzz png   # one format, other damage
//! ```
//!
//! A finding is written to `target/tmp/fuzz-FORMAT` (also one that ends the process, as an allocation beyond all memory
//! does) and named by its seed and round.
#![cfg(feature = "dem")]
#![allow(clippy::print_stdout, reason = "what was run is printed")]

mod corpus;
mod mutate;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use clipscape::grid::{Rect, Size};
use clipscape::progress::Silent;
use clipscape::source::{OpenOptions, open_bytes};

use corpus::Format;
use mutate::{Random, mutate};

/// Rounds of the short form.
const ROUNDS: u64 = 4000;
/// Memory that any file may take.
const FREE_BYTES: u64 = 64 << 20;
/// The longest that a file of some kilobytes may take, on a machine that does other things too.
const LONGEST: Duration = Duration::from_secs(10);
/// Samples that are read of what opens.
const READ_SAMPLES: i64 = 1 << 20;

/// What reading a file showed.
#[derive(Debug)]
struct Outcome {
    /// Bytes that the samples take as the file claims them; 0 where it is refused.
    claimed: u64,
    read: bool,
}

/// Opens the file and reads its first and last rows.
fn read(name: &str, bytes: Vec<u8>, options: &OpenOptions) -> Outcome {
    let refused = Outcome {
        claimed: 0,
        read: false,
    };
    let Ok(source) = open_bytes(name, Arc::new(bytes), options) else {
        return refused;
    };
    let Size { width, height } = source.description().grid.size;
    let columns = width.min(READ_SAMPLES);
    let rows = (READ_SAMPLES / columns).clamp(1, height);
    let mut out = vec![0.0; (columns * rows) as usize];
    let mut whole = true;
    for (x, z) in [(0, 0), (width - columns, height - rows)] {
        whole &= source
            .read(Rect::new(x, z, x + columns, z + rows), &mut out)
            .is_ok();
        assert!(
            !whole || out.iter().all(|h| !h.is_infinite()),
            "infinities are no heights"
        );
    }
    // What is larger is not looked through: a sparse file may claim more than can be read in the time.
    if width * height <= READ_SAMPLES {
        let _ = source.remarks(&Silent);
    }
    Outcome {
        claimed: (width as u64).saturating_mul(height as u64).saturating_mul(8),
        read: whole,
    }
}

/// What is wrong with how `target` took a file of `length` bytes, if anything.
fn fault(length: u64, target: impl FnOnce() -> Outcome) -> Result<bool, String> {
    let start = Instant::now();
    let mut outcome = None;
    let memory = allocation_counter::measure(|| {
        outcome = Some(catch_unwind(AssertUnwindSafe(target)));
    });
    let took = start.elapsed();
    let outcome = match outcome {
        Some(Ok(outcome)) => outcome,
        _ => return Err("it panicked".into()),
    };
    // The heights that are read of it are the test's own.
    let own = 4 * READ_SAMPLES as u64;
    let most = FREE_BYTES + own + 4 * outcome.claimed.min(1000 * length);
    if memory.bytes_max > most {
        return Err(format!("it took {} bytes, {most} are allowed", memory.bytes_max));
    }
    if took > LONGEST {
        return Err(format!("it took {took:?}"));
    }
    Ok(outcome.read)
}

fn variable(name: &str) -> Option<u64> {
    let text = std::env::var(name).ok()?;
    Some(
        text.parse()
            .unwrap_or_else(|_| panic!("{name} is {text:?}, not a whole number")),
    )
}

/// Damages the files of `format` and reads them, for as long as is asked for.
fn fuzz(format: &Format) {
    let seed = variable("CLIPSCAPE_FUZZ_SEED").unwrap_or(1);
    let seconds = variable("CLIPSCAPE_FUZZ_S");
    let last = seconds.map(|s| Instant::now() + Duration::from_secs(s));
    let kept = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("fuzz-{}", format.name));
    assert!(!format.files.is_empty(), "{} has no files", format.name);
    for (name, bytes) in &format.files {
        let whole = fault(bytes.len() as u64, || {
            read(name, (format.pack)(bytes.clone()), &format.options)
        });
        assert_eq!(whole, Ok(true), "{name} is to be read, undamaged");
    }
    let all: Vec<(&str, &[u8])> = format
        .files
        .iter()
        .chain(&format.broken)
        .map(|(n, b)| (n.as_str(), &b[..]))
        .collect();
    let (mut round, mut whole) = (0u64, 0u64);
    loop {
        if last.map_or(round >= ROUNDS, |last| Instant::now() >= last) {
            break;
        }
        // Each round depends on its number alone, so that one can be run again.
        let mut random = Random::new(seed, round);
        // Files that are whole lead deeper.
        let of = if random.below(4) == 0 {
            all.len()
        } else {
            format.files.len()
        };
        let (name, bytes) = all[random.below(of)];
        let other = all[random.below(all.len())].1;
        let damaged = mutate(bytes, other, &mut random);
        if seconds.is_some() {
            std::fs::write(&kept, &damaged).expect("the target folder can be written to");
        }
        let input = (format.pack)(damaged.clone());
        let length = input.len() as u64;
        match fault(length, || read(name, input, &format.options)) {
            Ok(read) => whole += u64::from(read),
            Err(what) => {
                std::fs::write(&kept, &damaged).expect("the target folder can be written to");
                panic!(
                    "{}, seed {seed}, round {round}: {what}; see {}",
                    format.name,
                    kept.display()
                );
            }
        }
        round += 1;
    }
    println!(
        "{}: {round} files from seed {seed}, {whole} of them read, none at fault",
        format.name
    );
    assert!(whole < round, "no damage was noticed");
}

macro_rules! formats {
    ($($name:ident),*) => {$(
        #[test]
        fn $name() {
            fuzz(&corpus::$name());
        }
    )*};
}

formats!(
    geotiff, png, openexr, hgt, dted, usgs_dem, ascii_grid, bil, envi, raw, zip, gzip
);

/// Readers that are at fault are found.
#[test]
fn control_faults_are_caught() {
    let read = |claimed| Outcome { claimed, read: true };
    assert_eq!(fault(1000, || read(0)), Ok(true));
    let panics = fault(1000, || panic!("as broken readers do"));
    assert_eq!(panics.unwrap_err(), "it panicked");
    let greedy = |claimed| {
        move || {
            drop(std::hint::black_box(vec![1u8; 80 << 20]));
            read(claimed)
        }
    };
    assert!(fault(1000, greedy(0)).unwrap_err().contains("bytes"));
    assert!(
        fault(1000, greedy(u64::MAX)).unwrap_err().contains("bytes"),
        "a claim beyond 1000:1 counts for nothing"
    );
    assert_eq!(
        fault(100_000, greedy(32 << 20)),
        Ok(true),
        "a claim that can be kept counts"
    );
}
