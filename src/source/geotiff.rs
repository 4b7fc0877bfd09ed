//! GeoTIFF: one band of heights in strips or tiles, of any integer or float type that the `tiff` crate decodes.
//!
//! The image is decoded block by block and held whole. Raw samples equal to `GDAL_NODATA` (tag 42113, text) in
//! their own type, NaN and infinities are no data; blocks that are not stored (length 0) are no data, or 0
//! where the file names none, as in GDAL. Scale, offset and unit of heights come from `GDAL_METADATA` (tag
//! 42112) and the geo keys; where the image lies, from `geotiff/place.rs`.

mod metadata;
mod nodata;
mod place;

use std::io::BufReader;
use std::sync::Arc;

use tiff::TiffError;
use tiff::decoder::ifd::Value;
use tiff::decoder::{Decoder, DecodingResult, DecodingSampleType, Limits};
use tiff::tags::Tag;

use self::nodata::Nodata;
use super::held::{HEIGHTS_ASSUMED, Held, Scale, Values, check_claim, size};
use super::{Cursor, Description, OpenOptions, ReadAt};
use crate::error::{Error, ErrorKind, Result};
use crate::grid::Grid;

/// A block may always be this large, however short the file: tiles are often larger than a small image.
const FREE_BLOCK_BYTES: u64 = 16 << 20;
/// The largest table of block offsets that is read, in bytes as the library counts them.
const TABLE_BYTES: usize = 256 << 20;
/// The most numbers or letters of a tag that places or describes the image.
const MAX_VALUES: u64 = 1 << 20;
/// Later images of the file that are looked at for masks.
const MAX_IMAGES: usize = 64;

/// None, LZW, two numbers of deflate, and PackBits. What else the library decodes loses exactness (JPEG) or
/// holds no heights (fax).
const COMPRESSIONS: [u16; 5] = [1, 5, 8, 32946, 32773];

const GRAY: u16 = 1;
const MASK: u32 = 4;
const OVERVIEW: u32 = 1;

type Tiff = Decoder<BufReader<Cursor>>;

/// Reads the image `name`.
pub(super) fn open(name: &str, bytes: Arc<dyn ReadAt>, options: &OpenOptions) -> Result<Held> {
    let file_bytes = bytes.size_bytes();
    let failed = |error: TiffError| refused(name, error);
    let mut tiff = Decoder::new(BufReader::new(Cursor::new(bytes))).map_err(failed)?;
    let (width, height) = tiff.dimensions().map_err(failed)?;
    check_kind(name, &mut tiff)?;
    options.band_index(name, 1)?;
    let layout = tiff.image_chunk_buffer_layout(0).map_err(failed)?;
    let sample = layout.sample_type.map(Sample::of);
    let Some(sample) = sample else {
        return Err(Error::new(
            ErrorKind::Unsupported,
            name,
            "has samples of a type that is not read here",
        ));
    };
    let count = check_claim(
        name,
        u64::from(width),
        u64::from(height),
        sample.bytes,
        file_bytes,
    )?;

    let (block_width, block_height) = tiff.chunk_dimensions();
    let block_bytes =
        u128::from(block_width) * u128::from(sample.bytes) * u128::from(block_height.min(height));
    let room = (count as u64 * sample.bytes).max(FREE_BLOCK_BYTES);
    if block_bytes > u128::from(room) {
        let what = format!("has blocks of {block_width} x {block_height} for {width} x {height} samples");
        return Err(Error::new(ErrorKind::Limit, name, what));
    }
    let mut limits = Limits::default();
    limits.decoding_buffer_size = usize::try_from(room).unwrap_or(usize::MAX);
    limits.intermediate_buffer_size = usize::try_from(file_bytes).unwrap_or(usize::MAX);
    limits.ifd_value_size = TABLE_BYTES;
    let mut tiff = tiff.with_limits(limits);

    let size = size(u64::from(width), u64::from(height));
    let mut assumed = Vec::new();
    let nodata = match options.nodata {
        Some(value) => Nodata::parse(&format!("{value:?}"), sample.integer),
        None => nodata_of(name, &mut tiff, sample, &mut assumed)?,
    };
    let values = decode(name, &mut tiff, [width, height], nodata, sample, count)?;
    let located = place::locate(name, &mut tiff, size)?;
    let items = metadata::read(&text_tag(&mut tiff, Tag::Unknown(42112)).unwrap_or_default());
    let unit = vertical_unit(&located, &items, &mut assumed);
    check_other_images(name, &mut tiff, &mut assumed)?;

    let mut values = values;
    if located.south_up {
        values.flip_rows(width as usize);
    }
    let scale = Scale {
        scale: items.scale * unit.metres,
        offset: items.offset * unit.metres,
    };
    let heights = values.finish(name, scale)?;
    assumed.splice(0..0, located.assumed);
    assumed.extend(heights.infinite_sentence());
    let description = Description {
        grid: Grid {
            base_m: heights.base_m,
            ..Grid::new(size.width, size.height, located.spacing_m)
        },
        format: "GeoTIFF".into(),
        sample_type: sample.name.into(),
        step_m: sample.integer.then_some(scale.scale.abs()),
        place: located.place,
        vertical_unit: unit.name.into(),
        assumed,
        name: name.into(),
    };
    Held::new(description, heights.heights)
}

