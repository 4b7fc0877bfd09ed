//! How an image lies in its file: size, type of samples, and its blocks, which are strips or tiles.
//!
//! A block is what is decoded at once. Strips that are not compressed are taken a few rows at once instead, whatever
//! their own height, so that a strip that holds a whole image costs no more memory than a small one.

use super::codec::Compression;
use super::ifd::{self, Directory, File, Order};
use crate::error::{Error, ErrorKind, Result};
use crate::grid::MAX_SIZE;

/// The bytes of strips without compression that are taken at once.
const GROUP_BYTES: i64 = 1 << 20;

/// A type of samples once they are unpacked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    U64,
    I64,
    F16,
    F32,
    F64,
}

impl Kind {
    /// Bytes of a sample.
    pub(super) fn bytes(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 | Self::F16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::U64 | Self::I64 | Self::F64 => 8,
        }
    }

    /// Whether samples are whole numbers.
    pub(super) fn integer(self) -> bool {
        !matches!(self, Self::F16 | Self::F32 | Self::F64)
    }

    /// Whether samples may have more bits than f32 holds.
    pub(super) fn wide(self) -> bool {
        matches!(self, Self::U32 | Self::I32 | Self::U64 | Self::I64 | Self::F64)
    }
}

/// How the band that is read lies in its file.
#[derive(Debug)]
pub(super) struct Layout {
    /// Columns and rows of the image.
    pub(super) width: i64,
    pub(super) height: i64,
    /// Columns and rows of a block.
    pub(super) block_width: i64,
    pub(super) block_height: i64,
    /// Whether a block is some rows of strips without compression, each of which is stored.
    pub(super) grouped: bool,
    /// Rows of a strip or tile as it is stored.
    pub(super) stored_rows: i64,
    pub(super) tiled: bool,
    pub(super) kind: Kind,
    /// Bits of a stored sample: those of `kind`, or fewer.
    pub(super) bits: u16,
    pub(super) order: Order,
    pub(super) compression: Compression,
    /// Whether the bits of what is stored stand in reverse within each byte.
    pub(super) reversed_bits: bool,
    /// 1 none, 2 horizontal differences, 3 differences of floats byte by byte.
    pub(super) predictor: u64,
    /// Samples of a stored pixel side by side, and which of them is read.
    pub(super) interleaved: usize,
    pub(super) band: usize,
    /// Offset and length of each strip or tile of the band.
    offsets: Vec<u64>,
    counts: Vec<u64>,
}

impl Layout {
    /// The most that decoding a block takes beside its samples of the band, in bytes: what is stored, and all of its
    /// samples where those of the band are picked from among them.
    pub(super) fn decoding_bytes(&self) -> u64 {
        let stored = self.counts.iter().copied().max().unwrap_or(0);
        let rows = if self.grouped {
            self.block_height
        } else {
            self.stored_rows
        };
        let all = self.row_bytes() * rows.min(self.height) as u64;
        let band = self.interleaved == 1 && usize::from(self.bits) == 8 * self.kind.bytes();
        match self.compression {
            Compression::None if band => 0,
            Compression::None => all,
            _ if band => stored.min(2 * all),
            _ => stored.min(2 * all) + all,
        }
    }

