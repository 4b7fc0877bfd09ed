//! What the tests of streaming share: a terrain file, a flight over it, and what a window may hold.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use clipscape::build::{PreprocessOptions, preprocess};
use clipscape::camera::{Camera, View};
use clipscape::clipmap::Clipmap;
use clipscape::grid::{Grid, Rect};
use clipscape::levels::Levels;
use clipscape::light::LightOptions;
use clipscape::progress::Silent;
use clipscape::source::{Description, HeightSource, Synth};
use clipscape::stream::Arriving;
use glam::DVec3;

use super::{Random, hash};

/// Ground of which half is noise whose bits no compression shrinks: tiles of it are stored as they are.
pub struct Rough(Description);

impl Rough {
    pub fn new(width: i64, height: i64) -> Self {
        let synth = Synth::new(2, 1).unwrap();
        let mut description = HeightSource::description(&synth).clone();
        description.grid = Grid::new(width, height, [30.0, 20.0]);
        description.name = "rough".into();
        Self(description)
    }
}

impl HeightSource for Rough {
    fn description(&self) -> &Description {
        &self.0
    }

    fn read(&self, rect: Rect, out: &mut [f32]) -> clipscape::Result<()> {
        for ((i, j), out) in rect.cells().zip(out) {
            // All bits are noise, but for exponents above that of 2^100.
            let bits = (hash(0, i, j) * f64::from(u32::MAX)) as u32;
            let noise = f32::from_bits(if bits >> 23 & 0xFF > 226 {
                bits & !0x4000_0000
            } else {
                bits
            });
            *out = if i < self.0.grid.size.width / 2 {
                noise
            } else {
                super::hills(0, i, j)
            };
        }
        Ok(())
    }
}

/// Makes the terrain file `path` of `source`, with light.
pub fn make_file(source: &dyn HeightSource, path: &Path) {
    let options = PreprocessOptions {
        memory_bytes: 4 << 30,
        light: Some(LightOptions {
            sky_directions: 0,
            ..Default::default()
        }),
        ..Default::default()
    };
    preprocess(source, path, &options, &Silent).unwrap();
}

/// A view of the ground around, from `eye`.
pub fn view(eye: DVec3) -> View {
    let camera = Camera {
        eye,
        heading_deg: 30.0,
        pitch_deg: -30.0,
        roll_deg: 0.0,
        fov_deg: 60.0,
    };
    View::new(camera, [64, 64]).unwrap()
}

/// A flight that turns now and then, and is somewhere else all of a sudden once in a while.
pub struct Wander {
    pub random: Random,
    pub size_m: [f64; 2],
    pub eye: DVec3,
    pub speed_m: f64,
    pub teleports: f64,
    velocity: DVec3,
    frame: u64,
}

impl Wander {
    pub fn new(seed: u64, grid: &Grid, speed_m: f64, teleports: f64) -> Self {
        let size_m = [
            grid.size.width as f64 * grid.spacing_m[0],
            grid.size.height as f64 * grid.spacing_m[1],
        ];
        Self {
            random: Random(seed),
            size_m,
            eye: DVec3::new(0.5 * size_m[0], 1200.0, 0.5 * size_m[1]),
            speed_m,
            teleports,
            velocity: DVec3::ZERO,
            frame: 0,
        }
    }

    pub fn step(&mut self) -> DVec3 {
        if self.frame.is_multiple_of(30) {
            let heading = self.random.uniform(0.0, std::f64::consts::TAU);
            self.velocity = self.speed_m * DVec3::new(heading.cos(), 0.0, heading.sin());
        }
        self.frame += 1;
        self.eye += self.velocity;
        let teleports = self.random.uniform(0.0, 1.0) < self.teleports;
        for (axis, size) in [(0, self.size_m[0]), (2, self.size_m[1])] {
            if teleports || self.eye[axis] < 0.0 || self.eye[axis] > size {
                self.eye[axis] = self.random.uniform(0.0, size);
            }
        }
        if teleports {
            self.eye.y = self.random.uniform(1000.0, 3000.0);
        }
        self.eye
    }
}

/// Samples that have arrived and are not what `truth` says: height, bits and all.
pub fn garbage(clipmap: &Clipmap, truth: &dyn Levels) -> usize {
    let mut count = 0;
    for window in clipmap.windows() {
        for rect in window.arrived() {
            let mut want = vec![0f32; rect.area() as usize];
            let _ = truth.heights(window.level(), rect, &mut want).unwrap();
            let got = rect.cells().map(|(i, j)| window.height(i, j).unwrap());
            count += want
                .iter()
                .zip(got)
                .filter(|(want, got)| want.to_bits() != got.to_bits() && !(want.is_nan() && got.is_nan()))
                .count();
        }
    }
    count
}

/// Waits until what was wanted is here, or known to be out of reach.
pub fn settle(arriving: &Arriving) {
    for _ in 0..60_000 {
        if arriving.is_idle() {
            return;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    panic!("nothing more arrives, and it is not idle");
}

/// The bytes of a file, as a source of bytes.
pub fn bytes_of(path: &Path) -> Arc<Vec<u8>> {
    Arc::new(std::fs::read(path).unwrap())
}
