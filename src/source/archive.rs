//! DEMs packed in `.zip` or `.gz`: what they hold, unpacked into memory when it is first read.
//!
//! Nothing is taken for what an archive claims beyond what its packed bytes can hold ([`MAX_COMPRESSION`]); checksums
//! are checked. What a ZIP archive stores without compression is read where it stands.

use std::io::{self, BufReader, Read};
use std::sync::{Arc, Mutex};

use flate2::read::MultiGzDecoder;
use zip::{CompressionMethod, ZipArchive};

use super::held::{MAX_COMPRESSION, filled};
use super::{Cursor, ReadAt};
use crate::error::{Error, ErrorKind, Result};

/// The most files of an archive that are looked at.
const MAX_ENTRIES: usize = 1 << 16;

/// How an archive begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Packing {
    Zip,
    Gzip,
}

impl Packing {
    /// The packing of a file that begins with `head`, if it is one.
    pub(super) fn of(head: &[u8]) -> Option<Self> {
        match head {
            [b'P', b'K', 3, 4, ..] | [b'P', b'K', 5, 6, ..] => Some(Self::Zip),
            [0x1f, 0x8b, ..] => Some(Self::Gzip),
            _ => None,
        }
    }
}

/// An open ZIP archive.
pub(super) struct Zip {
    name: String,
    bytes: Arc<dyn ReadAt>,
    entries: Vec<Entry>,
}

/// A file in an archive.
#[derive(Clone, Debug)]
struct Entry {
    name: String,
    index: usize,
}

fn broken(name: &str, what: impl std::fmt::Display) -> Error {
    Error::new(ErrorKind::Broken, name, what).advice("fetch the file again")
}

fn refused(name: &str, error: zip::result::ZipError) -> Error {
    use zip::result::ZipError;
    match error {
        ZipError::Io(error) if error.kind() != io::ErrorKind::UnexpectedEof => unpacking(name, error),
        ZipError::UnsupportedArchive(what) => {
            let what = format!("is packed in a way that is not read: {what}");
            Error::new(ErrorKind::Unsupported, name, what).advice("unpack it first")
        }
        other => broken(name, format!("is a damaged ZIP archive: {other}")).because(other),
    }
}

/// What is wrong where unpacking met `error`: the decoders tell damage in several ways.
fn unpacking(name: &str, error: io::Error) -> Error {
    match error.kind() {
        io::ErrorKind::UnexpectedEof
        | io::ErrorKind::InvalidData
        | io::ErrorKind::InvalidInput
        | io::ErrorKind::Other => broken(name, format!("cannot be unpacked: {error}")).because(error),
        _ => Error::io(name, error),
    }
}

impl Zip {
    /// Opens the archive `name`.
    pub(super) fn open(name: &str, bytes: Arc<dyn ReadAt>) -> Result<Self> {
        let archive = archive(name, &bytes)?;
        if archive.len() > MAX_ENTRIES {
            let what = format!("holds {} files, more than {MAX_ENTRIES}", archive.len());
            return Err(Error::new(ErrorKind::Limit, name, what).advice("unpack it first"));
        }
        let mut entries = Vec::new();
        for index in 0..archive.len() {
            let file = archive
                .name_for_index(index)
                .transpose()
                .map_err(|e| refused(name, e))?;
            match file {
                Some(file) if !file.ends_with('/') => entries.push(Entry {
                    name: file.into_owned(),
                    index,
                }),
                _ => {}
            }
        }
        entries.sort_by(|a, b| a.name.cmp(&b.name));
        Ok(Self {
            name: name.into(),
            bytes,
            entries,
        })
    }

    /// The names of its files, sorted.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.entries.iter().map(|e| e.name.as_str())
    }

    /// The bytes of the file `entry`; none where there is no such file, whatever its letters' case.
    ///
    /// # Errors
    /// Where it is damaged, encrypted, packed in a way that is not read, or claims what it cannot hold.
    pub(super) fn file(&self, entry: &str) -> Result<Option<Arc<dyn ReadAt>>> {
        let found = self.entries.iter().find(|e| e.name == entry);
        let Some(found) = found.or_else(|| self.entries.iter().find(|e| e.name.eq_ignore_ascii_case(entry)))
        else {
            return Ok(None);
        };
        let mut archive = archive(&self.name, &self.bytes)?;
        let file = archive
            .by_index(found.index)
            .map_err(|e| refused(&self.name, e))?;
        let (size, packed) = (file.size(), file.compressed_size());
        match file.compression() {
            CompressionMethod::Stored => {
                let start = file
                    .data_start()
                    .ok_or_else(|| broken(&self.name, "is a damaged ZIP archive"))?;
                let inside = start
                    .checked_add(size)
                    .is_some_and(|end| end <= self.bytes.size_bytes());
                if size != packed || !inside {
                    return Err(broken(
                        &self.name,
                        format!("its file {entry} reaches beyond the archive's end"),
                    ));
                }
                Ok(Some(Arc::new(Slice {
                    bytes: self.bytes.clone(),
                    start,
                    size,
                })))
            }
            CompressionMethod::Deflated => {
                if packed > self.bytes.size_bytes() {
                    return Err(broken(
                        &self.name,
                        format!("its file {entry} reaches beyond the archive's end"),
                    ));
                }
                check_ratio(&self.name, size, packed)?;
                Ok(Some(Arc::new(Deflated {
                    name: self.name.clone(),
                    bytes: self.bytes.clone(),
                    index: found.index,
                    size,
                    unpacked: Mutex::new(None),
                })))
            }
            other => {
                let what = format!("packs {entry} in a way that is not read ({other})");
                Err(Error::new(ErrorKind::Unsupported, &self.name, what).advice("unpack it first"))
            }
        }
    }
}

