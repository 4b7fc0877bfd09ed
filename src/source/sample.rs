//! Samples as bytes: their type, byte order, and the value among them that means no data.

use super::SampleType;

/// How the bytes of a sample are read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Coding {
    pub(super) sample: SampleType,
    pub(super) big_endian: bool,
    /// The stored value that means no data; of float samples it is rounded to their type before it is compared.
    pub(super) nodata: Option<f64>,
}

impl Coding {
    /// Whether f32 holds every value of the type.
    pub(super) fn fits_f32(self) -> bool {
        use SampleType::{F32, I8, I16, U8, U16};
        matches!(self.sample, U8 | I8 | U16 | I16 | F32)
    }

    /// Calls `put` with the number and the value of each sample in `bytes`, which begin `stride` bytes apart: NaN for
    /// no data; infinities as they are. Whole numbers beyond 2^53 are rounded to f64.
    pub(super) fn each(self, bytes: &[u8], stride: usize, put: impl FnMut(usize, f64)) {
        let nodata = self.nodata;
        let whole = |v: i128| {
            // What has a fraction, or lies beyond i128, no whole number equals.
            let void = nodata.is_some_and(|n| n.fract() == 0.0 && n.abs() < 1e38 && n as i128 == v);
            if void { f64::NAN } else { v as f64 }
        };
        // Small integers are exact in f64: no need for wide arithmetic.
        let small = |v: f64| if nodata == Some(v) { f64::NAN } else { v };
        let single = |v: f32| {
            let void = nodata.is_some_and(|n| n as f32 == v);
            if void { f64::NAN } else { f64::from(v) }
        };
        let words = Words {
            bytes,
            stride,
            big_endian: self.big_endian,
        };
        match self.sample {
            SampleType::U8 => words.each(u8::from_le_bytes, |v| small(v.into()), put),
            SampleType::I8 => words.each(i8::from_le_bytes, |v| small(v.into()), put),
            SampleType::U16 => words.each(u16::from_le_bytes, |v| small(v.into()), put),
            SampleType::I16 => words.each(i16::from_le_bytes, |v| small(v.into()), put),
            SampleType::U32 => words.each(u32::from_le_bytes, |v| small(v.into()), put),
            SampleType::I32 => words.each(i32::from_le_bytes, |v| small(v.into()), put),
            SampleType::U64 => words.each(u64::from_le_bytes, |v| whole(v.into()), put),
            SampleType::I64 => words.each(i64::from_le_bytes, |v| whole(v.into()), put),
            SampleType::F32 => words.each(f32::from_le_bytes, single, put),
            SampleType::F64 => words.each(f64::from_le_bytes, small, put),
        }
    }
}

/// Words of some bytes each, the first of them `stride` bytes apart.
struct Words<'b> {
    bytes: &'b [u8],
    stride: usize,
    big_endian: bool,
}

impl Words<'_> {
    fn each<const N: usize, T>(
        &self,
        read: impl Fn([u8; N]) -> T,
        value: impl Fn(T) -> f64,
        mut put: impl FnMut(usize, f64),
    ) {
        let words = self
            .bytes
            .chunks(self.stride)
            .filter_map(<[u8]>::first_chunk::<N>);
        for (i, word) in words.enumerate() {
            let mut word = *word;
            if self.big_endian {
                word.reverse();
            }
            put(i, value(read(word)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(
        sample: SampleType,
        big_endian: bool,
        nodata: Option<f64>,
        bytes: &[u8],
        stride: usize,
    ) -> Vec<f64> {
        let mut out = Vec::new();
        let coding = Coding {
            sample,
            big_endian,
            nodata,
        };
        coding.each(bytes, stride, |_, v| out.push(v));
        out
    }

    #[test]
    fn types_orders_and_strides_are_read() {
        use SampleType::{F32, F64, I16, I64, U8, U16};
        assert_eq!(values(I16, true, None, &[0xff, 0xfe, 1, 0], 2), [-2.0, 256.0]);
        assert_eq!(values(U16, false, None, &[0xff, 0xfe, 1, 0], 2), [65279.0, 1.0]);
        assert_eq!(values(U8, false, None, &[1, 2, 3, 4, 5, 6], 3), [1.0, 4.0]);
        // A last word that is cut is none.
        assert_eq!(values(U16, false, None, &[1, 0, 9, 2, 0, 9, 3], 3), [1.0, 2.0]);
        assert_eq!(values(F64, true, None, &(-2.5f64).to_be_bytes(), 8), [-2.5]);
        let v = values(
            F32,
            false,
            Some(-3.402_823_466_385_29e38),
            &f32::MIN.to_le_bytes(),
            4,
        );
        assert!(v[0].is_nan(), "a decimal text is compared as f32");
        let near = ((1i64 << 60) + 1).to_le_bytes();
        assert!(!values(I64, false, Some((1i64 << 60) as f64), &near, 8)[0].is_nan());
        assert!(values(U8, false, Some(7.0), &[7], 1)[0].is_nan());
        assert_eq!(values(U8, false, Some(7.5), &[7], 1), [7.0]);
    }
}
