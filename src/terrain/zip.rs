//! OpenEXR's ZIP compression of one tile: bytes set apart, differences, deflate.
//!
//! As OpenEXR's `ImfZip.cpp` has it: of the tile's little-endian bytes those at even places come first, then those at
//! odd ones; each byte but the first is replaced by its difference to the one before, plus 128, modulo 256; what
//! results is a zlib stream. A tile that does not shrink is stored as it is, which its length tells.
//!
//! The exr crate does the same, but with miniz at level 4: for the levels of 13201 x 4801 heights in whole metres that
//! takes 7.5 s of a processor where libdeflate's level 1 takes 1.8 s for 4 % more bytes, and its level 4 1.4 s more for
//! 7 % fewer (levels 1, 2, 3, 4, 6, 7: 93.7, 90.4, 88.3, 87.4, 86.9, 85.5 MB in 4.1, 4.8, 5.2, 5.5, 7.1, 9.7 s of all
//! preprocessing). zlib-rs takes 3.2 s for as many bytes as level 1 (level 2), or 1.6 s for 40 % more (level 1); reading
//! takes 0.6 s against 0.7 s and zune's 0.8 s.

use std::cell::RefCell;

use libdeflater::{CompressionLvl, Compressor, Decompressor};

/// libdeflate's level beyond which bytes become dear: see above.
const LEVEL: i32 = 4;

thread_local! {
    // Each holds some hundred KiB of tables, which are as good for the next tile.
    static COMPRESSOR: RefCell<Compressor> =
        RefCell::new(Compressor::new(CompressionLvl::new(LEVEL).unwrap_or_default()));
    static DECOMPRESSOR: RefCell<Decompressor> = RefCell::new(Decompressor::new());
}

/// The bytes that a file holds for a tile of the samples `raw`, little-endian: never more than those.
pub(super) fn compress(raw: Vec<u8>) -> Vec<u8> {
    if raw.len() < 2 {
        return raw;
    }
    let differences = differences(&raw);
    let mut out = vec![0; raw.len() - 1];
    let length = COMPRESSOR.with_borrow_mut(|c| c.zlib_compress(&differences, &mut out));
    match length {
        Ok(length) => {
            out.truncate(length);
            out.shrink_to_fit();
            out
        }
        // It does not fit: it would be no shorter.
        Err(_) => raw,
    }
}

/// The samples, `length` bytes, of the bytes that a file holds for a tile; else what is wrong, as a phrase.
pub(super) fn decompress(held: Vec<u8>, length: usize) -> Result<Vec<u8>, String> {
    if held.len() == length {
        return Ok(held);
    }
    let mut differences = vec![0; length];
    let found = DECOMPRESSOR
        .with_borrow_mut(|d| d.zlib_decompress(&held, &mut differences))
        .map_err(|e| e.to_string())?;
    if found != length {
        return Err(format!("{found} bytes of samples instead of {length}"));
    }
    Ok(samples(differences))
}

/// Even bytes, then odd ones, as differences.
fn differences(raw: &[u8]) -> Vec<u8> {
    let (even, odd) = (raw.len().div_ceil(2), raw.len() / 2);
    let mut apart = vec![0; raw.len()];
    let (first, second) = apart.split_at_mut(even);
    let pairs = raw.chunks_exact(2);
    if let [last] = pairs.remainder() {
        first[odd] = *last;
    }
    // Two loops, each of which is a few wide instructions.
    for (out, pair) in first.iter_mut().zip(pairs.clone()) {
        *out = pair[0];
    }
    for (out, pair) in second.iter_mut().zip(pairs) {
        *out = pair[1];
    }
    let mut out = vec![0; raw.len()];
    out[0] = apart[0];
    for ((out, before), byte) in out[1..].iter_mut().zip(&apart).zip(&apart[1..]) {
        *out = byte.wrapping_sub(*before).wrapping_add(128);
    }
    out
}

