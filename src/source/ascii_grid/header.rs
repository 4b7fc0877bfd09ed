//! The words of an ESRI ASCII grid and its header.

use std::io::{BufRead, BufReader};

use crate::error::{Error, ErrorKind, Result};
use crate::source::{Cursor, Georeference, Registration};

/// No number or header word is longer; a longer one shows that the file is something else.
const MAX_WORD_BYTES: usize = 400;

/// A word of the file and the line it stands in, counted from 1.
pub(super) struct Word {
    pub(super) text: String,
    pub(super) line: u64,
}

/// The words of the file, split at white space.
pub(super) struct Words<'n> {
    pub(super) name: &'n str,
    pub(super) input: BufReader<Cursor>,
    pub(super) line: u64,
}

impl Words<'_> {
    pub(super) fn next(&mut self) -> Result<Option<Word>> {
        let mut text = Vec::new();
        loop {
            let buffer = self
                .input
                .fill_buf()
                .map_err(|error| Error::io(self.name, error))?;
            if buffer.is_empty() {
                break;
            }
            let mut used = 0;
            let mut ended = false;
            for &byte in buffer {
                if byte.is_ascii_whitespace() {
                    ended = !text.is_empty();
                    if ended {
                        break; // the separator stays, so that a line's end counts for the next word
                    }
                    self.line += u64::from(byte == b'\n');
                } else {
                    text.push(byte);
                }
                used += 1;
                if text.len() > MAX_WORD_BYTES {
                    break;
                }
            }
            self.input.consume(used);
            if text.len() > MAX_WORD_BYTES {
                let what = format!(
                    "line {}: a word of more than {MAX_WORD_BYTES} bytes is no number",
                    self.line
                );
                return Err(Error::new(ErrorKind::Broken, self.name, what));
            }
            if ended {
                break;
            }
        }
        if text.is_empty() {
            return Ok(None);
        }
        let text = String::from_utf8(text).map_err(|_| {
            let what = format!("line {}: is not text", self.line);
            Error::new(ErrorKind::Broken, self.name, what)
        })?;
        Ok(Some(Word {
            text,
            line: self.line,
        }))
    }
}

/// At most 40 characters of a word, for a message.
pub(super) fn shown(text: &str) -> String {
    text.chars().take(40).collect()
}

/// A number, whose decimal point may be a comma.
pub(super) fn number(name: &str, word: &Word) -> Result<f64> {
    let parsed = word
        .text
        .parse()
        .or_else(|_| word.text.replacen(',', ".", 1).parse());
    parsed.map_err(|_| {
        let what = format!("line {}: {:?} is not a number", word.line, shown(&word.text));
        Error::new(ErrorKind::Broken, name, what)
    })
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Key {
    Ncols,
    Nrows,
    XCorner,
    XCenter,
    YCorner,
    YCenter,
    Cellsize,
    Dx,
    Dy,
    Nodata,
}

pub(super) const KEYS: [(&str, Key); 10] = [
    ("ncols", Key::Ncols),
    ("nrows", Key::Nrows),
    ("xllcorner", Key::XCorner),
    ("xllcenter", Key::XCenter),
    ("yllcorner", Key::YCorner),
    ("yllcenter", Key::YCenter),
    ("cellsize", Key::Cellsize),
    ("dx", Key::Dx),
    ("dy", Key::Dy),
    ("nodata_value", Key::Nodata),
];

pub(super) fn key(word: &str) -> Option<Key> {
    KEYS.iter()
        .find(|(text, _)| word.eq_ignore_ascii_case(text))
        .map(|(_, key)| *key)
}

/// The numbers of the header, in the order in which they stand.
pub(super) struct Header {
    entries: Vec<(Key, f64)>,
}

impl Header {
    /// Reads pairs of a known word and a number; returns them and the word after them.
    pub(super) fn read(words: &mut Words) -> Result<(Self, Option<Word>)> {
        let name = words.name;
        let broken = |line: u64, what: String| {
            Err(Error::new(
                ErrorKind::Broken,
                name,
                format!("line {line}: {what}"),
            ))
        };
        let mut entries: Vec<(Key, f64)> = Vec::new();
        loop {
            let Some(word) = words.next()? else {
                return Ok((Self { entries }, None));
            };
            let Some(key) = key(&word.text) else {
                // `nan` and `inf` may be the first height; any other letter begins a word not known here.
                if word.text.starts_with(char::is_alphabetic) && word.text.parse::<f64>().is_err() {
                    return broken(
                        word.line,
                        format!("{:?} is no word of an ESRI ASCII header", shown(&word.text)),
                    );
                }
                return Ok((Self { entries }, Some(word)));
            };
            if entries.iter().any(|(k, _)| *k == key) {
                return broken(word.line, format!("{:?} stands there twice", word.text));
            }
            let Some(value) = words.next()? else {
                return broken(word.line, format!("{:?} has no value", word.text));
            };
            entries.push((key, number(name, &value)?));
        }
    }

    pub(super) fn get(&self, key: Key) -> Option<f64> {
        self.entries
            .iter()
            .find(|(k, _)| *k == key)
            .map(|(_, value)| *value)
    }

    pub(super) fn count(&self, name: &str, key: Key) -> Result<u64> {
        let word = KEYS.iter().find(|(_, k)| *k == key).map_or("", |(text, _)| *text);
        match self.get(key) {
            // Whole numbers below 2^53 are exact in f64.
            Some(n) if n.fract() == 0.0 && (1.0..9e15).contains(&n) => Ok(n as u64),
            Some(n) => Err(Error::new(
                ErrorKind::Broken,
                name,
                format!("{word} is {n}, not a whole number above 0"),
            )),
            None => Err(Error::new(
                ErrorKind::Broken,
                name,
                format!("has no {word} in its header"),
            )),
        }
    }

    /// Steps between columns and rows in the file's own units, both above 0.
    pub(super) fn pixel(&self, name: &str) -> Result<[f64; 2]> {
        let cell = self.get(Key::Cellsize);
        match [self.get(Key::Dx).or(cell), self.get(Key::Dy).or(cell)] {
            [Some(dx), Some(dy)] if dx > 0.0 && dy > 0.0 && dx.is_finite() && dy.is_finite() => Ok([dx, dy]),
            [Some(dx), Some(dy)] => {
                let what = format!("has a cell size of {dx} x {dy}, which is not above 0 and finite");
                Err(Error::new(ErrorKind::Broken, name, what))
            }
            _ => Err(Error::new(
                ErrorKind::Broken,
                name,
                "has neither cellsize nor dx and dy in its header",
            )),
        }
    }

    /// Where the centre of the first value of the first row lies, if the header says.
    pub(super) fn place(&self, name: &str, rows: u64) -> Result<Option<Georeference>> {
        let [dx, dy] = self.pixel(name)?;
        let centre =
            |corner, center, step: f64| self.get(center).or_else(|| Some(self.get(corner)? + 0.5 * step));
        let west = centre(Key::XCorner, Key::XCenter, dx);
        let south = centre(Key::YCorner, Key::YCenter, dy);
        let (Some(west), Some(south)) = (west, south) else {
            return Ok(None);
        };
        if !(west.is_finite() && south.is_finite()) {
            return Err(Error::new(
                ErrorKind::Broken,
                name,
                format!("lies at {west}, {south}"),
            ));
        }
        let registration = if self.get(Key::XCenter).is_some() {
            Registration::Point
        } else {
            Registration::Area
        };
        Ok(Some(Georeference {
            crs: None,
            origin: [west, south + (rows - 1) as f64 * dy],
            pixel: [dx, -dy],
            registration,
            geographic: false,
        }))
    }
}
