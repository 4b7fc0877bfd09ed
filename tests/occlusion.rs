//! What nearer ground hides may be left out: every vertex of a patch that is left out lies behind the drawn surface, by the
//! caster over it, whatever the camera, the near plane, voids and data that are late.
//!
//! 400 scenes by default; `CLIPSCAPE_SCENES` asks for more, `CLIPSCAPE_SEED` sets the seed.

#![allow(clippy::print_stderr, reason = "long runs say what they saw")]

mod support;
#[path = "support/surfaces.rs"]
mod surfaces;

use std::collections::HashSet;

use clipscape::camera::{Camera, Depth, View};
use clipscape::clipmap::{Clipmap, ClipmapOptions, Drawn, Instance, Wait, displace};
use clipscape::grid::Grid;
use clipscape::levels::Levels;
use clipscape::query::{Picker, Surface};
use glam::DVec3;
use support::scenes::count;
use support::{Random, hash, seed};
use surfaces::pyramid;

const SIZE_PX: [u32; 2] = [640, 400];

/// Ridges and valleys, with blocks of a share of voids.
fn ridges(voids: f64) -> impl Levels {
    pyramid(Grid::new(900, 700, [20.0, 30.0]), move |i, j| {
        if hash(5, i / 9, j / 7) < voids {
            return f32::NAN;
        }
        let (x, z) = (i as f64 / 50.0, j as f64 / 38.0);
        let smooth = 500.0 * (x.sin() * (z + 0.4 * x).cos()) + 80.0 * (2.7 * x).sin() * (3.1 * z).sin();
        (smooth + 4.0 * hash(0, i, j)) as f32
    })
}

/// The ground's height under a camera; 0 over voids.
fn ground(levels: &dyn Levels, x: f64, z: f64) -> f64 {
    let truth = clipscape::query::S0::new(levels);
    truth.height_at(x, z).unwrap().unwrap_or(0.0)
}

fn camera(random: &mut Random, levels: &dyn Levels) -> Camera {
    let grid = levels.grid();
    let side = |axis: usize, samples: i64| grid.spacing_m[axis] * (samples - 1) as f64;
    let x = random.uniform(-0.02, 1.02) * side(0, grid.size.width);
    let z = random.uniform(-0.02, 1.02) * side(1, grid.size.height);
    let above = random.pick(&[-20.0, 1.0, 20.0, 100.0, 200.0]);
    Camera {
        eye: DVec3::new(x, ground(levels, x, z) + above, z),
        heading_deg: random.uniform(0.0, 360.0),
        pitch_deg: random.uniform(-30.0, 10.0),
        roll_deg: random.pick(&[0.0, 0.0, 37.0]),
        fov_deg: random.pick(&[30.0, 60.0, 110.0]),
    }
}

/// What a scene left out for being hidden.
#[derive(Debug, Default)]
struct LeftOut {
    patches: usize,
    vertices: usize,
    /// Vertices that are in the picture and have nothing before them.
    seen: Vec<String>,
}

/// A frame with and without hidden patches, the eye having come to its place if data may be late.
fn look(levels: &dyn Levels, options: &ClipmapOptions, view: &View, way: DVec3, heed: bool) -> LeftOut {
    let draw = |occlusion| {
        let options = ClipmapOptions {
            occlusion,
            ..*options
        };
        let mut clipmap = Clipmap::new(levels, &options).unwrap();
        if !heed {
            clipmap.frame_mut().2.ignore_gaps();
        }
        let frames = if options.wait == Wait::None { 12 } else { 0 };
        for k in 0..=frames {
            let mut view = *view;
            view.eye -= way * f64::from(frames - k);
            clipmap.update(levels, &view, f64::from(k) / 30.0).unwrap();
        }
        clipmap
    };
    let (all, culled) = (draw(false), draw(true));
    let key = |i: &Instance| (i.level, i.origin);
    let drawn: HashSet<_> = culled.selection().instances().map(key).collect();
    let surface = Drawn::new(&all).unwrap();
    let mut picker = Picker::new(&surface, view).unwrap();
    let mut out = LeftOut::default();
    for instance in all.selection().instances().filter(|i| !drawn.contains(&key(i))) {
        out.patches += 1;
        for k in (0..81).step_by(4) {
            let vertex = displace(&all, instance, k % 9, k / 9);
            let [x, y, _, w] = vertex.clip.map(f64::from);
            if vertex.void || x.abs() > w || y.abs() > w || w < f64::from(all.view_constants().near_m) {
                continue;
            }
            out.vertices += 1;
            let pixel = [
                (x / w + 1.0) / 2.0 * f64::from(SIZE_PX[0]),
                (1.0 - y / w) / 2.0 * f64::from(SIZE_PX[1]),
            ];
            let before = picker
                .cast(pixel)
                .unwrap()
                .is_some_and(|c| c.along < w * (1.0 - 1e-5));
            if !before {
                out.seen.push(format!("{instance:?} vertex {k} at {pixel:?}"));
            }
        }
    }
    out
}

