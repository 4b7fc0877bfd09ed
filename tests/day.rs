//! Light over a day against the light of single suns, over real mountains, level by level.
//!
//! At the time of one of its positions a day must light ground as a file made for that sun alone does. On level 0 it is off
//! where times are rounded (to 7 s of a day of 8 hours) and where the disc rises otherwise than between two positions in
//! the mean; on coarser levels by what two moments say of a distribution. The tolerances are about twice what was measured.
//!
//! How long ground lies in shadow between its first and its last light is looked at on a part of the shipped DEM, and with
//! `CLIPSCAPE_WHOLE=1` on all of it.
#![allow(clippy::print_stderr, reason = "says what it found")]

use std::path::Path;

use clipscape::build::Threads;
use clipscape::grid::{Grid, Rect, Size};
use clipscape::levels::{DaySample, LightSample};
use clipscape::light::{
    Day, Earth, day_levels, horizon_tangents, light_levels, sun_of_day, sun_share, trace_day,
};
use clipscape::progress::Silent;
use clipscape::pyramid::{Filter, Pyramid};
use half::f16;

struct Dem {
    grid: Grid,
    heights: Vec<f32>,
    pyramid: Pyramid,
}

/// A part of the shipped DEM.
fn pyrenees(rect: Rect) -> Dem {
    let source = clipscape::source::open(Path::new("data/N42E001.hgt")).unwrap();
    let description = source.description();
    let mut heights = vec![0.0; rect.area() as usize];
    source.read(rect, &mut heights).unwrap();
    let grid = Grid::new(rect.width(), rect.height(), description.grid.spacing_m);
    let threads = Threads::new(0).unwrap();
    let filter = Filter::default();
    let pyramid = Pyramid::new(
        grid,
        heights.clone(),
        description.step_m,
        &filter,
        &threads,
        &Silent,
    )
    .unwrap();
    Dem {
        grid,
        heights,
        pyramid,
    }
}

fn day(date: &str, positions: u32) -> Day {
    Day::of(format!("{date}T12:00Z").parse().unwrap(), 42.5, 1.5, positions).unwrap()
}

/// Slopes of a level as they are drawn: central differences.
fn slopes(heights: &[f32], size: Size, spacing_m: [f64; 2], i: i64, j: i64) -> [f32; 2] {
    let at = |i: i64, j: i64| heights[(j * size.width + i) as usize];
    let rise = |a: f32, b: f32, run: f64| f16::from_f32((b - a) / run as f32).to_f32();
    [
        rise(at(i - 1, j), at(i + 1, j), 2.0 * spacing_m[0]),
        rise(at(i, j - 1), at(i, j + 1), 2.0 * spacing_m[1]),
    ]
}

/// The shares of a level of the day at `time`, but for its rim and what is beside voids, and those of the single sun.
fn both(
    dem: &Dem,
    level: u32,
    of_day: &[DaySample],
    single: &[LightSample],
    day: &Day,
    time: f64,
) -> Vec<[f32; 2]> {
    let size = dem.grid.level(level);
    let spacing_m = dem.grid.spacing_m.map(|m| m * f64::from(1u32 << level));
    let to_sun = day.sun(time).unwrap().direction().map(|c| c as f32);
    let inner = Rect::new(1, 1, size.width - 1, size.height - 1);
    let share = |(i, j): (i64, i64)| {
        let at = (j * size.width + i) as usize;
        let s = &of_day[at];
        let [east, south] = slopes(dem.pyramid.level(level), size, spacing_m, i, j);
        let spread = s.slope.to_f32().powi(2) - east * east - south * south;
        let rough = if level == 0 {
            0.0
        } else {
            (0.5 * spread).max(0.0).sqrt()
        };
        let times = [s.first, s.first_soft, s.last, s.last_soft].map(f16::to_f32);
        [
            sun_of_day(times, rough, [east, south], to_sun, time as f32),
            single[at].sun.to_f32(),
        ]
    };
    let heights = dem.pyramid.level(level);
    let known = |i: i64, j: i64| !heights[(j * size.width + i) as usize].is_nan();
    let whole = |&(i, j): &(i64, i64)| {
        Rect::new(i - 1, j - 1, i + 2, j + 2)
            .cells()
            .all(|(i, j)| known(i, j))
    };
    inner.cells().filter(whole).map(share).collect()
}

/// Root mean square of the differences, and their mean.
fn difference(shares: &[[f32; 2]]) -> [f64; 2] {
    let (squares, sum) = shares.iter().fold((0.0, 0.0), |(squares, sum), [a, b]| {
        let off = f64::from(a - b);
        (squares + off * off, sum + off)
    });
    [
        f64::sqrt(squares / shares.len() as f64),
        sum / shares.len() as f64,
    ]
}

