//! Filters compared: how far each coarse surface strays from the DEM, what becomes of peaks, what rings, how long it takes.
//!
//!     cargo bench --bench filters [-- ROUNDS [DEM...]]
//!
//! Without DEMs: the shipped one, and those of `../shared/data/small` where that folder is there and they can be read.
//! Then the default filter with 3 to 6 lobes. All figures are over the levels from 1 to the coarsest of a file.
//!
//! - *RMS, max*: of `S_l - S0` in metres over all samples of level 0 where both exist, `S_l` triangulated from north-west
//!   to south-east. Before they are printed they are held against the bounds of the pyramid: the greatest of a level must
//!   be what its patches' `error` says.
//! - *Peaks*: metres lost, in the mean, at the 100 samples of greatest topographic prominence (height above the lowest
//!   saddle on the way to higher ground, of 8 neighbours each, voids and edges counting as lowest). Lost is what the
//!   peak's height has above the greatest sample of the level within one step of it either way.
//! - *Overshoot*: the most, in metres, by which a sample leaves the range of the finer samples within one coarse step of
//!   it (5 x 5), which shows how much it rings; and the range of all samples of the DEM. Last rows and columns beyond the
//!   DEM, which continue it in a straight line, are left out.
//!   The number of lobes is decided by RMS and ringing: see [`clipscape::pyramid::DEFAULT_LOBES`].
//! - *Time*: of filtering all levels, on all processors, the median of ROUNDS (9) in which the filters take turns.
#![allow(clippy::print_stdout, reason = "a bench prints its table")]

use std::path::{Path, PathBuf};
use std::time::Instant;

use clipscape::build::Threads;
use clipscape::grid::{Grid, Rect};
use clipscape::progress::Silent;
use clipscape::pyramid::{Filter, FilterKind, Pyramid};
use clipscape::stats::percentile;
use clipscape::{Error, ErrorKind, Result};

/// The number of peaks.
const PEAKS: usize = 100;

/// A DEM whole.
struct Dem {
    name: String,
    grid: Grid,
    step_m: Option<f64>,
    heights: Vec<f32>,
    /// Samples of greatest prominence, (i, j).
    peaks: Vec<[i64; 2]>,
}

/// What is printed of one filter over one DEM.
#[derive(Default)]
struct Row {
    /// Of levels 1 and on.
    rms_m: Vec<f64>,
    max_m: Vec<f64>,
    peak_loss_m: Vec<f64>,
    ringing_m: f64,
    beyond_m: f64,
    times_ms: Vec<f64>,
}

impl Dem {
    fn read(path: &Path) -> Result<Self> {
        let source = clipscape::source::open(path)?;
        let description = source.description();
        let grid = description.grid;
        let mut heights = vec![f32::NAN; grid.size.samples() as usize];
        source.read(grid.size.rect(), &mut heights)?;
        Ok(Self {
            name: path
                .file_name()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned(),
            step_m: description.step_m,
            peaks: prominent(&heights, grid.size.width, PEAKS),
            grid,
            heights,
        })
    }

    fn pyramid(&self, filter: &Filter, threads: &Threads) -> Result<(Pyramid, f64)> {
        let heights = self.heights.clone();
        let start = Instant::now();
        let made = Pyramid::new(self.grid, heights, self.step_m, filter, threads, &Silent)?;
        Ok((made, start.elapsed().as_secs_f64() * 1e3))
    }

    /// All of a row but the times.
    fn measure(&self, filter: &Filter, threads: &Threads) -> Result<Row> {
        let (mut made, _) = self.pyramid(filter, threads)?;
        made.bound(threads, &Silent)?;
        let mut row = Row::default();
        for level in 1..self.grid.file_levels() {
            let (rms, max) = self.strays(&made, level);
            let bounds = made.level_bounds(level).iter();
            let stated = bounds.fold(0.0f64, |most, b| most.max(f64::from(b.error)));
            // `error` speaks of morph targets too, which are rounded to f32.
            if !(max <= stated && stated <= max * (1.0 + 1e-5) + 1e-3) {
                let what = format!("level {level} strays by {max} m, its bounds say {stated} m");
                return Err(Error::new(ErrorKind::Misuse, &self.name, what));
            }
            row.rms_m.push(rms);
            row.max_m.push(max);
            row.peak_loss_m.push(self.peak_loss(&made, level));
            let [ringing, beyond] = self.overshoots(&made, level);
            row.ringing_m = row.ringing_m.max(ringing);
            row.beyond_m = row.beyond_m.max(beyond);
        }
        Ok(row)
    }

