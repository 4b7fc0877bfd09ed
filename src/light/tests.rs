//! The sun on shapes whose light is known, and the levels.

use super::*;
use crate::progress::Silent;
use crate::work::Serial;

/// Heights by position in metres.
pub(super) fn shape(grid: &Grid, height: impl Fn(f64, f64) -> f64) -> Vec<f32> {
    let [dx, dz] = grid.spacing_m;
    grid.size
        .rect()
        .cells()
        .map(|(i, j)| height(i as f64 * dx, j as f64 * dz) as f32)
        .collect()
}

fn sun(heights: &[f32], grid: &Grid, azimuth_deg: f64, altitude_deg: f64) -> Vec<f32> {
    sun_share(
        heights,
        grid,
        Sun {
            azimuth_deg,
            altitude_deg,
        },
        &Serial,
        &Silent,
    )
    .expect("traces")
}

/// The sky's share, on one thread.
pub(super) fn sky(heights: &[f32], grid: &Grid, directions: u32) -> Vec<f32> {
    sky_share(heights, grid, directions, &Serial, &Silent).expect("traces")
}

#[test]
fn the_disc_sets_by_the_segment_of_a_circle() {
    let radius = (DISC_DEG / 2.0).to_radians();
    assert_eq!(disc_share(0.3, 0.3), 0.5);
    assert_eq!(disc_share(0.3, 0.3 + radius), 1.0);
    assert_eq!(disc_share(0.3 + radius, 0.3), 0.0);
    assert_eq!(disc_share(0.1, 1.5), 1.0);
    // By counting points of the disc.
    for step in -9..=9 {
        let x = f64::from(step) / 10.0;
        let mut seen = 0u32;
        let mut all = 0u32;
        for (u, v) in (-400..=400).flat_map(|u| (-400..=400).map(move |v| (u, v))) {
            if u * u + v * v <= 160_000 {
                all += 1;
                seen += u32::from(f64::from(v) > -x * 400.0);
            }
        }
        let counted = f64::from(seen) / f64::from(all);
        let got = disc_share(0.0, x * radius);
        assert!((got - counted).abs() < 2e-3, "{x}: {got} against {counted}");
    }
}

#[test]
fn the_sun_points_where_its_angles_say() {
    let at = |azimuth_deg, altitude_deg| {
        Sun {
            azimuth_deg,
            altitude_deg,
        }
        .direction()
    };
    assert_eq!(at(0.0, 0.0), [0.0, 0.0, -1.0]);
    assert_eq!(at(90.0, 0.0), [1.0, 0.0, 0.0]);
    assert_eq!(at(180.0, 0.0), [0.0, 0.0, 1.0]);
    assert_eq!(at(-90.0, 0.0), [-1.0, 0.0, 0.0]);
    assert_eq!(at(123.0, 90.0), [0.0, 1.0, 0.0]);
    let west_of_north = at(315.0, 45.0);
    assert!(
        west_of_north
            .iter()
            .zip([-0.5, 0.5f64.sqrt(), -0.5])
            .all(|(a, b)| (a - b).abs() < 1e-12)
    );
    for (azimuth_deg, altitude_deg) in [
        (f64::NAN, 3.0),
        (f64::INFINITY, 3.0),
        (0.0, 90.1),
        (0.0, f64::NAN),
    ] {
        let refused = Sun {
            azimuth_deg,
            altitude_deg,
        }
        .check()
        .unwrap_err();
        assert_eq!(refused.kind(), ErrorKind::Misuse);
    }
}

/// A ridge of 300 m across the line to the sun at `azimuth_deg`, a multiple of 90, on level ground of 101 x 101
/// samples: shares at (towards the sun from the crest, behind the crest, in its shadow beyond its foot).
fn ridge(azimuth_deg: f64, lit_from_deg: f64) -> [f32; 3] {
    let grid = Grid::new(101, 101, [10.0, 10.0]);
    let (sin, cos) = azimuth_deg.to_radians().sin_cos();
    // Distance from the middle towards the azimuth; north is -z.
    let towards = |x: f64, z: f64| (x - 500.0) * sin - (z - 500.0) * cos;
    let heights = shape(&grid, |x, z| (300.0 - 2.0 * towards(x, z).abs()).max(0.0));
    let share = sun(&heights, &grid, lit_from_deg, 30.0);
    [50.0, -50.0, -300.0].map(|d: f64| {
        let (i, j) = (
            (50.0 + d / 10.0 * sin).round() as usize,
            (50.0 - d / 10.0 * cos).round() as usize,
        );
        share[j * 101 + i]
    })
}

