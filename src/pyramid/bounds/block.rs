//! What a block of level 0 says of the bounds of every level: the part of them that its own samples decide.
//!
//! A sample on the sides of several patches counts for all of them, with the same number: where cells meet, the surface
//! is a sum of the same two products on either side, and exists on both or on neither (a corner without weight does not
//! count). So each sample is looked at once for each level, with the cell to its south-east, and the greatest of all
//! blocks' numbers is bit for bit what the plain version finds patch by patch.

use crate::grid::{Grid, PATCH, Rect, Size};

/// Levels up to this many samples of level 0 a step are measured column of cells by column of cells, others cell by cell:
/// what is long is then walked without a stop.
const SHORT_STEP: i64 = 16;

/// Whole rows of a level, from row `first` on.
#[derive(Clone, Copy)]
pub struct Rows<'a> {
    /// The level's size.
    pub size: Size,
    /// The first row held.
    pub first: i64,
    /// The rows held, one after another.
    pub heights: &'a [f32],
}

impl<'a> Rows<'a> {
    fn row(&self, j: i64) -> &'a [f32] {
        let width = self.size.width as usize;
        &self.heights[(j - self.first) as usize * width..][..width]
    }
}

/// The least and greatest height of a patch so far, and the greatest difference to the truth.
#[derive(Clone, Copy)]
pub(super) struct Own {
    pub(super) min: f32,
    pub(super) max: f32,
    pub(super) worst: f64,
}

impl Own {
    pub(super) const NONE: Self = Self {
        min: f32::INFINITY,
        max: f32::NEG_INFINITY,
        worst: 0.0,
    };

    pub(super) fn join(&mut self, other: Self) {
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
        self.worst = self.worst.max(other.worst);
    }
}

/// What a block says of the patches of a level that it touches.
pub struct Share {
    pub(super) level: u32,
    pub(super) patches: Rect,
    pub(super) own: Vec<Own>,
}

/// Measures `block` of level 0 of `grid`, whose samples are `truth`, row by row, for every level. Blocks must be disjoint
/// and cover level 0; `x0` and `z0` are multiples of 16. Of each level above 0, `levels` (from level 1 on) has
/// the rows over the block, and the next one to the south where there is one.
pub fn measure(grid: &Grid, block: Rect, truth: &[f32], levels: &[Rows<'_>]) -> Vec<Share> {
    let count = levels.len() as u32 + 1;
    let share = |level| {
        let patches = patches_of(grid, level, block);
        let mut share = Share {
            level,
            patches,
            own: vec![Own::NONE; patches.area() as usize],
        };
        let rect = samples_of(grid, level, block);
        let width = block.width() as usize;
        match level {
            0 => share.extremes(rect, |j| &truth[(j - block.z0) as usize * width..][..width]),
            _ => {
                let rows = levels[level as usize - 1];
                share.extremes(rect, |j| &rows.row(j)[rect.x0 as usize..rect.x1 as usize]);
                Lines::new(level, block, truth, rows).errors(&mut share);
            }
        }
        share
    };
    (0..count).map(share).collect()
}

/// The samples of a level over the block; those beyond the DEM's edge belong to its last blocks.
fn samples_of(grid: &Grid, level: u32, block: Rect) -> Rect {
    let size = grid.level(level);
    let up = |n: i64| (n + (1 << level) - 1) >> level;
    let end = |n: i64, all: i64, count: i64| if n == all { count } else { up(n) };
    Rect::new(
        up(block.x0),
        up(block.z0),
        end(block.x1, grid.size.width, size.width),
        end(block.z1, grid.size.height, size.height),
    )
}

/// The patches of a level that the block, or a sample of the level over it, touches.
fn patches_of(grid: &Grid, level: u32, block: Rect) -> Rect {
    let step = PATCH << level;
    let samples = samples_of(grid, level, block);
    let low = |n: i64| (n - 1).div_euclid(step);
    let high = |last: i64, end: i64| ((last - 1) / step).max((end - 1) / PATCH) + 1;
    Rect::new(
        low(block.x0),
        low(block.z0),
        high(block.x1, samples.x1),
        high(block.z1, samples.z1),
    )
    .intersection(grid.patches(level).rect())
}

impl Share {
    fn at(&mut self, a: i64, b: i64) -> &mut Own {
        &mut self.own[((b - self.patches.z0) * self.patches.width() + a - self.patches.x0) as usize]
    }

    /// Least and greatest of the samples in `rect` of the level; `row` has a row's columns of it.
    fn extremes<'r>(&mut self, rect: Rect, row: impl Fn(i64) -> &'r [f32]) {
        let width = rect.width() as usize;
        let (mut low, mut high) = (vec![0.0; width], vec![0.0; width]);
        for b in self.patches.z0..self.patches.z1 {
            low.fill(f32::INFINITY);
            high.fill(f32::NEG_INFINITY);
            for j in (b * PATCH).max(rect.z0)..((b + 1) * PATCH + 1).min(rect.z1) {
                for ((low, high), &h) in low.iter_mut().zip(&mut high).zip(row(j)) {
                    // No comparison with NaN holds.
                    *low = if h < *low { h } else { *low };
                    *high = if h > *high { h } else { *high };
                }
            }
            for a in self.patches.x0..self.patches.x1 {
                let from = ((a * PATCH).max(rect.x0) - rect.x0) as usize;
                let to = (((a + 1) * PATCH + 1).min(rect.x1) - rect.x0).max(0) as usize;
                let columns = from.min(to)..to;
                let own = self.at(a, b);
                own.min = low[columns.clone()].iter().fold(own.min, |m, h| m.min(*h));
                own.max = high[columns].iter().fold(own.max, |m, h| m.max(*h));
            }
        }
    }
}

