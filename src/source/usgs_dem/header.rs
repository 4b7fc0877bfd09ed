//! Record A of a USGS DEM: what its fields at fixed bytes say.

use crate::error::{Error, ErrorKind, Result};
use crate::source::{Georeference, ReadAt, Registration};

/// Bytes that are looked at: record A and the beginning of the first profile.
const HEAD_BYTES: u64 = 1024 + 64;
const GEOGRAPHIC: i64 = 0;
const UTM: i64 = 1;

/// A number of Fortran's, whose exponent may begin with D; none where there is none.
pub(super) fn number(field: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(field).ok()?.trim().replace(['D', 'd'], "E");
    text.parse().ok()
}

/// Whether a file that begins with `head` is a USGS DEM: the codes of level of coordinates and of pattern stand where
/// they belong.
pub(in crate::source) fn is_usgs_dem(head: &[u8]) -> bool {
    let code = |at: usize| head.get(at..at + 6);
    let one_of = |at, all: &[&[u8]]| code(at).is_some_and(|c| all.contains(&c));
    one_of(150, &[b"     1", b"     4"])
        && one_of(156, &[b"     0", b"     1", b"     2", b"     3", b" -9999"])
}

/// What record A says, and where the profiles begin.
pub(super) struct Header {
    pub(super) width: u64,
    pub(super) height: u64,
    pub(super) data_start: u64,
    /// Steps between columns and rows, in the file's units.
    pub(super) step: [f64; 2],
    /// Units of height that a stored 1 stands for.
    pub(super) resolution: f64,
    /// Name and metres of the unit of heights.
    pub(super) vertical_unit: (&'static str, f64),
    /// Metres in the unit of a projected system.
    pub(super) ground_unit_m: f64,
    system: i64,
    zone: i64,
    datum: i64,
    /// Easting and northing of the first column's and the first row's samples, in the file's units.
    origin: [f64; 2],
}

impl Header {
    pub(super) fn read(name: &str, bytes: &dyn ReadAt) -> Result<Self> {
        let mut head = vec![0; bytes.size_bytes().min(HEAD_BYTES) as usize];
        bytes
            .read_exact_at(0, &mut head)
            .map_err(|error| Error::io(name, error))?;
        let broken = |what: String| Error::new(ErrorKind::Broken, name, what).advice("fetch the file again");
        if head.len() < 864 + 24 {
            return Err(broken("ends within its header".into()));
        }
        if !is_usgs_dem(&head) {
            return Err(broken(
                "is no USGS DEM: its header lacks the codes of coordinates".into(),
            ));
        }
        let real = |at: usize, length: usize, what: &str| {
            number(&head[at..at + length])
                .filter(|v| v.is_finite())
                .ok_or_else(|| {
                    let text = head[at..at + length].escape_ascii();
                    broken(format!("its header gives {what} as \"{text}\""))
                })
        };
        let data_start =
            data_start(&head).ok_or_else(|| broken("has no first profile where one belongs".into()))?;
        // The old format, of 864 bytes, has no field of the datum.
        let datum = if data_start == 864 {
            1
        } else {
            head.get(890..892)
                .and_then(|f| std::str::from_utf8(f).ok())
                .and_then(|t| t.trim().parse().ok())
                .unwrap_or(1)
        };
        let (system, zone) = (whole(&head, 156).unwrap_or(0), whole(&head, 162).unwrap_or(0));
        let ground_unit_m = match (system, whole(&head, 528)) {
            (_, Some(1)) => 1200.0 / 3937.0,
            _ => 1.0,
        };
        let vertical_unit = match whole(&head, 534) {
            Some(1) => ("foot", 0.3048),
            _ => ("metre", 1.0),
        };
        let step = [
            real(816, 12, "the step of columns")?,
            real(828, 12, "the step of rows")?,
        ];
        let resolution = real(840, 12, "the resolution of heights")?;
        if !(step[0] > 0.0 && step[1] > 0.0 && resolution > 0.0) {
            let what = format!("its header gives steps of {step:?} and a resolution of {resolution}");
            return Err(broken(what));
        }
        // South-west, north-west, north-east, south-east.
        let corner = |k: usize, axis: usize| real(546 + 48 * k + 24 * axis, 24, "a corner");
        let mut south = corner(0, 1)?.min(corner(3, 1)?);
        let mut north = corner(1, 1)?.max(corner(2, 1)?);
        let mut west = corner(0, 0)?.min(corner(1, 0)?);
        if !geographic(system) {
            // The corners are those of the quadrangle; samples stand on multiples of the step.
            south = (south / step[1]).floor() * step[1];
            north = (north / step[1]).ceil() * step[1];
            let start = data_start as usize + 24;
            let first = head.get(start..start + 24).and_then(number);
            west = first
                .filter(|x| x.is_finite())
                .ok_or_else(|| broken("has no first profile".into()))?;
        }
        let rows = (north - south) / step[1] + 1.5;
        let width = whole(&head, 858).and_then(|n| u64::try_from(n).ok()).unwrap_or(0);
        if !(1.0..1e9).contains(&rows) || width == 0 {
            let what = format!(
                "its header gives {width} profiles from {south} to {north} in steps of {}",
                step[1]
            );
            return Err(broken(what));
        }
        Ok(Self {
            width,
            height: rows as u64,
            data_start,
            step,
            resolution,
            vertical_unit,
            ground_unit_m,
            system,
            zone,
            datum,
            origin: [west, north],
        })
    }

