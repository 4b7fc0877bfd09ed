//! Procedural mountains, `synth:SIZE:SEED`: a height source and a pyramid without file, filter or memory.
//!
//! Any sample of any level is computed alone, in a time that depends on the number of octaves only. A level
//! leaves out what its grid cannot carry, and its bounds follow from the amplitudes of what is left out
//! (`synth/bound.rs`), so nothing is ever built or loaded. The field does not depend on the size: a smaller
//! terrain is the north-west corner of a larger one with the same seed. All bits are the same on every machine.

mod bound;
mod field;
mod noise;

use self::field::{Cells, Field, OCTAVES};
use self::noise::Cell;
use super::processors::Processors;
use super::{Description, HeightSource};
use crate::error::{Error, ErrorKind, Result};
use crate::grid::{Grid, PATCH, Patch, Rect, Size};
use crate::levels::{Arrival, Bounds, Levels, LightSample};
use crate::work::each_chunk;

/// The greatest size, in samples along a side.
pub const MAX_SYNTH_SIZE: i64 = 1 << 20;

/// Samples that one task computes at least, in whole rows.
const TASK_SAMPLES: i64 = 1 << 14;

/// Metres between samples.
const SPACING_M: f64 = 30.0;

/// Fractal mountains of `size` x `size` samples, 30 m apart.
#[derive(Clone, Debug)]
pub struct Synth {
    description: Description,
    field: Field,
}

impl Synth {
    /// Mountains of `size` x `size` samples.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] for a size below 1 or above [`MAX_SYNTH_SIZE`].
    pub fn new(size: i64, seed: u64) -> Result<Self> {
        let name = format!("synth:{size}:{seed}");
        if !(1..=MAX_SYNTH_SIZE).contains(&size) {
            let what = format!("a size of {size} samples is not between 1 and {MAX_SYNTH_SIZE}");
            return Err(Error::new(ErrorKind::Misuse, name, what));
        }
        let description = Description {
            grid: Grid::new(size, size, [SPACING_M; 2]),
            format: "synth".into(),
            sample_type: "float32".into(),
            step_m: None,
            place: None,
            vertical_unit: "metre".into(),
            assumed: Vec::new(),
            name,
        };
        Ok(Self {
            description,
            field: Field::new(seed),
        })
    }

    /// Understands `synth:SIZE` and `synth:SIZE:SEED` (seed 1 where it is left out); none for any other text.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] where size or seed is no number, or the size out of range.
    pub fn parse(text: &str) -> Option<Result<Self>> {
        let rest = text.strip_prefix("synth:")?;
        let (size, seed) = rest.split_once(':').unwrap_or((rest, "1"));
        let Some((size, seed)) = size.parse().ok().zip(seed.parse().ok()) else {
            return Some(Err(Error::new(
                ErrorKind::Misuse,
                text,
                "is not synth:SIZE or synth:SIZE:SEED",
            )
            .advice("give whole numbers, as in synth:4096:1")));
        };
        Some(Self::new(size, seed))
    }

    fn size(&self, level: u32) -> Size {
        self.description.grid.level(level)
    }

    /// Heights of any rectangle of a level, also beyond its edges: the field goes on there.
    fn fill(&self, level: u32, rect: Rect, out: &mut [f32]) {
        let mut cells: Cells = [Cell::NONE; OCTAVES];
        for ((x, z), height) in rect.cells().zip(out) {
            *height = self.field.height(level, x << level, z << level, &mut cells) as f32;
        }
    }

    /// The same, rows shared out to all processors where they are many.
    fn fill_shared(&self, level: u32, rect: Rect, out: &mut [f32]) {
        if rect.is_empty() {
            return;
        }
        let task_rows = TASK_SAMPLES / rect.width() + 1;
        let task_samples = (rect.width() * task_rows) as usize;
        each_chunk(&Processors, out, task_samples, |n, rows| {
            let z0 = rect.z0 + n as i64 * task_rows;
            let z1 = (z0 + task_rows).min(rect.z1);
            self.fill(level, Rect::new(rect.x0, z0, rect.x1, z1), rows);
        });
    }

    /// Bounds of a row of patches `a0..a1`, `b` of `level`.
    fn row_bounds(&self, level: u32, [a0, a1]: [i64; 2], b: i64, out: &mut [Bounds]) {
        let rect = Rect::new(a0 * PATCH, b * PATCH, a1 * PATCH + 1, (b + 1) * PATCH + 1);
        let mut own = vec![0.0; rect.area() as usize];
        self.fill(level, rect, &mut own);
        let finer_rect = Rect::new(2 * rect.x0, 2 * rect.z0, 2 * rect.x1 - 1, 2 * rect.z1 - 1);
        let mut finer = Vec::new();
        if level > 0 {
            finer.resize(finer_rect.area() as usize, 0.0);
            self.fill(level - 1, finer_rect, &mut finer);
        }
        let own = Window { rect, heights: &own };
        let finer = Window {
            rect: finer_rect,
            heights: &finer,
        };
        for (a, bounds) in (a0..a1).zip(out) {
            *bounds = self.patch_bounds(Patch::new(level, a, b), own, finer);
        }
    }

