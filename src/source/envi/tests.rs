//! Tests of the ENVI reader on files that the tests write.

use super::super::{Band, HeightSource, OpenOptions};
use super::*;

const HEADER: &str = "ENVI\ndescription = {\n a test}\nsamples = 2\nlines = 2\nbands = 1\nheader offset = 1\n\
                      data type = 2\ninterleave = bsq\nbyte order = 1\ndata ignore value = -7\n\
                      map info = {UTM, 1, 1, 440720, 3751320, 60, 30, 11, North,North America 1927}\n";

fn read(
    header: &str,
    bytes: Vec<u8>,
    options: &OpenOptions,
) -> Result<(crate::source::Description, Vec<f32>)> {
    let flat = open(&Input::bare("a.dat", bytes, options), header)?;
    let mut out = vec![0.0; flat.description().grid.size.samples() as usize];
    flat.read(flat.description().grid.size.rect(), &mut out)?;
    Ok((flat.description().clone(), out))
}

#[test]
fn samples_place_and_system_are_read() {
    let bytes = vec![9, 0, 1, 0xff, 0xf9, 1, 0, 0, 4];
    let (d, heights) = read(HEADER, bytes, &OpenOptions::default()).unwrap();
    assert!(heights[1].is_nan() && heights[0] == 1.0 && heights[2..] == [256.0, 4.0]);
    let place = d.place.unwrap();
    assert_eq!(
        (place.origin, place.pixel),
        ([440_750.0, 3_751_305.0], [60.0, -30.0])
    );
    assert_eq!(place.crs.as_deref(), Some("UTM 11 North North America 1927"));
    assert_eq!(d.grid.spacing_m, [60.0, 30.0]);
}

#[test]
fn bands_stand_where_the_interleave_puts_them() {
    let second = OpenOptions {
        band: Some(Band::Number(2)),
        ..OpenOptions::default()
    };
    for (order, bytes) in [
        ("bsq", vec![0, 1, 2, 3, 4, 11, 12, 13, 14]),
        ("bil", vec![0, 1, 2, 11, 12, 3, 4, 13, 14]),
        ("bip", vec![0, 1, 11, 2, 12, 3, 13, 4, 14]),
    ] {
        let header = HEADER
            .replace("bands = 1", "bands = 2")
            .replace("data type = 2", "data type = 1")
            .replace("bsq", order);
        assert_eq!(
            read(&header, bytes, &second).unwrap().1,
            [11.0, 12.0, 13.0, 14.0],
            "{order}"
        );
    }
}

#[test]
fn faults_are_named() {
    for (from, to, kind, part) in [
        (
            "lines = 2",
            "lines = 3",
            ErrorKind::Broken,
            "need 13 bytes, it has 9",
        ),
        (
            "lines = 2",
            "lines = x",
            ErrorKind::Broken,
            "\"lines\" is no whole number",
        ),
        ("lines = 2\n", "", ErrorKind::Broken, "no \"lines\""),
        (
            "data type = 2",
            "data type = 6",
            ErrorKind::Unsupported,
            "data type 6",
        ),
        (
            "byte order = 1",
            "byte order = 2",
            ErrorKind::Broken,
            "byte order 2",
        ),
        ("bsq", "bsx", ErrorKind::Broken, "interleave"),
        ("1927}", "1927, rotation=12}", ErrorKind::Unsupported, "rotated"),
        ("440720", "x", ErrorKind::Broken, "six numbers"),
        (", 60, 30", ", 60, 0", ErrorKind::Broken, "60 x 0"),
        (
            "header offset = 1",
            "header offset = 18446744073709551615",
            ErrorKind::Broken,
            "ends too early",
        ),
    ] {
        let error = read(&HEADER.replace(from, to), vec![0; 9], &OpenOptions::default()).unwrap_err();
        assert_eq!(error.kind(), kind, "{to}: {error}");
        assert!(error.to_string().contains(part), "{error} lacks {part}");
    }
}
