//! The view of errors: once the camera rests, its frame is drawn and measured on a thread of its own.

use std::sync::Arc;

use super::loading::Loading;
use super::settings::Settings;
use crate::camera::View;
use crate::clipmap::{ClipmapOptions, Wait};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::render::{Headless, HeadlessOptions};
use crate::shade::ViewMode;
use crate::stream::Terrain;

/// What a picture of errors is of.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Subject {
    view: View,
    settings: Settings,
    sample_count: u32,
}

/// Pictures of errors, one after another.
#[derive(Default)]
pub(super) struct Measured {
    /// The one that is being made.
    job: Option<(Subject, Loading<Vec<u8>>)>,
    /// The one that was made last.
    picture: Option<(Subject, Vec<u8>)>,
}

/// How far it is.
pub(super) enum Progress {
    /// The picture of what is asked for is here; whether only since this call.
    Here(bool),
    /// It is being made, or another before it.
    Making,
}

impl Measured {
    /// Asks for the errors of what `view` shows with these settings.
    ///
    /// # Errors
    /// Those of drawing and measuring.
    pub(super) fn of(
        &mut self,
        gpu: &Gpu,
        terrain: &Arc<Terrain>,
        view: &View,
        settings: &Settings,
        sample_count: u32,
    ) -> Result<Progress> {
        let subject = Subject {
            view: *view,
            settings: *settings,
            sample_count,
        };
        let mut new = false;
        if let Some((of, job)) = &mut self.job
            && let Some(made) = job.poll()
        {
            let of = *of;
            self.job = None;
            self.picture = Some((of, made?));
            new = true;
        }
        if self.picture.as_ref().is_some_and(|(of, _)| *of == subject) {
            return Ok(Progress::Here(new));
        }
        if self.job.is_none() {
            let (gpu, terrain) = (gpu.clone(), terrain.clone());
            let job = Loading::start(move |_| measure(gpu, terrain, &subject))?;
            self.job = Some((subject, job));
        }
        Ok(Progress::Making)
    }

    /// The picture that was made last: its size and pixels.
    pub(super) fn picture(&self) -> Option<([u32; 2], &[u8])> {
        let (of, rgba8) = self.picture.as_ref()?;
        Some((of.view.size_px, rgba8))
    }
}

fn measure(gpu: Gpu, terrain: Arc<Terrain>, subject: &Subject) -> Result<Vec<u8>> {
    let settings = &subject.settings;
    let options = HeadlessOptions {
        size_px: subject.view.size_px,
        sample_count: subject.sample_count,
        view_mode: ViewMode::Error,
        tint: settings.tint,
        haze: settings.haze,
        traced_light: true,
        sun: settings.sun,
        clipmap: ClipmapOptions {
            wait: Wait::All,
            upload_budget_bytes: None,
            // Errors are laid over the light of the terrain's one sun.
            day: false,
            ..settings.clipmap
        },
    };
    let mut headless = Headless::new(gpu, terrain.as_ref(), &options)?;
    Ok(headless.frame_of(terrain.as_ref(), &subject.view, 0.0)?.rgba8)
}
