//! ESRI ASCII grids, `.asc`: a header of words and numbers, then heights as text, rows from north to south.
//!
//! Header words in any case and order: `ncols`, `nrows`, `xllcorner` or `xllcenter`, `yllcorner` or
//! `yllcenter` (of the lower left cell), `cellsize` or `dx` and `dy`, `NODATA_value` (Esri, "ASCII raster file
//! format"). Values are read as f64. The format names no reference system.

mod header;

use std::io::BufReader;

use self::header::{Header, Key, Words, key, number, shown};
use super::held::{HEIGHTS_ASSUMED, Held, Scale, Values, check_claim, size};
use super::open::Input;
use super::{Cursor, Description, unnamed};
use crate::error::{Error, ErrorKind, Result};
use crate::grid::Grid;

/// Whether a file that begins with `head` is an ESRI ASCII grid.
pub(super) fn is_ascii_grid(head: &[u8]) -> bool {
    let start = head
        .iter()
        .position(|b| !b.is_ascii_whitespace())
        .unwrap_or(head.len());
    let word: Vec<u8> = head[start..]
        .iter()
        .take_while(|b| !b.is_ascii_whitespace())
        .copied()
        .collect();
    std::str::from_utf8(&word).is_ok_and(|word| key(word).is_some())
}

/// Reads the grid `name`.
pub(super) fn open(input: &Input) -> Result<Held> {
    let name = input.name;
    input.options.band_index(name, 1)?;
    let bytes = input.bytes.clone();
    let file_bytes = bytes.size_bytes();
    let mut words = Words {
        name,
        input: BufReader::new(Cursor::new(bytes)),
        line: 1,
    };
    let (header, first) = Header::read(&mut words)?;
    let (width, height) = (header.count(name, Key::Ncols)?, header.count(name, Key::Nrows)?);
    // A value takes at least a digit and a separator.
    if u128::from(width) * u128::from(height) > u128::from(file_bytes.div_ceil(2)) {
        let what = format!("promises {width} x {height} values, but has only {file_bytes} bytes");
        return Err(Error::new(ErrorKind::Broken, name, what).advice("fetch the file again"));
    }
    let count = check_claim(name, width, height, 1, file_bytes)?;

    let mut values = Values::new(name, count)?;
    let nodata = input.options.nodata.or(header.get(Key::Nodata));
    let mut whole = true;
    let mut word = first;
    for index in 0..count {
        let Some(found) = word else {
            let what = format!("ends after {index} of {width} x {height} values");
            return Err(Error::new(ErrorKind::Broken, name, what).advice("fetch the file again"));
        };
        let value = number(name, &found)?;
        whole &= value.fract() == 0.0 || value.is_nan();
        values.set(name, index, if Some(value) == nodata { f64::NAN } else { value })?;
        word = words.next()?;
    }
    if let Some(extra) = word {
        let what = format!(
            "line {}: {:?} comes after all {width} x {height} values",
            extra.line,
            shown(&extra.text)
        );
        return Err(Error::new(ErrorKind::Broken, name, what).advice("check ncols and nrows"));
    }
    let heights = values.finish(name, Scale::METRES)?;

    let size = size(width, height);
    let pixel = header.pixel(name)?;
    let located = unnamed::locate(input, header.place(name, height)?, pixel, size)?;
    let mut assumed = located.assumed;
    assumed.push(HEIGHTS_ASSUMED.into());
    assumed.extend(heights.infinite_sentence());
    let description = Description {
        grid: Grid {
            base_m: heights.base_m,
            ..Grid::new(size.width, size.height, located.spacing_m)
        },
        format: "ESRI ASCII".into(),
        sample_type: if whole {
            "whole numbers as text"
        } else {
            "numbers as text"
        }
        .into(),
        step_m: whole.then_some(1.0),
        place: located.place,
        vertical_unit: "unknown".into(),
        assumed,
        name: name.into(),
    };
    Held::new(description, heights.heights)
}

#[cfg(test)]
mod tests {
    use super::super::{HeightSource, OpenOptions, Registration, geographic};
    use super::*;

    fn read(text: &str) -> Result<(Description, Vec<f32>)> {
        let held = open(&Input::bare(
            "t.asc",
            text.as_bytes().to_vec(),
            &OpenOptions::default(),
        ))?;
        let mut out = vec![0.0; held.description().grid.size.samples() as usize];
        held.read(held.description().grid.size.rect(), &mut out)?;
        Ok((held.description().clone(), out))
    }

    const SMALL: &str = "ncols 3\nnrows 2\nxllcorner 500000\nyllcorner 4e6\ncellsize 10\nnodata_value -9999\n\
                         1 2 -9999\n4 5.5 6\n";

    #[test]
    fn a_small_grid_is_read_with_its_place() {
        let (d, heights) = read(SMALL).unwrap();
        assert_eq!(
            (heights[0], heights[1], heights[3..].to_vec()),
            (1.0, 2.0, vec![4.0, 5.5, 6.0])
        );
        assert!(heights[2].is_nan());
        let place = d.place.unwrap();
        assert_eq!(
            (place.origin, place.pixel, place.geographic),
            ([500_005.0, 4_000_015.0], [10.0, -10.0], false)
        );
        assert_eq!((d.grid.spacing_m, d.step_m), ([10.0, 10.0], None));
        assert!(d.assumed.contains(&geographic::METRES_ASSUMED.to_string()));
    }

