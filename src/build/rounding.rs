//! What rounding a source's heights to f32 cost.

use crate::source::Description;

/// Upper bound of what rounding heights to f32 cost, in metres: 0 where the source's own type and step show
/// that f32 holds each of them, else half the spacing of f32 at the greatest, which is `most` in size.
pub(super) fn rounding_m(description: &Description, most: f32) -> f64 {
    let as_metres = matches!(description.vertical_unit.as_str(), "metre" | "unknown");
    let power_of_two = |step: f64| step.is_normal() && step.to_bits() << 12 == 0;
    let exact = as_metres
        && match description.step_m {
            // Multiples of a power of two are exact up to 24 bits.
            Some(step) => power_of_two(step) && f64::from(most) < step * f64::from(1u32 << 24),
            None => matches!(description.sample_type.as_str(), "float16" | "float32"),
        };
    if exact {
        return 0.0;
    }
    // Half of the distance to the next f32 above; what is rounded up to `most` is nearer than that.
    (f64::from(most.next_up()) - f64::from(most)) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;

    fn described(sample_type: &str, step_m: Option<f64>, unit: &str) -> Description {
        Description {
            grid: Grid::new(1, 1, [1.0, 1.0]),
            format: "test".into(),
            sample_type: sample_type.into(),
            step_m,
            place: None,
            vertical_unit: unit.into(),
            assumed: Vec::new(),
            name: "test".into(),
        }
    }

    #[test]
    fn rounding_is_0_only_where_f32_holds_every_height() {
        let of = |sample_type, step, unit, heights: &[f32]| {
            let most = heights.iter().fold(0f32, |most, h| most.max(h.abs()));
            rounding_m(&described(sample_type, step, unit), most)
        };
        assert_eq!(of("float32", None, "metre", &[0.1]), 0.0);
        assert_eq!(of("int16", Some(1.0), "unknown", &[-3.0, 2000.0]), 0.0);
        assert_eq!(of("int16", Some(0.25), "metre", &[-3.0, 2000.25]), 0.0);
        // 0.1 has no exact f32; 2000 lies among those that are 2^-13 apart.
        assert_eq!(of("int16", Some(0.1), "metre", &[2000.0]), f64::powi(2.0, -14));
        assert_eq!(of("float64", None, "metre", &[2000.0]), f64::powi(2.0, -14));
        assert_eq!(of("float32", None, "foot", &[2000.0]), f64::powi(2.0, -14));
        assert_eq!(of("int32", Some(1.0), "metre", &[16_777_216.0]), 1.0);
        assert_eq!(of("int32", Some(1.0), "metre", &[16_777_215.0]), 0.0);
        for (exact, stored) in [(1999.99999, 1999.99999f64 as f32), (0.3, 0.3f64 as f32)] {
            let bound = of("float64", None, "metre", &[stored]);
            assert!((f64::from(stored) - exact).abs() <= bound, "{exact}");
        }
    }
}
