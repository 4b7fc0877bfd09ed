//! What rays of one azimuth pass over: for each run of cells the samples that may be ends of its crossings, wherever
//! within a cell it begins.
//!
//! In columns U along the rays' axis and rows V along the other, both counted forward, a ray passes V = m U, m from 0
//! to 1; a run from U on begins over the sample (U, floor(m U)), so with V at a fraction f from 0 to 1 above it. The
//! cells between columns j and j + 1 of it are left by V at f + m (j + 1): so the ends of what is crossed there lie in
//! rows floor(m j) to ceil(m (j + 1)) + 1. A longer run is made of shorter ones, the one from column j on floor(m j)
//! or ceil(m j) rows farther.
//!
//! The greatest height over such a strip, for every sample that a run may begin over, is what bounds the run: thin,
//! and along the ray, where a square that holds the run takes in what lies far beside it.

use std::collections::BTreeSet;

use super::relief::{LANES, greater};
use super::stage::SPANS;
use crate::grid::Rect;

/// Samples along a side of the squares that strips of longer runs are made of.
pub(super) const SQUARE: usize = 4;

/// Columns up to which positions on rays are known to far less than what is taken for a hit of a sample.
const SURE: i64 = 1 << 20;

/// East and south.
type Offset = [i64; 2];

/// See above.
#[derive(Default)]
pub(super) struct Strips {
    along: usize,
    lean: f64,
    signs: [i64; 2],
    /// To the next sample across the rays, none where they run along their axis.
    pub(super) pair: Offset,
    /// Of a shortest run, in samples, of which each stands for that and the next across.
    pub(super) finest: Vec<Offset>,
    /// Of a middle one as [`LANES`] samples see it, in squares from that which holds the beginning of the first's.
    pub(super) middle: Vec<Offset>,
    /// Where the middle ones that a longest one is made of may begin, in samples from where that does.
    parts: Vec<Offset>,
    /// What a middle one reaches from where it begins, in samples.
    reach: Rect,
}

impl Strips {
    /// Those of rays along axis `along`, that pass `lean` cells along the other for each and go forward or back along
    /// both as `signs` say, over grids of `longest` cells.
    pub(super) fn new(along: usize, lean: f64, signs: [i64; 2], longest: i64) -> Self {
        let mut strips = Self {
            along,
            lean,
            signs,
            ..Self::default()
        };
        let spare = i64::from(longest > SURE);
        let across = i64::from(lean > 0.0);
        strips.pair = strips.turned(0, across);
        let [mut finest, mut pairs] = [BTreeSet::new(), BTreeSet::new()];
        for column in 0..=SPANS[2] {
            let [least, _] = strips.passed((column - 1).max(0)..=column);
            let [_, most] = strips.passed(column..=(column + 1).min(SPANS[2]));
            let (least, most) = (least - spare, most + across + spare);
            finest.extend((least..=most).map(|v| strips.turned(column, v)));
            let firsts = (least..=most).step_by(2).map(|v| v.min(most - across));
            pairs.extend(firsts.map(|v| strips.turned(column, v)));
        }
        let mut middle = BTreeSet::new();
        let parts = strips.parts(SPANS[1], SPANS[2], spare);
        for within in (0..SQUARE * SQUARE).map(|k| [k % SQUARE, k / SQUARE].map(|c| c as i64)) {
            for (part, offset) in parts.iter().flat_map(|p| finest.iter().map(move |o| (p, o))) {
                for lane in [0, LANES as i64 / 2, LANES as i64 - 1] {
                    let at = [0, 1].map(|c| within[c] + part[c] + offset[c]);
                    middle.insert([at[0] + lane, at[1]].map(|c| c.div_euclid(SQUARE as i64)));
                }
            }
        }
        for (part, offset) in parts.iter().flat_map(|p| finest.iter().map(move |o| (p, o))) {
            let [x, z] = [0, 1].map(|c| part[c] + offset[c]);
            strips.reach = Rect::new(
                strips.reach.x0.min(x),
                strips.reach.z0.min(z),
                strips.reach.x1.max(x + 1),
                strips.reach.z1.max(z + 1),
            );
        }
        strips.finest = pairs.into_iter().collect();
        strips.middle = middle.into_iter().collect();
        strips.parts = strips.parts(SPANS[0], SPANS[1], spare).into_iter().collect();
        strips
    }

