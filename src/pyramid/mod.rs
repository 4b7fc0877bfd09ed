//! The pyramid: the DEM filtered into coarser and coarser levels, with bounds of how far each strays from it.
//!
//! [`Filter`] is the kernel, [`downsample()`] makes one level of the next finer one, `bounds` says how high
//! each patch reaches and how wrong it is. [`Pyramid`] holds all of it in memory and is a [`Levels`].
//! Heights are metres less [`Grid::base_m`]; NaN is no data.

use crate::error::{Error, ErrorKind, Result};
use crate::grid::{Grid, Rect, Size};
use crate::levels::{Arrival, Bounds, Levels, LightSample};
use crate::progress::Progress;
use crate::work::Work;

mod bounds;
mod downsample;
mod filter;
mod halving;
#[cfg(test)]
pub(crate) mod random;
#[cfg(test)]
mod tests;

pub use bounds::SATURATION;
pub use bounds::block::{Rows, Share, measure};
pub use bounds::rows::BoundsRows;
pub use downsample::{downsample, rounding_step};
pub use filter::{DEFAULT_LOBES, Filter, FilterKind, MAX_LOBES};
pub use halving::Halving;

/// All levels of a DEM in memory: heights, and once they are made bounds and light.
pub struct Pyramid {
    grid: Grid,
    /// Heights of each level, row by row.
    levels: Vec<Vec<f32>>,
    /// Bounds of each level's patches, row by row; empty until [`Pyramid::bound`].
    bounds: Vec<Vec<Bounds>>,
    /// Light of each level, row by row; empty until [`Pyramid::set_light`].
    light: Vec<Vec<LightSample>>,
    overshoot_m: f32,
    rounding_step_m: Option<f64>,
}

fn misuse(what: impl std::fmt::Display) -> Error {
    Error::new(ErrorKind::Misuse, "pyramid", what)
}

impl Pyramid {
    /// Filters `heights`, level 0 of `grid` row by row (metres less `base_m`, NaN for no data; infinities
    /// become NaN), into all of [`Grid::file_levels`].
    ///
    /// `step_m` is the step in metres of which every height of an integer DEM is a multiple, none for others;
    /// levels above 0 are then rounded to [`rounding_step`] of it.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] where the grid or the step is impossible or `heights` has another length;
    /// [`ErrorKind::Cancelled`].
    pub fn new(
        grid: Grid,
        heights: Vec<f32>,
        step_m: Option<f64>,
        filter: &Filter,
        work: &dyn Work,
        progress: &dyn Progress,
    ) -> Result<Self> {
        grid.check().map_err(misuse)?;
        if heights.len() as i64 != grid.size.samples() {
            let Size { width, height } = grid.size;
            return Err(misuse(format!(
                "{} heights given for {width} x {height} samples",
                heights.len()
            )));
        }
        let rounding_step_m = match step_m {
            None => None,
            Some(step) => Some(
                rounding_step(step)
                    .ok_or_else(|| misuse(format!("a height step of {step} m is not above 0 and finite")))?,
            ),
        };
        let mut heights = heights;
        for h in &mut heights {
            *h = valid(*h);
        }
        let count = grid.file_levels();
        progress.begin(
            "pyramid",
            (1..count).map(|l| grid.level(l).samples() as u64).sum(),
        );
        let mut levels = vec![heights];
        for l in 1..count {
            let fine = &levels[l as usize - 1];
            levels.push(downsample(
                fine,
                grid.level(l - 1),
                filter,
                rounding_step_m,
                work,
                progress,
            )?);
        }
        let overshoot_m = overshoot(&levels);
        Ok(Self {
            grid,
            levels,
            bounds: Vec::new(),
            light: Vec::new(),
            overshoot_m,
            rounding_step_m,
        })
    }

    /// Computes the bounds of every patch of every level. Until then [`Levels::bounds`] answers
    /// [`Arrival::Missing`].
    ///
    /// # Errors
    /// [`ErrorKind::Cancelled`]; there are then no bounds.
    pub fn bound(&mut self, work: &dyn Work, progress: &dyn Progress) -> Result<()> {
        let grid = &self.grid;
        progress.begin(
            "bounds",
            (0..self.level_count())
                .map(|l| grid.patches(l).samples() as u64)
                .sum(),
        );
        let mut all: Vec<Vec<Bounds>> = Vec::with_capacity(self.levels.len());
        for (l, heights) in self.levels.iter().enumerate() {
            let finer = all.last().map(Vec::as_slice);
            let made = bounds::bound_level(grid, l as u32, heights, &self.levels[0], finer, work, progress)?;
            all.push(made);
        }
        self.bounds = all;
        Ok(())
    }

    /// Takes the light of every level, row by row.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] where a level is missing or has another size.
    pub fn set_light(&mut self, levels: Vec<Vec<LightSample>>) -> Result<()> {
        let lengths = |l: usize| self.levels.get(l).map(Vec::len);
        if levels.len() != self.levels.len() {
            return Err(misuse(format!(
                "light of {} levels for {} levels",
                levels.len(),
                self.levels.len()
            )));
        }
        if let Some(l) = (0..levels.len()).find(|&l| lengths(l) != Some(levels[l].len())) {
            let Size { width, height } = self.grid.level(l as u32);
            let what = format!(
                "{} samples of light for level {l} of {width} x {height}",
                levels[l].len()
            );
            return Err(misuse(what));
        }
        self.light = levels;
        Ok(())
    }

