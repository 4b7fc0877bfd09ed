//! Many files as one DEM: tiles of one grid, opened and read as they are asked for.
//!
//! Where tiles overlap, the later of them in order wins with every sample that is not void; where none has a sample is
//! no data. Heights are metres, so tiles of several formats, types and units stand side by side.

mod layout;
mod seams;

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use self::layout::Tile;
use super::{Description, HeightSource, OpenOptions, READ_ROWS, geographic};
use crate::error::{Error, ErrorKind, Result};
use crate::grid::Rect;
use crate::progress::Progress;

/// Tiles that are kept open hold at most this much, if they are more than one.
const CACHE_BYTES: u64 = 256 << 20;
/// Tiles that are kept open at most: each may hold a file open.
const CACHE_TILES: usize = 64;

/// How a tile is opened: by its path, with the options of all.
type Open = dyn Fn(&std::path::Path, &OpenOptions) -> Result<Box<dyn HeightSource>> + Send + Sync;

/// The tiles, and those of them that are open.
pub(super) struct Mosaic {
    description: Description,
    tiles: Vec<Tile>,
    options: OpenOptions,
    open: Box<Open>,
    /// Number of a tile and the open tile, the one used last at the end.
    cache: Mutex<Vec<(usize, Arc<dyn HeightSource>)>>,
}

impl Mosaic {
    /// The mosaic `name` of the files `paths`, of which the later ones win. Each is opened once to learn its place.
    ///
    /// # Errors
    /// Those of opening; [`ErrorKind::Unsupported`] naming a tile that tells no place or is off the others' grid.
    pub(super) fn new(name: &str, paths: &[PathBuf], options: &OpenOptions, open: Box<Open>) -> Result<Self> {
        let mut tiles = Vec::with_capacity(paths.len());
        let mut first: Option<Description> = None;
        let mut common = Common::default();
        for path in paths {
            let source = open(path, options)?;
            let description = source.description();
            let first = first.get_or_insert_with(|| description.clone());
            tiles.push(Tile::new(path.clone(), description, source.held_bytes(), first)?);
            common.add(description);
        }
        let first = first.ok_or_else(|| Error::new(ErrorKind::Misuse, name, "holds no DEM"))?;
        let (grid, place) = layout::union(name, &mut tiles, &first)?;
        let mut description = common.describe(name, grid, place, tiles.len());
        if let Some(place) = description.place.as_ref().filter(|p| p.geographic) {
            let (spacing_m, sentence) = geographic::spacing_m(place, grid.size)
                .map_err(|what| Error::new(ErrorKind::Broken, name, what))?;
            description.grid.spacing_m = spacing_m;
            description.assumed.insert(0, sentence);
        }
        description
            .grid
            .check()
            .map_err(|what| Error::new(ErrorKind::Limit, name, what))?;
        Ok(Self {
            description,
            tiles,
            options: options.clone(),
            open,
            cache: Mutex::new(Vec::new()),
        })
    }

    /// Tile number `k`, opened if it is not. Tiles that have been idle longest are closed.
    fn tile(&self, k: usize) -> Result<Arc<dyn HeightSource>> {
        // Whoever panicked left a list of whole entries.
        let mut cache = self.cache.lock().unwrap_or_else(PoisonError::into_inner);
        let entry = match cache.iter().position(|(number, _)| *number == k) {
            Some(at) => cache.remove(at),
            None => {
                let tile = &self.tiles[k];
                // Room is made before it is opened.
                let held = |cache: &[(usize, Arc<dyn HeightSource>)]| {
                    let held = cache.iter().map(|(k, _)| self.tiles[*k].held_bytes);
                    held.fold(tile.held_bytes, u64::saturating_add)
                };
                while !cache.is_empty() && (cache.len() >= CACHE_TILES || held(&cache) > CACHE_BYTES) {
                    cache.remove(0);
                }
                let source: Arc<dyn HeightSource> = (self.open)(&tile.path, &self.options)?.into();
                if source.description().grid.size != tile.size() {
                    let what = "has another size than when it was first opened";
                    return Err(Error::new(ErrorKind::Broken, tile.path.display(), what));
                }
                (k, source)
            }
        };
        let source = entry.1.clone();
        cache.push(entry);
        Ok(source)
    }

    /// The samples of tile `k` in `rect`, which lies in it: metres less the mosaic's base.
    fn read_tile(&self, k: usize, rect: Rect, out: &mut Vec<f32>) -> Result<()> {
        let tile = &self.tiles[k];
        out.resize(rect.area() as usize, f32::NAN);
        self.tile(k)?
            .read(rect.moved(-tile.rect.x0, -tile.rect.z0), out)?;
        let base_m = self.description.grid.base_m;
        if tile.base_m != base_m {
            for h in out.iter_mut() {
                *h = (f64::from(*h) + tile.base_m - base_m) as f32;
            }
        }
        Ok(())
    }
}

