//! Tiles of levels, read and decoded once however many views want them, by loader threads or by who cannot go on without.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Instant;

use super::TileOptions;
use super::pace::Pace;
use super::shape::{Key, Shape, copy_part, words_per_sample};
use super::store::{ENTRY_BYTES, Outcome, Store};
use crate::error::{Error, ErrorKind, Result};
use crate::grid::Rect;
use crate::levels::{Arrival, Data, Levels, Wanted};

/// How a tile that is not here is had.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Patience {
    /// Not at all: it is noted as wanted.
    None,
    /// It is waited for; a fault that was met before is met again.
    Wait,
    /// It is waited for, and read again where a fault was met before.
    Retry,
}

/// The tiles of one source of levels, and the threads that load them.
pub(super) struct Tiles {
    shared: Arc<Shared>,
    loaders: usize,
    threads: Mutex<Vec<JoinHandle<()>>>,
}

struct Shared {
    source: Arc<dyn Levels>,
    shape: Shape,
    store: Mutex<Store>,
    /// There is something to load, or the end has come.
    work: Condvar,
    /// A tile has come, or cannot be had.
    done: Condvar,
    /// By kind of data: samples that were loaded, and the nanoseconds that it took.
    loaded: [(AtomicU64, AtomicU64); 4],
}

impl Tiles {
    /// Tiles of `source`, which answers at once, with `bounds_side` patches along a side of a tile of bounds.
    pub(super) fn new(source: Arc<dyn Levels>, bounds_side: i64, options: &TileOptions) -> Self {
        let shape = Shape {
            grid: *source.grid(),
            levels: source.level_count(),
            bounds_side,
        };
        Self {
            shared: Arc::new(Shared {
                source,
                shape,
                store: Mutex::new(Store::new(options.memory_bytes)),
                work: Condvar::new(),
                done: Condvar::new(),
                loaded: Default::default(),
            }),
            loaders: options.loaders,
            threads: Mutex::default(),
        }
    }

    /// Copies `rect` into `out`, as far as it is here or `patience` brings it.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] for a rectangle outside the level, and those of the source.
    pub(super) fn copy<T: bytemuck::Pod>(
        &self,
        data: Data,
        level: u32,
        rect: Rect,
        out: &mut [T],
        patience: Patience,
    ) -> Result<Arrival> {
        let shape = &self.shared.shape;
        shape.check(data, level, rect, out.len())?;
        let mut arrival = Arrival::Arrived;
        for key in shape.keys(data, level, rect) {
            match self.fetch(key, patience) {
                None => arrival = Arrival::Missing,
                Some(outcome) => {
                    let sample_bytes = 4 * words_per_sample(data);
                    copy_part(&outcome?, shape.rect(key), sample_bytes, rect, out);
                }
            }
        }
        if arrival == Arrival::Missing {
            self.start();
        }
        Ok(arrival)
    }

    /// A view wants these and nothing else, most urgent first.
    pub(super) fn want(&self, view: u64, wanted: &[Wanted]) {
        let shape = &self.shared.shape;
        let keys = wanted.iter().flat_map(|w| shape.keys(w.data, w.level, w.rect));
        let keys: Vec<Key> = keys.collect();
        let mut store = self.shared.lock();
        store.want(view, keys);
        let has_work = store.has_work();
        drop(store);
        if has_work {
            self.start();
            self.shared.work.notify_all();
        }
    }

    /// Waits until all of this is here, or cannot be had.
    pub(super) fn wait_for(&self, wanted: &[Wanted]) {
        for w in wanted {
            for key in self.shared.shape.keys(w.data, w.level, w.rect) {
                self.fetch(key, Patience::Wait);
            }
        }
    }

    /// Whether all that is wanted is here, and nothing on its way.
    pub(super) fn is_idle(&self) -> bool {
        self.shared.lock().is_idle()
    }

    /// The most bytes of tiles that there have been at once.
    pub(super) fn most_bytes(&self) -> usize {
        self.shared.lock().most_bytes()
    }

    /// What loading has cost so far; none where nothing was loaded.
    pub(super) fn pace(&self) -> Option<Pace> {
        let loaded = &self.shared.loaded;
        let read = |n: &AtomicU64| n.load(Ordering::Relaxed) as f64;
        let any = loaded.iter().any(|(samples, _)| read(samples) > 0.0);
        any.then(|| Pace {
            shape: self.shared.shape,
            sample_s: std::array::from_fn(|k| 1e-9 * read(&loaded[k].1) / read(&loaded[k].0).max(1.0)),
            loaders: self.loaders,
        })
    }

