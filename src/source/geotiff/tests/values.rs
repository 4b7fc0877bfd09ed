//! Tests of how samples become heights: types, no data, base, scale and unit.

use super::*;

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
            // And no reader but that encoder's own knows differences without LZW or deflate.
            let packed = !matches!(compression, Compression::Packbits | Compression::Uncompressed);
            if !packed && matches!(predictor, Predictor::Horizontal) {
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
    let source = open(
        "t.tif",
        Arc::new(encode::<Gray32Float>([4, 1], &floats, &min)),
        &OpenOptions::default(),
    );
    let source = source.unwrap();
    source.read(Rect::new(0, 0, 4, 1), &mut [0.0; 4]).unwrap();
    assert_eq!(source.reads().infinite, 1);
    let remarks = source.remarks(&crate::progress::Silent).unwrap();
    assert!(remarks[0].starts_with("One height is infinite"), "{remarks:?}");
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
fn a_second_image_is_told() {
    let told = |kind: u32| {
        let mut out = Bytes::new(Vec::new());
        let mut encoder = TiffEncoder::new(&mut out).unwrap();
        encoder.write_image::<Gray8>(2, 2, &[1, 2, 3, 4]).unwrap();
        let mut second = encoder.new_image::<Gray8>(2, 2).unwrap();
        second.encoder().write_tag(Tag::NewSubfileType, kind).unwrap();
        second.write_data(&[0; 4]).unwrap();
        let (d, _) = read(out.into_inner()).unwrap();
        d.assumed.iter().any(|s| s.contains("several images"))
    };
    assert!(told(0) && !told(OVERVIEW as u32));
}
