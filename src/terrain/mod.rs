//! The terrain file: a pyramid with bounds and light as one multi-part OpenEXR file (`STEM.terrain.exr`).
//!
//! [`layout`] names the parts, their grids and the order of their tiles; [`Meta`] is what the header's
//! `clipscape.` attributes say; [`write()`] (over [`TerrainWriter`]) makes a file of any [`crate::levels::Levels`];
//! an open [`TerrainFile`] is one. Both are strict: a file that differs from the layout in any way is refused.

mod cache;
#[cfg(test)]
mod damage_tests;
mod header;
pub mod layout;
mod meta;
mod reader;
#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests;
mod tile;
mod writer;
mod zip;

pub use header::is_terrain;
pub use layout::FORMAT_VERSION;
pub use meta::{LightMeta, Meta, SourceStamp, TOOL};
pub use reader::{DEFAULT_CACHE_BYTES, TerrainFile};
pub(crate) use tile::{BOUNDS_FIELDS, DAY_FIELDS, pack_columns, pack_light};
pub use writer::{EncodedTile, TerrainWriter, write};
