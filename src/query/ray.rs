//! The caster: where a ray first meets a surface.
//!
//! Along the ray's track over the ground, the tree of patches is walked from front to back. A patch is passed over
//! where the ray stays above its greatest or below its least height; bounds that are not known pass over nothing. In a
//! patch that is drawn, the quads along the track are walked, each cut at its diagonal. Over one triangle, surface less
//! ray is linear in time: the ray meets it where that changes sign or is 0, from above or from below.
//!
//! *No slipping through.* The side on which the ray is, above or below, is carried from triangle to triangle. Where it
//! is another at the start of one than at the end of the one before, the ray has met the surface at the edge between
//! them, be it a step of rounding between levels or a wall. A hole ends what is carried. Of patches that were passed
//! over the side is known but not whether the surface exists at their far end: where that matters, it is looked up.
//!
//! The ray starts at `start` (in multiples of its direction); a start on the surface is met at once. A ray that stands
//! over one place has that place's height, and no step in time. Its cost is that of the patches along its track whose
//! heights it crosses, and of their quads.
//!
//! *Rounding.* A time is one product of an exact distance and a rounded inverse, a height above the ray a sum of five
//! products: both are off by a few 2^-53 of their terms.

use super::ground;
use super::line::{Line, Side};
use super::{Quad, Reader, Surface, Triangle};
use crate::clipmap::{Corners, Place};
use crate::error::Result;
use crate::grid::{PATCH, Patch, Rect};

/// Where a ray meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// How far along the ray, as a multiple of its direction.
    pub along: f64,
    /// The surface's height there, metres above the DEM's base.
    pub height_m: f64,
    /// The level of the quad that it meets.
    pub level: u32,
    /// The quad's column and row, in samples of its level.
    pub cell: [i64; 2],
    /// Its heights.
    pub quad: Quad,
    /// Which of its triangles.
    pub triangle: Triangle,
    /// Whether it meets the edge between two triangles that do not agree there.
    pub wall: bool,
}

/// What is carried from one patch or triangle to the next.
#[derive(Clone, Copy, Debug)]
enum Carried {
    /// There was no surface, or the ray has only begun.
    Nothing,
    /// The ray was on this side.
    Side(Side),
    /// The ray was on this side of a patch that was passed over, if there is a surface at its end.
    Passed(Side, Patch, [f64; 2]),
}

/// The part of a ray over one triangle.
pub(super) struct Piece {
    pub(super) cell: [i64; 2],
    pub(super) quad: Quad,
    pub(super) triangle: Triangle,
    pub(super) span: [f64; 2],
    /// The surface's height at both ends; none of both where it is a hole.
    pub(super) heights: Option<[f64; 2]>,
}

struct Caster<'a> {
    reader: &'a mut dyn Reader,
    line: &'a Line,
    carried: Carried,
    /// Where the ray is behind the surface; none to stop at the first crossing.
    behind: Option<Behind>,
}

/// Where a ray is on the other side of the surface than it was before it first met it.
#[derive(Debug, Default)]
struct Behind {
    home: Option<Side>,
    since: Option<f64>,
    spans: Vec<[f64; 2]>,
}

impl Behind {
    fn side(&mut self, side: Option<Side>, time: f64) {
        let behind = self.home.is_some() && side.is_some() && side != self.home;
        match (self.since, behind) {
            (None, true) => self.since = Some(time),
            (Some(since), false) => {
                self.spans.push([since, time]);
                self.since = None;
            }
            _ => {}
        }
    }
}

/// The first crossing of a ray with a surface.
///
/// # Errors
/// Those of the reader.
pub(super) fn cast<S: Surface + ?Sized>(
    surface: &S,
    reader: &mut dyn Reader,
    line: &Line,
) -> Result<Option<Crossing>> {
    if line.track.stands() {
        return plumb(surface, reader, line);
    }
    let mut caster = Caster {
        reader,
        line,
        carried: Carried::Nothing,
        behind: None,
    };
    caster.walk(surface, f64::INFINITY)
}

