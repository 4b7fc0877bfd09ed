//! DTED levels 0 to 2, `.dt0` `.dt1` `.dt2`: columns of signed-magnitude heights in metres, from south to north.
//!
//! A file begins with the records UHL (80 bytes: place of the south-west sample, intervals in tenths of an arc second,
//! numbers of columns and rows), DSI (648) and ACC (2700), after which a record stands for each column: 8 bytes (0xAA,
//! its number in the file, its number in the tile), heights, and the sum of all these bytes; -32767 is no data
//! (MIL-PRF-89020B, sections 3.11 to 3.13). Some files leave out columns, which are no data, and some hold negative
//! heights as two's complement: as in GDAL, what would lie below -16000 m is taken as that.

use std::sync::Arc;

use super::held::{check_claim, size};
use super::open::Input;
use super::{Description, Georeference, HeightSource, ReadAt, Registration, geographic};
use crate::error::{Error, ErrorKind, Result};
use crate::grid::{Grid, Rect};
use crate::progress::Progress;

const UHL_BYTES: usize = 80;
const DSI_BYTES: u64 = 648;
const ACC_BYTES: u64 = 2700;
/// Labels of tapes that may stand before the UHL.
const MAX_LABELS: u64 = 16;
const RECORD_HEAD_BYTES: u64 = 8;
const CHECKSUM_BYTES: u64 = 4;
const SENTINEL: u8 = 0xaa;
const VOID: i16 = -32767;
/// Below this a signed-magnitude height is taken as two's complement.
const LEAST: i16 = -16000;

/// Whether a file that begins with `head` is DTED.
pub(super) fn is_dted(head: &[u8]) -> bool {
    let labels = head.chunks(UHL_BYTES);
    let mut rest = labels.skip_while(|label| label.starts_with(b"VOL") || label.starts_with(b"HDR"));
    rest.next().is_some_and(|record| record.starts_with(b"UHL"))
}

/// An open tile: its columns are read where they are asked for.
pub(super) struct Dted {
    description: Description,
    bytes: Arc<dyn ReadAt>,
    /// Where each column's record begins; none for one that is left out.
    columns: Vec<Option<u64>>,
    nodata: Option<f64>,
}

/// Opens the tile `input`.
pub(super) fn open(input: &Input) -> Result<Dted> {
    let name = input.name;
    input.options.band_index(name, 1)?;
    let bytes = input.bytes.clone();
    let (uhl, uhl_end) = find_uhl(name, bytes.as_ref())?;
    for (offset, magic) in [(uhl_end, b"DSI"), (uhl_end + DSI_BYTES, b"ACC")] {
        let mut found = [0; 3];
        bytes
            .read_exact_at(offset, &mut found)
            .map_err(|error| Error::io(name, error))?;
        if found != *magic {
            let what = format!("has no {} record", magic.escape_ascii());
            return Err(Error::new(ErrorKind::Broken, name, what).advice("fetch the file again"));
        }
    }
    let header = Header::parse(name, &uhl)?;
    let file_bytes = bytes.size_bytes();
    check_claim(name, header.width, header.height, 2, file_bytes)?;
    let data = uhl_end + DSI_BYTES + ACC_BYTES;
    let columns = find_columns(name, bytes.as_ref(), data, &header)?;

    let size = size(header.width, header.height);
    let place = header.place();
    let (spacing_m, sentence) =
        geographic::spacing_m(&place, size).map_err(|what| Error::new(ErrorKind::Broken, name, what))?;
    let mut assumed = vec![
        sentence,
        "As a DTED tile it is taken to be on WGS84, with heights in metres above mean sea level.".into(),
    ];
    let missing = columns.iter().filter(|c| c.is_none()).count();
    if missing > 0 {
        assumed.push(format!(
            "{missing} of its {} columns are not in the file, and are no data.",
            columns.len()
        ));
    }
    let grid = Grid::new(size.width, size.height, spacing_m);
    grid.check()
        .map_err(|what| Error::new(ErrorKind::Broken, name, what))?;
    Ok(Dted {
        description: Description {
            grid,
            format: "DTED".into(),
            sample_type: "int16".into(),
            step_m: Some(1.0),
            place: Some(place),
            vertical_unit: "metre".into(),
            assumed,
            name: name.into(),
        },
        bytes,
        columns,
        nodata: input.options.nodata,
    })
}

