//! OpenEXR heightmaps: one channel of one part, f16, f32 or u32; NaN and infinities are no data.
//!
//! The channel is the one asked for, else the first there is of `Y`, `Z`, `height`, `H`, `R`, or the only one. Blocks are decoded one
//! after another, so that only the wanted channel is held.

use std::collections::HashSet;
use std::io::BufReader;
use std::sync::Arc;

use exr::block::reader::ChunksReader;
use exr::compression::Compression;
use exr::meta::attribute::SampleType;
use exr::meta::header::Header;
use half::f16;

use super::held::{Held, Scale, Values, bare_description, check_claim, size};
use super::open::Input;
use super::{Band, Cursor, HeightSource, OpenOptions, ReadAt};
use crate::error::{Error, ErrorKind, Result};
use crate::grid::{Grid, Size};

/// Reads the heights of the picture `name`.
pub(super) fn open(input: &Input) -> Result<Held> {
    open_channel(input.name, input.bytes.clone(), &Wanted::HEIGHTS, input.options)
}

/// What is looked for in a picture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wanted {
    /// Names of its channel, the best first.
    pub(crate) names: &'static [&'static str],
    /// Whether a picture's only channel will do, whatever its name.
    pub(crate) only: bool,
    /// What it holds, in the plural.
    pub(crate) what: &'static str,
    /// What else could be given.
    pub(crate) advice: &'static str,
}

impl Wanted {
    const HEIGHTS: Self = Self {
        names: &["Y", "Z", "height", "H", "R"],
        only: true,
        what: "heights",
        advice: "name one of them with --band",
    };
}

/// Reads a channel of the picture `name`: its size and its values, row by row, NaN where they are not finite.
///
/// # Errors
/// Where the file is damaged, or has no such channel.
pub(crate) fn read_channel(name: &str, bytes: Arc<dyn ReadAt>, wanted: &Wanted) -> Result<(Size, Vec<f64>)> {
    let held = open_channel(name, bytes, wanted, &OpenOptions::default())?;
    let Grid { size, base_m, .. } = held.description().grid;
    let mut values = vec![0.0; size.samples() as usize];
    held.read(size.rect(), &mut values)?;
    Ok((size, values.into_iter().map(|v| f64::from(v) + base_m).collect()))
}

