//! The depth image of one clipmap after another, by one set of pipelines.

use clipscape::Clipmap;
use clipscape::gpu::{ClipmapRenderer, Gpu, RendererOptions, Targets};
use clipscape::light::Sun;
use clipscape::shade::ViewMode;

/// Draws one clipmap after another into one picture's depth.
pub struct Depths {
    pub gpu: Gpu,
    renderer: ClipmapRenderer,
    targets: Targets,
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
            targets: Targets::new(&gpu, size_px, &options),
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
        let mut pass = self.targets.pass(&mut encoder, None);
        self.renderer.draw(&mut pass, clipmap, &textures).unwrap();
        drop(pass);
        self.gpu.queue.submit([encoder.finish()]);
        bytemuck::pod_collect_to_vec(&self.gpu.read_texture(self.targets.depth(), 0).unwrap())
    }
}
