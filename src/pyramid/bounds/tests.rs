//! Bounds by brute force: surfaces evaluated anew in f64 at random points, with controls that must fail.

use super::*;
use crate::levels::Levels;
use crate::progress::Silent;
use crate::pyramid::random::Random;
use crate::pyramid::{Filter, Pyramid};
use crate::work::Serial;

fn bounded(grid: Grid, heights: Vec<f32>, step_m: Option<f64>) -> Pyramid {
    let mut made = Pyramid::new(grid, heights, step_m, &Filter::default(), &Serial, &Silent).unwrap();
    made.bound(&Serial, &Silent).unwrap();
    made
}

/// A level as a surface over the ground, in samples of level 0.
struct Surface<'a> {
    heights: &'a [f32],
    size: Size,
    step: f64,
    /// The control: split from south-west to north-east instead.
    wrong_diagonal: bool,
}

impl Surface<'_> {
    /// Its height at (x, z) by Cramer's rule over the triangle there; none where a corner is void.
    fn at(&self, x: f64, z: f64) -> Option<f64> {
        let (x, z) = (x / self.step, z / self.step);
        let (i, j) = (
            (x.floor() as i64).min(self.size.width - 2),
            (z.floor() as i64).min(self.size.height - 2),
        );
        let (u, v) = (x - i as f64, z - j as f64);
        let corners = match (self.wrong_diagonal, u > v, u + v > 1.0) {
            (false, true, _) => [(0, 0), (1, 0), (1, 1)],
            (false, false, _) => [(0, 0), (0, 1), (1, 1)],
            (true, _, true) => [(1, 0), (0, 1), (1, 1)],
            (true, _, false) => [(1, 0), (0, 1), (0, 0)],
        };
        let [a, b, c] = corners.map(|(di, dj): (i64, i64)| {
            let h = self.heights[((j + dj) * self.size.width + i + di) as usize];
            (di as f64, dj as f64, f64::from(h))
        });
        let (bx, bz, cx, cz) = (b.0 - a.0, b.1 - a.1, c.0 - a.0, c.1 - a.1);
        let area = bx * cz - bz * cx;
        let (px, pz) = (u - a.0, v - a.1);
        let (s, t) = ((px * cz - pz * cx) / area, (bx * pz - bz * px) / area);
        let h = a.2 + s * (b.2 - a.2) + t * (c.2 - a.2);
        (!h.is_nan()).then_some(h)
    }
}

/// What a control alters.
#[derive(Clone, Copy, Default)]
struct Break {
    wrong_diagonal: bool,
    error_scale: Option<f32>,
    shifted: bool,
}

/// How many of `count` random points, and how many targets, contradict the stored bounds.
fn violations(made: &Pyramid, seed: u64, count: u32, broken: Break) -> u32 {
    let grid = *made.grid();
    let (width, height) = (grid.size.width, grid.size.height);
    let mut random = Random::new(seed);
    let truth = Surface {
        heights: made.level(0),
        size: grid.size,
        step: 1.0,
        wrong_diagonal: false,
    };
    let mut found = 0;
    for level in 0..grid.file_levels() {
        let size = grid.level(level);
        let mut heights = made.level(level).to_vec();
        if broken.shifted {
            heights.rotate_left(1);
        }
        let step = (1i64 << level) as f64;
        let surface = Surface {
            heights: &heights,
            size,
            step,
            wrong_diagonal: broken.wrong_diagonal,
        };
        let bounds_at = |x: f64, z: f64| {
            let patches = grid.patches(level);
            let index = |x: f64, count: i64| ((x / step / 8.0).floor() as i64).min(count - 1);
            made.level_bounds(level)
                [(index(z, patches.height) * patches.width + index(x, patches.width)) as usize]
        };
        for _ in 0..count {
            let (mut x, mut z) = (
                random.unit() * (width - 1) as f64,
                random.unit() * (height - 1) as f64,
            );
            if random.unit() < 0.3 {
                // Near the samples, where the extremes are.
                (x, z) = (
                    (x.floor() + 1e-6).min((width - 1) as f64),
                    (z.floor() + 2e-6).min((height - 1) as f64),
                );
            }
            let (Some(h), Some(s0)) = (surface.at(x, z), truth.at(x, z)) else {
                continue;
            };
            let bounds = bounds_at(x, z);
            let error = bounds.error * broken.error_scale.unwrap_or(1.0);
            let outside = h < f64::from(bounds.min) - 1e-9 || h > f64::from(bounds.max) + 1e-9;
            // 1e-9 m is the evaluation's own rounding here, at heights below 1e4 m.
            if outside || (h - s0).abs() > f64::from(error) + 1e-9 {
                found += 1;
            }
        }
    }
    found
}

