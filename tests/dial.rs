//! The dial: with a promised error the surface stays watertight, moves without popping, and keeps the promise wherever the
//! rings do not cut in.
//!
//! *How far need may change* between two frames follows from what [`Screen`] bounds: a box that moves by at most g metres
//! relative to the eye lies within the box grown by g, whose span is not less; turning by w radians about the vertical
//! moves nothing along the axis by more than w times its distance, as if the box were grown by that. So q' of a patch
//! changes by at most the difference between the spans of the grown and the plain box, of whichever of the two frames that is
//! greater for, and need by 1 / 0.2 of it; a vertex's share of the field, a blend of corners each of which is a least over
//! patches, by no more than the greatest change over the patches that touch the four corners.
#![allow(clippy::print_stdout, reason = "the greatest changes are printed")]

mod support;

use std::collections::HashMap;

use clipscape::Result;
use clipscape::camera::{Camera, View};
use clipscape::clipmap::{Clipmap, ClipmapOptions, Screen, Terms, certified_patches, certify};
use clipscape::grid::{Grid, PATCH, Rect};
use clipscape::levels::{Arrival, Bounds, Levels, LightSample};
use clipscape::progress::Silent;
use clipscape::pyramid::{Filter, Pyramid};
use clipscape::work::Serial;
use glam::DVec3;
use support::facts::faults;
use support::motion::{self, ARRIVAL, Bound, Found, Motion, SPACING_M, Surface, TRANSITION, creep};
use support::{Random, hash, hills, seed};

/// Rough hills, flat in places, with voids.
fn rough(width: i64, height: i64, voids: bool) -> Pyramid {
    let grid = Grid::new(width, height, [20.0, 30.0]);
    let heights = grid.size.rect().cells().map(|(i, j)| {
        if voids && hash(9, i / 16, j / 16) < 0.05 {
            return f32::NAN;
        }
        let rough = 300.0 * (hash(3, i / 40, j / 40) as f32).powi(4);
        0.3 * hills(0, i, j) + rough * hash(0, i, j) as f32
    });
    let filter = Filter::default();
    let mut pyramid = Pyramid::new(grid, heights.collect(), None, &filter, &Serial, &Silent).unwrap();
    pyramid.bound(&Serial, &Silent).unwrap();
    pyramid
}

/// Levels whose errors are not saturated: a patch may need less than one below it.
struct Unsaturated<'a>(&'a Pyramid);

impl Levels for Unsaturated<'_> {
    fn grid(&self) -> &Grid {
        self.0.grid()
    }

    fn heights(&self, level: u32, rect: Rect, out: &mut [f32]) -> Result<Arrival> {
        self.0.heights(level, rect, out)
    }

    fn bounds(&self, level: u32, patches: Rect, out: &mut [Bounds]) -> Result<Arrival> {
        let arrival = self.0.bounds(level, patches, out)?;
        out.iter_mut().for_each(|b| b.need_error = b.error);
        Ok(arrival)
    }

    fn has_light(&self) -> bool {
        false
    }

    fn light(&self, level: u32, rect: Rect, out: &mut [LightSample]) -> Result<Arrival> {
        self.0.light(level, rect, out)
    }
}

fn scene(random: &mut Random, grid: &Grid) -> (ClipmapOptions, View) {
    let clip_size = random.pick(&[64, 128, 256]);
    let limit = clip_size / 4 - 10;
    let options = ClipmapOptions {
        clip_size,
        transition: Some(random.pick(&[0, 1, 2, limit, clip_size / 10]).min(limit)),
        levels: random.pick(&[None, None, None, Some(3)]),
        max_error_px: Some(random.pick(&[0.1, 0.5, 1.0, 3.0, 10.0, 40.0])),
        vertical_scale: random.pick(&[1.0, 1.0, 1.0, -1.0, 4.0, 0.0]),
        cull: false,
        ..Default::default()
    };
    let [w, h] = [(0, grid.size.width), (1, grid.size.height)]
        .map(|(axis, samples)| samples as f64 * grid.spacing_m[axis]);
    let camera = Camera {
        eye: DVec3::new(
            random.uniform(-0.1, 1.1) * w,
            random.pick(&[-300.0, 0.0, 100.0, 400.0, 2000.0, 20_000.0]),
            random.uniform(-0.1, 1.1) * h,
        ),
        heading_deg: random.uniform(0.0, 360.0),
        pitch_deg: random.uniform(-90.0, 10.0),
        roll_deg: random.uniform(-180.0, 180.0) * random.pick(&[0.0, 1.0]),
        fov_deg: random.uniform(10.0, 100.0),
    };
    (options, View::new(camera, [640, 360]).unwrap())
}

