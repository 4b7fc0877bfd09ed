//! Patches: the unit of drawing, culling, bounding and certifying.

use super::{Rect, Size};

/// Quads along a patch's side.
pub const PATCH: i64 = 8;

/// Patch (a, b) of a level: 8 x 8 quads from sample (8a, 8b), aligned to the level's own grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Patch {
    /// The level.
    pub level: u32,
    /// Column of the patch, from west.
    pub a: i64,
    /// Row of the patch, from north.
    pub b: i64,
}

impl Patch {
    /// Patch (a, b) of `level`.
    pub fn new(level: u32, a: i64, b: i64) -> Self {
        Self { level, a, b }
    }

    /// The patch of the next coarser level that holds this one.
    pub fn parent(self) -> Self {
        Self::new(self.level + 1, self.a.div_euclid(2), self.b.div_euclid(2))
    }

    /// The four patches of the next finer level over the same ground, some perhaps beyond the DEM.
    /// `level` must be above 0.
    pub fn children(self) -> [Self; 4] {
        let child = |da, db| Self::new(self.level - 1, 2 * self.a + da, 2 * self.b + db);
        [child(0, 0), child(1, 0), child(0, 1), child(1, 1)]
    }

    /// Its 9 x 9 samples, in samples of its level; those past the level's last column or row do not exist.
    pub fn samples(self) -> Rect {
        let (x, z) = (self.a * PATCH, self.b * PATCH);
        Rect::new(x, z, x + PATCH + 1, z + PATCH + 1)
    }

    /// Its 9 x 9 samples cut to a level of `size` samples.
    pub fn samples_within(self, size: Size) -> Rect {
        self.samples().intersection(size.rect())
    }
}

impl Rect {
    /// The patches of a level of `size` samples that have one of this rectangle's samples on or in them,
    /// as a rectangle of patch indices.
    pub fn touching_patches(self, size: Size) -> Rect {
        if self.is_empty() {
            return Rect::EMPTY;
        }
        let low = |first: i64| (first - 1).div_euclid(PATCH); // a shared side belongs to both
        let high = |end: i64| (end - 1).div_euclid(PATCH) + 1;
        Rect::new(low(self.x0), low(self.z0), high(self.x1), high(self.z1))
            .intersection(size.patches().rect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn touching_patches_are_those_that_share_a_sample() {
        let size = Size {
            width: 41,
            height: 30,
        };
        let patches = size.patches();
        for x0 in 0..41 {
            for x1 in x0 + 1..42 {
                let rect = Rect::new(x0, 3, x1, 17).intersection(size.rect());
                let touching = rect.touching_patches(size);
                for a in 0..patches.width {
                    for b in 0..patches.height {
                        let shares = !Patch::new(0, a, b)
                            .samples_within(size)
                            .intersection(rect)
                            .is_empty();
                        assert_eq!(touching.contains(a, b), shares, "{rect:?} against ({a}, {b})");
                    }
                }
            }
        }
    }

    #[test]
    fn parents_and_children_agree_also_at_negative_indices() {
        for a in -9..9 {
            let patch = Patch::new(3, a, -a);
            assert!(patch.children().iter().all(|c| c.parent() == patch));
        }
    }
}