/// The inverse of [`differences`].
fn samples(mut apart: Vec<u8>) -> Vec<u8> {
    // Four sums side by side, each of its own quarter, start from what the quarters before them sum to.
    let quarter = apart.len().div_ceil(4).max(1);
    let mut start = 128u8;
    let starts: Vec<u8> = apart
        .chunks(quarter)
        .map(|part| {
            let sum = part
                .iter()
                .fold(0u8, |sum, byte| sum.wrapping_add(*byte))
                .wrapping_sub((part.len() as u8).wrapping_mul(128));
            let next = start.wrapping_add(sum);
            std::mem::replace(&mut start, next)
        })
        .collect();
    let mut parts = apart.chunks_mut(quarter);
    let mut part = || parts.next().unwrap_or_default();
    let quarters = [part(), part(), part(), part()];
    sum_up(quarters, &starts);

    let mut out = vec![0; apart.len()];
    let (even, odd) = apart.split_at(apart.len().div_ceil(2));
    let mut pairs = out.chunks_exact_mut(2);
    for ((pair, even), odd) in (&mut pairs).zip(even).zip(odd) {
        pair[0] = *even;
        pair[1] = *odd;
    }
    if let ([last], Some(byte)) = (pairs.into_remainder(), even.last()) {
        *last = *byte;
    }
    out
}

/// Replaces differences by the values that they sum to, in four parts at once.
fn sum_up([a, b, c, d]: [&mut [u8]; 4], starts: &[u8]) {
    let start = |n: usize| starts.get(n).copied().unwrap_or_default();
    let mut sums = [start(0), start(1), start(2), start(3)];
    let step = |sum: &mut u8, byte: &mut u8| {
        *sum = sum.wrapping_add(*byte).wrapping_sub(128);
        *byte = *sum;
    };
    // All parts but the last that has any are equally long.
    let together = d.len();
    let (a0, a1) = a.split_at_mut(together.min(a.len()));
    let (b0, b1) = b.split_at_mut(together.min(b.len()));
    let (c0, c1) = c.split_at_mut(together.min(c.len()));
    for (((a, b), c), d) in a0.iter_mut().zip(b0).zip(c0).zip(d) {
        step(&mut sums[0], a);
        step(&mut sums[1], b);
        step(&mut sums[2], c);
        step(&mut sums[3], d);
    }
    for (sum, rest) in sums.iter_mut().zip([a1, b1, c1]) {
        rest.iter_mut().for_each(|byte| step(sum, byte));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pyramid::random::Random;

    /// Straight from OpenEXR's words.
    fn plain(raw: &[u8]) -> Vec<u8> {
        let even = raw.iter().step_by(2);
        let odd = raw.iter().skip(1).step_by(2);
        let apart: Vec<u8> = even.chain(odd).copied().collect();
        let differences = apart
            .windows(2)
            .map(|w| (i32::from(w[1]) - i32::from(w[0]) + 128 + 256) as u8);
        apart[..1].iter().copied().chain(differences).collect()
    }

    #[test]
    fn differences_are_those_of_openexr_and_come_back() {
        let random = &mut Random::new(4);
        for length in (1..70).chain([4095, 4096, 4097, 262_144]) {
            let raw: Vec<u8> = (0..length).map(|_| random.bits() as u8).collect();
            let found = differences(&raw);
            assert_eq!(found, plain(&raw), "{length} bytes");
            assert_eq!(samples(found.clone()), raw, "{length} bytes");
            let mut wrong = found;
            wrong[length / 2] ^= 1;
            assert_ne!(samples(wrong), raw, "control");
        }
    }

    #[test]
    fn tiles_come_back_and_those_that_do_not_shrink_are_stored_as_they_are() {
        let random = &mut Random::new(5);
        let noise: Vec<u8> = (0..10_000).map(|_| random.bits() as u8).collect();
        assert_eq!(compress(noise.clone()), noise);
        for raw in [
            noise,
            vec![7; 10_000],
            vec![1, 2, 3, 4],
            vec![9],
            (0..=255).collect(),
        ] {
            let held = compress(raw.clone());
            assert!(held.len() <= raw.len());
            assert_eq!(decompress(held, raw.len()).unwrap(), raw);
        }
        assert!(compress(vec![7; 10_000]).len() < 200);
    }

    #[test]
    fn damage_is_told() {
        let raw: Vec<u8> = (0..10_000u32).map(|i| (i / 100) as u8).collect();
        let held = compress(raw);
        let short = held[..held.len() - 3].to_vec();
        assert!(decompress(short, 10_000).is_err());
        assert!(decompress(held.clone(), 9_999).is_err());
        assert!(decompress(held.clone(), 10_001).is_err());
        let mut flipped = held;
        let middle = flipped.len() / 2;
        flipped[middle] ^= 4;
        assert!(
            decompress(flipped, 10_000).is_err(),
            "the sum at the stream's end tells"
        );
    }
}
