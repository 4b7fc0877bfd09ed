//! How numbers, suns and bytes are written. Each parser says what it wants.

use clap::builder::{PossibleValuesParser, TypedValueParser};

#[cfg(feature = "dem")]
use crate::build::PartKind;
use crate::grid::Rect;
use crate::light::{Moment, Sun};
use crate::pyramid::FilterKind;
use crate::source::{Band, RawLayout, SampleType};

/// A finite number.
pub(super) fn number(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(_) => Err("not a finite number".into()),
        Err(_) => Err("not a number".into()),
    }
}

/// A number, also `nan`, `inf` and `-inf`.
pub(super) fn any_number(text: &str) -> Result<f64, String> {
    text.trim().parse().map_err(|_| "not a number".into())
}

/// A spacing `DX` or `DX,DZ` in metres, above 0.
pub(super) fn spacing(text: &str) -> Result<[f64; 2], String> {
    let [dx, dz] = if text.contains(',') {
        numbers(text)?
    } else {
        [number(text)?; 2]
    };
    if dx > 0.0 && dz > 0.0 {
        Ok([dx, dz])
    } else {
        Err("not above 0".into())
    }
}

/// A band by its number from 1, or else by its name.
pub(super) fn band(text: &str) -> Result<Band, String> {
    match text.parse() {
        Ok(0) => Err("bands are counted from 1".into()),
        Ok(number) => Ok(Band::Number(number)),
        Err(_) if text.is_empty() => Err("a number or a name is wanted".into()),
        Err(_) => Ok(Band::Name(text.into())),
    }
}

/// Size and type `WxH:TYPE`.
pub(super) fn raw(text: &str) -> Result<RawLayout, String> {
    let wanted = || "not a size and a type, as in 1024x1024:int16".to_string();
    let (size, kind) = text.split_once(':').ok_or_else(wanted)?;
    let (width, height) = size.split_once('x').ok_or_else(wanted)?;
    let kind = kind.to_ascii_lowercase();
    let (name, big_endian) = match kind.strip_suffix("be") {
        Some(name) => (name, true),
        None => (kind.strip_suffix("le").unwrap_or(&kind), false),
    };
    let sample = SampleType::parse(name)
        .ok_or_else(|| format!("{kind:?} is no type; uint8 to int64, float32 and float64 are"))?;
    let side = |text: &str| text.parse().ok().filter(|n| *n > 0).ok_or_else(wanted);
    Ok(RawLayout {
        width: side(width)?,
        height: side(height)?,
        sample,
        big_endian,
    })
}

/// A rectangle of samples `X,Y,W,H`.
pub(super) fn samples(text: &str) -> Result<Rect, String> {
    let wanted = || "not four whole numbers: first column, first row, columns, rows".to_string();
    let values: Vec<i64> = text
        .split(',')
        .map(|part| part.trim().parse().map_err(|_| wanted()))
        .collect::<Result<_, _>>()?;
    let [x, z, width, height] = values[..] else {
        return Err(wanted());
    };
    let ends = x.checked_add(width).zip(z.checked_add(height));
    match ends {
        Some((x1, z1)) if width > 0 && height > 0 => Ok(Rect::new(x, z, x1, z1)),
        _ => Err("a rectangle without samples".into()),
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

/// A moment, as in 2026-06-21T09:00:00Z.
pub(super) fn moment(text: &str) -> Result<Moment, String> {
    text.parse()
}

/// A time of day, as 9:30 by the sun or a moment.
#[cfg(feature = "gpu")]
pub(super) fn sun_time(text: &str) -> Result<crate::light::SunTime, String> {
    text.parse()
}

/// Degrees of latitude.
pub(super) fn latitude(text: &str) -> Result<f64, String> {
    let degrees = number(text)?;
    if degrees.abs() <= 90.0 {
        Ok(degrees)
    } else {
        Err("not between -90 and 90 degrees".into())
    }
}

/// A coefficient of refraction.
pub(super) fn refraction(text: &str) -> Result<f64, String> {
    let k = number(text)?;
    if (-1.0..1.0).contains(&k) {
        Ok(k)
    } else {
        Err("not from -1 to below 1".into())
    }
}

/// A filter by its name.
pub(super) fn filter() -> impl TypedValueParser<Value = FilterKind> {
    PossibleValuesParser::new(FilterKind::ALL.map(FilterKind::name)).try_map(|name| name.parse())
}

/// A part of a terrain, by its name.
#[cfg(feature = "dem")]
pub(super) fn part(text: &str) -> Result<PartKind, String> {
    let known = PartKind::NAMED.iter().find(|(name, _)| *name == text);
    known.map(|(_, kind)| *kind).ok_or_else(|| {
        let names = PartKind::NAMED.map(|(name, _)| name);
        format!("not one of {}", names.join(", "))
    })
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
