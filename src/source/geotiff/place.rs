//! Where a GeoTIFF lies: pixel scale and tie point, or a matrix, and the geo keys (OGC GeoTIFF 1.1, 19-008r4,
//! chapters 7.1 to 7.5).
//!
//! With `PixelIsArea` (also where nothing is said) the tie point names the outer corner of a pixel and its
//! sample lies half a pixel inside; with `PixelIsPoint` it names the sample.

use tiff::tags::Tag;

use super::{Tiff, refused, text_tag, value_tag};
use crate::error::{Error, ErrorKind, Result};
use crate::grid::Size;
use crate::source::{Georeference, Registration, geographic};

// Keys.
const MODEL_TYPE: u16 = 1024;
const RASTER_TYPE: u16 = 1025;
const CITATION: u16 = 1026;
const GEODETIC_CRS: u16 = 2048;
const GEODETIC_CITATION: u16 = 2049;
const ANGULAR_UNITS: u16 = 2054;
const PROJECTED_CRS: u16 = 3072;
const PROJECTED_CITATION: u16 = 3073;
const LINEAR_UNITS: u16 = 3076;
const LINEAR_UNIT_SIZE: u16 = 3077;
const VERTICAL_UNITS: u16 = 4099;
// Their values.
const PROJECTED: u16 = 1;
const GEOGRAPHIC: u16 = 2;
const POINT: u16 = 2;
const DEGREE: u16 = 9102;
const USER_DEFINED: u16 = 32767;
// Tags.
const DOUBLES: Tag = Tag::GeoDoubleParamsTag;
const TEXTS: Tag = Tag::GeoAsciiParamsTag;

/// Where an image lies.
#[derive(Debug)]
pub(super) struct Located {
    /// Place of its first sample once rows run from north to south; none where the file does not say.
    pub(super) place: Option<Georeference>,
    /// Metres between columns and rows.
    pub(super) spacing_m: [f64; 2],
    /// Whether the file's rows run from south to north.
    pub(super) south_up: bool,
    /// EPSG code of the unit of heights.
    pub(super) vertical_unit: Option<u16>,
    /// Sentences on what was assumed.
    pub(super) assumed: Vec<String>,
}

/// Name and length in metres of an EPSG unit of length.
pub(super) fn linear_unit(code: u16) -> Option<(&'static str, f64)> {
    match code {
        9001 => Some(("metre", 1.0)),
        9002 => Some(("foot", 0.3048)),
        9003 => Some(("US survey foot", 1200.0 / 3937.0)),
        _ => None,
    }
}

/// Finds where the current image of `tiff`, of `size` samples, lies.
///
/// # Errors
/// Rotated grids, control points, units that are not known here and damaged keys.
pub(super) fn locate(name: &str, tiff: &mut Tiff, size: Size) -> Result<Located> {
    let keys = Keys::read(name, tiff)?;
    let mut located = Located {
        place: None,
        spacing_m: [1.0, 1.0],
        south_up: false,
        vertical_unit: keys.code(VERTICAL_UNITS),
        assumed: Vec::new(),
    };
    let Some(transform) = transform(name, tiff)? else {
        located
            .assumed
            .push("The file does not say where it lies: the spacing is taken as 1 m.".into());
        return Ok(located);
    };
    let registration = if keys.code(RASTER_TYPE) == Some(POINT) {
        Registration::Point
    } else {
        Registration::Area
    };
    let inside = if registration == Registration::Area {
        0.5
    } else {
        0.0
    };
    let [px, py] = transform.pixel;
    if !(px > 0.0 && py != 0.0 && [px, py].iter().chain(&transform.origin).all(|v| v.is_finite())) {
        let what = format!("has pixels of {px} x {py} at {:?}", transform.origin);
        return Err(Error::new(ErrorKind::Unsupported, name, what)
            .advice("give columns from west to east and finite numbers"));
    }
    located.south_up = py > 0.0;
    let first_row = if located.south_up {
        (size.height - 1) as f64 + inside
    } else {
        inside
    };
    let mut place = Georeference {
        crs: keys.crs(tiff),
        origin: [
            transform.origin[0] + inside * px,
            transform.origin[1] + first_row * py,
        ],
        pixel: [px, -py.abs()],
        registration,
        geographic: false,
    };
    let degrees = match keys.model(name)? {
        Some(GEOGRAPHIC) => {
            if let Some(code) = keys.code(ANGULAR_UNITS).filter(|c| *c != DEGREE) {
                let what = format!("measures angles in the unit of EPSG code {code}; degrees are read");
                return Err(Error::new(ErrorKind::Unsupported, name, what));
            }
            true
        }
        Some(_) => false,
        None => {
            let degrees = geographic::looks_like_degrees(&place, size);
            let sentence = if degrees {
                geographic::DEGREES_ASSUMED
            } else {
                geographic::METRES_ASSUMED
            };
            located.assumed.push(sentence.into());
            degrees
        }
    };
    if degrees {
        place.geographic = true;
        let (spacing_m, sentence) =
            geographic::spacing_m(&place, size).map_err(|what| Error::new(ErrorKind::Broken, name, what))?;
        located.spacing_m = spacing_m;
        located.assumed.push(sentence);
    } else {
        let metres = keys.metres(name, &mut located.assumed)?;
        if place.crs.is_some() {
            located.assumed.push(geographic::GRID_NORTH_ASSUMED.into());
        }
        located.spacing_m = [px * metres, py.abs() * metres];
    }
    located.place = Some(place);
    Ok(located)
}

