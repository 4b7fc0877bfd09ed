use super::*;
use crate::camera::{Camera, overview};
use crate::clipmap::ClipmapOptions;
use crate::render::{Headless, HeadlessOptions};
use crate::source::Synth;
use glam::DVec3;

const SIZE_PX: [u32; 2] = [160, 90];

fn settings() -> Settings {
    Settings {
        clipmap: ClipmapOptions {
            clip_size: 64,
            ..Default::default()
        },
        view_mode: ViewMode::Shaded,
        tint: true,
        haze: true,
        sun: Sun::default(),
        sun_hour: None,
    }
}

fn gpu() -> Option<Gpu> {
    let required = std::env::var_os("CLIPSCAPE_REQUIRE_GPU").is_some_and(|v| v == "1");
    match crate::gpu::open() {
        Ok(gpu) => Some(gpu),
        Err(error) => {
            assert!(!required, "CLIPSCAPE_REQUIRE_GPU is set, but {error}");
            None
        }
    }
}

fn draw(scene: &mut Scene, gpu: &Gpu, view: &View) -> Vec<u8> {
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    scene.update(gpu, &mut encoder, view, 0.0).unwrap();
    scene.record(&mut encoder).unwrap();
    gpu.queue.submit([encoder.finish()]);
    scene.pixels(gpu).unwrap().1
}

fn headless(gpu: &Gpu, terrain: &Terrain, settings: &Settings, view: &View) -> Vec<u8> {
    let options = HeadlessOptions {
        size_px: view.size_px,
        sample_count: 1,
        view_mode: settings.view_mode,
        tint: settings.tint,
        haze: settings.haze,
        traced_light: true,
        sun: settings.sun,
        clipmap: settings.clipmap,
    };
    let mut headless = Headless::new(gpu.clone(), terrain, &options).unwrap();
    headless.frame_of(terrain, view, 0.0).unwrap().rgba8
}

#[test]
fn after_any_change_of_settings_the_picture_is_that_of_a_frame_made_for_them() {
    let Some(gpu) = gpu() else { return };
    let terrain = Arc::new(Terrain::from_synth(Synth::new(1024, 3).unwrap()));
    let mut scene = Scene::new(&gpu, terrain.clone(), &settings(), Sun::default(), 1, SIZE_PX).unwrap();
    let camera = Camera {
        eye: DVec3::new(15_000.0, 2500.0, 25_000.0),
        heading_deg: 10.0,
        pitch_deg: -20.0,
        roll_deg: 0.0,
        fov_deg: 60.0,
    };
    let view = View::new(camera, SIZE_PX).unwrap();
    let first = draw(&mut scene, &gpu, &view);
    assert!(first == headless(&gpu, &terrain, &settings(), &view));
    let changes: [fn(&mut Settings); 10] = [
        |s| s.view_mode = ViewMode::Level,
        |s| s.view_mode = ViewMode::Shaded,
        |s| s.tint = false,
        |s| s.haze = false,
        |s| s.sun.azimuth_deg = 100.0,
        |s| s.clipmap.vertical_scale = 2.5,
        |s| s.clipmap.transition = Some(1),
        |s| s.set_clip_size(256),
        |s| s.clipmap.max_error_px = Some(30.0),
        |s| s.clipmap.max_error_px = Some(60.0),
    ];
    let (mut settings, mut before) = (settings(), first);
    for (k, change) in changes.into_iter().enumerate() {
        change(&mut settings);
        scene.apply(&gpu, &settings).unwrap();
        let after = draw(&mut scene, &gpu, &view);
        assert!(after == headless(&gpu, &terrain, &settings, &view), "change {k}");
        assert!(after != before, "control: change {k} changes nothing");
        before = after;
    }
    let wide = View::new(camera, [200, 50]).unwrap();
    scene.resize(&gpu, [200, 50]);
    let after = draw(&mut scene, &gpu, &wide);
    assert!(after == headless(&gpu, &terrain, &settings, &wide));
}

#[test]
fn a_new_device_draws_the_same() {
    let (Some(gpu), Some(other)) = (gpu(), gpu()) else {
        return;
    };
    let terrain = Arc::new(Terrain::from_synth(Synth::new(512, 3).unwrap()));
    let camera = overview(terrain.grid(), 0.0, 3000.0, 16.0 / 9.0);
    let view = View::new(camera, SIZE_PX).unwrap();
    let mut scene = Scene::new(&gpu, terrain.clone(), &settings(), Sun::default(), 4, SIZE_PX).unwrap();
    let before = draw(&mut scene, &gpu, &view);
    drop(scene);
    gpu.device.destroy();
    let mut scene = Scene::new(&other, terrain, &settings(), Sun::default(), 4, SIZE_PX).unwrap();
    assert!(draw(&mut scene, &other, &view) == before);
}