fn scenes() -> impl Iterator<Item = (u64, Pyramid)> {
    (0..8).map(|seed| {
        let mut random = Random::new(100 + seed);
        let grid = Grid::new(70 + random.below(200), 70 + random.below(200), [1.0, 1.0]);
        let voids = [0.0, 0.05, 0.002][seed as usize % 3];
        let noise = random.heights(grid.size.samples(), 0.0, 200.0, voids);
        let hills = grid
            .size
            .rect()
            .cells()
            .zip(&noise)
            .map(|((x, z), n)| n + (1500.0 * ((x as f64 / 31.0).sin() + (z as f64 / 17.0).cos())) as f32);
        let whole = seed % 2 == 0;
        let heights = hills.map(|h| if whole { h.round() } else { h }).collect();
        (seed, bounded(grid, heights, whole.then_some(1.0)))
    })
}

#[test]
fn bounds_hold_at_random_points_and_controls_do_not() {
    let (mut diagonal, mut halved, mut shifted) = (0, 0, 0);
    for (seed, made) in scenes() {
        assert_eq!(violations(&made, seed, 4000, Break::default()), 0, "seed {seed}");
        diagonal += violations(
            &made,
            seed,
            4000,
            Break {
                wrong_diagonal: true,
                ..Break::default()
            },
        );
        halved += violations(
            &made,
            seed,
            4000,
            Break {
                error_scale: Some(0.5),
                ..Break::default()
            },
        );
        shifted += violations(
            &made,
            seed,
            4000,
            Break {
                shifted: true,
                ..Break::default()
            },
        );
    }
    assert!(
        diagonal > 0 && halved > 0 && shifted > 0,
        "{diagonal} {halved} {shifted}"
    );
}

/// The least true error of a patch, from its definition, sample by sample and target by target.
fn true_error(made: &Pyramid, patch: Patch) -> f64 {
    let grid = made.grid();
    let l = patch.level;
    let size = grid.level(l);
    let at = |i: i64, j: i64| {
        let h = size
            .rect()
            .contains(i, j)
            .then(|| made.level(l)[(j * size.width + i) as usize]);
        h.map_or(f64::NAN, f64::from)
    };
    let step = 1i64 << l;
    let span = patch.samples();
    let ground = Rect::new(
        span.x0 * step,
        span.z0 * step,
        (span.x1 - 1) * step + 1,
        (span.z1 - 1) * step + 1,
    );
    let mut worst = 0.0f64;
    for (x, z) in ground.intersection(grid.size.rect()).cells() {
        let truth = f64::from(made.level(0)[(z * grid.size.width + x) as usize]);
        let (i, j, u, v) = (x / step, z / step, x % step, z % step);
        // Corners with a weight, by where in the cell the sample lies.
        let (fu, fv) = (u as f64 / step as f64, v as f64 / step as f64);
        let surface = match (u == 0, v == 0) {
            (true, true) => at(i, j),
            (false, true) => at(i, j) + fu * (at(i + 1, j) - at(i, j)),
            (true, false) => at(i, j) + fv * (at(i, j + 1) - at(i, j)),
            _ if u == v => at(i, j) + fu * (at(i + 1, j + 1) - at(i, j)),
            _ if u > v => at(i, j) + fu * (at(i + 1, j) - at(i, j)) + fv * (at(i + 1, j + 1) - at(i + 1, j)),
            _ => at(i, j) + fv * (at(i, j + 1) - at(i, j)) + fu * (at(i + 1, j + 1) - at(i, j + 1)),
        };
        worst = worst.max((surface - truth).abs());
    }
    worst
}

#[test]
fn errors_are_as_small_as_they_may_be_voids_and_edges_included() {
    for (seed, made) in scenes() {
        for level in 0..made.grid().file_levels() {
            let patches = made.grid().patches(level);
            for ((a, b), bounds) in patches.rect().cells().zip(made.level_bounds(level)) {
                if bounds.is_void() {
                    continue;
                }
                let truth = true_error(&made, Patch::new(level, a, b));
                let (stored, place) = (
                    f64::from(bounds.error),
                    format!("seed {seed}, level {level}, ({a}, {b})"),
                );
                // A target's rounding is at most 2^-24 of 1e4 m.
                assert!(
                    stored >= truth - 1e-9 && stored <= truth * (1.0 + 2e-7) + 1e-3,
                    "{place}: {stored} {truth}"
                );
                assert!(level > 0 || stored == 0.0, "{place}");
                let inside = |(i, j)| made.level(level)[(j * made.grid().level(level).width + i) as usize];
                let samples = Patch::new(level, a, b).samples_within(made.grid().level(level));
                let valid: Vec<f32> = samples.cells().map(inside).filter(|h| !h.is_nan()).collect();
                let low = valid.iter().copied().fold(f32::INFINITY, f32::min);
                let high = valid.iter().copied().fold(f32::NEG_INFINITY, f32::max);
                assert_eq!((bounds.min, bounds.max), (low, high), "{place}");
            }
        }
    }
}

