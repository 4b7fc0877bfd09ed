//! DEMs and cameras for tests over many frames.

use std::path::Path;

use clipscape::build::Threads;
use clipscape::camera::{Camera, View};
use clipscape::grid::Grid;
use clipscape::levels::Levels;
use clipscape::progress::Silent;
use clipscape::pyramid::{Filter, Pyramid};
use clipscape::query::{S0, Surface};
use clipscape::source::{Crop, OpenOptions};
use clipscape::stream::Terrain;
use glam::DVec3;

use super::{Random, hash};

/// A DEM to fly over.
pub struct Dem {
    pub name: &'static str,
    pub levels: Box<dyn Levels>,
    /// Whether it is of real ground.
    pub real: bool,
}

/// The number that an environment variable asks for.
pub fn count(variable: &str, default: usize) -> usize {
    let asked = std::env::var(variable).ok().and_then(|n| n.parse().ok());
    asked.unwrap_or(default)
}

/// A part of the Sierra Nevada around Mt Whitney, in degrees.
const SIERRA: Crop = Crop::Place {
    west: -119.0,
    north: 37.25,
    east: -118.0,
    south: 36.25,
};

/// White noise, the shipped DEM, and of those for development the ones that are there.
pub fn dems() -> Vec<Dem> {
    let mut dems = vec![Dem {
        name: "white noise",
        levels: Box::new(white_noise(true)),
        real: false,
    }];
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for (name, path, crop) in [
        ("Pyrenees", "data/N42E001.hgt", None),
        (
            "Mt Hood",
            "../shared/data/small/lf_elev_220_mt_hood_utm.tif",
            None,
        ),
        (
            "Sierra, 119 to 118 W, 36.25 to 37.25 N",
            "../shared/data/sierra",
            Some(SIERRA),
        ),
    ] {
        let path = root.join(path);
        if path.exists() && (cfg!(feature = "dem") || path.starts_with(root.join("data"))) {
            let options = OpenOptions {
                crop,
                ..Default::default()
            };
            dems.push(Dem {
                name,
                levels: Box::new(Terrain::open_with(&[path], &options, &Silent).unwrap()),
                real: true,
            });
        }
    }
    dems
}

/// White noise: each sample uniform in 0 to 9000 m; with voids, a tenth of it in blocks and some alone.
pub fn white_noise(voids: bool) -> Pyramid {
    let grid = Grid::new(1013, 1200, [30.0, 20.0]);
    let heights = grid.size.rect().cells().map(|(i, j)| {
        if voids && (hash(3, i / 13, j / 11) < 0.1 || hash(4, i, j) < 0.01) {
            f32::NAN
        } else {
            (9000.0 * hash(0, i, j)) as f32
        }
    });
    let threads = Threads::new(0).unwrap();
    let filter = Filter::default();
    let mut pyramid = Pyramid::new(grid, heights.collect(), None, &filter, &threads, &Silent).unwrap();
    pyramid.bound(&threads, &Silent).unwrap();
    pyramid
}

/// How far on the screen the point of a pixel's ray at `along` metres along the view axis lies from the DEM's own surface
/// over the same place, in pixels; none where that has a hole. Heights are drawn times `scale`.
pub fn error_px(truth: &S0<'_>, view: &View, scale: f64, pixel: [f64; 2], along: f64) -> Option<f64> {
    let place = |p: DVec3| {
        let drawn = (p - view.eye) * DVec3::new(1.0, scale, 1.0);
        let [x, y, w] = view.clip_rows().map(|row| row.dot(drawn));
        let half = view.size_px.map(|s| f64::from(s) / 2.0);
        (w > 0.0).then(|| [x / w * half[0], y / w * half[1]])
    };
    let p = view.eye + view.ray(pixel) * along * DVec3::new(1.0, 1.0 / scale, 1.0);
    let height_m = truth.height_at(p.x, p.z).unwrap()?;
    Some(match (place(p), place(DVec3::new(p.x, height_m, p.z))) {
        (Some(a), Some(b)) => (a[0] - b[0]).hypot(a[1] - b[1]),
        _ => f64::INFINITY,
    })
}

/// A camera: 30 % within 50 m of the ground, pitch from -90 to +10 degrees, all headings, over the DEM and a little off it.
pub fn camera(random: &mut Random, truth: &S0<'_>) -> Camera {
    let grid = truth.grid();
    let side = |axis: usize, samples: i64| grid.spacing_m[axis] * (samples - 1) as f64;
    let x = random.uniform(-0.05, 1.05) * side(0, grid.size.width);
    let z = random.uniform(-0.05, 1.05) * side(1, grid.size.height);
    let ground = truth.height_at(x, z).unwrap().unwrap_or(0.0);
    let above = if random.uniform(0.0, 1.0) < 0.3 {
        random.uniform(-50.0, 50.0)
    } else {
        50.0 * random.uniform(0.0, 6.0).exp()
    };
    Camera {
        eye: DVec3::new(x, ground + above, z),
        heading_deg: random.uniform(0.0, 360.0),
        pitch_deg: random.uniform(-90.0, 10.0),
        roll_deg: random.uniform(-180.0, 180.0) * random.pick(&[0.0, 0.0, 0.0, 1.0]),
        fov_deg: random.uniform(20.0, 100.0),
    }
}
