//! What the certificate says of each patch in metres, against the drawn surface at every sample of the DEM.
//!
//! The drawn surface and the DEM's own are both linear on the DEM's triangles but where alpha bends the former, so the
//! samples are where they stray most, or nearly. Terrains are rough, with and without voids, and end within cells.
#![allow(clippy::print_stdout, reason = "how tight the bound is")]

mod support;

use clipscape::Result;
use clipscape::camera::{Camera, View};
use clipscape::clipmap::{
    CORNERS, Clipmap, ClipmapOptions, Corners, Drawn, Terms, certified_patches, certify_by,
};
use clipscape::grid::{Grid, PATCH, Patch, Rect, Size};
use clipscape::levels::{Arrival, Bounds, Levels, LightSample};
use clipscape::progress::Silent;
use clipscape::pyramid::{Filter, Pyramid};
use clipscape::work::Serial;
use glam::DVec3;
use support::{Random, hash, seed};

fn noise(width: i64, height: i64, voids: f64) -> Pyramid {
    let grid = Grid::new(width, height, [10.0, 10.0]);
    let heights = grid.size.rect().cells().map(|(i, j)| {
        let void = hash(4, i / 5, j / 7) < voids || hash(5, i, j) < voids / 4.0;
        if void {
            f32::NAN
        } else {
            500.0 * hash(0, i, j) as f32
        }
    });
    let filter = Filter::default();
    let mut pyramid = Pyramid::new(grid, heights.collect(), None, &filter, &Serial, &Silent).unwrap();
    pyramid.bound(&Serial, &Silent).unwrap();
    pyramid
}

fn camera(x_m: f64, y_m: f64, z_m: f64) -> View {
    let camera = Camera {
        eye: DVec3::new(x_m, y_m, z_m),
        heading_deg: 0.0,
        pitch_deg: -30.0,
        roll_deg: 0.0,
        fov_deg: 60.0,
    };
    View::new(camera, [640, 360]).unwrap()
}

/// The most by which the triangles that are drawn of a patch stray from `truth`, level 0 of a DEM of `size`, at its samples.
fn strayed_m(corners: &Corners, patch: Patch, truth: &[f32], size: Size) -> f64 {
    let step = 1i64 << patch.level;
    let mut worst = 0.0f64;
    let cells = Rect::new(0, 0, PATCH, PATCH);
    for ((x, z), east) in cells.cells().flat_map(|cell| [(cell, false), (cell, true)]) {
        let at = |dx: i64, dz: i64| f64::from(corners[((z + dz) * CORNERS as i64 + x + dx) as usize]);
        let middle = if east { at(1, 0) } else { at(0, 1) };
        let (nw, se) = (at(0, 0), at(1, 1));
        if (nw + middle + se).is_nan() {
            continue; // a hole
        }
        for (u, v) in Rect::new(0, 0, step + 1, step + 1).cells() {
            let (i, j) = ((patch.a * PATCH + x) * step + u, (patch.b * PATCH + z) * step + v);
            if (u < v) == east && u != v || !size.rect().contains(i, j) {
                continue;
            }
            let [u, v] = [u, v].map(|s| s as f64 / step as f64);
            let height = (1.0 - u.max(v)) * nw + (u - v).abs() * middle + u.min(v) * se;
            worst = worst.max((height - f64::from(truth[(j * size.width + i) as usize])).abs());
        }
    }
    worst
}

/// How far each drawn patch strays, against what is certified of it by `terms`: the greatest share, and the patches that
/// stray further.
fn strays(levels: &dyn Levels, clipmap: &Clipmap, terms: Terms) -> (f64, usize, Vec<String>) {
    let size = levels.grid().size;
    let mut truth = vec![0.0; size.samples() as usize];
    assert_eq!(
        levels.heights(0, size.rect(), &mut truth).unwrap(),
        Arrival::Arrived
    );
    let drawn = Drawn::new(clipmap).unwrap();
    let (mut share, mut patches, mut further) = (0.0f64, 0, Vec::new());
    let mut greatest_px = 0.0f64;
    for certified in certified_patches(clipmap, terms).unwrap() {
        let patch = certified.patch;
        let px = certified.error_px.unwrap_or(f64::INFINITY);
        assert!(px <= certified.at_most_px * (1.0 + 1e-12), "{certified:?}");
        greatest_px = greatest_px.max(px);
        let corners = drawn.corners(patch).unwrap();
        let worst = strayed_m(corners, patch, &truth, size);
        let error_m = certified.error_m.unwrap();
        patches += 1;
        if worst > error_m {
            further.push(format!("{patch:?} strays {worst} of {error_m} m"));
        }
        if error_m > 0.0 {
            share = share.max(worst / error_m);
        }
    }
    // What is left out as allowing less than was found decides nothing.
    let whole = certify_by(clipmap, terms)
        .unwrap()
        .error_px
        .unwrap_or(f64::INFINITY);
    assert_eq!(whole, greatest_px);
    (share, patches, further)
}

