//! The window and what is in it: the terrain that is opened, a frame drawn whenever one is wanted, what is said and
//! written. [`events`] calls it.

mod events;

use std::sync::Arc;
use std::time::{Duration, Instant};

use winit::dpi::{PhysicalPosition, PhysicalSize};
use winit::event_loop::ActiveEventLoop;
use winit::window::Window;

use super::controls::Held;
use super::flying::{Flying, Moment};
use super::graphics::{Acquired, Graphics};
use super::loading::Loading;
use super::overlay::Overlay;
use super::panel::{Changed, Shown};
use super::settings::Settings;
use super::text::{self, Facts};
use super::{Open, Place, WindowOptions};
use crate::camera::Camera;
use crate::error::{Error, ErrorKind, Result};
use crate::progress::Progress;
use crate::stream::Terrain;

/// The hour by the sun at which light of a day is shown at first.
const FIRST_HOUR: f64 = 10.0;

/// Seconds for which a notice is shown, and the most of them at once.
const NOTICE_S: f64 = 8.0;
const NOTICES: usize = 4;

/// How often the window looks whether it is to end.
const LOOK: Duration = Duration::from_millis(200);

/// Seconds within which a second loss of the device ends the flight: it would go on for ever.
const LOSS_S: f64 = 30.0;

/// The most faults of data that are said one by one.
const SHOWN_FAULTS: usize = 4;

/// A terrain, and the camera that was asked for.
type Opened = (Terrain, Option<Camera>);

/// The window and what is in it.
pub(super) struct App<'a> {
    options: &'a WindowOptions,
    progress: &'a dyn Progress,
    start: Instant,
    settings: Settings,
    window: Option<Arc<Window>>,
    graphics: Option<Graphics>,
    overlay: Option<Overlay>,
    loading: Option<Loading<Opened>>,
    flying: Option<Flying>,
    held: Held,
    pointer: Pointer,
    panel_shown: bool,
    help_shown: bool,
    picture_wanted: bool,
    /// What was said, and until when it is shown.
    notices: Vec<(f64, String)>,
    faults: Vec<String>,
    /// Whether the last frame asked for another, and when the next is wanted at the latest.
    follows: bool,
    next_s: f64,
    hidden: bool,
    lost_s: Option<f64>,
    outcome: Result<()>,
}

/// The pointer, and what it does to the camera.
#[derive(Default)]
struct Pointer {
    /// Where it is, in pixels; none outside of the window.
    at: Option<PhysicalPosition<f64>>,
    /// Buttons that are held over the terrain.
    dragging: u32,
    /// Whether the window holds it.
    captured: bool,
    /// Parts of a notch of the wheel.
    wheel: f64,
}

impl<'a> App<'a> {
    /// Begins to open the terrain.
    ///
    /// # Errors
    /// Where the system starts no thread.
    pub(super) fn new(
        options: &'a WindowOptions,
        open: Open,
        place: Place,
        progress: &'a dyn Progress,
    ) -> Result<Self> {
        let loading = Loading::start(move |progress| {
            let terrain = open(progress)?;
            let camera = place(&terrain)?;
            Ok((terrain, camera))
        })?;
        Ok(Self {
            options,
            progress,
            start: Instant::now(),
            settings: Settings {
                clipmap: options.clipmap,
                view_mode: options.view_mode,
                tint: options.tint,
                haze: options.haze,
                sun: options.sun,
                sun_hour: None,
            },
            window: None,
            graphics: None,
            overlay: None,
            loading: Some(loading),
            flying: None,
            held: Held::default(),
            pointer: Pointer::default(),
            panel_shown: true,
            help_shown: false,
            picture_wanted: false,
            notices: Vec::new(),
            faults: Vec::new(),
            follows: false,
            next_s: 0.0,
            hidden: false,
            lost_s: None,
            outcome: Ok(()),
        })
    }

    /// What it ended with. A flight that was still being recorded is written.
    pub(super) fn into_outcome(mut self) -> Result<()> {
        if self.flying.as_ref().is_some_and(|f| f.recording_s(0.0).is_some()) {
            self.record();
        }
        let more = self.faults.len().saturating_sub(SHOWN_FAULTS);
        if more > 0 {
            self.progress.warn(&format!(
                "{more} more faults of the data; see clipscape info --verify"
            ));
        }
        self.outcome
    }

