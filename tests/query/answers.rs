//! What else is answered: facets, picks, colliders, and what is missing or senseless.

use clipscape::accuracy::Facet;
use clipscape::camera::{Camera, View};
use clipscape::clipmap::{Clipmap, Drawn, near_m};
use clipscape::error::{Error, ErrorKind};
use clipscape::grid::{Grid, Rect};
use clipscape::levels::{Arrival, Bounds, Levels, LightSample};
use clipscape::pyramid::Pyramid;
use clipscape::query::{Picker, S0, Surface, collider};
use glam::DVec3;

use crate::support::{Formula, Random, hills, seed};
use crate::surfaces::{pyramid, rough, rough_grid, small};
use crate::{camera, clipmap};

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
