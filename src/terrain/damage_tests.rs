//! What damage does: a file is read as it was written, or refused with the place named.

use std::io::Cursor;
use std::sync::Arc;

use super::layout::{Kind, Layout};
use super::testing::{Arrays, Look, Random, all_bits, first_tile, meta, open};
use super::*;
use crate::error::{Error, ErrorKind, Result};
use crate::grid::{Grid, Rect};
use crate::levels::Levels;
use crate::progress::Silent;

/// What a damaged file may do: fail with a kind that says so, or give the very same data and description.
fn same_or_refused(bytes: Vec<u8>, want: &[u32], description: &Meta) -> Result<(), Error> {
    let file = open(bytes)?;
    let got = all_bits(&file)?;
    assert!(
        got == want && file.meta() == description,
        "the damage went unnoticed"
    );
    Ok(())
}

#[test]
fn any_damaged_byte_of_header_and_tables_is_noticed_or_without_effect() {
    let arrays = Arrays::random(70, 33, true, Look::Smooth, 7);
    let bytes = arrays.file();
    let (want, description) = (all_bits(&arrays).unwrap(), meta(arrays.grid, true));
    same_or_refused(bytes.clone(), &want, &description).unwrap();
    let mut refused = 0;
    let end = first_tile(&bytes);
    for at in 0..end {
        for value in [
            bytes[at] ^ 1,
            bytes[at] ^ 0x80,
            0,
            0xFF,
            bytes[at].wrapping_add(1),
        ] {
            let mut damaged = bytes.clone();
            damaged[at] = value;
            if let Err(error) = same_or_refused(damaged, &want, &description) {
                let kind = error.kind();
                assert!(
                    matches!(kind, ErrorKind::Broken | ErrorKind::Unsupported),
                    "byte {at}: {error}"
                );
                refused += 1;
            }
        }
    }
    // Most bytes matter: names, types, windows, texts, offsets.
    assert!(refused > 3 * end, "{refused} of {} damages were noticed", 5 * end);
}

#[test]
fn any_flip_in_a_tile_is_caught_and_its_place_named() {
    for (look, light) in [(Look::Noise, true), (Look::Smooth, true), (Look::Noise, false)] {
        let arrays = Arrays::random(300, 280, light, look, 8);
        let bytes = arrays.file();
        let (want, start) = (all_bits(&arrays).unwrap(), first_tile(&bytes));
        let random = &mut Random::new(9);
        for round in 0..400 {
            let mut damaged = bytes.clone();
            let at = start + random.below((bytes.len() - start) as i64) as usize;
            damaged[at] ^= 1 << random.below(8);
            let case = format!("seed 9, round {round}, byte {at}, {look:?}");
            // A file whose last tile's head is damaged may not even open.
            let Ok(file) = open(damaged) else { continue };
            let faults = file.verify(&Silent).unwrap();
            // Deflate has bits that mean nothing (beyond its last block): then the data are the same.
            if faults.is_empty() {
                assert!(all_bits(&file).unwrap() == want, "{case}");
                assert!(
                    look == Look::Smooth || at < start + 24,
                    "{case}: a stored tile has no such bits"
                );
                continue;
            }
            for fault in faults {
                assert_eq!(fault.kind(), ErrorKind::Broken, "{case}");
                let line = fault.to_string();
                assert!(
                    line.contains("part ") && line.contains("tile ("),
                    "{case}: {line}"
                );
            }
        }
    }
}

#[test]
fn a_stored_tile_is_caught_by_its_check_alone() {
    let arrays = Arrays::random(64, 64, false, Look::Noise, 10);
    let mut bytes = arrays.file();
    let at = first_tile(&bytes) + 24 + 1000;
    bytes[at] ^= 4;
    let file = open(bytes).unwrap();
    let error = file.heights(0, Rect::new(3, 3, 4, 4), &mut [0.0]).unwrap_err();
    assert!(
        error
            .to_string()
            .contains("part height.0, tile (0, 0) is damaged: its CRC-32C"),
        "{error}"
    );
    // Everything else can still be read, and verify names this tile only.
    let _ = file
        .bounds(0, Rect::new(0, 0, 1, 1), &mut [crate::levels::Bounds::VOID])
        .unwrap();
    assert_eq!(file.verify(&Silent).unwrap().len(), 1);
}

#[test]
fn a_file_cut_anywhere_does_not_open() {
    let bytes = Arrays::random(300, 270, true, Look::Smooth, 11).file();
    assert!(open(bytes.clone()).is_ok());
    let random = &mut Random::new(12);
    let some = (0..300).map(|_| random.below(bytes.len() as i64) as usize);
    for length in some.chain(0..64).chain(bytes.len() - 64..bytes.len()) {
        let error = open(bytes[..length].to_vec())
            .err()
            .unwrap_or_else(|| panic!("cut to {length} bytes"));
        assert_eq!(error.kind(), ErrorKind::Broken, "cut to {length} bytes: {error}");
    }
}

