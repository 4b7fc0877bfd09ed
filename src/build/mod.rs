//! Preprocessing: from a DEM to a terrain file, or to a pyramid in memory.
//!
//! [`preprocess`] drives the rooms above it, in passes from north to south: `heights` reads [`crate::source`] band by
//! band, filters it by [`crate::pyramid`] and writes the tiles of all levels through [`crate::terrain`]; `bounds` reads
//! them back and writes the bounds; `light` traces sun and sky over them by [`crate::light`], `day` the light of a day, both
//! by `blocks`. What is held depends on the DEM's width alone: it is computed beforehand, and more than the ceiling is
//! refused.
//! [`build_pyramid`] holds all levels in memory instead, for who draws a DEM without a file.
//! [`relight`] gives a terrain file other light.
//! [`Part`] is a level's heights, light or error as a DEM of its own, to be written as one.
//! [`Threads`] shares the work out; results do not depend on their number.

mod bands;
mod blocks;
mod bounds;
mod day;
mod heights;
mod light;
mod memory;
mod output;
mod part;
mod preprocess;
mod pyramid;
mod relight;
mod rounding;
#[cfg(test)]
mod tests;
mod threads;
mod tightness;
mod tiles;

pub use crate::terrain::SourceStamp;
pub use memory::{DEFAULT_MEMORY_BYTES, HELD_MEMORY_BYTES, needed_bytes, peak_rss_bytes, preprocess_bytes};
pub use output::{Output, refuse_existing};
pub use part::{Part, PartKind};
pub use preprocess::{PreprocessOptions, PreprocessReport, preprocess};
pub use pyramid::build_pyramid;
pub use relight::relight;
pub use threads::Threads;
