//! [`light_levels`](super::light_levels) row by row: rows of level 0 go in from the north, rows of all levels come out as
//! soon as they are known, bit for bit the same.
//!
//! Light is void where heights are, on each level, and filtered by their rule, so that only what is lit weighs. Under
//! voids it is filled for whoever looks there from beside them, level by level, once it is rounded to f16.

use std::ops::Range;

use half::f16;
use half::slice::HalfFloatSliceExt;

use super::fill::{WAVES, fill_rows};
use crate::grid::{Grid, Size};
use crate::pyramid::{Filter, Halving};
use crate::work::{Work, each_chunk};

/// Rows below those that are asked for which must be known of a level: under voids light comes from them.
pub const LIGHT_ROWS_BESIDE: i64 = WAVES;

/// Light that is being filtered into all of [`Grid::file_levels`].
pub struct LightLevels {
    sun: Vec<Level>,
    /// None where the sky is whole everywhere, and its share 1 under voids too.
    sky: Option<Vec<Level>>,
}

/// One share on one level.
struct Level {
    size: Size,
    /// Makes the next level; none on the last.
    halving: Option<Halving>,
    /// The row that is held first, and the rows from there on; NaN at voids.
    first: i64,
    rows: Vec<f16>,
}

impl LightLevels {
    /// Light of `grid` of which nothing has been seen, to be filtered by `filter`; without `sky` that is whole.
    pub fn new(grid: &Grid, filter: &Filter, sky: bool) -> Self {
        let count = grid.file_levels();
        let levels = || {
            let level = |l| {
                let size = grid.level(l);
                Level {
                    size,
                    halving: (l + 1 < count).then(|| Halving::new(size, filter, None)),
                    first: 0,
                    rows: Vec::new(),
                }
            };
            (0..count).map(level).collect()
        };
        Self {
            sun: levels(),
            sky: sky.then(levels),
        }
    }

    /// Takes the next whole rows of level 0, NaN at voids; of the sky none where that is whole.
    pub fn take(&mut self, sun: &[f32], sky: &[f32], work: &dyn Work) {
        take(&mut self.sun, sun, work);
        if let Some(levels) = &mut self.sky {
            take(levels, sky, work);
        }
    }

    /// Rows `rows` of `level`, row by row, the sun's share and the sky's (none where that is whole); they are known as
    /// soon as [`LIGHT_ROWS_BESIDE`] more are, or all. Earlier ones are forgotten but for those beside them.
    pub fn give(&mut self, level: u32, rows: Range<i64>, work: &dyn Work) -> [Vec<f16>; 2] {
        let sky = self
            .sky
            .as_mut()
            .map(|levels| levels[level as usize].give(rows.clone(), work));
        [self.sun[level as usize].give(rows, work), sky.unwrap_or_default()]
    }

    /// The rows of `level`, from the north, that can be given.
    pub fn known(&self, level: u32) -> i64 {
        let Level {
            size, first, rows, ..
        } = &self.sun[level as usize];
        let put = first + rows.len() as i64 / size.width;
        if put == size.height {
            put
        } else {
            put - LIGHT_ROWS_BESIDE
        }
    }
}

/// Puts rows of a share on its finest level, and what comes to be known by them on the others.
fn take(levels: &mut [Level], rows: &[f32], work: &dyn Work) {
    let mut made: Option<Vec<f32>> = None;
    for level in levels {
        let rows = made.as_deref().unwrap_or(rows);
        level.put(rows, work);
        let mut next = Vec::new();
        if let Some(halving) = &mut level.halving {
            halving.take(rows, work, &mut next);
            // Voids stay NaN.
            next.iter_mut().for_each(|s| *s = s.clamp(0.0, 1.0));
        }
        made = Some(next);
    }
}

impl Level {
    fn put(&mut self, rows: &[f32], work: &dyn Work) {
        const CHUNK: usize = 1 << 16;
        let start = self.rows.len();
        self.rows.reserve_exact(rows.len());
        self.rows.resize(start + rows.len(), f16::NAN);
        each_chunk(work, &mut self.rows[start..], CHUNK, |chunk, out| {
            out.convert_from_f32_slice(&rows[chunk * CHUNK..][..out.len()]);
        });
    }

