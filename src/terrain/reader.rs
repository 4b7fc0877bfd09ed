//! Reading terrain files: an open [`TerrainFile`] is a [`Levels`].
//!
//! Opening reads the header; a tile is read, checked and decoded when it is asked for, and so are the page of the
//! offset tables and the tile of checks that it needs: what a file of any size takes in memory does not grow with it. Part
//! and coordinates that stand before a tile must be those that were asked for, and its samples must have the
//! CRC-32C that the file's check parts say. Decoded tiles are kept in a bounded cache, so rows and strips do not
//! decode a tile more than once.

use std::sync::Arc;

use super::cache::Cache;
use super::header;
use super::layout::{Kind, Layout, Part};
use super::meta::Meta;
use super::tile::{BOUNDS_FIELDS, DAY_FIELDS, LIGHT_FIELDS, check, little_endian, unpack};
use super::zip;
use crate::error::{Error, ErrorKind, Result};
use crate::grid::{Grid, Rect};
use crate::levels::{Arrival, Bounds, DaySample, Levels, LightSample};
use crate::progress::Progress;
use crate::source::ReadAt;

/// Decoded tiles that a [`TerrainFile`] keeps unless told otherwise: 64 MiB.
pub const DEFAULT_CACHE_BYTES: usize = 64 << 20;

/// Offsets in a page of the tables.
const PAGE_OFFSETS: u64 = 512;

/// Pages of the offset tables that are kept: 1 MiB, which is all of them for a DEM of 60,000 samples a side.
const PAGES_BYTES: usize = 1 << 20;

/// What stands before a tile's data: part, tile x and y, level x and y, length in bytes, each an i32.
pub(super) const TILE_HEAD_BYTES: usize = 24;

/// Tables of a file in the making, as far as they have come.
pub(super) struct Unwritten {
    /// Of each part the offset of each tile, row by row; 0 where it has not been put.
    pub(super) tables: Vec<Vec<u64>>,
    /// Of each check part its samples: of each channel one value.
    pub(super) checks: Vec<Vec<[u32; 2]>>,
}

/// An open terrain file.
pub struct TerrainFile {
    name: String,
    bytes: Arc<dyn ReadAt>,
    meta: Meta,
    layout: Layout,
    /// Where each part's offset table begins.
    tables_at: Vec<u64>,
    pages: Cache,
    /// What the writer of a file in the making knows, and the file does not say yet.
    unwritten: Option<Unwritten>,
    cache: Cache,
}

impl TerrainFile {
    /// Opens the terrain file in `bytes`; messages call it `name`. Reads the header, and where the last tile stands.
    ///
    /// # Errors
    /// [`ErrorKind::Broken`] where it is damaged or cut short, [`ErrorKind::Unsupported`] where it is no terrain
    /// file or one of another version, and what `bytes` meet.
    pub fn open(name: &str, bytes: Arc<dyn ReadAt>) -> Result<Self> {
        let (meta, layout, tables_at) = header::read(name, bytes.clone())?;
        // The header's reader has made sure that the file is long enough for all tables.
        let starts = layout.parts().iter().scan(tables_at, |at, part| {
            let start = *at;
            *at += 8 * part.tiles().samples() as u64;
            Some(start)
        });
        let tables_at = starts.collect();
        let cache = Cache::new(DEFAULT_CACHE_BYTES);
        let file = Self {
            name: name.into(),
            bytes,
            meta,
            layout,
            tables_at,
            pages: Cache::new(PAGES_BYTES),
            unwritten: None,
            cache,
        };
        file.check_end()?;
        Ok(file)
    }

    /// A file in the making: the tiles that its tables know of, checked by what its writer kept.
    pub(super) fn unfinished(
        name: &str,
        bytes: Arc<dyn ReadAt>,
        meta: Meta,
        layout: Layout,
        unwritten: Unwritten,
    ) -> Self {
        Self {
            name: name.into(),
            bytes,
            meta,
            layout,
            tables_at: Vec::new(),
            pages: Cache::new(0),
            unwritten: Some(unwritten),
            cache: Cache::new(DEFAULT_CACHE_BYTES),
        }
    }

    /// The same with a cache of another size, in bytes of decoded tiles.
    #[must_use]
    pub fn with_cache(mut self, budget_bytes: usize) -> Self {
        self.cache = Cache::new(budget_bytes);
        self
    }

    /// What the file says of itself.
    pub fn meta(&self) -> &Meta {
        &self.meta
    }

