//! The clipmap against the whole DEM as one full-resolution mesh, and how wrong the clipmap's frame is.
//!
//!     cargo bench --bench mesh [-- ROUNDS [SIZE [WxH]]]
//!
//! The DEM is `synth:SIZE:7` (4096 if none is given: 33.5 million triangles), filtered into a pyramid as any DEM is. The
//! mesh fetches its heights from one texture, in strips of rows that share an index buffer, and is shaded by the same
//! function as the clipmap, its slopes taken from a texture of the whole DEM. Cameras, size and run are the same; both
//! are drawn in turn, and printed are medians over the rounds, in wall milliseconds from recording to completion.
//!
//! *Error*: for each pixel of terrain in the clipmap's frame, P is the point drawn there, by its depth read back, Q the
//! point of the full-resolution surface above or below it, and the error the distance between their projections in
//! pixels. Measured likewise on the mesh's own frame it tells what the rasteriser's grid and f32 depth make of no error: nothing, but
//! where a pixel falls on a triangle seen on edge, whose depth there is anything.
#![allow(clippy::print_stdout, reason = "a bench prints its table")]

mod support;

use clipscape::camera::{Camera, View};
use clipscape::clipmap::near_m;
use clipscape::gpu::Gpu;
use clipscape::grid::Grid;
use clipscape::levels::Levels;
use clipscape::progress::Silent;
use clipscape::pyramid::{Filter, Pyramid};
use clipscape::render::Headless;
use clipscape::source::Synth;
use clipscape::{Error, ErrorKind, Result};
use glam::DVec3;
use half::f16;
use support::{Targets, median, met, module, options, percentile, pipeline, shader_constants};
use wgpu::util::DeviceExt as _;

/// Rows of quads in a strip, all strips but the last.
const STRIP_ROWS: i64 = 64;

/// The greatest side of a texture by WebGPU's default limits.
const GREATEST_SIZE: i64 = 8192;

const MESH_SHADER: &str = "
#import shared/ground.wgsl

@group(1) @binding(0) var dem: texture_2d<f32>;
@group(1) @binding(1) var slopes: texture_2d<f32>;
@group(1) @binding(2) var slope_sampler: sampler;

