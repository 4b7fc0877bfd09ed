//! A terrain to draw, from whatever a user names: a terrain file, a DEM, or procedural terrain.
//!
//! A terrain file is read tile by tile as windows ask for it, into a cache with a budget of bytes. A DEM has no coarser
//! levels, so its pyramid is built in memory first (without light); preprocessing it once is quicker from the second look
//! on. Procedural terrain knows every level and needs neither.
//!
//! A [`Terrain`] waits for what it is asked for. [`Terrain::arriving`] is the same terrain for a view that does not: what
//! has not been loaded is missing there, and threads load it in the order in which it is wanted.

use std::path::Path;
use std::sync::Arc;

mod arriving;
mod shape;
mod store;
#[cfg(test)]
mod tests;
mod tiles;

pub use arriving::Arriving;

use self::tiles::{Patience, Tiles};
use crate::error::{Error, ErrorKind, Result};
use crate::grid::{Grid, Rect};
use crate::levels::{Arrival, Bounds, Data, Levels, LightSample, Wanted};
use crate::light::Sun;
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
    levels: Arc<dyn Levels>,
    origin: Origin,
    /// Where levels take a while to answer.
    tiles: Option<Arc<Tiles>>,
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
            let origin = Origin::File(Box::new(file.meta().clone()));
            return Ok(Self::new(name.to_string(), Arc::new(file), origin));
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
        let name = description.name.clone();
        Ok(Self::new(
            name,
            Arc::new(pyramid),
            Origin::Dem(Box::new(description)),
        ))
    }

    /// Procedural terrain.
    pub fn from_synth(synth: Synth) -> Self {
        let description = HeightSource::description(&synth).clone();
        let name = description.name.clone();
        Self::new(name, Arc::new(synth), Origin::Dem(Box::new(description)))
    }

    fn new(name: String, levels: Arc<dyn Levels>, origin: Origin) -> Self {
        let terrain = Self {
            name,
            levels,
            origin,
            tiles: None,
        };
        terrain.with_default_tiles()
    }

    fn with_default_tiles(mut self) -> Self {
        self.tiles = self.new_tiles(&TileOptions::default());
        self
    }

    /// Keeps and loads tiles as `options` say; what was kept so far is let go.
    ///
    /// # Errors
    /// Those of [`TileOptions::check`].
    pub fn with_tiles(mut self, options: &TileOptions) -> Result<Self> {
        options.check()?;
        self.tiles = self.new_tiles(options);
        Ok(self)
    }

    /// A pyramid in memory needs none.
    fn new_tiles(&self, options: &TileOptions) -> Option<Arc<Tiles>> {
        let side = match &self.origin {
            Origin::File(_) => FILE_BOUNDS_SIDE,
            Origin::Dem(description) if description.format == "synth" => SYNTH_BOUNDS_SIDE,
            Origin::Dem(_) => return None,
        };
        Some(Arc::new(Tiles::new(self.levels.clone(), side, options)))
    }

    /// The same terrain for a view that does not wait: what has not been loaded is missing, and on its way.
    pub fn arriving(&self) -> Arriving {
        Arriving::new(self.levels.clone(), self.tiles.clone())
    }

    /// The most bytes of tiles that have been kept at once, those that were being loaded included.
    pub fn most_tile_bytes(&self) -> usize {
        self.tiles.as_ref().map_or(0, |tiles| tiles.most_bytes())
    }

    /// The tiles through which it answers itself: procedural terrain is quicker computed where it is asked for.
    fn own_tiles(&self) -> Option<&Tiles> {
        match &self.origin {
            Origin::File(_) => self.tiles.as_deref(),
            Origin::Dem(_) => None,
        }
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
}

impl Levels for Terrain {
    fn grid(&self) -> &Grid {
        self.levels.grid()
    }

    fn level_count(&self) -> u32 {
        self.levels.level_count()
    }

    fn heights(&self, level: u32, rect: Rect, out: &mut [f32]) -> Result<Arrival> {
        match self.own_tiles() {
            Some(tiles) => tiles.copy(Data::Heights, level, rect, out, Patience::Retry),
            None => self.levels.heights(level, rect, out),
        }
    }

    fn bounds(&self, level: u32, patches: Rect, out: &mut [Bounds]) -> Result<Arrival> {
        match self.own_tiles() {
            Some(tiles) => tiles.copy(Data::Bounds, level, patches, out, Patience::Retry),
            None => self.levels.bounds(level, patches, out),
        }
    }

    fn has_light(&self) -> bool {
        self.levels.has_light()
    }

    fn light(&self, level: u32, rect: Rect, out: &mut [LightSample]) -> Result<Arrival> {
        match self.own_tiles() {
            Some(tiles) if self.has_light() => tiles.copy(Data::Light, level, rect, out, Patience::Retry),
            _ => self.levels.light(level, rect, out),
        }
    }

    fn want(&self, wanted: &[Wanted]) {
        if let Some(tiles) = self.own_tiles() {
            tiles.want(0, wanted);
        }
    }

    fn faults(&self) -> Vec<Error> {
        self.levels.faults()
    }
}
