//! What `info` says of a DEM's heights: the least and the greatest, voids, and values that look like undeclared no data.

use crate::error::{Error, Result};
use crate::grid::{Grid, Rect, Size};
use crate::levels::{Bounds, Levels};
use crate::progress::Progress;
use crate::terrain::TerrainFile;

/// Samples read at once, where rows are not longer.
const BAND_SAMPLES: i64 = 1 << 20;

/// Values that files use for no data, and heights of no land.
const SUSPECTS: [f64; 12] = [
    -9999.0,
    -99999.0,
    -999_999.0,
    9999.0,
    -32768.0,
    -32767.0,
    32767.0,
    65535.0,
    -2_147_483_648.0,
    2_147_483_647.0,
    // -3.4028234663852886e38, the least f32, and what programs write for it.
    f32::MIN as f64,
    -3.4e38,
];

/// Least and greatest height, less the grid's base, voids, and what may be meant as voids.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Heights {
    pub(super) range: Option<[f32; 2]>,
    pub(super) voids: Option<u64>,
    /// Values at either end of the range that look like undeclared no data, and how many samples have each.
    pub(super) suspects: Vec<(f64, u64)>,
}

/// Reads all heights, band by band.
pub(super) fn read_heights(
    name: &str,
    grid: &Grid,
    progress: &dyn Progress,
    read: impl Fn(Rect, &mut [f32]) -> Result<()>,
) -> Result<Heights> {
    let Size { width, height } = grid.size;
    let rows = (BAND_SAMPLES / width).clamp(1, height);
    let mut band = vec![0.0_f32; (rows * width) as usize];
    let (mut voids, mut range) = (0, None);
    let mut suspects = SUSPECTS.map(|value| ((value - grid.base_m) as f32, value, 0_u64));
    progress.begin("read", height as u64);
    for z in (0..height).step_by(rows as usize) {
        if progress.cancelled() {
            return Err(Error::cancelled(name));
        }
        let rect = Rect::new(0, z, width, (z + rows).min(height));
        let band = &mut band[..rect.area() as usize];
        read(rect, band)?;
        for &h in band.iter() {
            if h.is_nan() {
                voids += 1;
            } else {
                widen(&mut range, h, h);
            }
        }
        for (height, _, count) in &mut suspects {
            // Most bands hold none, which the range tells at once.
            if range.is_some_and(|[low, high]| low <= *height && *height <= high) {
                *count += band.iter().filter(|h| **h == *height).count() as u64;
            }
        }
        progress.advance(rect.height() as u64);
    }
    let at_an_end = |height: f32| range.is_some_and(|[low, high]| low == height || high == height);
    let found = suspects
        .into_iter()
        .filter(|(height, _, count)| *count > 0 && at_an_end(*height));
    Ok(Heights {
        range,
        voids: Some(voids),
        suspects: found.map(|(_, value, count)| (value, count)).collect(),
    })
}

/// The range from the bounds of level 0, a row of patches at a time; they do not tell voids.
pub(super) fn bounded_heights(file: &TerrainFile) -> Result<Heights> {
    let patches = file.grid().patches(0);
    let mut row = vec![Bounds::VOID; patches.width as usize];
    let mut range = None;
    for b in 0..patches.height {
        // As for heights: what is not there is an error.
        file.bounds(0, Rect::new(0, b, patches.width, b + 1), &mut row)
            .map(drop)?;
        row.iter()
            .filter(|bounds| !bounds.is_void())
            .for_each(|p| widen(&mut range, p.min, p.max));
    }
    Ok(Heights {
        range,
        ..Heights::default()
    })
}

fn widen(range: &mut Option<[f32; 2]>, min: f32, max: f32) {
    let [low, high] = range.unwrap_or([min, max]);
    *range = Some([low.min(min), high.max(max)]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::Silent;

    #[test]
    fn heights_are_gathered_over_bands_with_voids_apart() {
        let grid = Grid {
            base_m: 1000.0,
            ..Grid::new(1500, 1500, [1.0, 1.0])
        };
        let heights = read_heights("t", &grid, &Silent, |rect, out| {
            for ((x, z), h) in rect.cells().zip(out) {
                *h = match (x, z) {
                    (3, 1499) => -7.0,
                    (1499, 0) => 9.0,
                    (0, _) => f32::NAN,
                    _ => 0.5,
                };
            }
            Ok(())
        });
        let heights = heights.unwrap();
        let want = Heights {
            range: Some([-7.0, 9.0]),
            voids: Some(1500),
            suspects: Vec::new(),
        };
        assert_eq!(heights, want);
    }

    #[test]
    fn values_that_look_like_no_data_are_counted_at_the_ends_of_the_range_only() {
        let grid = Grid {
            base_m: 100.0,
            ..Grid::new(4, 3, [1.0, 1.0])
        };
        let of = |values: [f32; 4]| {
            let read = |rect: Rect, out: &mut [f32]| {
                for ((x, _), h) in rect.cells().zip(out) {
                    *h = values[x as usize] - 100.0;
                }
                Ok(())
            };
            read_heights("t", &grid, &Silent, read).unwrap().suspects
        };
        assert_eq!(of([1.0, 2.0, 3.0, 4.0]), []);
        assert_eq!(of([-9999.0, -9999.0, 3.0, 4.0]), [(-9999.0, 6)]);
        assert_eq!(of([-32768.0, 32767.0, 3.0, 4.0]), [(-32768.0, 3), (32767.0, 3)]);
        // Land above and below it: then it is a height.
        assert_eq!(of([9999.0, -9999.5, 10_001.0, 4.0]), []);
    }
}
