//! The fast caster over `S0`: hit for hit as the plain one, and closed forms.
#![allow(clippy::print_stderr, reason = "says what it found")]

mod support;
#[path = "support/surfaces.rs"]
mod surfaces;

use clipscape::camera::{Camera, View};
use clipscape::grid::Grid;
use clipscape::levels::Levels;
use clipscape::query::{Crossing, Picker, Probe, S0, Surface, Truth};
use clipscape::source::Synth;
use glam::DVec3;
use support::{Random, hash, hills, seed};
use surfaces::pyramid;

/// Rays on which the casters differ, and rays that hit.
fn differences(
    levels: &dyn Levels,
    plain: &dyn Levels,
    random: &mut Random,
    rays: u32,
) -> (Vec<String>, u32) {
    let (mut wrong, mut hits) = (Vec::new(), 0);
    let grid = levels.grid();
    let side = [0, 1].map(|k| [grid.size.width, grid.size.height][k] as f64 * grid.spacing_m[k]);
    let scales = [1.0, 3.0, -1.0, 0.0];
    let truths = scales.map(|scale| Truth::new(levels, scale));
    let plains = scales.map(|scale| S0::new(plain).with_vertical_scale(scale));
    for _ in 0..rays / 50 {
        let k = random.pick(&[0, 0, 0, 1, 2, 3]);
        let (truth, s0, scale) = (&truths[k], &plains[k], scales[k]);
        let beyond = random.pick(&[0.0, 0.0, 0.5]);
        let place = [0, 1].map(|k| random.uniform(-beyond, 1.0 + beyond) * side[k]);
        let ground = s0.height_at(place[0], place[1]).unwrap().unwrap_or(grid.base_m);
        // Above the ground, below it, and on it; along the grid, along diagonals, and anyhow.
        let above = random.pick(&[1.0, 40.0, 300.0, -20.0, 0.0]);
        let (turn, tilt) = (random.uniform(0.0, 360.0), random.uniform(-30.0, 5.0));
        let (steep, roll) = (random.uniform(-90.0, 10.0), random.uniform(-180.0, 180.0));
        let camera = Camera {
            eye: DVec3::new(place[0], ground + above, place[1]),
            heading_deg: random.pick(&[0.0, 90.0, 45.0, turn, turn]),
            pitch_deg: random.pick(&[-90.0, 0.0, steep, tilt]),
            roll_deg: random.pick(&[0.0, roll]),
            fov_deg: random.pick(&[0.1, 40.0, 90.0, 150.0]),
        };
        let view = View::new(camera, [16, 9]).unwrap();
        let (mut probe, mut picker) = (Probe::new(truth, &view).unwrap(), Picker::new(s0, &view).unwrap());
        for _ in 0..50 {
            // Centres, the picture's middle, and anywhere.
            let pixel = match random.bits() % 4 {
                0 => [8.0, 4.5],
                1 => [8.0, random.uniform(0.0, 9.0)],
                _ => [random.uniform(0.0, 16.0), random.uniform(0.0, 9.0)],
            };
            let (fast, slow) = (probe.cast(pixel).unwrap(), picker.cast(pixel).unwrap());
            let essence = |c: Crossing| (c.along, c.height_m, c.cell, c.triangle, c.wall);
            if fast.map(essence) != slow.map(essence) {
                wrong.push(format!(
                    "{camera:?} times {scale}, pixel {pixel:?}: {fast:?}, not {slow:?}"
                ));
            }
            hits += u32::from(slow.is_some());
        }
    }
    (wrong, hits)
}

fn voids(i: i64, j: i64) -> f32 {
    let void = hash(7, i / 19, j / 17) < 0.2 || hash(8, i, j) < 0.02;
    if void { f32::NAN } else { hills(0, i, j) }
}

