//! Writing terrain files: [`write`] makes one of any [`Levels`], tile by tile; [`TerrainWriter`] takes tiles from
//! whoever has them.

use std::io::{Seek, SeekFrom, Write};
use std::sync::{Arc, Mutex};

use exr::block::chunk::{Chunk, CompressedBlock, CompressedTileBlock, TileCoordinates};
use exr::meta::MetaData;
use exr::prelude::Vec2;

use super::header;
use super::layout::{Kind, Layout, Part, TileRow};
use super::meta::Meta;
use super::reader::{TerrainFile, Unwritten};
use super::tile::{BOUNDS_FIELDS, DAY_FIELDS, LIGHT_FIELDS, check, little_endian, pack};
use super::zip;
use crate::error::{Error, ErrorKind, Result};
use crate::grid::Rect;
use crate::levels::{Arrival, Bounds, DaySample, Levels, LightSample};
use crate::progress::Progress;
use crate::source::ReadAt;
use crate::work::Work;

const SUBJECT: &str = "terrain file";

/// Tiles that are held decoded at once while they are compressed: 16 of the largest (bounds) take 25 MB.
const BATCH: i64 = 16;

/// Writes a terrain file of `levels` to `out`, from its beginning.
///
/// The levels' grid must be that of `meta`, and they must have light and a day exactly if `meta` says so. The same input
/// gives the same bytes, however `work` shares the compression out.
///
/// # Errors
/// What `out` or `levels` meet; [`ErrorKind::Misuse`] where `meta` and `levels` differ; [`ErrorKind::Limit`] where
/// OpenEXR cannot hold the grid; [`ErrorKind::Cancelled`].
pub fn write<W: Write + Seek + Sync>(
    out: W,
    meta: &Meta,
    levels: &dyn Levels,
    work: &dyn Work,
    progress: &dyn Progress,
) -> Result<W> {
    if *levels.grid() != meta.grid
        || levels.has_light() != meta.light.is_some()
        || levels.has_day() != meta.day.is_some()
    {
        return Err(Error::new(
            ErrorKind::Misuse,
            SUBJECT,
            "its description is not that of its levels",
        ));
    }
    let mut writer = TerrainWriter::new(out, meta)?;
    progress.begin("write", writer.layout.tile_count());
    writer.copy(writer.layout.order(), levels, work, progress)?;
    writer.finish()
}

/// A compressed tile with its check, ready to be put.
#[derive(Clone, Debug)]
pub struct EncodedTile {
    part: usize,
    x: i64,
    y: i64,
    check: u32,
    compressed: Vec<u8>,
}

/// A terrain file in the making. Tiles may be encoded on many threads and are put one by one; the file holds them
/// in the order in which they are put, which should be [`Layout::order`].
pub struct TerrainWriter<W> {
    out: W,
    layout: Layout,
    exr: MetaData,
    /// Where the offset tables begin, and where the next tile goes.
    tables_at: u64,
    position: u64,
    /// Of each part the offset of each tile, row by row; 0 where it has not been put.
    tables: Vec<Vec<u64>>,
    /// Of each check part its samples so far: of each channel one value.
    checks: Vec<Vec<[u32; 2]>>,
}

impl<W: Write + Seek> TerrainWriter<W> {
    /// Writes the header, and zeros where the offset tables will be. `out` stands at its beginning.
    ///
    /// # Errors
    /// What `out` meets; [`ErrorKind::Limit`] where OpenEXR cannot hold the grid.
    pub fn new(mut out: W, meta: &Meta) -> Result<Self> {
        let layout = Layout::new(&meta.grid, meta.light.is_some(), meta.day.is_some())
            .map_err(|what| Error::new(ErrorKind::Limit, SUBJECT, what))?;
        let exr = header::describe(&layout);
        let head = header::to_bytes(meta, &exr)?;
        out.write_all(&head).map_err(|e| Error::io(SUBJECT, e))?;
        let tiles = |part: &Part| part.tiles().samples() as usize;
        let tables: Vec<Vec<u64>> = layout.parts().iter().map(|p| vec![0; tiles(p)]).collect();
        for table in &tables {
            out.write_all(bytemuck::cast_slice(table))
                .map_err(|e| Error::io(SUBJECT, e))?;
        }
        let held = |part: &Part| match part.kind {
            Kind::Check | Kind::CheckDay | Kind::CheckBounds => vec![[0; 2]; part.size.samples() as usize],
            _ => Vec::new(),
        };
        let checks = layout.parts().iter().map(held).collect();
        let tables_at = head.len() as u64;
        let position = tables_at + 8 * layout.tile_count();
        Ok(Self {
            out,
            layout,
            exr,
            tables_at,
            position,
            tables,
            checks,
        })
    }

