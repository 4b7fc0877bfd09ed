//! A frame of the flight: the camera moved, the clipmap updated, the terrain drawn, the panel's figures found.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use super::WindowOptions;
use super::controls::Held;
use super::files;
use super::measured::{Measured, Progress};
use super::motion::{Ground, Pilot};
use super::recorder::Recorder;
use super::scene::Scene;
use super::settings::Settings;
use super::text::{self, Facts, Under};
use crate::camera::{Camera, View, overview};
use crate::clipmap::{Clipmap, Drawn, certify};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::light::Sun;
use crate::query::Surface;
use crate::render::pictures::write_png;
use crate::shade::ViewMode;
use crate::stream::Terrain;

/// How often the surface may rise, as data arrive that show more of it, before the camera is let be for this frame.
const LIFTS: usize = 4;

/// Seconds from one look at what is under the pointer, and at what is certified, to the next.
const LOOK_S: f64 = 0.1;

/// Frames longer than this are as if they had taken so long: the camera does not leap after a pause.
const LONGEST_FRAME_S: f64 = 0.1;

/// The weight of the last frame in the smoothed time of frames.
const SMOOTHING: f64 = 0.1;

/// What is said while errors are being measured.
const MEASURING: &str = "The errors of this view are being measured";
const MOVING: &str = "Errors are measured once the camera rests and all data are there";

/// A flight over a terrain.
pub(super) struct Flying {
    pub(super) scene: Scene,
    pub(super) pilot: Pilot,
    pub(super) facts: Facts,
    recorder: Option<Recorder>,
    measured: Measured,
    /// Whether the picture of errors is of what is seen.
    errors_shown: bool,
    last_frame_s: Option<f64>,
    last_look_s: f64,
    traced_sun: Sun,
    sample_count: u32,
}

/// A frame's circumstances.
pub(super) struct Moment<'a> {
    pub(super) now_s: f64,
    pub(super) size_px: [u32; 2],
    pub(super) settings: &'a Settings,
    pub(super) held: &'a Held,
    /// The pointer in pixels from the upper left corner, where it is over the terrain.
    pub(super) pointer: Option<[f64; 2]>,
    /// Whether the frame before led straight to this one.
    pub(super) follows: bool,
}

/// What a frame asks for.
#[derive(Default)]
pub(super) struct Wants {
    /// Another frame, as something is still going on.
    pub(super) frame: bool,
    /// Another frame in a while, as something is being made.
    pub(super) look: bool,
    /// A new picture of errors is to be shown, or none any longer.
    pub(super) errors_changed: bool,
    /// What the view of errors waits for.
    pub(super) measuring: Option<&'static str>,
}

impl Flying {
    /// Begins with `camera`, or where none is asked for with a view of the whole.
    ///
    /// # Errors
    /// As for [`Scene::new`].
    pub(super) fn new(
        gpu: &Gpu,
        terrain: Arc<Terrain>,
        camera: Option<Camera>,
        settings: &Settings,
        traced_sun: Sun,
        sample_count: u32,
        size_px: [u32; 2],
    ) -> Result<Self> {
        let scene = Scene::new(gpu, terrain, settings, traced_sun, sample_count, size_px)?;
        let camera = camera.unwrap_or_else(|| whole(&scene, settings, size_px));
        Ok(Self {
            scene,
            pilot: Pilot::new(camera),
            facts: Facts::default(),
            recorder: None,
            measured: Measured::default(),
            errors_shown: false,
            last_frame_s: None,
            last_look_s: f64::NEG_INFINITY,
            traced_sun,
            sample_count,
        })
    }

    /// Goes on with another device.
    ///
    /// # Errors
    /// As for [`Scene::new`].
    pub(super) fn rebuild(&mut self, gpu: &Gpu, settings: &Settings, size_px: [u32; 2]) -> Result<()> {
        let terrain = self.scene.terrain().clone();
        self.scene = Scene::new(
            gpu,
            terrain,
            settings,
            self.traced_sun,
            self.sample_count,
            size_px,
        )?;
        self.measured = Measured::default();
        self.errors_shown = false;
        Ok(())
    }

