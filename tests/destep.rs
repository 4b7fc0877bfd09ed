//! De-stepping a DEM of whole metres whose unrounded heights are known: how near it comes to them, in height, slope and
//! light; and that a terrain file of it is the same for any ceiling and any threads, and says so. `--nocapture` prints the
//! figures.
#![allow(clippy::print_stderr, reason = "says what it found")]

use std::path::Path;
use std::sync::Arc;

use clipscape::build::{PreprocessOptions, preprocess};
use clipscape::error::Result;
use clipscape::grid::{Grid, Rect};
use clipscape::levels::Levels;
use clipscape::progress::Silent;
use clipscape::source::{Description, Destepped, HeightSource, open};
use clipscape::terrain::TerrainFile;

/// Samples of the smooth ground between two of the DEM that it is made of.
const FINER: i64 = 3;

/// Heights in memory.
struct Dem {
    description: Description,
    heights: Vec<f32>,
}

impl HeightSource for Dem {
    fn description(&self) -> &Description {
        &self.description
    }

    fn read(&self, rect: Rect, out: &mut [f32]) -> Result<()> {
        let width = self.description.grid.size.width;
        for ((x, z), out) in rect.cells().zip(out) {
            *out = self.heights[(z * width + x) as usize];
        }
        Ok(())
    }
}