    /// The name by which messages speak of it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its parts.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Reads and checks every tile, and that unused checks are 0; returns all faults.
    ///
    /// # Errors
    /// [`ErrorKind::Cancelled`] only.
    pub fn verify(&self, progress: &dyn Progress) -> Result<Vec<Error>> {
        progress.begin("verify", self.layout.tile_count());
        let mut faults = Vec::new();
        for (index, part) in self.layout.parts().iter().enumerate() {
            let tiles = part.tiles();
            for (x, y) in tiles.rect().cells() {
                if progress.cancelled() {
                    return Err(Error::cancelled(&self.name));
                }
                let checked = self.read_tile(index, x, y).and_then(|tile| match part.kind {
                    Kind::Check | Kind::CheckDay | Kind::CheckBounds => self.check_unused(index, x, y, &tile),
                    _ => Ok(()),
                });
                faults.extend(checked.err());
                progress.advance(1);
            }
        }
        Ok(faults)
    }

    /// A file that was cut anywhere ends before the last tile of the file's order does.
    fn check_end(&self) -> Result<()> {
        let last = self.layout.parts().len() - 1;
        let tiles = self.layout.parts()[last].tiles();
        self.tile_head(last, tiles.width - 1, tiles.height - 1).map(drop)
    }

    /// What the offset tables say of a tile.
    fn offset(&self, part: usize, x: i64, y: i64) -> Result<u64> {
        let tiles = self.layout.parts()[part].tiles();
        let index = (y * tiles.width + x) as u64;
        if let Some(unwritten) = &self.unwritten {
            return Ok(unwritten.tables[part][index as usize]);
        }
        let page = index / PAGE_OFFSETS;
        let key = (part, page as i64, 0);
        let bytes = match self.pages.get(key) {
            Some(bytes) => bytes,
            None => {
                let first = page * PAGE_OFFSETS;
                let count = PAGE_OFFSETS.min(tiles.samples() as u64 - first);
                let mut bytes = vec![0; 8 * count as usize];
                self.bytes
                    .read_exact_at(self.tables_at[part] + 8 * first, &mut bytes)
                    .map_err(|e| self.unread(part, x, y, e))?;
                let bytes = Arc::new(bytes);
                self.pages.put(key, bytes.clone());
                bytes
            }
        };
        let at = 8 * (index % PAGE_OFFSETS) as usize;
        let offset = bytes[at..at + 8].try_into().expect("a page holds whole offsets");
        Ok(u64::from_le_bytes(offset))
    }

    /// Where the data of a tile begin, and their length; checked against the file's length.
    fn tile_head(&self, part: usize, x: i64, y: i64) -> Result<(u64, usize)> {
        let description = &self.layout.parts()[part];
        let offset = self.offset(part, x, y)?;
        let file_bytes = self.bytes.size_bytes();
        let data = offset
            .checked_add(TILE_HEAD_BYTES as u64)
            .filter(|end| *end < file_bytes);
        let Some(data) = data else {
            return Err(self.broken(part, x, y, format!("should lie at byte {offset} of {file_bytes}")));
        };
        let mut head = [0; TILE_HEAD_BYTES];
        self.bytes
            .read_exact_at(offset, &mut head)
            .map_err(|e| self.unread(part, x, y, e))?;
        let mut words = head
            .chunks_exact(4)
            .map(|w| i32::from_le_bytes([w[0], w[1], w[2], w[3]]));
        let found: [i32; 6] = std::array::from_fn(|_| words.next().unwrap_or_default());
        if found[..5]
            .iter()
            .map(|n| i64::from(*n))
            .ne([part as i64, x, y, 0, 0])
        {
            let [p, tx, ty, lx, ly, _] = found;
            let what = format!("finds tile ({tx}, {ty}) of part number {p}, level ({lx}, {ly}) in its place");
            return Err(self.broken(part, x, y, what));
        }
        let most = description.bytes(description.tile_rect(x, y));
        let length = usize::try_from(found[5]).ok().filter(|n| (1..=most).contains(n));
        let Some(length) = length else {
            return Err(self.broken(
                part,
                x,
                y,
                format!("has {} bytes of data, not 1 to {most}", found[5]),
            ));
        };
        if data + length as u64 > file_bytes {
            return Err(self.broken(part, x, y, format!("ends beyond the file's {file_bytes} bytes")));
        }
        Ok((data, length))
    }

