//! Rows of samples cut into tiles, compressed on all processors, and put one after another.

use std::io::{Seek, Write};
use std::sync::{Mutex, PoisonError};

use bytemuck::Pod;

use crate::error::{Error, Result};
use crate::progress::Progress;
use crate::terrain::layout::{Kind, TILE, TileRow};
use crate::terrain::{EncodedTile, TerrainWriter};
use crate::work::Work;

/// Tiles that are held at once before they are written: of heights 16 MiB, of bounds 24 MiB as they are.
const BATCH_BYTES: usize = 24 << 20;

/// A row of tiles.
pub(super) struct Tiles<'a, T, const N: usize> {
    pub(super) row: TileRow,
    /// Samples along a row.
    pub(super) width: i64,
    /// The rows under the tiles, from the first on.
    pub(super) samples: &'a [[T; N]],
    /// For each channel of the part the field that it holds.
    pub(super) fields: [usize; N],
}

/// Compresses and puts a row of tiles from west to east.
///
/// # Errors
/// What the file meets; [`crate::ErrorKind::Cancelled`].
pub(super) fn put_tiles<W: Write + Seek + Sync + Send, T: Pod + Sync, const N: usize>(
    writer: &mut TerrainWriter<W>,
    tiles: &Tiles<'_, T, N>,
    work: &dyn Work,
    progress: &dyn Progress,
) -> Result<()> {
    let Tiles { row, width, .. } = *tiles;
    put_packed(writer, row, size_of::<[T; N]>(), work, progress, |x| {
        let columns = x * TILE..((x + 1) * TILE).min(width);
        crate::terrain::pack_columns(tiles.samples, width, columns, tiles.fields)
    })
}

/// Compresses and puts a row of tiles from west to east, of `sample_bytes` a sample; `pack` makes the decoded samples of
/// tile number x of it.
///
/// # Errors
/// What the file meets; [`crate::ErrorKind::Cancelled`].
pub(super) fn put_packed<W: Write + Seek + Sync + Send>(
    writer: &mut TerrainWriter<W>,
    row: TileRow,
    sample_bytes: usize,
    work: &dyn Work,
    progress: &dyn Progress,
    pack: impl Fn(i64) -> Vec<u8> + Sync,
) -> Result<()> {
    let count = writer.layout().parts()[row.part].tiles().width;
    let batch = (BATCH_BYTES / (TILE * TILE) as usize / sample_bytes).max(1) as i64;
    for from in (0..count).step_by(batch as usize) {
        let until = (from + batch).min(count);
        let encoded = each_tile(from, until, work, progress, |x| {
            writer.encode(row.part, x, row.y, pack(x))
        })?;
        for tile in encoded {
            writer.put(tile)?;
        }
    }
    Ok(())
}

/// Compresses and puts all tiles of the checks.
///
/// # Errors
/// What the file meets; [`crate::ErrorKind::Cancelled`].
pub(super) fn put_checks<W: Write + Seek + Sync + Send>(
    writer: &mut TerrainWriter<W>,
    work: &dyn Work,
    progress: &dyn Progress,
) -> Result<()> {
    for kind in [Kind::Check, Kind::CheckDay, Kind::CheckBounds] {
        for row in writer.layout().order_of(kind) {
            let count = writer.layout().parts()[row.part].tiles().width;
            let encoded = each_tile(0, count, work, progress, |x| {
                writer.encode(row.part, x, row.y, writer.check_tile(row.part, x, row.y))
            })?;
            for tile in encoded {
                writer.put(tile)?;
            }
        }
    }
    Ok(())
}

/// Tiles `from..until` of a row, made on all processors, in their order.
fn each_tile(
    from: i64,
    until: i64,
    work: &dyn Work,
    progress: &dyn Progress,
    make: impl Fn(i64) -> Result<EncodedTile> + Sync,
) -> Result<Vec<EncodedTile>> {
    if progress.cancelled() {
        return Err(Error::cancelled("terrain file"));
    }
    let slots: Vec<Mutex<Option<Result<EncodedTile>>>> = (from..until).map(|_| Mutex::default()).collect();
    work.each(slots.len(), &|index| {
        let tile = make(from + index as i64);
        *slots[index].lock().unwrap_or_else(PoisonError::into_inner) = Some(tile);
    });
    let tile = |slot: Mutex<Option<Result<EncodedTile>>>| {
        let tile = slot.into_inner().unwrap_or_else(PoisonError::into_inner);
        tile.expect("every task ran and left its tile")
    };
    slots.into_iter().map(tile).collect()
}
