//! SRTM tiles, `.hgt`: a rectangle of big-endian 16-bit heights without a header.
//!
//! A tile of one degree holds 1201 x 1201 (3 arc seconds), 3601 x 3601 (1 arc second) or, beyond 50 degrees north or
//! south, 1801 x 3601 (2 by 1 arc seconds) heights in metres above the EGM96 geoid, rows from north to south, -32768
//! for no data; samples lie on whole arc seconds, so neighbours share their border. The name, as `N42E001.hgt`, is the
//! place of the *south-west* sample (USGS, SRTM Topo, quickstart document of version 2, sections 2.1.1 to 2.1.3).

use super::flat::{Flat, Layout};
use super::open::Input;
use super::sample::Coding;
use super::{Description, Georeference, Registration, SampleType, geographic};
use crate::error::{Error, ErrorKind, Result};
use crate::grid::Grid;

/// Columns and rows of a tile.
const SIZES: [[u64; 2]; 3] = [[1201, 1201], [3601, 3601], [1801, 3601]];
const VOID: f64 = -32768.0;

/// Opens the tile `input`, whose own name or whose archive's tells its place, as `N42E001.hgt`.
pub(super) fn open(input: &Input) -> Result<Flat> {
    let Input { name, options, .. } = *input;
    options.band_index(name, 1)?;
    let length = input.bytes.size_bytes();
    let [width, height] = SIZES
        .into_iter()
        .find(|[w, h]| 2 * w * h == length)
        .ok_or_else(|| {
            let all = SIZES
                .map(|[w, h]| format!("{} ({w} x {h})", 2 * w * h))
                .join(" or ");
            let what = format!("{length} bytes are no SRTM tile, which has {all}");
            Error::new(ErrorKind::Broken, name, what).advice("fetch the file again")
        })?;
    let [longitude, latitude] = corner(input.file_name).or_else(|| corner(name)).ok_or_else(|| {
        Error::new(
            ErrorKind::Broken,
            name,
            "the name of an SRTM tile must tell its place",
        )
        .advice("name it like N42E001.hgt, after its south-west corner")
    })?;
    let coding = Coding {
        sample: SampleType::I16,
        big_endian: true,
        nodata: Some(options.nodata.unwrap_or(VOID)),
    };
    let layout = Layout::dense(width, height, coding);
    let size = layout.check(name, length)?;
    let place = Georeference {
        crs: Some("EPSG:4326".into()),
        origin: [longitude, latitude + 1.0],
        pixel: [1.0 / (width - 1) as f64, -1.0 / (height - 1) as f64],
        registration: Registration::Point,
        geographic: true,
    };
    let (spacing_m, sentence) =
        geographic::spacing_m(&place, size).map_err(|what| Error::new(ErrorKind::Broken, name, what))?;
    let description = Description {
        grid: Grid::new(size.width, size.height, spacing_m),
        format: "SRTM".into(),
        sample_type: coding.sample.name().into(),
        step_m: Some(1.0),
        place: Some(place),
        vertical_unit: "metre".into(),
        assumed: vec![
            sentence,
            "As an SRTM tile it is taken to be on WGS84, with heights in metres above the EGM96 geoid."
                .into(),
        ],
        name: name.into(),
    };
    Flat::new(description, input.bytes.clone(), layout)
}

/// Longitude and latitude of the south-west sample, from a name like `N42E001` or `s29w072`, with or without
/// folders and endings.
fn corner(name: &str) -> Option<[f64; 2]> {
    let stem = name.rsplit(['/', '\\']).next()?.split('.').next()?;
    let tile = stem.get(..7)?;
    let number = |range: std::ops::Range<usize>| {
        let digits = tile.get(range)?;
        if !digits.bytes().all(|b| b.is_ascii_digit()) {
            return None;
        }
        digits.parse::<f64>().ok()
    };
    let sign = |at: usize, plus: u8, minus: u8| match tile.as_bytes()[at].to_ascii_uppercase() {
        c if c == plus => Some(1.0),
        c if c == minus => Some(-1.0),
        _ => None,
    };
    let latitude = sign(0, b'N', b'S')? * number(1..3)?;
    let longitude = sign(3, b'E', b'W')? * number(4..7)?;
    let on_earth = (-90.0..90.0).contains(&latitude) && (-180.0..180.0).contains(&longitude);
    on_earth.then_some([longitude, latitude])
}

#[cfg(test)]
mod tests {
    use super::super::{HeightSource, OpenOptions};
    use super::*;
    use crate::grid::Rect;

    fn open(name: &str, bytes: &[u8]) -> Result<Flat> {
        super::open(&Input::bare(name, bytes.to_vec(), &OpenOptions::default()))
    }

    fn tile() -> Vec<u8> {
        let mut bytes = vec![0u8; 2 * 1201 * 1201];
        let mut put = |x: usize, z: usize, h: i16| {
            bytes[2 * (z * 1201 + x)..][..2].copy_from_slice(&h.to_be_bytes());
        };
        put(0, 0, 1234);
        put(1200, 0, -32768);
        put(0, 1200, -5);
        put(1200, 1200, 32767);
        bytes
    }

    #[test]
    fn rows_run_from_north_and_the_name_is_the_south_west_corner() {
        let held = open("some/N42E001.hgt", &tile()).unwrap();
        let d = held.description();
        let place = d.place.as_ref().unwrap();
        assert_eq!(place.origin, [1.0, 43.0]);
        let [east, south] = place.place(1200.0, 1200.0);
        assert!((east - 2.0).abs() < 1e-12 && (south - 42.0).abs() < 1e-12);
        assert_eq!((d.step_m, d.grid.base_m), (Some(1.0), 0.0));
        let mut out = vec![0.0; 1201 * 1201];
        held.read(d.grid.size.rect(), &mut out).unwrap();
        assert_eq!(
            (out[0], out[1200 * 1201], out[1201 * 1201 - 1]),
            (1234.0, -5.0, 32767.0)
        );
        assert!(out[1200].is_nan());
        let mut one = [0.0];
        held.read(Rect::new(0, 1200, 1, 1201), &mut one).unwrap();
        assert_eq!(one, [-5.0]);
    }

    #[test]
    fn names_of_all_quarters_are_understood_and_others_refused() {
        assert_eq!(corner("S29W072.hgt"), Some([-72.0, -29.0]));
        assert_eq!(corner("a\\n00e179.SRTMGL1.hgt"), Some([179.0, 0.0]));
        for bad in [
            "hills.hgt",
            "N4E001.hgt",
            "N42E1.hgt",
            "N99E001.hgt",
            "N42E180.hgt",
            "X42E001.hgt",
            "N+2E001",
        ] {
            assert_eq!(corner(bad), None, "{bad}");
        }
        assert_eq!(
            open("hills.hgt", &tile()).err().unwrap().kind(),
            ErrorKind::Broken
        );
        assert!(open("N60E001.hgt", &vec![0; 2 * 1801 * 3601]).is_ok());
        let error = open("N42E001.hgt", &tile()[..2_884_000]).err().unwrap();
        assert!(error.to_string().contains("2884000 bytes"), "{error}");
    }
}
