//! A draft: levels of a DEM that stand in for its pyramid until that is built, from what is quick to read.
//!
//! One level of the DEM, the *drawn-up* one, is resampled from an overview of the file where it has one that is fine
//! enough, else from one row of the DEM for each row of the level; coarser levels are filtered from it, and finer
//! ones lie on its surface. So all levels are there at once, smooth where the DEM is not. A sample is void where all
//! that was read around it is. Bounds hold the draft's own heights; how far it is from the DEM is not known: a draft is
//! *provisional*.

use crate::build::Threads;
use crate::error::{Error, ErrorKind, Result};
use crate::grid::{Grid, Patch, Rect, Size};
use crate::levels::{Arrival, Bounds, Levels, LightSample};
use crate::progress::{Progress, Silent};
use crate::pyramid::{Filter, downsample};
use crate::source::{HeightSource, Overview};
use crate::work::each_chunk;

/// Samples of the drawn-up level, at most: enough for a picture that shows the whole.
const MOST_SAMPLES: i64 = 1 << 20;

/// Levels of a DEM from a quick look at it.
pub(super) struct Draft {
    name: String,
    grid: Grid,
    /// The drawn-up level.
    first: u32,
    /// The heights of it and of all coarser levels, row by row.
    levels: Vec<Vec<f32>>,
    /// Least and greatest height of all; NaN where there is none.
    range_m: [f32; 2],
}

impl Draft {
    /// Looks at `source`, on `threads`.
    ///
    /// # Errors
    /// Those of reading; [`ErrorKind::Cancelled`].
    pub(super) fn new(source: &dyn HeightSource, threads: &Threads, progress: &dyn Progress) -> Result<Self> {
        let description = source.description();
        let grid = description.grid;
        grid.check()
            .map_err(|what| Error::new(ErrorKind::Misuse, &description.name, what))?;
        let last = grid.file_levels() - 1;
        let fits = |level: &u32| grid.level(*level).samples() <= MOST_SAMPLES;
        let first = (0..last).find(fits).unwrap_or(last);
        let look = Look {
            step: 1 << first,
            size: grid.level(first),
        };
        // A file's overviews are as coarse as they are: the coarsest that is fine enough is the least to read.
        let overviews = source.overviews()?;
        let fine_enough = |o: &&Overview| o.step.iter().all(|step| *step <= look.step as f64);
        let heights = match overviews.iter().rev().find(fine_enough) {
            Some(overview) => look.at_overview(overview, threads, progress)?,
            None => look.at_rows(source, threads, progress)?,
        };
        let mut levels = vec![heights];
        for level in first..last {
            let fine = &levels[(level - first) as usize];
            let coarse = downsample(
                fine,
                grid.level(level),
                &Filter::default(),
                None,
                threads,
                &Silent,
            )?;
            levels.push(coarse);
        }
        let range_m = range(levels.iter().flatten());
        Ok(Self {
            name: description.name.clone(),
            grid,
            first,
            levels,
            range_m,
        })
    }

    /// The heights of row `j`, from column `i0` on: the level's own, or those of the drawn-up level's surface there.
    fn row(&self, level: u32, i0: i64, j: i64, out: &mut [f32]) {
        let own = |level: u32, j: i64| {
            let width = self.grid.level(level).width;
            &self.levels[(level - self.first) as usize][(j * width) as usize..][..width as usize]
        };
        if level >= self.first {
            out.copy_from_slice(&own(level, j)[i0 as usize..][..out.len()]);
            return;
        }
        // The triangle of the drawn-up level that holds a sample, and its place there.
        let shift = self.first - level;
        let last = self.grid.level(self.first).height - 1;
        let north = own(self.first, j >> shift);
        let south = own(self.first, ((j >> shift) + 1).min(last));
        let whole = 1i64 << shift;
        let scale = 1.0 / whole as f32;
        let v = (j & (whole - 1)) as f32 * scale;
        for (i, out) in (i0..).zip(out) {
            let (a, u) = ((i >> shift) as usize, (i & (whole - 1)) as f32 * scale);
            let east = (a + 1).min(north.len() - 1);
            let (side, weights) = if u >= v {
                (north[east], [1.0 - u, u - v, v])
            } else {
                (south[a], [1.0 - v, v - u, u])
            };
            let corners = [north[a], side, south[east]];
            let sum: f32 = corners.iter().zip(weights).map(|(h, w)| h * w).sum();
            *out = if sum.is_nan() {
                without_voids(corners, weights)
            } else {
                sum
            };
        }
    }

