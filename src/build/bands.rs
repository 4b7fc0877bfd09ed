//! A DEM read band by band on a thread of its own, one band ahead of whoever works on it.

use std::sync::mpsc;
use std::time::Instant;

use crate::error::{Error, ErrorKind, Result};
use crate::grid::Rect;
use crate::progress::Progress;
use crate::source::{HeightSource, READ_ROWS};

/// Rows of a band.
pub(super) const BAND_ROWS: i64 = READ_ROWS;

/// A band of whole rows of level 0.
pub(super) struct Band {
    /// Its first row.
    pub(super) z0: i64,
    /// Its heights, row by row.
    pub(super) heights: Vec<f32>,
}

/// Gives `work` every band of `source` from north to south, and returns the seconds that it waited for them. Two bands
/// are held at once.
///
/// # Errors
/// Those of reading and of `work`; [`ErrorKind::Cancelled`]; [`ErrorKind::Limit`] where there is no memory, or no thread.
pub(super) fn each_band(
    source: &dyn HeightSource,
    progress: &dyn Progress,
    mut work: impl FnMut(&mut Band) -> Result<()>,
) -> Result<f64> {
    let description = source.description();
    let (name, size) = (&description.name, description.grid.size);
    let rows_of = |z0: i64| Rect::new(0, z0, size.width, (z0 + BAND_ROWS).min(size.height));
    let starts = (0..size.height).step_by(BAND_ROWS as usize);
    let mut waited_s = 0.0;
    std::thread::scope(|scope| {
        // Without room in the channel the reader holds one band while the other is worked on.
        let (give, take) = mpsc::sync_channel::<Result<Band>>(0);
        let (give_back, emptied) = mpsc::channel::<Vec<f32>>();
        let reader = move || {
            for (n, z0) in starts.enumerate() {
                // The first two bands bring their own memory, the others that of one which is done.
                let free = if n < 2 {
                    Some(Vec::new())
                } else {
                    emptied.recv().ok()
                };
                let Some(heights) = free else { return };
                let band = read(source, progress, rows_of(z0), heights);
                let failed = band.is_err();
                if give.send(band).is_err() || failed {
                    return;
                }
            }
        };
        let spawned = std::thread::Builder::new().spawn_scoped(scope, reader);
        spawned.map_err(|e| {
            Error::new(ErrorKind::Limit, name, "the system starts no thread to read it").because(e)
        })?;
        for _ in (0..size.height).step_by(BAND_ROWS as usize) {
            let start = Instant::now();
            let band = take.recv();
            waited_s += start.elapsed().as_secs_f64();
            // The reader ends early only after an error, which it has sent.
            let Ok(band) = band else { break };
            let mut band = band?;
            work(&mut band)?;
            // Gone where it has read all.
            let _ = give_back.send(band.heights);
        }
        Ok(waited_s)
    })
}

fn read(
    source: &dyn HeightSource,
    progress: &dyn Progress,
    rect: Rect,
    mut heights: Vec<f32>,
) -> Result<Band> {
    let name = &source.description().name;
    if progress.cancelled() {
        return Err(Error::cancelled(name));
    }
    let count = rect.area() as usize;
    if heights.capacity() < count {
        heights.try_reserve_exact(count).map_err(|e| {
            Error::new(ErrorKind::Limit, name, format!("no memory for {count} samples")).because(e)
        })?;
    }
    heights.resize(count, f32::NAN);
    source.read(rect, &mut heights)?;
    Ok(Band { z0: rect.z0, heights })
}
