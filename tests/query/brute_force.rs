//! Rays against all triangles of a surface, one after another; and by several threads.

use clipscape::clipmap::{ClipmapOptions, Drawn};
use clipscape::grid::Grid;
use clipscape::query::{S0, Surface};
use clipscape::work::Work;
use glam::DVec3;

use crate::clipmap;
use crate::support::{Random, seed};
use crate::surfaces::{Diagonal, Oracle, pyramid, rough, rough_grid, small};

/// A random ray about a DEM: from above, below, within its heights, or far away.
fn random_ray(random: &mut Random, grid: &Grid, heights_m: [f64; 2]) -> (DVec3, DVec3) {
    let side = [0, 1].map(|k| [grid.size.width, grid.size.height][k] as f64 * grid.spacing_m[k]);
    let place = |random: &mut Random, beyond: f64| {
        DVec3::new(
            random.uniform(-beyond, 1.0 + beyond) * side[0],
            random.uniform(heights_m[0] - 20.0, heights_m[1] + 60.0),
            random.uniform(-beyond, 1.0 + beyond) * side[1],
        )
    };
    let target = place(random, 0.0);
    let origin = match random.bits() % 4 {
        0 => place(random, 0.0),
        1 => place(random, 1.0),
        2 => target + (place(random, 3.0) - target) * 50.0,
        _ => DVec3::new(
            target.x + random.uniform(-40.0, 40.0),
            heights_m[1] + 300.0,
            target.z,
        ),
    };
    (origin, (target - origin) * random.uniform(0.01, 3.0))
}

/// Rays on which caster and oracle disagree, and rays that hit.
fn disagreements(
    surface: &dyn Surface,
    oracle: &Oracle,
    rays: u32,
    random: &mut Random,
) -> (Vec<String>, u32) {
    let range = oracle
        .triangles
        .iter()
        .flatten()
        .fold([f64::INFINITY, -f64::INFINITY], |[a, b], p| {
            [a.min(p.y), b.max(p.y)]
        });
    let (mut wrong, mut hits) = (Vec::new(), 0);
    for _ in 0..rays {
        let (origin, direction) = random_ray(random, surface.grid(), range);
        let [least, most] = oracle.ray(origin, direction);
        let hit = surface.ray(origin, direction).unwrap();
        hits += u32::from(hit.is_some());
        let along = hit.map_or(f64::INFINITY, |h| h.along);
        let slack = 1e-7;
        if along < least - slack || along > most + slack {
            wrong.push(format!(
                "{origin} along {direction}: {along}, not {least} to {most}"
            ));
        }
        if let Some(hit) = hit {
            let height = surface.height_at(hit.point.x, hit.point.z).unwrap();
            let off = height.map_or(f64::INFINITY, |h| (h - (origin + direction * along).y).abs());
            let near_a_hole = height.is_none();
            if !near_a_hole && (off > 1e-6 || (hit.distance_m - (hit.point - origin).length()).abs() > 1e-6) {
                wrong.push(format!("{origin} along {direction}: {off} m off the surface"));
            }
        }
    }
    (wrong, hits)
}

#[test]
fn rays_meet_the_truth_where_brute_force_does() {
    let seed = seed(21);
    let mut random = Random(seed);
    let pyramid = pyramid(rough_grid(), rough);
    let (s0, oracle) = (S0::new(&pyramid), Oracle::truth(&pyramid, Diagonal::NorthWest));
    let (wrong, hits) = disagreements(&s0, &oracle, 4000, &mut random);
    assert!(
        wrong.is_empty(),
        "seed {seed}: {} of 4000: {}",
        wrong.len(),
        wrong[0]
    );
    assert!(hits > 1000, "seed {seed}: only {hits} hits");
    // Control: quads split the other way are another surface.
    let other = Oracle::truth(&pyramid, Diagonal::NorthEast);
    let (wrong, _) = disagreements(&s0, &other, 400, &mut random);
    assert!(wrong.len() > 50, "seed {seed}: {} of 400 differ", wrong.len());
}

#[test]
fn rays_meet_the_drawn_surface_where_brute_force_does() {
    let seed = seed(22);
    let mut random = Random(seed);
    let pyramid = pyramid(rough_grid(), rough);
    for k in 0..8 {
        let options = ClipmapOptions {
            transition: Some(random.pick(&[0, 1, 6])),
            levels: random.pick(&[None, None, Some(1), Some(2)]),
            ..small(64)
        };
        let eye = DVec3::new(random.uniform(-60.0, 510.0), 1150.0, random.uniform(-60.0, 650.0));
        let clipmap = clipmap(&pyramid, eye, &options);
        let drawn = Drawn::new(&clipmap).unwrap();
        let oracle = Oracle::drawn(&clipmap, Diagonal::NorthWest);
        if oracle.triangles.is_empty() {
            continue;
        }
        let (wrong, hits) = disagreements(&drawn, &oracle, 600, &mut random);
        assert!(
            wrong.is_empty(),
            "seed {seed}, scene {k} {options:?}: {} of 600: {}",
            wrong.len(),
            wrong[0]
        );
        assert!(hits > 50, "seed {seed}, scene {k}: only {hits} hits");
        let other = Oracle::drawn(&clipmap, Diagonal::NorthEast);
        let (wrong, _) = disagreements(&drawn, &other, 100, &mut random);
        assert!(
            wrong.len() > 5,
            "seed {seed}, scene {k}: the other diagonal differs on {}",
            wrong.len()
        );
    }
}

#[test]
fn several_threads_find_what_one_finds() {
    let pyramid = pyramid(rough_grid(), rough);
    let s0 = S0::new(&pyramid);
    let clipmap = clipmap(&pyramid, DVec3::new(200.0, 1200.0, 300.0), &small(64));
    let drawn = Drawn::new(&clipmap).unwrap();
    let threads = clipscape::build::Threads::new(4).unwrap();
    for surface in [&s0 as &dyn Surface, &drawn] {
        let rays: Vec<_> = {
            let mut random = Random(seed(25));
            (0..2000)
                .map(|_| random_ray(&mut random, surface.grid(), [1000.0, 1300.0]))
                .collect()
        };
        let cast = |k: usize| surface.ray(rays[k].0, rays[k].1).unwrap();
        let found: Vec<_> = (0..rays.len()).map(|_| std::sync::Mutex::new(None)).collect();
        threads.each(rays.len(), &|k| *found[k].lock().unwrap() = cast(k));
        for (k, found) in found.into_iter().enumerate() {
            assert_eq!(found.into_inner().unwrap(), cast(k), "ray {k}");
        }
    }
}
