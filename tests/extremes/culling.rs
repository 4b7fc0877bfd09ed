//! Culling changes no bit of a picture, whatever the camera.

use clipscape::Result;
use clipscape::camera::Camera;
use clipscape::clipmap::ClipmapOptions;
use clipscape::grid::{Grid, Rect};
use clipscape::levels::{Arrival, Bounds, Levels, LightSample};
use clipscape::pyramid::Pyramid;
use glam::DVec3;

use crate::draw::{frame, headless, options};
use crate::harness::{pyramid, rough};
use crate::support::{Random, gpu, hash, seed};

/// A pyramid whose bounds say less than is there: every patch as flat as its middle.
struct Flattered(Pyramid);

impl Levels for Flattered {
    fn grid(&self) -> &Grid {
        self.0.grid()
    }

    fn heights(&self, level: u32, rect: Rect, out: &mut [f32]) -> Result<Arrival> {
        self.0.heights(level, rect, out)
    }

    fn bounds(&self, level: u32, patches: Rect, out: &mut [Bounds]) -> Result<Arrival> {
        let arrival = self.0.bounds(level, patches, out)?;
        for bounds in out {
            let middle = 0.5 * bounds.min + 0.5 * bounds.max;
            (bounds.min, bounds.max) = (middle, middle);
        }
        Ok(arrival)
    }

    fn has_light(&self) -> bool {
        false
    }

    fn light(&self, level: u32, rect: Rect, out: &mut [LightSample]) -> Result<Arrival> {
        self.0.light(level, rect, out)
    }
}

/// The design's random cameras: 30 % within 50 m of the ground, pitch from -90 to 10, all headings.
fn random_camera(random: &mut Random, grid: &Grid) -> Camera {
    let side = |axis: usize, samples: i64| grid.spacing_m[axis] * samples as f64;
    let low = random.uniform(0.0, 1.0) < 0.3;
    let (roll, fov) = (random.uniform(-180.0, 180.0), random.uniform(1.0, 170.0));
    Camera {
        eye: DVec3::new(
            random.uniform(-0.1, 1.1) * side(0, grid.size.width),
            if low {
                random.uniform(-150.0, 250.0)
            } else {
                random.uniform(250.0, 5000.0)
            },
            random.uniform(-0.1, 1.1) * side(1, grid.size.height),
        ),
        heading_deg: random.uniform(0.0, 360.0),
        pitch_deg: random.uniform(-90.0, 10.0),
        roll_deg: random.pick(&[0.0, 0.0, roll]),
        fov_deg: random.pick(&[60.0, 60.0, fov, 0.1]),
    }
}

/// Pixels that culling changes over `count` random cameras, and pixels of terrain.
fn changed(
    levels: &dyn Levels,
    clipmap: ClipmapOptions,
    count: usize,
    random: &mut Random,
) -> (usize, usize) {
    let gpu = gpu().expect("asked for before");
    let draw = |cull| {
        let mut options = options([64, 48]);
        options.clipmap = ClipmapOptions { cull, ..clipmap };
        headless(&gpu, levels, &options)
    };
    let (mut culled, mut all) = (draw(true), draw(false));
    let (mut changed, mut terrain) = (0, 0);
    for _ in 0..count {
        let camera = random_camera(random, levels.grid());
        let whole = frame(&mut all, levels, &camera);
        changed += frame(&mut culled, levels, &camera).differing(&whole);
        terrain += whole.terrain_pixels();
    }
    (changed, terrain)
}

#[test]
fn random_cameras_see_the_same_with_and_without_culling() {
    if gpu().is_none() {
        return;
    }
    let seed = seed(21);
    let mut random = Random(seed);
    let hills = pyramid(Grid::new(700, 500, [9.0, 11.0]), rough);
    let noise = pyramid(Grid::new(333, 600, [20.0, 20.0]), |i, j| {
        9000.0 * hash(2, i, j) as f32
    });
    let gaps = pyramid(Grid::new(600, 700, [10.0, 8.0]), |i, j| {
        if hash(6, i / 8, j / 11) < 0.05 {
            f32::NAN
        } else {
            rough(i, j)
        }
    });
    for vertical_scale in [1.0, -2.0, 1000.0, 0.0] {
        for (name, levels) in [("hills", &hills), ("noise", &noise), ("gaps", &gaps)] {
            let clipmap = ClipmapOptions {
                clip_size: random.pick(&[64, 128]),
                vertical_scale,
                transition: random.pick(&[Some(0), None, Some(6)]),
                ..Default::default()
            };
            let (changed, terrain) = changed(levels, clipmap, 25, &mut random);
            assert_eq!(changed, 0, "seed {seed}: {name} with {clipmap:?}");
            assert!(terrain > 2000 || vertical_scale == 0.0, "{terrain} pixels");
        }
    }
    // Control: bounds that say less than is there are caught.
    let clipmap = ClipmapOptions {
        clip_size: 64,
        ..Default::default()
    };
    let (changed, _) = changed(&Flattered(noise), clipmap, 25, &mut random);
    assert!(
        changed > 20,
        "seed {seed}: only {changed} pixels tell of wrong bounds"
    );
}