/// A type of samples.
#[derive(Clone, Copy, Debug)]
struct Sample {
    name: &'static str,
    bytes: u64,
    integer: bool,
}

impl Sample {
    fn of(kind: DecodingSampleType) -> Self {
        let (name, bytes, integer) = match kind {
            DecodingSampleType::U8 => ("uint8", 1, true),
            DecodingSampleType::U16 => ("uint16", 2, true),
            DecodingSampleType::U32 => ("uint32", 4, true),
            DecodingSampleType::U64 => ("uint64", 8, true),
            DecodingSampleType::I8 => ("int8", 1, true),
            DecodingSampleType::I16 => ("int16", 2, true),
            DecodingSampleType::I32 => ("int32", 4, true),
            DecodingSampleType::I64 => ("int64", 8, true),
            DecodingSampleType::F16 => ("float16", 2, false),
            DecodingSampleType::F32 => ("float32", 4, false),
            DecodingSampleType::F64 => ("float64", 8, false),
        };
        Self { name, bytes, integer }
    }
}

/// Refuses images that are no single band of heights.
fn check_kind(name: &str, tiff: &mut Tiff) -> Result<()> {
    let failed = |error: TiffError| refused(name, error);
    let unsupported = |what: String| Err(Error::new(ErrorKind::Unsupported, name, what));
    let tag = |tiff: &mut Tiff, tag: Tag| tiff.find_tag_unsigned::<u16>(tag);
    let bands = tag(tiff, Tag::SamplesPerPixel).map_err(failed)?.unwrap_or(1);
    if bands != 1 {
        return unsupported(format!("has {bands} bands, and one is read"));
    }
    let photometric = tag(tiff, Tag::PhotometricInterpretation).map_err(failed)?;
    match photometric {
        Some(GRAY) => {}
        Some(0) => return unsupported("counts downwards (photometric interpretation WhiteIsZero)".into()),
        Some(3) => return unsupported("has a palette of colours, not heights".into()),
        Some(n) => {
            return unsupported(format!(
                "has colours (photometric interpretation {n}), not heights"
            ));
        }
        None => return unsupported("has no photometric interpretation".into()),
    }
    let compression = tag(tiff, Tag::Compression).map_err(failed)?.unwrap_or(1);
    if !COMPRESSIONS.contains(&compression) {
        let known = match compression {
            7 => "JPEG",
            34887 => "LERC",
            34925 => "LZMA",
            50000 => "zstd",
            50001 => "WebP",
            _ => "unknown here",
        };
        let what = format!("is compressed in a way that is not read (number {compression}, {known})");
        return Err(Error::new(ErrorKind::Unsupported, name, what)
            .advice("compress it with deflate, as with gdal_translate -co COMPRESS=DEFLATE"));
    }
    let formats = tiff
        .find_tag_unsigned_vec::<u16>(Tag::SampleFormat)
        .map_err(failed)?
        .unwrap_or(vec![1]);
    if let [5 | 6, ..] = formats[..] {
        return unsupported("has complex numbers, not heights".into());
    }
    let bits = tiff
        .find_tag_unsigned_vec::<u16>(Tag::BitsPerSample)
        .map_err(failed)?
        .unwrap_or(vec![1]);
    if ![Some(&8), Some(&16), Some(&32), Some(&64)].contains(&bits.first()) {
        return unsupported(format!("has {bits:?} bits a sample; 8, 16, 32 and 64 are read"));
    }
    Ok(())
}

