//! `clipscape synth`: procedural terrain as a GeoTIFF.

use std::io::BufWriter;
use std::path::Path;

use super::Outcome;
use super::args::SynthArgs;
use super::progress::Terminal;
use crate::build::Output;
use crate::error::{Error, ErrorKind, Result};
use crate::source::{Synth, write_tiff};

/// Runs the command.
pub(super) fn run(args: &SynthArgs, terminal: &Terminal) -> Outcome {
    let name = format!("synth:{}", args.size);
    let synth = Synth::parse(&name).expect("the name begins with synth:")?;
    refuse_other_formats(&args.output)?;
    let (output, file) = Output::create(&args.output, args.force)?;
    write_tiff(BufWriter::with_capacity(1 << 20, &file), &synth, terminal).map_err(|e| match e.kind() {
        ErrorKind::Io => e.about(args.output.display()),
        _ => e,
    })?;
    output.publish(&file)?;
    terminal.note(&format!("{} is made", args.output.display()));
    Ok(())
}

/// A file that is called like another format would not be one.
pub(super) fn refuse_other_formats(path: &Path) -> Result<()> {
    let ending = path.extension().map(|e| e.to_ascii_lowercase());
    if ending.is_some_and(|e| e == "tif" || e == "tiff") {
        return Ok(());
    }
    Err(Error::new(
        ErrorKind::Unsupported,
        path.display(),
        "a DEM is written as a GeoTIFF only",
    )
    .advice("name it .tif"))
}
