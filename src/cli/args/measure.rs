//! What may be typed after `measure`.

use std::path::PathBuf;

use clap::Args;

use super::InputArgs;
use crate::cli::view_values::{List, Promise};
use crate::cli::{values, view_values};
use crate::light::Sun;
use crate::pyramid::FilterKind;

/// Fly one path over many settings, and report what each costs and how wrong its pictures are: a page with plots, a table
/// as CSV with its schema, and a summary as JSON.
///
/// Settings are each clip size with each promised error, and, beside the one of clip size 256 without a promise, other
/// transitions, levels and filters one at a time.
#[derive(Debug, Args)]
pub(in crate::cli) struct MeasureArgs {
    #[command(flatten)]
    pub(in crate::cli) input: InputArgs,

    /// The path: a flight's JSON file
    #[arg(long, value_name = "FILE", required_unless_present = "depth")]
    pub(in crate::cli) flight: Option<PathBuf>,

    /// The folder of the results
    #[arg(long, short, value_name = "FOLDER", required_unless_present = "depth")]
    pub(in crate::cli) output: Option<PathBuf>,

    /// Instead of a flight, measure a frame that another program drew of the DEM: an OpenEXR picture with a channel Z or
    /// depth, metres along the view axis, 0 or infinity where no terrain is drawn
    #[arg(long, value_name = "FILE.exr", requires = "camera", conflicts_with_all = ["flight", "output", "quick", "size"])]
    pub(in crate::cli) depth: Option<PathBuf>,

    /// The camera of that frame: {"eye": [x, y, z], "heading": 0, "pitch": 0, "roll": 0, "fov": 60} in the DEM's world
    /// metres and degrees
    #[arg(long, value_name = "FILE.json", requires = "depth")]
    pub(in crate::cli) camera: Option<PathBuf>,

    /// Print the figures of that frame as one JSON object
    #[arg(long, requires = "depth")]
    pub(in crate::cli) json: bool,

    /// Fewer settings and frames, of 640x360 pixels: two minutes instead of hours on a software driver
    #[arg(long)]
    pub(in crate::cli) quick: bool,

    /// Pixels of a frame [default: 1280x720, with --quick 640x360]
    #[arg(long, value_name = "WxH", value_parser = view_values::size, allow_hyphen_values = true)]
    pub(in crate::cli) size: Option<[u32; 2]>,

    /// Clip sizes, with commas between them
    #[arg(long, value_name = "N,...", value_parser = view_values::fixed_clip_size, value_delimiter = ',')]
    #[arg(allow_negative_numbers = true)]
    pub(in crate::cli) clip_size: Option<Vec<i64>>,

    /// Promised errors in pixels, off for no promise
    #[arg(long, value_name = "off|E,...", value_parser = view_values::promise, value_delimiter = ',')]
    #[arg(allow_negative_numbers = true)]
    pub(in crate::cli) max_error_px: Option<Vec<Promise>>,

    /// Widths of the morph band in steps of a level, or none
    #[arg(long, value_name = "none|T,...", value_parser = view_values::list_of::<i64>, allow_negative_numbers = true)]
    pub(in crate::cli) transition: Option<List<i64>>,

    /// Numbers of levels, or none
    #[arg(long, value_name = "none|L,...", value_parser = view_values::list_of::<u32>, allow_negative_numbers = true)]
    pub(in crate::cli) levels: Option<List<u32>>,

    /// Filters by which coarser levels are made anew from level 0, or none
    #[arg(long, value_name = "none|NAME,...", value_parser = view_values::list_of::<FilterKind>)]
    pub(in crate::cli) filter: Option<List<FilterKind>>,

    /// Rounds in which every setting is flown and timed
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000), allow_negative_numbers = true)]
    pub(in crate::cli) rounds: Option<u32>,

    /// Frames, evenly over the flight, that are measured pixel by pixel
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..), allow_negative_numbers = true)]
    pub(in crate::cli) measured_frames: Option<u64>,

    /// Memory in which coarser levels may be made anew, as in 512M or 2GiB [default: 2GiB]
    #[arg(long, value_name = "BYTES", value_parser = values::bytes)]
    pub(in crate::cli) memory: Option<u64>,

    /// Factor on heights, within 1000000 of 0
    #[arg(long, short = 'z', value_name = "S", value_parser = values::number, default_value = "1")]
    #[arg(allow_negative_numbers = true)]
    pub(in crate::cli) vertical_scale: f64,

    /// Where the sun stands, for terrain without traced light: degrees from north, and above the horizon
    /// [default: 315,45]
    #[arg(long, value_name = "AZIMUTH,ALTITUDE", value_parser = values::sun, allow_hyphen_values = true)]
    pub(in crate::cli) sun: Option<Sun>,

    /// Leave the ground grey
    #[arg(long)]
    pub(in crate::cli) no_tint: bool,

    /// No air between the ground and the eye
    #[arg(long)]
    pub(in crate::cli) no_haze: bool,

    /// Replace results that are in the folder
    #[arg(long, short)]
    pub(in crate::cli) force: bool,

    /// Show no progress and no warnings
    #[arg(long, short)]
    pub(in crate::cli) quiet: bool,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Debug, Parser)]
    struct Measure {
        #[command(flatten)]
        args: MeasureArgs,
    }

    #[test]
    fn lists_are_what_was_typed() {
        let parse = |line: &str| {
            let line = format!("measure a.tif --flight f.json -o out {line}");
            Measure::try_parse_from(line.split_whitespace()).map(|m| m.args)
        };
        let args = parse("--clip-size 64,256 --max-error-px off,0.5 --transition 0,3 --levels none").unwrap();
        assert_eq!(args.clip_size, Some(vec![64, 256]));
        assert_eq!(args.max_error_px, Some(vec![Promise(None), Promise(Some(0.5))]));
        assert_eq!(
            (args.transition.unwrap().0, args.levels.unwrap().0),
            (vec![0, 3], vec![])
        );
        let args = parse("--filter point,lanczos3 --quick").unwrap();
        assert_eq!(args.filter.unwrap().0, [FilterKind::Point, FilterKind::Lanczos3]);
        assert!(args.quick && args.clip_size.is_none());
        let frame = |line: &str| {
            Measure::try_parse_from(format!("measure a.tif {line}").split_whitespace()).map(|m| m.args)
        };
        let args = frame("--depth d.exr --camera c.json --json -z -2").unwrap();
        assert!(args.depth.is_some() && args.json && args.flight.is_none());
        for bad in [
            "",
            "--depth d.exr",
            "--camera c.json",
            "--depth d.exr --camera c.json --flight f.json",
        ] {
            assert!(frame(bad).is_err(), "{bad}");
        }
        for bad in [
            "--json",
            "--clip-size 100",
            "--max-error-px nan",
            "--filter boxy",
            "--levels 1,x",
            "--rounds 0",
            "--size 3",
        ] {
            assert!(parse(bad).is_err(), "{bad}");
        }
    }
}