/// Where, up to `end`, a ray is behind the surface: on the other side of it than before it first met it. A hole ends
/// it, unless it lies in a patch that the ray passes over. In multiples of the ray's direction, one span after another.
///
/// # Errors
/// Those of the reader.
pub(super) fn behind<S: Surface + ?Sized>(
    surface: &S,
    reader: &mut dyn Reader,
    line: &Line,
    end: f64,
) -> Result<Vec<[f64; 2]>> {
    if line.track.stands() {
        let first = plumb(surface, reader, line)?
            .map(|c| c.along)
            .filter(|a| *a < end);
        return Ok(first.map(|along| vec![[along, end]]).unwrap_or_default());
    }
    let mut caster = Caster {
        reader,
        line,
        carried: Carried::Nothing,
        behind: Some(Behind::default()),
    };
    caster.walk(surface, end * line.factor)?;
    let behind = caster.behind.unwrap_or_default();
    let last = behind.since.map(|since| [since, f64::INFINITY]);
    let spans = behind.spans.into_iter().chain(last);
    Ok(spans.map(|span| span.map(|t| line.along(t).min(end))).collect())
}

/// The crossing of a ray straight up or down.
pub(super) fn plumb<S: Surface + ?Sized>(
    surface: &S,
    reader: &mut dyn Reader,
    line: &Line,
) -> Result<Option<Crossing>> {
    let found = ground::find(surface, reader, &line.eye)?;
    Ok(found.and_then(|f| {
        let height_m = f.quad.height(f.at)?;
        let time = line.up(height_m) / line.rise;
        (time >= line.start && time.is_finite()).then(|| Crossing {
            along: line.along(time),
            height_m,
            level: f.level,
            cell: f.cell,
            quad: f.quad,
            triangle: Triangle::holding(f.at),
            wall: false,
        })
    }))
}

impl Caster<'_> {
    fn walk<S: Surface + ?Sized>(&mut self, surface: &S, end: f64) -> Result<Option<Crossing>> {
        let (level, roots) = surface.roots();
        let (line, step) = (self.line, PATCH << level);
        let Some(span) = line.track.over(roots, step, [line.start, end]) else {
            return Ok(None);
        };
        line.track.cells(roots, step, span, |a, b, span| {
            self.visit(Patch::new(level, a, b), span)
        })
    }

    fn visit(&mut self, patch: Patch, span: [f64; 2]) -> Result<Option<Crossing>> {
        let place = self.reader.place(patch);
        if place == Place::Nothing {
            self.carried = Carried::Nothing;
            if let Some(behind) = &mut self.behind {
                behind.side(None, span[0]);
            }
            return Ok(None);
        }
        if let Some(side) = self.line.side_of(self.reader.heights(patch)?, span) {
            let before = match self.carried {
                Carried::Nothing => side,
                Carried::Side(before) | Carried::Passed(before, ..) => before,
            };
            // Else the ray changes sides where this patch begins, if there is a surface.
            if before == side {
                self.carried = Carried::Passed(side, patch, span);
                return Ok(None);
            }
        }
        if place == Place::Patch {
            return self.meet(patch, span);
        }
        for child in self.line.track.children(patch) {
            if let Some(span) = self.over(child, span)
                && let Some(found) = self.visit(child, span)?
            {
                return Ok(Some(found));
            }
        }
        Ok(None)
    }

    fn over(&self, patch: Patch, span: [f64; 2]) -> Option<[f64; 2]> {
        let cell = Rect::new(patch.a, patch.b, patch.a + 1, patch.b + 1);
        self.line.track.over(cell, PATCH << patch.level, span)
    }

    /// Walks the quads of a drawn patch.
    fn meet(&mut self, patch: Patch, span: [f64; 2]) -> Result<Option<Crossing>> {
        let line = self.line;
        let mut carried = match self.carried {
            Carried::Nothing => None,
            Carried::Side(side) | Carried::Passed(side, ..) => Some(side),
        };
        if let Carried::Passed(side, passed, passed_span) = self.carried {
            let begins = begin(line, self.reader.corners(patch)?, patch, span);
            if begins.is_some_and(|begins| begins != side) && !self.ends_on_surface(passed, passed_span)? {
                carried = None;
            }
        }
        let corners = self.reader.corners(patch)?;
        let behind = &mut self.behind;
        let found = pieces(line, corners, patch, span, |piece| {
            let Some(heights) = piece.heights else {
                carried = None;
                if let Some(behind) = behind {
                    behind.side(None, piece.span[0]);
                }
                return None;
            };
            let [first, last] = [0, 1].map(|k| line.up(heights[k]) - line.rise * piece.span[k]);
            let before = carried.or(Side::of(first));
            carried = Side::of(last);
            let wall = before != Side::of(first);
            if let Some(behind) = behind {
                if wall || carried != before {
                    behind.home = behind.home.or(before);
                }
                behind.side(Side::of(first), piece.span[0]);
                let share = if first == last {
                    0.0
                } else {
                    (first / (first - last)).clamp(0.0, 1.0)
                };
                behind.side(carried, piece.span[0] + (piece.span[1] - piece.span[0]) * share);
                return None;
            }
            let share = if wall || first == 0.0 {
                0.0
            } else if carried != before {
                first / (first - last)
            } else {
                return None;
            };
            Some(Crossing {
                along: line.along(piece.span[0] + (piece.span[1] - piece.span[0]) * share),
                height_m: heights[0] + (heights[1] - heights[0]) * share,
                level: patch.level,
                cell: piece.cell,
                quad: piece.quad,
                triangle: piece.triangle,
                wall: wall && first != 0.0,
            })
        });
        self.carried = carried.map_or(Carried::Nothing, Carried::Side);
        Ok(found)
    }

    /// Whether there is a surface at the end of a ray's span over a patch.
    fn ends_on_surface(&mut self, patch: Patch, span: [f64; 2]) -> Result<bool> {
        match self.reader.place(patch) {
            Place::Nothing => Ok(false),
            Place::Finer => {
                let children = self.line.track.children(patch);
                for child in children.into_iter().rev() {
                    if let Some(part) = self.over(child, span)
                        && part[1] == span[1]
                    {
                        return self.ends_on_surface(child, part);
                    }
                }
                Ok(false)
            }
            Place::Patch => {
                let line = self.line;
                let mut exists = false;
                pieces(line, self.reader.corners(patch)?, patch, span, |piece| {
                    exists = piece.heights.is_some();
                    None::<()>
                });
                Ok(exists)
            }
        }
    }
}

