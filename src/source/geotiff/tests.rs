//! Tests of the GeoTIFF reader on images that the tests write.

use std::io::Cursor as Bytes;

use half::f16;
use tiff::encoder::colortype::{
    ColorType, Gray8, Gray16, Gray32, Gray32Float, Gray64, Gray64Float, GrayI8, GrayI16, GrayI32, GrayI64,
    RGB8,
};
use tiff::encoder::{Compression, TiffEncoder, TiffKind, TiffKindBig, TiffKindStandard, TiffValue};
use tiff::tags::Predictor;

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

#[test]
fn every_type_of_samples_is_read() {
    macro_rules! check {
        ($color:ty, $inner:ty, $name:literal, $step:expr, $values:expr) => {
            let values: [$inner; 4] = $values;
            let (d, heights) = read(encode::<$color>([2, 2], &values, &Extra::default())).unwrap();
            assert_eq!(
                (d.sample_type.as_str(), d.step_m, d.grid.base_m),
                ($name, $step, 0.0)
            );
            assert_eq!(heights, values.map(|v| v as f32), $name);
        };
    }
    check!(Gray8, u8, "uint8", Some(1.0), [0, 1, 200, 255]);
    check!(GrayI8, i8, "int8", Some(1.0), [-128, -1, 0, 127]);
    check!(Gray16, u16, "uint16", Some(1.0), [0, 256, 40_000, 65_535]);
    check!(GrayI16, i16, "int16", Some(1.0), [-32_768, -5, 0, 8848]);
    check!(Gray32, u32, "uint32", Some(1.0), [0, 1, 2, 1 << 24]);
    check!(GrayI32, i32, "int32", Some(1.0), [-(1 << 24), 1, 2, 3]);
    check!(Gray64, u64, "uint64", Some(1.0), [0, 1, 2, 1 << 40]);
    check!(GrayI64, i64, "int64", Some(1.0), [-5, 1, 2, 1 << 40]);
    check!(Gray32Float, f32, "float32", None, [0.1, -1e30, 1e-30, 8848.86]);
    check!(
        Gray64Float,
        f64,
        "float64",
        None,
        [0.5, -1.25, 1e-3f32 as f64, 0.0]
    );
}