#[test]
fn alpha_s_facts_hold_with_the_dial() {
    let seed = seed(31);
    let mut random = Random(seed);
    let terrains = [rough(900, 700, true), rough(777, 1201, false)];
    let (mut patches, mut plain_patches, mut mixed) = (0, 0, 0);
    for k in 0..120 {
        let levels = &terrains[k % 2];
        let (options, view) = scene(&mut random, levels.grid());
        let mut clipmap = Clipmap::new(levels, &options).unwrap();
        clipmap.update(levels, &view, 0.0).unwrap();
        let faults = faults(&clipmap, &clipmap);
        assert!(
            faults.is_empty(),
            "seed {seed}, scene {k}: {options:?} {view:?}: {} faults: {:?}",
            faults.len(),
            &faults[..faults.len().min(3)]
        );
        patches += clipmap.report().patches;
        mixed += u32::from(clipmap.report().levels_drawn > 1);
        let off = ClipmapOptions {
            max_error_px: None,
            ..options
        };
        let mut plain = Clipmap::new(levels, &off).unwrap();
        plain_patches += plain.update(levels, &view, 0.0).unwrap().patches;
    }
    println!("{patches} patches of {plain_patches}, {mixed} scenes of several levels");
    assert!(patches < plain_patches && patches > 10_000 && mixed > 40);
}

#[test]
fn control_without_saturation_it_is_not_watertight() {
    let mut random = Random(seed(32));
    let pyramid = rough(900, 700, true);
    let levels = Unsaturated(&pyramid);
    let mut caught = 0;
    for _ in 0..40 {
        let (options, view) = scene(&mut random, levels.grid());
        let mut clipmap = Clipmap::new(&levels, &options).unwrap();
        clipmap.update(&levels, &view, 0.0).unwrap();
        caught += u32::from(!faults(&clipmap, &clipmap).is_empty());
    }
    assert!(caught > 3, "{caught} of 40");
}

#[test]
fn the_promise_is_kept_wherever_the_rings_do_not_cut_in() {
    let seed = seed(33);
    let mut random = Random(seed);
    let levels = rough(777, 1201, false);
    let (mut by_need, mut closest, mut kept, mut frames) = (0, 0.0f64, 0, 0);
    for k in 0..150 {
        let (options, view) = scene(&mut random, levels.grid());
        let promised = options.max_error_px.unwrap();
        let mut clipmap = Clipmap::new(&levels, &options).unwrap();
        clipmap.update(&levels, &view, 0.0).unwrap();
        let ring = clipmap.ring();
        let eye = clipmap.eye().unwrap().samples();
        for certified in certified_patches(&clipmap, Terms::default()).unwrap() {
            let patch = certified.patch;
            let side = (PATCH << patch.level) as f64;
            let [near, far] = {
                let axis = |index: i64, axis: usize| {
                    let first = index as f64 * side - eye[axis];
                    [
                        first.max(-first - side).max(0.0),
                        first.abs().max((first + side).abs()),
                    ]
                };
                let (x, z) = (axis(patch.a, 0), axis(patch.b, 1));
                [x[0].max(z[0]), x[1].max(z[1])]
            };
            let step = (1i64 << patch.level) as f64;
            let climb = |level: u32| f64::from(clipmap.level_constants()[level as usize].climb);
            let coarsest = patch.level as usize + 1 == clipmap.windows().len();
            let own_ring_is_0 =
                coarsest || (far / step).max(climb(patch.level)) < (ring.reach() - ring.transition) as f64;
            let finer_may_be_drawn =
                patch.level == 0 || (2.0 * near / step).max(climb(patch.level - 1)) < ring.reach() as f64;
            // What is left of the walk's roots when levels are cut off has nothing coarser to go by.
            if own_ring_is_0 && finer_may_be_drawn {
                by_need += 1;
                let px = certified.error_px.unwrap_or(f64::INFINITY);
                assert!(
                    px <= promised,
                    "seed {seed}, scene {k}: {px} of {promised} px: {certified:?}, {options:?} {view:?}"
                );
                closest = closest.max(px / promised);
            }
        }
        frames += 1;
        let whole = certify(&clipmap).unwrap().error_px.unwrap_or(f64::INFINITY);
        kept += usize::from(whole <= promised);
    }
    println!(
        "{by_need} patches by need, at most {closest:.3} of the promise; {kept} of {frames} frames keep it"
    );
    assert!(by_need > 5_000 && closest > 0.2 && kept > 10);
}

/// What these motions promise, of pictures of 64x48: about where level 0 is let go at their heights.
const MAX_ERROR_PX: f64 = 15.0;

fn dialled(levels: &dyn Levels, max_error_px: f64) -> Clipmap {
    let options = ClipmapOptions {
        max_error_px: Some(max_error_px),
        ..motion::options(TRANSITION)
    };
    Clipmap::new(levels, &options).unwrap()
}

