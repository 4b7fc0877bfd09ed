//! Measured errors against closed forms: surfaces drawn on the CPU, exactly, and at a known wrong height.

mod support;
#[path = "support/surfaces.rs"]
mod surfaces;

use clipscape::accuracy::{DepthImage, ErrorSummary, ExactImage, FrameErrors, measure};
use clipscape::camera::{Camera, View};
use clipscape::clipmap::near_m;
use clipscape::grid::Grid;
use clipscape::levels::Levels;
use clipscape::pyramid::Pyramid;
use clipscape::query::Truth;
use clipscape::work::Serial;
use glam::DVec3;
use support::{Random, hash, hills, seed};
use surfaces::pyramid;

const SIZE_PX: [u32; 2] = [120, 90];

fn grid() -> Grid {
    let mut grid = Grid::new(300, 260, [10.0, 12.5]);
    grid.base_m = 500.5;
    grid
}

fn plane(i: i64, j: i64) -> f32 {
    2.0 * i as f32 - 1.5 * j as f32
}

fn rough(i: i64, j: i64) -> f32 {
    3.0 * hills(0, i, j)
}

fn with_holes(i: i64, j: i64) -> f32 {
    if hash(3, i / 6, j / 5) < 0.1 {
        f32::NAN
    } else {
        rough(i, j)
    }
}

/// The depths of `levels` as a device without rounding would draw them.
fn depths(levels: &dyn Levels, view: &View, vertical_scale: f64) -> Vec<f32> {
    let exact = ExactImage::new(&Truth::new(levels, vertical_scale), view, &Serial).unwrap();
    let near_m = near_m(levels.grid());
    exact.distances_m().iter().map(|d| (near_m / d) as f32).collect()
}

fn errors(truth: &dyn Levels, view: &View, vertical_scale: f64, depths: &[f32]) -> FrameErrors {
    let image = DepthImage::new(depths, view).unwrap();
    measure(&Truth::new(truth, vertical_scale), &image, &Serial).unwrap()
}

/// A camera over the grid that looks at some ground of it; heights are as drawn with the scale.
fn camera(random: &mut Random, vertical_scale: f64) -> Camera {
    let above = random.uniform(400.0, 2000.0);
    let mut place = |height: f64| {
        DVec3::new(
            random.uniform(600.0, 2400.0),
            height,
            random.uniform(600.0, 2600.0),
        )
    };
    let eye = place(if vertical_scale < 0.0 {
        500.5 - above
    } else {
        1200.0 + above
    });
    let (heading_deg, pitch_deg) = Camera::toward(eye, place(eye.y + (500.5 - eye.y) * vertical_scale));
    Camera {
        eye,
        heading_deg,
        pitch_deg,
        roll_deg: random.uniform(-20.0, 20.0),
        fov_deg: random.uniform(20.0, 80.0),
    }
}

