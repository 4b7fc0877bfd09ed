//! Files of bare samples, `.raw`, `.r16`, `.r32`, whose size and type the user tells.

use super::flat::{Flat, Layout};
use super::held::bare_description;
use super::open::Input;
use super::sample::Coding;
use super::{RawLayout, SampleType};
use crate::error::{Error, ErrorKind, Result};

/// Opens the samples `input`, of `raw`. The file must be exactly as long as they are.
pub(super) fn open(input: &Input, raw: RawLayout) -> Result<Flat> {
    let Input { name, options, .. } = *input;
    options.band_index(name, 1)?;
    let RawLayout {
        width,
        height,
        sample,
        big_endian,
    } = raw;
    let coding = Coding {
        sample,
        big_endian,
        nodata: options.nodata,
    };
    let layout = Layout::dense(width, height, coding);
    let file_bytes = input.bytes.size_bytes();
    let needed = (u128::from(width) * u128::from(height)).saturating_mul(sample.bytes() as u128);
    if needed != u128::from(file_bytes) {
        let what = format!(
            "has {file_bytes} bytes, {width} x {height} samples of {} are {needed}",
            sample.name()
        );
        return Err(
            Error::new(ErrorKind::Misuse, name, what).advice("give its true size and type with --raw")
        );
    }
    let size = layout.check(name, file_bytes)?;
    let mut description = bare_description(name, "raw", sample.name(), size);
    description.step_m = sample.integer().then_some(1.0);
    if sample.bytes() > 1 {
        let order = if big_endian { "most" } else { "least" };
        description.assumed.push(format!(
            "The {order} significant byte of a sample is taken as the first."
        ));
    }
    Flat::new(description, input.bytes.clone(), layout)
}

/// Whether a name's ending promises bare samples.
pub(super) fn is_raw(ending: &str) -> bool {
    matches!(ending, "raw" | "r8" | "r16" | "r32")
}

/// What is wrong where size and type are not told.
pub(super) fn untold(name: &str, ending: &str) -> Error {
    let sample = match ending {
        "r8" => SampleType::U8,
        "r32" => SampleType::F32,
        _ => SampleType::U16,
    };
    Error::new(
        ErrorKind::Misuse,
        name,
        "has no header, so its size and type must be told",
    )
    .advice(format!("give them, as in --raw 1024x1024:{}", sample.name()))
}

#[cfg(test)]
mod tests {
    use super::super::{HeightSource, OpenOptions};
    use super::*;

    #[test]
    fn the_size_must_be_true() {
        let options = OpenOptions {
            nodata: Some(0.0),
            ..OpenOptions::default()
        };
        let raw = RawLayout {
            width: 3,
            height: 1,
            sample: SampleType::U16,
            big_endian: true,
        };
        let bytes = vec![0, 0, 1, 0, 0, 1];
        let flat = open(&Input::bare("a.r16", bytes.clone(), &options), raw).unwrap();
        let mut out = [0.0; 3];
        flat.read(flat.description().grid.size.rect(), &mut out).unwrap();
        assert!(out[0].is_nan() && out[1..] == [256.0, 1.0]);
        for (width, height) in [(2, 1), (4, 1), (u64::MAX, u64::MAX), (0, 0)] {
            let wrong = RawLayout { width, height, ..raw };
            let error = open(&Input::bare("a.r16", bytes.clone(), &options), wrong)
                .err()
                .unwrap();
            assert_eq!(error.kind(), ErrorKind::Misuse, "{error}");
        }
    }
}
