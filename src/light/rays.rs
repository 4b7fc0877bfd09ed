//! Where rays of one azimuth cross the edges of triangles: the same, relative to their sample, for all samples.
//!
//! Along a ray from a sample the surface is linear between its crossings with columns, rows and the diagonals from
//! north-west to south-east. So a grid has one list of crossings for an azimuth: two ends, the share of the way
//! between them, the distance. They come in stages of as many cells along the axis that the ray runs along.
//!
//! On an earth of radius R the ground at distance t lies lower by `t^2 / 2R`, and the tangent by `t / 2R`.

use super::stage::{Crossing, Place, STAGE, Stage};
use super::strips::Strips;
use crate::grid::{Grid, MAX_SIZE, Rect};

/// Stages that the rays of one light keep in all directions together; those farther out are made anew by whoever needs
/// them. One takes some 33 KiB.
const KEPT: u32 = 768;

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

/// The rays of one azimuth.
pub(super) struct Rays {
    /// Columns, rows and diagonals crossed a metre, negative where their numbers fall.
    rates: [f64; 3],
    /// The axis along which it crosses more of columns and rows: 0 or 1.
    along: usize,
    radius_m: f64,
    slack: f32,
    /// Stages until the DEM ends for every sample.
    stages: i64,
    kept: Vec<Stage>,
    /// What their runs pass over.
    strips: Strips,
}

impl Rays {
    /// The rays at `azimuth_deg`, as far as `grid` reaches, on an earth of `radius_m` (infinite: flat). What could
    /// raise a tangent by no more than `slack` may be left out. They are those of one of `directions`.
    pub(super) fn new(grid: &Grid, azimuth_deg: f64, radius_m: f64, slack: f64, directions: u32) -> Self {
        let [east, south] = direction(azimuth_deg);
        let (gx, gz) = (east / grid.spacing_m[0], south / grid.spacing_m[1]);
        let along = usize::from(gz.abs() > gx.abs());
        let longest = [grid.size.width, grid.size.height][along] - 1;
        let mut rays = Self {
            rates: [gx, gz, gx - gz],
            along,
            radius_m,
            slack: slack as f32,
            stages: (longest + STAGE - 1) / STAGE,
            kept: Vec::new(),
            strips: Strips::default(),
        };
        let signs = [gx, gz].map(|rate| if rate < 0.0 { -1 } else { 1 });
        rays.strips = Strips::new(along, rays.lean(), signs, longest);
        for k in 0..rays.stages.min((KEPT / directions).into()) {
            let mut stage = Stage::default();
            rays.cross(k, &mut stage);
            stage.places = Vec::new();
            stage.crossings.shrink_to_fit();
            stage.runs.shrink_to_fit();
            rays.kept.push(stage);
        }
        rays
    }

    /// The number of stages that any ray of the DEM has.
    pub(super) fn stages(&self) -> i64 {
        self.stages
    }

    /// Stage `k`, counted outward from 0, perhaps made in `room`.
    pub(super) fn stage<'a>(&'a self, k: i64, room: &'a mut Stage) -> &'a Stage {
        if let Some(kept) = self.kept.get(k as usize) {
            return kept;
        }
        self.cross(k, room);
        room
    }

    /// What their runs pass over.
    pub(super) fn strips(&self) -> &Strips {
        &self.strips
    }

    /// By how many cells a ray passes on along the other axis for each along its own, 0 to 1.
    fn lean(&self) -> f64 {
        (self.rates[1 - self.along] / self.rates[self.along]).abs()
    }

    /// As of a run that holds stage `k`, above 0, and all beyond.
    pub(super) fn beyond(&self, k: i64) -> (f32, f32) {
        let t = (k * STAGE) as f64 / self.rates[self.along].abs();
        let drop = (0.5 * t / self.radius_m) as f32;
        ((1.0 / t) as f32, drop + self.slack)
    }

    /// All samples that rays of `block` meet in stage `k`.
    pub(super) fn swept(&self, k: i64, block: Rect) -> Rect {
        let ends = [k, k + 1].map(|k| {
            [0, 1].map(|axis: usize| {
                let cells = (k * STAGE) as f64 * self.rates[axis] / self.rates[self.along].abs();
                cells.clamp(-(2.0 * MAX_SIZE as f64), 2.0 * MAX_SIZE as f64) as i64
            })
        });
        let least = [0, 1].map(|axis: usize| ends[0][axis].min(ends[1][axis]) - 2);
        let most = [0, 1].map(|axis: usize| ends[0][axis].max(ends[1][axis]) + 2);
        Rect::new(
            block.x0 + least[0],
            block.z0 + least[1],
            block.x1 + most[0],
            block.z1 + most[1],
        )
    }

