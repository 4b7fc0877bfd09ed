//! The score of a setting: measured frames against `S0`, and their cracks.

use super::settings::Setting;
use super::sweep::{Sweep, cancel};
use crate::accuracy::{DepthImage, ErrorPool, cracks, measure};
use crate::build::Threads;
use crate::camera::View;
use crate::clipmap::Drawn;
use crate::error::Result;
use crate::progress::Progress;
use crate::query::Truth;

/// What frames are held against.
pub(super) struct Scene<'a> {
    truth: Truth<'a>,
    threads: &'a Threads,
}

/// What the measured frames of a setting came to.
pub(super) struct Score {
    pub(super) pool: ErrorPool,
    pub(super) cracks: u64,
    /// Bytes of the windows' textures on the device.
    pub(super) texture_bytes: u64,
}

impl<'a> Scene<'a> {
    pub(super) fn new(sweep: &'a Sweep<'_>, threads: &'a Threads) -> Result<Self> {
        Ok(Self {
            truth: Truth::new(sweep.terrain.0, sweep.options.clipmap.vertical_scale),
            threads,
        })
    }

    /// Draws and scores `frames`.
    pub(super) fn score(
        &self,
        sweep: &Sweep<'_>,
        setting: &Setting,
        frames: &[u64],
        progress: &dyn Progress,
    ) -> Result<Score> {
        let levels = sweep.levels(setting).0;
        let mut headless = sweep.headless(setting)?;
        let mut score = Score {
            pool: ErrorPool::default(),
            cracks: 0,
            texture_bytes: texture_bytes(headless.textures().heights())
                + texture_bytes(headless.textures().light()),
        };
        for &frame in frames {
            cancel(progress)?;
            let view = View::new(sweep.flight.camera_at_frame(frame), sweep.options.size_px)?;
            headless.frame_of(levels, &view, sweep.flight.time_of_frame_s(frame))?;
            let depths = headless.read_depth()?;
            let image = DepthImage::new(&depths, &view)?;
            score
                .pool
                .add(frame, &measure(&self.truth, &image, self.threads)?);
            score.cracks += cracks(&Drawn::new(headless.clipmap())?, &image, self.threads)?.len() as u64;
            progress.advance(1);
        }
        Ok(score)
    }
}

/// The bytes of a texture of one sample a texel without smaller levels.
pub(super) fn texture_bytes(texture: &wgpu::Texture) -> u64 {
    let texel_bytes = texture.format().block_copy_size(None).map_or(0, u64::from);
    let size = texture.size();
    u64::from(size.width) * u64::from(size.height) * u64::from(size.depth_or_array_layers) * texel_bytes
}
