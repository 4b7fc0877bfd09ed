//! The structure of a TIFF file: header, directories, and the values of their tags (TIFF 6.0, section 2; BigTIFF).
//!
//! Read here and not through the `tiff` crate, which takes a directory and its image as one: it opens no file whose
//! image it cannot decode whole, takes the tables of blocks on the file's word, and hands a reader to one thread.

use std::io;
use std::sync::Arc;

use crate::error::{Error, ErrorKind, Result};
use crate::source::ReadAt;

/// The most tags of one directory.
const MAX_TAGS: u64 = 1 << 12;
/// The most bytes of a tag that places or describes an image.
const MAX_VALUE_BYTES: u64 = 4 << 20;

// Tags.
pub(super) const NEW_SUBFILE_TYPE: u16 = 254;
pub(super) const WIDTH: u16 = 256;
pub(super) const HEIGHT: u16 = 257;
pub(super) const BITS: u16 = 258;
pub(super) const COMPRESSION: u16 = 259;
pub(super) const PHOTOMETRIC: u16 = 262;
pub(super) const FILL_ORDER: u16 = 266;
pub(super) const STRIP_OFFSETS: u16 = 273;
pub(super) const BANDS: u16 = 277;
pub(super) const ROWS_PER_STRIP: u16 = 278;
pub(super) const STRIP_BYTES: u16 = 279;
pub(super) const PLANAR: u16 = 284;
pub(super) const PREDICTOR: u16 = 317;
pub(super) const TILE_WIDTH: u16 = 322;
pub(super) const TILE_HEIGHT: u16 = 323;
pub(super) const TILE_OFFSETS: u16 = 324;
pub(super) const TILE_BYTES: u16 = 325;
pub(super) const SAMPLE_FORMAT: u16 = 339;
pub(super) const PIXEL_SCALE: u16 = 33550;
pub(super) const TIE_POINTS: u16 = 33922;
pub(super) const TRANSFORMATION: u16 = 34264;
pub(super) const GEO_KEYS: u16 = 34735;
pub(super) const GEO_DOUBLES: u16 = 34736;
pub(super) const GEO_TEXTS: u16 = 34737;
pub(super) const GDAL_METADATA: u16 = 42112;
pub(super) const GDAL_NODATA: u16 = 42113;
pub(super) const LERC_PARAMETERS: u16 = 50674;

/// The order of the bytes of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    /// Least first, `II`.
    Little,
    /// Greatest first, `MM`.
    Big,
}

impl Order {
    fn number<const N: usize>(self, bytes: [u8; N]) -> u64 {
        let add = |sum: u64, byte: &u8| sum << 8 | u64::from(*byte);
        match self {
            Self::Little => bytes.iter().rev().fold(0, add),
            Self::Big => bytes.iter().fold(0, add),
        }
    }
}

/// A TIFF file whose header has been read.
#[derive(Clone)]
pub(super) struct File {
    /// The name by which messages speak of it.
    pub(super) name: String,
    bytes: Arc<dyn ReadAt>,
    /// Its length.
    pub(super) size_bytes: u64,
    pub(super) order: Order,
    big: bool,
}

/// One directory: the tags of one image.
#[derive(Clone, Debug)]
pub(super) struct Directory {
    entries: Vec<Entry>,
    /// Where the next directory stands; 0 after the last.
    pub(super) next: u64,
}

#[derive(Clone, Copy, Debug)]
struct Entry {
    tag: u16,
    kind: u16,
    count: u64,
    /// The value itself where it fits, else its offset; as it stands in the file, with what it lacks as 0.
    value: [u8; 8],
}

impl File {
    /// Bytes of memory that the file's own bytes take.
    pub(super) fn held_bytes(&self) -> u64 {
        self.bytes.held_bytes()
    }