/// What all tiles have in common.
#[derive(Default)]
struct Common {
    formats: Vec<String>,
    types: Vec<String>,
    units: Vec<String>,
    steps: Vec<Option<f64>>,
    /// Sentences and how many tiles they are of.
    assumed: Vec<(String, usize)>,
}

impl Common {
    fn add(&mut self, description: &Description) {
        fn once<T: PartialEq>(all: &mut Vec<T>, one: T) {
            if !all.contains(&one) {
                all.push(one);
            }
        }
        once(&mut self.formats, description.format.clone());
        once(&mut self.types, description.sample_type.clone());
        once(&mut self.units, description.vertical_unit.clone());
        once(&mut self.steps, description.step_m);
        let place = description.place.as_ref();
        let own = place.and_then(|p| geographic::spacing_m(p, description.grid.size).ok());
        for sentence in &description.assumed {
            // The mosaic's own spacing is told instead.
            if own.as_ref().is_some_and(|(_, said)| said == sentence) {
                continue;
            }
            match self.assumed.iter_mut().find(|(s, _)| s == sentence) {
                Some((_, count)) => *count += 1,
                None => self.assumed.push((sentence.clone(), 1)),
            }
        }
    }

    fn describe(
        self,
        name: &str,
        grid: crate::grid::Grid,
        place: super::Georeference,
        tiles: usize,
    ) -> Description {
        let one = |all: &[String]| match all {
            [one] => one.clone(),
            _ => "mixed".into(),
        };
        let told = |(sentence, count): (String, usize)| {
            if count == tiles {
                sentence
            } else {
                format!("Of {count} of {tiles} tiles: {sentence}")
            }
        };
        Description {
            grid,
            format: self.formats.join(", "),
            sample_type: one(&self.types),
            step_m: match self.steps[..] {
                [step] => step,
                _ => None,
            },
            place: Some(place),
            vertical_unit: one(&self.units),
            assumed: self.assumed.into_iter().map(told).collect(),
            name: name.into(),
        }
    }
}

impl HeightSource for Mosaic {
    fn description(&self) -> &Description {
        &self.description
    }

    fn held_bytes(&self) -> u64 {
        let held = || self.tiles.iter().map(|tile| tile.held_bytes);
        let all = held().fold(0, u64::saturating_add);
        let open = all.min(held().max().unwrap_or(0).max(CACHE_BYTES));
        // A tile's part of the rows that are read, before it is laid over the others'.
        let widest = self.tiles.iter().map(|tile| tile.rect.width()).max().unwrap_or(0);
        open + (size_of::<f32>() as i64 * READ_ROWS * widest) as u64
    }

    fn read(&self, rect: Rect, out: &mut [f32]) -> Result<()> {
        self.description.check_rect(rect, out)?;
        out.fill(f32::NAN);
        let mut part = Vec::new();
        for (k, tile) in self.tiles.iter().enumerate() {
            let cut = tile.rect.intersection(rect);
            if cut.is_empty() {
                continue;
            }
            self.read_tile(k, cut, &mut part)?;
            let rows = part.chunks_exact(cut.width() as usize);
            for (z, from) in (cut.z0..cut.z1).zip(rows) {
                let start = ((z - rect.z0) * rect.width() + cut.x0 - rect.x0) as usize;
                for (to, h) in out[start..start + from.len()].iter_mut().zip(from) {
                    if !h.is_nan() {
                        *to = *h;
                    }
                }
            }
        }
        Ok(())
    }

    /// Those of each tile, and how many samples differ where tiles overlap.
    fn remarks(&self, progress: &dyn Progress) -> Result<Vec<String>> {
        let mut remarks = Vec::new();
        progress.begin("tiles", self.tiles.len() as u64);
        let mut seams = seams::Seams::default();
        for (k, tile) in self.tiles.iter().enumerate() {
            if progress.cancelled() {
                return Err(Error::cancelled(&self.description.name));
            }
            for remark in self.tile(k)?.remarks(&crate::progress::Silent)? {
                remarks.push(format!("{}: {remark}", tile.path.display()));
            }
            self.compare(k, &mut seams, progress)?;
            progress.advance(1);
        }
        remarks.extend(seams.sentence());
        Ok(remarks)
    }
}

#[cfg(test)]
mod tests;
