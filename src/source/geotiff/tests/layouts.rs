//! Tests of layouts: every type, order, compression, predictor, block and arrangement of bands, against the values that
//! were written.

use super::writer::{Image, write};
use super::*;
use crate::source::Band;

/// What an image should read as.
fn wanted(image: &Image, band: usize) -> Vec<f32> {
    let places = (0..image.height).flat_map(|z| (0..image.width).map(move |x| (x, z)));
    places.map(|(x, z)| (image.value)(band, x, z) as f32).collect()
}

fn check(image: &Image, big: bool, bigtiff: bool) {
    let file: Arc<dyn ReadAt> = Arc::new(write(std::slice::from_ref(image), big, bigtiff));
    for band in 0..image.bands {
        let options = OpenOptions {
            band: Some(Band::Number(band as u32 + 1)),
            ..OpenOptions::default()
        };
        let what = || {
            format!(
                "{} bits of format {}, compression {}, predictor {}, blocks {:?}, band {band} of {} (separate {}), big \
                 endian {big}, BigTIFF {bigtiff}",
                image.bits,
                image.format,
                image.compression,
                image.predictor,
                image.block,
                image.bands,
                image.separate
            )
        };
        let source = open("t.tif", Arc::clone(&file), &options).unwrap_or_else(|e| panic!("{e}: {}", what()));
        let size = source.description().grid.size;
        let mut heights = vec![0.0; size.samples() as usize];
        source
            .read(size.rect(), &mut heights)
            .unwrap_or_else(|e| panic!("{e}: {}", what()));
        let base_m = source.description().grid.base_m;
        let heights: Vec<f32> = heights.iter().map(|h| (f64::from(*h) + base_m) as f32).collect();
        assert_eq!(heights, wanted(image, band), "{}", what());
    }
}

/// Formats and bits of every type.
const TYPES: [(u16, usize); 11] = [
    (1, 8),
    (1, 16),
    (1, 32),
    (1, 64),
    (2, 8),
    (2, 16),
    (2, 32),
    (2, 64),
    (3, 16),
    (3, 32),
    (3, 64),
];

#[test]
fn every_layout_is_read() {
    for (format, bits) in TYPES {
        for (compression, predictor) in [
            (1, 1),
            (32773, 1),
            (5, 1),
            (5, 2),
            (8, 1),
            (8, 2),
            (32946, 3),
            (50000, 1),
            (50000, 2),
            (5, 3),
        ] {
            if predictor == 3 && format != 3 {
                continue;
            }
            for (block, bands, separate) in [
                ([0, 4], 1, false),
                ([0, 11], 3, false),
                ([16, 16], 1, false),
                ([5, 3], 3, false),
                ([16, 16], 2, true),
                ([0, 3], 2, true),
            ] {
                let mut image = Image::new(13, 11, format, bits);
                (image.compression, image.predictor, image.block) = (compression, predictor, block);
                (image.bands, image.separate) = (bands, separate);
                image.value = match (format, bits) {
                    (1, 8) => |b, x, z| ((x * 37 + z * 91 + b * 5) % 256) as f64,
                    (2, 8) => |b, x, z| ((x * 37 + z * 91 + b * 5) % 256) as f64 - 128.0,
                    (1, _) => |b, x, z| ((x * 3777 + z * 9111 + b * 5) % 65_536) as f64,
                    (2, _) => |b, x, z| ((x * 3777 + z * 9111 + b * 5) % 65_536) as f64 - 32_768.0,
                    (_, 16) => |b, x, z| (x * 7 + z * 91) as f64 / 8.0 - 60.0 + b as f64,
                    _ => |b, x, z| (x * 777 + z * 91) as f64 / 64.0 - 60.0 + b as f64,
                };
                for (big, bigtiff) in [(false, false), (true, true), (true, false), (false, true)] {
                    check(&image, big, bigtiff);
                }
            }
        }
    }
}

#[test]
fn a_wrong_value_would_be_seen() {
    let mut image = Image::new(13, 11, 2, 16);
    image.compression = 8;
    let bytes = write(std::slice::from_ref(&image), false, false);
    image.value = |_, x, z| (x * 7 + z * 31) as f64 + if (x, z) == (12, 10) { 1.0 } else { 0.0 };
    assert_ne!(read(bytes).unwrap().1, wanted(&image, 0));
}

