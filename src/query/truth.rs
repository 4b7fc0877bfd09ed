//! `S0` for millions of rays: the same hits as [`S0`] gives, sooner.
//!
//! [`Truth`] keeps level 0 in tiles of 256 x 256 quads with the ranges of heights in squares of 2^k quads (a maximum
//! mipmap, as in Tevs, Ihrke and Seidel, *Maximum Mipmaps for Fast, Accurate, and Scalable Dynamic Height Field
//! Rendering*, 2008, with minima for what is seen from below). A [`Probe`] walks them for one thread.
//! The way of a ray over their squares is `walk.rs`.
//!
//! Above the tiles the stored bounds of coarser levels are asked for (`Reader::heights` of [`S0`]), so ground over which
//! rays pass high is never read.

use super::line::Line;
use super::ray::plumb;
use super::shelf::Remembered;
use super::tile::{TILE, TILE_RANK, Tile, Tiles};
use super::walk::Walk;
use super::{Crossing, Quad, Reader, S0, Surface, Triangle};
use crate::camera::View;
use crate::clipmap::{Eye, near_of_m};
use crate::error::Result;
use crate::grid::{Grid, PATCH, Patch, Rect};
use crate::levels::Levels;

/// The level whose patches are tiles.
const TILE_LEVEL: u32 = TILE_RANK - PATCH.ilog2();

/// The surface of a DEM's own samples, for many rays and threads.
pub struct Truth<'a> {
    s0: S0<'a>,
    levels: &'a dyn Levels,
    tiles: Tiles,
}

impl std::fmt::Debug for Truth<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Truth")
            .field("s0", &self.s0)
            .finish_non_exhaustive()
    }
}

impl<'a> Truth<'a> {
    /// Level 0 of `levels`, which must be a source that waits for its data, with a factor on heights relative to the eye.
    ///
    /// It keeps 256 MiB of [`Tiles`] at most, and each [`Probe`] the 64 that it asked for last (28 MB).
    pub fn new(levels: &'a dyn Levels, vertical_scale: f64) -> Self {
        Self::with_tiles(levels, vertical_scale, &Tiles::default())
    }

    /// The same, with tiles that an earlier truth of the same levels has read.
    pub fn with_tiles(levels: &'a dyn Levels, vertical_scale: f64, tiles: &Tiles) -> Self {
        Self {
            s0: S0::new(levels).with_vertical_scale(vertical_scale),
            levels,
            tiles: tiles.clone(),
        }
    }

    /// The levels.
    pub fn levels(&self) -> &'a dyn Levels {
        self.levels
    }

    /// Where the samples lie.
    pub fn grid(&self) -> &Grid {
        self.levels.grid()
    }

    /// Factor on heights relative to the eye, as drawn; may be 0 or negative.
    pub fn vertical_scale(&self) -> f64 {
        self.s0.vertical_scale()
    }

    /// The same surface by the plain caster.
    pub fn plain(&self) -> &S0<'a> {
        &self.s0
    }
}

/// A place of the ground, and the quad that holds it.
#[derive(Clone, Copy, Debug)]
pub struct Under {
    /// The quad.
    pub quad: Quad,
    /// Its column and row.
    pub cell: [i64; 2],
    /// Where in it the place is, 0 to 1 from west to east and from north to south.
    pub at: [f64; 2],
}

/// Casts rays through the pixels of one view over a [`Truth`], for one thread.
pub struct Probe<'a> {
    truth: &'a Truth<'a>,
    view: View,
    eye: Eye,
    near_m: f64,
    /// Ranges of squares larger than a tile.
    bounds: Box<dyn Reader + 'a>,
    remembered: Remembered<Tile>,
}

impl std::fmt::Debug for Probe<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Probe")
            .field("view", &self.view)
            .finish_non_exhaustive()
    }
}

impl<'a> Probe<'a> {
    /// A probe for `view` over `truth`.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Misuse`] for a view of other than finite numbers.
    pub fn new(truth: &'a Truth<'a>, view: &View) -> Result<Self> {
        view.check()?;
        Ok(Self {
            truth,
            view: *view,
            eye: Eye::new(view.eye, truth.grid()),
            near_m: near_of_m(view, truth.grid()),
            bounds: truth.s0.reader(),
            remembered: Remembered::new(),
        })
    }

    /// The eye.
    pub fn eye(&self) -> &Eye {
        &self.eye
    }