    fn patch_bounds(&self, patch: Patch, own: Window, finer: Window) -> Bounds {
        let level = patch.level;
        let (mut min, mut max) = (f32::INFINITY, f32::NEG_INFINITY);
        for (x, z) in patch.samples_within(self.size(level)).cells() {
            min = min.min(own.at(x, z));
            max = max.max(own.at(x, z));
        }
        // The regions of a patch's children and of their neighbours lie within its own region: half a patch
        // beyond it, and then a quarter, an eighth, and so on, of what they reach themselves.
        let half = PATCH / 2;
        let centre = |i: i64| (i * PATCH + half) << level;
        let radius = (half << level) + PATCH * ((1 << level) - 1);
        let region = self.field.region(level, centre(patch.a), centre(patch.b), radius);
        let mut error = bound::error(level, &region);
        if level > 0 {
            let step = finer.greatest_difference(own, patch);
            error = error.min(step + bound::error(level - 1, &region));
        }
        // Rounding must not undo the nesting of ranges: each level has more room than the one below.
        let room = 1e-6 * f64::from(level + 1);
        Bounds {
            min,
            max,
            error: up(error),
            need_min: -up(-(region.heights.lo - room)),
            need_max: up(region.heights.hi + room),
            need_error: up(bound::need(level, &region)),
        }
    }
}

/// Heights of a rectangle of a level.
#[derive(Clone, Copy)]
struct Window<'h> {
    rect: Rect,
    heights: &'h [f32],
}

impl Window<'_> {
    fn at(self, x: i64, z: i64) -> f32 {
        self.heights[((z - self.rect.z0) * self.rect.width() + (x - self.rect.x0)) as usize]
    }

    /// The greatest |S_l - S_{l-1}| over a patch of level l, `self` being of level l - 1. Its extremes lie at
    /// samples of level l - 1, where `S_l` is a sample or the mean of two.
    fn greatest_difference(self, coarse: Self, patch: Patch) -> f64 {
        let samples = patch.samples();
        let mut most = 0.0f64;
        for z in 2 * samples.z0..2 * samples.z1 - 1 {
            for x in 2 * samples.x0..2 * samples.x1 - 1 {
                let (i, j) = (x.div_euclid(2), z.div_euclid(2));
                let (p, q) = (x.rem_euclid(2), z.rem_euclid(2));
                let mean = 0.5 * (f64::from(coarse.at(i, j)) + f64::from(coarse.at(i + p, j + q)));
                most = most.max((f64::from(self.at(x, z)) - mean).abs());
            }
        }
        most
    }
}

/// The least f32 that is not below `value`.
fn up(value: f64) -> f32 {
    let near = value as f32;
    if f64::from(near) < value {
        near.next_up()
    } else {
        near
    }
}

impl HeightSource for Synth {
    fn description(&self) -> &Description {
        &self.description
    }

    fn read(&self, rect: Rect, out: &mut [f32]) -> Result<()> {
        self.check(0, rect, self.size(0), out.len())?;
        self.fill_shared(0, rect, out);
        Ok(())
    }
}

impl Levels for Synth {
    fn grid(&self) -> &Grid {
        &self.description.grid
    }

    fn heights(&self, level: u32, rect: Rect, out: &mut [f32]) -> Result<Arrival> {
        self.check(level, rect, self.size(level), out.len())?;
        self.fill_shared(level, rect, out);
        Ok(Arrival::Arrived)
    }

    fn bounds(&self, level: u32, patches: Rect, out: &mut [Bounds]) -> Result<Arrival> {
        self.check(level, patches, self.size(level).patches(), out.len())?;
        if !patches.is_empty() {
            each_chunk(&Processors, out, patches.width() as usize, |n, row| {
                let b = patches.z0 + n as i64;
                self.row_bounds(level, [patches.x0, patches.x1], b, row);
            });
        }
        Ok(Arrival::Arrived)
    }

    fn has_light(&self) -> bool {
        false
    }

    fn light(&self, _: u32, _: Rect, _: &mut [LightSample]) -> Result<Arrival> {
        Err(Error::new(
            ErrorKind::Misuse,
            &self.description.name,
            "has no light",
        ))
    }
}

impl Synth {
    fn check(&self, level: u32, rect: Rect, size: Size, places: usize) -> Result<()> {
        if level < self.level_count() && size.rect().contains_rect(rect) && places as i64 == rect.area() {
            return Ok(());
        }
        let what = format!("{rect:?} with {places} places does not fit {size:?} of level {level}");
        Err(Error::new(ErrorKind::Misuse, &self.description.name, what))
    }
}

#[cfg(test)]
mod tests;
