//! What may be typed: commands, their options, and the help of each.

mod cache;
#[cfg(feature = "window")]
mod fly;
mod input;
#[cfg(feature = "gpu")]
mod measure;
#[cfg(feature = "gpu")]
mod render;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

pub(super) use self::cache::{CacheAction, CacheArgs};
#[cfg(feature = "window")]
pub(super) use self::fly::FlyArgs;
pub(super) use self::input::InputArgs;
#[cfg(feature = "gpu")]
pub(super) use self::measure::MeasureArgs;
#[cfg(feature = "gpu")]
pub(super) use self::render::{CameraArgs, RenderArgs, ViewArgs};
use super::values;
#[cfg(feature = "dem")]
use crate::build::PartKind;
use crate::light::{DAY_POSITIONS, DEFAULT_SKY_DIRECTIONS, Moment, Sun};
use crate::pyramid::FilterKind;

/// A terrain geometry clipmap engine: from a DEM to frames, and how wrong they are.
#[derive(Debug, Parser)]
#[command(
    name = "clipscape",
    version,
    arg_required_else_help = true,
    max_term_width = 100
)]
#[command(after_help = "Exit status: 0 done, 1 could not, 2 usage, 130 interrupted.")]
pub(super) struct Cli {
    #[command(subcommand)]
    pub(super) command: Command,
}

#[derive(Debug, Subcommand)]
pub(super) enum Command {
    Info(InfoArgs),
    Preprocess(PreprocessArgs),
    #[cfg(feature = "gpu")]
    Render(Box<RenderArgs>),
    #[cfg(feature = "window")]
    Fly(Box<FlyArgs>),
    #[cfg(feature = "gpu")]
    Measure(Box<MeasureArgs>),
    Cache(CacheArgs),
    #[cfg(feature = "dem")]
    Export(ExportArgs),
    #[cfg(feature = "dem")]
    Synth(SynthArgs),
}

/// Say what a DEM or terrain file is, and what was assumed of it.
#[derive(Debug, Args)]
pub(super) struct InfoArgs {
    #[command(flatten)]
    pub(super) input: InputArgs,

    /// Print one JSON object
    #[arg(long)]
    pub(super) json: bool,

    /// Read and check all of it, every tile
    #[arg(long)]
    pub(super) verify: bool,

    /// Show no progress and no warnings
    #[arg(long, short)]
    pub(super) quiet: bool,
}

/// Make a terrain file of a DEM: all its levels, their bounds, and light. Of a terrain file, light it anew.
#[derive(Debug, Args)]
pub(super) struct PreprocessArgs {
    #[command(flatten)]
    pub(super) input: InputArgs,

    /// The terrain file [default: STEM.terrain.exr beside the input, which may be the input itself]
    #[arg(long, short, value_name = "FILE")]
    pub(super) output: Option<PathBuf>,

    /// Trace no light
    #[arg(long, conflicts_with_all = ["sun", "sky_directions"])]
    pub(super) no_light: bool,

    /// Where the sun stands: degrees clockwise from north, and above the horizon [default: 315,45]
    #[arg(long, value_name = "AZIMUTH,ALTITUDE", value_parser = values::sun, allow_hyphen_values = true)]
    pub(super) sun: Option<Sun>,

    /// Where the sun stands at a time, as in 2026-06-21T09:00:00Z, over the middle of the DEM
    #[arg(long, value_name = "TIME", value_parser = values::moment, conflicts_with_all = ["sun", "no_light"])]
    pub(super) sun_at: Option<Moment>,

    /// Trace light for the whole day of --sun-at too, from this many suns, so that render --sun-time and flights show any
    /// time of it
    #[arg(long, value_name = "N", requires = "sun_at", allow_negative_numbers = true)]
    #[arg(value_parser = clap::value_parser!(u32).range(i64::from(*DAY_POSITIONS.start())..=i64::from(*DAY_POSITIONS.end())))]
    pub(super) day: Option<u32>,

    /// Degrees north of the equator from where --sun-at sees the sun, in place of the DEM's middle
    #[arg(long, value_name = "DEGREES", value_parser = values::latitude, allow_hyphen_values = true)]
    #[arg(requires_all = ["sun_at", "lon"])]
    pub(super) lat: Option<f64>,

