//! One view's state on the GPU, as the caller holds it: which update of which clipmap is there, and what may follow.

use super::options::RendererOptions;
use super::resident::{Resident, UploadReport};
use super::staging::Staging;
use crate::clipmap::{Clipmap, Ring};
use crate::error::{Error, ErrorKind, Result};
use crate::light::{Day, Sun};
use crate::shade::ShadeConstants;

/// An update of a clipmap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Update {
    clipmap: u64,
    generation: u64,
}

impl Update {
    fn of(clipmap: &Clipmap) -> Self {
        Self {
            clipmap: clipmap.identity(),
            generation: clipmap.generation(),
        }
    }

    fn follows(self, before: Self) -> bool {
        self.clipmap == before.clipmap && self.generation == before.generation + 1
    }
}

/// One view's state on the GPU. Made by [`super::ClipmapRenderer::textures`].
#[derive(Debug)]
pub struct ViewTextures {
    ring: Ring,
    levels: u32,
    resident: Resident,
    staging: Staging,
    /// The update that was recorded last; none where the textures' contents are unknown.
    recorded: Option<Update>,
    sun: Sun,
    /// Whether there is room for light over a day, and its time.
    day: bool,
    time_of_day: f64,
}

impl ViewTextures {
    pub(super) fn new(
        device: &wgpu::Device,
        layout: &wgpu::BindGroupLayout,
        sampler: &wgpu::Sampler,
        clipmap: &Clipmap,
        sun: Sun,
    ) -> Result<Self> {
        let (ring, levels) = (*clipmap.ring(), clipmap.windows().len() as u32);
        let limits = device.limits();
        for (what, needed, provided) in [
            (
                "texels along a side of a texture",
                ring.light_size() as u32,
                limits.max_texture_dimension_2d,
            ),
            (
                "layers of a texture",
                levels * (1 + u32::from(clipmap.has_day())),
                limits.max_texture_array_layers,
            ),
        ] {
            if needed > provided {
                let what = format!("needs {needed} {what}, the device has {provided}");
                return Err(Error::new(ErrorKind::Limit, "textures", what).advice("use a smaller clip size"));
            }
        }
        Ok(Self {
            ring,
            levels,
            resident: Resident::new(device, layout, sampler, &ring, levels, clipmap.has_day()),
            staging: Staging::new(device),
            recorded: None,
            sun,
            day: clipmap.has_day(),
            time_of_day: 0.0,
        })
    }

    /// Sets the sun by which slopes are lit where no light was traced, and around which the sky glows. It shines from the
    /// next upload on.
    pub fn set_sun(&mut self, sun: Sun) {
        self.sun = sun;
    }

    /// Sets the time of `day` whose light is shown, -1 to 1 (see [`Day::time_of_hour`]), and the sun of that time, from the
    /// next upload on.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] for a time of other than finite numbers.
    pub fn set_time_of_day(&mut self, day: &Day, time: f64) -> Result<()> {
        self.sun = day.sun(time)?;
        self.time_of_day = time;
        Ok(())
    }

    /// The height texture: R32Float, clip size squared, a layer per level.
    pub fn heights(&self) -> &wgpu::Texture {
        &self.resident.heights
    }

    /// The light texture: Rgba16Float, twice the clip size squared, a layer per level; where light over a day is held, as
    /// many layers of that behind them.
    pub fn light(&self) -> &wgpu::Texture {
        &self.resident.light
    }

    /// The constants, textures and sampler as a group for [`super::ClipmapRenderer::bind_group_layout`].
    pub fn bind_group(&self) -> &wgpu::BindGroup {
        &self.resident.bind_group
    }

    pub(super) fn instances(&self) -> &wgpu::Buffer {
        &self.resident.instances
    }

    /// Records the clipmap's last update into `encoder`: what leads to it from the one before where that is here, else
    /// whole windows.
    pub(super) fn upload(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        clipmap: &Clipmap,
        options: &RendererOptions,
    ) -> Result<UploadReport> {
        self.check(clipmap, options)?;
        let now = Update::of(clipmap);
        // Until all is recorded, what the textures will hold is unknown.
        let before = self.recorded.take().filter(|_| !self.staging.was_dropped());
        if before.is_none_or(|before| before.clipmap != now.clipmap) {
            self.resident.forget();
        }
        let mut shade = ShadeConstants::new(
            &self.sun,
            clipmap.height_range_m(),
            clipmap.grid().base_m,
            clipmap.vertical_scale(),
            clipmap.view_constants().eye_height_m[0],
        );
        shade.day_time = self.time_of_day as f32;
        let mut upload = self.staging.begin(encoder);
        let recorded = if before == Some(now) {
            self.resident
                .frame(&mut upload, clipmap, &shade)
                .map(|()| UploadReport::default())
        } else {
            let follows = before.is_some_and(|before| now.follows(before));
            self.resident.record(&mut upload, clipmap, &shade, follows)
        };
        upload.finish();
        let report = recorded?;
        self.recorded = Some(now);
        Ok(report)
    }

    /// Refuses to draw what is not here: another clipmap, another of its updates, or one whose encoder was dropped.
    pub(super) fn check_drawable(&self, clipmap: &Clipmap, options: &RendererOptions) -> Result<()> {
        self.check(clipmap, options)?;
        self.check_uploaded()?;
        if self.recorded == Some(Update::of(clipmap)) {
            return Ok(());
        }
        Err(Error::new(
            ErrorKind::Misuse,
            "textures",
            "do not hold the clipmap's last update",
        )
        .advice("upload it before drawing"))
    }

    /// Refuses to draw where nothing was uploaded, or what was recorded will never be submitted.
    pub(super) fn check_uploaded(&self) -> Result<()> {
        if self.recorded.is_some() && !self.staging.was_dropped() {
            return Ok(());
        }
        Err(Error::new(ErrorKind::Misuse, "textures", "hold no update")
            .advice("upload one before drawing, and submit the encoder that it was recorded into"))
    }

    /// Refuses a clipmap of other sizes or one that has seen nothing yet, and views that pipelines for `options` cannot
    /// draw.
    fn check(&self, clipmap: &Clipmap, options: &RendererOptions) -> Result<()> {
        let (ring, levels) = (clipmap.ring(), clipmap.windows().len() as u32);
        if (self.ring.clip_size, self.levels) != (ring.clip_size, levels) {
            let what = format!(
                "are made for {} levels of clip size {}, not for {levels} of {}",
                self.levels, self.ring.clip_size, ring.clip_size
            );
            return Err(Error::new(ErrorKind::Misuse, "textures", what)
                .advice("make textures for each clipmap from itself"));
        }
        if clipmap.generation() == 0 {
            return Err(
                Error::new(ErrorKind::Misuse, "clipmap", "has not been updated yet")
                    .advice("update it before uploading"),
            );
        }
        if [self.day, options.day] != [clipmap.has_day(); 2] {
            let what = "light over a day is drawn, or held, by one of pipelines, textures and clipmap alone";
            return Err(Error::new(ErrorKind::Misuse, "textures", what).advice(
                "set RendererOptions::day as Clipmap::has_day says, and make textures from that clipmap",
            ));
        }
        options.check_view(clipmap)
    }
}
