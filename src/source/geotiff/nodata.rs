//! The value that means no data in a GeoTIFF, compared in the type of its samples.

use half::f16;

/// The no-data value of a file, as its decimal text gives it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Nodata {
    /// None named, or one that the samples cannot have.
    None,
    /// Of integer samples.
    Whole(i128),
    /// Of float samples; rounded to their type before it is compared.
    Real(f64),
}

impl Nodata {
    /// Reads the text of the tag, for samples that are integers or floats.
    pub(super) fn parse(text: &str, integer: bool) -> Self {
        match (integer, text.parse::<i128>(), text.parse::<f64>()) {
            (true, Ok(value), _) => Self::Whole(value),
            // `-9999.0` or `3e4`; what has a fraction, or lies beyond i128, no integer sample equals.
            (true, _, Ok(value)) if value.fract() == 0.0 && value.abs() < 1e38 => Self::Whole(value as i128),
            (false, _, Ok(value)) => Self::Real(value),
            _ => Self::None,
        }
    }

    /// An integer sample, NaN if it is no data. Beyond 2^53 it is rounded to f64.
    pub(super) fn whole(self, value: i128) -> f64 {
        if self == Self::Whole(value) {
            f64::NAN
        } else {
            value as f64
        }
    }

    /// An f16 sample, NaN if it is no data.
    pub(super) fn half(self, value: f16) -> f64 {
        let void = matches!(self, Self::Real(n) if f16::from_f64(n) == value);
        if void { f64::NAN } else { value.to_f64() }
    }

    /// An f32 sample, NaN if it is no data.
    pub(super) fn single(self, value: f32) -> f64 {
        let void = matches!(self, Self::Real(n) if n as f32 == value);
        if void { f64::NAN } else { f64::from(value) }
    }

    /// An f64 sample, NaN if it is no data.
    pub(super) fn double(self, value: f64) -> f64 {
        let void = matches!(self, Self::Real(n) if n == value);
        if void { f64::NAN } else { value }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decimal_text_is_compared_in_the_type_of_the_samples() {
        let text = Nodata::parse("-3.4028234663852886e+38", false);
        assert!(text.single(f32::MIN).is_nan());
        assert_eq!(text.single(-3.4e38), f64::from(-3.4e38f32));
        assert!(Nodata::parse("0.1", false).single(0.1).is_nan());
        assert_eq!(
            Nodata::parse("0.1", false).double(f64::from(0.1f32)),
            f64::from(0.1f32)
        );
        assert!(
            Nodata::parse("-9999", false)
                .half(f16::from_f32(-9999.0))
                .is_nan()
        );
    }

    #[test]
    fn whole_numbers_are_exact_and_what_cannot_match_never_does() {
        let large = Nodata::parse("9223372036854775807", true);
        assert!(large.whole(i64::MAX.into()).is_nan());
        assert!(!large.whole(i128::from(i64::MAX) - 1).is_nan());
        assert!(Nodata::parse("-32768.0", true).whole(-32768).is_nan());
        assert_eq!(Nodata::parse("-9999.5", true), Nodata::None);
        assert_eq!(Nodata::parse("nan", true), Nodata::None);
        assert_eq!(Nodata::parse("", true), Nodata::None);
        assert_eq!(Nodata::parse("-inf", true), Nodata::None);
        assert_eq!(Nodata::parse("nan", false).single(5.0), 5.0);
        assert!(Nodata::parse("-inf", false).single(f32::NEG_INFINITY).is_nan());
    }
}