/// CRS coordinates of the raster's own (0, 0), and the step to the next column and row.
struct Transform {
    origin: [f64; 2],
    pixel: [f64; 2],
}

fn transform(name: &str, tiff: &mut Tiff) -> Result<Option<Transform>> {
    let mut doubles = |tag: Tag| -> Result<Option<Vec<f64>>> {
        let value = value_tag(tiff, tag).map_err(|error| refused(name, error))?;
        value
            .map(|v| v.into_f64_vec())
            .transpose()
            .map_err(|error| refused(name, error))
    };
    let matrix = doubles(Tag::ModelTransformationTag)?;
    let scale = doubles(Tag::ModelPixelScaleTag)?;
    let tie = doubles(Tag::ModelTiepointTag)?;
    let unsupported = |what: &str| Error::new(ErrorKind::Unsupported, name, what);
    if let Some(m) = matrix {
        let [a, b, _, x, c, d, _, y, ..] = m[..] else {
            let what = format!("has a transformation of {} numbers, where 16 belong", m.len());
            return Err(Error::new(ErrorKind::Broken, name, what));
        };
        if b != 0.0 || c != 0.0 {
            return Err(unsupported("is rotated or sheared against its coordinate system")
                .advice("warp it north-up, as with gdalwarp"));
        }
        return Ok(Some(Transform {
            origin: [x, y],
            pixel: [a, d],
        }));
    }
    match (scale.as_deref(), tie.as_deref()) {
        (Some([sx, sy, ..]), Some([i, j, _, x, y, _])) => {
            if *sy < 0.0 {
                // The standard says south-up, GDAL takes it as north-up.
                return Err(unsupported(
                    "has a negative vertical pixel scale, which programs read differently",
                )
                .advice("rewrite it north-up, as with gdal_translate"));
            }
            Ok(Some(Transform {
                origin: [x - i * sx, y + j * sy],
                pixel: [*sx, -*sy],
            }))
        }
        (None, None) => Ok(None),
        (_, Some(points)) if points.len() > 6 => Err(unsupported("is placed by several control points")
            .advice("warp it onto a grid, as with gdalwarp")),
        _ => Err(Error::new(
            ErrorKind::Broken,
            name,
            "has half of a georeference: pixel scale or tie point",
        )
        .advice("write both, as with gdal_translate -a_ullr")),
    }
}

/// The geo keys that hold a number, and where texts and doubles of the others stand.
#[derive(Debug, Default)]
struct Keys {
    entries: Vec<[u16; 4]>,
    doubles: Vec<f64>,
}

