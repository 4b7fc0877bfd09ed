//! `clipscape export`: a part of a terrain as a georeferenced GeoTIFF.

use std::io::BufWriter;

use super::Outcome;
use super::args::ExportArgs;
use super::input::{self, Input};
use super::progress::Terminal;
use super::synth::refuse_other_formats;
use crate::build::{Output, Part, PartKind};
use crate::error::{Error, ErrorKind};
use crate::levels::Levels;
use crate::source::{Description, HeightSource, write_tiff};
use crate::stream::Terrain;
use crate::terrain::TerrainFile;

/// Runs the command.
pub(super) fn run(args: &ExportArgs, terminal: &Terminal) -> Outcome {
    refuse_other_formats(&args.output)?;
    input::refuse_own(&args.input, &args.output)?;
    let level = args.level.unwrap_or(u32::from(args.part == PartKind::Error));
    // Made first: where it cannot be, that is said before the work and not after it.
    let (output, file) = Output::create(&args.output, args.force)?;
    let write = |source: &dyn HeightSource| {
        write_tiff(BufWriter::with_capacity(1 << 20, &file), source, terminal).map_err(|e| match e.kind() {
            ErrorKind::Io if e.subject() == "output" => e.about(args.output.display()),
            _ => e,
        })
    };
    match input::open(&args.input)? {
        Input::Terrain(file) => {
            write(&Part::new(file.as_ref(), &description(&file), args.part, level)?)?;
        }
        // Level 0 is the DEM itself, of whatever size.
        Input::Dem(source) if args.part == PartKind::Height && level == 0 => write(source.as_ref())?,
        Input::Dem(source) if matches!(args.part, PartKind::Sun | PartKind::Sky) => {
            let error = Error::new(ErrorKind::Misuse, &source.description().name, "has no light");
            return Err(error
                .advice("preprocess it, which traces light, and export from the terrain file")
                .into());
        }
        Input::Dem(source) => {
            let terrain = Terrain::from_source(source.as_ref(), terminal)?;
            write(&Part::new(&terrain, source.description(), args.part, level)?)?;
        }
    }
    output.publish(&file)?;
    terminal.note(&format!("{} is made", args.output.display()));
    Ok(())
}

/// What a terrain file knows of its DEM.
fn description(file: &TerrainFile) -> Description {
    let meta = file.meta();
    Description {
        grid: *file.grid(),
        format: "terrain file".into(),
        sample_type: "float32".into(),
        step_m: None,
        place: meta.place.clone(),
        vertical_unit: meta.vertical_unit.clone(),
        assumed: meta.assumed.clone(),
        name: file.name().into(),
    }
}