#[test]
fn a_ridge_is_lit_on_the_suns_side_and_shades_the_other_for_all_four_winds() {
    // 30 degrees: the shadow of 300 m is 520 m long, the ridge's foot at 150 m. Level ground is lit by 1/2.
    for azimuth_deg in [0.0, 90.0, 180.0, 270.0] {
        let [front, back, shadow] = ridge(azimuth_deg, azimuth_deg);
        // Slope 2 towards a sun at 30 degrees: (2 cos 30 + sin 30) / sqrt 5.
        assert!((front - 0.9982).abs() < 1e-3, "azimuth {azimuth_deg}: {front}");
        assert_eq!([back, shadow], [0.0, 0.0], "azimuth {azimuth_deg}");
        // Control: a sun mirrored to the other side lights what must be dark.
        let [front, back, shadow] = ridge(azimuth_deg, azimuth_deg + 180.0);
        assert!(
            front == 0.0 && back > 0.9 && (shadow - 0.5).abs() < 1e-6,
            "azimuth {azimuth_deg}, mirrored"
        );
    }
}

#[test]
fn a_north_south_ridge_with_the_sun_in_the_west() {
    let grid = Grid::new(81, 41, [10.0, 10.0]);
    let heights = shape(&grid, |x, _| (200.0 - (x - 400.0).abs()).max(0.0));
    let share = sun(&heights, &grid, 270.0, 20.0);
    let row = &share[20 * 81..21 * 81];
    assert!(row[30] > 0.85, "the west side, {}", row[30]);
    assert_eq!(row[50], 0.0, "the east side");
    assert_eq!(row[65], 0.0, "east of the foot, in shadow");
    assert!(
        (row[10] - 20f32.to_radians().sin()).abs() < 1e-6,
        "west of the foot, {}",
        row[10]
    );
}

#[test]
fn a_shadow_ends_where_the_sun_rises_over_the_wall_with_a_penumbra() {
    // A wall of 100 m; at distance d its tangent is 100 / d.
    let grid = Grid::new(1200, 5, [1.0, 1.0]);
    let heights = shape(&grid, |x, _| if x < 5.0 { 100.0 } else { 0.0 });
    let altitude_deg = 10.0f64;
    let share = sun(&heights, &grid, 270.0, altitude_deg);
    let mut partial = 0;
    for d in 100..1000 {
        let want = disc_share((100.0 / f64::from(d)).atan(), altitude_deg.to_radians())
            * altitude_deg.to_radians().sin();
        let got = f64::from(share[2 * 1200 + 4 + d as usize]);
        assert!((got - want).abs() < 1e-6, "{d} m: {got} against {want}");
        partial += u32::from(got > 0.001 && got < 0.17);
    }
    assert!(partial > 10, "the penumbra is {partial} m");
}

#[test]
fn suns_at_the_ends_of_their_range() {
    let grid = Grid::new(40, 30, [30.0, 20.0]);
    let rough = shape(&grid, |x, z| 50.0 * ((x / 70.0).sin() + (z / 50.0).cos()));
    let flat = vec![7.0; 1200];
    for azimuth_deg in [0.0, 45.0, 90.0, 123.4, 180.0, 225.0, 270.0, 315.0, 360.0] {
        assert!(
            sun(&flat, &grid, azimuth_deg, 0.0).iter().all(|&s| s == 0.0),
            "{azimuth_deg}: grazing"
        );
        assert!(
            sun(&flat, &grid, azimuth_deg, 90.0).iter().all(|&s| s == 1.0),
            "{azimuth_deg}: overhead"
        );
        for heights in [&flat, &rough] {
            for altitude_deg in [-0.27, -1.0, -90.0] {
                let dark = sun(heights, &grid, azimuth_deg, altitude_deg)
                    .iter()
                    .all(|&s| s == 0.0);
                assert!(dark, "{azimuth_deg}, {altitude_deg}: below the horizon");
            }
            for altitude_deg in [0.0, 0.1, 3.0, 45.0, 89.9, 90.0] {
                let share = sun(heights, &grid, azimuth_deg, altitude_deg);
                assert!(
                    share.iter().all(|s| (0.0..=1.0).contains(s)),
                    "{azimuth_deg}, {altitude_deg}"
                );
            }
        }
        let lit = sun(&rough, &grid, azimuth_deg, 3.0)
            .iter()
            .filter(|&&s| s > 0.0)
            .count();
        assert!(lit > 0 && lit < 900, "{azimuth_deg}: {lit} lit by a low sun");
    }
}

