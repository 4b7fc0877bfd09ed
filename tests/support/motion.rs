//! What the tests of popping share: a terrain, the drawn surface at every vertex of level 0, and the bound of its change,
//! which `tests/popping.rs` derives.

use std::collections::HashMap;

use clipscape::camera::{Camera, View};
use clipscape::clipmap::{Clipmap, ClipmapOptions, Instance, displace};
use clipscape::grid::{Grid, PATCH, Patch};
use clipscape::levels::Levels;
use clipscape::progress::Silent;
use clipscape::pyramid::{Filter, Pyramid};
use clipscape::work::Serial;
use glam::DVec3;

use super::facts::patch_of;
use super::{hash, hills};

pub const SIZE: [i64; 2] = [353, 301];
pub const SPACING_M: [f64; 2] = [10.0, 12.0];
pub const CLIP_SIZE: i64 = 64;
pub const TRANSITION: i64 = 6;
pub const REACH: f64 = 30.0;

/// Rough hills: next to each other, levels differ by metres.
pub fn terrain() -> Pyramid {
    let grid = Grid::new(SIZE[0], SIZE[1], SPACING_M);
    let heights = grid.size.rect().cells();
    let heights = heights.map(|(i, j)| 0.5 * hills(0, i, j) + 40.0 * hash(0, i, j) as f32);
    let filter = Filter::default();
    let mut pyramid = Pyramid::new(grid, heights.collect(), None, &filter, &Serial, &Silent).unwrap();
    pyramid.bound(&Serial, &Silent).unwrap();
    pyramid
}

pub fn options(transition: i64) -> ClipmapOptions {
    ClipmapOptions {
        clip_size: CLIP_SIZE,
        transition: Some(transition),
        cull: false,
        ..Default::default()
    }
}

pub fn clipmap(levels: &dyn Levels, transition: i64) -> Clipmap {
    Clipmap::new(levels, &options(transition)).unwrap()
}

pub fn camera(x_samples: f64, y: f64, z_samples: f64, heading_deg: f64) -> Camera {
    Camera {
        eye: DVec3::new(x_samples * SPACING_M[0], y, z_samples * SPACING_M[1]),
        heading_deg,
        pitch_deg: -20.0,
        roll_deg: 0.0,
        fov_deg: 60.0,
    }
}

/// Brings `clipmap` to `camera` and measures what it draws.
pub fn frame(clipmap: &mut Clipmap, levels: &dyn Levels, camera: &Camera, time_s: f64) -> Surface {
    clipmap
        .update(levels, &View::new(*camera, [64, 48]).unwrap(), time_s)
        .unwrap();
    let instances: Vec<_> = clipmap.selection().instances().copied().collect();
    Surface::new(clipmap, &instances)
}

/// Frames at `count` places a thousandth of a sample apart, the middle one at `x`.
pub fn creep(x: f64, y: f64, count: i32) -> Vec<Camera> {
    let place = |k| x + f64::from(k - count / 2) / 1000.0;
    (0..count).map(|k| camera(place(k), y, 150.3, 80.0)).collect()
}

/// Where the next patches of level 0 arrive as the eye moves on: R and the selection's margin from their side.
pub const ARRIVAL: f64 = 256.0 - REACH - 1.0 / 256.0;

/// Where those of level 1 do, which are twice as large.
pub const ARRIVAL_OF_LEVEL_1: f64 = 256.0 - 2.0 * (REACH + 1.0 / 256.0);

/// The three corners, with their weights, of the triangle of a level in which a place of level 0 lies.
pub fn corners(level: u32, i: i64, j: i64) -> [([i64; 2], f64); 3] {
    let step = (1i64 << level) as f64;
    let (x, z) = (i >> level, j >> level);
    let u = (i - (x << level)) as f64 / step;
    let v = (j - (z << level)) as f64 / step;
    let middle = if u >= v { [x + 1, z] } else { [x, z + 1] };
    [
        ([x, z], 1.0 - u.max(v)),
        (middle, (u - v).abs()),
        ([x + 1, z + 1], u.min(v)),
    ]
}

/// What a frame draws: height and level at each vertex of level 0, row by row.
pub struct Surface {
    pub heights: Vec<f64>,
    pub levels: Vec<u32>,
}

impl Surface {
    pub fn new(clipmap: &Clipmap, instances: &[Instance]) -> Self {
        let patch = |instance: &Instance| {
            let vertices: Vec<f32> = (0..81)
                .map(|k| displace(clipmap, instance, k % 9, k / 9).height)
                .collect();
            (patch_of(instance), vertices)
        };
        let patches: HashMap<Patch, Vec<f32>> = instances.iter().map(patch).collect();
        let count = clipmap.windows().len() as u32;
        let mut surface = Self {
            heights: Vec::new(),
            levels: Vec::new(),
        };
        for (i, j) in clipmap.grid().size.rect().cells() {
            let (level, height) = (0..count)
                .find_map(|level| {
                    // The last column and row lie on the side of the patch before.
                    let last = clipmap.grid().patches(level);
                    let a = ((i >> level) / PATCH).min(last.width - 1);
                    let b = ((j >> level) / PATCH).min(last.height - 1);
                    let vertices = patches.get(&Patch::new(level, a, b))?;
                    let term = |([x, z], weight): ([i64; 2], f64)| {
                        if weight == 0.0 {
                            return 0.0;
                        }
                        let k = (z - b * PATCH) * (PATCH + 1) + x - a * PATCH;
                        weight * f64::from(vertices[k as usize])
                    };
                    Some((level, corners(level, i, j).map(term).iter().sum()))
                })
                .expect("every place is drawn");
            surface.heights.push(height);
            surface.levels.push(level);
        }
        surface
    }
}