/// The side on which a ray begins over a patch; none over a hole, and on the surface.
fn begin(line: &Line, corners: &Corners, patch: Patch, span: [f64; 2]) -> Option<Side> {
    pieces(line, corners, patch, span, |piece| {
        let surface = piece.heights.map(|h| line.up(h[0]) - line.rise * piece.span[0]);
        Some(surface.and_then(Side::of))
    })
    .flatten()
}

/// The pieces of a ray over the triangles of a patch, one after another, until `visit` has found something.
fn pieces<T>(
    line: &Line,
    corners: &Corners,
    patch: Patch,
    span: [f64; 2],
    mut visit: impl FnMut(Piece) -> Option<T>,
) -> Option<T> {
    let (x0, z0) = (patch.a * PATCH, patch.b * PATCH);
    let step = 1i64 << patch.level;
    let cells = Rect::new(x0, z0, x0 + PATCH, z0 + PATCH);
    let found: Result<Option<T>, std::convert::Infallible> =
        line.track.cells(cells, step, span, |i, j, span| {
            let quad = Quad::of(corners, (i - x0) as usize, (j - z0) as usize);
            Ok(pieces_of_quad(line, quad, [i, j], step, span, &mut visit))
        });
    match found {
        Ok(found) => found,
    }
}

/// The same over one quad, at column and row `cell` of a grid with steps of `step` samples.
pub(super) fn pieces_of_quad<T>(
    line: &Line,
    quad: Quad,
    cell: [i64; 2],
    step: i64,
    span: [f64; 2],
    visit: &mut impl FnMut(Piece) -> Option<T>,
) -> Option<T> {
    let [from, to] = span.map(|t| line.track.within(cell[0], cell[1], step, t));
    let mut piece = |triangle, span: [f64; 2], from, to| {
        let heights = quad.height_in(triangle, from).zip(quad.height_in(triangle, to));
        visit(Piece {
            cell,
            quad,
            triangle,
            span,
            heights: heights.map(|(a, b)| [a, b]),
        })
    };
    // How far north-east of the diagonal.
    let [a, b] = [from[0] - from[1], to[0] - to[1]];
    if (a < 0.0 && b > 0.0) || (a > 0.0 && b < 0.0) {
        let share = a / (a - b);
        let t = span[0] + (span[1] - span[0]) * share;
        let on = from[0] + (to[0] - from[0]) * share;
        let [first, second] = if a < 0.0 {
            [Triangle::SouthWest, Triangle::NorthEast]
        } else {
            [Triangle::NorthEast, Triangle::SouthWest]
        };
        return piece(first, [span[0], t], from, [on, on])
            .or_else(|| piece(second, [t, span[1]], [on, on], to));
    }
    let triangle = if a + b >= 0.0 {
        Triangle::NorthEast
    } else {
        Triangle::SouthWest
    };
    piece(triangle, span, from, to)
}