    /// Reads the header of `bytes`; returns where the first directory stands as well.
    ///
    /// # Errors
    /// [`ErrorKind::Broken`] for what is no TIFF, [`ErrorKind::Io`] where it cannot be read.
    pub(super) fn open(name: &str, bytes: Arc<dyn ReadAt>) -> Result<(Self, u64)> {
        let mut file = Self {
            name: name.into(),
            size_bytes: bytes.size_bytes(),
            bytes,
            order: Order::Little,
            big: false,
        };
        let head: [u8; 4] = file.array(0)?;
        (file.order, file.big) = match &head {
            b"II*\0" => (Order::Little, false),
            b"MM\0*" => (Order::Big, false),
            b"II+\0" => (Order::Little, true),
            b"MM\0+" => (Order::Big, true),
            _ => return Err(file.broken("does not begin like a TIFF")),
        };
        let first = if file.big {
            let sizes = file.order.number(file.array::<4>(4)?);
            // The size of offsets, 8, and a 0.
            let wanted = match file.order {
                Order::Little => 8,
                Order::Big => 8 << 16,
            };
            if sizes != wanted {
                return Err(file.broken("is a BigTIFF whose offsets have no 64 bits"));
            }
            file.order.number(file.array::<8>(8)?)
        } else {
            file.order.number(file.array::<4>(4)?)
        };
        Ok((file, first))
    }

    /// The error that says what is wrong with the file.
    pub(super) fn broken(&self, what: impl std::fmt::Display) -> Error {
        Error::new(ErrorKind::Broken, &self.name, what)
            .advice("fetch the file again, or check that it is a TIFF")
    }

    /// The error that says what of the file is not read here.
    pub(super) fn unsupported(&self, what: impl std::fmt::Display) -> Error {
        Error::new(ErrorKind::Unsupported, &self.name, what)
    }

    /// Fills `out` from `offset` on.
    ///
    /// # Errors
    /// [`ErrorKind::Broken`] beyond the file's end, [`ErrorKind::Io`] where it cannot be read.
    pub(super) fn read(&self, offset: u64, out: &mut [u8]) -> Result<()> {
        let end = offset.checked_add(out.len() as u64);
        if end.is_none_or(|end| end > self.size_bytes) {
            return Err(Error::io(
                &self.name,
                io::Error::from(io::ErrorKind::UnexpectedEof),
            ));
        }
        self.bytes
            .read_exact_at(offset, out)
            .map_err(|error| Error::io(&self.name, error))
    }

    fn array<const N: usize>(&self, offset: u64) -> Result<[u8; N]> {
        let mut out = [0; N];
        self.read(offset, &mut out)?;
        Ok(out)
    }

    /// Reads the directory at `offset`.
    ///
    /// # Errors
    /// As [`File::read`]; [`ErrorKind::Limit`] for one of more tags than any image needs.
    pub(super) fn directory(&self, offset: u64) -> Result<Directory> {
        let (count, start, entry_bytes) = if self.big {
            (self.order.number(self.array::<8>(offset)?), 8, 20)
        } else {
            (self.order.number(self.array::<2>(offset)?), 2, 12)
        };
        if count > MAX_TAGS {
            let what = format!("has a directory of {count} tags, above {MAX_TAGS}");
            return Err(Error::new(ErrorKind::Limit, &self.name, what));
        }
        let start = offset + start;
        let mut table = vec![0; (count * entry_bytes) as usize];
        self.read(start, &mut table)?;
        let entries = table.chunks_exact(entry_bytes as usize).map(|bytes| {
            let (count, value) = bytes[4..].split_at(if self.big { 8 } else { 4 });
            let mut padded = [0; 8];
            padded[..value.len()].copy_from_slice(value);
            Entry {
                tag: self.order.number([bytes[0], bytes[1]]) as u16,
                kind: self.order.number([bytes[2], bytes[3]]) as u16,
                count: self.word(count),
                value: padded,
            }
        });
        let entries = entries.collect();
        let end = start + table.len() as u64;
        let next = match self.big {
            true => self.order.number(self.array::<8>(end)?),
            false => self.order.number(self.array::<4>(end)?),
        };
        Ok(Directory { entries, next })
    }

    /// A number of 4 or 8 bytes.
    fn word(&self, bytes: &[u8]) -> u64 {
        match *bytes {
            [a, b, c, d] => self.order.number([a, b, c, d]),
            [a, b, c, d, e, f, g, h] => self.order.number([a, b, c, d, e, f, g, h]),
            _ => 0,
        }
    }

