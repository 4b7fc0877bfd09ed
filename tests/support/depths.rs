//! The depth image of one clipmap after another, by one set of pipelines.

use clipscape::Clipmap;
use clipscape::gpu::{ClipmapRenderer, Gpu, RendererOptions};
use clipscape::light::Sun;
use clipscape::shade::ViewMode;

/// Draws one clipmap after another into one picture's depth.
pub struct Depths {
    pub gpu: Gpu,
    renderer: ClipmapRenderer,
    colour: wgpu::Texture,
    depth: wgpu::Texture,
}

impl Depths {
    pub fn new(gpu: Gpu, size_px: [u32; 2]) -> Self {
        let options = RendererOptions {
            view_mode: ViewMode::Level,
            traced_light: false,
            ..Default::default()
        };
        Self {
            renderer: ClipmapRenderer::new(&gpu.device, &options).unwrap(),
            colour: gpu.target("clipscape test colour", size_px, options.colour_format),
            depth: gpu.target("clipscape test depth", size_px, options.depth_format),
            gpu,
        }
    }

    pub fn draw(&self, clipmap: &Clipmap) -> Vec<f32> {
        let device = &self.gpu.device;
        let mut textures = self.renderer.textures(device, clipmap, Sun::default()).unwrap();
        let mut encoder = device.create_command_encoder(&Default::default());
        self.renderer
            .upload(&mut encoder, clipmap, &mut textures)
            .unwrap();
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("clipscape test pass"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.colour.create_view(&Default::default()),
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth.create_view(&Default::default()),
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        self.renderer.draw(&mut pass, clipmap, &textures).unwrap();
        drop(pass);
        self.gpu.queue.submit([encoder.finish()]);
        bytemuck::pod_collect_to_vec(&self.gpu.read_texture(&self.depth, 0).unwrap())
    }
}
