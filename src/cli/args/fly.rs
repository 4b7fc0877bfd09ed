//! What may be typed after `fly`.

use std::path::PathBuf;

use clap::Args;

use super::input::ReadArgs;
use super::{CameraArgs, ViewArgs};

/// Fly through a DEM or terrain file in a window; H shows the keys. Of a DEM the pyramid is built on the way, and no light
/// traced.
#[derive(Debug, Args)]
#[command(mut_arg("wait", |arg| arg
    .default_value("none")
    .help("Whether frames wait for all of their data, or are drawn with what is there [default: none]")))]
#[command(mut_arg("clip_size", |arg| arg
    .value_name("N")
    .help("Samples along the side of a level's window, a power of two from 64 to 2048 [default: 512]")
    .long_help(None)))]
#[command(mut_arg("size", |arg| arg.help("Pixels of the window as it is opened")))]
#[command(mut_arg("stats", |arg| arg.hide(true)))]
pub(in crate::cli) struct FlyArgs {
    /// A terrain file, a DEM, several or a folder of them that are one DEM (later ones win), or synth:SIZE[:SEED]
    /// [default: synth:16384:1, procedural terrain]
    #[arg(value_name = "INPUT")]
    pub(in crate::cli) inputs: Vec<PathBuf>,

    #[command(flatten, next_help_heading = "How a DEM is read")]
    pub(in crate::cli) read: ReadArgs,

    #[command(flatten)]
    pub(in crate::cli) camera: CameraArgs,

    #[command(flatten)]
    pub(in crate::cli) view: ViewArgs,

    /// The folder of flights and pictures that are written; nothing in it is replaced
    #[arg(long, value_name = "DIR", default_value = ".", hide_default_value = true)]
    pub(in crate::cli) output_dir: PathBuf,

    /// F12 loses the graphics device, for tests
    #[arg(long, hide = true)]
    pub(in crate::cli) loses_device: bool,

    /// Show no warnings, and say not what was written
    #[arg(long, short)]
    pub(in crate::cli) quiet: bool,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clipmap::Wait;
    use clap::Parser;

    #[derive(Debug, Parser)]
    struct Fly {
        #[command(flatten)]
        args: FlyArgs,
    }

    fn parse(line: &str) -> Result<FlyArgs, clap::Error> {
        Fly::try_parse_from(line.split_whitespace()).map(|f| f.args)
    }

    #[test]
    fn all_may_be_left_out_and_frames_do_not_wait() {
        let args = parse("fly").unwrap();
        assert!(args.inputs.is_empty() && args.output_dir == *".");
        assert_eq!(args.view.wait, Wait::None);
        let args = parse("fly a.tif b.tif --wait all --spacing 30 --eye 1,2,3 --heading -5 -z 2").unwrap();
        assert_eq!((args.inputs.len(), args.view.wait), (2, Wait::All));
        assert_eq!(
            (args.camera.eye, args.camera.heading),
            (Some([1.0, 2.0, 3.0]), Some(-5.0))
        );
        assert!(!args.read.options().is_default());
        for bad in [
            "fly --heading 3",
            "fly --flight orbit",
            "fly --msaa 2",
            "fly --wait some",
        ] {
            assert!(parse(bad).is_err(), "{bad}");
        }
    }
}
