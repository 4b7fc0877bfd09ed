//! A frame written as another program would write it, scored as the frame itself is measured.
#![cfg(feature = "gpu")]

mod support;
#[path = "support/surfaces.rs"]
mod surfaces;

use std::sync::Arc;

use clipscape::Camera;
use clipscape::accuracy::{Distances, parse_camera};
use clipscape::build::Threads;
use clipscape::camera::Key;
use clipscape::clipmap::{ClipmapOptions, near_m};
use clipscape::grid::Grid;
use clipscape::levels::Levels;
use clipscape::query::Truth;
use clipscape::render::{Headless, HeadlessOptions};
use exr::prelude::{AnyChannel, AnyChannels};
use exr::prelude::{Encoding, FlatSamples, Image, Layer, LayerAttributes, WritableImage};
use glam::DVec3;
use support::{gpu, hills};
use surfaces::pyramid;

const SIZE_PX: [u32; 2] = [160, 120];

fn exr(distances_m: Vec<f32>) -> Vec<u8> {
    let size = (SIZE_PX[0] as usize, SIZE_PX[1] as usize);
    let channel = AnyChannel::new("Z", FlatSamples::F32(distances_m));
    let channels = AnyChannels::sort(std::iter::once(channel).collect());
    let layer = Layer::new(
        size,
        LayerAttributes::named("depth"),
        Encoding::SMALL_LOSSLESS,
        channels,
    );
    let mut out = std::io::Cursor::new(Vec::new());
    Image::from_layer(layer).write().to_buffered(&mut out).unwrap();
    out.into_inner()
}

#[test]
fn a_frame_written_as_distances_scores_as_it_measures() {
    let Some(gpu) = gpu() else { return };
    let levels = pyramid(Grid::new(700, 600, [20.0, 20.0]), |i, j| {
        let hole = support::hash(4, i / 60, j / 40) < 0.03;
        if hole { f32::NAN } else { 4.0 * hills(0, i, j) }
    });
    for vertical_scale in [1.0, 2.0] {
        let options = HeadlessOptions {
            size_px: SIZE_PX,
            traced_light: false,
            clipmap: ClipmapOptions {
                clip_size: 64,
                vertical_scale,
                ..Default::default()
            },
            ..Default::default()
        };
        let camera = Camera {
            eye: DVec3::new(3000.0, 1500.0, 9000.0),
            heading_deg: 40.0,
            pitch_deg: -12.0,
            roll_deg: 4.0,
            fov_deg: 55.0,
        };
        let mut headless = Headless::new(gpu.clone(), &levels, &options).unwrap();
        headless.measure().unwrap();
        let frame = headless.frame(&levels, &camera, 0.0).unwrap();
        let want = frame.measured.unwrap().errors;
        let distance = |d: &f32| (near_m(levels.grid()) / f64::from(*d)) as f32; // infinite where nothing is drawn
        let distances_m: Vec<f32> = headless.read_depth().unwrap().iter().map(distance).collect();
        let threads = Threads::new(0).unwrap();
        let truth = Truth::new(&levels, vertical_scale);
        // The camera by way of JSON.
        let key = serde_json::to_string(&Key::new(0.0, &camera))
            .unwrap()
            .replace("\"t\":0.0,", "");
        let camera = parse_camera("camera.json", &key).unwrap();
        let score = |distances_m: Vec<f32>| {
            let distances = Distances::open("frame.exr", Arc::new(exr(distances_m))).unwrap();
            distances.measure(&truth, &camera, &threads).unwrap()
        };
        let got = score(distances_m.clone());
        assert!(
            want.summary.terrain_px > 10_000 && want.summary.error_px_max > 0.5,
            "{:?}",
            want.summary
        );
        // Distances are rounded once more.
        let mut worst = 0.0f32;
        for (a, b) in got.pixels.iter().zip(&want.pixels) {
            assert_eq!(a.error_px.is_nan(), b.error_px.is_nan());
            worst = worst.max((a.error_px - b.error_px).abs());
        }
        assert!(worst < 1e-3, "{worst} px");
        assert_eq!(got.summary.terrain_px, want.summary.terrain_px);
        assert!((got.summary.error_px_max - want.summary.error_px_max).abs() < 1e-3);
        assert!((got.summary.error_px_p99 - want.summary.error_px_p99).abs() < 1e-3);
        assert!(got.summary.silhouette_px.abs_diff(want.summary.silhouette_px) <= 2);
        // Control: a hundredth more of distance is noticed.
        let farther = score(distances_m.iter().map(|d| d * 1.01).collect());
        assert!(
            farther.summary.error_px_rms > got.summary.error_px_rms + 0.1,
            "{:?}",
            farther.summary
        );
    }
}