    /// How many rows lie south of a height at northing `y`.
    pub(super) fn row_from_south(&self, y: f64) -> i64 {
        let south = self.origin[1] - (self.height - 1) as f64 * self.step[1];
        // Towards zero, as GDAL does; a cast cannot overflow.
        ((y - south) / self.step[1] + 0.5) as i64
    }

    pub(super) fn place(&self) -> Georeference {
        let geographic = geographic(self.system);
        // Degrees are given in arc seconds.
        let unit = if geographic { 1.0 / 3600.0 } else { 1.0 };
        Georeference {
            crs: self.crs(),
            origin: self.origin.map(|v| v * unit),
            pixel: [self.step[0] * unit, -self.step[1] * unit],
            registration: Registration::Point,
            geographic,
        }
    }

    /// EPSG's code of the datum's geographic system, or of a zone of UTM on it.
    fn crs(&self) -> Option<String> {
        let (degrees, utm) = match self.datum {
            1 => (4267, 26700),
            2 => (4322, 32200),
            3 => (4326, 32600),
            4 => (4269, 26900),
            _ => return None,
        };
        match self.system {
            UTM if (1..=60).contains(&self.zone) => Some(format!("EPSG:{}", utm + self.zone)),
            2 => Some(format!("State plane zone {}", self.zone)),
            _ if geographic(self.system) => Some(format!("EPSG:{degrees}")),
            _ => None,
        }
    }
}

/// Whether coordinates of a kind are arc seconds. Albers (3), which no known file has, is read as such by GDAL.
fn geographic(system: i64) -> bool {
    system == GEOGRAPHIC || system == 3
}

/// A whole number in free form, from byte `at` on.
fn whole(head: &[u8], at: usize) -> Option<i64> {
    Some(whole_and_end(head, at)?.0)
}

/// A whole number in free form, from byte `at` on, and where it ends.
fn whole_and_end(head: &[u8], at: usize) -> Option<(i64, usize)> {
    let rest = head.get(at..)?;
    let start = rest.iter().position(|b| !b.is_ascii_whitespace())?;
    let text = &rest[start..rest.len().min(start + 12)];
    let signed = usize::from(matches!(text.first(), Some(b'-' | b'+')));
    let digits = text[signed..].iter().take_while(|b| b.is_ascii_digit()).count();
    let value = std::str::from_utf8(&text[..signed + digits]).ok()?.parse().ok()?;
    Some((value, at + start + signed + digits))
}

/// Where the first profile, whose row and column are both 1, begins: after 864 bytes in the old format, 1024 in the new
/// (where some give column 0), 893 in some files of neither.
fn data_start(head: &[u8]) -> Option<u64> {
    let pair = |at: usize| {
        let (row, end) = whole_and_end(head, at)?;
        Some((row, whole(head, end)?))
    };
    [(864, 1), (1024, 1), (1024, 0), (893, 1)]
        .into_iter()
        .find(|(at, column)| pair(*at) == Some((1, *column)))
        .map(|(at, _)| at as u64)
}
