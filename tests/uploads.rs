//! Uploads take effect where they are recorded: several views and several updates in one submission, and encoders that
//! are dropped.
#![cfg(feature = "gpu")]

#[path = "support/stage.rs"]
mod stage;
mod support;

use clipscape::camera::{Camera, View};
use clipscape::clipmap::VOID_HEIGHT;
use clipscape::error::ErrorKind;
use clipscape::gpu::RendererOptions;
use clipscape::grid::Grid;
use glam::DVec3;
use stage::{Eye, Stage};
use support::{Formula, gpu, hash, hills};

type Hills = Formula<fn(u32, i64, i64) -> f32>;

const SIZE_PX: [u32; 2] = [120, 80];

fn ground(level: u32, i: i64, j: i64) -> f32 {
    let (x, z) = (i << level, j << level);
    let lake = (x / 90 + z / 70) % 5 == 3 && hash(level, i, j) < 0.1;
    if lake { f32::NAN } else { hills(level, i, j) }
}

fn levels() -> Hills {
    Formula::new(Grid::new(701, 523, [9.0, 11.0]), ground)
}

fn view(x: f64, z: f64, heading_deg: f64) -> View {
    let camera = Camera {
        eye: DVec3::new(x, 400.0, z),
        heading_deg,
        pitch_deg: -20.0,
        roll_deg: 0.0,
        fov_deg: 60.0,
    };
    View::new(camera, SIZE_PX).unwrap()
}

/// Texels of the height texture that do not hold their sample.
fn stale(stage: &Stage, eye: &Eye) -> usize {
    let n = eye.textures.heights().width() as usize;
    let of = |window: &clipscape::clipmap::Window| {
        let layer = stage
            .gpu
            .read_texture(eye.textures.heights(), window.level())
            .unwrap();
        let texels: Vec<f32> = bytemuck::pod_collect_to_vec(&layer);
        let stale = window.resident().cells().filter(|&(i, j)| {
            let [x, z] = window.slot_of(i, j);
            let want = window.height(i, j).filter(|h| !h.is_nan()).unwrap_or(VOID_HEIGHT);
            texels[z as usize * n + x as usize] != want
        });
        stale.count()
    };
    eye.clipmap.windows().iter().map(of).sum()
}

#[test]
fn two_views_of_one_terrain_in_one_submission_equal_those_drawn_alone() {
    let Some(gpu) = gpu() else { return };
    let (stage, levels) = (Stage::new(&gpu, &RendererOptions::default(), SIZE_PX), levels());
    let paths = [
        |k: f64| view(1500.0 + 70.0 * k, 2000.0, 30.0 * k),
        |k: f64| view(4000.0, 3000.0 - 90.0 * k, 200.0),
    ];
    let alone = paths.map(|path| {
        let mut eye = stage.eye(&levels, 64);
        (0..6)
            .map(|k| stage.colours(&stage.picture(&levels, &mut eye, &path(f64::from(k)))))
            .collect::<Vec<_>>()
    });
    let mut eyes = [stage.eye(&levels, 64), stage.eye(&levels, 64)];
    for k in 0..6 {
        // Both are updated and recorded before anything is submitted.
        let mut encoder = stage.encoder();
        let targets = [stage.target(), stage.target()];
        for ((eye, path), target) in eyes.iter_mut().zip(paths).zip(&targets) {
            eye.clipmap.update(&levels, &path(f64::from(k)), 0.0).unwrap();
            stage.record(&mut encoder, eye, target);
        }
        stage.gpu.queue.submit([encoder.finish()]);
        for ((target, alone), name) in targets.iter().zip(&alone).zip(["first", "second"]) {
            assert!(
                stage.colours(target) == alone[k as usize],
                "frame {k}: the {name} view"
            );
        }
    }
    assert!(
        alone[0] != alone[1] && alone[0][0] != alone[0][1],
        "control: the pictures differ"
    );
}

#[test]
fn two_updates_of_one_view_in_one_submission_equal_those_drawn_alone() {
    let Some(gpu) = gpu() else { return };
    let (stage, levels) = (Stage::new(&gpu, &RendererOptions::default(), SIZE_PX), levels());
    // A step, a jump, and one between whole windows.
    let views = [
        view(1500.0, 2000.0, 0.0),
        view(1600.0, 2100.0, 10.0),
        view(4800.0, 900.0, 90.0),
        view(4700.0, 950.0, 80.0),
    ];
    let mut eye = stage.eye(&levels, 64);
    let alone = views.map(|view| stage.colours(&stage.picture(&levels, &mut eye, &view)));
    for one_encoder in [true, false] {
        let mut eye = stage.eye(&levels, 64);
        let mut encoders = vec![stage.encoder()];
        let mut targets = Vec::new();
        for view in &views {
            eye.clipmap.update(&levels, view, 0.0).unwrap();
            let target = stage.target();
            stage.record(encoders.last_mut().unwrap(), &mut eye, &target);
            targets.push(target);
            if !one_encoder {
                encoders.push(stage.encoder());
            }
        }
        stage
            .gpu
            .queue
            .submit(encoders.into_iter().map(wgpu::CommandEncoder::finish));
        for (k, (target, alone)) in targets.iter().zip(&alone).enumerate() {
            assert!(
                stage.colours(target) == *alone,
                "update {k}, one encoder: {one_encoder}"
            );
        }
        assert_eq!(stale(&stage, &eye), 0);
    }
    assert!(alone[0] != alone[1], "control: the pictures differ");
}

