//! PNG heightmaps: 8 or 16 bits a sample, without any place on the earth; grey, or a band of several that is named. A
//! grey that the file declares transparent is no data.

use std::io::BufReader;

use png::{BitDepth, Decoder, DecodingError, Limits};

use super::held::{Held, Scale, Values, bare_description, check_claim, size};
use super::open::Input;
use super::{Cursor, SampleType};
use crate::error::{Error, ErrorKind, Result};
use crate::grid::Grid;

/// What the decoder may take besides rows: chunks that it keeps.
const SLACK_BYTES: usize = 16 << 20;

/// Reads the picture `input`.
pub(super) fn open(input: &Input) -> Result<Held> {
    let name = input.name;
    let file_bytes = input.bytes.size_bytes();
    let failed = |error: DecodingError| refused(name, error);
    let limits = Limits { bytes: SLACK_BYTES };
    let mut decoder = Decoder::new_with_limits(BufReader::new(Cursor::new(input.bytes.clone())), limits);
    // Samples as they are stored: no palette, no transparency made of `tRNS`.
    decoder.set_transformations(png::Transformations::IDENTITY);
    let header = decoder.read_header_info().map_err(failed)?;
    let (width, height) = (header.width, header.height);
    let (colour, depth) = (header.color_type, header.bit_depth);
    if colour == png::ColorType::Indexed {
        return Err(unsupported(
            name,
            "is a picture with a palette, not heights".into(),
        ));
    }
    let sample = match depth {
        BitDepth::Eight => SampleType::U8,
        BitDepth::Sixteen => SampleType::U16,
        other => return Err(unsupported(name, format!("has {} bits a sample", other as u8))),
    };
    let bands = colour.samples();
    if bands > 1 && input.options.band.is_none() {
        let what = match bands {
            2 => "has grey with alpha, not heights alone",
            3 => "is an RGB picture, not heights",
            _ => "is an RGB picture with alpha, not heights",
        };
        return Err(Error::new(ErrorKind::Unsupported, name, what).advice(format!(
            "give a grey PNG, or the band that holds heights with --band 1 to {bands}"
        )));
    }
    let band = input.options.band_index(name, bands as u32)? as usize;
    let pixel_bytes = sample.bytes() * bands;
    let count = check_claim(name, width.into(), height.into(), pixel_bytes as u64, file_bytes)?;
    // An interlaced picture is complete only with its last pass, and is decoded whole.
    let row_bytes = width as usize * pixel_bytes;
    let interlaced = header.interlaced;
    let room = if interlaced {
        row_bytes.saturating_mul(height as usize)
    } else {
        row_bytes.saturating_mul(4)
    };
    decoder.set_limits(Limits {
        bytes: room.saturating_add(SLACK_BYTES),
    });
    let mut reader = decoder.read_info().map_err(failed)?;

    // A grey that is declared transparent is no data (PNG specification, section 11.3.2.1); the library gives as many
    // bytes as a sample has.
    let transparent = match (bands, reader.info().trns.as_deref()) {
        (1, Some([high, low])) => Some(f64::from(u16::from_be_bytes([*high, *low]))),
        (1, Some([grey])) => Some(f64::from(*grey)),
        _ => None,
    };
    let nodata = input.options.nodata.or(transparent);
    let mut values = Values::new(name, count)?;
    let mut put_row = |z: usize, row: &[u8]| {
        for (x, pixel) in row.chunks_exact(pixel_bytes).take(width as usize).enumerate() {
            let value = match (sample, &pixel[band * sample.bytes()..]) {
                (SampleType::U16, [high, low, ..]) => f64::from(u16::from_be_bytes([*high, *low])),
                (_, rest) => f64::from(rest[0]),
            };
            let value = if nodata == Some(value) { f64::NAN } else { value };
            values.set(name, z * width as usize + x, value)?;
        }
        Ok::<(), Error>(())
    };
    if interlaced {
        let mut pixels = super::held::filled(name, row_bytes.saturating_mul(height as usize), 0u8)?;
        reader.next_frame(&mut pixels).map_err(failed)?;
        for (z, row) in pixels.chunks_exact(row_bytes).enumerate() {
            put_row(z, row)?;
        }
    } else {
        for z in 0..height as usize {
            let row = reader.next_row().map_err(failed)?;
            let row = row.ok_or_else(|| broken(name, format!("ends after {z} of {height} rows")))?;
            put_row(z, row.data())?;
        }
    }
    // The end of the data, with its checksums, must be there too.
    reader.finish().map_err(failed)?;
    let heights = values.finish(name, Scale::METRES)?;
    let mut description = bare_description(name, "PNG", sample.name(), size(width.into(), height.into()));
    description.grid = Grid {
        base_m: heights.base_m,
        ..description.grid
    };
    description.step_m = Some(1.0);
    Held::new(description, heights.heights)
}

fn unsupported(name: &str, what: String) -> Error {
    Error::new(ErrorKind::Unsupported, name, what).advice("give a grey PNG of 8 or 16 bits")
}

fn broken(name: &str, what: impl std::fmt::Display) -> Error {
    Error::new(ErrorKind::Broken, name, what).advice("fetch the file again")
}

