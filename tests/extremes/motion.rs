//! Extreme motion: a teleport each frame, steps of a thousandth of a sample, climbing, turning on the spot. What a
//! frame draws depends on the camera alone, not on the way there. Popping is measured in `tests/popping.rs`.

use clipscape::camera::{Camera, View};
use clipscape::clipmap::{Clipmap, displace};
use clipscape::grid::Grid;
use clipscape::pyramid::Pyramid;
use glam::DVec3;

use crate::harness::{camera, check_facts, pyramid, rough, small, updated};
use crate::support::{Random, seed};

fn terrain() -> Pyramid {
    pyramid(Grid::new(701, 523, [10.0, 12.0]), rough)
}

/// All clip coordinates that a clipmap draws, by patch, as bits.
fn vertices(clipmap: &Clipmap) -> Vec<[u32; 4]> {
    let instances = clipmap.selection().instances();
    instances
        .flat_map(|i| (0..81).map(|k| displace(clipmap, i, k % 9, k / 9)))
        .map(|v| v.clip.map(f32::to_bits))
        .collect()
}

/// Moves one clipmap along `cameras`, checking each frame, and every `fresh_every`th against a clipmap that came there
/// at once.
fn fly(what: &str, cameras: &[Camera], fresh_every: usize) {
    let levels = terrain();
    let options = clipscape::ClipmapOptions {
        cull: false,
        ..small()
    };
    let mut clipmap = Clipmap::new(&levels, &options).unwrap();
    for (k, camera) in cameras.iter().enumerate() {
        let view = View::new(*camera, [48, 32]).unwrap();
        clipmap.update(&levels, &view, 0.0).unwrap();
        check_facts(&clipmap, &format!("{what}, frame {k}, {camera:?}"));
        if k % fresh_every == 0 {
            let fresh = updated(&levels, &small(), &view);
            assert!(vertices(&clipmap) == vertices(&fresh), "{what}, frame {k}");
        }
    }
}

fn teleports(count: usize, random: &mut Random) -> Vec<Camera> {
    let mut teleport = |_| {
        let mut eye = DVec3::new(
            random.uniform(-0.2, 1.2) * 7010.0,
            random.pick(&[40.0, 400.0, 3000.0]),
            random.uniform(-0.2, 1.2) * 6276.0,
        );
        if random.uniform(0.0, 1.0) < 0.1 {
            eye *= 1e5;
        }
        camera(eye, random.uniform(0.0, 360.0), random.uniform(-90.0, 10.0))
    };
    (0..count).map(&mut teleport).collect()
}

#[test]
fn a_teleport_each_frame() {
    let seed = seed(31);
    fly(
        &format!("teleports of seed {seed}"),
        &teleports(40, &mut Random(seed)),
        1,
    );
}

#[test]
fn steps_of_a_thousandth_of_a_sample() {
    // Across column 256, where every level's window may move.
    let step = |k: i64| DVec3::new((256.0 + (k - 30) as f64 / 1000.0) * 10.0, 300.0, 2500.0);
    let cameras: Vec<_> = (0..60).map(|k| camera(step(k), 90.0, -20.0)).collect();
    fly("across a snap", &cameras, 10);
}

#[test]
fn climbing_and_descending() {
    let heights = (0..60).map(|k| 200.0 * 1.08f64.powi(30 - (k - 30i32).abs()));
    let cameras: Vec<_> = heights
        .map(|y| camera(DVec3::new(3456.0, y, 2500.0), 90.0, -80.0))
        .collect();
    fly("climbing", &cameras, 10);
}

#[test]
fn turning_on_the_spot() {
    let turn = |k| camera(DVec3::new(3456.0, 330.0, 2500.0), 7.0 * f64::from(k), -20.0);
    let cameras: Vec<_> = (0..52).map(turn).collect();
    fly("turning", &cameras, 10);
}

#[cfg(feature = "gpu")]
#[test]
fn pictures_after_teleports_are_those_of_fresh_views() {
    use crate::draw::{frame, headless, options};
    let Some(gpu) = crate::support::gpu() else { return };
    let (levels, seed) = (terrain(), seed(32));
    let options = options([48, 32]);
    let mut far_travelled = headless(&gpu, &levels, &options);
    for (k, camera) in teleports(12, &mut Random(seed)).iter().enumerate() {
        let here = frame(&mut far_travelled, &levels, camera);
        let fresh = frame(&mut headless(&gpu, &levels, &options), &levels, camera);
        assert_eq!(here.differing(&fresh), 0, "seed {seed}, teleport {k}");
    }
}
