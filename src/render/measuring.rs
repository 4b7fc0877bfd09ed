//! Measures frames: their depths, one a pixel, against the surface that they draw (cracks) and against `S0` (errors).

use super::headless::{COLOUR_FORMAT, HeadlessOptions};
use crate::accuracy::{DepthImage, FrameErrors, cracks, measure_drawn};
use crate::build::Threads;
use crate::camera::View;
use crate::clipmap::{Clipmap, Drawn};
use crate::error::Result;
use crate::gpu::{ClipmapRenderer, Gpu, RendererOptions, Targets, ViewTextures};
use crate::levels::Levels;
use crate::query::{Tiles, Truth};
use crate::shade::ViewMode;

/// What was measured of a frame.
#[derive(Clone, Debug)]
pub struct Measured {
    /// Its errors, pixel by pixel and summed up.
    pub errors: FrameErrors,
    /// Pixels that see through the drawn surface.
    pub cracks: u64,
}

/// What measuring takes beside the frame's own state.
pub(super) struct MeasuringPass {
    threads: Threads,
    tiles: Tiles,
    /// For frames of several samples a pixel: a second pass of one.
    single: Option<SinglePass>,
}

impl std::fmt::Debug for MeasuringPass {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("MeasuringPass")
            .field("threads", &self.threads.count())
            .field("tiles", &self.tiles)
            .field("single", &self.single)
            .finish()
    }
}

#[derive(Debug)]
struct SinglePass {
    renderer: ClipmapRenderer,
    targets: Targets,
}

impl MeasuringPass {
    /// For frames as in `options`.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Limit`] where the system starts no threads.
    pub(super) fn new(gpu: &Gpu, options: &HeadlessOptions) -> Result<Self> {
        Ok(Self {
            threads: Threads::new(0)?,
            tiles: Tiles::default(),
            single: (options.sample_count != 1)
                .then(|| SinglePass::new(gpu, options.size_px))
                .transpose()?,
        })
    }

    /// Draws the frame that `textures` hold once more, if its depth has several samples a pixel, and reads its depths
    /// back; `depth` is its own depth texture.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Device`] where the device failed.
    pub(super) fn depths(
        &self,
        gpu: &Gpu,
        clipmap: &Clipmap,
        textures: &ViewTextures,
        depth: &wgpu::Texture,
    ) -> Result<Vec<f32>> {
        let depth = match &self.single {
            None => depth,
            Some(single) => {
                single.draw(gpu, clipmap, textures)?;
                single.targets.depth()
            }
        };
        Ok(bytemuck::pod_collect_to_vec(&gpu.read_texture(depth, 0)?))
    }

    /// Errors of a frame of `levels`, from its depths.
    ///
    /// # Errors
    /// Those of `levels`.
    pub(super) fn errors(
        &self,
        levels: &dyn Levels,
        clipmap: &Clipmap,
        view: &View,
        depths: &[f32],
    ) -> Result<FrameErrors> {
        let truth = Truth::with_tiles(levels, clipmap.vertical_scale(), &self.tiles);
        let image = DepthImage::new(depths, view)?;
        measure_drawn(&truth, &Drawn::new(clipmap)?, &image, &self.threads)
    }

    /// Cracks of a frame, from its depths.
    ///
    /// # Errors
    /// Those of [`cracks()`].
    pub(super) fn cracks(&self, clipmap: &Clipmap, view: &View, depths: &[f32]) -> Result<u64> {
        let image = DepthImage::new(depths, view)?;
        Ok(cracks(&Drawn::new(clipmap)?, &image, &self.threads)?.len() as u64)
    }
}

impl SinglePass {
    fn new(gpu: &Gpu, size_px: [u32; 2]) -> Result<Self> {
        let options = RendererOptions {
            colour_format: COLOUR_FORMAT,
            view_mode: ViewMode::Level, // colours are not looked at
            traced_light: false,
            ..Default::default()
        };
        Ok(Self {
            renderer: ClipmapRenderer::new(&gpu.device, &options)?,
            targets: Targets::new(gpu, size_px, &options),
        })
    }

    fn draw(&self, gpu: &Gpu, clipmap: &Clipmap, textures: &ViewTextures) -> Result<()> {
        let mut encoder = gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor {
                label: Some("clipscape measured frame"),
            });
        let mut pass = self.targets.pass(&mut encoder, None);
        self.renderer.draw(&mut pass, clipmap, textures)?;
        drop(pass);
        gpu.queue.submit([encoder.finish()]);
        Ok(())
    }
}