    /// RMS and maximum of `S_l - S0` over the samples of level 0.
    fn strays(&self, made: &Pyramid, level: u32) -> (f64, f64) {
        let (size, step) = (self.grid.level(level), 1i64 << level);
        let coarse = made.level(level);
        let (mut squares, mut max, mut count) = (0.0, 0.0f64, 0u64);
        for ((x, z), &truth) in self.grid.size.rect().cells().zip(&self.heights) {
            let (i, j, u, v) = (x / step, z / step, x % step, z % step);
            // A corner without weight need not exist.
            let weighed = |di: i64, dj: i64, weight: i64| match weight {
                0 => 0.0,
                _ => f64::from(coarse[((j + dj) * size.width + i + di) as usize]) * weight as f64,
            };
            let sum = if u >= v {
                weighed(0, 0, step - u) + weighed(1, 0, u - v) + weighed(1, 1, v)
            } else {
                weighed(0, 0, step - v) + weighed(0, 1, v - u) + weighed(1, 1, u)
            };
            let stray = (sum / step as f64 - f64::from(truth)).abs();
            if stray.is_finite() {
                squares += stray * stray;
                max = max.max(stray);
                count += 1;
            }
        }
        ((squares / count.max(1) as f64).sqrt(), max)
    }

    /// Mean height lost at the peaks.
    fn peak_loss(&self, made: &Pyramid, level: u32) -> f64 {
        let (size, step) = (self.grid.level(level), 1i64 << level);
        let lost = self.peaks.iter().filter_map(|&[x, z]| {
            let near = Rect::new(
                (x + step - 1) / step - 1,
                (z + step - 1) / step - 1,
                x / step + 2,
                z / step + 2,
            );
            let near = near.intersection(size.rect()).cells();
            let highest = near
                .map(|(i, j)| made.level(level)[(j * size.width + i) as usize])
                .fold(f32::NAN, f32::max);
            let peak = self.heights[(z * self.grid.size.width + x) as usize];
            (!highest.is_nan()).then(|| f64::from(peak) - f64::from(highest))
        });
        let lost: Vec<f64> = lost.collect();
        lost.iter().sum::<f64>() / lost.len().max(1) as f64
    }

    /// The most by which a sample leaves the range of the finer ones within one coarse step, and that of the whole DEM.
    fn overshoots(&self, made: &Pyramid, level: u32) -> [f64; 2] {
        let (size, finer) = (self.grid.level(level), self.grid.level(level - 1));
        let range = |samples: &mut dyn Iterator<Item = f32>| {
            samples.fold((f32::NAN, f32::NAN), |(low, high), h| (low.min(h), high.max(h)))
        };
        let outside = |h: f32, (low, high): (f32, f32)| {
            (f64::from(low) - f64::from(h)).max(f64::from(h) - f64::from(high))
        };
        let whole = range(&mut self.heights.iter().copied());
        let mut worst = [0.0f64; 2];
        for ((i, j), &h) in size.rect().cells().zip(made.level(level)) {
            if h.is_nan() || i << level >= self.grid.size.width || j << level >= self.grid.size.height {
                continue;
            }
            let around = Rect::new(2 * i - 2, 2 * j - 2, 2 * i + 3, 2 * j + 3).intersection(finer.rect());
            let near = &mut around
                .cells()
                .map(|(x, z)| made.level(level - 1)[(z * finer.width + x) as usize]);
            worst[0] = worst[0].max(outside(h, range(near)));
            worst[1] = worst[1].max(outside(h, whole));
        }
        worst
    }
}

/// The `count` samples of greatest topographic prominence, the most prominent first.
///
/// Samples are flooded from the highest down; where two pools meet, the lower of their peaks has its saddle.
fn prominent(heights: &[f32], width: i64, count: usize) -> Vec<[i64; 2]> {
    const DRY: u32 = u32::MAX;
    let mut order: Vec<u32> = (0..heights.len() as u32)
        .filter(|&k| !heights[k as usize].is_nan())
        .collect();
    order.sort_by(|&a, &b| {
        heights[b as usize]
            .total_cmp(&heights[a as usize])
            .then(a.cmp(&b))
    });
    // The pool of each sample: its peak, by way of others.
    let mut pool = vec![DRY; heights.len()];
    fn peak_of(pool: &mut [u32], mut k: u32) -> u32 {
        while pool[k as usize] != k {
            pool[k as usize] = pool[pool[k as usize] as usize];
            k = pool[k as usize];
        }
        k
    }
    let mut peaks: Vec<(f32, u32)> = Vec::new();
    let rows = heights.len() as i64 / width;
    for &k in &order {
        pool[k as usize] = k;
        let (x, z) = (i64::from(k) % width, i64::from(k) / width);
        let around = Rect::new(x - 1, z - 1, x + 2, z + 2).intersection(Rect::new(0, 0, width, rows));
        for (x, z) in around.cells() {
            let other = (z * width + x) as usize;
            if pool[other] == DRY {
                continue;
            }
            let (a, b) = (peak_of(&mut pool, k), peak_of(&mut pool, other as u32));
            if a == b {
                continue;
            }
            let higher = |a: u32, b: u32| {
                heights[a as usize] > heights[b as usize]
                    || (heights[a as usize] == heights[b as usize] && a < b)
            };
            let (high, low) = if higher(a, b) { (a, b) } else { (b, a) };
            pool[low as usize] = high;
            if low != k {
                peaks.push((heights[low as usize] - heights[k as usize], low));
            }
        }
    }
    let lowest = order.last().map_or(0.0, |&k| heights[k as usize]);
    // What never met higher ground is the peak of an island.
    peaks.extend(
        order
            .iter()
            .filter(|&&k| pool[k as usize] == k)
            .map(|&k| (heights[k as usize] - lowest, k)),
    );
    peaks.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    peaks.truncate(count);
    peaks
        .iter()
        .map(|&(_, k)| [i64::from(k) % width, i64::from(k) / width])
        .collect()
}

