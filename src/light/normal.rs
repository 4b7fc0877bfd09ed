//! The surface normal at samples, by central differences.

use super::relief::LANES;
use crate::grid::Grid;

/// Slopes of the ground at samples.
pub(super) struct Slopes<'a> {
    heights: &'a [f32],
    grid: &'a Grid,
    /// One over twice the spacing.
    per_two_m: [f32; 2],
}

impl<'a> Slopes<'a> {
    /// The slopes of `heights`, as many as `grid` has samples.
    pub(super) fn new(heights: &'a [f32], grid: &'a Grid) -> Self {
        Self {
            heights,
            grid,
            per_two_m: grid.spacing_m.map(|m| (0.5 / m) as f32),
        }
    }

    /// By how much the ground rises a metre eastward and southward at each of `count`, at most [`LANES`], samples from
    /// (i, j) eastward: central differences, one-sided at the DEM's edges and beside voids, level along an axis without
    /// a valid neighbour. NaN at voids; 0 beyond `count`.
    pub(super) fn rises(&self, [i, j]: [usize; 2], count: usize) -> [[f32; LANES]; 2] {
        let (width, height) = (self.grid.size.width as usize, self.grid.size.height as usize);
        let at = j * width + i;
        let [mut east, mut south] = [[0.0; LANES]; 2];
        let mut whole = count == LANES && i > 0 && i + LANES < width && j > 0 && j + 1 < height;
        if whole {
            let lanes = |at: usize| -> &[f32; LANES] {
                self.heights[at..at + LANES]
                    .try_into()
                    .expect("the range is as long")
            };
            let (here, west, east_of) = (lanes(at), lanes(at - 1), lanes(at + 1));
            let (north, south_of) = (lanes(at - width), lanes(at + width));
            for l in 0..LANES {
                east[l] = (east_of[l] - west[l]) * self.per_two_m[0];
                south[l] = (south_of[l] - north[l]) * self.per_two_m[1];
            }
            whole = (0..LANES).fold(true, |all, l| all & !(here[l] + east[l] + south[l]).is_nan());
        }
        if !whole {
            for l in 0..count {
                [east[l], south[l]] = self.beside_gaps([i + l, j]);
            }
        }
        [east, south]
    }

    /// Rises eastward and southward where neighbours may be missing.
    #[cold]
    fn beside_gaps(&self, [i, j]: [usize; 2]) -> [f32; 2] {
        let (width, height) = (self.grid.size.width as usize, self.grid.size.height as usize);
        let at = j * width + i;
        let centre = self.heights[at];
        if centre.is_nan() {
            return [f32::NAN; 2];
        }
        let known = |inside: bool, at: usize| {
            let h = if inside { self.heights[at] } else { f32::NAN };
            (!h.is_nan()).then_some(h)
        };
        let slope = |before: Option<f32>, after: Option<f32>, per_two_m: f32| match (before, after) {
            (Some(b), Some(a)) => (a - b) * per_two_m,
            (None, Some(a)) => (a - centre) * 2.0 * per_two_m,
            (Some(b), None) => (centre - b) * 2.0 * per_two_m,
            (None, None) => 0.0,
        };
        let [columns, rows] = self.per_two_m;
        [
            slope(
                known(i > 0, at.wrapping_sub(1)),
                known(i + 1 < width, at + 1),
                columns,
            ),
            slope(
                known(j > 0, at.wrapping_sub(width)),
                known(j + 1 < height, at + width),
                rows,
            ),
        ]
    }

    /// The cosines between `direction`, a unit vector of the world (x east, y up, z south), and the normals at `count`
    /// samples from (i, j) eastward; NaN at voids.
    pub(super) fn cosines(&self, at: [usize; 2], count: usize, direction: [f32; 3]) -> [f32; LANES] {
        let [east, south] = self.rises(at, count);
        std::array::from_fn(|l| {
            let (e, s) = (east[l], south[l]);
            (direction[1] - e * direction[0] - s * direction[2]) / (1.0 + e * e + s * s).sqrt()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rise(heights: &[f32], grid: &Grid, i: usize, j: usize) -> [f32; 2] {
        let [east, south] = Slopes::new(heights, grid).rises([i, j], 1);
        [east[0], south[0]]
    }

    #[test]
    fn a_plane_has_one_slope_edges_and_voids_included() {
        let grid = Grid::new(19, 5, [2.0, 4.0]);
        let mut heights: Vec<f32> = grid
            .size
            .rect()
            .cells()
            .map(|(x, z)| (4 * x - 2 * z) as f32)
            .collect();
        heights[2 * 19 + 7] = f32::NAN;
        for (i, j) in (0..19).flat_map(|i| (0..5).map(move |j| (i, j))) {
            let got = rise(&heights, &grid, i, j);
            if (i, j) == (7, 2) {
                assert!(got[0].is_nan() && got[1].is_nan());
            } else {
                assert_eq!(got, [2.0, -0.5], "({i}, {j})");
            }
        }
        let lone = [f32::NAN, 3.0, f32::NAN];
        assert_eq!(rise(&lone, &Grid::new(3, 1, [1.0, 1.0]), 1, 0), [0.0, 0.0]);
    }

    #[test]
    fn samples_at_once_have_the_slopes_of_each_alone() {
        let grid = Grid::new(30, 7, [3.0, 5.0]);
        let mut heights = crate::pyramid::random::Random::new(3).heights(210, -90.0, 90.0, 0.2);
        heights[3 * 30 + 11] = 5.0;
        let slopes = Slopes::new(&heights, &grid);
        for (i, j) in (0..30 - LANES).flat_map(|i| (0..7).map(move |j| (i, j))) {
            let [east, south] = slopes.rises([i, j], LANES);
            let cosines = slopes.cosines([i, j], LANES, [0.6, 0.0, 0.8]);
            for l in 0..LANES {
                let [e, s] = rise(&heights, &grid, i + l, j);
                assert_eq!([e, s].map(f32::to_bits), [east[l], south[l]].map(f32::to_bits));
                let want = -(0.6 * e + 0.8 * s) / (1.0 + e * e + s * s).sqrt();
                let off = (want - cosines[l]).abs();
                assert!(if e.is_nan() { off.is_nan() } else { off <= 1e-6 });
            }
        }
    }
}