/// As if it were of heights.
fn open_channel(name: &str, bytes: Arc<dyn ReadAt>, wanted: &Wanted, options: &OpenOptions) -> Result<Held> {
    let file_bytes = bytes.size_bytes();
    let failed = |error: exr::error::Error| refused(name, error);
    let reader = exr::block::read(BufReader::new(Cursor::new(bytes)), false).map_err(failed)?;
    let headers = reader.headers();
    // Every part is checked: the library makes a table of the blocks of all.
    for header in headers {
        let (width, height) = (header.layer_size.x() as u64, header.layer_size.y() as u64);
        let pixel_bytes = header.channels.bytes_per_pixel as u64;
        check_claim(name, width, height, pixel_bytes.max(1), file_bytes)?;
        check_claim(name, header.chunk_count as u64, 1, 1, file_bytes)?;
    }
    let (layer, channel) = choose(headers, wanted, options.band.as_ref()).ok_or_else(|| {
        let names: Vec<String> = headers
            .iter()
            .flat_map(|h| &h.channels.list)
            .take(8)
            .map(|c| c.name.to_string())
            .collect();
        let names = names.join(", ");
        let misuse =
            |what: String| Error::new(ErrorKind::Misuse, name, what).advice("name one of them with --band");
        match &options.band {
            Some(Band::Name(band)) => misuse(format!("has no channel named {band:?} among {names}")),
            Some(Band::Number(n)) => misuse(format!("has no channel {n} among {names}")),
            None => {
                let what = format!("has no channel of {} among {names}", wanted.what);
                Error::new(ErrorKind::Unsupported, name, what).advice(wanted.advice)
            }
        }
    })?;
    let header = &headers[layer];
    let description = &header.channels.list[channel];
    if header.deep {
        return Err(Error::new(ErrorKind::Unsupported, name, "holds deep data"));
    }
    // DWA and B44 lose heights, and the library's DWA decoder takes memory on the file's word.
    use Compression::{PIZ, PXR24, RLE, Uncompressed, ZIP1, ZIP16};
    if !matches!(
        header.compression,
        Uncompressed | RLE | ZIP1 | ZIP16 | PIZ | PXR24
    ) {
        let what = format!("is compressed with loss ({})", header.compression);
        return Err(Error::new(ErrorKind::Unsupported, name, what).advice("compress it with ZIP"));
    }
    if description.sampling.x() != 1 || description.sampling.y() != 1 {
        let what = format!("its channel {} is subsampled", description.name);
        return Err(Error::new(ErrorKind::Unsupported, name, what));
    }
    let sample_type = description.sample_type;
    let (width, height) = (header.layer_size.x(), header.layer_size.y());
    let mut assumed = Vec::new();
    if options.band.is_none() && (headers.len() > 1 || header.channels.list.len() > 1) {
        let part = header
            .own_attributes
            .layer_name
            .as_ref()
            .map(|n| format!(" of part {n}"));
        assumed.push(format!(
            "Of several channels, {}{} is taken as {}.",
            description.name,
            part.unwrap_or_default(),
            wanted.what
        ));
    }

    let mut values = Values::new(name, width * height)?;
    let mut seen = 0usize;
    let mut places = HashSet::new();
    let mut blocks = reader
        .filter_chunks(false, |_, _, block| {
            block.layer == layer && block.level.x() == 0 && block.level.y() == 0
        })
        .map_err(failed)?
        .sequential_decompressor(false);
    while let Some(block) = blocks.decompress_next_block() {
        let block = block.map_err(failed)?;
        let at = block.index.pixel_position;
        if !places.insert((at.x(), at.y())) {
            let what = format!("has two blocks at column {}, row {}", at.x(), at.y());
            return Err(Error::new(ErrorKind::Broken, name, what).advice("fetch the file again"));
        }
        let channels = &blocks.meta_data().headers[layer].channels;
        for line in block
            .lines(channels)
            .filter(|line| line.location.channel == channel)
        {
            let (x, z) = (line.location.position.x(), line.location.position.y());
            let end = x.saturating_add(line.location.sample_count);
            if end > width || z >= height {
                let what =
                    format!("a block lies at column {x}, row {z}, outside its {width} x {height} samples");
                return Err(Error::new(ErrorKind::Broken, name, what));
            }
            let start = z * width + x;
            // A no-data value is compared in the type of the samples.
            let nodata = options.nodata;
            let void_of = |void: bool, value: f64| if void { f64::NAN } else { value };
            match sample_type {
                SampleType::F16 => set(name, &mut values, start, line.value, |b| {
                    let v = f16::from_ne_bytes(b);
                    void_of(nodata.is_some_and(|n| f16::from_f64(n) == v), v.to_f64())
                })?,
                SampleType::F32 => {
                    set(name, &mut values, start, line.value, |b| {
                        let v = f32::from_ne_bytes(b);
                        void_of(nodata.is_some_and(|n| n as f32 == v), v.into())
                    })?;
                }
                SampleType::U32 => {
                    set(name, &mut values, start, line.value, |b| {
                        let v = f64::from(u32::from_ne_bytes(b));
                        void_of(nodata == Some(v), v)
                    })?;
                }
            }
            seen += line.location.sample_count;
        }
    }
    if seen != width * height {
        let what = format!("holds {seen} of its {width} x {height} samples");
        return Err(Error::new(ErrorKind::Broken, name, what).advice("fetch the file again"));
    }

    let heights = values.finish(name, Scale::METRES)?;
    let (type_name, step_m) = match sample_type {
        SampleType::F16 => ("float16", None),
        SampleType::F32 => ("float32", None),
        SampleType::U32 => ("uint32", Some(1.0)),
    };
    let mut description = bare_description(name, "OpenEXR", type_name, size(width as u64, height as u64));
    description.grid = Grid {
        base_m: heights.base_m,
        ..description.grid
    };
    description.step_m = step_m;
    description.assumed.extend(assumed);
    description.assumed.extend(heights.infinite_sentence());
    Held::new(description, heights.heights)
}

