//! USGS ASCII DEM, `.dem` (also Canadian CDED): a text header and a profile of heights for each column, from south to
//! north.
//!
//! The header, record A, has fields at fixed bytes: kind of coordinates and zone (156), units of ground and heights
//! (528), corners (546), steps and resolution of heights (816), profiles (858), datum (890). A profile, record B, begins
//! with row, column, number of heights, 1, then its first place, its datum, least and greatest height; a height is a
//! whole number times the resolution, -32767 for none (USGS, Standards for Digital Elevation Models, part 2, appendices
//! 2-A and 2-B). Size and place follow from the corners as in GDAL's USGSDEM driver, so that samples agree with it:
//! quadrangles in UTM are rectangles whose profiles differ in length, and what they leave out is no data.

mod header;

use std::io::{BufReader, Read};

use self::header::{Header, number};
use super::held::{Held, Scale, Values, check_claim, size};
use super::open::Input;
use super::{Cursor, Description, geographic};
use crate::error::{Error, ErrorKind, Result};
use crate::grid::Grid;

pub(super) use self::header::is_usgs_dem;

const VOID: i64 = -32767;
/// Records are of this length, and a profile begins with one; the rest of the last may hold anything.
const RECORD_BYTES: u64 = 1024;
/// A profile's own header: four numbers of 6 letters and five of 24.
const PROFILE_HEAD_BYTES: u64 = 144;

/// Reads the DEM `input`.
pub(super) fn open(input: &Input) -> Result<Held> {
    let name = input.name;
    input.options.band_index(name, 1)?;
    let header = Header::read(name, input.bytes.as_ref())?;
    let file_bytes = input.bytes.size_bytes();
    let (width, height) = (header.width, header.height);
    if width > file_bytes / PROFILE_HEAD_BYTES {
        let what = format!("promises {width} profiles, but has only {file_bytes} bytes");
        return Err(Error::new(ErrorKind::Broken, name, what).advice("fetch the file again"));
    }
    let count = check_claim(name, width, height, 1, file_bytes)?;
    let mut values = Values::new(name, count)?;
    let mut cursor = Cursor::new(input.bytes.clone());
    std::io::Seek::seek(&mut cursor, std::io::SeekFrom::Start(header.data_start))
        .map_err(|error| Error::io(name, error))?;
    let mut words = Words {
        name,
        input: BufReader::new(cursor),
        at: header.data_start,
        next: None,
    };
    let mut outside = 0u64;
    for column in 0..width {
        let profile = Profile::read(&mut words, column)?;
        let south = header.row_from_south(profile.south);
        let shift = profile.datum / header.resolution;
        for k in 0..profile.count {
            let stored = words.whole().map_err(|e| e.in_profile(name, column))?;
            let from_south = i128::from(k) + i128::from(south);
            let Ok(row) = u64::try_from(i128::from(height) - 1 - from_south) else {
                outside += 1;
                continue;
            };
            if row >= height {
                outside += 1;
                continue;
            }
            let void = stored == VOID || input.options.nodata == Some(stored as f64);
            let value = if void { f64::NAN } else { stored as f64 + shift };
            values.set(name, (row * width + column) as usize, value)?;
        }
        if header.data_start == RECORD_BYTES {
            words.skip_to_record()?;
        }
    }
    let (unit, metres) = header.vertical_unit;
    let scale = Scale {
        scale: header.resolution * metres,
        offset: 0.0,
    };
    let heights = values.finish(name, scale)?;
    let size = size(width, height);
    let place = header.place();
    let mut assumed = Vec::new();
    let mut spacing_m = header.step.map(|s| s * header.ground_unit_m);
    if place.geographic {
        let (metres, sentence) =
            geographic::spacing_m(&place, size).map_err(|what| Error::new(ErrorKind::Broken, name, what))?;
        spacing_m = metres;
        assumed.push(sentence);
    } else {
        assumed.push(geographic::GRID_NORTH_ASSUMED.into());
    }
    if outside > 0 {
        assumed.push(format!(
            "{outside} heights of its profiles lie outside of its corners and are left out."
        ));
    }
    assumed.extend(heights.infinite_sentence());
    let description = Description {
        grid: Grid {
            base_m: heights.base_m,
            ..Grid::new(size.width, size.height, spacing_m)
        },
        format: "USGS DEM".into(),
        sample_type: "whole numbers as text".into(),
        step_m: Some(scale.scale),
        place: Some(place),
        vertical_unit: unit.into(),
        assumed,
        name: name.into(),
    };
    Held::new(description, heights.heights)
}

