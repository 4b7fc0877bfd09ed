//! LERC within TIFF: a block is one blob of values, bare or packed once more with deflate or zstd (Esri, LERC 2; GDAL's
//! tag LercParameters). Reading is by the crate `lerc-rs`.

use std::io::Read;

use super::block::FREE_BYTES;
use super::layout::Kind;
use crate::source::held::MAX_COMPRESSION;

/// What a blob is packed with once more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Around {
    Nothing,
    Deflate,
    Zstd,
}

/// The samples that a block should have.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wanted {
    pub(super) kind: Kind,
    pub(super) columns: usize,
    /// Rows that are wanted, and those that the block may have.
    pub(super) rows: [usize; 2],
    pub(super) interleaved: usize,
}

/// Unpacks a block into `out`, the least byte of each sample first. Values that the blob masks are NaN, or 0 where samples
/// are whole numbers, as in libtiff.
///
/// # Errors
/// A phrase, where the blob is damaged or holds other samples than those that are wanted.
pub(super) fn unpack(around: Around, wanted: Wanted, stored: &[u8], out: &mut [u8]) -> Result<(), String> {
    let damaged = |error: &dyn std::fmt::Display| format!("has damaged LERC data: {error}");
    let inner;
    let blob = match around {
        Around::Nothing => stored,
        _ => {
            // A blob is about as long as its values at most.
            let most = 2 * out.len() as u64 + (64 << 10);
            let mut unpacked = Vec::new();
            let read = match around {
                Around::Zstd => super::codec::zstd_reader(stored, most)?
                    .take(most)
                    .read_to_end(&mut unpacked),
                _ => flate2::read::ZlibDecoder::new(stored)
                    .take(most)
                    .read_to_end(&mut unpacked),
            };
            read.map_err(|e| damaged(&e))?;
            inner = unpacked;
            &inner[..]
        }
    };
    let info = lerc::decode_info(blob).map_err(|e| damaged(&e))?;
    let [width, height, depth, bands] = [info.width, info.height, info.depth, info.bands].map(|n| n as usize);
    let [least, most] = wanted.rows;
    if width != wanted.columns || !(least..=most).contains(&height) || depth * bands != wanted.interleaved {
        return Err(format!(
            "has LERC data of {width} x {height} samples of {depth} values in {bands} bands, where {} x {most} belong",
            wanted.columns
        ));
    }
    if bands > 1 {
        return Err("has LERC data of several bands one after another, which are not read".into());
    }
    // The rows below the image are unpacked too, and a blob may claim any number of them.
    let count = width * height * depth;
    let free = FREE_BYTES.max(blob.len() as u64 * MAX_COMPRESSION);
    if (count as u64).saturating_mul(wanted.kind.bytes() as u64) > free {
        return Err(format!(
            "has LERC data of {} bytes that claim {count} samples",
            blob.len()
        ));
    }
    macro_rules! values {
        ($type:ty, $void:expr) => {{
            let mut values: Vec<$type> = vec![Default::default(); count];
            lerc::decode_into_with_nodata(blob, &mut values, $void).map_err(|e| damaged(&e))?;
            let places = out.chunks_exact_mut(size_of::<$type>());
            for (place, value) in places.zip(values) {
                place.copy_from_slice(&value.to_le_bytes());
            }
        }};
    }
    match wanted.kind {
        Kind::U8 => values!(u8, 0),
        Kind::I8 => values!(i8, 0),
        Kind::U16 => values!(u16, 0),
        Kind::I16 => values!(i16, 0),
        Kind::U32 => values!(u32, 0),
        Kind::I32 => values!(i32, 0),
        Kind::F32 => values!(f32, f32::NAN),
        Kind::F64 => values!(f64, f64::NAN),
        Kind::U64 | Kind::I64 | Kind::F16 => {
            return Err("has LERC data of a type that LERC does not have".into());
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blobs_are_unpacked_and_other_sizes_refused() {
        let values: Vec<f32> = (0..35u16).map(|i| f32::from(i * i) / 4.0).collect();
        let blob = lerc::encode_slice(7, 5, &values, lerc::Precision::Lossless).unwrap();
        let want: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let wanted = Wanted {
            kind: Kind::F32,
            columns: 7,
            rows: [5, 5],
            interleaved: 1,
        };
        let mut deflate = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
        std::io::Write::write_all(&mut deflate, &blob).unwrap();
        let level = ruzstd::encoding::CompressionLevel::Fastest;
        for (around, stored) in [
            (Around::Nothing, blob.clone()),
            (Around::Deflate, deflate.finish().unwrap()),
            (Around::Zstd, ruzstd::encoding::compress_to_vec(&blob[..], level)),
        ] {
            let mut out = vec![0; want.len()];
            unpack(around, wanted, &stored, &mut out).unwrap();
            assert_eq!(out, want, "{around:?}");
            assert!(
                unpack(around, wanted, &stored[..stored.len() / 2], &mut out).is_err(),
                "{around:?}"
            );
        }
        let mut out = vec![0; want.len()];
        let other = |change: fn(&mut Wanted)| {
            let mut other = wanted;
            change(&mut other);
            other
        };
        for other in [
            other(|w| w.columns = 8),
            other(|w| w.rows = [6, 6]),
            other(|w| w.rows = [4, 4]),
            other(|w| w.interleaved = 2),
            other(|w| w.kind = Kind::I32),
            other(|w| w.kind = Kind::F16),
        ] {
            assert!(
                unpack(Around::Nothing, other, &blob, &mut out).is_err(),
                "{other:?}"
            );
        }
        // Fewer rows than the blob has may be wanted.
        let mut part = vec![0; 7 * 3 * 4];
        unpack(Around::Nothing, other(|w| w.rows = [3, 5]), &blob, &mut part).unwrap();
        assert_eq!(part, want[..84]);
        for at in 0..blob.len() {
            for value in [0, 0xff, blob[at] ^ 0x10] {
                let mut wrong = blob.clone();
                wrong[at] = value;
                let _ = unpack(Around::Nothing, wanted, &wrong, &mut out);
            }
        }
    }
}