    /// Nearest drawn distance along the view axis.
    pub fn near_m(&self) -> f64 {
        self.near_m
    }

    /// Where the ray through a place of the picture first meets the surface, from the near plane on, as
    /// [`super::Picker::cast`] says.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Misuse`] for other than finite numbers; those of reading.
    pub fn cast(&mut self, pixel: [f64; 2]) -> Result<Option<Crossing>> {
        self.cast_from(pixel, self.near_m)
    }

    /// The same from `start_m` metres along the view axis on.
    ///
    /// # Errors
    /// As for [`Probe::cast`].
    pub fn cast_from(&mut self, pixel: [f64; 2], start_m: f64) -> Result<Option<Crossing>> {
        let truth = self.truth;
        let scale = truth.vertical_scale();
        let line = Line::new(truth.grid(), &self.eye, self.view.ray(pixel), scale, start_m)?;
        if line.track.stands() {
            return plumb(&truth.s0, self.bounds.as_mut(), &line);
        }
        let (coarsest, roots) = truth.s0.roots();
        let level = coarsest.max(TILE_LEVEL);
        let roots = if level == coarsest {
            roots
        } else {
            let tiles = |samples: i64| (samples - 1 + TILE - 1) / TILE;
            let size = truth.grid().size;
            Rect::new(0, 0, tiles(size.width), tiles(size.height))
        };
        let step = PATCH << level;
        let Some(span) = line.track.over(roots, step, [line.start, f64::INFINITY]) else {
            return Ok(None);
        };
        let mut walk = Walk::new(&line);
        line.track.cells(roots, step, span, |a, b, span| {
            self.visit(&mut walk, Patch::new(level, a, b), coarsest, span)
        })
    }

    /// A square of at least a tile.
    fn visit(
        &mut self,
        walk: &mut Walk<'_>,
        patch: Patch,
        coarsest: u32,
        span: [f64; 2],
    ) -> Result<Option<Crossing>> {
        if patch.level <= coarsest && walk.passes_over(self.bounds.heights(patch)?, span) {
            return Ok(None);
        }
        if patch.level == TILE_LEVEL {
            let (truth, key) = (self.truth, [patch.a, patch.b]);
            let tile = self.remembered.get(key, || truth.tiles.tile(truth.levels, key))?;
            return Ok(walk.square(tile, key.map(|k| k * TILE), TILE_RANK, [0; 2], span));
        }
        let half = PATCH << (patch.level - 1);
        let middle = [2 * patch.a + 1, 2 * patch.b + 1].map(|k| k * half);
        for (side, span) in walk.quarters(middle, span) {
            if span[0] < span[1] {
                let child = Patch::new(patch.level - 1, 2 * patch.a + side[0], 2 * patch.b + side[1]);
                let found = self.visit(walk, child, coarsest, span)?;
                if found.is_some() {
                    return Ok(found);
                }
            }
        }
        Ok(None)
    }

    /// The quad of a place, metres east and south of the eye; none off the DEM.
    ///
    /// # Errors
    /// Those of reading.
    pub fn under(&mut self, from_eye_m: [f64; 2]) -> Result<Option<Under>> {
        let grid = self.truth.grid();
        let (mut cell, mut at) = ([0; 2], [0.0; 2]);
        for axis in 0..2 {
            let last = [grid.size.width, grid.size.height][axis] - 1;
            let from_anchor = self.eye.fraction[axis] + from_eye_m[axis] / grid.spacing_m[axis];
            let [first, end] = [0, last].map(|i| (i - self.eye.anchor[axis]) as f64);
            // Also where it is no number.
            if last == 0 || !(first..=end).contains(&from_anchor) {
                return Ok(None);
            }
            let whole = from_anchor.floor().min(end - 1.0);
            cell[axis] = self.eye.anchor[axis] + whole as i64;
            at[axis] = from_anchor - whole;
        }
        let (truth, key) = (self.truth, cell.map(|c| c.div_euclid(TILE)));
        let [x, z] = cell.map(|c| c.rem_euclid(TILE) as usize);
        let tile = self.remembered.get(key, || truth.tiles.tile(truth.levels, key))?;
        Ok(Some(Under {
            quad: tile.quad(x, z),
            cell,
            at,
        }))
    }
}