    /// Reads, decodes and checks a tile.
    fn read_tile(&self, part: usize, x: i64, y: i64) -> Result<Vec<u8>> {
        let (at, length) = self.tile_head(part, x, y)?;
        let mut compressed = vec![0; length];
        self.bytes
            .read_exact_at(at, &mut compressed)
            .map_err(|e| self.unread(part, x, y, e))?;
        let description = &self.layout.parts()[part];
        let most = description.bytes(description.tile_rect(x, y));
        let tile = zip::decompress(compressed, most)
            .map_err(|e| self.broken(part, x, y, format!("cannot be decoded ({e})")))?;
        let tile = little_endian(tile, description.sample_bytes());
        if let Some(at) = self.layout.check_of(part, x, y) {
            let want = self.check_value(at.part, at.x, at.y, at.channel)?;
            let found = check(&tile, description.sample_bytes());
            if found != want {
                let place = self.layout.parts()[at.part].name();
                let what = format!("is damaged: its CRC-32C is {found:08x}, {place} says {want:08x}");
                return Err(self.broken(part, x, y, what));
            }
        }
        Ok(tile)
    }

    /// A tile from the cache, or read.
    fn tile(&self, part: usize, x: i64, y: i64) -> Result<Arc<Vec<u8>>> {
        if let Some(tile) = self.cache.get((part, x, y)) {
            return Ok(tile);
        }
        let tile = Arc::new(self.read_tile(part, x, y)?);
        self.cache.put((part, x, y), tile.clone());
        Ok(tile)
    }

    /// One value of a check part.
    fn check_value(&self, part: usize, x: i64, z: i64, channel: usize) -> Result<u32> {
        if let Some(unwritten) = &self.unwritten {
            let width = self.layout.parts()[part].size.width;
            return Ok(unwritten.checks[part][(z * width + x) as usize][channel]);
        }
        let at = Rect::new(x, z, x + 1, z + 1);
        let (tx, ty) = (x / super::layout::TILE, z / super::layout::TILE);
        let tile = self.tile(part, tx, ty)?;
        Ok(check_values(&self.layout.parts()[part], &tile, (tx, ty), at)[0][channel])
    }

    /// Whether a check part holds 0 wherever there is nothing to check.
    fn check_unused(&self, part: usize, x: i64, y: i64, tile: &[u8]) -> Result<()> {
        let description = &self.layout.parts()[part];
        let rect = description.tile_rect(x, y);
        let values = check_values(description, tile, (x, y), rect);
        let unused = |cell: (i64, i64), value: [u32; 2]| match description.kind {
            Kind::CheckDay => false,
            Kind::Check => self.meta.light.is_none() && value[1] != 0,
            _ => {
                let of = self.layout.part(Kind::Bounds, cell.1 as u32);
                cell.0 >= self.layout.parts()[of].tiles().samples() && value[0] != 0
            }
        };
        match rect
            .cells()
            .zip(values)
            .find(|(cell, value)| unused(*cell, *value))
        {
            Some(((x0, z0), _)) => Err(self.broken(
                part,
                x,
                y,
                format!("is damaged: unused sample ({x0}, {z0}) is not 0"),
            )),
            None => Ok(()),
        }
    }

    /// Copies `rect` of a part into `out`, tile by tile.
    fn copy<T: bytemuck::Pod, const N: usize>(
        &self,
        kind: Kind,
        level: u32,
        fields: [usize; N],
        rect: Rect,
        out: &mut [[T; N]],
    ) -> Result<Arrival> {
        let misuse = |what: String| Err(Error::new(ErrorKind::Misuse, &self.name, what));
        if level >= self.layout.levels() {
            return misuse(format!(
                "level {level} was asked for, it has {}",
                self.layout.levels()
            ));
        }
        if kind == Kind::Light && self.meta.light.is_none() {
            return misuse("light was asked for, it has none".into());
        }
        if kind == Kind::Day && self.meta.day.is_none() {
            return misuse("light over a day was asked for, it has none".into());
        }
        let part = self.layout.part(kind, level);
        let description = &self.layout.parts()[part];
        if !description.size.rect().contains_rect(rect) || out.len() as i64 != rect.area() {
            let (name, length) = (description.name(), out.len());
            return misuse(format!("{rect:?} of {name} into {length} samples was asked for"));
        }
        if rect.is_empty() {
            return Ok(Arrival::Arrived);
        }
        for (x, y) in tiles_of(rect).cells() {
            unpack(
                &self.tile(part, x, y)?,
                description.tile_rect(x, y),
                fields,
                rect,
                out,
            );
        }
        Ok(Arrival::Arrived)
    }

