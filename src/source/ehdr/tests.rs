//! Tests of the ESRI BIL reader on files that the tests write.

use super::super::{Band, HeightSource, OpenOptions};
use super::*;

fn read(
    name: &str,
    header: &str,
    bytes: Vec<u8>,
    options: &OpenOptions,
) -> Result<(crate::source::Description, Vec<f32>)> {
    let flat = open(&Input::bare(name, bytes, options), header)?;
    let mut out = vec![0.0; flat.description().grid.size.samples() as usize];
    flat.read(flat.description().grid.size.rect(), &mut out)?;
    Ok((flat.description().clone(), out))
}

const PLACE: &str = "ULXMAP 1000\nULYMAP 2000\nXDIM 10\nYDIM 20\n";

#[test]
fn a_float_grid_with_its_place_by_the_lower_left_corner() {
    let header = "ncols 2\nnrows 2\ncellsize 10\nxllcorner 100\nyllcorner 200\nNODATA_value -9999\n\
                  byteorder LSBFIRST\n";
    let bytes = [1.5f32, -9999.0, 3.0, 4.0]
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    let (d, heights) = read("a.flt", header, bytes, &OpenOptions::default()).unwrap();
    assert!(heights[1].is_nan() && heights[0] == 1.5 && heights[2..] == [3.0, 4.0]);
    let place = d.place.unwrap();
    assert_eq!(
        (place.origin, place.registration),
        ([105.0, 215.0], Registration::Area)
    );
    assert_eq!(d.sample_type, "float32");
}

#[test]
fn layouts_put_a_band_where_it_is() {
    // Two bands of 2 x 2 bytes: 1 to 4 and 11 to 14.
    let second = OpenOptions {
        band: Some(Band::Number(2)),
        ..OpenOptions::default()
    };
    for (layout, bytes) in [
        ("BIL", vec![1, 2, 11, 12, 3, 4, 13, 14]),
        ("BIP", vec![1, 11, 2, 12, 3, 13, 4, 14]),
        ("BSQ", vec![1, 2, 3, 4, 11, 12, 13, 14]),
        ("BSQ\nBANDGAPBYTES 1", vec![1, 2, 3, 4, 0, 11, 12, 13, 14]),
        (
            "BIL\nSKIPBYTES 1\nBANDROWBYTES 3\nTOTALROWBYTES 7",
            vec![0, 1, 2, 0, 11, 12, 0, 0, 3, 4, 0, 13, 14, 0, 0],
        ),
    ] {
        let header = format!("NROWS 2\nNCOLS 2\nNBANDS 2\nNBITS 8\nLAYOUT {layout}\n{PLACE}");
        let (d, heights) = read("a.bil", &header, bytes.clone(), &second).unwrap();
        assert_eq!(heights, [11.0, 12.0, 13.0, 14.0], "{layout}");
        assert_eq!(d.place.unwrap().origin, [1000.0, 2000.0]);
        let error = read("a.bil", &header, bytes, &OpenOptions::default()).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Unsupported, "{error}");
    }
}

#[test]
fn types_follow_what_is_said_and_else_the_length() {
    let of = |extra: &str, name: &str, bytes: usize| {
        let header = format!("NROWS 1\nNCOLS 2\nBYTEORDER I\n{extra}");
        read(name, &header, vec![0; bytes], &OpenOptions::default()).map(|(d, _)| d.sample_type)
    };
    assert_eq!(of("", "a.bil", 8).unwrap(), "float32");
    assert_eq!(of("", "a.bil", 4).unwrap(), "uint16");
    assert_eq!(of("NODATA -1", "a.bil", 4).unwrap(), "int16");
    assert_eq!(of("NBITS 16\nPIXELTYPE SIGNEDINT", "a.bil", 4).unwrap(), "int16");
    assert_eq!(of("NBITS 32", "a.flt", 8).unwrap(), "float32");
    assert_eq!(of("NBITS 32", "a.bil", 8).unwrap(), "uint32");
    assert_eq!(of("PIXELTYPE FLOAT", "a.bil", 8).unwrap(), "float32");
    assert_eq!(
        of("NBITS 1", "a.bil", 1).unwrap_err().kind(),
        ErrorKind::Unsupported
    );
}

#[test]
fn faults_are_named() {
    for (header, kind, part) in [
        (
            "NROWS 2\nNCOLS 2\nNBITS 16",
            ErrorKind::Broken,
            "need 8 bytes, it has 4",
        ),
        (
            "NROWS 2\nNCOLS two",
            ErrorKind::Broken,
            "NCOLS, \"two\", is no whole number",
        ),
        ("NROWS 2\nNCOLS -2", ErrorKind::Broken, "is no whole number"),
        ("NROWS 0\nNCOLS 2", ErrorKind::Broken, "2 x 0"),
        ("NROWS 2", ErrorKind::Broken, "no NCOLS"),
        ("NROWS 2\nNCOLS 2\nLAYOUT BIX", ErrorKind::Broken, "none of BIL"),
        (
            "NROWS 2\nNCOLS 2\nBYTEORDER X",
            ErrorKind::Unsupported,
            "BYTEORDER",
        ),
        ("NROWS 2\nNCOLS 2\nXDIM 0\nYDIM 1", ErrorKind::Broken, "cell size"),
        (
            "NROWS 2\nNCOLS 2\nSKIPBYTES 99999999999999999999",
            ErrorKind::Broken,
            "SKIPBYTES",
        ),
        (
            "NROWS 2\nNCOLS 2\nSKIPBYTES 18446744073709551615",
            ErrorKind::Broken,
            "ends too early",
        ),
        (
            "NROWS 2\nNCOLS 2\nNBANDS 1\nTOTALROWBYTES 18446744073709551615",
            ErrorKind::Broken,
            "ends too early",
        ),
        (
            "NROWS 1000000\nNCOLS 1000000\nNBITS 8",
            ErrorKind::Limit,
            "more than",
        ),
    ] {
        let error = read("a.bil", header, vec![0; 4], &OpenOptions::default()).unwrap_err();
        assert_eq!(error.kind(), kind, "{header}: {error}");
        assert!(error.to_string().contains(part), "{error} lacks {part}");
    }
}
