//! Bounds as they come to be known while level 0 is looked at from north to south: rows of patches that are finished,
//! of every level, and only those that something still asks for are held.

use std::collections::VecDeque;

use super::block::{Own, Share};
use super::{SLACK, round_up, saturate};
use crate::grid::{Grid, PATCH, Patch, Size};
use crate::levels::Bounds;

/// Bounds in the making.
pub struct BoundsRows {
    grid: Grid,
    levels: Vec<Level>,
}

/// Rows of patches of a level.
struct Level {
    patches: Size,
    /// What is known of the rows that are not finished, from the first such on.
    own: VecDeque<Vec<Own>>,
    /// Finished rows from row `first` on.
    made: VecDeque<Vec<Bounds>>,
    first: i64,
    /// Rows that have been handed out.
    taken: i64,
}

impl Level {
    /// One past the last finished row.
    fn next(&self) -> i64 {
        self.first + self.made.len() as i64
    }
}

impl BoundsRows {
    /// Bounds of `grid` of which nothing is known.
    pub fn new(grid: &Grid) -> Self {
        let level = |l| Level {
            patches: grid.patches(l),
            own: VecDeque::new(),
            made: VecDeque::new(),
            first: 0,
            taken: 0,
        };
        Self {
            grid: *grid,
            levels: (0..grid.file_levels()).map(level).collect(),
        }
    }

    /// Adds what a block says. Its rows must not be finished.
    pub fn add(&mut self, share: &Share) {
        let level = &mut self.levels[share.level as usize];
        let next = level.next();
        let width = share.patches.width() as usize;
        for (b, from) in (share.patches.z0..).zip(share.own.chunks_exact(width.max(1))) {
            let place = (b - next) as usize;
            while level.own.len() <= place {
                level.own.push_back(vec![Own::NONE; level.patches.width as usize]);
            }
            let row = &mut level.own[place][share.patches.x0 as usize..][..width];
            row.iter_mut().zip(from).for_each(|(own, more)| own.join(*more));
        }
    }

    /// Finishes what can be once all blocks over the first `seen` rows of level 0 have been added.
    pub fn advance(&mut self, seen: i64) {
        for l in 0..self.levels.len() {
            let (finer, coarser) = self.levels.split_at_mut(l);
            let (finer, level) = (finer.last(), &mut coarser[0]);
            while level.next() < level.patches.height {
                let b = level.next();
                let own_known = seen == self.grid.size.height || (PATCH * (b + 1)) << l < seen;
                let finer_known = finer.is_none_or(|f| f.next() >= (2 * b + 3).min(f.patches.height));
                if !own_known || !finer_known {
                    break;
                }
                let Some(own) = level.own.pop_front() else { break };
                let bounds = (0..).zip(&own).map(|(a, own)| {
                    let patch = Patch::new(l as u32, a, b);
                    let mut bounds = bounds(own, patch.level);
                    if let Some(finer) = finer {
                        saturate(patch, &mut bounds, finer.patches, |x, z| {
                            finer.made[(z - finer.first) as usize][x as usize]
                        });
                    }
                    bounds
                });
                level.made.push_back(bounds.collect());
            }
        }
        self.forget();
    }

    /// The bounds of rows of patches of a level, row by row: those that follow what was taken before, and are finished.
    pub fn take(&mut self, level: u32, rows: i64) -> Option<Vec<Bounds>> {
        let level = &mut self.levels[level as usize];
        let end = (level.taken + rows).min(level.patches.height);
        if end > level.next() {
            return None;
        }
        let from = (level.taken - level.first) as usize;
        let taken = level.made.range(from..from + (end - level.taken) as usize);
        let taken = taken.flatten().copied().collect();
        level.taken = end;
        self.forget();
        Some(taken)
    }

    /// Drops rows that were taken and that the next coarser level has no more use for.
    fn forget(&mut self) {
        for l in 0..self.levels.len() {
            let used = self
                .levels
                .get(l + 1)
                .map_or(i64::MAX, |coarser| 2 * coarser.next() - 1);
            let level = &mut self.levels[l];
            while level.first < level.taken.min(used) && level.made.pop_front().is_some() {
                level.first += 1;
            }
        }
    }
}

/// A patch's bounds, not yet saturated.
fn bounds(own: &Own, level: u32) -> Bounds {
    if own.min > own.max {
        return Bounds::VOID;
    }
    // As the plain version has it: see there.
    let (min, max) = (own.min + 0.0, own.max + 0.0);
    let level_height = if min < max {
        f64::from(min.abs().max(max.abs()))
    } else {
        0.0
    };
    let error = match level {
        0 => 0.0,
        _ => round_up(own.worst + SLACK * (level_height + own.worst)),
    };
    Bounds {
        min,
        max,
        error,
        need_min: min,
        need_max: max,
        need_error: error,
    }
}