fn refused(name: &str, error: DecodingError) -> Error {
    match error {
        DecodingError::LimitsExceeded => {
            let what = "claims more memory than a file of its length can need";
            Error::new(ErrorKind::Limit, name, what)
                .advice("check that the file is whole")
                .because(error)
        }
        DecodingError::IoError(error) => match error.kind() {
            std::io::ErrorKind::InvalidData | std::io::ErrorKind::InvalidInput => {
                broken(name, format!("cannot be decoded: {error}")).because(error)
            }
            _ => Error::io(name, error),
        },
        other => broken(name, format!("cannot be decoded: {other}")).because(other),
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Band, Description, HeightSource, OpenOptions};
    use super::*;
    use png::{ColorType, Encoder};

    fn encode(pixels: &[u8], width: u32, height: u32, colour: ColorType, depth: BitDepth) -> Vec<u8> {
        let mut out = Vec::new();
        let mut encoder = Encoder::new(&mut out, width, height);
        encoder.set_color(colour);
        encoder.set_depth(depth);
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(pixels).unwrap();
        writer.finish().unwrap();
        out
    }

    fn read_with(bytes: Vec<u8>, options: &OpenOptions) -> Result<(Description, Vec<f32>)> {
        let held = open(&Input::bare("t.png", bytes, options))?;
        let mut out = vec![0.0; held.description().grid.size.samples() as usize];
        held.read(held.description().grid.size.rect(), &mut out)?;
        Ok((held.description().clone(), out))
    }

    fn read(bytes: Vec<u8>) -> Result<(Description, Vec<f32>)> {
        read_with(bytes, &OpenOptions::default())
    }

    #[test]
    fn grey_of_8_and_16_bits_is_read_as_it_stands() {
        let values = [0u16, 1, 255, 256, 40_000, 65_535];
        let pixels: Vec<u8> = values.iter().flat_map(|v| v.to_be_bytes()).collect();
        let (d, heights) = read(encode(&pixels, 3, 2, ColorType::Grayscale, BitDepth::Sixteen)).unwrap();
        assert_eq!(heights, values.map(f32::from));
        assert_eq!(
            (d.sample_type.as_str(), d.step_m, d.grid.spacing_m),
            ("uint16", Some(1.0), [1.0, 1.0])
        );
        assert!(d.assumed.iter().any(|s| s.contains("1 m")));
        let (_, heights) = read(encode(&[0, 7, 255], 1, 3, ColorType::Grayscale, BitDepth::Eight)).unwrap();
        assert_eq!(heights, [0.0, 7.0, 255.0]);
    }

    #[test]
    fn a_transparent_grey_is_no_data() {
        for (depth, pixels) in [
            (BitDepth::Sixteen, vec![0, 7, 1, 0, 0, 7]),
            (BitDepth::Eight, vec![7, 100, 7]),
        ] {
            let mut out = Vec::new();
            let mut encoder = Encoder::new(&mut out, 3, 1);
            encoder.set_color(ColorType::Grayscale);
            encoder.set_depth(depth);
            encoder.set_trns(vec![0, 7]);
            let mut writer = encoder.write_header().unwrap();
            writer.write_image_data(&pixels).unwrap();
            writer.finish().unwrap();
            let (_, heights) = read(out).unwrap();
            assert!(
                heights[0].is_nan() && heights[2].is_nan() && heights[1] >= 100.0,
                "{heights:?}"
            );
        }
    }

    #[test]
    fn a_band_of_a_coloured_picture_must_be_named() {
        let pixels: Vec<u8> = (1..=6u16).flat_map(|v| (1000 * v).to_be_bytes()).collect();
        let bytes = encode(&pixels, 2, 1, ColorType::Rgb, BitDepth::Sixteen);
        let error = read(bytes.clone()).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Unsupported, "{error}");
        let second = OpenOptions {
            band: Some(Band::Number(2)),
            nodata: Some(5000.0),
            ..OpenOptions::default()
        };
        let (_, heights) = read_with(bytes, &second).unwrap();
        assert!(heights[0] == 2000.0 && heights[1].is_nan(), "{heights:?}");
    }

    #[test]
    fn colour_is_unsupported_and_damage_is_broken() {
        let alpha = read(encode(&[0; 8], 2, 2, ColorType::GrayscaleAlpha, BitDepth::Eight)).unwrap_err();
        assert_eq!(alpha.kind(), ErrorKind::Unsupported, "{alpha}");
        let bits = read(encode(&[0; 2], 2, 2, ColorType::Grayscale, BitDepth::Four)).unwrap_err();
        assert_eq!(bits.kind(), ErrorKind::Unsupported, "{bits}");
        let pixels: Vec<u8> = (0..64 * 64u32).map(|i| (i * i % 251) as u8).collect();
        let whole = encode(&pixels, 64, 64, ColorType::Grayscale, BitDepth::Eight);
        for keep in [10, 25, 26, 33, whole.len() / 2, whole.len() - 20] {
            let error = read(whole[..keep].to_vec()).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::Broken, "{keep} bytes: {error}");
        }
        let mut flipped = whole.clone();
        flipped[whole.len() / 2] ^= 0x10;
        assert_eq!(read(flipped).unwrap_err().kind(), ErrorKind::Broken);
        // A size that no file of this length can hold, with a right checksum.
        let mut huge = Vec::new();
        let encoder = Encoder::new(&mut huge, 1 << 29, 1 << 29);
        drop(encoder.write_header().unwrap());
        assert_eq!(read(huge).unwrap_err().kind(), ErrorKind::Limit);
    }
}
