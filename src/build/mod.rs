//! Preprocessing: from a DEM to a terrain file, or to a pyramid in memory.
//!
//! [`preprocess`] drives the rooms above it: [`crate::source`] is read, [`crate::pyramid`] filters and bounds it,
//! [`crate::light`] traces sun and sky, [`crate::terrain`] writes the file. [`build_pyramid`] stops before the
//! light. All levels are held in memory: what that takes is computed beforehand and refused above a ceiling.
//! [`relight`] gives a terrain file other light. [`Part`] is a level's heights, light or error as a DEM of its own, to be written as one.
//! [`Threads`] shares the work out; results do not depend on their number.

mod memory;
mod output;
mod part;
mod preprocess;
mod relight;
#[cfg(test)]
mod tests;
mod threads;

pub use crate::terrain::SourceStamp;
pub use memory::{DEFAULT_MEMORY_BYTES, needed_bytes, peak_rss_bytes};
pub use output::{Output, refuse_existing};
pub use part::{Part, PartKind};
pub use preprocess::{PreprocessOptions, PreprocessReport, build_pyramid, preprocess};
pub use relight::relight;
pub use threads::Threads;
