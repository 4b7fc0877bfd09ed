//! Surfaces to query: pyramids in memory, and all the triangles of a surface for brute force.
#![allow(unreachable_pub, reason = "a module of test programs has no outside")]
#![allow(dead_code, reason = "each test program uses its own part of this")]

use clipscape::clipmap::{Clipmap, ClipmapOptions, displace};
use clipscape::grid::{Grid, PATCH, Rect};
use clipscape::levels::Levels;
use clipscape::progress::Silent;
use clipscape::pyramid::{Filter, Pyramid};
use clipscape::work::Serial;
use glam::DVec3;

use crate::support::{hash, hills};

pub fn pyramid(grid: Grid, height: impl Fn(i64, i64) -> f32) -> Pyramid {
    let heights = grid.size.rect().cells().map(|(i, j)| height(i, j)).collect();
    let mut pyramid = Pyramid::new(grid, heights, None, &Filter::default(), &Serial, &Silent).unwrap();
    pyramid.bound(&Serial, &Silent).unwrap();
    pyramid
}

pub fn small(clip_size: i64) -> ClipmapOptions {
    ClipmapOptions {
        clip_size,
        cull: false,
        ..Default::default()
    }
}

pub fn rough(i: i64, j: i64) -> f32 {
    let void = hash(7, i / 9, j / 7) < 0.06 || hash(8, i, j) < 0.01;
    if void {
        f32::NAN
    } else {
        hills(0, i, j) + 40.0 * hash(0, i, j) as f32
    }
}

pub fn rough_grid() -> Grid {
    let mut grid = Grid::new(150, 119, [3.0, 5.0]);
    grid.base_m = 1000.25;
    grid
}

/// A triangle in world metres.
pub type Corners = [DVec3; 3];

/// Which way the quads of an oracle are split.
#[derive(Clone, Copy, PartialEq)]
pub enum Diagonal {
    NorthWest,
    /// The wrong one.
    NorthEast,
}

/// All triangles of a surface, cut at the DEM's edge, for brute force.
pub struct Oracle {
    pub triangles: Vec<Corners>,
    edge_m: [f64; 2],
}

impl Oracle {
    fn new(grid: &Grid) -> Self {
        Self {
            triangles: Vec::new(),
            edge_m: [
                (grid.size.width - 1) as f64 * grid.spacing_m[0],
                (grid.size.height - 1) as f64 * grid.spacing_m[1],
            ],
        }
    }

    fn push([nw, ne, sw, se]: [DVec3; 4], diagonal: Diagonal, into: &mut Vec<Corners>) {
        let both = match diagonal {
            Diagonal::NorthWest => [[nw, sw, se], [nw, se, ne]],
            Diagonal::NorthEast => [[nw, sw, ne], [ne, sw, se]],
        };
        into.extend(both.iter().filter(|t| t.iter().all(|p| p.is_finite())));
    }

    pub fn truth(pyramid: &Pyramid, diagonal: Diagonal) -> Self {
        let grid = pyramid.grid();
        let mut oracle = Self::new(grid);
        let point = |i: i64, j: i64| {
            let height = pyramid.level(0)[(j * grid.size.width + i) as usize];
            DVec3::new(
                i as f64 * grid.spacing_m[0],
                f64::from(height) + grid.base_m,
                j as f64 * grid.spacing_m[1],
            )
        };
        let cells = Rect::new(0, 0, grid.size.width - 1, grid.size.height - 1);
        for (i, j) in cells.cells() {
            let quad = [point(i, j), point(i + 1, j), point(i, j + 1), point(i + 1, j + 1)];
            Self::push(quad, diagonal, &mut oracle.triangles);
        }
        oracle
    }

    /// Of the selection itself and its displaced vertices: not by [`Drawn`]'s walk.
    pub fn drawn(clipmap: &Clipmap, diagonal: Diagonal) -> Self {
        let grid = clipmap.grid();
        let mut oracle = Self::new(grid);
        for instance in clipmap.selection().instances() {
            let last = grid.level(instance.level);
            let point = |x: i32, z: i32| {
                let vertex = displace(clipmap, instance, x, z);
                let i = i64::from(instance.origin[0] + x).min(last.width - 1) << instance.level;
                let j = i64::from(instance.origin[1] + z).min(last.height - 1) << instance.level;
                let height = if vertex.void {
                    f64::NAN
                } else {
                    f64::from(vertex.height)
                };
                DVec3::new(
                    i as f64 * grid.spacing_m[0],
                    height + grid.base_m,
                    j as f64 * grid.spacing_m[1],
                )
            };
            for z in 0..PATCH as i32 {
                for x in 0..PATCH as i32 {
                    let quad = [point(x, z), point(x + 1, z), point(x, z + 1), point(x + 1, z + 1)];
                    Self::push(quad, diagonal, &mut oracle.triangles);
                }
            }
        }
        oracle
    }

    /// The first hits in multiples of `direction`, by triangles that are a little too large and a little too small.
    pub fn ray(&self, origin: DVec3, direction: DVec3) -> [f64; 2] {
        let mut first = [f64::INFINITY; 2];
        for [a, b, c] in &self.triangles {
            let (u, v) = (*b - *a, *c - *a);
            let normal = u.cross(v);
            let towards = normal.dot(direction);
            if normal.y == 0.0 || towards == 0.0 {
                continue; // no area on the ground, or seen edge on
            }
            let t = normal.dot(*a - origin) / towards;
            // Its place on the ground.
            let p = DVec3::new(origin.x - a.x, 0.0, origin.z - a.z)
                + DVec3::new(direction.x, 0.0, direction.z) * t;
            let area = u.x * v.z - u.z * v.x;
            let weights = [(p.x * v.z - p.z * v.x) / area, (u.x * p.z - u.z * p.x) / area];
            let inside = weights[0].min(weights[1]).min(1.0 - weights[0] - weights[1]);
            let place = DVec3::new(a.x + p.x, 0.0, a.z + p.z);
            let over = ((place.x - self.edge_m[0]) / self.edge_m[0])
                .max((place.z - self.edge_m[1]) / self.edge_m[1]);
            for (first, slack) in first.iter_mut().zip([1e-9, -1e-9]) {
                if t >= -slack && inside >= -slack && over <= slack {
                    *first = first.min(t);
                }
            }
        }
        first
    }
}