/// A peak of 10 in a ring of 3 with an outlet at 2, and one of 7 beyond it: prominences 10 and 5.
fn check_prominence() {
    #[rustfmt::skip]
    let field = [
        0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
        0.0, 3.0, 3.0, 3.0, 0.0, 6.0, 0.0,
        0.0, 3.0, 10., 2.5, 2.0, 7.0, 0.0,
        0.0, 3.0, 3.0, 3.0, 0.0, 6.5, 0.0,
        0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
    ];
    assert_eq!(prominent(&field, 7, 9), [[2, 2], [5, 2]]);
}

fn dems(named: &[String]) -> Vec<PathBuf> {
    if !named.is_empty() {
        return named.iter().map(PathBuf::from).collect();
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let shipped = root.join("data/N42E001.hgt");
    let folder = root.join("../shared/data/small");
    let others = std::fs::read_dir(folder)
        .into_iter()
        .flatten()
        .flatten()
        .map(|e| e.path());
    let mut others: Vec<_> = others
        .filter(|path| path.file_name() != shipped.file_name())
        .collect();
    others.sort();
    std::iter::once(shipped).chain(others).collect()
}

fn print_table(dem: &Dem, rows: &[(String, Row)]) {
    let levels = 1..dem.grid.file_levels();
    let heads = |what: &str| {
        levels
            .clone()
            .map(|l| format!(" {what} {l} |"))
            .collect::<String>()
    };
    println!(
        "| filter |{}{}{} rings | beyond DEM | ms |",
        heads("RMS"),
        heads("max"),
        heads("peak")
    );
    println!("|---|{}---|---|---|", "---|".repeat(3 * levels.len()));
    for (name, row) in rows {
        let cells = |values: &[f64], digits: usize| {
            values
                .iter()
                .map(|v| format!(" {v:.digits$} |"))
                .collect::<String>()
        };
        let mut times = row.times_ms.clone();
        times.sort_by(f64::total_cmp);
        println!(
            "| {name} |{}{}{} {:.1} | {:.1} | {:.1} |",
            cells(&row.rms_m, 2),
            cells(&row.max_m, 0),
            cells(&row.peak_loss_m, 1),
            row.ringing_m,
            row.beyond_m,
            percentile(&times, 50.0)
        );
    }
    println!();
}

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let rounds: usize = arguments.first().and_then(|a| a.parse().ok()).unwrap_or(9).max(1);
    check_prominence();
    let threads = Threads::new(0)?;
    let mut filters: Vec<(String, Filter)> =
        FilterKind::ALL.map(|kind| (kind.to_string(), kind.into())).into();
    filters.extend((3..=6).map(|lobes| (format!("{lobes} lobes"), Filter::sinc_blackman(lobes))));
    let mut dem_count = 0;
    // Logarithms of each filter's figures over the default's, summed over DEMs and levels.
    let mut totals = vec![[0.0f64; 4]; filters.len()];
    let mut cases = 0;
    for path in dems(arguments.get(1..).unwrap_or_default()) {
        let dem = match Dem::read(&path) {
            Ok(dem) => dem,
            Err(error) => {
                println!("{error}: left out\n");
                continue;
            }
        };
        dem_count += 1;
        println!(
            "{}, {} x {}: metres, by level\n",
            dem.name, dem.grid.size.width, dem.grid.size.height
        );
        let mut rows = Vec::new();
        for (name, filter) in &filters {
            rows.push((name.clone(), dem.measure(filter, &threads)?));
        }
        for _ in 0..rounds {
            for ((_, filter), (_, row)) in filters.iter().zip(&mut rows) {
                row.times_ms.push(dem.pyramid(filter, &threads)?.1);
            }
        }
        print_table(&dem, &rows);
        let reference = &rows[FilterKind::ALL.len() - 2].1; // the default
        for (total, (_, row)) in totals.iter_mut().zip(&rows) {
            let ratio = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| (a / b).ln()).sum() };
            total[0] += ratio(&row.rms_m, &reference.rms_m);
            total[1] += ratio(&row.max_m, &reference.max_m);
            total[2] += ratio(&row.peak_loss_m, &reference.peak_loss_m);
            total[3] += (row.ringing_m / reference.ringing_m).ln();
        }
        cases += reference.rms_m.len();
    }
    println!("Over {dem_count} DEMs and their levels, geometric means against the default:\n");
    println!("| filter | RMS | max | peak loss | rings |\n|---|---|---|---|---|");
    for ((name, _), total) in filters.iter().zip(&totals) {
        let mean = |total: f64, count: usize| (total / count.max(1) as f64).exp();
        let [rms, max, peak] = [total[0], total[1], total[2]].map(|t| mean(t, cases));
        let rings = mean(total[3], dem_count);
        println!("| {name} | {rms:.4} | {max:.4} | {peak:.3} | {rings:.2} |");
    }
    Ok(())
}
