//! Tests of the USGS DEM reader on files that the tests write.

use super::super::{HeightSource, OpenOptions};
use super::*;

/// A DEM in the new format: three profiles of columns 30 apart whose heights begin at different rows.
fn file(vertical_unit: u32, resolution: &str, profiles: &[(f64, &[i32])]) -> Vec<u8> {
    let mut head = vec![b' '; 1024];
    let mut put = |at: usize, text: &str| head[at..at + text.len()].copy_from_slice(text.as_bytes());
    put(0, "A TEST");
    put(150, "     1     1    10");
    put(528, &format!("     2{vertical_unit:6}     4"));
    for (k, (x, y)) in [
        (1005.0, 2010.0),
        (1000.0, 2089.0),
        (1061.0, 2091.0),
        (1060.0, 2005.0),
    ]
    .into_iter()
    .enumerate()
    {
        put(546 + 48 * k, &format!("{x:24.12}{y:24.12}"));
    }
    put(816, &format!("0.300000E+020.300000E+02{resolution:>12}"));
    put(852, &format!("     1{:6}", profiles.len()));
    put(890, " 4");
    for (k, (south, heights)) in profiles.iter().enumerate() {
        let mut record = format!(
            "     1{:6}{:6}     1{:>24}{:>24}   0.000000000000000D+00{:>24}{:>24}",
            k + 1,
            heights.len(),
            format!("{:.3}", 1000.0 + 30.0 * k as f64),
            format!("{south:.3}"),
            "0.0",
            "0.0"
        );
        heights.iter().for_each(|h| record.push_str(&format!("{h:6}")));
        record.push_str("   999"); // beyond the promised heights
        head.extend(record.bytes());
        head.resize(head.len().next_multiple_of(1024), b' ');
    }
    head
}

fn read(bytes: Vec<u8>) -> Result<(Description, Vec<f32>)> {
    let held = open(&Input::bare("t.dem", bytes, &OpenOptions::default()))?;
    let mut out = vec![0.0; held.description().grid.size.samples() as usize];
    held.read(held.description().grid.size.rect(), &mut out)?;
    Ok((held.description().clone(), out))
}

const PROFILES: [(f64, &[i32]); 3] = [
    (2010.0, &[1, 2, 3]),
    (1980.0, &[10, -32767, 12]),
    (2070.0, &[22, -23, 24, 25]),
];

#[test]
fn profiles_stand_at_their_rows_and_the_rest_is_no_data() {
    let bytes = file(2, "0.100000E+01", &PROFILES);
    assert!(is_usgs_dem(&bytes));
    let (d, heights) = read(bytes).unwrap();
    // Northings 1980 to 2100: five rows.
    assert_eq!((d.grid.size.width, d.grid.size.height), (3, 5));
    let rows: Vec<_> = heights.chunks(3).map(<[f32]>::to_vec).collect();
    let shown = |row: &[f32]| row.iter().map(|h| format!("{h}")).collect::<Vec<_>>().join(" ");
    let all: Vec<_> = rows.iter().map(|r| shown(r)).collect();
    assert_eq!(
        all,
        ["NaN NaN -23", "3 NaN 22", "2 12 NaN", "1 NaN NaN", "NaN 10 NaN"]
    );
    let place = d.place.unwrap();
    assert_eq!((place.origin, place.pixel), ([1000.0, 2100.0], [30.0, -30.0]));
    assert_eq!(place.crs.as_deref(), Some("EPSG:26910"));
    assert_eq!((d.step_m, d.vertical_unit.as_str()), (Some(1.0), "metre"));
    assert!(
        d.assumed
            .iter()
            .any(|s| s.starts_with("2 heights of its profiles lie outside")),
        "{:?}",
        d.assumed
    );
}

#[test]
fn feet_and_resolutions_become_metres() {
    let (d, heights) = read(file(1, "1.000000D-01", &PROFILES)).unwrap();
    assert_eq!(heights[6], (2.0f64 * 0.1 * 0.3048) as f32);
    assert_eq!((d.vertical_unit.as_str(), d.grid.base_m), ("foot", 0.0));
}

#[test]
fn faults_are_named() {
    let whole = file(2, "0.100000E+01", &PROFILES);
    let with = |at: usize, new: &str| {
        let mut bytes = whole.clone();
        bytes[at..at + new.len()].copy_from_slice(new.as_bytes());
        bytes
    };
    for (bytes, part) in [
        (whole[..500].to_vec(), "ends within its header"),
        (with(150, "     7"), "lacks the codes"),
        (with(816, "           x"), "step of columns as"),
        (with(816, "0.000000E+02"), "steps of [0.0"),
        (with(840, "-1.00000E+00"), "resolution of -1"),
        (with(570, "     a"), "a corner as"),
        (with(858, "     0"), "0 profiles"),
        (with(858, "999999"), "promises 999999 profiles"),
        (with(1024, "     2"), "no first profile"),
        (with(618, "                    1e30"), "in steps of 30"),
        (whole[..1024 + 150].to_vec(), "ends within profile 1"),
        (with(1024 + 12, " 99999"), "has \".\" where a number belongs"),
        (with(1024 + 12, "    -1"), "gives -1 heights"),
        (with(1024 + 72, "                 x"), "where a number belongs"),
    ] {
        let error = read(bytes).err().unwrap_or_else(|| panic!("{part}"));
        assert_eq!(error.kind(), ErrorKind::Broken, "{error}");
        assert!(error.to_string().contains(part), "{error} lacks {part}");
    }
}
