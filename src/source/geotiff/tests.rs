//! Tests of the GeoTIFF reader on images that the tests write.

mod damage;
mod layouts;
mod places;
mod refusals;
mod values;
mod writer;

use std::io::Cursor as Bytes;

use half::f16;
use tiff::encoder::colortype::{
    ColorType, Gray8, Gray16, Gray32, Gray32Float, Gray64, Gray64Float, GrayI8, GrayI16, GrayI32, GrayI64,
    RGB8,
};
use tiff::encoder::{Compression, TiffEncoder, TiffKind, TiffKindBig, TiffKindStandard, TiffValue};
use tiff::tags::{Predictor, Tag};

use super::*;
use crate::grid::Rect;
use crate::source::{HeightSource, Registration, geographic};

/// Tags that place and describe an image.
#[derive(Clone, Default)]
struct Extra {
    scale: Option<[f64; 3]>,
    tie: Option<Vec<f64>>,
    matrix: Option<[f64; 16]>,
    keys: Vec<[u16; 4]>,
    nodata: Option<&'static str>,
    metadata: Option<&'static str>,
}

fn placed(scale: [f64; 2], at: [f64; 2], keys: &[[u16; 4]]) -> Extra {
    Extra {
        scale: Some([scale[0], scale[1], 0.0]),
        tie: Some(vec![0.0, 0.0, 0.0, at[0], at[1], 0.0]),
        keys: keys.to_vec(),
        ..Extra::default()
    }
}

fn encode_as<C: ColorType, K: TiffKind>(
    size: [u32; 2],
    data: &[C::Inner],
    compression: Compression,
    predictor: Predictor,
    extra: &Extra,
) -> Vec<u8>
where
    [C::Inner]: TiffValue,
{
    let mut out = Bytes::new(Vec::new());
    let encoder = TiffEncoder::<_, K>::new_generic(&mut out).unwrap();
    let mut encoder = encoder.with_compression(compression).with_predictor(predictor);
    let mut image = encoder.new_image::<C>(size[0], size[1]).unwrap();
    image.rows_per_strip(3).unwrap();
    let tags = image.encoder();
    if let Some(scale) = extra.scale {
        tags.write_tag(Tag::ModelPixelScaleTag, &scale[..]).unwrap();
    }
    if let Some(tie) = &extra.tie {
        tags.write_tag(Tag::ModelTiepointTag, &tie[..]).unwrap();
    }
    if let Some(matrix) = extra.matrix {
        tags.write_tag(Tag::ModelTransformationTag, &matrix[..]).unwrap();
    }
    if !extra.keys.is_empty() {
        let mut directory = vec![[1, 1, 0, extra.keys.len() as u16]];
        directory.extend(&extra.keys);
        tags.write_tag(Tag::GeoKeyDirectoryTag, &directory.concat()[..])
            .unwrap();
    }
    if let Some(text) = extra.nodata {
        tags.write_tag(Tag::GdalNodata, text).unwrap();
    }
    if let Some(text) = extra.metadata {
        tags.write_tag(Tag::Unknown(42112), text).unwrap();
    }
    image.write_data(data).unwrap();
    out.into_inner()
}

fn encode<C: ColorType>(size: [u32; 2], data: &[C::Inner], extra: &Extra) -> Vec<u8>
where
    [C::Inner]: TiffValue,
{
    encode_as::<C, TiffKindStandard>(size, data, Compression::Uncompressed, Predictor::None, extra)
}

fn read(bytes: Vec<u8>) -> Result<(Description, Vec<f32>)> {
    let held = open("t.tif", Arc::new(bytes), &OpenOptions::default())?;
    let size = held.description().grid.size;
    let mut out = vec![0.0; size.samples() as usize];
    held.read(size.rect(), &mut out)?;
    Ok((held.description().clone(), out))
}

fn refusal(bytes: Vec<u8>, kind: ErrorKind, part: &str) {
    let error = read(bytes).expect_err(part);
    assert_eq!(error.kind(), kind, "{error}");
    assert!(error.to_string().contains(part), "{error} lacks {part}");
}

/// A little-endian TIFF of `tags` (tag, type, values as bytes), with `data` behind it at the offset that the
/// function is told.
fn by_hand(
    tags: &[(u16, u16, u32, Vec<u8>)],
    data: impl Fn(u32) -> Vec<(u16, Vec<u32>)>,
    payload: &[u8],
) -> Vec<u8> {
    let count = |tags: usize| 8 + 2 + 12 * tags as u32 + 4;
    let extra = data(0).len();
    let start = count(tags.len() + extra);
    let mut all = tags.to_vec();
    for (tag, values) in data(start) {
        assert!(values.len() == 1, "longer values would need a place of their own");
        all.push((tag, 4, 1, values[0].to_le_bytes().to_vec()));
    }
    all.sort_by_key(|t| t.0);
    let mut out = b"II*\0\x08\0\0\0".to_vec();
    out.extend((all.len() as u16).to_le_bytes());
    for (tag, kind, n, value) in all {
        out.extend(tag.to_le_bytes());
        out.extend(kind.to_le_bytes());
        out.extend(n.to_le_bytes());
        let mut value = value;
        value.resize(4, 0);
        out.extend(value);
    }
    out.extend([0; 4]);
    out.extend(payload);
    out
}

fn short(tag: u16, value: u16) -> (u16, u16, u32, Vec<u8>) {
    (tag, 3, 1, value.to_le_bytes().to_vec())
}

/// A 20 x 10 image of one 32 x 16 tile of `kind` samples.
fn tiled(bits: u16, format: u16, payload: &[u8], stored: u32) -> Vec<u8> {
    packed(1, bits, format, payload, stored)
}

fn packed(compression: u16, bits: u16, format: u16, payload: &[u8], stored: u32) -> Vec<u8> {
    let tags = [
        short(256, 20),
        short(257, 10),
        short(258, bits),
        short(259, compression),
        short(262, 1),
        short(277, 1),
        short(322, 32),
        short(323, 16),
        short(339, format),
    ];
    by_hand(
        &tags,
        |start| {
            vec![
                (324, vec![if stored == 0 { 0 } else { start }]),
                (325, vec![stored]),
            ]
        },
        payload,
    )
}
