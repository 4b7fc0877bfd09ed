//! What a terrain answers from at the moment, and what takes its place.
//!
//! A DEM that was opened at once is a draft first, then its terrain file without light, then with it. Each is a *stage*;
//! views go over to the next one between their frames.

use std::sync::{Arc, PoisonError, RwLock};

use super::tiles::Tiles;
use super::{FILE_BOUNDS_SIDE, TileOptions};
use crate::levels::Levels;
use crate::terrain::TerrainFile;

/// Levels, and the tiles through which they are read where they take a while to answer.
#[derive(Clone)]
pub(super) struct Stage {
    pub(super) levels: Arc<dyn Levels>,
    pub(super) tiles: Option<Arc<Tiles>>,
    /// Whether those who wait go through the tiles too.
    shared: bool,
    /// Patches along a side of a tile of bounds.
    bounds_side: i64,
}

impl Stage {
    /// Levels that answer at once.
    pub(super) fn in_memory(levels: Arc<dyn Levels>) -> Self {
        Self {
            levels,
            tiles: None,
            shared: false,
            bounds_side: FILE_BOUNDS_SIDE,
        }
    }

    /// Levels that are computed; whoever waits does that itself. `bounds_side` patches along a side of a tile of bounds.
    pub(super) fn computed(levels: Arc<dyn Levels>, bounds_side: i64, options: &TileOptions) -> Self {
        Self {
            tiles: Some(Arc::new(Tiles::new(levels.clone(), bounds_side, options))),
            levels,
            shared: false,
            bounds_side,
        }
    }

    /// The same with tiles of its own, where it has any.
    pub(super) fn with_tiles(self, options: &TileOptions) -> Self {
        let tiles = || Arc::new(Tiles::new(self.levels.clone(), self.bounds_side, options));
        Self {
            tiles: self.tiles.as_ref().map(|_| tiles()),
            ..self
        }
    }

    /// A terrain file.
    pub(super) fn of_file(file: TerrainFile, options: &TileOptions) -> Self {
        Self {
            shared: true,
            ..Self::computed(Arc::new(file), FILE_BOUNDS_SIDE, options)
        }
    }

    /// The tiles for those who wait.
    pub(super) fn shared_tiles(&self) -> Option<&Tiles> {
        self.tiles.as_deref().filter(|_| self.shared)
    }
}

/// The stage of the moment, and its number.
pub(super) struct Current(RwLock<(u64, Stage)>);

impl Current {
    pub(super) fn new(stage: Stage) -> Self {
        Self(RwLock::new((0, stage)))
    }

    /// The stage of the moment, and its number.
    pub(super) fn get(&self) -> (u64, Stage) {
        self.0.read().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// The next stage.
    pub(super) fn replace(&self, stage: Stage) {
        let mut current = self.0.write().unwrap_or_else(PoisonError::into_inner);
        *current = (current.0 + 1, stage);
    }
}