/// A level over a block, row of level 0 by row.
struct Lines<'a> {
    level: u32,
    /// Samples of level 0 to a step, as a number of them and as a factor.
    step: i64,
    scale: f64,
    block: Rect,
    truth: &'a [f32],
    rows: Rows<'a>,
    /// Cells of the level over the block's columns.
    cells: std::ops::Range<i64>,
    /// The row of the level whose corners are loaded, and those of the next, NaN beyond its edge, in f64 too.
    loaded: i64,
    north: Vec<f32>,
    south: Vec<f32>,
    wide: [Vec<f64>; 2],
    /// Cells with a void corner, by their place in `cells`.
    broken: Vec<usize>,
    /// Of each cell the greatest difference so far in the rows of a patch, and that on its west side, times the step.
    best: Vec<f64>,
    west: Vec<f64>,
}

fn keep(most: &mut f64, difference: f64) {
    // No comparison with NaN holds.
    *most = if difference > *most { difference } else { *most };
}

impl<'a> Lines<'a> {
    fn new(level: u32, block: Rect, truth: &'a [f32], rows: Rows<'a>) -> Self {
        let cells = block.x0 >> level..((block.x1 - 1) >> level) + 1;
        let count = (cells.end - cells.start) as usize;
        Self {
            level,
            step: 1 << level,
            scale: (1i64 << level) as f64,
            block,
            truth,
            rows,
            cells,
            loaded: -1,
            north: vec![f32::NAN; count + 1],
            south: vec![f32::NAN; count + 1],
            wide: [vec![0.0; count + 1], vec![0.0; count + 1]],
            broken: Vec::new(),
            best: vec![0.0; count],
            west: vec![0.0; count],
        }
    }

    /// The greatest difference between the level and the truth for each patch.
    fn errors(mut self, share: &mut Share) {
        let patch = PATCH << self.level;
        for b in share.patches.z0..share.patches.z1 {
            self.best.fill(0.0);
            self.west.fill(0.0);
            for z in (b * patch).max(self.block.z0)..((b + 1) * patch + 1).min(self.block.z1) {
                self.row(z);
            }
            for a in share.patches.x0..share.patches.x1 {
                let place = |i: i64| (i.clamp(self.cells.start, self.cells.end) - self.cells.start) as usize;
                let inner = &self.best[place(a * PATCH)..place((a + 1) * PATCH)];
                let mut worst = inner.iter().fold(0.0, |m: f64, d| m.max(*d));
                if self.cells.contains(&((a + 1) * PATCH)) {
                    worst = worst.max(self.west[place((a + 1) * PATCH)]);
                }
                let own = share.at(a, b);
                own.worst = own.worst.max(worst / self.scale);
            }
        }
    }

