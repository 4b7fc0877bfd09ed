//! Headless frames, and the files they become.

mod crack_pass;
mod headless;
pub mod pictures;
mod recording;

pub use headless::{COLOUR_FORMAT, Frame, Headless, HeadlessOptions};
pub use recording::{Recording, picture};