    /// The first `most` values of `entry` as they stand in the file, and the bytes of one of them.
    fn values(&self, entry: &Entry, most: u64) -> Result<(Vec<u8>, usize)> {
        let each = match entry.kind {
            1 | 2 | 6 | 7 => 1,
            3 | 8 => 2,
            4 | 9 | 11 | 13 => 4,
            5 | 10 | 12 | 16 | 17 | 18 => 8,
            kind => return Err(self.broken(format!("has tag {} of the unknown type {kind}", entry.tag))),
        };
        let whole = entry.count.checked_mul(each);
        let inline = if self.big { 8 } else { 4 };
        let inline_value = whole.is_some_and(|bytes| bytes <= inline);
        let bytes = entry.count.min(most).saturating_mul(each);
        if inline_value {
            return Ok((entry.value[..bytes as usize].to_vec(), each as usize));
        }
        let offset = self.word(&entry.value[..inline as usize]);
        if bytes > self.size_bytes {
            let what = format!("has {} values of tag {}, beyond its end", entry.count, entry.tag);
            return Err(self.broken(what));
        }
        let mut out = vec![0; bytes as usize];
        self.read(offset, &mut out)?;
        Ok((out, each as usize))
    }

    /// The first `most` whole numbers of a tag; none where it is missing.
    ///
    /// # Errors
    /// Those of reading; [`ErrorKind::Broken`] where they are no whole numbers or negative.
    pub(super) fn whole(&self, directory: &Directory, tag: u16, most: u64) -> Result<Option<Vec<u64>>> {
        let Some(entry) = directory.entry(tag) else {
            return Ok(None);
        };
        let signed = matches!(entry.kind, 6 | 8 | 9 | 17);
        if !signed && !matches!(entry.kind, 1 | 3 | 4 | 7 | 13 | 16 | 18) {
            return Err(self.broken(format!("has tag {tag} of type {}, no whole number", entry.kind)));
        }
        let (bytes, each) = self.values(entry, most)?;
        let order = self.order;
        let out: Vec<u64> = match each {
            1 => bytes.iter().map(|b| u64::from(*b)).collect(),
            2 => bytes
                .as_chunks::<2>()
                .0
                .iter()
                .map(|b| order.number(*b))
                .collect(),
            4 => bytes
                .as_chunks::<4>()
                .0
                .iter()
                .map(|b| order.number(*b))
                .collect(),
            _ => bytes
                .as_chunks::<8>()
                .0
                .iter()
                .map(|b| order.number(*b))
                .collect(),
        };
        if signed && out.iter().any(|v| v >> (8 * each - 1) != 0) {
            return Err(self.broken(format!("has a negative value of tag {tag}")));
        }
        Ok(Some(out))
    }

    /// The one whole number of a tag, or `default` where it is missing.
    ///
    /// # Errors
    /// As [`File::whole`]; [`ErrorKind::Broken`] where it has another count of values, or is missing without a default.
    pub(super) fn scalar(&self, directory: &Directory, tag: u16, default: Option<u64>) -> Result<u64> {
        match (self.whole(directory, tag, 2)?.as_deref(), default) {
            (Some([value]), _) => Ok(*value),
            (Some(values), _) => {
                let what = ["no value", "several values"][values.len().min(1)];
                Err(self.broken(format!("has {what} of tag {tag}, where one belongs")))
            }
            (None, Some(default)) => Ok(default),
            (None, None) => Err(self.broken(format!("lacks tag {tag}"))),
        }
    }

    /// The numbers of a tag that places an image; none where it is missing.
    ///
    /// # Errors
    /// Those of reading; [`ErrorKind::Broken`] where they are no numbers, or too many.
    pub(super) fn reals(&self, directory: &Directory, tag: u16) -> Result<Option<Vec<f64>>> {
        let Some(entry) = directory.entry(tag) else {
            return Ok(None);
        };
        self.check_length(entry)?;
        let order = self.order;
        match entry.kind {
            12 => {
                let (bytes, _) = self.values(entry, u64::MAX)?;
                let all = bytes.as_chunks::<8>().0.iter();
                Ok(Some(all.map(|b| f64::from_bits(order.number(*b))).collect()))
            }
            11 => {
                let (bytes, _) = self.values(entry, u64::MAX)?;
                let all = bytes.as_chunks::<4>().0.iter();
                let single = |b: &[u8; 4]| f64::from(f32::from_bits(order.number(*b) as u32));
                Ok(Some(all.map(single).collect()))
            }
            _ => {
                let all = self.whole(directory, tag, u64::MAX)?;
                Ok(all.map(|v| v.iter().map(|v| *v as f64).collect()))
            }
        }
    }

