//! A terrain to draw, from whatever a user names: a terrain file, a DEM, or procedural terrain.
//!
//! A terrain file is read tile by tile as windows ask for it, into a cache with a budget of bytes. A DEM has no coarser
//! levels, so its pyramid is built in memory first (without light); preprocessing it once is quicker from the second look
//! on. Procedural terrain knows every level and needs neither.
//!
//! A [`Terrain`] waits for what it is asked for. [`Terrain::arriving`] is the same terrain for a view that does not: what
//! has not been loaded is missing there, and threads load it in the order in which it is wanted.
//!
//! [`Terrain::open_at_once`] does not wait for a DEM's pyramid either: there is a draft of it at once, from what is quick
//! to read, and its terrain file is built in the background, takes the draft's place, and is kept for the next run in a
//! [`CacheFolder`].

use std::path::Path;
use std::sync::Arc;

mod arriving;
mod at_once;
mod background;
mod cache_folder;
mod draft;
mod pace;
mod shape;
mod stage;
mod store;
#[cfg(test)]
mod tests;
mod tiles;

pub use arriving::Arriving;
pub use at_once::AtOnce;
pub use cache_folder::{CacheFolder, CachedFile, DEFAULT_CACHE_BYTES, Fingerprint};
pub use pace::{Flown, Pace};

use self::background::Background;
use self::stage::{Current, Stage};
use self::tiles::Patience;
use crate::error::{Error, ErrorKind, Result};
use crate::grid::{Grid, Rect};
use crate::levels::{Arrival, Bounds, Data, DaySample, Levels, LightSample, Wanted};
use crate::light::{Day, Sun};
use crate::progress::Progress;
use crate::pyramid::Filter;
use crate::source::{self, Description, Georeference, HeightSource, OpenOptions, ReadAt, Synth};
use crate::terrain::{Meta, TerrainFile, is_terrain};

/// Bytes of tiles that are kept where nothing else is said: 256 MiB.
pub const DEFAULT_TILE_BYTES: usize = 256 << 20;

/// The least budget for tiles, 32 MiB: with less, what a view must have at once might not fit.
pub const LEAST_TILE_BYTES: usize = 32 << 20;

/// Threads that load tiles, at most, where nothing else is said: beyond them decoding gains little.
const LOADERS: usize = 4;

/// Decoded tiles that the reader of a terrain file keeps beneath the tiles of views: those of its check parts.
const READER_BYTES: usize = 4 << 20;

/// Patches along a side of a tile of bounds in a terrain file.
const FILE_BOUNDS_SIDE: i64 = crate::terrain::layout::TILE;

/// The same where bounds are computed: over the ground of one tile of heights.
const SYNTH_BOUNDS_SIDE: i64 = crate::terrain::layout::TILE / crate::grid::PATCH;

/// How tiles are kept and loaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TileOptions {
    /// The most bytes of tiles that are kept, those that are being loaded included.
    pub memory_bytes: usize,
    /// Threads that load them. Frames that wait for their data do not depend on it.
    pub loaders: usize,
}

impl Default for TileOptions {
    fn default() -> Self {
        let processors = std::thread::available_parallelism().map_or(1, usize::from);
        Self {
            memory_bytes: DEFAULT_TILE_BYTES,
            loaders: processors.min(LOADERS),
        }
    }
}

impl TileOptions {
    /// Refuses too small a budget, and no loaders.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`], naming the option.
    pub fn check(&self) -> Result<()> {
        if self.memory_bytes < LEAST_TILE_BYTES {
            let what = format!("{} bytes of memory are too few for tiles", self.memory_bytes);
            let advice = format!("give at least {} MiB", LEAST_TILE_BYTES >> 20);
            return Err(Error::new(ErrorKind::Misuse, "tiles", what).advice(advice));
        }
        if self.loaders == 0 {
            return Err(Error::new(
                ErrorKind::Misuse,
                "tiles",
                "without loaders nothing arrives",
            ));
        }
        Ok(())
    }
}

/// A terrain, shared by any number of views.
pub struct Terrain {
    name: String,
    grid: Grid,
    origin: Origin,
    current: Arc<Current>,
    /// What is being built of a DEM that was opened at once. It puts what it has done in the place of `current`.
    background: Option<Background>,
}

/// What a terrain was made from.
#[derive(Clone, Debug)]
pub enum Origin {
    /// A terrain file, with what it says of itself.
    File(Box<Meta>),
    /// A DEM whose pyramid was built in memory, or procedural terrain.
    Dem(Box<Description>),
}

