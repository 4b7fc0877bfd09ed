//! `S0`, the truth: level 0 of any [`Levels`], read tile by tile into a small cache, never as a whole.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::collider::arrived;
use super::{Reader, Surface};
use crate::clipmap::{CORNERS, Corners, Place};
use crate::error::Result;
use crate::grid::{Grid, PATCH, Patch, Rect};
use crate::levels::{Arrival, Bounds, Levels};

/// Patches along a side of a tile: 256 samples and one more.
const TILE: i64 = 32;

/// Bytes of tiles that are kept, about.
const BUDGET_BYTES: usize = 64 << 20;

/// The surface of a DEM's own samples.
pub struct S0<'a> {
    levels: &'a dyn Levels,
    vertical_scale: f64,
    budget_bytes: usize,
    cache: Mutex<Cache>,
}

impl std::fmt::Debug for S0<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("S0")
            .field("grid", self.levels.grid())
            .field("vertical_scale", &self.vertical_scale)
            .finish_non_exhaustive()
    }
}

/// What tile: heights of level 0, or bounds of patches of a level; its column and row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Key {
    bounds_of: Option<u32>,
    x: i64,
    z: i64,
}

#[derive(Clone)]
enum Tile {
    /// Heights of a rectangle of samples.
    Heights(Rect, Arc<[f32]>),
    /// Least and greatest height of each of a rectangle of patches and of all below it; NaN where not known.
    Bounds(Rect, Arc<[[f32; 2]]>),
}

impl Tile {
    fn bytes(&self) -> usize {
        match self {
            Self::Heights(_, heights) => size_of_val(&heights[..]),
            Self::Bounds(_, bounds) => size_of_val(&bounds[..]),
        }
    }
}

#[derive(Default)]
struct Cache {
    tiles: HashMap<Key, (Tile, u64)>,
    bytes: usize,
    clock: u64,
}

impl<'a> S0<'a> {
    /// The surface of level 0 of `levels`, which must be a source that waits for its data.
    pub fn new(levels: &'a dyn Levels) -> Self {
        Self {
            levels,
            vertical_scale: 1.0,
            budget_bytes: BUDGET_BYTES,
            cache: Mutex::default(),
        }
    }

    /// The same, drawn with a factor on heights relative to the eye; only picks heed it.
    #[must_use]
    pub fn with_vertical_scale(mut self, vertical_scale: f64) -> Self {
        self.vertical_scale = vertical_scale;
        self
    }

    fn cache(&self) -> MutexGuard<'_, Cache> {
        // Nothing is done under the lock that could leave it half done.
        self.cache.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn tile(&self, key: Key) -> Result<Tile> {
        {
            let mut cache = self.cache();
            cache.clock += 1;
            let now = cache.clock;
            if let Some((tile, used)) = cache.tiles.get_mut(&key) {
                *used = now;
                return Ok(tile.clone());
            }
        }
        // Read without the lock: two threads may now and then read the same, but none waits for another's disk.
        let tile = match key.bounds_of {
            None => self.read_heights(key)?,
            Some(level) => self.read_bounds(level, key)?,
        };
        let mut cache = self.cache();
        cache.clock += 1;
        let now = cache.clock;
        cache.bytes += tile.bytes();
        if let Some((old, _)) = cache.tiles.insert(key, (tile.clone(), now)) {
            cache.bytes -= old.bytes();
        }
        while cache.bytes > self.budget_bytes && cache.tiles.len() > 1 {
            let oldest = cache
                .tiles
                .iter()
                .min_by_key(|(_, (_, used))| *used)
                .map(|(key, _)| *key);
            if let Some((old, _)) = oldest.and_then(|key| cache.tiles.remove(&key)) {
                cache.bytes -= old.bytes();
            }
        }
        Ok(tile)
    }

    fn read_heights(&self, key: Key) -> Result<Tile> {
        let side = TILE * PATCH;
        let (x, z) = (key.x * side, key.z * side);
        // One more column and row: a patch's corners all lie in one tile.
        let rect = Rect::new(x, z, x + side + 1, z + side + 1).intersection(self.levels.grid().size.rect());
        let mut heights = vec![0.0; rect.area() as usize];
        arrived(self.levels.heights(0, rect, &mut heights)?)?;
        // Infinities are no data, whatever the source says.
        heights
            .iter_mut()
            .filter(|h| !h.is_finite())
            .for_each(|h| *h = f32::NAN);
        Ok(Tile::Heights(rect, heights.into()))
    }

    fn read_bounds(&self, level: u32, key: Key) -> Result<Tile> {
        let (x, z) = (key.x * TILE, key.z * TILE);
        let rect = Rect::new(x, z, x + TILE, z + TILE).intersection(self.levels.grid().patches(level).rect());
        let mut bounds = vec![Bounds::VOID; rect.area() as usize];
        let unknown = self.levels.bounds(level, rect, &mut bounds)? == Arrival::Missing;
        // Above level 0 a patch stands for all below it, which its own samples do not bound.
        let pair = |b: &Bounds| match (unknown, level) {
            (true, _) => [f32::NAN; 2],
            (false, 0) => [b.min, b.max],
            (false, _) => [b.need_min, b.need_max],
        };
        Ok(Tile::Bounds(rect, bounds.iter().map(pair).collect()))
    }
}

