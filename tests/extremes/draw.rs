//! Small frames and what is read back of them.

use clipscape::camera::Camera;
use clipscape::clipmap::ClipmapOptions;
use clipscape::gpu::{ClipmapRenderer, Gpu, RendererOptions, Targets, ViewTextures};
use clipscape::levels::Levels;
use clipscape::light::Sun;
use clipscape::render::{Headless, HeadlessOptions};
use half::f16;

/// Shaded, with all that shading does; clip size 64.
pub(crate) fn options(size_px: [u32; 2]) -> HeadlessOptions {
    HeadlessOptions {
        size_px,
        clipmap: ClipmapOptions {
            clip_size: 64,
            ..Default::default()
        },
        ..Default::default()
    }
}

pub(crate) fn headless(gpu: &Gpu, levels: &dyn Levels, options: &HeadlessOptions) -> Headless {
    Headless::new(gpu.clone(), levels, options).unwrap()
}

/// A frame read back.
#[derive(Debug, PartialEq)]
pub(crate) struct Picture {
    pub(crate) rgba8: Vec<u8>,
    pub(crate) depth: Vec<f32>,
}

impl Picture {
    /// Pixels of which colour or depth differ in any bit.
    pub(crate) fn differing(&self, other: &Self) -> usize {
        let pixels = self.depth.len();
        assert_eq!(pixels, other.depth.len());
        let bits = |picture: &Self, k: usize| {
            (
                picture.rgba8[4 * k..4 * k + 4].to_vec(),
                picture.depth[k].to_bits(),
            )
        };
        (0..pixels).filter(|&k| bits(self, k) != bits(other, k)).count()
    }

    pub(crate) fn terrain_pixels(&self) -> usize {
        self.depth.iter().filter(|d| **d != 0.0).count()
    }
}

pub(crate) fn frame(headless: &mut Headless, levels: &dyn Levels, camera: &Camera) -> Picture {
    let rgba8 = headless.frame(levels, camera, 0.0).unwrap().rgba8;
    let depth = headless.read_depth().unwrap();
    Picture { rgba8, depth }
}

/// Draws what a [`Headless`] drew last into a target of floats, in which colours that are no number can be seen.
pub(crate) struct Floats {
    renderer: ClipmapRenderer,
    textures: ViewTextures,
    targets: Targets,
    /// Red of the pixels that show no terrain.
    pub(crate) background: f64,
}

impl Floats {
    pub(crate) fn new(headless: &Headless, size_px: [u32; 2]) -> Self {
        let device = &headless.gpu().device;
        let options = RendererOptions {
            colour_format: wgpu::TextureFormat::Rgba16Float,
            traced_light: headless.clipmap().has_light(),
            ..Default::default()
        };
        let renderer = ClipmapRenderer::new(device, &options).unwrap();
        Self {
            textures: renderer
                .textures(device, headless.clipmap(), Sun::default())
                .unwrap(),
            renderer,
            targets: Targets::new(headless.gpu(), size_px, &options),
            background: 0.0,
        }
    }

    /// Pixels with a channel outside 0 to 1, or that is no number.
    pub(crate) fn unfit_pixels(&mut self, headless: &Headless) -> usize {
        let gpu = headless.gpu();
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        self.renderer
            .upload(&mut encoder, headless.clipmap(), &mut self.textures)
            .unwrap();
        let [view, depth] =
            [self.targets.colour(), self.targets.depth()].map(|t| t.create_view(&Default::default()));
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color {
                        r: self.background,
                        ..wgpu::Color::BLACK
                    }),
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
        self.renderer
            .draw(&mut pass, headless.clipmap(), &self.textures)
            .unwrap();
        drop(pass);
        gpu.queue.submit([encoder.finish()]);
        let bytes = gpu.read_texture(self.targets.colour(), 0).unwrap();
        let texels: Vec<[u16; 4]> = bytemuck::pod_collect_to_vec(&bytes);
        let fit = |channel: &u16| (0.0..=1.0).contains(&f16::from_bits(*channel).to_f32());
        texels.iter().filter(|texel| !texel.iter().all(fit)).count()
    }
}
