//! Rays whose answers are known: planes, a spike, a cone, steps, far away.

use clipscape::clipmap::{Drawn, Place};
use clipscape::grid::{Grid, Patch, Rect};
use clipscape::query::{Reader, S0, Surface};
use glam::DVec3;

use crate::clipmap;
use crate::support::{Formula, Random, seed};
use crate::surfaces::{pyramid, small};

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