    fn check(&self, level: u32, rect: Rect, size: Size, places: usize) -> Result<()> {
        let fits = size.rect().contains_rect(rect) && places as i64 == rect.area();
        if level < self.level_count() && fits {
            return Ok(());
        }
        let what = format!("{rect:?} with {places} places does not fit {size:?} of level {level}");
        Err(Error::new(ErrorKind::Misuse, &self.name, what))
    }
}

impl Levels for Draft {
    fn grid(&self) -> &Grid {
        &self.grid
    }

    fn heights(&self, level: u32, rect: Rect, out: &mut [f32]) -> Result<Arrival> {
        self.check(level, rect, self.grid.level(level), out.len())?;
        if !rect.is_empty() {
            for (j, row) in (rect.z0..).zip(out.chunks_exact_mut(rect.width() as usize)) {
                self.row(level, rect.x0, j, row);
            }
        }
        Ok(Arrival::Arrived)
    }

    fn bounds(&self, level: u32, patches: Rect, out: &mut [Bounds]) -> Result<Arrival> {
        self.check(level, patches, self.grid.patches(level), out.len())?;
        let [need_min, need_max] = self.range_m;
        let size = self.grid.level(level);
        let mut band = Vec::new();
        for (b, row) in (patches.z0..patches.z1).zip(out.chunks_exact_mut(patches.width().max(1) as usize)) {
            // The samples of a row of patches.
            let first = Patch::new(level, patches.x0, b).samples_within(size);
            let last = Patch::new(level, patches.x1 - 1, b).samples_within(size);
            let samples = Rect { x1: last.x1, ..first };
            band.resize(samples.area() as usize, 0.0);
            let _ = self.heights(level, samples, &mut band)?;
            for (a, out) in (patches.x0..).zip(row) {
                let patch = Patch::new(level, a, b).samples_within(size);
                let columns = (patch.x0 - samples.x0) as usize..(patch.x1 - samples.x0) as usize;
                let rows = band.chunks_exact(samples.width() as usize);
                let [min, max] = range(rows.flat_map(|row| &row[columns.clone()]));
                // How far it is off, nobody knows: detail is never left out.
                *out = Bounds {
                    min,
                    max,
                    error: if min.is_nan() { f32::NAN } else { f32::MAX },
                    need_min,
                    need_max,
                    need_error: if need_min.is_nan() { f32::NAN } else { f32::MAX },
                };
            }
        }
        Ok(Arrival::Arrived)
    }

    fn has_light(&self) -> bool {
        false
    }

    fn light(&self, _: u32, _: Rect, _: &mut [LightSample]) -> Result<Arrival> {
        Err(Error::new(ErrorKind::Misuse, &self.name, "has no light"))
    }

    fn is_provisional(&self) -> bool {
        true
    }
}

/// The weighted mean of the corners that are not void: the DEM may have data where one is. NaN where those that count all
/// are.
fn without_voids(corners: [f32; 3], weights: [f32; 3]) -> f32 {
    let there = corners.into_iter().zip(weights);
    let (sum, weight) = there
        .filter(|(h, w)| !h.is_nan() && *w > 0.0)
        .fold((0.0, 0.0), |(sum, weight), (h, w)| (sum + h * w, weight + w));
    if weight > 0.0 { sum / weight } else { f32::NAN }
}

/// Least and greatest; NaN where there is none.
fn range<'h>(heights: impl Iterator<Item = &'h f32>) -> [f32; 2] {
    heights.fold([f32::NAN; 2], |[low, high], h| [low.min(*h), high.max(*h)])
}

/// A level that is looked up in something finer.
struct Look {
    /// Columns and rows of the DEM from sample to sample.
    step: i64,
    size: Size,
}

impl Look {
    /// From one row of the DEM for each of the level's own, and of that the mean around each sample.
    fn at_rows(
        &self,
        source: &dyn HeightSource,
        threads: &Threads,
        progress: &dyn Progress,
    ) -> Result<Vec<f32>> {
        let Size { width, height } = source.description().grid.size;
        let reach = self.step / 2;
        self.rows(threads, progress, &source.description().name, |j, row| {
            let z = (j * self.step).min(height - 1);
            let mut read = vec![f32::NAN; width as usize];
            source.read(Rect::new(0, z, width, z + 1), &mut read)?;
            for (i, out) in row.iter_mut().enumerate() {
                let centre = (i as i64 * self.step).min(width - 1);
                let around = (centre - reach).max(0)..(centre + reach + 1).min(width);
                *out = mean(around.map(|x| read[x as usize]));
            }
            Ok(())
        })
    }

