//! An image read by rectangles: only blocks that a rectangle touches are decoded, several at once, and the latest of
//! them kept, so that a pass from north to south decodes none twice.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use super::block;
use super::cache::{Block, Cache};
use super::ifd::File;
use super::layout::Layout;
use super::samples::Samples;
use crate::error::Result;
use crate::grid::Rect;
use crate::source::Reads;
use crate::source::processors::Processors;
use crate::work::{Work, each_chunk};

/// Bytes of blocks that are kept at least, and at most; in between, two rows of blocks.
const CACHE_BYTES: [u64; 2] = [32 << 20, 192 << 20];
/// Bytes of blocks that are decoded before any of them is turned into heights.
const BATCH_BYTES: i64 = 8 << 20;
/// Bytes by which a block is found: its offset, its length and its place in the cache.
const LISTED_BYTES: u64 = 64;
/// Rows that one task turns into heights.
const TASK_ROWS: usize = 16;

/// One band of an image, or a mask.
pub(super) struct Raster {
    file: File,
    layout: Layout,
    samples: Samples,
    work: Box<dyn Work + Send>,
    cache: Mutex<Cache>,
    cache_bytes: u64,
    decoded: AtomicU64,
    infinite: AtomicU64,
}

impl Raster {
    pub(super) fn new(file: File, layout: Layout, samples: Samples, work: Box<dyn Work + Send>) -> Self {
        let row_of_blocks = (layout.across() * layout.block_width) as u128
            * layout.block_height as u128
            * layout.kind.bytes() as u128;
        let [least, most] = CACHE_BYTES;
        let budget = (2 * row_of_blocks).clamp(least.into(), most.into());
        Self {
            file,
            layout,
            samples,
            work,
            cache: Mutex::new(Cache::new(budget as usize)),
            cache_bytes: budget as u64,
            decoded: AtomicU64::new(0),
            infinite: AtomicU64::new(0),
        }
    }

    pub(super) fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The most that is held of blocks, in bytes: the cache, blocks on their way into it, and those that are being
    /// decoded, as they are stored and where they hold more than the band.
    pub(super) fn held_bytes(&self) -> u64 {
        let Layout {
            width, height, kind, ..
        } = &self.layout;
        let whole = (width * height) as u64 * kind.bytes() as u64;
        let row_of_blocks = whole / self.layout.down().max(1) as u64;
        let decoded = whole.min(self.cache_bytes + row_of_blocks.max(BATCH_BYTES as u64));
        let blocks = (self.layout.across() * self.layout.down()) as u64;
        let at_once = blocks.min(Processors::count() as u64);
        decoded + at_once * self.layout.decoding_bytes() + blocks * LISTED_BYTES
    }

    /// What reading has met so far.
    pub(super) fn reads(&self) -> Reads {
        Reads {
            blocks: (self.layout.across() * self.layout.down()) as u64,
            decoded: self.decoded.load(Ordering::Relaxed),
            infinite: self.infinite.load(Ordering::Relaxed),
        }
    }

    /// Chooses the base from the first block that holds a value; a block that cannot be read leaves it at 0, and fails
    /// when it is asked for.
    pub(super) fn choose_base(&mut self) {
        for row in 0..self.layout.down() {
            for column in 0..self.layout.across() {
                let base_m = match block::decode(&self.file, &self.layout, column, row) {
                    Ok(Some(raw)) => self.samples.base_of(&raw),
                    Ok(None) if self.samples.left_out().is_nan() => None,
                    Ok(None) | Err(_) => Some(0.0),
                };
                if let Some(base_m) = base_m {
                    self.samples.base_m = base_m;
                    return;
                }
            }
        }
    }

    /// How bytes become heights.
    pub(super) fn samples(&self) -> &Samples {
        &self.samples
    }