impl std::fmt::Debug for Terrain {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Terrain")
            .field("name", &self.name)
            .field("origin", &self.origin)
            .finish_non_exhaustive()
    }
}

impl Terrain {
    /// Opens `input`: a path, or `synth:SIZE[:SEED]`. A DEM's pyramid is built, with `progress`.
    ///
    /// # Errors
    /// Where the input is missing, damaged, of a kind that is not read, or too large to be held.
    pub fn open(input: impl AsRef<Path>, progress: &dyn Progress) -> Result<Self> {
        Self::open_with(&[input], &OpenOptions::default(), progress)
    }

    /// Opens `inputs`, several files or folders of one DEM among them (see [`source::open_with`]), read as `options`
    /// say. What only a look at the samples tells is warned of.
    ///
    /// # Errors
    /// As [`Terrain::open`]; [`crate::ErrorKind::Misuse`] where options do not suit the input: a terrain file takes
    /// none.
    pub fn open_with(
        inputs: &[impl AsRef<Path>],
        options: &OpenOptions,
        progress: &dyn Progress,
    ) -> Result<Self> {
        if let [input] = inputs {
            let path = input.as_ref();
            if options.is_default()
                && let Some(synth) = path.to_str().and_then(Synth::parse)
            {
                return Ok(Self::from_synth(synth?));
            }
            if path.is_file() {
                let (name, bytes) = (path.display().to_string(), source::open_file(path)?);
                if is_terrain(bytes.as_ref()) {
                    options.refuse_for_terrain(&name)?;
                    return Self::from_bytes(&name, bytes, progress);
                }
            }
        }
        let source = source::open_with(inputs, options)?;
        for remark in source.remarks(progress)? {
            progress.warn(&format!("{}: {remark}", source.description().name));
        }
        Self::from_source(source.as_ref(), progress)
    }

    /// The terrain in `bytes`: a terrain file's or a DEM file's. `name` is how messages speak of it, and its
    /// extension helps to tell formats that cannot be told by their content.
    ///
    /// # Errors
    /// As [`Terrain::open`].
    pub fn from_bytes(name: &str, bytes: Arc<dyn ReadAt>, progress: &dyn Progress) -> Result<Self> {
        if is_terrain(bytes.as_ref()) {
            let file = TerrainFile::open(name, bytes)?.with_cache(READER_BYTES);
            return Ok(Self::from_file(name, file, &TileOptions::default()));
        }
        Self::from_source(
            source::open_bytes(name, bytes, &OpenOptions::default())?.as_ref(),
            progress,
        )
    }

    /// The terrain of a DEM that the caller reads: its pyramid is built in memory.
    ///
    /// # Errors
    /// Those of `source`; [`crate::ErrorKind::Limit`] where it is too large to be held.
    pub fn from_source(source: &dyn HeightSource, progress: &dyn Progress) -> Result<Self> {
        let pyramid = crate::build::build_pyramid(source, &Filter::default(), progress)?;
        let description = source.description().clone();
        let stage = Stage::in_memory(Arc::new(pyramid));
        Ok(Self::new(Origin::Dem(Box::new(description)), stage))
    }

    /// Procedural terrain.
    pub fn from_synth(synth: Synth) -> Self {
        let description = HeightSource::description(&synth).clone();
        let stage = Stage::computed(Arc::new(synth), SYNTH_BOUNDS_SIDE, &TileOptions::default());
        Self::new(Origin::Dem(Box::new(description)), stage)
    }

    fn from_file(name: &str, file: TerrainFile, tiles: &TileOptions) -> Self {
        let origin = Origin::File(Box::new(file.meta().clone()));
        Self {
            name: name.to_string(),
            ..Self::new(origin, Stage::of_file(file, tiles))
        }
    }

    fn new(origin: Origin, stage: Stage) -> Self {
        let name = match &origin {
            Origin::File(meta) => meta.source.name.clone(),
            Origin::Dem(description) => description.name.clone(),
        };
        Self {
            name,
            grid: *stage.levels.grid(),
            origin,
            current: Arc::new(Current::new(stage)),
            background: None,
        }
    }

    /// Keeps and loads tiles as `options` say; what was kept so far is let go.
    ///
    /// # Errors
    /// Those of [`TileOptions::check`].
    pub fn with_tiles(self, options: &TileOptions) -> Result<Self> {
        options.check()?;
        let (_, stage) = self.current.get();
        let stage = stage.with_tiles(options);
        Ok(Self {
            current: Arc::new(Current::new(stage)),
            ..self
        })
    }

