//! Tests of the DTED reader on files that the tests write.

use super::super::OpenOptions;
use super::*;
use crate::progress::Silent;

const WIDTH: usize = 3;
const HEIGHT: usize = 4;

/// A tile of 3 x 4 at 80 W, 43 N whose sample of column x and row z from the south is `height(x, z)`.
fn tile(height: impl Fn(usize, usize) -> u16) -> Vec<u8> {
    let mut bytes = format!("UHL10800000W0430000N03000600{:19}00030004", "").into_bytes();
    bytes.resize(UHL_BYTES, b'0');
    bytes.extend(b"DSI");
    bytes.resize(UHL_BYTES + DSI_BYTES as usize, b' ');
    bytes.extend(b"ACC");
    bytes.resize(UHL_BYTES + (DSI_BYTES + ACC_BYTES) as usize, b' ');
    for x in 0..WIDTH {
        let start = bytes.len();
        bytes.extend([SENTINEL, 0, 0, x as u8, 0, x as u8, 0, 0]);
        for z in 0..HEIGHT {
            bytes.extend(height(x, z).to_be_bytes());
        }
        let sum: u32 = bytes[start..].iter().map(|b| u32::from(*b)).sum();
        bytes.extend(sum.to_be_bytes());
    }
    bytes
}

fn ramp(x: usize, z: usize) -> u16 {
    match (x, z) {
        (0, 0) => 0x8005,          // -5
        (1, 0) => 0xffff,          // no data
        (2, 0) => (-20i16) as u16, // two's complement
        _ => (100 * x + z) as u16,
    }
}

fn of(bytes: Vec<u8>) -> Result<Dted> {
    open(&Input::bare("t.dt0", bytes, &OpenOptions::default()))
}

#[test]
fn columns_become_rows_from_the_north() {
    let dted = of(tile(ramp)).unwrap();
    let d = dted.description();
    let place = d.place.as_ref().unwrap();
    let south = place.place(0.0, 3.0);
    assert!(
        (south[0] + 80.0).abs() < 1e-12 && (south[1] - 43.0).abs() < 1e-12,
        "{place:?}"
    );
    assert!(
        (place.pixel[0] - 300.0 / 36000.0).abs() < 1e-15 && (place.pixel[1] + 600.0 / 36000.0).abs() < 1e-15
    );
    let mut out = [0.0; 12];
    dted.read(d.grid.size.rect(), &mut out).unwrap();
    assert_eq!(
        out[..9],
        [3.0, 103.0, 203.0, 2.0, 102.0, 202.0, 1.0, 101.0, 201.0]
    );
    assert!(
        out[9] == -5.0 && out[10].is_nan() && out[11] == -20.0,
        "{:?}",
        &out[9..]
    );
    let mut one = [0.0; 2];
    dted.read(Rect::new(1, 1, 2, 3), &mut one).unwrap();
    assert_eq!(one, [102.0, 101.0]);
    assert!(dted.remarks(&Silent).unwrap().is_empty());
}

#[test]
fn a_wrong_checksum_is_remarked() {
    let mut bytes = tile(ramp);
    let last = bytes.len() - 6;
    bytes[last] ^= 1;
    let remarks = of(bytes).unwrap().remarks(&Silent).unwrap();
    assert!(remarks[0].contains("1 of 3 columns"), "{remarks:?}");
}

#[test]
fn columns_that_are_left_out_are_no_data() {
    let mut bytes = tile(ramp);
    let record = 12 + 2 * HEIGHT;
    let data = bytes.len() - 3 * record;
    bytes.drain(data..data + 2 * record);
    let dted = of(bytes).unwrap();
    let mut out = [0.0; 3];
    dted.read(Rect::new(0, 0, 3, 1), &mut out).unwrap();
    assert!(out[0].is_nan() && out[1].is_nan() && out[2] == 203.0, "{out:?}");
    assert!(
        dted.description()
            .assumed
            .iter()
            .any(|s| s.starts_with("2 of its 3 columns"))
    );
}

#[test]
fn labels_are_skipped_and_swapped_origins_understood() {
    let mut labelled = b"VOL1".to_vec();
    labelled.resize(UHL_BYTES, b' ');
    labelled.extend(tile(ramp));
    assert!(is_dted(&labelled) && of(labelled).is_ok());
    let mut swapped = tile(ramp);
    swapped[4..20].copy_from_slice(b"0430000N0800000W");
    let corner = of(swapped).unwrap().description.place.unwrap().place(0.0, 3.0);
    assert!((corner[0] + 80.0).abs() < 1e-12 && (corner[1] - 43.0).abs() < 1e-12);
    assert!(!is_dted(b"UHX") && !is_dted(b""));
}

#[test]
fn faults_are_named() {
    let whole = tile(ramp);
    let data = whole.len() - 3 * (12 + 2 * HEIGHT);
    let with = |at: usize, new: &[u8]| {
        let mut bytes = whole.clone();
        bytes[at..at + new.len()].copy_from_slice(new);
        bytes
    };
    for (bytes, kind, part) in [
        (with(0, b"UHX"), ErrorKind::Broken, "no UHL"),
        (with(80, b"XSI"), ErrorKind::Broken, "no DSI"),
        (with(728, b"XCC"), ErrorKind::Broken, "no ACC"),
        (with(47, b"0000"), ErrorKind::Broken, "0 x 4 samples"),
        (with(47, b"x"), ErrorKind::Broken, "columns as \"x003\""),
        (with(20, b"0000"), ErrorKind::Broken, "tenths"),
        (with(11, b"Q"), ErrorKind::Broken, "side as \"Q\""),
        (with(12, b"099"), ErrorKind::Broken, "latitudes"),
        (
            with(data, &[0]),
            ErrorKind::Broken,
            "record 0, at byte 3428, begins with 0x00",
        ),
        (with(data + 5, &[9]), ErrorKind::Broken, "is column 9 of 3"),
        (with(data + 5, &[1]), ErrorKind::Broken, "is column 1 once more"),
        (
            whole[..whole.len() - 1].to_vec(),
            ErrorKind::Broken,
            "ends within column 2 of 3",
        ),
        (
            whole[..data].to_vec(),
            ErrorKind::Broken,
            "ends within column 0 of 3",
        ),
        (whole[..100].to_vec(), ErrorKind::Broken, "ends too early"),
    ] {
        let error = of(bytes).err().unwrap();
        assert_eq!(error.kind(), kind, "{error}");
        assert!(error.to_string().contains(part), "{error} lacks {part}");
    }
}