/// The UHL record and where it ends.
fn find_uhl(name: &str, bytes: &dyn ReadAt) -> Result<([u8; UHL_BYTES], u64)> {
    let mut record = [0; UHL_BYTES];
    for label in 0..MAX_LABELS {
        let offset = label * UHL_BYTES as u64;
        bytes
            .read_exact_at(offset, &mut record)
            .map_err(|error| Error::io(name, error))?;
        if record.starts_with(b"UHL") {
            return Ok((record, offset + UHL_BYTES as u64));
        }
        if !(record.starts_with(b"VOL") || record.starts_with(b"HDR")) {
            break;
        }
    }
    Err(Error::new(
        ErrorKind::Broken,
        name,
        "has no UHL record, so it is no DTED tile",
    )
    .advice("check that the file is what its name says"))
}

/// What the UHL record says.
struct Header {
    width: u64,
    height: u64,
    /// Degrees between columns and between rows.
    step: [f64; 2],
    /// Longitude and latitude of the south-west sample.
    corner: [f64; 2],
}

impl Header {
    fn parse(name: &str, uhl: &[u8; UHL_BYTES]) -> Result<Self> {
        let field =
            |at: usize, length: usize| std::str::from_utf8(&uhl[at..at + length]).unwrap_or("").trim();
        let broken = |what: String| Error::new(ErrorKind::Broken, name, what).advice("fetch the file again");
        let whole = |at: usize, length: usize, what: &str| {
            let text = field(at, length);
            text.parse::<u32>()
                .map_err(|_| broken(format!("its UHL gives {what} as {text:?}")))
        };
        let width = whole(47, 4, "the number of columns")?;
        let height = whole(51, 4, "the number of rows")?;
        let steps = [
            whole(20, 4, "the interval of columns")?,
            whole(24, 4, "the interval of rows")?,
        ];
        if width == 0 || height == 0 || steps.contains(&0) {
            return Err(broken(format!(
                "its UHL gives {width} x {height} samples, {steps:?} tenths of a second apart"
            )));
        }
        // Degrees in three digits, minutes and seconds in two each, and a letter.
        let angle = |at: usize| {
            let (degrees, minutes, seconds) = (
                whole(at, 3, "the origin's degrees")?,
                whole(at + 3, 2, "the origin's minutes")?,
                whole(at + 5, 2, "the origin's seconds")?,
            );
            let letter = uhl[at + 7].to_ascii_uppercase();
            let value = f64::from(degrees) + f64::from(minutes) / 60.0 + f64::from(seconds) / 3600.0;
            match letter {
                b'S' | b'W' => Ok((-value, letter)),
                b'N' | b'E' => Ok((value, letter)),
                other => Err(broken(format!(
                    "its UHL gives the origin's side as \"{}\"",
                    other.escape_ascii()
                ))),
            }
        };
        let (first, second) = (angle(4)?, angle(12)?);
        // The first edition of the standard had longitude and latitude swapped.
        let corner = if matches!(first.1, b'N' | b'S') {
            [second.0, first.0]
        } else {
            [first.0, second.0]
        };
        Ok(Self {
            width: width.into(),
            height: height.into(),
            step: steps.map(|s| f64::from(s) / 36000.0),
            corner,
        })
    }

    fn record_bytes(&self) -> u64 {
        RECORD_HEAD_BYTES + 2 * self.height + CHECKSUM_BYTES
    }

    fn place(&self) -> Georeference {
        let [dx, dy] = self.step;
        let [west, south] = self.corner;
        Georeference {
            crs: Some("EPSG:4326".into()),
            origin: [west, south + (self.height - 1) as f64 * dy],
            pixel: [dx, -dy],
            registration: Registration::Point,
            geographic: true,
        }
    }
}