    /// The same terrain for a view that does not wait: what has not been loaded is missing, and on its way.
    pub fn arriving(&self) -> Arriving {
        Arriving::new(self.current.clone())
    }

    /// The most bytes of tiles that have been kept at once, those that were being loaded included.
    pub fn most_tile_bytes(&self) -> usize {
        self.current.get().1.tiles.map_or(0, |tiles| tiles.most_bytes())
    }

    /// What loading tiles has cost so far; none where nothing was loaded.
    pub fn pace(&self) -> Option<Pace> {
        self.current.get().1.tiles?.pace()
    }

    /// Whether what it was opened as at once is still being built.
    pub fn is_building(&self) -> bool {
        self.background.as_ref().is_some_and(|b| !b.is_done())
    }

    /// Waits until a DEM that was opened at once has its heights and bounds, or cannot have them: then it is no longer
    /// provisional, and the next run opens it.
    ///
    /// # Errors
    /// [`ErrorKind::Cancelled`].
    pub fn wait_for_heights(&self, progress: &dyn Progress) -> Result<()> {
        match &self.background {
            Some(background) => background.wait_for_heights(progress),
            None => Ok(()),
        }
    }

    /// Takes what building it in the background has to say, each once.
    pub fn take_warnings(&self) -> Vec<String> {
        self.background
            .as_ref()
            .map_or_else(Vec::new, Background::take_warnings)
    }

    /// The name by which messages speak of it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What it was made from.
    pub fn origin(&self) -> &Origin {
        &self.origin
    }

    /// Where it lies, if its file says.
    pub fn place(&self) -> Option<&Georeference> {
        match &self.origin {
            Origin::File(meta) => meta.place.as_ref(),
            Origin::Dem(description) => description.place.as_ref(),
        }
    }

    /// The sun whose light was traced, where there is light.
    pub fn sun(&self) -> Option<Sun> {
        match &self.origin {
            Origin::File(meta) => meta.light.as_ref().map(|l| Sun {
                azimuth_deg: l.sun_azimuth_deg,
                altitude_deg: l.sun_altitude_deg,
            }),
            Origin::Dem(_) => None,
        }
    }

    /// The day whose light there is, where there is one.
    pub fn day(&self) -> Option<Day> {
        match &self.origin {
            Origin::File(meta) => meta.day,
            Origin::Dem(_) => None,
        }
    }
}

impl Levels for Terrain {
    fn grid(&self) -> &Grid {
        &self.grid
    }

    fn level_count(&self) -> u32 {
        self.current.get().1.levels.level_count()
    }

    fn heights(&self, level: u32, rect: Rect, out: &mut [f32]) -> Result<Arrival> {
        let (_, stage) = self.current.get();
        match stage.shared_tiles() {
            Some(tiles) => tiles.copy(Data::Heights, level, rect, out, Patience::Retry),
            None => stage.levels.heights(level, rect, out),
        }
    }

    fn bounds(&self, level: u32, patches: Rect, out: &mut [Bounds]) -> Result<Arrival> {
        let (_, stage) = self.current.get();
        match stage.shared_tiles() {
            Some(tiles) => tiles.copy(Data::Bounds, level, patches, out, Patience::Retry),
            None => stage.levels.bounds(level, patches, out),
        }
    }

    fn has_light(&self) -> bool {
        self.current.get().1.levels.has_light()
    }

    fn light(&self, level: u32, rect: Rect, out: &mut [LightSample]) -> Result<Arrival> {
        let (_, stage) = self.current.get();
        match stage.shared_tiles() {
            Some(tiles) if stage.levels.has_light() => {
                tiles.copy(Data::Light, level, rect, out, Patience::Retry)
            }
            _ => stage.levels.light(level, rect, out),
        }
    }

    fn has_day(&self) -> bool {
        self.current.get().1.levels.has_day()
    }

    fn day(&self, level: u32, rect: Rect, out: &mut [DaySample]) -> Result<Arrival> {
        let (_, stage) = self.current.get();
        match stage.shared_tiles() {
            Some(tiles) if stage.levels.has_day() => tiles.copy(Data::Day, level, rect, out, Patience::Retry),
            _ => stage.levels.day(level, rect, out),
        }
    }

    fn want(&self, wanted: &[Wanted]) {
        if let Some(tiles) = self.current.get().1.shared_tiles() {
            tiles.want(0, wanted);
        }
    }

    fn edition(&self) -> u64 {
        self.current.get().0
    }

    fn is_provisional(&self) -> bool {
        self.current.get().1.levels.is_provisional()
    }

    fn faults(&self) -> Vec<Error> {
        self.current.get().1.levels.faults()
    }
}
