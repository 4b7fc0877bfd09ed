//! The parts of a terrain file: names, channels, grids, and the order in which their tiles stand.
//!
//! | part | channels | grid |
//! |---|---|---|
//! | `height.0` ... | `Y` f32 | samples of the level |
//! | `bounds.0` ... | `error`, `max`, `min`, `need_error`, `need_max`, `need_min` f32 | patches of the level |
//! | `light.0` ... (where there is light) | `sky`, `sun` f16 | samples of the level |
//! | `day.0` ... (where there is a day) | `first`, `first_soft`, `last`, `last_soft`, `slope` f16 | samples of the level |
//! | `check.0` ... | `height`, `light` u32 | tiles of `height.N`; `light` is 0 without light |
//! | `check.day.0` ... (where there is a day) | `day` u32 | tiles of `day.N` |
//! | `check.bounds` | `bounds` u32 | row N: the tiles of `bounds.N`, row by row; cells beyond them are 0 |
//!
//! Parts stand in the order of this table, each kind from the finest level to the coarsest. All are tiled
//! 256 x 256 with one resolution level, ZIP, and share one display window, that of `height.0`. Channels are
//! alphabetical, as OpenEXR wants them.
//!
//! *Checks.* A check is the CRC-32C of a tile's decoded samples as OpenEXR lays out an uncompressed tile: row
//! by row, in each row channel by channel in alphabetical order, samples little-endian, the tile cut at the
//! part's edge.
//!
//! *Order of tiles.* Heights first, then bounds, light, the day, checks and `check.bounds`: each kind is made in a pass of its
//! own over what stands before it. Heights, bounds, light and day stand in the order of the rows of level 0 that a pass from
//! north to south must have seen ([`TileRow::seen`]); where equal the finer level first; within a row of tiles from
//! west to east. So one pass can write every tile as soon as that many rows were seen, and hold few of them.

use exr::meta::attribute::SampleType;

use crate::grid::{Grid, PATCH, Rect, Size};

/// The version of the layout and the attributes; a reader reads its own only.
pub const FORMAT_VERSION: u32 = 1;

/// Samples along a tile's side.
pub const TILE: i64 = 256;

/// Steps of a level by which the filter of any kernel, cascaded from level 0, stays below: see [`TileRow::seen`].
const FILTER_REACH: i64 = 64;

/// Steps of a level by which light reaches farther than its filter: under voids it comes from samples beside them.
const LIGHT_REACH: i64 = FILTER_REACH + 16;

/// The greatest side of a part: OpenEXR's windows end below 2^30 - 1.
pub const MAX_SIDE: i64 = (1 << 30) - 2;

/// What a part holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    /// Heights of a level.
    Height,
    /// Bounds of a level's patches.
    Bounds,
    /// Light of a level.
    Light,
    /// Light over a day of a level.
    Day,
    /// Checks of the tiles of a level's heights and light.
    Check,
    /// Checks of the tiles of a level's light over a day.
    CheckDay,
    /// Checks of the tiles of all levels' bounds.
    CheckBounds,
}

/// One part of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// What it holds.
    pub kind: Kind,
    /// Of which level; 0 for [`Kind::CheckBounds`].
    pub level: u32,
    /// Its samples.
    pub size: Size,
}

impl Part {
    /// Its name in the file.
    pub fn name(&self) -> String {
        match self.kind {
            Kind::Height => format!("height.{}", self.level),
            Kind::Bounds => format!("bounds.{}", self.level),
            Kind::Light => format!("light.{}", self.level),
            Kind::Day => format!("day.{}", self.level),
            Kind::Check => format!("check.{}", self.level),
            Kind::CheckDay => format!("check.day.{}", self.level),
            Kind::CheckBounds => "check.bounds".into(),
        }
    }

