//! The certificate: before a frame is drawn, how wrong it can be anywhere, in pixels.
//!
//! It is the greatest, over the patches to be drawn, of what [`Screen`] says a vertical segment spans whose drawn end is
//! seen in the patch's box and whose length is at most e, an upper bound of `|D - S0|` over the patch: D is the drawn
//! surface, S0 the DEM's own. It speaks of places where both exist, not of silhouettes or shading.
//!
//! *e, from the stored errors.* On a triangle of the patch, of level l, let a = `S_l`, b = `S_{l+1}`, d = b - a, all linear
//! on it, and let the corners have weights w at the place, and alphas in `[low, high]`, `v = high - low`. D is
//! `sum w (a_i + alpha_i d_i)`. With A the mean of alpha by w:
//!
//! 1. `D = (1 - A) a + A b + sum w (alpha_i - A) d_i`, which is the covariance of alpha and d over the corners.
//! 2. `|(1 - A) a + A b - S0| <= (1 - A) E + A F`, as `|a - S0| <= E` and `|b - S0| <= F`, the stored errors of the patch
//!    and of its parent: at most the greater of that at `low` and that at `high`.
//! 3. `|covariance| <= v (max d - min d) / 4` (Gruess 1935) and `|d_i| <= E + F` at the corners, so it is at most
//!    `v (E + F) / 2`. At a corner beyond the DEM's edge there is no S0, and where alpha is steep that is much: there d is
//!    taken from the windows' samples, triangle by triangle.
//! 4. Across one cell, v is at most `high - low` over the patch, and at most the greater of what the ring and the held
//!    field change: of two functions, the greater changes by no more than one of them. The ring changes by 1 / T a step; the
//!    field, bilinear, by the greatest differences of its ends along each axis.
//!
//! *Voids.* Where a corner lacks a or b, the vertex function draws the other, so patches with voids are looked at triangle
//! by triangle too. Where all corners have their a but not all their b, one without b counts as alpha 0, and `|D - a|` is at
//! most the greatest `alpha_i |d_i|` of the others. Where all have their b but not all their a, one without a is drawn
//! only at alpha 1, and `|D - b|` is at most the greatest `(1 - alpha_i) |d_i|`. Where a triangle has neither surface and
//! is drawn all the same, e is how far its corners are from the highest or lowest that S0 is there.
//!
//! *Rounding.* Where alpha is 0 or 1 a vertex is drawn at the height of which the stored error speaks. Else the vertex
//! function rounds by at most `2^-23 (|h| + |c|)`, which is added to e. What f32 does on the way from a vertex to a pixel
//! belongs to the floor of what is measured ([`crate::accuracy`]).

use super::alpha::{self, MARGIN};
use super::screen::Screen;
use super::selection::{Scene, hull};
use super::window::PatchInfo;
use super::{Clipmap, no_frame};
use crate::error::Result;
use crate::grid::{PATCH, Patch};

/// What a frame promises of itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Certificate {
    /// An upper bound of the frame's error in pixels, or why there is none.
    pub error_px: std::result::Result<f64, Uncertified>,
    /// The patch that decides it; none where nothing is drawn.
    pub patch: Option<Patch>,
}

impl Certificate {
    /// Whether the frame is certified to err by at most `max_error_px` pixels.
    pub fn keeps(&self, max_error_px: f64) -> bool {
        self.error_px.is_ok_and(|px| px <= max_error_px)
    }
}

/// Why a frame has no certificate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Uncertified {
    /// The DEM's own surface may reach the camera plane where the drawn one is seen.
    CameraPlane,
    /// Bounds of what is drawn have not arrived.
    Missing,
    /// What is drawn stands in for data that are not there yet.
    Provisional,
}

impl Uncertified {
    /// The reason in words.
    pub fn reason(self) -> &'static str {
        match self {
            Self::CameraPlane => "the error may reach the camera plane",
            Self::Missing => "bounds of what is drawn have not arrived",
            Self::Provisional => "what is drawn is provisional",
        }
    }
}

