//! Extreme heights: equal, near each other, huge, noise, spikes, voids, infinities.

use std::sync::Arc;

use clipscape::camera::{Camera, MAX_EYE_M, View};
use clipscape::clipmap::displace;
use clipscape::grid::{Grid, Rect};
use clipscape::levels::{Arrival, Levels};
use clipscape::progress::Silent;
use clipscape::stream::Terrain;
use glam::DVec3;

use crate::harness::{Subject, camera, pyramid, small, updated};
use crate::support::{Formula, hash, hills};

const SPACING_M: f64 = 30.0;

fn grid() -> Grid {
    Grid::new(301, 220, [SPACING_M; 2])
}

/// Cameras above, among and below heights from `low` to `high`.
fn cameras(low: f64, high: f64) -> Vec<Camera> {
    let relief = high - low;
    let at = |y: f64, heading, pitch| {
        let y = y.clamp(-MAX_EYE_M, MAX_EYE_M);
        camera(DVec3::new(4030.0, y, 3011.0), heading, pitch)
    };
    vec![
        at(high + 0.2 * relief + 400.0, 200.0, -35.0),
        at(high + 0.01 * relief + 15.0, 20.0, -5.0),
        at(high + relief + 5000.0, 0.0, -90.0),
        at((low + high) / 2.0, 100.0, 0.0),
        at(low - 0.1 * relief - 40.0, 300.0, 30.0),
    ]
}

/// Checks heights between `low` and `high`; the pixels of terrain that each camera saw, where there is an adapter.
fn check(what: &str, low: f64, high: f64, height: impl Fn(i64, i64) -> f32) -> Option<Vec<usize>> {
    let levels = pyramid(grid(), height);
    Subject::new(what, &levels).check(&cameras(low, high))
}

#[test]
fn equal_heights_stay_equal_on_every_level() {
    let drawn = check("all equal", 500.0, 500.0, |_, _| 500.0);
    assert!(drawn.is_none_or(|d| d[..3].iter().all(|pixels| *pixels > 300)));
    let height = |_, _| 12_345.678f32;
    let levels = pyramid(grid(), height);
    for camera in cameras(12_345.678, 12_345.678) {
        let view = View::new(camera, [48, 32]).unwrap();
        let clipmap = updated(&levels, &small(), &view);
        let mut vertices = 0;
        for instance in clipmap.selection().instances() {
            for k in 0..81 {
                let vertex = displace(&clipmap, instance, k % 9, k / 9);
                assert_eq!(vertex.height.to_bits(), 12_345.678f32.to_bits(), "{vertex:?}");
                vertices += 1;
            }
        }
        assert!(vertices > 1000);
    }
}

#[test]
fn heights_1e_30_apart() {
    check("1e-30 apart", 0.0, 1e-29, |i, j| {
        1e-30 * (10.0 * hash(0, i, j)).floor() as f32
    });
}

#[test]
fn heights_of_9e6_up_and_down() {
    check("9e6 up and down", -9e6, 9e6, |i, j| {
        if hash(0, i, j) < 0.5 { -9e6 } else { 9e6 }
    });
}

#[test]
fn heights_of_1e30() {
    check("1e30", 0.0, 1e30, |i, j| 1e30 * hash(0, i, j) as f32);
    check("1e30 up and down", -1e30, 1e30, |i, j| {
        if hash(0, i, j) < 0.5 { -1e30 } else { 1e30 }
    });
    // Seen from where a camera may well stand over the lowest of them.
    let levels = pyramid(grid(), |i, j| if hash(0, i, j) < 0.9 { 0.0 } else { 1e30 });
    Subject::new("towers of 1e30", &levels).check(&cameras(0.0, 100.0));
}

#[test]
fn white_noise() {
    let drawn = check("white noise", 0.0, 9000.0, |i, j| 9000.0 * hash(0, i, j) as f32);
    assert!(drawn.as_ref().is_none_or(|d| d[3] > 300), "{drawn:?}");
}

#[test]
fn one_spike() {
    let spike = |i, j| if (i, j) == (152, 96) { 9000.0 } else { 0.0 };
    let drawn = check("one spike", 0.0, 100.0, spike);
    assert!(drawn.is_none_or(|d| d[0] > 300));
}

