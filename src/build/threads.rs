//! [`Work`] on all processors.

use rayon::prelude::*;

use crate::error::{Error, ErrorKind, Result};
use crate::work::Work;

/// A pool of threads that runs tasks in any order; a task may itself share work out on the same pool.
pub struct Threads {
    pool: rayon::ThreadPool,
}

impl Threads {
    /// A pool of `count` threads; 0 stands for one a processor.
    ///
    /// # Errors
    /// [`ErrorKind::Limit`] where the system refuses to start them.
    pub fn new(count: usize) -> Result<Self> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(count)
            .build()
            .map_err(|e| {
                Error::new(
                    ErrorKind::Limit,
                    "threads",
                    "the system does not start as many as were asked for",
                )
                .advice("ask for fewer")
                .because(e)
            })?;
        Ok(Self { pool })
    }

    /// The number of threads.
    pub fn count(&self) -> usize {
        self.pool.current_num_threads()
    }
}

impl Work for Threads {
    fn each(&self, count: usize, task: &(dyn Fn(usize) + Sync)) {
        self.pool.install(|| (0..count).into_par_iter().for_each(task));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[test]
    fn every_task_runs_once_also_from_within_a_task() {
        let threads = Threads::new(2).unwrap();
        assert_eq!(threads.count(), 2);
        let runs: Vec<AtomicUsize> = (0..100).map(|_| AtomicUsize::new(0)).collect();
        threads.each(10, &|a| {
            threads.each(10, &|b| {
                runs[10 * a + b].fetch_add(1, Ordering::Relaxed);
            });
        });
        assert!(runs.iter().all(|r| r.load(Ordering::Relaxed) == 1));
        threads.each(0, &|_| panic!("there is no task"));
    }
}
