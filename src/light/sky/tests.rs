//! The sky on shapes whose view factor is known.

use super::*;
use crate::light::tests::{shape, sky};
use crate::progress::Silent;
use crate::pyramid::random::Random;
use crate::work::Serial;

#[test]
fn the_sky_over_planes() {
    let grid = Grid::new(61, 61, [10.0, 10.0]);
    assert!(
        sky(&vec![3.0; 3721], &grid, 16)
            .iter()
            .all(|&s| (s - 1.0).abs() < 1e-6)
    );
    for slope_deg in [5.0f64, 20.0, 45.0, 70.0] {
        for aspect_deg in [0.0f64, 90.0, 33.0] {
            let (sin, cos) = aspect_deg.to_radians().sin_cos();
            let heights = shape(&grid, |x, z| slope_deg.to_radians().tan() * (x * sin + z * cos));
            let got = f64::from(sky(&heights, &grid, 16)[30 * 61 + 30]);
            let want = (1.0 + slope_deg.to_radians().cos()) / 2.0;
            assert!(
                (got - want).abs() < 0.01,
                "slope {slope_deg}, aspect {aspect_deg}: {got} against {want}"
            );
        }
    }
}

#[test]
fn the_sky_beside_a_step_and_in_a_valley() {
    // Long across, so that the ends of the DEM, 20 times the depth away, hide less than 0.01.
    let grid = Grid::new(241, 1001, [10.0, 10.0]);
    let middle = |share: &[f32], i: usize| f64::from(share[500 * 241 + i]);
    let step = shape(&grid, |x, _| if x < 400.0 { 200.0 } else { 0.0 });
    let share = sky(&step, &grid, 16);
    for i in [45, 60, 80, 140] {
        // The wall's top edge is at 390 m. Half of the sky is whole, half begins at atan(200 / d).
        let elevation = (200.0 / (i as f64 * 10.0 - 390.0)).atan();
        let want = 0.5 + 0.5 * elevation.cos();
        assert!(
            (middle(&share, i) - want).abs() < 0.01,
            "column {i}: {} against {want}",
            middle(&share, i)
        );
    }
    for slope_deg in [10.0f64, 30.0, 45.0] {
        let slope = slope_deg.to_radians();
        // Sides 240 m wide each on level ground.
        let valley = shape(&grid, |x, _| slope.tan() * (x - 1200.0).abs().min(240.0));
        let share = sky(&valley, &grid, 16);
        let bottom = middle(&share, 120);
        assert!(
            (bottom - slope.cos()).abs() < 0.01,
            "bottom at {slope_deg}: {bottom} against {}",
            slope.cos()
        );
        // On a side, 120 m up from the bottom (on the level): the other side's top stands at elevation e.
        let e = (slope.tan() * 120.0 / 360.0).atan();
        let want = (1.0 + (slope + e).cos()) / 2.0;
        let side = middle(&share, 132);
        assert!(
            (side - want).abs() < 0.01,
            "side at {slope_deg}: {side} against {want}"
        );
    }
}

#[test]
fn the_sky_on_and_in_a_cone() {
    let grid = Grid::new(201, 201, [10.0, 10.0]);
    for slope_deg in [15.0f64, 40.0] {
        let slope = slope_deg.to_radians();
        let radius = |x: f64, z: f64| (x - 1000.0).hypot(z - 1000.0);
        let peak = sky(&shape(&grid, |x, z| -slope.tan() * radius(x, z)), &grid, 16);
        assert!((peak[100 * 201 + 100] - 1.0).abs() < 1e-6);
        // A cone is convex: its own tangent plane hides all that is hidden.
        let want = (1.0 + slope.cos()) / 2.0;
        for (i, j) in [(140, 100), (100, 50), (70, 70)] {
            let got = f64::from(peak[j * 201 + i]);
            assert!(
                (got - want).abs() < 0.01,
                "flank at {slope_deg}, ({i}, {j}): {got} against {want}"
            );
        }
        // A pit with a floor of 100 m and a rim at 900 m around it, seen from the floor's middle. (At the point
        // of a whole cone the triangles of its first cells, not the cone, are the horizon.)
        let pit = sky(
            &shape(&grid, |x, z| {
                slope.tan() * (radius(x, z).min(900.0) - 100.0).max(0.0)
            }),
            &grid,
            16,
        );
        let want = (slope.tan() * 800.0 / 900.0).atan().cos().powi(2);
        let got = f64::from(pit[100 * 201 + 100]);
        assert!(
            (got - want).abs() < 0.01,
            "pit at {slope_deg}: {got} against {want}"
        );
    }
}

#[test]
fn the_arc_cotangent_is_right() {
    for step in 0..=4000 {
        let x = 10f64.powf(f64::from(step) / 400.0 - 5.0);
        for x in [x, 0.0] {
            let (got, want) = (f64::from(arc_cotangent(x as f32)), 1f64.atan2(x));
            assert!((got - want).abs() < 1e-6, "{x}: {got} against {want}");
        }
    }
}

/// The tangents of the horizon at `azimuth_deg` over `heights` that is sought but for gains of `slack`.
fn tangents(heights: &[f32], grid: &Grid, azimuth_deg: f64, slack: f64) -> Vec<f32> {
    let whole = Whole::of(heights, grid);
    let relief = Relief::new(grid, &whole, Crests::of(heights, grid, &Serial));
    let rays = Rays::new(grid, azimuth_deg, f64::INFINITY, slack, 16);
    all_rows(grid, "horizon", &Silent, |rows, out| {
        each_block(&relief, rows, out, &Serial, |block, scratch, tangents| {
            relief.settle(block, scratch)?;
            relief.raise(&rays, block, f32::INFINITY, tangents, scratch)
        })
    })
    .expect("traces")
}

#[test]
fn the_horizon_is_short_of_the_highest_by_no_more_than_what_is_not_sought() {
    let [mut short, mut loose] = [0; 2];
    for (grid, azimuths_deg) in [
        (Grid::new(3000, 40, [25.0, 20.0]), [90.0, 270.3]),
        (Grid::new(600, 500, [58.0, 27.0]), [22.5, 292.5]),
    ] {
        let mut random = Random::new(79);
        let mut heights = random.heights(grid.size.samples(), 0.0, 5.0, 0.0);
        for h in &mut heights {
            if random.unit() < 0.01 {
                *h += random.between(0.0, 400.0) as f32;
            }
        }
        for azimuth_deg in azimuths_deg {
            let want = tangents(&heights, &grid, azimuth_deg, 0.0);
            let got = tangents(&heights, &grid, azimuth_deg, SLACK);
            let control = tangents(&heights, &grid, azimuth_deg, 10.0 * SLACK);
            for ((want, got), control) in want.into_iter().zip(got).zip(control) {
                let by = f64::from(want - got);
                assert!(
                    (-1e-6..=SLACK + 1e-6).contains(&by),
                    "{azimuth_deg}: {got} for {want}"
                );
                short += u32::from(by > 0.0);
                loose += u32::from(f64::from(want - control) > SLACK + 1e-6);
            }
        }
    }
    assert!(short > 100, "{short}: nothing was left out");
    assert!(loose > 100, "{loose}: ten times as much must show");
}