    #[test]
    fn centres_other_cases_and_one_value_a_line_are_read() {
        let text = "NROWS 2\r\nNCols 1\r\nXLLCENTER 500\r\nyllcenter 700\r\nDX 2\r\ndy 3\r\n7\r\n\r\n8";
        let (d, heights) = read(text).unwrap();
        assert_eq!(heights, [7.0, 8.0]);
        assert_eq!(d.place.as_ref().unwrap().origin, [500.0, 703.0]);
        assert_eq!(d.place.unwrap().registration, Registration::Point);
        assert_eq!((d.grid.spacing_m, d.step_m), ([2.0, 3.0], Some(1.0)));
    }

    #[test]
    fn degrees_are_taken_only_where_nothing_else_fits_and_said() {
        let text = SMALL
            .replace("500000", "7")
            .replace("4e6", "46")
            .replace("cellsize 10", "cellsize 0.01");
        let (d, _) = read(&text).unwrap();
        assert!(d.place.unwrap().geographic);
        assert!(d.assumed.contains(&geographic::DEGREES_ASSUMED.to_string()));
        assert!((d.grid.spacing_m[1] - 1111.5).abs() < 1.0, "{:?}", d.grid);
    }

    #[test]
    fn decimal_commas_are_points() {
        let (d, heights) = read("ncols 2\nnrows 1\ncellsize ,5E+2\nNODATA_value -1,5\n2,5 -1,5").unwrap();
        assert!(heights[0] == 2.5 && heights[1].is_nan());
        assert_eq!(d.grid.spacing_m, [50.0, 50.0]);
    }

    #[test]
    fn voids_are_what_the_header_names_in_any_spelling_and_nan() {
        for (nodata, void) in [
            ("-9999", "-9999.000"),
            ("-3.4028235e+38", "-3.4028235e38"),
            ("nan", "NaN"),
            ("1e3", "1000"),
            ("-inf", "-inf"),
        ] {
            let text = format!("ncols 2\nnrows 1\ncellsize 1\nNODATA_VALUE {nodata}\n{void} 7");
            let (_, heights) = read(&text).unwrap();
            assert!(heights[0].is_nan() && heights[1] == 7.0, "{nodata}: {heights:?}");
        }
    }

    #[test]
    fn wide_values_get_a_base() {
        let (d, heights) = read("ncols 2\nnrows 1\ncellsize 1\n10000000.25 10000001.5").unwrap();
        assert_eq!((d.grid.base_m, heights), (10_000_000.25, vec![0.0, 1.25]));
        assert!(d.place.is_none());
    }

    #[test]
    fn faults_are_named_with_their_line() {
        let cases = [
            (
                SMALL.replace("5.5", "5,5,5"),
                ErrorKind::Broken,
                "line 8: \"5,5,5\" is not a number",
            ),
            (
                SMALL.replace("5.5", "x5"),
                ErrorKind::Broken,
                "line 8: \"x5\" is not a number",
            ),
            (
                SMALL.replace(" 6", ""),
                ErrorKind::Broken,
                "ends after 5 of 3 x 2",
            ),
            (
                SMALL.replace(" 6", " 6 7"),
                ErrorKind::Broken,
                "line 8: \"7\" comes after",
            ),
            (
                SMALL.replace("ncols 3", "ncols 3.5"),
                ErrorKind::Broken,
                "ncols is 3.5",
            ),
            (
                SMALL.replace("ncols 3", "ncols -3"),
                ErrorKind::Broken,
                "ncols is -3",
            ),
            (SMALL.replace("ncols 3", "ncols 1e12"), ErrorKind::Broken, "bytes"),
            (SMALL.replace("nrows 2\n", ""), ErrorKind::Broken, "has no nrows"),
            (
                SMALL.replace("cellsize 10", "cellsize 0"),
                ErrorKind::Broken,
                "cell size of 0 x 0",
            ),
            (
                SMALL.replace("cellsize 10\n", ""),
                ErrorKind::Broken,
                "neither cellsize",
            ),
            (
                SMALL.replace("nrows 2", "ncols 2"),
                ErrorKind::Broken,
                "line 2: \"ncols\" stands there twice",
            ),
            (
                SMALL.replace("cellsize", "sellsize"),
                ErrorKind::Broken,
                "line 5: \"sellsize\"",
            ),
            (
                SMALL.replace("5.5", &"5".repeat(500)),
                ErrorKind::Broken,
                "more than 400 bytes",
            ),
            (
                "ncols 3\nnrows".into(),
                ErrorKind::Broken,
                "\"nrows\" has no value",
            ),
        ];
        for (text, kind, part) in cases {
            let error = read(&text).unwrap_err();
            assert_eq!(error.kind(), kind, "{error}");
            assert!(error.to_string().contains(part), "{error} lacks {part}");
        }
    }

    #[test]
    fn the_first_word_tells_the_format() {
        assert!(is_ascii_grid(b"  \nNCOLS 5"));
        assert!(is_ascii_grid(b"xllcorner 5"));
        assert!(!is_ascii_grid(b"ncolumns 5"));
        assert!(!is_ascii_grid(b""));
        assert!(!is_ascii_grid(&[0xff, 0xfe, 0]));
    }
}
