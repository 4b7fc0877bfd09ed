//! How high the terrain stands along the rays of one azimuth over each sample of a block.
//!
//! With H the height over a ray at distance t and h its sample's, `(H - h) / t` is monotone between two crossings, so
//! its greatest value is taken at a crossing. (On a curved earth that is short of the truth by at most half a
//! crossing's distance from the last over the earth's radius: 1e-5 for cells of 100 m.) An edge counts where its two
//! ends are valid, a sample that the ray hits where it is; what is void or beyond the DEM does not stand in the way.
//!
//! The terrain is looked at block by block and, for each, stage by stage outward: the heights that the block's rays meet
//! in a stage are fetched, so that what is held depends neither on the DEM's size nor on how far a shadow comes from.
//! A few samples beside each other walk their rays at once. A stage, or a run of crossings, is left out where the highest
//! ground near them could not raise the horizon of any: with H never above M, `(M - h) / t` for the nearest t of a run
//! bounds all of it, as long as the tangent sought is at least 0. That is exact.
//!
//! Differences of heights are formed first, so that in f32 a rise is off by at most 2^-22 of the differences it is made
//! of; heights must lie within 1e38 m of each other.

use std::sync::{Mutex, PoisonError};

use super::crests::{CrestWindows, Crests};
use super::rays::{Rays, SPANS, STAGE, STRIDE, Stage};
use crate::error::Result;
use crate::grid::{Grid, Rect};

/// Samples that are traced at once.
pub(super) const LANES: usize = 8;

/// Columns and rows of a block: what is traced together. Results may depend on where blocks begin: always at multiples.
pub(super) const BLOCK: [usize; 2] = [256, 128];

/// Groups of samples in a row of a block.
const GROUPS: usize = BLOCK[0] / LANES;

/// Stages at which all samples look, and how many farther ones are asked for together whether any need.
const NEAR: i64 = 2;
const FAR: i64 = 8;

/// Samples from one window of maxima to the next, for each of [`SPANS`].
const STEPS: [usize; SPANS.len()] = [16, 4, 4];

/// Where the heights of level 0 come from while light is traced over them.
pub trait Ground: Sync {
    /// Copies the heights of `rect`, which lies on the grid, into `out`, whose rows are `stride` samples apart.
    ///
    /// # Errors
    /// What reading them meets.
    fn copy(&self, rect: Rect, stride: usize, out: &mut [f32]) -> Result<()>;
}

/// All heights of level 0, row by row.
pub(super) struct Whole<'a> {
    heights: &'a [f32],
    width: usize,
}

impl<'a> Whole<'a> {
    pub(super) fn of(heights: &'a [f32], grid: &Grid) -> Self {
        Self {
            heights,
            width: grid.size.width as usize,
        }
    }
}

impl Ground for Whole<'_> {
    fn copy(&self, rect: Rect, stride: usize, out: &mut [f32]) -> Result<()> {
        let count = rect.width() as usize;
        for (z, row) in (rect.z0..rect.z1).zip(out.chunks_mut(stride)) {
            let from = z as usize * self.width + rect.x0 as usize;
            row[..count].copy_from_slice(&self.heights[from..from + count]);
        }
        Ok(())
    }
}

/// The terrain over which light is traced.
pub struct Relief<'a> {
    grid: Grid,
    ground: &'a dyn Ground,
    /// The greatest height; minus infinity where all is void.
    greatest: f32,
    /// Over stages, and over the longest runs in them.
    crests: [CrestWindows; 2],
    /// What is not in use.
    scratches: Mutex<Vec<Scratch>>,
}

/// A block's own heights, and what its samples look at: reused from block to block.
pub(super) struct Scratch {
    /// The block and a sample around it, rows [`STRIDE`] apart; NaN beyond the DEM.
    own: Vec<f32>,
    region: Region,
    room: Stage,
    /// Groups of samples that are not decided; those of them that may look at the stages that are near, and those that
    /// look at one.
    open: Vec<u32>,
    near: Vec<u32>,
    looking: Vec<u32>,
    /// Of each sample of a block what its maker likes to keep.
    pub(super) kept: [Vec<f32>; 2],
}

impl Default for Scratch {
    fn default() -> Self {
        Self {
            own: vec![f32::NAN; (BLOCK[1] + 2) * STRIDE],
            region: Region::default(),
            room: Stage::default(),
            open: Vec::new(),
            near: Vec::new(),
            looking: Vec::new(),
            kept: Default::default(),
        }
    }
}

