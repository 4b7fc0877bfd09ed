//! The day's levels row by row: what is known of samples of level 0 goes in from the north, rows of all levels come out as
//! soon as they are known.
//!
//! Under voids each value is filled outward on level 0, so that there are none on any level. Then a time, its mean square
//! and the squared slope are filtered like heights, and what is stored is made of these on each level.

use std::ops::Range;

use half::f16;

use super::{LEAST_SOFT, LitTimes, NEVER};
use crate::error::{Error, Result};
use crate::grid::{Grid, Size};
use crate::levels::DaySample;
use crate::light::check;
use crate::light::fill::{WAVES, fill_rows};
use crate::progress::Progress;
use crate::pyramid::{Filter, Halving};
use crate::work::{Work, each_chunk};

/// Rows that are filtered at once: few, as so many are held once more.
const BAND: i64 = 16;

/// Samples that are worked on at once.
const CHUNK: usize = 1 << 16;

/// The day's light of all of [`Grid::file_levels`] from that of level 0: see [`DayLevels`].
///
/// # Errors
/// [`crate::ErrorKind::Misuse`] where the grid is impossible or the length is not the grid's;
/// [`crate::ErrorKind::Cancelled`].
pub fn day_levels(
    grid: &Grid,
    traced: &[LitTimes],
    filter: &Filter,
    work: &dyn Work,
    progress: &dyn Progress,
) -> Result<Vec<Vec<DaySample>>> {
    check(grid, traced.len())?;
    progress.begin("day levels", grid.size.height as u64);
    let mut levels = DayLevels::new(grid, filter);
    for rows in traced.chunks((BAND * grid.size.width) as usize) {
        if progress.cancelled() {
            return Err(Error::cancelled("day"));
        }
        levels.take(rows, work);
        progress.advance((rows.len() as i64 / grid.size.width) as u64);
    }
    let sample = |&[first, first_soft, last, last_soft, slope]: &[f16; 5]| DaySample {
        first,
        first_soft,
        last,
        last_soft,
        slope,
        unused: f16::ZERO,
    };
    let all = |l: u32| levels.rows(l, 0..levels.known(l)).iter().map(sample).collect();
    Ok((0..grid.file_levels()).map(all).collect())
}

/// Light over a day that is being filtered into all of [`Grid::file_levels`].
pub struct DayLevels {
    size: Size,
    /// Rows of level 0 as they were traced from row `first` on, as far as voids may still be filled from them.
    traced: Vec<LitTimes>,
    first: i64,
    levels: Vec<Level>,
}

/// One level of a day.
struct Level {
    size: Size,
    /// Make the next level, a value each; none on the last.
    halvings: Option<[Halving; 5]>,
    /// The row that is held first, and the rows from there on: the values of a [`DaySample`].
    first: i64,
    rows: Vec<[f16; 5]>,
}

impl DayLevels {
    /// A day over `grid` of which nothing has been seen, to be filtered by `filter`.
    pub fn new(grid: &Grid, filter: &Filter) -> Self {
        let count = grid.file_levels();
        let level = |l| {
            let size = grid.level(l);
            let halving = |_| Halving::new(size, filter, None);
            Level {
                size,
                halvings: (l + 1 < count).then(|| [(); 5].map(halving)),
                first: 0,
                rows: Vec::new(),
            }
        };
        Self {
            size: grid.size,
            traced: Vec::new(),
            first: 0,
            levels: (0..count).map(level).collect(),
        }
    }

    /// Takes the next whole rows of level 0.
    pub fn take(&mut self, rows: &[LitTimes], work: &dyn Work) {
        let Size { width, height } = self.size;
        self.traced.reserve_exact(rows.len());
        self.traced.extend_from_slice(rows);
        let seen = self.first + self.traced.len() as i64 / width;
        loop {
            let from = self.levels[0].known();
            let until = if seen == height { height } else { seen - WAVES }.min(from + BAND);
            if until <= from {
                break;
            }
            let band = self.filled(from..until, work);
            self.filter(band, work);
            let passed = (until - WAVES).max(self.first);
            self.traced.drain(..((passed - self.first) * width) as usize);
            self.first = passed;
        }
    }