/// What the bound is made of, to leave some of it out: controls of tests.
#[doc(hidden)]
#[derive(Clone, Copy, Debug)]
pub struct Terms {
    /// Factor on the stored errors.
    pub errors: f64,
    /// Whether the covariance counts.
    pub covariance: bool,
}

impl Default for Terms {
    fn default() -> Self {
        Self {
            errors: 1.0,
            covariance: true,
        }
    }
}

/// The certificate of the frame that the last update of `clipmap` made.
///
/// # Errors
/// [`crate::ErrorKind::Misuse`] where it was never updated, or its last update failed.
pub fn certify(clipmap: &Clipmap) -> Result<Certificate> {
    certify_by(clipmap, Terms::default())
}

/// The same with some of the bound left out: controls of tests.
///
/// # Errors
/// As [`certify`].
#[doc(hidden)]
pub fn certify_by(clipmap: &Clipmap, terms: Terms) -> Result<Certificate> {
    let frame = Frame::new(clipmap, terms)?;
    if clipmap.report.provisional {
        return Ok(Certificate {
            error_px: Err(Uncertified::Provisional),
            patch: None,
        });
    }
    let mut certificate = Certificate {
        error_px: Ok(0.0),
        patch: None,
    };
    for instance in clipmap.selection.instances() {
        let patch = instance.patch();
        let error_px = frame.patch_px(patch);
        match (certificate.error_px, error_px) {
            (Ok(greatest), Ok(px)) if px <= greatest && certificate.patch.is_some() => {}
            (Err(_), Ok(_)) => {}
            _ => {
                certificate = Certificate {
                    error_px,
                    patch: Some(patch),
                };
            }
        }
    }
    Ok(certificate)
}

/// What is certified of one patch.
#[doc(hidden)]
#[derive(Clone, Copy, Debug)]
pub struct CertifiedPatch {
    /// The patch.
    pub patch: Patch,
    /// How far its surface may stray, in metres; none where bounds have not arrived.
    pub error_m: Option<f64>,
    /// The same in pixels.
    pub error_px: std::result::Result<f64, Uncertified>,
}

/// The certificate patch by patch of the selection: for tests.
///
/// # Errors
/// As [`certify`].
#[doc(hidden)]
pub fn certified_patches(clipmap: &Clipmap, terms: Terms) -> Result<Vec<CertifiedPatch>> {
    let frame = Frame::new(clipmap, terms)?;
    let certified = |patch| CertifiedPatch {
        patch,
        error_m: frame.drawn_error_m(patch),
        error_px: frame.patch_px(patch),
    };
    Ok(clipmap
        .selection
        .instances()
        .map(|i| certified(i.patch()))
        .collect())
}

struct Frame<'a> {
    clipmap: &'a Clipmap,
    scene: Scene<'a>,
    screen: &'a Screen,
    terms: Terms,
}

/// Alpha over a patch.
#[derive(Clone, Copy, Debug)]
struct Alphas {
    low: f64,
    high: f64,
    /// The most that it changes across one cell.
    across: f64,
}

impl<'a> Frame<'a> {
    fn new(clipmap: &'a Clipmap, terms: Terms) -> Result<Self> {
        let (Some(scene), Some(screen)) = (clipmap.scene(), clipmap.screen.as_ref()) else {
            return Err(no_frame("that could be certified"));
        };
        Ok(Self {
            clipmap,
            scene,
            screen,
            terms,
        })
    }

    fn patch_px(&self, patch: Patch) -> std::result::Result<f64, Uncertified> {
        let error_m = self.drawn_error_m(patch).ok_or(Uncertified::Missing)?;
        let [low, high] = self.scene.patch_box(patch, hull(self.infos(patch)));
        let px = self
            .screen
            .seen_px(low, high, error_m * self.scene.vertical_scale.abs());
        if px.is_finite() {
            Ok(px)
        } else {
            Err(Uncertified::CameraPlane)
        }
    }

    /// What is known of a patch and of its parent.
    fn infos(&self, patch: Patch) -> [Option<&PatchInfo>; 2] {
        let parent = self.scene.has_coarser(patch.level).then(|| patch.parent());
        [Some(patch), parent].map(|patch| patch.and_then(|p| self.scene.info(p)))
    }

