//! Days over shapes whose shadows are known.

use half::f16;

use super::*;
use crate::grid::Grid;
use crate::levels::DaySample;
use crate::light::{DISC_DEG, Earth};
use crate::progress::Silent;
use crate::pyramid::Filter;
use crate::pyramid::random::Random;
use crate::work::Serial;

fn day(text: &str, latitude_deg: f64, longitude_deg: f64, positions: u32) -> Day {
    Day::of(text.parse().unwrap(), latitude_deg, longitude_deg, positions).unwrap()
}

#[test]
fn a_disc_is_cut_as_geometry_says() {
    let step = 1.0 / 1024.0;
    let (mut worst, mut sum) = (0.0f32, 0.0f64);
    for k in -2048..=2048i32 {
        let x = k as f32 * step;
        let c = x.clamp(-1.0, 1.0);
        let want = 1.0 - (c.acos() - c * (1.0 - c * c).sqrt()) / std::f32::consts::PI;
        worst = worst.max((disc(x) - want).abs());
        assert!(disc(x) >= disc(x - step) && (0.0..=1.0).contains(&disc(x)), "{x}");
        let middle = 0.5 * (disc_integral(x - step) + disc_integral(x));
        sum += f64::from(disc(x - step / 2.0) * step);
        assert!((f64::from(middle) - sum).abs() < 2e-3, "{x}: {middle}, not {sum}");
    }
    assert!(worst < 0.006, "{worst}");
    assert_eq!(
        [disc(-1.0), disc(1.0), disc_integral(-1.0)].map(|v| (v * 1e5).round()),
        [0.0, 1e5, 0.0]
    );
}

#[test]
fn days_are_those_of_almanacs() {
    // Greenwich at the equinox of 2026: noon at 12:07 UT, some 12 hours and 10 minutes from the first of the disc to the last.
    let found = day("2026-03-20T20:00Z", 51.4769, 0.0, 48);
    assert!(
        found.noon.to_string().starts_with("2026-03-20T12:0"),
        "{}",
        found.noon
    );
    assert!((found.half_s / 3600.0 - 6.1).abs() < 0.05, "{found:?}");
    assert_eq!(found.time_of_hour(12.0), 0.0);
    assert!((found.hour_of_time(1.0) - 12.0 - found.half_s / 3600.0).abs() < 1e-12);
    assert_eq!(
        [found.time_of_position(0), found.time_of_position(47)],
        [-1.0, 1.0]
    );
    // It is the same day for any moment within half a day of its noon, wherever the date line lies.
    for (longitude, moment, noon) in [
        (179.9, "2026-06-21T20:00Z", "2026-06-22T00:0"),
        (-179.9, "2026-06-21T20:00Z", "2026-06-22T00:0"),
        (-118.6, "2026-06-21T09:00-07:00", "2026-06-21T19:5"),
        (-118.6, "2026-06-21T23:00-07:00", "2026-06-21T19:5"),
    ] {
        let found = day(moment, 36.0, longitude, 2).noon.to_string();
        assert!(found.starts_with(noon), "{longitude}, {moment}: {found}");
    }
    assert_eq!(day("2026-06-21T12:00Z", 80.0, 0.0, 3).half_s, 43_200.0);
    let moment = "2026-12-21T12:00Z".parse().unwrap();
    for (latitude, positions) in [(80.0, 3), (40.0, 1), (40.0, 2000), (91.0, 3), (f64::NAN, 3)] {
        assert!(
            Day::of(moment, latitude, 0.0, positions).is_err(),
            "{latitude}, {positions}"
        );
    }
    // What a file says reads back as the same bits, and what it cannot say is refused.
    let text = found.to_string();
    assert_eq!(text.parse::<Day>().unwrap(), found);
    for wrong in [
        "",
        "48",
        "1 2 3 4 5 6",
        "48 1 99 0 2461120 69",
        &format!("{text} 1"),
        &text.replace("48", "1"),
    ] {
        assert!(wrong.parse::<Day>().is_err(), "{wrong}");
    }
}

