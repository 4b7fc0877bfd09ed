//! How much memory a DEM takes while it is preprocessed, and how much the process took.

use crate::error::{Error, ErrorKind, Result};
use crate::grid::{Grid, Size};
use crate::light::{LitTimes, ROWS};
use crate::terrain::layout::TILE;

/// The ceiling of preprocessing unless another is given: 512 MiB.
pub const DEFAULT_MEMORY_BYTES: u64 = 512 << 20;

/// The ceiling of a pyramid that is held whole, unless another is given: 2 GiB.
pub const HELD_MEMORY_BYTES: u64 = 2 << 30;

/// Bytes a sample of level 0 takes at the peak where all is held: heights of all levels and their bounds alone (measured
/// at 4096 x 4096 over a source that holds nothing: 6.8), or light and what filtering it takes as well (22.3); and 4 for a
/// source that holds its heights.
const BYTES_A_SAMPLE: u64 = 12;
const BYTES_A_SAMPLE_WITH_LIGHT: u64 = 30;

/// Bytes a column of level 0 takes in either pass of preprocessing: in the first two bands of the DEM (2 KiB), the rows of
/// the coarser levels (1.4 KiB) and those under the kernels (0.2 KiB with 4 lobes); in the second the rows of the coarser
/// levels (1.4 KiB) and of bounds (1.7 KiB), and while these are packed some of them twice.
const BYTES_A_COLUMN: u64 = 4096;

/// And in the third, where light is traced: the shares of the rows that are traced together (1 KiB), rows of level 0 that
/// are not yet written, and while they are packed once more (2 KiB), those of the coarser levels (1.3 KiB) and those under
/// the kernels (0.3 KiB with 4 lobes).
const BYTES_A_COLUMN_WITH_LIGHT: u64 = 5632;

/// And in the fourth, where light over a day is: the times of the rows that are traced together (2.5 KiB) and of those
/// about what is filtered (1 KiB), rows of level 0 that are not yet written (2.7 KiB), those of the coarser levels
/// (2.8 KiB) and those under the kernels (0.8 KiB with 4 lobes). Over 32768 columns with voids the whole process took
/// 408 MiB, of which 120 depend on no column.
const BYTES_A_COLUMN_WITH_DAY: u64 = 10_240;

/// Bytes a tile of level 0 takes: its place in the file and its checks, twice, and those of the tiles above it; with light
/// its crests too (256).
const BYTES_A_TILE: u64 = 64;
const BYTES_A_TILE_WITH_LIGHT: u64 = 320;

/// What does not depend on the DEM: the program, and tiles being compressed; with light the crossings of its rays with
/// cell edges (25 MiB), the terrain that blocks look at, and the tiles that are kept at least.
const FIXED_BYTES: u64 = 64 << 20;
const FIXED_BYTES_WITH_LIGHT: u64 = 120 << 20;

/// Decoded tiles that are kept while light is traced, at least.
const LEAST_CACHE_BYTES: u64 = 16 << 20;

/// Rows of blocks that are traced at once at most: so many times less often are far tiles read, and with more the tasks of
/// two threads end too far apart.
const MOST_BLOCK_ROWS: u64 = 4;

/// The memory that the pyramid of a DEM of `grid` takes where it is held whole, in bytes.
pub fn needed_bytes(grid: &Grid, light: bool) -> u64 {
    (grid.size.samples() as u64)
        .saturating_mul(if light {
            BYTES_A_SAMPLE_WITH_LIGHT
        } else {
            BYTES_A_SAMPLE
        })
        .saturating_add(FIXED_BYTES)
}

/// The memory that preprocessing a DEM of `grid` takes, in bytes, with light and with that of a day, where its source holds
/// `held_bytes`: whatever its height but for some bytes a tile.
pub fn preprocess_bytes(grid: &Grid, light: bool, day: bool, held_bytes: u64) -> u64 {
    let a_column = match (light, day) {
        (_, true) => BYTES_A_COLUMN_WITH_DAY,
        (true, _) => BYTES_A_COLUMN_WITH_LIGHT,
        _ => BYTES_A_COLUMN,
    };
    let (a_tile, fixed) = if light || day {
        (BYTES_A_TILE_WITH_LIGHT, FIXED_BYTES_WITH_LIGHT)
    } else {
        (BYTES_A_TILE, FIXED_BYTES)
    };
    let tiles = grid.size.samples() as u64 / (TILE * TILE) as u64;
    (grid.size.width as u64)
        .saturating_mul(a_column)
        .saturating_add(tiles * a_tile)
        .saturating_add(fixed)
        .saturating_add(held_bytes)
}

/// What tracing light over a DEM of `grid` takes beside what it needs at least, where `left_bytes` of the ceiling are left:
/// the rows that are traced at once, and the bytes of decoded tiles that are kept. Where not all tiles can be, the rows are
/// up to [`MOST_BLOCK_ROWS`] of blocks, for up to a third of what is left.
pub(super) fn light_room(grid: &Grid, day: bool, left_bytes: u64) -> (i64, usize) {
    // Memory of tiles that are let go is not all of use for others at once.
    let cache_bytes = |left: u64| LEAST_CACHE_BYTES + left / 2;
    let a_sample = if day {
        size_of::<LitTimes>()
    } else {
        2 * size_of::<f32>()
    };
    let block_row_bytes = grid.size.width as u64 * (ROWS * a_sample) as u64;
    let more = if decoded_bytes(grid) <= cache_bytes(left_bytes) {
        0
    } else {
        (left_bytes / 3 / block_row_bytes).min(MOST_BLOCK_ROWS - 1)
    };
    let cache_bytes = cache_bytes(left_bytes - more * block_row_bytes);
    (
        (1 + more as i64) * ROWS as i64,
        usize::try_from(cache_bytes).unwrap_or(usize::MAX),
    )
}

