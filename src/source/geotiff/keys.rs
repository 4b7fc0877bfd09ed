//! The geo keys of a GeoTIFF: codes, numbers and texts on its coordinate system (OGC GeoTIFF 1.1, 19-008r4, chapter 7).

use super::ifd::{self, Directory, File};
use crate::error::{Error, ErrorKind, Result};
use crate::source::geographic::Ellipsoid;
use crate::source::georeference::LENGTHS;

// Keys.
const MODEL_TYPE: u16 = 1024;
const RASTER_TYPE: u16 = 1025;
const CITATION: u16 = 1026;
const GEODETIC_CRS: u16 = 2048;
const GEODETIC_CITATION: u16 = 2049;
const ANGULAR_UNITS: u16 = 2054;
const ELLIPSOID: u16 = 2056;
const SEMI_MAJOR_AXIS: u16 = 2057;
const SEMI_MINOR_AXIS: u16 = 2058;
const INVERSE_FLATTENING: u16 = 2059;
const PROJECTED_CRS: u16 = 3072;
const PROJECTED_CITATION: u16 = 3073;
const LINEAR_UNITS: u16 = 3076;
const LINEAR_UNIT_SIZE: u16 = 3077;
const VERTICAL_CRS: u16 = 4096;
const VERTICAL_UNITS: u16 = 4099;
// Their values.
const PROJECTED: u16 = 1;
const GEOGRAPHIC: u16 = 2;
const GEOCENTRIC: u16 = 3;
const POINT: u16 = 2;
/// The degree, and the degree of whoever supplies it.
const DEGREES: [u16; 2] = [9102, 9122];
const USER_DEFINED: u16 = 32767;

/// What a coordinate system is measured in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Model {
    Lengths,
    Degrees,
}

/// The geo keys that hold a number, and the doubles and texts of the others.
#[derive(Debug, Default)]
pub(super) struct Keys {
    entries: Vec<[u16; 4]>,
    doubles: Vec<f64>,
    texts: String,
}

/// Name and length in metres of an EPSG unit of length.
pub(super) fn linear_unit(code: u16) -> Option<(&'static str, f64)> {
    let index = [9001, 9002, 9003, 9036].iter().position(|known| *known == code)?;
    Some(LENGTHS[index])
}

impl Keys {
    /// Reads the keys of an image; none where it has none.
    ///
    /// # Errors
    /// [`ErrorKind::Broken`] where their directory is damaged.
    pub(super) fn read(file: &File, image: &Directory) -> Result<Self> {
        let Some(all) = file.whole(image, ifd::GEO_KEYS, 1 << 18)? else {
            return Ok(Self::default());
        };
        let all: Vec<u16> = all.into_iter().map(|v| u16::try_from(v).unwrap_or(0)).collect();
        let (header, entries) = all.split_at(all.len().min(4));
        let [1, _, _, count] = *header else {
            return Err(file.broken(format!("has a geo key directory that begins with {header:?}")));
        };
        let entries = entries.as_chunks::<4>().0;
        let Some(entries) = entries.get(..usize::from(count)) else {
            return Err(file.broken(format!("has {} of {count} geo keys", entries.len())));
        };
        Ok(Self {
            entries: entries.to_vec(),
            doubles: file.reals(image, ifd::GEO_DOUBLES)?.unwrap_or_default(),
            texts: file.text(image, ifd::GEO_TEXTS).unwrap_or_default(),
        })
    }

    /// Whether a pixel's coordinates name its sample.
    pub(super) fn is_point(&self) -> bool {
        self.code(RASTER_TYPE) == Some(POINT)
    }

    /// The value of a key that holds a code.
    fn code(&self, key: u16) -> Option<u16> {
        let entry = self.entries.iter().find(|e| e[0] == key && e[1] == 0);
        entry.map(|e| e[3])
    }

    /// A code that names something.
    fn named(&self, key: u16) -> Option<u16> {
        self.code(key).filter(|code| !matches!(*code, 0 | USER_DEFINED))
    }

    fn double(&self, key: u16) -> Option<f64> {
        let held = |e: &&[u16; 4]| e[0] == key && e[1] == ifd::GEO_DOUBLES;
        let entry = self.entries.iter().find(held)?;
        self.doubles.get(usize::from(entry[3])).copied()
    }

    fn text(&self, key: u16) -> Option<String> {
        let held = |e: &&[u16; 4]| e[0] == key && e[1] == ifd::GEO_TEXTS;
        let entry = self.entries.iter().find(held)?;
        let start = usize::from(entry[3]);
        let text = self.texts.get(start..start + usize::from(entry[2]))?;
        let text = text.trim_end_matches('|').trim();
        (!text.is_empty()).then(|| text.to_string())
    }