    /// Its channels in the order of the file, all of one type.
    pub fn channels(&self) -> (&'static [&'static str], SampleType) {
        match self.kind {
            Kind::Height => (&["Y"], SampleType::F32),
            Kind::Bounds => (
                &["error", "max", "min", "need_error", "need_max", "need_min"],
                SampleType::F32,
            ),
            Kind::Light => (&["sky", "sun"], SampleType::F16),
            Kind::Day => (
                &["first", "first_soft", "last", "last_soft", "slope"],
                SampleType::F16,
            ),
            Kind::Check => (&["height", "light"], SampleType::U32),
            Kind::CheckDay => (&["day"], SampleType::U32),
            Kind::CheckBounds => (&["bounds"], SampleType::U32),
        }
    }

    /// Bytes of one channel's sample.
    pub fn sample_bytes(&self) -> usize {
        self.channels().1.bytes_per_sample()
    }

    /// The tiles that cover it.
    pub fn tiles(&self) -> Size {
        let count = |n: i64| (n + TILE - 1) / TILE;
        Size {
            width: count(self.size.width),
            height: count(self.size.height),
        }
    }

    /// The samples of tile (x, y), cut at the part's edge.
    pub fn tile_rect(&self, x: i64, y: i64) -> Rect {
        Rect::new(x * TILE, y * TILE, (x + 1) * TILE, (y + 1) * TILE).intersection(self.size.rect())
    }

    /// The bytes of the decoded samples in `rect`.
    pub fn bytes(&self, rect: Rect) -> usize {
        rect.area() as usize * self.channels().0.len() * self.sample_bytes()
    }
}

/// A row of tiles of a part, from west to east.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TileRow {
    /// Index of the part.
    pub part: usize,
    /// Row of tiles.
    pub y: i64,
    /// Rows of level 0 after which it is certainly known, at most the DEM's. Of heights those under the tiles and 64 of the
    /// level's own steps more, of light 80: a kernel of 32 lobes reaches 63 samples of the next finer level, as many of
    /// the one below that, and so on, in all less than 63 steps of the level; and light is filled 16 samples into voids, a day's as many of level 0. Of bounds those under the patches and one
    /// patch more: saturation asks the next finer level for one patch more than the children, and so on down.
    pub seen: i64,
}

/// All parts of a terrain file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    parts: Vec<Part>,
    levels: u32,
    light: bool,
    day: bool,
}

impl Layout {
    /// The parts for a DEM of `grid`, with light or without, and with a day or without; else what is wrong with the grid, as a phrase.
    pub fn new(grid: &Grid, light: bool, day: bool) -> Result<Self, String> {
        grid.check()?;
        let Size { width, height } = grid.size;
        if width > MAX_SIDE || height > MAX_SIDE {
            return Err(format!(
                "a size of {width} x {height} samples is above {MAX_SIDE} a side"
            ));
        }
        let levels = grid.file_levels();
        let mut parts = Vec::new();
        let mut per_level = |kind, size: &dyn Fn(u32) -> Size| {
            parts.extend((0..levels).map(|level| Part {
                kind,
                level,
                size: size(level),
            }));
        };
        per_level(Kind::Height, &|l| grid.level(l));
        per_level(Kind::Bounds, &|l| grid.patches(l));
        if light {
            per_level(Kind::Light, &|l| grid.level(l));
        }
        if day {
            per_level(Kind::Day, &|l| grid.level(l));
        }
        let tiles_of = |kind, size| Part { kind, level: 0, size }.tiles();
        per_level(Kind::Check, &|l| tiles_of(Kind::Height, grid.level(l)));
        if day {
            per_level(Kind::CheckDay, &|l| tiles_of(Kind::Day, grid.level(l)));
        }
        let bounds_tiles = tiles_of(Kind::Bounds, grid.patches(0)).samples();
        let size = Size {
            width: bounds_tiles,
            height: i64::from(levels),
        };
        parts.push(Part {
            kind: Kind::CheckBounds,
            level: 0,
            size,
        });
        // OpenEXR counts the tiles of a part in i32.
        for part in &parts {
            let Size { width, height } = part.size;
            if part.tiles().samples() > i64::from(i32::MAX) || width > MAX_SIDE || height > MAX_SIDE {
                let name = part.name();
                return Err(format!(
                    "its part {name} of {width} x {height} is more than OpenEXR can hold"
                ));
            }
        }
        Ok(Self {
            parts,
            levels,
            light,
            day,
        })
    }

