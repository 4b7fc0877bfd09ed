//! The pyramid as a whole: planes, extremes, and the trait's face.

use super::random::Random;
use super::*;
use crate::progress::Silent;
use crate::work::Serial;

fn pyramid(grid: Grid, heights: Vec<f32>) -> Pyramid {
    pyramid_with(&Filter::default(), grid, heights)
}

fn pyramid_with(filter: &Filter, grid: Grid, heights: Vec<f32>) -> Pyramid {
    let mut made = Pyramid::new(grid, heights, None, filter, &Serial, &Silent).expect("filters");
    made.bound(&Serial, &Silent).expect("bounds");
    made
}

/// Greatest difference between a level and `plane`, over all its samples, those past the edge included.
fn worst_against(made: &Pyramid, level: u32, plane: impl Fn(i64, i64) -> f64) -> f64 {
    let size = made.grid().level(level);
    let cells = size.rect().cells().zip(made.level(level));
    cells
        .map(|((i, j), &h)| (f64::from(h) - plane(i << level, j << level)).abs())
        .fold(0.0, f64::max)
}

const WIDTHS: [(i64, i64); 8] = [
    (1000, 300),
    (1013, 300),
    (1201, 300),
    (13201, 40),
    (40, 13201),
    (1013, 1000),
    (300, 1201),
    (65, 66),
];

#[test]
fn an_integer_plane_is_kept_exactly_on_every_level_up_to_the_edge() {
    // Its heights are exact in f32 on every level, and f64 sums err by far less than half a step of f32.
    for (width, height) in WIDTHS {
        let plane = |x: i64, z: i64| (3 * x - 2 * z + 1000) as f64;
        let grid = Grid::new(width, height, [30.0, 30.0]);
        let made = pyramid(
            grid,
            grid.size
                .rect()
                .cells()
                .map(|(x, z)| plane(x, z) as f32)
                .collect(),
        );
        for level in 0..grid.file_levels() {
            assert_eq!(
                worst_against(&made, level, plane),
                0.0,
                "{width} x {height}, level {level}"
            );
        }
    }
}

#[test]
fn any_plane_is_kept_to_rounding() {
    // Each level rounds by up to u = 2^-24 M. The kernel multiplies what it inherits by 1 + 2 overshoot at most
    // and averages most of it away; past the edge it is up to 3 times as much along each axis, and levels of
    // two columns double it. Measured: at most 2.3 u, but 11 u on level 8 of 40 x 13201, which has two columns.
    for (width, height) in WIDTHS {
        let plane = |x: i64, z: i64| 1234.567 + 0.731 * x as f64 - 0.419 * z as f64;
        let grid = Grid::new(width, height, [30.0, 30.0]);
        let made = pyramid(
            grid,
            grid.size
                .rect()
                .cells()
                .map(|(x, z)| plane(x, z) as f32)
                .collect(),
        );
        for level in 0..grid.file_levels() {
            let (low, high) = range(made.level(level));
            let unit = f64::from(low.abs().max(high.abs())) / (1u64 << 24) as f64;
            let worst = worst_against(&made, level, plane);
            let allowed = 16.0 * unit;
            assert!(
                worst <= allowed,
                "{width} x {height}, level {level}: {worst} m, allowed {allowed} m"
            );
        }
    }
}

#[test]
fn every_filter_keeps_planes_up_to_the_edge() {
    // By the same allowances as the default's, above. Widths: odd, even at every level, two rows.
    for (width, height) in [(301, 130), (258, 130), (300, 2), (65, 66)] {
        let grid = Grid::new(width, height, [30.0, 20.0]);
        let whole = |x: i64, z: i64| (3 * x - 2 * z + 1000) as f64;
        let any = |x: i64, z: i64| 1234.567 + 0.731 * x as f64 - 0.419 * z as f64;
        let sampled = |plane: &dyn Fn(i64, i64) -> f64| -> Vec<f32> {
            grid.size
                .rect()
                .cells()
                .map(|(x, z)| plane(x, z) as f32)
                .collect()
        };
        for kind in FilterKind::ALL {
            let exact = pyramid_with(&kind.into(), grid, sampled(&whole));
            let rounded = pyramid_with(&kind.into(), grid, sampled(&any));
            for level in 0..grid.file_levels() {
                let place = format!("{kind}, {width} x {height}, level {level}");
                assert_eq!(worst_against(&exact, level, whole), 0.0, "{place}");
                let (low, high) = range(rounded.level(level));
                let unit = f64::from(low.abs().max(high.abs())) / (1u64 << 24) as f64;
                let worst = worst_against(&rounded, level, any);
                assert!(worst <= 16.0 * unit, "{place}: {worst} m");
            }
        }
    }
}