    /// From the samples of an overview around each of the level's own.
    fn at_overview(
        &self,
        overview: &Overview,
        threads: &Threads,
        progress: &dyn Progress,
    ) -> Result<Vec<f32>> {
        let description = overview.source.description();
        let Size { width, height } = description.grid.size;
        // Samples of the overview whose places lie within half a step of the sample's, one at least.
        let around = |k: i64, axis: usize, count: i64| {
            let at = |k: f64| (k * self.step as f64 - overview.shift[axis]) / overview.step[axis];
            let [low, high] = [k as f64 - 0.5, k as f64 + 0.5].map(at);
            let nearest = (at(k as f64).round() as i64).clamp(0, count - 1);
            let first = (low.ceil() as i64).clamp(0, nearest);
            first..(high.floor() as i64).clamp(nearest, count - 1) + 1
        };
        self.rows(threads, progress, &description.name, |j, row| {
            let z = around(j, 1, height);
            let mut read = vec![f32::NAN; (width * (z.end - z.start)) as usize];
            overview
                .source
                .read(Rect::new(0, z.start, width, z.end), &mut read)?;
            for (i, out) in row.iter_mut().enumerate() {
                let x = around(i as i64, 0, width);
                let cells = (0..z.end - z.start).flat_map(|z| x.clone().map(move |x| (x, z)));
                *out = mean(cells.map(|(x, z)| read[(z * width + x) as usize]));
            }
            Ok(())
        })
    }

    /// Fills the level's rows, a run of them at a time: what lies beside each other is read by one thread.
    fn rows(
        &self,
        threads: &Threads,
        progress: &dyn Progress,
        name: &str,
        fill: impl Fn(i64, &mut [f32]) -> Result<()> + Sync,
    ) -> Result<Vec<f32>> {
        let Size { width, height } = self.size;
        let mut heights = vec![f32::NAN; (width * height) as usize];
        let run = (height / (4 * threads.count() as i64)).max(1);
        let failed = std::sync::Mutex::new(Ok(()));
        progress.begin("look", height as u64);
        each_chunk(threads, &mut heights, (run * width) as usize, |k, rows| {
            for (j, row) in (k as i64 * run..).zip(rows.chunks_exact_mut(width as usize)) {
                let filled = match progress.cancelled() {
                    true => Err(Error::cancelled(name)),
                    false => fill(j, row),
                };
                if let Err(error) = filled {
                    if let Ok(mut failed) = failed.lock() {
                        *failed = Err(error);
                    }
                    return;
                }
                progress.advance(1);
            }
        });
        failed
            .into_inner()
            .unwrap_or_else(std::sync::PoisonError::into_inner)
            .map(|()| heights)
    }
}

