//! DEMs and cameras for tests over many frames.

use std::path::Path;

use clipscape::build::Threads;
use clipscape::camera::Camera;
use clipscape::grid::Grid;
use clipscape::levels::Levels;
use clipscape::progress::Silent;
use clipscape::pyramid::{Filter, Pyramid};
use clipscape::query::{S0, Surface};
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

/// White noise, the shipped DEM, and of those for development the ones that are there.
pub fn dems() -> Vec<Dem> {
    let mut dems = vec![Dem {
        name: "white noise",
        levels: Box::new(white_noise(true)),
        real: false,
    }];
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for (name, path) in [
        ("Pyrenees", "data/N42E001.hgt"),
        ("Mt Hood", "../shared/data/small/lf_elev_220_mt_hood_utm.tif"),
    ] {
        let path = root.join(path);
        if path.exists() && (cfg!(feature = "dem") || path.extension().is_some_and(|e| e == "hgt")) {
            dems.push(Dem {
                name,
                levels: Box::new(Terrain::open(path, &Silent).unwrap()),
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