/// The file with one text replaced by another of the same length.
fn replaced(bytes: &[u8], from: &str, to: &str) -> Vec<u8> {
    assert_eq!(from.len(), to.len());
    let mut out = bytes.to_vec();
    let places: Vec<usize> = (0..out.len() - from.len())
        .filter(|&i| out[i..].starts_with(from.as_bytes()))
        .collect();
    assert!(!places.is_empty(), "{from:?} is not there");
    for at in places {
        out[at..at + to.len()].copy_from_slice(to.as_bytes());
    }
    out
}

#[test]
fn other_versions_and_other_files_are_told_apart() {
    let bytes = Arrays::random(70, 33, false, Look::Smooth, 13).file();
    assert!(is_terrain(&bytes));
    let other = replaced(
        &bytes,
        "version\0string\0\u{1}\0\0\0\u{31}",
        "version\0string\0\u{1}\0\0\0\u{32}",
    );
    let error = open(other).err().unwrap();
    assert_eq!(error.kind(), ErrorKind::Unsupported);
    assert!(
        error.to_string().contains("version 2, this program reads 1"),
        "{error}"
    );
    // Without the attribute it is an OpenEXR file of somebody else's.
    let plain = replaced(&bytes, "clipscape.version", "klipscape.version");
    assert!(!is_terrain(&plain));
    let error = open(plain).err().unwrap();
    assert_eq!(error.kind(), ErrorKind::Unsupported);
    assert!(error.to_string().contains("not a terrain file"), "{error}");
    for not in [
        Vec::new(),
        b"text".to_vec(),
        vec![0u8; 100_000],
        bytes[..3].to_vec(),
    ] {
        assert!(!is_terrain(&not));
        assert_eq!(open(not).err().unwrap().kind(), ErrorKind::Broken);
    }
}

#[test]
fn a_plain_height_image_is_not_a_terrain_file() {
    let mut out = Cursor::new(Vec::new());
    use exr::prelude::*;
    let channels = SpecificChannels::build()
        .with_channel("Y")
        .with_pixel_fn(|_| (1.0f32,));
    Image::from_channels((20, 10), channels)
        .write()
        .non_parallel()
        .to_buffered(&mut out)
        .unwrap();
    let bytes = out.into_inner();
    assert!(!is_terrain(&bytes));
    assert_eq!(open(bytes).err().unwrap().kind(), ErrorKind::Unsupported);
}

#[test]
fn headers_with_other_sizes_than_the_rules_say_are_refused() {
    let arrays = Arrays::random(300, 70, false, Look::Smooth, 14);
    let description = meta(arrays.grid, false);
    let layout = Layout::new(&arrays.grid, false, false).unwrap();
    let with = |change: &dyn Fn(&mut exr::meta::MetaData)| {
        let mut exr = header::describe(&layout);
        change(&mut exr);
        let mut bytes = header::to_bytes(&description, &exr).unwrap();
        bytes.resize(bytes.len() + 100_000, 0);
        header::read("t", Arc::new(bytes)).map(|_| ())
    };
    with(&|_| ()).unwrap();
    let level_1 = layout.part(Kind::Height, 1);
    let refused = |what: &str, change: &dyn Fn(&mut exr::meta::MetaData)| {
        let error = with(change).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Broken, "{error}");
        assert!(error.to_string().contains(what), "{error}");
    };
    use exr::prelude::{IntegerBounds, Text, Vec2};
    refused("data window", &|m| m.headers[level_1].layer_size = Vec2(151, 35));
    refused("data window", &|m| {
        m.headers[level_1].own_attributes.layer_position = Vec2(1, 0);
    });
    refused("display window", &|m| {
        m.headers[level_1].shared_attributes.display_window = IntegerBounds::from_dimensions(Vec2(9, 9));
    });
    refused("is called", &|m| {
        m.headers[level_1].own_attributes.layer_name = Some(Text::from("height.7"));
    });
    refused("parts", &|m| drop(m.headers.pop()));
    refused("zip", &|m| {
        m.headers[level_1].compression = exr::prelude::Compression::RLE;
    });
    refused("channels", &|m| {
        m.headers[level_1].channels = m.headers[layout.part(Kind::Bounds, 1)].channels.clone();
    });
    refused("display window", &|m| m.headers[0].layer_size = Vec2(299, 70));
    // A header that promises more than the file can hold is refused before anything is allocated for it.
    let grid = Grid::new(1 << 20, 1 << 20, [1.0, 1.0]);
    let huge = header::describe(&Layout::new(&grid, false, false).unwrap());
    let mut bytes = header::to_bytes(&meta(grid, false), &huge).unwrap();
    bytes.resize(bytes.len() + 1000, 0);
    assert!(open(bytes).err().unwrap().to_string().contains("ends too early"));
}