#[test]
fn samples_of_a_few_bits_are_unpacked() {
    for (bits, value) in [
        (
            1,
            (|_, x, z| ((x + z) % 2) as f64) as fn(usize, usize, usize) -> f64,
        ),
        (2, |_, x, z| ((x + z) % 4) as f64),
        (4, |_, x, z| ((x * 3 + z) % 16) as f64),
        (12, |_, x, z| ((x * 300 + z * 7) % 4096) as f64),
        (20, |_, x, z| ((x * 30_011 + z * 7) % 1_048_576) as f64),
        (24, |_, x, z| ((x * 300_011 + z * 7) % 16_777_216) as f64),
    ] {
        for block in [[0, 4], [16, 16]] {
            for big in [false, true] {
                if big && bits == 24 {
                    continue; // refused
                }
                let mut image = Image::new(13, 11, 1, bits);
                (image.value, image.block) = (value, block);
                image.compression = 8;
                check(&image, big, false);
            }
        }
    }
    let mut image = Image::new(13, 11, 1, 12);
    (image.compression, image.predictor) = (8, 2);
    refusal(
        write(&[image], false, false),
        ErrorKind::Unsupported,
        "differences (predictor 2) of samples of 12 bits",
    );
}

#[test]
fn a_predictor_without_its_compressions_is_passed_over() {
    // libtiff, and so every writer of note, knows predictors with LZW, deflate and zstd alone.
    let mut image = Image::new(13, 11, 2, 16);
    let want = wanted(&image, 0);
    let plain = write(std::slice::from_ref(&image), false, false);
    image.predictor = 2;
    image.tags.clear();
    let mut tagged = plain.clone();
    let at = plain
        .windows(8)
        .position(|w| w == [61, 1, 3, 0, 1, 0, 0, 0])
        .unwrap();
    tagged[at + 8] = 2;
    assert_eq!(read(tagged).unwrap().1, want);
}

#[test]
fn blocks_that_are_not_stored_are_no_data_or_0() {
    for (block, left_out) in [([16, 16], vec![1, 2]), ([0, 4], vec![1])] {
        for compression in [1, 8] {
            let mut image = Image::new(20, 20, 2, 16);
            image.value = |_, _, _| 5.0;
            (image.block, image.left_out, image.compression) = (block, left_out.clone(), compression);
            let (_, zeros) = read(write(std::slice::from_ref(&image), false, false)).unwrap();
            let (_, voids) = read(write(&[image.clone().text(42113, "-1")], false, false)).unwrap();
            let is_out = |i: usize| match block {
                [16, _] => (i % 20 >= 16) != (i / 20 >= 16),
                _ => (4..8).contains(&(i / 20)),
            };
            for i in 0..400 {
                assert_eq!(zeros[i], if is_out(i) { 0.0 } else { 5.0 }, "{i}");
                assert_eq!(voids[i].is_nan(), is_out(i), "{i}");
            }
        }
    }
}

#[test]
fn lengths_that_are_missing_or_short_are_made_out() {
    let strip = |compression, rows| {
        let mut image = Image::new(13, 11, 2, 16);
        (image.block, image.compression) = ([0, rows], compression);
        let want = wanted(&image, 0);
        (write(&[image], false, false), want)
    };
    // Another tag in place of that of the lengths.
    let without = |mut bytes: Vec<u8>| {
        let at = bytes.windows(4).position(|w| w == [0x17, 1, 4, 0]).unwrap();
        bytes[at..at + 2].copy_from_slice(&[0x18, 1]);
        bytes
    };
    for (compression, rows) in [(1, 4), (1, 11), (8, 11), (5, 4)] {
        let (bytes, want) = strip(compression, rows);
        assert_eq!(read(without(bytes)).unwrap().1, want, "{compression} {rows}");
    }
    // Fewer lengths than strips: the others are not stored. One strip without compression needs none.
    let (mut bytes, want) = strip(1, 4);
    let at = bytes.windows(4).position(|w| w == [0x17, 1, 4, 0]).unwrap();
    bytes[at + 4] = 2;
    let (_, heights) = read(bytes).unwrap();
    assert_eq!((&heights[..104], &heights[104..]), (&want[..104], &[0.0; 39][..]));
    let (mut bytes, want) = strip(1, 11);
    let at = bytes.windows(4).position(|w| w == [0x17, 1, 4, 0]).unwrap();
    bytes[at + 8] = 1;
    assert_eq!(read(bytes).unwrap().1, want);
}

