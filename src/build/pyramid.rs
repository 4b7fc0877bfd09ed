//! The pyramid of a DEM held whole in memory, for who draws it without a file.

use super::bands::BAND_ROWS;
use super::memory::{self, HELD_MEMORY_BYTES};
use super::threads::Threads;
use crate::error::{Error, ErrorKind, Result};
use crate::grid::{Rect, Size};
use crate::progress::Progress;
use crate::pyramid::{Filter, Pyramid};
use crate::source::{Description, HeightSource};

/// Reads `source` whole and builds its pyramid with bounds, without light: what rendering a raw DEM needs.
///
/// # Errors
/// [`ErrorKind::Limit`] where it needs more than [`HELD_MEMORY_BYTES`]; [`ErrorKind::Cancelled`]; and what reading
/// meets.
pub fn build_pyramid(source: &dyn HeightSource, filter: &Filter, progress: &dyn Progress) -> Result<Pyramid> {
    let description = source.description();
    memory::check(
        &description.name,
        &description.grid,
        |grid| memory::needed_bytes(grid, false),
        HELD_MEMORY_BYTES,
        "preprocess it, or cut it",
    )?;
    let threads = Threads::new(0)?;
    let heights = read(source, progress)?;
    let mut pyramid = Pyramid::new(
        description.grid,
        heights,
        description.step_m,
        filter,
        &threads,
        progress,
    )?;
    pyramid.bound(&threads, progress)?;
    Ok(pyramid)
}

/// All heights of level 0, read in bands from north to south.
fn read(source: &dyn HeightSource, progress: &dyn Progress) -> Result<Vec<f32>> {
    let Description { grid, name, .. } = source.description();
    grid.check()
        .map_err(|what| Error::new(ErrorKind::Misuse, name, what))?;
    let Size { width, height } = grid.size;
    let count = grid.size.samples() as usize;
    let mut heights = Vec::new();
    heights.try_reserve_exact(count).map_err(|e| {
        Error::new(
            ErrorKind::Limit,
            name,
            format!("no memory for {width} x {height} samples"),
        )
        .because(e)
    })?;
    heights.resize(count, f32::NAN);
    progress.begin("read", count as u64);
    let bands = heights.chunks_mut((BAND_ROWS * width) as usize);
    for (band, z) in bands.zip((0..height).step_by(BAND_ROWS as usize)) {
        if progress.cancelled() {
            return Err(Error::cancelled(name));
        }
        source.read(Rect::new(0, z, width, (z + BAND_ROWS).min(height)), band)?;
        progress.advance(band.len() as u64);
    }
    Ok(heights)
}