fn archive(name: &str, bytes: &Arc<dyn ReadAt>) -> Result<ZipArchive<BufReader<Cursor>>> {
    ZipArchive::new(BufReader::new(Cursor::new(bytes.clone()))).map_err(|e| refused(name, e))
}

fn check_ratio(name: &str, size: u64, packed: u64) -> Result<()> {
    if u128::from(size) > u128::from(packed) * u128::from(MAX_COMPRESSION) {
        let what = format!("claims to unpack from {packed} to {size} bytes, which no packing does");
        return Err(Error::new(ErrorKind::Limit, name, what).advice("check that the file is whole"));
    }
    Ok(())
}

/// A part of other bytes.
struct Slice {
    bytes: Arc<dyn ReadAt>,
    start: u64,
    size: u64,
}

impl ReadAt for Slice {
    fn size_bytes(&self) -> u64 {
        self.size
    }

    fn held_bytes(&self) -> u64 {
        self.bytes.held_bytes()
    }

    fn read_exact_at(&self, offset: u64, out: &mut [u8]) -> io::Result<()> {
        let end = offset.checked_add(out.len() as u64);
        if end.is_none_or(|end| end > self.size) {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        self.bytes.read_exact_at(self.start + offset, out)
    }
}

/// A file of an archive, unpacked when it is first read.
struct Deflated {
    name: String,
    bytes: Arc<dyn ReadAt>,
    index: usize,
    size: u64,
    unpacked: Mutex<Option<Arc<Vec<u8>>>>,
}

impl Deflated {
    fn unpack(&self) -> Result<Vec<u8>> {
        let size = usize::try_from(self.size).unwrap_or(usize::MAX);
        let mut out = filled(&self.name, size, 0u8)?;
        let mut archive = archive(&self.name, &self.bytes)?;
        let mut file = archive.by_index(self.index).map_err(|e| refused(&self.name, e))?;
        file.read_exact(&mut out).map_err(|e| unpacking(&self.name, e))?;
        // The checksum is compared at the end, which must be here.
        match file.read(&mut [0]).map_err(|e| unpacking(&self.name, e))? {
            0 => Ok(out),
            _ => Err(broken(&self.name, "unpacks to more than it claims")),
        }
    }
}

impl ReadAt for Deflated {
    fn size_bytes(&self) -> u64 {
        self.size
    }

    fn held_bytes(&self) -> u64 {
        self.size + self.bytes.held_bytes()
    }

    fn read_exact_at(&self, offset: u64, out: &mut [u8]) -> io::Result<()> {
        // Nobody who panicked has left half of an unpacked file here.
        let mut unpacked = self
            .unpacked
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner);
        let all = match &*unpacked {
            Some(all) => all.clone(),
            None => {
                let kind = |error: &Error| match error.kind() {
                    ErrorKind::Limit => io::ErrorKind::OutOfMemory,
                    ErrorKind::Unsupported => io::ErrorKind::Unsupported,
                    _ => io::ErrorKind::InvalidData,
                };
                let all = self
                    .unpack()
                    .map_err(|e| io::Error::new(kind(&e), e.what().to_string()))?;
                unpacked.insert(Arc::new(all)).clone()
            }
        };
        drop(unpacked);
        all.read_exact_at(offset, out)
    }
}

/// Unpacks the `.gz` file `name`, which does not tell how long it will be.
///
/// # Errors
/// Where it is damaged.
pub(super) fn gunzip(name: &str, bytes: Arc<dyn ReadAt>) -> Result<Arc<dyn ReadAt>> {
    let packed = bytes.size_bytes();
    // The last four bytes are the length modulo 2^32 (RFC 1952, section 2.3.1), of the last member if there are many.
    let mut trailer = [0; 4];
    bytes
        .read_exact_at(packed.saturating_sub(4), &mut trailer)
        .map_err(|error| Error::io(name, error))?;
    let told = u64::from(u32::from_le_bytes(trailer));
    let mut out = Vec::new();
    if told <= packed.saturating_mul(MAX_COMPRESSION) {
        let reserved = out.try_reserve_exact(usize::try_from(told).unwrap_or(usize::MAX));
        reserved.map_err(|error| {
            let what = format!("needs {told} bytes of memory to unpack, which are not there");
            Error::new(ErrorKind::Limit, name, what).because(error)
        })?;
    }
    let most = packed.saturating_mul(MAX_COMPRESSION);
    let decoder = MultiGzDecoder::new(BufReader::new(Cursor::new(bytes)));
    let mut decoder = decoder.take(most.saturating_add(1));
    decoder.read_to_end(&mut out).map_err(|e| unpacking(name, e))?;
    check_ratio(name, out.len() as u64, packed)?;
    Ok(Arc::new(Unpacked(out)))
}