#[test]
fn no_patch_strays_further_than_certified() {
    let seed = seed(41);
    let mut random = Random(seed);
    let terrains = [noise(300, 277, 0.0), noise(333, 250, 0.05), noise(257, 321, 0.3)];
    let (mut most, mut halved, mut patches) = (0.0f64, 0, 0);
    for k in 0..60 {
        let levels = &terrains[k % 3];
        let options = ClipmapOptions {
            clip_size: 64,
            transition: Some(random.pick(&[0, 1, 2, 6])),
            max_error_px: random.pick(&[None, Some(10.0), Some(100.0), Some(400.0)]),
            cull: false,
            ..Default::default()
        };
        let view = camera(
            random.uniform(-200.0, 3200.0),
            random.pick(&[300.0, 600.0, 2000.0]),
            random.uniform(-200.0, 3000.0),
        );
        let mut clipmap = Clipmap::new(levels, &options).unwrap();
        clipmap.update(levels, &view, 0.0).unwrap();
        let (share, count, further) = strays(levels, &clipmap, Terms::default());
        assert!(
            further.is_empty(),
            "seed {seed}, scene {k}: {options:?} {:?}: {further:?}",
            view.eye
        );
        (most, patches) = (most.max(share), patches + count);
        let half = Terms {
            errors: 0.5,
            ..Terms::default()
        };
        halved += strays(levels, &clipmap, half).2.len();
    }
    println!(
        "{patches} patches stray at most {most:.3} of what is certified; halved, {halved} stray further"
    );
    assert!(patches > 5_000 && most > 0.9 && halved > 500);
}

/// Columns of which the drawn surface leaves the span of its two levels: level 1 errs by 1 m one way at a vertex and the
/// other way beside it, and level 2 is above it at one vertex and below at the next. The pattern repeats every 8 columns.
struct Teeth(Grid);

impl Teeth {
    const TRUTH: [f32; 8] = [1.0, -1.0, -1.0, -3.25, -5.5, -3.5, -1.5, 0.0];
    const LEVEL_1: [f32; 4] = [0.0, 0.0, -5.0, -1.0];
    const LEVEL_2: [f32; 2] = [2.0, -6.0];
}

impl Levels for Teeth {
    fn grid(&self) -> &Grid {
        &self.0
    }

    fn heights(&self, level: u32, rect: Rect, out: &mut [f32]) -> Result<Arrival> {
        for ((i, _), out) in rect.cells().zip(out) {
            let column = |count: usize| (i as usize) % count;
            *out = match level {
                0 => Self::TRUTH[column(8)],
                1 => Self::LEVEL_1[column(4)],
                2 => Self::LEVEL_2[column(2)],
                _ => 2.0,
            };
        }
        Ok(Arrival::Arrived)
    }

    fn bounds(&self, level: u32, _: Rect, out: &mut [Bounds]) -> Result<Arrival> {
        // Levels 1 and 2 are nowhere off by more than 1 m.
        let error = [0.0, 1.0, 1.0].get(level as usize).copied().unwrap_or(8.0);
        out.fill(Bounds {
            min: -6.0,
            max: 2.0,
            error,
            need_min: -6.0,
            need_max: 2.0,
            need_error: 8.0,
        });
        Ok(Arrival::Arrived)
    }

    fn has_light(&self) -> bool {
        false
    }

    fn light(&self, _: u32, _: Rect, _: &mut [LightSample]) -> Result<Arrival> {
        Ok(Arrival::Missing)
    }
}

#[test]
fn the_covariance_of_alpha_and_step_counts() {
    // Both levels are within 1 m of the truth, all along the pattern.
    for x in 0..8 {
        let mean = |level: &[f32], step: usize| {
            let (k, t) = (x / step, (x % step) as f32 / step as f32);
            level[k] + t * (level[(k + 1) % level.len()] - level[k])
        };
        for surface in [mean(&Teeth::LEVEL_1, 2), mean(&Teeth::LEVEL_2, 4)] {
            assert!((surface - Teeth::TRUTH[x]).abs() <= 1.0, "column {x}: {surface}");
        }
    }
    let levels = Teeth(Grid::new(513, 513, [10.0, 10.0]));
    let options = ClipmapOptions {
        clip_size: 64,
        transition: Some(1),
        cull: false,
        ..Default::default()
    };
    let mut clipmap = Clipmap::new(&levels, &options).unwrap();
    // So that a patch of level 1 ends to the west where alpha is 1/2: 29.5 of its steps from the eye.
    let view = camera((128.0 + 2.0 * 29.5) * 10.0, 20.0, 2560.0);
    clipmap.update(&levels, &view, 0.0).unwrap();
    let (share, _, further) = strays(&levels, &clipmap, Terms::default());
    assert!(further.is_empty() && share > 0.95, "{share}: {further:?}");
    let without = Terms {
        covariance: false,
        ..Terms::default()
    };
    let (_, _, further) = strays(&levels, &clipmap, without);
    assert!(
        !further.is_empty(),
        "control: without the covariance it does not hold"
    );
}
