//! The facts about alpha that make the surface watertight, over random scenes, without a GPU.

mod support;

use std::collections::HashSet;

use clipscape::camera::{Camera, View};
use clipscape::clipmap::{Clipmap, ClipmapOptions, Instance, displace};
use clipscape::grid::Grid;
use clipscape::levels::Levels;
use clipscape::progress::Silent;
use clipscape::pyramid::{Filter, Pyramid};
use clipscape::work::Serial;
use glam::DVec3;
use support::facts::{closer_faults, faults};
use support::{Formula, Random, hash, hills, seed};

type Hills = Formula<fn(u32, i64, i64) -> f32>;

struct Scene {
    levels: Hills,
    options: ClipmapOptions,
    view: View,
}

fn scene(random: &mut Random) -> Scene {
    let (w, h) = (
        random.pick(&[1201, 777, 1013, 1025, 40, 2000]),
        random.pick(&[1201, 500, 799, 64]),
    );
    let grid = Grid::new(w, h, [random.pick(&[1.0, 30.0]), random.pick(&[1.0, 25.0])]);
    let clip_size = random.pick(&[64, 128, 256]);
    let limit = clip_size / 4 - 10;
    let transition = random.pick(&[0, 1, 2, limit, clip_size / 10]).min(limit);
    let levels = random.pick(&[None, None, Some(1), Some(3)]);
    let spacing_m = (grid.spacing_m[0] * grid.spacing_m[1]).sqrt();
    let eye = DVec3::new(
        random.uniform(-50.0, w as f64 + 50.0) * grid.spacing_m[0],
        random.pick(&[-300.0, 0.0, 5.0, 40.0, 300.0, 3000.0]) * spacing_m,
        random.uniform(-50.0, h as f64 + 50.0) * grid.spacing_m[1],
    );
    let camera = Camera {
        eye,
        heading_deg: 0.0,
        pitch_deg: -90.0,
        roll_deg: 0.0,
        fov_deg: 60.0,
    };
    Scene {
        levels: Formula::new(grid, hills),
        options: ClipmapOptions {
            clip_size,
            levels,
            transition: Some(transition),
            cull: false,
            ..Default::default()
        },
        view: View::new(camera, [64, 64]).unwrap(),
    }
}

#[test]
fn control_a_side_that_is_not_closed_is_caught() {
    let seed = seed(9);
    let mut random = Random(seed);
    let mut caught = 0;
    for _ in 0..40 {
        let scene = scene(&mut random);
        let mut clipmap = Clipmap::new(&scene.levels, &scene.options).unwrap();
        clipmap.update(&scene.levels, &scene.view, 0.0).unwrap();
        let mut selection = clipmap.selection().clone();
        selection.closers.swap(0, 1);
        let sides = selection.closers[0].len() + selection.closers[1].len();
        caught += u32::from(sides > 0 && !closer_faults(&selection).is_empty());
    }
    // Where all that is drawn is one level, no side is closed.
    assert!(caught > 8, "seed {seed}: {caught} of 40");
}

/// How many of the patches that are drawn as if alpha were 0 on all of them have a vertex at which it is not.
fn moving(clipmap: &Clipmap, shader: &Clipmap) -> usize {
    let moves = |i: &&Instance| (0..81).any(|k| displace(shader, i, k % 9, k / 9).alpha != 0.0);
    clipmap.selection().still.iter().filter(moves).count()
}

#[test]
fn alpha_s_facts_hold_over_random_scenes() {
    let seed = seed(6);
    let mut random = Random(seed);
    let (mut patches, mut mixed, mut morphing, mut still) = (0, 0, 0, 0);
    for k in 0..150 {
        let scene = scene(&mut random);
        let mut clipmap = Clipmap::new(&scene.levels, &scene.options).unwrap();
        clipmap.update(&scene.levels, &scene.view, 0.0).unwrap();
        let faults = faults(&clipmap, &clipmap);
        let place = || format!("seed {seed}, scene {k}: {:?} {:?}", scene.options, scene.view.eye);
        assert!(
            faults.is_empty(),
            "{}: {} faults: {:?}",
            place(),
            faults.len(),
            &faults[..faults.len().min(3)]
        );
        assert_eq!(moving(&clipmap, &clipmap), 0, "{}", place());
        still += clipmap.selection().still.len();
        patches += clipmap.report().patches;
        mixed += u32::from(clipmap.report().levels_drawn > 1);
        let first = clipmap.selection().instances();
        morphing += first
            .filter(|i| {
                (0..81).any(|k| {
                    let alpha = displace(&clipmap, i, k % 9, k / 9).alpha;
                    alpha > 0.0 && alpha < 1.0
                })
            })
            .count();
    }
    assert!(
        patches > 10_000 && mixed > 40 && morphing > 500 && still > 5_000,
        "{patches} patches, {mixed} mixed, {morphing} morphing, {still} still"
    );
}

