//! What may be typed after `render`, and the options on how terrain is shown.

use std::ops::Range;
use std::path::PathBuf;

use clap::Args;

use super::InputArgs;
use crate::cli::values;
use crate::cli::view_values::{self, ClipSize};
use crate::clipmap::{ClipmapOptions, Wait};
use crate::error::Result;
use crate::light::{Sun, SunTime};
use crate::shade::ViewMode;

/// Draw pictures of a DEM or terrain file: one that shows the whole, one from a given place, or a flight. Of a DEM the
/// pyramid is built on the way, and no light traced; with --wait none it is drawn at once, and its terrain file built
/// meanwhile and kept for the next run.
#[derive(Debug, Args)]
pub(in crate::cli) struct RenderArgs {
    #[command(flatten)]
    pub(in crate::cli) input: InputArgs,

    /// The picture, or the folder of a flight's frames [default: STEM.png, or STEM for a flight]
    #[arg(long, short, value_name = "PATH")]
    pub(in crate::cli) output: Option<PathBuf>,

    #[command(flatten)]
    pub(in crate::cli) camera: CameraArgs,

    /// Draw the frames of a flight: a JSON file, or orbit to circle the DEM once
    #[arg(long, value_name = "FILE|orbit", conflicts_with = "camera")]
    pub(in crate::cli) flight: Option<PathBuf>,

    /// Only these frames of the flight, the last one excluded
    #[arg(long, value_name = "A..B", value_parser = view_values::frames, requires = "flight")]
    pub(in crate::cli) frames: Option<Range<u64>>,

    /// Write the flight as an animated PNG too
    #[arg(long, value_name = "FILE", requires = "flight")]
    pub(in crate::cli) animation: Option<PathBuf>,

    /// Write a sheet of up to 25 small frames of the flight too
    #[arg(long, value_name = "FILE", requires = "flight")]
    pub(in crate::cli) contact_sheet: Option<PathBuf>,

    #[command(flatten)]
    pub(in crate::cli) view: ViewArgs,

    /// Measure every drawn frame against the DEM's own surface, and say in --stats how far off it is on the screen and in
    /// metres (error_*), how many pixels see through the drawn surface (cracks), and at how many the two disagree about
    /// being terrain (silhouette_px); a pixel whose depth is that of a triangle beside it is measured on that triangle
    /// (beside_px). Takes a while, and needs --stats
    #[arg(long, requires = "stats")]
    pub(in crate::cli) measure: bool,

    /// Replace what exists
    #[arg(long, short)]
    pub(in crate::cli) force: bool,

    /// Show no progress and no warnings
    #[arg(long, short)]
    pub(in crate::cli) quiet: bool,
}

/// Where the camera stands and looks.
#[derive(Clone, Debug, Args)]
pub(in crate::cli) struct CameraArgs {
    /// Where the camera stands: world metres, x east, y up, z south of the north-western sample
    #[arg(long, value_name = "X,Y,Z", value_parser = view_values::place, allow_hyphen_values = true)]
    #[arg(group = "camera")]
    pub(in crate::cli) eye: Option<[f64; 3]>,

    /// Where the camera stands in the DEM's own reference system: easting and northing, or longitude and latitude in
    /// degrees, --above its ground
    #[arg(long, value_name = "E,N", value_parser = view_values::crs_place, allow_hyphen_values = true)]
    #[arg(group = "camera")]
    pub(in crate::cli) eye_at: Option<[f64; 2]>,

    /// Metres of the camera above the ground [default: 2]
    #[arg(long, value_name = "METRES", value_parser = values::number, allow_negative_numbers = true)]
    #[arg(requires = "eye_at")]
    pub(in crate::cli) above: Option<f64>,

    /// What it looks at, instead of heading and pitch: the ground there, as for --eye-at
    #[arg(long, value_name = "E,N", value_parser = view_values::crs_place, allow_hyphen_values = true)]
    #[arg(requires = "camera", conflicts_with_all = ["heading", "pitch"])]
    pub(in crate::cli) look_at: Option<[f64; 2]>,

    /// Where it looks: degrees clockwise from north [default: 0]
    #[arg(long, value_name = "DEGREES", value_parser = values::number, allow_negative_numbers = true)]
    #[arg(requires = "camera")]
    pub(in crate::cli) heading: Option<f64>,