/// Halves by the mean of two by two samples: centred half a sample off.
fn box_shifted(fine: &[f32], size: Size) -> Vec<f32> {
    let at = |i: i64, j: i64| fine[(j.min(size.height - 1) * size.width + i.min(size.width - 1)) as usize];
    let mean = |(i, j)| {
        let (x, z): (i64, i64) = (2 * i, 2 * j);
        (at(x, z) + at(x + 1, z) + at(x, z + 1) + at(x + 1, z + 1)) / 4.0
    };
    size.level(1).rect().cells().map(mean).collect()
}

#[test]
fn a_box_half_a_sample_off_fails_the_plane_as_it_must() {
    let size = Size {
        width: 101,
        height: 33,
    };
    let plane: Vec<f32> = size.rect().cells().map(|(x, z)| (x + 2 * z) as f32).collect();
    let coarse = box_shifted(&plane, size);
    let wrong = size
        .level(1)
        .rect()
        .cells()
        .zip(&coarse)
        .filter(|((i, j), h)| **h != (2 * i + 4 * j) as f32);
    assert!(wrong.count() > coarse.len() / 2);
}

#[test]
fn extremes_neither_panic_nor_leave_the_finite() {
    let sizes = [
        (1, 1),
        (1, 200),
        (200, 1),
        (2, 2),
        (2, 200),
        (3, 3),
        (128, 128),
        (129, 66),
        (131, 90),
    ];
    for (width, height) in sizes {
        let grid = Grid::new(width, height, [30.0, 30.0]);
        let count = grid.size.samples();
        let cells = || grid.size.rect().cells();
        let one = |k: i64| {
            cells()
                .map(|(x, z)| f32::from(u8::from(x + z * width == k)))
                .collect::<Vec<_>>()
        };
        let mut spike = one(count / 2);
        spike.iter_mut().for_each(|h| *h *= 9000.0);
        let lone = one(0)
            .iter()
            .map(|&h| if h == 1.0 { 5.0 } else { f32::NAN })
            .collect();
        let checkers = |odd: f32, even: f32| cells().map(move |(x, z)| [even, odd][((x + z) & 1) as usize]);
        let fields: [(&str, Vec<f32>); 12] = [
            ("all equal", vec![17.0; count as usize]),
            ("1e-30 apart", Random::new(1).heights(count, 1e-30, 2e-30, 0.0)),
            ("9e6", Random::new(2).heights(count, -9e6, 9e6, 0.0)),
            ("1e30", Random::new(3).heights(count, -1e30, 1e30, 0.1)),
            ("greatest", checkers(f32::MAX, f32::MIN).collect()),
            ("1 m on 1e7 m", Random::new(4).heights(count, 1e7, 1e7 + 1.0, 0.0)),
            ("one spike", spike),
            ("all void", vec![f32::NAN; count as usize]),
            ("valid where odd", checkers(1.0, f32::NAN).collect()),
            ("valid where even", checkers(f32::NAN, 1.0).collect()),
            ("one valid", lone),
            ("infinities", checkers(f32::INFINITY, 2.0).collect()),
        ];
        for (name, heights) in fields {
            let made = pyramid(grid, heights);
            for level in 0..grid.file_levels() {
                let place = format!("{name}, {width} x {height}, level {level}");
                assert_eq!(
                    made.level(level).len() as i64,
                    grid.level(level).samples(),
                    "{place}"
                );
                assert!(!made.level(level).iter().any(|h| h.is_infinite()), "{place}");
                let (low, high) = range(made.level(level));
                match name {
                    "all equal" => {
                        assert_eq!((low, high), (17.0, 17.0), "{place}");
                        let flat =
                            |b: &Bounds| (b.error, b.need_error, b.min, b.max) == (0.0, 0.0, 17.0, 17.0);
                        assert!(made.level_bounds(level).iter().all(flat), "{place}");
                    }
                    "all void" => assert!(low.is_nan() && made.level_bounds(level)[0].is_void(), "{place}"),
                    "valid where odd" if level > 0 => {
                        // Only where all lies past the edge does the rule take the last fine sample.
                        let inner = made.level(level).iter().zip(grid.level(level).rect().cells());
                        let centred = |(i, j): (i64, i64)| i << level < width && j << level < height;
                        assert!(
                            inner.into_iter().all(|(h, at)| !centred(at) || h.is_nan()),
                            "{place}"
                        );
                    }
                    "infinities" => assert!(high <= 2.0 && low >= 2.0, "{place}: {low} to {high}"),
                    _ => {}
                }
            }
        }
    }
}

