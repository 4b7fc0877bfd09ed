//! A shelf of what was read, shared by threads and kept within a budget: the least recently used goes first.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::error::Result;

/// Things by the column and row of their tile. Clones share them.
pub(crate) struct Shelf<T> {
    budget_bytes: usize,
    things: Arc<Mutex<Things<T>>>,
}

struct Things<T> {
    by_key: HashMap<[i64; 2], Thing<T>>,
    bytes: usize,
    clock: u64,
}

struct Thing<T> {
    thing: Arc<T>,
    bytes: usize,
    used: u64,
}

impl<T> Clone for Shelf<T> {
    fn clone(&self) -> Self {
        Self {
            budget_bytes: self.budget_bytes,
            things: self.things.clone(),
        }
    }
}

impl<T> Shelf<T> {
    /// An empty one. The last thing is kept whatever the budget.
    pub(crate) fn new(budget_bytes: usize) -> Self {
        Self {
            budget_bytes,
            things: Arc::new(Mutex::new(Things {
                by_key: HashMap::new(),
                bytes: 0,
                clock: 0,
            })),
        }
    }

    fn things(&self) -> MutexGuard<'_, Things<T>> {
        // Nothing is done under the lock that could leave it half done.
        self.things.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The bytes that are held.
    pub(crate) fn bytes(&self) -> usize {
        self.things().bytes
    }

    /// What stands there, read by `read` (with its size in bytes) where it does not yet.
    pub(crate) fn get(&self, key: [i64; 2], read: impl FnOnce() -> Result<(T, usize)>) -> Result<Arc<T>> {
        {
            let mut things = self.things();
            things.clock += 1;
            let now = things.clock;
            if let Some(found) = things.by_key.get_mut(&key) {
                found.used = now;
                return Ok(found.thing.clone());
            }
        }
        // Read without the lock: two threads may now and then read the same, but none waits for another's disk.
        let (thing, bytes) = read()?;
        let thing = Arc::new(thing);
        let mut things = self.things();
        things.clock += 1;
        let new = Thing {
            thing: thing.clone(),
            bytes,
            used: things.clock,
        };
        things.bytes += bytes;
        if let Some(old) = things.by_key.insert(key, new) {
            things.bytes -= old.bytes;
        }
        while things.bytes > self.budget_bytes && things.by_key.len() > 1 {
            let oldest = things.by_key.iter().min_by_key(|(_, thing)| thing.used);
            let oldest = oldest.map(|(key, _)| *key);
            if let Some(old) = oldest.and_then(|key| things.by_key.remove(&key)) {
                things.bytes -= old.bytes;
            }
        }
        Ok(thing)
    }
}

/// Tiles along a side of the square of them that is remembered.
const REMEMBERED: i64 = 8;

/// The 8 x 8 tiles that one thread asked for last: it finds them without asking the others.
pub(crate) struct Remembered<T> {
    slots: Vec<Option<([i64; 2], Arc<T>)>>,
}

impl<T> Remembered<T> {
    /// None yet.
    pub(crate) fn new() -> Self {
        Self {
            slots: (0..REMEMBERED * REMEMBERED).map(|_| None).collect(),
        }
    }

    /// What stands there, from `shelf` where it is not remembered.
    pub(crate) fn get(&mut self, key: [i64; 2], shelf: impl FnOnce() -> Result<Arc<T>>) -> Result<&T> {
        let [x, z] = key.map(|k| k.rem_euclid(REMEMBERED));
        let slot = &mut self.slots[(z * REMEMBERED + x) as usize];
        let thing = match slot.take() {
            Some((last, thing)) if last == key => thing,
            _ => shelf()?,
        };
        Ok(&slot.insert((key, thing)).1)
    }
}
