//! Headless frames, and the files they become.

mod headless;
pub mod pictures;
mod recording;

pub use headless::{COLOUR_FORMAT, Frame, Headless, HeadlessOptions};
pub use recording::{Recording, picture};