/// The value that means no data, if the file names one.
fn nodata_of(name: &str, tiff: &mut Tiff, sample: Sample, assumed: &mut Vec<String>) -> Result<Nodata> {
    if value_tag(tiff, Tag::GdalNodata)
        .map_err(|error| refused(name, error))?
        .is_none()
    {
        return Ok(Nodata::None);
    }
    let text = text_tag(tiff, Tag::GdalNodata).unwrap_or_default();
    let text = text.trim();
    let nodata = Nodata::parse(text, sample.integer);
    if matches!(nodata, Nodata::None) && !text.is_empty() {
        assumed.push(format!(
            "Its no-data value, {text:?}, is no number that its samples can have."
        ));
    }
    Ok(nodata)
}

/// All samples, block by block.
fn decode(
    name: &str,
    tiff: &mut Tiff,
    [width, height]: [u32; 2],
    nodata: Nodata,
    sample: Sample,
    count: usize,
) -> Result<Values> {
    let failed = |error: TiffError| refused(name, error);
    let stored = stored_bytes(tiff).map_err(failed)?;
    let (block_width, block_height) = tiff.chunk_dimensions();
    let across = width.div_ceil(block_width);
    let blocks = u64::from(across) * u64::from(height.div_ceil(block_height));
    if stored.len() as u64 != blocks {
        let what = format!("lists {} blocks where its size asks for {blocks}", stored.len());
        return Err(Error::new(ErrorKind::Broken, name, what));
    }
    let mut values = Values::new(name, count)?;
    let row_bytes = block_width as usize * sample.bytes as usize;
    let mut block = DecodingResult::U8(Vec::new());
    for (index, bytes) in (0u32..).zip(stored) {
        let (x0, z0) = ((index % across) * block_width, (index / across) * block_height);
        let columns = block_width.min(width - x0) as usize;
        let rows = block_height.min(height - z0) as usize;
        let start = |z: usize| (z0 as usize + z) * width as usize + x0 as usize;
        if bytes == 0 {
            if matches!(nodata, Nodata::None) {
                for at in (0..rows).flat_map(|z| start(z)..start(z) + columns) {
                    values.set(name, at, 0.0)?;
                }
            }
            continue;
        }
        // Rows are read with what pads them beyond the image's edge: the library fails on LZW tiles where it
        // has to skip that itself (image-rs/image-tiff issue 395).
        tiff.read_chunk_to_buffer(&mut block, index, row_bytes)
            .map_err(failed)?;
        let mut put = |x: usize, z: usize, value: f64| values.set(name, start(z) + x, value);
        let cut = Cut {
            columns,
            rows,
            stride: block_width as usize,
        };
        match &block {
            DecodingResult::U8(v) => cut.each(v, |x, z, v| put(x, z, nodata.whole(v.into())))?,
            DecodingResult::U16(v) => cut.each(v, |x, z, v| put(x, z, nodata.whole(v.into())))?,
            DecodingResult::U32(v) => cut.each(v, |x, z, v| put(x, z, nodata.whole(v.into())))?,
            DecodingResult::U64(v) => cut.each(v, |x, z, v| put(x, z, nodata.whole(v.into())))?,
            DecodingResult::I8(v) => cut.each(v, |x, z, v| put(x, z, nodata.whole(v.into())))?,
            DecodingResult::I16(v) => cut.each(v, |x, z, v| put(x, z, nodata.whole(v.into())))?,
            DecodingResult::I32(v) => cut.each(v, |x, z, v| put(x, z, nodata.whole(v.into())))?,
            DecodingResult::I64(v) => cut.each(v, |x, z, v| put(x, z, nodata.whole(v.into())))?,
            DecodingResult::F16(v) => cut.each(v, |x, z, v| put(x, z, nodata.half(v)))?,
            DecodingResult::F32(v) => cut.each(v, |x, z, v| put(x, z, nodata.single(v)))?,
            DecodingResult::F64(v) => cut.each(v, |x, z, v| put(x, z, nodata.double(v)))?,
        }
    }
    Ok(values)
}

/// The part of a decoded block that lies in the image.
struct Cut {
    columns: usize,
    rows: usize,
    stride: usize,
}

