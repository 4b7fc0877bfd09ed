//! The change of the drawn surface from frame to frame over a DEM that is too large to look at every vertex: at places
//! around the eye, as many of them near as far, against the bound that `tests/popping.rs` derives.

use std::collections::HashMap;

use clipscape::camera::Camera;
use clipscape::clipmap::{Clipmap, FADE_S, Instance, displace};
use clipscape::grid::{Grid, PATCH, Patch};
use clipscape::levels::Levels;

use super::Random;
use super::facts::patch_of;
use super::motion::{Found, corners};

/// All levels of a DEM, to look its samples up.
pub struct Samples {
    grid: Grid,
    levels: Vec<Vec<f32>>,
    /// The greatest slopes east and south of any level from 1 on.
    slopes: [f64; 2],
    greatest_m: f64,
}

impl Samples {
    pub fn new(levels: &dyn Levels) -> Self {
        let grid = *levels.grid();
        let read = |level| {
            let rect = grid.level(level).rect();
            let mut heights = vec![0.0; rect.area() as usize];
            let _ = levels.heights(level, rect, &mut heights).unwrap();
            heights
        };
        let levels: Vec<Vec<f32>> = (0..levels.level_count()).map(read).collect();
        let mut slopes = [0.0f64; 2];
        for (level, heights) in levels.iter().enumerate().skip(1) {
            let width = grid.level(level as u32).width as usize;
            let step_m = grid.spacing_m.map(|s| s * (1i64 << level) as f64);
            for row in heights.chunks_exact(width) {
                let steepest = row.windows(2).map(|h| (h[0] - h[1]).abs()).fold(0.0, f32::max);
                slopes[0] = slopes[0].max(f64::from(steepest) / step_m[0]);
            }
            let below = heights.iter().zip(&heights[width..]);
            let steepest = below.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            slopes[1] = slopes[1].max(f64::from(steepest) / step_m[1]);
        }
        let greatest = levels
            .iter()
            .flatten()
            .fold(0.0, |most: f32, h| most.max(h.abs()));
        Self {
            grid,
            levels,
            slopes,
            greatest_m: f64::from(greatest),
        }
    }

    fn at(&self, level: u32, i: i64, j: i64) -> f64 {
        let size = self.grid.level(level);
        let (i, j) = (i.clamp(0, size.width - 1), j.clamp(0, size.height - 1));
        f64::from(self.levels[level as usize][(j * size.width + i) as usize])
    }

    /// `|c - h|` of a sample; 0 on the coarsest of the levels that are drawn.
    fn step_m(&self, level: u32, coarsest: u32, i: i64, j: i64) -> f64 {
        if level >= coarsest {
            return 0.0;
        }
        let coarse = |i: i64, j: i64| self.at(level + 1, i, j);
        let target = coarse(i >> 1, j >> 1) + coarse((i + 1) >> 1, (j + 1) >> 1);
        (target / 2.0 - self.at(level, i, j)).abs()
    }

    /// The greatest `|c - h|` of level `level` over the quads around the eye and the next ones.
    fn step_around_m(&self, level: u32, coarsest: u32, camera: &Camera) -> f64 {
        let [i, j] = [(camera.eye.x, 0), (camera.eye.z, 1)]
            .map(|(at_m, axis)| (at_m / (self.grid.spacing_m[axis] * (1i64 << level) as f64)).floor() as i64);
        let around = (-1..=2).flat_map(|b| (-1..=2).map(move |a| (a, b)));
        around
            .map(|(a, b)| self.step_m(level, coarsest, i + a, j + b))
            .fold(0.0, f64::max)
    }
}

/// What a frame draws, to be looked up at any place.
pub struct Frame {
    camera: Camera,
    reach: f64,
    transition: f64,
    clipmap: Clipmap,
    patches: HashMap<Patch, Instance>,
}

impl Frame {
    /// Of a clipmap without culling.
    pub fn new(clipmap: &Clipmap, camera: &Camera) -> Self {
        let instances = clipmap.selection().instances();
        Self {
            camera: *camera,
            reach: clipmap.ring().reach() as f64,
            transition: clipmap.ring().transition as f64,
            patches: instances.map(|i| (patch_of(i), *i)).collect(),
            clipmap: clipmap.clone(),
        }
    }

