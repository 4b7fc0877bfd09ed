//! ENVI rasters: bare samples beside a text header `.hdr` that begins with `ENVI`.
//!
//! Header fields as `name = value`, values in braces over several lines: samples, lines, bands, header offset, data
//! type, interleave, byte order, data ignore value, map info, coordinate system string. In `map info` the reference
//! pixel's coordinates count from 1 at the outer corner of the first (L3Harris Geospatial, "ENVI header files").

use std::collections::HashMap;

use super::flat::{Flat, Layout};
use super::open::Input;
use super::sample::Coding;
use super::unnamed::{self, Located, System};
use super::{Georeference, Registration, SampleType};
use crate::error::{Error, ErrorKind, Result};

/// Whether `text` is such a header.
pub(super) fn is_header(text: &str) -> bool {
    text.starts_with("ENVI")
}

/// Opens the samples `input`, whose header is `text`.
pub(super) fn open(input: &Input, text: &str) -> Result<Flat> {
    let name = input.name;
    let header = Header::parse(name, text);
    let (width, height) = (header.whole("samples", None)?, header.whole("lines", None)?);
    let bands = header.whole("bands", Some(1))?;
    if width == 0 || height == 0 || bands == 0 {
        let what = format!("its header gives {width} x {height} samples in {bands} bands");
        return Err(Error::new(ErrorKind::Broken, name, what));
    }
    let sample = match header.whole("data type", None)? {
        1 => SampleType::U8,
        2 => SampleType::I16,
        3 => SampleType::I32,
        4 => SampleType::F32,
        5 => SampleType::F64,
        12 => SampleType::U16,
        13 => SampleType::U32,
        14 => SampleType::I64,
        15 => SampleType::U64,
        n => {
            let what = format!("has samples of ENVI's data type {n}");
            return Err(Error::new(ErrorKind::Unsupported, name, what)
                .advice("whole numbers of 8 to 64 bits and floats are read"));
        }
    };
    let big_endian = match header.whole("byte order", Some(0))? {
        0 => false,
        1 => true,
        n => {
            let what = format!("its header gives byte order {n}");
            return Err(Error::new(ErrorKind::Broken, name, what).advice("write 0 or 1"));
        }
    };
    let coding = Coding {
        sample,
        big_endian,
        nodata: input.options.nodata.or(header.number("data ignore value")?),
    };
    let band_count = u32::try_from(bands).unwrap_or(u32::MAX);
    let band = u64::from(input.options.band_index(name, band_count)?);
    let layout = header.layout([width, height, bands], band, coding)?;
    let size = layout.check(name, input.bytes.size_bytes())?;

    let mut located = Located::nowhere();
    if let Some(map) = header.map()? {
        let system = header
            .field("coordinate system string")
            .and_then(unnamed::parse)
            .or(map.system);
        located = unnamed::locate_in(name, system, Some(map.place), map.pixel, size)?;
    }
    Flat::located(input, "ENVI", located, layout, size)
}

/// The fields of a header; names in small letters, values without braces.
struct Header<'n> {
    name: &'n str,
    fields: HashMap<String, String>,
}

/// What `map info` says.
struct Map {
    place: Georeference,
    pixel: [f64; 2],
    system: Option<System>,
}

impl<'n> Header<'n> {
    fn parse(name: &'n str, text: &str) -> Self {
        let mut fields = HashMap::new();
        let mut lines = text.lines();
        while let Some(line) = lines.next() {
            let Some((key, value)) = line.split_once('=') else {
                continue;
            };
            let mut value = value.trim().to_string();
            while value.starts_with('{') && !value.contains('}') {
                let Some(more) = lines.next() else { break };
                value.push(' ');
                value.push_str(more.trim());
            }
            let value = value.trim_matches(['{', '}']).trim().to_string();
            fields.insert(key.trim().to_ascii_lowercase(), value);
        }
        Self { name, fields }
    }

    fn field(&self, key: &str) -> Option<&str> {
        self.fields.get(key).map(String::as_str)
    }

    fn broken(&self, what: String) -> Error {
        Error::new(ErrorKind::Broken, self.name, what)
    }

    fn whole(&self, key: &str, default: Option<u64>) -> Result<u64> {
        match (self.field(key), default) {
            (None, Some(default)) => Ok(default),
            (None, None) => Err(self.broken(format!("its header has no {key:?}"))),
            (Some(text), _) => text
                .parse()
                .map_err(|_| self.broken(format!("its header's {key:?} is no whole number"))),
        }
    }