    /// Reads how band `band`, counted from 0, of the image of `directory` is stored.
    ///
    /// # Errors
    /// Where its tags contradict each other, are beyond the file, or say what is not read here.
    pub(super) fn read(file: &File, directory: &Directory, band: u64) -> Result<Self> {
        let scalar = |tag, default| file.scalar(directory, tag, default);
        let size = |tag, what: &str| {
            let side = scalar(tag, None)?;
            if (1..=MAX_SIZE as u64).contains(&side) {
                return Ok(side as i64);
            }
            let kind = if side == 0 {
                ErrorKind::Broken
            } else {
                ErrorKind::Limit
            };
            let found = format!("has {side} {what}; 1 to {MAX_SIZE} are read");
            Err(Error::new(kind, &file.name, found))
        };
        let (width, height) = (size(ifd::WIDTH, "columns")?, size(ifd::HEIGHT, "rows")?);
        let bands = scalar(ifd::BANDS, Some(1))?;
        if band >= bands {
            return Err(file.broken(format!(
                "has an image of {bands} bands, and band {} is read",
                band + 1
            )));
        }
        let (kind, bits) = sample_type(file, directory, bands)?;
        let compression = Compression::of(file, directory, scalar(ifd::COMPRESSION, Some(1))?)?;
        check_colours(file, scalar(ifd::PHOTOMETRIC, Some(1))?)?;
        let predictor = match compression.is_predicted() {
            true => scalar(ifd::PREDICTOR, Some(1))?,
            false => 1, // libtiff, and so every writer of note, knows it for these compressions alone
        };
        check_predictor(file, predictor, kind, bits)?;
        let separate = scalar(ifd::PLANAR, Some(1))? == 2 && bands > 1;

        let tiled = directory.has(ifd::TILE_OFFSETS) || directory.has(ifd::TILE_WIDTH);
        let (block_width, stored_rows) = if tiled {
            (
                size(ifd::TILE_WIDTH, "columns a tile")?,
                size(ifd::TILE_HEIGHT, "rows a tile")?,
            )
        } else {
            let rows = scalar(ifd::ROWS_PER_STRIP, Some(u64::MAX))?;
            if rows == 0 {
                return Err(file.broken("has strips of no rows"));
            }
            (width, rows.min(height as u64) as i64)
        };
        let blocks =
            (width as u64).div_ceil(block_width as u64) * (height as u64).div_ceil(stored_rows as u64);
        let mut layout = Self {
            width,
            height,
            block_width,
            block_height: stored_rows,
            grouped: false,
            stored_rows,
            tiled,
            kind,
            bits,
            order: file.order,
            compression,
            reversed_bits: scalar(ifd::FILL_ORDER, Some(1))? == 2,
            predictor,
            interleaved: if separate { 1 } else { bands as usize },
            band: if separate { 0 } else { band as usize },
            offsets: Vec::new(),
            counts: Vec::new(),
        };
        let first = if separate { band * blocks } else { 0 };
        layout.read_tables(file, directory, first, blocks)?;
        layout.group();
        Ok(layout)
    }

    /// Reads offsets and lengths of `blocks` blocks from block `first` on.
    fn read_tables(&mut self, file: &File, directory: &Directory, first: u64, blocks: u64) -> Result<()> {
        let [offsets, counts, what] = if self.tiled {
            [ifd::TILE_OFFSETS, ifd::TILE_BYTES, 0]
        } else {
            [ifd::STRIP_OFFSETS, ifd::STRIP_BYTES, 1]
        };
        let what = ["tiles", "strips"][usize::from(what)];
        let end = first.saturating_add(blocks);
        let tail = |mut all: Vec<u64>| all.split_off(all.len().min(first as usize));
        let listed = file.whole(directory, offsets, end)?.map(tail).unwrap_or_default();
        if listed.len() as u64 != blocks {
            let what = format!("lists {} {what} where its size asks for {blocks}", listed.len());
            return Err(file.broken(what));
        }
        self.offsets = listed;
        self.counts = match file.whole(directory, counts, end)? {
            Some(counts) => {
                // As libtiff has it, a length that is not listed is 0: such a block is not stored.
                let mut counts = tail(counts);
                counts.resize(blocks as usize, 0);
                counts
            }
            // Not known: whatever the block may need, up to the end of the file.
            None => vec![u64::MAX; blocks as usize],
        };
        if !self.tiled && self.compression == Compression::None {
            // Nor is the length of a single strip without compression of use; many files have it wrong.
            if let [count] = &mut self.counts[..]
                && self.offsets[0] != 0
            {
                *count = u64::MAX;
            }
        }
        let unknown = self.offsets.iter().zip(&mut self.counts);
        for (offset, count) in unknown.filter(|(_, count)| **count == u64::MAX) {
            // A length of 0 would stand for a block that is left out.
            if *offset >= file.size_bytes {
                let what = format!(
                    "has {what} at byte {offset}, but it is {} bytes long",
                    file.size_bytes
                );
                return Err(file.broken(what));
            }
            *count = file.size_bytes - *offset;
        }
        Ok(())
    }

