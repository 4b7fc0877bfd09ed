//! Nothing on the GPU is absolute: a shift of the DEM's index offset and a scale of the world by a power of two leave
//! every image bit for bit as it was.

use clipscape::camera::Camera;
use clipscape::clipmap::ClipmapOptions;
use clipscape::grid::Grid;
use clipscape::render::HeadlessOptions;
use clipscape::shade::ViewMode;
use glam::DVec3;

use crate::draw::{Picture, frame, headless, options};
use crate::harness::{camera, pyramid, rough};
use crate::support::{Formula, gpu, hash, hills};

const SIZE_PX: [u32; 2] = [64, 48];

fn views() -> [HeadlessOptions; 4] {
    let with = |view_mode, haze| HeadlessOptions {
        view_mode,
        tint: haze,
        haze,
        ..options(SIZE_PX)
    };
    [
        with(ViewMode::Shaded, true),
        with(ViewMode::Shaded, false),
        with(ViewMode::Light, false),
        with(ViewMode::Level, false),
    ]
}

fn ground(level: u32, i: i64, j: i64) -> f32 {
    let void = hash(7, (i << level) / 32, (j << level) / 32) < 0.05;
    if void { f32::NAN } else { hills(level, i, j) }
}

fn cameras() -> [Camera; 3] {
    [
        camera(DVec3::new(3006.7, 420.0, 2503.1), 25.0, -25.0),
        camera(DVec3::new(4111.1, 1900.0, 1333.3), 210.0, -60.0),
        camera(DVec3::new(77.0, 230.0, 5300.0), 100.0, -8.0),
    ]
}

/// The pictures of all cameras over the DEM whose index offset is `offset`.
fn shifted(offset: [i64; 2], has_light: bool, options: &HeadlessOptions) -> Option<Vec<Picture>> {
    let mut levels = Formula::new(Grid::new(701, 523, [9.0, 11.0]), ground);
    levels.grid.offset = offset;
    levels.has_light = has_light;
    let mut headless = headless(&gpu()?, &levels, options);
    Some(
        cameras()
            .map(|camera| frame(&mut headless, &levels, &camera))
            .into(),
    )
}

fn differing(a: &[Picture], b: &[Picture]) -> usize {
    a.iter().zip(b).map(|(a, b)| a.differing(b)).sum()
}

#[test]
fn a_shift_of_the_index_offset_changes_no_bit() {
    const FAR: i64 = 1 << 40;
    let mut offsets = vec![[FAR, FAR], [FAR, -FAR], [-FAR, FAR], [-FAR, -FAR]];
    offsets.extend([
        [FAR + 1, -FAR - 1],
        [1 - FAR, 3],
        [FAR + 12_345, 777 - FAR],
        [63, -29],
    ]);
    let views = views();
    let traced = views.iter().map(|options| (options, true));
    // Without traced light all follows from slopes, which lie in the same texels.
    for (options, has_light) in traced.chain([(&views[0], false)]) {
        let Some(unshifted) = shifted([0, 0], has_light, options) else {
            return;
        };
        let terrain: usize = unshifted.iter().map(Picture::terrain_pixels).sum();
        assert!(terrain > 3000, "{terrain} pixels of terrain");
        for &offset in &offsets {
            let pictures = shifted(offset, has_light, options).expect("there is an adapter");
            let different = differing(&pictures, &unshifted);
            let mode = options.view_mode;
            assert_eq!(
                different, 0,
                "{mode:?}, light {has_light}, offset {offset:?}: {different} of {terrain} pixels differ"
            );
        }
    }
}

/// The pictures of the world times `scale`.
fn scaled(scale: f64, options: &HeadlessOptions) -> Option<Vec<Picture>> {
    let grid = Grid::new(501, 423, [9.0 * scale, 11.0 * scale]);
    let levels = pyramid(grid, |i, j| (f64::from(rough(i, j)) * scale) as f32);
    let mut headless = headless(&gpu()?, &levels, options);
    let cameras = cameras().map(|camera| Camera {
        eye: camera.eye * scale,
        ..camera
    });
    Some(
        cameras
            .map(|camera| frame(&mut headless, &levels, &camera))
            .into(),
    )
}

#[test]
fn a_scale_by_a_power_of_two_changes_no_bit() {
    // Air and tint have lengths of their own.
    for (number, options) in views()[1..].iter().enumerate() {
        let Some(unscaled) = scaled(1.0, options) else {
            return;
        };
        let terrain: usize = unscaled.iter().map(Picture::terrain_pixels).sum();
        assert!(terrain > 3000, "{terrain} pixels of terrain");
        // Every power in one view, some in the others, which share all but the last step of the colour.
        let step = if number == 1 { 1 } else { 10 };
        for k in (-20..=20).step_by(step) {
            let pictures = scaled(2f64.powi(k), options).expect("there is an adapter");
            let mode = options.view_mode;
            assert_eq!(differing(&pictures, &unscaled), 0, "{mode:?}, 2^{k}");
        }
        // Control: a scale that rounds is seen.
        let third = scaled(1.0 / 3.0, options).expect("there is an adapter");
        assert!(differing(&third, &unscaled) > 100);
    }
}

#[test]
fn control_an_eye_a_hundredth_of_a_sample_on_is_seen() {
    let Some(gpu) = gpu() else { return };
    let levels = Formula::new(Grid::new(701, 523, [9.0, 11.0]), ground);
    let options = HeadlessOptions {
        clipmap: ClipmapOptions {
            clip_size: 64,
            ..Default::default()
        },
        ..options(SIZE_PX)
    };
    let mut headless = headless(&gpu, &levels, &options);
    for camera in cameras() {
        let here = frame(&mut headless, &levels, &camera);
        let mut moved = camera;
        moved.eye.x += 0.09;
        assert!(frame(&mut headless, &levels, &moved).differing(&here) > 100);
    }
}