    /// Draws a frame.
    ///
    /// # Errors
    /// Those of reading the terrain and of the device.
    pub(super) fn frame(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        moment: &Moment,
    ) -> Result<Wants> {
        let start = Instant::now();
        self.scene.apply(gpu, moment.settings)?;
        self.scene.resize(gpu, moment.size_px);
        let passed_s = self.passed_s(moment);
        let scale = moment.settings.clipmap.vertical_scale;
        let range_m = self.scene.range_m();
        on_ground(self.scene.clipmap(), scale, range_m, |ground| {
            self.pilot.advance(moment.held, passed_s, ground);
        });
        let mut uploaded = 0;
        let mut lifts_left = LIFTS;
        let view = loop {
            let view = View::new(self.pilot.camera, moment.size_px)?;
            uploaded += self.scene.update(gpu, encoder, &view, moment.now_s)?.upload_bytes;
            let lifted = on_ground(self.scene.clipmap(), scale, range_m, |ground| {
                self.facts.above_m = ground.above_m(self.pilot.camera.eye);
                lifts_left > 0 && self.pilot.keep_above(ground)
            });
            if !lifted {
                break view;
            }
            lifts_left -= 1;
        };
        let drew = self.scene.record(encoder)?;
        if let Some(recorder) = &mut self.recorder {
            recorder.follow(moment.now_s, &self.pilot.camera);
        }
        self.facts.update = *self.scene.clipmap().report();
        self.facts.update.upload_bytes = uploaded;
        self.facts.streamed_bytes += uploaded;
        (self.facts.triangles, self.facts.draw_calls) = (drew.triangles, drew.draw_calls);
        self.look(&view, moment)?;
        self.facts.cpu_ms = start.elapsed().as_secs_f64() * 1e3;

        let rests = self.pilot.rests(moment.held);
        // A draft is complete as far as it goes: what takes its place is looked for now and then.
        let update = &self.facts.update;
        let settled =
            (update.complete || update.provisional && update.stale_levels == 0) && self.scene.is_idle();
        let mut wants = Wants {
            frame: !rests || !settled || self.recorder.is_some(),
            look: update.provisional || self.scene.terrain().is_building(),
            ..Wants::default()
        };
        self.measure(
            gpu,
            &view,
            moment,
            rests && self.facts.update.complete,
            &mut wants,
        )?;
        Ok(wants)
    }

    /// Seconds since the frame before, as the camera is to move by them; and the time of frames.
    fn passed_s(&mut self, moment: &Moment) -> f64 {
        let passed_s = self
            .last_frame_s
            .map_or(0.0, |last| (moment.now_s - last).max(0.0));
        self.last_frame_s = Some(moment.now_s);
        if !moment.follows {
            return 0.0;
        }
        let ms = passed_s * 1e3;
        self.facts.frame_ms = Some(match self.facts.frame_ms {
            Some(before) => before + (ms - before) * SMOOTHING,
            None => ms,
        });
        passed_s.min(LONGEST_FRAME_S)
    }

    /// What the panel says that takes a while to find.
    fn look(&mut self, view: &View, moment: &Moment) -> Result<()> {
        let camera = &self.pilot.camera;
        (self.facts.heading_deg, self.facts.pitch_deg) = (camera.heading_deg, camera.pitch_deg);
        let grid = *self.scene.clipmap().grid();
        let spacing_m = (grid.spacing_m[0] * grid.spacing_m[1]).sqrt();
        self.facts.speed_m_per_s = self
            .pilot
            .speed_m_per_s(self.facts.above_m, spacing_m, moment.held);
        if moment.follows && moment.now_s - self.last_look_s < LOOK_S {
            return Ok(());
        }
        self.last_look_s = moment.now_s;
        let clipmap = self.scene.clipmap();
        self.facts.certificate = Some(certify(clipmap)?);
        let hit = match moment.pointer {
            Some(pixel) => Drawn::new(clipmap)?.pick(view, pixel)?,
            None => None,
        };
        let place = self.scene.terrain().place();
        self.facts.under = hit.map(|hit| Under {
            place: text::place(hit.point, &grid, place),
            height_m: hit.point.y,
            distance_m: hit.distance_m,
            level: hit.level,
        });
        Ok(())
    }

