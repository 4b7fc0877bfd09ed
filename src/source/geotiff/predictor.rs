//! The predictors of TIFF undone: horizontal differences (TIFF 6.0, section 14) and those of floats byte by byte
//! (Adobe Photoshop TIFF Technical Note 3).

use super::ifd::Order;

/// Undoes predictor 2 on a row of samples of `bytes` bytes each (1, 2, 4 or 8), `interleaved` to a pixel: each is the
/// sum, without carry beyond its bits, of what is stored and the same band of the pixel before it.
pub(super) fn sum(row: &mut [u8], bytes: usize, interleaved: usize, order: Order) {
    macro_rules! sum {
        ($int:ty, $n:literal) => {{
            let samples = row.as_chunks_mut::<$n>().0;
            let (read, write): (fn([u8; $n]) -> $int, fn($int) -> [u8; $n]) = match order {
                Order::Little => (<$int>::from_le_bytes, <$int>::to_le_bytes),
                Order::Big => (<$int>::from_be_bytes, <$int>::to_be_bytes),
            };
            if interleaved == 1 {
                let mut last = 0;
                for sample in samples {
                    last = read(*sample).wrapping_add(last);
                    *sample = write(last);
                }
            } else {
                for i in interleaved..samples.len() {
                    samples[i] = write(read(samples[i]).wrapping_add(read(samples[i - interleaved])));
                }
            }
        }};
    }
    match bytes {
        1 => sum!(u8, 1),
        2 => sum!(u16, 2),
        4 => sum!(u32, 4),
        _ => sum!(u64, 8),
    }
}

/// Undoes predictor 3 on a row of floats of `bytes` bytes each, `interleaved` to a pixel: differences of bytes, of
/// which all first ones stand before all second ones. The samples are left with their greatest byte first, whatever
/// the order of the file. `spare` is as long as the row.
pub(super) fn sum_floats(row: &mut [u8], spare: &mut [u8], bytes: usize, interleaved: usize) {
    for i in interleaved..row.len() {
        row[i] = row[i].wrapping_add(row[i - interleaved]);
    }
    let samples = row.len() / bytes;
    for (plane, values) in row.chunks_exact(samples.max(1)).enumerate() {
        for (sample, value) in spare.chunks_exact_mut(bytes).zip(values) {
            sample[plane] = *value;
        }
    }
    row.copy_from_slice(spare);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_summed_band_by_band_and_wrap() {
        let mut row = [250, 1, 10, 2, 255, 3];
        sum(&mut row, 1, 2, Order::Little);
        assert_eq!(row, [250, 1, 4, 3, 3, 6]);
        for order in [Order::Little, Order::Big] {
            let bytes = |v: u16| match order {
                Order::Little => v.to_le_bytes(),
                Order::Big => v.to_be_bytes(),
            };
            let mut row = [65_535, 2, 300].map(bytes).concat();
            sum(&mut row, 2, 1, order);
            assert_eq!(row, [65_535, 1, 301].map(bytes).concat());
        }
        let mut row = [u64::MAX, 2].map(u64::to_le_bytes).concat();
        sum(&mut row, 8, 1, Order::Little);
        assert_eq!(row, [u64::MAX, 1].map(u64::to_le_bytes).concat());
        let mut row = [1u32 << 31, 1 << 31].map(u32::to_be_bytes).concat();
        sum(&mut row, 4, 1, Order::Big);
        assert_eq!(row, [1u32 << 31, 0].map(u32::to_be_bytes).concat());
    }

    #[test]
    fn floats_come_back_from_their_bytes() {
        // As a writer does it: bytes of all samples by rank, greatest first, then differences from the last byte on.
        for interleaved in [1, 3] {
            let values = [1.5f32, -0.0, 3e30, f32::MIN, 0.1, 8848.86];
            let n = values.len();
            let mut row = vec![0; 4 * n];
            for (i, value) in values.iter().enumerate() {
                for (rank, byte) in value.to_be_bytes().iter().enumerate() {
                    row[rank * n + i] = *byte;
                }
            }
            for i in (interleaved..row.len()).rev() {
                row[i] = row[i].wrapping_sub(row[i - interleaved]);
            }
            let mut spare = vec![0; row.len()];
            sum_floats(&mut row, &mut spare, 4, interleaved);
            assert_eq!(row, values.map(f32::to_be_bytes).concat());
        }
    }
}