    fn number(&self, key: &str) -> Result<Option<f64>> {
        let parse = |text: &str| {
            text.parse()
                .map_err(|_| self.broken(format!("its header's {key:?} is no number")))
        };
        self.field(key).map(parse).transpose()
    }

    fn layout(&self, [width, height, bands]: [u64; 3], band: u64, coding: Coding) -> Result<Layout> {
        let too_large = || {
            Error::new(
                ErrorKind::Limit,
                self.name,
                "its header gives a size beyond all files",
            )
        };
        let product = |factors: [u64; 3]| {
            let all = factors.iter().try_fold(1u64, |p, f| p.checked_mul(*f));
            all.ok_or_else(too_large)
        };
        let bytes = coding.sample.bytes() as u64;
        let order = self.field("interleave").unwrap_or("bsq").to_ascii_lowercase();
        let (pixel_bytes, row_bytes, band_start) = match order.as_str() {
            "bsq" => (
                bytes,
                product([bytes, width, 1])?,
                product([band, height, product([bytes, width, 1])?])?,
            ),
            "bil" => (
                bytes,
                product([bytes, width, bands])?,
                product([band, bytes, width])?,
            ),
            "bip" => (
                product([bytes, bands, 1])?,
                product([bytes, bands, width])?,
                product([band, bytes, 1])?,
            ),
            _ => return Err(self.broken("its header's \"interleave\" is none of bsq, bil, bip".into())),
        };
        let offset = self.whole("header offset", Some(0))?;
        Ok(Layout {
            start: offset.checked_add(band_start).ok_or_else(too_large)?,
            pixel_bytes,
            row_bytes,
            ..Layout::dense(width, height, coding)
        })
    }

    /// Projection, reference pixel, its coordinates, pixel size, then what belongs to the projection.
    fn map(&self) -> Result<Option<Map>> {
        let Some(text) = self.field("map info") else {
            return Ok(None);
        };
        let parts: Vec<&str> = text.split(',').map(str::trim).collect();
        let numbers: Vec<f64> = parts
            .iter()
            .skip(1)
            .take(6)
            .map_while(|p| p.parse().ok())
            .collect();
        let [ref_x, ref_y, x, y, dx, dy] = numbers[..] else {
            return Err(self.broken("its header's \"map info\" does not give six numbers".into()));
        };
        let option = |key: &str| {
            let pairs = parts.iter().filter_map(|p| p.split_once('='));
            pairs
                .filter(|(k, _)| k.trim().eq_ignore_ascii_case(key))
                .map(|(_, v)| v.trim())
                .next()
        };
        if option("rotation").is_some_and(|r| r.parse() != Ok(0.0)) {
            return Err(Error::new(
                ErrorKind::Unsupported,
                self.name,
                "is rotated against its coordinate system",
            )
            .advice("warp it north-up, as with gdalwarp"));
        }
        let origin = [x + (1.5 - ref_x) * dx, y - (1.5 - ref_y) * dy];
        if !(dx > 0.0 && dy > 0.0 && origin.iter().chain(&[dx, dy]).all(|v| v.is_finite())) {
            return Err(self.broken(format!("its header gives pixels of {dx} x {dy} at {x}, {y}")));
        }
        let geographic = parts[0].eq_ignore_ascii_case("Geographic Lat/Lon");
        let metres = match option("units").map(str::to_ascii_lowercase).as_deref() {
            _ if geographic => None,
            Some("feet") => Some(0.3048),
            Some("us survey feet") => Some(1200.0 / 3937.0),
            None | Some("meters" | "metres") => Some(1.0),
            Some(other) => {
                let what = format!("measures lengths in {other:?}");
                return Err(
                    Error::new(ErrorKind::Unsupported, self.name, what).advice("metres and feet are read")
                );
            }
        };
        // "Arbitrary" is a grid without any system.
        let known = !parts[0].eq_ignore_ascii_case("Arbitrary");
        let words = [&parts[..1], parts.get(7..).unwrap_or(&[])].concat().join(" ");
        Ok(Some(Map {
            place: Georeference {
                crs: None,
                origin,
                pixel: [dx, -dy],
                registration: Registration::Area,
                geographic,
            },
            pixel: [dx, dy],
            system: known.then_some(System { text: words, metres }),
        }))
    }
}

#[cfg(test)]
mod tests;
