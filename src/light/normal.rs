//! The surface normal at samples, by central differences.

use super::relief::LANES;

/// Slopes of the ground at samples.
pub(super) struct Slopes<'a> {
    /// Rows of heights with one sample more on every side of those that are asked for; NaN where there is none.
    heights: &'a [f32],
    stride: usize,
    /// One over twice the spacing.
    per_two_m: [f32; 2],
}

impl<'a> Slopes<'a> {
    /// The slopes of `heights`, whose rows are `stride` samples apart and begin one sample west and one north of the
    /// first that is asked for.
    pub(super) fn new(heights: &'a [f32], stride: usize, spacing_m: [f64; 2]) -> Self {
        Self {
            heights,
            stride,
            per_two_m: spacing_m.map(|m| (0.5 / m) as f32),
        }
    }

    /// By how much the ground rises a metre eastward and southward at each of [`LANES`] samples from (x, z) eastward:
    /// central differences, one-sided at the DEM's edges and beside voids, level along an axis without a valid neighbour.
    /// NaN at voids.
    pub(super) fn rises(&self, [x, z]: [usize; 2]) -> [[f32; LANES]; 2] {
        let at = (z + 1) * self.stride + x + 1;
        let lanes = |at: usize| -> &[f32; LANES] {
            self.heights[at..at + LANES]
                .try_into()
                .expect("the range is as long")
        };
        let (here, west, east_of) = (lanes(at), lanes(at - 1), lanes(at + 1));
        let (north, south_of) = (lanes(at - self.stride), lanes(at + self.stride));
        let [mut east, mut south] = [[0.0; LANES]; 2];
        for l in 0..LANES {
            east[l] = (east_of[l] - west[l]) * self.per_two_m[0];
            south[l] = (south_of[l] - north[l]) * self.per_two_m[1];
        }
        let whole = (0..LANES).fold(true, |all, l| all & !(here[l] + east[l] + south[l]).is_nan());
        if !whole {
            for l in 0..LANES {
                [east[l], south[l]] = self.beside_gaps(at + l);
            }
        }
        [east, south]
    }

    /// Rises eastward and southward where neighbours may be missing.
    #[cold]
    fn beside_gaps(&self, at: usize) -> [f32; 2] {
        let centre = self.heights[at];
        if centre.is_nan() {
            return [f32::NAN; 2];
        }
        let slope = |before: f32, after: f32, per_two_m: f32| match (before.is_nan(), after.is_nan()) {
            (false, false) => (after - before) * per_two_m,
            (true, false) => (after - centre) * 2.0 * per_two_m,
            (false, true) => (centre - before) * 2.0 * per_two_m,
            (true, true) => 0.0,
        };
        let [columns, rows] = self.per_two_m;
        [
            slope(self.heights[at - 1], self.heights[at + 1], columns),
            slope(
                self.heights[at - self.stride],
                self.heights[at + self.stride],
                rows,
            ),
        ]
    }

    /// The cosines between `direction`, a unit vector of the world (x east, y up, z south), and the normals at
    /// [`LANES`] samples from (x, z) eastward; NaN at voids.
    pub(super) fn cosines(&self, at: [usize; 2], direction: [f32; 3]) -> [f32; LANES] {
        let [east, south] = self.rises(at);
        std::array::from_fn(|l| {
            let (e, s) = (east[l], south[l]);
            (direction[1] - e * direction[0] - s * direction[2]) / (1.0 + e * e + s * s).sqrt()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;

    /// `heights` with a sample of no data around, and so many at the ends of rows that all lanes are there.
    fn padded(heights: &[f32], grid: &Grid) -> (Vec<f32>, usize) {
        let width = grid.size.width as usize;
        let stride = width + 2 + LANES;
        let mut padded = vec![f32::NAN; (heights.len() / width + 2) * stride];
        for (z, row) in heights.chunks(width).enumerate() {
            padded[(z + 1) * stride + 1..][..width].copy_from_slice(row);
        }
        (padded, stride)
    }

    fn rise(heights: &[f32], grid: &Grid, i: usize, j: usize) -> [f32; 2] {
        let (padded, stride) = padded(heights, grid);
        let [east, south] = Slopes::new(&padded, stride, grid.spacing_m).rises([i, j]);
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
        let (padded, stride) = padded(&heights, &grid);
        let slopes = Slopes::new(&padded, stride, grid.spacing_m);
        for (i, j) in (0..30 - LANES).flat_map(|i| (0..7).map(move |j| (i, j))) {
            let [east, south] = slopes.rises([i, j]);
            let cosines = slopes.cosines([i, j], [0.6, 0.0, 0.8]);
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
