//! Extreme sizes and spacings of a DEM.

use clipscape::camera::Camera;
use clipscape::grid::Grid;
use glam::DVec3;

use crate::harness::{Subject, camera, pyramid, rough};
use crate::support::hills;

/// Cameras over the middle, over the far corner, and beside the DEM, in heights of `unit_m`.
fn cameras(grid: &Grid, unit_m: f64) -> Vec<Camera> {
    let side = |axis: usize, n: i64| grid.spacing_m[axis] * (n - 1) as f64;
    let (x, z) = (side(0, grid.size.width), side(1, grid.size.height));
    let at = |u: f64, y: f64, v: f64| DVec3::new(u * x, y * unit_m, v * z);
    vec![
        camera(at(0.5, 50.0, 0.5), 33.0, -40.0),
        camera(at(0.4, 60.0, 0.45), 0.0, -90.0),
        camera(at(1.0, 45.0, 1.0), 315.0, -20.0),
        camera(at(-0.1, 70.0, 0.6), 90.0, -15.0),
    ]
}

#[test]
fn any_size() {
    let sizes = [
        [1, 1],
        [1, 100],
        [100, 1],
        [2, 2],
        [3, 3],
        [5, 3],
        [40, 50],
        [64, 64],
        [65, 65],
        [127, 64],
        [128, 128],
        [129, 129],
        [301, 202],
        [256, 256],
        [257, 257],
        [1000, 37],
        [41, 1013],
        [13201, 24],
    ];
    for [width, height] in sizes {
        let grid = Grid::new(width, height, [10.0, 10.0]);
        let what = format!("{width} x {height} samples");
        let levels = pyramid(grid, |i, j| 0.2 * (hills(0, i, j) - hills(0, 0, 0)));
        let unit_m = 10.0 * (width.max(height) as f64 / 60.0).min(1.0);
        let drawn = Subject::new(&what, &levels).check(&cameras(&grid, unit_m));
        let seen = width > 1 && height > 1;
        let any = drawn.map(|d| d.iter().sum::<usize>() > 0);
        assert!(any.is_none_or(|any| any == seen), "{what}: drawn {any:?}");
        let holed = pyramid(grid, rough);
        Subject::new(format!("{what} with holes"), &holed).check(&cameras(&grid, 10.0));
    }
}

#[test]
fn any_spacing() {
    for spacing_m in [
        [1e-3, 1e-3],
        [1e6, 1e6],
        [1.0, 1000.0],
        [1000.0, 1.0],
        [1e-3, 1.0],
    ] {
        let grid = Grid::new(260, 190, spacing_m);
        let unit_m = (spacing_m[0] * spacing_m[1]).sqrt();
        // Slopes of about 1, and heights that have nothing to do with the spacing.
        for scale in [0.2 * unit_m, 1.0] {
            let levels = pyramid(grid, |i, j| (scale * f64::from(hills(0, i, j))) as f32);
            let what = format!("spacing of {spacing_m:?} m, heights times {scale}");
            let drawn = Subject::new(&what, &levels).check(&cameras(&grid, unit_m));
            let seen = drawn.is_none_or(|d| d.iter().sum::<usize>() > 0);
            assert!(seen || scale == 1.0, "{what}: nothing is drawn");
        }
    }
}
