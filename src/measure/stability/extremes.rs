//! The design's extremes, group by group: pictures that must not depend on culling or on what was drawn before, and whose
//! depths must be numbers.

use glam::DVec3;

use super::Comparison;
use super::ground::{hash, pyramid, rough};
use super::pictures::{Picture, differing, options, pictures};
use crate::camera::Camera;
use crate::clipmap::{ClipmapOptions, Ring};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::grid::Grid;
use crate::levels::Levels;
use crate::render::HeadlessOptions;

/// What was found of a group.
#[derive(Default)]
struct Found {
    wrong: usize,
    pictures: usize,
    terrain: usize,
}

impl Found {
    /// Adds what `cameras` see of `levels`: drawn with culling, without, and the last by a clipmap made for it.
    fn add(
        &mut self,
        gpu: &Gpu,
        levels: &dyn Levels,
        options: &HeadlessOptions,
        cameras: &[Camera],
    ) -> Result<()> {
        let with = |cull| HeadlessOptions {
            clipmap: ClipmapOptions {
                cull,
                ..options.clipmap
            },
            ..*options
        };
        let drawn: Vec<Picture> = pictures(gpu, levels, &with(true), cameras)?;
        self.wrong += differing(&drawn, &pictures(gpu, levels, &with(false), cameras)?);
        let last = cameras.len() - 1;
        let fresh = pictures(gpu, levels, &with(true), &cameras[last..])?;
        self.wrong += differing(&fresh, &drawn[last..]);
        for picture in &drawn {
            self.wrong += picture.1.iter().filter(|d| !(0.0..=1.0).contains(*d)).count();
            self.terrain += picture.1.iter().filter(|d| **d > 0.0).count();
        }
        self.pictures += cameras.len();
        Ok(())
    }

    fn line(self, what: &str) -> Comparison {
        let compared = format!(
            "pixels of {} pictures ({} of terrain) that culling or what was drawn before changes, or whose depth is no \
             number in 0 to 1",
            self.pictures, self.terrain
        );
        Comparison::new(what, compared, self.wrong as f64, 0.0, "px")
    }
}

fn camera(eye: [f64; 3], heading_deg: f64, pitch_deg: f64) -> Camera {
    Camera {
        eye: DVec3::from_array(eye),
        heading_deg,
        pitch_deg,
        roll_deg: 0.0,
        fov_deg: 60.0,
    }
}

/// Over, among and straight above ground of `side_m` whose heights reach from `low_m` to `high_m`.
fn around(side_m: [f64; 2], low_m: f64, high_m: f64) -> [Camera; 3] {
    let relief_m = (high_m - low_m).max(0.02 * side_m[0].max(side_m[1]));
    let at = |up_m: f64, heading, pitch| camera([0.51 * side_m[0], up_m, 0.53 * side_m[1]], heading, pitch);
    [
        at(high_m + 0.3 * relief_m, 200.0, -35.0),
        at((low_m + high_m) / 2.0, 100.0, 0.0),
        at(high_m + 2.0 * relief_m, 0.0, -90.0),
    ]
}

/// Extreme heights.
pub(super) fn heights(gpu: &Gpu) -> Result<Comparison> {
    type Field = (fn(i64, i64) -> f32, [f64; 2]);
    let fields: [Field; 8] = [
        (|_, _| 500.0, [500.0, 500.0]),
        (|i, j| if hash(10, i, j) < 0.5 { -9e6 } else { 9e6 }, [-9e6, 9e6]),
        (|i, j| 1e30 * hash(11, i, j) as f32, [0.0, 1e30]),
        (
            |i, j| if (i, j) == (152, 96) { 9000.0 } else { 0.0 },
            [0.0, 100.0],
        ),
        (|_, _| f32::NAN, [0.0, 100.0]),
        (
            |i, j| if (i + j) & 1 == 0 { rough(i, j) } else { f32::NAN },
            [-400.0, 460.0],
        ),
        (
            |i, j| if (i, j) == (152, 96) { 700.0 } else { f32::NAN },
            [0.0, 700.0],
        ),
        (
            |i, j| {
                if hash(12, i, j) < 0.02 {
                    f32::INFINITY
                } else {
                    rough(i, j)
                }
            },
            [-400.0, 460.0],
        ),
    ];
    let mut found = Found::default();
    for (height, [low_m, high_m]) in fields {
        let levels = pyramid(Grid::new(301, 220, [30.0; 2]), height)?;
        found.add(
            gpu,
            &levels,
            &options(true, true),
            &around([9000.0, 6570.0], low_m, high_m),
        )?;
    }
    Ok(found.line("heights: equal, +-9e6, 1e30, a spike, void, a void checkerboard, one sample, infinities"))
}