#[test]
fn control_a_selection_that_lags_behind_the_shader_is_caught() {
    let seed = seed(7);
    let mut random = Random(seed);
    let (mut caught, mut moved_on) = (0, 0);
    for _ in 0..40 {
        let mut scene = scene(&mut random);
        let mut clipmap = Clipmap::new(&scene.levels, &scene.options).unwrap();
        clipmap.update(&scene.levels, &scene.view, 0.0).unwrap();
        let mut moved = clipmap.clone();
        let spacing_m = scene.levels.grid.spacing_m;
        scene.view.eye += DVec3::new(20.0 * spacing_m[0], 0.0, 20.0 * spacing_m[1]);
        moved.update(&scene.levels, &scene.view, 0.0).unwrap();
        caught += u32::from(!faults(&clipmap, &moved).is_empty());
        moved_on += u32::from(moving(&clipmap, &moved) > 0);
    }
    // Where all that is drawn is one level, there is nothing to contradict.
    assert!(
        caught > 10 && moved_on > 10,
        "seed {seed}: {caught}, {moved_on} of 40"
    );
}

/// A pyramid with its own saturated bounds: rough ground with voids.
fn rough(width: i64, height: i64) -> Pyramid {
    let grid = Grid::new(width, height, [20.0, 30.0]);
    let heights = grid.size.rect().cells().map(|(i, j)| {
        let void = hash(9, i / 16, j / 16) < 0.1;
        if void {
            f32::NAN
        } else {
            hills(0, i, j) + 400.0 * hash(0, i, j) as f32
        }
    });
    let mut pyramid = Pyramid::new(
        grid,
        heights.collect(),
        None,
        &Filter::default(),
        &Serial,
        &Silent,
    )
    .unwrap();
    pyramid.bound(&Serial, &Silent).unwrap();
    pyramid
}

#[test]
fn culling_by_the_frustum_leaves_out_only_what_is_beside_the_picture() {
    let seed = seed(8);
    let mut random = Random(seed);
    let terrains = [rough(900, 700), rough(333, 1201)];
    let mut dropped = 0;
    for k in 0..80 {
        let scene = scene(&mut random);
        let levels = &terrains[k % 2];
        let size = levels.grid().size;
        let scale = random.pick(&[1.0, 1.0, 0.0, -2.0, 10.0]);
        let camera = Camera {
            eye: DVec3::new(
                random.uniform(-0.1, 1.1) * size.width as f64 * 20.0,
                random.pick(&[-100.0, 50.0, 500.0, 4000.0]),
                random.uniform(-0.1, 1.1) * size.height as f64 * 30.0,
            ),
            heading_deg: random.uniform(0.0, 360.0),
            pitch_deg: random.uniform(-90.0, 10.0),
            roll_deg: 0.0,
            fov_deg: 60.0,
        };
        let view = View::new(camera, [64, 64]).unwrap();
        let draw = |cull| {
            let options = ClipmapOptions {
                cull,
                occlusion: false,
                vertical_scale: scale,
                ..scene.options
            };
            let mut clipmap = Clipmap::new(levels, &options).unwrap();
            clipmap.update(levels, &view, 0.0).unwrap();
            clipmap
        };
        let (all, culled) = (draw(false), draw(true));
        let seen: HashSet<_> = culled
            .selection()
            .instances()
            .map(|i| (i.level, i.origin))
            .collect();
        for instance in all
            .selection()
            .instances()
            .filter(|i| !seen.contains(&(i.level, i.origin)))
        {
            dropped += 1;
            // All of its vertices lie outside one and the same plane of the frustum.
            let vertices = (0..81)
                .map(|k| displace(&all, instance, k % 9, k / 9))
                .filter(|v| !v.void);
            let clips: Vec<_> = vertices.map(|v| v.clip).collect();
            let outside = |test: fn(&[f32; 4]) -> bool| clips.iter().all(test);
            let unseen = outside(|c| c[3] < 0.0)
                || outside(|c| c[0] > c[3])
                || outside(|c| c[0] < -c[3])
                || outside(|c| c[1] > c[3])
                || outside(|c| c[1] < -c[3]);
            assert!(
                unseen,
                "seed {seed}, scene {k}, scale {scale}: {instance:?} is seen"
            );
        }
    }
    assert!(dropped > 1000, "only {dropped} patches were dropped");
}
