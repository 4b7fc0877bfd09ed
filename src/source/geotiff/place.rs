//! Where a GeoTIFF lies: pixel scale and tie point, or a matrix, and the geo keys (OGC GeoTIFF 1.1, 19-008r4,
//! chapters 7.1 to 7.5).
//!
//! With `PixelIsArea` (also where nothing is said) the tie point names the outer corner of a pixel and its
//! sample lies half a pixel inside; with `PixelIsPoint` it names the sample.

use super::ifd::{self, Directory, File};
use super::keys::{Keys, Model};
use crate::error::{Error, ErrorKind, Result};
use crate::grid::Size;
use crate::source::{Georeference, Registration, geographic};

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

/// Finds where the image of a directory, of `size` samples, lies.
///
/// # Errors
/// Rotated grids, control points, units that are not known here and damaged keys.
pub(super) fn locate(file: &File, image: &Directory, size: Size) -> Result<Located> {
    let keys = Keys::read(file, image)?;
    let mut located = Located {
        place: None,
        spacing_m: [1.0, 1.0],
        south_up: false,
        vertical_unit: keys.vertical_unit(),
        assumed: Vec::new(),
    };
    let Some(transform) = transform(file, image, &mut located.assumed)? else {
        let what = "The file does not say where it lies: the spacing is taken as 1 m.";
        located.assumed.push(what.into());
        return Ok(located);
    };
    let (registration, inside) = if keys.is_point() {
        (Registration::Point, 0.0)
    } else {
        (Registration::Area, 0.5)
    };
    let [px, py] = transform.pixel;
    if !(px > 0.0 && py != 0.0 && [px, py].iter().chain(&transform.origin).all(|v| v.is_finite())) {
        let what = format!("has pixels of {px} x {py} at {:?}", transform.origin);
        return Err(file
            .unsupported(what)
            .advice("give columns from west to east and finite numbers"));
    }
    located.south_up = py > 0.0;
    if located.south_up {
        let what = "The file's rows run from south to north; they are given from north to south.";
        located.assumed.push(what.into());
    }
    let first_row = if located.south_up {
        (size.height - 1) as f64 + inside
    } else {
        inside
    };
    let mut place = Georeference {
        crs: keys.crs(),
        origin: [
            transform.origin[0] + inside * px,
            transform.origin[1] + first_row * py,
        ],
        pixel: [px, -py.abs()],
        registration,
        geographic: false,
    };
    let degrees = match keys.model(file)? {
        Some(model) => model == Model::Degrees,
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
        let (spacing_m, sentence) = geographic::spacing_on(keys.ellipsoid(), &place, size)
            .map_err(|what| Error::new(ErrorKind::Broken, &file.name, what))?;
        located.spacing_m = spacing_m;
        located.assumed.push(sentence);
    } else {
        let metres = keys.metres(file, &mut located.assumed)?;
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

fn transform(file: &File, image: &Directory, assumed: &mut Vec<String>) -> Result<Option<Transform>> {
    let scale = file.reals(image, ifd::PIXEL_SCALE)?;
    let tie = file.reals(image, ifd::TIE_POINTS)?;
    match (scale.as_deref(), tie.as_deref()) {
        (Some([sx, sy, ..]), Some([i, j, _, x, y, _])) => {
            if *sy < 0.0 {
                let what =
                    "Its vertical pixel scale is negative; as in GDAL, its first row is the northernmost.";
                assumed.push(what.into());
            }
            return Ok(Some(Transform {
                origin: [x - i * sx, y + j * sy.abs()],
                pixel: [*sx, -sy.abs()],
            }));
        }
        (_, Some(points)) if points.len() > 6 => {
            return Err(file
                .unsupported("is placed by several control points")
                .advice("warp it onto a grid, as with gdalwarp"));
        }
        _ => {}
    }
    if let Some(m) = file.reals(image, ifd::TRANSFORMATION)? {
        let [a, b, _, x, c, d, _, y, ..] = m[..] else {
            return Err(file.broken(format!(
                "has a transformation of {} numbers, where 16 belong",
                m.len()
            )));
        };
        if b != 0.0 || c != 0.0 {
            return Err(file
                .unsupported("is rotated or sheared against its coordinate system")
                .advice("warp it north-up, as with gdalwarp"));
        }
        return Ok(Some(Transform {
            origin: [x, y],
            pixel: [a, d],
        }));
    }
    if scale.is_none() && tie.is_none() {
        return Ok(None);
    }
    let what = "has half of a georeference: pixel scale or tie point";
    Err(Error::new(ErrorKind::Broken, &file.name, what).advice("write both, as with gdal_translate -a_ullr"))
}