struct Varyings {
    @builtin(position) position: vec4<f32>,
    @location(0) from_eye: vec2<f32>,
    @location(1) height: f32,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Varyings {
    let side = textureDimensions(dem).x;
    let sample = vec2<i32>(vec2(index % side, index / side));
    let from_eye = vec2<f32>(sample - view.anchor) - view.fraction;
    let height = textureLoad(dem, sample, 0).x;
    let east = from_eye.x * view.spacing_m.x;
    let up = ((height - view.eye_height_m.x) - view.eye_height_m.y) * view.vertical_scale;
    let south = from_eye.y * view.spacing_m.y;
    let position = view.clip_from_east * east + view.clip_from_up * up + view.clip_from_south * south;
    return Varyings(vec4(position.x, position.y, view.near_m, position.w), from_eye, height);
}

@fragment
fn fragment(in: Varyings) -> @location(0) vec4<f32> {
    let place = in.from_eye + view.fraction + vec2<f32>(view.anchor) + 0.5;
    let slope = textureSampleLevel(slopes, slope_sampler, place / vec2<f32>(textureDimensions(slopes)), 0.0);
    let point = GroundPoint(in.from_eye, in.height, 0.0, 0u);
    let colour = view_colour(surface_point(point, vec4(0.0, 0.0, slope.xy)));
    return vec4(encode(colour.rgb), colour.a);
}
";

/// The whole DEM on the GPU.
struct Mesh {
    side: i64,
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
    indices: wgpu::Buffer,
}

impl Mesh {
    fn new(gpu: &Gpu, pyramid: &Pyramid, headless: &Headless) -> Result<Self> {
        let grid = pyramid.grid();
        let side = grid.size.width;
        let slopes = slopes(pyramid);
        let views = [
            texture(
                gpu,
                side,
                wgpu::TextureFormat::R32Float,
                bytemuck::cast_slice(pyramid.level(0)),
            ),
            texture(
                gpu,
                side,
                wgpu::TextureFormat::Rg16Float,
                bytemuck::cast_slice(&slopes),
            ),
        ];
        let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        let sampled = |binding, visibility, filterable| wgpu::BindGroupLayoutEntry {
            binding,
            visibility,
            ty: wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Float { filterable },
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            count: None,
        };
        let layout = gpu
            .device
            .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: Some("clipscape bench mesh"),
                entries: &[
                    sampled(0, wgpu::ShaderStages::VERTEX, false),
                    sampled(1, wgpu::ShaderStages::FRAGMENT, true),
                    wgpu::BindGroupLayoutEntry {
                        binding: 2,
                        visibility: wgpu::ShaderStages::FRAGMENT,
                        ty: wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
                        count: None,
                    },
                ],
            });
        let resources = [
            wgpu::BindingResource::TextureView(&views[0]),
            wgpu::BindingResource::TextureView(&views[1]),
            wgpu::BindingResource::Sampler(&sampler),
        ];
        let entries: Vec<_> = (resources.into_iter().zip(0..))
            .map(|(resource, binding)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("clipscape bench mesh"),
            layout: &layout,
            entries: &entries,
        });
        let module = module(gpu, "mesh.wgsl", MESH_SHADER)?;
        let layouts = [Some(headless.renderer().bind_group_layout()), Some(&layout)];
        let entries = ["vertex", "fragment"];
        Ok(Self {
            side,
            pipeline: pipeline(
                gpu,
                "clipscape bench mesh",
                &module,
                &layouts,
                &shader_constants(),
                entries,
                &[],
            ),
            group,
            indices: gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("clipscape bench strip"),
                contents: bytemuck::cast_slice(&strip_indices(side)),
                usage: wgpu::BufferUsages::INDEX,
            }),
        })
    }

    fn triangles(&self) -> i64 {
        2 * (self.side - 1) * (self.side - 1)
    }

    fn draw(&self, pass: &mut wgpu::RenderPass<'_>, headless: &Headless) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, headless.textures().bind_group(), &[]);
        pass.set_bind_group(1, &self.group, &[]);
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        let mut row = 0;
        while row < self.side - 1 {
            let rows = STRIP_ROWS.min(self.side - 1 - row);
            let indices = 6 * rows * (self.side - 1);
            pass.draw_indexed(0..indices as u32, (row * self.side) as i32, 0..1);
            row += rows;
        }
    }
}

/// The quads of [`STRIP_ROWS`] rows, split from north-west to south-east.
fn strip_indices(side: i64) -> Vec<u32> {
    let quads = (0..STRIP_ROWS).flat_map(|z| (0..side - 1).map(move |x| (x, z)));
    let corner = |x: i64, z: i64| (z * side + x) as u32;
    quads
        .flat_map(|(x, z)| {
            let [nw, ne] = [corner(x, z), corner(x + 1, z)];
            let [sw, se] = [corner(x, z + 1), corner(x + 1, z + 1)];
            [nw, sw, se, nw, se, ne]
        })
        .collect()
}

/// Slopes to the east and south at every sample, as the clipmap's light texels have them.
fn slopes(pyramid: &Pyramid) -> Vec<[f16; 2]> {
    let (grid, heights) = (pyramid.grid(), pyramid.level(0));
    let side = grid.size.width;
    let at = |i: i64, j: i64| f64::from(heights[(j * side + i) as usize]);
    let last = side - 1;
    let slope = |(i, j): (i64, i64)| {
        let ([west, east], [north, south]) = (
            [(i - 1).max(0), (i + 1).min(last)],
            [(j - 1).max(0), (j + 1).min(last)],
        );
        let slope_east = (at(east, j) - at(west, j)) / ((east - west) as f64 * grid.spacing_m[0]);
        let slope_south = (at(i, south) - at(i, north)) / ((south - north) as f64 * grid.spacing_m[1]);
        [slope_east, slope_south].map(f16::from_f64)
    };
    grid.size.rect().cells().map(slope).collect()
}

