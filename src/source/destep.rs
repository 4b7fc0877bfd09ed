//! A DEM of whole steps, as of whole metres, with the terraces of its rounding smoothed away.
//!
//! What was rounded lies within half a step of what is stored. Among the surfaces that do so this takes a smooth one: it
//! bends each sample towards its neighbours (`bend` in `destep/block.rs`) at distances of 16, 8, 4, 2 and 1 samples, along rows and then along
//! columns, and after each distance puts what strayed back to within half a step (projection onto a convex set; P. L.
//! Combettes, *The Foundations of Set Theoretic Estimation*, 1993). So a terrace of up to some 30 samples becomes the
//! slope that it was, and no sample moves by more than half a step, rounding to a thirty-second of the step included.
//!
//! *What is rounding and what is ground.* Of samples of a plane that were rounded, one differs from the mean of the two
//! beside it by a step at most. A difference up to [`TRUST`] steps counts wholly, one of twice that not at all: rough ground
//! stays as it was read, and terraces wider than 30 samples stay in part.
//!
//! *No data.* A sample at the DEM's edge or beside no data, which lacks a neighbour on one side, is not bent in that
//! direction. What is no data stays so, and nothing else becomes it.
//!
//! A sample's new height depends on the samples within [`REACH`] of it and on nothing else: it is the same to the bit
//! whatever is read beside it, and on however many threads.

use std::sync::{Mutex, PoisonError};

use self::block::Block;
use super::processors::Processors;
use super::{Description, HeightSource, READ_ROWS, Reads};
use crate::error::{Error, ErrorKind, Result};
use crate::grid::Rect;
use crate::progress::Progress;
use crate::work::Work;

mod block;
#[cfg(test)]
mod tests;

/// Distances at which samples are bent towards others, in samples, in order.
const DISTANCES: [i64; 5] = [16, 8, 4, 2, 1];

/// Samples to each side on which a height depends: at each distance those once and twice as far.
const REACH: i64 = 2 * (16 + 8 + 4 + 2 + 1);

/// Differences up to this many steps are taken for rounding. Of 1/2, 3/4 and 1 the one that left the least error over
/// ground of 30 m whose unrounded heights were known.
const TRUST: f32 = 0.75;

/// Parts of a step in which heights are given: with 16 their rounding is most of what is left of the error of slopes, with
/// 64 a file grows by a seventh more.
const PARTS: f64 = 32.0;

/// Columns that a task smooths.
const TASK_COLUMNS: i64 = 256;

/// Another DEM without its steps.
pub struct Destepped<'a> {
    whole: &'a dyn HeightSource,
    description: Description,
    step_m: f64,
    /// The rows that the last read took from the DEM, for the next one south of it.
    kept: Mutex<Option<Kept>>,
}

/// Rows as they are in the DEM.
struct Kept {
    rect: Rect,
    heights: Vec<f32>,
}

impl<'a> Destepped<'a> {
    /// `whole` without its steps.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] where it has none: its heights are not whole numbers of one step.
    pub fn new(whole: &'a dyn HeightSource) -> Result<Self> {
        let mut description = whole.description().clone();
        let quantum = description.step_m.and_then(quantum_m);
        let (Some(step_m), Some(quantum_m)) = (description.step_m, quantum) else {
            let what = format!(
                "its heights ({}) are not whole numbers of one step, so that there are no terraces to smooth",
                description.sample_type
            );
            let error = Error::new(ErrorKind::Misuse, &description.name, what);
            return Err(error.advice("leave out the de-stepping"));
        };
        // Where the step is no power of two, neither are heights multiples of its parts.
        description.step_m = (quantum_m * PARTS == step_m).then_some(quantum_m);
        Ok(Self {
            whole,
            description,
            step_m,
            kept: Mutex::new(None),
        })
    }

    /// The step of the DEM in metres: heights move by half of it at most.
    pub fn step_m(&self) -> f64 {
        self.step_m
    }

    /// What moves of heights are multiples of, in metres: a thirty-second of the greatest power of two not above the
    /// step.
    pub fn quantum_m(&self) -> f64 {
        quantum_m(self.step_m).expect("checked when it was made")
    }