/// The greatest size of a white noise of 0 to 9000 m, taken through the levels by `next`.
fn noise_after(width: i64, height: i64, next: impl Fn(&[f32], Size) -> Vec<f32>) -> f32 {
    let grid = Grid::new(width, height, [1.0, 1.0]);
    let mut level = Random::new(9).heights(grid.size.samples(), 0.0, 9000.0, 0.0);
    for l in 1..grid.file_levels() {
        level = next(&level, grid.level(l - 1));
    }
    level.iter().fold(0.0, |most, h| most.max(h.abs()))
}

#[test]
fn white_noise_does_not_explode_at_the_edges() {
    let filter = Filter::default();
    let rule = |fine: &[f32], size| downsample(fine, size, &filter, None, &Serial, &Silent).unwrap();
    // The control extrapolates the fine rows instead, at every level anew.
    let control = |fine: &[f32], size: Size| {
        let mut coarse = rule(fine, size);
        let small = size.level(1);
        for j in 0..(size.height + 1) / 2 {
            let last = ((2 * j + 1) * size.width - 1) as usize;
            coarse[((j + 1) * small.width - 1) as usize] = 2.0 * fine[last] - fine[last - 1];
        }
        coarse
    };
    // Even at every level: 1026, 514, 258, 130, 66, 34.
    for (width, height) in [(1026, 1026), (1026, 65), (1024, 1000), (1013, 1022), (131, 66)] {
        // An inner sample obeys the kernel; a continued one leaves its row by less than the range.
        let worst = noise_after(width, height, rule);
        assert!(worst < 18_000.0, "{width} x {height}: {worst} m");
    }
    assert!(noise_after(1026, 1026, control) > 60_000.0);
}

#[test]
fn two_rows_are_continued_in_a_straight_line_as_they_must() {
    // S_l between the two rows of the DEM is then exactly S0 along z; the row past them doubles its distance.
    let grid = Grid::new(2, 300, [1.0, 1.0]);
    let made = pyramid(
        grid,
        grid.size
            .rect()
            .cells()
            .map(|(x, z)| (x * 10 + z) as f32)
            .collect(),
    );
    for level in 0..grid.file_levels() {
        let plane = |x: i64, z: i64| (x * 10 + z) as f64;
        assert_eq!(worst_against(&made, level, plane), 0.0, "level {level}");
    }
}