    fn give(&mut self, rows: Range<i64>, work: &dyn Work) -> Vec<f16> {
        let Size { width, .. } = self.size;
        let held = Size {
            width,
            height: self.rows.len() as i64 / width,
        };
        let at = |row: i64| ((row - self.first) * width) as usize;
        let mut given = self.rows[at(rows.start)..at(rows.end)].to_vec();
        if given.iter().any(|s| s.is_nan()) {
            let mut values = vec![0.0; given.len()];
            let wanted = rows.start - self.first..rows.end - self.first;
            fill_rows(held, |at| self.rows[at].to_f32(), wanted, &mut values, work);
            given.convert_from_f32_slice(&values);
        }
        let passed = (rows.end - WAVES).max(self.first);
        self.rows.drain(..at(passed));
        self.first = passed;
        given
    }
}

#[cfg(test)]
mod tests {
    use super::super::light_levels;
    use super::*;
    use crate::progress::Silent;
    use crate::pyramid::random::Random;
    use crate::work::Serial;

    #[test]
    fn rows_in_pieces_give_the_bits_of_the_whole() {
        for (seed, (width, height, voids)) in [
            (300, 700, 0.3),
            (70, 600, 0.97),
            (1, 1, 0.0),
            (1, 400, 0.1),
            (5, 3, 1.0),
        ]
        .into_iter()
        .enumerate()
        {
            let grid = Grid::new(width, height, [1.0, 1.0]);
            let filter = Filter::default();
            let random =
                |k, voids| Random::new(seed as u64 + k).heights(grid.size.samples(), 0.0, 1.0, voids);
            let heights = random(0, voids);
            let marked = |mut share: Vec<f32>| {
                share
                    .iter_mut()
                    .zip(&heights)
                    .filter(|(_, h)| h.is_nan())
                    .for_each(|(s, _)| *s = f32::NAN);
                share
            };
            let (sun, sky) = (marked(random(100, 0.0)), marked(random(200, 0.0)));
            for whole_sky in [false, true] {
                let sky_given = if whole_sky {
                    vec![1.0; sky.len()]
                } else {
                    sky.clone()
                };
                let want =
                    light_levels(&grid, &heights, sun.clone(), sky_given, &filter, &Serial, &Silent).unwrap();
                let mut levels = LightLevels::new(&grid, &filter, !whole_sky);
                let mut given: Vec<i64> = vec![0; want.len()];
                let mut taken = 0;
                while taken < height {
                    let until = (taken + 128).min(height);
                    let rows = (taken * width) as usize..(until * width) as usize;
                    levels.take(
                        &sun[rows.clone()],
                        if whole_sky { &[] } else { &sky[rows] },
                        &Serial,
                    );
                    taken = until;
                    for (l, given) in given.iter_mut().enumerate() {
                        let size = grid.level(l as u32);
                        // A kernel of 4 lobes reaches less than 16 of the level's steps.
                        let known = if taken == height {
                            size.height
                        } else {
                            (taken >> l) - 32
                        };
                        let until = (*given + 50).min(size.height);
                        if *given == size.height || known < until {
                            continue;
                        }
                        let [sun, sky] = levels.give(l as u32, *given..until, &Serial);
                        let want = &want[l][(*given * size.width) as usize..(until * size.width) as usize];
                        assert!(
                            sun.iter().eq(want.iter().map(|s| &s.sun)),
                            "{width} x {height}, level {l}"
                        );
                        if whole_sky {
                            assert!(sky.is_empty() && want.iter().all(|s| s.sky == f16::ONE));
                        } else {
                            assert!(
                                sky.iter().eq(want.iter().map(|s| &s.sky)),
                                "{width} x {height}, level {l}"
                            );
                        }
                        *given = until;
                    }
                }
                // What is left of each, now that all is known.
                for (l, given) in given.into_iter().enumerate() {
                    let size = grid.level(l as u32);
                    let [sun, _] = levels.give(l as u32, given..size.height, &Serial);
                    let want = &want[l][(given * size.width) as usize..];
                    assert!(
                        sun.iter().eq(want.iter().map(|s| &s.sun)),
                        "{width} x {height}, level {l}"
                    );
                }
            }
        }
    }
}
