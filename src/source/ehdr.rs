//! ESRI `.bil`, `.bip`, `.bsq` and `.flt`: bare samples beside a text header `.hdr`.
//!
//! Header words in any case and order, a word and a value a line: NROWS, NCOLS, NBANDS, NBITS, PIXELTYPE, BYTEORDER,
//! LAYOUT, SKIPBYTES, BANDROWBYTES, TOTALROWBYTES, BANDGAPBYTES, NODATA or NODATA_VALUE, and the place as ULXMAP,
//! ULYMAP, XDIM, YDIM (the *centre* of the upper left cell) or as in an ESRI ASCII grid (Esri, "BIL, BIP, and BSQ raster
//! files"). Where NBITS or PIXELTYPE are left out, and for the byte order that is then taken, GDAL's EHdr driver is
//! followed. A `.prj` file beside may name the reference system.

use std::collections::HashMap;

use super::flat::{Flat, Layout};
use super::open::Input;
use super::sample::Coding;
use super::unnamed::{self, Located};
use super::{Georeference, Registration, SampleType};
use crate::error::{Error, ErrorKind, Result};

/// Whether `text` is such a header.
pub(super) fn is_header(text: &str) -> bool {
    let header = Header::parse(text);
    header.words.contains_key("nrows") && header.words.contains_key("ncols")
}

/// Opens the samples `input`, whose header is `text`.
pub(super) fn open(input: &Input, text: &str) -> Result<Flat> {
    let name = input.name;
    let header = Header::parse(text);
    let (width, height) = (
        header.whole(name, "ncols", None)?,
        header.whole(name, "nrows", None)?,
    );
    let bands = header.whole(name, "nbands", Some(1))?;
    if width == 0 || height == 0 || bands == 0 {
        let what = format!("its header gives {width} x {height} samples in {bands} bands");
        return Err(Error::new(ErrorKind::Broken, name, what));
    }
    let file_bytes = input.bytes.size_bytes();
    let mut assumed = Vec::new();
    let nodata = header.nodata(name)?;
    let sample = header.sample(input, [width, height, bands], nodata, &mut assumed)?;
    let big_endian = match header.word("byteorder").and_then(|w| w.chars().next()) {
        Some('I' | 'i' | 'L' | 'l') => false,
        Some('M' | 'm') => true,
        Some(_) => {
            let what = format!(
                "its header gives BYTEORDER {:?}",
                header.word("byteorder").unwrap_or("")
            );
            return Err(Error::new(ErrorKind::Unsupported, name, what).advice("write I or M"));
        }
        None => {
            if sample.bytes() > 1 {
                assumed.push(
                    "The byte order is unknown; the most significant byte is taken as the first.".into(),
                );
            }
            true
        }
    };
    let coding = Coding {
        sample,
        big_endian,
        nodata: input.options.nodata.or(nodata),
    };
    let band_count = u32::try_from(bands).unwrap_or(u32::MAX);
    let band = u64::from(input.options.band_index(name, band_count)?);
    let layout = header.layout(name, [width, height, bands], band, coding)?;
    let size = layout.check(name, file_bytes)?;

    let pixel = header.pixel(name)?;
    let mut located = match pixel {
        Some(pixel) => unnamed::locate(input, header.place(name, height, pixel)?, pixel, size)?,
        None => Located::nowhere(),
    };
    assumed.append(&mut located.assumed);
    located.assumed = assumed;
    Flat::located(input, "ESRI BIL", located, layout, size)
}

/// The words of a header, in small letters, with their values.
struct Header<'t> {
    words: HashMap<String, &'t str>,
}