    /// Degrees upwards, -90 to 90 [default: 0]
    #[arg(long, value_name = "DEGREES", value_parser = view_values::pitch, allow_negative_numbers = true)]
    #[arg(requires = "camera")]
    pub(in crate::cli) pitch: Option<f64>,

    /// Degrees by which the right side is tilted down [default: 0]
    #[arg(long, value_name = "DEGREES", value_parser = values::number, allow_negative_numbers = true)]
    #[arg(requires = "camera")]
    pub(in crate::cli) roll: Option<f64>,

    /// Vertical field of view in degrees, 0.01 to below 180 [default: 60]
    #[arg(long, value_name = "DEGREES", value_parser = view_values::fov, requires = "camera", allow_negative_numbers = true)]
    pub(in crate::cli) fov: Option<f64>,
}

/// How terrain is shown, wherever it is.
#[derive(Debug, Args)]
pub(in crate::cli) struct ViewArgs {
    /// Pixels of a frame
    #[arg(long, value_name = "WxH", value_parser = view_values::size, default_value = "1280x720", allow_hyphen_values = true)]
    pub(in crate::cli) size: [u32; 2],

    /// Samples along the side of a level's window, a power of two from 64 to 2048, or auto for the smallest that keeps
    /// --max-error-px [default: 256; what suits the picture's height where the whole DEM is shown]
    #[arg(long, value_name = "N|auto", value_parser = view_values::clip_size, allow_negative_numbers = true)]
    pub(in crate::cli) clip_size: Option<ClipSize>,

    /// Keep only the finest levels, this many
    #[arg(long, value_name = "L", value_parser = clap::value_parser!(u32).range(1..), allow_negative_numbers = true)]
    pub(in crate::cli) levels: Option<u32>,

    /// Width of the morph band in steps of a level, 0 to N/4 - 10 [default: N/10]
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(i64).range(0..), allow_negative_numbers = true)]
    pub(in crate::cli) transition: Option<i64>,

    /// Promise that nothing is drawn more than this many pixels from where the DEM has it, and leave out detail that the
    /// promise does not need; --stats says what each frame certifies
    #[arg(long, value_name = "E", value_parser = view_values::max_error, allow_negative_numbers = true)]
    pub(in crate::cli) max_error_px: Option<f64>,

    /// Whether frames wait for all of their data, or are drawn with what is there [default: all]
    #[arg(long, value_name = "all|none", value_parser = view_values::wait, default_value = "all", hide_default_value = true)]
    pub(in crate::cli) wait: Wait,

    /// The most bytes uploaded for a frame, beside the coarsest level; with --wait none
    #[arg(long, value_name = "BYTES", value_parser = values::bytes, allow_negative_numbers = true)]
    pub(in crate::cli) upload_budget: Option<u64>,

    /// The most memory for tiles of a terrain file, those that are being loaded included; at least 32M [default: 256M]
    #[arg(long, value_name = "BYTES", value_parser = values::bytes, allow_negative_numbers = true)]
    pub(in crate::cli) memory: Option<u64>,

    /// Keep no terrain file of what is built in the background while frames of a DEM are drawn with --wait none
    #[arg(long)]
    pub(in crate::cli) no_cache: bool,

    /// Factor on heights, within 1000000 of 0
    #[arg(long, short = 'z', value_name = "S", value_parser = values::number, default_value = "1")]
    #[arg(allow_negative_numbers = true)]
    pub(in crate::cli) vertical_scale: f64,

    /// Where the sun stands, for terrain without traced light: degrees from north, and above the horizon
    /// [default: 315,45]
    #[arg(long, value_name = "AZIMUTH,ALTITUDE", value_parser = values::sun, allow_hyphen_values = true)]
    pub(in crate::cli) sun: Option<Sun>,

    /// The time of day, of terrain with light over a day (preprocess --day): 9:30 by the sun, which stands highest at 12:00,
    /// or a moment as 2026-06-21T09:30:00Z
    #[arg(long, value_name = "TIME", value_parser = values::sun_time, conflicts_with = "sun")]
    pub(in crate::cli) sun_time: Option<SunTime>,

    /// What is shown: shaded, light (the bare light), level (levels, their bands, what is held back), wire (triangles), or
    /// error (how far each pixel is off the DEM's own surface: grey 0, blue 0.1, cyan 0.25, green 0.5, yellow 1, red
    /// 2 pixels and more; magenta where the two disagree about being terrain)
    #[arg(long, value_name = "VIEW", value_parser = view_values::view, default_value = "shaded")]
    pub(in crate::cli) view: ViewMode,

    /// Samples a pixel: 1 or 4
    #[arg(long, value_name = "N", value_parser = view_values::msaa, default_value = "1")]
    pub(in crate::cli) msaa: u32,

    /// Leave the ground grey
    #[arg(long)]
    pub(in crate::cli) no_tint: bool,

    /// No air between the ground and the eye
    #[arg(long)]
    pub(in crate::cli) no_haze: bool,

    /// Draw patches that are not seen too; the picture is the same
    #[arg(long)]
    pub(in crate::cli) no_cull: bool,

    /// Write a line of JSON for each frame and a summary
    #[arg(long, value_name = "FILE")]
    pub(in crate::cli) stats: Option<PathBuf>,
}

