//! How numbers, suns and bytes are written. Each parser says what it wants.

use clap::builder::{PossibleValuesParser, TypedValueParser};

use crate::light::Sun;
use crate::pyramid::FilterKind;

/// A finite number.
pub(super) fn number(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(_) => Err("not a finite number".into()),
        Err(_) => Err("not a number".into()),
    }
}

/// `N` finite numbers with commas between them.
pub(super) fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let values: Vec<f64> = text.split(',').map(number).collect::<Result<_, _>>()?;
    let count = values.len();
    values
        .try_into()
        .map_err(|_| format!("{count} numbers, {N} are wanted, with commas between them"))
}

/// A sun `AZIMUTH,ALTITUDE` in degrees.
pub(super) fn sun(text: &str) -> Result<Sun, String> {
    let [azimuth_deg, altitude_deg] = numbers(text)?;
    let sun = Sun {
        azimuth_deg,
        altitude_deg,
    };
    sun.check()
        .map_err(|_| "the altitude is outside of -90 to 90 degrees".to_string())?;
    Ok(sun)
}

/// A filter by its name.
pub(super) fn filter() -> impl TypedValueParser<Value = FilterKind> {
    PossibleValuesParser::new(FilterKind::ALL.map(FilterKind::name)).try_map(|name| name.parse())
}

/// Bytes: `4096`, `512M`, `2GiB`. K, M, G and T, with or without iB, are powers of 1024; KB to TB of 1000.
pub(super) fn bytes(text: &str) -> Result<u64, String> {
    let wanted = || "not a size in bytes, as in 512M or 2GiB".to_string();
    let digits = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
    let (number, unit) = text.split_at(digits);
    let number: u64 = number.parse().map_err(|_| wanted())?;
    let unit = unit.trim().to_ascii_lowercase();
    let power = |letter: Option<char>| match letter {
        Some('k') => Some(1),
        Some('m') => Some(2),
        Some('g') => Some(3),
        Some('t') => Some(4),
        _ => None,
    };
    let mut letters = unit.chars();
    let factor = match (power(letters.next()), letters.as_str()) {
        (Some(power), "" | "ib") => 1024_u64.pow(power),
        (Some(power), "b") => 1000_u64.pow(power),
        (None, _) if matches!(unit.as_str(), "" | "b") => 1,
        _ => return Err(wanted()),
    };
    number
        .checked_mul(factor)
        .ok_or_else(|| "more bytes than can be counted".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_read_with_their_units() {
        for (text, count) in [
            ("0", 0),
            ("4096", 4096),
            ("512M", 512 << 20),
            ("512m", 512 << 20),
            ("2GiB", 2 << 30),
            ("2 GiB", 2 << 30),
            ("3KB", 3000),
            ("1T", 1 << 40),
            ("7B", 7),
        ] {
            assert_eq!(bytes(text), Ok(count), "{text}");
        }
        for bad in ["", "M", "-1", "1.5G", "1X", "1Mi", "1MBs", "99999999T", "1 2"] {
            assert!(bytes(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn suns_are_in_the_sky_or_refused() {
        assert_eq!(
            sun("-45,-3"),
            Ok(Sun {
                azimuth_deg: -45.0,
                altitude_deg: -3.0
            })
        );
        for bad in ["", "nan,0", "0,inf", "1,,3", "1,2,3", "x,y"] {
            assert!(sun(bad).is_err(), "{bad}");
        }
        assert!(sun("0,91").is_err() && sun("10").is_err());
    }
}