#[cfg(test)]
mod tests {
    use super::super::block::{Rows, measure};
    use super::*;
    use crate::grid::Rect;
    use crate::progress::Silent;
    use crate::pyramid::random::Random;
    use crate::pyramid::{Filter, Pyramid};
    use crate::work::Serial;

    const BLOCK: i64 = 256;

    /// The bounds of all levels, block by block.
    fn streamed(made: &Pyramid, broken: bool) -> Vec<Vec<Bounds>> {
        use crate::levels::Levels;
        let grid = *made.grid();
        let mut rows = BoundsRows::new(&grid);
        let mut all: Vec<Vec<Bounds>> = vec![Vec::new(); made.level_count() as usize];
        let levels: Vec<Rows<'_>> = (1..made.level_count())
            .map(|l| Rows {
                size: grid.level(l),
                first: 0,
                heights: made.level(l),
            })
            .collect();
        let Size { width, height } = grid.size;
        for z0 in (0..height).step_by(BLOCK as usize) {
            let z1 = (z0 + BLOCK).min(height);
            for x0 in (0..width).step_by(BLOCK as usize) {
                let block = Rect::new(x0, z0, (x0 + BLOCK).min(width), z1);
                let mut truth: Vec<f32> = block
                    .cells()
                    .map(|(x, z)| made.level(0)[(z * width + x) as usize])
                    .collect();
                if broken {
                    // A control: the block's last sample is not looked at.
                    *truth.last_mut().unwrap() = f32::NAN;
                }
                measure(&grid, block, &truth, &levels)
                    .iter()
                    .for_each(|share| rows.add(share));
            }
            rows.advance(z1);
            for (l, all) in (0..).zip(&mut all) {
                while let Some(row) = rows.take(l, 3).filter(|row| !row.is_empty()) {
                    all.extend(row);
                }
            }
        }
        for (l, level) in rows.levels.iter_mut().enumerate() {
            assert_eq!(level.taken, level.next(), "level {l} is not whole");
        }
        all
    }

    fn bits(bounds: &[Bounds]) -> Vec<u32> {
        let fields: &[f32] = bytemuck::cast_slice(bounds);
        let one = |f: &f32| if f.is_nan() { f32::NAN } else { *f };
        fields.iter().map(|f| one(f).to_bits()).collect()
    }

    #[test]
    fn blocks_give_the_same_bits_as_the_whole() {
        let sizes = [
            (1, 1),
            (1, 900),
            (900, 1),
            (2, 2),
            (64, 65),
            (257, 513),
            (512, 300),
            (513, 257),
            (770, 1030),
            (1500, 20),
            (9, 5000),
        ];
        let mut controls = 0;
        for (seed, (width, height)) in sizes.into_iter().enumerate() {
            for (voids, look) in [(0.0, 0), (0.02, 0), (0.3, 1), (0.9, 1), (0.0, 2), (0.05, 3)] {
                let random = &mut Random::new(seed as u64 * 17 + look);
                let grid = Grid::new(width, height, [1.0, 1.0]);
                let cells = grid.size.rect().cells();
                let heights: Vec<f32> = cells
                    .map(|(x, z)| {
                        let smooth =
                            ((x as f32 / 30.0).sin() * 400.0 + (z as f32 / 17.0).cos() * 90.0).round();
                        let h = match look {
                            0 => smooth + 0.1 * random.unit() as f32,
                            1 => random.between(-500.0, 9000.0) as f32,
                            // Zeros of either sign, and level ground.
                            2 => [0.0, -0.0, 0.0][random.below(3) as usize],
                            _ => smooth,
                        };
                        if random.unit() < voids { f32::NAN } else { h }
                    })
                    .collect();
                let step = (look == 3).then_some(1.0);
                let filter = Filter::default();
                let mut made = Pyramid::new(grid, heights, step, &filter, &Serial, &Silent).unwrap();
                made.bound(&Serial, &Silent).unwrap();
                let (got, broken) = (streamed(&made, false), streamed(&made, true));
                for (l, got) in got.iter().enumerate() {
                    let case = format!("{width} x {height}, look {look}, voids {voids}, level {l}");
                    assert_eq!(got.len(), made.level_bounds(l as u32).len(), "{case}");
                    let want = made.level_bounds(l as u32);
                    let differs = (0..want.len()).find(|n| bits(&got[*n..=*n]) != bits(&want[*n..=*n]));
                    let differs = differs.map(|n| (n, got[n], want[n]));
                    assert!(differs.is_none(), "{case}: {differs:?}");
                    controls += usize::from(bits(&broken[l]) != bits(got));
                }
            }
        }
        assert!(controls > 50, "the control was caught {controls} times");
    }
}
