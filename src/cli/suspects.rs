//! Heights that look like no data which the file does not declare: numbers that programs write where they know nothing.

use crate::source::Description;

/// Numbers in use for no data, as they are stored, and how `info` prints them.
const NUMBERS: [(f64, &str); 8] = [
    (-9999.0, "-9999"),
    (-99999.0, "-99999"),
    (-32767.0, "-32767"),
    (-32768.0, "-32768"),
    (32767.0, "32767"),
    (65535.0, "65535"),
    (-3.402_823_466_385_288_6e38, "-3.4028235e38"),
    (3.402_823_466_385_288_6e38, "3.4028235e38"),
];

/// Counts of suspicious heights; the default suspects nothing.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Suspects {
    /// A height less the grid's base, the stored number's text, and how often it was seen.
    heights: Vec<(f32, &'static str, u64)>,
}

impl Suspects {
    /// The numbers as heights of a DEM: stored whole numbers may have a scale.
    pub(super) fn new(description: &Description) -> Self {
        let scale = description.step_m.unwrap_or(1.0);
        let height = |(number, text): (f64, &'static str)| {
            let h = (number * scale - description.grid.base_m) as f32;
            (h, text, 0)
        };
        Self {
            heights: NUMBERS
                .map(height)
                .into_iter()
                .filter(|(h, ..)| h.is_finite())
                .collect(),
        }
    }

    /// Looks at a height that is not void.
    pub(super) fn look_at(&mut self, height: f32) {
        for (suspect, _, count) in &mut self.heights {
            *count += u64::from(*suspect == height);
        }
    }

    /// What is suspected.
    pub(super) fn sentences(&self) -> Vec<String> {
        let seen = self.heights.iter().filter(|(.., count)| *count > 0);
        seen.map(|(_, text, count)| {
            let samples = if *count == 1 {
                "1 sample is".to_string()
            } else {
                format!("{count} samples are")
            };
            format!(
                "{samples} {text}, which looks like no data that the file does not declare; if so, give --nodata={text}."
            )
        })
        .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;

    #[test]
    fn stored_numbers_are_known_through_scale_and_base() {
        let description = |step_m, base_m| Description {
            grid: Grid {
                base_m,
                ..Grid::new(1, 1, [1.0, 1.0])
            },
            format: "test".into(),
            sample_type: "int16".into(),
            step_m,
            place: None,
            vertical_unit: "metre".into(),
            assumed: Vec::new(),
            name: "t".into(),
        };
        let mut suspects = Suspects::new(&description(Some(0.5), 100.0));
        for h in [
            -9999.0 * 0.5 - 100.0,
            -9999.0,
            32767.0 * 0.5 - 100.0,
            32767.0 * 0.5 - 100.0,
        ] {
            suspects.look_at(h);
        }
        let said = suspects.sentences();
        assert!(
            said[0].starts_with("1 sample is -9999,") && said[1].starts_with("2 samples are 32767,"),
            "{said:?}"
        );
        assert_eq!(said.len(), 2);
        let mut suspects = Suspects::new(&description(None, 0.0));
        suspects.look_at(f32::MIN);
        assert!(suspects.sentences()[0].contains("give --nodata=-3.4028235e38"));
        suspects = Suspects::default();
        suspects.look_at(-9999.0);
        assert!(suspects.sentences().is_empty());
    }
}
