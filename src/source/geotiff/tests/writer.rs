//! A writer of TIFFs of every layout that is read, for tests: plain, and without any code of the reader.

use std::io::Write;

use half::f16;
use weezl::BitOrder;

/// A tag: number, type, values as whole numbers or doubles.
pub(super) type Tag = (u16, u16, Vec<f64>);

/// An image to be written. `value` gives a sample by band, column and row.
#[derive(Clone)]
pub(super) struct Image {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) bands: usize,
    pub(super) separate: bool,
    /// SampleFormat: 1 whole, 2 signed, 3 float.
    pub(super) format: u16,
    pub(super) bits: usize,
    pub(super) compression: u16,
    pub(super) predictor: u16,
    /// Columns and rows of a tile; strips of some rows where the first is 0.
    pub(super) block: [usize; 2],
    /// Blocks that are not stored.
    pub(super) left_out: Vec<usize>,
    pub(super) tags: Vec<Tag>,
    pub(super) value: fn(usize, usize, usize) -> f64,
}

impl Image {
    pub(super) fn new(width: usize, height: usize, format: u16, bits: usize) -> Self {
        Self {
            width,
            height,
            bands: 1,
            separate: false,
            format,
            bits,
            compression: 1,
            predictor: 1,
            block: [0, height],
            left_out: Vec::new(),
            tags: Vec::new(),
            value: |_, x, z| (x * 7 + z * 31) as f64,
        }
    }

    /// The same with a text tag.
    pub(super) fn text(mut self, tag: u16, text: &str) -> Self {
        let bytes = text.bytes().chain([0]).map(f64::from).collect();
        self.tags.push((tag, 2, bytes));
        self
    }

    fn sample(&self, band: usize, x: usize, z: usize, big: bool) -> Vec<u8> {
        let value = (self.value)(band, x, z);
        let mut bytes = match (self.format, self.bits) {
            (3, 16) => f16::from_f64(value).to_le_bytes().to_vec(),
            (3, 32) => (value as f32).to_le_bytes().to_vec(),
            (3, _) => value.to_le_bytes().to_vec(),
            (_, bits) => (value as i64).to_le_bytes()[..bits / 8].to_vec(),
        };
        if big {
            bytes.reverse();
        }
        bytes
    }

    /// A stored row: its samples after the predictor.
    fn row(&self, bands: &[usize], xs: std::ops::Range<usize>, z: usize, big: bool) -> Vec<u8> {
        let place = |x: usize| (x.min(self.width - 1), z.min(self.height - 1));
        if ![8, 16, 32, 64].contains(&self.bits) {
            let mut bits = Vec::new();
            for x in xs {
                let (x, z) = place(x);
                let value = (self.value)(bands[0], x, z) as u64;
                bits.extend((0..self.bits).rev().map(|bit| (value >> bit & 1) as u8));
            }
            let bytes = bits.chunks(8).map(|bits| {
                let shifted = bits.iter().enumerate().map(|(i, bit)| bit << (7 - i));
                shifted.sum::<u8>()
            });
            return bytes.collect();
        }
        let mut samples: Vec<Vec<u8>> = Vec::new();
        for x in xs {
            let (x, z) = place(x);
            // Predictor 3 stores the greatest byte first, whatever the order of the file.
            samples.extend(
                bands
                    .iter()
                    .map(|b| self.sample(*b, x, z, big || self.predictor == 3)),
            );
        }
        let step = bands.len();
        match self.predictor {
            2 => {
                let number = |bytes: &[u8]| {
                    let add = |sum: u64, byte: &u8| sum << 8 | u64::from(*byte);
                    match big {
                        true => bytes.iter().fold(0, add),
                        false => bytes.iter().rev().fold(0, add),
                    }
                };
                for i in (step..samples.len()).rev() {
                    let difference = number(&samples[i]).wrapping_sub(number(&samples[i - step]));
                    let n = samples[i].len();
                    let mut bytes = difference.to_le_bytes()[..n].to_vec();
                    if big {
                        bytes.reverse();
                    }
                    samples[i] = bytes;
                }
                samples.concat()
            }
            3 => {
                let planes = 0..self.bits / 8;
                let mut row: Vec<u8> = planes.flat_map(|p| samples.iter().map(move |s| s[p])).collect();
                for i in (step..row.len()).rev() {
                    row[i] = row[i].wrapping_sub(row[i - step]);
                }
                row
            }
            _ => samples.concat(),
        }
    }