#[test]
fn the_fast_caster_hits_what_the_plain_one_does() {
    let seed = seed(61);
    let mut random = Random(seed);
    let grid = |width, height| {
        let mut grid = Grid::new(width, height, [3.0, 5.0]);
        grid.base_m = 1000.25;
        grid.offset = [70, -3];
        grid
    };
    let steps = |i: i64, j: i64| hills(0, i, j).round();
    let noise = |i, j| 9000.0 * hash(0, i, j) as f32;
    let terrains = [
        ("hills", pyramid(grid(700, 530), |i, j| hills(0, i, j))),
        ("steps", pyramid(grid(513, 257), steps)),
        ("voids", pyramid(grid(600, 600), voids)),
        ("noise", pyramid(grid(300, 300), noise)),
        ("a tile", pyramid(grid(257, 257), voids)),
        ("small", pyramid(grid(5, 3), noise)),
        ("a row of quads", pyramid(grid(900, 2), steps)),
        ("void", pyramid(grid(300, 300), |_, _| f32::NAN)),
        ("a column of samples", pyramid(grid(1, 300), steps)),
    ];
    let mut all = 0;
    for (name, pyramid) in &terrains {
        let (wrong, hits) = differences(pyramid, pyramid, &mut random, 6000);
        assert!(
            wrong.is_empty(),
            "seed {seed}: {name}: {} rays, one is {}",
            wrong.len(),
            wrong[0]
        );
        all += hits;
    }
    // Bounds from formulas, more levels than tiles have, ground that is never read.
    let synth = Synth::new(6000, 5).unwrap();
    let (wrong, hits) = differences(&synth, &synth, &mut random, 300);
    assert!(
        wrong.is_empty(),
        "seed {seed}: synth: {} rays, one is {}",
        wrong.len(),
        wrong[0]
    );
    assert!(all + hits > 10_000, "seed {seed}: {all} and {hits} hits");
}

#[test]
fn control_one_sample_of_another_height_is_noticed() {
    let mut random = Random(62);
    let grid = Grid::new(12, 12, [3.0, 5.0]);
    let one = pyramid(grid, |i, j| hills(0, i, j));
    let other = pyramid(grid, |i, j| {
        hills(0, i, j) + f32::from(u8::from(i == 5 && j == 6))
    });
    let (wrong, hits) = differences(&one, &other, &mut random, 10_000);
    assert!(wrong.len() > 10, "{} of {hits} rays", wrong.len());
}

/// Rays of a picture against a closed form: distance along the view axis, none where nothing is met. The greatest
/// relative deviation, and the rays that hit.
fn deviation(levels: &dyn Levels, camera: Camera, form: impl Fn(DVec3, DVec3) -> Option<f64>) -> (f64, u32) {
    let view = View::new(camera, [160, 120]).unwrap();
    let truth = Truth::new(levels, 1.0);
    let mut probe = Probe::new(&truth, &view).unwrap();
    let (mut worst, mut hits) = (0.0f64, 0);
    for n in 0..160 * 120 {
        let pixel = [n % 160, n / 160].map(|v| f64::from(v) + 0.5);
        let hit = probe.cast(pixel).unwrap().map(|c| c.along);
        if let Some(want) = form(camera.eye, view.ray(pixel)) {
            let got = hit.unwrap_or(f64::INFINITY);
            worst = worst.max((got / want - 1.0).abs());
            hits += 1;
        }
    }
    (worst, hits)
}

fn camera(eye: [f64; 3], target: [f64; 3]) -> Camera {
    let (heading_deg, pitch_deg) = Camera::toward(eye.into(), target.into());
    Camera {
        eye: eye.into(),
        heading_deg,
        pitch_deg,
        roll_deg: 7.0,
        fov_deg: 50.0,
    }
}

#[test]
fn a_plane_is_met_where_it_is() {
    let mut grid = Grid::new(600, 600, [4.0, 8.0]);
    grid.base_m = 123.0;
    // Rises by 1/4 to the east and falls by 1/8 to the south; every height is exact in f32.
    let plane = pyramid(grid, |i, j| (i - j) as f32);
    let (east, south, base) = (0.25, -0.125, 123.0);
    for (eye, target) in [
        ([1000.0, 900.0, 2500.0], [1200.0, 123.0, 2000.0]),
        ([900.0, 200.0, 2300.0], [1300.0, 190.0, 1900.0]),
        ([1200.0, -600.0, 2300.0], [1200.0, 123.0, 2400.0]),
    ] {
        let (worst, hits) = deviation(&plane, camera(eye, target), |o, d| {
            let along = (base + east * o.x + south * o.z - o.y) / (d.y - east * d.x - south * d.z);
            let at = o + d * along;
            let on = (0.0..=599.0 * 4.0).contains(&at.x) && (0.0..=599.0 * 8.0).contains(&at.z);
            (along > 0.0 && on).then_some(along)
        });
        assert!(hits > 3000, "{hits}");
        eprintln!("plane: off by {worst:.1e} of the distance at most, {hits} rays");
        assert!(worst < 1e-12, "{worst:e} of the distance, from {eye:?}");
    }
}