impl<'t> Header<'t> {
    fn parse(text: &'t str) -> Self {
        let pair = |line: &'t str| {
            let mut parts = line.split_whitespace();
            Some((parts.next()?.to_ascii_lowercase(), parts.next()?))
        };
        Self {
            words: text.lines().filter_map(pair).collect(),
        }
    }

    fn word(&self, key: &str) -> Option<&'t str> {
        self.words.get(key).copied()
    }

    fn whole(&self, name: &str, key: &str, default: Option<u64>) -> Result<u64> {
        match (self.word(key), default) {
            (None, Some(default)) => Ok(default),
            (None, None) => {
                let what = format!("its header has no {}", key.to_uppercase());
                Err(Error::new(ErrorKind::Broken, name, what))
            }
            (Some(text), _) => text
                .parse()
                .map_err(|_| self.odd(name, key, "is no whole number")),
        }
    }

    fn number(&self, name: &str, key: &str) -> Result<Option<f64>> {
        let parse = |text: &str| {
            text.parse::<f64>()
                .map_err(|_| self.odd(name, key, "is no number"))
        };
        self.word(key).map(parse).transpose()
    }

    fn odd(&self, name: &str, key: &str, why: &str) -> Error {
        let text: String = self.word(key).unwrap_or("").chars().take(40).collect();
        let what = format!("its header's {}, {text:?}, {why}", key.to_uppercase());
        Error::new(ErrorKind::Broken, name, what)
    }

    fn nodata(&self, name: &str) -> Result<Option<f64>> {
        let key = if self.word("nodata").is_some() {
            "nodata"
        } else {
            "nodata_value"
        };
        self.number(name, key)
    }

    /// The type of samples, from NBITS and PIXELTYPE; where both are missing, from the file's length.
    fn sample(
        &self,
        input: &Input,
        [width, height, bands]: [u64; 3],
        nodata: Option<f64>,
        assumed: &mut Vec<String>,
    ) -> Result<SampleType> {
        let kind = self.word("pixeltype").and_then(|w| w.chars().next());
        let mut kind = kind.map(|c| c.to_ascii_uppercase());
        let told = kind.is_some();
        let mut bits = match self.word("nbits") {
            Some(_) => Some(self.whole(input.name, "nbits", None)?),
            None => None,
        };
        if bits.is_none() && kind.is_none() {
            let all = u128::from(width) * u128::from(height) * u128::from(bands);
            bits = match u128::from(input.bytes.size_bytes()) / all {
                bytes @ (1 | 2 | 4 | 8) => Some(bytes as u64 * 8),
                _ => None,
            };
            if bits == Some(32) {
                kind = Some('F');
            }
        }
        if kind.is_none() && input.ending() == "flt" {
            kind = Some('F');
        }
        if kind.is_none() && nodata.is_some_and(|n| n < 0.0) {
            kind = Some('S');
        }
        let bits = bits.unwrap_or(if kind == Some('F') { 32 } else { 8 });
        let sample = match (bits, kind) {
            (8, Some('S')) => SampleType::I8,
            (8, Some('U') | None) => SampleType::U8,
            (16, Some('S')) => SampleType::I16,
            (16, Some('U') | None) => SampleType::U16,
            (32, Some('S')) => SampleType::I32,
            (32, Some('U') | None) => SampleType::U32,
            (32, Some('F')) => SampleType::F32,
            (64, Some('F')) => SampleType::F64,
            _ => {
                let what = format!(
                    "has {bits} bits a sample of type {:?}",
                    self.word("pixeltype").unwrap_or("none")
                );
                return Err(Error::new(ErrorKind::Unsupported, input.name, what)
                    .advice("8, 16 and 32 bit integers, 32 and 64 bit floats are read"));
            }
        };
        if !told {
            assumed.push(format!(
                "The header names no PIXELTYPE: samples are taken as {}.",
                sample.name()
            ));
        }
        Ok(sample)
    }

    /// Where the samples of band number `band` stand.
    fn layout(
        &self,
        name: &str,
        [width, height, bands]: [u64; 3],
        band: u64,
        coding: Coding,
    ) -> Result<Layout> {
        let bytes = coding.sample.bytes() as u64;
        let too_large = || Error::new(ErrorKind::Limit, name, "its header gives a size beyond all files");
        let product = |a: u64, b: u64| a.checked_mul(b).ok_or_else(too_large);
        let skip = self.whole(name, "skipbytes", Some(0))?;
        let dense_row = product(width, bytes)?;
        let order = self.word("layout").unwrap_or("bil").to_ascii_lowercase();
        let (pixel_bytes, row_bytes, band_start) = match order.as_str() {
            "bip" => {
                let pixel = product(bytes, bands)?;
                let row = self.whole(name, "totalrowbytes", Some(product(pixel, width)?))?;
                (pixel, row, product(band, bytes)?)
            }
            "bsq" => {
                let gap = self.whole(name, "bandgapbytes", Some(0))?;
                let whole = product(dense_row, height)?
                    .checked_add(gap)
                    .ok_or_else(too_large)?;
                (bytes, dense_row, product(band, whole)?)
            }
            "bil" => {
                let band_row = self.whole(name, "bandrowbytes", Some(dense_row))?;
                let row = self.whole(name, "totalrowbytes", Some(product(band_row, bands)?))?;
                (bytes, row, product(band, band_row)?)
            }
            _ => return Err(self.odd(name, "layout", "is none of BIL, BIP, BSQ")),
        };
        Ok(Layout {
            start: skip.checked_add(band_start).ok_or_else(too_large)?,
            pixel_bytes,
            row_bytes,
            ..Layout::dense(width, height, coding)
        })
    }

    /// Steps between columns and rows in the file's own units, if it gives them.
    fn pixel(&self, name: &str) -> Result<Option<[f64; 2]>> {
        let cell = self.number(name, "cellsize")?;
        let dx = self.number(name, "xdim")?.or(cell);
        let dy = self.number(name, "ydim")?.or(cell);
        match (dx, dy) {
            (Some(dx), Some(dy)) if dx > 0.0 && dy > 0.0 && dx.is_finite() && dy.is_finite() => {
                Ok(Some([dx, dy]))
            }
            (None, None) => Ok(None),
            _ => {
                let what = "its header's cell size is not above 0 and finite in both directions";
                Err(Error::new(ErrorKind::Broken, name, what))
            }
        }
    }

    /// Where the centre of the first sample lies, if the header says.
    fn place(&self, name: &str, rows: u64, [dx, dy]: [f64; 2]) -> Result<Option<Georeference>> {
        let number = |key| self.number(name, key);
        let corner = number("xllcorner")?.is_some() || number("yllcorner")?.is_some();
        let centre = number("ulxmap")?.or(number("xllcenter")?);
        let west = centre.or(number("xllcorner")?.map(|x| x + 0.5 * dx));
        let south = number("yllcenter")?.or(number("yllcorner")?.map(|y| y + 0.5 * dy));
        let north = south.map(|y| y + (rows - 1) as f64 * dy).or(number("ulymap")?);
        let (Some(west), Some(north)) = (west, north) else {
            return Ok(None);
        };
        if !(west.is_finite() && north.is_finite()) {
            let what = format!("its header puts it at {west}, {north}");
            return Err(Error::new(ErrorKind::Broken, name, what));
        }
        Ok(Some(Georeference {
            crs: None,
            origin: [west, north],
            pixel: [dx, -dy],
            registration: if corner {
                Registration::Area
            } else {
                Registration::Point
            },
            geographic: false,
        }))
    }
}

#[cfg(test)]
mod tests;
