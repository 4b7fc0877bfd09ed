//! A view's way to a terrain without waiting: what has not been loaded is missing, and on its way.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, PoisonError, RwLock};

use super::stage::{Current, Stage};
use super::tiles::Patience;
use crate::error::Result;
use crate::grid::{Grid, Rect};
use crate::levels::{Arrival, Bounds, Data, DaySample, Levels, LightSample, Wanted};

/// Numbers views, so that each has wants of its own.
static VIEWS: AtomicU64 = AtomicU64::new(1);

/// The levels of a [`super::Terrain`] as they arrive, for one view.
///
/// Nothing but [`Levels::wait_for`] ever reads a file: what is not here is [`Arrival::Missing`], and loaded by threads in
/// the order of the last [`Levels::want`]. Dropped, it wants nothing any longer.
pub struct Arriving {
    grid: Grid,
    current: Arc<Current>,
    /// The stage that this view has come to.
    stage: RwLock<(u64, Stage)>,
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
    pub(super) fn new(current: Arc<Current>) -> Self {
        let stage = current.get();
        Self {
            grid: *stage.1.levels.grid(),
            stage: RwLock::new(stage),
            current,
            view: VIEWS.fetch_add(1, Ordering::Relaxed),
        }
    }

    /// Whether all that was wanted is here, and nothing on its way.
    pub fn is_idle(&self) -> bool {
        self.stage().tiles.is_none_or(|t| t.is_idle())
    }

    fn stage(&self) -> Stage {
        self.stage
            .read()
            .unwrap_or_else(PoisonError::into_inner)
            .1
            .clone()
    }
}

impl Levels for Arriving {
    fn grid(&self) -> &Grid {
        &self.grid
    }

    fn level_count(&self) -> u32 {
        self.stage().levels.level_count()
    }

    fn heights(&self, level: u32, rect: Rect, out: &mut [f32]) -> Result<Arrival> {
        let Stage { levels, tiles, .. } = self.stage();
        match tiles {
            Some(tiles) => tiles.copy(Data::Heights, level, rect, out, Patience::None),
            None => levels.heights(level, rect, out),
        }
    }

    fn bounds(&self, level: u32, patches: Rect, out: &mut [Bounds]) -> Result<Arrival> {
        let Stage { levels, tiles, .. } = self.stage();
        match tiles {
            Some(tiles) => tiles.copy(Data::Bounds, level, patches, out, Patience::None),
            None => levels.bounds(level, patches, out),
        }
    }

    fn has_light(&self) -> bool {
        self.stage().levels.has_light()
    }

    fn light(&self, level: u32, rect: Rect, out: &mut [LightSample]) -> Result<Arrival> {
        let Stage { levels, tiles, .. } = self.stage();
        match tiles {
            Some(tiles) if levels.has_light() => tiles.copy(Data::Light, level, rect, out, Patience::None),
            _ => levels.light(level, rect, out),
        }
    }

    fn has_day(&self) -> bool {
        self.stage().levels.has_day()
    }

    fn day(&self, level: u32, rect: Rect, out: &mut [DaySample]) -> Result<Arrival> {
        let Stage { levels, tiles, .. } = self.stage();
        match tiles {
            Some(tiles) if levels.has_day() => tiles.copy(Data::Day, level, rect, out, Patience::None),
            _ => levels.day(level, rect, out),
        }
    }

    fn want(&self, wanted: &[Wanted]) {
        if let Some(tiles) = self.stage().tiles {
            tiles.want(self.view, wanted);
        }
    }

    fn wait_for(&self, wanted: &[Wanted]) {
        if let Some(tiles) = self.stage().tiles {
            tiles.wait_for(wanted);
        }
    }

    fn edition(&self) -> u64 {
        let current = self.current.get();
        let mut stage = self.stage.write().unwrap_or_else(PoisonError::into_inner);
        if current.0 != stage.0 {
            if let Some(tiles) = &stage.1.tiles {
                tiles.want(self.view, &[]);
            }
            *stage = current;
        }
        stage.0
    }

    fn is_provisional(&self) -> bool {
        self.stage().levels.is_provisional()
    }
}

impl Drop for Arriving {
    fn drop(&mut self) {
        if let Some(tiles) = self.stage().tiles {
            tiles.want(self.view, &[]);
        }
    }
}
