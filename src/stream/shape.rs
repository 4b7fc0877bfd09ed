//! How levels are cut into tiles: squares of samples, or of patches for bounds.

use crate::error::{Error, ErrorKind, Result};
use crate::grid::{Grid, Rect, Size};
use crate::levels::{Bounds, Data, DaySample};

/// Samples along a side of a tile of heights or light: that of a terrain file's tiles.
const SIDE: i64 = crate::terrain::layout::TILE;

/// A tile: what it holds, of which level, in which column and row of tiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) struct Key {
    pub(super) data: Data,
    pub(super) level: u32,
    pub(super) x: i64,
    pub(super) y: i64,
}

/// The tiles of one DEM's levels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    pub(super) grid: Grid,
    pub(super) levels: u32,
    /// Patches along a side of a tile of bounds.
    pub(super) bounds_side: i64,
}

impl Shape {
    /// Samples, or patches, along a side of a tile.
    pub(super) fn side(&self, data: Data) -> i64 {
        if data == Data::Bounds {
            self.bounds_side
        } else {
            SIDE
        }
    }

    /// The samples, or patches, that a level has.
    pub(super) fn size(&self, data: Data, level: u32) -> Size {
        match data {
            Data::Bounds => self.grid.patches(level),
            Data::Heights | Data::Light | Data::Day => self.grid.level(level),
        }
    }

    /// The samples, or patches, of a tile, cut at the level's edge.
    pub(super) fn rect(&self, key: Key) -> Rect {
        let side = self.side(key.data);
        Rect::new(key.x * side, key.y * side, (key.x + 1) * side, (key.y + 1) * side)
            .intersection(self.size(key.data, key.level).rect())
    }

    /// The tiles that hold some of `rect`, row by row; what of it lies outside the level has none.
    pub(super) fn keys(&self, data: Data, level: u32, rect: Rect) -> impl Iterator<Item = Key> + use<> {
        let side = self.side(data);
        let rect = rect.intersection(self.size(data, level).rect());
        let tiles = if rect.is_empty() {
            Rect::EMPTY
        } else {
            Rect::new(
                rect.x0 / side,
                rect.z0 / side,
                (rect.x1 - 1) / side + 1,
                (rect.z1 - 1) / side + 1,
            )
        };
        tiles.cells().map(move |(x, y)| Key { data, level, x, y })
    }

    /// The 32-bit words of a tile's samples.
    pub(super) fn words(&self, key: Key) -> usize {
        self.rect(key).area() as usize * words_per_sample(key.data)
    }

    /// Refuses a rectangle that does not lie in its level, or has another area than `places`.
    pub(super) fn check(&self, data: Data, level: u32, rect: Rect, places: usize) -> Result<()> {
        let within = level < self.levels && self.size(data, level).rect().contains_rect(rect);
        if within && places as i64 == rect.area() {
            return Ok(());
        }
        let what = format!("{rect:?} of level {level} with {places} places was asked for");
        Err(Error::new(ErrorKind::Misuse, "terrain", what))
    }
}

/// The 32-bit words of a sample, or of a patch's bounds.
pub(super) fn words_per_sample(data: Data) -> usize {
    match data {
        Data::Bounds => size_of::<Bounds>() / 4,
        Data::Heights | Data::Light => 1,
        Data::Day => size_of::<DaySample>() / 4,
    }
}

/// Copies what `tile`, whose samples lie at `from`, has of `rect` into `out`, which holds `rect` row by row.
pub(super) fn copy_part(
    tile: &[u32],
    from: Rect,
    sample_bytes: usize,
    rect: Rect,
    out: &mut [impl bytemuck::Pod],
) {
    let tile: &[u8] = bytemuck::cast_slice(tile);
    let out: &mut [u8] = bytemuck::cast_slice_mut(out);
    let both = from.intersection(rect);
    let count = both.width() as usize * sample_bytes;
    for z in both.z0..both.z1 {
        let at = |of: Rect| ((z - of.z0) * of.width() + both.x0 - of.x0) as usize * sample_bytes;
        out[at(rect)..][..count].copy_from_slice(&tile[at(from)..][..count]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_a_rectangle_and_copy_it_whole() {
        let shape = Shape {
            grid: Grid::new(700, 300, [1.0, 1.0]),
            levels: 5,
            bounds_side: 32,
        };
        for (data, level) in [
            (Data::Heights, 0),
            (Data::Bounds, 0),
            (Data::Light, 1),
            (Data::Day, 1),
        ] {
            let size = shape.size(data, level);
            let rect = Rect::new(5, 3, size.width - 1, size.height);
            let words = words_per_sample(data);
            let mut out = vec![[0u32; 6]; rect.area() as usize];
            let mut flat = vec![0u32; rect.area() as usize * words];
            for key in shape.keys(data, level, rect) {
                let from = shape.rect(key);
                let value = |(x, z): (i64, i64), w: usize| (z * 10_000 + x * 10) as u32 + w as u32;
                let tile: Vec<u32> = from
                    .cells()
                    .flat_map(|cell| (0..words).map(move |w| value(cell, w)))
                    .collect();
                assert_eq!(tile.len(), shape.words(key));
                copy_part(&tile, from, 4 * words, rect, &mut flat);
            }
            for (k, (x, z)) in rect.cells().enumerate() {
                for w in 0..words {
                    out[k][w] = flat[k * words + w];
                    assert_eq!(out[k][w], (z * 10_000 + x * 10) as u32 + w as u32, "({x}, {z})");
                }
            }
        }
        assert_eq!(shape.keys(Data::Heights, 0, Rect::new(-9, -9, 0, 0)).count(), 0);
        assert!(
            shape
                .check(Data::Heights, 0, Rect::new(0, 0, 701, 1), 701)
                .is_err()
        );
        assert!(shape.check(Data::Heights, 5, Rect::new(0, 0, 1, 1), 1).is_err());
    }
}
