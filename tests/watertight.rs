//! The facts about alpha that make the surface watertight, over random scenes, without a GPU.

mod support;

use std::collections::{HashMap, HashSet};

use clipscape::camera::{Camera, View};
use clipscape::clipmap::{Clipmap, ClipmapOptions, Instance, Selection, Side, Vertex, displace};
use clipscape::grid::{Grid, PATCH, Patch};
use clipscape::levels::Levels;
use clipscape::progress::Silent;
use clipscape::pyramid::{Filter, Pyramid};
use clipscape::work::Serial;
use glam::DVec3;
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

/// A drawn patch's side: level, which end of the axis it faces, and its nine vertices by place along it.
struct Line<'a> {
    level: u32,
    faces_on: bool,
    instance: &'a Instance,
    vertices: Vec<(i64, Vertex)>,
}

/// Checks the selection of `clipmap` against the alpha of `shader`, usually the same; says what is wrong.
fn faults(clipmap: &Clipmap, shader: &Clipmap) -> Vec<String> {
    let grid = clipmap.grid();
    let mut faults = Vec::new();
    let mut area = 0;
    let mut lines: HashMap<(bool, i64), Vec<Line<'_>>> = HashMap::new();
    for instance in clipmap.selection().instances() {
        let step = 1i64 << instance.level;
        let [x, z] = instance.origin.map(|o| i64::from(o) * step);
        let side = PATCH * step;
        let cut = |first: i64, samples: i64| ((first + side).min(samples - 1) - first).max(0);
        area += cut(x, grid.size.width) * cut(z, grid.size.height);
        for (along_x, far) in [(true, false), (true, true), (false, false), (false, true)] {
            let at = if far { side } else { 0 };
            let end = if far { PATCH as i32 } else { 0 };
            let key = (along_x, if along_x { z + at } else { x + at });
            let vertices = (0..=PATCH).map(|k| {
                let (cx, cz) = if along_x { (k as i32, end) } else { (end, k as i32) };
                // Vertices past a level's last sample fall on it.
                let size = grid.level(instance.level);
                let last = (if along_x { size.width } else { size.height } - 1) * step;
                let place = (k * step + if along_x { x } else { z }).min(last);
                (place, displace(shader, instance, cx, cz))
            });
            let line = Line {
                level: instance.level,
                faces_on: far,
                instance,
                vertices: vertices.collect(),
            };
            lines.entry(key).or_default().push(line);
        }
    }
    let resident_whole = !clipmap.report().cut;
    if resident_whole && area != (grid.size.width - 1) * (grid.size.height - 1) {
        faults.push(format!("cover: {area} cells"));
    }
    for line in lines.values() {
        for fine in line {
            for coarse in line
                .iter()
                .filter(|c| c.faces_on != fine.faces_on && c.level >= fine.level)
            {
                let overlap = |a: &Line<'_>, b: &Line<'_>| a.vertices[0].0 < b.vertices[PATCH as usize].0;
                if !overlap(fine, coarse) || !overlap(coarse, fine) {
                    continue;
                }
                if coarse.level > fine.level + 1 {
                    faults.push(format!("levels {} and {} meet", fine.level, coarse.level));
                }
                if coarse.level == fine.level + 1 && fine.vertices.iter().any(|(_, v)| v.alpha != 1.0) {
                    faults.push(format!(
                        "(b): {:?} meets a coarser patch with alpha below 1",
                        fine.instance
                    ));
                }
                for (place, theirs) in &coarse.vertices {
                    let ours = fine.vertices.iter().find(|(p, _)| p == place).map(|(_, v)| v);
                    if ours.is_some_and(|v| {
                        (v.from_eye, v.height, v.clip) != (theirs.from_eye, theirs.height, theirs.clip)
                    }) {
                        faults.push(format!(
                            "a vertex at {place} differs: {ours:?} {theirs:?} between {:?} and {:?}",
                            fine.instance, coarse.instance
                        ));
                    }
                }
            }
        }
    }
    faults.extend(closer_faults(clipmap.selection()));
    // (c): wherever children are drawn, alpha of their parent's level is 0 on the parent.
    for instance in clipmap.selection().instances() {
        if instance.level as usize + 1 == clipmap.windows().len() {
            continue;
        }
        let [a, b] = instance.origin.map(|o| i64::from(o) / PATCH);
        let parent = Patch::new(instance.level, a, b).parent();
        let origin = [(parent.a * PATCH) as i32, (parent.b * PATCH) as i32];
        let parent = Instance {
            origin,
            level: parent.level,
            fill: 0.0,
        };
        let zero = |k: i32| displace(shader, &parent, k % 9, k / 9).alpha == 0.0;
        if !(0..81).all(zero) {
            faults.push(format!("(c): {instance:?} is drawn where its parent morphs"));
        }
    }
    faults
}

/// A side is closed exactly where a patch of the next coarser level is drawn beyond it.
fn closer_faults(selection: &Selection) -> Vec<String> {
    let drawn: HashSet<_> = selection
        .instances()
        .map(|i| (i.level, i.origin.map(|o| i64::from(o) / PATCH)))
        .collect();
    let mut faults = Vec::new();
    for instance in selection.instances() {
        let [a, b] = instance.origin.map(|o| i64::from(o) / PATCH);
        for (side, closers) in Side::ALL.into_iter().zip(&selection.closers) {
            let (a, b) = match side {
                Side::West => (a - 1, b),
                Side::East => (a + 1, b),
                Side::North => (a, b - 1),
                Side::South => (a, b + 1),
            };
            let beyond = Patch::new(instance.level, a, b).parent();
            let coarser = drawn.contains(&(beyond.level, [beyond.a, beyond.b]));
            if coarser != closers.contains(instance) {
                faults.push(format!(
                    "closer: {side:?} of {instance:?} beside a coarser patch: {coarser}"
                ));
            }
        }
    }
    faults
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

#[test]
fn alpha_s_facts_hold_over_random_scenes() {
    let seed = seed(6);
    let mut random = Random(seed);
    let (mut patches, mut mixed, mut morphing) = (0, 0, 0);
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
        patches > 10_000 && mixed > 40 && morphing > 500,
        "{patches} patches, {mixed} mixed, {morphing} morphing"
    );
}

#[test]
fn control_a_selection_that_lags_behind_the_shader_is_caught() {
    let seed = seed(7);
    let mut random = Random(seed);
    let mut caught = 0;
    for _ in 0..40 {
        let mut scene = scene(&mut random);
        let mut clipmap = Clipmap::new(&scene.levels, &scene.options).unwrap();
        clipmap.update(&scene.levels, &scene.view, 0.0).unwrap();
        let mut moved = clipmap.clone();
        let spacing_m = scene.levels.grid.spacing_m;
        scene.view.eye += DVec3::new(20.0 * spacing_m[0], 0.0, 20.0 * spacing_m[1]);
        moved.update(&scene.levels, &scene.view, 0.0).unwrap();
        caught += u32::from(!faults(&clipmap, &moved).is_empty());
    }
    // Where all that is drawn is one level, there is nothing to contradict.
    assert!(caught > 10, "seed {seed}: {caught} of 40");
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
fn culling_leaves_out_only_what_is_not_seen() {
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