    fn measure(
        &mut self,
        gpu: &Gpu,
        view: &View,
        moment: &Moment,
        still: bool,
        wants: &mut Wants,
    ) -> Result<()> {
        let was_shown = std::mem::take(&mut self.errors_shown);
        if moment.settings.view_mode == ViewMode::Error {
            if still {
                let terrain = self.scene.terrain().clone();
                let progress = self
                    .measured
                    .of(gpu, &terrain, view, moment.settings, self.sample_count)?;
                match progress {
                    Progress::Here(new) => {
                        self.errors_shown = true;
                        wants.errors_changed = new;
                    }
                    Progress::Making => {
                        wants.measuring = Some(MEASURING);
                        wants.look = true;
                    }
                }
            } else {
                wants.measuring = Some(MOVING);
            }
        }
        wants.errors_changed |= was_shown != self.errors_shown;
        Ok(())
    }

    /// The picture of errors, where it is of what is seen.
    pub(super) fn errors(&self) -> Option<([u32; 2], &[u8])> {
        self.measured.picture().filter(|_| self.errors_shown)
    }

    /// Shows the whole.
    pub(super) fn show_whole(&mut self, settings: &Settings, size_px: [u32; 2], now_s: f64) {
        let (from, to) = (self.pilot.camera, whole(&self.scene, settings, size_px));
        if let Some(recorder) = &mut self.recorder {
            recorder.jump(now_s, &from, &to);
        }
        self.pilot.place(to);
    }

    /// Seconds of the flight that is being recorded.
    pub(super) fn recording_s(&self, now_s: f64) -> Option<f64> {
        self.recorder.as_ref().map(|r| r.length_s(now_s))
    }

    /// Begins to record; or where it has begun, ends and writes the flight, and returns its path and length in seconds.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub(super) fn record(&mut self, options: &WindowOptions, now_s: f64) -> Result<Option<(PathBuf, f64)>> {
        let Some(recorder) = self.recorder.take() else {
            self.recorder = Some(Recorder::new(now_s, &self.pilot.camera));
            return Ok(None);
        };
        let flight = recorder.finish(now_s, &self.pilot.camera)?;
        let write = |path: &Path| files::write_text(path, &flight.to_json());
        let path = files::write_new(&options.folder, &options.stem, ".json", write)?;
        Ok(Some((path, flight.end_s())))
    }

    /// Writes what is shown, without the panel.
    ///
    /// # Errors
    /// Where it cannot be read back or written.
    pub(super) fn picture(&self, gpu: &Gpu, options: &WindowOptions) -> Result<PathBuf> {
        let ([width, height], rgba8) = match self.errors() {
            Some((size_px, rgba8)) => (size_px, rgba8.to_vec()),
            None => self.scene.pixels(gpu)?,
        };
        let write = |path: &Path| write_png(path, width, height, &rgba8);
        files::write_new(&options.folder, &options.stem, ".png", write)
    }
}

/// The camera that shows the whole.
fn whole(scene: &Scene, settings: &Settings, size_px: [u32; 2]) -> Camera {
    let scale = settings.clipmap.vertical_scale;
    let [a, b] = scene.range_m().map(|h| h * scale);
    let aspect = f64::from(size_px[0]) / f64::from(size_px[1]);
    overview(scene.clipmap().grid(), a.min(b), a.max(b), aspect).scaled_down(scale)
}

/// Asks about the ground as it was drawn last; before the first frame there is none.
fn on_ground<T>(
    clipmap: &Clipmap,
    vertical_scale: f64,
    range_m: [f64; 2],
    ask: impl FnOnce(&Ground) -> T,
) -> T {
    let drawn = Drawn::new(clipmap).ok();
    let height_m = |x: f64, z: f64| drawn.as_ref()?.height_at(x, z).ok().flatten();
    ask(&Ground {
        grid: clipmap.grid(),
        vertical_scale,
        range_m,
        height_m: &height_m,
    })
}
