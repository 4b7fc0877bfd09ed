//! Terrain within a caller's own program: its matrices, its depth buffer, its targets.
#![cfg(feature = "gpu")]

#[path = "support/stage.rs"]
mod stage;
mod support;

use clipscape::camera::{Camera, Depth, DepthDirection, View};
use clipscape::clipmap::near_m;
use clipscape::error::ErrorKind;
use clipscape::gpu::{ClipmapRenderer, RendererOptions};
use clipscape::grid::Grid;
use glam::dcamera::rh::proj::directx;
use glam::dcamera::rh::view::look_to_mat4;
use glam::{DMat4, DVec3};
use stage::Stage;
use support::{Formula, gpu, hills};

const SIZE_PX: [u32; 2] = [96, 96];

type Ground = Formula<fn(u32, i64, i64) -> f32>;

fn hilly() -> Ground {
    Formula::new(Grid::new(701, 523, [8.0, 16.0]), hills)
}

fn flat() -> Ground {
    Formula::new(Grid::new(701, 523, [8.0, 16.0]), |_, _, _| 40.0)
}

const CAMERA: Camera = Camera {
    eye: DVec3::new(2500.0, 900.0, 5000.0),
    heading_deg: 0.0,
    pitch_deg: -30.0,
    roll_deg: 0.0,
    fov_deg: 90.0,
};

/// The view matrix of [`CAMERA`], of its own axes.
fn camera_matrix() -> DMat4 {
    let axes = CAMERA.axes();
    look_to_mat4(CAMERA.eye, axes.col(2), axes.col(1))
}

/// Pixels of which a channel differs by more than 4.
fn differing(a: &[u8], b: &[u8]) -> usize {
    assert_eq!(a.len(), b.len());
    let far = |(a, b): &(&[u8], &[u8])| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > 4);
    a.chunks(4).zip(b.chunks(4)).filter(far).count()
}

#[test]
fn matrices_and_a_camera_draw_the_same_picture() {
    let Some(gpu) = gpu() else { return };
    let levels = hilly();
    let stage = Stage::new(&gpu, &RendererOptions::default(), SIZE_PX);
    let near = near_m(&levels.grid);
    // A field of view of 90 degrees, whose tangent the camera has exactly: so are all numbers.
    let mut projection = DMat4::ZERO;
    (projection.x_axis.x, projection.y_axis.y) = (1.0, 1.0);
    (projection.z_axis.w, projection.w_axis.z) = (-1.0, near);
    let axes = CAMERA.axes();
    let mut matrix = DMat4::IDENTITY;
    for (k, axis) in [axes.col(0), axes.col(1), -axes.col(2)].into_iter().enumerate() {
        for (i, value) in axis.to_array().into_iter().enumerate() {
            matrix.col_mut(i)[k] = value;
        }
    }
    matrix *= DMat4::from_translation(-CAMERA.eye);
    let of_camera = View::new(CAMERA, SIZE_PX).unwrap();
    let mut of_matrices = View::from_matrices(matrix, projection, SIZE_PX).unwrap();
    assert!(of_matrices.eye.abs_diff_eq(CAMERA.eye, 1e-9));
    of_matrices.eye = CAMERA.eye;
    let draw = |view: &View| {
        let target = stage.picture(&levels, &mut stage.eye(&levels, 64), view);
        (stage.colours(&target), stage.depths(&target))
    };
    let (colours, depths) = draw(&of_camera);
    assert!(draw(&of_matrices) == (colours.clone(), depths.clone()));
    // A near distance of twice that changes no colour, and doubles depth; another axis is another picture.
    let (same, doubled) = draw(&of_camera.with_depth(Depth::reversed(2.0 * near).unwrap()));
    assert!(same == colours && doubled != depths);
    assert!(doubled.iter().zip(&depths).all(|(d, s)| *d == 2.0 * s));
    projection.z_axis.x = 0.1;
    let shifted = View::from_matrices(matrix, projection, SIZE_PX).unwrap();
    assert!(differing(&draw(&shifted).0, &colours) > 500, "control");
}

