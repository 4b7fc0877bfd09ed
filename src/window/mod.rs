//! The window: terrain to fly through, with a panel of figures and dials over it.
//!
//! It is built over the same face that an embedding program uses. Each frame, `motion` moves the camera by what
//! `controls` understands of keys and pointer, `scene` updates the clipmap and draws it into a texture of the
//! window's size, and `overlay` lays the `panel` over it. A terrain is opened by `loading` on a thread of its own, so
//! the window is there at once; `measured` finds errors on another. `recorder` keeps the flight, `files` finds names
//! for what is written, `graphics` holds the device and the surface, and `app` is what the window's system calls.

mod app;
mod controls;
mod files;
mod flying;
mod graphics;
mod loading;
mod measured;
mod motion;
mod overlay;
mod panel;
mod recorder;
mod scene;
mod settings;
mod text;

use std::path::PathBuf;

pub use text::quoted;
use winit::event_loop::EventLoop;

use crate::camera::{Camera, check_picture};
use crate::clipmap::ClipmapOptions;
use crate::error::{Error, ErrorKind, Result};
use crate::light::{Sun, SunTime};
use crate::progress::Progress;
use crate::shade::ViewMode;
use crate::stream::Terrain;

/// What opens the terrain, on a thread of its own.
pub type Open = Box<dyn FnOnce(&dyn Progress) -> Result<Terrain> + Send>;

/// What places the camera over the terrain that was opened; none for a view of the whole.
pub type Place = Box<dyn FnOnce(&Terrain) -> Result<Option<Camera>> + Send>;

/// How a window begins.
#[derive(Clone, Debug)]
pub struct WindowOptions {
    /// What its title and the panel call the terrain.
    pub title: String,
    /// Width and height in physical pixels, as far as the screen allows.
    pub size_px: [u32; 2],
    /// Samples a pixel: 1 or 4.
    pub sample_count: u32,
    /// What is shown.
    pub view_mode: ViewMode,
    /// Whether the ground is tinted by height and slope.
    pub tint: bool,
    /// Whether air lies between ground and eye.
    pub haze: bool,
    /// The sun, where no light was traced.
    pub sun: Sun,
    /// The time of day at first, where the terrain has light over a day.
    pub sun_time: Option<SunTime>,
    /// Clip size, levels, transition, vertical scale, culling, promised error, waiting.
    pub clipmap: ClipmapOptions,
    /// The folder of flights and pictures.
    pub folder: PathBuf,
    /// How their names begin.
    pub stem: String,
    /// The command that replays a flight, up to the flag that names it.
    pub replay: String,
    /// Whether F12 loses the graphics device: tests do what drivers do.
    #[doc(hidden)]
    pub loses_device: bool,
}

/// Opens a window, flies in it until it is closed, and says in lines what was written and what is wrong with the data.
///
/// Must be called from the main thread, once in a process.
///
/// # Errors
/// [`ErrorKind::Device`] without a display or an adapter, and where the device fails twice; [`ErrorKind::Misuse`] for
/// options out of range; those of `open` and `place`; [`ErrorKind::Cancelled`] once `progress` says so.
pub fn run(options: &WindowOptions, open: Open, place: Place, progress: &dyn Progress) -> Result<()> {
    check_picture(options.size_px)?;
    options.clipmap.check()?;
    if ![1, 4].contains(&options.sample_count) {
        let what = format!("{} samples a pixel", options.sample_count);
        return Err(Error::new(ErrorKind::Misuse, "multisampling", what).advice("use 1 or 4"));
    }
    let events = event_loop()?;
    let mut app = app::App::new(options, open, place, progress)?;
    let ended = events.run_app(&mut app);
    app.into_outcome()?;
    ended.map_err(|e| no_display(&e.to_string()).because(e))
}

/// The connection to the display.
fn event_loop() -> Result<EventLoop<()>> {
    // Where a library of the display's is missing, winit panics instead of saying so.
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| {}));
    let built = std::panic::catch_unwind(EventLoop::new);
    std::panic::set_hook(hook);
    match built {
        Ok(Ok(events)) => Ok(events),
        Ok(Err(e)) => Err(no_display(&e.to_string()).because(e)),
        Err(panic) => {
            let words = panic.downcast_ref::<String>().map(String::as_str);
            let words = words.or_else(|| panic.downcast_ref::<&str>().copied());
            Err(no_display(
                words.unwrap_or("a library of the display's is missing"),
            ))
        }
    }
}

fn no_display(why: &str) -> Error {
    let words: Vec<&str> = why.split_whitespace().collect();
    let what = format!("no window can be opened ({})", words.join(" "));
    Error::new(ErrorKind::Device, "display", what)
        .advice("clipscape render draws pictures and flights without one")
}