    fn now_s(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    /// Shows a sentence for a while, and says it outside too.
    fn say(&mut self, sentence: &str) {
        self.progress.warn(sentence);
        if self.notices.len() == NOTICES {
            self.notices.remove(0);
        }
        self.notices.push((self.now_s() + NOTICE_S, sentence.to_string()));
    }

    fn open_window(&mut self, events: &ActiveEventLoop) -> Result<()> {
        let [width, height] = self.options.size_px;
        let attributes = Window::default_attributes()
            .with_title(format!("clipscape: {}", self.options.title))
            .with_inner_size(PhysicalSize::new(width, height));
        let window = events
            .create_window(attributes)
            .map_err(|e| super::no_display(&e.to_string()).because(e))?;
        self.window = Some(Arc::new(window));
        self.open_graphics()
    }

    fn open_graphics(&mut self) -> Result<()> {
        let Some(window) = self.window.clone() else {
            return Ok(());
        };
        // The window can have one surface at a time.
        (self.overlay, self.graphics) = (None, None);
        let graphics = Graphics::new(window.clone())?;
        self.overlay = Some(Overlay::new(&window, &graphics));
        if let Some(flying) = &mut self.flying {
            flying.rebuild(&graphics.gpu, &self.settings, graphics.size_px())?;
        }
        self.graphics = Some(graphics);
        Ok(())
    }

    /// Ends, with an error or without.
    fn end(&mut self, events: &ActiveEventLoop, outcome: Result<()>) {
        if self.outcome.is_ok() {
            self.outcome = outcome;
        }
        events.exit();
    }

    /// Goes on with what was opened meanwhile.
    fn take_loaded(&mut self) -> Result<()> {
        let (Some(loading), Some(graphics)) = (&mut self.loading, &self.graphics) else {
            return Ok(());
        };
        let warnings = loading.take_warnings();
        let opened = loading.poll();
        if let Some(opened) = opened {
            let (terrain, camera) = opened?;
            if let Some(day) = terrain.day() {
                let time = self.options.sun_time.map(|time| time.in_day(&day));
                let hour = time.map_or(FIRST_HOUR, |time| day.hour_of_time(time));
                self.settings.clipmap.day = true;
                self.settings.sun_hour = Some(hour.rem_euclid(24.0));
            }
            self.flying = Some(Flying::new(
                &graphics.gpu,
                Arc::new(terrain),
                camera,
                &self.settings,
                self.options.sun,
                self.options.sample_count,
                graphics.size_px(),
            )?);
            self.loading = None;
            self.follows = false;
        }
        for warning in warnings {
            self.say(&warning);
        }
        Ok(())
    }

    /// Draws a frame, if there is something to draw into.
    fn draw(&mut self) -> Result<()> {
        self.take_loaded()?;
        let now_s = self.now_s();
        self.notices.retain(|(until_s, _)| *until_s > now_s);
        let (Some(window), Some(graphics), Some(overlay)) =
            (&self.window, &mut self.graphics, &mut self.overlay)
        else {
            return Ok(());
        };
        graphics.resize(window.inner_size());
        let picture = match graphics.acquire()? {
            Acquired::Picture(picture) => picture,
            Acquired::Nothing => {
                self.next_s = now_s + LOOK.as_secs_f64();
                self.follows = false;
                return Ok(());
            }
            Acquired::Lost => return self.replace_device(now_s),
        };
        let size_px = graphics.size_px();
        let view = picture.texture.create_view(&Default::default());
        let mut encoder = graphics
            .gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor {
                label: Some("clipscape window"),
            });
        let mut wants = super::flying::Wants::default();
        let mut below_ground = false;
        if let Some(flying) = &mut self.flying {
            let pointer = self
                .pointer
                .at
                .filter(|_| !self.pointer.captured && !overlay.has_pointer());
            wants = flying.frame(
                &graphics.gpu,
                &mut encoder,
                &Moment {
                    now_s,
                    size_px,
                    settings: &self.settings,
                    held: &self.held,
                    pointer: pointer.map(|p| [p.x + 0.5, p.y + 0.5]),
                    follows: self.follows,
                },
            )?;
            if wants.errors_changed {
                overlay.set_errors(flying.errors());
            }
            graphics.lay(&mut encoder, &flying.scene.shown(graphics.encodes()), &view);
            below_ground = flying.pilot.below_ground;
        } else {
            graphics.clear(&mut encoder, &view);
        }
        let before = (self.settings, below_ground);
        let facts = Facts::default();
        let flying = self.flying.as_ref();
        let notices: Vec<String> = self.notices.iter().map(|(_, text)| text.clone()).collect();
        let shown = Shown {
            title: &self.options.title,
            loading: self.loading.as_ref().map(Loading::stage),
            facts: flying.map_or(&facts, |f| &f.facts),
            traced_sun: flying.and_then(|f| f.scene.traced_sun()),
            recording_s: flying.and_then(|f| f.recording_s(now_s)),
            notices: &notices,
            measuring: wants.measuring,
            errors: overlay.errors(),
        };
        let mut changed = Changed {
            settings: &mut self.settings,
            below_ground: &mut below_ground,
            panel: &mut self.panel_shown,
            help: &mut self.help_shown,
        };
        let asked = overlay.lay_out(window, &shown, &mut changed);
        overlay.record(graphics, &mut encoder, &view, size_px);
        graphics.gpu.queue.submit([encoder.finish()]);
        graphics.present(picture);
        if let Some(flying) = &mut self.flying {
            flying.pilot.below_ground = below_ground;
        }
        self.follows = wants.frame || before != (self.settings, below_ground);
        let notice_s = self
            .notices
            .first()
            .map_or(f64::INFINITY, |(until_s, _)| *until_s);
        let look_s = if wants.look {
            now_s + LOOK.as_secs_f64()
        } else {
            f64::INFINITY
        };
        self.next_s = (now_s + asked.again_s).min(notice_s).min(look_s);
        if std::mem::take(&mut self.picture_wanted) {
            self.write_picture();
        }
        self.take_faults();
        Ok(())
    }

