//! Where rays of one azimuth cross the edges of triangles: the same, relative to their sample, for all samples.
//!
//! Along a ray from a sample the surface is linear between its crossings with columns, rows and the diagonals from
//! north-west to south-east. So a grid has one list of crossings for an azimuth: two ends, the share of the way
//! between them, the distance. Consecutive crossings are joined into runs of few cells, those into longer ones: a
//! tree, laid out so that a walk over it goes forward only.
//!
//! On an earth of radius R the ground at distance t lies lower by `t^2 / 2R`, and the tangent by `t / 2R`.

use crate::grid::{Grid, MAX_SIZE, Rect};

/// Cells that a run spans at most, longest runs first.
pub(super) const SPANS: [i64; 4] = [256, 64, 16, 4];

/// The part of a cell that counts as no part: a crossing this near to a sample passes through it.
const SNAP: f64 = 1e-9;

/// The horizontal unit vector of an azimuth in the world: east and south. Exact at multiples of 45 degrees up
/// to the rounding of the square root of 1/2.
pub(super) fn direction(azimuth_deg: f64) -> [f64; 2] {
    let turned = azimuth_deg.rem_euclid(360.0);
    let quarter = (turned / 90.0).round();
    let rest = turned - 90.0 * quarter;
    let (sin, cos) = if rest.abs() == 45.0 {
        (
            rest.signum() * std::f64::consts::FRAC_1_SQRT_2,
            std::f64::consts::FRAC_1_SQRT_2,
        )
    } else {
        rest.to_radians().sin_cos()
    };
    let (east, north) = match quarter as i64 % 4 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    };
    [east, -north]
}

/// The crossings of one azimuth, outward.
pub(super) struct Rays {
    pub(super) crossings: Vec<Crossing>,
    /// Runs, each before those it is made of.
    pub(super) runs: Vec<Run>,
    /// The number of leading crossings that stay on the grid, by the cells from the sample to its edge.
    on_grid: [Vec<u32>; 2],
    /// The last column and row.
    last: [i64; 2],
    /// Whether the rays run towards the last column, and the last row.
    forward: [bool; 2],
}

/// A crossing: height = that of end `a` + `weight` (that of end `b` - that of end `a`).
pub(super) struct Crossing {
    /// The ends, as offsets in the array of samples.
    pub(super) a: isize,
    pub(super) b: isize,
    pub(super) weight: f32,
    /// One over the distance in metres.
    pub(super) per_m: f32,
    /// By how much the curved earth lowers the tangent.
    pub(super) drop: f32,
}

/// Consecutive crossings whose ends lie within [`SPANS`]`[depth]` cells of the north-west corner of them all.
pub(super) struct Run {
    pub(super) depth: u8,
    /// Its crossings.
    pub(super) first: u32,
    pub(super) end: u32,
    /// The run that follows where this one is left out.
    pub(super) next: u32,
    /// That corner, relative to the sample.
    pub(super) corner: [i32; 2],
    /// One over the distance of its first crossing, in metres.
    pub(super) per_m: f32,
    /// By how much the earth's curve lowers its tangents at least, and the gain that is not sought.
    pub(super) drop: f32,
}

