//! Fills what is not known outward from what is, so that no sentinel is ever in a light texture.

use crate::grid::Size;

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
            let filled = |rows: std::ops::Range<i64>| {
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
