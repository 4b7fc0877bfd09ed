//! Queries on the DEM's own surface and on the drawn one: closed forms, and brute force over all
//! triangles.

mod support;
#[path = "support/surfaces.rs"]
mod surfaces;

use clipscape::accuracy::Facet;
use clipscape::camera::{Camera, View};
use clipscape::clipmap::{Clipmap, ClipmapOptions, Drawn, Place, near_m};
use clipscape::error::{Error, ErrorKind};
use clipscape::grid::{Grid, Patch, Rect};
use clipscape::levels::{Arrival, Bounds, Levels, LightSample};
use clipscape::pyramid::Pyramid;
use clipscape::query::{Picker, Reader, S0, Surface, collider};
use clipscape::work::Work;
use glam::DVec3;
use support::{Formula, Random, hills, seed};
use surfaces::{Diagonal, Oracle, pyramid, rough, rough_grid, small};

fn camera(eye: DVec3) -> Camera {
    Camera {
        eye,
        heading_deg: 30.0,
        pitch_deg: -20.0,
        roll_deg: 3.0,
        fov_deg: 60.0,
    }
}

fn clipmap(levels: &dyn Levels, eye: DVec3, options: &ClipmapOptions) -> Clipmap {
    let mut clipmap = Clipmap::new(levels, options).unwrap();
    clipmap
        .update(levels, &View::new(camera(eye), [64, 64]).unwrap(), 0.0)
        .unwrap();
    clipmap
}

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

/// Rays that follow rows, columns and diagonals exactly, stand, begin on or below the surface, or go through vertices.
#[test]
fn rays_of_special_position_meet_a_plane_where_they_should() {
    let (slope_x, slope_z) = (0.5, -0.25);
    let plane = |i: i64, j: i64| (16.0 + slope_x * 2.0 * i as f64 + slope_z * 4.0 * j as f64) as f32;
    let pyramid = pyramid(Grid::new(100, 90, [2.0, 4.0]), plane);
    let surfaces: [&dyn Surface; 2] = {
        let clipmap = Box::leak(Box::new(clipmap(
            &pyramid,
            DVec3::new(50.0, 40.0, 90.0),
            &small(64),
        )));
        [
            Box::leak(Box::new(S0::new(&pyramid))),
            Box::leak(Box::new(Drawn::new(clipmap).unwrap())),
        ]
    };
    let height = |x: f64, z: f64| 16.0 + slope_x * x + slope_z * z;
    for surface in surfaces {
        let mut count = 0;
        for (x, z) in [
            (40.0, 80.0),
            (41.0, 82.0),
            (40.0, 83.0),
            (0.0, 0.0),
            (198.0, 356.0),
            (3.3, 3.3),
        ] {
            assert_eq!(
                surface
                    .height_at(x, z)
                    .unwrap()
                    .map(|h| (h - height(x, z)).abs() < 1e-9),
                Some(true)
            );
            let normal = surface.normal_at(x, z).unwrap().unwrap();
            assert!((normal - DVec3::new(-slope_x, 1.0, -slope_z).normalize()).length() < 1e-9);
            for (dx, dz) in [
                (0, 0),
                (1, 0),
                (0, 1),
                (1, 1),
                (-1, -1),
                (1, -1),
                (-1, 0),
                (0, -1),
                (2, 1),
                (-1, 3),
            ] {
                for above in [30.0, -30.0, 0.0] {
                    let away = DVec3::new(2.0 * f64::from(dx), 0.0, 4.0 * f64::from(dz)) * 3.0;
                    let target = DVec3::new(x, height(x, z), z);
                    let origin = target - away + DVec3::new(0.0, above, 0.0);
                    let direction = target - origin;
                    if direction == DVec3::ZERO {
                        continue;
                    }
                    let hit = surface.ray(origin, direction).unwrap();
                    // The same height at both ends may be the plane's own: then it is met at once, if it is there.
                    let start = origin.y - height(origin.x, origin.z);
                    let on_dem = |p: DVec3| (0.0..=198.0).contains(&p.x) && (0.0..=356.0).contains(&p.z);
                    let corner = !on_dem(origin) && !on_dem(origin + direction * 1.1);
                    let hit = match hit {
                        Some(hit) => hit,
                        // Touching the DEM in its corner alone is no meeting.
                        None => {
                            assert!(
                                corner || !on_dem(target + direction * 1e-9),
                                "{target} along {direction}"
                            );
                            continue;
                        }
                    };
                    count += 1;
                    let want = if start == 0.0 && on_dem(origin) { 0.0 } else { 1.0 };
                    assert!(
                        (hit.along - want).abs() < 1e-9 || (start.abs() < 1e-9 && hit.along <= 1.0),
                        "{origin} along {direction}: {}",
                        hit.along
                    );
                    assert!((hit.point.y - height(hit.point.x, hit.point.z)).abs() < 1e-9);
                }
            }
        }
        assert!(count > 120, "{count}");
        // Away from the plane, and beside the DEM, nothing is met.
        for (origin, direction) in [
            (DVec3::new(50.0, 90.0, 50.0), DVec3::Y),
            (DVec3::new(50.0, -90.0, 50.0), DVec3::NEG_Y),
            (DVec3::new(-1.0, 90.0, 50.0), DVec3::NEG_Y),
            (DVec3::new(-1.0, 20.0, 50.0), DVec3::Z),
            (DVec3::new(50.0, 400.0, 50.0), DVec3::X),
            (DVec3::new(-50.0, 20.0, -50.0), DVec3::new(-1.0, -1e-3, -1.0)),
        ] {
            assert_eq!(
                surface.ray(origin, direction).unwrap(),
                None,
                "{origin} along {direction}"
            );
        }
    }
}