    /// All parts in the order of the file.
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// The number of levels.
    pub fn levels(&self) -> u32 {
        self.levels
    }

    /// The index of the part of `kind` and `level`. Light only where there is light, a day where there is one.
    pub fn part(&self, kind: Kind, level: u32) -> usize {
        let before = match kind {
            Kind::Height => 0,
            Kind::Bounds => 1,
            Kind::Light => 2,
            Kind::Day => 2 + usize::from(self.light),
            Kind::Check | Kind::CheckBounds => 2 + usize::from(self.light) + usize::from(self.day),
            Kind::CheckDay => 4 + usize::from(self.light),
        };
        match kind {
            Kind::CheckBounds => self.parts.len() - 1,
            _ => before * self.levels as usize + level as usize,
        }
    }

    /// Where the check of tile (x, y) of part `part` stands: part, sample and channel. None for checks.
    pub fn check_of(&self, part: usize, x: i64, y: i64) -> Option<Check> {
        let Part { kind, level, .. } = self.parts[part];
        match kind {
            Kind::Height => Some(Check {
                part: self.part(Kind::Check, level),
                x,
                y,
                channel: 0,
            }),
            Kind::Light => Some(Check {
                part: self.part(Kind::Check, level),
                x,
                y,
                channel: 1,
            }),
            Kind::Day => Some(Check {
                part: self.part(Kind::CheckDay, level),
                x,
                y,
                channel: 0,
            }),
            Kind::Bounds => {
                let x = y * self.parts[part].tiles().width + x;
                Some(Check {
                    part: self.part(Kind::CheckBounds, 0),
                    x,
                    y: i64::from(level),
                    channel: 0,
                })
            }
            Kind::Check | Kind::CheckDay | Kind::CheckBounds => None,
        }
    }

    /// The number of tiles in the file.
    pub fn tile_count(&self) -> u64 {
        self.parts.iter().map(|p| p.tiles().samples() as u64).sum()
    }

    /// All rows of tiles in the order of the file.
    pub fn order(&self) -> Vec<TileRow> {
        let rows = self.parts[0].size.height;
        let mut order = Vec::new();
        for (part, Part { kind, level, .. }) in self.parts.iter().enumerate() {
            for y in 0..self.parts[part].tiles().height {
                let under = match (kind, level) {
                    (Kind::Height, 0) => (y + 1) * TILE,
                    (Kind::Height | Kind::Day, _) => (y + 1) * TILE + FILTER_REACH,
                    (Kind::Light, _) => (y + 1) * TILE + LIGHT_REACH,
                    (Kind::Bounds, _) => ((y + 1) * TILE + 1) * PATCH,
                    (Kind::Check | Kind::CheckDay | Kind::CheckBounds, _) => rows,
                };
                let seen = (under << level).min(rows);
                order.push(TileRow { part, y, seen });
            }
        }
        order.sort_by_key(|row| {
            let Part { kind, level, .. } = self.parts[row.part];
            (kind, row.seen, level, row.y)
        });
        order
    }

    /// The rows of tiles of `kind`, in the order of the file.
    pub fn order_of(&self, kind: Kind) -> Vec<TileRow> {
        let mut order = self.order();
        order.retain(|row| self.parts[row.part].kind == kind);
        order
    }
}

