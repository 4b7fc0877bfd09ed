//! Terrain inside an existing wgpu program: its own device, its own matrices, its own things in the same depth buffer.
//!
//!     cargo run --no-default-features --features gpu --example embed -- [OUT.png [INPUT]]
//!
//! Draws one picture, 1280 x 720, of the shipped DEM (or INPUT) with boxes that stand on its ground, and contour lines
//! from a surface function of its own. Without a window, so that it runs anywhere.
#![allow(clippy::print_stderr, reason = "a program says what went wrong")]

use std::error::Error;
use std::fs::File;
use std::io::BufWriter;

use bytemuck::{Pod, Zeroable};
use clipscape::gpu::{ClipmapRenderer, Readback, RendererOptions, SkyRenderer};
use clipscape::grid::Rect;
use clipscape::levels::Levels;
use clipscape::progress::Silent;
use clipscape::stream::Terrain;
use clipscape::{Clipmap, ClipmapOptions, View};
use glam::dcamera::rh::proj::directx;
use glam::dcamera::rh::view::look_at_mat4;
use glam::{DMat4, DVec3, Mat4};

const SIZE_PX: [u32; 2] = [1280, 720];
const COLOUR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;
const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Contour lines every 100 m, every fifth of them stronger, over the ground's own colours.
const SURFACE: &str = "
fn contour(height_m: f32, step_m: f32) -> f32 {
    let lines = height_m / step_m;
    let off_px = (0.5 - abs(fract(lines) - 0.5)) / max(fwidth(lines), 1e-6);
    return (1.0 - smoothstep(0.5, 1.5, off_px)) * (1.0 - smoothstep(0.1, 0.4, fwidth(lines)));
}

fn surface_colour(point: SurfacePoint) -> vec4<f32> {
    let ink = max(0.35 * contour(point.height_m, 100.0), 0.8 * contour(point.height_m, 500.0));
    let ground = mix(tint(point), vec3(0.25, 0.05, 0.02), ink);
    let radiance = ground * illumination(point.sun, point.sky);
    return vec4(tone(through_air(radiance, point.from_eye_m)), 1.0);
}";

/// A box, as its pipeline reads it.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Instance {
    clip_from_box: Mat4,
    turn: [f32; 4],
    colour: [f32; 4],
}

fn main() {
    let mut arguments = std::env::args_os().skip(1);
    let out = arguments.next().unwrap_or_else(|| "embed.png".into());
    let input = arguments.next().unwrap_or_else(|| "data/N42E001.hgt".into());
    if let Err(error) = run(out.as_ref(), input.as_ref()) {
        eprintln!("embed: {error}");
        std::process::exit(1);
    }
}