#[test]
fn a_spike_and_a_cone_are_met_where_their_triangles_are() {
    // One sample of 100 m on flat ground: along its row the section is a triangle of two steps.
    let spike = pyramid(Grid::new(70, 70, [1.0, 1.0]), |i, j| {
        if (i, j) == (30, 40) { 100.0 } else { 0.0 }
    });
    let s0 = S0::new(&spike);
    for (height, want) in [(50.0, 29.5), (99.0, 29.99), (100.0, 30.0), (1e-6, 29.000_000_01)] {
        let hit = s0.ray(DVec3::new(-5.0, height, 40.0), DVec3::X).unwrap().unwrap();
        assert!((hit.point.x - want).abs() < 1e-9, "{height}: {}", hit.point);
        let back = s0
            .ray(DVec3::new(1e4, height, 40.0), DVec3::NEG_X)
            .unwrap()
            .unwrap();
        assert!(
            (back.point.x - (60.0 - want)).abs() < 1e-8,
            "{height}: {}",
            back.point
        );
    }
    assert!(
        s0.ray(DVec3::new(-5.0, 100.0001, 40.0), DVec3::X)
            .unwrap()
            .is_none(),
        "over its top"
    );
    assert!(
        s0.ray(DVec3::new(-5.0, 50.0, 40.51), DVec3::X).unwrap().is_none(),
        "beside it"
    );
    // Along the diagonal its foot is as far; across it the edge of the hexagon of its triangles is nearer.
    let diagonal = s0
        .ray(DVec3::new(20.0, 50.0, 30.0), DVec3::new(1.0, 0.0, 1.0))
        .unwrap()
        .unwrap();
    assert!((diagonal.along - 9.5).abs() < 1e-12, "{}", diagonal.along);
    let across = s0
        .ray(DVec3::new(20.0, 50.0, 50.0), DVec3::new(1.0, 0.0, -1.0))
        .unwrap()
        .unwrap();
    assert!((across.along - 9.75).abs() < 1e-12, "{}", across.along);

    // A cone of slope 1: its facets lie within the sag of a chord of one step, 1 / (8 r), inside of it.
    let cone = pyramid(Grid::new(129, 129, [1.0, 1.0]), |i, j| {
        (60.0 - ((i - 64) as f64).hypot((j - 64) as f64)) as f32
    });
    let s0 = S0::new(&cone);
    let mut random = Random(seed(23));
    for _ in 0..500 {
        let turn = random.uniform(0.0, std::f64::consts::TAU);
        let height = random.uniform(5.0, 40.0);
        let from = DVec3::new(64.0 + 500.0 * turn.cos(), height, 64.0 + 500.0 * turn.sin());
        let hit = s0
            .ray(from, DVec3::new(64.0 - from.x, 0.0, 64.0 - from.z))
            .unwrap()
            .unwrap();
        let radius = (hit.point.x - 64.0).hypot(hit.point.z - 64.0);
        let sag = 2.0 / (8.0 * (60.0 - height)) + 1e-5;
        assert!(
            radius <= 60.0 - height + 1e-5 && radius >= 60.0 - height - sag,
            "{radius} at {height}"
        );
    }
}