    /// Rows `rows` of level 0 value by value, filled under voids.
    fn filled(&self, rows: Range<i64>, work: &dyn Work) -> [Vec<f32>; 5] {
        let Size { width, .. } = self.size;
        let held = Size {
            width,
            height: self.traced.len() as i64 / width,
        };
        let wanted = rows.start - self.first..rows.end - self.first;
        std::array::from_fn(|field| {
            let mut values = vec![0.0; ((rows.end - rows.start) * width) as usize];
            let value = |at: usize| self.traced[at].fields()[field];
            fill_rows(held, value, wanted.clone(), &mut values, work);
            values
        })
    }

    /// Filters the next rows of level 0, value by value.
    fn filter(&mut self, mut fields: [Vec<f32>; 5], work: &dyn Work) {
        let [first, first_soft, last, last_soft, _] = &mut fields;
        for (times, softs) in [(first, first_soft), (last, last_soft)] {
            // From softness to mean square: what is filtered.
            each_chunk(work, softs, CHUNK, |chunk, softs| {
                for (soft, &time) in softs.iter_mut().zip(&times[chunk * CHUNK..]) {
                    *soft = time * time + 0.25 * *soft * *soft;
                }
            });
        }
        for level in &mut self.levels {
            level.put(&fields, work);
            if let Some(halvings) = &mut level.halvings {
                for (halving, field) in halvings.iter_mut().zip(&mut fields) {
                    let mut coarse = Vec::new();
                    halving.take(field, work, &mut coarse);
                    *field = coarse;
                }
            }
        }
    }

    /// The rows of `level` that are known, from the north.
    pub fn known(&self, level: u32) -> i64 {
        self.levels[level as usize].known()
    }

    /// Rows `rows` of `level`, which are known and not forgotten: the values of a [`DaySample`], row by row.
    pub fn rows(&self, level: u32, rows: Range<i64>) -> &[[f16; 5]] {
        let Level {
            size,
            first,
            rows: held,
            ..
        } = &self.levels[level as usize];
        let at = |row: i64| ((row - first) * size.width) as usize;
        &held[at(rows.start)..at(rows.end)]
    }

    /// Forgets the rows of `level` above `row`.
    pub fn forget(&mut self, level: u32, row: i64) {
        let level = &mut self.levels[level as usize];
        level
            .rows
            .drain(..((row - level.first) * level.size.width) as usize);
        level.first = row;
    }
}

impl Level {
    fn known(&self) -> i64 {
        self.first + self.rows.len() as i64 / self.size.width
    }

    /// Puts its next rows: means of a time, its square, another, its square, and of the squared slope.
    fn put(
        &mut self,
        [first, first_square, last, last_square, slope_square]: &[Vec<f32>; 5],
        work: &dyn Work,
    ) {
        let start = self.rows.len();
        self.rows.reserve_exact(first.len());
        self.rows.resize(start + first.len(), [f16::ZERO; 5]);
        each_chunk(work, &mut self.rows[start..], CHUNK, |chunk, samples| {
            for (k, sample) in (chunk * CHUNK..).zip(samples) {
                let time = |time: f32| time.clamp(-NEVER, NEVER);
                let soft = |time: f32, square: f32| {
                    let variance = square - time * time;
                    (2.0 * variance.max(0.0).sqrt()).clamp(LEAST_SOFT, NEVER)
                };
                *sample = [
                    time(first[k]),
                    soft(first[k], first_square[k]),
                    time(last[k]),
                    soft(last[k], last_square[k]),
                    slope_square[k].max(0.0).sqrt().min(6e4),
                ]
                .map(f16::from_f32);
            }
        });
    }
}