/// A name, heights, and a vertical scale.
type Round = (&'static str, fn(i64, i64) -> f32, f64);

fn rounds() -> [Round; 6] {
    [
        ("plane", plane, 1.0),
        ("plane", plane, -2.0),
        ("rough", rough, 1.0),
        ("rough", rough, 3.0),
        ("rough", rough, -1.0),
        ("holes", with_holes, 1.0),
    ]
}

/// Pixels from P to Q by their projections, for a pixel's depth and Q `gap_m` below P as drawn.
fn apart_px(view: &View, pixel: [f64; 2], away_m: f64, gap_m: f64) -> f64 {
    let [x, y, w] = view.clip_rows();
    let size = view.size_px.map(f64::from);
    let project = |p: DVec3| {
        [
            (x.dot(p) / w.dot(p) + 1.0) / 2.0 * size[0],
            (1.0 - y.dot(p) / w.dot(p)) / 2.0 * size[1],
        ]
    };
    let p = view.ray(pixel) * away_m;
    let (from, to) = (project(p), project(p - DVec3::Y * gap_m));
    (from[0] - to[0]).hypot(from[1] - to[1])
}

#[test]
fn what_is_drawn_exactly_measures_nothing() {
    let seed = seed(41);
    let mut random = Random(seed);
    for (name, height, scale) in rounds() {
        let truth = pyramid(grid(), height);
        let mut terrain_px = 0;
        for _ in 0..4 {
            let view = View::new(camera(&mut random, scale), SIZE_PX).unwrap();
            let summary = errors(&truth, &view, scale, &depths(&truth, &view, scale)).summary;
            assert_eq!(summary.error_px_max, 0.0, "seed {seed}: {name} times {scale}");
            // Rounding the depth may put a point over the edge of a hole.
            assert!(
                summary.silhouette_px <= summary.terrain_px / 1000,
                "seed {seed}: {summary:?}"
            );
            assert!(summary.error_floor_px < 0.1, "seed {seed}: {summary:?}");
            terrain_px += summary.terrain_px;
        }
        assert!(
            terrain_px > 5000,
            "seed {seed}: {name}: {terrain_px} pixels of terrain"
        );
    }
}

#[test]
fn a_surface_at_a_wrong_height_measures_by_how_much() {
    let seed = seed(42);
    let mut random = Random(seed);
    for (name, height, scale) in rounds() {
        let truth = pyramid(grid(), height);
        for shift_m in [0.75f32, -3.0, 20.0] {
            let shifted = pyramid(grid(), |i, j| height(i, j) + shift_m);
            let view = View::new(camera(&mut random, scale), SIZE_PX).unwrap();
            let depths = depths(&shifted, &view, scale);
            let errors = errors(&truth, &view, scale, &depths);
            let (mut seen, mut worst) = (0, 0.0f64);
            for (n, pixel) in errors
                .pixels
                .iter()
                .enumerate()
                .filter(|(_, p)| !p.error_px.is_nan())
            {
                let centre = [n % SIZE_PX[0] as usize, n / SIZE_PX[0] as usize].map(|v| v as f64 + 0.5);
                let away_m = near_m(truth.grid()) / f64::from(depths[n]);
                let want_px = apart_px(&view, centre, away_m, f64::from(shift_m) * scale);
                let (error_px, floor_px) = (f64::from(pixel.error_px), f64::from(pixel.floor_px));
                // A depth is rounded to f32, which the floor knows of.
                let off = (error_px - (want_px - floor_px).max(0.0)).abs();
                assert!(
                    off <= floor_px + 1e-6 * want_px,
                    "seed {seed}: {name} times {scale} by {shift_m} m: {error_px}, not {want_px} px, floor {floor_px}"
                );
                // The floor hides no error above it.
                assert!(want_px <= 2.0 * floor_px || error_px > 0.0, "seed {seed}: {name}");
                seen += 1;
                worst = worst.max(want_px);
            }
            let summary = errors.summary;
            assert_eq!(summary.terrain_px, seen);
            assert!(seen > 500, "seed {seed}: {name} times {scale}: {seen} pixels");
            let off_m = (summary.error_m_max - f64::from(shift_m.abs())).abs();
            assert!(
                off_m < 0.02,
                "seed {seed}: {name} times {scale}: {} m",
                summary.error_m_max
            );
            assert!(
                summary.error_px_max > 0.9 * worst - summary.error_floor_px,
                "seed {seed}: {summary:?} of {worst}"
            );
            // Control: measured against itself, nothing is left.
            let itself = self::errors(&shifted, &view, scale, &depths).summary;
            assert_eq!(itself.error_px_max, 0.0, "seed {seed}: {name}");
        }
    }
}

#[test]
fn terrain_where_there_is_none_and_none_where_there_is_are_silhouettes() {
    let truth = pyramid(grid(), with_holes);
    let whole = pyramid(grid(), rough);
    let mut random = Random(seed(43));
    let view = View::new(camera(&mut random, 1.0), SIZE_PX).unwrap();
    let (drawn, right) = (depths(&whole, &view, 1.0), depths(&truth, &view, 1.0));
    let differ = drawn
        .iter()
        .zip(&right)
        .filter(|(a, b)| (**a > 0.0) != (**b > 0.0));
    let differ = differ.count() as u64;
    // Without its holes the ground hides what is behind them: there S0 is void below what was drawn.
    let filled = errors(&truth, &view, 1.0, &drawn);
    assert!(
        differ > 0 && filled.summary.silhouette_px >= differ,
        "{differ}, {:?}",
        filled.summary
    );
    let of_holes = filled
        .pixels
        .iter()
        .filter(|p| p.silhouette && p.error_px.is_nan())
        .count();
    assert_eq!(of_holes as u64, filled.summary.silhouette_px);
    // Nothing drawn at all.
    let nothing = vec![0.0; drawn.len()];
    let summary = errors(&truth, &view, 1.0, &nothing).summary;
    let terrain = right.iter().filter(|d| **d > 0.0).count() as u64;
    let want = ErrorSummary {
        silhouette_px: terrain,
        ..ErrorSummary::default()
    };
    assert_eq!(summary, want);
    // No number is no terrain, and breaks nothing.
    let nan = vec![f32::NAN; drawn.len()];
    assert_eq!(errors(&truth, &view, 1.0, &nan).summary, want);
}

#[test]
fn a_scale_of_nothing_is_a_plane_through_the_eye() {
    let truth: Pyramid = pyramid(grid(), rough);
    let view = View::new(camera(&mut Random(44), 1.0), SIZE_PX).unwrap();
    let summary = errors(&truth, &view, 0.0, &depths(&truth, &view, 0.0)).summary;
    assert_eq!((summary.error_px_max, summary.error_m_max), (0.0, 0.0));
}

#[test]
fn a_truth_behind_the_camera_is_beyond_all_numbers() {
    // Looking straight down from 10 m over a plain; drawn is a point 5 m away, over ground that reaches up to 100 m.
    let tower = pyramid(grid(), |i, j| if i == 100 && j == 100 { 100.0 } else { 0.0 });
    let camera = Camera {
        eye: DVec3::new(1000.0, 510.5, 1250.0),
        heading_deg: 0.0,
        pitch_deg: -90.0,
        roll_deg: 0.0,
        fov_deg: 60.0,
    };
    let view = View::new(camera, [1, 1]).unwrap();
    let depth = [(near_m(&grid()) / 5.0) as f32];
    let summary = errors(&tower, &view, 1.0, &depth).summary;
    assert_eq!(summary.error_px_max, f64::MAX, "{summary:?}");
    assert!((summary.error_m_max - 95.0).abs() < 1e-3, "{summary:?}");
}