    /// The drawn height over sample (i, j) of level 0, and the level that draws it.
    fn height(&self, i: i64, j: i64) -> (u32, f64) {
        let grid = self.clipmap.grid();
        let drawn = (0..self.clipmap.windows().len() as u32).find_map(|level| {
            // The last column and row lie on the side of the patch before.
            let last = grid.patches(level);
            let a = ((i >> level) / PATCH).min(last.width - 1);
            let b = ((j >> level) / PATCH).min(last.height - 1);
            let instance = self.patches.get(&Patch::new(level, a, b))?;
            let term = |([x, z], weight): ([i64; 2], f64)| {
                if weight == 0.0 {
                    return 0.0;
                }
                let [x, z] = [x - a * PATCH, z - b * PATCH].map(|k| k as i32);
                weight * f64::from(displace(&self.clipmap, instance, x, z).height)
            };
            Some((level, corners(level, i, j).map(term).iter().sum()))
        });
        drawn.expect("every place is drawn")
    }
}

/// Adds to `found` how much `count` places around the eye changed between two frames, `passed_s` apart.
pub fn compare(
    samples: &Samples,
    frames: [&Frame; 2],
    passed_s: f64,
    random: &mut Random,
    count: usize,
    found: &mut Found,
) {
    let [before, after] = frames;
    let grid = &samples.grid;
    let coarsest = after.clipmap.windows().len() as u32 - 1;
    let moved = (after.camera.eye - before.camera.eye).abs();
    let steps = (moved.x / grid.spacing_m[0]).max(moved.z / grid.spacing_m[1]);
    let faded = passed_s / FADE_S;
    // Of the ground that the climb is measured from, as far as it fades in.
    let fading: f64 = (1..coarsest)
        .map(|level| {
            let around = frames.map(|f| samples.step_around_m(level, coarsest, &f.camera));
            around[0].max(around[1])
        })
        .sum();
    let ground_m = faded.min(1.0) * fading;
    let climbed_m = moved.y + samples.slopes[0] * moved.x + samples.slopes[1] * moved.z + ground_m;
    let climb = 1.25 * climbed_m / (grid.spacing_m[0] * grid.spacing_m[1]).sqrt();
    let eye = [0, 1].map(|axis| [after.camera.eye.x, after.camera.eye.z][axis] / grid.spacing_m[axis]);
    let farthest = grid.size.width.max(grid.size.height) as f64;
    for _ in 0..count {
        let far = farthest.powf(random.uniform(0.0, 1.0));
        let along = random.uniform(-far, far);
        let side = far * random.pick(&[-1.0, 1.0]);
        let [x, z] = random.pick(&[[along, side], [side, along]]);
        let (i, j) = ((eye[0] + x).round() as i64, (eye[1] + z).round() as i64);
        if !grid.size.rect().contains(i, j) {
            continue;
        }
        let (was, now) = (before.height(i, j), after.height(i, j));
        let term = |level: u32| {
            let own = corners(level, i, j).into_iter().filter(|c| c.1 > 0.0);
            let step_m = own
                .map(|([x, z], _)| samples.step_m(level, coarsest, x, z))
                .fold(0.0, f64::max);
            let scale = f64::from(1u32 << level);
            let rounding = 2.0 * (2f64.powi(-22) * after.reach / after.transition + 2f64.powi(-24));
            step_m * (steps.max(climb) / scale / after.transition + faded + steps / scale + rounding)
        };
        let (low, high) = (was.0.min(now.0), was.0.max(now.0));
        let bound = (low..=high).map(term).sum::<f64>() + 2.0 * 2f64.powi(-22) * samples.greatest_m;
        let change = (now.1 - was.1).abs();
        found.change_m = found.change_m.max(change);
        found.share = found.share.max(change / bound);
        found.pops += usize::from(change > bound);
        found.changed += usize::from(change > 0.0);
        found.handed_over += usize::from(was.0 != now.0);
    }
}