    fn drawn_error_m(&self, patch: Patch) -> Option<f64> {
        let [own, parent] = self.infos(patch);
        self.error_m(patch, own, parent)
    }

    /// e: the most by which the drawn surface may be off, in metres; none where bounds that count are not there.
    fn error_m(&self, patch: Patch, own: Option<&PatchInfo>, parent: Option<&PatchInfo>) -> Option<f64> {
        // A wholly void patch is nowhere, so it is nowhere wrong.
        let error = |info: &PatchInfo| f64::from(info.bounds.error).max(0.0) * self.terms.errors;
        let alphas = self.alphas(patch);
        if alphas.high == 0.0 {
            return own.map(error);
        }
        let parent = parent?;
        // Of a wholly void patch only what lies on the parent's surface is drawn.
        if alphas.low == 1.0 || own.is_some_and(|p| p.bounds.is_void()) {
            return Some(error(parent));
        }
        let own = own?;
        let (e, f) = (error(own), error(parent));
        let steep = alphas.across > STEEP;
        let morphed = if steep || own.voids || parent.voids || self.scene.over_the_edge(patch) {
            self.by_triangles(patch, e, f, own)?
        } else {
            let covariance = alphas.across * (e + f) / 2.0;
            blend(e, f, alphas) + if self.terms.covariance { covariance } else { 0.0 }
        };
        let greatest = [own, parent]
            .into_iter()
            .flat_map(|p| [p.bounds.min.abs(), p.bounds.max.abs()])
            .fold(0.0, f32::max);
        Some(morphed + f64::from(greatest) * 2f64.powi(-22))
    }

    /// The same by the patch's triangles and the windows' samples; none where one that counts has not arrived.
    fn by_triangles(&self, patch: Patch, e: f64, f: f64, own: &PatchInfo) -> Option<f64> {
        let truth = [own.bounds.need_min, own.bounds.need_max].map(f64::from);
        let corners: [[Option<Corner>; SIDE]; SIDE] =
            std::array::from_fn(|z| std::array::from_fn(|x| self.corner(patch, x as i64, z as i64)));
        let mut worst = 0.0f64;
        for z in 0..SIDE - 1 {
            for x in 0..SIDE - 1 {
                for third in [corners[z][x + 1], corners[z + 1][x]] {
                    let triangle = match (corners[z][x], third, corners[z + 1][x + 1]) {
                        (Some(nw), Some(third), Some(se)) => [nw, third, se],
                        _ => return None,
                    };
                    worst = worst.max(self.triangle_m(&triangle, e, f, truth));
                }
            }
        }
        Some(worst)
    }