/// Heights of a rectangle, and the greatest of them over windows.
#[derive(Default)]
struct Region {
    /// Rows [`STRIDE`] apart; NaN beyond the DEM.
    heights: Vec<f32>,
    windows: [Windows; SPANS.len()],
}

/// The greatest heights over windows from each multiple of a step that hold a run of a span as [`LANES`] samples see
/// it, row by row.
#[derive(Default)]
struct Windows {
    wide: usize,
    highest: Vec<f32>,
}

impl<'a> Relief<'a> {
    /// The terrain of `grid` whose heights are those of `ground`, and whose crests are `crests`.
    pub fn new(grid: &Grid, ground: &'a dyn Ground, crests: Crests) -> Self {
        Self {
            grid: *grid,
            ground,
            greatest: crests.greatest(),
            crests: [STAGE, SPANS[0]].map(|cells| crests.windows(cells)),
            scratches: Mutex::default(),
        }
    }

    /// Room to work in, to be given back.
    pub(super) fn scratch(&self) -> Scratch {
        let mut scratches = self.scratches.lock().unwrap_or_else(PoisonError::into_inner);
        scratches.pop().unwrap_or_default()
    }

    pub(super) fn give_back(&self, scratch: Scratch) {
        self.scratches
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(scratch);
    }

    pub(super) fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Fetches a block's own heights.
    pub(super) fn settle(&self, block: Rect, scratch: &mut Scratch) -> Result<()> {
        self.fetch(block.grown(1), &mut scratch.own)
    }

    /// Copies the heights of `rect` into rows [`STRIDE`] apart, NaN where there is no DEM.
    fn fetch(&self, rect: Rect, out: &mut [f32]) -> Result<()> {
        let on = rect.intersection(self.grid.size.rect());
        if on != rect {
            out.fill(f32::NAN);
        }
        if on.is_empty() {
            return Ok(());
        }
        let at = (on.z0 - rect.z0) as usize * STRIDE + (on.x0 - rect.x0) as usize;
        self.ground.copy(on, STRIDE, &mut out[at..])
    }

    /// Raises each of `tangents`, at least 0, to the tangent of the elevation of the terrain along `rays` over its
    /// sample; the samples are those of `block`, in rows of [`BLOCK`]`[0]`, whose own heights have been fetched. Where
    /// one is void or its tangent not below `until`, the tangent becomes infinite.
    pub(super) fn raise(
        &self,
        rays: &Rays,
        block: Rect,
        until: f32,
        tangents: &mut [f32],
        scratch: &mut Scratch,
    ) -> Result<()> {
        let Scratch {
            own,
            region,
            room,
            open,
            near,
            looking,
            ..
        } = scratch;
        let wide = (block.width() as usize).div_ceil(LANES);
        let heights = |[x, z]: [usize; 2]| lanes(own, (z + 1) * STRIDE + x + 1);
        open.clear();
        for z in 0..block.height() as usize {
            for x in 0..wide {
                let group = (z * GROUPS + x) as u32;
                let (h, t) = (heights(place(group)), lanes_mut(tangents, group as usize * LANES));
                let mut decided = true;
                for l in 0..LANES {
                    if h[l].is_nan() || t[l] >= until {
                        t[l] = f32::INFINITY;
                    }
                    decided &= t[l] == f32::INFINITY;
                }
                if !decided {
                    open.push(group);
                }
            }
        }
        near.clone_from(open);
        for k in 0..rays.stages() {
            if k >= NEAR && (k - NEAR) % FAR == 0 {
                // Which of them need look at any of the next stages at all.
                let (per_m, drop) = rays.beyond(k);
                let most = self.crests[0].over(rays.swept(k, FAR, block));
                near.clear();
                open.retain(|&group| {
                    let (h, t) = (heights(place(group)), lanes(tangents, group as usize * LANES));
                    if could_rise(most, per_m, drop, h, t) {
                        near.push(group);
                    }
                    // What the highest ground cannot raise from here, none will from farther out.
                    could_rise(self.greatest, per_m, drop, h, t)
                });
                if open.is_empty() {
                    break;
                }
            }
            if near.is_empty() {
                continue;
            }
            let stage = rays.stage(k, room);
            let hull = stage.hull;
            looking.clear();
            // Columns and rows of those that look, in the block.
            let mut ends = [usize::MAX, usize::MAX, 0, 0];
            for &group in &*near {
                let at = place(group);
                let (h, t) = (heights(at), lanes(tangents, group as usize * LANES));
                let corner = [
                    block.x0 + at[0] as i64 + hull.x0,
                    block.z0 + at[1] as i64 + hull.z0,
                ];
                let most = self.crests[0].highest(corner[0], corner[1]);
                if could_rise(most, stage.per_m, stage.drop, h, t)
                    && (k == 0 || self.any_run_could_rise(stage, corner, h, t))
                {
                    looking.push(group);
                    ends = [
                        ends[0].min(at[0]),
                        ends[1].min(at[1]),
                        ends[2].max(at[0] + LANES),
                        ends[3].max(at[1] + 1),
                    ];
                }
            }
            if looking.is_empty() {
                continue;
            }
            let rect = Rect::new(
                block.x0 + ends[0] as i64 + hull.x0,
                block.z0 + ends[1] as i64 + hull.z0,
                block.x0 + ends[2] as i64 + hull.x1 - 1,
                block.z0 + ends[3] as i64 + hull.z1 - 1,
            );
            region.look(self, rect)?;
            for &group in &*looking {
                let at = place(group);
                let within = [at[0] - ends[0], at[1] - ends[1]];
                let tangents = lanes_mut(tangents, group as usize * LANES);
                region.walk(stage, within, until, heights(at), tangents);
            }
        }
        Ok(())
    }