    /// The sample over or beside which rays, that of the rays' own at (0, 0), are after so many cells.
    pub(super) fn begin(&self, cells: i64) -> Offset {
        self.turned(cells, (cells as f64 * self.lean).floor() as i64)
    }

    /// What one of the longest runs passes over that begins in `begin` for the first of [`LANES`] samples, as
    /// rectangles.
    pub(super) fn under(&self, begin: Rect) -> impl Iterator<Item = Rect> {
        self.parts.iter().map(move |[x, z]| {
            Rect::new(
                begin.x0 + x + self.reach.x0,
                begin.z0 + z + self.reach.z0,
                begin.x1 + x + self.reach.x1 + LANES as i64 - 1,
                begin.z1 + z + self.reach.z1,
            )
        })
    }

    /// The least and the greatest row that a run may be in between two of its columns.
    fn passed(&self, columns: std::ops::RangeInclusive<i64>) -> [i64; 2] {
        [
            (*columns.start() as f64 * self.lean).floor() as i64,
            (*columns.end() as f64 * self.lean).ceil() as i64,
        ]
    }

    /// Where runs of `span` cells begin that a longer one of `of` cells is made of.
    fn parts(&self, of: i64, span: i64, spare: i64) -> BTreeSet<Offset> {
        let mut parts = BTreeSet::new();
        for u in (0..of).step_by(span as usize) {
            let [least, most] = self.passed(u..=u);
            for v in least - spare..=most + spare {
                parts.insert(self.turned(u, v));
            }
        }
        parts
    }

    /// Column U and row V as they lie.
    fn turned(&self, u: i64, v: i64) -> Offset {
        let mut offset = [0; 2];
        offset[self.along] = self.signs[self.along] * u;
        offset[1 - self.along] = self.signs[1 - self.along] * v;
        offset
    }
}

/// Values that [`greatest_at`] makes at once.
const AT_ONCE: usize = 32;

