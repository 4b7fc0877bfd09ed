//! A caller's side of the library's face: targets of its own, and its own passes.
#![allow(unreachable_pub, reason = "a module of test programs has no outside")]
#![allow(dead_code, reason = "each test program uses its own part of this")]

use clipscape::Clipmap;
use clipscape::camera::View;
use clipscape::clipmap::ClipmapOptions;
use clipscape::gpu::{ClipmapRenderer, Gpu, RendererOptions, ViewTextures};
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

/// A picture's textures.
pub struct Target {
    pub colour: wgpu::Texture,
    multisampled: Option<wgpu::Texture>,
    pub depth: wgpu::Texture,
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

    pub fn target(&self) -> Target {
        let options = self.renderer.options();
        let texture = |format, sample_count| {
            self.gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: None,
                size: wgpu::Extent3d {
                    width: self.size_px[0],
                    height: self.size_px[1],
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: if sample_count == 1 {
                    wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC
                } else {
                    wgpu::TextureUsages::RENDER_ATTACHMENT
                },
                view_formats: &[],
            })
        };
        let samples = options.sample_count;
        Target {
            colour: texture(options.colour_format, 1),
            multisampled: (samples > 1).then(|| texture(options.colour_format, samples)),
            depth: texture(options.depth_format, samples),
        }
    }

    pub fn encoder(&self) -> wgpu::CommandEncoder {
        self.gpu.device.create_command_encoder(&Default::default())
    }

    /// A pass over cleared targets, in which `draw` draws.
    pub fn pass(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        target: &Target,
        draw: impl FnOnce(&mut wgpu::RenderPass<'_>),
    ) {
        let view = |t: &wgpu::Texture| t.create_view(&Default::default());
        let (colour, depth) = (view(&target.colour), view(&target.depth));
        let multisampled = target.multisampled.as_ref().map(view);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: multisampled.as_ref().unwrap_or(&colour),
                depth_slice: None,
                resolve_target: multisampled.as_ref().map(|_| &colour),
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(self.renderer.options().clear_depth()),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: target
                    .depth
                    .format()
                    .has_stencil_aspect()
                    .then_some(wgpu::Operations {
                        load: wgpu::LoadOp::Clear(0),
                        store: wgpu::StoreOp::Discard,
                    }),
            }),
            ..Default::default()
        });
        draw(&mut pass);
    }

    /// Records the upload and the drawing of what `eye` saw last.
    pub fn record(&self, encoder: &mut wgpu::CommandEncoder, eye: &mut Eye, target: &Target) {
        self.renderer
            .upload(encoder, &eye.clipmap, &mut eye.textures)
            .unwrap();
        self.pass(encoder, target, |pass| {
            self.renderer.draw(pass, &eye.clipmap, &eye.textures).unwrap();
        });
    }

    /// The picture of what `view` sees, drawn in a submission of its own.
    pub fn picture(&self, levels: &dyn Levels, eye: &mut Eye, view: &View) -> Target {
        eye.clipmap.update(levels, view, 0.0).unwrap();
        let target = self.target();
        let mut encoder = self.encoder();
        self.record(&mut encoder, eye, &target);
        self.gpu.queue.submit([encoder.finish()]);
        target
    }

    pub fn colours(&self, target: &Target) -> Vec<u8> {
        self.gpu.read_texture(&target.colour, 0).unwrap()
    }

    /// Depths of a target of 32-bit float.
    pub fn depths(&self, target: &Target) -> Vec<f32> {
        bytemuck::pod_collect_to_vec(&self.gpu.read_texture(&target.depth, 0).unwrap())
    }
}