fn scenes(seed: u64, heed: bool) -> LeftOut {
    let mut random = Random(seed);
    let terrains: [(&str, Box<dyn Levels>); 4] = [
        ("ridges", Box::new(ridges(0.0))),
        ("ridges with few voids", Box::new(ridges(0.001))),
        ("ridges with voids", Box::new(ridges(0.05))),
        ("ridges full of voids", Box::new(ridges(0.2))),
    ];
    let mut sum = LeftOut::default();
    for k in 0..count("CLIPSCAPE_SCENES", 400) {
        let (name, levels) = &terrains[k % 4];
        let levels = levels.as_ref();
        let clip_size = random.pick(&[64, 128, 256]);
        let wait = random.pick(&[Wait::All, Wait::All, Wait::None]);
        let options = ClipmapOptions {
            clip_size,
            transition: random.pick(&[None, Some(0), Some(clip_size / 4 - 10)]),
            vertical_scale: random.pick(&[1.0, 1.0, 1.0, 1.0, -1.0, 4.0]),
            max_error_px: random.pick(&[None, None, Some(2.0)]),
            levels: random.pick(&[None, None, None, Some(2)]),
            upload_budget_bytes: (wait == Wait::None).then(|| random.pick(&[20_000, 200_000])),
            wait,
            ..Default::default()
        };
        let camera = camera(&mut random, levels);
        let near_m = random.pick(&[None, None, None, Some(0.5), Some(60.0)]);
        let view = View::new(camera, SIZE_PX).unwrap();
        let view = near_m.map_or(view, |m| view.with_depth(Depth::reversed(m).unwrap()));
        let spacing_m = levels.grid().spacing_m[0];
        let way = DVec3::new(random.uniform(-4.0, 4.0), 0.0, random.uniform(-4.0, 4.0)) * spacing_m;
        let found = look(levels, &options, &view, way, heed);
        sum.patches += found.patches;
        sum.vertices += found.vertices;
        if let Some(first) = found.seen.first() {
            let (seen, of) = (found.seen.len(), found.vertices);
            sum.seen.push(format!(
                "scene {k}, {name}: {seen} of {of} are seen, as {first}; {camera:?}, near {near_m:?}, {options:?}"
            ));
        }
    }
    eprintln!(
        "{} patches and {} vertices in the picture left out",
        sum.patches, sum.vertices
    );
    sum
}

#[test]
fn what_is_left_out_lies_behind_what_is_drawn() {
    let seed = seed(31);
    let found = scenes(seed, true);
    assert!(found.seen.is_empty(), "seed {seed}: {:#?}", found.seen);
    assert!(
        found.patches > 2000 && found.vertices > 10_000,
        "seed {seed}: {} patches, {} vertices left out",
        found.patches,
        found.vertices
    );
}

#[test]
fn control_gaps_through_which_more_is_seen_are_caught() {
    let seed = seed(31);
    let found = scenes(seed, false);
    assert!(
        !found.seen.is_empty(),
        "seed {seed}: {} patches, {} vertices left out, all of them hidden",
        found.patches,
        found.vertices
    );
}
