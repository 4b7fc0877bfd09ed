//! What the benches share: a target of their own, timed draws into it, medians.
#![allow(unreachable_pub, reason = "a module of benches has no outside")]
#![allow(dead_code, reason = "each bench uses its own part of this")]

pub mod mesh;
pub mod rounds;

use std::time::Instant;

use clipscape::clipmap::ClipmapOptions;
use clipscape::gpu::{Gpu, Parts, RendererOptions};
use clipscape::render::{COLOUR_FORMAT, Headless, HeadlessOptions};
use clipscape::{Error, ErrorKind, Result};

/// The depth format drawn into, as [`Headless`] does.
const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// As the command line draws a DEM without traced light.
pub fn options(size_px: [u32; 2], cull: bool) -> HeadlessOptions {
    HeadlessOptions {
        size_px,
        traced_light: false,
        clipmap: ClipmapOptions {
            clip_size: 256,
            cull,
            ..Default::default()
        },
        ..Default::default()
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

/// What is drawn into.
pub struct Targets {
    gpu: Gpu,
    targets: clipscape::gpu::Targets,
}

impl Targets {
    pub fn new(gpu: &Gpu, size_px: [u32; 2]) -> Self {
        let options = RendererOptions {
            colour_format: COLOUR_FORMAT,
            depth_format: DEPTH_FORMAT,
            ..Default::default()
        };
        Self {
            targets: clipscape::gpu::Targets::new(gpu, size_px, &options),
            gpu: gpu.clone(),
        }
    }

    /// Clears and draws; wall milliseconds from recording until the device is done.
    pub fn draw_ms(&self, draw: impl FnOnce(&mut wgpu::RenderPass<'_>)) -> Result<f64> {
        let start = Instant::now();
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let mut pass = self.targets.pass(&mut encoder, None);
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
        let depth = self.gpu.read_texture(self.targets.depth(), 0)?;
        Ok((
            self.gpu.read_texture(self.targets.colour(), 0)?,
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

/// `met` where an aim is met.
pub fn met(aim: bool) -> &'static str {
    if aim { "met" } else { "not met" }
}