    /// Puts the crossings of stage `k` into `stage`.
    fn cross(&self, k: i64, stage: &mut Stage) {
        let [gx, gz, _] = self.rates;
        // Every stage begins with the line after the one that ended the stage before, whatever rounding does.
        let passed = |k: i64| {
            self.rates
                .map(|rate| ((k * STAGE) as f64 * (rate / self.rates[self.along]).abs()).floor() as i64)
        };
        let (mut next, last) = (passed(k).map(|n| n + 1), passed(k + 1));
        stage.crossings.clear();
        stage.places.clear();
        let mut last_sample = None;
        loop {
            let distance = |kind: usize| {
                if next[kind] > last[kind] {
                    f64::INFINITY
                } else {
                    next[kind] as f64 / self.rates[kind].abs()
                }
            };
            let kind = (0..3).fold(0, |best, k| if distance(k) < distance(best) { k } else { best });
            let t = distance(kind);
            if t == f64::INFINITY {
                break;
            }
            let line = if self.rates[kind] < 0.0 {
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
            // Three lines meet in a sample.
            if weight == 0.0 && last_sample == Some(a) {
                continue;
            }
            last_sample = (weight == 0.0).then_some(a);
            stage.crossings.push(Crossing {
                a: 0,
                b: 0,
                weight: weight as f32,
                per_m: (1.0 / t) as f32,
                drop: (0.5 * t / self.radius_m) as f32,
            });
            // A line ends the cell before it.
            let passed = if kind == self.along {
                line.abs() - 1
            } else {
                (t * self.rates[self.along].abs()).floor() as i64
            };
            stage.places.push(Place {
                cell: (passed - k * STAGE).clamp(0, STAGE - 1),
                ends: Rect::new(a[0], a[1], b[0] + 1, b[1] + 1),
            });
        }
        // On its way.
        let mut last = 0;
        for place in &mut stage.places {
            last = place.cell.max(last);
            place.cell = last;
        }
        stage.finish(self.slack, |cell| self.strips.begin(k * STAGE + cell));
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_made_anew_are_those_that_are_kept_and_hold_every_line_once() {
        for azimuth_deg in [0.0, 45.0, 17.3, 90.2, 200.0, 359.9] {
            let grid = Grid::new(3000, 2000, [30.0, 22.0]);
            let kept = Rays::new(&grid, azimuth_deg, 6e6, 0.0, 1);
            let anew = Rays::new(&grid, azimuth_deg, 6e6, 0.0, 10 * KEPT);
            assert!(anew.kept.is_empty() && kept.stages() == anew.stages());
            let (mut here, mut there) = (Stage::default(), Stage::default());
            let mut last = f32::INFINITY;
            let mut lines = 0;
            for k in 0..kept.stages() {
                let (a, b) = (kept.stage(k, &mut here), anew.stage(k, &mut there));
                let hulls = |stage: &Stage| -> Vec<(Rect, u32)> {
                    stage.runs.iter().map(|r| (r.hull, r.next)).collect()
                };
                assert_eq!(hulls(a), hulls(b));
                let ends = |stage: &Stage| -> Vec<(i64, i64)> {
                    stage.crossings.iter().map(|c| (c.a, c.b)).collect()
                };
                assert_eq!(ends(a), ends(b));
                // Outward, and within what is said to be swept.
                for crossing in &a.crossings {
                    assert!(crossing.per_m <= last);
                    last = crossing.per_m;
                }
                let swept = kept.swept(k, Rect::new(0, 0, 1, 1));
                for run in &a.runs {
                    assert!(swept.contains_rect(run.hull), "{azimuth_deg}: {:?}", run.hull);
                    assert!(k == 0 || run.per_m <= kept.beyond(k).0 && run.drop >= kept.beyond(k).1);
                }
                lines += a.crossings.len() as i64;
            }
            // Columns, rows and diagonals as far as the last stage goes, less what meets in samples.
            let far_m = (kept.stages() * STAGE) as f64 / kept.rates[kept.along].abs();
            let all: f64 = kept.rates.iter().map(|rate| (far_m * rate.abs()).floor()).sum();
            assert!(
                lines <= all as i64 && (azimuth_deg % 45.0 == 0.0 || lines >= all as i64 - 3),
                "{lines} of {all}"
            );
        }
    }
}
