//! The OpenEXR header of a terrain file: written from a layout, and read back only if it says the same.
//!
//! Attributes are written here, not by the exr crate: it keeps them in a map whose order differs from run to run.
//! `clipscape.version` is the very first, the others follow by name.

use std::collections::BTreeMap;
use std::io::{self, BufReader, Read};
use std::sync::Arc;

use exr::meta::attribute::{
    self, AttributeValue, ChannelDescription, Compression, IntegerBounds, LevelMode, LineOrder, Text,
    TileDescription,
};
use exr::meta::header::Header;
use exr::meta::{BlockDescription, Headers, MetaData, Requirements, magic_number};
use exr::prelude::{SmallVec, Vec2};

use super::layout::{FORMAT_VERSION, Layout, Part, TILE};
use super::meta::{Meta, PREFIX, VERSION};
use crate::error::{Error, ErrorKind, Result};
use crate::grid::Size;
use crate::source::{Cursor, ReadAt};

/// The greatest length of a header; about 1 KiB a part and the attributes once are far below it.
const MAX_BYTES: usize = 1 << 20;

const REQUIREMENTS: Requirements = Requirements {
    file_format_version: 2,
    is_single_layer_and_tiled: false,
    has_long_names: false,
    has_deep_data: false,
    has_multiple_layers: true,
};

/// Whether `bytes` begin like a terrain file: an OpenEXR file whose first 64 KiB name `clipscape.version`.
///
/// One read. A file that cannot be read is none.
pub fn is_terrain(bytes: &dyn ReadAt) -> bool {
    let mut start = vec![0; bytes.size_bytes().min(1 << 16) as usize];
    let name: &[u8] = b"clipscape.version\0string\0";
    bytes.read_exact_at(0, &mut start).is_ok()
        && start.starts_with(&magic_number::BYTES)
        && start.windows(name.len()).any(|w| w == name)
}

/// The exr crate's description of a layout's parts.
pub(super) fn describe(layout: &Layout) -> MetaData {
    let window = vec2(layout.parts()[0].size);
    let headers: Headers = layout
        .parts()
        .iter()
        .map(|part| describe_part(part, window))
        .collect();
    MetaData {
        requirements: REQUIREMENTS,
        headers,
    }
}

fn describe_part(part: &Part, window: Vec2<usize>) -> Header {
    let (names, sample_type) = part.channels();
    // The second flag speaks to lossy compressions only.
    let channel = |name: &&str| ChannelDescription::new(*name, sample_type, false);
    let channels: SmallVec<[ChannelDescription; 5]> = names.iter().map(channel).collect();
    let blocks = BlockDescription::Tiles(TileDescription {
        tile_size: Vec2(TILE as usize, TILE as usize),
        level_mode: LevelMode::Singular,
        rounding_mode: exr::math::RoundingMode::Down,
    });
    Header::new(Text::from(part.name().as_str()), vec2(part.size), channels)
        .with_display_window(IntegerBounds::from_dimensions(window))
        .with_encoding(Compression::ZIP16, blocks, LineOrder::Increasing)
}

fn vec2(size: Size) -> Vec2<usize> {
    Vec2(size.width as usize, size.height as usize)
}

/// The file's bytes up to its offset tables.
pub(super) fn to_bytes(meta: &Meta, exr: &MetaData) -> Result<Vec<u8>> {
    let mut out = Vec::new();
    write_all(meta, exr, &mut out).map_err(|e| damaged("terrain file", &e))?;
    if out.len() > MAX_BYTES {
        let what = format!(
            "its header takes {} bytes, at most {MAX_BYTES} are allowed",
            out.len()
        );
        return Err(Error::new(ErrorKind::Limit, "terrain file", what).advice("shorten the CRS or the name"));
    }
    Ok(out)
}

fn write_all(meta: &Meta, exr: &MetaData, out: &mut Vec<u8>) -> exr::error::Result<()> {
    magic_number::write(out)?;
    exr.requirements.write(out)?;
    for (index, header) in exr.headers.iter().enumerate() {
        let standard = header
            .all_named_attributes()
            .map(|(name, value)| (name.to_vec(), value));
        let mut all: Vec<(Vec<u8>, AttributeValue)> = standard.collect();
        if index == 0 {
            let text = |t: String| AttributeValue::Text(Text::from_bytes_unchecked(t.into_bytes().into()));
            all.extend(
                meta.to_attributes()
                    .into_iter()
                    .map(|(n, t)| (n.into_bytes(), text(t))),
            );
        }
        all.sort_by(|(a, _), (b, _)| (a != VERSION.as_bytes(), a).cmp(&(b != VERSION.as_bytes(), b)));
        for (name, value) in &all {
            attribute::write(name, value, out)?;
        }
        out.push(0);
    }
    out.push(0);
    Ok(())
}

