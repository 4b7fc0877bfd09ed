//! clipscape
pub mod build;
pub mod camera;
pub mod clipmap;
pub mod error;
pub mod grid;
pub mod levels;
pub mod light;
pub mod progress;
pub mod pyramid;
pub mod source;
pub mod stream;
pub mod terrain;
pub mod work;

pub use error::{Error, ErrorKind, Result};
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod shade;