/// An unpacked file.
struct Unpacked(Vec<u8>);

impl ReadAt for Unpacked {
    fn size_bytes(&self) -> u64 {
        self.0.size_bytes()
    }

    fn held_bytes(&self) -> u64 {
        self.0.capacity() as u64
    }

    fn read_exact_at(&self, offset: u64, out: &mut [u8]) -> io::Result<()> {
        self.0.read_exact_at(offset, out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;
    use zip::write::{SimpleFileOptions, ZipWriter};

    fn zipped(files: &[(&str, &[u8])], method: CompressionMethod) -> Vec<u8> {
        let mut writer = ZipWriter::new(io::Cursor::new(Vec::new()));
        for (name, data) in files {
            let options = SimpleFileOptions::default().compression_method(method);
            writer.start_file(*name, options).unwrap();
            writer.write_all(data).unwrap();
        }
        writer.finish().unwrap().into_inner()
    }

    fn gzipped(data: &[u8]) -> Vec<u8> {
        let mut writer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
        writer.write_all(data).unwrap();
        writer.finish().unwrap()
    }

    fn all(bytes: &dyn ReadAt) -> io::Result<Vec<u8>> {
        let mut out = vec![0; bytes.size_bytes() as usize];
        bytes.read_exact_at(0, &mut out).map(|()| out)
    }

    fn data() -> Vec<u8> {
        (0..5000u32).map(|i| (i / 7 % 251) as u8).collect()
    }

    #[test]
    fn stored_and_deflated_files_come_out_whole() {
        let data = data();
        for method in [CompressionMethod::Stored, CompressionMethod::Deflated] {
            let bytes = zipped(&[("b/A.bil", &data), ("a.txt", b"text")], method);
            let zip = Zip::open("t.zip", Arc::new(bytes)).unwrap();
            assert_eq!(zip.names().collect::<Vec<_>>(), ["a.txt", "b/A.bil"]);
            let file = zip.file("b/a.BIL").unwrap().unwrap();
            assert_eq!(all(file.as_ref()).unwrap(), data);
            assert!(file.read_exact_at(4999, &mut [0; 2]).is_err());
            assert!(zip.file("c").unwrap().is_none());
        }
        let double = [gzipped(&data), gzipped(b"more")].concat();
        assert_eq!(
            all(gunzip("t.gz", Arc::new(double)).unwrap().as_ref()).unwrap(),
            [&data[..], b"more"].concat()
        );
    }

    #[test]
    fn damage_anywhere_is_told_and_never_read() {
        let data = data();
        let whole = zipped(&[("a.bil", &data)], CompressionMethod::Deflated);
        let mut caught = 0;
        for at in 0..whole.len() {
            let mut bytes = whole.clone();
            bytes[at] ^= 0x55;
            let read = Zip::open("t.zip", Arc::new(bytes)).and_then(|zip| {
                let file = zip.file("a.bil")?;
                file.map(|f| all(f.as_ref()).map_err(|e| Error::io("t.zip", e)))
                    .transpose()
            });
            match read {
                Err(_) | Ok(None) => caught += 1,
                // Dates, attributes and the like.
                Ok(Some(out)) => assert_eq!(out, data, "byte {at}"),
            }
        }
        assert!(caught > whole.len() / 2, "{caught} of {}", whole.len());
        let whole = gzipped(&data);
        for at in 10..whole.len() {
            let mut bytes = whole.clone();
            bytes[at] ^= 0x55;
            assert!(gunzip("t.gz", Arc::new(bytes)).is_err(), "byte {at}");
            assert!(
                gunzip("t.gz", Arc::new(whole[..at].to_vec())).is_err(),
                "cut at {at}"
            );
        }
    }

    #[test]
    fn claims_beyond_all_packing_are_refused() {
        let mut bytes = zipped(&[("a.bil", &[7; 4000])], CompressionMethod::Deflated);
        // The unpacked length stands 24 bytes into the entry of the central directory (APPNOTE.TXT, 4.3.12).
        let entry = bytes.windows(4).position(|w| w == b"PK\x01\x02").unwrap();
        bytes[entry + 24..entry + 28].copy_from_slice(&0x7fff_ffffu32.to_le_bytes());
        let zip = Zip::open("t.zip", Arc::new(bytes)).unwrap();
        assert_eq!(zip.file("a.bil").err().unwrap().kind(), ErrorKind::Limit);
    }
}
