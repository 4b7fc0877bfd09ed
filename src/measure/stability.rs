//! Numerical stability: a compact set of comparisons over synthetic DEMs, run and printed with every report.
//!
//! Each line says what is compared, the largest difference found, and the most that the arithmetic allows. The whole set,
//! with controls that break each line on purpose, is the test program `extremes`; this one takes seconds and runs on the
//! device that the rest of the report was measured on. All DEMs and cameras follow from [`SEED`].

mod ground;
mod numbers;
mod pictures;

use crate::error::Result;
use crate::gpu::Gpu;
use crate::progress::Progress;

/// The seed of all DEMs and cameras here.
pub const SEED: u64 = 7;

/// A line of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// The extreme.
    pub what: String,
    /// What was held against what, and over how much.
    pub compared: String,
    /// The largest difference found.
    pub largest: f64,
    /// The most that is allowed.
    pub allowed: f64,
    /// What both count.
    pub unit: &'static str,
}

impl Comparison {
    fn new(what: &str, compared: String, largest: f64, allowed: f64, unit: &'static str) -> Self {
        Self {
            what: what.into(),
            compared,
            largest,
            allowed,
            unit,
        }
    }

    /// Whether the difference is within what is allowed; never where it is no number.
    pub fn holds(&self) -> bool {
        self.largest <= self.allowed
    }
}

/// Runs all comparisons, those of pictures on `gpu`.
///
/// # Errors
/// [`crate::ErrorKind::Cancelled`]; [`crate::ErrorKind::Device`] where the device fails.
pub fn compare(gpu: &Gpu, progress: &dyn Progress) -> Result<Vec<Comparison>> {
    type Step = fn(&Gpu) -> Result<Comparison>;
    const STEPS: [Step; 15] = [
        |gpu| pictures::shift(gpu),
        |gpu| pictures::scale(gpu),
        |gpu| pictures::culling(gpu),
        |gpu| pictures::history(gpu),
        |gpu| pictures::metre_on_ten_million(gpu),
        |gpu| pictures::cracks(gpu),
        |gpu| pictures::certificate(gpu),
        |_| numbers::twin_heights(),
        |_| numbers::twin_places(),
        |_| numbers::whole_planes(),
        |_| numbers::planes(),
        |_| numbers::small_heights(),
        |_| numbers::large_heights(),
        |_| numbers::white_noise(),
        |_| numbers::bounds(),
    ];
    progress.begin("stability", STEPS.len() as u64);
    let mut lines = Vec::new();
    for step in STEPS {
        if progress.cancelled() {
            return Err(crate::Error::cancelled("stability"));
        }
        lines.push(step(gpu)?);
        progress.advance(1);
    }
    Ok(lines)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_number_and_more_than_allowed_do_not_hold() {
        let line = |largest, allowed| Comparison::new("x", "y".into(), largest, allowed, "m").holds();
        assert!(line(0.0, 0.0) && line(1.0, 2.0));
        assert!(!line(f64::NAN, 1.0) && !line(2.0, 1.0));
    }

    #[test]
    fn what_needs_no_device_holds() {
        for line in [
            numbers::twin_heights(),
            numbers::twin_places(),
            numbers::whole_planes(),
            numbers::planes(),
            numbers::small_heights(),
            numbers::large_heights(),
            numbers::white_noise(),
            numbers::bounds(),
        ] {
            let line = line.unwrap();
            assert!(line.holds(), "{line:?}");
        }
    }
}