/// Part and channel that hold what is wanted: the ones asked for, of the first part that has such a channel; numbers count
/// the channels of all parts.
fn choose(headers: &[Header], wanted: &Wanted, band: Option<&Band>) -> Option<(usize, usize)> {
    let find = |name: &str| {
        headers.iter().enumerate().find_map(|(layer, header)| {
            let channel = header.channels.list.iter().position(|c| c.name.eq(name))?;
            Some((layer, channel))
        })
    };
    let only = || {
        let [header] = headers else { return None };
        (wanted.only && header.channels.list.len() == 1).then_some((0, 0))
    };
    let all = || {
        let channels = headers.iter().enumerate();
        channels
            .flat_map(|(layer, header)| (0..header.channels.list.len()).map(move |channel| (layer, channel)))
    };
    match band {
        None => wanted.names.iter().copied().find_map(find).or_else(only),
        // A channel of a layer within a part is named `layer.channel`.
        Some(Band::Name(name)) => find(name),
        Some(Band::Number(n)) => all().nth((*n as usize).checked_sub(1)?),
    }
}

fn set<const N: usize>(
    name: &str,
    values: &mut Values,
    start: usize,
    line: &[u8],
    value: impl Fn([u8; N]) -> f64,
) -> Result<()> {
    let (samples, _) = line.as_chunks::<N>();
    for (x, sample) in samples.iter().enumerate() {
        values.set(name, start + x, value(*sample))?;
    }
    Ok(())
}

fn refused(name: &str, error: exr::error::Error) -> Error {
    use exr::error::Error as Exr;
    let (kind, what) = match &error {
        Exr::NotSupported(what) => (
            ErrorKind::Unsupported,
            format!("uses what is not read here: {what}"),
        ),
        Exr::Invalid(what) => (ErrorKind::Broken, format!("cannot be decoded: {what}")),
        Exr::Io(io) => match io.kind() {
            std::io::ErrorKind::UnexpectedEof => (ErrorKind::Broken, "ends too early".into()),
            std::io::ErrorKind::InvalidData | std::io::ErrorKind::InvalidInput => {
                (ErrorKind::Broken, format!("cannot be decoded: {io}"))
            }
            _ => (ErrorKind::Io, io.to_string()),
        },
        Exr::Aborted => (ErrorKind::Cancelled, "interrupted".into()),
    };
    let advice = if kind == ErrorKind::Broken {
        "fetch the file again"
    } else {
        ""
    };
    Error::new(kind, name, what).advice(advice).because(error)
}

#[cfg(test)]
mod tests {
    use super::super::{HeightSource, OpenOptions};
    use super::*;
    use crate::error::Result;
    use exr::prelude::*;

    fn encode(channels: Vec<(&str, FlatSamples)>, size: (usize, usize), compression: Compression) -> Vec<u8> {
        let list = channels
            .into_iter()
            .map(|(name, samples)| AnyChannel::new(name, samples))
            .collect::<Vec<_>>();
        let encoding = Encoding {
            compression,
            blocks: Blocks::Tiles(Vec2(4, 4)),
            line_order: LineOrder::Increasing,
        };
        let layer = Layer::new(
            size,
            LayerAttributes::named("main"),
            encoding,
            AnyChannels::sort(list.into()),
        );
        let mut out = std::io::Cursor::new(Vec::new());
        Image::from_layer(layer)
            .write()
            .non_parallel()
            .to_buffered(&mut out)
            .unwrap();
        out.into_inner()
    }

    fn read(bytes: Vec<u8>) -> Result<(super::super::Description, Vec<f32>)> {
        read_with(bytes, &OpenOptions::default())
    }

    fn read_with(bytes: Vec<u8>, options: &OpenOptions) -> Result<(super::super::Description, Vec<f32>)> {
        let held = open(&Input::bare("t.exr", bytes, options))?;
        let mut out = vec![0.0; held.description().grid.size.samples() as usize];
        held.read(held.description().grid.size.rect(), &mut out)?;
        Ok((held.description().clone(), out))
    }

