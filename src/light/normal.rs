//! The surface normal at a sample, by central differences.

use crate::grid::Grid;

/// The unit normal at valid sample (i, j) in the world (x east, y up, z south): central differences, one-sided
/// at the DEM's edges and beside voids, level along an axis without a valid neighbour.
pub(super) fn normal(heights: &[f32], grid: &Grid, i: usize, j: usize) -> [f64; 3] {
    let (width, height) = (grid.size.width as usize, grid.size.height as usize);
    let at = j * width + i;
    let centre = f64::from(heights[at]);
    let known = |inside: bool, at: usize| {
        let h = if inside { f64::from(heights[at]) } else { f64::NAN };
        (!h.is_nan()).then_some(h)
    };
    let slope = |before: Option<f64>, after: Option<f64>, spacing: f64| match (before, after) {
        (Some(b), Some(a)) => (a - b) / (2.0 * spacing),
        (None, Some(a)) => (a - centre) / spacing,
        (Some(b), None) => (centre - b) / spacing,
        (None, None) => 0.0,
    };
    let [dx, dz] = grid.spacing_m;
    let east = slope(known(i > 0, at.wrapping_sub(1)), known(i + 1 < width, at + 1), dx);
    let south = slope(
        known(j > 0, at.wrapping_sub(width)),
        known(j + 1 < height, at + width),
        dz,
    );
    let length = (1.0 + east * east + south * south).sqrt();
    [-east / length, 1.0 / length, -south / length]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_has_one_normal_edges_and_voids_included() {
        let grid = Grid::new(5, 5, [2.0, 3.0]);
        let mut heights: Vec<f32> = grid
            .size
            .rect()
            .cells()
            .map(|(x, z)| (4 * x - 3 * z) as f32)
            .collect();
        heights[12] = f32::NAN;
        for at in (0..25).filter(|&at| at != 12) {
            let n = normal(&heights, &grid, at % 5, at / 5);
            let want = [-2.0, 1.0, 1.0].map(|c: f64| c / 6f64.sqrt());
            assert!(
                n.iter().zip(want).all(|(n, w)| (n - w).abs() < 1e-12),
                "{at}: {n:?}"
            );
        }
        let lone = [f32::NAN, 3.0, f32::NAN];
        assert_eq!(normal(&lone, &Grid::new(3, 1, [1.0, 1.0]), 1, 0), [0.0, 1.0, 0.0]);
    }
}