    fn fetch(&self, key: Key, patience: Patience) -> Option<Outcome> {
        let mut store = self.shared.lock();
        loop {
            match store.get(key) {
                Some(Err(_)) if patience == Patience::Retry => {}
                Some(outcome) => return Some(outcome),
                None => {}
            }
            if patience == Patience::None {
                store.miss(key);
                self.shared.work.notify_one();
                return None;
            }
            if store.is_loading(key) {
                store = self
                    .shared
                    .done
                    .wait(store)
                    .unwrap_or_else(PoisonError::into_inner);
                continue;
            }
            store.begin_at_once(key, self.shared.cost_bytes(key));
            drop(store);
            let outcome = self.shared.load(key);
            let keep = outcome.is_ok() || patience == Patience::Wait;
            self.shared.lock().finish(key, outcome.clone(), keep);
            self.shared.done.notify_all();
            return Some(outcome);
        }
    }

    /// Starts the loaders, where they do not run yet.
    fn start(&self) {
        let mut threads = self.threads.lock().unwrap_or_else(PoisonError::into_inner);
        while threads.len() < self.loaders {
            let shared = self.shared.clone();
            let name = format!("clipscape loader {}", threads.len());
            let spawned = std::thread::Builder::new().name(name).spawn(move || shared.run());
            match spawned {
                Ok(thread) => threads.push(thread),
                // A system that starts no more threads has those that run, or whoever waits, do the work.
                Err(_) => break,
            }
        }
    }
}

impl Drop for Tiles {
    fn drop(&mut self) {
        self.shared.lock().stopped = true;
        self.shared.work.notify_all();
        for thread in self
            .threads
            .get_mut()
            .unwrap_or_else(PoisonError::into_inner)
            .drain(..)
        {
            // It has said what there was to say.
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Store> {
        self.store.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn cost_bytes(&self, key: Key) -> usize {
        4 * self.shape.words(key) + ENTRY_BYTES
    }

    /// A loader's life.
    fn run(&self) {
        let mut store = self.lock();
        while !store.stopped {
            let Some(key) = store.next(|key| self.cost_bytes(key)) else {
                store = self.work.wait(store).unwrap_or_else(PoisonError::into_inner);
                continue;
            };
            drop(store);
            let outcome = self.load(key);
            store = self.lock();
            store.finish(key, outcome, true);
            self.done.notify_all();
        }
    }

    /// Reads a tile. A source of the caller's own that panics has given no tile; nobody waits for it for ever.
    fn load(&self, key: Key) -> Outcome {
        let start = Instant::now();
        let outcome = catch_unwind(AssertUnwindSafe(|| self.read(key))).unwrap_or_else(|_| {
            let what = format!("{key:?} could not be read: its reader panicked");
            Err(Error::new(ErrorKind::Broken, "terrain", what))
        });
        let (samples, ns) = &self.loaded[key.data as usize];
        samples.fetch_add(self.shape.rect(key).area() as u64, Ordering::Relaxed);
        let took = u64::try_from(start.elapsed().as_nanos()).unwrap_or(u64::MAX);
        ns.fetch_add(took, Ordering::Relaxed);
        outcome
    }

    fn read(&self, key: Key) -> Outcome {
        let rect = self.shape.rect(key);
        let mut words = vec![0u32; self.shape.words(key)];
        let arrival = match key.data {
            Data::Heights => self
                .source
                .heights(key.level, rect, bytemuck::cast_slice_mut(&mut words)),
            Data::Bounds => self
                .source
                .bounds(key.level, rect, bytemuck::cast_slice_mut(&mut words)),
            Data::Light => self
                .source
                .light(key.level, rect, bytemuck::cast_slice_mut(&mut words)),
            Data::Day => self
                .source
                .day(key.level, rect, bytemuck::cast_slice_mut(&mut words)),
        };
        match arrival? {
            Arrival::Arrived => Ok(Arc::new(words)),
            Arrival::Missing => {
                let what = format!("{key:?} is missing");
                Err(Error::new(ErrorKind::Unsupported, "terrain", what))
            }
        }
    }
}