/// Patches in a row, each level at its own height, with nothing between them; the height of a void one is NaN.
struct Terraces {
    grid: Grid,
    heights: Vec<f32>,
    /// Whether bounds are known.
    bounded: bool,
}

impl Surface for Terraces {
    fn grid(&self) -> &Grid {
        &self.grid
    }
    fn vertical_scale(&self) -> f64 {
        1.0
    }
    fn roots(&self) -> (u32, Rect) {
        (0, self.grid.patches(0).rect())
    }
    fn reader(&self) -> Box<dyn Reader + '_> {
        Box::new(TerraceReader(self, [0.0; 81]))
    }
}

struct TerraceReader<'a>(&'a Terraces, clipscape::clipmap::Corners);

impl Reader for TerraceReader<'_> {
    fn place(&self, _: Patch) -> Place {
        Place::Patch
    }
    fn heights(&mut self, patch: Patch) -> clipscape::Result<[f32; 2]> {
        let height = self.0.heights[patch.a as usize];
        Ok(if self.0.bounded {
            [height; 2]
        } else {
            [f32::NAN; 2]
        })
    }
    fn corners(&mut self, patch: Patch) -> clipscape::Result<&clipscape::clipmap::Corners> {
        self.1 = [self.0.heights[patch.a as usize]; 81];
        Ok(&self.1)
    }
}

#[test]
fn a_ray_slips_through_no_step_between_patches_but_through_holes() {
    let terraces = |heights: &[f32], bounded| Terraces {
        grid: Grid::new(8 * heights.len() as i64 + 1, 17, [1.0, 1.0]),
        heights: heights.to_vec(),
        bounded,
    };
    for bounded in [false, true] {
        for (heights, want) in [
            // The step may be as small as rounding makes it.
            (&[0.0, 5.0, 9.0][..], Some(8.0)),
            (&[2.0f32.next_down(), 2.0f32.next_up()], Some(8.0)),
            (&[2.0, 0.0], Some(0.0)),
            (&[0.0, 0.0, 5.0], Some(16.0)),
            (&[5.0, 5.0, 0.0], Some(16.0)),
            (&[0.0, 1.0, 0.0], None),
            // Over a hole nothing is carried.
            (&[0.0, f32::NAN, 5.0], None),
            (&[0.0, f32::NAN, 5.0, 0.0], Some(24.0)),
            (&[f32::NAN, 5.0, 5.0], None),
        ] {
            let surface = terraces(heights, bounded);
            let hit = surface.ray(DVec3::new(-3.0, 2.0, 4.25), DVec3::X).unwrap();
            assert_eq!(hit.map(|h| h.point.x), want, "{heights:?}, bounded: {bounded}");
            // And back, through the other side.
            let length = (8 * heights.len()) as f64;
            let mut turned = surface;
            turned.heights.reverse();
            let back = turned
                .ray(DVec3::new(length + 3.0, 2.0, 4.25), DVec3::NEG_X)
                .unwrap();
            assert_eq!(back.map(|h| length - h.point.x), want, "{heights:?} turned round");
        }
    }
}

