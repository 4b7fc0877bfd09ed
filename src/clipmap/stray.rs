//! How far what is drawn of a patch may stray from the DEM's own surface, before it is drawn.
//!
//! D is the drawn surface, S0 the DEM's own. e is an upper bound of `|D - S0|` on a triangle of the patch, where both
//! exist. With the patch's level l, let a = `S_l`, b = `S_{l+1}`, d = b - a, all linear on the triangle, and let its corners
//! have weights w at the place, and alphas in `[low, high]`, `v = high - low`. D is `sum w (a_i + alpha_i d_i)`; E and F are
//! the stored errors of the patch and of its parent: `|a - S0| <= E`, `|b - S0| <= F`. Where alpha is 0 on all of the patch
//! e is E, where it is 1 it is F. Else with A the mean of alpha by w:
//!
//! 1. `D = (1 - A) a + A b + sum w (alpha_i - A) d_i`, which is the covariance of alpha and d over the corners.
//! 2. `|(1 - A) a + A b - S0| <= (1 - A) E + A F`: at most the greater of that at `low` and that at `high`.
//! 3. `|covariance| <= v (max d - min d) / 4` (Gruess 1935), with d taken from the windows' samples.
//! 4. As well, `|D - S0| <= E + sum w alpha_i |d_i| <= E + max alpha_i |d_i|`, and `|D - S0| <= F + max (1 - alpha_i) |d_i|`.
//!
//! e is the least of what 2 and 3, and each half of 4, allow, and of what the whole patch does:
//!
//! *Before looking at triangles*: `|d_i| <= E + F` at a corner where S0 exists, so with the least and the greatest alpha of
//! the patch 3 is at most `v (E + F) / 2`, and 4 follows as it stands. At a corner beyond the DEM's edge there is no S0, and
//! corners may be void: there d is at most the range of all heights of both patches and of S0 between them, which is added
//! to the greater of E and F.
//!
//! *Voids.* Where a corner lacks a or b, the vertex function draws the other. Where all corners have their a but not all
//! their b, one without b counts as alpha 0, and the first half of 4 is left. Where all have their b but not all their a,
//! one without a is drawn only at alpha 1, and the second half is left. Where a triangle has neither surface and
//! is drawn all the same, e is how far its corners are from the highest or lowest that S0 is there.
//!
//! *Rounding.* Where alpha is 0 or 1 a vertex is drawn at the height of which the stored error speaks. Else the vertex
//! function rounds by at most `2^-23 (|h| + |c|)`, which is added to e. What f32 does on the way from a vertex to a pixel
//! belongs to the floor of what is measured ([`crate::accuracy`]).

use glam::DVec3;

use super::Clipmap;
use super::alpha::{self, MARGIN};
use super::certificate::Terms;
use super::scene::{Scene, hull};
use super::screen::{Screen, Sight};
use super::window::PatchInfo;
use crate::grid::{PATCH, Patch};

/// Corners along a patch's side.
const SIDE: usize = PATCH as usize + 1;

/// What decides how far the patches of a frame stray.
pub(super) struct Strays<'a> {
    pub(super) clipmap: &'a Clipmap,
    pub(super) scene: Scene<'a>,
    pub(super) screen: &'a Screen,
    pub(super) terms: Terms,
}

/// How far a patch strays: none where bounds or samples that count have not arrived.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stray {
    /// The most on any of its triangles, in metres.
    pub(super) error_m: f64,
    /// The most on those that are seen, in pixels.
    pub(super) error_px: f64,
}

/// What a patch lies on.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Lies {
    /// Its own level, alpha being 0 on all of it.
    Own,
    /// The next coarser one, alpha being 1 on all of it.
    Coarser,
    /// Between the two, alpha being within these everywhere.
    Between([f64; 2]),
}