/// What the header of the terrain file `name` says, and its length in bytes.
pub(super) fn read(name: &str, bytes: Arc<dyn ReadAt>) -> Result<(Meta, Layout, u64)> {
    let file_bytes = bytes.size_bytes();
    let mut input = Counted {
        inner: BufReader::new(Cursor::new(bytes)),
        count: 0,
    };
    let exr = MetaData::read_from_buffered(&mut input, true).map_err(|e| damaged(name, &e))?;
    let broken = |what: String| {
        Error::new(ErrorKind::Broken, name, what).advice("fetch it again, or preprocess the DEM again")
    };
    let first = exr
        .headers
        .first()
        .ok_or_else(|| broken("it has no parts".into()))?;
    let attributes = ours(first).map_err(broken)?;
    match attributes.get(VERSION).map(|text| text.parse::<u32>()) {
        None => {
            let what = "an OpenEXR file, but not a terrain file: it has no attribute clipscape.version";
            return Err(Error::new(ErrorKind::Unsupported, name, what).advice("preprocess it first"));
        }
        Some(Ok(FORMAT_VERSION)) => {}
        Some(Ok(version)) => {
            let what = format!("terrain file of version {version}, this program reads {FORMAT_VERSION}");
            return Err(Error::new(ErrorKind::Unsupported, name, what).advice("preprocess the DEM again"));
        }
        Some(Err(_)) => return Err(broken("clipscape.version is not a number".into())),
    }
    let Vec2(width, height) = first.layer_size;
    let side = |n| i64::try_from(n).map_err(|_| broken(format!("a side of {n} samples is too long")));
    let size = Size {
        width: side(width)?,
        height: side(height)?,
    };
    let meta = Meta::from_attributes(&attributes, size).map_err(broken)?;
    let layout = Layout::new(&meta.grid, meta.light.is_some(), meta.day.is_some()).map_err(broken)?;
    compare(&exr, &layout).map_err(broken)?;
    // Each tile takes 8 bytes of table, 24 of coordinates and length, and a byte of data at the least.
    let least = layout.tile_count().saturating_mul(33).saturating_add(input.count);
    if least > file_bytes {
        let (Size { width, height }, tiles) = (size, layout.tile_count());
        return Err(broken(format!(
            "ends too early: {width} x {height} samples in {tiles} tiles need {least} bytes, it has {file_bytes}"
        )));
    }
    Ok((meta, layout, input.count))
}

/// The texts of a header's `clipscape.` attributes.
fn ours(header: &Header) -> Result<BTreeMap<String, String>, String> {
    let mut all = BTreeMap::new();
    for (name, value) in &header.own_attributes.other {
        let Ok(name) = std::str::from_utf8(name.as_slice()) else {
            continue;
        };
        if !name.starts_with(PREFIX) {
            continue;
        }
        let AttributeValue::Text(text) = value else {
            return Err(format!("{name} is not a text"));
        };
        let text = std::str::from_utf8(text.as_slice()).map_err(|_| format!("{name} is not UTF-8"))?;
        all.insert(name.to_owned(), text.to_owned());
    }
    Ok(all)
}

/// Compares the parts found with those of the layout; else what differs, as a phrase.
fn compare(found: &MetaData, layout: &Layout) -> Result<(), String> {
    let want = describe(layout);
    if found.headers.len() != want.headers.len() {
        return Err(format!(
            "it has {} parts instead of {}",
            found.headers.len(),
            want.headers.len()
        ));
    }
    for ((found, want), part) in found.headers.iter().zip(&want.headers).zip(layout.parts()) {
        let name = part.name();
        let Size { width, height } = part.size;
        if found.own_attributes.layer_name != want.own_attributes.layer_name {
            let other = found
                .own_attributes
                .layer_name
                .as_ref()
                .map(Text::to_string)
                .unwrap_or_default();
            return Err(format!("part {name} is called {other:?}"));
        }
        if found.layer_size != want.layer_size || found.own_attributes.layer_position != Vec2(0, 0) {
            let Vec2(w, h) = found.layer_size;
            return Err(format!(
                "part {name} has a data window of {w} x {h} instead of {width} x {height} at 0, 0"
            ));
        }
        if found.shared_attributes.display_window != want.shared_attributes.display_window {
            return Err(format!("part {name} has another display window than height.0"));
        }
        let kinds = |h: &Header| -> Vec<_> {
            h.channels
                .list
                .iter()
                .map(|c| (c.name.clone(), c.sample_type, c.sampling))
                .collect()
        };
        if kinds(found) != kinds(want) {
            return Err(format!(
                "part {name} has other channels than {}",
                part.channels().0.join(", ")
            ));
        }
        if found.blocks != want.blocks || found.deep {
            return Err(format!("part {name} is not tiled {TILE} x {TILE} with one level"));
        }
        if found.compression != want.compression {
            return Err(format!(
                "part {name} has {} instead of {}",
                found.compression, want.compression
            ));
        }
    }
    Ok(())
}

/// An error of the exr crate about the header of `name`.
fn damaged(name: &str, error: &exr::error::Error) -> Error {
    use exr::error::Error as Exr;
    match error {
        Exr::Io(e) => Error::io(name, io::Error::new(e.kind(), e.to_string())),
        Exr::NotSupported(what) => Error::new(
            ErrorKind::Unsupported,
            name,
            format!("an OpenEXR header with unsupported {what}"),
        ),
        _ => Error::new(
            ErrorKind::Broken,
            name,
            format!("damaged OpenEXR header ({error})"),
        )
        .advice("fetch it again, or preprocess the DEM again"),
    }
}

/// Counts the bytes read, and ends after [`MAX_BYTES`].
struct Counted<R> {
    inner: R,
    count: u64,
}

impl<R: Read> Read for Counted<R> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let left = (MAX_BYTES as u64).saturating_sub(self.count) as usize;
        let length = out.len().min(left);
        let count = self.inner.read(&mut out[..length])?;
        self.count += count as u64;
        Ok(count)
    }
}
