//! The horizon against a ray caster that shares nothing with it, and which way is which.

use super::*;
use crate::progress::Silent;
use crate::pyramid::random::Random;
use crate::work::Serial;

/// The greatest tangent over all edges of all triangles that the ray from (i, j) meets, at least 0: segment
/// against ray in the plane, for every edge of the grid. And by how much f32 may be off it: 2^-22 of the differences of
/// heights that make up any of them, 1e-6 for crossings as near to a sample as either calls a hit, and f32's rounding.
fn brute_tangent(heights: &[f32], grid: &Grid, azimuth_deg: f64, i: i64, j: i64) -> (f64, f64) {
    let [dx, dz] = grid.spacing_m;
    let (sin, cos) = azimuth_deg.to_radians().sin_cos();
    let at = |x: i64, z: i64| f64::from(heights[(z * grid.size.width + x) as usize]);
    let here = at(i, j);
    let (mut best, mut slack) = (0.0f64, 0.0f64);
    let rect = grid.size.rect();
    for (x, z) in rect.cells() {
        for (ex, ez) in [(1, 0), (0, 1), (1, 1)] {
            if !rect.contains(x + ex, z + ez) {
                continue;
            }
            // Ends as (along the ray, across it), in metres from (i, j); north is -z.
            let end = |x: i64, z: i64| {
                let (px, pz) = ((x - i) as f64 * dx, (z - j) as f64 * dz);
                (px * sin - pz * cos, px * cos + pz * sin, at(x, z))
            };
            let (p, q) = (end(x, z), end(x + ex, z + ez));
            let small = 1e-7 * dx.min(dz);
            for (along, across, h) in [p, q] {
                if across.abs() < small && along > small {
                    best = best.max((h - here) / along); // f64's max leaves NaN out
                }
            }
            if (p.1 > small && q.1 < -small) || (p.1 < -small && q.1 > small) {
                let w = p.1 / (p.1 - q.1);
                let along = p.0 + w * (q.0 - p.0);
                if along > small {
                    best = best.max((p.2 + w * (q.2 - p.2) - here) / along);
                    let differences = (p.2 - here).abs() + (q.2 - p.2).abs();
                    slack = slack.max(differences / along * f64::powi(2.0, -22));
                }
            }
        }
    }
    (best, slack + 1e-6 * (1.0 + best))
}

fn tangents(heights: &[f32], grid: &Grid, azimuth_deg: f64) -> Vec<f32> {
    horizon_tangents(heights, grid, azimuth_deg, &Serial, &Silent).expect("traces")
}

#[test]
fn it_equals_brute_force_in_every_direction() {
    let mut mirrored_differ = 0;
    for seed in 0..24u64 {
        let mut random = Random::new(seed);
        let spacing = [[10.0, 10.0], [3.0, 20.0], [1.0, 1000.0], [30.0, 22.0]][seed as usize % 4];
        let grid = Grid::new(1 + random.below(60), 1 + random.below(45), spacing);
        let voids = [0.0, 0.1, 0.6][seed as usize % 3];
        // Rough ground with single peaks: the horizon is both near and far.
        let mut heights = random.heights(grid.size.samples(), 0.0, 20.0, voids);
        heights.iter_mut().for_each(|h| {
            *h += if random.unit() < 0.02 {
                random.between(0.0, 900.0) as f32
            } else {
                0.0
            }
        });
        for k in 0..12 {
            let azimuth_deg = if k < 8 {
                f64::from(k) * 45.0
            } else {
                random.between(-360.0, 720.0)
            };
            let got = tangents(&heights, &grid, azimuth_deg);
            let mirrored = tangents(&heights, &grid, 360.0 - azimuth_deg);
            for _ in 0..40 {
                let (i, j) = (random.below(grid.size.width), random.below(grid.size.height));
                let at = (j * grid.size.width + i) as usize;
                if heights[at].is_nan() {
                    assert!(got[at].is_nan());
                    continue;
                }
                let (want, slack) = brute_tangent(&heights, &grid, azimuth_deg, i, j);
                let close = |got: f32| (f64::from(got) - want).abs() <= slack;
                assert!(
                    close(got[at]),
                    "seed {seed}, azimuth {azimuth_deg}, ({i}, {j}): {} against {want}",
                    got[at]
                );
                mirrored_differ += u32::from(!close(mirrored[at]));
            }
        }
    }
    assert!(
        mirrored_differ > 1000,
        "{mirrored_differ}: a mirrored azimuth must show"
    );
}

