//! How fast one may fly before loaders fall behind.
//!
//! A camera that moves by a step of level l, along an axis, exposes a row of N samples of its window; with it the level's
//! light texels over the same ground are wanted, 2 rows of 2N samples of the next finer level's heights (for slopes) and
//! light, and N/8 patches' bounds once in 8 steps. Tiles are loaded whole: of a run of n samples the tiles of side s that
//! it touches hold `n + s - 1` in the mean. With c the seconds that a loader takes a sample of each kind, as it has taken
//! so far, a metre costs
//!
//! `sum over l of (N' c_h + 4N' (c_h + c_l) + N'/64 c_b) / (dx 2^l)`, N' with what tiles add to each,
//!
//! and as many loaders as there are share it. An upload budget allows `budget fps` bytes a second, of 4 a height and 8 for
//! each of 4 light texels over a sample. And what is read must have been wanted before: a view wants what windows will gain
//! in some seconds, but not of a window that the eye leaves in that time, so the finest level is loaded in time up to
//! `N dx` in these seconds. The smallest of the three speeds is the fastest at which every level stays fresh.

use super::shape::Shape;
use crate::grid::PATCH;
use crate::levels::Data;

/// What loading has cost so far.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    pub(super) shape: Shape,
    /// Seconds of a loader a sample: heights, bounds of a patch, light, light over a day.
    pub(super) sample_s: [f64; 4],
    pub(super) loaders: usize,
}

/// How a view is flown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flown {
    /// Clip size N.
    pub clip_size: i64,
    /// Levels that its clipmap has.
    pub levels: u32,
    /// Bytes that may be uploaded for a frame; no limit where none.
    pub upload_budget_bytes: Option<u64>,
    /// Frames a second.
    pub fps: f64,
    /// Seconds for which what windows will gain is wanted beforehand.
    pub ahead_s: f64,
}

impl Pace {
    /// The fastest flight in m/s at which every level stays fresh; infinite where nothing limits it.
    pub fn fastest_m_s(&self, flown: &Flown) -> f64 {
        let n = flown.clip_size as f64;
        let whole = |n: f64, data: Data| n + (self.shape.side(data) - 1) as f64;
        let [heights_s, bounds_s, light_s, day_s] = self.sample_s;
        let heights = |n: f64| whole(n, Data::Heights);
        let step_s = heights(n) * heights_s
            + 2.0 * heights(2.0 * n) * (heights_s + light_s + day_s)
            + whole(n / PATCH as f64, Data::Bounds) / PATCH as f64 * bounds_s;
        let light_bytes = if day_s > 0.0 { 16.0 } else { 8.0 };
        let step_bytes = n * (4.0 + 4.0 * light_bytes);
        let spacing_m = self.shape.grid.spacing_m;
        let finest_m = spacing_m[0].min(spacing_m[1]);
        let steps_a_metre: f64 = (0..flown.levels)
            .map(|l| 1.0 / (finest_m * (1i64 << l) as f64))
            .sum();
        let loaded = self.loaders as f64 / (step_s * steps_a_metre);
        let uploaded = flown.upload_budget_bytes.map_or(f64::INFINITY, |bytes| {
            bytes as f64 * flown.fps / (step_bytes * steps_a_metre)
        });
        loaded.min(uploaded).min(n * finest_m / flown.ahead_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;

    #[test]
    fn the_slowest_of_loading_uploading_and_wanting_decides() {
        let pace = |sample_s: f64, loaders| Pace {
            shape: Shape {
                grid: Grid::new(5000, 5000, [10.0, 20.0]),
                levels: 8,
                bounds_side: 256,
            },
            sample_s: [sample_s, 0.0, 0.0, 0.0],
            loaders,
        };
        let flown = |budget| Flown {
            clip_size: 256,
            levels: 1,
            upload_budget_bytes: budget,
            fps: 30.0,
            ahead_s: 0.0,
        };
        // A step of 10 m reads 511 samples of the level and 2 x 767 of the finer one.
        let want = 10.0 / ((511.0 + 2.0 * 767.0) * 1e-6);
        assert!((pace(1e-6, 1).fastest_m_s(&flown(None)) - want).abs() < 1e-6 * want);
        assert!((pace(1e-6, 2).fastest_m_s(&flown(None)) - 2.0 * want).abs() < 1e-6 * want);
        let budget = pace(1e-6, 1).fastest_m_s(&flown(Some(9216)));
        assert!((budget - 300.0).abs() < 1e-9, "a step's bytes a frame: {budget}");
        assert_eq!(pace(0.0, 1).fastest_m_s(&flown(None)), f64::INFINITY);
        let levels = |levels| Flown {
            levels,
            ..flown(None)
        };
        let [one, two] = [1, 2].map(|l| pace(1e-6, 1).fastest_m_s(&levels(l)));
        assert!((one / two - 1.5).abs() < 1e-9);
        // A window of 2560 m is left in half a second.
        let ahead = Flown {
            ahead_s: 0.5,
            ..flown(None)
        };
        assert_eq!(pace(1e-9, 1).fastest_m_s(&ahead), 5120.0);
    }
}