#[test]
fn facets_are_what_rays_meet_about_them() {
    let pyramid = pyramid(rough_grid(), |i, j| hills(0, i, j));
    let seed = seed(27);
    let mut random = Random(seed);
    let mut checked = 0;
    for scale in [1.0, -3.0] {
        let s0 = S0::new(&pyramid).with_vertical_scale(scale);
        let grid = pyramid.grid();
        for _ in 0..100 {
            let eye = DVec3::new(
                random.uniform(0.0, 400.0),
                1000.0 + 260.0 * scale.signum(),
                random.uniform(0.0, 500.0),
            );
            let camera = Camera {
                pitch_deg: -60.0,
                ..camera(eye)
            };
            let view = View::new(camera, [100, 80]).unwrap();
            let mut picker = Picker::new(&s0, &view).unwrap();
            let pixel = [random.uniform(0.0, 100.0), random.uniform(0.0, 80.0)];
            let Some(hit) = picker.cast(pixel).unwrap() else {
                continue;
            };
            let facet = Facet::new(grid, &view, scale, &hit, pixel).unwrap();
            let near_m = near_m(grid);
            assert!(
                (facet.depth / (near_m / hit.along) - 1.0).abs() < 1e-9,
                "seed {seed}"
            );
            // Beside it, as long as the same triangle is met, depth is linear.
            let beside = [pixel[0] + 0.01, pixel[1] - 0.02];
            let next = picker.cast(beside).unwrap();
            if let Some(next) = next.filter(|n| (n.cell, n.triangle) == (hit.cell, hit.triangle)) {
                let linear = facet.depth + 0.01 * facet.gradient[0] - 0.02 * facet.gradient[1];
                assert!((linear / (near_m / next.along) - 1.0).abs() < 1e-9, "seed {seed}");
                checked += 1;
            }
            assert!(
                facet.rounding() > 0.0 && facet.rounding() < 0.1 * facet.depth,
                "{facet:?}"
            );
        }
    }
    assert!(checked > 40, "seed {seed}: {checked}");
}

#[test]
fn large_indices_cost_nothing() {
    let side = 1 << 30;
    let plane = |level: u32, i: i64, j: i64| (((i << level) % 1024) as f32) + ((j << level) % 512) as f32;
    let levels = Formula::new(Grid::new(side, side, [0.5, 0.25]), plane);
    let s0 = S0::new(&levels);
    let corner = DVec3::new(((side / 2) as f64) * 0.5, 0.0, ((side - 1024) as f64) * 0.25);
    for (x, z) in [(10.25, 3.5), (100.0, 50.0), (0.0, 0.0), (99.125, 20.0625)] {
        let want = x / 0.5 + z / 0.25;
        assert_eq!(
            s0.height_at(corner.x + x, corner.z + z).unwrap(),
            Some(want),
            "{x}, {z}"
        );
        let target = corner + DVec3::new(x, want, z);
        let from = DVec3::new(16.0, 512.0, 8.0);
        let hit = s0.ray(target + from, -from).unwrap().unwrap();
        assert!((hit.along - 1.0).abs() < 1e-12, "{}", hit.along);
    }
}