    /// The heights of the DEM in `rect`, of which those that the last read took too are not read again.
    fn raw(&self, rect: Rect) -> Result<Kept> {
        // Taken out and not locked: who reads may wait for tasks, and be handed another that reads.
        let kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner).take();
        let follows = |kept: &Kept| {
            let Rect { x0, z0, x1, z1 } = kept.rect;
            (x0, x1) == (rect.x0, rect.x1) && (z0..=z1).contains(&rect.z0) && z1 <= rect.z1
        };
        let mut kept = kept.filter(follows).unwrap_or(Kept {
            rect: Rect { z1: rect.z0, ..rect },
            heights: Vec::new(),
        });
        let passed = (rect.z0 - kept.rect.z0) * rect.width();
        kept.heights.drain(..passed as usize);
        let (known, count) = (kept.heights.len(), rect.area() as usize);
        kept.heights.try_reserve_exact(count - known).map_err(|e| {
            let what = format!("no memory for {count} samples");
            Error::new(ErrorKind::Limit, &self.description.name, what).because(e)
        })?;
        kept.heights.resize(count, f32::NAN);
        let missing = Rect {
            z0: kept.rect.z1,
            ..rect
        };
        self.whole.read(missing, &mut kept.heights[known..])?;
        kept.rect = rect;
        Ok(kept)
    }
}

/// A thirty-second of the greatest power of two that is not above `step_m`.
fn quantum_m(step_m: f64) -> Option<f64> {
    // Clearing the fraction's bits leaves the power of two.
    let power = f64::from_bits(step_m.to_bits() & 0x7ff0_0000_0000_0000);
    let quantum = power / PARTS;
    let in_f32 = |x: f64| f64::from(f32::MIN_POSITIVE) <= x && x <= f64::from(f32::MAX);
    (step_m > 0.0 && in_f32(quantum) && in_f32(step_m)).then_some(quantum)
}

impl HeightSource for Destepped<'_> {
    fn description(&self) -> &Description {
        &self.description
    }

    fn read(&self, rect: Rect, out: &mut [f32]) -> Result<()> {
        self.description.check_rect(rect, out)?;
        if rect.is_empty() {
            return Ok(());
        }
        let dem = self.description.grid.size.rect();
        let kept = self.raw(rect.grown(REACH).intersection(dem))?;
        let block = |x0: i64| Block {
            dem,
            rect: Rect {
                x0,
                x1: (x0 + TASK_COLUMNS).min(rect.x1),
                ..rect
            },
            raw: &kept.heights,
            raw_rect: kept.rect,
            step: self.step_m,
            quantum: self.quantum_m(),
        };
        let width = rect.width() as usize;
        let starts: Vec<i64> = (rect.x0..rect.x1).step_by(TASK_COLUMNS as usize).collect();
        // Rows cut into the parts that each task fills.
        let mut parts: Vec<Vec<&mut [f32]>> = starts.iter().map(|_| Vec::new()).collect();
        for row in out.chunks_exact_mut(width) {
            let cut = row.chunks_mut(TASK_COLUMNS as usize);
            parts.iter_mut().zip(cut).for_each(|(part, row)| part.push(row));
        }
        let parts: Vec<Mutex<Vec<&mut [f32]>>> = parts.into_iter().map(Mutex::new).collect();
        Processors.each(starts.len(), &|task| {
            let mut part = parts[task].lock().unwrap_or_else(PoisonError::into_inner);
            block(starts[task]).smooth(&mut part);
        });
        *self.kept.lock().unwrap_or_else(PoisonError::into_inner) = Some(kept);
        Ok(())
    }

    fn held_bytes(&self) -> u64 {
        let rows = (READ_ROWS + 2 * REACH) as u64;
        let row_bytes = 4 * self.description.grid.size.width as u64;
        let task_bytes = Block::held_bytes(TASK_COLUMNS, READ_ROWS) * Processors::count() as u64;
        self.whole.held_bytes() + rows * row_bytes + task_bytes
    }

    fn reads(&self) -> Reads {
        self.whole.reads()
    }

    fn remarks(&self, progress: &dyn Progress) -> Result<Vec<String>> {
        self.whole.remarks(progress)
    }
}
