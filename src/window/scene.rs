//! The terrain as the window shows it: drawn into a texture of the window's size, which is then laid under the panel, and
//! which a picture is read back from.

use std::sync::Arc;

use super::settings::Settings;
use crate::camera::View;
use crate::clipmap::{Clipmap, UpdateReport, Wait};
use crate::error::{Error, Result};
use crate::gpu::{ClipmapRenderer, DrawReport, Gpu, RendererOptions, SkyRenderer, Targets, ViewTextures};
use crate::levels::Levels;
use crate::light::Sun;
use crate::render::COLOUR_FORMAT;
use crate::shade::ViewMode;
use crate::stream::{Arriving, Terrain};

/// The most pipelines that are kept: as many as there are looks.
const MOST_LOOKS: usize = 4 * ViewMode::NAMED.len();

/// What pipelines differ in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Look {
    view_mode: ViewMode,
    tint: bool,
    haze: bool,
}

impl Look {
    fn of(settings: &Settings) -> Self {
        Self {
            view_mode: settings.view_mode,
            tint: settings.tint,
            haze: settings.haze,
        }
    }
}

/// Terrain, its clipmap, and all that draws it on one device.
pub(super) struct Scene {
    terrain: Arc<Terrain>,
    arriving: Arriving,
    settings: Settings,
    /// The sun that light is traced with where the terrain does not say: that of the beginning.
    traced_sun: Sun,
    sample_count: u32,
    clipmap: Clipmap,
    /// Pipelines by what they show; the first is the one in use.
    renderers: Vec<(Look, ClipmapRenderer)>,
    sky: SkyRenderer,
    textures: ViewTextures,
    targets: Targets,
}

impl Scene {
    /// Prepares to draw `terrain` in pictures of `size_px` pixels. `traced_sun` is the sun of the light that is traced
    /// while it is shown, where it is.
    ///
    /// # Errors
    /// For settings out of range; those of reading the terrain and of the device.
    pub(super) fn new(
        gpu: &Gpu,
        terrain: Arc<Terrain>,
        settings: &Settings,
        traced_sun: Sun,
        sample_count: u32,
        size_px: [u32; 2],
    ) -> Result<Self> {
        let arriving = terrain.arriving();
        let clipmap = Clipmap::new(levels(&terrain, &arriving, settings), &settings.clipmap)?;
        let options = options(settings, sample_count, &clipmap);
        let renderer = ClipmapRenderer::new(&gpu.device, &options)?;
        let sun = sun(&terrain, clipmap.has_light(), traced_sun, settings);
        let mut textures = renderer.textures(&gpu.device, &clipmap, sun)?;
        set_time_of_day(&mut textures, &terrain, &clipmap, settings)?;
        Ok(Self {
            sky: SkyRenderer::new(&gpu.device, &options)?,
            targets: Targets::to_show(gpu, size_px, &options),
            renderers: vec![(Look::of(settings), renderer)],
            textures,
            clipmap,
            settings: *settings,
            traced_sun,
            sample_count,
            arriving,
            terrain,
        })
    }

    /// Takes over changed settings: as little is made anew as they allow.
    ///
    /// # Errors
    /// As [`Scene::new`]; then the settings in effect are those before.
    pub(super) fn apply(&mut self, gpu: &Gpu, settings: &Settings) -> Result<()> {
        if *settings == self.settings {
            return Ok(());
        }
        let look = Look::of(settings);
        match self.renderers.iter().position(|(l, _)| *l == look) {
            Some(k) => self.renderers.swap(0, k),
            None => {
                let options = options(settings, self.sample_count, &self.clipmap);
                let renderer = ClipmapRenderer::new(&gpu.device, &options)?;
                self.renderers.truncate(MOST_LOOKS - 1);
                self.renderers.insert(0, (look, renderer));
            }
        }
        let before = (self.clipmap.ring().clip_size, self.clipmap.windows().len());
        if !self.clipmap.adopt(&settings.clipmap)? {
            self.clipmap = Clipmap::new(levels(&self.terrain, &self.arriving, settings), &settings.clipmap)?;
        }
        let sun = self.sun_of(settings);
        if (self.clipmap.ring().clip_size, self.clipmap.windows().len()) == before {
            self.textures.set_sun(sun);
        } else {
            self.textures = self.renderers[0].1.textures(&gpu.device, &self.clipmap, sun)?;
        }
        set_time_of_day(&mut self.textures, &self.terrain, &self.clipmap, settings)?;
        self.settings = *settings;
        Ok(())
    }

    /// Draws in pictures of another size from now on.
    pub(super) fn resize(&mut self, gpu: &Gpu, size_px: [u32; 2]) {
        if size_px != self.targets.size_px() {
            self.targets = Targets::to_show(gpu, size_px, self.renderers[0].1.options());
        }
    }

    /// Moves the windows to the view's eye, selects what to draw, and records the uploads.
    ///
    /// # Errors
    /// For a view of other than finite numbers; those of reading the terrain and of the device.
    pub(super) fn update(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        view: &View,
        time_s: f64,
    ) -> Result<UpdateReport> {
        let levels = levels(&self.terrain, &self.arriving, &self.settings);
        let report = *self.clipmap.update(levels, view, time_s)?;
        self.follow_light(gpu)?;
        let renderer = &self.renderers[0].1;
        renderer.upload(encoder, &self.clipmap, &mut self.textures)?;
        Ok(report)
    }

