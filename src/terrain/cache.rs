//! A bounded cache of decoded tiles: the least recently used go first.

use std::collections::{BTreeMap, HashMap};
use std::sync::{Arc, Mutex, PoisonError};

/// A tile: part, column, row.
pub(super) type Key = (usize, i64, i64);

/// What an entry costs beside its bytes, so that many tiny tiles stay bounded too.
const ENTRY_BYTES: usize = 128;

/// Decoded tiles of one file, up to a budget of bytes. Two threads that miss the same tile both decode it.
pub(super) struct Cache {
    budget_bytes: usize,
    inner: Mutex<Inner>,
}

#[derive(Default)]
struct Inner {
    tiles: HashMap<Key, (Arc<Vec<u8>>, u64)>,
    by_use: BTreeMap<u64, Key>,
    clock: u64,
    bytes: usize,
}

impl Cache {
    pub(super) fn new(budget_bytes: usize) -> Self {
        Self {
            budget_bytes,
            inner: Mutex::default(),
        }
    }

    /// The tile, if it is here; it is then the most recently used.
    pub(super) fn get(&self, key: Key) -> Option<Arc<Vec<u8>>> {
        let mut inner = self.inner.lock().unwrap_or_else(PoisonError::into_inner);
        let Inner {
            tiles, by_use, clock, ..
        } = &mut *inner;
        let (tile, used) = tiles.get_mut(&key)?;
        by_use.remove(used);
        *clock += 1;
        *used = *clock;
        by_use.insert(*clock, key);
        Some(tile.clone())
    }

    /// Keeps a tile, and lets go of the least recently used ones beyond the budget. A tile larger than the
    /// budget is not kept.
    pub(super) fn put(&self, key: Key, tile: Arc<Vec<u8>>) {
        let cost = tile.len() + ENTRY_BYTES;
        let mut inner = self.inner.lock().unwrap_or_else(PoisonError::into_inner);
        if cost > self.budget_bytes || inner.tiles.contains_key(&key) {
            return;
        }
        inner.clock += 1;
        let now = inner.clock;
        inner.tiles.insert(key, (tile, now));
        inner.by_use.insert(now, key);
        inner.bytes += cost;
        while inner.bytes > self.budget_bytes {
            let Some((_, oldest)) = inner.by_use.pop_first() else {
                break;
            };
            if let Some((tile, _)) = inner.tiles.remove(&oldest) {
                inner.bytes -= tile.len() + ENTRY_BYTES;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_recently_used_go_first_and_the_budget_holds() {
        let cache = Cache::new(3 * (100 + ENTRY_BYTES));
        let tile = || Arc::new(vec![0u8; 100]);
        for x in 0..3 {
            cache.put((0, x, 0), tile());
        }
        assert!(cache.get((0, 0, 0)).is_some());
        cache.put((0, 3, 0), tile());
        assert!(cache.get((0, 1, 0)).is_none(), "1 was used least recently");
        assert!([0, 2, 3].iter().all(|x| cache.get((0, *x, 0)).is_some()));
        for x in 0..1000 {
            cache.put((1, x, 0), Arc::new(vec![0; (x % 300) as usize]));
            let inner = cache.inner.lock().unwrap();
            let held: usize = inner.tiles.values().map(|(t, _)| t.len() + ENTRY_BYTES).sum();
            assert_eq!(held, inner.bytes);
            assert!(held <= cache.budget_bytes && inner.tiles.len() == inner.by_use.len());
        }
        cache.put((2, 0, 0), Arc::new(vec![0; 10_000]));
        assert!(cache.get((2, 0, 0)).is_none());
    }
}