/// The greatest of `values`, in rows `stride` apart of which `width` are looked at, at `offsets` from each; what lies
/// beyond them is not there.
pub(super) fn greatest_at(
    values: &[f32],
    stride: usize,
    width: usize,
    offsets: &[Offset],
    out: &mut Vec<f32>,
) {
    out.resize(values.len(), f32::NEG_INFINITY);
    let height = (values.len() / stride) as i64;
    let mut inside: Vec<&Offset> = Vec::new();
    for (z, out) in (0..).zip(out.chunks_exact_mut(stride)) {
        inside.clear();
        inside.extend(offsets.iter().filter(|[_, dz]| (0..height).contains(&(z + dz))));
        let row = z as usize * stride;
        for (at, out) in (0..).step_by(AT_ONCE).zip(out[..width].chunks_mut(AT_ONCE)) {
            let whole = out.len() == AT_ONCE
                && inside
                    .iter()
                    .all(|[x, _]| (0..=width as i64 - AT_ONCE as i64).contains(&(at + x)));
            let mut most = [f32::NEG_INFINITY; AT_ONCE];
            for [x, dz] in &inside {
                let first = (row as i64 + at + dz * stride as i64) + x;
                if whole {
                    let there = &values[first as usize..][..AT_ONCE];
                    most.iter_mut()
                        .zip(there)
                        .for_each(|(most, &h)| *most = greater(*most, h));
                } else {
                    for (l, most) in (0..).zip(&mut most[..out.len()]) {
                        if (0..width as i64).contains(&(at + l + x)) {
                            *most = greater(*most, values[(first + l) as usize]);
                        }
                    }
                }
            }
            out.copy_from_slice(&most[..out.len()]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;
    use crate::light::rays::Rays;
    use crate::light::stage::{Run, Stage};
    use crate::pyramid::random::Random;

    /// Whether all ends of the crossings of `run` of `stage` lie in its strip as `strips` have it.
    fn holds(strips: &Strips, stage: &Stage, run: &Run) -> bool {
        let places = &stage.places[run.first as usize..run.end as usize];
        let ends = places
            .iter()
            .flat_map(|p| [[p.ends.x0, p.ends.z0], [p.ends.x1 - 1, p.ends.z1 - 1]]);
        let lanes = 0..LANES as i64;
        match run.depth {
            0 => {
                let [x, z] = run.begin;
                let under: Vec<Rect> = strips.under(Rect::new(x, z, x + 1, z + 1)).collect();
                let within = |x, z| under.iter().any(|rect| rect.contains(x, z));
                ends.into_iter()
                    .all(|[x, z]| lanes.clone().all(|lane| within(x + lane, z)))
            }
            1 => ends.into_iter().all(|end| {
                let [x, z] = [0, 1].map(|c| end[c] - run.begin[c]);
                (0..SQUARE as i64).all(|west| {
                    (0..SQUARE as i64).all(|north| {
                        lanes.clone().all(|lane| {
                            let square = [west + x + lane, north + z].map(|c| c.div_euclid(SQUARE as i64));
                            strips.middle.contains(&square)
                        })
                    })
                })
            }),
            _ => ends.into_iter().all(|end| {
                let offset = [0, 1].map(|c| end[c] - run.begin[c]);
                let before = [0, 1].map(|c| offset[c] - strips.pair[c]);
                strips.finest.contains(&offset) || strips.finest.contains(&before)
            }),
        }
    }

    #[test]
    fn strips_hold_all_ends_of_what_is_crossed() {
        let mut random = Random::new(31);
        let mut missed = [0; 3];
        for k in 0..60 {
            let spacing = [[30.0, 30.0], [58.0, 27.0], [1.0, 1000.0], [22.0, 30.0]][k % 4];
            let grid = Grid::new(3000, 2000, spacing);
            let azimuth_deg = match k {
                0..32 => k as f64 / 4.0 * 45.0,
                _ => random.between(0.0, 360.0),
            };
            // None is kept, so that places are known.
            let rays = Rays::new(&grid, azimuth_deg, f64::INFINITY, 0.0, 1 << 20);
            let strips = rays.strips();
            let leaning = Strips::new(strips.along, strips.lean * 0.8 + 0.1, strips.signs, 3000);
            let mut room = Stage::default();
            for k in 0..rays.stages() {
                let stage = rays.stage(k, &mut room);
                for run in &stage.runs {
                    assert!(
                        holds(strips, stage, run),
                        "azimuth {azimuth_deg}, spacing {spacing:?}, stage {k}: {:?} from {:?}",
                        run.hull,
                        run.begin
                    );
                    missed[usize::from(run.depth)] += u32::from(!holds(&leaning, stage, run));
                }
            }
        }
        assert!(
            missed.iter().all(|&missed| missed > 100),
            "{missed:?}: strips of rays that lean otherwise must show"
        );
    }

    #[test]
    fn the_greatest_at_offsets_is_that_of_each_alone() {
        let mut random = Random::new(32);
        for _ in 0..100 {
            let (width, height) = (1 + random.below(90), 1 + random.below(20));
            let stride = width + random.below(5);
            let values = random.heights(stride * height, -1.0, 1.0, 0.2);
            let offsets: Vec<Offset> = (0..1 + random.below(9))
                .map(|_| [random.below(21) - 10, random.below(9) - 4])
                .collect();
            let mut got = Vec::new();
            greatest_at(&values, stride as usize, width as usize, &offsets, &mut got);
            for (x, z) in Rect::new(0, 0, width, height).cells() {
                let there = offsets.iter().filter_map(|[dx, dz]| {
                    let (x, z) = (x + dx, z + dz);
                    let on = Rect::new(0, 0, width, height).contains(x, z);
                    on.then(|| values[(z * stride + x) as usize])
                });
                let want = there.fold(f32::NEG_INFINITY, f32::max);
                assert_eq!(
                    got[(z * stride + x) as usize],
                    want,
                    "({x}, {z}) of {width} x {height}"
                );
            }
        }
    }
}
