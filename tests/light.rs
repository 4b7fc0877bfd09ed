//! The sun's share against a caster that shares nothing with it: every sample, every crossing, in f64.
//!
//! The caster knows no runs, no maxima, no table: it walks columns, rows and diagonals of each sample's own ray, and
//! stops only where the highest ground of the DEM could not raise its horizon.
#![allow(clippy::print_stderr, reason = "says what it found")]

mod support;

use std::path::{Path, PathBuf};

use clipscape::build::Threads;
use clipscape::grid::{Grid, Rect};
use clipscape::light::{DISC_DEG, Earth, Sun, disc_share, sun_share};
use clipscape::progress::Silent;
use clipscape::pyramid::{Filter, Pyramid};
use clipscape::query::{S0, lit_at};
use clipscape::source::{self, OpenOptions};
use clipscape::work::{Serial, each_chunk};
use support::{Random, seed};

/// A DEM, its heights row by row.
struct Dem {
    grid: Grid,
    heights: Vec<f32>,
}

impl Dem {
    fn at(&self, i: i64, j: i64) -> f64 {
        f64::from(self.heights[(j * self.grid.size.width + i) as usize])
    }

    /// The height of the surface at column `u` and row `v`, one of which, or their difference, is whole: between the
    /// two samples at the ends of that edge. NaN where one is void or missing.
    fn on_edge(&self, u: f64, v: f64, kind: usize) -> f64 {
        let size = self.grid.size;
        // A crossing this near to a sample passes through it.
        let snap = |x: f64| {
            if (x - x.round()).abs() < 1e-9 {
                x.round()
            } else {
                x
            }
        };
        let (u, v) = (snap(u), snap(v));
        let (i, j) = (u.floor() as i64, v.floor() as i64);
        let (step, weight) = match kind {
            0 => ([0, 1], v - v.floor()),
            1 => ([1, 0], u - u.floor()),
            _ => ([1, 1], u - u.floor()),
        };
        let rect = size.rect();
        if !rect.contains(i, j) {
            return f64::NAN;
        }
        if weight == 0.0 {
            return self.at(i, j);
        }
        let (i1, j1) = (i + step[0], j + step[1]);
        if !rect.contains(i1, j1) {
            return f64::NAN;
        }
        (1.0 - weight) * self.at(i, j) + weight * self.at(i1, j1)
    }

    /// The tangent of the horizon over sample (i, j), seen from `above_m` over it, at least 0.
    fn tangent(&self, azimuth_deg: f64, highest: f64, [i, j]: [i64; 2], above_m: f64) -> f64 {
        let (sin, cos) = azimuth_deg.to_radians().sin_cos();
        let clean = |x: f64| if x.abs() < 1e-15 { 0.0 } else { x };
        let mut rate = [
            clean(sin) / self.grid.spacing_m[0],
            -clean(cos) / self.grid.spacing_m[1],
        ];
        if (rate[0].abs() - rate[1].abs()).abs() < 1e-12 * rate[0].abs() {
            rate[1] = rate[0].abs().copysign(rate[1]);
        }
        let here = self.at(i, j) + above_m;
        let mut best = 0.0f64;
        for (kind, rate_of) in [rate[0], rate[1], rate[0] - rate[1]].into_iter().enumerate() {
            if rate_of == 0.0 {
                continue;
            }
            for line in 1.. {
                let t = f64::from(line) / rate_of.abs();
                if (highest - here) / t <= best {
                    break;
                }
                let (u, v) = (i as f64 + t * rate[0], j as f64 + t * rate[1]);
                let inside = |x: f64, n: i64| x > -0.5 && x < n as f64 - 0.5;
                if !inside(u, self.grid.size.width) || !inside(v, self.grid.size.height) {
                    break;
                }
                let height = match kind {
                    0 => self.on_edge(u.round(), v, 0),
                    1 => self.on_edge(u, v.round(), 1),
                    _ => {
                        // On a diagonal, column less row is whole.
                        let number = (u - v).round();
                        self.on_edge(u, u - number, 2)
                    }
                };
                best = best.max((height - here) / t); // f64's max leaves NaN out
            }
        }
        best
    }