    fn triangle_m(&self, corners: &[Corner; 3], e: f64, f: f64, truth: [f64; 2]) -> f64 {
        if corners.iter().any(Corner::is_void) {
            return 0.0;
        }
        let alphas = Alphas {
            low: corners.iter().fold(1.0, |low, c| c.low.min(low)),
            high: corners.iter().fold(0.0, |high, c| c.high.max(high)),
            across: 0.0,
        };
        let steps = || corners.iter().map(|c| c.c - c.h);
        // A step of NaN is that of a corner without one of the two, which `max` and `min` leave out.
        let greatest = |weight: fn(&Corner) -> f64| {
            let weighted = corners.iter().map(|c| weight(c) * (c.c - c.h).abs());
            weighted.fold(0.0, f64::max)
        };
        let has = |height: fn(&Corner) -> f64| corners.iter().all(|c| !height(c).is_nan());
        match (has(|c| c.h), has(|c| c.c)) {
            (true, true) => {
                let [least, most] = steps().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], d| {
                    [low.min(d), high.max(d)]
                });
                let covariance = (alphas.high - alphas.low) * (most - least) / 4.0;
                blend(e, f, alphas) + if self.terms.covariance { covariance } else { 0.0 }
            }
            (true, false) => e + greatest(|c| c.high),
            (false, true) => f + greatest(|c| 1.0 - c.low),
            (false, false) => corners
                .iter()
                .flat_map(|c| [c.h, c.c])
                .flat_map(|height| [height - truth[0], truth[1] - height])
                .fold(0.0, f64::max),
        }
    }

    /// What is known of a patch's corner; none where samples that count have not arrived.
    fn corner(&self, patch: Patch, x: i64, z: i64) -> Option<Corner> {
        let (view, level) = (
            self.clipmap.view_constants(),
            &self.clipmap.level_constants()[patch.level as usize],
        );
        let i = (patch.a * PATCH + x).min(i64::from(level.last[0]));
        let j = (patch.b * PATCH + z).min(i64::from(level.last[1]));
        let d = self.scene.distance(patch.level, i, j);
        let held = alpha::held(
            self.scene.held,
            level.parent_last,
            patch.level,
            i as i32,
            j as i32,
        );
        let [low, high] = [d - MARGIN, d + MARGIN].map(|d| f64::from(alpha::ring(view, d as f32).max(held)));
        let at = |level: u32, i: i64, j: i64| self.scene.windows[level as usize].height(i, j).map(f64::from);
        let c0 = at(patch.level + 1, i >> 1, j >> 1)?;
        let c1 = at(patch.level + 1, (i + 1) >> 1, (j + 1) >> 1)?;
        let h = match at(patch.level, i, j) {
            None if low == 1.0 => f64::NAN, // drawn as c, whatever it is
            known => known?,
        };
        Some(Corner {
            low,
            high,
            h,
            c: c0 * 0.5 + c1 * 0.5,
        })
    }

    fn alphas(&self, patch: Patch) -> Alphas {
        if !self.scene.has_coarser(patch.level) {
            return Alphas {
                low: 0.0,
                high: 0.0,
                across: 0.0,
            };
        }
        let (view, level) = (
            self.clipmap.view_constants(),
            &self.clipmap.level_constants()[patch.level as usize],
        );
        let [nearest, farthest] = self.scene.distances(patch);
        let [low, high] =
            [nearest - MARGIN, farthest + MARGIN].map(|d| f64::from(alpha::ring(view, d as f32)));
        let ring_across = if view.transition == 0.0 {
            high - low
        } else {
            ((1.0 + 2.0 * MARGIN) / f64::from(view.transition)).min(high - low)
        };
        let ends = |first: i64, last: i32| {
            let first = (first * PATCH) as i32;
            [first.min(last), (first + PATCH as i32).min(last)]
        };
        let (x, z) = (ends(patch.a, level.last[0]), ends(patch.b, level.last[1]));
        let held = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[u, v]: [usize; 2]| {
            let value = alpha::held(self.scene.held, level.parent_last, patch.level, x[u], z[v]);
            f64::from(value)
        });
        let [nw, ne, sw, se] = held;
        let steps = |ends: [i32; 2]| f64::from((ends[1] - ends[0]).max(1));
        let held_across =
            (nw - ne).abs().max((sw - se).abs()) / steps(x) + (nw - sw).abs().max((ne - se).abs()) / steps(z);
        let least = held.into_iter().fold(1.0, f64::min);
        let greatest = held.into_iter().fold(0.0, f64::max);
        let (low, high) = (low.max(least), high.max(greatest));
        Alphas {
            low,
            high,
            across: ring_across.max(held_across).min(high - low),
        }
    }
}

/// Where alpha changes by more across a cell, a patch is looked at triangle by triangle: below it the covariance is small
/// beside the errors.
const STEEP: f64 = 0.1;

/// Corners along a patch's side.
const SIDE: usize = PATCH as usize + 1;

/// A corner of a patch: its alpha, with a margin for the shader's rounding, and its heights on both levels, NaN for none.
#[derive(Clone, Copy, Debug)]
struct Corner {
    low: f64,
    high: f64,
    h: f64,
    c: f64,
}

impl Corner {
    /// Whether it is void for certain, and its triangles are holes.
    fn is_void(&self) -> bool {
        (self.h.is_nan() && self.high < 1.0) || (self.c.is_nan() && self.low == 1.0)
    }
}

/// The greatest of the two errors' blends over a patch's alphas.
fn blend(e: f64, f: f64, alphas: Alphas) -> f64 {
    let at = |alpha: f64| e + alpha * (f - e);
    at(alphas.low).max(at(alphas.high))
}
