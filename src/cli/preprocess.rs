//! `clipscape preprocess`: a terrain file of a DEM.

use std::io::Write;

use super::Outcome;
use super::args::PreprocessArgs;
use super::input::{self, Input};
use super::progress::Terminal;
use crate::build::{self, Output, PreprocessOptions};
use crate::error::{Error, ErrorKind};
use crate::light::LightOptions;

/// Runs the command.
pub(super) fn run(args: &PreprocessArgs, terminal: &Terminal) -> Outcome {
    let source = match input::open(&args.input)? {
        Input::Dem(source) => source,
        Input::Terrain(file) => {
            let what = "is a terrain file already";
            let error = Error::new(ErrorKind::Unsupported, file.name(), what);
            return Err(error.advice("name the DEM that it was made of").into());
        }
    };
    let out = args
        .output
        .clone()
        .unwrap_or_else(|| input::beside(&args.input, ".terrain.exr"));
    let defaults = PreprocessOptions::default();
    let options = PreprocessOptions {
        light: (!args.no_light).then(|| LightOptions {
            sun: args.sun.unwrap_or_default(),
            sky_directions: args.sky_directions,
        }),
        filter: args.filter.into(),
        force: args.force,
        memory_bytes: args.memory.unwrap_or(defaults.memory_bytes),
        source: input::stamp(&args.input),
        ..defaults
    };
    // Made first: where it cannot be, that is said before the work and not after it.
    let stats = args
        .stats
        .as_deref()
        .map(|path| Output::create(path, args.force))
        .transpose()?;
    let report = build::preprocess(source.as_ref(), &out, &options, terminal)?;
    if let (Some((output, mut file)), Some(path)) = (stats, &args.stats) {
        let line = serde_json::to_string(&report).expect("numbers are valid JSON") + "\n";
        file.write_all(line.as_bytes())
            .map_err(|e| Error::io(path.display(), e))?;
        output.publish(&file)?;
    }
    terminal.note(&format!("{} is made, in {:.1} s", out.display(), report.total_s));
    Ok(())
}