impl Rays {
    /// The rays at `azimuth_deg`, as far as `grid` reaches, on an earth of `radius_m` (infinite: flat). What could
    /// raise a tangent by no more than `slack` may be left out.
    pub(super) fn new(grid: &Grid, azimuth_deg: f64, radius_m: f64, slack: f64) -> Self {
        let [east, south] = direction(azimuth_deg);
        // Cells a metre.
        let (gx, gz) = (east / grid.spacing_m[0], south / grid.spacing_m[1]);
        let rates = [gx, gz, gx - gz]; // of crossing columns, rows, diagonals
        let last = [grid.size.width - 1, grid.size.height - 1];
        let mut next = [1i64; 3];
        let mut crossings = Vec::new();
        let mut boxes = Vec::new();
        // The greatest distance in cells from the sample to an end of any crossing so far.
        let mut reach = [0i64; 2];
        let mut reaches = [Vec::new(), Vec::new()];
        let mut last_sample = None;
        loop {
            let distance = |kind: usize| next[kind] as f64 / rates[kind].abs(); // infinite where never crossed
            let kind = (0..3).fold(0, |best, k| if distance(k) < distance(best) { k } else { best });
            let t = distance(kind);
            let line = if rates[kind] < 0.0 {
                -next[kind]
            } else {
                next[kind]
            };
            next[kind] += 1;
            let Some((at, weight)) = between(if kind == 0 { gz * t } else { gx * t }) else {
                break;
            };
            let on = i64::from(weight > 0.0);
            let (a, b) = match kind {
                0 => ([line, at], [line, at + on]),
                1 => ([at, line], [at + on, line]),
                // On a diagonal, column less row is its number.
                _ => ([at, at - line], [at + on, at - line + on]),
            };
            for axis in 0..2 {
                reach[axis] = reach[axis].max(a[axis].abs()).max(b[axis].abs());
            }
            if reach[0] > last[0] || reach[1] > last[1] {
                break;
            }
            // Three lines meet in a sample.
            if weight == 0.0 && last_sample == Some(a) {
                continue;
            }
            last_sample = (weight == 0.0).then_some(a);
            let offset = |end: [i64; 2]| (end[1] * grid.size.width + end[0]) as isize;
            crossings.push(Crossing {
                a: offset(a),
                b: offset(b),
                weight: weight as f32,
                per_m: (1.0 / t) as f32,
                drop: (0.5 * t / radius_m) as f32,
            });
            boxes.push(Rect::new(
                a[0].min(b[0]),
                a[1].min(b[1]),
                a[0].max(b[0]) + 1,
                a[1].max(b[1]) + 1,
            ));
            reaches[0].push(reach[0]);
            reaches[1].push(reach[1]);
        }
        let on_grid = [0, 1].map(|axis: usize| {
            (0..=last[axis])
                .map(|cells| reaches[axis].partition_point(|&r| r <= cells) as u32)
                .collect()
        });
        let mut tree = Tree {
            crossings: &crossings,
            boxes: &boxes,
            slack: slack as f32,
            runs: Vec::new(),
        };
        tree.join(0, 0, boxes.len());
        let runs = tree.runs;
        Self {
            crossings,
            runs,
            on_grid,
            last,
            forward: [gx > 0.0, gz > 0.0],
        }
    }

    /// The number of leading crossings that stay on the grid for each of `lanes` samples from (i, j) eastward.
    pub(super) fn on_grid(&self, i: usize, j: usize, lanes: usize) -> usize {
        let cells = |axis: usize, least: usize, most: usize| {
            if self.forward[axis] {
                self.last[axis] as usize - most
            } else {
                least
            }
        };
        let columns = self.on_grid[0][cells(0, i, i + lanes - 1)];
        columns.min(self.on_grid[1][cells(1, j, j)]) as usize
    }
}

/// Position `p`, in cells, as a sample and the share of the way to the next; none where there is no such sample.
fn between(p: f64) -> Option<(i64, f64)> {
    let nearest = p.round();
    if nearest.is_nan() || nearest.abs() >= MAX_SIZE as f64 {
        None
    } else if (p - nearest).abs() <= SNAP {
        Some((nearest as i64, 0.0))
    } else {
        Some((p.floor() as i64, p - p.floor()))
    }
}

/// Runs in the making.
struct Tree<'a> {
    crossings: &'a [Crossing],
    /// The samples at the ends of each crossing.
    boxes: &'a [Rect],
    slack: f32,
    runs: Vec<Run>,
}

impl Tree<'_> {
    /// Joins crossings `first..end` into runs of `SPANS[depth]` cells and less.
    fn join(&mut self, depth: usize, first: usize, end: usize) {
        let mut from = first;
        while from < end {
            let mut hull = self.boxes[from];
            let mut to = from + 1;
            while to < end {
                let ends = &self.boxes[to];
                let joined = Rect::new(
                    hull.x0.min(ends.x0),
                    hull.z0.min(ends.z0),
                    hull.x1.max(ends.x1),
                    hull.z1.max(ends.z1),
                );
                if joined.width() > SPANS[depth] + 1 || joined.height() > SPANS[depth] + 1 {
                    break;
                }
                hull = joined;
                to += 1;
            }
            let at = self.runs.len();
            self.runs.push(Run {
                depth: depth as u8,
                first: from as u32,
                end: to as u32,
                next: 0,
                corner: [hull.x0 as i32, hull.z0 as i32],
                per_m: self.crossings[from].per_m,
                drop: self.crossings[from].drop + self.slack,
            });
            if depth + 1 < SPANS.len() {
                self.join(depth + 1, from, to);
            }
            self.runs[at].next = self.runs.len() as u32;
            from = to;
        }
    }
}