    /// Copies the heights of `rect`, which lies on the level, into `out`, whose rows are `stride` samples apart.
    pub(crate) fn heights_strided(
        &self,
        level: u32,
        rect: Rect,
        stride: usize,
        out: &mut [f32],
    ) -> Result<()> {
        let part = self.layout.part(Kind::Height, level);
        for (x, y) in tiles_of(rect).cells() {
            let tile_rect = self.layout.parts()[part].tile_rect(x, y);
            let both = tile_rect.intersection(rect);
            let tile = self.tile(part, x, y)?;
            let count = both.width() as usize;
            for z in both.z0..both.z1 {
                let from = ((z - tile_rect.z0) * tile_rect.width() + both.x0 - tile_rect.x0) as usize;
                let to = (z - rect.z0) as usize * stride + (both.x0 - rect.x0) as usize;
                let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut out[to..to + count]);
                bytes.copy_from_slice(&tile[4 * from..4 * (from + count)]);
            }
        }
        Ok(())
    }

    /// Reads tile (x, y) of a level's heights into the cache, if it is not there.
    pub(crate) fn hold_heights(&self, level: u32, x: i64, y: i64) -> Result<()> {
        self.tile(self.layout.part(Kind::Height, level), x, y).map(drop)
    }

    fn broken(&self, part: usize, x: i64, y: i64, what: impl std::fmt::Display) -> Error {
        let part = self.layout.parts()[part].name();
        Error::new(
            ErrorKind::Broken,
            &self.name,
            format!("part {part}, tile ({x}, {y}) {what}"),
        )
        .advice("fetch it again, or preprocess the DEM again")
    }

    fn unread(&self, part: usize, x: i64, y: i64, error: std::io::Error) -> Error {
        let part = self.layout.parts()[part].name();
        Error::io(format!("{}: part {part}, tile ({x}, {y})", self.name), error)
    }
}

/// The values of `rect` of a check part; the second is 0 where the part has one channel.
fn check_values(part: &Part, tile: &[u8], (x, y): (i64, i64), rect: Rect) -> Vec<[u32; 2]> {
    let tile_rect = part.tile_rect(x, y);
    let count = rect.area() as usize;
    if part.channels().0.len() == 2 {
        let mut out = vec![[0; 2]; count];
        unpack(tile, tile_rect, [0, 1], rect, &mut out);
        return out;
    }
    let mut out = vec![[0; 1]; count];
    unpack(tile, tile_rect, [0], rect, &mut out);
    out.into_iter().map(|[only]| [only, 0]).collect()
}

impl Levels for TerrainFile {
    fn grid(&self) -> &Grid {
        &self.meta.grid
    }

    fn heights(&self, level: u32, rect: Rect, out: &mut [f32]) -> Result<Arrival> {
        self.copy::<f32, 1>(Kind::Height, level, [0], rect, bytemuck::cast_slice_mut(out))
    }

    fn bounds(&self, level: u32, patches: Rect, out: &mut [Bounds]) -> Result<Arrival> {
        self.copy::<f32, 6>(
            Kind::Bounds,
            level,
            BOUNDS_FIELDS,
            patches,
            bytemuck::cast_slice_mut(out),
        )
    }

    fn has_light(&self) -> bool {
        self.meta.light.is_some()
    }

    fn light(&self, level: u32, rect: Rect, out: &mut [LightSample]) -> Result<Arrival> {
        self.copy::<u16, 2>(
            Kind::Light,
            level,
            LIGHT_FIELDS,
            rect,
            bytemuck::cast_slice_mut(out),
        )
    }

    fn has_day(&self) -> bool {
        self.meta.day.is_some()
    }

    fn day(&self, level: u32, rect: Rect, out: &mut [DaySample]) -> Result<Arrival> {
        let mut samples = vec![[0u16; 5]; out.len()];
        let arrival = self.copy(Kind::Day, level, DAY_FIELDS, rect, &mut samples)?;
        for (out, [first, first_soft, last, last_soft, slope]) in out.iter_mut().zip(samples) {
            *out = bytemuck::cast([first, first_soft, last, last_soft, slope, 0]);
        }
        Ok(arrival)
    }
}

/// Columns and rows of the tiles that hold samples of `rect`, which is not empty.
fn tiles_of(rect: Rect) -> Rect {
    let tile_of = |n: i64| n / super::layout::TILE;
    Rect::new(
        tile_of(rect.x0),
        tile_of(rect.z0),
        tile_of(rect.x1 - 1) + 1,
        tile_of(rect.z1 - 1) + 1,
    )
}
