//! The samples of a window that have not arrived, as disjoint rectangles.

use crate::grid::Rect;

/// What a window misses.
#[derive(Clone, Debug, Default)]
pub(super) struct Missing {
    /// To be asked for.
    waiting: Vec<Rect>,
    /// Could not be read: not asked for again while they stay in the window.
    lost: Vec<Rect>,
    spare: Vec<Rect>,
}

impl Missing {
    /// Whether every sample has arrived.
    pub(super) fn is_empty(&self) -> bool {
        self.waiting.is_empty() && self.lost.is_empty()
    }

    /// All that has not arrived, lost or not.
    pub(super) fn rects(&self) -> impl Iterator<Item = Rect> {
        self.waiting.iter().chain(&self.lost).copied()
    }

    /// What is to be asked for.
    pub(super) fn waiting(&self) -> &[Rect] {
        &self.waiting
    }

    /// Whether sample (i, j) has not arrived.
    pub(super) fn contains(&self, i: i64, j: i64) -> bool {
        self.rects().any(|r| r.contains(i, j))
    }

    /// Follows a window from `from` to `to`: what it left is forgotten, what it gained is missing.
    pub(super) fn follow(&mut self, from: Rect, to: Rect) {
        for list in [&mut self.waiting, &mut self.lost] {
            list.retain_mut(|r| {
                *r = r.intersection(to);
                !r.is_empty()
            });
        }
        self.waiting.extend(to.difference(from));
    }

    /// Cuts what is waited for along every `side`-th column and row, so that each piece lies in one tile, and lists
    /// it by distance from `eye` (in samples of the level), nearest first.
    pub(super) fn by_tile(&mut self, side: i64, eye: [f64; 2]) {
        std::mem::swap(&mut self.waiting, &mut self.spare);
        self.waiting.clear();
        for rect in self.spare.drain(..) {
            let tiles = |first: i64, end: i64| first.div_euclid(side)..(end - 1).div_euclid(side) + 1;
            for b in tiles(rect.z0, rect.z1) {
                for a in tiles(rect.x0, rect.x1) {
                    let tile = Rect::new(a * side, b * side, (a + 1) * side, (b + 1) * side);
                    self.waiting.push(rect.intersection(tile));
                }
            }
        }
        self.waiting
            .sort_unstable_by(|p, q| distance(*p, eye).total_cmp(&distance(*q, eye)));
    }

    /// Takes what is waited for, to be given back by [`Missing::wait`] and [`Missing::lose`] where it does not arrive.
    pub(super) fn take(&mut self) -> Vec<Rect> {
        let empty = std::mem::take(&mut self.spare);
        std::mem::replace(&mut self.waiting, empty)
    }

    /// Ends a round that began with [`Missing::take`], keeping its memory.
    pub(super) fn done(&mut self, mut taken: Vec<Rect>) {
        taken.clear();
        self.spare = taken;
    }

    /// `rect` is still waited for.
    pub(super) fn wait(&mut self, rect: Rect) {
        if !rect.is_empty() {
            self.waiting.push(rect);
        }
    }

    /// `rect` cannot be read.
    pub(super) fn lose(&mut self, rect: Rect) {
        self.lost.push(rect);
    }
}

/// The greater of the distances east-west and north-south from `eye` to the nearest sample of `rect`.
pub(super) fn distance(rect: Rect, eye: [f64; 2]) -> f64 {
    let axis = |first: i64, end: i64, eye: f64| (first as f64 - eye).max(eye - (end - 1) as f64).max(0.0);
    axis(rect.x0, rect.x1, eye[0]).max(axis(rect.z0, rect.z1, eye[1]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_missing_follows_the_window() {
        let mut missing = Missing::default();
        let (a, b) = (Rect::new(0, 0, 64, 64), Rect::new(10, -3, 74, 61));
        missing.follow(Rect::EMPTY, a);
        assert_eq!(missing.rects().map(|r| r.area()).sum::<i64>(), a.area());
        missing.lose(Rect::new(200, 0, 201, 1));
        let taken = missing.take();
        missing.wait(Rect::new(0, 0, 12, 5)); // all else of it arrived
        missing.done(taken);
        missing.follow(a, b);
        for (i, j) in b.cells() {
            let stayed = a.contains(i, j) && !(i < 12 && j < 5);
            assert_eq!(missing.contains(i, j), !stayed, "({i}, {j})");
        }
        assert_eq!(missing.lost, []);
        let area = missing.rects().map(|r| r.area()).sum::<i64>();
        assert_eq!(
            area,
            b.cells().filter(|&(i, j)| missing.contains(i, j)).count() as i64
        );
    }

    #[test]
    fn tiles_are_cut_and_sorted_by_distance() {
        let mut missing = Missing::default();
        missing.follow(Rect::EMPTY, Rect::new(-5, 3, 20, 9));
        missing.by_tile(8, [9.5, 4.0]);
        assert_eq!(
            missing.waiting()[..2],
            [Rect::new(8, 3, 16, 8), Rect::new(0, 3, 8, 8)]
        );
        assert_eq!(missing.waiting().len(), 8);
        assert_eq!(missing.rects().map(|r| r.area()).sum::<i64>(), 25 * 6);
    }
}
