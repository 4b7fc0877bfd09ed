//! The clipmap on the GPU: device, shaders, textures and their uploads, drawing, reading back.
//!
//! The caller owns device, queue, encoder and target; nothing here submits or waits but [`read`] and [`open`].

mod device;
mod options;
mod readback;
mod renderer;
mod resident;
mod shader;
mod sky;
mod staging;
mod targets;
mod textures;

#[cfg(feature = "window")]
pub(crate) use device::open_for;
pub use device::{Gpu, open};
pub use options::RendererOptions;
pub use readback::{Readback, read};
pub use renderer::{ClipmapRenderer, DrawReport};
pub use resident::UploadReport;
pub use shader::{Composed, Parts, ShaderError, compose, entry_files};
pub use sky::SkyRenderer;
pub use targets::Targets;
pub use textures::ViewTextures;
