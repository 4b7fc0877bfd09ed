//! The tiles that are held, loaded and wanted: which is loaded next, and which goes where the budget is full.
//!
//! Each view wants a list of tiles, most urgent first; where several views do, their lists are merged place by place,
//! and the place in that list is a tile's *rank*. The next tile to be loaded is the first of the list that is neither
//! here nor on its way; a tile that no list names any longer is not loaded at all. The budget counts what is held and what
//! is being loaded. Room is made by letting go of tiles that nobody wants, the least recently used first, and then of
//! wanted ones that rank below the tile that needs the room; where there are none of these either, loading pauses until
//! the views have read what is here.

use std::collections::{BTreeMap, HashMap, VecDeque};
use std::sync::Arc;

use super::shape::Key;
use crate::error::Result;

/// What an entry costs beside its samples, so that many tiny tiles stay bounded too.
pub(super) const ENTRY_BYTES: usize = 160;

/// A tile's samples, or why there are none.
pub(super) type Outcome = Result<Arc<Vec<u32>>>;

#[derive(Debug)]
struct Held {
    outcome: Outcome,
    used: u64,
    cost_bytes: usize,
}

/// Tiles of one DEM, up to a budget of bytes.
#[derive(Debug, Default)]
pub(super) struct Store {
    budget_bytes: usize,
    bytes: usize,
    most_bytes: usize,
    held: HashMap<Key, Held>,
    by_use: BTreeMap<u64, Key>,
    clock: u64,
    loading: HashMap<Key, usize>,
    wants: BTreeMap<u64, Vec<Key>>,
    ranks: HashMap<Key, usize>,
    queue: VecDeque<Key>,
    pub(super) stopped: bool,
}

impl Store {
    pub(super) fn new(budget_bytes: usize) -> Self {
        Self {
            budget_bytes,
            ..Self::default()
        }
    }

    /// The most bytes that it has counted at once.
    pub(super) fn most_bytes(&self) -> usize {
        self.most_bytes
    }

    /// The tile, or why it cannot be had, if it is known; it is then the most recently used.
    pub(super) fn get(&mut self, key: Key) -> Option<Outcome> {
        let held = self.held.get_mut(&key)?;
        self.by_use.remove(&held.used);
        self.clock += 1;
        held.used = self.clock;
        self.by_use.insert(self.clock, key);
        Some(held.outcome.clone())
    }

    /// Whether somebody is loading it.
    pub(super) fn is_loading(&self, key: Key) -> bool {
        self.loading.contains_key(&key)
    }

    /// Whether nothing is wanted that is not here, and nothing on its way.
    pub(super) fn is_idle(&self) -> bool {
        self.loading.is_empty() && self.queue.iter().all(|key| self.held.contains_key(key))
    }

    /// Whether a loader has something to do.
    pub(super) fn has_work(&self) -> bool {
        !self.queue.is_empty()
    }

    /// A view wants these and no others, most urgent first.
    pub(super) fn want(&mut self, view: u64, keys: Vec<Key>) {
        if keys.is_empty() {
            if self.wants.remove(&view).is_none() && self.ranks.is_empty() {
                return;
            }
        } else {
            self.wants.insert(view, keys);
        }
        self.ranks.clear();
        self.queue.clear();
        let longest = self.wants.values().map(Vec::len).max().unwrap_or(0);
        for place in 0..longest {
            for k in self.wants.values().filter_map(|keys| keys.get(place).copied()) {
                let rank = self.ranks.len();
                if *self.ranks.entry(k).or_insert(rank) == rank
                    && !self.held.contains_key(&k)
                    && !self.loading.contains_key(&k)
                {
                    self.queue.push_back(k);
                }
            }
        }
    }

    /// A view found that this is not here: it comes last, until the next [`Store::want`].
    pub(super) fn miss(&mut self, key: Key) {
        let rank = self.ranks.len();
        if !self.loading.contains_key(&key) && *self.ranks.entry(key).or_insert(rank) == rank {
            self.queue.push_back(key);
        }
    }