#[test]
fn a_single_spike_is_met_where_it_is() {
    // One sample of 64 m on a plain: six triangles about it, each a plane of its own.
    let (ci, cj, step) = (300, 300, 10.0);
    let spike = pyramid(Grid::new(601, 601, [step, step]), |i, j| {
        if i == ci && j == cj { 64.0 } else { 0.0 }
    });
    let centre = DVec3::new(ci as f64 * step, 0.0, cj as f64 * step);
    // Height at u, v steps from the peak: 1 - max(|u|, |v|, |u - v|), where quads are split from north-west to
    // south-east.
    let height = |u: f64, v: f64| 64.0 * (1.0 - u.abs().max(v.abs()).max((u - v).abs())).max(0.0);
    let planes = [
        [1.0, 0.0],
        [-1.0, 0.0],
        [0.0, 1.0],
        [0.0, -1.0],
        [1.0, -1.0],
        [-1.0, 1.0],
    ];
    let form = |o: DVec3, d: DVec3| {
        let (o, d) = ((o - centre) / step, d / step);
        let mut first = f64::INFINITY;
        for [a, b] in planes {
            // y = 64 (1 - a u - b v)
            let along = (6.4 * (1.0 - a * o.x - b * o.z) - o.y) / (d.y + 6.4 * (a * d.x + b * d.z));
            let at = o + d * along;
            let on = (at.y * step - height(at.x, at.z)).abs() < 1e-9;
            if along > 0.0 && on {
                first = first.min(along);
            }
        }
        let plain = -o.y / d.y;
        let at = o + d * plain;
        let inside = at.x.abs().max(at.z.abs()) <= 300.0;
        if plain > 0.0 && inside && height(at.x, at.z) == 0.0 {
            first = first.min(plain);
        }
        first.is_finite().then_some(first)
    };
    for (eye, target) in [
        ([2950.0, 60.0, 3060.0], [3000.0, 30.0, 3000.0]),
        ([3004.0, 90.0, 3003.0], [3000.0, 0.0, 3000.0]),
        ([3035.0, 5.0, 2990.0], [3000.0, 30.0, 3000.0]),
    ] {
        let (worst, hits) = deviation(&spike, camera(eye, target), form);
        assert!(hits > 3000, "{hits}");
        eprintln!("spike: off by {worst:.1e} of the distance at most, {hits} rays");
        assert!(worst < 1e-11, "{worst:e} of the distance, from {eye:?}");
    }
}

#[test]
fn a_cone_is_met_as_nearly_as_triangles_can_be() {
    // Slope 1 about the middle; its triangles lie inside of it by at most what a chord of a step leaves of it.
    let step = 5.0;
    let cone = pyramid(Grid::new(801, 801, [step, step]), |i, j| {
        2000.0 - step as f32 * ((i - 400) as f32).hypot((j - 400) as f32)
    });
    let apex = DVec3::new(2000.0, 2000.0, 2000.0);
    let eye = [2000.0, 2600.0, 500.0];
    let (worst, hits) = deviation(&cone, camera(eye, [2000.0, 1200.0, 1000.0]), |o, d| {
        // (2000 - y)^2 = x^2 + z^2 about the apex.
        let o = o - apex;
        let (a, b, c) = (
            d.x * d.x + d.z * d.z - d.y * d.y,
            o.x * d.x + o.z * d.z - o.y * d.y,
            o.x * o.x + o.z * o.z - o.y * o.y,
        );
        let root = (b * b - a * c).sqrt();
        let along = [(-b - root) / a, (-b + root) / a]
            .into_iter()
            .filter(|t| *t > 0.0)
            .fold(f64::INFINITY, f64::min);
        let at = o + d * along;
        // Away from its apex, its edges and its mirror image.
        let r = at.x.hypot(at.z);
        (along.is_finite() && at.y < 0.0 && (300.0..1900.0).contains(&r)).then_some(along)
    });
    assert!(hits > 3000, "{hits}");
    eprintln!("cone: off by {worst:.1e} of the distance at most, {hits} rays");
    // Heights differ by at most 50 / (8 * 300) m, a chord of a diagonal's length at radius 300; along rays that meet the cone
    // at some angle, three times that, of at least 700 m.
    assert!(
        worst < 3.0 * 50.0 / 8.0 / 300.0 / 700.0,
        "{worst:e} of the distance"
    );
    assert!(worst > 1e-7, "control: triangles are no cone, {worst:e}");
}
