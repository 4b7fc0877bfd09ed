//! The compressions of TIFF, from the bytes of a block to those of its samples, through a library where there is one.
//!
//! LZW by weezl, deflate by flate2, zstd by ruzstd; PackBits (TIFF 6.0, section 9) is a loop; LERC has a file of its own.
//! JPEG and WebP lose exactness, LZMA is rare.

use std::io::Read;

use flate2::{Decompress, FlushDecompress, Status};
use weezl::{BitOrder, LzwStatus};

use super::ifd::{self, Directory, File};
use super::lerc::Around;
use crate::error::Result;

/// A compression that is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Compression {
    None,
    Lzw,
    Deflate,
    PackBits,
    Zstd,
    Lerc(Around),
}

impl Compression {
    /// The compression of that number, of an image of `directory`.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Unsupported`] for all others, by name where it is known.
    pub(super) fn of(file: &File, directory: &Directory, number: u64) -> Result<Self> {
        let name = match number {
            1 => return Ok(Self::None),
            5 => return Ok(Self::Lzw),
            8 | 32946 => return Ok(Self::Deflate),
            32773 => return Ok(Self::PackBits),
            50000 => return Ok(Self::Zstd),
            34887 => {
                let parameters = file
                    .whole(directory, ifd::LERC_PARAMETERS, 2)?
                    .unwrap_or_default();
                return match parameters.get(1) {
                    None | Some(0) => Ok(Self::Lerc(Around::Nothing)),
                    Some(1) => Ok(Self::Lerc(Around::Deflate)),
                    Some(2) => Ok(Self::Lerc(Around::Zstd)),
                    Some(n) => Err(file.unsupported(format!("has LERC data packed in the unknown way {n}"))),
                };
            }
            2..=4 => "fax",
            6 | 7 => "JPEG",
            34676 | 34677 => "SGI LogLuv",
            34712 => "JPEG 2000",
            34925 => "LZMA",
            50001 => "WebP",
            50002 => "JPEG XL",
            _ => "unknown here",
        };
        let what = format!("is compressed in a way that is not read (number {number}, {name})");
        Err(file
            .unsupported(what)
            .advice("compress it with deflate, as with gdal_translate -co COMPRESS=DEFLATE"))
    }

    /// Whether libtiff, and so every writer of note, knows predictors with it.
    pub(super) fn is_predicted(self) -> bool {
        matches!(self, Self::Lzw | Self::Deflate | Self::Zstd)
    }

    /// Unpacks `stored` until `out` is full. What follows is passed over, as in libtiff.
    ///
    /// # Errors
    /// A phrase, where `stored` is damaged or ends before `out` is full.
    pub(super) fn unpack(self, stored: &[u8], out: &mut [u8]) -> Result<(), String> {
        match self {
            Self::None => {
                let filled = stored.get(..out.len()).ok_or_else(|| short(stored.len(), out))?;
                out.copy_from_slice(filled);
                Ok(())
            }
            Self::Lzw => lzw(stored, out),
            Self::Deflate => deflate(stored, out),
            Self::PackBits => packbits(stored, out),
            Self::Zstd => zstd(stored, out),
            Self::Lerc(_) => Err("has LERC data, which are unpacked by what is known of them".into()),
        }
    }
}

fn short(filled: usize, out: &[u8]) -> String {
    format!("ends after {filled} of {} bytes", out.len())
}

fn deflate(stored: &[u8], out: &mut [u8]) -> Result<(), String> {
    let mut stream = Decompress::new(true);
    let status = stream.decompress(stored, out, FlushDecompress::Finish);
    match status {
        // The checksum behind the last byte is part of what is checked.
        Err(error) => Err(format!("has damaged deflate data: {error}")),
        Ok(_) if stream.total_out() == out.len() as u64 => Ok(()),
        Ok(Status::Ok | Status::BufError | Status::StreamEnd) => Err(short(stream.total_out() as usize, out)),
    }
}

fn lzw(stored: &[u8], out: &mut [u8]) -> Result<(), String> {
    let mut decoder = weezl::decode::Configuration::with_tiff_size_switch(BitOrder::Msb, 8)
        .with_yield_on_full_buffer(true)
        .build();
    let (mut input, mut filled) = (stored, 0);
    while filled < out.len() {
        let step = decoder.decode_bytes(input, &mut out[filled..]);
        input = &input[step.consumed_in..];
        filled += step.consumed_out;
        match step.status {
            Ok(LzwStatus::Ok) => {}
            Ok(LzwStatus::NoProgress | LzwStatus::Done) => break,
            Err(error) => return Err(format!("has damaged LZW data: {error}")),
        }
    }
    if filled == out.len() {
        Ok(())
    } else {
        Err(short(filled, out))
    }
}