    /// The parts, and the order in which tiles should be put.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Compresses tile (x, y) of part `part`. `bytes` are its decoded samples: row by row, in each row channel by
    /// channel (alphabetical), in the machine's byte order.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] where the tile does not exist or `bytes` has another length.
    pub fn encode(&self, part: usize, x: i64, y: i64, bytes: Vec<u8>) -> Result<EncodedTile> {
        let wrong = |what: &str| {
            Error::new(
                ErrorKind::Misuse,
                SUBJECT,
                format!("tile ({x}, {y}) of part number {part} {what}"),
            )
        };
        let Some(&description) = self.layout.parts().get(part) else {
            return Err(wrong("has no part"));
        };
        let rect = description.tile_rect(x, y);
        if rect.is_empty() {
            return Err(wrong("does not exist"));
        }
        if bytes.len() != description.bytes(rect) {
            return Err(wrong(&format!(
                "takes {} bytes, not {}",
                description.bytes(rect),
                bytes.len()
            )));
        }
        let check = check(&bytes, description.sample_bytes());
        let compressed = zip::compress(little_endian(bytes, description.sample_bytes()));
        Ok(EncodedTile {
            part,
            x,
            y,
            check,
            compressed,
        })
    }

    /// Writes a tile and keeps its check.
    ///
    /// # Errors
    /// What `out` meets; [`ErrorKind::Misuse`] for a tile that has been put before.
    pub fn put(&mut self, tile: EncodedTile) -> Result<()> {
        let EncodedTile {
            part,
            x,
            y,
            check,
            compressed,
        } = tile;
        let index = (y * self.layout.parts()[part].tiles().width + x) as usize;
        if self.tables[part][index] != 0 {
            let name = self.layout.parts()[part].name();
            let what = format!("tile ({x}, {y}) of {name} is put twice");
            return Err(Error::new(ErrorKind::Misuse, SUBJECT, what));
        }
        let length = compressed.len() as u64;
        let coordinates = TileCoordinates {
            tile_index: Vec2(x as usize, y as usize),
            level_index: Vec2(0, 0),
        };
        let block = CompressedTileBlock {
            coordinates,
            compressed_pixels_le: compressed,
        };
        Chunk {
            layer_index: part,
            compressed_block: CompressedBlock::Tile(block),
        }
        .write(&mut self.out, self.exr.headers.len())
        .map_err(refused)?;
        self.tables[part][index] = self.position;
        self.position += super::reader::TILE_HEAD_BYTES as u64 + length;
        if let Some(at) = self.layout.check_of(part, x, y) {
            let width = self.layout.parts()[at.part].size.width;
            self.checks[at.part][(at.y * width + at.x) as usize][at.channel] = check;
        }
        Ok(())
    }

    /// Puts rows of tiles of `levels`, or of the checks so far. Progress advances by tiles.
    ///
    /// # Errors
    /// What the file or `levels` meet; [`ErrorKind::Cancelled`].
    pub fn copy(
        &mut self,
        rows: Vec<TileRow>,
        levels: &dyn Levels,
        work: &dyn Work,
        progress: &dyn Progress,
    ) -> Result<()>
    where
        W: Sync,
    {
        for TileRow { part, y, .. } in rows {
            let width = self.layout.parts()[part].tiles().width;
            for x0 in (0..width).step_by(BATCH as usize) {
                if progress.cancelled() {
                    return Err(Error::cancelled(SUBJECT));
                }
                let count = BATCH.min(width - x0) as usize;
                let slots: Vec<Mutex<Option<Result<EncodedTile>>>> =
                    (0..count).map(|_| Mutex::default()).collect();
                work.each(count, &|index| {
                    let x = x0 + index as i64;
                    let tile = self
                        .decoded(part, x, y, levels)
                        .and_then(|b| self.encode(part, x, y, b));
                    *slots[index]
                        .lock()
                        .expect("each slot is locked once, by its own task") = Some(tile);
                });
                for slot in slots {
                    let tile = slot.into_inner().ok().flatten();
                    self.put(tile.expect("every task ran and left its tile")?)?;
                }
                progress.advance(count as u64);
            }
        }
        Ok(())
    }

    /// The decoded samples of tile (x, y) of a check part, from the tiles that have been put.
    pub fn check_tile(&self, part: usize, x: i64, y: i64) -> Vec<u8> {
        let description = &self.layout.parts()[part];
        let rect = description.tile_rect(x, y);
        let at = |(x, z)| self.checks[part][(z * description.size.width + x) as usize];
        let samples: Vec<[u32; 2]> = rect.cells().map(at).collect();
        if description.channels().0.len() == 2 {
            return pack(&samples, rect.width() as usize, [0, 1]);
        }
        let samples: Vec<[u32; 1]> = samples.into_iter().map(|[first, _]| [first]).collect();
        pack(&samples, rect.width() as usize, [0])
    }