impl Surface for S0<'_> {
    fn grid(&self) -> &Grid {
        self.levels.grid()
    }

    fn vertical_scale(&self) -> f64 {
        self.vertical_scale
    }

    fn roots(&self) -> (u32, Rect) {
        let coarsest = self.levels.level_count() - 1;
        (coarsest, self.levels.grid().patches(coarsest).rect())
    }

    fn reader(&self) -> Box<dyn Reader + '_> {
        Box::new(S0Reader {
            s0: self,
            tiles: vec![None; self.levels.level_count() as usize + 1],
            corners: [f32::NAN; CORNERS * CORNERS],
        })
    }
}

/// Remembers the last tile of each level's bounds and of heights: a ray stays in a tile for long.
struct S0Reader<'a> {
    s0: &'a S0<'a>,
    /// Of heights, then of the bounds of each level.
    tiles: Vec<Option<(Key, Tile)>>,
    corners: Corners,
}

impl S0Reader<'_> {
    fn tile(&mut self, key: Key) -> Result<&Tile> {
        let slot = &mut self.tiles[key.bounds_of.map_or(0, |level| level as usize + 1)];
        let tile = match slot.take() {
            Some((last, tile)) if last == key => tile,
            _ => self.s0.tile(key)?,
        };
        Ok(&slot.insert((key, tile)).1)
    }
}

impl Reader for S0Reader<'_> {
    fn place(&self, patch: Patch) -> Place {
        let exists = self
            .s0
            .levels
            .grid()
            .patches(patch.level)
            .rect()
            .contains(patch.a, patch.b);
        match (exists, patch.level) {
            (false, _) => Place::Nothing,
            (true, 0) => Place::Patch,
            (true, _) => Place::Finer,
        }
    }

    fn heights(&mut self, patch: Patch) -> Result<[f32; 2]> {
        let key = Key {
            bounds_of: Some(patch.level),
            x: patch.a.div_euclid(TILE),
            z: patch.b.div_euclid(TILE),
        };
        Ok(match self.tile(key)? {
            Tile::Bounds(rect, bounds) if rect.contains(patch.a, patch.b) => {
                bounds[((patch.b - rect.z0) * rect.width() + (patch.a - rect.x0)) as usize]
            }
            _ => [f32::NAN; 2],
        })
    }

    fn corners(&mut self, patch: Patch) -> Result<&Corners> {
        let key = Key {
            bounds_of: None,
            x: patch.a.div_euclid(TILE),
            z: patch.b.div_euclid(TILE),
        };
        let mut corners = [f32::NAN; CORNERS * CORNERS];
        if let Tile::Heights(rect, heights) = self.tile(key)? {
            let samples = patch.samples().intersection(*rect);
            for (j, out) in (samples.z0..samples.z1).zip(corners.chunks_exact_mut(CORNERS)) {
                let first = ((j - rect.z0) * rect.width() + (samples.x0 - rect.x0)) as usize;
                let width = samples.width() as usize;
                out[..width].copy_from_slice(&heights[first..first + width]);
            }
        }
        self.corners = corners;
        Ok(&self.corners)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::Silent;
    use crate::pyramid::random::Random;
    use crate::pyramid::{Filter, Pyramid};
    use crate::work::Serial;

    #[test]
    fn a_small_cache_stays_small_and_changes_nothing() {
        let grid = Grid::new(1100, 900, [1.0, 1.0]);
        let mut random = Random::new(5);
        let heights = random.heights(1100 * 900, 0.0, 100.0, 0.1);
        let mut pyramid = Pyramid::new(grid, heights, None, &Filter::default(), &Serial, &Silent).unwrap();
        pyramid.bound(&Serial, &Silent).unwrap();
        let roomy = S0::new(&pyramid);
        let tight = S0 {
            budget_bytes: 300_000, // one tile of heights
            ..S0::new(&pyramid)
        };
        for _ in 0..300 {
            let (x, z) = (random.between(-9.0, 1110.0), random.between(-9.0, 910.0));
            assert_eq!(roomy.height_at(x, z).unwrap(), tight.height_at(x, z).unwrap());
            let from = glam::DVec3::new(x, 130.0, z);
            let along = glam::DVec3::new(random.between(-9.0, 9.0), -0.5, random.between(-9.0, 9.0));
            assert_eq!(roomy.ray(from, along).unwrap(), tight.ray(from, along).unwrap());
            assert!(tight.cache().bytes <= tight.budget_bytes);
        }
        let bytes: usize = roomy.cache().tiles.values().map(|(tile, _)| tile.bytes()).sum();
        assert_eq!(roomy.cache().bytes, bytes);
        assert!(bytes > 10 * tight.cache().bytes, "{bytes}: all was read");
    }
}