#[test]
fn picks_heed_the_near_plane_and_the_vertical_scale() {
    let pyramid = pyramid(rough_grid(), |i, j| hills(0, i, j));
    let seed = seed(24);
    let mut random = Random(seed);
    for scale in [1.0, 3.0, -2.0, 0.25] {
        let s0 = S0::new(&pyramid).with_vertical_scale(scale);
        let mut hits = 0;
        for _ in 0..200 {
            let eye = DVec3::new(
                random.uniform(0.0, 400.0),
                1000.0 + 260.0 * scale.signum(),
                random.uniform(0.0, 500.0),
            );
            let camera = Camera {
                pitch_deg: -70.0,
                ..camera(eye)
            };
            let view = View::new(camera, [100, 80]).unwrap();
            let pixel = [random.uniform(0.0, 100.0), random.uniform(0.0, 80.0)];
            let Some(hit) = s0.pick(&view, pixel).unwrap() else {
                continue;
            };
            hits += 1;
            // Projected as drawn, the point is under the pixel, as far away as it says.
            let mut from_eye = hit.point - eye;
            from_eye.y *= scale;
            let [x, y, w] = view.clip_rows().map(|row| row.dot(from_eye));
            let back = [(x / w + 1.0) * 50.0, (1.0 - y / w) * 40.0];
            assert!(
                (0..2).all(|k| (back[k] - pixel[k]).abs() < 1e-6),
                "seed {seed}: {pixel:?} {back:?}"
            );
            assert!((w - hit.along).abs() < 1e-9 * w && (from_eye.length() - hit.distance_m).abs() < 1e-6);
            let height = s0.height_at(hit.point.x, hit.point.z).unwrap().unwrap();
            assert!((height - hit.point.y).abs() < 1e-6, "seed {seed}");
        }
        assert!(hits > 20, "seed {seed}, scale {scale}: {hits}");
    }
    // Flattened, terrain is seen edge on: nothing is there to pick.
    let flat = S0::new(&pyramid).with_vertical_scale(0.0);
    let view = View::new(camera(DVec3::new(200.0, 1300.0, 200.0)), [100, 80]).unwrap();
    assert_eq!(flat.pick(&view, [50.0, 70.0]).unwrap(), None);
    // An eye a hair above the ground, looking down: what is nearer than the near plane is not drawn.
    let ground = flat.height_at(200.0, 200.0).unwrap().unwrap();
    let near_m = near_m(pyramid.grid());
    for (above, found) in [(0.5, false), (2.0, true)] {
        let mut camera = camera(DVec3::new(200.0, ground + above * near_m, 200.0));
        camera.pitch_deg = -90.0;
        let view = View::new(camera, [2, 2]).unwrap();
        assert_eq!(
            S0::new(&pyramid).pick(&view, [1.0, 1.0]).unwrap().is_some(),
            found
        );
    }
}

/// Levels of which something is missing or cannot be read.
struct Faulty {
    levels: Pyramid,
    heights: fn() -> clipscape::Result<Arrival>,
    bounds: Arrival,
}

impl Levels for Faulty {
    fn grid(&self) -> &Grid {
        self.levels.grid()
    }
    fn heights(&self, level: u32, rect: Rect, out: &mut [f32]) -> clipscape::Result<Arrival> {
        let _ = self.levels.heights(level, rect, out)?;
        (self.heights)()
    }
    fn bounds(&self, level: u32, patches: Rect, out: &mut [Bounds]) -> clipscape::Result<Arrival> {
        let _ = self.levels.bounds(level, patches, out)?;
        Ok(self.bounds)
    }
    fn has_light(&self) -> bool {
        false
    }
    fn light(&self, _: u32, _: Rect, _: &mut [LightSample]) -> clipscape::Result<Arrival> {
        Ok(Arrival::Missing)
    }
}

