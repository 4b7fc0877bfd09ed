//! De-stepping: half a step at most, the same however it is read, and nearer to the ground that was rounded.

use super::*;
use crate::grid::{Grid, Size};

/// A DEM in memory.
struct Dem {
    description: Description,
    heights: Vec<f32>,
}

impl HeightSource for Dem {
    fn description(&self) -> &Description {
        &self.description
    }

    fn read(&self, rect: Rect, out: &mut [f32]) -> Result<()> {
        self.description.check_rect(rect, out)?;
        let width = self.description.grid.size.width;
        for ((x, z), out) in rect.cells().zip(out) {
            *out = self.heights[(z * width + x) as usize];
        }
        Ok(())
    }
}

/// The heights that `truth` gives, rounded to whole steps.
fn rounded_dem(size: Size, step_m: f64, truth: impl Fn(f64, f64) -> f64) -> Dem {
    let Size { width, height } = size;
    let mut description = super::super::held::bare_description("t", "test", "int16", size);
    description.grid = Grid::new(width, height, [1.0, 1.0]);
    description.step_m = Some(step_m);
    let height = |(x, z): (i64, i64)| ((truth(x as f64, z as f64) / step_m).round() * step_m) as f32;
    Dem {
        description,
        heights: size.rect().cells().map(height).collect(),
    }
}

/// White noise in 0 to 1 by place.
fn noise(x: i64, z: i64) -> f64 {
    let mut state = (x as u64) << 32 ^ z as u64 ^ 0x9e37_79b9_7f4a_7c15;
    for _ in 0..3 {
        state = (state ^ state >> 31).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    }
    (state >> 11) as f64 / (1u64 << 53) as f64
}

/// Slopes of every kind, noise in a corner, voids and a void coast.
fn rough(width: i64, height: i64, step_m: f64) -> Dem {
    let size = Size { width, height };
    let mut dem = rounded_dem(size, step_m, |x, z| {
        let hills = 40.0 * (x / 60.0).sin() * (z / 45.0).cos() + 0.02 * x;
        let cliff = if x > 0.7 * width as f64 { 300.0 } else { 0.0 };
        let corner = if z > 0.6 * height as f64 { 9000.0 } else { 2.0 };
        step_m * (hills + cliff + corner * noise(x as i64, z as i64) * f64::from(x > 150.0))
    });
    for ((x, z), h) in size.rect().cells().zip(&mut dem.heights) {
        if noise(x + 7, z) < 0.02 || x < 5 + z % 7 {
            *h = f32::NAN;
        }
    }
    dem
}

fn all(source: &dyn HeightSource) -> Vec<f32> {
    let size = source.description().grid.size;
    let mut out = vec![0.0; size.samples() as usize];
    source.read(size.rect(), &mut out).unwrap();
    out
}

fn bits(heights: &[f32]) -> Vec<u32> {
    heights.iter().map(|h| h.to_bits()).collect()
}

#[test]
fn the_same_bits_however_it_is_read() {
    for (width, height) in [(1, 1), (1, 300), (300, 1), (33, 70), (601, 290)] {
        let dem = rough(width, height, 1.0);
        let destepped = Destepped::new(&dem).unwrap();
        let whole = all(&destepped);
        for (columns, rows) in [(width, 256), (width, 7), (256, 256), (97, 64)] {
            for z0 in (0..height).step_by(rows as usize) {
                for x0 in (0..width).step_by(columns as usize) {
                    let rect = Rect::new(x0, z0, (x0 + columns).min(width), (z0 + rows).min(height));
                    let mut part = vec![0.0; rect.area() as usize];
                    destepped.read(rect, &mut part).unwrap();
                    let want: Vec<f32> = rect
                        .cells()
                        .map(|(x, z)| whole[(z * width + x) as usize])
                        .collect();
                    assert!(bits(&part) == bits(&want), "{width} x {height}, {rect:?}");
                }
            }
        }
        // A control: with one sample another the heights around it are others, and only as far as it reaches.
        let mut other = rough(width, height, 1.0);
        let (x, z) = (width / 2, height / 2);
        other.heights[(z * width + x) as usize] += 1.0;
        let other = all(&Destepped::new(&other).unwrap());
        let mut changed = 0;
        for ((i, j), (a, b)) in dem
            .description
            .grid
            .size
            .rect()
            .cells()
            .zip(whole.iter().zip(&other))
        {
            if a.to_bits() != b.to_bits() {
                assert!((i - x).abs() <= REACH && (j - z).abs() <= REACH, "({i}, {j})");
                changed += 1;
            }
        }
        let void = dem.heights[(z * width + x) as usize].is_nan();
        assert!(changed > 0 || void);
    }
}

/// Heights that moved by more than half of `step_m`, and whether voids are the same.
fn strays(before: &[f32], after: &[f32], step_m: f64) -> (usize, bool) {
    let moved = |(a, b): (&f32, &f32)| (f64::from(*a) - f64::from(*b)).abs() > 0.5 * step_m;
    let stray = before.iter().zip(after).filter(|pair| moved(*pair)).count();
    let same_voids = before.iter().zip(after).all(|(a, b)| a.is_nan() == b.is_nan());
    (stray, same_voids)
}