#[test]
fn an_encoder_that_is_dropped_costs_whole_windows_and_nothing_else() {
    let Some(gpu) = gpu() else { return };
    let (stage, levels) = (Stage::new(&gpu, &RendererOptions::default(), SIZE_PX), levels());
    let views = [
        view(1500.0, 2000.0, 0.0),
        view(1900.0, 2300.0, 0.0),
        view(1950.0, 2350.0, 5.0),
        view(1990.0, 2390.0, 5.0),
    ];
    let mut fresh = stage.eye(&levels, 64);
    let wanted = views.map(|view| stage.colours(&stage.picture(&levels, &mut fresh, &view)));

    let mut eye = stage.eye(&levels, 64);
    stage.picture(&levels, &mut eye, &views[0]);
    eye.clipmap.update(&levels, &views[1], 0.0).unwrap();
    let mut encoder = stage.encoder();
    let target = stage.target();
    stage.record(&mut encoder, &mut eye, &target);
    drop(encoder.finish());
    assert!(
        stale(&stage, &eye) > 100,
        "control: what was dropped is not there"
    );

    // It may not be drawn any more,
    let mut encoder = stage.encoder();
    let error = stage
        .renderer
        .draw(&mut target.pass(&mut encoder, None), &eye.clipmap, &eye.textures)
        .unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Misuse);
    // but uploaded again, either as it was or as of the next update.
    let mut again = stage.encoder();
    stage.record(&mut again, &mut eye, &target);
    stage.gpu.queue.submit([again.finish()]);
    assert!(stage.colours(&target) == wanted[1]);
    assert_eq!(stale(&stage, &eye), 0);

    eye.clipmap.update(&levels, &views[2], 0.0).unwrap();
    let mut dropped = stage.encoder();
    let exposed = stage
        .renderer
        .upload(&mut dropped, &eye.clipmap, &mut eye.textures)
        .unwrap();
    drop(dropped);
    eye.clipmap.update(&levels, &views[3], 0.0).unwrap();
    let mut encoder = stage.encoder();
    let whole = stage
        .renderer
        .upload(&mut encoder, &eye.clipmap, &mut eye.textures)
        .unwrap();
    assert!(whole.bytes > 10 * exposed.bytes, "{whole:?} {exposed:?}");
    stage.draw(&mut encoder, &eye, &target);
    stage.gpu.queue.submit([encoder.finish()]);
    assert!(stage.colours(&target) == wanted[3]);
    assert_eq!(stale(&stage, &eye), 0);
}

#[test]
fn an_update_that_was_not_uploaded_or_is_uploaded_twice_does_no_harm() {
    let Some(gpu) = gpu() else { return };
    let (stage, levels) = (Stage::new(&gpu, &RendererOptions::default(), SIZE_PX), levels());
    let mut eye = stage.eye(&levels, 64);
    stage.picture(&levels, &mut eye, &view(1500.0, 2000.0, 0.0));
    eye.clipmap
        .update(&levels, &view(1800.0, 2000.0, 0.0), 0.0)
        .unwrap();
    let there = view(2100.0, 2200.0, 0.0);
    let picture = stage.colours(&stage.picture(&levels, &mut eye, &there));
    assert_eq!(stale(&stage, &eye), 0);
    let mut encoder = stage.encoder();
    let twice = stage
        .renderer
        .upload(&mut encoder, &eye.clipmap, &mut eye.textures)
        .unwrap();
    assert_eq!(twice.bytes, 0);
    stage.gpu.queue.submit([encoder.finish()]);
    let mut fresh = stage.eye(&levels, 64);
    assert!(picture == stage.colours(&stage.picture(&levels, &mut fresh, &there)));
}

#[test]
fn textures_of_another_clipmap_are_written_whole_or_refused() {
    let Some(gpu) = gpu() else { return };
    let (stage, levels) = (Stage::new(&gpu, &RendererOptions::default(), SIZE_PX), levels());
    let mut raised = self::levels();
    raised.height = |l, i, j| ground(l, i, j) + 90.0;
    let here = view(1500.0, 2000.0, 0.0);
    let (mut eye, mut other) = (stage.eye(&levels, 64), stage.eye(&raised, 64));
    stage.picture(&levels, &mut eye, &here);
    let wanted = stage.colours(&stage.picture(&raised, &mut other, &here));
    // Of the same sizes, and as many updates on: still not the same.
    std::mem::swap(&mut eye.textures, &mut other.textures);
    let target = stage.target();
    let mut encoder = stage.encoder();
    let drawn = stage.renderer.draw(
        &mut target.pass(&mut encoder, None),
        &other.clipmap,
        &other.textures,
    );
    assert_eq!(drawn.unwrap_err().kind(), ErrorKind::Misuse);
    assert!(wanted == stage.colours(&stage.picture(&raised, &mut other, &here)));
    assert_eq!(stale(&stage, &other), 0);

    let mut larger = stage.eye(&levels, 128);
    larger.clipmap.update(&levels, &here, 0.0).unwrap();
    let refused = stage
        .renderer
        .upload(&mut encoder, &larger.clipmap, &mut eye.textures)
        .unwrap_err();
    assert_eq!(refused.kind(), ErrorKind::Misuse);
    assert!(refused.to_string().contains("clip size 64"), "{refused}");
    let unseen = stage.eye(&levels, 64).clipmap;
    let refused = stage
        .renderer
        .upload(&mut encoder, &unseen, &mut eye.textures)
        .unwrap_err();
    assert!(refused.to_string().contains("has not been updated"), "{refused}");
}