#[test]
fn a_target_is_held_at_vertices_between_void_triangles() {
    // Level 1 of 5 x 5 with only its diagonal valid: no triangle, but the targets on the diagonal exist.
    let grid = Grid::new(129, 129, [1.0, 1.0]);
    let on_diagonal = |(x, z): (i64, i64)| {
        let h = if (x / 2) % 2 == 1 && x % 2 == 1 {
            100.0
        } else {
            0.0
        };
        if x == z { h } else { f32::NAN }
    };
    let made = bounded(grid, grid.size.rect().cells().map(on_diagonal).collect(), None);
    assert_eq!(made.level(1)[66], 0.0);
    assert!(
        (99.99..100.01).contains(&made.level_bounds(1)[0].error),
        "{}",
        made.level_bounds(1)[0].error
    );
}

/// Parents whose `need_*` do not hold those of their children and the children's neighbours.
fn unsaturated(grid: &Grid, bounds: &[Vec<Bounds>]) -> u32 {
    let mut found = 0;
    for level in 1..grid.file_levels() {
        let (fine, coarse) = (grid.patches(level - 1), grid.patches(level));
        for (a, b) in fine.rect().cells() {
            let below = bounds[level as usize - 1][(b * fine.width + a) as usize];
            if below.need_min.is_nan() {
                continue;
            }
            // The parents of this patch and of its eight neighbours.
            for (x, z) in Rect::new(a - 1, b - 1, a + 2, b + 2)
                .intersection(fine.rect())
                .cells()
            {
                let held = bounds[level as usize][((z / 2) * coarse.width + x / 2) as usize];
                let fits = held.need_min <= below.need_min
                    && held.need_max >= below.need_max
                    && f64::from(held.need_error) >= SATURATION * f64::from(below.need_error);
                found += u32::from(!fits);
            }
        }
    }
    found
}

#[test]
fn needs_nest_also_through_voids_and_controls_do_not() {
    let all = |made: &Pyramid| -> Vec<Vec<Bounds>> {
        (0..made.grid().file_levels())
            .map(|l| made.level_bounds(l).to_vec())
            .collect()
    };
    let mut unsaturated_controls = [0, 0];
    for (seed, made) in scenes() {
        let bounds = all(&made);
        assert_eq!(unsaturated(made.grid(), &bounds), 0, "seed {seed}");
        for b in bounds.iter().flatten() {
            let own = b.is_void() || (b.need_error >= b.error && b.need_min <= b.min && b.need_max >= b.max);
            assert!(own, "seed {seed}: {b:?}");
        }
        let mut none = bounds.clone();
        none.iter_mut()
            .flatten()
            .for_each(|b| (b.need_error, b.need_min, b.need_max) = (b.error, b.min, b.max));
        unsaturated_controls[0] += unsaturated(made.grid(), &none);
    }
    // A coast of ground that only level 0 shows, beside ground that all levels show.
    let grid = Grid::new(300, 200, [1.0, 1.0]);
    let heights = grid.size.rect().cells().map(|(x, z)| {
        let even = x % 2 == 0 && z % 2 == 0;
        if x < 130 && even {
            f32::NAN
        } else {
            ((x * 37 + z * 91) % 101) as f32
        }
    });
    let made = bounded(grid, heights.collect(), None);
    let mut bounds = all(&made);
    assert!(bounds[2].iter().any(|b| b.is_void() && !b.need_min.is_nan()));
    assert_eq!(unsaturated(&grid, &bounds), 0);
    bounds
        .iter_mut()
        .flatten()
        .filter(|b| b.is_void())
        .for_each(|b| *b = Bounds::VOID);
    unsaturated_controls[1] += unsaturated(&grid, &bounds);
    assert!(
        unsaturated_controls.iter().all(|&c| c > 0),
        "{unsaturated_controls:?}"
    );
}

#[test]
fn rounding_goes_up() {
    for x in [0.0, 1.0, 0.1, 1e-50, 3e38, 1e39, 16_777_217.0] {
        assert!(f64::from(round_up(x)) >= x, "{x}");
        assert!(x == 0.0 || f64::from(round_up(x).next_down()) < x, "{x}");
    }
    assert_eq!(round_up(0.0), 0.0);
}
