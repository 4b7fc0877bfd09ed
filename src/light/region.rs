//! Heights of a rectangle, and the walk of rays over them.

use super::relief::{LANES, greater, lanes};
use super::sight::could_rise;
use super::stage::{Run, SPANS, STRIDE, Stage};
use super::strips::{SQUARE, Strips, greatest_at};

/// Heights for which measuring them for shortest runs takes as long as one group's walk without.
const MEASURED: usize = 128;

/// Heights of a rectangle, and the greatest of them over what runs pass over.
#[derive(Default)]
pub(super) struct Region {
    /// Rows [`STRIDE`] apart; NaN beyond the DEM.
    pub(super) heights: Vec<f32>,
    /// The greatest of each sample and the next across rays; over the strip of a shortest run, for each sample that it
    /// begins over.
    pairs: Vec<f32>,
    finest: Vec<f32>,
    /// Over squares, and over the strip of a middle run as [`LANES`] samples see it, for each square that it begins
    /// in; `wide` of them in a row.
    wide: usize,
    squares: Vec<f32>,
    middle: Vec<f32>,
    /// Whether the strips of shortest runs are known.
    fine: bool,
}

impl Region {
    /// Room for `rows` rows of heights.
    pub(super) fn room(&mut self, rows: usize) -> &mut [f32] {
        self.heights.resize(rows * STRIDE, f32::NAN);
        &mut self.heights
    }

    /// Measures its heights, of which `width` in a row count, for middle runs with `strips`.
    pub(super) fn measure(&mut self, width: usize, strips: &Strips) {
        debug_assert!(width <= STRIDE, "{width}");
        self.wide = width.div_ceil(SQUARE);
        self.squares.clear();
        let mut columns = [f32::NEG_INFINITY; STRIDE];
        for rows in self.heights.chunks(SQUARE * STRIDE) {
            columns.fill(f32::NEG_INFINITY);
            for row in rows.chunks(STRIDE) {
                let both = columns[..width].iter_mut().zip(row);
                both.for_each(|(most, &h)| *most = greater(*most, h));
            }
            let squares = columns[..self.wide * SQUARE].chunks_exact(SQUARE);
            self.squares
                .extend(squares.map(|c| greater(greater(c[0], c[1]), greater(c[2], c[3]))));
        }
        greatest_at(
            &self.squares,
            self.wide,
            self.wide,
            &strips.middle,
            &mut self.middle,
        );
    }

    /// And for shortest runs, where so many `groups` of samples walk that it pays.
    pub(super) fn measure_finely(&mut self, width: usize, strips: &Strips, groups: usize) {
        self.fine = groups * MEASURED > self.heights.len();
        if self.fine {
            let (pair, pairs) = (&[[0, 0], strips.pair], &mut self.pairs);
            greatest_at(&self.heights, STRIDE, width, pair, pairs);
            greatest_at(pairs, STRIDE, width, &strips.finest, &mut self.finest);
        }
    }

    /// Whether any part of run `longest` of `stage` could raise any of `tangents` over samples of heights `h`, of
    /// which the first lies (x, z) from the region's corner.
    pub(super) fn any_could_rise(
        &self,
        stage: &Stage,
        longest: u32,
        [x, z]: [i64; 2],
        h: &[f32; LANES],
        tangents: &[f32; LANES],
    ) -> bool {
        let mut at = longest as usize + 1;
        while at < stage.runs[longest as usize].next as usize {
            let run = &stage.runs[at];
            let begin = [x + run.begin[0], z + run.begin[1]].map(|c| c as usize);
            if self.could_rise(run, begin, h, tangents) {
                return true;
            }
            at = run.next as usize;
        }
        false
    }

    /// Whether a run that begins over (x, z) for the first of some samples of heights `h` could raise any of
    /// `tangents`.
    fn could_rise(&self, run: &Run, [x, z]: [usize; 2], h: &[f32; LANES], tangents: &[f32; LANES]) -> bool {
        if run.depth == 1 {
            let most = self.middle[z / SQUARE * self.wide + x / SQUARE];
            return could_rise(most, run.per_m, run.drop, h, tangents);
        }
        let most = lanes(&self.finest, z * STRIDE + x);
        (0..LANES).fold(false, |any, l| {
            any | ((most[l] - h[l]) * run.per_m - run.drop > tangents[l])
        })
    }

    /// Raises the tangents of samples of heights `h`, of which the first lies (x, z) from the region's corner, by the
    /// parts of run `longest` of `stage`. `likely` is that which is looked at first, if any, and becomes the one that
    /// raised any of them last.
    #[expect(clippy::too_many_arguments, reason = "all of a walk")]
    pub(super) fn walk(
        &self,
        stage: &Stage,
        longest: u32,
        [x, z]: [i64; 2],
        until: f32,
        h: &[f32; LANES],
        tangents: &mut [f32; LANES],
        likely: &mut usize,
    ) {
        let own = z * STRIDE as i64 + x;
        let first = *likely;
        if first < stage.runs.len() {
            self.look(stage, first, own, until, h, tangents);
        }
        let mut at = longest as usize + 1;
        while at < stage.runs[longest as usize].next as usize {
            let run = &stage.runs[at];
            let finest = usize::from(run.depth) + 1 == SPANS.len();
            if self.fine || !finest {
                let begin = [x + run.begin[0], z + run.begin[1]].map(|c| c as usize);
                if !self.could_rise(run, begin, h, tangents) {
                    at = run.next as usize;
                    continue;
                }
            }
            if finest && at != first && self.look(stage, at, own, until, h, tangents) {
                *likely = at;
            }
            at += 1;
        }
    }

    /// Raises tangents by the crossings of one run; whether it did.
    fn look(
        &self,
        stage: &Stage,
        run: usize,
        own: i64,
        until: f32,
        h: &[f32; LANES],
        tangents: &mut [f32; LANES],
    ) -> bool {
        let run = &stage.runs[run];
        let before = *tangents;
        for crossing in &stage.crossings[run.first as usize..run.end as usize] {
            let a = lanes(&self.heights, (own + crossing.a) as usize);
            let b = lanes(&self.heights, (own + crossing.b) as usize);
            for l in 0..LANES {
                let rise = (a[l] - h[l]) + crossing.weight * (b[l] - a[l]);
                // The second where an end is void.
                tangents[l] = greater(tangents[l], rise * crossing.per_m - crossing.drop);
            }
        }
        let raised = (0..LANES).fold(false, |any, l| any | (tangents[l] > before[l]));
        for tangent in tangents.iter_mut() {
            *tangent = if *tangent >= until {
                f32::INFINITY
            } else {
                *tangent
            };
        }
        raised
    }
}