#[test]
fn rounded_levels_are_multiples_and_the_next_level_follows_from_them() {
    let grid = Grid::new(200, 130, [1.0, 1.0]);
    let heights: Vec<f32> = Random::new(5)
        .heights(grid.size.samples(), 0.0, 4000.0, 0.05)
        .iter()
        .map(|h| h.round())
        .collect();
    let filter = Filter::default();
    let made = Pyramid::new(grid, heights, Some(1.0), &filter, &Serial, &Silent).unwrap();
    assert_eq!(made.rounding_step_m(), Some(1.0 / 4.0));
    for level in 1..grid.file_levels() {
        assert!(
            made.level(level)
                .iter()
                .all(|h| h.is_nan() || (h * 4.0).fract() == 0.0),
            "level {level}"
        );
    }
    let again = downsample(
        made.level(1),
        grid.level(1),
        &filter,
        made.rounding_step_m(),
        &Serial,
        &Silent,
    )
    .unwrap();
    let bits = |level: &[f32]| level.iter().map(|h| h.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&again), bits(made.level(2)));
    assert_eq!(rounding_step(0.1), Some(0.0625 / 4.0));
    assert_eq!(rounding_step(3.0), Some(2.0 / 4.0));
    assert!(
        [0.0, -1.0, f64::NAN, f64::INFINITY]
            .iter()
            .all(|&s| rounding_step(s).is_none())
    );
}

#[test]
fn misuse_is_an_error_and_cancelling_ends_it() {
    struct Stop;
    impl Progress for Stop {
        fn cancelled(&self) -> bool {
            true
        }
    }
    let filter = Filter::default();
    let grid = Grid::new(100, 70, [1.0, 1.0]);
    let new = |grid, count, step| Pyramid::new(grid, vec![0.0; count], step, &filter, &Serial, &Silent);
    let kind = |result: Result<Pyramid>| result.err().map(|e| e.kind());
    assert_eq!(kind(new(grid, 6999, None)), Some(ErrorKind::Misuse));
    assert_eq!(kind(new(grid, 7000, Some(-1.0))), Some(ErrorKind::Misuse));
    assert_eq!(
        kind(new(Grid::new(0, 70, [1.0, 1.0]), 0, None)),
        Some(ErrorKind::Misuse)
    );
    let stopped = Pyramid::new(grid, vec![0.0; 7000], None, &filter, &Serial, &Stop);
    assert_eq!(kind(stopped), Some(ErrorKind::Cancelled));
    let mut made = new(grid, 7000, None).unwrap();
    assert_eq!(
        made.bound(&Serial, &Stop).unwrap_err().kind(),
        ErrorKind::Cancelled
    );

    let mut room = [Bounds::VOID; 1];
    assert_eq!(
        made.bounds(0, Rect::new(0, 0, 1, 1), &mut room).unwrap(),
        Arrival::Missing
    );
    made.bound(&Serial, &Silent).unwrap();
    assert_eq!(
        made.bounds(0, Rect::new(0, 0, 1, 1), &mut room).unwrap(),
        Arrival::Arrived
    );
    assert_eq!((room[0].min, room[0].error), (0.0, 0.0));
    assert!(made.bounds(9, Rect::new(0, 0, 1, 1), &mut room).is_err());
    assert!(made.heights(0, Rect::new(99, 0, 101, 1), &mut [0.0; 2]).is_err());
    assert!(made.heights(0, Rect::new(0, 0, 2, 1), &mut [0.0; 1]).is_err());
    assert!(
        made.light(0, Rect::new(0, 0, 1, 1), &mut [LightSample::default()])
            .is_err()
    );
    assert!(made.set_light(vec![vec![]; 2]).is_err());
    let light: Vec<_> = (0..2)
        .map(|l| vec![LightSample::default(); grid.level(l).samples() as usize])
        .collect();
    made.set_light(light).unwrap();
    assert!(made.has_light());
}

#[test]
fn rectangles_come_row_by_row() {
    let grid = Grid::new(90, 70, [1.0, 1.0]);
    let made = pyramid(grid, (0..6300).map(|k| k as f32).collect());
    let mut out = [0.0; 6];
    assert_eq!(
        made.heights(0, Rect::new(3, 2, 6, 4), &mut out).unwrap(),
        Arrival::Arrived
    );
    assert_eq!(out, [183.0, 184.0, 185.0, 273.0, 274.0, 275.0]);
}