    /// A lost device is replaced, but not again and again.
    fn replace_device(&mut self, now_s: f64) -> Result<()> {
        if self.lost_s.is_some_and(|before_s| now_s - before_s < LOSS_S) {
            let what = "the device was lost twice in short order";
            return Err(Error::new(ErrorKind::Device, "graphics", what)
                .advice("update its driver; clipscape render draws without a window"));
        }
        self.lost_s = Some(now_s);
        self.open_graphics()?;
        self.follows = false;
        self.next_s = now_s;
        self.say("The graphics device was lost, and replaced");
        Ok(())
    }

    fn write_picture(&mut self) {
        let (Some(flying), Some(graphics)) = (&self.flying, &self.graphics) else {
            return;
        };
        let behind = match flying.facts.update.complete {
            true => String::new(),
            false => format!(", with {}", text::state(&flying.facts.update)),
        };
        match flying.picture(&graphics.gpu, self.options) {
            Ok(path) => self.say(&format!("{} is written{behind}", path.display())),
            Err(error) => self.say(&error.to_string()),
        }
    }

    fn record(&mut self) {
        let now_s = self.now_s();
        let Some(flying) = &mut self.flying else { return };
        let size_px = self
            .graphics
            .as_ref()
            .map_or(self.options.size_px, Graphics::size_px);
        match flying.record(self.options, now_s) {
            Ok(None) => {}
            Ok(Some((path, length_s))) => {
                let replay = format!(
                    "{} --flight {}{}",
                    self.options.replay,
                    text::quoted(&path.display().to_string()),
                    text::render_flags(&self.settings, size_px, self.options.sample_count)
                );
                self.say(&format!(
                    "{} is written, {length_s:.1} s; to replay it: {replay}",
                    path.display()
                ));
            }
            Err(error) => self.say(&error.to_string()),
        }
    }

    /// Says what is wrong with the data, each fault once, and of many only the first.
    fn take_faults(&mut self) {
        let Some(flying) = &mut self.flying else { return };
        let warnings = flying.scene.terrain().take_warnings();
        let texts: Vec<String> = flying.scene.take_faults().iter().map(Error::to_string).collect();
        for text in texts {
            if !self.faults.contains(&text) {
                if self.faults.len() < SHOWN_FAULTS {
                    self.say(&text);
                }
                self.faults.push(text);
            }
        }
        for warning in warnings {
            self.say(&warning);
        }
    }
}