    /// Whether the ground near any of the longest runs of a stage, whose corner as samples of heights `h` see it is given,
    /// could raise any of `tangents`: what is far mostly cannot, and need not be fetched then.
    fn any_run_could_rise(
        &self,
        stage: &Stage,
        corner: [i64; 2],
        h: &[f32; LANES],
        tangents: &[f32; LANES],
    ) -> bool {
        let mut at = 0;
        while let Some(run) = stage.runs.get(at) {
            let [x, z] = [0, 1].map(|axis| corner[axis] + i64::from(run.corner[axis]));
            if could_rise(self.crests[1].highest(x, z), run.per_m, run.drop, h, tangents) {
                return true;
            }
            at = run.next as usize;
        }
        false
    }

    /// The slopes at a block's samples, whose own heights have been fetched.
    pub(super) fn slopes<'b>(&self, scratch: &'b Scratch) -> super::normal::Slopes<'b> {
        super::normal::Slopes::new(&scratch.own, STRIDE, self.grid.spacing_m)
    }
}

/// Column and row, in a block, of the first sample of a group.
pub(super) fn place(group: u32) -> [usize; 2] {
    [group as usize % GROUPS * LANES, group as usize / GROUPS]
}

/// Whether ground of height `most` at a distance of `1 / per_m` could raise any of `tangents` over samples of heights `h`.
fn could_rise(most: f32, per_m: f32, drop: f32, h: &[f32; LANES], tangents: &[f32; LANES]) -> bool {
    // False for voids, and for what is decided.
    (0..LANES).fold(false, |any, l| any | ((most - h[l]) * per_m - drop > tangents[l]))
}

impl Region {
    /// Looks at the heights of `rect`.
    fn look(&mut self, relief: &Relief<'_>, rect: Rect) -> Result<()> {
        let (width, rows) = (rect.width() as usize, rect.height() as usize);
        debug_assert!(width <= STRIDE, "{rect:?}");
        // What lies beyond the last row is asked for by nobody, but by whole blocks of rows.
        self.heights
            .resize(rows.next_multiple_of(STEPS[2]) * STRIDE, f32::NAN);
        relief.fetch(rect, &mut self.heights[..rows * STRIDE])?;
        let finest = STEPS[2];
        let wide = width.div_ceil(finest);
        let mut blocks = Vec::with_capacity(wide * rows.div_ceil(finest));
        let mut columns = [f32::NEG_INFINITY; STRIDE];
        for rows in self.heights[..rows * STRIDE].chunks(finest * STRIDE) {
            columns.fill(f32::NEG_INFINITY);
            for row in rows.chunks(STRIDE) {
                let both = columns[..width].iter_mut().zip(row);
                both.for_each(|(most, &h)| *most = greater(*most, h));
            }
            let blocks_of = columns[..wide * finest].chunks_exact(finest);
            blocks.extend(blocks_of.map(|c| greater(greater(c[0], c[1]), greater(c[2], c[3]))));
        }
        for (depth, windows) in self.windows.iter_mut().enumerate() {
            let step = STEPS[depth] / finest;
            let (blocks, wide) = if step == 1 {
                (&blocks, wide)
            } else {
                (&thinned(&blocks, wide, step), wide.div_ceil(step))
            };
            // A run's samples begin anywhere in a block.
            let count = |samples: i64| (samples as usize + STEPS[depth] - 1).div_ceil(STEPS[depth]);
            let across = slide(blocks, wide, false, count(SPANS[depth] + LANES as i64));
            *windows = Windows {
                wide,
                highest: slide(&across, wide, true, count(SPANS[depth] + 1)),
            };
        }
        Ok(())
    }