impl ViewArgs {
    /// The clipmap that is asked for, with a clip size that was decided on.
    ///
    /// # Errors
    /// Where what is asked for does not go together.
    pub(in crate::cli) fn clipmap_options(&self, clip_size: i64) -> Result<ClipmapOptions> {
        let options = ClipmapOptions {
            clip_size,
            levels: self.levels,
            transition: self.transition,
            vertical_scale: self.vertical_scale,
            cull: !self.no_cull,
            occlusion: !self.no_cull,
            max_error_px: self.max_error_px,
            wait: self.wait,
            upload_budget_bytes: self.upload_budget,
            day: false,
        };
        options.check()?;
        Ok(options)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Debug, Parser)]
    struct Render {
        #[command(flatten)]
        args: RenderArgs,
    }

    #[test]
    fn a_camera_is_what_was_typed() {
        let parse = |line: &str| Render::try_parse_from(line.split_whitespace()).map(|r| r.args);
        let args =
            parse("render a.tif --eye -5,100,-3 --pitch -90 --heading -1e1 -z -2.5 --size 1x1").unwrap();
        assert_eq!(args.camera.eye, Some([-5.0, 100.0, -3.0]));
        assert_eq!(
            (args.camera.pitch, args.camera.heading, args.view.vertical_scale),
            (Some(-90.0), Some(-10.0), -2.5)
        );
        assert_eq!(
            (args.view.size, args.view.clip_size, args.view.msaa),
            ([1, 1], None, 1)
        );
        let args = parse("render a.exr --clip-size auto --max-error-px 0.5").unwrap();
        assert_eq!(
            (args.view.clip_size, args.view.max_error_px),
            (Some(ClipSize::Auto), Some(0.5))
        );
        let args = parse("render a.tif --eye-at 1.5,-42 --above 300 --look-at 2,-43 --roll 3").unwrap();
        assert_eq!(
            (args.camera.eye_at, args.camera.above, args.camera.look_at),
            (Some([1.5, -42.0]), Some(300.0), Some([2.0, -43.0]))
        );
        let args = parse("render a.exr --flight orbit --frames 0..3 --view level").unwrap();
        assert_eq!((args.frames, args.view.view), (Some(0..3), ViewMode::Level));
        assert!(!args.measure && parse("render a.exr --measure --stats b").unwrap().measure);
        for bad in [
            "render a.tif --frames 0..3",
            "render a.tif --measure",
            "render a.tif --pitch 3",
            "render a.tif --eye 0,0,0 --flight orbit",
            "render a.tif --eye-at 0,0 --flight orbit",
            "render a.tif --eye-at 0,0 --eye 0,0,0",
            "render a.tif --eye-at 0,0,0",
            "render a.tif --above 3",
            "render a.tif --look-at 3,4",
            "render a.tif --eye-at 0,0 --look-at 3,4 --pitch 3",
            "render a.tif --msaa 2",
            "render a.tif --levels 0",
            "render a.tif --eye 0,nan,0",
            "render a.tif --clip-size 100",
            "render a.tif --max-error-px 0",
            "render a.tif --max-error-px -1",
        ] {
            assert!(parse(bad).is_err(), "{bad}");
        }
    }
}
