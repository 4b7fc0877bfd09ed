//! Popping, measured on the twin: no height that is drawn changes by more than the camera's own motion explains.
//!
//! Measured is the drawn surface at every vertex of level 0, in two frames that follow each other. Every vertex of any
//! level lies over one of them; which level draws the place may differ between the frames, so arrivals and departures of
//! levels are seen.
//!
//! *The bound.* Let a place lie in a triangle of level `l`, `M_l` be the greatest `|c - h|` over the triangle's corners
//! that carry weight there, and T the transition, 1 or more. The drawn height is the corners' mean of `h + alpha (c - h)`,
//! so it changes by at most `M_l |d alpha|`, and `alpha`, a clamped `(d - (R - T)) / T`, by at most `D_l / T`, where D_l is
//! the change of `d` in steps of level `l`: the greater of what a move by (x, z) samples and y metres does to the
//! distance, `max(x, z) / 2^l`, and to the climb, `1.25 (|y| + g) / (sqrt(dx dz) 2^l)`. `g` is by how much the ground may
//! differ between the two places under the eye: the greatest slopes of any level from 1 on, times the metres moved.
//! Where level `l` draws the place in one frame and `l + 1` in the other, both terms count: alpha of level `l` was within
//! `D_l / T` of 1 (fact (b): its whole patch is let go at 1), and that of level `l + 1` within `D_{l+1} / T` of 0 (fact
//! (c)). So the bound is the sum over the levels that draw the place in either frame.
//!
//! *Data that arrive late* add the held field's share of alpha: it falls by the time that has passed over
//! [`FADE_S`], or rises by at most 1 a step that the eye moves (see `HeldField`); and, through the ground under the eye,
//! to the climb. Frames that report pops, of a budget too small for anything better, are left out.
//!
//! *Rounding.* Each `d` is off by less than `2^-22 R` steps (a difference and a product of f32, and the climb's rounding),
//! alpha by 2^-24 more, and a height by `2^-22` of the greatest height; each counts twice, once for each frame.

#![allow(clippy::print_stdout, reason = "the greatest changes are printed")]

mod support;

use std::collections::HashMap;

use clipscape::camera::{Camera, View};
use clipscape::clipmap::{Clipmap, ClipmapOptions, FADE_S, Instance, Wait, displace};
use clipscape::grid::{Grid, PATCH, Patch};
use clipscape::levels::Levels;
use clipscape::progress::Silent;
use clipscape::pyramid::{Filter, Pyramid};
use clipscape::work::Serial;
use glam::DVec3;
use support::facts::patch_of;
use support::{hash, hills};

const SIZE: [i64; 2] = [353, 301];
const SPACING_M: [f64; 2] = [10.0, 12.0];
const CLIP_SIZE: i64 = 64;
const TRANSITION: i64 = 6;
const REACH: f64 = 30.0;

/// Rough hills: next to each other, levels differ by metres.
fn terrain() -> Pyramid {
    let grid = Grid::new(SIZE[0], SIZE[1], SPACING_M);
    let heights = grid.size.rect().cells();
    let heights = heights.map(|(i, j)| 0.5 * hills(0, i, j) + 40.0 * hash(0, i, j) as f32);
    let filter = Filter::default();
    let mut pyramid = Pyramid::new(grid, heights.collect(), None, &filter, &Serial, &Silent).unwrap();
    pyramid.bound(&Serial, &Silent).unwrap();
    pyramid
}

fn options(transition: i64) -> ClipmapOptions {
    ClipmapOptions {
        clip_size: CLIP_SIZE,
        transition: Some(transition),
        cull: false,
        ..Default::default()
    }
}

fn clipmap(levels: &dyn Levels, transition: i64) -> Clipmap {
    Clipmap::new(levels, &options(transition)).unwrap()
}

fn camera(x_samples: f64, y: f64, z_samples: f64, heading_deg: f64) -> Camera {
    Camera {
        eye: DVec3::new(x_samples * SPACING_M[0], y, z_samples * SPACING_M[1]),
        heading_deg,
        pitch_deg: -20.0,
        roll_deg: 0.0,
        fov_deg: 60.0,
    }
}

/// Brings `clipmap` to `camera` and measures what it draws.
fn frame(clipmap: &mut Clipmap, levels: &dyn Levels, camera: &Camera, time_s: f64) -> Surface {
    clipmap
        .update(levels, &View::new(*camera, [64, 48]).unwrap(), time_s)
        .unwrap();
    let instances: Vec<_> = clipmap.selection().instances().copied().collect();
    Surface::new(clipmap, &instances)
}

