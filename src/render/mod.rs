//! Headless frames, and the files they become.

mod error_view;
mod headless;
mod measuring;
pub mod pictures;
mod recording;

pub use headless::{COLOUR_FORMAT, Frame, Headless, HeadlessOptions};
pub use measuring::Measured;
pub use recording::{Recording, picture};