/// The head of a profile.
struct Profile {
    count: u32,
    /// Northing or latitude of its first height, in the file's units.
    south: f64,
    /// What is added to its heights, in their unit.
    datum: f64,
}

impl Profile {
    fn read(words: &mut Words, column: u64) -> Result<Self> {
        let name = words.name;
        let told = |fault: Fault| fault.in_profile(name, column);
        let mut heads = [0; 4];
        for head in &mut heads {
            *head = words.whole().map_err(told)?;
        }
        let mut numbers = [0.0; 5];
        for n in &mut numbers {
            *n = words.fixed().map_err(told)?;
        }
        let [_, _, count, _] = heads;
        let [_, south, datum, _, _] = numbers;
        match u32::try_from(count) {
            Ok(count) if south.is_finite() && datum.is_finite() => Ok(Self { count, south, datum }),
            _ => {
                let what = format!("profile {} gives {count} heights from {south} on", column + 1);
                Err(Error::new(ErrorKind::Broken, name, what).advice("fetch the file again"))
            }
        }
    }
}

/// What went wrong while a number was read.
enum Fault {
    Io(std::io::Error),
    End,
    Odd(String),
}

impl Fault {
    fn in_profile(self, name: &str, column: u64) -> Error {
        let profile = column + 1;
        let broken = |what: String| Error::new(ErrorKind::Broken, name, what).advice("fetch the file again");
        match self {
            Self::Io(error) => Error::io(name, error),
            Self::End => broken(format!("ends within profile {profile}")),
            Self::Odd(text) => broken(format!("profile {profile} has {text:?} where a number belongs")),
        }
    }
}

/// The numbers of the profiles, one after another.
struct Words<'n> {
    name: &'n str,
    input: BufReader<Cursor>,
    /// The byte after the last one taken.
    at: u64,
    /// A byte that was read and not taken.
    next: Option<u8>,
}

impl Words<'_> {
    fn take(&mut self) -> std::result::Result<Option<u8>, Fault> {
        let byte = match self.next.take() {
            Some(byte) => byte,
            None => {
                let mut one = [0];
                if self.input.read(&mut one).map_err(Fault::Io)? == 0 {
                    return Ok(None);
                }
                one[0]
            }
        };
        self.at += 1;
        Ok(Some(byte))
    }

    /// A whole number after any white space; it may end where the sign of the next begins.
    fn whole(&mut self) -> std::result::Result<i64, Fault> {
        let mut byte = self.take()?;
        while byte.is_some_and(|b| b.is_ascii_whitespace()) {
            byte = self.take()?;
        }
        let first = byte.ok_or(Fault::End)?;
        let (negative, mut digits, mut value) = match first {
            b'-' | b'+' => (first == b'-', 0, 0i64),
            b'0'..=b'9' => (false, 1, i64::from(first - b'0')),
            _ => return Err(Fault::Odd((first as char).to_string())),
        };
        while let Some(byte) = self.take()? {
            if !byte.is_ascii_digit() {
                self.next = Some(byte);
                self.at -= 1;
                break;
            }
            digits += 1;
            // More digits than a field has show that this is something else.
            if digits > 9 {
                return Err(Fault::Odd(format!("{value}...")));
            }
            value = 10 * value + i64::from(byte - b'0');
        }
        if digits == 0 {
            return Err(Fault::Odd((first as char).to_string()));
        }
        Ok(if negative { -value } else { value })
    }

    /// A number in a field of 24 letters.
    fn fixed(&mut self) -> std::result::Result<f64, Fault> {
        let mut field = [0; 24];
        for byte in &mut field {
            *byte = self.take()?.ok_or(Fault::End)?;
        }
        number(&field).ok_or_else(|| Fault::Odd(field.escape_ascii().to_string()))
    }

    /// Goes on to where the next record begins, or the end of the file.
    fn skip_to_record(&mut self) -> Result<()> {
        while !self.at.is_multiple_of(RECORD_BYTES) {
            match self.take() {
                Ok(Some(_)) => {}
                Ok(None) => break,
                Err(fault) => return Err(fault.in_profile(self.name, 0)),
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
