//! Decodes a block: reads what is stored, unpacks it, undoes its predictor, and keeps the band that is asked for.

use super::codec::Compression;
use super::ifd::{File, Order};
use super::layout::Layout;
use super::lerc;
use super::predictor;
use crate::error::{Error, ErrorKind, Result};
use crate::source::held::{MAX_COMPRESSION, filled};

/// A block may always take this much memory, however little of it is stored.
pub(super) const FREE_BYTES: u64 = 4 << 20;
/// What a compressed block may need beyond twice the bytes of its samples.
const SPARE_BYTES: u64 = 64 << 10;

/// The samples of the block at (`column`, `row`): [`Layout::held`] of them, each of the bytes of the layout's kind, in
/// the order of [`order`]. None where the file leaves the block out.
///
/// # Errors
/// [`ErrorKind::Broken`] where it is damaged or beyond the file's end, [`ErrorKind::Limit`] where it claims more
/// samples than what is stored of it can hold, and those of reading.
pub(super) fn decode(file: &File, layout: &Layout, column: i64, row: i64) -> Result<Option<Vec<u8>>> {
    let raw = if layout.grouped {
        Some(rows_as_stored(file, layout, row)?)
    } else {
        unpacked(file, layout, (row * layout.across() + column) as usize, row)?
    };
    Ok(raw.map(|raw| band(layout, raw, layout.held(column, row))))
}

/// The order of the bytes of a decoded sample.
pub(super) fn order(layout: &Layout) -> Order {
    match layout.predictor {
        3 => Order::Big,
        _ if is_packed(layout) || matches!(layout.compression, Compression::Lerc(_)) => Order::Little,
        _ => layout.order,
    }
}

fn is_packed(layout: &Layout) -> bool {
    usize::from(layout.bits) != 8 * layout.kind.bytes()
}

/// Rows of strips that are stored as they are.
fn rows_as_stored(file: &File, layout: &Layout, row: i64) -> Result<Vec<u8>> {
    let row_bytes = layout.row_bytes();
    let first = row * layout.block_height;
    let end = (first + layout.block_height).min(layout.height);
    // Their strips must have as many bytes, which is known before memory is taken.
    for strip in first / layout.stored_rows..=(end - 1) / layout.stored_rows {
        let rows = layout.stored_rows.min(layout.height - strip * layout.stored_rows);
        let wanted = row_bytes.checked_mul(rows as u64);
        let (offset, count) = layout.stored(strip as usize).unwrap_or((0, 0));
        check_inside(file, layout, strip as usize, offset, count)?;
        if wanted.is_none_or(|wanted| count < wanted) {
            let what = format!("strip {strip} ends after {count} of {rows} rows of {row_bytes} bytes");
            return Err(file.broken(what));
        }
    }
    let mut raw = filled(&file.name, (row_bytes * (end - first) as u64) as usize, 0u8)?;
    let mut at = first;
    while at < end {
        let strip = at / layout.stored_rows;
        let within = at - strip * layout.stored_rows;
        let rows = (layout.stored_rows - within).min(end - at);
        let (offset, _) = layout.stored(strip as usize).unwrap_or((0, 0));
        let start = ((at - first) as u64 * row_bytes) as usize;
        let part = &mut raw[start..start + (rows as u64 * row_bytes) as usize];
        file.read(offset + within as u64 * row_bytes, part)?;
        if layout.reversed_bits {
            reverse_bits(part);
        }
        at += rows;
    }
    Ok(raw)
}