    /// What the system is measured in, if the keys say.
    ///
    /// # Errors
    /// [`ErrorKind::Unsupported`] for geocentric coordinates and for angles in other units than degrees.
    pub(super) fn model(&self, file: &File) -> Result<Option<Model>> {
        let model = match self.code(MODEL_TYPE) {
            Some(PROJECTED) => Model::Lengths,
            Some(GEOGRAPHIC) => Model::Degrees,
            Some(GEOCENTRIC) => return Err(file.unsupported("is in geocentric coordinates")),
            _ if self.code(PROJECTED_CRS).is_some() => Model::Lengths,
            _ if self.code(GEODETIC_CRS).is_some() => Model::Degrees,
            _ => return Ok(None),
        };
        if model == Model::Degrees
            && let Some(code) = self.code(ANGULAR_UNITS).filter(|code| !DEGREES.contains(code))
        {
            let what = format!("measures angles in the unit of EPSG code {code}; degrees are read");
            return Err(file.unsupported(what));
        }
        Ok(Some(model))
    }

    /// `EPSG:n`, or the file's own words; with `+m` behind the code where it names a system of heights too.
    pub(super) fn crs(&self) -> Option<String> {
        let geographic = self.code(MODEL_TYPE) == Some(GEOGRAPHIC);
        let (code, own) = if geographic {
            (self.named(GEODETIC_CRS), GEODETIC_CITATION)
        } else {
            (self.named(PROJECTED_CRS), PROJECTED_CITATION)
        };
        match (code, self.vertical_crs()) {
            (Some(code), Some(vertical)) => Some(format!("EPSG:{code}+{vertical}")),
            (Some(code), None) => Some(format!("EPSG:{code}")),
            (None, _) => self.text(own).or_else(|| self.text(CITATION)),
        }
    }

    /// The EPSG code of the system of heights.
    fn vertical_crs(&self) -> Option<u16> {
        match self.named(VERTICAL_CRS)? {
            // GeoTIFF 1.0 named those of the oceans by the codes of their datums.
            code @ 5101..=5106 => Some(code + 600),
            // And heights over ellipsoids by codes that EPSG never had as systems.
            5001..=5033 => None,
            code => Some(code),
        }
    }

    /// EPSG code of the unit of heights: as a key says, or as its system has it, of those in use.
    pub(super) fn vertical_unit(&self) -> Option<u16> {
        let of_system = || match self.vertical_crs()? {
            3855 | 5773 | 5798 | 5703 | 5701 | 5714 | 5621 | 5730 | 5783 | 5720 | 5728 | 5711 => Some(9001),
            5702 | 6360 => Some(9003),
            8228 => Some(9002),
            _ => None,
        };
        self.named(VERTICAL_UNITS).or_else(of_system)
    }

    /// The ellipsoid of the system, where the keys say and it is known here.
    pub(super) fn ellipsoid(&self) -> Option<Ellipsoid> {
        let axes = || {
            let a_m = self.double(SEMI_MAJOR_AXIS)?;
            let by_minor = self.double(SEMI_MINOR_AXIS).map(|b_m| (a_m - b_m) / a_m);
            let flattening = match self.double(INVERSE_FLATTENING) {
                Some(0.0) => Some(0.0),
                Some(inverse) => Some(1.0 / inverse),
                None => by_minor,
            };
            Ellipsoid::of_axes(a_m, flattening?)
        };
        let by_code = |key| self.named(key).and_then(Ellipsoid::of_code);
        by_code(ELLIPSOID).or_else(|| by_code(GEODETIC_CRS)).or_else(axes)
    }

    /// Metres in the unit of a system of lengths.
    ///
    /// # Errors
    /// [`ErrorKind::Unsupported`] for a unit that is not known here.
    pub(super) fn metres(&self, file: &File, assumed: &mut Vec<String>) -> Result<f64> {
        match self.code(LINEAR_UNITS) {
            Some(USER_DEFINED) => match self.double(LINEAR_UNIT_SIZE) {
                Some(metres) if metres > 0.0 && metres.is_finite() => Ok(metres),
                _ => Err(file.unsupported("has a unit of length of unknown size")),
            },
            Some(code) => linear_unit(code).map(|(_, metres)| metres).ok_or_else(|| {
                let what =
                    format!("measures lengths in the unit of EPSG code {code}; metres and feet are read");
                Error::new(ErrorKind::Unsupported, &file.name, what)
            }),
            None => {
                if !self.entries.is_empty() {
                    let what = "The file does not name its unit of length; it is taken as the metre.";
                    assumed.push(what.into());
                }
                Ok(1.0)
            }
        }
    }
}