impl Under {
    /// Rise over run to the east and to the south of the triangle that holds the place, NaN where a corner of it is void.
    pub fn slopes(&self, spacing_m: [f64; 2]) -> [f64; 2] {
        let quad = &self.quad;
        let [east, south] = match Triangle::holding(self.at) {
            Triangle::SouthWest => [quad.se - quad.sw, quad.sw - quad.nw],
            Triangle::NorthEast => [quad.ne - quad.nw, quad.se - quad.ne],
        };
        [east / spacing_m[0], south / spacing_m[1]]
    }

    /// The surface's height there, metres above the DEM's base; none in a hole.
    pub fn height_m(&self) -> Option<f64> {
        self.quad.height(self.at)
    }

    /// The triangle there as what a ray meets `along` times its direction away.
    pub fn crossing(&self, along: f64, height_m: f64) -> Crossing {
        Crossing {
            along,
            height_m,
            level: 0,
            cell: self.cell,
            quad: self.quad,
            triangle: Triangle::holding(self.at),
            wall: false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::progress::Silent;
    use crate::pyramid::random::Random;
    use crate::pyramid::{Filter, Pyramid};
    use crate::work::Serial;
    use glam::DVec3;

    #[test]
    fn a_small_cache_stays_small_and_changes_nothing() {
        let grid = Grid::new(2300, 900, [1.0, 1.0]);
        let mut random = Random::new(6);
        let heights = random.heights(2300 * 900, 0.0, 100.0, 0.1);
        let mut pyramid = Pyramid::new(grid, heights, None, &Filter::default(), &Serial, &Silent).unwrap();
        pyramid.bound(&Serial, &Silent).unwrap();
        let roomy = Truth::new(&pyramid, 1.0);
        let tight = Truth::with_tiles(&pyramid, 1.0, &Tiles::new(500_000)); // one tile
        let camera = Camera {
            eye: DVec3::new(1000.0, 160.0, 400.0),
            heading_deg: 70.0,
            pitch_deg: -20.0,
            roll_deg: 0.0,
            fov_deg: 100.0,
        };
        let view = View::new(camera, [64, 64]).unwrap();
        let mut seen = 0;
        let [mut a, mut b] = [&roomy, &tight].map(|truth| Probe::new(truth, &view).unwrap());
        for _ in 0..3000 {
            let pixel = [random.between(0.0, 64.0), random.between(0.0, 64.0)];
            let [hit, other] = [&mut a, &mut b].map(|probe| probe.cast(pixel).unwrap());
            assert_eq!(hit.map(|h| (h.along, h.cell)), other.map(|h| (h.along, h.cell)));
            seen += u32::from(hit.is_some());
            assert!(tight.tiles.bytes() <= 500_000);
        }
        assert!(seen > 1000 && roomy.tiles.bytes() > 4_000_000, "{seen}");
    }

    #[test]
    fn a_place_is_over_its_quad_up_to_the_edges() {
        let grid = Grid {
            base_m: 20.0,
            ..Grid::new(300, 270, [2.0, 3.0])
        };
        let heights = grid
            .size
            .rect()
            .cells()
            .map(|(i, j)| (i * 7 % 31 - j * 5 % 17) as f32)
            .collect();
        let pyramid = Pyramid::new(grid, heights, None, &Filter::default(), &Serial, &Silent).unwrap();
        let truth = Truth::new(&pyramid, 1.0);
        let camera = Camera {
            eye: DVec3::new(100.25, 50.0, 200.5),
            heading_deg: 0.0,
            pitch_deg: 0.0,
            roll_deg: 0.0,
            fov_deg: 60.0,
        };
        let mut probe = Probe::new(&truth, &View::new(camera, [8, 8]).unwrap()).unwrap();
        let mut random = Random::new(7);
        let mut at = |x: f64, z: f64| {
            probe
                .under([x - 100.25, z - 200.5])
                .unwrap()
                .and_then(|u| u.height_m())
        };
        for _ in 0..2000 {
            let (x, z) = (random.between(-5.0, 605.0), random.between(-5.0, 815.0));
            let want = truth.plain().height_at(x, z).unwrap().map(|h| h - 20.0);
            let got = at(x, z);
            assert_eq!(got.is_some(), want.is_some(), "{x} {z}");
            assert!(
                got.zip(want).is_none_or(|(a, b)| (a - b).abs() < 1e-9),
                "{x} {z}: {got:?} {want:?}"
            );
        }
        assert!(at(598.0, 807.0).is_some() && at(0.0, 0.0).is_some());
        assert!(at(598.001, 3.0).is_none() && at(3.0, -0.001).is_none() && at(f64::NAN, 3.0).is_none());
    }
}