#[test]
fn bits_in_reverse_are_turned() {
    for compression in [1, 8] {
        let mut image = Image::new(13, 11, 2, 16);
        image.compression = compression;
        image.tags.push((266, 3, vec![2.0]));
        let want = wanted(&image, 0);
        let mut bytes = write(&[image], false, false);
        let offset = bytes
            .windows(8)
            .position(|w| w == [0x11, 1, 4, 0, 1, 0, 0, 0])
            .unwrap();
        let start = bytes[offset + 8] as usize;
        let count = bytes
            .windows(8)
            .position(|w| w == [0x17, 1, 4, 0, 1, 0, 0, 0])
            .unwrap();
        let length = usize::from(bytes[count + 8]) + 256 * usize::from(bytes[count + 9]);
        bytes[start..start + length]
            .iter_mut()
            .for_each(|b| *b = b.reverse_bits());
        assert_eq!(read(bytes).unwrap().1, want);
    }
}

#[test]
fn a_mask_hides_and_an_overview_is_a_dem_of_its_own() {
    let mut image = Image::new(20, 10, 2, 16);
    image.tags.push((33550, 12, vec![30.0, 30.0, 0.0]));
    image
        .tags
        .push((33922, 12, vec![0.0, 0.0, 0.0, 600.0, 900.0, 0.0]));
    let mut mask = Image::new(20, 10, 1, 1);
    mask.value = |_, x, _| f64::from(u8::from(x >= 9));
    mask.tags.push((254, 4, vec![4.0]));
    let mut half = Image::new(10, 5, 2, 16);
    half.value = |_, x, z| (x * 1000 + z) as f64;
    half.tags.push((254, 4, vec![1.0]));
    let mut half_mask = Image::new(10, 5, 1, 1);
    half_mask.value = |_, _, z| f64::from(u8::from(z != 2));
    half_mask.tags.push((254, 4, vec![5.0]));
    half_mask.compression = 8;
    for big in [false, true] {
        let images = [image.clone(), half.clone(), mask.clone(), half_mask.clone()];
        let source = open(
            "t.tif",
            Arc::new(write(&images, big, false)),
            &OpenOptions::default(),
        )
        .unwrap();
        let mut heights = vec![0.0; 200];
        source.read(Rect::new(0, 0, 20, 10), &mut heights).unwrap();
        for (i, (height, want)) in heights.iter().zip(wanted(&image, 0)).enumerate() {
            assert!(
                if i % 20 < 9 {
                    height.is_nan()
                } else {
                    *height == want
                },
                "{i}: {height}"
            );
        }
        let overviews = source.overviews().unwrap();
        let [overview] = &overviews[..] else {
            panic!("{} overviews", overviews.len())
        };
        assert_eq!((overview.step, overview.shift), ([2.0; 2], [0.5; 2]));
        let d = overview.source.description();
        assert_eq!((d.grid.size.width, d.grid.spacing_m), (10, [60.0; 2]));
        let of = source.description().place.as_ref().unwrap();
        assert_eq!(d.place.as_ref().unwrap().origin, of.place(0.5, 0.5));
        let mut coarse = vec![0.0; 50];
        overview.source.read(Rect::new(0, 0, 10, 5), &mut coarse).unwrap();
        for (i, (height, want)) in coarse.iter().zip(wanted(&half, 0)).enumerate() {
            assert!(
                if i / 10 == 2 {
                    height.is_nan()
                } else {
                    *height == want
                },
                "{i}: {height}"
            );
        }
    }
    let mut small = mask.clone();
    small.width = 19;
    refusal(
        write(&[image, small], false, false),
        ErrorKind::Broken,
        "mask of 19 x 10",
    );
}

#[test]
fn a_pass_from_north_to_south_decodes_no_block_twice() {
    for (block, windows) in [
        ([0, 7], [100, 16]),
        ([16, 16], [100, 5]),
        ([16, 16], [16, 16]),
        ([0, 1], [9, 9]),
    ] {
        let mut image = Image::new(100, 90, 2, 16);
        (image.block, image.compression) = (block, 8);
        let want = wanted(&image, 0);
        let bytes: Arc<dyn ReadAt> = Arc::new(write(&[image], false, false));
        let source = open("t.tif", bytes, &OpenOptions::default()).unwrap();
        for z in (0..90).step_by(windows[1]) {
            for x in (0..100).step_by(windows[0]) {
                let rect = Rect::new(
                    x,
                    z,
                    100.min(x + windows[0] as i64),
                    90.min(z + windows[1] as i64),
                );
                let mut out = vec![0.0; rect.area() as usize];
                source.read(rect, &mut out).unwrap();
                for ((x, z), height) in rect.cells().zip(out) {
                    assert_eq!(height, want[(z * 100 + x) as usize], "({x}, {z})");
                }
            }
        }
        let reads = source.reads();
        assert_eq!(reads.decoded, reads.blocks, "{block:?} {windows:?}");
    }
}
