//! A stage of rays: its crossings outward, joined into runs of few cells, those into longer ones, as a tree laid out
//! so that a walk over it goes forward only.

use crate::grid::Rect;

/// Cells of a stage along the axis that the ray runs along.
pub(super) const STAGE: i64 = 256;

/// Cells of a run along that axis, longest runs first: they begin at each multiple of them.
pub(super) const SPANS: [i64; 3] = [64, 16, 4];

/// The row stride of what the ends of crossings are offsets in: one of the longest runs as all samples of a block see
/// it fits.
pub(super) const STRIDE: usize = 352;

/// The crossings of a stage.
#[derive(Default)]
pub(super) struct Stage {
    pub(super) crossings: Vec<Crossing>,
    /// Runs, each before those it is made of.
    pub(super) runs: Vec<Run>,
    /// Where each of the longest of them is, outward.
    pub(super) longest: Vec<u32>,
    /// While it is made: where each crossing lies.
    pub(super) places: Vec<Place>,
}

/// A crossing: height = that of end `a` + `weight` (that of end `b` - that of end `a`).
pub(super) struct Crossing {
    /// The ends, as offsets from the rays' own sample among samples whose rows are [`STRIDE`] apart.
    pub(super) a: i64,
    pub(super) b: i64,
    pub(super) weight: f32,
    /// One over the distance in metres.
    pub(super) per_m: f32,
    /// By how much the curved earth lowers the tangent.
    pub(super) drop: f32,
}

/// Where a crossing lies: in which cell of its stage along the rays' axis, and the samples at its ends.
pub(super) struct Place {
    pub(super) cell: i64,
    pub(super) ends: Rect,
}

/// The crossings of [`SPANS`]`[depth]` cells.
pub(super) struct Run {
    pub(super) depth: u8,
    /// Its crossings.
    pub(super) first: u32,
    pub(super) end: u32,
    /// The run that follows where this one is left out.
    pub(super) next: u32,
    /// The samples at their ends and those over which it and its parts begin, relative to the rays' own.
    pub(super) hull: Rect,
    /// The sample over or beside which it begins, likewise.
    pub(super) begin: [i64; 2],
    /// One over the distance of its first crossing, in metres.
    pub(super) per_m: f32,
    /// By how much the earth's curve lowers its tangents at least, and the gain that is not sought.
    pub(super) drop: f32,
}

impl Stage {
    /// Joins its crossings, whose places are known, into runs; `begin` says over which sample, relative to the rays'
    /// own, they are in the beginning of a cell.
    pub(super) fn finish(&mut self, slack: f32, begin: impl Fn(i64) -> [i64; 2]) {
        for (crossing, Place { ends, .. }) in self.crossings.iter_mut().zip(&self.places) {
            let offset = |x: i64, z: i64| z * STRIDE as i64 + x;
            crossing.a = offset(ends.x0, ends.z0);
            crossing.b = offset(ends.x1 - 1, ends.z1 - 1);
        }
        self.runs.clear();
        let mut tree = Tree {
            crossings: &self.crossings,
            places: &self.places,
            slack,
            begin,
            runs: &mut self.runs,
        };
        tree.join(0, 0, self.places.len());
        self.longest.clear();
        let longest = (0..).zip(&self.runs).filter(|(_, run)| run.depth == 0);
        self.longest.extend(longest.map(|(at, _)| at));
    }
}

fn joined(a: Rect, b: Rect) -> Rect {
    Rect::new(a.x0.min(b.x0), a.z0.min(b.z0), a.x1.max(b.x1), a.z1.max(b.z1))
}

/// Runs in the making.
struct Tree<'a, Begin> {
    crossings: &'a [Crossing],
    places: &'a [Place],
    slack: f32,
    begin: Begin,
    runs: &'a mut Vec<Run>,
}

impl<Begin: Fn(i64) -> [i64; 2]> Tree<'_, Begin> {
    /// Joins crossings `first..end` into runs of `SPANS[depth]` cells; what they hold together.
    fn join(&mut self, depth: usize, first: usize, end: usize) -> Rect {
        let number = |at: usize| self.places[at].cell / SPANS[depth];
        let mut whole: Option<Rect> = None;
        let mut from = first;
        while from < end {
            let number_here = number(from);
            let to = (from..end).find(|&at| number(at) != number_here).unwrap_or(end);
            let begin = (self.begin)(number_here * SPANS[depth]);
            let at = self.runs.len();
            self.runs.push(Run {
                depth: depth as u8,
                first: from as u32,
                end: to as u32,
                next: 0,
                hull: Rect::EMPTY,
                begin,
                per_m: self.crossings[from].per_m,
                drop: self.crossings[from].drop + self.slack,
            });
            let mut hull = Rect::new(begin[0], begin[1], begin[0] + 1, begin[1] + 1);
            if depth + 1 < SPANS.len() {
                hull = joined(hull, self.join(depth + 1, from, to));
            } else {
                let places = &self.places[from..to];
                hull = places.iter().fold(hull, |hull, place| joined(hull, place.ends));
            }
            self.runs[at].hull = hull;
            self.runs[at].next = self.runs.len() as u32;
            whole = Some(whole.map_or(hull, |whole| joined(whole, hull)));
            from = to;
        }
        whole.unwrap_or(Rect::EMPTY)
    }
}
