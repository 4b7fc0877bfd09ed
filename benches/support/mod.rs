//! What the benches share: a target of their own, timed draws into it, medians.
#![allow(unreachable_pub, reason = "a module of benches has no outside")]
#![allow(dead_code, reason = "each bench uses its own part of this")]

pub mod mesh;

use std::time::Instant;

use clipscape::clipmap::ClipmapOptions;
use clipscape::gpu::{Gpu, Parts};
use clipscape::light::Sun;
use clipscape::render::{COLOUR_FORMAT, Headless, HeadlessOptions};
use clipscape::shade::ViewMode;
use clipscape::{Error, ErrorKind, Result};

/// The depth format drawn into, as [`Headless`] does.
const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// As the command line draws a DEM without traced light.
pub fn options(size_px: [u32; 2], cull: bool) -> HeadlessOptions {
    HeadlessOptions {
        size_px,
        sample_count: 1,
        view_mode: ViewMode::Shaded,
        tint: true,
        haze: true,
        traced_light: false,
        sun: Sun::default(),
        clipmap: ClipmapOptions {
            clip_size: 256,
            cull,
            ..Default::default()
        },
    }
}

/// The shader constants of [`options`], for pipelines of a bench's own.
pub fn shader_constants() -> [(&'static str, f64); 4] {
    [
        ("TRACED_LIGHT", 0.0),
        ("TINT", 1.0),
        ("HAZE", 1.0),
        ("ENCODE_SRGB", f64::from(u8::from(!COLOUR_FORMAT.is_srgb()))),
    ]
}

/// A colour and a depth texture.
pub struct Targets {
    gpu: Gpu,
    colour: wgpu::Texture,
    depth: wgpu::Texture,
}

impl Targets {
    pub fn new(gpu: &Gpu, size_px: [u32; 2]) -> Self {
        Self {
            colour: gpu.target("clipscape bench colour", size_px, COLOUR_FORMAT),
            depth: gpu.target("clipscape bench depth", size_px, DEPTH_FORMAT),
            gpu: gpu.clone(),
        }
    }

    /// Clears and draws; wall milliseconds from recording until the device is done.
    pub fn draw_ms(&self, draw: impl FnOnce(&mut wgpu::RenderPass<'_>)) -> Result<f64> {
        let start = Instant::now();
        let [colour, depth] = [&self.colour, &self.depth].map(|t| t.create_view(&Default::default()));
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("clipscape bench"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &colour,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        draw(&mut pass);
        drop(pass);
        self.gpu.queue.submit([encoder.finish()]);
        wait(&self.gpu)?;
        Ok(start.elapsed().as_secs_f64() * 1e3)
    }

    /// The same for a clipmap as it was brought up to date last.
    pub fn clipmap_ms(&self, headless: &Headless) -> Result<f64> {
        let mut drawn = Ok(Default::default());
        let ms = self.draw_ms(|pass| {
            drawn = headless
                .renderer()
                .draw(pass, headless.clipmap(), headless.textures());
        })?;
        drawn.map(|_| ms)
    }

    /// Red, green, blue, alpha of each pixel, and the depths.
    pub fn read(&self) -> Result<(Vec<u8>, Vec<f32>)> {
        let depth = self.gpu.read_texture(&self.depth, 0)?;
        Ok((
            self.gpu.read_texture(&self.colour, 0)?,
            bytemuck::pod_collect_to_vec(&depth),
        ))
    }
}

/// Waits until the device has done all that was submitted.
pub fn wait(gpu: &Gpu) -> Result<()> {
    let done = gpu.device.poll(wgpu::PollType::wait_indefinitely());
    done.map(drop).map_err(|e| {
        let what = format!("the device does not answer ({e})");
        Error::new(ErrorKind::Device, "graphics", what)
    })
}

/// A pipeline that draws triangles of `module` as the terrain's own pipelines do.
pub fn pipeline(
    gpu: &Gpu,
    label: &str,
    module: &wgpu::ShaderModule,
    layouts: &[Option<&wgpu::BindGroupLayout>],
    constants: &[(&str, f64)],
    [vertex, fragment]: [&str; 2],
    buffers: &[Option<wgpu::VertexBufferLayout<'_>>],
) -> wgpu::RenderPipeline {
    let layout = gpu
        .device
        .create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(label),
            bind_group_layouts: layouts,
            immediate_size: 0,
        });
    let compilation_options = wgpu::PipelineCompilationOptions {
        constants,
        ..Default::default()
    };
    gpu.device
        .create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(label),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module,
                entry_point: Some(vertex),
                compilation_options: compilation_options.clone(),
                buffers,
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH_FORMAT,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module,
                entry_point: Some(fragment),
                compilation_options,
                targets: &[Some(COLOUR_FORMAT.into())],
            }),
            multiview_mask: None,
            cache: None,
        })
}

/// The module of a shader text that may import the crate's own parts.
pub fn module(gpu: &Gpu, name: &str, text: &str) -> Result<wgpu::ShaderModule> {
    let composed = clipscape::gpu::compose(name, text, &Parts::default())
        .map_err(|e| Error::new(ErrorKind::Misuse, "shader", e.to_string()).because(e))?;
    Ok(gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(name),
        source: wgpu::ShaderSource::Wgsl(composed.source.into()),
    }))
}

/// The `percent`-th percentile of values in any order.
pub fn percentile(values: &[f64], percent: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    clipscape::stats::percentile(&sorted, percent)
}

pub fn median(values: &[f64]) -> f64 {
    percentile(values, 50.0)
}

/// `met` where an aim is met.
pub fn met(aim: bool) -> &'static str {
    if aim { "met" } else { "not met" }
}