    /// The tiles that have been put, as an open file whose checks are those that were kept here: what a later pass
    /// makes of them is made of what the file holds. `bytes` are the file's.
    ///
    /// # Errors
    /// What `out` meets as it is flushed.
    pub fn readable(
        &mut self,
        name: &str,
        meta: &Meta,
        open: impl FnOnce() -> Result<Arc<dyn ReadAt>>,
    ) -> Result<TerrainFile> {
        self.out.flush().map_err(|e| Error::io(SUBJECT, e))?;
        Ok(TerrainFile::unfinished(
            name,
            open()?,
            meta.clone(),
            self.layout.clone(),
            Unwritten {
                tables: self.tables.clone(),
                checks: self.checks.clone(),
            },
        ))
    }

    /// The decoded samples of any tile: of `levels`, or of the checks so far.
    fn decoded(&self, part: usize, x: i64, y: i64, levels: &dyn Levels) -> Result<Vec<u8>> {
        let description = &self.layout.parts()[part];
        let rect = description.tile_rect(x, y);
        decode_levels(description, rect, levels).unwrap_or_else(|| Ok(self.check_tile(part, x, y)))
    }

    /// Writes the offset tables and gives `out` back, flushed.
    ///
    /// # Errors
    /// What `out` meets; [`ErrorKind::Misuse`] where tiles are missing.
    pub fn finish(mut self) -> Result<W> {
        let missing = self.tables.iter().flatten().filter(|&&at| at == 0).count();
        if missing > 0 {
            return Err(Error::new(
                ErrorKind::Misuse,
                SUBJECT,
                format!("{missing} tiles were not written"),
            ));
        }
        self.out
            .seek(SeekFrom::Start(self.tables_at))
            .map_err(|e| Error::io(SUBJECT, e))?;
        for table in &mut self.tables {
            table.iter_mut().for_each(|at| *at = at.to_le());
            self.out
                .write_all(bytemuck::cast_slice(table))
                .map_err(|e| Error::io(SUBJECT, e))?;
        }
        self.out.flush().map_err(|e| Error::io(SUBJECT, e))?;
        Ok(self.out)
    }
}

/// The decoded samples of `rect` of a part that comes from `levels`; None for check parts.
fn decode_levels(part: &Part, rect: Rect, levels: &dyn Levels) -> Option<Result<Vec<u8>>> {
    let (count, width) = (rect.area() as usize, rect.width() as usize);
    let arrived = |arrival: Result<Arrival>, bytes: &dyn Fn() -> Vec<u8>| match arrival? {
        Arrival::Arrived => Ok(bytes()),
        Arrival::Missing => {
            let what = format!(
                "{} is not there yet; only whole levels can be written",
                part.name()
            );
            Err(Error::new(ErrorKind::Misuse, SUBJECT, what))
        }
    };
    match part.kind {
        Kind::Height => {
            let mut heights = vec![0f32; count];
            let arrival = levels.heights(part.level, rect, &mut heights);
            // One NaN, so that the file does not depend on which one a source uses for no data.
            heights
                .iter_mut()
                .filter(|h| h.is_nan())
                .for_each(|h| *h = f32::NAN);
            let samples: &[[f32; 1]] = bytemuck::cast_slice(&heights);
            Some(arrived(arrival, &|| pack(samples, width, [0])))
        }
        Kind::Bounds => {
            let mut bounds = vec![Bounds::VOID; count];
            let arrival = levels.bounds(part.level, rect, &mut bounds);
            // One NaN here too, field by field: a void patch may have saturated bounds.
            let fields: &mut [f32] = bytemuck::cast_slice_mut(&mut bounds);
            fields
                .iter_mut()
                .filter(|f| f.is_nan())
                .for_each(|f| *f = f32::NAN);
            let samples: &[[f32; 6]] = bytemuck::cast_slice(&bounds);
            Some(arrived(arrival, &|| pack(samples, width, BOUNDS_FIELDS)))
        }
        Kind::Light => {
            let mut light = vec![LightSample::default(); count];
            let arrival = levels.light(part.level, rect, &mut light);
            let samples: &[[u16; 2]] = bytemuck::cast_slice(&light);
            Some(arrived(arrival, &|| pack(samples, width, LIGHT_FIELDS)))
        }
        Kind::Day => {
            let mut day = vec![DaySample::default(); count];
            let arrival = levels.day(part.level, rect, &mut day);
            let samples: &[[u16; 6]] = bytemuck::cast_slice(&day);
            let samples: Vec<[u16; 5]> = samples.iter().map(|s| [s[0], s[1], s[2], s[3], s[4]]).collect();
            Some(arrived(arrival, &|| pack(&samples, width, DAY_FIELDS)))
        }
        Kind::Check | Kind::CheckDay | Kind::CheckBounds => None,
    }
}

fn refused(error: exr::error::Error) -> Error {
    match error {
        exr::error::Error::Io(e) => Error::io(SUBJECT, e),
        other => Error::new(ErrorKind::Io, SUBJECT, format!("cannot be written ({other})")),
    }
}