#[test]
fn voids_and_the_edge_cast_no_shadow() {
    let grid = Grid::new(30, 3, [10.0, 10.0]);
    let mut heights = vec![0.0; 90];
    (0..3).for_each(|j| heights[j * 30 + 10] = f32::NAN);
    let share = sun(&heights, &grid, 270.0, 5.0);
    let level = 5f32.to_radians().sin();
    for (at, s) in share.iter().enumerate() {
        let right = if at % 30 == 10 {
            s.is_nan()
        } else {
            (s - level).abs() < 1e-6
        };
        assert!(right, "sample {at}: {s}");
    }
    // A control: a wall in the same place does.
    (0..3).for_each(|j| heights[j * 30 + 10] = 50.0);
    assert_eq!(sun(&heights, &grid, 270.0, 5.0)[30 + 20], 0.0);
}

#[test]
fn light_levels_are_filled_clamped_and_of_the_right_size() {
    let grid = Grid::new(131, 90, [10.0, 10.0]);
    let mut heights = shape(&grid, |x, z| 80.0 * ((x / 37.0).sin() + (z / 53.0).cos()));
    heights.iter_mut().step_by(3).for_each(|h| *h = f32::NAN);
    let options = LightOptions {
        sun: Sun {
            azimuth_deg: 200.0,
            altitude_deg: 12.0,
        },
        sky_directions: 4,
    };
    let trace = |heights: &[f32]| {
        trace_light(&grid, heights, &options, &Filter::default(), &Serial, &Silent).expect("traces")
    };
    let levels = trace(&heights);
    assert_eq!(levels.len() as u32, grid.file_levels());
    for (l, level) in levels.iter().enumerate() {
        assert_eq!(level.len() as i64, grid.level(l as u32).samples());
        let unit = |v: f16| (0.0..=1.0).contains(&v.to_f32());
        assert!(level.iter().all(|s| unit(s.sun) && unit(s.sky)), "level {l}");
    }
    let dark = levels[1].iter().filter(|s| s.sun.to_f32() < 0.2).count();
    assert!(
        dark > 100 && dark < levels[1].len() - 100,
        "{dark}: light and shade reach level 1"
    );
    let void = trace(&vec![f32::NAN; heights.len()]);
    let whole = LightSample {
        sun: f16::ONE,
        sky: f16::ONE,
    };
    assert!(void.iter().flatten().all(|s| *s == whole));
    let short = light_levels(
        &grid,
        &heights,
        vec![],
        vec![],
        &Filter::default(),
        &Serial,
        &Silent,
    );
    assert_eq!(short.unwrap_err().kind(), ErrorKind::Misuse);
}

#[test]
fn without_directions_the_sky_is_whole_and_cancelling_ends_it() {
    struct Stop;
    impl Progress for Stop {
        fn cancelled(&self) -> bool {
            true
        }
    }
    let grid = Grid::new(20, 20, [1.0, 1.0]);
    let heights = vec![0.0; 400];
    assert!(sky(&heights, &grid, 0).iter().all(|&s| s == 1.0));
    let stopped = sky_share(&heights, &grid, 3, &Serial, &Stop).unwrap_err();
    assert_eq!(stopped.kind(), ErrorKind::Cancelled);
    let stopped = sun_share(&heights, &grid, Sun::default(), &Serial, &Stop).unwrap_err();
    assert_eq!(stopped.kind(), ErrorKind::Cancelled);
}

#[test]
fn any_order_of_work_gives_the_same_light() {
    struct Backwards;
    impl Work for Backwards {
        fn each(&self, count: usize, task: &(dyn Fn(usize) + Sync)) {
            (0..count).rev().for_each(task);
        }
    }
    let grid = Grid::new(70, 50, [10.0, 12.0]);
    let heights = shape(&grid, |x, z| 90.0 * ((x / 37.0).sin() + (z / 53.0).cos()));
    let run = |work: &dyn Work| {
        trace_light(
            &grid,
            &heights,
            &LightOptions::default(),
            &Filter::default(),
            work,
            &Silent,
        )
        .expect("traces")
    };
    assert!(run(&Serial) == run(&Backwards));
}
