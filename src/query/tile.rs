//! Level 0 in tiles of 256 x 256 quads, each with the least and greatest heights of ever larger squares of its quads:
//! of 2 x 2, of 4 x 4, up to the whole tile.

use std::sync::Arc;

use super::Quad;
use super::collider::arrived;
use super::shelf::Shelf;
use crate::error::Result;
use crate::grid::Rect;
use crate::levels::Levels;

/// Squares of `2^k` quads a side have rank k; a tile is the square of this rank.
pub(super) const TILE_RANK: u32 = 8;

/// Quads along a side of a tile.
pub(super) const TILE: i64 = 1 << TILE_RANK;

/// Samples along a side of a tile.
const SAMPLES: usize = TILE as usize + 1;

/// A tile: heights above the DEM's base, NaN for no data and beyond the DEM, and the ranges of its squares.
#[derive(Debug)]
pub(super) struct Tile {
    heights: Vec<f32>,
    /// By rank, from 1 on; row by row.
    ranges: [Vec<[f32; 2]>; TILE_RANK as usize],
}

impl Tile {
    fn new(heights: Vec<f32>) -> Self {
        let mut ranges: [Vec<[f32; 2]>; TILE_RANK as usize] = Default::default();
        // Without a valid sample, NaN: it is neither less nor greater than any.
        let join = |a: [f32; 2], b: [f32; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        let side = (TILE >> 1) as usize;
        ranges[0].reserve_exact(side * side);
        for z in 0..side {
            for x in 0..side {
                let rows = (0..3).map(|row| {
                    let first = (2 * z + row) * SAMPLES + 2 * x;
                    let h = &heights[first..first + 3];
                    [h[0].min(h[1]).min(h[2]), h[0].max(h[1]).max(h[2])]
                });
                ranges[0].push(rows.fold([f32::NAN; 2], join));
            }
        }
        for rank in 2..=TILE_RANK {
            let side = (TILE >> rank) as usize;
            let fine = &ranges[rank as usize - 2];
            let coarse = (0..side * side)
                .map(|k| {
                    let (x, z) = (k % side, k / side);
                    let at = |dx: usize, dz: usize| fine[(2 * z + dz) * 2 * side + 2 * x + dx];
                    join(join(at(0, 0), at(1, 0)), join(at(0, 1), at(1, 1)))
                })
                .collect();
            ranges[rank as usize - 1] = coarse;
        }
        Self { heights, ranges }
    }

    /// Quad (x, z) of the tile.
    pub(super) fn quad(&self, x: usize, z: usize) -> Quad {
        let first = z * SAMPLES + x;
        let north = &self.heights[first..first + 2];
        let south = &self.heights[first + SAMPLES..first + SAMPLES + 2];
        Quad {
            nw: f64::from(north[0]),
            ne: f64::from(north[1]),
            sw: f64::from(south[0]),
            se: f64::from(south[1]),
        }
    }

    /// Least and greatest valid height of square (x, z) of a rank from 1 on; NaN where all of it is void.
    pub(super) fn range(&self, rank: u32, x: usize, z: usize) -> [f32; 2] {
        self.ranges[rank as usize - 1][z * (TILE as usize >> rank) + x]
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.heights[..]) + self.ranges.iter().map(|r| size_of_val(&r[..])).sum::<usize>()
    }
}

/// Tiles of one DEM, read when they are first asked for and kept within a budget. Clones share them.
#[derive(Clone)]
pub struct Tiles(Shelf<Tile>);

impl std::fmt::Debug for Tiles {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Tiles").field("bytes", &self.bytes()).finish()
    }
}

impl Default for Tiles {
    /// With room for 256 MiB, the tiles of about 40 million samples.
    fn default() -> Self {
        Self::new(256 << 20)
    }
}

impl Tiles {
    /// None yet; one is kept whatever the budget.
    pub fn new(budget_bytes: usize) -> Self {
        Self(Shelf::new(budget_bytes))
    }

    /// The bytes that are held.
    pub fn bytes(&self) -> usize {
        self.0.bytes()
    }

    /// Tile (x, z) of `levels`, which must have a quad of the DEM.
    pub(super) fn tile(&self, levels: &dyn Levels, key: [i64; 2]) -> Result<Arc<Tile>> {
        self.0.get(key, || {
            let tile = read(levels, key)?;
            let bytes = tile.bytes();
            Ok((tile, bytes))
        })
    }
}

fn read(levels: &dyn Levels, [x, z]: [i64; 2]) -> Result<Tile> {
    let (x0, z0) = (x * TILE, z * TILE);
    let rect = Rect::new(x0, z0, x0 + TILE + 1, z0 + TILE + 1).intersection(levels.grid().size.rect());
    let mut read = vec![0.0; rect.area() as usize];
    arrived(levels.heights(0, rect, &mut read)?)?;
    let mut heights = vec![f32::NAN; SAMPLES * SAMPLES];
    let rows = read.chunks_exact(rect.width().max(1) as usize);
    for (row, out) in rows.zip(heights.chunks_exact_mut(SAMPLES)) {
        for (height, out) in row.iter().zip(out) {
            // Infinities are no data, whatever the source says.
            if height.is_finite() {
                *out = *height;
            }
        }
    }
    Ok(Tile::new(heights))
}