/// The mean of those that are not void; NaN where all are.
fn mean(heights: impl Iterator<Item = f32>) -> f32 {
    let valid = heights.filter(|h| h.is_finite());
    let (sum, count) = valid.fold((0.0f64, 0u32), |(sum, count), h| (sum + f64::from(h), count + 1));
    if count == 0 {
        f32::NAN
    } else {
        (sum / f64::from(count)) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::{Description, Synth};

    /// A plane with a void corner, and an overview of it if wanted.
    struct Plane(Description, bool);

    fn plane(x: f64, z: f64) -> f64 {
        100.0 + 0.25 * x - 0.125 * z
    }

    impl Plane {
        fn new(size: i64, overview: bool) -> Self {
            Self(
                HeightSource::description(&Synth::new(size, 1).unwrap()).clone(),
                overview,
            )
        }
    }

    impl HeightSource for Plane {
        fn description(&self) -> &Description {
            &self.0
        }

        fn read(&self, rect: Rect, out: &mut [f32]) -> Result<()> {
            assert!(!self.1, "it has an overview");
            for ((i, j), out) in rect.cells().zip(out) {
                let void = i < 900 && j < 900;
                *out = if void {
                    f32::NAN
                } else {
                    plane(i as f64, j as f64) as f32
                };
            }
            Ok(())
        }

        fn overviews(&self) -> Result<Vec<Overview>> {
            /// Every fourth sample, shifted as pixels of overviews are.
            struct Fourth(Description);
            impl HeightSource for Fourth {
                fn description(&self) -> &Description {
                    &self.0
                }
                fn read(&self, rect: Rect, out: &mut [f32]) -> Result<()> {
                    for ((i, j), out) in rect.cells().zip(out) {
                        *out = plane(4.0 * i as f64 + 1.5, 4.0 * j as f64 + 1.5) as f32;
                    }
                    Ok(())
                }
            }
            let mut description = self.0.clone();
            let size = description.grid.size;
            description.grid.size = Size {
                width: size.width / 4,
                height: size.height / 4,
            };
            let overview = Overview {
                source: Box::new(Fourth(description)),
                step: [4.0; 2],
                shift: [1.5; 2],
            };
            Ok(if self.1 { vec![overview] } else { Vec::new() })
        }
    }

    #[test]
    fn a_plane_is_a_plane_on_all_levels_but_at_its_edges() {
        for overview in [false, true] {
            let draft = Draft::new(&Plane::new(5000, overview), &Threads::new(2).unwrap(), &Silent).unwrap();
            assert_eq!(draft.first, 3);
            let mut most = 0.0f64;
            for level in 0..draft.level_count() {
                let size = draft.grid.level(level);
                let step = 1i64 << level;
                for k in 0..200 {
                    let (i, j) = ((k * 7919) % size.width, (k * 104_729) % size.height);
                    let inner = |n: i64| (24..5000 - 24 - step).contains(&(n * step));
                    let voids = |n: i64| !overview && n * step < 1200;
                    if !inner(i) || !inner(j) || voids(i) && voids(j) {
                        continue;
                    }
                    let mut out = [0.0];
                    let _ = draft
                        .heights(level, Rect::new(i, j, i + 1, j + 1), &mut out)
                        .unwrap();
                    let want = plane((i * step) as f64, (j * step) as f64);
                    most = most.max((f64::from(out[0]) - want).abs());
                }
            }
            // An overview's samples around one of ours lie a little to one side of it.
            assert!(most < if overview { 0.6 } else { 0.01 }, "{most} m");
        }
    }

    #[test]
    fn there_is_no_hole_where_the_dem_has_data_and_bounds_hold_what_is_drawn() {
        let source = Plane::new(5000, false);
        let draft = Draft::new(&source, &Threads::new(1).unwrap(), &Silent).unwrap();
        let rect = Rect::new(850, 850, 1000, 1000);
        let (mut drawn, mut dem) = (vec![0.0; 22_500], vec![0.0; 22_500]);
        let _ = draft.heights(0, rect, &mut drawn).unwrap();
        source.read(rect, &mut dem).unwrap();
        let holes = drawn.iter().zip(&dem).filter(|(a, b)| a.is_nan() && !b.is_nan());
        assert_eq!(holes.count(), 0);
        assert!(drawn.iter().any(|h| h.is_nan()), "the middle of the void is one");
        for level in [0, 2, 3, 5] {
            let patch = Patch::new(level, 5, 9);
            let mut bounds = [Bounds::VOID];
            let _ = draft.bounds(level, Rect::new(5, 9, 6, 10), &mut bounds).unwrap();
            let samples = patch.samples_within(draft.grid.level(level));
            for (i, j) in samples.cells() {
                let mut height = [0.0];
                draft.row(level, i, j, &mut height);
                assert!(height[0].is_nan() || (bounds[0].min..=bounds[0].max).contains(&height[0]));
            }
        }
        assert!(draft.is_provisional());
    }

    #[test]
    fn what_cannot_be_read_is_said() {
        struct Broken(Plane);
        impl HeightSource for Broken {
            fn description(&self) -> &Description {
                self.0.description()
            }
            fn read(&self, _: Rect, _: &mut [f32]) -> Result<()> {
                Err(Error::new(ErrorKind::Broken, "a", "is damaged"))
            }
        }
        let threads = Threads::new(2).unwrap();
        let error = Draft::new(&Broken(Plane::new(5000, false)), &threads, &Silent)
            .err()
            .unwrap();
        assert_eq!(error.kind(), ErrorKind::Broken);
    }
}