#[test]
fn azimuths_run_clockwise_from_north() {
    // One peak of 100 m in the middle of level ground; only samples on its line see it over the horizon.
    let grid = Grid::new(41, 41, [10.0, 10.0]);
    let mut heights = vec![0.0; 1681];
    heights[20 * 41 + 20] = 100.0;
    let sees = [
        (0.0, 20, 30),
        (90.0, 10, 20),
        (180.0, 20, 10),
        (270.0, 30, 20),
        (135.0, 10, 10),
        (315.0, 30, 30),
    ];
    for (azimuth_deg, i, j) in sees {
        let got = tangents(&heights, &grid, azimuth_deg);
        let distance = 100.0
            * if azimuth_deg % 90.0 == 0.0 {
                1.0
            } else {
                2f64.sqrt()
            };
        let tangent = f64::from(got[j * 41 + i]);
        assert!(
            (tangent - 100.0 / distance).abs() < 1e-6,
            "azimuth {azimuth_deg}: {tangent}"
        );
        let opposite = (40 - j) * 41 + (40 - i);
        assert_eq!(got[opposite], 0.0, "azimuth {azimuth_deg}, from the other side");
    }
}

#[test]
fn runs_and_blocks_change_nothing_on_a_grid_of_many_blocks() {
    // A far wall, lone towers, and ground that lies lower: everything that may be left out is there.
    let grid = Grid::new(150, 90, [25.0, 20.0]);
    let mut random = Random::new(77);
    let mut heights = random.heights(grid.size.samples(), -50.0, 0.0, 0.02);
    for (at, h) in heights.iter_mut().enumerate() {
        if at % 150 == 140 {
            *h = 800.0;
        } else if random.unit() < 0.0005 {
            *h = 300.0;
        }
    }
    for azimuth_deg in [90.0, 77.3, 100.0, 45.0, 271.0, 200.0, 3.0] {
        let got = tangents(&heights, &grid, azimuth_deg);
        for _ in 0..60 {
            let (i, j) = (random.below(150), random.below(90));
            let at = (j * 150 + i) as usize;
            let (want, slack) = brute_tangent(&heights, &grid, azimuth_deg, i, j);
            let fine = heights[at].is_nan() || (f64::from(got[at]) - want).abs() <= slack;
            assert!(
                fine,
                "azimuth {azimuth_deg}, ({i}, {j}): {} against {want}",
                got[at]
            );
        }
    }
}

#[test]
fn what_stands_many_stages_away_is_seen() {
    let long = Grid::new(6000, 24, [25.0, 20.0]);
    let tall = Grid::new(24, 6000, [20.0, 25.0]);
    let mut seen = 0;
    for (grid, azimuths_deg) in [(long, [90.0, 270.0, 89.9]), (tall, [0.0, 180.0, 180.1])] {
        let mut random = Random::new(78);
        let mut heights = random.heights(grid.size.samples(), -5.0, 0.0, 0.02);
        // Walls at the ends, and a few towers between them.
        for (at, h) in (0..).zip(&mut heights) {
            let along = (at % grid.size.width).max(at / grid.size.width);
            if !(30..5970).contains(&along) {
                *h += 2000.0;
            } else if random.unit() < 0.0002 {
                *h += 150.0;
            }
        }
        for azimuth_deg in azimuths_deg {
            let got = tangents(&heights, &grid, azimuth_deg);
            for _ in 0..60 {
                let (i, j) = (random.below(grid.size.width), random.below(grid.size.height));
                let at = (j * grid.size.width + i) as usize;
                let (want, slack) = brute_tangent(&heights, &grid, azimuth_deg, i, j);
                let fine = heights[at].is_nan() || (f64::from(got[at]) - want).abs() <= slack;
                assert!(
                    fine,
                    "azimuth {azimuth_deg}, ({i}, {j}): {} against {want}",
                    got[at]
                );
                // Most of what is seen is a wall beyond the stages at which all look.
                seen += u32::from(want > 0.0 && want < 2010.0 / (600.0 * 25.0));
            }
        }
    }
    assert!(seen > 100, "{seen}");
}

#[test]
fn impossible_input_is_refused() {
    let grid = Grid::new(3, 3, [1.0, 1.0]);
    let kind = |heights: &[f32], azimuth_deg| {
        horizon_tangents(heights, &grid, azimuth_deg, &Serial, &Silent).map_err(|e| e.kind())
    };
    assert_eq!(kind(&[0.0; 8], 0.0), Err(crate::ErrorKind::Misuse));
    assert_eq!(kind(&[0.0; 9], f64::NAN), Err(crate::ErrorKind::Misuse));
    assert!(kind(&[0.0; 9], -1e300).is_ok());
}