    /// The heights of `rect`, in the order of the file's rows; it lies within the image and is not empty.
    ///
    /// # Errors
    /// Those of the first block, by row and column, that cannot be decoded.
    pub(super) fn read(&self, rect: Rect, out: &mut [f32]) -> Result<()> {
        let Layout {
            block_width,
            block_height,
            ..
        } = self.layout;
        let columns = rect.x0 / block_width..(rect.x1 - 1) / block_width + 1;
        let end = (rect.z1 - 1) / block_height + 1;
        let across = columns.end - columns.start;
        let held = (block_width.min(self.layout.width) * self.layout.kind.bytes() as i64)
            .saturating_mul(block_height.min(self.layout.height))
            .saturating_mul(across);
        let at_once = (BATCH_BYTES / held).max(1);
        let width = rect.width() as usize;
        let mut out = out;
        let mut row = rect.z0 / block_height;
        while row < end {
            let rows = row..(row + at_once).min(end);
            let blocks = self.blocks(columns.clone(), rows.clone())?;
            let z0 = rect.z0.max(rows.start * block_height);
            let z1 = rect.z1.min(rows.end * block_height);
            let (part, rest) = std::mem::take(&mut out).split_at_mut((z1 - z0) as usize * width);
            each_chunk(self.work.as_ref(), part, TASK_ROWS * width, |chunk, part| {
                let z = z0 + (chunk * TASK_ROWS) as i64;
                for (z, out) in (z..).zip(part.chunks_exact_mut(width)) {
                    let from = (z / block_height - rows.start) * across;
                    let blocks = &blocks[from as usize..][..across as usize];
                    self.row(blocks, columns.start, z, rect, out);
                }
            });
            out = rest;
            row = rows.end;
        }
        Ok(())
    }

    /// Row `z` of `rect` from the blocks over it, the first of which is at column `column`.
    fn row(&self, blocks: &[Block], column: i64, z: i64, rect: Rect, out: &mut [f32]) {
        let bytes = self.layout.kind.bytes();
        let (mut out, mut infinite) = (out, 0);
        for (column, block) in (column..).zip(blocks) {
            let [held, _] = self.layout.held(column, 0);
            let west = column * self.layout.block_width;
            let (x0, x1) = (rect.x0.max(west), rect.x1.min(west + held));
            let (part, rest) = out.split_at_mut((x1 - x0) as usize);
            match block {
                Some(raw) => {
                    let row = z % self.layout.block_height;
                    let start = (row * held + x0 - west) as usize * bytes;
                    infinite += self
                        .samples
                        .heights(&raw[start..start + part.len() * bytes], part);
                }
                None => part.fill(self.samples.left_out()),
            }
            out = rest;
        }
        if infinite > 0 {
            self.infinite.fetch_add(infinite, Ordering::Relaxed);
        }
    }

    /// The blocks of some columns and rows, row by row. The cache is not locked while they are decoded: a task that
    /// waits for others may be handed another's, which would wait for itself.
    fn blocks(&self, columns: std::ops::Range<i64>, rows: std::ops::Range<i64>) -> Result<Vec<Block>> {
        let at: Vec<(i64, i64)> = rows.flat_map(|z| columns.clone().map(move |x| (x, z))).collect();
        let mut blocks: Vec<Block> = {
            let mut cache = self.cache.lock().unwrap_or_else(PoisonError::into_inner);
            at.iter().map(|at| cache.get(*at)).collect()
        };
        let missing: Vec<usize> = (0..at.len()).filter(|i| blocks[*i].is_none()).collect();
        if missing.is_empty() {
            return Ok(blocks);
        }
        let mut decoded: Vec<Result<Option<Vec<u8>>>> = missing.iter().map(|_| Ok(None)).collect();
        each_chunk(self.work.as_ref(), &mut decoded, 1, |task, place| {
            let (column, row) = at[missing[task]];
            place[0] = block::decode(&self.file, &self.layout, column, row);
        });
        let mut cache = self.cache.lock().unwrap_or_else(PoisonError::into_inner);
        for (i, block) in missing.into_iter().zip(decoded) {
            let Some(raw) = block? else { continue };
            self.decoded.fetch_add(1, Ordering::Relaxed);
            let raw = Arc::new(raw);
            cache.put(at[i], Arc::clone(&raw));
            blocks[i] = Some(raw);
        }
        Ok(blocks)
    }
}
