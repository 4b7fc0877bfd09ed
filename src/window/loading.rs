//! Opens a terrain on a thread of its own, and says how far it has come.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use crate::error::{Error, ErrorKind, Result};
use crate::progress::Progress;

/// Seconds that a loading thread may take to notice that it is no longer wanted.
const PATIENCE: Duration = Duration::from_secs(2);

/// What the thread reports.
#[derive(Default)]
struct Shared {
    stage: Mutex<String>,
    total: AtomicU64,
    done: AtomicU64,
    warnings: Mutex<Vec<String>>,
    cancelled: AtomicBool,
}

impl Progress for Shared {
    fn begin(&self, stage: &str, total: u64) {
        *self.stage.lock().unwrap_or_else(PoisonError::into_inner) = stage.to_string();
        self.done.store(0, Ordering::Relaxed);
        self.total.store(total, Ordering::Relaxed);
    }

    fn advance(&self, steps: u64) {
        self.done.fetch_add(steps, Ordering::Relaxed);
    }

    fn warn(&self, sentence: &str) {
        let mut warnings = self.warnings.lock().unwrap_or_else(PoisonError::into_inner);
        warnings.push(sentence.to_string());
    }

    fn cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}

/// How far the thread has come.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Stage {
    /// What it does; empty before it has said so.
    pub(super) name: String,
    /// The share that is done, 0 to 1.
    pub(super) share: f32,
}

/// Something that is made on a thread. Dropped, it is cancelled.
pub(super) struct Loading<T> {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<Result<T>>>,
}

impl<T: Send + 'static> Loading<T> {
    /// Starts `open` on a thread.
    ///
    /// # Errors
    /// [`ErrorKind::Limit`] where the system starts no thread.
    pub(super) fn start(open: impl FnOnce(&dyn Progress) -> Result<T> + Send + 'static) -> Result<Self> {
        let shared = Arc::new(Shared::default());
        let progress = shared.clone();
        let thread = thread::Builder::new()
            .name("clipscape loading".into())
            .spawn(move || open(progress.as_ref()));
        let thread = thread
            .map_err(|e| Error::new(ErrorKind::Limit, "loading", "the system starts no thread").because(e))?;
        Ok(Self {
            shared,
            thread: Some(thread),
        })
    }

    /// What was made, once it is; none before.
    pub(super) fn poll(&mut self) -> Option<Result<T>> {
        if !self.thread.as_ref()?.is_finished() {
            return None;
        }
        let joined = self.thread.take()?.join();
        Some(joined.unwrap_or_else(|_| {
            let what = "ended unexpectedly";
            Err(Error::new(ErrorKind::Limit, "loading", what)
                .advice("free some memory; if it happens again, report it"))
        }))
    }

    /// How far it has come.
    pub(super) fn stage(&self) -> Stage {
        let name = self.shared.stage.lock().unwrap_or_else(PoisonError::into_inner);
        let (done, total) = (
            self.shared.done.load(Ordering::Relaxed),
            self.shared.total.load(Ordering::Relaxed),
        );
        Stage {
            name: name.clone(),
            share: (done as f32 / total.max(1) as f32).min(1.0),
        }
    }

    /// Takes the warnings since the last call.
    pub(super) fn take_warnings(&self) -> Vec<String> {
        std::mem::take(
            &mut self
                .shared
                .warnings
                .lock()
                .unwrap_or_else(PoisonError::into_inner),
        )
    }
}

impl<T> Drop for Loading<T> {
    /// Cancels, and waits a little, so that what it was writing is removed.
    fn drop(&mut self) {
        self.shared.cancelled.store(true, Ordering::Relaxed);
        let Some(thread) = self.thread.take() else {
            return;
        };
        let start = Instant::now();
        while !thread.is_finished() && start.elapsed() < PATIENCE {
            thread::sleep(Duration::from_millis(5));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wait<T: Send + 'static>(loading: &mut Loading<T>) -> Result<T> {
        loop {
            if let Some(result) = loading.poll() {
                return result;
            }
            thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn progress_warnings_and_results_come_through() {
        let (go, gone) = std::sync::mpsc::channel();
        let mut loading = Loading::start(move |progress| {
            progress.begin("pyramid", 8);
            progress.advance(2);
            progress.warn("odd");
            gone.recv().unwrap();
            Ok(42)
        })
        .unwrap();
        while loading.stage().share < 0.25 {
            thread::yield_now();
        }
        assert!(loading.poll().is_none());
        assert_eq!(loading.stage().name, "pyramid");
        while loading.take_warnings() != ["odd"] {
            thread::yield_now();
        }
        assert!(loading.take_warnings().is_empty());
        go.send(()).unwrap();
        assert_eq!(wait(&mut loading).unwrap(), 42);
        assert!(loading.poll().is_none());
    }

    #[test]
    fn errors_and_panics_are_errors() {
        let mut loading =
            Loading::<()>::start(|_| Err(Error::new(ErrorKind::Broken, "a", "is bad"))).unwrap();
        assert_eq!(wait(&mut loading).unwrap_err().kind(), ErrorKind::Broken);
        let mut loading =
            Loading::<()>::start(|_| std::panic::resume_unwind(Box::new("on purpose"))).unwrap();
        assert_eq!(wait(&mut loading).unwrap_err().kind(), ErrorKind::Limit);
    }

    #[test]
    fn dropped_it_is_cancelled() {
        let (say, said) = std::sync::mpsc::channel();
        let loading = Loading::<()>::start(move |progress| {
            while !progress.cancelled() {
                thread::sleep(Duration::from_millis(1));
            }
            say.send(()).unwrap();
            Err(Error::cancelled("a"))
        })
        .unwrap();
        drop(loading);
        said.try_recv().expect("the drop waited for the thread's end");
    }
}