fn packbits(stored: &[u8], out: &mut [u8]) -> Result<(), String> {
    let (mut input, mut filled) = (stored.iter().copied(), 0);
    while filled < out.len() {
        let Some(head) = input.next() else {
            return Err(short(filled, out));
        };
        let left = out.len() - filled;
        match head as i8 {
            -128 => {}
            // A run may end beyond the block, as in libtiff.
            n @ ..0 => {
                let count = left.min(1 + usize::from(n.unsigned_abs()));
                let value = input.next().ok_or_else(|| short(filled, out))?;
                out[filled..filled + count].fill(value);
                filled += count;
            }
            n => {
                let count = left.min(n as usize + 1);
                for place in &mut out[filled..filled + count] {
                    *place = input.next().ok_or("ends within a run of PackBits")?;
                }
                filled += count;
            }
        }
    }
    Ok(())
}

fn zstd(stored: &[u8], out: &mut [u8]) -> Result<(), String> {
    let mut stream = zstd_reader(stored, out.len() as u64)?;
    stream.read_exact(out).map_err(|e| damaged_zstd(&e))
}

fn damaged_zstd(error: &dyn std::fmt::Display) -> String {
    format!("has damaged zstd data: {error}")
}

/// Unpacks a zstd frame of which the first `wanted` bytes at most will be read.
///
/// # Errors
/// A phrase, where it is no frame, or one of far more bytes.
pub(super) fn zstd_reader(stored: &[u8], wanted: u64) -> Result<impl Read, String> {
    let window = zstd_window(stored).ok_or("has no zstd data where they are expected")?;
    // The library takes memory for the window that the frame asks for, which is often far more than a block: no match
    // in what is wanted reaches back further than to its start.
    let enough = wanted.next_power_of_two().max(LEAST_WINDOW_BYTES);
    let (head, rest) = stored
        .split_at_checked(6)
        .ok_or("has no zstd data where they are expected")?;
    let mut head = head.to_vec();
    if window > enough {
        if head[4] & SINGLE_SEGMENT != 0 {
            return Err(format!(
                "has zstd data of {window} bytes for {wanted} bytes of samples"
            ));
        }
        head[5] = ((enough.trailing_zeros() - 10) << 3) as u8;
    }
    let whole = std::io::Cursor::new(head).chain(rest);
    ruzstd::decoding::StreamingDecoder::new(whole).map_err(|e| damaged_zstd(&e))
}

/// The least window that is asked for: a block of zstd holds no more.
const LEAST_WINDOW_BYTES: u64 = 128 << 10;
/// The bit of a frame's descriptor that makes its window its whole content.
const SINGLE_SEGMENT: u8 = 0x20;