#[test]
fn times_of_day_are_hours_by_the_sun_or_moments() {
    let found = day("2026-06-21T12:00Z", 42.5, 1.5, 48);
    let time = |text: &str| text.parse::<SunTime>().map(|t| t.in_day(&found));
    assert_eq!(time("12:00").unwrap(), 0.0);
    assert!((time("6:30").unwrap() - found.time_of_hour(6.5)).abs() < 1e-12);
    assert!((time("06:30:36").unwrap() - found.time_of_hour(6.51)).abs() < 1e-9);
    assert!(time(&found.noon.to_string()).unwrap().abs() < 1e-4);
    for wrong in [
        "",
        "6",
        "24:00",
        "6:60",
        "6:1:1:1",
        "-6:00",
        "6.5",
        "6:",
        "2026-06-21T",
        "six",
    ] {
        assert!(time(wrong).is_err(), "{wrong}");
    }
}

/// A wall of 300 m along a column, in a plain, under a sun that rises in the east to the zenith.
struct Wall {
    day: Day,
    samples: Vec<DaySample>,
}

const WIDTH: i64 = 400;
const SPACING_M: f64 = 10.0;
const COLUMN: i64 = 380;
const HEIGHT_M: f64 = 300.0;

impl Wall {
    fn new(positions: u32) -> (Self, Vec<f32>, Grid) {
        let day = day("2026-03-20T12:00Z", 0.0, 0.0, positions);
        let grid = Grid::new(WIDTH, 5, [SPACING_M, 1000.0]);
        let heights: Vec<f32> = grid
            .size
            .rect()
            .cells()
            .map(|(x, _)| if x == COLUMN { HEIGHT_M as f32 } else { 0.0 })
            .collect();
        let trace = trace_day(&heights, &grid, &Earth::default(), &day, &Serial, &Silent).unwrap();
        let levels = day_levels(&grid, &trace, &Filter::default(), &Serial, &Silent).unwrap();
        let samples = levels[0][2 * WIDTH as usize..3 * WIDTH as usize].to_vec();
        (Self { day, samples }, heights, grid)
    }

    /// The share of the disc, west of the wall, from the wall outwards.
    fn shares(&self, time: f64) -> Vec<f32> {
        let up = [0.0, 1.0, 0.0];
        let share = |s: &DaySample| {
            let times = [s.first, s.first_soft, s.last, s.last_soft].map(f16::to_f32);
            sun_of_day(times, 0.0, [0.0; 2], up, time as f32)
        };
        self.samples[..COLUMN as usize - 1]
            .iter()
            .rev()
            .map(share)
            .collect()
    }
}

/// How many samples are in neither shadow nor light.
fn between(shares: &[f32]) -> usize {
    shares.iter().filter(|s| (0.05..0.95).contains(*s)).count()
}

#[test]
fn between_two_positions_a_shadow_crawls_and_does_not_fade() {
    let (wall, heights, grid) = Wall::new(9);
    // From position 1 to 2, about 9 to 31 degrees of altitude... as the day has it.
    let (from, until) = (wall.day.time_of_position(1), wall.day.time_of_position(2));
    let mut before: Option<(Vec<f32>, f64)> = None;
    for k in 0..=64 {
        let time = from + (until - from) * f64::from(k) / 64.0;
        let sun = wall.day.sun(time).unwrap();
        let shares = wall.shares(time);
        // The shadow's end is where the disc's middle stands on the wall.
        let want = HEIGHT_M / sun.altitude_deg.to_radians().tan() / SPACING_M;
        let end = shares.iter().take_while(|s| **s < 0.5).count() as f64 + 1.5;
        let slack = 2.0 + 0.02 * want;
        assert!(
            (end - want).abs() < slack || want > 350.0,
            "{time}: ends at {end}, not {want}"
        );
        // The disc's half degree, and no more, is neither dark nor light: d(h / tan a) = h / sin^2 a da.
        let penumbra =
            HEIGHT_M / sun.altitude_deg.to_radians().sin().powi(2) * DISC_DEG.to_radians() / SPACING_M;
        assert!(
            (between(&shares) as f64) < 2.0 * penumbra + 3.0,
            "{time}: {} samples",
            between(&shares)
        );
        if let Some((earlier, end_before)) = before {
            // It only ever gets lighter, and the end only ever nearer.
            assert!(
                shares.iter().zip(&earlier).all(|(now, then)| now >= then),
                "{time}"
            );
            assert!(end <= end_before, "{time}");
        }
        before = Some((shares, end));
    }
    // The control: light of the two positions, faded into each other, is half light over all that the shadow leaves.
    let single = |time: f64| {
        let sun = wall.day.sun(time).unwrap();
        let all = crate::light::sun_share(&heights, &grid, sun, &Serial, &Silent).unwrap();
        let sin = sun.altitude_deg.to_radians().sin() as f32;
        let row = &all[2 * WIDTH as usize..][..COLUMN as usize - 1];
        row.iter().rev().map(|s| s / sin).collect::<Vec<_>>()
    };
    let faded: Vec<f32> = single(from)
        .iter()
        .zip(single(until))
        .map(|(a, b)| 0.5 * (a + b))
        .collect();
    let middle = wall.shares(0.5 * (from + until));
    assert!(
        between(&faded) > 8 * between(&middle).max(4),
        "{} faded, {} crawling",
        between(&faded),
        between(&middle)
    );
    // At the positions themselves both are the same.
    let worst = |time: f64| {
        let all = single(time).into_iter().zip(wall.shares(time));
        all.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    };
    assert!(
        worst(from) < 0.12 && worst(until) < 0.12,
        "{} {}",
        worst(from),
        worst(until)
    );
}