    /// The cosine between normal and sun, by central differences.
    fn cosine(&self, sun: Sun, i: i64, j: i64) -> f64 {
        let here = self.at(i, j);
        let rise = |di: i64, dj: i64, spacing_m: f64| {
            let get = |i: i64, j: i64| {
                let inside = self.grid.size.rect().contains(i, j);
                Some(if inside { self.at(i, j) } else { f64::NAN }).filter(|h| !h.is_nan())
            };
            match (get(i - di, j - dj), get(i + di, j + dj)) {
                (Some(a), Some(b)) => (b - a) / 2.0 / spacing_m,
                (Some(a), None) => (here - a) / spacing_m,
                (None, Some(b)) => (b - here) / spacing_m,
                (None, None) => 0.0,
            }
        };
        let (e, s) = (
            rise(1, 0, self.grid.spacing_m[0]),
            rise(0, 1, self.grid.spacing_m[1]),
        );
        let (azimuth, altitude) = (sun.azimuth_deg.to_radians(), sun.altitude_deg.to_radians());
        let (east, south) = (azimuth.sin() * altitude.cos(), -azimuth.cos() * altitude.cos());
        (altitude.sin() - e * east - s * south) / (1.0 + e * e + s * s).sqrt()
    }

    /// Of every sample the share of the sun's disc and the cosine between normal and sun, or NaN.
    fn cast(&self, sun: Sun, threads: &Threads) -> Vec<[f64; 2]> {
        let width = self.grid.size.width as usize;
        let highest = self
            .heights
            .iter()
            .fold(f64::NEG_INFINITY, |m, &h| m.max(h.into()));
        let mut cast = vec![[f64::NAN; 2]; self.heights.len()];
        each_chunk(threads, &mut cast, width, |j, row| {
            for (i, out) in (0..).zip(row) {
                let j = j as i64;
                if !self.at(i, j).is_nan() {
                    let tangent = self.tangent(sun.azimuth_deg, highest, [i, j], 0.0);
                    *out = [
                        disc_share(tangent.atan(), sun.altitude_deg.to_radians()),
                        self.cosine(sun, i, j),
                    ];
                }
            }
        });
        cast
    }

    fn traced(&self, sun: Sun, threads: &Threads) -> Vec<f32> {
        sun_share(&self.heights, &self.grid, sun, threads, &Silent).unwrap()
    }
}

/// How traced shares differ from cast ones.
#[derive(Debug, Default)]
struct Difference {
    /// Root mean square and mean of the differences of the disc's share, where the ground faces the sun.
    disc_rms: f64,
    disc_mean: f64,
    /// The greatest difference of shares times cosine, anywhere.
    worst: f64,
    /// Samples that are partly lit, and wholly dark though they face the sun.
    partly: usize,
    dark: usize,
}

fn difference(traced: &[f32], cast: &[[f64; 2]]) -> Difference {
    let mut found = Difference::default();
    let (mut squares, mut sum, mut facing) = (0.0, 0.0, 0.0);
    for (&got, &[disc, cosine]) in traced.iter().zip(cast) {
        assert_eq!(got.is_nan(), disc.is_nan(), "voids stay void");
        if disc.is_nan() {
            continue;
        }
        let off = f64::from(got) - disc * cosine.max(0.0);
        found.worst = found.worst.max(off.abs());
        if cosine > 0.02 {
            let off = f64::from(got) / cosine - disc;
            squares += off * off;
            sum += off;
            facing += 1.0;
            found.partly += usize::from(disc > 0.0 && disc < 1.0);
            found.dark += usize::from(disc == 0.0);
        }
    }
    if facing > 0.0 {
        found.disc_rms = f64::sqrt(squares / facing);
        found.disc_mean = sum / facing;
    }
    found
}

fn sun(azimuth_deg: f64, altitude_deg: f64) -> Sun {
    Sun {
        azimuth_deg,
        altitude_deg,
    }
}

/// Rough ground over hills, with voids in places.
fn rough(width: i64, height: i64, spacing_m: [f64; 2], random: &mut Random) -> Dem {
    let grid = Grid::new(width, height, spacing_m);
    let voids = random.pick(&[0.0, 0.0, 0.1, 0.5]);
    let heights = grid
        .size
        .rect()
        .cells()
        .map(|(i, j)| {
            let (u, v) = (i as f64 / 17.0, j as f64 / 13.0);
            let hills = 150.0 * (u.sin() * v.cos() + (u * 0.31 + v * 0.2).sin());
            if random.uniform(0.0, 1.0) < voids {
                f32::NAN
            } else {
                (hills + random.uniform(0.0, 12.0)) as f32
            }
        })
        .collect();
    Dem { grid, heights }
}

