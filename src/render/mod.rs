//! Headless frames, and the files they become.

mod headless;
pub mod pictures;

pub use headless::{COLOUR_FORMAT, Frame, Headless, HeadlessOptions};