#[test]
fn all_void_draws_nothing() {
    let drawn = check("all void", 0.0, 100.0, |_, _| f32::NAN);
    assert!(drawn.is_none_or(|d| d.iter().all(|pixels| *pixels == 0)));
}

#[test]
fn one_valid_sample_draws_nothing() {
    // It stands on every level, and no triangle has three valid corners.
    let lone = |i, j| if (i, j) == (152, 96) { 700.0 } else { f32::NAN };
    let drawn = check("one valid sample", 0.0, 700.0, lone);
    assert!(drawn.is_none_or(|d| d.iter().all(|pixels| *pixels == 0)));
    // Control: three more make a quad.
    let four = |i: i64, j: i64| match (i - 152, j - 96) {
        (0 | 1, 0 | 1) => 700.0,
        _ => f32::NAN,
    };
    let levels = pyramid(grid(), four);
    let above = camera(DVec3::new(152.5 * SPACING_M, 800.0, 96.5 * SPACING_M), 0.0, -90.0);
    let drawn = Subject::new("four valid samples", &levels).check(&[above]);
    assert!(drawn.is_none_or(|d| d[0] > 50));
}

#[test]
fn a_void_checkerboard() {
    // On level 0 no triangle has three valid corners. Where the even samples are void, so is every coarser level.
    let board = |odd: i64| {
        move |i: i64, j: i64| {
            if (i + j) & 1 == odd {
                hills(0, i, j)
            } else {
                f32::NAN
            }
        }
    };
    // A pixel may lie on the edge between two valid corners, within 2^-16 of a triangle: such are drawn.
    let drawn = check("a checkerboard without coarse samples", -200.0, 200.0, board(1));
    assert!(
        drawn.as_ref().is_none_or(|d| d.iter().all(|pixels| *pixels <= 3)),
        "{drawn:?}"
    );
    let drawn = check("a checkerboard with coarse samples", -200.0, 200.0, board(0));
    assert!(
        drawn.as_ref().is_none_or(|d| d.iter().sum::<usize>() > 300),
        "{drawn:?}"
    );
}

/// All heights of a level, as bits.
fn bits(levels: &dyn Levels, level: u32) -> Vec<u32> {
    let rect = levels.grid().level(level).rect();
    let mut heights = vec![0.0; rect.area() as usize];
    assert_eq!(
        levels.heights(level, rect, &mut heights).unwrap(),
        Arrival::Arrived
    );
    heights
        .iter()
        .map(|h| if h.is_nan() { 0 } else { h.to_bits() })
        .collect()
}

#[test]
fn infinite_heights_are_no_data() {
    let holed = |instead: [f32; 2]| {
        pyramid(grid(), move |i, j| match hash(5, i, j) {
            h if h < 0.01 => instead[0],
            h if h < 0.02 => instead[1],
            _ => hills(0, i, j),
        })
    };
    let infinite = holed([f32::INFINITY, f32::NEG_INFINITY]);
    let missing = holed([f32::NAN; 2]);
    for level in 0..infinite.level_count() {
        assert_eq!(bits(&infinite, level), bits(&missing, level), "level {level}");
        assert_eq!(
            infinite.level_bounds(level).len(),
            missing.level_bounds(level).len()
        );
    }
    Subject::new("infinities", &infinite).check(&cameras(-200.0, 200.0));
    // A source of the caller's own that lets infinities through is drawn no differently.
    let own = Formula::new(grid(), |_: u32, i: i64, j: i64| match hash(5, i, j) {
        h if h < 0.02 => f32::INFINITY,
        _ => hills(0, i, j),
    });
    Subject::new("infinities of the caller's own", &own).check(&cameras(-200.0, 200.0));
    // Control: as heights they would not be the same.
    let high = holed([f32::MAX, -1e38]);
    assert_ne!(bits(&high, 0), bits(&missing, 0));
}

/// An ESRI ASCII grid of `height(i, j)`.
fn ascii(size: [i64; 2], height: impl Fn(i64, i64) -> String) -> Vec<u8> {
    let [w, h] = size;
    let mut text = format!("ncols {w}\nnrows {h}\nxllcorner 0\nyllcorner 0\ncellsize {SPACING_M}\n");
    for (i, j) in Rect::new(0, 0, w, h).cells() {
        text += &height(i, j);
        text.push(if i + 1 == w { '\n' } else { ' ' });
    }
    text.into_bytes()
}