/// Section 12's suns: 0 and 90 degrees, below the horizon, along a row, a column, a diagonal, and anyhow.
#[test]
fn suns_of_all_heights_and_ways_light_what_the_caster_lights() {
    let mut random = Random(seed(14));
    let threads = Threads::new(0).unwrap();
    let mut shown = 0;
    for (width, height, spacing_m) in [
        (90, 70, [30.0, 30.0]),
        (83, 101, [25.0, 40.0]),
        (200, 9, [30.0, 30.0]),
        (5, 160, [30.0, 30.0]),
        (1, 40, [10.0, 10.0]),
        (1, 1, [1.0, 1.0]),
    ] {
        let dem = rough(width, height, spacing_m, &mut random);
        // The diagonal of a cell, whatever its sides.
        let diagonal = (spacing_m[0] / spacing_m[1]).atan().to_degrees();
        let anyhow = random.uniform(0.0, 360.0);
        let ways = [
            0.0,
            90.0,
            180.0,
            270.0,
            diagonal,
            180.0 - diagonal,
            180.0 + diagonal,
            -diagonal,
            0.3,
            89.7,
            anyhow,
        ];
        for azimuth_deg in ways {
            for altitude_deg in [90.0, 89.9, 45.0, 12.0, 3.0, 0.2, 0.0, -0.2, -0.265, -5.0, -90.0] {
                let sun = sun(azimuth_deg, altitude_deg);
                let traced = dem.traced(sun, &threads);
                let found = difference(&traced, &dem.cast(sun, &threads));
                // What f32 costs: 2^-22 of the differences of heights, over the radius of the disc and 10 m.
                assert!(
                    found.worst < 1e-4 && found.disc_rms < 1e-5,
                    "{width} x {height}, {sun:?}, seed {}: {found:?}",
                    seed(14)
                );
                if altitude_deg <= -DISC_DEG / 2.0 {
                    assert!(
                        traced.iter().all(|&s| s.is_nan() || s == 0.0),
                        "{sun:?}: it has set"
                    );
                }
                if altitude_deg == 90.0 {
                    assert!(found.dark == 0, "{sun:?}: nothing stands over the zenith");
                }
                // A control: light from elsewhere must show.
                if altitude_deg == 3.0 && width.min(height) > 50 {
                    let beside = Sun {
                        azimuth_deg: azimuth_deg + 5.0,
                        ..sun
                    };
                    let beside = difference(&dem.traced(beside, &threads), &dem.cast(sun, &threads));
                    assert!(beside.disc_rms > 0.02 && found.dark > 100, "{sun:?}: {beside:?}");
                    shown += 1;
                }
            }
        }
    }
    assert_eq!(shown, 22);
}

/// Three crops of real mountains, by the longitude and latitude of their middle: of 400 samples a side, or as many as
/// `CLIPSCAPE_LIGHT_SIDE` says. Skipped where the data are not there.
#[test]
fn real_mountains_are_lit_as_the_caster_lights_them() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/sierra");
    if !folder.is_dir() {
        eprintln!("skipped: {} is not there", folder.display());
        return;
    }
    let source = source::open_with(&[PathBuf::from(&folder)], &OpenOptions::default()).unwrap();
    let description = source.description();
    let place = description.place.as_ref().unwrap();
    let threads = Threads::new(0).unwrap();
    let long = std::env::var("CLIPSCAPE_LIGHT_SIDE");
    let side: i64 = long.ok().and_then(|side| side.parse().ok()).unwrap_or(400);
    for (name, at) in [
        ("Mount Whitney", [-118.292, 36.579]),
        ("Yosemite Valley", [-119.590, 37.740]),
        ("White Mountain Peak", [-118.254, 37.634]),
    ] {
        let [i, j] = place.sample(at, description.grid.size.width);
        let corner = [i, j].map(|x| x as i64 - side / 2);
        let rect = Rect::new(corner[0], corner[1], corner[0] + side, corner[1] + side);
        let rect = rect.intersection(description.grid.size.rect());
        let mut heights = vec![0.0; rect.area() as usize];
        source.read(rect, &mut heights).unwrap();
        let dem = Dem {
            grid: Grid::new(rect.width(), rect.height(), description.grid.spacing_m),
            heights,
        };
        for sun in [sun(135.0, 3.0), sun(120.0, 3.0), sun(262.0, 12.0)] {
            let cast = dem.cast(sun, &threads);
            let found = difference(&dem.traced(sun, &threads), &cast);
            eprintln!(
                "{name} ({} x {}), {sun:?}: disc RMS {:.1e}, mean {:+.1e}, worst share {:.1e}; {} partly lit, {} dark",
                rect.width(),
                rect.height(),
                found.disc_rms,
                found.disc_mean,
                found.worst,
                found.partly,
                found.dark
            );
            assert!(found.disc_rms < 1e-5 && found.disc_mean.abs() < 1e-6, "{found:?}");
            assert!(found.dark > 5000 && found.partly > 1000, "{found:?}");
            // A control: half a degree higher is not the same sun.
            let higher = Sun {
                altitude_deg: sun.altitude_deg + 0.5,
                ..sun
            };
            let control = difference(&dem.traced(higher, &threads), &cast);
            assert!(
                control.disc_rms > 0.02 && control.disc_mean > 1e-3,
                "{name}: {control:?}"
            );
        }
    }
}

