//! What DEMs hold while they are read from north to south, by the allocator's count, is no more than what they say of it
//! (`HeightSource::held_bytes`), by which a ceiling of memory is kept. `--nocapture` prints both.
#![cfg(feature = "dem")]
#![allow(clippy::print_stderr, reason = "says what it found")]

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use clipscape::grid::Rect;
use clipscape::source::{Band, Destepped, HeightSource, OpenOptions, open_with};

/// Rows that are read at once, as preprocessing does.
const ROWS: i64 = 256;

/// What is not counted: names, paths, decoders' tables, tasks.
const SLACK_BYTES: u64 = 512 << 10;

/// Rough whole metres.
fn height(x: usize, z: usize) -> i16 {
    let hill = 900.0 * (x as f64 / 90.0).sin() * (z as f64 / 130.0).cos();
    hill as i16 + ((x * 7919 + z * 104_729) % 31) as i16
}

fn deflated(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

/// How a TIFF is cut.
#[derive(Clone, Copy)]
struct Cut {
    size: [usize; 2],
    /// Columns and rows of a tile, or 0 and the rows of a strip.
    block: [usize; 2],
    bands: usize,
    packed: bool,
}

/// A TIFF of 16-bit whole numbers, all bands side by side and alike (TIFF 6.0, sections 2, 8 and 15).
fn tiff(cut: Cut) -> Vec<u8> {
    let [width, rows] = cut.size;
    let tiled = cut.block[0] > 0;
    let columns = if tiled { cut.block[0] } else { width };
    let mut out = b"II*\0\0\0\0\0".to_vec();
    let (mut offsets, mut counts) = (Vec::new(), Vec::new());
    for z0 in (0..rows).step_by(cut.block[1]) {
        for x0 in (0..width).step_by(columns) {
            let end = if tiled {
                z0 + cut.block[1]
            } else {
                (z0 + cut.block[1]).min(rows)
            };
            let mut block = Vec::new();
            for z in z0..end {
                for x in x0..x0 + columns {
                    for _ in 0..cut.bands {
                        block.extend(height(x, z).to_le_bytes());
                    }
                }
            }
            let block = if cut.packed { deflated(&block) } else { block };
            offsets.push(out.len() as u32);
            counts.push(block.len() as u32);
            out.extend(block);
        }
    }
    let compression = if cut.packed { 8 } else { 1 };
    let mut tags: Vec<(u16, Vec<u32>)> = vec![
        (256, vec![width as u32]),
        (257, vec![rows as u32]),
        (258, vec![16; cut.bands]),
        (259, vec![compression]),
        (262, vec![1]),
        (277, vec![cut.bands as u32]),
        (339, vec![2; cut.bands]),
    ];
    if tiled {
        let [width, height] = cut.block.map(|n| n as u32);
        tags.extend([
            (322, vec![width]),
            (323, vec![height]),
            (324, offsets),
            (325, counts),
        ]);
    } else {
        tags.extend([(273, offsets), (278, vec![cut.block[1] as u32]), (279, counts)]);
    }
    tags.sort();
    let mut directory = (tags.len() as u16).to_le_bytes().to_vec();
    for (tag, values) in &tags {
        directory.extend(tag.to_le_bytes());
        directory.extend(4u16.to_le_bytes());
        directory.extend((values.len() as u32).to_le_bytes());
        let place = match values[..] {
            [one] => one,
            _ => {
                let at = out.len() as u32;
                out.extend(values.iter().flat_map(|v| v.to_le_bytes()));
                at
            }
        };
        directory.extend(place.to_le_bytes());
    }
    directory.extend([0; 4]);
    let at = out.len() as u32;
    out[4..8].copy_from_slice(&at.to_le_bytes());
    out.extend(directory);
    out
}

fn hgt() -> Vec<u8> {
    let samples = (0..1201).flat_map(|z| (0..1201).map(move |x| height(x, z)));
    samples.flat_map(i16::to_be_bytes).collect()
}

fn zipped(path: &Path, name: &str, bytes: &[u8]) {
    let mut writer = zip::ZipWriter::new(fs::File::create(path).unwrap());
    writer
        .start_file(name, zip::write::SimpleFileOptions::default())
        .unwrap();
    writer.write_all(bytes).unwrap();
    writer.finish().unwrap();
}

fn ascii(columns: usize, rows: usize, west: usize) -> String {
    let mut text = format!("ncols {columns}\nnrows {rows}\nxllcorner {west}\nyllcorner 0\ncellsize 1\n");
    for z in 0..rows {
        for x in 0..columns {
            text += &format!("{} ", height(x, z));
        }
        text += "\n";
    }
    text
}

/// Reads all of `source` and returns the most bytes that this thread held at once for it.
fn reading_bytes(source: &dyn HeightSource) -> u64 {
    let size = source.description().grid.size;
    let mut band = vec![0.0; (ROWS * size.width) as usize];
    let info = allocation_counter::measure(|| {
        for z in (0..size.height).step_by(ROWS as usize) {
            let rect = Rect::new(0, z, size.width, (z + ROWS).min(size.height));
            source.read(rect, &mut band[..rect.area() as usize]).unwrap();
        }
    });
    info.bytes_max
}

/// Opens and reads `inputs`; the bytes held, and those that it says it holds.
fn held_and_said(inputs: &[PathBuf], destep: bool) -> [u64; 2] {
    let of_bands = inputs[0].to_string_lossy().contains("bands");
    let options = OpenOptions {
        band: of_bands.then_some(Band::Number(2)),
        ..OpenOptions::default()
    };
    let mut source = None;
    let opened = allocation_counter::measure(|| {
        source = Some(open_with(inputs, &options).unwrap());
    });
    let source = source.unwrap();
    let open = u64::try_from(opened.bytes_current).unwrap();
    if destep {
        let destepped = Destepped::new(source.as_ref()).unwrap();
        return [open + reading_bytes(&destepped), destepped.held_bytes()];
    }
    [open + reading_bytes(source.as_ref()), source.held_bytes()]
}

#[test]
fn no_source_holds_more_than_it_says() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let cut = Cut {
        size: [3000, 2100],
        block: [0, 16],
        bands: 1,
        packed: true,
    };
    let whole = Cut {
        block: [0, 2100],
        ..cut
    };
    let tiled = Cut {
        block: [256, 256],
        ..cut
    };
    let strips = |bands| Cut { bands, ..whole };
    let mut cases: Vec<(&str, Vec<PathBuf>, bool)> = Vec::new();
    for (name, cut) in [
        ("strips.tif", cut),
        ("one strip.tif", whole),
        ("tiles.tif", tiled),
        ("one strip of three bands.tif", strips(3)),
        ("plain strips.tif", Cut { packed: false, ..cut }),
        (
            "one plain strip of three bands.tif",
            Cut {
                packed: false,
                ..strips(3)
            },
        ),
    ] {
        fs::write(path(name), tiff(cut)).unwrap();
        cases.push((name, vec![path(name)], false));
    }
    zipped(&path("tiles.tif.zip"), "tiles.tif", &tiff(tiled));
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    gzip.write_all(&tiff(whole)).unwrap();
    fs::write(path("strip.tif.gz"), gzip.finish().unwrap()).unwrap();
    let mut picture = Vec::new();
    let mut encoder = png::Encoder::new(&mut picture, 900, 800);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    let samples: Vec<u8> = (0..800)
        .flat_map(|z| (0..900).map(move |x| (height(x, z) as u16).to_be_bytes()))
        .flatten()
        .collect();
    encoder
        .write_header()
        .unwrap()
        .write_image_data(&samples)
        .unwrap();
    fs::write(path("picture.png"), &picture).unwrap();
    fs::write(path("grid.asc"), ascii(500, 400, 0)).unwrap();
    fs::write(path("east.asc"), ascii(500, 400, 500)).unwrap();
    for name in ["tiles.tif.zip", "strip.tif.gz", "picture.png", "grid.asc"] {
        cases.push((name, vec![path(name)], false));
    }
    let tiles: Vec<PathBuf> = ["N42E001", "N42E002", "N42E003", "N41E001"]
        .map(|name| {
            let out = path(&format!("{name}.hgt.zip"));
            zipped(&out, &format!("{name}.hgt"), &hgt());
            out
        })
        .to_vec();
    cases.push(("one .hgt.zip", tiles[..1].to_vec(), false));
    cases.push(("four .hgt.zip", tiles.clone(), false));
    cases.push(("four .hgt.zip, de-stepped", tiles, true));
    cases.push(("two .asc", vec![path("grid.asc"), path("east.asc")], false));

    // What several threads hold at once is counted where there is one.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    for (name, inputs, destep) in &cases {
        let [held, said] = pool.install(|| held_and_said(inputs, *destep));
        eprintln!("{name}: holds {held}, says {said} bytes");
        assert!(
            held <= said + SLACK_BYTES,
            "{name}: holds {held}, says {said} bytes"
        );
        assert!(
            said <= 2 * held + (4 << 20),
            "{name}: holds {held}, says {said} bytes"
        );
    }
    // A control: were half of one strip left out, that would be told.
    let [held, said] = pool.install(|| held_and_said(&[path("one strip.tif")], false));
    assert!(held > said / 2 + SLACK_BYTES, "holds {held}, says {said} bytes");
}
