//! The value that means no data in a GeoTIFF, compared in the type of its samples.

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

    /// The value as an integer of type `T`; none where it is no integer, or none that `T` can have.
    pub(super) fn whole_as<T: TryFrom<i128>>(self) -> Option<T> {
        match self {
            Self::Whole(value) => T::try_from(value).ok(),
            _ => None,
        }
    }

    /// The value of float samples, not yet rounded to their type.
    pub(super) fn real(self) -> Option<f64> {
        match self {
            Self::Real(value) => Some(value),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers_are_exact_and_what_cannot_match_never_does() {
        let large = Nodata::parse("9223372036854775807", true);
        assert_eq!(large.whole_as::<i64>(), Some(i64::MAX));
        assert_eq!(large.whole_as::<i16>(), None);
        assert_eq!(Nodata::parse("-32768.0", true).whole_as::<i16>(), Some(-32768));
        assert_eq!(Nodata::parse("3e4", true).whole_as::<u16>(), Some(30_000));
        assert_eq!(Nodata::parse("-9999", true).whole_as::<u16>(), None);
        for none in ["-9999.5", "nan", "", "-inf", "x"] {
            assert_eq!(Nodata::parse(none, true), Nodata::None, "{none}");
        }
        assert!(Nodata::parse("nan", false).real().is_some_and(f64::is_nan));
        assert_eq!(Nodata::parse("-inf", false).real(), Some(f64::NEG_INFINITY));
        assert_eq!(Nodata::parse("0.1", false).real(), Some(0.1));
    }
}