/// Points on the ground and in the air over it see of the sun what the caster says.
#[test]
fn points_in_the_air_are_lit_as_the_caster_lights_them() {
    let mut random = Random(seed(15));
    let (mut dark, mut partly, mut lit, mut off) = (0, 0, 0, 0);
    for (width, height, spacing_m) in [(90, 70, [30.0, 30.0]), (83, 101, [25.0, 40.0])] {
        let mut dem = rough(width, height, spacing_m, &mut random);
        // Behind a hole a ray may come out under the ground, which the caster never asks.
        dem.heights
            .iter_mut()
            .filter(|h| h.is_nan())
            .for_each(|h| *h = 0.0);
        let highest = dem
            .heights
            .iter()
            .fold(f64::NEG_INFINITY, |m, &h| m.max(h.into()));
        let mut levels = Pyramid::new(
            dem.grid,
            dem.heights.clone(),
            None,
            &Filter::default(),
            &Serial,
            &Silent,
        )
        .unwrap();
        levels.bound(&Serial, &Silent).unwrap();
        let ground = S0::new(&levels);
        let earth = Earth::default();
        for _ in 0..4000 {
            let sun = sun(
                random.uniform(0.0, 360.0),
                random.pick(&[-0.2, 0.1, 3.0, 8.0, 20.0, 45.0]),
            );
            let [i, j] = [width, height].map(|n: i64| random.uniform(0.0, n as f64) as i64);
            let above_m = random.pick(&[0.0, 0.0, 1.0, 10.0, 50.0]) * random.uniform(0.5, 1.0);
            let (x, z) = (i as f64 * spacing_m[0], j as f64 * spacing_m[1]);
            let y = dem.at(i, j) + above_m;
            let got = lit_at(&ground, &earth, sun, [x, y, z])
                .unwrap()
                .expect("it is not below the ground");
            let tangent = dem.tangent(sun.azimuth_deg, highest, [i, j], above_m);
            let want = disc_share(tangent.atan(), sun.altitude_deg.to_radians());
            assert!(
                (got - want).abs() < 1e-3,
                "({i}, {j}), {above_m} m up, {sun:?}, seed {}: {got}, not {want}",
                seed(15)
            );
            dark += u32::from(want == 0.0);
            lit += u32::from(want == 1.0);
            partly += u32::from(want > 0.0 && want < 1.0);
            // A control: the sun of a degree further round, and up, shows.
            let other = Sun {
                altitude_deg: sun.altitude_deg + 0.3,
                ..sun
            };
            off +=
                u32::from((lit_at(&ground, &earth, other, [x, y, z]).unwrap().unwrap() - want).abs() > 0.1);
            // Higher up it never gets darker, and under the ground is no light to speak of.
            let higher = lit_at(&ground, &earth, sun, [x, y + random.uniform(0.0, 30.0), z]).unwrap();
            assert!(higher.unwrap() >= got - 1e-4, "({i}, {j}), {sun:?}");
            let below = lit_at(&ground, &earth, sun, [x, dem.at(i, j) - 1.0, z]).unwrap();
            assert_eq!(below, None);
        }
        // Far up, and beyond the DEM, nothing stands before the sun.
        for at in [[100.0, 1e4, 100.0], [-1e5, 0.0, 50.0]] {
            assert_eq!(lit_at(&ground, &earth, sun(270.0, 10.0), at).unwrap(), Some(1.0));
        }
        let turned = Earth {
            grid_north_deg: 30.0,
            ..earth
        };
        let at = [x_of(40, spacing_m), dem.at(40, 40), 40.0 * spacing_m[1]];
        assert_eq!(
            lit_at(&ground, &turned, sun(100.0, 5.0), at).unwrap(),
            lit_at(&ground, &earth, sun(70.0, 5.0), at).unwrap()
        );
        assert!(lit_at(&ground, &earth, sun(f64::NAN, 5.0), at).is_err());
        assert!(lit_at(&ground, &earth, sun(0.0, 5.0), [f64::NAN, 0.0, 0.0]).is_err());
    }
    eprintln!("{dark} dark, {partly} partly lit, {lit} lit; the control differs at {off}");
    assert!(dark > 1000 && partly > 100 && lit > 1000 && off > 300);
}

fn x_of(i: i64, spacing_m: [f64; 2]) -> f64 {
    i as f64 * spacing_m[0]
}