/// Where each column's record begins: each says which column of the tile it is.
fn find_columns(name: &str, bytes: &dyn ReadAt, data: u64, header: &Header) -> Result<Vec<Option<u64>>> {
    let record_bytes = header.record_bytes();
    let room = bytes.size_bytes().saturating_sub(data) / record_bytes;
    let mut columns = vec![None; header.width as usize];
    for k in 0..room.min(header.width) {
        let at = data + k * record_bytes;
        let mut head = [0; RECORD_HEAD_BYTES as usize];
        bytes
            .read_exact_at(at, &mut head)
            .map_err(|error| Error::io(name, error))?;
        let broken = |what: String| {
            Err(Error::new(
                ErrorKind::Broken,
                name,
                format!("record {k}, at byte {at}, {what}"),
            )
            .advice("fetch the file again"))
        };
        if head[0] != SENTINEL {
            return broken(format!(
                "begins with {:#04x} and not with {SENTINEL:#04x}",
                head[0]
            ));
        }
        let column = usize::from(u16::from_be_bytes([head[4], head[5]]));
        match columns.get_mut(column) {
            None => return broken(format!("is column {column} of {}", header.width)),
            Some(Some(_)) => return broken(format!("is column {column} once more")),
            Some(place) => *place = Some(at),
        }
    }
    let spare = bytes.size_bytes().saturating_sub(data) % record_bytes;
    if room < header.width && (spare != 0 || room == 0) {
        let what = format!("ends within column {room} of {}", header.width);
        return Err(Error::new(ErrorKind::Broken, name, what).advice("fetch the file again"));
    }
    Ok(columns)
}

/// A signed-magnitude height.
fn metres(bytes: [u8; 2]) -> i16 {
    let stored = i16::from_be_bytes(bytes);
    if stored >= 0 {
        return stored;
    }
    let value = -(stored & i16::MAX);
    if value < LEAST && value != VOID {
        stored
    } else {
        value
    }
}

impl HeightSource for Dted {
    fn description(&self) -> &Description {
        &self.description
    }

    fn held_bytes(&self) -> u64 {
        self.bytes.held_bytes() + size_of_val(&self.columns[..]) as u64
    }

    fn read(&self, rect: Rect, out: &mut [f32]) -> Result<()> {
        self.description.check_rect(rect, out)?;
        let (rows, width) = (rect.height() as usize, rect.width() as usize);
        let mut bytes = vec![0; 2 * rows];
        for (i, x) in (rect.x0..rect.x1).enumerate() {
            let column = out.iter_mut().skip(i).step_by(width);
            let Some(at) = self.columns[x as usize] else {
                column.for_each(|h| *h = f32::NAN);
                continue;
            };
            // Rows count from the north, heights from the south.
            let south = (self.description.grid.size.height - rect.z1) as u64;
            self.bytes
                .read_exact_at(at + RECORD_HEAD_BYTES + 2 * south, &mut bytes)
                .map_err(|error| Error::io(&self.description.name, error))?;
            for (h, pair) in column.zip(bytes.as_chunks::<2>().0.iter().rev()) {
                let value = metres(*pair);
                let void = value == VOID || self.nodata == Some(f64::from(value));
                *h = if void { f32::NAN } else { value.into() };
            }
        }
        Ok(())
    }

    /// Columns whose checksum is wrong are read as they stand, as GDAL does, and counted.
    fn remarks(&self, progress: &dyn Progress) -> Result<Vec<String>> {
        let name = &self.description.name;
        let height = self.description.grid.size.height as usize;
        let mut record = vec![0; (RECORD_HEAD_BYTES + CHECKSUM_BYTES) as usize + 2 * height];
        let mut wrong = 0;
        for at in self.columns.iter().flatten() {
            if progress.cancelled() {
                return Err(Error::cancelled(name));
            }
            self.bytes
                .read_exact_at(*at, &mut record)
                .map_err(|error| Error::io(name, error))?;
            let (summed, sum) = record.split_at(record.len() - CHECKSUM_BYTES as usize);
            let is = summed.iter().fold(0u32, |s, b| s.wrapping_add((*b).into()));
            wrong += u64::from(sum != is.to_be_bytes());
        }
        Ok(match wrong {
            0 => Vec::new(),
            n => vec![format!(
                "The checksum of {n} of {} columns is wrong; their heights are read as they stand.",
                self.columns.len()
            )],
        })
    }
}

#[cfg(test)]
mod tests;