#[test]
fn strips_compressions_predictors_and_both_kinds_of_file_are_read() {
    let (width, height) = (13u32, 11u32);
    let values: Vec<i16> = (0..width * height)
        .map(|i| (i * 37 % 1000) as i16 - 300)
        .collect();
    let want: Vec<f32> = values.iter().map(|v| f32::from(*v)).collect();
    for (name, compression) in [
        ("none", Compression::Uncompressed),
        ("LZW", Compression::Lzw),
        ("deflate", Compression::Deflate(Default::default())),
        ("PackBits", Compression::Packbits),
    ] {
        for predictor in [Predictor::None, Predictor::Horizontal] {
            let size = [width, height];
            let extra = Extra::default();
            // Each strip of PackBits holds one row here, and the encoder alone decides so.
            if matches!(compression, Compression::Packbits) && matches!(predictor, Predictor::Horizontal) {
                continue;
            }
            let classic =
                encode_as::<GrayI16, TiffKindStandard>(size, &values, compression, predictor, &extra);
            assert_eq!(read(classic).unwrap().1, want, "{name} {predictor:?}");
            let big = encode_as::<GrayI16, TiffKindBig>(size, &values, compression, predictor, &extra);
            assert_eq!(read(big).unwrap().1, want, "{name} {predictor:?} big");
        }
    }
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

#[test]
fn tiles_beyond_the_edge_are_cut_and_halves_are_read() {
    let halves: Vec<u8> = (0..32 * 16u16)
        .flat_map(|i| f16::from_f32(f32::from(i)).to_le_bytes())
        .collect();
    let (d, heights) = read(tiled(16, 3, &halves, halves.len() as u32)).unwrap();
    assert_eq!(d.sample_type, "float16");
    for (x, z) in Rect::new(0, 0, 20, 10).cells() {
        assert_eq!(heights[(z * 20 + x) as usize], (z * 32 + x) as f32);
    }
    // A tile that is not stored is 0, as nothing names a no-data value.
    let (_, heights) = read(tiled(16, 2, &[], 0)).unwrap();
    assert_eq!(heights, [0.0; 200]);
}

/// LZW as TIFF has it, with literal codes only: 9 bits each, cleared before they would need 10.
fn lzw(data: &[u8]) -> Vec<u8> {
    let mut codes = vec![];
    for piece in data.chunks(200) {
        codes.push(256u16);
        codes.extend(piece.iter().map(|b| u16::from(*b)));
    }
    codes.push(257);
    let bits: Vec<u8> = codes
        .iter()
        .flat_map(|c| (0..9).rev().map(move |b| (c >> b & 1) as u8))
        .collect();
    bits.chunks(8)
        .map(|byte| {
            byte.iter()
                .enumerate()
                .fold(0, |sum, (i, bit)| sum | bit << (7 - i))
        })
        .collect()
}

#[test]
fn lzw_tiles_beyond_the_edge_are_read() {
    let bytes: Vec<u8> = (0..32 * 16u32).map(|i| (i * i % 251) as u8).collect();
    let payload = lzw(&bytes);
    let (_, heights) = read(packed(5, 8, 1, &payload, payload.len() as u32)).unwrap();
    for (x, z) in Rect::new(0, 0, 20, 10).cells() {
        assert_eq!(
            heights[(z * 20 + x) as usize],
            f32::from(bytes[(z * 32 + x) as usize]),
            "({x}, {z})"
        );
    }
    refusal(
        packed(7, 8, 1, &payload, payload.len() as u32),
        ErrorKind::Unsupported,
        "JPEG",
    );
    refusal(packed(65_535, 8, 1, &payload, 0), ErrorKind::Unsupported, "65535");
}

#[test]
fn no_data_is_compared_in_the_type_of_the_samples() {
    let extra = |nodata| Extra {
        nodata: Some(nodata),
        ..Extra::default()
    };
    let voids = |bytes: Vec<u8>| {
        read(bytes)
            .unwrap()
            .1
            .iter()
            .map(|h| h.is_nan())
            .collect::<Vec<_>>()
    };
    let shorts = [-9999i16, -9998, 0, 1];
    assert_eq!(
        voids(encode::<GrayI16>([4, 1], &shorts, &extra("-9999"))),
        [true, false, false, false]
    );
    assert_eq!(
        voids(encode::<GrayI16>([4, 1], &shorts, &extra("-9999.0"))),
        [true, false, false, false]
    );
    assert_eq!(
        voids(encode::<GrayI16>([4, 1], &shorts, &extra("55537"))),
        [false; 4]
    );
    let floats = [f32::MIN, 0.1, f32::NAN, f32::INFINITY];
    let min = extra("-3.4028234663852886e+38");
    assert_eq!(
        voids(encode::<Gray32Float>([4, 1], &floats, &min)),
        [true, false, true, true]
    );
    assert_eq!(
        voids(encode::<Gray32Float>([4, 1], &floats, &extra("0.1"))),
        [false, true, true, true]
    );
    let (d, _) = read(encode::<Gray32Float>([4, 1], &floats, &extra("none"))).unwrap();
    assert!(
        d.assumed.iter().any(|s| s.contains("\"none\"")),
        "{:?}",
        d.assumed
    );
    assert!(
        d.assumed.iter().any(|s| s.contains("One height is infinite")),
        "{:?}",
        d.assumed
    );
}

#[test]
fn wide_values_get_a_base_and_scale_offset_and_unit_become_metres() {
    let (d, heights) = read(encode::<Gray64Float>(
        [3, 1],
        &[1e7 + 0.0625, 1e7, -1e7],
        &Extra::default(),
    ))
    .unwrap();
    assert_eq!(
        (d.grid.base_m, heights),
        (1e7 + 0.0625, vec![0.0, -0.0625, -2e7 - 0.0625])
    );
    let (d, heights) = read(encode::<GrayI32>(
        [2, 1],
        &[16_777_217, 16_777_218],
        &Extra::default(),
    ))
    .unwrap();
    assert_eq!((d.grid.base_m, heights), (16_777_217.0, vec![0.0, 1.0]));
    let metadata = "<GDALMetadata><Item name=\"S\" sample=\"0\" role=\"scale\">0.5</Item>\
                    <Item name=\"O\" sample=\"0\" role=\"offset\">100</Item></GDALMetadata>";
    let keys = [
        [1024, 0, 1, 1],
        [3072, 0, 1, 32611],
        [3076, 0, 1, 9001],
        [4099, 0, 1, 9002],
    ];
    let extra = Extra {
        metadata: Some(metadata),
        ..placed([30.0, 30.0], [0.0, 0.0], &keys)
    };
    let (d, heights) = read(encode::<GrayI16>([2, 1], &[0, 10], &extra)).unwrap();
    assert_eq!(heights, [30.48, (105.0f64 * 0.3048) as f32]);
    assert_eq!(
        (d.step_m, d.vertical_unit.as_str(), d.grid.base_m),
        (Some(0.5 * 0.3048), "foot", 0.0)
    );
    assert_eq!(d.assumed, ["Grid north is taken for true north."]);
}

#[test]
fn area_and_point_name_the_same_samples() {
    let utm = |raster: u16| {
        [
            [1024, 0, 1, 1],
            [1025, 0, 1, raster],
            [3072, 0, 1, 32611],
            [3076, 0, 1, 9001],
        ]
    };
    let data = [1i16, 2, 3, 4, 5, 6];
    let area = encode::<GrayI16>([3, 2], &data, &placed([30.0, 20.0], [1000.0, 5000.0], &utm(1)));
    let point = encode::<GrayI16>([3, 2], &data, &placed([30.0, 20.0], [1015.0, 4990.0], &utm(2)));
    let (a, p) = (read(area).unwrap().0, read(point).unwrap().0);
    let (a_place, p_place) = (a.place.unwrap(), p.place.unwrap());
    assert_eq!((a_place.origin, a_place.pixel), ([1015.0, 4990.0], [30.0, -20.0]));
    assert_eq!((p_place.origin, p_place.pixel), (a_place.origin, a_place.pixel));
    assert_eq!(
        (a_place.registration, p_place.registration),
        (Registration::Area, Registration::Point)
    );
    assert_eq!(
        (a_place.crs.as_deref(), a.grid.spacing_m),
        (Some("EPSG:32611"), [30.0, 20.0])
    );
    // A tie point at another pixel, and a matrix, say the same.
    let mut elsewhere = placed([30.0, 20.0], [0.0; 2], &utm(1));
    elsewhere.tie = Some(vec![2.0, 1.0, 0.0, 1060.0, 4980.0, 0.0]);
    assert_eq!(
        read(encode::<GrayI16>([3, 2], &data, &elsewhere))
            .unwrap()
            .0
            .place,
        Some(a_place.clone())
    );
    let mut matrix = [0.0; 16];
    (matrix[0], matrix[3], matrix[5], matrix[7], matrix[15]) = (30.0, 1000.0, -20.0, 5000.0, 1.0);
    let mut extra = Extra {
        matrix: Some(matrix),
        keys: utm(1).to_vec(),
        ..Extra::default()
    };
    assert_eq!(
        read(encode::<GrayI16>([3, 2], &data, &extra)).unwrap().0.place,
        Some(a_place.clone())
    );
    // Rows from the south: the same samples turned about.
    (matrix[5], matrix[7]) = (20.0, 4960.0);
    extra.matrix = Some(matrix);
    let (d, heights) = read(encode::<GrayI16>([3, 2], &data, &extra)).unwrap();
    assert_eq!(
        (d.place, heights),
        (Some(a_place), vec![4.0, 5.0, 6.0, 1.0, 2.0, 3.0])
    );
}

#[test]
fn units_of_length_and_degrees_become_metres() {
    let spacing = |keys: &[[u16; 4]], scale: f64, at: [f64; 2]| {
        read(encode::<Gray8>([2, 2], &[0; 4], &placed([scale; 2], at, keys)))
            .unwrap()
            .0
    };
    let feet = spacing(
        &[[1024, 0, 1, 1], [3072, 0, 1, 2229], [3076, 0, 1, 9003]],
        100.0,
        [6e6, 2e6],
    );
    assert_eq!(feet.grid.spacing_m, [100.0 * (1200.0 / 3937.0); 2]);
    let degrees = spacing(&[[1024, 0, 1, 2], [2048, 0, 1, 4326]], 0.01, [7.0, 46.01]);
    let place = degrees.place.unwrap();
    assert!(place.geographic && place.crs.as_deref() == Some("EPSG:4326"));
    assert!(
        (degrees.grid.spacing_m[1] - 1111.5).abs() < 0.5,
        "{:?}",
        degrees.grid
    );
    assert!(
        degrees.assumed.iter().any(|s| s.contains("ellipsoid")),
        "{:?}",
        degrees.assumed
    );
    let silent = spacing(&[[1024, 0, 1, 1], [3072, 0, 1, 2229]], 100.0, [6e6, 2e6]);
    assert!(
        silent.assumed.iter().any(|s| s.contains("unit of length")),
        "{:?}",
        silent.assumed
    );
    let unknown = spacing(&[], 0.01, [7.0, 46.0]);
    assert!(unknown.assumed.contains(&geographic::DEGREES_ASSUMED.to_string()));
    let far = spacing(&[], 0.01, [700.0, 46.0]);
    assert_eq!(far.grid.spacing_m, [0.01; 2]);
    assert!(far.assumed.contains(&geographic::METRES_ASSUMED.to_string()));
}

#[test]
fn what_is_no_grid_of_heights_is_unsupported() {
    let gray = |extra: &Extra| encode::<Gray8>([2, 2], &[0; 4], extra);
    let utm = [[1024, 0, 1, 1], [3072, 0, 1, 32611], [3076, 0, 1, 9001]];
    use ErrorKind::{Broken, Unsupported};
    refusal(
        encode::<RGB8>([2, 2], &[0; 12], &Extra::default()),
        Unsupported,
        "3 bands",
    );
    let mut matrix = [0.0; 16];
    (matrix[0], matrix[1], matrix[5]) = (1.0, 0.1, -1.0);
    refusal(
        gray(&Extra {
            matrix: Some(matrix),
            ..Extra::default()
        }),
        Unsupported,
        "rotated",
    );
    let mut points = placed([1.0, 1.0], [0.0; 2], &utm);
    (points.scale, points.tie) = (None, Some(vec![0.0; 12]));
    refusal(gray(&points), Unsupported, "control points");
    refusal(
        gray(&placed([1.0, -1.0], [0.0; 2], &utm)),
        Unsupported,
        "negative vertical",
    );
    refusal(
        gray(&placed([f64::NAN, 1.0], [0.0; 2], &utm)),
        Unsupported,
        "pixels of NaN",
    );
    refusal(
        gray(&Extra {
            scale: Some([1.0; 3]),
            ..Extra::default()
        }),
        Broken,
        "half of a georeference",
    );
    refusal(
        gray(&placed([1.0; 2], [0.0; 2], &[[1024, 0, 1, 3]])),
        Unsupported,
        "geocentric",
    );
    let grads = [[1024, 0, 1, 2], [2048, 0, 1, 4807], [2054, 0, 1, 9105]];
    refusal(gray(&placed([0.01; 2], [2.0, 48.0], &grads)), Unsupported, "9105");
    let chains = [[1024, 0, 1, 1], [3076, 0, 1, 9033]];
    refusal(gray(&placed([1.0; 2], [0.0; 2], &chains)), Unsupported, "9033");
    refusal(
        gray(&placed([0.01; 2], [7.0, 99.0], &[[1024, 0, 1, 2]])),
        Broken,
        "latitudes",
    );
    for (photometric, part) in [(0, "WhiteIsZero"), (3, "palette"), (2, "colours")] {
        let mut bytes = gray(&Extra::default());
        let at = bytes
            .windows(8)
            .position(|w| w == [6, 1, 3, 0, 1, 0, 0, 0])
            .unwrap();
        bytes[at + 8] = photometric;
        refusal(bytes, Unsupported, part);
    }
    refusal(tiled(32, 5, &[0; 2048], 2048), Unsupported, "complex");
    refusal(tiled(12, 1, &[0; 2048], 2048), Unsupported, "12");
}

#[test]
fn damage_is_broken_and_claims_are_limited() {
    let whole = encode::<GrayI16>([40, 40], &[7; 1600], &Extra::default());
    for keep in [3, 7, 9, 60, whole.len() / 2, whole.len() - 3] {
        let error = read(whole[..keep].to_vec()).unwrap_err();
        assert_eq!(
            error.kind(),
            ErrorKind::Broken,
            "{keep} of {} bytes: {error}",
            whole.len()
        );
    }
    let sides = |width: u16, height: u16| {
        let tags = [
            short(256, width),
            short(257, height),
            short(258, 16),
            short(262, 1),
            short(277, 1),
            short(278, height),
        ];
        by_hand(&tags, |start| vec![(273, vec![start]), (279, vec![8])], &[0; 8])
    };
    assert!(read(sides(2, 2)).is_ok());
    refusal(sides(2, 3), ErrorKind::Broken, "too early");
    refusal(sides(60_000, 60_000), ErrorKind::Limit, "60000 x 60000");
}

#[test]
fn a_mask_is_refused_and_a_second_image_is_told() {
    let two = |kind: u32| {
        let mut out = Bytes::new(Vec::new());
        let mut encoder = TiffEncoder::new(&mut out).unwrap();
        encoder.write_image::<Gray8>(2, 2, &[1, 2, 3, 4]).unwrap();
        let mut second = encoder.new_image::<Gray8>(2, 2).unwrap();
        second.encoder().write_tag(Tag::NewSubfileType, kind).unwrap();
        second.write_data(&[0; 4]).unwrap();
        out.into_inner()
    };
    refusal(two(MASK), ErrorKind::Unsupported, "mask");
    let told = |kind: u32| {
        read(two(kind))
            .unwrap()
            .0
            .assumed
            .iter()
            .any(|s| s.contains("several images"))
    };
    assert!(told(0) && !told(OVERVIEW));
}
