//! The exact image: one ray a pixel, through its centre, over `S0` in f64.

use std::sync::Mutex;

use crate::camera::View;
use crate::error::{Error, Result};
use crate::query::{Probe, Truth};
use crate::work::{Work, each_chunk};

/// How far away `S0` is at the pixels of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct ExactImage {
    distances_m: Vec<f64>,
    view: View,
}

impl ExactImage {
    /// The exact image of `view`, which shares the view and the near plane of what the GPU draws.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Misuse`] for a view of other than finite numbers; those of reading.
    pub fn new(truth: &Truth<'_>, view: &View, work: &dyn Work) -> Result<Self> {
        let mut distances_m = vec![f64::INFINITY; view.size_px.iter().map(|&n| n as usize).product()];
        each_row(
            truth,
            view,
            work,
            &mut distances_m,
            || (),
            |probe, (), pixel, out| {
                if let Some(hit) = probe.cast(pixel)? {
                    *out = hit.along;
                }
                Ok(())
            },
        )?;
        Ok(Self {
            distances_m,
            view: *view,
        })
    }

    /// The view.
    pub fn view(&self) -> &View {
        &self.view
    }

    /// Metres along the view axis, row by row from the upper left; infinite where the ray meets no terrain.
    pub fn distances_m(&self) -> &[f64] {
        &self.distances_m
    }
}

/// Fills `out`, an element a pixel of `view`, row by row on all of `work`, with a probe and what `memory` makes for each
/// row; `pixel` gets the place of a pixel's centre.
pub(super) fn each_row<T: Send, M>(
    truth: &Truth<'_>,
    view: &View,
    work: &dyn Work,
    out: &mut [T],
    memory: impl Fn() -> M + Sync,
    pixel: impl Fn(&mut Probe<'_>, &mut M, [f64; 2], &mut T) -> Result<()> + Sync,
) -> Result<()> {
    let failed = Mutex::new(None::<Error>);
    each_chunk(work, out, view.size_px[0] as usize, |y, row| {
        let fill = |row: &mut [T]| -> Result<()> {
            let (mut probe, mut memory) = (Probe::new(truth, view)?, memory());
            for (x, out) in row.iter_mut().enumerate() {
                pixel(&mut probe, &mut memory, [x as f64 + 0.5, y as f64 + 0.5], out)?;
            }
            Ok(())
        };
        if let Err(error) = fill(row) {
            failed.lock().expect("no task panics").get_or_insert(error);
        }
    });
    failed.into_inner().expect("no task panics").map_or(Ok(()), Err)
}