    #[test]
    fn each_type_is_read_tile_by_tile_into_rows() {
        let ramp: Vec<f32> = (0..7 * 5).map(|i| i as f32 * 0.5 - 3.0).collect();
        let bytes = encode(
            vec![("depth", FlatSamples::F32(ramp.clone()))],
            (7, 5),
            Compression::ZIP16,
        );
        let (d, heights) = read(bytes).unwrap();
        assert_eq!(
            (heights, d.sample_type.as_str(), d.step_m),
            (ramp.clone(), "float32", None)
        );
        let halves = ramp.iter().map(|v| f16::from_f32(*v)).collect();
        let bytes = encode(vec![("Y", FlatSamples::F16(halves))], (7, 5), Compression::RLE);
        assert_eq!(read(bytes).unwrap().1, ramp);
        let counts: Vec<u32> = (0..35).map(|i| 16_777_217 + i).collect();
        let bytes = encode(
            vec![("H", FlatSamples::U32(counts))],
            (7, 5),
            Compression::Uncompressed,
        );
        let (d, heights) = read(bytes).unwrap();
        assert_eq!((d.grid.base_m, d.step_m), (16_777_217.0, Some(1.0)));
        assert_eq!(heights, (0..35).map(|i| i as f32).collect::<Vec<_>>());
    }

    #[test]
    fn the_channel_is_chosen_by_name_and_voids_are_counted() {
        let flat = |v: f32| FlatSamples::F32(vec![v; 4]);
        let bytes = encode(
            vec![("R", flat(1.0)), ("G", flat(2.0)), ("Z", flat(3.0))],
            (2, 2),
            Compression::ZIP1,
        );
        let (d, heights) = read(bytes).unwrap();
        assert_eq!(heights, [3.0; 4]);
        assert!(
            d.assumed.iter().any(|s| s.contains("channels, Z")),
            "{:?}",
            d.assumed
        );
        let bytes = encode(
            vec![("A", flat(1.0)), ("B", flat(2.0))],
            (2, 2),
            Compression::ZIP1,
        );
        let error = read(bytes).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Unsupported, "{error}");
        let odd = FlatSamples::F32(vec![f32::NAN, f32::INFINITY, 5.0, f32::NEG_INFINITY]);
        let (d, heights) = read(encode(vec![("Y", odd)], (2, 2), Compression::ZIP1)).unwrap();
        assert_eq!(heights.iter().filter(|h| h.is_nan()).count(), 3);
        assert!(
            d.assumed.iter().any(|s| s.contains("2 heights are infinite")),
            "{:?}",
            d.assumed
        );
    }

    #[test]
    fn any_channel_is_read_by_its_name_or_number() {
        let flat = |v: f32| FlatSamples::F32(vec![v, -5.0]);
        let bytes = encode(
            vec![("A", flat(1.0)), ("depth.Z", flat(2.0)), ("Y", flat(3.0))],
            (2, 1),
            Compression::ZIP1,
        );
        let of = |band: Option<Band>, nodata| {
            let options = OpenOptions {
                band,
                nodata,
                ..OpenOptions::default()
            };
            read_with(bytes.clone(), &options).map(|(_, heights)| heights)
        };
        assert_eq!(of(None, None).unwrap(), [3.0, -5.0]);
        assert_eq!(of(Some(Band::Name("depth.Z".into())), None).unwrap(), [2.0, -5.0]);
        assert_eq!(of(Some(Band::Number(1)), None).unwrap(), [1.0, -5.0]);
        assert!(of(None, Some(-5.0)).unwrap()[1].is_nan());
        for band in [Band::Name("Z".into()), Band::Number(0), Band::Number(4)] {
            let error = of(Some(band), None).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::Misuse, "{error}");
        }
    }

    #[test]
    fn loss_is_refused() {
        let bytes = encode(
            vec![("Y", FlatSamples::F32(vec![1.0; 64]))],
            (8, 8),
            Compression::B44,
        );
        let error = read(bytes).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Unsupported);
        assert!(error.to_string().contains("with loss"), "{error}");
    }

    #[test]
    fn a_truncated_file_is_broken() {
        let ramp: Vec<f32> = (0..64 * 64).map(|i| (i * i % 977) as f32).collect();
        let whole = encode(vec![("Y", FlatSamples::F32(ramp))], (64, 64), Compression::ZIP16);
        for keep in [5, 60, 200, whole.len() / 2, whole.len() - 1] {
            let error = read(whole[..keep].to_vec()).unwrap_err();
            assert_eq!(
                error.kind(),
                ErrorKind::Broken,
                "{keep} of {} bytes: {error}",
                whole.len()
            );
        }
    }
}