/// Where the check of a tile stands: a sample of a check part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Check {
    /// Index of the check part.
    pub part: usize,
    /// Column of the sample.
    pub x: i64,
    /// Row of the sample.
    pub y: i64,
    /// Its channel.
    pub channel: usize,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_found_where_they_stand_and_their_grids_follow_the_rules() {
        for (w, h, light) in [
            (1, 1, true),
            (1, 500, false),
            (300, 700, true),
            (1201, 1201, false),
        ] {
            let grid = Grid::new(w, h, [1.0, 1.0]);
            for day in [false, true] {
                let layout = Layout::new(&grid, light, day).unwrap();
                for (index, part) in layout.parts().iter().enumerate() {
                    assert_eq!(layout.part(part.kind, part.level), index, "{part:?}");
                    assert!(part.channels().0.is_sorted());
                }
                let has_light = layout.parts().iter().any(|p| p.kind == Kind::Light);
                assert_eq!(has_light, light);
                assert_eq!(layout.parts().iter().any(|p| p.kind == Kind::Day), day);
                assert_eq!(layout.parts().last().unwrap().name(), "check.bounds");
            }
        }
    }

    #[test]
    fn every_row_stands_once_and_checks_stand_after_what_they_check() {
        let layout = Layout::new(&Grid::new(3000, 5000, [1.0, 1.0]), true, true).unwrap();
        let order = layout.order();
        let rows: i64 = layout.parts().iter().map(|p| p.tiles().height).sum();
        assert_eq!(order.len() as i64, rows);
        let place = |part, y| order.iter().position(|r| r.part == part && r.y == y).unwrap();
        for (index, part) in layout.parts().iter().enumerate() {
            for y in 0..part.tiles().height {
                if let Some(check) = layout.check_of(index, 0, y) {
                    assert!(
                        place(index, y) < place(check.part, check.y / TILE),
                        "{part:?} row {y}"
                    );
                }
                if part.kind == Kind::Height && y > 0 {
                    assert!(place(index, y - 1) < place(index, y));
                }
            }
        }
        // The first row of tiles of level 1 needs 128 rows of level 0 beyond the second.
        let at = |l, y| place(layout.part(Kind::Height, l), y);
        assert!(at(0, 1) < at(1, 0) && at(1, 0) < at(0, 2));
        // Each kind follows the one it is made of.
        let kinds: Vec<Kind> = order.iter().map(|row| layout.parts()[row.part].kind).collect();
        assert!(kinds.is_sorted());
    }

    #[test]
    fn rows_are_known_once_as_many_were_seen_as_the_order_says() {
        for (width, height) in [(3, 70_000), (1, 1), (1, 300), (70, 5001)] {
            let grid = Grid::new(width, height, [1.0, 1.0]);
            let layout = Layout::new(&grid, true, true).unwrap();
            for row in layout.order() {
                let Part { kind, level, size } = layout.parts()[row.part];
                let beside = if kind == Kind::Light {
                    crate::light::LIGHT_ROWS_BESIDE
                } else {
                    0
                };
                let last = ((row.y + 1) * TILE + beside).min(size.height) - 1;
                // The row of level 0 that the last row of the tile needs, by walking down.
                let mut needs = last;
                for finer in (0..level).rev() {
                    let (reach, count) = match kind {
                        Kind::Height | Kind::Light | Kind::Day => (63, grid.level(finer).height),
                        Kind::Bounds => (2, grid.patches(finer).height),
                        Kind::Check | Kind::CheckDay | Kind::CheckBounds => continue,
                    };
                    needs = (2 * needs + reach).min(count - 1);
                }
                if kind == Kind::Bounds {
                    needs = ((needs + 1) * PATCH).min(height - 1);
                }
                if kind == Kind::Day {
                    // Filled into voids on level 0.
                    needs = (needs + crate::light::LIGHT_ROWS_BESIDE).min(height - 1);
                }
                if !matches!(kind, Kind::Check | Kind::CheckDay | Kind::CheckBounds) {
                    assert!(needs < row.seen, "{width} x {height}: {row:?} needs {needs}");
                }
            }
        }
    }

    #[test]
    fn grids_beyond_openexr_are_refused_without_counting_tiles_one_by_one() {
        let layout = |w, h| Layout::new(&Grid::new(w, h, [1.0, 1.0]), true, true);
        assert!(layout(1 << 20, 1 << 20).is_ok());
        assert!(layout(1 << 30, 1).unwrap_err().contains("a side"));
        assert!(
            layout(MAX_SIDE, MAX_SIDE)
                .unwrap_err()
                .contains("more than OpenEXR")
        );
        assert!(layout(0, 4).is_err());
    }
}