/// The window that a zstd frame asks for, from its header (RFC 8878, section 3.1.1.1); none for what is no frame.
fn zstd_window(stored: &[u8]) -> Option<u64> {
    let rest = stored.strip_prefix(&[0x28, 0xb5, 0x2f, 0xfd])?;
    let (descriptor, rest) = rest.split_first()?;
    if descriptor & SINGLE_SEGMENT == 0 {
        let window = *rest.first()?;
        let base = 1u64 << (10 + (window >> 3));
        return Some(base + base / 8 * u64::from(window & 7));
    }
    // A single segment: the window is the whole content, whose size stands behind the number of a dictionary.
    let dictionary = [0, 1, 2, 4][usize::from(descriptor & 3)];
    let size = match descriptor >> 6 {
        0 => return rest.get(dictionary).map(|size| u64::from(*size)),
        flag => rest.get(dictionary..)?.get(..1 << flag)?,
    };
    let number = size.iter().rev().fold(0, |sum, byte| sum << 8 | u64::from(*byte));
    Some(if size.len() == 2 { number + 256 } else { number })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packbits_unpacks_runs_and_literals_and_stops_when_full() {
        // The example of TIFF 6.0, section 9 (after Apple's technical note).
        let packed = b"\xfe\xaa\x02\x80\x00\x2a\xfd\xaa\x03\x80\x00\x2a\x22\xf7\xaa";
        let want = b"\xaa\xaa\xaa\x80\x00\x2a\xaa\xaa\xaa\xaa\x80\x00\x2a\x22\xaa\xaa\xaa\xaa\xaa\xaa\xaa\xaa\xaa\xaa";
        let mut out = [0; 24];
        Compression::PackBits.unpack(packed, &mut out).unwrap();
        assert_eq!(&out, want);
        let mut part = [0; 20];
        Compression::PackBits.unpack(packed, &mut part).unwrap();
        assert_eq!(part, want[..20]);
        let mut more = [0; 25];
        let error = Compression::PackBits.unpack(packed, &mut more).unwrap_err();
        assert_eq!(error, "ends after 24 of 25 bytes");
        for cut in 0..packed.len() {
            assert!(
                Compression::PackBits.unpack(&packed[..cut], &mut out).is_err(),
                "{cut}"
            );
        }
        Compression::PackBits
            .unpack(b"\x80\x80\0\x07", &mut out[..1])
            .unwrap();
        assert_eq!(out[0], 7);
    }

    #[test]
    fn damage_and_want_of_data_are_told_apart_from_data_that_follow() {
        use std::io::Write;
        let want: Vec<u8> = (0..5000u32).map(|i| (i * i % 251) as u8).collect();
        let mut stream = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
        stream.write_all(&want).unwrap();
        let deflate = stream.finish().unwrap();
        let lzw = weezl::encode::Encoder::with_tiff_size_switch(BitOrder::Msb, 8)
            .encode(&want)
            .unwrap();
        let zstd = ruzstd::encoding::compress_to_vec(&want[..], ruzstd::encoding::CompressionLevel::Fastest);
        for (compression, stored) in [
            (Compression::None, want.clone()),
            (Compression::Deflate, deflate),
            (Compression::Lzw, lzw),
            (Compression::Zstd, zstd),
        ] {
            let mut out = vec![0; want.len()];
            let behind = [&stored[..], b"behind"].concat();
            compression.unpack(&behind, &mut out).unwrap();
            assert_eq!(out, want, "{compression:?}");
            let mut part = vec![0; 777];
            compression.unpack(&stored, &mut part).unwrap();
            assert_eq!(part, want[..777], "{compression:?}");
            for cut in [0, 1, stored.len() / 2] {
                assert!(
                    compression.unpack(&stored[..cut], &mut out).is_err(),
                    "{compression:?} {cut}"
                );
            }
            let mut more = vec![0; want.len() + 1];
            assert!(compression.unpack(&stored, &mut more).is_err(), "{compression:?}");
        }
        let mut wrong = vec![0x78, 0x9c, 0xff];
        wrong.extend([0x55; 99]);
        let error = Compression::Deflate.unpack(&wrong, &mut [0; 99]).unwrap_err();
        assert!(error.contains("damaged deflate data"), "{error}");
    }

    #[test]
    fn a_window_beyond_need_takes_no_memory() {
        // A frame of one raw block of two bytes that asks for a window of 2^(10 + 31) bytes.
        let frame = [0x28, 0xb5, 0x2f, 0xfd, 0x00, 0xf8, 0x11, 0, 0, b'h', b'i'];
        assert_eq!(zstd_window(&frame), Some(1 << 41));
        let mut out = [0; 2];
        Compression::Zstd.unpack(&frame, &mut out).unwrap();
        assert_eq!(&out, b"hi");
        // A single segment of 2^56 bytes.
        let frame = [0x28, 0xb5, 0x2f, 0xfd, 0xe0, 0, 0, 0, 0, 0, 0, 0, 1, 0];
        assert_eq!(zstd_window(&frame), Some(1 << 56));
        let error = Compression::Zstd.unpack(&frame, &mut [0; 9]).unwrap_err();
        assert!(error.contains("72057594037927936 bytes for 9 bytes"), "{error}");
        assert_eq!(zstd_window(&[0x28, 0xb5, 0x2f, 0xfd, 0x20, 9]), Some(9));
        assert_eq!(
            zstd_window(&[0x28, 0xb5, 0x2f, 0xfd, 0x60, 9, 1]),
            Some(9 + 256 + 256)
        );
        assert_eq!(zstd_window(b"II*"), None);
    }
}
