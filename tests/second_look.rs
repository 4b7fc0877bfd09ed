//! The second look of measured frames: what a rasteriser takes from a triangle beside a pixel's centre is measured on that
//! triangle, and what is drawn at a wrong place keeps its error.
//!
//! Depths are made on the CPU. A device that snaps corners to 1/256 pixel may draw at a pixel the triangle behind a crest
//! that a ray a little beside its centre meets, at the depth of that triangle's plane at the centre: here it always does.

mod support;
#[path = "support/surfaces.rs"]
mod surfaces;

use clipscape::accuracy::{DepthImage, Facet, FrameErrors, measure, measure_drawn};
use clipscape::camera::{Camera, View};
use clipscape::clipmap::{Clipmap, ClipmapOptions, Drawn, near_m};
use clipscape::grid::Grid;
use clipscape::levels::Levels;
use clipscape::pyramid::Pyramid;
use clipscape::query::{Picker, Truth};
use clipscape::work::Serial;
use glam::DVec3;
use support::{Random, hash, hills, seed};
use surfaces::pyramid;

const SIZE_PX: [u32; 2] = [160, 90];

/// Rough enough for crests and slivers.
fn crests(shift_m: f32) -> Pyramid {
    pyramid(Grid::new(300, 260, [10.0, 12.5]), move |i, j| {
        0.3 * hills(0, i, j) + 25.0 * hash(0, i, j) as f32 + shift_m
    })
}

fn camera(random: &mut Random, up_m: f64) -> View {
    let mut place =
        |up_m: f64| DVec3::new(random.uniform(600.0, 2400.0), up_m, random.uniform(600.0, 2600.0));
    let (eye, to) = (place(up_m), place(0.0));
    let (heading_deg, pitch_deg) = Camera::toward(eye, to);
    let camera = Camera {
        eye,
        heading_deg,
        pitch_deg,
        roll_deg: 0.0,
        fov_deg: random.uniform(20.0, 60.0),
    };
    View::new(camera, SIZE_PX).unwrap()
}

/// A clipmap over all of `levels`; with a clip size of 64 most of it is drawn coarser than it is.
fn clipmap(levels: &dyn Levels, view: &View, clip_size: i64) -> Clipmap {
    let options = ClipmapOptions {
        clip_size,
        ..Default::default()
    };
    let mut clipmap = Clipmap::new(levels, &options).unwrap();
    clipmap.update(levels, view, 0.0).unwrap();
    clipmap
}

/// The depths of the drawn surface; where `bared`, at pixels beside crests that of what is behind, and at how many.
fn depths(clipmap: &Clipmap, view: &View, bared: bool) -> (Vec<f32>, usize) {
    let drawn = Drawn::new(clipmap).unwrap();
    let mut picker = Picker::new(&drawn, view).unwrap();
    let (grid, near_m) = (clipmap.grid(), near_m(clipmap.grid()));
    let (mut depths, mut count) = (Vec::new(), 0);
    for y in 0..SIZE_PX[1] {
        for x in 0..SIZE_PX[0] {
            let centre = [f64::from(x) + 0.5, f64::from(y) + 0.5];
            let hit = picker.cast(centre).unwrap();
            let mut depth = hit.map_or(0.0, |hit| near_m / hit.along);
            let sides = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];
            for side in sides.iter().filter(|_| bared) {
                let ray = [0, 1].map(|k| centre[k] + side[k] / 300.0);
                let Some(beside) = picker.cast(ray).unwrap() else {
                    continue;
                };
                let behind = picker.cast_from(ray, beside.along * (1.0 + 1e-9)).unwrap();
                let facet = behind.and_then(|b| Facet::new(grid, view, 1.0, &b, centre));
                // A triangle that ends before the pixel's centre, but for the grid: nearer than what the centre sees.
                let plane = facet.map_or(0.0, |f| f.depth);
                if behind.is_some_and(|b| b.along < beside.along * 1.1)
                    && plane > depth * 1.02
                    && plane < 2.0 * depth
                {
                    depth = plane;
                    count += 1;
                    break;
                }
            }
            depths.push(depth as f32);
        }
    }
    (depths, count)
}

fn both(truth: &Pyramid, clipmap: &Clipmap, view: &View, depths: &[f32]) -> [FrameErrors; 2] {
    let (truth, drawn) = (Truth::new(truth, 1.0), Drawn::new(clipmap).unwrap());
    let image = DepthImage::new(depths, view).unwrap();
    [
        measure(&truth, &image, &Serial).unwrap(),
        measure_drawn(&truth, &drawn, &image, &Serial).unwrap(),
    ]
}

#[test]
fn what_is_drawn_beside_a_pixel_is_measured_there() {
    let seed = seed(61);
    let mut random = Random(seed);
    let truth = crests(0.0);
    let (mut bared, mut wrong) = (0, 0);
    for _ in 0..6 {
        let view = camera(&mut random, 230.0);
        let clipmap = clipmap(&truth, &view, 1024);
        let (depths, count) = depths(&clipmap, &view, true);
        let [first, second] = both(&truth, &clipmap, &view, &depths);
        let errors = |of: &FrameErrors| of.pixels.iter().filter(|p| p.error_px > 1e-9).count();
        assert_eq!(errors(&second), 0, "seed {seed}: {:?}", second.summary);
        (bared, wrong) = (bared + count, wrong + errors(&first));
        assert!(second.summary.beside_px as usize <= count, "seed {seed}");
    }
    assert!(
        bared > 20 && wrong > 10,
        "control: the first look is fooled: {wrong} of {bared}"
    );
}

#[test]
fn what_is_drawn_at_a_wrong_place_keeps_its_error() {
    let seed = seed(62);
    let mut random = Random(seed);
    let (truth, raised) = (crests(0.0), crests(2.0));
    for _ in 0..4 {
        let view = camera(&mut random, 700.0);
        // Of a surface that is not the one which was to be drawn: nothing explains its depths.
        let right = clipmap(&truth, &view, 1024);
        let (wrong, _) = depths(&clipmap(&raised, &view, 1024), &view, false);
        let [first, second] = both(&truth, &right, &view, &wrong);
        let seen = first.pixels.iter().filter(|p| p.error_px > 0.0).count();
        let excused = (first.pixels.iter().zip(&second.pixels))
            .filter(|(a, b)| b.error_px < 0.5 * a.error_px)
            .count();
        assert!(
            seen > 1000 && excused * 50 < seen,
            "seed {seed}: {excused} of {seen}"
        );
        // Of a drawn surface that is coarser than the DEM: its points are where it says, and as wrong.
        let coarse = clipmap(&truth, &view, 64);
        let (depths, _) = depths(&coarse, &view, false);
        let [first, second] = both(&truth, &coarse, &view, &depths);
        assert!(
            first.summary.error_px_max > 0.5,
            "seed {seed}: {:?}",
            first.summary
        );
        assert_eq!(second.summary.beside_px, 0, "seed {seed}: {:?}", second.summary);
        assert_eq!(first.summary, second.summary, "seed {seed}");
    }
}