fn read(bytes: Vec<u8>) -> Terrain {
    Terrain::from_bytes("relief.asc", Arc::new(bytes), &Silent).unwrap()
}

/// Relief of 1 m in steps of 1/1024 m, 0 at sample (0, 0).
fn metre(i: i64, j: i64) -> f64 {
    let h = hash(3, i / 4, j / 4) + hash(4, i, j);
    if (i, j) == (0, 0) {
        0.0
    } else {
        (512.0 * h).floor() / 1024.0
    }
}

#[test]
fn relief_of_a_metre_on_1e7_loses_nothing() {
    let size = [181, 150];
    let offset = read(ascii(size, |i, j| format!("{:.10}", 1e7 + metre(i, j))));
    let plain = read(ascii(size, |i, j| format!("{:.10}", metre(i, j))));
    assert_eq!((offset.grid().base_m, plain.grid().base_m), (1e7, 0.0));
    for level in 0..offset.level_count() {
        assert_eq!(bits(&offset, level), bits(&plain, level), "level {level}");
    }
    let eyes = |y: f64| {
        [
            camera(DVec3::new(2000.0, y + 3.0, 2100.0), 40.0, -10.0),
            camera(DVec3::new(2000.0, y + 900.0, 2100.0), 40.0, -70.0),
            camera(DVec3::new(2000.0, y + 0.5, 2100.0), 220.0, 0.0),
        ]
    };
    Subject::new("a metre on 1e7", &offset).check(&eyes(1e7));
    for (high, low) in eyes(1e7).iter().zip(&eyes(0.0)) {
        let vertices = |levels: &dyn Levels, camera: &Camera| -> Vec<u32> {
            let clipmap = updated(levels, &small(), &View::new(*camera, [48, 32]).unwrap());
            let instances = clipmap.selection().instances();
            instances
                .flat_map(|i| (0..81).map(|k| displace(&clipmap, i, k % 9, k / 9)))
                .flat_map(|v| v.clip.map(f32::to_bits))
                .collect()
        };
        let on_1e7 = vertices(&offset, high);
        assert!(on_1e7 == vertices(&plain, low) && on_1e7.len() > 1000);
        // Control: an eye that f32 cannot tell from this one at 1e7 m makes another picture.
        let mut moved = *low;
        moved.eye.y += 0.125;
        assert!(on_1e7 != vertices(&plain, &moved));
    }
}

/// A DEM of a caller's own, some of whose heights are infinite.
#[cfg(feature = "dem")]
struct Unruly(clipscape::source::Description);

#[cfg(feature = "dem")]
impl clipscape::source::HeightSource for Unruly {
    fn description(&self) -> &clipscape::source::Description {
        &self.0
    }

    fn read(&self, rect: Rect, out: &mut [f32]) -> clipscape::Result<()> {
        for ((i, j), height) in rect.cells().zip(out) {
            *height = match (i, j) {
                (3, 4) => f32::INFINITY,
                (5, 4) | (6, 6) => f32::NEG_INFINITY,
                (7, 7) => f32::NAN,
                _ => hills(0, i, j),
            };
        }
        Ok(())
    }
}

#[cfg(feature = "dem")]
#[test]
fn infinite_heights_of_a_file_are_counted() {
    let synth = clipscape::source::Synth::new(40, 1).unwrap();
    let description = clipscape::source::HeightSource::description(&synth).clone();
    let mut file = std::io::Cursor::new(Vec::new());
    clipscape::source::write_tiff(&mut file, &Unruly(description), &Silent).unwrap();
    let source =
        clipscape::source::open_bytes("unruly.tif", Arc::new(file.into_inner()), &Default::default())
            .unwrap();
    let mut heights = vec![0.0; 40 * 40];
    source.read(Rect::new(0, 0, 40, 40), &mut heights).unwrap();
    assert_eq!(heights.iter().filter(|h| h.is_nan()).count(), 4);
    assert!(heights.iter().all(|h| !h.is_infinite()));
    // Known once they have been read.
    let remarks = source.remarks(&Silent).unwrap();
    assert!(
        remarks.iter().any(|s| s.starts_with("3 heights are infinite")),
        "{remarks:?}"
    );
}
