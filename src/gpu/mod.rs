//! The clipmap on the GPU: device, shaders, textures and their uploads, drawing, reading back.
//!
//! The caller owns device, queue, encoder and target; nothing here submits or waits but [`read`] and [`open`].

mod device;
mod readback;
mod renderer;
mod shader;
mod sky;
mod textures;

pub use device::{Gpu, open};
pub use readback::{Readback, read};
pub use renderer::{ClipmapRenderer, DEPTH_FORMAT, DrawReport, RendererOptions};
pub use shader::{Composed, ShaderError, compose, entry_files};
pub use sky::{SkyConstants, SkyRenderer};
pub use textures::{UploadReport, ViewTextures};