#[test]
fn at_its_positions_a_day_is_lit_as_by_single_suns() {
    let dem = pyrenees(Rect::new(300, 300, 812, 812));
    let threads = Threads::new(0).unwrap();
    let (filter, earth) = (Filter::default(), Earth::default());
    for (date, wanted) in [
        ("2026-06-21", [0.01, 0.06, 0.09, 0.10]),
        ("2026-12-21", [0.03, 0.07, 0.10, 0.11]),
    ] {
        let day = day(date, 48);
        let trace = trace_day(&dem.heights, &dem.grid, &earth, &day, &threads, &Silent).unwrap();
        let of_day = day_levels(&dem.grid, &trace, &filter, &threads, &Silent).unwrap();
        let mut worst = [[0.0f64; 2]; 4];
        for k in [4, 8, 12, 20, 30, 38, 43] {
            let time = day.time_of_position(k);
            let sun = day.sun(time).unwrap();
            let single = |sun| {
                let share = sun_share(&dem.heights, &dem.grid, sun, &threads, &Silent).unwrap();
                let sky = vec![1.0; share.len()];
                light_levels(&dem.grid, &dem.heights, share, sky, &filter, &threads, &Silent).unwrap()
            };
            let one = single(sun);
            let [here, _] = difference(&both(&dem, 0, &of_day[0], &one[0], &day, time));
            for level in 0..4 {
                let l = level as usize;
                let [rms, mean] = difference(&both(&dem, level, &of_day[l], &one[l], &day, time));
                eprintln!(
                    "{date}, {:5.1} degrees, level {level}: RMS {rms:.4}, mean {mean:+.4}",
                    sun.altitude_deg
                );
                worst[l] = [worst[l][0].max(rms), worst[l][1].max(mean.abs())];
            }
            // A control: the sun of two positions later is another one.
            let later = single(day.sun(day.time_of_position(k + 2)).unwrap());
            let [rms, _] = difference(&both(&dem, 0, &of_day[0], &later[0], &day, time));
            assert!(rms > 3.0 * here, "{date}: {rms} two positions later, {here}");
        }
        for (level, ([rms, mean], wanted)) in worst.iter().zip(wanted).enumerate() {
            assert!(
                *rms < wanted && *mean < 0.03,
                "{date}, level {level}: {rms}, {mean}"
            );
        }
    }
}

/// The share of the lit time that ground is lit too long: it lies in shadow between its first and its last light.
fn shaded_between(heights: &[f32], grid: &Grid, day: &Day) -> f64 {
    let threads = Threads::new(0).unwrap();
    let trace = trace_day(heights, grid, &Earth::default(), day, &threads, &Silent).unwrap();
    let (mut lit, mut shaded) = (0u64, 0u64);
    for k in 0..day.positions {
        let time = day.time_of_position(k);
        let sun = day.sun(time).unwrap();
        let tangents = horizon_tangents(heights, grid, sun.azimuth_deg, &threads, &Silent).unwrap();
        let altitude = sun.altitude_deg.to_radians() as f32;
        for (n, tangent) in tangents.iter().enumerate().filter(|(n, _)| !heights[*n].is_nan()) {
            let is_up = altitude > tangent.atan();
            lit += u64::from(is_up);
            let time = time as f32;
            shaded += u64::from(!is_up && trace[n].first < time && time < trace[n].last);
        }
    }
    shaded as f64 / lit as f64
}

#[test]
fn ground_hardly_ever_lies_in_shadow_between_its_first_and_its_last_light() {
    let dem = match std::env::var_os("CLIPSCAPE_WHOLE") {
        Some(_) => pyrenees(Rect::new(0, 0, 1201, 1201)),
        None => pyrenees(Rect::new(300, 300, 812, 812)),
    };
    for date in ["2026-06-21", "2026-03-20", "2026-12-21"] {
        let share = shaded_between(&dem.heights, &dem.grid, &day(date, 48));
        eprintln!("{date}: {:.4} % of the lit time", 100.0 * share);
        assert!(share < 0.002, "{date}: {share}");
    }
    // A control: a tower on a plain shades what lies north of it at noon.
    let grid = Grid::new(64, 64, [30.0, 30.0]);
    let tower = |(i, j): (i64, i64)| {
        if (30..34).contains(&i) && j == 40 {
            900.0
        } else {
            0.0
        }
    };
    let heights: Vec<f32> = grid.size.rect().cells().map(tower).collect();
    let share = shaded_between(&heights, &grid, &day("2026-12-21", 48));
    assert!(share > 0.002, "the tower's shadow is {share} of the lit time");
}