fn texture(gpu: &Gpu, side: i64, format: wgpu::TextureFormat, texels: &[u8]) -> wgpu::TextureView {
    let descriptor = wgpu::TextureDescriptor {
        label: Some("clipscape bench DEM"),
        size: wgpu::Extent3d {
            width: side as u32,
            height: side as u32,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    };
    let order = wgpu::util::TextureDataOrder::LayerMajor;
    let texture = (gpu.device).create_texture_with_data(&gpu.queue, &descriptor, order, texels);
    texture.create_view(&Default::default())
}

/// Screen errors of a frame's terrain pixels in pixels.
fn screen_errors(depth: &[f32], view: &View, pyramid: &Pyramid) -> Vec<f64> {
    let grid = pyramid.grid();
    let [x_row, y_row, w_row] = view.clip_rows();
    let size = view.size_px.map(f64::from);
    let project = |from_eye: DVec3| {
        let w = w_row.dot(from_eye);
        [
            (x_row.dot(from_eye) / w + 1.0) / 2.0 * size[0],
            (1.0 - y_row.dot(from_eye) / w) / 2.0 * size[1],
        ]
    };
    let mut errors = Vec::new();
    for (k, &depth) in depth.iter().enumerate().filter(|(_, d)| **d > 0.0) {
        let pixel = [k % view.size_px[0] as usize, k / view.size_px[0] as usize].map(|p| p as f64 + 0.5);
        let distance = near_m(grid) / f64::from(depth);
        let mut from_eye = view.ray(pixel) * distance;
        let place = view.eye + from_eye;
        let Some(height) = surface(pyramid, grid, place) else {
            continue; // beyond the last column or row by less than a rounding
        };
        from_eye.y = height - view.eye.y;
        let [qx, qy] = project(from_eye);
        errors.push((qx - pixel[0]).hypot(qy - pixel[1]));
    }
    errors
}

/// The height of the full-resolution surface at a place's x and z, none beside the DEM.
fn surface(pyramid: &Pyramid, grid: &Grid, place: DVec3) -> Option<f64> {
    let side = grid.size.width;
    let (x, z) = (place.x / grid.spacing_m[0], place.z / grid.spacing_m[1]);
    let last = (side - 1) as f64;
    if !((0.0..=last).contains(&x) && (0.0..=last).contains(&z)) {
        return None;
    }
    let (i, j) = ((x as i64).min(side - 2), (z as i64).min(side - 2));
    let (u, v) = (x - i as f64, z - j as f64);
    let at = |i: i64, j: i64| f64::from(pyramid.level(0)[(j * side + i) as usize]);
    let middle = if u >= v { at(i + 1, j) } else { at(i, j + 1) };
    let height = at(i, j) * (1.0 - u.max(v)) + middle * (u - v).abs() + at(i + 1, j + 1) * u.min(v);
    Some(height + grid.base_m)
}

fn main() {
    let mut arguments = std::env::args().skip(1).filter(|a| a != "--bench");
    let rounds = arguments.next().and_then(|a| a.parse().ok()).unwrap_or(3).max(1);
    let side = arguments.next().and_then(|a| a.parse().ok()).unwrap_or(4096);
    let size_px = arguments.next().and_then(|a| {
        let (width, height) = a.split_once('x')?;
        Some([width.parse().ok()?, height.parse().ok()?])
    });
    if let Err(error) = run(rounds, side, size_px.unwrap_or([1280, 720])) {
        println!("mesh: {error}");
        std::process::exit(1);
    }
}

fn run(rounds: usize, side: i64, size_px: [u32; 2]) -> Result<()> {
    if !(STRIP_ROWS + 1..=GREATEST_SIZE).contains(&side) {
        let what = format!("{side} samples a side do not make a mesh");
        let advice = format!("give {} to {GREATEST_SIZE}", STRIP_ROWS + 1);
        return Err(Error::new(ErrorKind::Misuse, "size", what).advice(advice));
    }
    let pyramid = clipscape::build::build_pyramid(&Synth::new(side, 7)?, &Filter::default(), &Silent)?;
    let gpu = clipscape::gpu::open()?;
    let mut headless = Headless::new(gpu.clone(), &pyramid, &options(size_px, true))?;
    let mesh = Mesh::new(&gpu, &pyramid, &headless)?;
    let targets = Targets::new(&gpu, size_px);
    println!(
        "{} ({}), {}x{} pixels, {side} x {side} samples, {} triangles in the mesh, medians of {rounds} rounds",
        gpu.info.name,
        gpu.driver(),
        size_px[0],
        size_px[1],
        mesh.triangles()
    );
    println!("ms: clipmap, mesh, times as fast (aim: at least 20); error of the frame in pixels");
    for (name, camera) in cameras(&pyramid) {
        headless.frame(&pyramid, &camera, 0.0)?;
        let triangles = headless.clipmap().selection().triangles();
        let (mut ours, mut theirs) = (Vec::new(), Vec::new());
        for _ in 0..rounds {
            targets.clipmap_ms(&headless)?;
            ours.push(targets.clipmap_ms(&headless)?);
            theirs.push(targets.draw_ms(|pass| mesh.draw(pass, &headless))?);
        }
        let (full_colour, full_depth) = targets.read()?;
        targets.clipmap_ms(&headless)?;
        let (colour, depth) = targets.read()?;
        let view = View::new(camera, size_px)?;
        let ratio = median(&theirs) / median(&ours);
        println!(
            "{name}: {:.1}, {:.0}, {ratio:.1} {}; {triangles} triangles",
            median(&ours),
            median(&theirs),
            met(ratio >= 20.0)
        );
        for (what, depth) in [("the clipmap's frame", &depth), ("the mesh's own", &full_depth)] {
            let errors = screen_errors(depth, &view, &pyramid);
            if errors.is_empty() {
                println!("  {what}: no terrain");
                continue;
            }
            let rms = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
            println!(
                "  {what}: max {:.3}, 99th percentile {:.3}, rms {rms:.4} px, over {} pixels, {} of them above 1 px",
                percentile(&errors, 100.0),
                percentile(&errors, 99.0),
                errors.len(),
                errors.iter().filter(|e| **e > 1.0).count()
            );
        }
        let apart = colour
            .iter()
            .zip(&full_colour)
            .map(|(a, b)| f64::from(a.abs_diff(*b)));
        println!(
            "  colours differ by {:.2} of 255 in the mean",
            apart.sum::<f64>() / colour.len() as f64
        );
    }
    Ok(())
}

/// Cameras over the middle of the DEM: low, looking to the horizon, and high, looking down.
fn cameras(pyramid: &Pyramid) -> [(&'static str, Camera); 2] {
    let grid = pyramid.grid();
    let middle = grid.spacing_m.map(|s| (0.5 * grid.size.width as f64 + 0.3) * s);
    let at = |above_m: f64| {
        let place = DVec3::new(middle[0], 0.0, middle[1]);
        let ground = surface(pyramid, grid, place).unwrap_or(0.0);
        DVec3::new(place.x, ground + above_m, place.z)
    };
    let camera = |eye, pitch_deg| Camera {
        eye,
        heading_deg: 25.0,
        pitch_deg,
        roll_deg: 0.0,
        fov_deg: 60.0,
    };
    [
        ("low", camera(at(300.0), -8.0)),
        ("high", camera(at(6000.0), -30.0)),
    ]
}