#[test]
fn what_is_missing_damaged_or_senseless_is_a_typed_error() {
    let make = |heights, bounds| Faulty {
        levels: pyramid(rough_grid(), |i, j| hills(0, i, j)),
        heights,
        bounds,
    };
    let down =
        |levels: &dyn Levels| S0::new(levels).ray(DVec3::new(100.0, 1e4, 100.0), DVec3::new(0.01, -1.0, 0.0));
    let broken = make(
        || Err(Error::new(ErrorKind::Broken, "tile", "damaged")),
        Arrival::Arrived,
    );
    assert_eq!(down(&broken).unwrap_err().kind(), ErrorKind::Broken);
    let missing = make(|| Ok(Arrival::Missing), Arrival::Arrived);
    assert_eq!(down(&missing).unwrap_err().kind(), ErrorKind::Unsupported);
    assert_eq!(
        S0::new(&missing).height_at(5.0, 5.0).unwrap_err().kind(),
        ErrorKind::Unsupported
    );
    // Bounds that are not known pass over nothing, and change nothing.
    let unbounded = make(|| Ok(Arrival::Arrived), Arrival::Missing);
    assert_eq!(down(&unbounded).unwrap(), down(&unbounded.levels).unwrap());
    assert!(down(&unbounded).unwrap().is_some());

    let s0 = S0::new(&unbounded);
    let at = DVec3::new(10.0, 10.0, 10.0);
    for (origin, direction) in [
        (at, DVec3::ZERO),
        (at, DVec3::new(f64::NAN, 1.0, 0.0)),
        (at, DVec3::new(f64::INFINITY, 1.0, 0.0)),
        (DVec3::new(f64::NAN, 0.0, 0.0), DVec3::X),
    ] {
        assert_eq!(s0.ray(origin, direction).unwrap_err().kind(), ErrorKind::Misuse);
    }
    assert_eq!(
        s0.height_at(f64::INFINITY, 0.0).unwrap_err().kind(),
        ErrorKind::Misuse
    );
    // Directions of any length lead the same way.
    let far =
        [1e-300, 1.0, 1e300].map(|s| s0.ray(DVec3::new(100.0, 1e4, 90.0), DVec3::new(0.01, -1.0, 0.0) * s));
    let far = far.map(|hit| hit.unwrap().unwrap());
    assert!(
        (far[0].distance_m - far[1].distance_m).abs() < 1e-6
            && (far[2].distance_m - far[1].distance_m).abs() < 1e-6
    );
    let never = Clipmap::new(&unbounded.levels, &small(64)).unwrap();
    assert_eq!(Drawn::new(&never).unwrap_err().kind(), ErrorKind::Misuse);
    // DEMs without area have no surface.
    for (w, h) in [(1, 1), (1, 9), (9, 1)] {
        let line = pyramid(Grid::new(w, h, [1.0, 1.0]), |_, _| 5.0);
        let s0 = S0::new(&line);
        assert_eq!(s0.height_at(0.0, 0.0).unwrap(), None);
        assert_eq!(s0.ray(DVec3::new(0.0, 9.0, 0.0), DVec3::NEG_Y).unwrap(), None);
        assert_eq!(
            s0.ray(DVec3::new(-3.0, 9.0, 0.0), DVec3::new(1.0, -1.0, 0.0))
                .unwrap(),
            None
        );
        let clipmap = clipmap(&line, DVec3::new(0.0, 9.0, 0.0), &small(64));
        let drawn = Drawn::new(&clipmap).unwrap();
        assert_eq!(
            drawn
                .ray(DVec3::new(-3.0, 9.0, 0.5), DVec3::new(1.0, -1.0, 0.0))
                .unwrap(),
            None
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

#[test]
fn colliders_hold_the_level_s_samples() {
    let pyramid = pyramid(rough_grid(), rough);
    let rect = Rect::new(3, 4, 20, 31);
    let made = collider(&pyramid, 1, rect).unwrap();
    assert_eq!((made.first_m, made.spacing_m), ([18.0, 40.0], [6.0, 10.0]));
    for ((i, j), height) in rect.cells().zip(&made.heights_m) {
        let want = f64::from(pyramid.level(1)[(j * 76 + i) as usize]) + 1000.25;
        assert!(
            *height == want || (height.is_nan() && want.is_nan()),
            "({i}, {j})"
        );
    }
    assert!(made.heights_m.iter().any(|h| h.is_nan()) && made.heights_m.iter().any(|h| !h.is_nan()));
    let kind = |level, rect| collider(&pyramid, level, rect).unwrap_err().kind();
    assert_eq!(kind(9, rect), ErrorKind::Misuse);
    assert_eq!(kind(1, Rect::new(0, 0, 77, 3)), ErrorKind::Misuse);
    assert_eq!(kind(0, Rect::EMPTY), ErrorKind::Misuse);
    let large = Formula::new(Grid::new(1 << 20, 1 << 20, [1.0, 1.0]), hills);
    let all = large.grid.size.rect();
    assert_eq!(collider(&large, 0, all).unwrap_err().kind(), ErrorKind::Limit);
}