fn run(out: &std::path::Path, input: &std::path::Path) -> Result<(), Box<dyn Error>> {
    // What the program has already: a device, and targets.
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default()))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&Default::default()))?;
    let colour = target(&device, "embed colour", COLOUR);
    let depth = target(&device, "embed depth", DEPTH);

    // Once: the terrain, a view of it, and pipelines for the program's targets.
    let terrain = Terrain::open(input, &Silent)?;
    let mut clipmap = Clipmap::new(&terrain, &ClipmapOptions::default())?;
    let options = RendererOptions {
        colour_format: COLOUR,
        depth_format: DEPTH,
        traced_light: clipmap.has_light(),
        surface: Some(SURFACE.to_string()),
        ..Default::default()
    };
    let renderer = ClipmapRenderer::new(&device, &options)?;
    let sky = SkyRenderer::new(&device, &options)?;
    let mut textures = renderer.textures(&device, &clipmap, terrain.sun().unwrap_or_default())?;
    let boxes = box_pipeline(&device, &options);

    // Every frame: the program's own matrices, from which the terrain takes its view.
    let [width_m, depth_m] = [0, 1].map(|axis| {
        let size = terrain.grid().size;
        ([size.width, size.height][axis] - 1) as f64 * terrain.grid().spacing_m[axis]
    });
    let place = |x: f64, z: f64| ground(&terrain, x * width_m, z * depth_m);
    let eye = place(0.485, 0.675)? + DVec3::new(0.0, 1400.0, 0.0);
    let view_from_world = look_at_mat4(eye, place(0.36, 0.50)?, DVec3::Y);
    let aspect = f64::from(SIZE_PX[0]) / f64::from(SIZE_PX[1]);
    let clip_from_view = directx::perspective_infinite_reverse(50f64.to_radians(), aspect, 1.0);
    let view = View::from_matrices(view_from_world, clip_from_view, SIZE_PX)?;
    clipmap.update(&terrain, &view, 0.0)?;

    let clip_from_world = clip_from_view * view_from_world;
    let mut instances = Vec::new();
    let feet = [
        (0.455, 0.64),
        (0.445, 0.60),
        (0.40, 0.60),
        (0.42, 0.57),
        (0.36, 0.53),
    ];
    for (k, (x, z)) in feet.into_iter().enumerate() {
        instances.push(standing_box(clip_from_world, place(x, z)?, k as f64));
    }

    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor {
        label: Some("embed frame"),
    });
    renderer.upload(&mut encoder, &clipmap, &mut textures)?;
    {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("embed pass"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &colour.create_view(&Default::default()),
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &depth.create_view(&Default::default()),
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(options.clear_depth()),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        renderer.draw(&mut pass, &clipmap, &textures)?;
        // The program's own things, in any order with the terrain; the sky fills what is left.
        use wgpu::util::DeviceExt as _;
        let buffer = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("embed boxes"),
            contents: bytemuck::cast_slice(&instances),
            usage: wgpu::BufferUsages::VERTEX,
        });
        pass.set_pipeline(&boxes);
        pass.set_vertex_buffer(0, buffer.slice(..));
        pass.draw(0..36, 0..instances.len() as u32);
        sky.draw(&mut pass, &textures)?;
    }
    let readback = Readback::record(&device, &mut encoder, &colour, 0);
    queue.submit([encoder.finish()]);

    let mut encoder = png::Encoder::new(BufWriter::new(File::create(out)?), SIZE_PX[0], SIZE_PX[1]);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    encoder
        .write_header()?
        .write_image_data(&readback.wait(&device)?)?;
    Ok(())
}

/// The point of the ground at (x, z), in world metres.
fn ground(terrain: &Terrain, x: f64, z: f64) -> Result<DVec3, Box<dyn Error>> {
    let [dx, dz] = terrain.grid().spacing_m;
    let (i, j) = ((x / dx) as i64, (z / dz) as i64);
    let mut height = [0.0];
    let _ = terrain.heights(0, Rect::new(i, j, i + 1, j + 1), &mut height)?;
    let height_m = if height[0].is_nan() {
        0.0
    } else {
        f64::from(height[0])
    };
    Ok(DVec3::new(
        i as f64 * dx,
        height_m + terrain.grid().base_m,
        j as f64 * dz,
    ))
}

/// A box that stands on the ground, sunk in by a quarter, turned by `k`.
fn standing_box(clip_from_world: DMat4, foot: DVec3, k: f64) -> Instance {
    let angle = 0.4 + 0.9 * k;
    // In f64 up to clip space: far from the world's origin f32 would be too coarse.
    let clip_from_box = clip_from_world
        * DMat4::from_translation(foot + DVec3::new(0.0, 300.0, 0.0))
        * DMat4::from_rotation_y(angle)
        * DMat4::from_scale(DVec3::new(120.0, 600.0, 120.0));
    Instance {
        clip_from_box: clip_from_box.as_mat4(),
        turn: [angle.cos() as f32, angle.sin() as f32, 0.0, 0.0],
        colour: [0.8, 0.15 + 0.12 * k as f32, 0.05, 1.0],
    }
}

fn target(device: &wgpu::Device, label: &str, format: wgpu::TextureFormat) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d {
            width: SIZE_PX[0],
            height: SIZE_PX[1],
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    })
}

fn box_pipeline(device: &wgpu::Device, options: &RendererOptions) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::include_wgsl!("embed.wgsl"));
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("embed boxes"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: Default::default(),
            buffers: &[Some(wgpu::VertexBufferLayout {
                array_stride: size_of::<Instance>() as u64,
                step_mode: wgpu::VertexStepMode::Instance,
                attributes: &wgpu::vertex_attr_array![
                    0 => Float32x4, 1 => Float32x4, 2 => Float32x4, 3 => Float32x4,
                    4 => Float32x4, 5 => Float32x4
                ],
            })],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: options.depth_format,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("fragment"),
            compilation_options: Default::default(),
            targets: &[Some(options.colour_format.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