/// By level and patch of it: the most by which its need may change from one frame to the next.
type Changes = HashMap<(u32, i64, i64), f64>;

fn changes(clipmap: &Clipmap, cameras: [&Camera; 2], max_error_px: f64) -> Changes {
    let grid = clipmap.grid();
    let moved_m = (cameras[1].eye - cameras[0].eye).length();
    let turned = (cameras[1].heading_deg - cameras[0].heading_deg)
        .to_radians()
        .abs();
    let mut changes = Changes::new();
    for window in &clipmap.windows()[1..] {
        let level = window.level();
        for (a, b) in grid.patches(level).rect().cells() {
            let Some(info) = window.patch(a, b) else { continue };
            let span = |camera: &Camera, grown: bool| {
                let view = View::new(*camera, [64, 48]).unwrap();
                let corner = |da: i64, height: f32, axis: [i64; 2]| {
                    let at = |k: usize| (((axis[k] + da) * PATCH) << level) as f64 * SPACING_M[k];
                    DVec3::new(at(0), f64::from(height), at(1)) - camera.eye
                };
                let (low, high) = (
                    corner(-1, info.bounds.need_min, [a, b]),
                    corner(2, info.bounds.need_max, [a, b]),
                );
                let grow = if grown {
                    moved_m + turned * low.abs().max(high.abs()).length()
                } else {
                    0.0
                };
                Screen::new(&view, grid).nearby_px(low - grow, high + grow, f64::from(info.bounds.need_error))
            };
            // Beyond what the dial looks at no change of q' counts.
            let capped = |camera, grown| (span(camera, grown) / max_error_px).min(0.9);
            let change = cameras.map(|camera| {
                capped(camera, true) - capped(camera, false).max(0.7).min(capped(camera, true))
            });
            changes.insert((level, a, b), change[0].max(change[1]) / 0.2);
        }
    }
    changes
}

/// Flies with the dial, at `max_error_px(frame)`.
fn fly(cameras: &[Camera], max_error_px: impl Fn(usize) -> f64) -> Found {
    let levels = motion::terrain();
    let bound = Bound::new(&levels);
    let frame = |camera: &Camera, k: usize| {
        let mut clipmap = dialled(&levels, max_error_px(k));
        let surface = motion::frame(&mut clipmap, &levels, camera, 0.0);
        (clipmap, surface)
    };
    let mut found = Found::default();
    let (_, mut before): (_, Surface) = frame(&cameras[0], 0);
    for (pair, k) in cameras.windows(2).zip(1..) {
        let (clipmap, after) = frame(&pair[1], k);
        let changes = changes(&clipmap, [&pair[0], &pair[1]], max_error_px(0));
        let width = clipmap.grid().size.width;
        let need = |level: u32, place: usize| {
            let last = clipmap.grid().patches(level + 1);
            let patch = |index: i64, count: i64| ((index >> (level + 1)) / PATCH).min(count - 1);
            let a = patch(place as i64 % width, last.width);
            let b = patch(place as i64 / width, last.height);
            // A place on a side belongs to the patch beyond it too.
            Rect::new(a - 2, b - 2, a + 2, b + 2)
                .cells()
                .filter_map(|(a, b)| changes.get(&(level + 1, a, b)))
                .fold(0.0, |most: f64, c| most.max(*c))
        };
        let motion = Motion {
            need: Some(&need),
            ..Motion::of([&pair[0], &pair[1]])
        };
        found.add(&bound, [&before, &after], &motion);
        before = after;
    }
    found
}

#[test]
fn flying_turning_and_climbing_with_the_dial_pop_nothing() {
    let fly_on = |k| motion::camera(ARRIVAL + f64::from(k), 400.0, 150.3, 80.0);
    let turn = |k| motion::camera(ARRIVAL, 400.0, 150.3, f64::from(k));
    let climb = |k| motion::camera(171.4, 360.0 + 5.0 * f64::from(k), 150.3, 80.0);
    let motions: [(&str, Vec<Camera>); 3] = [
        ("flying", (0..12).map(fly_on).collect()),
        ("turning", (0..12).map(turn).collect()),
        ("climbing", (0..24).map(climb).collect()),
    ];
    for (what, cameras) in motions {
        let found = fly(&cameras, |_| MAX_ERROR_PX);
        println!("{what} with the dial: {found:?}");
        assert_eq!(found.pops, 0, "{what}: {found:?}");
        assert!(found.changed > 5_000, "{what}: {found:?}");
    }
    // Another promise from frame to frame is nothing that the camera explains.
    let promise = |k: usize| MAX_ERROR_PX * (1.0 + 0.2 * (k % 2) as f64);
    let found = fly(&creep(ARRIVAL, 400.0, 4), promise);
    println!("control: {found:?}");
    assert!(found.pops > 1_000, "control: {found:?}");
}
