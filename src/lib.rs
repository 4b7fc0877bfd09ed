//! clipscape
pub mod error;
pub mod grid;
pub mod levels;
pub mod progress;
pub mod source;
pub mod work;
pub mod camera;
pub mod pyramid;
pub mod light;
pub mod terrain;
pub mod build;
pub mod stream;
pub mod clipmap;
pub mod stats;
#[cfg(feature = "gpu")]
pub mod render;

pub use error::{Error, ErrorKind, Result};