    fn blocks(&self, big: bool) -> Vec<Vec<u8>> {
        let tiled = self.block[0] > 0;
        let (columns, rows) = if tiled {
            (self.block[0], self.block[1])
        } else {
            (self.width, self.block[1])
        };
        let planes: Vec<Vec<usize>> = match self.separate {
            true => (0..self.bands).map(|b| vec![b]).collect(),
            false => vec![(0..self.bands).collect()],
        };
        let mut blocks = Vec::new();
        for plane in planes {
            for z in (0..self.height).step_by(rows) {
                for x in (0..self.width).step_by(columns) {
                    let end = if tiled {
                        z + rows
                    } else {
                        (z + rows).min(self.height)
                    };
                    let raw: Vec<u8> = (z..end)
                        .flat_map(|z| self.row(&plane, x..x + columns, z, big))
                        .collect();
                    blocks.push(compress(self.compression, &raw));
                }
            }
        }
        for index in &self.left_out {
            blocks[*index].clear();
        }
        blocks
    }
}

fn compress(compression: u16, raw: &[u8]) -> Vec<u8> {
    match compression {
        1 => raw.to_vec(),
        5 => weezl::encode::Encoder::with_tiff_size_switch(BitOrder::Msb, 8)
            .encode(raw)
            .unwrap(),
        8 | 32946 => {
            let mut stream = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
            stream.write_all(raw).unwrap();
            stream.finish().unwrap()
        }
        32773 => raw
            .chunks(100)
            .flat_map(|part| [&[part.len() as u8 - 1], part].concat())
            .collect(),
        50000 => ruzstd::encoding::compress_to_vec(raw, ruzstd::encoding::CompressionLevel::Fastest),
        _ => raw.to_vec(),
    }
}

/// A file of images, one directory after the other.
pub(super) fn write(images: &[Image], big: bool, bigtiff: bool) -> Vec<u8> {
    let bytes = |value: u64, n: usize| {
        let mut bytes = value.to_le_bytes()[..n].to_vec();
        if big {
            bytes.reverse();
        }
        bytes
    };
    let word = if bigtiff { 8 } else { 4 };
    let mut out = if big { b"MM".to_vec() } else { b"II".to_vec() };
    out.extend(bytes(if bigtiff { 43 } else { 42 }, 2));
    if bigtiff {
        out.extend([bytes(8, 2), bytes(0, 2)].concat());
    }
    let mut link = out.len();
    out.extend(bytes(0, word));
    for image in images {
        let (mut offsets, mut counts) = (Vec::new(), Vec::new());
        for block in image.blocks(big) {
            offsets.push(if block.is_empty() { 0.0 } else { out.len() as f64 });
            counts.push(block.len() as f64);
            out.extend(block);
        }
        let n = image.bands;
        let long = if bigtiff { 16 } else { 4 };
        let mut tags: Vec<Tag> = vec![
            (256, 4, vec![image.width as f64]),
            (257, 3, vec![image.height as f64]),
            (258, 3, vec![image.bits as f64; n]),
            (259, 3, vec![image.compression.into()]),
            (262, 3, vec![1.0]),
            (277, 3, vec![n as f64]),
            (284, 3, vec![if image.separate { 2.0 } else { 1.0 }]),
            (317, 3, vec![image.predictor.into()]),
            (339, 3, vec![image.format.into(); n]),
        ];
        if image.block[0] > 0 {
            tags.push((322, 3, vec![image.block[0] as f64]));
            tags.push((323, 3, vec![image.block[1] as f64]));
            tags.extend([(324, long, offsets), (325, long, counts)]);
        } else {
            tags.push((278, 4, vec![image.block[1] as f64]));
            tags.extend([(273, long, offsets), (279, long, counts)]);
        }
        tags.extend(image.tags.clone());
        tags.sort_by_key(|tag| tag.0);
        let mut entries = Vec::new();
        for (tag, kind, values) in &tags {
            let each = match kind {
                1 | 2 => 1,
                3 => 2,
                4 => 4,
                _ => 8,
            };
            let stored: Vec<u8> = values
                .iter()
                .flat_map(|v| bytes(if *kind == 12 { v.to_bits() } else { *v as u64 }, each))
                .collect();
            entries.extend([bytes((*tag).into(), 2), bytes((*kind).into(), 2)].concat());
            entries.extend(bytes(values.len() as u64, word));
            let mut inline = stored.clone();
            if stored.len() > word {
                inline = bytes(out.len() as u64, word);
                out.extend(stored);
            }
            inline.resize(word, 0);
            entries.extend(inline);
        }
        let here = bytes(out.len() as u64, word);
        out[link..link + word].copy_from_slice(&here);
        out.extend(bytes(tags.len() as u64, if bigtiff { 8 } else { 2 }));
        out.extend(entries);
        link = out.len();
        out.extend(bytes(0, word));
    }
    out
}