    /// The next tile to be loaded, for which room is made; it is then being loaded. None where nothing is wanted, or
    /// nothing may go for it.
    pub(super) fn next(&mut self, cost_bytes: impl Fn(Key) -> usize) -> Option<Key> {
        loop {
            let key = *self.queue.front()?;
            if self.held.contains_key(&key) || self.loading.contains_key(&key) {
                self.queue.pop_front();
                continue;
            }
            let (cost, rank) = (cost_bytes(key), self.ranks.get(&key).copied().unwrap_or(0));
            if !self.make_room(cost, rank) {
                return None;
            }
            self.queue.pop_front();
            self.begin(key, cost);
            return Some(key);
        }
    }

    /// Somebody who cannot wait for others loads it, whatever must go for it.
    pub(super) fn begin_at_once(&mut self, key: Key, cost_bytes: usize) {
        self.drop_held(key);
        self.make_room(cost_bytes, 0);
        self.begin(key, cost_bytes);
    }

    fn begin(&mut self, key: Key, cost_bytes: usize) {
        self.loading.insert(key, cost_bytes);
        self.bytes += cost_bytes;
        self.most_bytes = self.most_bytes.max(self.bytes);
    }

    /// What was being loaded has come, or cannot be had, which is remembered too if `keep`.
    pub(super) fn finish(&mut self, key: Key, outcome: Outcome, keep: bool) {
        let Some(mut cost_bytes) = self.loading.remove(&key) else {
            return;
        };
        if outcome.is_err() {
            self.bytes -= cost_bytes - ENTRY_BYTES.min(cost_bytes);
            cost_bytes = ENTRY_BYTES.min(cost_bytes);
        }
        if !keep {
            self.bytes -= cost_bytes;
            return;
        }
        self.clock += 1;
        let used = self.clock;
        self.by_use.insert(used, key);
        self.held.insert(
            key,
            Held {
                outcome,
                used,
                cost_bytes,
            },
        );
        // Whoever could not wait may have taken more than there was.
        self.make_room(0, usize::MAX);
    }

    /// Makes room for a tile of that rank; whether there is room now.
    fn make_room(&mut self, cost_bytes: usize, rank: usize) -> bool {
        if self.bytes + cost_bytes <= self.budget_bytes {
            return true;
        }
        let unwanted: Vec<Key> = self
            .by_use
            .values()
            .filter(|k| !self.ranks.contains_key(*k))
            .copied()
            .collect();
        let mut below: Vec<(usize, Key)> = Vec::new();
        let mut unwanted = unwanted.into_iter();
        let mut looked = false;
        while self.bytes + cost_bytes > self.budget_bytes {
            if let Some(key) = unwanted.next() {
                self.drop_held(key);
                continue;
            }
            if !looked {
                looked = true;
                let ranked = self.held.keys().filter_map(|k| Some((*self.ranks.get(k)?, *k)));
                below.extend(ranked.filter(|(r, _)| *r > rank));
                below.sort_unstable();
            }
            let Some((_, key)) = below.pop() else {
                return false;
            };
            self.drop_held(key);
            self.queue.push_back(key);
        }
        true
    }