/// All samples of a stored strip or tile; none where the file leaves it out.
fn unpacked(file: &File, layout: &Layout, index: usize, row: i64) -> Result<Option<Vec<u8>>> {
    let Some((offset, count)) = layout.stored(index) else {
        return Ok(None);
    };
    let row_bytes = layout.row_bytes();
    // Not the rows below the image, even of a tile: some writers leave them out.
    let rows = layout.stored_rows.min(layout.height - row * layout.stored_rows);
    let name = || format!("{} {index}", ["strip", "tile"][usize::from(layout.tiled)]);
    let wanted = u128::from(row_bytes) * rows as u128;
    let holds = u128::from(count) * u128::from(MAX_COMPRESSION);
    if wanted > holds.max(FREE_BYTES.into()) {
        let what = format!(
            "{} claims {wanted} bytes of samples, and {count} are stored",
            name()
        );
        return Err(Error::new(ErrorKind::Limit, &file.name, what).advice("check that the file is whole"));
    }
    check_inside(file, layout, index, offset, count)?;
    let wanted = wanted as u64;
    let needed = match layout.compression {
        Compression::None => wanted,
        _ => 2 * wanted + SPARE_BYTES,
    };
    let mut stored = filled(&file.name, count.min(needed) as usize, 0u8)?;
    file.read(offset, &mut stored)?;
    if layout.reversed_bits {
        reverse_bits(&mut stored);
    }
    let mut raw = match layout.compression {
        Compression::None if stored.len() as u64 == wanted => stored,
        compression => {
            let mut raw = filled(&file.name, wanted as usize, 0u8)?;
            let unpacked = match compression {
                Compression::Lerc(around) => {
                    let wanted = lerc::Wanted {
                        kind: layout.kind,
                        columns: layout.block_width as usize,
                        rows: [rows, layout.stored_rows].map(|n| n as usize),
                        interleaved: layout.interleaved,
                    };
                    lerc::unpack(around, wanted, &stored, &mut raw)
                }
                compression => compression.unpack(&stored, &mut raw),
            };
            unpacked.map_err(|what| file.broken(format!("{} {what}", name())))?;
            raw
        }
    };
    let bytes = layout.kind.bytes();
    match layout.predictor {
        2 => raw
            .chunks_exact_mut(row_bytes as usize)
            .for_each(|row| predictor::sum(row, bytes, layout.interleaved, layout.order)),
        3 => {
            let mut spare = vec![0; row_bytes as usize];
            raw.chunks_exact_mut(row_bytes as usize)
                .for_each(|row| predictor::sum_floats(row, &mut spare, bytes, layout.interleaved));
        }
        _ => {}
    }
    Ok(Some(raw))
}

fn reverse_bits(bytes: &mut [u8]) {
    bytes.iter_mut().for_each(|byte| *byte = byte.reverse_bits());
}

fn check_inside(file: &File, layout: &Layout, index: usize, offset: u64, count: u64) -> Result<()> {
    if offset
        .checked_add(count)
        .is_some_and(|end| end <= file.size_bytes)
    {
        return Ok(());
    }
    let what = ["strip", "tile"][usize::from(layout.tiled)];
    Err(file.broken(format!(
        "{what} {index}, of {count} bytes at {offset}, lies beyond its end at {}",
        file.size_bytes
    )))
}

/// The samples of one band in the columns and rows that lie in the image.
fn band(layout: &Layout, raw: Vec<u8>, [columns, rows]: [i64; 2]) -> Vec<u8> {
    let bytes = layout.kind.bytes();
    let row_bytes = layout.row_bytes() as usize;
    let (columns, rows) = (columns as usize, rows as usize);
    let mut raw = raw;
    if is_packed(layout) {
        let mut out = Vec::with_capacity(columns * rows * bytes);
        for row in raw.chunks_exact(row_bytes).take(rows) {
            for column in 0..columns {
                let value = bits_of(layout, row, column * layout.interleaved + layout.band);
                out.extend(&value.to_le_bytes()[..bytes]);
            }
        }
        return out;
    }
    if columns * bytes == row_bytes {
        raw.truncate(rows * row_bytes);
        return raw;
    }
    let step = layout.interleaved * bytes;
    let mut out = Vec::with_capacity(columns * rows * bytes);
    for row in raw.chunks_exact(row_bytes).take(rows) {
        if layout.interleaved == 1 {
            out.extend(&row[..columns * bytes]);
        } else {
            let pixels = row.chunks_exact(step).take(columns);
            pixels.for_each(|pixel| out.extend(&pixel[layout.band * bytes..][..bytes]));
        }
    }
    out
}

/// Sample `index` of a row of samples of odd size: the first in the highest bits, whatever the file's order, as GDAL
/// has it for those of three bytes too.
fn bits_of(layout: &Layout, row: &[u8], index: usize) -> u32 {
    let bits = usize::from(layout.bits);
    let start = index * bits;
    let mut value = 0u64;
    let last = (start + bits - 1) / 8;
    for byte in &row[start / 8..=last] {
        value = value << 8 | u64::from(*byte);
    }
    let behind = 8 * (last + 1) - start - bits;
    (value >> behind & ((1 << bits) - 1)) as u32
}
