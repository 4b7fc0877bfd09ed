//! A caller's side of the library's face: its own encoders, targets and submissions.
#![allow(unreachable_pub, reason = "a module of test programs has no outside")]
#![allow(dead_code, reason = "each test program uses its own part of this")]

use clipscape::Clipmap;
use clipscape::camera::View;
use clipscape::clipmap::ClipmapOptions;
use clipscape::gpu::{ClipmapRenderer, Gpu, RendererOptions, Targets, ViewTextures};
use clipscape::levels::Levels;
use clipscape::light::Sun;

/// Pipelines for one kind of target.
pub struct Stage {
    pub gpu: Gpu,
    pub renderer: ClipmapRenderer,
    pub size_px: [u32; 2],
}

/// One view of a terrain.
pub struct Eye {
    pub clipmap: Clipmap,
    pub textures: ViewTextures,
}

impl Stage {
    pub fn new(gpu: &Gpu, options: &RendererOptions, size_px: [u32; 2]) -> Self {
        Self {
            gpu: gpu.clone(),
            renderer: ClipmapRenderer::new(&gpu.device, options).unwrap(),
            size_px,
        }
    }

    pub fn eye(&self, levels: &dyn Levels, clip_size: i64) -> Eye {
        let options = ClipmapOptions {
            clip_size,
            ..Default::default()
        };
        let clipmap = Clipmap::new(levels, &options).unwrap();
        let textures = self
            .renderer
            .textures(&self.gpu.device, &clipmap, Sun::default())
            .unwrap();
        Eye { clipmap, textures }
    }

    pub fn target(&self) -> Targets {
        Targets::new(&self.gpu, self.size_px, self.renderer.options())
    }

    pub fn encoder(&self) -> wgpu::CommandEncoder {
        self.gpu.device.create_command_encoder(&Default::default())
    }

    /// Records the upload and the drawing of what `eye` saw last.
    pub fn record(&self, encoder: &mut wgpu::CommandEncoder, eye: &mut Eye, target: &Targets) {
        self.renderer
            .upload(encoder, &eye.clipmap, &mut eye.textures)
            .unwrap();
        self.draw(encoder, eye, target);
    }

    /// Records the drawing of what was uploaded.
    pub fn draw(&self, encoder: &mut wgpu::CommandEncoder, eye: &Eye, target: &Targets) {
        let mut pass = target.pass(encoder, None);
        self.renderer
            .draw(&mut pass, &eye.clipmap, &eye.textures)
            .unwrap();
    }

    /// The picture of what `view` sees, drawn in a submission of its own.
    pub fn picture(&self, levels: &dyn Levels, eye: &mut Eye, view: &View) -> Targets {
        eye.clipmap.update(levels, view, 0.0).unwrap();
        let target = self.target();
        let mut encoder = self.encoder();
        self.record(&mut encoder, eye, &target);
        self.gpu.queue.submit([encoder.finish()]);
        target
    }

    pub fn colours(&self, target: &Targets) -> Vec<u8> {
        self.gpu.read_texture(target.colour(), 0).unwrap()
    }

    /// Depths of a target of 32-bit float.
    pub fn depths(&self, target: &Targets) -> Vec<f32> {
        bytemuck::pod_collect_to_vec(&self.gpu.read_texture(target.depth(), 0).unwrap())
    }
}