/// The bytes of the heights of all levels of a DEM of `grid` as tiles that are kept, and a little more.
pub(super) fn decoded_bytes(grid: &Grid) -> u64 {
    (grid.size.samples() as u64)
        .saturating_mul(6)
        .saturating_add(1 << 20)
}

/// Refuses a DEM called `name` whose grid is impossible, or of which something needs more than `ceiling_bytes`.
pub(super) fn check(
    name: &str,
    grid: &Grid,
    needed: impl Fn(&Grid) -> u64,
    ceiling_bytes: u64,
    advice: &str,
) -> Result<()> {
    grid.check()
        .map_err(|what| Error::new(ErrorKind::Misuse, name, what))?;
    let needed = needed(grid);
    if needed <= ceiling_bytes {
        return Ok(());
    }
    let Size { width, height } = grid.size;
    let mib = |bytes: u64| bytes.div_ceil(1 << 20);
    let what = format!(
        "{width} x {height} samples need {} MiB of memory, {} MiB are allowed",
        mib(needed),
        ceiling_bytes >> 20
    );
    let advice = format!("allow {} MiB, {advice}", mib(needed));
    Err(Error::new(ErrorKind::Limit, name, what).advice(advice))
}

/// The most memory that this process has held at once, in bytes, where the system tells (Linux).
pub fn peak_rss_bytes() -> Option<u64> {
    parse_peak(&std::fs::read_to_string("/proc/self/status").ok()?)
}

/// The line `VmHWM:    1234 kB` of `/proc/self/status` (proc(5)).
fn parse_peak(status: &str) -> Option<u64> {
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kib.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dem_above_the_ceiling_is_refused_with_the_number_it_needs() {
        let grid = Grid::new(13201, 13201, [1.0, 1.0]);
        let with = |light| move |grid: &Grid| preprocess_bytes(grid, light, false, 0);
        let needed = preprocess_bytes(&grid, true, false, 0);
        assert!(check("a.tif", &grid, with(true), needed, "or cut it").is_ok());
        let error = check("a.tif", &grid, with(true), needed - 1, "or cut it").unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Limit);
        let number = format!("{} MiB", needed.div_ceil(1 << 20));
        assert!(error.to_string().contains(&number), "{error}");
        assert!(preprocess_bytes(&grid, false, false, 0) < needed);
        assert!(preprocess_bytes(&grid, true, true, 0) > needed);
        let most = Grid::new(1 << 30, 1 << 30, [1.0, 1.0]);
        assert_eq!(needed_bytes(&most, true), u64::MAX, "more than can be counted");
        assert!(
            check(
                "a.tif",
                &most,
                |grid| needed_bytes(grid, true),
                u64::MAX - 1,
                "or cut it"
            )
            .is_err()
        );
        let none = Grid::new(i64::MAX, i64::MAX, [1.0, 1.0]);
        assert_eq!(
            check("a.tif", &none, with(true), u64::MAX, "or cut it")
                .unwrap_err()
                .kind(),
            ErrorKind::Misuse
        );
    }

    #[test]
    fn what_is_left_goes_to_rows_and_tiles_and_is_not_spent_twice() {
        let rows = ROWS as i64;
        for (width, height, day, left, want) in [
            // Nothing is left; all tiles are kept; some for rows; as many rows as are of use.
            (16_384, 16_384, false, 0, rows),
            (4_096, 4_096, false, 370 << 20, rows),
            (32_768, 32_768, false, 128 << 20, 2 * rows),
            (16_384, 16_384, false, 262 << 20, 4 * rows),
            (16_384, 16_384, true, 190 << 20, 2 * rows),
        ] {
            let grid = Grid::new(width, height, [1.0, 1.0]);
            let (traced, cache) = light_room(&grid, day, left);
            assert_eq!(traced, want, "{width} x {height}, {left}");
            let a_row = if day { size_of::<LitTimes>() } else { 8 } as i64 * width;
            let spent = ((traced - rows) * a_row) as u64 + cache as u64 - LEAST_CACHE_BYTES;
            assert!(spent <= left, "{spent} of {left}");
        }
    }

    #[test]
    fn the_height_of_a_dem_costs_next_to_nothing() {
        for (light, day, a_tile, fixed, a_column) in [
            (false, false, 64, 64 << 20, 4096),
            (true, false, 320, 120 << 20, 5632),
            (true, true, 320, 120 << 20, 10_240),
        ] {
            let of = |width, height| preprocess_bytes(&Grid::new(width, height, [1.0, 1.0]), light, day, 7);
            assert_eq!(of(1000, 1 << 20) - of(1000, 1), (1000 << 20) / 65_536 * a_tile);
            assert_eq!(of(65_536, 1), fixed + 65_536 * a_column + a_tile + 7);
            assert!(of(if day { 32_768 } else { 65_536 }, 32_768) < 512 << 20);
            assert!(of(32_768, 1 << 17) < 512 << 20);
        }
    }

    #[test]
    fn the_peak_is_read_where_the_system_tells() {
        assert_eq!(
            parse_peak("Name:\tx\nVmHWM:\t    1234 kB\nVmRSS:\t 1 kB\n"),
            Some(1234 * 1024)
        );
        assert_eq!(parse_peak("VmRSS:\t 1 kB\n"), None);
        assert_eq!(parse_peak("VmHWM:\t many kB\n"), None);
    }
}
