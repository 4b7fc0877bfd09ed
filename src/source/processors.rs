//! Shares the decoding of a file's blocks, or the computing of heights, out to all processors.

use rayon::prelude::*;

use crate::work::Work;

/// Runs tasks on rayon's threads: those of the pool that the caller works on, else those of the process.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Processors;

impl Processors {
    /// How many tasks run at once.
    pub(super) fn count() -> usize {
        rayon::current_num_threads()
    }
}

impl Work for Processors {
    fn each(&self, count: usize, task: &(dyn Fn(usize) + Sync)) {
        if count < 2 {
            (0..count).for_each(task);
        } else {
            (0..count).into_par_iter().for_each(task);
        }
    }
}
