//! A whole DEM as one full-resolution mesh: its heights in one texture, drawn in strips of rows that share an index buffer,
//! shaded by the clipmap's own function with slopes from a texture of the whole DEM.

use clipscape::gpu::Gpu;
use clipscape::grid::Grid;
use clipscape::render::Headless;
use clipscape::{Error, ErrorKind, Result};
use half::f16;
use wgpu::util::DeviceExt as _;

use super::{module, pipeline, shader_constants};

/// Rows of quads in a strip, all strips but the last.
const STRIP_ROWS: i64 = 64;

/// The greatest side of a texture by WebGPU's default limits.
const GREATEST_SIZE: i64 = 8192;

const SHADER: &str = "
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
    let colour = view_colour(surface_point(point, vec4(0.0, 0.0, slope.xy), 0.0));
    return vec4(encode(colour.rgb), colour.a);
}
";

/// The whole DEM on the GPU.
pub struct Mesh {
    size: [i64; 2],
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
    indices: wgpu::Buffer,
}

impl Mesh {
    /// That of a grid without voids, at most [`GREATEST_SIZE`] samples a side.
    pub fn new(gpu: &Gpu, grid: &Grid, heights: &[f32], headless: &Headless) -> Result<Self> {
        let size = [grid.size.width, grid.size.height];
        let range = STRIP_ROWS + 1..=GREATEST_SIZE;
        if !size.iter().all(|side| range.contains(side)) {
            let what = format!("{} x {} samples do not make a mesh", size[0], size[1]);
            let advice = format!("give {} to {GREATEST_SIZE} a side", STRIP_ROWS + 1);
            return Err(Error::new(ErrorKind::Misuse, "size", what).advice(advice));
        }
        if heights.iter().any(|h| h.is_nan()) {
            let what = "it has voids, which a mesh cannot leave out";
            return Err(Error::new(ErrorKind::Unsupported, "mesh", what).advice("choose a part without"));
        }
        let slopes = slopes(grid, heights);
        let views = [
            texture(
                gpu,
                size,
                wgpu::TextureFormat::R32Float,
                bytemuck::cast_slice(heights),
            ),
            texture(
                gpu,
                size,
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
        let module = module(gpu, "mesh.wgsl", SHADER)?;
        let layouts = [Some(headless.renderer().bind_group_layout()), Some(&layout)];
        let entries = ["vertex", "fragment"];
        Ok(Self {
            size,
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
                contents: bytemuck::cast_slice(&strip_indices(size[0])),
                usage: wgpu::BufferUsages::INDEX,
            }),
        })
    }

    pub fn triangles(&self) -> i64 {
        2 * (self.size[0] - 1) * (self.size[1] - 1)
    }

    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>, headless: &Headless) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, headless.textures().bind_group(), &[]);
        pass.set_bind_group(1, &self.group, &[]);
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        let [width, height] = self.size;
        let mut row = 0;
        while row < height - 1 {
            let rows = STRIP_ROWS.min(height - 1 - row);
            let indices = 6 * rows * (width - 1);
            pass.draw_indexed(0..indices as u32, (row * width) as i32, 0..1);
            row += rows;
        }
    }
}

/// The quads of [`STRIP_ROWS`] rows, split from north-west to south-east.
fn strip_indices(width: i64) -> Vec<u32> {
    let quads = (0..STRIP_ROWS).flat_map(|z| (0..width - 1).map(move |x| (x, z)));
    let corner = |x: i64, z: i64| (z * width + x) as u32;
    quads
        .flat_map(|(x, z)| {
            let [nw, ne] = [corner(x, z), corner(x + 1, z)];
            let [sw, se] = [corner(x, z + 1), corner(x + 1, z + 1)];
            [nw, sw, se, nw, se, ne]
        })
        .collect()
}

/// Slopes to the east and south at every sample, as the clipmap's light texels have them.
fn slopes(grid: &Grid, heights: &[f32]) -> Vec<[f16; 2]> {
    let (width, last) = (grid.size.width, [grid.size.width - 1, grid.size.height - 1]);
    let at = |i: i64, j: i64| f64::from(heights[(j * width + i) as usize]);
    let slope = |(i, j): (i64, i64)| {
        let ([west, east], [north, south]) = (
            [(i - 1).max(0), (i + 1).min(last[0])],
            [(j - 1).max(0), (j + 1).min(last[1])],
        );
        let slope_east = (at(east, j) - at(west, j)) / ((east - west) as f64 * grid.spacing_m[0]);
        let slope_south = (at(i, south) - at(i, north)) / ((south - north) as f64 * grid.spacing_m[1]);
        [slope_east, slope_south].map(f16::from_f64)
    };
    grid.size.rect().cells().map(slope).collect()
}

fn texture(gpu: &Gpu, size: [i64; 2], format: wgpu::TextureFormat, texels: &[u8]) -> wgpu::TextureView {
    let descriptor = wgpu::TextureDescriptor {
        label: Some("clipscape bench DEM"),
        size: wgpu::Extent3d {
            width: size[0] as u32,
            height: size[1] as u32,
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