#[test]
fn ground_that_is_never_lit_stays_dark_and_a_day_without_end_stays_light() {
    // A shaft one sample wide, to whose bottom no sun of the tropics' edge comes.
    let grid = Grid::new(9, 9, [1.0, 1.0]);
    let heights: Vec<f32> = grid
        .size
        .rect()
        .cells()
        .map(|cell| if cell == (4, 4) { 0.0 } else { 1000.0 })
        .collect();
    let levels = |day: &Day| {
        let trace = trace_day(&heights, &grid, &Earth::default(), day, &Serial, &Silent).unwrap();
        day_levels(&grid, &trace, &Filter::default(), &Serial, &Silent).unwrap()
    };
    let share = |s: &DaySample, time: f64| {
        let times = [s.first, s.first_soft, s.last, s.last_soft].map(f16::to_f32);
        sun_of_day(times, 0.0, [0.0; 2], [0.0, 1.0, 0.0], time as f32)
    };
    let short = day("2026-12-21T12:00Z", 45.0, 0.0, 20);
    let made = levels(&short);
    for k in -40..=40 {
        let time = f64::from(k) / 32.0;
        assert_eq!(share(&made[0][40], time), 0.0, "{time}");
        let open = share(&made[0][0], time);
        assert_eq!(open > 0.5, time.abs() < 0.99, "{time}: {open}");
    }
    let endless = levels(&day("2026-06-21T12:00Z", 85.0, 0.0, 20));
    for k in -32..=32 {
        assert_eq!(share(&endless[0][0], f64::from(k) / 32.0), 1.0, "{k}");
    }
}

#[test]
fn coarse_ground_is_lit_over_as_long_as_its_pieces_take() {
    // Columns in turn have first light at -0.5 and at 0.1: half of the ground is lit in between.
    let grid = Grid::new(256, 256, [1.0, 1.0]);
    let column = |x: i64, a: f32, b: f32| if x % 2 == 0 { a } else { b };
    let times = |(x, _)| LitTimes {
        first: column(x, -0.5, 0.1),
        first_soft: 0.01,
        last: 0.9,
        last_soft: 0.01,
        slope_square: 0.0,
    };
    let trace: Vec<LitTimes> = grid.size.rect().cells().map(times).collect();
    let levels = day_levels(&grid, &trace, &Filter::default(), &Serial, &Silent).unwrap();
    let sample = levels[1][64 * 129 + 64];
    assert!((sample.first.to_f32() + 0.2).abs() < 1e-3, "{sample:?}");
    // Two values 0.3 from their mean: a half circle of that deviation has twice the radius.
    assert!((sample.first_soft.to_f32() - 0.6).abs() < 2e-3, "{sample:?}");
    assert!((sample.last_soft.to_f32() - 0.01).abs() < 5e-3, "{sample:?}");
    let times = [sample.first, sample.first_soft, sample.last, sample.last_soft].map(f16::to_f32);
    let share = |time: f32| sun_of_day(times, 0.0, [0.0; 2], [0.0, 1.0, 0.0], time);
    assert!((share(-0.2) - 0.5).abs() < 0.01 && share(-0.9) == 0.0 && share(0.5) == 1.0);
}