    fn drop_held(&mut self, key: Key) {
        if let Some(held) = self.held.remove(&key) {
            self.by_use.remove(&held.used);
            self.bytes -= held.cost_bytes;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::{Error, ErrorKind};
    use crate::levels::Data;
    use crate::terrain::testing::Random;

    const COST: usize = 1000;

    fn key(x: i64) -> Key {
        Key {
            data: Data::Heights,
            level: 0,
            x,
            y: 0,
        }
    }

    fn keys(of: impl IntoIterator<Item = i64>) -> Vec<Key> {
        of.into_iter().map(key).collect()
    }

    fn tile() -> Outcome {
        Ok(Arc::new(Vec::new()))
    }

    /// Loads until nothing more is to be had; what was loaded, in order.
    fn load_all(store: &mut Store) -> Vec<i64> {
        std::iter::from_fn(|| {
            let key = store.next(|_| COST)?;
            store.finish(key, tile(), true);
            Some(key.x)
        })
        .collect()
    }

    #[test]
    fn views_take_turns_and_a_tile_is_loaded_once_for_all() {
        let mut store = Store::new(100 * COST);
        store.want(1, keys([5, 6, 7]));
        store.want(2, keys([7, 5, 8]));
        assert_eq!(load_all(&mut store), [5, 7, 6, 8]);
        store.want(2, keys([9, 5]));
        store.miss(key(3));
        store.miss(key(9));
        assert_eq!(load_all(&mut store), [9, 3]);
        assert!(store.is_idle());
    }

    #[test]
    fn what_is_no_longer_wanted_is_not_loaded() {
        let mut store = Store::new(100 * COST);
        store.want(1, keys([1, 2, 3]));
        assert_eq!(store.next(|_| COST), Some(key(1)));
        store.want(1, keys([4]));
        assert!(store.is_loading(key(1)), "what has begun is finished");
        assert_eq!(store.next(|_| COST), Some(key(4)));
        store.want(1, Vec::new());
        assert_eq!(store.next(|_| COST), None);
    }

    #[test]
    fn the_unwanted_go_first_then_what_ranks_below() {
        let mut store = Store::new(3 * COST);
        store.want(1, keys([1, 2, 3]));
        assert_eq!(load_all(&mut store), [1, 2, 3]);
        // 2 and 3 are wanted no longer; 2 was used last.
        store.get(key(2));
        store.want(1, keys([1, 4]));
        assert_eq!(load_all(&mut store), [4]);
        assert!(store.get(key(3)).is_none() && store.get(key(2)).is_some());
        // All that is here is wanted, and ranks above: loading pauses.
        store.want(1, keys([1, 4, 2, 9]));
        assert_eq!(load_all(&mut store), [0i64; 0]);
        // What ranks below goes, and is loaded again once there is room.
        store.want(1, keys([9, 1, 4, 2]));
        assert_eq!(load_all(&mut store), [9]);
        assert!(store.get(key(2)).is_none());
        store.want(1, keys([2]));
        assert_eq!(load_all(&mut store), [2]);
    }

    #[test]
    fn a_fault_is_remembered_if_it_is_to_be() {
        let mut store = Store::new(3 * COST);
        let fault = || Err(Error::new(ErrorKind::Broken, "tile", "damaged"));
        store.begin_at_once(key(1), COST);
        store.finish(key(1), fault(), false);
        assert!(store.get(key(1)).is_none() && store.bytes == 0);
        store.want(1, keys([1]));
        let next = store.next(|_| COST).unwrap();
        store.finish(next, fault(), true);
        assert!(store.get(key(1)).is_some_and(|o| o.is_err()) && store.bytes == ENTRY_BYTES);
        store.want(1, keys([1, 2]));
        assert_eq!(load_all(&mut store), [2], "it is not read again");
    }

    #[test]
    fn the_budget_holds_and_the_books_agree() {
        let random = &mut Random::new(5);
        let mut store = Store::new(10 * COST);
        for _ in 0..3000 {
            let some = (0..random.below(20))
                .map(|_| random.below(40))
                .collect::<Vec<_>>();
            store.want(random.below(3) as u64, keys(some));
            for _ in 0..random.below(5) {
                if let Some(key) = store.next(|_| COST) {
                    store.finish(key, tile(), true);
                }
            }
            store.get(key(random.below(40)));
            let held: usize = store.held.values().map(|h| h.cost_bytes).sum();
            assert_eq!(held, store.bytes);
            assert_eq!(store.held.len(), store.by_use.len());
            assert!(store.bytes <= store.budget_bytes && store.most_bytes() <= store.budget_bytes);
        }
    }
}
