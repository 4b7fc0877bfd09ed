//! A terrain to draw, from whatever a user names: a terrain file, a DEM, or procedural terrain.
//!
//! A terrain file is read tile by tile as windows ask for it. A DEM has no coarser levels, so its pyramid is built in
//! memory first (without light); preprocessing it once is quicker from the second look on. Procedural terrain knows
//! every level and needs neither.

use std::path::Path;
use std::sync::Arc;

use crate::error::{Error, Result};
use crate::grid::{Grid, Rect};
use crate::levels::{Arrival, Bounds, Levels, LightSample};
use crate::light::Sun;
use crate::progress::Progress;
use crate::pyramid::Filter;
use crate::source::{self, Description, HeightSource, ReadAt, Synth};
use crate::terrain::{Meta, TerrainFile, is_terrain};

/// A terrain, shared by any number of views.
pub struct Terrain {
    name: String,
    levels: Box<dyn Levels>,
    origin: Origin,
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
        let path = input.as_ref();
        if let Some(synth) = path.to_str().and_then(Synth::parse) {
            return Ok(Self::from_synth(synth?));
        }
        let bytes = source::open_file(path)?;
        Self::from_bytes(&path.display().to_string(), bytes, progress)
    }

    /// The terrain in `bytes`: a terrain file's or a DEM file's. `name` is how messages speak of it, and its
    /// extension helps to tell formats that cannot be told by their content.
    ///
    /// # Errors
    /// As [`Terrain::open`].
    pub fn from_bytes(name: &str, bytes: Arc<dyn ReadAt>, progress: &dyn Progress) -> Result<Self> {
        if is_terrain(bytes.as_ref()) {
            let file = TerrainFile::open(name, bytes)?;
            let origin = Origin::File(Box::new(file.meta().clone()));
            return Ok(Self {
                name: name.to_string(),
                levels: Box::new(file),
                origin,
            });
        }
        Self::from_source(source::open_bytes(name, bytes)?.as_ref(), progress)
    }

    /// The terrain of a DEM that the caller reads: its pyramid is built in memory.
    ///
    /// # Errors
    /// Those of `source`; [`crate::ErrorKind::Limit`] where it is too large to be held.
    pub fn from_source(source: &dyn HeightSource, progress: &dyn Progress) -> Result<Self> {
        let pyramid = crate::build::build_pyramid(source, &Filter::default(), progress)?;
        let description = source.description().clone();
        Ok(Self {
            name: description.name.clone(),
            levels: Box::new(pyramid),
            origin: Origin::Dem(Box::new(description)),
        })
    }

    /// Procedural terrain.
    pub fn from_synth(synth: Synth) -> Self {
        let description = HeightSource::description(&synth).clone();
        Self {
            name: description.name.clone(),
            levels: Box::new(synth),
            origin: Origin::Dem(Box::new(description)),
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
        self.levels.heights(level, rect, out)
    }

    fn bounds(&self, level: u32, patches: Rect, out: &mut [Bounds]) -> Result<Arrival> {
        self.levels.bounds(level, patches, out)
    }

    fn has_light(&self) -> bool {
        self.levels.has_light()
    }

    fn light(&self, level: u32, rect: Rect, out: &mut [LightSample]) -> Result<Arrival> {
        self.levels.light(level, rect, out)
    }

    fn want(&self, wanted: &[(u32, Rect)]) {
        self.levels.want(wanted);
    }

    fn faults(&self) -> Vec<Error> {
        self.levels.faults()
    }
}