    /// The text of a tag, up to its end or a first 0; none where it is missing, no text or cannot be read.
    pub(super) fn text(&self, directory: &Directory, tag: u16) -> Option<String> {
        let entry = directory.entry(tag).filter(|e| matches!(e.kind, 1 | 2 | 7))?;
        self.check_length(entry).ok()?;
        let (bytes, _) = self.values(entry, u64::MAX).ok()?;
        let end = bytes.iter().position(|b| *b == 0).unwrap_or(bytes.len());
        Some(String::from_utf8_lossy(&bytes[..end]).into_owned())
    }

    fn check_length(&self, entry: &Entry) -> Result<()> {
        if entry.count > MAX_VALUE_BYTES / 8 {
            let what = format!("has {} values of tag {}, which needs few", entry.count, entry.tag);
            return Err(Error::new(ErrorKind::Limit, &self.name, what));
        }
        Ok(())
    }
}

impl Directory {
    fn entry(&self, tag: u16) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.tag == tag)
    }

    /// Whether it has `tag`.
    pub(super) fn has(&self, tag: u16) -> bool {
        self.entry(tag).is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(bytes: &[u8]) -> Result<(File, u64)> {
        File::open("t.tif", Arc::new(bytes.to_vec()))
    }

    #[test]
    fn both_orders_and_both_kinds_of_header_are_read() {
        for (head, first) in [
            (&b"II*\0\x08\0\0\0"[..], 8),
            (b"MM\0*\0\0\0\x08", 8),
            (b"II+\0\x08\0\0\0\x10\0\0\0\0\0\0\0", 16),
            (b"MM\0+\0\x08\0\0\0\0\0\0\0\0\0\x10", 16),
        ] {
            assert_eq!(file(head).unwrap().1, first);
        }
        for bad in [
            &b""[..],
            b"II*\0",
            b"II*\0\x08\0",
            b"MM*\0\x08\0\0\0",
            b"II+\0\x04\0\0\0\x10\0\0\0\0\0\0\0",
        ] {
            assert_eq!(file(bad).err().unwrap().kind(), ErrorKind::Broken);
        }
    }

    #[test]
    fn values_are_read_in_place_and_elsewhere_and_never_beyond_the_end() {
        let mut bytes = b"II*\0\x08\0\0\0\x04\0".to_vec();
        bytes.extend(b"\x00\x01\x03\0\x01\0\0\0\x07\0\0\0"); // 256: SHORT 7
        bytes.extend(b"\x11\x01\x04\0\x02\0\0\0\x3e\0\0\0"); // 273: two LONG at 62
        bytes.extend(b"\x81\xa4\x02\0\x05\0\0\0\x46\0\0\0"); // 42113: five letters at 70
        bytes.extend(b"\x17\x01\x04\0\0\0\0\x7f\x3e\0\0\0"); // 279: 2^31 - 2^24 LONG
        bytes.extend([0; 4]);
        assert_eq!(bytes.len(), 62);
        bytes.extend(b"\x01\0\0\0\x02\0\0\0nan\0x");
        let (tiff, first) = file(&bytes).unwrap();
        let directory = tiff.directory(first).unwrap();
        assert_eq!(tiff.scalar(&directory, WIDTH, None).unwrap(), 7);
        assert_eq!(
            tiff.whole(&directory, STRIP_OFFSETS, 9).unwrap(),
            Some(vec![1, 2])
        );
        assert_eq!(tiff.whole(&directory, STRIP_OFFSETS, 1).unwrap(), Some(vec![1]));
        assert_eq!(tiff.text(&directory, GDAL_NODATA).unwrap(), "nan");
        assert_eq!(tiff.scalar(&directory, HEIGHT, Some(3)).unwrap(), 3);
        assert!(tiff.scalar(&directory, HEIGHT, None).is_err());
        assert!(
            tiff.scalar(&directory, STRIP_OFFSETS, None).is_err(),
            "two values"
        );
        assert!(tiff.whole(&directory, STRIP_BYTES, u64::MAX).is_err());
        assert!(tiff.reals(&directory, STRIP_BYTES).is_err());
        assert!(tiff.whole(&directory, GDAL_NODATA, 1).is_err());
        assert!(tiff.directory(1 << 40).is_err());
        assert!(tiff.directory(u64::MAX).is_err());
    }
}