impl Keys {
    fn read(name: &str, tiff: &mut Tiff) -> Result<Self> {
        let failed = |error| refused(name, error);
        let Some(value) = value_tag(tiff, Tag::GeoKeyDirectoryTag).map_err(failed)? else {
            return Ok(Self::default());
        };
        let all = value.into_u16_vec().map_err(failed)?;
        let doubles = match value_tag(tiff, DOUBLES).map_err(failed)? {
            Some(value) => value.into_f64_vec().map_err(failed)?,
            None => Vec::new(),
        };
        let (header, entries) = all.split_at(all.len().min(4));
        let [1, _, _, count] = *header else {
            let what = format!("has a geo key directory that begins with {header:?}");
            return Err(Error::new(ErrorKind::Broken, name, what));
        };
        let entries = entries.as_chunks::<4>().0;
        let Some(entries) = entries.get(..usize::from(count)) else {
            let what = format!("has {} of {count} geo keys", entries.len());
            return Err(Error::new(ErrorKind::Broken, name, what));
        };
        Ok(Self {
            entries: entries.to_vec(),
            doubles,
        })
    }

    /// The value of a key that holds a code.
    fn code(&self, key: u16) -> Option<u16> {
        self.entries
            .iter()
            .find(|e| e[0] == key && e[1] == 0)
            .map(|e| e[3])
    }

    fn double(&self, key: u16) -> Option<f64> {
        let entry = self
            .entries
            .iter()
            .find(|e| e[0] == key && e[1] == DOUBLES.to_u16())?;
        self.doubles.get(usize::from(entry[3])).copied()
    }

    fn text(&self, tiff: &mut Tiff, key: u16) -> Option<String> {
        let entry = self
            .entries
            .iter()
            .find(|e| e[0] == key && e[1] == TEXTS.to_u16())?;
        let all = text_tag(tiff, TEXTS)?;
        let start = usize::from(entry[3]);
        let text = all
            .get(start..start + usize::from(entry[2]))?
            .trim_end_matches('|')
            .trim()
            .to_string();
        (!text.is_empty()).then_some(text)
    }

    /// [`PROJECTED`] or [`GEOGRAPHIC`], if the keys say.
    fn model(&self, name: &str) -> Result<Option<u16>> {
        match self.code(MODEL_TYPE) {
            Some(code @ (PROJECTED | GEOGRAPHIC)) => Ok(Some(code)),
            Some(3) => Err(Error::new(
                ErrorKind::Unsupported,
                name,
                "is in geocentric coordinates",
            )),
            _ if self.code(PROJECTED_CRS).is_some() => Ok(Some(PROJECTED)),
            _ if self.code(GEODETIC_CRS).is_some() => Ok(Some(GEOGRAPHIC)),
            _ => Ok(None),
        }
    }

    /// `EPSG:n`, or the file's own words.
    fn crs(&self, tiff: &mut Tiff) -> Option<String> {
        let coded = |key| self.code(key).filter(|code| !matches!(*code, 0 | USER_DEFINED));
        let geographic = self.code(MODEL_TYPE) == Some(GEOGRAPHIC);
        let code = if geographic {
            coded(GEODETIC_CRS)
        } else {
            coded(PROJECTED_CRS)
        };
        code.map(|code| format!("EPSG:{code}")).or_else(|| {
            let own = if geographic {
                GEODETIC_CITATION
            } else {
                PROJECTED_CITATION
            };
            self.text(tiff, own).or_else(|| self.text(tiff, CITATION))
        })
    }

    /// Metres in the unit of a projected system.
    fn metres(&self, name: &str, assumed: &mut Vec<String>) -> Result<f64> {
        match self.code(LINEAR_UNITS) {
            Some(USER_DEFINED) => match self.double(LINEAR_UNIT_SIZE) {
                Some(metres) if metres > 0.0 && metres.is_finite() => Ok(metres),
                _ => Err(Error::new(
                    ErrorKind::Unsupported,
                    name,
                    "has a unit of length of unknown size",
                )),
            },
            Some(code) => linear_unit(code).map(|(_, metres)| metres).ok_or_else(|| {
                let what =
                    format!("measures lengths in the unit of EPSG code {code}; metres and feet are read");
                Error::new(ErrorKind::Unsupported, name, what)
            }),
            None => {
                if !self.entries.is_empty() {
                    assumed
                        .push("The file does not name its unit of length; it is taken as the metre.".into());
                }
                Ok(1.0)
            }
        }
    }
}
