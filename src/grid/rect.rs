//! Half-open rectangles of samples or patches.

/// Columns `x0..x1` and rows `z0..z1`, in samples of a level (or in patches, where it is said).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Rect {
    /// First column.
    pub x0: i64,
    /// First row.
    pub z0: i64,
    /// One past the last column.
    pub x1: i64,
    /// One past the last row.
    pub z1: i64,
}

impl Rect {
    /// The empty rectangle.
    pub const EMPTY: Self = Self {
        x0: 0,
        z0: 0,
        x1: 0,
        z1: 0,
    };

    /// Columns `x0..x1` and rows `z0..z1`.
    pub const fn new(x0: i64, z0: i64, x1: i64, z1: i64) -> Self {
        Self { x0, z0, x1, z1 }
    }

    /// Columns; 0 where empty.
    pub fn width(self) -> i64 {
        (self.x1 - self.x0).max(0)
    }

    /// Rows; 0 where empty.
    pub fn height(self) -> i64 {
        (self.z1 - self.z0).max(0)
    }

    /// The number of cells.
    pub fn area(self) -> i64 {
        self.width() * self.height()
    }

    /// Whether it holds nothing.
    pub fn is_empty(self) -> bool {
        self.x0 >= self.x1 || self.z0 >= self.z1
    }

    /// Whether it holds cell (x, z).
    pub fn contains(self, x: i64, z: i64) -> bool {
        (self.x0..self.x1).contains(&x) && (self.z0..self.z1).contains(&z)
    }

    /// Whether it holds all of `other`.
    pub fn contains_rect(self, other: Self) -> bool {
        other.is_empty() || self.intersection(other) == other
    }

    /// What both hold; [`Rect::EMPTY`] where that is nothing.
    pub fn intersection(self, other: Self) -> Self {
        let both = Self::new(
            self.x0.max(other.x0),
            self.z0.max(other.z0),
            self.x1.min(other.x1),
            self.z1.min(other.z1),
        );
        if both.is_empty() { Self::EMPTY } else { both }
    }

    /// This rectangle less `other`, as at most four disjoint rectangles: whole rows north and south of the
    /// overlap, then what is left west and east of it.
    pub fn difference(self, other: Self) -> impl Iterator<Item = Self> {
        let cut = self.intersection(other);
        let pieces = if cut.is_empty() {
            [self, Self::EMPTY, Self::EMPTY, Self::EMPTY]
        } else {
            [
                Self::new(self.x0, self.z0, self.x1, cut.z0),
                Self::new(self.x0, cut.z1, self.x1, self.z1),
                Self::new(self.x0, cut.z0, cut.x0, cut.z1),
                Self::new(cut.x1, cut.z0, self.x1, cut.z1),
            ]
        };
        pieces.into_iter().filter(|r| !r.is_empty())
    }

    /// The rectangle grown by `cells` on every side.
    #[must_use]
    pub fn grown(self, cells: i64) -> Self {
        Self::new(self.x0 - cells, self.z0 - cells, self.x1 + cells, self.z1 + cells)
    }

    /// The rectangle moved by (dx, dz).
    #[must_use]
    pub fn moved(self, dx: i64, dz: i64) -> Self {
        Self::new(self.x0 + dx, self.z0 + dz, self.x1 + dx, self.z1 + dz)
    }

    /// Its cells, row by row.
    pub fn cells(self) -> impl Iterator<Item = (i64, i64)> {
        (self.z0..self.z1).flat_map(move |z| (self.x0..self.x1).map(move |x| (x, z)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_difference_is_disjoint_and_exact() {
        let a = Rect::new(-2, 1, 4, 6);
        for x0 in -4..6 {
            for x1 in x0..7 {
                for (z0, z1) in [(0, 3), (2, 4), (3, 9), (0, 9), (7, 9), (4, 4)] {
                    let b = Rect::new(x0, z0, x1, z1);
                    let pieces: Vec<_> = a.difference(b).collect();
                    for (x, z) in a.grown(1).cells() {
                        let count = pieces.iter().filter(|r| r.contains(x, z)).count();
                        let want = usize::from(a.contains(x, z) && !b.contains(x, z));
                        assert_eq!(count, want, "({x}, {z}) of {a:?} less {b:?}");
                    }
                }
            }
        }
    }
}
