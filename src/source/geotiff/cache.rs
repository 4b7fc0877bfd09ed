//! Decoded blocks, the latest used of them up to a budget of bytes.

use std::collections::HashMap;
use std::sync::Arc;

/// A decoded block; none where the file leaves it out.
pub(super) type Block = Option<Arc<Vec<u8>>>;

/// Column and row of a block.
type At = (i64, i64);

/// The cache of an image.
#[derive(Debug)]
pub(super) struct Cache {
    /// Blocks, and when each was last used.
    blocks: HashMap<At, (Arc<Vec<u8>>, u64)>,
    bytes: usize,
    budget_bytes: usize,
    clock: u64,
}

impl Cache {
    pub(super) fn new(budget_bytes: usize) -> Self {
        Self {
            blocks: HashMap::new(),
            bytes: 0,
            budget_bytes,
            clock: 0,
        }
    }

    /// The block at a column and row of blocks, if it is held.
    pub(super) fn get(&mut self, at: At) -> Option<Arc<Vec<u8>>> {
        self.clock += 1;
        let (block, used) = self.blocks.get_mut(&at)?;
        *used = self.clock;
        Some(Arc::clone(block))
    }

    /// Holds a block; drops those that were not used for the longest where it gets too many.
    pub(super) fn put(&mut self, at: At, block: Arc<Vec<u8>>) {
        self.clock += 1;
        self.bytes += block.len();
        if let Some((old, _)) = self.blocks.insert(at, (block, self.clock)) {
            self.bytes -= old.len();
        }
        if self.bytes <= self.budget_bytes {
            return;
        }
        // A quarter at once, so that not every block pays for the search.
        let mut ages: Vec<(u64, At)> = self.blocks.iter().map(|(at, (_, used))| (*used, *at)).collect();
        ages.sort_unstable();
        for (_, at) in ages {
            if self.bytes <= self.budget_bytes / 4 * 3 {
                break;
            }
            if let Some((old, _)) = self.blocks.remove(&at) {
                self.bytes -= old.len();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_latest_used_stay_within_the_budget() {
        let mut cache = Cache::new(100);
        for x in 0..10 {
            cache.put((x, 0), Arc::new(vec![0; 10]));
        }
        assert_eq!(cache.bytes, 100);
        assert!(cache.get((0, 0)).is_some());
        cache.put((10, 0), Arc::new(vec![0; 10]));
        assert!(cache.bytes <= 75);
        assert!(cache.get((0, 0)).is_some() && cache.get((10, 0)).is_some());
        assert!(cache.get((1, 0)).is_none());
        cache.put((11, 0), Arc::new(vec![0; 1000]));
        assert!(cache.bytes <= 75 && cache.get((11, 0)).is_none());
        cache.put((0, 0), Arc::new(vec![0; 7]));
        cache.put((0, 0), Arc::new(vec![0; 9]));
        assert_eq!(cache.get((0, 0)).map(|b| b.len()), Some(9));
        assert_eq!(
            cache.bytes,
            cache.blocks.values().map(|(b, _)| b.len()).sum::<usize>()
        );
    }
}