/// The three corners, with their weights, of the triangle of a level in which a place of level 0 lies.
fn corners(level: u32, i: i64, j: i64) -> [([i64; 2], f64); 3] {
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
struct Surface {
    heights: Vec<f64>,
    levels: Vec<u32>,
}

impl Surface {
    fn new(clipmap: &Clipmap, instances: &[Instance]) -> Self {
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

/// What the bound is made of.
struct Bound {
    /// `M_l` at every vertex of level 0, level by level.
    steps_m: Vec<Vec<f64>>,
    /// The greatest `|c - h|` of each level.
    greatest_steps_m: Vec<f64>,
    /// The greatest slopes east and south of any level from 1 on.
    slopes: [f64; 2],
    greatest_m: f64,
}

impl Bound {
    fn new(pyramid: &Pyramid) -> Self {
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

    /// The most that the drawn height of a place may change between frames from `before` and `after`, while what has
    /// arrived fades in by the share `faded`.
    fn at(&self, place: usize, levels: [u32; 2], before: &Camera, after: &Camera, faded: f64) -> f64 {
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
            self.steps_m[level as usize][place] * (change / transition + held + rounding)
        };
        let (low, high) = (levels[0].min(levels[1]), levels[0].max(levels[1]));
        (low..=high).map(level).sum::<f64>() + 2.0 * 2f64.powi(-22) * self.greatest_m
    }
}

/// What was found over the frames of a motion.
#[derive(Debug, Default)]
struct Found {
    /// The greatest change of a height in metres.
    change_m: f64,
    /// The greatest share of its bound that a change took.
    share: f64,
    /// Places above their bound.
    pops: usize,
    /// Places that changed at all.
    changed: usize,
    /// Places that another level drew than in the frame before.
    handed_over: usize,
}

impl Found {
    fn add(&mut self, bound: &Bound, surfaces: [&Surface; 2], cameras: [&Camera; 2], faded: f64) {
        let [before, after] = surfaces;
        for place in 0..before.heights.len() {
            let levels = [before.levels[place], after.levels[place]];
            let change = (after.heights[place] - before.heights[place]).abs();
            let share = change / bound.at(place, levels, cameras[0], cameras[1], faded);
            self.change_m = self.change_m.max(change);
            self.share = self.share.max(share);
            self.pops += usize::from(share > 1.0);
            self.changed += usize::from(change > 0.0);
            self.handed_over += usize::from(levels[0] != levels[1]);
        }
    }
}

fn fly(transition: i64, cameras: &[Camera]) -> Found {
    let levels = terrain();
    let bound = Bound::new(&levels);
    let mut clipmap = clipmap(&levels, transition);
    let mut found = Found::default();
    let mut before = frame(&mut clipmap, &levels, &cameras[0], 0.0);
    for pair in cameras.windows(2) {
        let after = frame(&mut clipmap, &levels, &pair[1], 0.0);
        found.add(&bound, [&before, &after], [&pair[0], &pair[1]], 0.0);
        before = after;
    }
    found
}

fn assert_smooth(what: &str, found: &Found) {
    println!("{what}: {found:?}");
    assert_eq!(found.pops, 0, "{what}: {found:?}");
}

/// Frames at `count` places a thousandth of a sample apart, the middle one at `x`.
fn creep(x: f64, y: f64, count: i32) -> Vec<Camera> {
    let place = |k| x + f64::from(k - count / 2) / 1000.0;
    (0..count).map(|k| camera(place(k), y, 150.3, 80.0)).collect()
}

/// Where the next patches of level 0 arrive as the eye moves on: R and the selection's margin from their side.
const ARRIVAL: f64 = 256.0 - REACH - 1.0 / 256.0;

/// Where those of level 1 do, which are twice as large.
const ARRIVAL_OF_LEVEL_1: f64 = 256.0 - 2.0 * (REACH + 1.0 / 256.0);

#[test]
fn creeping_across_a_snap_of_every_window() {
    let found = fly(TRANSITION, &creep(256.0, 70.0, 24));
    assert_smooth("across a snap", &found);
    assert!(found.changed > 10_000, "{found:?}");
}

#[test]
fn creeping_through_the_arrival_of_patches() {
    for x in [ARRIVAL, ARRIVAL_OF_LEVEL_1] {
        let found = fly(TRANSITION, &creep(x, 70.0, 12));
        assert_smooth("arrival of patches", &found);
        assert!(found.handed_over > 50 && found.changed > 10_000, "{found:?}");
    }
}

#[test]
fn control_transition_0_is_caught() {
    let found = fly(0, &creep(ARRIVAL, 70.0, 12));
    println!("transition 0: {found:?}");
    assert!(found.pops > 50 && found.share > 100.0, "{found:?}");
}

/// Heights through which level 0, then level 1, is let go: R steps and some are reached at 263 m over its ground, and
/// twice that.
fn climb(from: f64, to: f64, count: i32) -> Vec<Camera> {
    let height = |k: i32| from + (to - from) * f64::from(k) / f64::from(count - 1);
    (0..count)
        .map(|k| camera(171.4, height(k), 150.3, 80.0))
        .collect()
}

#[test]
fn climbing_through_the_departure_of_levels_and_descending() {
    let (up, mut down) = (climb(150.0, 620.0, 60), climb(150.0, 620.0, 60));
    down.reverse();
    for (what, cameras) in [("climbing", up), ("descending", down)] {
        let found = fly(TRANSITION, &cameras);
        assert_smooth(what, &found);
        assert!(found.handed_over > 5_000, "{found:?}");
    }
    let found = fly(0, &climb(150.0, 620.0, 60));
    assert!(found.pops > 1_000, "control: transition 0 is caught: {found:?}");
}

#[test]
fn turning_on_the_spot_changes_nothing() {
    let turn = |k| camera(ARRIVAL, 70.0, 150.3, 10.0 * f64::from(k));
    let found = fly(TRANSITION, &(0..36).map(turn).collect::<Vec<_>>());
    assert_smooth("turning", &found);
    assert_eq!((found.changed, found.change_m), (0, 0.0));
}

#[test]
fn control_a_level_let_go_before_alpha_is_1_is_caught() {
    let levels = terrain();
    let bound = Bound::new(&levels);
    let mut clipmap = clipmap(&levels, TRANSITION);
    let here = camera(ARRIVAL - 5.0, 70.0, 150.3, 80.0);
    let before = frame(&mut clipmap, &levels, &here, 0.0);
    let mut instances: Vec<_> = clipmap.selection().instances().copied().collect();
    // The parent of a patch of level 0 that is still on its way to 1.
    let early = instances.iter().find(|i| {
        let mut alphas = (0..81).map(|k| displace(&clipmap, i, k % 9, k / 9).alpha);
        i.level == 0 && alphas.any(|alpha| alpha > 0.5) && alphas.any(|alpha| alpha < 0.9)
    });
    let parent = patch_of(early.expect("a patch morphs")).parent();
    instances.retain(|i| patch_of(i).level != 0 || patch_of(i).parent() != parent);
    instances.push(Instance {
        origin: [(parent.a * PATCH) as i32, (parent.b * PATCH) as i32],
        level: parent.level,
        fill: 0.0,
    });
    let after = Surface::new(&clipmap, &instances);
    let mut found = Found::default();
    let moved = camera(ARRIVAL - 5.0 + 0.001, 70.0, 150.3, 80.0);
    found.add(&bound, [&before, &after], [&here, &moved], 0.0);
    assert!(found.pops > 50, "{found:?}");
}

/// Flies over data that come under a budget, `fps` frames a second; also how many frames had data missing, and popped.
fn fly_late(cameras: &[Camera], budget_bytes: u64, fps: f64, fade: bool) -> (Found, [u32; 2]) {
    let levels = terrain();
    let bound = Bound::new(&levels);
    let options = ClipmapOptions {
        wait: Wait::None,
        upload_budget_bytes: Some(budget_bytes),
        ..options(TRANSITION)
    };
    let mut clipmap = Clipmap::new(&levels, &options).unwrap();
    let mut found = Found::default();
    let mut counts = [0, 0];
    let mut before = frame(&mut clipmap, &levels, &cameras[0], 0.0);
    for (pair, k) in cameras.windows(2).zip(1..) {
        // Without a fade, as if a second passed from frame to frame: what arrives is there at once.
        let time_s = f64::from(k) / if fade { fps } else { 1.0 };
        let after = frame(&mut clipmap, &levels, &pair[1], time_s);
        let report = clipmap.report();
        counts[0] += u32::from(!report.complete);
        counts[1] += u32::from(report.pops > 0);
        if report.pops == 0 {
            found.add(
                &bound,
                [&before, &after],
                [&pair[0], &pair[1]],
                1.0 / (fps * FADE_S),
            );
        }
        before = after;
    }
    (found, counts)
}

#[test]
fn data_that_arrive_late_fade_in() {
    let spot = vec![camera(171.4, 70.0, 150.3, 80.0); 80];
    let creeping = creep(171.4, 70.0, 80);
    let flying = |k| camera(120.0 + 0.7 * f64::from(k), 70.0, 150.3 + 0.3 * f64::from(k), 80.0);
    for (what, cameras, budget_bytes) in [
        ("on the spot", spot.clone(), 20_000),
        ("creeping", creeping, 20_000),
        ("flying", (0..120).map(flying).collect(), 20_000),
    ] {
        let (found, [late, popped]) = fly_late(&cameras, budget_bytes, 60.0, true);
        println!("{what}: {late} of {} frames late, {popped} popped", cameras.len());
        assert_smooth(what, &found);
        assert!(
            late > 20 && popped * 10 < cameras.len() as u32,
            "{what}: {late}, {popped}"
        );
        assert!(found.change_m > 0.1, "{what}: {found:?}");
    }
    let (found, _) = fly_late(&spot, 20_000, 60.0, false);
    assert!(found.pops > 1_000, "control: without the fade it pops: {found:?}");
}