/// What happens between two frames.
pub struct Motion<'a> {
    pub cameras: [&'a Camera; 2],
    /// The share by which what has arrived fades in.
    pub faded: f64,
    /// The most by which need may change, by level and place of level 0.
    pub need: Option<&'a dyn Fn(u32, usize) -> f64>,
}

impl<'a> Motion<'a> {
    /// That of a camera alone.
    pub fn of(cameras: [&'a Camera; 2]) -> Self {
        Self {
            cameras,
            faded: 0.0,
            need: None,
        }
    }
}

/// What the bound is made of.
pub struct Bound {
    /// `M_l` at every vertex of level 0, level by level.
    steps_m: Vec<Vec<f64>>,
    /// The greatest `|c - h|` of each level.
    greatest_steps_m: Vec<f64>,
    /// The greatest slopes east and south of any level from 1 on.
    slopes: [f64; 2],
    greatest_m: f64,
}

impl Bound {
    pub fn new(pyramid: &Pyramid) -> Self {
        let grid = pyramid.grid();
        let at = |level: u32, i: i64, j: i64| {
            f64::from(pyramid.level(level)[(j * grid.level(level).width + i) as usize])
        };
        let mut slopes = [0.0f64; 2];
        for level in 1..pyramid.level_count() {
            let (size, step) = (grid.level(level), (1i64 << level) as f64);
            for (i, j) in size.rect().cells() {
                let east = (at(level, i, j) - at(level, (i + 1).min(size.width - 1), j)).abs();
                let south = (at(level, i, j) - at(level, i, (j + 1).min(size.height - 1))).abs();
                slopes[0] = slopes[0].max(east / (SPACING_M[0] * step));
                slopes[1] = slopes[1].max(south / (SPACING_M[1] * step));
            }
        }
        let step_m = |level: u32, i: i64, j: i64| {
            if level + 1 == pyramid.level_count() {
                return 0.0;
            }
            let target = at(level + 1, i >> 1, j >> 1) + at(level + 1, (i + 1) >> 1, (j + 1) >> 1);
            (target / 2.0 - at(level, i, j)).abs()
        };
        let level_steps = |level| {
            let place = |(i, j)| {
                let weighted = corners(level, i, j).into_iter().filter(|c| c.1 > 0.0);
                weighted
                    .map(|([x, z], _)| step_m(level, x, z))
                    .fold(0.0, f64::max)
            };
            grid.size.rect().cells().map(place).collect()
        };
        let steps_m: Vec<Vec<f64>> = (0..pyramid.level_count()).map(level_steps).collect();
        Self {
            greatest_steps_m: steps_m
                .iter()
                .map(|s| s.iter().copied().fold(0.0, f64::max))
                .collect(),
            steps_m,
            slopes,
            greatest_m: (0..pyramid.level_count())
                .flat_map(|l| pyramid.level(l))
                .fold(0.0, |most, h| most.max(f64::from(h.abs()))),
        }
    }

    /// The most that the drawn height of a place may change in a motion.
    pub fn at(&self, place: usize, levels: [u32; 2], motion: &Motion<'_>) -> f64 {
        let [before, after] = motion.cameras;
        let faded = motion.faded;
        let moved = (after.eye - before.eye).abs();
        let samples = (moved.x / SPACING_M[0]).max(moved.z / SPACING_M[1]);
        let ground = faded * self.greatest_steps_m[1..].iter().sum::<f64>();
        let climbed = moved.y + self.slopes[0] * moved.x + self.slopes[1] * moved.z + ground;
        let climb = 1.25 * climbed / (SPACING_M[0] * SPACING_M[1]).sqrt();
        let transition = TRANSITION as f64;
        let level = |level: u32| {
            let change = samples.max(climb) / f64::from(1u32 << level);
            let rounding = 2.0 * (2f64.powi(-22) * REACH / transition + 2f64.powi(-24));
            let held = if faded > 0.0 {
                faded + samples / f64::from(1u32 << level)
            } else {
                0.0
            };
            let need = motion.need.map_or(0.0, |need| need(level, place));
            self.steps_m[level as usize][place] * (change / transition + held + need + rounding)
        };
        let (low, high) = (levels[0].min(levels[1]), levels[0].max(levels[1]));
        (low..=high).map(level).sum::<f64>() + 2.0 * 2f64.powi(-22) * self.greatest_m
    }
}

/// What was found over the frames of a motion.
#[derive(Debug, Default)]
pub struct Found {
    /// The greatest change of a height in metres.
    pub change_m: f64,
    /// The greatest share of its bound that a change took.
    pub share: f64,
    /// Places above their bound.
    pub pops: usize,
    /// Places that changed at all.
    pub changed: usize,
    /// Places that another level drew than in the frame before.
    pub handed_over: usize,
}

impl Found {
    pub fn add(&mut self, bound: &Bound, surfaces: [&Surface; 2], motion: &Motion<'_>) {
        let [before, after] = surfaces;
        for place in 0..before.heights.len() {
            let levels = [before.levels[place], after.levels[place]];
            let change = (after.heights[place] - before.heights[place]).abs();
            let share = change / bound.at(place, levels, motion);
            self.change_m = self.change_m.max(change);
            self.share = self.share.max(share);
            self.pops += usize::from(share > 1.0);
            self.changed += usize::from(change > 0.0);
            self.handed_over += usize::from(levels[0] != levels[1]);
        }
    }
}