    /// Raises the tangents of samples of heights `h`, of which the first lies (x, z) from that over which the stage
    /// begins in the region's corner.
    fn walk(
        &self,
        stage: &Stage,
        [x, z]: [usize; 2],
        until: f32,
        h: &[f32; LANES],
        tangents: &mut [f32; LANES],
    ) {
        let base = z * STRIDE + x;
        let mut at = 0;
        while let Some(run) = stage.runs.get(at) {
            let depth = usize::from(run.depth);
            let x = (x + usize::from(run.corner[0])) / STEPS[depth];
            let z = (z + usize::from(run.corner[1])) / STEPS[depth];
            let windows = &self.windows[depth];
            if !could_rise(
                windows.highest[z * windows.wide + x],
                run.per_m,
                run.drop,
                h,
                tangents,
            ) {
                at = run.next as usize;
                continue;
            }
            at += 1;
            if depth + 1 < SPANS.len() {
                continue;
            }
            for crossing in &stage.crossings[run.first as usize..run.end as usize] {
                let a = lanes(&self.heights, base + crossing.a as usize);
                let b = lanes(&self.heights, base + crossing.b as usize);
                for l in 0..LANES {
                    let rise = (a[l] - h[l]) + crossing.weight * (b[l] - a[l]);
                    // The second where an end is void.
                    tangents[l] = greater(tangents[l], rise * crossing.per_m - crossing.drop);
                }
            }
            for tangent in tangents.iter_mut() {
                *tangent = if *tangent >= until {
                    f32::INFINITY
                } else {
                    *tangent
                };
            }
        }
    }
}

/// [`LANES`] values from index `at` on.
fn lanes(values: &[f32], at: usize) -> &[f32; LANES] {
    values[at..at + LANES].try_into().expect("the range is as long")
}

fn lanes_mut(values: &mut [f32], at: usize) -> &mut [f32; LANES] {
    (&mut values[at..at + LANES])
        .try_into()
        .expect("the range is as long")
}

/// The greater of two; `most` where the other is no number.
pub(super) fn greater(most: f32, other: f32) -> f32 {
    if other > most { other } else { most }
}

/// The greatest of `step` x `step` values each.
fn thinned(values: &[f32], width: usize, step: usize) -> Vec<f32> {
    let mut out = Vec::with_capacity(width.div_ceil(step) * values.len().div_ceil(step * width));
    for rows in values.chunks(step * width) {
        for x in (0..width).step_by(step) {
            let parts = rows.chunks(width).map(|row| &row[x..(x + step).min(width)]);
            out.push(
                parts
                    .flatten()
                    .fold(f32::NEG_INFINITY, |most, &h| greater(most, h)),
            );
        }
    }
    out
}

/// The greatest of `count` values from each on, fewer at the end, down columns or along rows of `width`.
pub(super) fn slide(values: &[f32], width: usize, down: bool, count: usize) -> Vec<f32> {
    let mut values = values.to_vec();
    let (stride, length) = if down { (width, values.len()) } else { (1, width) };
    for values in values.chunks_mut(length) {
        // Windows of 1, 2, 4, ... values, then two of the largest that together are `count`.
        let mut done = 1;
        while done < count && done * stride < length {
            let by = done.min(count - done);
            // In pieces that do not reach into what they read: vectorised.
            let mut at = 0;
            while at + by * stride < length {
                let (here, there) = values[at..].split_at_mut(by * stride);
                here.iter_mut()
                    .zip(&*there)
                    .for_each(|(most, &h)| *most = greater(*most, h));
                at += by * stride;
            }
            done += by;
        }
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pyramid::random::Random;

    #[test]
    fn windows_slide_over_all_that_they_hold() {
        let mut random = Random::new(5);
        for _ in 0..200 {
            let (width, height) = (1 + random.below(40) as usize, 1 + random.below(30) as usize);
            let (count, down) = (1 + random.below(20) as usize, random.unit() < 0.5);
            let values = random.heights((width * height) as i64, -1.0, 1.0, 0.0);
            let got = slide(&values, width, down, count);
            for (at, &got) in got.iter().enumerate() {
                let (x, z) = (at % width, at / width);
                let held = (0..count).filter_map(|k| {
                    let (x, z) = if down { (x, z + k) } else { (x + k, z) };
                    (x < width && z < height).then(|| values[z * width + x])
                });
                assert_eq!(
                    got,
                    held.fold(f32::NEG_INFINITY, f32::max),
                    "{width} x {height}, {count}"
                );
            }
        }
    }
}