/// Projections of every kind, with the direction of their depth.
fn projections() -> [(&'static str, DMat4, DepthDirection); 6] {
    use DepthDirection::{Forward, Reversed};
    [
        (
            "reversed",
            directx::perspective_infinite_reverse(1.2, 1.0, 3.0),
            Reversed,
        ),
        (
            "reversed, finite",
            directx::perspective(1.2, 1.0, 3e4, 3.0),
            Reversed,
        ),
        ("forward", directx::perspective_infinite(1.2, 1.3, 3.0), Forward),
        (
            "forward, finite",
            directx::perspective(0.8, 0.7, 300.0, 6e3),
            Forward,
        ),
        (
            "off axis",
            directx::frustum(-0.2, 1.0, -1.1, 0.3, 1.0, 1e5),
            Forward,
        ),
        (
            "turned",
            DMat4::from_rotation_z(0.7) * directx::perspective(1.2, 1.0, 2e4, 2.0),
            Reversed,
        ),
    ]
}

#[test]
fn depths_are_those_of_the_caller_s_projection() {
    let Some(gpu) = gpu() else { return };
    let levels = flat();
    let view_matrix = camera_matrix();
    for (name, projection, direction) in projections() {
        let options = RendererOptions {
            depth_direction: direction,
            ..Default::default()
        };
        let stage = Stage::new(&gpu, &options, SIZE_PX);
        let view = View::from_matrices(view_matrix, projection, SIZE_PX).unwrap();
        let depths = stage.depths(&stage.picture(&levels, &mut stage.eye(&levels, 64), &view));
        // Where each pixel's ray meets the plane, by the caller's matrices alone.
        let clip_from_world = projection * view_matrix;
        let world_from_clip = clip_from_world.inverse();
        let exact = |x: u32, y: u32| {
            let ndc = |at: u32, size: u32| 2.0 * (f64::from(at) + 0.5) / f64::from(size) - 1.0;
            let clip = DVec3::new(ndc(x, SIZE_PX[0]), -ndc(y, SIZE_PX[1]), 0.5).extend(1.0);
            let seen = world_from_clip * clip;
            let ray = seen.truncate() / seen.w - CAMERA.eye;
            let reach = (40.0 - CAMERA.eye.y) / ray.y;
            let point = CAMERA.eye + ray * reach;
            let inside = reach > 0.0
                && (0.0..700.0 * 8.0).contains(&point.x)
                && (0.0..522.0 * 16.0).contains(&point.z);
            let clip = clip_from_world * point.extend(1.0);
            (inside && (0.0..=1.0).contains(&(clip.z / clip.w))).then_some(clip.z / clip.w)
        };
        let (mut compared, mut worst, mut lost) = (0, 0.0f64, 0);
        for y in 0..SIZE_PX[1] {
            for x in 0..SIZE_PX[0] {
                let drawn = depths[(y * SIZE_PX[0] + x) as usize];
                let Some(exact) = exact(x, y) else { continue };
                if drawn == options.clear_depth() {
                    lost += 1;
                    continue;
                }
                compared += 1;
                // Relative to how far it is from the clear value: where depth has its detail.
                let distance = (f64::from(drawn) - exact).abs();
                let grain = if direction == DepthDirection::Reversed {
                    exact
                } else {
                    1.0
                };
                worst = worst.max(distance / grain);
            }
        }
        assert!(compared > 1500, "{name}: {compared} pixels");
        // Pixels on the border of the DEM, the near and the far plane may fall to either side.
        assert!(lost <= 20, "{name}: {lost} pixels are missing");
        // Depth is linear on the screen over a plane; what is left is f32, a few dozen ulps (7e-7 was measured).
        let bound = 32.0 * f64::from(f32::EPSILON);
        assert!(worst < bound, "{name}: {worst}");
        // Control: the depth of a projection that is a little different is caught.
        let nearer = Depth::new(direction, 1.02 * view.depth().unwrap().near_m(), f64::INFINITY).unwrap();
        let other = stage.picture(&levels, &mut stage.eye(&levels, 64), &view.with_depth(nearer));
        let far_off = |(a, b): (&f32, &f32)| {
            let grain = if direction == DepthDirection::Reversed {
                *b
            } else {
                1.0
            };
            f64::from((a - b).abs()) > bound * f64::from(grain)
        };
        assert!(stage.depths(&other).iter().zip(&depths).any(far_off), "{name}");
    }
}

#[test]
fn every_target_shows_the_same_picture() {
    let Some(gpu) = gpu() else { return };
    use wgpu::TextureFormat as Format;
    let levels = hilly();
    let view = View::new(CAMERA, SIZE_PX).unwrap();
    let draw = |options: &RendererOptions, view: &View| {
        let stage = Stage::new(&gpu, options, SIZE_PX);
        stage.colours(&stage.picture(&levels, &mut stage.eye(&levels, 64), view))
    };
    let wanted = draw(&RendererOptions::default(), &view);
    let covered = wanted.chunks(4).filter(|p| p[..3] != [0, 0, 0]).count();
    assert!(covered > 2000, "{covered}");
    for depth_format in [
        Format::Depth32Float,
        Format::Depth24Plus,
        Format::Depth24PlusStencil8,
        Format::Depth16Unorm,
    ] {
        for depth_direction in [DepthDirection::Reversed, DepthDirection::Forward] {
            for colour_format in [Format::Rgba8UnormSrgb, Format::Rgba8Unorm] {
                let options = RendererOptions {
                    colour_format,
                    depth_format,
                    depth_direction,
                    ..Default::default()
                };
                let depth = Depth::new(depth_direction, 400.0, 2e4).unwrap();
                let drawn = draw(&options, &view.with_depth(depth));
                // Formats round depth, and a shader encodes less exactly than a format does.
                let off = differing(&drawn, &wanted);
                assert!(off <= 20, "{options:?}: {off} pixels differ");
            }
        }
    }
    let four = RendererOptions {
        sample_count: 4,
        ..Default::default()
    };
    let off = differing(&draw(&four, &view), &wanted);
    assert!(off > 0 && off < 1500, "{off}");
    // Without an encoding, a float target holds linear colours.
    let float = RendererOptions {
        colour_format: Format::Rgba16Float,
        ..Default::default()
    };
    let halves: Vec<half::f16> = bytemuck::pod_collect_to_vec(&draw(&float, &view));
    let encoded = halves.iter().zip(&wanted).filter(|(linear, byte)| {
        let linear = f64::from(linear.to_f32());
        let srgb = if linear <= 0.003_130_8 {
            12.92 * linear
        } else {
            1.055 * linear.powf(1.0 / 2.4) - 0.055
        };
        (255.0 * srgb - f64::from(**byte)).abs() > 1.0 && **byte != 255
    });
    assert_eq!(encoded.count(), 0);
}

#[test]
fn what_does_not_fit_together_is_refused() {
    let Some(gpu) = gpu() else { return };
    use wgpu::TextureFormat as Format;
    let good = RendererOptions::default();
    for (options, word) in [
        (
            RendererOptions {
                sample_count: 2,
                ..good.clone()
            },
            "use 1 or 4",
        ),
        (
            RendererOptions {
                depth_format: Format::Rgba8Unorm,
                ..good.clone()
            },
            "no depth",
        ),
        (
            RendererOptions {
                colour_format: Format::Depth32Float,
                ..good.clone()
            },
            "no target",
        ),
        (
            RendererOptions {
                colour_format: Format::Rgba8Uint,
                ..good.clone()
            },
            "no target",
        ),
        (
            RendererOptions {
                depth_format: Format::Depth32FloatStencil8,
                ..good.clone()
            },
            "needs a device",
        ),
    ] {
        let error = ClipmapRenderer::new(&gpu.device, &options).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Misuse);
        assert!(error.to_string().contains(word), "{error}");
        assert!(clipscape::gpu::SkyRenderer::new(&gpu.device, &options).is_err());
    }
    let levels = hilly();
    let reversed = View::new(CAMERA, SIZE_PX).unwrap();
    let forward = reversed.with_depth(Depth::new(DepthDirection::Forward, 1.0, 1e5).unwrap());
    let of = |options: &RendererOptions, view: &View| {
        let stage = Stage::new(&gpu, options, SIZE_PX);
        let mut eye = stage.eye(&levels, 64);
        eye.clipmap.update(&levels, view, 0.0).unwrap();
        stage
            .renderer
            .upload(&mut stage.encoder(), &eye.clipmap, &mut eye.textures)
    };
    let forwards = RendererOptions {
        depth_direction: DepthDirection::Forward,
        ..good.clone()
    };
    let sixteen = RendererOptions {
        depth_format: Format::Depth16Unorm,
        ..good.clone()
    };
    assert!(of(&good, &reversed).is_ok() && of(&forwards, &forward).is_ok());
    for (options, view, word) in [
        (&good, &forward, "depth runs forward"),
        (&forwards, &reversed, "depth runs reversed"),
        (&sixteen, &reversed, "lost in Depth16Unorm"),
    ] {
        let error = of(options, view).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Misuse);
        assert!(error.to_string().contains(word), "{error}");
    }
}