    /// The heights of level `l`, row by row; empty where there is no such level.
    pub fn level(&self, l: u32) -> &[f32] {
        self.levels.get(l as usize).map_or(&[], Vec::as_slice)
    }

    /// The bounds of the patches of level `l`, row by row; empty where there is no such level or they are not
    /// made yet.
    pub fn level_bounds(&self, l: u32) -> &[Bounds] {
        self.bounds.get(l as usize).map_or(&[], Vec::as_slice)
    }

    /// The most, in metres, by which any sample of a level above 0 leaves the range of level 0.
    pub fn overshoot_m(&self) -> f32 {
        self.overshoot_m
    }

    /// What heights of levels above 0 are rounded to, in metres; none where they are as f32 holds them.
    pub fn rounding_step_m(&self) -> Option<f64> {
        self.rounding_step_m
    }
}

/// A height as it is stored: infinities are no data, and so is the least f32, which stands for no data on the GPU, and
/// no ground is that deep.
pub(crate) fn valid(height: f32) -> f32 {
    if height.is_infinite() || height == f32::MIN {
        f32::NAN
    } else {
        height
    }
}

/// The least and greatest valid sample; NaN where there is none.
pub(crate) fn range(samples: &[f32]) -> (f32, f32) {
    const LANES: usize = 8;
    let (mut low, mut high) = ([f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]);
    let mut widen = |part: &[f32]| {
        for ((low, high), &h) in low.iter_mut().zip(&mut high).zip(part) {
            // No comparison with NaN holds.
            *low = if h < *low { h } else { *low };
            *high = if h > *high { h } else { *high };
        }
    };
    let parts = samples.chunks_exact(LANES);
    widen(parts.remainder());
    parts.for_each(widen);
    let (low, high) = (
        low.into_iter().fold(f32::INFINITY, f32::min),
        high.into_iter().fold(f32::NEG_INFINITY, f32::max),
    );
    if low > high {
        (f32::NAN, f32::NAN)
    } else {
        (low, high)
    }
}

fn overshoot(levels: &[Vec<f32>]) -> f32 {
    let (low, high) = range(&levels[0]);
    levels[1..]
        .iter()
        .map(|level| range(level))
        .fold(0.0, |most, range| most.max(excess((low, high), range)))
}

/// The most by which a range leaves that of level 0; 0 where either is of no sample.
pub(crate) fn excess((low, high): (f32, f32), (l, h): (f32, f32)) -> f32 {
    0f32.max(low - l).max(h - high)
}

/// Copies `rect` of a grid of `size` elements out of `data`.
fn copy_rect<T: Copy>(data: &[T], size: Size, rect: Rect, out: &mut [T], what: &str) -> Result<Arrival> {
    if !size.rect().contains_rect(rect) {
        let Size { width, height } = size;
        let what = format!("{what} of {rect:?} asked for, outside of {width} x {height}");
        return Err(misuse(what));
    }
    if out.len() as i64 != rect.area() {
        return Err(misuse(format!(
            "room for {} {what}, {} asked for",
            out.len(),
            rect.area()
        )));
    }
    if !rect.is_empty() {
        let rows = out.chunks_exact_mut(rect.width() as usize);
        for (z, row) in (rect.z0..rect.z1).zip(rows) {
            let start = (z * size.width + rect.x0) as usize;
            row.copy_from_slice(&data[start..start + row.len()]);
        }
    }
    Ok(Arrival::Arrived)
}

impl Pyramid {
    fn check_level(&self, level: u32) -> Result<usize> {
        if level < self.level_count() {
            Ok(level as usize)
        } else {
            Err(misuse(format!(
                "level {level} asked for, of {} levels",
                self.level_count()
            )))
        }
    }
}

impl Levels for Pyramid {
    fn grid(&self) -> &Grid {
        &self.grid
    }

    fn heights(&self, level: u32, rect: Rect, out: &mut [f32]) -> Result<Arrival> {
        let l = self.check_level(level)?;
        copy_rect(&self.levels[l], self.grid.level(level), rect, out, "heights")
    }

    fn bounds(&self, level: u32, patches: Rect, out: &mut [Bounds]) -> Result<Arrival> {
        let l = self.check_level(level)?;
        match self.bounds.get(l) {
            None => Ok(Arrival::Missing),
            Some(bounds) => copy_rect(bounds, self.grid.patches(level), patches, out, "bounds"),
        }
    }

    fn has_light(&self) -> bool {
        !self.light.is_empty()
    }

    fn light(&self, level: u32, rect: Rect, out: &mut [LightSample]) -> Result<Arrival> {
        let l = self.check_level(level)?;
        let light = self
            .light
            .get(l)
            .ok_or_else(|| misuse("light asked for, but there is none"))?;
        copy_rect(light, self.grid.level(level), rect, out, "light samples")
    }
}
