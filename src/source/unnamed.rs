//! Where a grid lies whose file gives coordinates but names no reference system; a `.prj` file beside it may.

use super::open::Input;
use super::{Georeference, geographic};
use crate::error::{Error, ErrorKind, Result};
use crate::grid::Size;

/// The most bytes of a `.prj` file that are read: the longest WKT in use has some thousands.
const PRJ_BYTES: u64 = 1 << 16;

/// What is known of a grid's place.
pub(super) struct Located {
    pub(super) place: Option<Georeference>,
    pub(super) spacing_m: [f64; 2],
    pub(super) assumed: Vec<String>,
}

impl Located {
    /// For a file that says nothing of its place or its spacing.
    pub(super) fn nowhere() -> Self {
        Self {
            place: None,
            spacing_m: [1.0, 1.0],
            assumed: vec!["The file does not say where it lies: the spacing is taken as 1 m.".into()],
        }
    }
}

/// Completes `place`, whose reference system is not known yet, of `size` samples; `pixel` are the steps in its units.
///
/// # Errors
/// [`ErrorKind::Broken`] where degrees lie off the earth.
pub(super) fn locate(
    input: &Input,
    place: Option<Georeference>,
    pixel: [f64; 2],
    size: Size,
) -> Result<Located> {
    let system = if place.is_some() { beside(input)? } else { None };
    locate_in(input.name, system, place, pixel, size)
}

/// The same with the `system` that the file itself names, if it names one.
///
/// # Errors
/// As [`locate`].
pub(super) fn locate_in(
    name: &str,
    system: Option<System>,
    place: Option<Georeference>,
    pixel: [f64; 2],
    size: Size,
) -> Result<Located> {
    let mut located = Located {
        place: None,
        spacing_m: pixel,
        assumed: Vec::new(),
    };
    let Some(mut place) = place else {
        let sentence = "The file does not say where it lies; its cell size is taken to be in metres.";
        located.assumed.push(sentence.into());
        return Ok(located);
    };
    place.geographic = match &system {
        Some(system) => system.metres.is_none(),
        None => geographic::looks_like_degrees(&place, size),
    };
    if place.geographic {
        let (metres, sentence) =
            geographic::spacing_m(&place, size).map_err(|what| Error::new(ErrorKind::Broken, name, what))?;
        located.spacing_m = metres;
        if system.is_none() {
            located.assumed.push(geographic::DEGREES_ASSUMED.into());
        }
        located.assumed.push(sentence);
    } else if let Some(metres) = system.as_ref().and_then(|s| s.metres) {
        located.spacing_m = pixel.map(|p| p * metres);
        located.assumed.push(geographic::GRID_NORTH_ASSUMED.into());
    } else {
        located.assumed.push(geographic::METRES_ASSUMED.into());
    }
    place.crs = system.map(|s| s.text);
    located.place = Some(place);
    Ok(located)
}

/// A reference system as a file gives it.
pub(super) struct System {
    /// Its WKT on one line, or the file's own words.
    pub(super) text: String,
    /// Metres in its unit; none for degrees.
    pub(super) metres: Option<f64>,
}

/// The reference system in the `.prj` file beside `input`. One that is not understood is as good as none.
fn beside(input: &Input) -> Result<Option<System>> {
    let Some(bytes) = (input.beside)("prj")? else {
        return Ok(None);
    };
    let mut text = vec![0; bytes.size_bytes().min(PRJ_BYTES) as usize];
    bytes
        .read_exact_at(0, &mut text)
        .map_err(|error| Error::io(input.name, error))?;
    Ok(String::from_utf8(text).ok().and_then(|text| parse(&text)))
}

/// Reads WKT of a geographic or projected system: the last unit of the latter is that of its coordinates (OGC 01-009,
/// section 7.2).
pub(super) fn parse(text: &str) -> Option<System> {
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let geographic = text.starts_with("GEOGCS[");
    if !geographic && !text.starts_with("PROJCS[") {
        return None;
    }
    let metres = if geographic {
        None
    } else {
        let unit = &text[text.rfind("UNIT[")?..];
        let factor = unit.split([',', ']']).nth(1)?.trim().parse::<f64>().ok()?;
        Some(factor).filter(|f| f.is_finite() && *f > 0.0)
    };
    (geographic || metres.is_some()).then_some(System { text, metres })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_come_from_the_last_unit_of_the_text() {
        let projected = "PROJCS[\"a\",GEOGCS[\"b\",UNIT[\"Degree\",0.0174532925199433]],\n UNIT[\"Foot_US\",0.3048006096]]";
        let system = parse(projected).unwrap();
        assert_eq!(system.metres, Some(0.304_800_609_6));
        assert!(!system.text.contains('\n'));
        assert_eq!(
            parse("GEOGCS[\"b\",UNIT[\"Degree\",0.0174]]").unwrap().metres,
            None
        );
        for other in [
            "",
            "Projection UTM",
            "PROJCS[\"a\"]",
            "PROJCS[UNIT[\"m\",0]]",
            "PROJCS[UNIT[\"m\",x]]",
        ] {
            assert!(parse(other).is_none(), "{other}");
        }
    }
}
