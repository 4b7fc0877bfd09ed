//! The statistics of frames as a file, and what they say of the run: command, checksums, errors, speed.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use crate::cli::shots::Shots;
use crate::clipmap::{AHEAD_S, ClipmapOptions, FRAME_BYTES};
use crate::error::{Error, Result};
use crate::render::Headless;
use crate::stats::{FrameStats, PooledErrors, Run, SummaryStats};
use crate::stream::{Flown, Terrain};

pub(super) fn write_stats(mut file: &fs::File, path: &Path, frames: &[FrameStats], run: Run) -> Result<()> {
    let mut text = String::new();
    for frame in frames {
        text += &serde_json::to_string(frame).expect("numbers are valid JSON");
        text.push('\n');
    }
    text +=
        &serde_json::to_string(&SummaryStats::new(run, frames)).expect("numbers and texts are valid JSON");
    text.push('\n');
    file.write_all(text.as_bytes())
        .map_err(|e| Error::io(path.display(), e))
}

/// What the frames' errors come to, the worst frame by its own number.
pub(super) fn pooled_errors(headless: &Headless, frames: &[FrameStats]) -> Option<PooledErrors> {
    let pool = headless.pooled_errors()?;
    let worst = frames.get(usize::try_from(pool.worst_frame()?).ok()?)?;
    let summary = pool.summary();
    Some(PooledErrors {
        error_px_max: summary.error_px_max,
        error_px_p99: summary.error_px_p99,
        error_px_rms: summary.error_px_rms,
        error_m_max: summary.error_m_max,
        error_floor_px: summary.error_floor_px,
        worst_frame: worst.frame,
    })
}

/// The fastest flight at which every level would have stayed fresh, by what loading took.
pub(super) fn fastest_fresh_m_s(
    terrain: &Terrain,
    headless: &Headless,
    clipmap: &ClipmapOptions,
    shots: &Shots,
) -> Option<f64> {
    let Shots::Flight(flight) = shots else { return None };
    let flown = Flown {
        clip_size: clipmap.clip_size,
        levels: headless.clipmap().windows().len() as u32,
        upload_budget_bytes: clipmap.upload_budget_bytes.or(Some(FRAME_BYTES)),
        fps: flight.fps(),
        ahead_s: AHEAD_S,
    };
    terrain.pace().map(|pace| pace.fastest_m_s(&flown))
}

/// The command line as one line, whatever its arguments are made of.
pub(in crate::cli) fn command_line() -> String {
    let arguments: Vec<_> = std::env::args_os()
        .map(|a| a.to_string_lossy().into_owned())
        .collect();
    arguments.join(" ")
}

pub(in crate::cli) fn checksum(bytes: &[u8]) -> String {
    format!("crc32c:{:08x}", crc32c::crc32c(bytes))
}

/// The checksum over inputs that are files, one after another; none where there are none.
pub(in crate::cli) fn files_checksum(files: &[PathBuf]) -> Result<Option<String>> {
    let (mut crc, mut buffer) = (0, vec![0; 1 << 20]);
    for path in files {
        let mut file = fs::File::open(path).map_err(|e| Error::io(path.display(), e))?;
        loop {
            match std::io::Read::read(&mut file, &mut buffer).map_err(|e| Error::io(path.display(), e))? {
                0 => break,
                n => crc = crc32c::crc32c_append(crc, &buffer[..n]),
            }
        }
    }
    Ok((!files.is_empty()).then(|| format!("crc32c:{crc:08x}")))
}