    /// The corners of the cells south of row `j` of the level.
    fn load(&mut self, j: i64) {
        if self.loaded == j {
            return;
        }
        self.loaded = j;
        for (j, corners) in [(j, &mut self.north), (j + 1, &mut self.south)] {
            corners.fill(f32::NAN);
            if j < self.rows.size.height {
                let from = &self.rows.row(j)[self.cells.start as usize..];
                let count = from.len().min(corners.len());
                corners[..count].copy_from_slice(&from[..count]);
            }
        }
        for (wide, corners) in self.wide.iter_mut().zip([&self.north, &self.south]) {
            for (wide, h) in wide.iter_mut().zip(corners) {
                *wide = f64::from(*h);
            }
        }
        let mut broken = std::mem::take(&mut self.broken);
        broken.clear();
        broken.extend((0..self.best.len()).filter(|i| self.is_broken(*i)));
        self.broken = broken;
    }

    /// Whether a corner of cell number `i` is void, or beyond the edge.
    fn is_broken(&self, i: usize) -> bool {
        let [north, south] = &self.wide;
        (north[i] + north[i + 1] + south[i] + south[i + 1]).is_nan()
    }

    /// Looks at row `z` of level 0.
    fn row(&mut self, z: i64) {
        let (j, v) = (z >> self.level, z & (self.step - 1));
        self.load(j);
        let width = self.block.width();
        let truth = &self.truth[((z - self.block.z0) * width) as usize..][..width as usize];
        let whole = if self.step <= SHORT_STEP {
            let whole = width / self.step;
            match self.level {
                1 => self.short::<2>(truth, v as usize),
                2 => self.short::<4>(truth, v as usize),
                3 => self.short::<8>(truth, v as usize),
                _ => self.short::<16>(truth, v as usize),
            }
            whole as usize
        } else {
            for i in 0..self.best.len() {
                if !self.is_broken(i) {
                    self.long(truth, i, v);
                }
            }
            self.best.len()
        };
        // What is left: cells with voids, and one that the DEM's edge cuts.
        for n in 0..self.broken.len() {
            self.slow(truth, self.broken[n], v);
        }
        for i in whole..self.best.len() {
            self.slow(truth, i, v);
        }
        if 2 * v % self.step == 0 {
            self.targets(truth, v);
        }
    }

    /// Whole cells of `S` samples a side, all at once for each column of them. Where a corner is void the result may be
    /// NaN, which is not kept.
    fn short<const S: usize>(&mut self, truth: &[f32], v: usize) {
        let [north, south] = &self.wide;
        // In row 0 the southern corners have no weight; those of the north stand in for a row beyond the edge.
        let south = if v == 0 { north } else { south };
        let (scale, fv) = (self.scale, v as f64);
        let cells = truth.chunks_exact(S);
        let count = cells.len();
        let (nw, ne) = (&north[..count], &north[1..=count]);
        let (sw, se) = (&south[..count], &south[1..=count]);
        for u in 0..S {
            let fu = u as f64;
            let of = cells.clone().zip(nw).zip(ne).zip(sw).zip(se).zip(&mut self.best);
            if u < v {
                for (((((h, nw), _), sw), se), best) in of {
                    let surface = (scale - fv) * nw + (fv - fu) * sw + fu * se;
                    keep(best, (surface - scale * f64::from(h[u])).abs());
                }
            } else {
                for (((((h, nw), ne), _), se), best) in of {
                    let surface = (scale - fu) * nw + (fu - fv) * ne + fv * se;
                    keep(best, (surface - scale * f64::from(h[u])).abs());
                }
            }
        }
        // The west sides again, of the cells that begin a patch.
        let first = (-self.cells.start).rem_euclid(PATCH) as usize;
        for i in (first..count).step_by(PATCH as usize) {
            let surface = match v {
                0 => scale * nw[i],
                _ => (scale - fv) * nw[i] + fv * sw[i],
            };
            keep(
                &mut self.west[i],
                (surface - scale * f64::from(truth[i * S])).abs(),
            );
        }
    }