/// Sizes that are no multiple of anything, and spacings of 1e-3 m, 1e6 m and 1 : 1000.
pub(super) fn sizes(gpu: &Gpu) -> Result<Comparison> {
    let mut found = Found::default();
    let sizes = [
        (1, 1),
        (1, 90),
        (2, 2),
        (3, 3),
        (64, 64),
        (65, 65),
        (31, 130),
        (1000, 13),
        (1013, 7),
        (13_201, 3),
    ];
    let spaced = sizes.map(|size| (size, [10.0, 12.5]));
    let spacings = [[1e-3; 2], [1e6; 2], [1.0, 1000.0]].map(|spacing| ((301, 220), spacing));
    for ((width, height), spacing_m) in spaced.into_iter().chain(spacings) {
        let grid = Grid::new(width, height, spacing_m);
        // Relief in proportion to the smaller spacing.
        let unit = spacing_m[0].min(spacing_m[1]) / 10.0;
        let levels = pyramid(grid, |i, j| (f64::from(rough(i, j)) * unit) as f32)?;
        let side_m = [width as f64 * spacing_m[0], height as f64 * spacing_m[1]];
        found.add(
            gpu,
            &levels,
            &options(true, true),
            &around(side_m, -400.0 * unit, 460.0 * unit),
        )?;
    }
    Ok(found.line("sizes from 1 x 1 to 13201 x 3; spacing 1e-3 m, 1e6 m, 1 : 1000"))
}

const SPACING_M: [f64; 2] = [10.0, 12.5];

fn terrain() -> Result<crate::pyramid::Pyramid> {
    pyramid(Grid::new(400, 333, SPACING_M), rough)
}

/// The eye on a sample, an edge, the surface, below it, very high, far outside.
pub(super) fn eyes(gpu: &Gpu) -> Result<Comparison> {
    let levels = terrain()?;
    let ground_m = f64::from(rough(160, 128));
    let ground_m = if ground_m.is_nan() { 0.0 } else { ground_m };
    let places = [
        [160.0, ground_m + 40.0, 128.0],
        [160.5, ground_m + 40.0, 128.5],
        [160.0, ground_m, 128.0],
        [160.0, ground_m - 5000.0, 128.0],
        [399.0, 500.0, 332.0],
        [200.0, 1e9, 150.0],
        [8e6, 300.0, 150.0],
        [-1e15, 300.0, -1e15],
    ];
    let cameras: Vec<Camera> = places
        .into_iter()
        .flat_map(|[x, y, z]| {
            let eye = [x * SPACING_M[0], y, z * SPACING_M[1]];
            [(0.0, -90.0), (45.0, -20.0), (270.0, 90.0)].map(|(heading, pitch)| camera(eye, heading, pitch))
        })
        .collect();
    let mut found = Found::default();
    found.add(gpu, &levels, &options(true, true), &cameras)?;
    Ok(found.line("the eye on a sample, an edge, the ground, below it, 1e9 m up, 1e16 m away"))
}

/// Fields of view of 0.01 and 179 degrees, rolls, pictures of 1 x 1 and 2048 x 4.
pub(super) fn views(gpu: &Gpu) -> Result<Comparison> {
    let levels = terrain()?;
    let mut found = Found::default();
    for size_px in [[1, 1], [96, 64], [2048, 4]] {
        let cameras = [0.01, 60.0, 179.0].map(|fov_deg| Camera {
            fov_deg,
            roll_deg: 33.0,
            ..camera([1610.0, 700.0, 1700.0], 215.0, -30.0)
        });
        let options = HeadlessOptions {
            size_px,
            ..options(true, true)
        };
        found.add(gpu, &levels, &options, &cameras)?;
    }
    Ok(found.line("fields of view of 0.01 and 179 degrees, roll, 1 x 1 and 2048 x 4 pixels"))
}

/// Clip sizes, levels, transitions, vertical scales, and the dial at their ends.
pub(super) fn parameters(gpu: &Gpu) -> Result<Comparison> {
    let levels = terrain()?;
    let base = options(true, true);
    let with = |change: &dyn Fn(&mut ClipmapOptions)| {
        let mut options = base;
        change(&mut options.clipmap);
        options
    };
    let all = [
        with(&|o| o.clip_size = 1024),
        with(&|o| o.levels = Some(1)),
        with(&|o| o.transition = Some(0)),
        with(&|o| o.transition = Some(Ring::transition_limit(64))),
        with(&|o| o.vertical_scale = 0.0),
        with(&|o| o.vertical_scale = 1000.0),
        with(&|o| o.vertical_scale = -2.0),
        with(&|o| o.max_error_px = Some(0.01)),
        with(&|o| o.max_error_px = Some(100.0)),
    ];
    let mut found = Found::default();
    for options in all {
        found.add(gpu, &levels, &options, &around([4000.0, 4160.0], -400.0, 460.0))?;
    }
    Ok(found.line(
        "clip size 1024, one level, transition 0 and its limit, vertical scale 0, 1000, -2, the dial at 0.01 and 100 px",
    ))
}

/// A thousandth of a sample a frame across a level's snap, a climb, a turn on the spot.
pub(super) fn motion(gpu: &Gpu) -> Result<Comparison> {
    let levels = terrain()?;
    let [mut creeping, mut climbing, mut turning] = [const { Vec::new() }; 3];
    for k in 0..6 {
        let creep = 159.998 + 0.001 * f64::from(k);
        creeping.push(camera([creep * SPACING_M[0], 600.0, 1700.0], 40.0, -30.0));
    }
    for k in 0..6 {
        climbing.push(camera([1610.0, 500.0 * 1.6f64.powi(k), 1700.0], 40.0, -60.0));
    }
    for k in 0..6 {
        turning.push(camera([1610.0, 600.0, 1700.0], 61.0 * f64::from(k), -15.0));
    }
    let mut found = Found::default();
    for cameras in [creeping, climbing, turning] {
        found.add(gpu, &levels, &options(true, true), &cameras)?;
    }
    Ok(found.line("creeping across a snap by 1/1000 sample a frame, climbing, turning on the spot"))
}
