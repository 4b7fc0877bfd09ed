//! Tells one clipmap from another, so that what a GPU holds of one is never taken for another's.

use std::sync::atomic::{AtomicU64, Ordering};

/// A number that no other clipmap of this process has; a clone is another clipmap.
#[derive(Debug)]
pub(super) struct Identity(u64);

impl Identity {
    pub(super) fn new() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(1);
        Self(NEXT.fetch_add(1, Ordering::Relaxed))
    }

    pub(super) fn get(&self) -> u64 {
        self.0
    }
}

impl Clone for Identity {
    fn clone(&self) -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clones_are_others() {
        let one = Identity::new();
        assert_ne!(one.get(), one.clone().get());
    }
}
