//! From the bytes of samples to heights: no data, scale, offset and base.

use half::f16;

use super::ifd::Order;
use super::layout::Kind;
use super::nodata::Nodata;
use crate::source::held::Scale;

/// How bytes become heights.
#[derive(Clone, Copy, Debug)]
pub(super) struct Samples {
    pub(super) kind: Kind,
    pub(super) order: Order,
    pub(super) nodata: Nodata,
    pub(super) scale: Scale,
    /// Metres subtracted before the one rounding to f32.
    pub(super) base_m: f64,
}

/// Calls `$to` with every sample of `$raw` and puts what it returns to its place in `$out`.
macro_rules! each {
    ($raw:ident, $order:expr, $type:ty, $n:literal, $out:ident, $to:expr) => {{
        let samples = $raw.as_chunks::<$n>().0;
        #[allow(unused_mut, reason = "some count what they meet")]
        let mut to = $to;
        match $order {
            Order::Little => {
                for (out, sample) in $out.iter_mut().zip(samples) {
                    *out = to(<$type>::from_le_bytes(*sample));
                }
            }
            Order::Big => {
                for (out, sample) in $out.iter_mut().zip(samples) {
                    *out = to(<$type>::from_be_bytes(*sample));
                }
            }
        }
    }};
}

impl Samples {
    /// The heights of `raw` in metres less the base, each rounded once, NaN for no data. Returns how many were
    /// infinite or beyond f32, and became no data.
    pub(super) fn heights(&self, raw: &[u8], out: &mut [f32]) -> u64 {
        if self.scale == Scale::METRES && self.base_m == 0.0 {
            return self.plain(raw, out);
        }
        let mut infinite = 0;
        if self.scale == Scale::METRES && matches!(self.kind, Kind::U64 | Kind::I64) {
            // Beyond 2^53 f64 does not hold them.
            let base = self.base_m as i128;
            let whole = |value: i128| match self.nodata == Nodata::Whole(value) {
                true => f32::NAN,
                false => (value - base) as f32,
            };
            match self.kind {
                Kind::U64 => each!(raw, self.order, u64, 8, out, |v| whole(i128::from(v))),
                _ => each!(raw, self.order, i64, 8, out, |v| whole(i128::from(v))),
            }
            return 0;
        }
        let Self { scale, base_m, .. } = *self;
        self.values(raw, out, |value| {
            let height = (value * scale.scale + scale.offset - base_m) as f32;
            infinite += u64::from(height.is_infinite());
            if height.is_infinite() { f32::NAN } else { height }
        });
        infinite
    }

    /// Samples that are metres already, above no base.
    fn plain(&self, raw: &[u8], out: &mut [f32]) -> u64 {
        let mut infinite = 0;
        let mut finite = |height: f32| {
            infinite += u64::from(height.is_infinite());
            if height.is_infinite() { f32::NAN } else { height }
        };
        macro_rules! small {
            ($type:ty, $n:literal) => {{
                match self.nodata.whole_as::<$type>() {
                    Some(void) => each!(raw, self.order, $type, $n, out, |v| {
                        if v == void { f32::NAN } else { f32::from(v) }
                    }),
                    None => each!(raw, self.order, $type, $n, out, |v| f32::from(v)),
                }
            }};
        }
        match self.kind {
            Kind::U8 => small!(u8, 1),
            Kind::I8 => small!(i8, 1),
            Kind::U16 => small!(u16, 2),
            Kind::I16 => small!(i16, 2),
            Kind::F32 => {
                let void = self.nodata.real().map(|n| n as f32);
                each!(raw, self.order, f32, 4, out, |v| {
                    if Some(v) == void { f32::NAN } else { finite(v) }
                });
            }
            _ => self.values(raw, out, |value| finite(value as f32)),
        }
        infinite
    }

    /// What `to` makes of each value of `raw`, NaN for no data.
    pub(super) fn values<T>(&self, raw: &[u8], out: &mut [T], mut to: impl FnMut(f64) -> T) {
        macro_rules! whole {
            ($type:ty, $n:literal) => {{
                let void = self.nodata.whole_as::<$type>();
                each!(raw, self.order, $type, $n, out, |v| to(
                    if Some(v) == void { f64::NAN } else { v as f64 }
                ))
            }};
        }
        let real = self.nodata.real();
        match self.kind {
            Kind::U8 => whole!(u8, 1),
            Kind::I8 => whole!(i8, 1),
            Kind::U16 => whole!(u16, 2),
            Kind::I16 => whole!(i16, 2),
            Kind::U32 => whole!(u32, 4),
            Kind::I32 => whole!(i32, 4),
            Kind::U64 => whole!(u64, 8),
            Kind::I64 => whole!(i64, 8),
            Kind::F16 => {
                let void = real.map(f16::from_f64);
                each!(raw, self.order, f16, 2, out, |v| {
                    to(if Some(v) == void { f64::NAN } else { v.to_f64() })
                });
            }
            Kind::F32 => {
                let void = real.map(|n| n as f32);
                each!(raw, self.order, f32, 4, out, |v| {
                    to(if Some(v) == void { f64::NAN } else { f64::from(v) })
                });
            }
            Kind::F64 => {
                each!(raw, self.order, f64, 8, out, |v| to(if Some(v) == real {
                    f64::NAN
                } else {
                    v
                }));
            }
        }
    }

    /// The height of a block that is not stored: no data, or 0 where the file names no value for it, as in GDAL.
    pub(super) fn left_out(&self) -> f32 {
        match self.nodata {
            Nodata::None => (self.scale.offset - self.base_m) as f32,
            _ => f32::NAN,
        }
    }

    /// The base for `raw`, the first bytes of the image that hold anything: 0 while f32 holds every value of them, else
    /// the first in metres. None where all of them are void. A value near the end of f32's range stands for no data
    /// that the file does not declare, and would be no base to see the land from.
    pub(super) fn base_of(&self, raw: &[u8]) -> Option<f64> {
        let (mut first, mut exact) = (None, true);
        let mut ignored = vec![(); raw.len() / self.kind.bytes()];
        self.values(raw, &mut ignored, |value| {
            if value.abs() < 1e38 {
                first = first.or(Some(value));
                exact &= f64::from(value as f32) == value;
            }
        });
        let first = first?;
        Some(if exact {
            0.0
        } else {
            first * self.scale.scale + self.scale.offset
        })
    }
}
