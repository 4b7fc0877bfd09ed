//! Draws the sky where no terrain is. Optional, and separate from the terrain.

use super::options::RendererOptions;
use super::renderer::{self, created};
use super::shader;
use super::textures::ViewTextures;
use crate::error::Result;

/// The sky's pipeline for one target format; shared by any number of views.
#[derive(Debug)]
pub struct SkyRenderer {
    pipeline: wgpu::RenderPipeline,
}

impl SkyRenderer {
    /// A sky for targets as in `options`.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Misuse`] for options that [`RendererOptions::check`] refuses.
    pub fn new(device: &wgpu::Device, options: &RendererOptions) -> Result<Self> {
        options.check(device)?;
        let module = shader::module(device, "sky.wgsl", &Default::default())?;
        let layout = renderer::pipeline_layout(device, &renderer::bind_group_layout(device));
        let constants = [
            ("ENCODE_SRGB", f64::from(u8::from(options.encodes_srgb()))),
            ("FAR_DEPTH", f64::from(options.clear_depth())),
        ];
        let compilation_options = wgpu::PipelineCompilationOptions {
            constants: &constants,
            ..Default::default()
        };
        let pipeline = created(device, "clipscape sky", || {
            device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some("clipscape sky"),
                layout: Some(&layout),
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: Some("vertex"),
                    compilation_options: compilation_options.clone(),
                    buffers: &[],
                },
                primitive: wgpu::PrimitiveState::default(),
                // It shows where depth is still as it was cleared.
                depth_stencil: Some(options.depth_state(false, wgpu::CompareFunction::Equal)),
                multisample: wgpu::MultisampleState {
                    count: options.sample_count,
                    ..Default::default()
                },
                fragment: Some(wgpu::FragmentState {
                    module: &module,
                    entry_point: Some("fragment"),
                    compilation_options,
                    targets: &[Some(options.colour_format.into())],
                }),
                multiview_mask: None,
                cache: None,
            })
        })?;
        Ok(Self { pipeline })
    }

    /// Draws the sky of the view whose update `textures` hold; after the terrain and all else, so that only what is left
    /// is shaded.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Misuse`] where nothing was uploaded into `textures`.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>, textures: &ViewTextures) -> Result<()> {
        textures.check_uploaded()?;
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, textures.bind_group(), &[]);
        pass.draw(0..3, 0..1);
        Ok(())
    }
}
