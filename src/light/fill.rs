//! Fills what is not known outward from what is, so that no sentinel is ever in a light texture.

use std::ops::Range;

use crate::grid::Size;
use crate::work::{Work, each_chunk, split_columns};

/// Waves that go outward: beyond them nothing is looked at, and what lies within as many rows and columns decides what
/// a sample becomes. What is drawn beside a void asks for two samples of light.
pub(super) const WAVES: i64 = 16;

/// Fills the NaN of `values`, a grid of `size` row by row: in 16 waves outward from the valid ones, each the mean of those
/// of its eight neighbours that were known before its wave. What none of them reaches becomes 1.
pub fn fill_voids(values: &mut [f32], size: Size) {
    let (width, height) = (size.width as usize, size.height as usize);
    let around = |at: usize| {
        let (x, z) = (at % width, at / width);
        let rows = z.saturating_sub(1)..(z + 2).min(height);
        rows.flat_map(move |z| (x.saturating_sub(1)..(x + 2).min(width)).map(move |x| z * width + x))
    };
    // A sample is queued when its first neighbour becomes known, so each is filled once.
    let mut queued = vec![false; values.len()];
    let mut wave: Vec<usize> = (0..values.len())
        .filter(|&at| values[at].is_nan() && around(at).any(|n| !values[n].is_nan()))
        .collect();
    wave.iter().for_each(|&at| queued[at] = true);
    for _ in 0..WAVES {
        let means: Vec<f32> = wave
            .iter()
            .map(|&at| {
                let known = around(at).map(|n| values[n]).filter(|v| !v.is_nan());
                let (sum, count) =
                    known.fold((0.0f64, 0u32), |(sum, count), v| (sum + f64::from(v), count + 1));
                (sum / f64::from(count)) as f32
            })
            .collect();
        for (&at, mean) in wave.iter().zip(means) {
            values[at] = mean;
        }
        let mut next = Vec::new();
        for &at in &wave {
            for n in around(at) {
                if values[n].is_nan() && !queued[n] {
                    queued[n] = true;
                    next.push(n);
                }
            }
        }
        wave = next;
    }
    values.iter_mut().filter(|v| v.is_nan()).for_each(|v| *v = 1.0);
}

/// Columns that [`fill_rows`] fills at once.
const STRIPE: usize = 1024;

/// [`fill_voids`] of rows `rows` of a grid of `size` whose values are `value`, into `out`, in stripes of columns: no value
/// depends on what lies beyond [`WAVES`] rows or columns, so that many beside the rows must be there, where there are any.
pub(super) fn fill_rows(
    size: Size,
    value: impl Fn(usize) -> f32 + Sync,
    rows: Range<i64>,
    out: &mut [f32],
    work: &dyn Work,
) {
    let Size { width, height } = size;
    let around = (rows.start - WAVES).max(0)..(rows.end + WAVES).min(height);
    let at = |x: i64, z: i64| (z * width + x) as usize;
    let mut stripes = split_columns(out, width as usize, STRIPE);
    each_chunk(work, &mut stripes, 1, |stripe, out| {
        let x0 = (stripe * STRIPE) as i64;
        let columns = x0..(x0 + STRIPE as i64).min(width);
        let mut void = false;
        for (out, z) in out[0].iter_mut().zip(rows.clone()) {
            for (out, x) in out.iter_mut().zip(columns.clone()) {
                *out = value(at(x, z));
                void |= out.is_nan();
            }
        }
        if !void {
            return;
        }
        let beside = (columns.start - WAVES).max(0)..(columns.end + WAVES).min(width);
        let cells = around.clone().flat_map(|z| beside.clone().map(move |x| at(x, z)));
        let mut values: Vec<f32> = cells.map(&value).collect();
        let wide = beside.end - beside.start;
        let height = around.end - around.start;
        fill_voids(&mut values, Size { width: wide, height });
        for (out, z) in out[0].iter_mut().zip(rows.clone()) {
            let from = ((z - around.start) * wide + columns.start - beside.start) as usize;
            out.copy_from_slice(&values[from..][..out.len()]);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pyramid::random::Random;

    const NAN: f32 = f32::NAN;

    #[test]
    fn voids_take_the_mean_of_known_neighbours_wave_by_wave() {
        let mut row = [0.2, NAN, NAN, NAN, 0.6];
        fill_voids(&mut row, Size { width: 5, height: 1 });
        assert_eq!(row, [0.2, 0.2, 0.4, 0.6, 0.6]);
        let mut square = [0.0, 1.0, 0.5, 0.5, NAN, 0.5, 0.25, 0.75, 0.5];
        fill_voids(&mut square, Size { width: 3, height: 3 });
        assert_eq!(square[4], 0.5);
        let mut none = [NAN; 6];
        fill_voids(&mut none, Size { width: 2, height: 3 });
        assert_eq!(none, [1.0; 6]);
        // The waves end.
        let mut long = [NAN; 40];
        long[0] = 0.25;
        fill_voids(&mut long, Size { width: 40, height: 1 });
        assert!(long[..17].iter().all(|&v| v == 0.25) && long[17..].iter().all(|&v| v == 1.0));
    }

    #[test]
    fn rows_depend_on_as_many_beside_them_as_there_are_waves() {
        let size = Size {
            width: 29,
            height: 90,
        };
        for (seed, share) in [(1, 0.5), (2, 0.95), (3, 0.995)] {
            let before = Random::new(seed).heights(size.samples(), 0.0, 1.0, share);
            let filled = |rows: Range<i64>| {
                let mut part = before[(rows.start * 29) as usize..(rows.end * 29) as usize].to_vec();
                let height = rows.end - rows.start;
                fill_voids(&mut part, Size { height, ..size });
                part
            };
            let whole = filled(0..90);
            let with =
                |beside: i64| filled(40 - beside..50 + beside)[(beside * 29) as usize..][..290].to_vec();
            assert_eq!(whole[40 * 29..50 * 29], with(WAVES), "seed {seed}");
            // A control, where voids are so many that the last wave goes out.
            assert!(seed < 3 || whole[40 * 29..50 * 29] != with(WAVES / 2));
        }
    }

    #[test]
    fn stripes_of_columns_are_filled_as_the_whole_is() {
        let size = Size {
            width: 2 * STRIPE as i64 + 5,
            height: 60,
        };
        for (seed, share) in [(1, 0.0), (2, 0.7), (3, 0.99), (4, 0.9995)] {
            let before = Random::new(seed).heights(size.samples(), 0.0, 1.0, share);
            let mut whole = before.clone();
            fill_voids(&mut whole, size);
            for rows in [0..60, 0..9, 20..33, 50..60] {
                let wanted = (rows.start * size.width) as usize..(rows.end * size.width) as usize;
                let mut out = vec![0.0; wanted.len()];
                fill_rows(size, |at| before[at], rows, &mut out, &crate::work::Serial);
                assert_eq!(out, whole[wanted], "seed {seed}");
            }
        }
    }

    #[test]
    fn known_values_stay_and_the_rest_lies_between_them() {
        let size = Size {
            width: 37,
            height: 23,
        };
        for seed in 0..20 {
            let before = Random::new(seed).heights(size.samples(), 0.25, 0.75, 0.9);
            // So many that no sample is farther from all of them than the waves go.
            let mut after = before.clone();
            fill_voids(&mut after, size);
            assert!(after.iter().all(|v| (0.25..=0.75).contains(v)), "seed {seed}");
            let kept = before.iter().zip(&after).all(|(b, a)| b.is_nan() || b == a);
            assert!(kept, "seed {seed}");
        }
    }
}
