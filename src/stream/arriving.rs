//! A view's way to a terrain without waiting: what has not been loaded is missing, and on its way.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::tiles::{Patience, Tiles};
use crate::error::Result;
use crate::grid::{Grid, Rect};
use crate::levels::{Arrival, Bounds, Data, Levels, LightSample, Wanted};

/// Numbers views, so that each has wants of its own.
static VIEWS: AtomicU64 = AtomicU64::new(1);

/// The levels of a [`super::Terrain`] as they arrive, for one view.
///
/// Nothing but [`Levels::wait_for`] ever reads a file: what is not here is [`Arrival::Missing`], and loaded by threads in
/// the order of the last [`Levels::want`]. Dropped, it wants nothing any longer.
pub struct Arriving {
    levels: Arc<dyn Levels>,
    tiles: Option<Arc<Tiles>>,
    view: u64,
}

impl std::fmt::Debug for Arriving {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Arriving")
            .field("view", &self.view)
            .finish_non_exhaustive()
    }
}

impl Arriving {
    /// Of `levels` through `tiles`; without them they answer at once.
    pub(super) fn new(levels: Arc<dyn Levels>, tiles: Option<Arc<Tiles>>) -> Self {
        Self {
            levels,
            tiles,
            view: VIEWS.fetch_add(1, Ordering::Relaxed),
        }
    }

    /// Whether all that was wanted is here, and nothing on its way.
    pub fn is_idle(&self) -> bool {
        self.tiles.as_ref().is_none_or(|t| t.is_idle())
    }
}

impl Levels for Arriving {
    fn grid(&self) -> &Grid {
        self.levels.grid()
    }

    fn level_count(&self) -> u32 {
        self.levels.level_count()
    }

    fn heights(&self, level: u32, rect: Rect, out: &mut [f32]) -> Result<Arrival> {
        match &self.tiles {
            Some(tiles) => tiles.copy(Data::Heights, level, rect, out, Patience::None),
            None => self.levels.heights(level, rect, out),
        }
    }

    fn bounds(&self, level: u32, patches: Rect, out: &mut [Bounds]) -> Result<Arrival> {
        match &self.tiles {
            Some(tiles) => tiles.copy(Data::Bounds, level, patches, out, Patience::None),
            None => self.levels.bounds(level, patches, out),
        }
    }

    fn has_light(&self) -> bool {
        self.levels.has_light()
    }

    fn light(&self, level: u32, rect: Rect, out: &mut [LightSample]) -> Result<Arrival> {
        match &self.tiles {
            Some(tiles) if self.has_light() => tiles.copy(Data::Light, level, rect, out, Patience::None),
            _ => self.levels.light(level, rect, out),
        }
    }

    fn want(&self, wanted: &[Wanted]) {
        if let Some(tiles) = &self.tiles {
            tiles.want(self.view, wanted);
        }
    }

    fn wait_for(&self, wanted: &[Wanted]) {
        if let Some(tiles) = &self.tiles {
            tiles.wait_for(wanted);
        }
    }
}

impl Drop for Arriving {
    fn drop(&mut self) {
        if let Some(tiles) = &self.tiles {
            tiles.want(self.view, &[]);
        }
    }
}
