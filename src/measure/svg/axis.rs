//! A logarithmic axis: where values lie on it, and where it is marked.

/// A logarithmic axis: what it says, and the range of its values.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::measure) struct Axis {
    pub(super) label: String,
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Axis {
    /// A logarithmic axis over `values`, those not above 0 left out and those that stand for no number.
    pub(in crate::measure) fn log(label: &str, values: impl Iterator<Item = f64>) -> Self {
        let (low, high) = values
            .filter(|v| (f64::MIN_POSITIVE..1e300).contains(v))
            .fold((f64::INFINITY, 0.0f64), |(low, high), v| {
                (low.min(v), high.max(v))
            });
        let (low, high) = if low <= high { (low, high) } else { (0.1, 10.0) };
        // Room at both ends, and never less than a factor of 3 between them.
        let widen = (3f64.sqrt() / (high / low).sqrt()).max(1.12);
        Self {
            label: label.into(),
            low: low / widen,
            high: high * widen,
        }
    }

    /// Where a value lies: 0 at the low end, 1 at the high one; values outside lie on the nearest end.
    pub(super) fn at(&self, value: f64) -> f64 {
        let share = (value.max(f64::MIN_POSITIVE) / self.low).ln() / (self.high / self.low).ln();
        share.clamp(0.0, 1.0)
    }

    /// Values at which the axis is marked.
    pub(super) fn ticks(&self) -> Vec<f64> {
        let (from, to) = (self.low.log10().floor() as i32, self.high.log10().ceil() as i32);
        // The fewer powers of ten, the more between them.
        let steps: &[f64] = match (self.high / self.low).log10() {
            powers if powers < 0.9 => &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0],
            powers if powers < 4.0 => &[1.0, 2.0, 5.0],
            _ => &[1.0],
        };
        let all = (from..=to).flat_map(|k| steps.iter().map(move |m| m * 10f64.powi(k)));
        all.filter(|v| (self.low..=self.high).contains(v)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_hold_their_values_and_are_marked_within() {
        for axis in [
            Axis::log("x", [0.2, 40.0, f64::NAN, 0.0].into_iter()),
            Axis::log("x", [1e-9, 1e7].into_iter()),
            Axis::log("x", [5.0].into_iter()),
            Axis::log("x", std::iter::empty()),
        ] {
            let ticks = axis.ticks();
            assert!((1..=20).contains(&ticks.len()), "{axis:?}: {ticks:?}");
            for tick in ticks {
                assert!((axis.low..=axis.high).contains(&tick), "{axis:?}: {tick}");
            }
        }
        let axis = Axis::log("x", [1.0, 100.0].into_iter());
        assert!((axis.at(10.0) - 0.5).abs() < 1e-12);
        assert_eq!((axis.at(0.0), axis.at(1e9)), (0.0, 1.0));
    }
}
