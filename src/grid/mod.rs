//! Level sizes, patches, rectangles and toroidal slots: the only index arithmetic of the crate.
//!
//! Sample `i` of level `l` lies over column `i * 2^l` of the DEM, always. Level `l` has
//! `W_l = ceil((W - 1) / 2^l) + 1` columns, so its last sample lies on the east edge or beyond it by less
//! than a step; likewise for rows. Each cell is split by the diagonal from its north-west to its
//! south-east corner, on every level.

mod patch;
mod rect;
mod toroidal;

pub use patch::{PATCH, Patch};
pub use rect::Rect;
pub use toroidal::{seam_pieces, slot};

/// The greatest number of levels of any grid: level sizes halve, and sizes are below 2^31.
pub const MAX_LEVELS: u32 = 32;

/// The greatest width and height of a DEM in samples: the GPU addresses samples of one DEM in i32.
pub const MAX_SIZE: i64 = 1 << 30;

/// The least and the greatest spacing in metres: what is made of them stays within f32 on the GPU.
pub const SPACING_M: [f64; 2] = [1e-9, 1e12];

/// The greatest index offset in samples: indices beside it still fit i64 with room to spare.
const MAX_OFFSET: u64 = 1 << 60;

/// A file holds levels from 0 to the first of at most this many samples a side.
pub const COARSEST: i64 = 64;

/// Samples of a grid: columns from west to east and rows from north to south.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Size {
    /// Columns.
    pub width: i64,
    /// Rows.
    pub height: i64,
}

impl Size {
    /// The number of samples.
    pub fn samples(self) -> i64 {
        self.width * self.height
    }

    /// The whole grid as a rectangle of samples.
    pub fn rect(self) -> Rect {
        Rect::new(0, 0, self.width, self.height)
    }

    /// The size of level `level` of a grid of this size: `ceil((W - 1) / 2^l) + 1`, likewise for rows.
    pub fn level(self, level: u32) -> Self {
        let halve = |n: i64| ((n - 1) + (1i64 << level) - 1) / (1i64 << level) + 1;
        Self {
            width: halve(self.width),
            height: halve(self.height),
        }
    }

    /// The number of patches that cover a level of this size: at least 1 x 1.
    pub fn patches(self) -> Self {
        let count = |n: i64| ((n - 1) + PATCH - 1) / PATCH;
        Self {
            width: count(self.width).max(1),
            height: count(self.height).max(1),
        }
    }
}

/// Where a DEM's samples lie: its size, spacing, index offset, and the height subtracted from all of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Size of level 0 in samples; both sides at least 1 and at most [`MAX_SIZE`].
    pub size: Size,
    /// Metres between columns and between rows, within [`SPACING_M`].
    pub spacing_m: [f64; 2],
    /// Column and row of sample (0, 0) in a larger grid of which this one is a crop. It shifts toroidal
    /// slots and anchors, nothing else.
    pub offset: [i64; 2],
    /// Metres subtracted from every height before it was rounded to f32.
    pub base_m: f64,
}

impl Grid {
    /// A grid without offset and base.
    pub fn new(width: i64, height: i64, spacing_m: [f64; 2]) -> Self {
        Self {
            size: Size { width, height },
            spacing_m,
            offset: [0, 0],
            base_m: 0.0,
        }
    }

    /// The size of level `level` in samples.
    pub fn level(&self, level: u32) -> Size {
        self.size.level(level)
    }

    /// The patches of level `level`.
    pub fn patches(&self, level: u32) -> Size {
        self.level(level).patches()
    }

    /// The number of levels that a file holds: from 0 to the first of at most [`COARSEST`] samples a side.
    pub fn file_levels(&self) -> u32 {
        self.levels_until(COARSEST)
    }

    /// The number of levels from 0 to the first of at most `side` samples a side (`side` at least 2).
    pub fn levels_until(&self, side: i64) -> u32 {
        debug_assert!(side >= 2, "a level of 2 samples never shrinks to {side}");
        (0..)
            .find(|&l| {
                let size = self.level(l);
                size.width <= side && size.height <= side
            })
            .map_or(1, |l| l + 1)
    }

    /// Whether the grid is one that this crate can hold; else what is wrong with it, as a phrase.
    pub fn check(&self) -> Result<(), String> {
        let Size { width, height } = self.size;
        if width < 1 || height < 1 {
            return Err(format!("a size of {width} x {height} samples holds no data"));
        }
        if width > MAX_SIZE || height > MAX_SIZE {
            return Err(format!(
                "a size of {width} x {height} samples is above {MAX_SIZE} a side"
            ));
        }
        let [least, most] = SPACING_M;
        if !self.spacing_m.iter().all(|s| (least..=most).contains(s)) {
            let [dx, dz] = self.spacing_m;
            return Err(format!(
                "a spacing of {dx:?} x {dz:?} m is not within {least:?} to {most:?} m"
            ));
        }
        if self.offset.iter().any(|o| o.unsigned_abs() > MAX_OFFSET) {
            let [x, z] = self.offset;
            return Err(format!("an index offset of {x}, {z} is beyond 2^60 samples"));
        }
        if !self.base_m.is_finite() {
            return Err(format!("a base height of {} m is not finite", self.base_m));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_level_reaches_the_east_and_south_edges_by_less_than_a_step() {
        for n in (1..300).chain([1000, 1013, 1024, 1025, 1201, 13201, MAX_SIZE]) {
            let grid = Grid::new(n, n, [1.0, 1.0]);
            for l in 0..grid.file_levels() {
                let last = (grid.level(l).width - 1) << l;
                assert!(
                    last >= n - 1 && last - (n - 1) < 1 << l,
                    "{n} samples, level {l}: last at {last}"
                );
            }
        }
    }

    #[test]
    fn control_levels_rounded_down_would_miss_the_edge() {
        let last = |n: i64, l: u32| ((n - 1) >> l) << l;
        assert!(
            [1000, 1013, 13201]
                .iter()
                .any(|&n| (0..8).any(|l| last(n, l) < n - 1))
        );
    }

    #[test]
    fn sizes_compose_from_level_to_level() {
        for n in 1..2000 {
            let size = Size { width: n, height: 3 };
            assert_eq!(size.level(2), size.level(1).level(1), "{n}");
        }
    }

    #[test]
    fn a_file_ends_with_the_first_level_of_at_most_64() {
        let levels = |w, h| Grid::new(w, h, [1.0, 1.0]).file_levels();
        assert_eq!(levels(64, 64), 1);
        assert_eq!(levels(65, 1), 2);
        assert_eq!(levels(1201, 1201), 6); // 1201 601 301 151 76 39
        assert_eq!(levels(1, 1), 1);
    }

    #[test]
    fn impossible_grids_are_named() {
        assert!(Grid::new(0, 5, [1.0, 1.0]).check().unwrap_err().contains("0 x 5"));
        assert!(Grid::new(5, MAX_SIZE + 1, [1.0, 1.0]).check().is_err());
        assert!(Grid::new(5, 5, [f64::NAN, 1.0]).check().is_err());
        assert!(Grid::new(5, 5, [1.0, 0.0]).check().is_err());
        assert!(Grid::new(5, 5, [1e-300, 1.0]).check().is_err());
        assert!(Grid::new(5, 5, [1.0, f64::INFINITY]).check().is_err());
        assert!(Grid::new(5, 5, [1e-3, 1e6]).check().is_ok());
        let shifted = |x| Grid {
            offset: [x, 0],
            ..Grid::new(5, 5, [1.0, 1.0])
        };
        assert!(shifted(i64::MIN).check().is_err() && shifted(-(1 << 60)).check().is_ok());
    }
}