/// Random ground of some relief, voids in so many of a hundred samples and west of a coast.
fn ground(seed: u64, grid: &Grid, voids: f64, coast: i64) -> Vec<f32> {
    let mut heights = Random::new(seed).heights(grid.size.samples(), 0.0, 40.0, voids);
    for (h, (x, z)) in heights.iter_mut().zip(grid.size.rect().cells()) {
        let hill = 300.0 * (x as f32 / 30.0).sin() * (z as f32 / 41.0).cos();
        *h = if x < coast + z / 5 % 7 * coast.signum() {
            f32::NAN
        } else {
            *h + hill
        };
    }
    heights
}

/// All bits of times, which may be NaN.
fn bits(times: &[LitTimes]) -> Vec<[u32; 5]> {
    times
        .iter()
        .map(|times| times.fields().map(f32::to_bits))
        .collect()
}

#[test]
fn rows_in_pieces_give_the_bits_of_the_whole() {
    let cases = [
        (600, 300, 0.0, 0),
        (300, 420, 0.3, 0),
        (1100, 150, 0.01, 60),
        (70, 300, 0.97, 0),
        (1, 1, 0.0, 0),
        (1, 300, 0.1, 0),
        (5, 3, 1.0, 0),
    ];
    let day = day("2026-03-20T12:00Z", 42.5, 1.5, 5);
    let earth = Earth {
        radius_m: 7.3e6,
        ..Earth::default()
    };
    let filter = Filter::default();
    let threads = crate::build::Threads::new(2).unwrap();
    for (seed, (width, height, voids, coast)) in (0..).zip(cases) {
        let case = format!("{width} x {height}, voids {voids}, coast {coast}");
        let grid = Grid::new(width, height, [30.0, 22.0]);
        let heights = ground(seed, &grid, voids, coast);
        let plain = plain::trace_day(&heights, &grid, &earth, &day).unwrap();
        let traced = trace_day(&heights, &grid, &earth, &day, &threads, &Silent).unwrap();
        assert!(bits(&traced) == bits(&plain), "{case}");
        let want = plain::day_levels(&grid, &plain, &filter).unwrap();
        assert!(
            day_levels(&grid, &traced, &filter, &threads, &Silent).unwrap() == want,
            "{case}"
        );
        // In pieces of rows of any number, of which some are forgotten.
        let mut levels = DayLevels::new(&grid, &filter);
        let mut random = Random::new(seed);
        let mut forgotten = vec![0; want.len()];
        let mut taken = 0;
        while taken < height {
            let until = (taken + 1 + random.below(70)).min(height);
            levels.take(
                &traced[(taken * width) as usize..(until * width) as usize],
                &Serial,
            );
            taken = until;
            for (l, from) in (0..).zip(&mut forgotten) {
                let rows = *from..levels.known(l);
                let size = grid.level(l);
                let want =
                    &want[l as usize][(rows.start * size.width) as usize..(rows.end * size.width) as usize];
                let same = |(got, want): (&[f16; 5], &DaySample)| {
                    *got == [want.first, want.first_soft, want.last, want.last_soft, want.slope]
                };
                assert!(
                    levels.rows(l, rows.clone()).iter().zip(want).all(same),
                    "{case}, level {l}, {rows:?}"
                );
                if taken == height {
                    assert_eq!(rows.end, size.height, "{case}, level {l}");
                }
                *from = rows.start + random.below(rows.end - rows.start + 1);
                levels.forget(l, *from);
            }
        }
    }
    // A control: ground that is a metre higher somewhere is lit otherwise.
    let grid = Grid::new(300, 200, [30.0, 22.0]);
    let mut heights = ground(1, &grid, 0.0, 0);
    let before = plain::trace_day(&heights, &grid, &earth, &day).unwrap();
    heights[100 * 300 + 150] += 1.0;
    let after = trace_day(&heights, &grid, &earth, &day, &Serial, &Silent).unwrap();
    assert!(bits(&before) != bits(&after));
}
