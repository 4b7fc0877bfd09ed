//! The score of a setting: measured frames against `S0`, their cracks, and their pictures against the exact ones.

use super::settings::Setting;
use super::sweep::{Sweep, cancel};
use crate::accuracy::{DepthImage, ErrorPool, Look, Shading, cracks, measure_drawn, psnr_db};
use crate::build::Threads;
use crate::camera::View;
use crate::clipmap::Drawn;
use crate::error::Result;
use crate::progress::Progress;
use crate::query::Truth;

/// The greatest value of a channel.
const PEAK: f64 = 255.0;

/// What frames are held against.
pub(super) struct Scene<'a> {
    truth: Truth<'a>,
    threads: &'a Threads,
    /// The measured frames, each with its exact picture.
    frames: Vec<(u64, Vec<u8>)>,
}

/// What the measured frames of a setting came to.
pub(super) struct Score {
    pub(super) pool: ErrorPool,
    pub(super) cracks: u64,
    pub(super) psnr_db: Option<f64>,
    /// Bytes of the windows' textures on the device.
    pub(super) texture_bytes: u64,
}

impl<'a> Scene<'a> {
    /// Draws the exact pictures of `frames`.
    pub(super) fn new(
        sweep: &'a Sweep<'_>,
        frames: &[u64],
        threads: &'a Threads,
        progress: &dyn Progress,
    ) -> Result<Self> {
        let levels = sweep.terrain.0;
        let truth = Truth::new(levels, sweep.options.clipmap.vertical_scale);
        let look = Look {
            sun: sweep.options.sun,
            traced_light: sweep.options.traced_light,
            tint: sweep.options.tint,
            haze: sweep.options.haze,
        };
        let shading = Shading::new(levels, &look)?;
        progress.begin("exact pictures", frames.len() as u64);
        let mut pictures = Vec::new();
        for &frame in frames {
            cancel(progress)?;
            let view = View::new(sweep.flight.camera_at_frame(frame), sweep.options.size_px)?;
            pictures.push((frame, shading.picture(&truth, &view, threads)?));
            progress.advance(1);
        }
        Ok(Self {
            truth,
            threads,
            frames: pictures,
        })
    }

    /// Draws and scores the measured frames.
    pub(super) fn score(
        &self,
        sweep: &Sweep<'_>,
        setting: &Setting,
        progress: &dyn Progress,
    ) -> Result<Score> {
        let levels = sweep.levels(setting).0;
        let mut headless = sweep.headless(setting)?;
        let (mut pool, mut crack_count, mut mean_square) = (ErrorPool::default(), 0, 0.0);
        for (frame, exact) in &self.frames {
            cancel(progress)?;
            let view = View::new(sweep.flight.camera_at_frame(*frame), sweep.options.size_px)?;
            let drawn = headless.frame_of(levels, &view, sweep.flight.time_of_frame_s(*frame))?;
            // All pictures have as many pixels, so their mean squares average.
            let ratio_db = psnr_db(&drawn.rgba8, exact).unwrap_or(f64::NAN);
            mean_square += PEAK * PEAK * 10f64.powf(-ratio_db / 10.0) / self.frames.len() as f64;
            let depths = headless.read_depth()?;
            let image = DepthImage::new(&depths, &view)?;
            let surface = Drawn::new(headless.clipmap())?;
            let errors = measure_drawn(&self.truth, &surface, &image, self.threads)?;
            pool.add(*frame, &errors);
            crack_count += cracks(&surface, &image, self.threads)?.len() as u64;
            progress.advance(1);
        }
        let textures = headless.textures();
        Ok(Score {
            pool,
            cracks: crack_count,
            psnr_db: (mean_square > 0.0).then(|| 10.0 * (PEAK * PEAK / mean_square).log10()),
            texture_bytes: texture_bytes(textures.heights()) + texture_bytes(textures.light()),
        })
    }
}

/// The bytes of a texture of one sample a texel without smaller levels.
fn texture_bytes(texture: &wgpu::Texture) -> u64 {
    let texel_bytes = texture.format().block_copy_size(None).map_or(0, u64::from);
    let size = texture.size();
    u64::from(size.width) * u64::from(size.height) * u64::from(size.depth_or_array_layers) * texel_bytes
}