impl Cut {
    /// Calls `put` with column, row and value of each sample.
    fn each<T: Copy>(&self, values: &[T], mut put: impl FnMut(usize, usize, T) -> Result<()>) -> Result<()> {
        debug_assert!(values.len() >= self.stride * (self.rows - 1) + self.columns);
        for (z, row) in values.chunks(self.stride).take(self.rows).enumerate() {
            for (x, value) in row.iter().take(self.columns).enumerate() {
                put(x, z, *value)?;
            }
        }
        Ok(())
    }
}

/// The stored length of every block.
fn stored_bytes(tiff: &mut Tiff) -> tiff::TiffResult<Vec<u64>> {
    match tiff.get_chunk_type() {
        tiff::decoder::ChunkType::Strip => tiff.get_tag_u64_vec(Tag::StripByteCounts),
        tiff::decoder::ChunkType::Tile => tiff.get_tag_u64_vec(Tag::TileByteCounts),
    }
}

/// A tag of moderate length. The library takes memory for a text on the file's word.
fn value_tag(tiff: &mut Tiff, tag: Tag) -> tiff::TiffResult<Option<Value>> {
    match tiff.image_ifd().find_entry(tag) {
        Some(entry) if entry.count() > MAX_VALUES => Err(TiffError::LimitsExceeded),
        _ => tiff.find_tag(tag),
    }
}

/// A text tag; none where it is missing or no text.
fn text_tag(tiff: &mut Tiff, tag: Tag) -> Option<String> {
    value_tag(tiff, tag).ok().flatten()?.into_string().ok()
}

/// Refuses a mask, whose voids would otherwise be taken as heights; says if more images follow.
fn check_other_images(name: &str, tiff: &mut Tiff, assumed: &mut Vec<String>) -> Result<()> {
    for _ in 1..MAX_IMAGES {
        // A damaged directory behind the image does not touch the image itself.
        if !tiff.more_images() || tiff.next_image().is_err() {
            break;
        }
        let kind = tiff
            .find_tag_unsigned::<u32>(Tag::NewSubfileType)
            .ok()
            .flatten()
            .unwrap_or(0);
        if kind & MASK != 0 {
            return Err(Error::new(ErrorKind::Unsupported, name, "has an internal mask")
                .advice("write its voids as a no-data value, as with gdal_translate -a_nodata"));
        }
        if kind & OVERVIEW == 0 {
            assumed.push("It holds several images, of which the first is read.".into());
            break;
        }
    }
    Ok(())
}

/// A unit of heights.
struct Unit {
    name: &'static str,
    metres: f64,
}

fn vertical_unit(located: &place::Located, items: &metadata::Items, assumed: &mut Vec<String>) -> Unit {
    let key = located
        .vertical_unit
        .map(|code| (place::linear_unit(code), format!("code {code}")));
    let text = items
        .unit
        .as_deref()
        .map(|unit| (metadata::linear_unit(unit), format!("{unit:?}")));
    match text.or(key) {
        Some((Some((name, metres)), _)) => Unit { name, metres },
        Some((None, said)) => {
            assumed.push(format!(
                "The unit of heights is given as {said}, not known here, and taken as metres."
            ));
            Unit {
                name: "unknown",
                metres: 1.0,
            }
        }
        None => {
            assumed.push(HEIGHTS_ASSUMED.into());
            Unit {
                name: "unknown",
                metres: 1.0,
            }
        }
    }
}

fn refused(name: &str, error: TiffError) -> Error {
    let broken = |what: String| {
        Error::new(ErrorKind::Broken, name, what).advice("fetch the file again, or check that it is a TIFF")
    };
    let refusal = match &error {
        TiffError::FormatError(e) => broken(format!("cannot be decoded: {e}")),
        TiffError::UnsupportedError(e) => Error::new(
            ErrorKind::Unsupported,
            name,
            format!("uses what is not read here: {e}"),
        ),
        TiffError::IoError(e) => match e.kind() {
            std::io::ErrorKind::UnexpectedEof => broken("ends too early".into()),
            std::io::ErrorKind::InvalidData
            | std::io::ErrorKind::InvalidInput
            | std::io::ErrorKind::Other => broken(format!("cannot be decoded: {e}")),
            _ => Error::new(ErrorKind::Io, name, e),
        },
        TiffError::LimitsExceeded | TiffError::IntSizeError => Error::new(
            ErrorKind::Limit,
            name,
            "claims more memory than a file of its length can need",
        )
        .advice("check that the file is whole"),
        TiffError::UsageError(e) => broken(format!("cannot be decoded: {e}")),
    };
    refusal.because(error)
}

#[cfg(test)]
mod tests;
