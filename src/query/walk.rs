//! The way of a ray over the squares of tiles.
//!
//! *The walk.* The ray's track over the ground is cut where it crosses the lines through a square's middle, which gives
//! the spans of time over its quarters, in order, at one product for each line. A square is passed over where the ray
//! stays above its greatest or below its least height; quads are met as the plain caster in `ray.rs` meets them, by
//! the same function. Times of lines are the same bits in both, so are the spans over quads, and so are the hits.
//!
//! *Sides.* The side on which the ray is, above or below the surface, is carried from square to square. A ray that
//! passes over a square on one side and begins over the next on the other has met the surface between them, or come
//! through a hole. It has not come through a hole: the line between the two squares is an edge of both, at whose ends
//! samples are valid where the second one's surface begins, and ranges hold those. So nothing needs to be looked up
//! at the end of what was passed over; levels that do not agree there, which the plain caster allows for, are not met
//! on `S0`.

use super::Crossing;
use super::line::{Line, Side};
use super::ray::{Piece, pieces_of_quad};
use super::tile::Tile;

/// A ray on its way.
pub(super) struct Walk<'a> {
    line: &'a Line,
    /// The side on which it was last; none after a hole.
    carried: Option<Side>,
    /// Which half of a square it meets first, along each axis: the western or northern one is 0.
    first: [i64; 2],
}

impl<'a> Walk<'a> {
    pub(super) fn new(line: &'a Line) -> Self {
        let first = |speed: f64| i64::from(speed < 0.0);
        Self {
            line,
            carried: None,
            first: [first(line.track.x.speed), first(line.track.z.speed)],
        }
    }

    /// Whether the ray stays on the side of all that lies between two heights on which it was before.
    pub(super) fn passes_over(&mut self, heights: [f32; 2], span: [f64; 2]) -> bool {
        let Some(side) = self.line.side_of(heights, span) else {
            return false;
        };
        let same = self.carried.is_none_or(|carried| carried == side);
        if same {
            self.carried = Some(side);
        }
        same
    }

    /// The quarters of a square about `middle` in the order in which the ray meets them, some for no time at all.
    pub(super) fn quarters(&self, middle: [i64; 2], span: [f64; 2]) -> [([i64; 2], [f64; 2]); 3] {
        let track = &self.line.track;
        let [x, z] = [track.x.passes(middle[0]), track.z.passes(middle[1])];
        let [first, second] = [x.min(z), x.max(z)].map(|t| t.max(span[0]).min(span[1]));
        let [a, b] = self.first;
        let between = if x < z { [1 - a, b] } else { [a, 1 - b] };
        [
            ([a, b], [span[0], first]),
            (between, [first, second]),
            ([1 - a, 1 - b], [second, span[1]]),
        ]
    }

    /// Square `at` of a rank in a tile that begins at sample `origin`.
    pub(super) fn square(
        &mut self,
        tile: &Tile,
        origin: [i64; 2],
        rank: u32,
        at: [i64; 2],
        span: [f64; 2],
    ) -> Option<Crossing> {
        if rank == 0 {
            return self.quad(tile, origin, at, span);
        }
        let range = tile.range(rank, at[0] as usize, at[1] as usize);
        if self.passes_over(range, span) {
            return None;
        }
        if range[0].is_nan() {
            self.carried = None;
            return None;
        }
        let half = 1i64 << (rank - 1);
        let middle = [0, 1].map(|axis| origin[axis] + (2 * at[axis] + 1) * half);
        for (side, span) in self.quarters(middle, span) {
            if span[0] < span[1] {
                let at = [0, 1].map(|axis| 2 * at[axis] + side[axis]);
                let found = self.square(tile, origin, rank - 1, at, span);
                if found.is_some() {
                    return found;
                }
            }
        }
        None
    }

    fn quad(&mut self, tile: &Tile, origin: [i64; 2], at: [i64; 2], span: [f64; 2]) -> Option<Crossing> {
        let line = self.line;
        let quad = tile.quad(at[0] as usize, at[1] as usize);
        let cell = [0, 1].map(|axis| origin[axis] + at[axis]);
        pieces_of_quad(line, quad, cell, 1, span, &mut |piece| self.meet(piece))
    }

    /// As the plain caster meets a triangle.
    fn meet(&mut self, piece: Piece) -> Option<Crossing> {
        let line = self.line;
        let Some(heights) = piece.heights else {
            self.carried = None;
            return None;
        };
        let [first, last] = [0, 1].map(|k| line.up(heights[k]) - line.rise * piece.span[k]);
        let before = self.carried.or(Side::of(first));
        self.carried = Side::of(last);
        let wall = before != Side::of(first);
        let share = if wall || first == 0.0 {
            0.0
        } else if self.carried != before {
            first / (first - last)
        } else {
            return None;
        };
        Some(Crossing {
            along: line.along(piece.span[0] + (piece.span[1] - piece.span[0]) * share),
            height_m: heights[0] + (heights[1] - heights[0]) * share,
            level: 0,
            cell: piece.cell,
            quad: piece.quad,
            triangle: piece.triangle,
            wall: wall && first != 0.0,
        })
    }
}
