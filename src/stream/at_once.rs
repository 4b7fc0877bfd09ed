//! Opening a DEM without waiting for its pyramid: from the cache folder, or as a draft that is built upon.

use std::path::Path;
use std::sync::Arc;

use super::background::{Background, Plan};
use super::cache_folder::{CacheFolder, Fingerprint};
use super::draft::Draft;
use super::stage::Stage;
use super::{Origin, READER_BYTES, Terrain, TileOptions};
use crate::build::{HELD_MEMORY_BYTES, Threads};
use crate::error::{ErrorKind, Result};
use crate::light::LightOptions;
use crate::progress::Progress;
use crate::source::{self, HeightSource, OpenOptions, Synth};
use crate::terrain::{TerrainFile, is_terrain};

/// How a DEM is opened at once.
#[derive(Clone, Debug, PartialEq)]
pub struct AtOnce {
    /// Where its terrain file is kept for the next run; none keeps none.
    pub folder: Option<CacheFolder>,
    /// The light that is traced in the background.
    pub light: LightOptions,
    /// How tiles are kept and loaded.
    pub tiles: TileOptions,
    /// The memory that building it may take: a DEM whose light takes more is drawn without.
    pub memory_bytes: u64,
}

impl Default for AtOnce {
    fn default() -> Self {
        Self {
            folder: None,
            light: LightOptions::default(),
            tiles: TileOptions::default(),
            memory_bytes: HELD_MEMORY_BYTES,
        }
    }
}

impl Terrain {
    /// Opens `inputs` as [`Terrain::open_with`] does, but a DEM at once: as the terrain file that an earlier run has kept,
    /// else as a draft from what is quick to read, whose place its terrain file takes as soon as that is built in the
    /// background. Where that is kept `progress` is told once.
    ///
    /// # Errors
    /// As [`Terrain::open_with`], but for what is met in the background: see [`Terrain::take_warnings`].
    pub fn open_at_once(
        inputs: &[impl AsRef<Path>],
        options: &OpenOptions,
        at_once: &AtOnce,
        progress: &dyn Progress,
    ) -> Result<Self> {
        at_once.tiles.check()?;
        if is_quick(inputs)? {
            return Self::open_with(inputs, options, progress)?.with_tiles(&at_once.tiles);
        }
        let fingerprint = Fingerprint::new(inputs, options, &at_once.light)?;
        let kept = at_once
            .folder
            .as_ref()
            .and_then(|folder| kept(folder, &fingerprint, progress));
        let name = fingerprint.name.clone();
        let has_heights = kept.is_some();
        let kept = match kept {
            Some(file) if file.meta().light.is_some() => {
                return Ok(Self::from_file(&name, file, &at_once.tiles));
            }
            kept => kept,
        };
        let source: Arc<dyn HeightSource> = Arc::from(source::open_with(inputs, options)?);
        let mut terrain = match kept {
            Some(file) => Self::from_file(&name, file, &at_once.tiles),
            None => Self::draft(source.as_ref(), progress)?,
        };
        if let Some(folder) = at_once.folder.as_ref().filter(|_| !has_heights) {
            progress.warn(&format!(
                "{name}: its terrain file is built meanwhile, and kept as {}; --no-cache keeps none",
                folder.path_of(&fingerprint).display()
            ));
        }
        let plan = Plan {
            source,
            fingerprint,
            folder: at_once.folder.clone(),
            has_heights,
            light: at_once.light,
            tiles: at_once.tiles,
            memory_bytes: at_once.memory_bytes,
        };
        terrain.background = Some(Background::start(plan, terrain.current.clone()));
        Ok(terrain)
    }

    /// A draft of `source`.
    fn draft(source: &dyn HeightSource, progress: &dyn Progress) -> Result<Self> {
        let draft = Draft::new(source, &Threads::new(0)?, progress)?;
        let origin = Origin::Dem(Box::new(source.description().clone()));
        Ok(Self::new(origin, Stage::in_memory(Arc::new(draft))))
    }
}

/// Whether an input needs no pyramid: a terrain file, or procedural terrain.
fn is_quick(inputs: &[impl AsRef<Path>]) -> Result<bool> {
    let [input] = inputs else { return Ok(false) };
    let path = input.as_ref();
    if path.to_str().and_then(Synth::parse).is_some() {
        return Ok(true);
    }
    Ok(path.is_file() && is_terrain(source::open_file(path)?.as_ref()))
}

/// The terrain file that an earlier run has kept, if it is whole.
fn kept(folder: &CacheFolder, fingerprint: &Fingerprint, progress: &dyn Progress) -> Option<TerrainFile> {
    let path = folder.path_of(fingerprint);
    let name = path.display().to_string();
    let opened = source::open_file(&path).and_then(|bytes| TerrainFile::open(&name, bytes));
    match opened {
        Ok(file) if file.meta().source == fingerprint.stamp() => {
            folder.touch(&path);
            Some(file.with_cache(READER_BYTES))
        }
        Ok(_) => None,
        // It is not there: that is no fault.
        Err(error) if error.kind() == ErrorKind::Io => None,
        Err(error) => {
            progress.warn(&format!("{error}; it is built again"));
            None
        }
    }
}