    /// Takes strips without compression some rows at once, where all of them are stored.
    fn group(&mut self) {
        let stored = (0..self.offsets.len()).all(|block| self.stored(block).is_some());
        if !self.tiled && self.compression == Compression::None && stored {
            let rows = GROUP_BYTES / (self.row_bytes().min(GROUP_BYTES as u64) as i64).max(1);
            self.block_height = rows.clamp(1, self.height);
            self.grouped = true;
        }
    }

    /// Bytes of a row of a stored block.
    pub(super) fn row_bytes(&self) -> u64 {
        let bits = self.block_width as u64 * self.interleaved as u64 * u64::from(self.bits);
        bits.div_ceil(8)
    }

    /// Blocks side by side.
    pub(super) fn across(&self) -> i64 {
        (self.width + self.block_width - 1) / self.block_width
    }

    /// Blocks one below the other.
    pub(super) fn down(&self) -> i64 {
        (self.height + self.block_height - 1) / self.block_height
    }

    /// Offset and length of a stored strip or tile; none where the file leaves it out.
    pub(super) fn stored(&self, index: usize) -> Option<(u64, u64)> {
        let (offset, count) = (self.offsets[index], self.counts[index]);
        (offset != 0 && count != 0).then_some((offset, count))
    }

    /// Columns and rows of the image that a block holds.
    pub(super) fn held(&self, column: i64, row: i64) -> [i64; 2] {
        [
            self.block_width.min(self.width - column * self.block_width),
            self.block_height.min(self.height - row * self.block_height),
        ]
    }
}

/// The type of samples, and the bits that each of them takes.
fn sample_type(file: &File, directory: &Directory, bands: u64) -> Result<(Kind, u16)> {
    let all = |tag, default| -> Result<u64> {
        let values = file
            .whole(directory, tag, bands.min(1 << 16))?
            .unwrap_or_default();
        let first = values.first().copied().unwrap_or(default);
        if values.iter().any(|v| *v != first) {
            return Err(file.unsupported("has bands of different types"));
        }
        Ok(first)
    };
    let (bits, format) = (all(ifd::BITS, 1)?, all(ifd::SAMPLE_FORMAT, 1)?);
    let kind = match (format, bits) {
        (1 | 4, 24) if file.order == Order::Big => {
            let what = "has whole numbers of 24 bits, greatest byte first, which programs read differently";
            return Err(file.unsupported(what));
        }
        (1 | 4, 1..=8) => Kind::U8,
        (1 | 4, 9..=16) => Kind::U16,
        (1 | 4, 17..=32) => Kind::U32,
        (1 | 4, 64) => Kind::U64,
        (2, 8) => Kind::I8,
        (2, 16) => Kind::I16,
        (2, 32) => Kind::I32,
        (2, 64) => Kind::I64,
        (3, 16) => Kind::F16,
        (3, 32) => Kind::F32,
        (3, 64) => Kind::F64,
        (5 | 6, _) => return Err(file.unsupported("has complex numbers, not heights")),
        (1..=4, _) => {
            let what = ["whole numbers", "signed numbers", "floats", "numbers"][format as usize - 1];
            return Err(file.unsupported(format!("has {what} of {bits} bits, which are not read")));
        }
        _ => return Err(file.unsupported(format!("has samples of the unknown format {format}"))),
    };
    Ok((kind, bits as u16))
}

/// Refuses images whose samples are no numbers to be taken as they are.
fn check_colours(file: &File, photometric: u64) -> Result<()> {
    match photometric {
        3 => Err(file.unsupported("has a palette of colours, not heights")),
        6 => Err(file.unsupported("has colours as YCbCr, not heights")),
        _ => Ok(()),
    }
}

fn check_predictor(file: &File, predictor: u64, kind: Kind, bits: u16) -> Result<()> {
    let whole = usize::from(bits) == 8 * kind.bytes();
    let refused = match predictor {
        1 => return Ok(()),
        2 if whole => return Ok(()),
        3 if whole && !kind.integer() => return Ok(()),
        2 => format!("has differences (predictor 2) of samples of {bits} bits"),
        3 => "has differences of floats (predictor 3) of samples that are no floats".into(),
        n => format!("has the unknown predictor {n}"),
    };
    Err(file.unsupported(refused))
}
