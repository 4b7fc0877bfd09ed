//! What a user says of a DEM that its file does not say, or says wrongly.

use crate::error::{Error, ErrorKind, Result};
use crate::grid::Rect;

/// How a DEM is opened. The default leaves everything to the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OpenOptions {
    /// Samples of this value, as stored (before scale and unit), are no data, in place of what the file names. NaN
    /// stands for a file whose only voids are NaN.
    pub nodata: Option<f64>,
    /// Metres between columns and between rows, in place of what follows from the file.
    pub spacing_m: Option<[f64; 2]>,
    /// The band or channel that holds heights.
    pub band: Option<Band>,
    /// Size and type of a file that has no header.
    pub raw: Option<RawLayout>,
    /// The part that is read.
    pub crop: Option<Crop>,
}

/// One of several bands of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Band {
    /// The n-th, counted from 1.
    Number(u32),
    /// The one of this name (OpenEXR).
    Name(String),
}

/// Size and type of a file of bare samples, rows from north to south.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RawLayout {
    /// Columns.
    pub width: u64,
    /// Rows.
    pub height: u64,
    /// Their type.
    pub sample: SampleType,
    /// Whether the first byte of a sample is its most significant.
    pub big_endian: bool,
}

/// A type of samples as files store them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "each is what its name says")]
pub enum SampleType {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    U64,
    I64,
    F32,
    F64,
}

/// The part of a DEM that is read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Crop {
    /// These samples, which must all be there.
    Samples(Rect),
    /// The samples whose places lie within these CRS coordinates, edges included.
    Place {
        /// Least easting or longitude.
        west: f64,
        /// Greatest northing or latitude.
        north: f64,
        /// Greatest easting or longitude.
        east: f64,
        /// Least northing or latitude.
        south: f64,
    },
}

impl SampleType {
    /// Its name as `info` prints it.
    pub fn name(self) -> &'static str {
        match self {
            Self::U8 => "uint8",
            Self::I8 => "int8",
            Self::U16 => "uint16",
            Self::I16 => "int16",
            Self::U32 => "uint32",
            Self::I32 => "int32",
            Self::U64 => "uint64",
            Self::I64 => "int64",
            Self::F32 => "float32",
            Self::F64 => "float64",
        }
    }

    /// Bytes of one sample.
    pub fn bytes(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::U64 | Self::I64 | Self::F64 => 8,
        }
    }

    /// Whether samples are whole numbers.
    pub fn integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }

    /// The type of `name`, as in `int16`.
    pub fn parse(name: &str) -> Option<Self> {
        const ALL: [SampleType; 10] = [
            SampleType::U8,
            SampleType::I8,
            SampleType::U16,
            SampleType::I16,
            SampleType::U32,
            SampleType::I32,
            SampleType::U64,
            SampleType::I64,
            SampleType::F32,
            SampleType::F64,
        ];
        ALL.into_iter().find(|t| t.name().eq_ignore_ascii_case(name))
    }
}

impl OpenOptions {
    /// Whether nothing is said.
    pub fn is_default(&self) -> bool {
        *self == Self::default()
    }

    /// Refuses all options, for a terrain file called `name`: it has been read and cut when it was made.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`].
    pub fn refuse_for_terrain(&self, name: &str) -> Result<()> {
        if self.is_default() {
            return Ok(());
        }
        let what = "is a terrain file, whose samples and place are fixed";
        Err(Error::new(ErrorKind::Misuse, name, what)
            .advice("give --nodata, --spacing, --band, --raw, --srcwin and --projwin when it is made"))
    }

    /// Refuses what speaks of a file's samples, for an input that is none.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`].
    pub(super) fn refuse_of_file(&self, name: &str) -> Result<()> {
        let given = [
            (self.nodata.is_some(), "--nodata"),
            (self.band.is_some(), "--band"),
            (self.raw.is_some(), "--raw"),
        ];
        match given.iter().find(|(given, _)| *given) {
            None => Ok(()),
            Some((_, option)) => {
                let what = format!("is no file of samples, to which {option} belongs");
                Err(Error::new(ErrorKind::Misuse, name, what).advice("leave it out"))
            }
        }
    }

    /// The band wanted, counted from 0, of `count` bands without names.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] where there is no such band; [`ErrorKind::Unsupported`] where there are several and none
    /// is named.
    pub(super) fn band_index(&self, name: &str, count: u32) -> Result<u32> {
        let misuse = |what: String| {
            Err(Error::new(ErrorKind::Misuse, name, what).advice(format!("give --band 1 to {count}")))
        };
        match &self.band {
            None if count == 1 => Ok(0),
            None => {
                let what = format!("has {count} bands, and one is read");
                Err(Error::new(ErrorKind::Unsupported, name, what)
                    .advice(format!("name it with --band 1 to {count}")))
            }
            Some(Band::Number(n)) if (1..=count).contains(n) => Ok(n - 1),
            Some(Band::Number(n)) => misuse(format!("has no band {n}")),
            Some(Band::Name(text)) => misuse(format!("has no band named {text:?}")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_are_counted_from_one_and_never_guessed() {
        let of = |band: Option<Band>, count| {
            let options = OpenOptions {
                band,
                ..OpenOptions::default()
            };
            options.band_index("t", count).map_err(|e| e.kind())
        };
        assert_eq!(of(None, 1), Ok(0));
        assert_eq!(of(Some(Band::Number(3)), 3), Ok(2));
        assert_eq!(of(None, 2), Err(ErrorKind::Unsupported));
        assert_eq!(of(Some(Band::Number(0)), 2), Err(ErrorKind::Misuse));
        assert_eq!(of(Some(Band::Number(4)), 3), Err(ErrorKind::Misuse));
        assert_eq!(of(Some(Band::Name("Y".into())), 1), Err(ErrorKind::Misuse));
    }

    #[test]
    fn types_are_known_by_the_names_that_info_prints() {
        assert_eq!(SampleType::parse("Int16"), Some(SampleType::I16));
        assert_eq!(SampleType::parse("float64").map(SampleType::bytes), Some(8));
        assert_eq!(SampleType::parse("int12"), None);
    }
}
