//! What may be typed of an INPUT: files, and what they do not say themselves.

use std::path::PathBuf;

use clap::Args;

use crate::cli::values;
use crate::grid::Rect;
use crate::source::{Band, Crop, OpenOptions, RawLayout};

/// Inputs and how they are read.
#[derive(Debug, Args)]
pub(in crate::cli) struct InputArgs {
    /// A terrain file, a DEM, several or a folder of them that are one DEM (later ones win), or synth:SIZE[:SEED]
    #[arg(required = true, value_name = "INPUT")]
    pub(in crate::cli) inputs: Vec<PathBuf>,

    #[command(flatten, next_help_heading = "How a DEM is read")]
    pub(in crate::cli) read: ReadArgs,
}

/// How a DEM is read.
#[derive(Debug, Args)]
pub(in crate::cli) struct ReadArgs {
    /// The stored value that means no data, in place of what the file names
    #[arg(long, value_name = "VALUE", value_parser = values::any_number, allow_hyphen_values = true)]
    nodata: Option<f64>,

    /// Metres between columns, and between rows if they differ, in place of what follows from the file
    #[arg(long, value_name = "DX[,DZ]", value_parser = values::spacing, allow_hyphen_values = true)]
    spacing: Option<[f64; 2]>,

    /// The band that holds heights, counted from 1, or an OpenEXR channel by its name
    #[arg(long, value_name = "N|NAME", value_parser = values::band, allow_hyphen_values = true)]
    band: Option<Band>,

    /// Size and type of a file without a header, as in 1024x1024:int16; types are uint8 to int64, float32 and float64,
    /// with be at the end where the first byte is the most significant
    #[arg(long, value_name = "WxH:TYPE", value_parser = values::raw, allow_hyphen_values = true)]
    raw: Option<RawLayout>,

    /// Only the samples of this rectangle: first column, first row, columns, rows
    #[arg(long, value_name = "X,Y,W,H", value_parser = values::samples, allow_hyphen_values = true)]
    #[arg(conflicts_with = "projwin")]
    srcwin: Option<Rect>,

    /// Only the samples within these coordinates of the DEM's own system: west, north, east, south
    #[arg(long, value_name = "W,N,E,S", value_parser = values::numbers::<4>, allow_hyphen_values = true)]
    projwin: Option<[f64; 4]>,
}

impl ReadArgs {
    /// What the library is told.
    pub(in crate::cli) fn options(&self) -> OpenOptions {
        let place = self.projwin.map(|[west, north, east, south]| Crop::Place {
            west,
            north,
            east,
            south,
        });
        OpenOptions {
            nodata: self.nodata,
            spacing_m: self.spacing,
            band: self.band.clone(),
            raw: self.raw,
            crop: self.srcwin.map(Crop::Samples).or(place),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::SampleType;
    use clap::Parser;

    #[derive(Debug, Parser)]
    struct Program {
        #[command(flatten)]
        input: InputArgs,
    }

    fn parse(line: &str) -> Result<InputArgs, clap::Error> {
        Program::try_parse_from(line.split_whitespace()).map(|p| p.input)
    }

    #[test]
    fn options_are_what_was_typed() {
        let args =
            parse("info a.tif b.tif --nodata -9999 --spacing 30 --band 2 --srcwin -5,0,10,20").unwrap();
        assert_eq!(args.inputs.len(), 2);
        assert_eq!(
            args.read.options(),
            OpenOptions {
                nodata: Some(-9999.0),
                spacing_m: Some([30.0, 30.0]),
                band: Some(Band::Number(2)),
                raw: None,
                crop: Some(Crop::Samples(Rect::new(-5, 0, 5, 20))),
            }
        );
        let options =
            parse("info a.r16 --raw 3x4:int16be --band depth.Z --projwin -1,2,3,-4 --spacing 1,2").unwrap();
        let options = options.read.options();
        let raw = options.raw.unwrap();
        assert_eq!(
            (raw.width, raw.height, raw.sample, raw.big_endian),
            (3, 4, SampleType::I16, true)
        );
        assert_eq!(options.band, Some(Band::Name("depth.Z".into())));
        let Some(Crop::Place { west, south, .. }) = options.crop else {
            panic!("no crop by place");
        };
        assert_eq!((west, south), (-1.0, -4.0));
        assert!(
            parse("info a.asc --nodata nan")
                .unwrap()
                .read
                .options()
                .nodata
                .is_some_and(f64::is_nan)
        );
        assert!(parse("info a.tif").unwrap().read.options().is_default());
    }

    #[test]
    fn nonsense_is_refused() {
        for bad in [
            "info",
            "info a --raw 3x4",
            "info a --raw 3x4:int12",
            "info a --raw 3:int16",
            "info a --raw 0x4:int16",
            "info a --spacing 0",
            "info a --spacing -1,1",
            "info a --spacing 1,2,3",
            "info a --band 0",
            "info a --nodata x",
            "info a --srcwin 1,2,0,4",
            "info a --srcwin 1,2,3",
            "info a --srcwin 9223372036854775807,0,1,1",
            "info a --projwin 1,2,3,x",
            "info a --srcwin 0,0,1,1 --projwin 0,0,1,1",
        ] {
            assert!(parse(bad).is_err(), "{bad}");
        }
    }
}