/// Weights of the uniform cubic B-spline at `t` of 0 to 1.
fn spline(t: f64) -> [f64; 4] {
    let s = 1.0 - t;
    [
        s * s * s / 6.0,
        (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0,
        (-3.0 * t * t * t + 3.0 * t * t + 3.0 * t + 1.0) / 6.0,
        t * t * t / 6.0,
    ]
}

/// Smooth ground 30 m apart, as a cubic B-spline over `part` of the DEM at `path`, and the DEM of its whole metres.
fn smooth_and_rounded(path: &Path, part: Rect) -> (Vec<f64>, Dem) {
    let source = open(path).unwrap();
    let mut coarse = vec![0.0; part.area() as usize];
    source.read(part, &mut coarse).unwrap();
    assert!(coarse.iter().all(|h| !h.is_nan()), "the part has no voids");
    let (width, height) = (FINER * (part.width() - 3), FINER * (part.height() - 3));
    let grid = Grid::new(width, height, [30.0, 30.0]);
    let weights: Vec<[f64; 4]> = (0..FINER).map(|n| spline(n as f64 / FINER as f64)).collect();
    let truth: Vec<f64> = grid
        .size
        .rect()
        .cells()
        .map(|(x, z)| {
            let mut sum = 0.0;
            for (j, wz) in (0..).zip(weights[(z % FINER) as usize]) {
                for (i, wx) in (0..).zip(weights[(x % FINER) as usize]) {
                    let at = (z / FINER + j) * part.width() + x / FINER + i;
                    sum += wz * wx * f64::from(coarse[at as usize]);
                }
            }
            sum
        })
        .collect();
    let description = Description {
        grid,
        step_m: Some(1.0),
        place: None,
        name: "smooth".into(),
        ..source.description().clone()
    };
    let heights = truth.iter().map(|h| h.round() as f32).collect();
    (truth, Dem { description, heights })
}

/// RMS over all inner samples of: the difference of heights in metres, the angle between normals in degrees, the
/// difference of the light of a sun 10 degrees high in the north-west.
fn errors(grid: &Grid, heights: &[f32], truth: &[f64]) -> [f64; 3] {
    let width = grid.size.width;
    let [dx, dz] = grid.spacing_m;
    let normal = |at: &dyn Fn(i64, i64) -> f64, x: i64, z: i64| {
        let n = glam::DVec3::new(
            (at(x - 1, z) - at(x + 1, z)) / (2.0 * dx),
            1.0,
            (at(x, z - 1) - at(x, z + 1)) / (2.0 * dz),
        );
        n.normalize()
    };
    let (azimuth, altitude) = (315f64.to_radians(), 10f64.to_radians());
    let sun = glam::DVec3::new(
        azimuth.sin() * altitude.cos(),
        altitude.sin(),
        -azimuth.cos() * altitude.cos(),
    );
    let found = |x: i64, z: i64| f64::from(heights[(z * width + x) as usize]);
    let real = |x: i64, z: i64| truth[(z * width + x) as usize];
    let inner = grid.size.rect().grown(-1);
    let mut sums = [0.0; 3];
    for (x, z) in inner.cells() {
        let [a, b] = [normal(&found, x, z), normal(&real, x, z)];
        sums[0] += (found(x, z) - real(x, z)).powi(2);
        sums[1] += a.cross(b).length().asin().to_degrees().powi(2);
        sums[2] += (a.dot(sun).max(0.0) - b.dot(sun).max(0.0)).powi(2);
    }
    sums.map(|sum| (sum / inner.area() as f64).sqrt())
}

/// Asks of a DEM with known ground that de-stepping lowers all errors by the factors `least`, and says them.
fn nearer(path: &Path, part: Rect, least: [f64; 3]) {
    let (truth, dem) = smooth_and_rounded(path, part);
    let grid = dem.description.grid;
    let mut destepped = vec![0.0; dem.heights.len()];
    Destepped::new(&dem)
        .unwrap()
        .read(grid.size.rect(), &mut destepped)
        .unwrap();
    let moved = dem.heights.iter().zip(&destepped).map(|(a, b)| (a - b).abs());
    assert!(moved.fold(0.0, f32::max) <= 0.5);
    let before = errors(&grid, &dem.heights, &truth);
    let after = errors(&grid, &destepped, &truth);
    eprintln!(
        "{}: RMS of heights {:.3} to {:.3} m, of normals {:.3} to {:.3} degrees, of light {:.4} to {:.4}",
        path.display(),
        before[0],
        after[0],
        before[1],
        after[1],
        before[2],
        after[2]
    );
    for ((before, after), least) in before.into_iter().zip(after).zip(least) {
        assert!(before > least * after, "{before} to {after}");
    }
    // A control: heights that moved the wrong way are farther off.
    let wrong: Vec<f32> = dem
        .heights
        .iter()
        .zip(&destepped)
        .map(|(a, b)| 2.0 * a - b)
        .collect();
    let wrong = errors(&grid, &wrong, &truth);
    assert!(wrong.iter().zip(before).all(|(wrong, before)| *wrong > before));
}

#[test]
fn real_ground_comes_nearer_to_what_was_rounded() {
    let shipped = Path::new("data/N42E001.hgt");
    nearer(shipped, Rect::new(400, 700, 600, 900), [1.4, 1.5, 1.5]);
    for (name, part) in [
        ("N38W118", Rect::new(300, 300, 500, 500)),
        ("N37W121", Rect::new(300, 300, 500, 500)),
    ] {
        let packed = format!("../shared/data/sierra/{name}.hgt.zip");
        if cfg!(feature = "dem") && Path::new(&packed).exists() {
            nearer(Path::new(&packed), part, [1.5, 2.0, 2.0]);
        }
    }
}

#[test]
fn a_file_is_the_same_for_any_ceiling_and_threads_and_says_its_step() {
    let source = open(Path::new("data/N42E001.hgt")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let made = |name: &str, threads, memory_bytes, destep| {
        let out = folder.path().join(name);
        let options = PreprocessOptions {
            light: None,
            destep,
            threads,
            memory_bytes,
            ..PreprocessOptions::default()
        };
        preprocess(source.as_ref(), &out, &options, &Silent).unwrap();
        std::fs::read(out).unwrap()
    };
    let first = made("a.exr", 1, 90 << 20, true);
    for (threads, memory_bytes) in [(2, 90 << 20), (1, 4 << 30), (3, 4 << 30)] {
        let other = made(
            &format!("{threads}-{memory_bytes}.exr"),
            threads,
            memory_bytes,
            true,
        );
        assert!(first == other, "{threads} threads, {memory_bytes} bytes");
    }
    let file = TerrainFile::open("a", Arc::new(first)).unwrap();
    let meta = file.meta();
    assert_eq!(
        (meta.destep_m, meta.rounding_step_m),
        (Some(1.0), Some(1.0 / 16.0))
    );
    // Level 0 holds what the de-stepped source gives, within half a metre of the source.
    let size = file.grid().size;
    let [mut stored, mut given, mut raw] = [(); 3].map(|()| vec![0f32; size.samples() as usize]);
    let _ = file.heights(0, size.rect(), &mut stored).unwrap();
    source.read(size.rect(), &mut raw).unwrap();
    Destepped::new(source.as_ref())
        .unwrap()
        .read(size.rect(), &mut given)
        .unwrap();
    let mut moved = 0;
    for ((stored, given), raw) in stored.iter().zip(&given).zip(&raw) {
        assert!(stored == given || stored.is_nan() && given.is_nan());
        assert_eq!(stored.is_nan(), raw.is_nan());
        assert!(raw.is_nan() || (stored - raw).abs() <= 0.5);
        moved += usize::from((stored - raw).abs() > 0.0);
    }
    assert!(moved > 50_000, "{moved} moved");
    // A control: without it the file is another, and says nothing of it.
    let plain = made("plain.exr", 2, 4 << 30, false);
    let plain = TerrainFile::open("plain", Arc::new(plain)).unwrap();
    assert_eq!(plain.meta().destep_m, None);
    let _ = plain.heights(0, size.rect(), &mut stored).unwrap();
    assert!(stored.iter().zip(&raw).all(|(a, b)| a == b || a.is_nan()));
}