    /// Degrees east of Greenwich likewise
    #[arg(long, value_name = "DEGREES", value_parser = values::number, allow_hyphen_values = true)]
    #[arg(requires_all = ["sun_at", "lat"])]
    pub(super) lon: Option<f64>,

    /// Trace light over the earth's curve, with this coefficient of refraction [0.13 where none is given]
    #[arg(long, value_name = "K", value_parser = values::refraction, conflicts_with = "no_light")]
    #[arg(num_args = 0..=1, require_equals = true, default_missing_value = "0.13")]
    pub(super) curvature: Option<f64>,

    /// Directions in which the sky is looked for; 0 leaves the terrain out of its share
    #[arg(long, value_name = "N", default_value_t = DEFAULT_SKY_DIRECTIONS)]
    #[arg(value_parser = clap::value_parser!(u32).range(0..=3600), allow_negative_numbers = true)]
    pub(super) sky_directions: u32,

    /// How coarser levels are made: point, box, bilinear, cubic, lanczos3, sinc-blackman (unless told otherwise) or
    /// sinc-blackman-clamped
    #[arg(long, value_name = "NAME", value_parser = values::filter(), hide_possible_values = true)]
    pub(super) filter: Option<FilterKind>,

    /// Smooth the terraces of a DEM of whole metres (or of another step) away, moving no height by more than half a step
    #[arg(long)]
    pub(super) destep: bool,

    /// Refuse a DEM that needs more memory than this, as in 512M or 2GiB [default: 512M]
    #[arg(long, value_name = "BYTES", value_parser = values::bytes)]
    pub(super) memory: Option<u64>,

    /// Write how long it took, and what it cost, as a line of JSON
    #[arg(long, value_name = "FILE")]
    pub(super) stats: Option<PathBuf>,

    /// Replace what exists
    #[arg(long, short)]
    pub(super) force: bool,

    /// Show no progress and no warnings
    #[arg(long, short)]
    pub(super) quiet: bool,
}

/// Write a level's heights, light or error as a GeoTIFF that lies over the DEM. Of a DEM the pyramid is built on the
/// way where a level needs it.
#[cfg(feature = "dem")]
#[derive(Debug, Args)]
pub(super) struct ExportArgs {
    #[command(flatten)]
    pub(super) input: InputArgs,

    /// What is written: height in metres, sun or sky (shares of 0 to 1), or error (metres by which the level's surface
    /// lies above the DEM's own, at each of the DEM's samples)
    #[arg(long, value_name = "PART", value_parser = values::part)]
    pub(super) part: PartKind,

    /// The level: 0 is the DEM itself, each further one has half as many samples a side [default: 0; 1 for error]
    #[arg(long, value_name = "L")]
    pub(super) level: Option<u32>,

    /// The GeoTIFF
    #[arg(long, short, value_name = "FILE")]
    pub(super) output: PathBuf,

    /// Replace what exists
    #[arg(long, short)]
    pub(super) force: bool,

    /// Show no progress and no warnings
    #[arg(long, short)]
    pub(super) quiet: bool,
}

/// Write a procedural DEM of fractal mountains as a GeoTIFF.
#[cfg(feature = "dem")]
#[derive(Debug, Args)]
pub(super) struct SynthArgs {
    /// Samples along a side and, after a colon, the seed
    #[arg(value_name = "SIZE[:SEED]")]
    pub(super) size: String,

    /// The GeoTIFF
    #[arg(long, short, value_name = "FILE")]
    pub(super) output: PathBuf,

    /// Replace what exists
    #[arg(long, short)]
    pub(super) force: bool,

    /// Show no progress and no warnings
    #[arg(long, short)]
    pub(super) quiet: bool,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    fn parse(line: &str) -> Result<Cli, clap::Error> {
        Cli::try_parse_from(line.split_whitespace())
    }

    #[test]
    fn the_definitions_agree_with_each_other() {
        Cli::command().debug_assert();
    }

    #[test]
    fn values_may_be_negative() {
        let Command::Preprocess(args) = parse("clipscape preprocess a.tif --sun -45,-2").unwrap().command
        else {
            panic!("another command");
        };
        assert_eq!(
            args.sun,
            Some(Sun {
                azimuth_deg: -45.0,
                altitude_deg: -2.0
            })
        );
    }
}