    /// Where light has come that was traced meanwhile, other pipelines draw it.
    fn follow_light(&mut self, gpu: &Gpu) -> Result<()> {
        let has_light = self.clipmap.has_light();
        if has_light == self.renderers[0].1.options().traced_light {
            return Ok(());
        }
        let options = options(&self.settings, self.sample_count, &self.clipmap);
        let renderer = ClipmapRenderer::new(&gpu.device, &options)?;
        let sun = self.sun_of(&self.settings);
        self.textures = renderer.textures(&gpu.device, &self.clipmap, sun)?;
        set_time_of_day(&mut self.textures, &self.terrain, &self.clipmap, &self.settings)?;
        self.renderers = vec![(Look::of(&self.settings), renderer)];
        Ok(())
    }

    fn sun_of(&self, settings: &Settings) -> Sun {
        sun(&self.terrain, self.clipmap.has_light(), self.traced_sun, settings)
    }

    /// The sun of the traced light, where there is such.
    pub(super) fn traced_sun(&self) -> Option<Sun> {
        self.clipmap.has_light().then(|| self.sun_of(&self.settings))
    }

    /// Records the drawing of the last update.
    ///
    /// # Errors
    /// Those of the device.
    pub(super) fn record(&mut self, encoder: &mut wgpu::CommandEncoder) -> Result<DrawReport> {
        let renderer = &self.renderers[0].1;
        let mut pass = self.targets.pass(encoder, None);
        let report = renderer.draw(&mut pass, &self.clipmap, &self.textures)?;
        if matches!(self.settings.view_mode, ViewMode::Shaded | ViewMode::Wire) {
            self.sky.draw(&mut pass, &self.textures)?;
        }
        Ok(report)
    }

    /// What was drawn, encoded as it is to be shown.
    pub(super) fn shown(&self, encoded: bool) -> wgpu::TextureView {
        let bytes = COLOUR_FORMAT.remove_srgb_suffix();
        self.targets.colour().create_view(&wgpu::TextureViewDescriptor {
            label: Some("clipscape shown picture"),
            format: encoded.then_some(bytes),
            usage: Some(wgpu::TextureUsages::TEXTURE_BINDING),
            ..Default::default()
        })
    }

    /// The pixels that were drawn last, row by row from the top left: red, green, blue, alpha, sRGB; and their size.
    ///
    /// # Errors
    /// Those of the device.
    pub(super) fn pixels(&self, gpu: &Gpu) -> Result<([u32; 2], Vec<u8>)> {
        let rgba8 = gpu.read_texture(self.targets.colour(), 0)?;
        Ok((self.targets.size_px(), rgba8))
    }

    pub(super) fn clipmap(&self) -> &Clipmap {
        &self.clipmap
    }

    pub(super) fn terrain(&self) -> &Arc<Terrain> {
        &self.terrain
    }

    /// Least and greatest height of the DEM in metres.
    pub(super) fn range_m(&self) -> [f64; 2] {
        let base_m = self.clipmap.grid().base_m;
        self.clipmap.height_range_m().map(|h| f64::from(h) + base_m)
    }

    /// Whether nothing is on its way from the terrain.
    pub(super) fn is_idle(&self) -> bool {
        self.arriving.is_idle()
    }

    /// Faults of data since the last call.
    pub(super) fn take_faults(&mut self) -> Vec<Error> {
        let mut faults = self.clipmap.take_faults();
        faults.extend(self.terrain.faults());
        faults
    }
}

/// The terrain as it arrives, or waited for.
fn levels<'a>(terrain: &'a Arc<Terrain>, arriving: &'a Arriving, settings: &Settings) -> &'a dyn Levels {
    match settings.clipmap.wait {
        Wait::All => terrain.as_ref(),
        Wait::None => arriving,
    }
}

/// Sets the time whose light is shown, where light is of a day.
fn set_time_of_day(
    textures: &mut ViewTextures,
    terrain: &Terrain,
    clipmap: &Clipmap,
    settings: &Settings,
) -> Result<()> {
    match terrain.day().zip(settings.sun_hour) {
        Some((day, hour)) if clipmap.has_day() => textures.set_time_of_day(&day, day.time_of_hour(hour)),
        _ => Ok(()),
    }
}

/// The sun of the traced light, or the one that is set.
fn sun(terrain: &Terrain, has_light: bool, traced_sun: Sun, settings: &Settings) -> Sun {
    if has_light {
        terrain.sun().unwrap_or(traced_sun)
    } else {
        settings.sun
    }
}

fn options(settings: &Settings, sample_count: u32, clipmap: &Clipmap) -> RendererOptions {
    RendererOptions {
        colour_format: COLOUR_FORMAT,
        sample_count,
        view_mode: settings.view_mode,
        traced_light: clipmap.has_light(),
        day: clipmap.has_day(),
        tint: settings.tint,
        haze: settings.haze,
        ..Default::default()
    }
}

#[cfg(test)]
mod tests;