    /// The columns of level 0 over cell number `i` within the block, as they count in the cell and in the block.
    fn columns(&self, i: usize) -> (i64, std::ops::Range<usize>) {
        let x = (self.cells.start + i as i64) << self.level;
        let (from, to) = (x.max(self.block.x0), (x + self.step).min(self.block.x1));
        (
            from - x,
            (from - self.block.x0) as usize..(to - self.block.x0) as usize,
        )
    }

    /// A cell without a void.
    fn long(&mut self, truth: &[f32], i: usize, v: i64) {
        let [north, south] = &self.wide;
        let (nw, ne, sw, se) = (north[i], north[i + 1], south[i], south[i + 1]);
        let (u, columns) = self.columns(i);
        let truth = &truth[columns];
        let (scale, fv) = (self.scale, v as f64);
        let split = ((v - u).max(0) as usize).min(truth.len());
        let (south_west, north_east) = truth.split_at(split);
        let west = (scale - fv) * nw;
        let a = greatest(south_west, u as f64, scale, |u| west + (fv - u) * sw + u * se);
        let east = fv * se;
        let b = greatest(north_east, (u + split as i64) as f64, scale, |u| {
            (scale - u) * nw + (u - fv) * ne + east
        });
        keep(&mut self.best[i], a.max(b));
        if let (0, Some(h)) = (u, truth.first()) {
            let surface = west + fv * sw;
            keep(&mut self.west[i], (surface - scale * f64::from(*h)).abs());
        }
    }

    /// A cell of which corners may be void or beyond the edge: the surface is there where all that have weight are.
    fn slow(&mut self, truth: &[f32], i: usize, v: i64) {
        let [north, south] = &self.wide;
        let weighted = |weight: i64, corner: f64| if weight == 0 { 0.0 } else { weight as f64 * corner };
        let (first, columns) = self.columns(i);
        for (u, &h) in (first..).zip(&truth[columns]) {
            let middle = if u < v {
                weighted(v - u, south[i])
            } else {
                weighted(u - v, north[i + 1])
            };
            let surface =
                weighted(self.step - u.max(v), north[i]) + middle + weighted(u.min(v), south[i + 1]);
            let difference = (surface - self.scale * f64::from(h)).abs();
            keep(&mut self.best[i], difference);
            if u == 0 {
                keep(&mut self.west[i], difference);
            }
        }
    }

    /// The morph targets of the next finer level's vertices in a row that has some: as f32 rounds them.
    fn targets(&mut self, truth: &[f32], v: i64) {
        let half = self.step / 2;
        let (north, south) = (&self.north, if v == 0 { &self.north } else { &self.south });
        for i in 0..self.best.len() {
            let (first, columns) = self.columns(i);
            let off = |target: f32, h: f32| (f64::from(target) - f64::from(h)).abs() * self.scale;
            if first == 0 {
                let difference = off(0.5 * north[i] + 0.5 * south[i], truth[columns.start]);
                keep(&mut self.best[i], difference);
                keep(&mut self.west[i], difference);
            }
            let at = columns.start as i64 + half - first;
            if half >= first && at < columns.end as i64 {
                let difference = off(0.5 * north[i] + 0.5 * south[i + 1], truth[at as usize]);
                keep(&mut self.best[i], difference);
            }
        }
    }
}

/// The greatest `|surface(u) - scale h|` over samples from column `u` of a cell on.
fn greatest(truth: &[f32], u: f64, scale: f64, surface: impl Fn(f64) -> f64) -> f64 {
    const LANES: usize = 4;
    let mut most = [0.0; LANES];
    let mut columns: [f64; LANES] = std::array::from_fn(|lane| u + lane as f64);
    let parts = truth.chunks_exact(LANES);
    let rest = parts.remainder();
    for part in parts {
        for lane in 0..LANES {
            let difference = surface(columns[lane]) - scale * f64::from(part[lane]);
            keep(&mut most[lane], difference.abs());
            columns[lane] += LANES as f64;
        }
    }
    for (lane, h) in rest.iter().enumerate() {
        let difference = surface(columns[lane]) - scale * f64::from(*h);
        keep(&mut most[lane], difference.abs());
    }
    most.into_iter().fold(0.0, f64::max)
}