#[test]
fn no_height_moves_by_more_than_half_a_step_and_voids_stay() {
    for step_m in [1.0, 0.1, 0.3048, 0.25, 1e-3, 5.0, 1e-20] {
        let dem = rough(601, 290, step_m);
        let after = all(&Destepped::new(&dem).unwrap());
        assert_eq!(strays(&dem.heights, &after, step_m), (0, true), "step {step_m}");
        let moved = dem
            .heights
            .iter()
            .zip(&after)
            .filter(|(a, b)| (*a - *b).abs() > 0.0)
            .count();
        assert!(moved > 50_000, "step {step_m}: only {moved} moved");
        // Controls: smoothed as if its step were three of its own, and with its voids filled.
        let mut coarse = rough(601, 290, step_m);
        coarse.description.step_m = Some(3.0 * step_m);
        let mut after = all(&Destepped::new(&coarse).unwrap());
        assert!(strays(&dem.heights, &after, step_m).0 > 1000);
        after
            .iter_mut()
            .for_each(|h| *h = if h.is_nan() { 0.0 } else { *h });
        assert!(!strays(&dem.heights, &after, step_m).1);
    }
    // Heights so great that f32 has none between them do not move.
    let size = Size {
        width: 80,
        height: 80,
    };
    let dem = rounded_dem(size, 1.0, |x, _| 16_777_000.0 + 0.3 * x);
    let after = all(&Destepped::new(&dem).unwrap());
    assert_eq!(strays(&dem.heights, &after, 1.0), (0, true));
}

/// RMS of `heights` against the truth, and of their slopes to the east and to the south.
fn errors(size: Size, heights: &[f32], truth: impl Fn(f64, f64) -> f64) -> [f64; 2] {
    let at = |x: i64, z: i64| f64::from(heights[(z * size.width + x) as usize]);
    let error = |x: i64, z: i64| at(x, z) - truth(x as f64, z as f64);
    let inner = size.rect().grown(-1);
    let mut sums = [0.0; 2];
    for (x, z) in inner.cells() {
        sums[0] += error(x, z).powi(2);
        let slopes = [
            error(x + 1, z) - error(x - 1, z),
            error(x, z + 1) - error(x, z - 1),
        ];
        sums[1] += slopes.iter().map(|s| (s / 2.0).powi(2)).sum::<f64>();
    }
    sums.map(|sum| (sum / inner.area() as f64).sqrt())
}

#[test]
fn terraces_become_the_slopes_that_they_were() {
    let size = Size {
        width: 400,
        height: 400,
    };
    type Truth = fn(f64, f64) -> f64;
    // The least factor by which the RMS of heights, and of slopes, falls.
    let cases: [(&str, Truth, [f64; 2]); 5] = [
        ("plane of 1/20", |x, z| 3.3 + 0.047 * x + 0.019 * z, [10.0, 15.0]),
        ("plane of 1/3", |x, z| 3.3 + 0.27 * x + 0.13 * z, [20.0, 25.0]),
        (
            "cone",
            |x, z| 200.0 - 0.1 * (x - 200.3).hypot(z - 180.7),
            [10.0, 15.0],
        ),
        (
            "hills",
            |x, z| 20.0 * (x / 40.0).sin() * (z / 55.0).cos(),
            [4.0, 10.0],
        ),
        (
            "gentle hills",
            |x, z| 6.0 * (x / 60.0).sin() * (z / 75.0).cos(),
            [5.0, 8.0],
        ),
    ];
    for (name, truth, [least, least_slope]) in cases {
        let dem = rounded_dem(size, 1.0, truth);
        let after = all(&Destepped::new(&dem).unwrap());
        let ([h, s], [h0, s0]) = (errors(size, &after, truth), errors(size, &dem.heights, truth));
        assert!(
            h0 / h > least && s0 / s > least_slope,
            "{name}: {h0} to {h}, {s0} to {s}"
        );
    }
}

#[test]
fn level_ground_and_single_walls_stay_as_they_are() {
    let size = Size {
        width: 200,
        height: 150,
    };
    let level = rounded_dem(size, 1.0, |_, _| 7.0);
    assert_eq!(all(&Destepped::new(&level).unwrap()), level.heights);
    let wall = rounded_dem(size, 1.0, |x, _| if x < 90.0 { 0.0 } else { 40.0 });
    assert_eq!(all(&Destepped::new(&wall).unwrap()), wall.heights);
}

#[test]
fn a_dem_without_a_step_is_refused() {
    let size = Size { width: 5, height: 4 };
    for step_m in [
        None,
        Some(0.0),
        Some(-1.0),
        Some(f64::NAN),
        Some(f64::INFINITY),
        Some(1e-300),
    ] {
        let mut dem = rounded_dem(size, 1.0, |x, _| x);
        dem.description.step_m = step_m;
        let error = Destepped::new(&dem).err().unwrap();
        assert_eq!(error.kind(), ErrorKind::Misuse);
        assert!(
            error.to_string().contains("not whole numbers of one step"),
            "{error}"
        );
    }
    let dem = rounded_dem(size, 0.1, |x, _| x);
    let destepped = Destepped::new(&dem).unwrap();
    assert_eq!(
        (destepped.quantum_m(), destepped.description().step_m),
        (1.0 / 512.0, None)
    );
    let dem = rounded_dem(size, 2.0, |x, _| x);
    assert_eq!(Destepped::new(&dem).unwrap().description().step_m, Some(0.0625));
}
