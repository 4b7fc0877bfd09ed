//! PNG heightmaps: grey, 8 or 16 bits, without any place on the earth.

use std::io::BufReader;
use std::sync::Arc;

use image::codecs::png::PngDecoder;
use image::{ColorType, ImageDecoder, ImageError, Limits};

use super::held::{Held, Scale, Values, bare_description, check_claim, filled, size};
use super::{Cursor, ReadAt};
use crate::error::{Error, ErrorKind, Result};
use crate::grid::Grid;

/// What the decoder may take besides the image itself: a row or two, and text that it keeps.
const SLACK_BYTES: u64 = 16 << 20;

/// Reads the picture `name`.
pub(super) fn open(name: &str, bytes: Arc<dyn ReadAt>) -> Result<Held> {
    let file_bytes = bytes.size_bytes();
    // The header chunk: length, `IHDR`, width, height, bit depth, colour type (PNG specification, section
    // 11.2.2). The decoder widens 1, 2 and 4 bits to 8, so the true depth must be read here.
    let mut head = [0u8; 26];
    bytes
        .read_exact_at(0, &mut head)
        .map_err(|error| Error::io(name, error))?;
    let word = |at: usize| {
        u64::from(u32::from_be_bytes([
            head[at],
            head[at + 1],
            head[at + 2],
            head[at + 3],
        ]))
    };
    if &head[12..16] != b"IHDR" {
        return Err(Error::new(
            ErrorKind::Broken,
            name,
            "has no header after the PNG signature",
        ));
    }
    let (width, height, depth, colour) = (word(16), word(20), head[24], head[25]);
    if colour != 0 {
        let what = match colour {
            2 => "is an RGB picture, not heights".to_string(),
            3 => "is a picture with a palette, not heights".into(),
            4 => "has grey with alpha, not heights alone".into(),
            6 => "is an RGB picture with alpha, not heights".into(),
            n => format!("has colour type {n}"),
        };
        return Err(unsupported(name, what));
    }
    if depth != 8 && depth != 16 {
        return Err(unsupported(name, format!("has {depth} bits a sample")));
    }
    let count = check_claim(name, width, height, u64::from(depth / 8), file_bytes)?;

    let mut limits = Limits::default();
    limits.max_alloc = Some(count as u64 * 2 + SLACK_BYTES);
    let failed = |error: ImageError| refused(name, error);
    let decoder = PngDecoder::with_limits(BufReader::new(Cursor::new(bytes)), limits).map_err(failed)?;
    let wide = match decoder.color_type() {
        ColorType::L8 => false,
        ColorType::L16 => true,
        // A grey picture becomes grey with alpha where a `tRNS` chunk makes one value transparent.
        other => return Err(unsupported(name, format!("decodes to {other:?}"))),
    };
    let total = usize::try_from(decoder.total_bytes()).unwrap_or(usize::MAX);
    if total != count * if wide { 2 } else { 1 } {
        return Err(Error::new(
            ErrorKind::Broken,
            name,
            "decodes to another size than its header says",
        ));
    }
    let mut pixels = filled(name, total, 0u8)?;
    decoder.read_image(&mut pixels).map_err(failed)?;

    let mut values = Values::new(name, count)?;
    for index in 0..count {
        let value = if wide {
            f64::from(u16::from_ne_bytes([pixels[2 * index], pixels[2 * index + 1]]))
        } else {
            f64::from(pixels[index])
        };
        values.set(name, index, value)?;
    }
    let heights = values.finish(name, Scale::METRES)?;
    let sample_type = if wide { "uint16" } else { "uint8" };
    let mut description = bare_description(name, "PNG", sample_type, size(width, height));
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

fn refused(name: &str, error: ImageError) -> Error {
    let kind = match &error {
        ImageError::Unsupported(_) => ErrorKind::Unsupported,
        ImageError::Limits(_) => ErrorKind::Limit,
        _ => ErrorKind::Broken,
    };
    let advice = if kind == ErrorKind::Broken {
        "fetch the file again"
    } else {
        ""
    };
    Error::new(kind, name, format!("cannot be decoded: {error}"))
        .advice(advice)
        .because(error)
}

#[cfg(test)]
mod tests {
    use super::super::HeightSource;
    use super::*;
    use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};

    fn encode(pixels: &[u8], width: u32, height: u32, colour: ExtendedColorType) -> Vec<u8> {
        let mut out = Vec::new();
        PngEncoder::new(&mut out)
            .write_image(pixels, width, height, colour)
            .unwrap();
        out
    }

    fn read(bytes: Vec<u8>) -> Result<(super::super::Description, Vec<f32>)> {
        let held = open("t.png", Arc::new(bytes))?;
        let mut out = vec![0.0; held.description().grid.size.samples() as usize];
        held.read(held.description().grid.size.rect(), &mut out)?;
        Ok((held.description().clone(), out))
    }

    #[test]
    fn grey_of_8_and_16_bits_is_read_as_it_stands() {
        let values = [0u16, 1, 255, 256, 40_000, 65_535];
        let pixels: Vec<u8> = values.iter().flat_map(|v| v.to_ne_bytes()).collect();
        let (d, heights) = read(encode(&pixels, 3, 2, ExtendedColorType::L16)).unwrap();
        assert_eq!(heights, values.map(f32::from));
        assert_eq!(
            (d.sample_type.as_str(), d.step_m, d.grid.spacing_m),
            ("uint16", Some(1.0), [1.0, 1.0])
        );
        assert!(d.assumed.iter().any(|s| s.contains("1 m")));
        let (_, heights) = read(encode(&[0, 7, 255], 1, 3, ExtendedColorType::L8)).unwrap();
        assert_eq!(heights, [0.0, 7.0, 255.0]);
    }

    #[test]
    fn colour_is_unsupported_and_damage_is_broken() {
        let rgb = read(encode(&[0; 12], 2, 2, ExtendedColorType::Rgb8)).unwrap_err();
        assert_eq!(rgb.kind(), ErrorKind::Unsupported, "{rgb}");
        let alpha = read(encode(&[0; 8], 2, 2, ExtendedColorType::La8)).unwrap_err();
        assert_eq!(alpha.kind(), ErrorKind::Unsupported, "{alpha}");
        let whole = encode(&[9; 64 * 64], 64, 64, ExtendedColorType::L8);
        for keep in [10, 25, 26, 33, whole.len() - 20] {
            let error = read(whole[..keep].to_vec()).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::Broken, "{keep} bytes: {error}");
        }
        let mut flipped = whole.clone();
        flipped[45] ^= 0x10;
        assert_eq!(read(flipped).unwrap_err().kind(), ErrorKind::Broken);
        let mut huge = whole;
        huge[16..24].copy_from_slice(&[0x20, 0, 0, 0, 0x20, 0, 0, 0]);
        assert_eq!(read(huge).unwrap_err().kind(), ErrorKind::Limit);
    }
}