/// What is known of a patch before its triangles are looked at.
struct Known {
    lies: Lies,
    /// E and F.
    errors: [f64; 2],
    /// Least and greatest height of what is drawn.
    heights: [f32; 2],
    /// Least and greatest height of S0 on the patch.
    truth: [f64; 2],
    /// e for all of the patch.
    most_m: f64,
    /// What the vertex function may round by.
    rounding_m: f64,
    /// Whether it may have voids or reaches over the DEM's edge.
    ragged: bool,
}

/// A corner of a patch: its alpha, with a margin for the shader's rounding, its heights on both levels, NaN for none, and
/// where it is drawn at least and at most.
#[derive(Clone, Copy, Debug)]
struct Corner {
    low: f64,
    high: f64,
    h: f64,
    c: f64,
    sights: [Sight; 2],
}

impl Corner {
    /// Whether it is void for certain, and its triangles are holes.
    fn is_void(&self) -> bool {
        match (self.h.is_nan(), self.c.is_nan()) {
            (true, true) => true,
            (true, false) => self.high < 1.0,
            (false, true) => self.low == 1.0,
            (false, false) => false,
        }
    }
}

impl Strays<'_> {
    /// An upper bound of the pixels that a patch strays by, at little cost; infinite where it takes a look at it.
    pub(super) fn at_most_px(&self, patch: Patch, still: bool) -> f64 {
        let [own, parent] = self.infos(patch);
        let lies = if still { Lies::Own } else { self.lies(patch) };
        let Some(known) = self.known(patch, lies, own, parent) else {
            return f64::INFINITY;
        };
        let px = self.boxed_px(patch, &known);
        if px.is_nan() { f64::INFINITY } else { px }
    }

    /// How far a patch strays.
    pub(super) fn of(&self, patch: Patch) -> Option<Stray> {
        let [own, parent] = self.infos(patch);
        // Of a wholly void patch only what lies on the parent's surface is drawn.
        let lies = match self.lies(patch) {
            Lies::Between(_) if own.is_some_and(|p| p.bounds.is_void()) => Lies::Coarser,
            lies => lies,
        };
        let known = self.known(patch, lies, own, parent)?;
        match self.corners(patch, lies) {
            Some(corners) => Some(self.by_triangles(&corners, &known)),
            None if known.ragged => None,
            None => Some(Stray {
                error_m: known.most_m,
                error_px: self.boxed_px(patch, &known),
            }),
        }
    }

    /// What is known of a patch and of its parent.
    fn infos(&self, patch: Patch) -> [Option<&PatchInfo>; 2] {
        let parent = self.scene.has_coarser(patch.level).then(|| patch.parent());
        [Some(patch), parent].map(|patch| patch.and_then(|p| self.scene.info(p)))
    }

    fn known(
        &self,
        patch: Patch,
        lies: Lies,
        own: Option<&PatchInfo>,
        parent: Option<&PatchInfo>,
    ) -> Option<Known> {
        // A wholly void patch is nowhere, so it is nowhere wrong.
        let error = |info: &PatchInfo| f64::from(info.bounds.error).max(0.0) * self.terms.errors;
        let of_one = |info: &PatchInfo| Known {
            lies,
            errors: [error(info); 2],
            heights: [info.bounds.min, info.bounds.max],
            truth: [f64::NAN; 2],
            most_m: error(info),
            rounding_m: 0.0,
            ragged: false,
        };
        let [low, high] = match lies {
            Lies::Own => return own.map(of_one),
            Lies::Coarser => return parent.map(of_one),
            Lies::Between(alphas) => alphas,
        };
        let (own, parent) = (own?, parent?);
        let (e, f) = (error(own), error(parent));
        let heights = hull([Some(own), Some(parent)]);
        let truth = [own.bounds.need_min, own.bounds.need_max];
        let ragged = own.voids || parent.voids || self.scene.over_the_edge(patch);
        let strays = if ragged {
            // `min` and `max` leave out what is not known, a difference with it is NaN and counts as nothing.
            let range = f64::from(heights[1].max(truth[1])) - f64::from(heights[0].min(truth[0]));
            e.max(f) + range.max(0.0)
        } else {
            let at = |alpha: f64| e + alpha * (f - e);
            let blend = at(low).max(at(high)) + (high - low) * (e + f) / 2.0;
            blend.min(e + high * (e + f)).min(f + (1.0 - low) * (e + f))
        };
        let greatest = [own, parent]
            .into_iter()
            .flat_map(|p| [p.bounds.min.abs(), p.bounds.max.abs()])
            .fold(0.0, f32::max);
        let rounding_m = f64::from(greatest) * 2f64.powi(-22);
        Some(Known {
            lies,
            errors: [e, f],
            heights,
            truth: truth.map(f64::from),
            most_m: strays + rounding_m,
            rounding_m,
            ragged,
        })
    }

    /// Pixels by the box of a patch, in metres from the eye as drawn.
    fn boxed_px(&self, patch: Patch, known: &Known) -> f64 {
        let [low, high] = self.scene.patch_box(patch, known.heights);
        self.screen
            .seen_px(low, high, known.most_m * self.scene.vertical_scale.abs())
    }

    fn by_triangles(&self, corners: &[[Corner; SIDE]; SIDE], known: &Known) -> Stray {
        let mut worst = Stray {
            error_m: 0.0,
            error_px: 0.0,
        };
        for z in 0..SIDE - 1 {
            for x in 0..SIDE - 1 {
                let (nw, se) = (&corners[z][x], &corners[z + 1][x + 1]);
                for third in [&corners[z][x + 1], &corners[z + 1][x]] {
                    let triangle = [nw, third, se];
                    if triangle.iter().any(|c| c.is_void()) {
                        continue;
                    }
                    let error_m = self.triangle_m(triangle, known);
                    worst.error_m = worst.error_m.max(error_m);
                    let sights = triangle.map(|c| c.sights);
                    let drawn_m = error_m * self.scene.vertical_scale.abs();
                    let px = self.screen.seen_among_px(sights.as_flattened(), drawn_m);
                    worst.error_px = worst.error_px.max(px);
                }
            }
        }
        worst
    }

    fn triangle_m(&self, corners: [&Corner; 3], known: &Known) -> f64 {
        let [e, f] = known.errors;
        match known.lies {
            Lies::Own => return e,
            Lies::Coarser => return f,
            Lies::Between(_) => {}
        }
        // A step of NaN is that of a corner without one of the two, which `max` and `min` leave out.
        let greatest = |weight: fn(&Corner) -> f64| {
            let weighted = corners.iter().map(|c| weight(c) * (c.c - c.h).abs());
            weighted.fold(0.0, f64::max)
        };
        let by_own = || e + greatest(|c| c.high);
        let by_coarser = || f + greatest(|c| 1.0 - c.low);
        let has = |height: fn(&Corner) -> f64| corners.iter().all(|c| !height(c).is_nan());
        let strays = match (has(|c| c.h), has(|c| c.c)) {
            (true, true) => self.blend_m(corners, known).min(by_own()).min(by_coarser()),
            (true, false) => by_own(),
            (false, true) => by_coarser(),
            (false, false) => {
                let [lowest, highest] = known.truth;
                let heights = corners.iter().flat_map(|c| [c.h, c.c]);
                let strays = heights.flat_map(|height| [height - lowest, highest - height]);
                strays.fold(0.0, f64::max)
            }
        };
        (strays + known.rounding_m).min(known.most_m)
    }

    /// What 2 and 3 of the head of this file allow on a triangle that has both surfaces.
    fn blend_m(&self, corners: [&Corner; 3], known: &Known) -> f64 {
        let [e, f] = known.errors;
        let low = corners.iter().fold(1.0, |low, c| c.low.min(low));
        let high = corners.iter().fold(0.0, |high, c| c.high.max(high));
        let steps = || corners.iter().map(|c| c.c - c.h);
        let least = steps().fold(f64::INFINITY, f64::min);
        let most = steps().fold(f64::NEG_INFINITY, f64::max);
        let at = |alpha: f64| e + alpha * (f - e);
        let covariance = (high - low) * (most - least) / 4.0;
        at(low).max(at(high)) + if self.terms.covariance { covariance } else { 0.0 }
    }

    /// What is known of a patch's corners; none where samples that count have not arrived.
    fn corners(&self, patch: Patch, lies: Lies) -> Option<[[Corner; SIDE]; SIDE]> {
        let nothing = Corner {
            low: 0.0,
            high: 0.0,
            h: f64::NAN,
            c: f64::NAN,
            sights: [self.screen.sight(DVec3::ZERO); 2],
        };
        let mut corners = [[nothing; SIDE]; SIDE];
        for (z, row) in corners.iter_mut().enumerate() {
            for (x, corner) in row.iter_mut().enumerate() {
                *corner = self.corner(patch, lies, [x as i64, z as i64])?;
            }
        }
        Some(corners)
    }

    fn corner(&self, patch: Patch, lies: Lies, [x, z]: [i64; 2]) -> Option<Corner> {
        let (view, level) = (
            self.clipmap.view_constants(),
            &self.clipmap.level_constants()[patch.level as usize],
        );
        let i = (patch.a * PATCH + x).min(i64::from(level.last[0]));
        let j = (patch.b * PATCH + z).min(i64::from(level.last[1]));
        let [low, high] = match lies {
            Lies::Own => [0.0; 2],
            Lies::Coarser => [1.0; 2],
            Lies::Between(_) => {
                let d = self.scene.distance(patch.level, i, j);
                let held = alpha::held(
                    self.scene.held,
                    level.parent_last,
                    patch.level,
                    i as i32,
                    j as i32,
                );
                [d - MARGIN, d + MARGIN].map(|d| f64::from(alpha::ring(view, d as f32).max(held)))
            }
        };
        let at = |level: u32, i: i64, j: i64| self.scene.windows[level as usize].height(i, j).map(f64::from);
        let c = if lies == Lies::Own {
            f64::NAN
        } else {
            let c0 = at(patch.level + 1, i >> 1, j >> 1)?;
            let c1 = at(patch.level + 1, (i + 1) >> 1, (j + 1) >> 1)?;
            c0 * 0.5 + c1 * 0.5
        };
        let h = match lies {
            Lies::Coarser => f64::NAN,
            _ => match at(patch.level, i, j) {
                None if low == 1.0 => f64::NAN, // drawn as c, whatever it is
                known => known?,
            },
        };
        let drawn = match (h.is_nan(), c.is_nan()) {
            (true, _) => [c, c],
            (_, true) => [h, h],
            _ => [low, high].map(|alpha| h + alpha * (c - h)),
        };
        let sights = drawn.map(|height| self.screen.sight(self.scene.place(patch.level, [i, j], height)));
        Some(Corner {
            low,
            high,
            h,
            c,
            sights,
        })
    }

    /// By what alpha is on all of a patch.
    fn lies(&self, patch: Patch) -> Lies {
        if !self.scene.has_coarser(patch.level) {
            return Lies::Own;
        }
        let (view, level) = (
            self.clipmap.view_constants(),
            &self.clipmap.level_constants()[patch.level as usize],
        );
        let [nearest, farthest] = self.scene.distances(patch);
        let [low, high] = [nearest - MARGIN, farthest + MARGIN].map(|d| alpha::ring(view, d as f32));
        let ends = |first: i64, last: i32| {
            let first = (first * PATCH) as i32;
            [first.min(last), (first + PATCH as i32).min(last)]
        };
        let (x, z) = (ends(patch.a, level.last[0]), ends(patch.b, level.last[1]));
        // Bilinear over the patch: least and greatest at its corners.
        let held = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[u, v]: [usize; 2]| {
            alpha::held(self.scene.held, level.parent_last, patch.level, x[u], z[v])
        });
        let low = low.max(held.into_iter().fold(1.0, f32::min));
        let high = high.max(held.into_iter().fold(0.0, f32::max));
        if low == 1.0 {
            Lies::Coarser
        } else if high == 0.0 {
            Lies::Own
        } else {
            Lies::Between([low, high].map(f64::from))
        }
    }
}
