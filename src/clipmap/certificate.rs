//! The certificate: before a frame is drawn, how wrong it can be anywhere, in pixels.
//!
//! It is the greatest, over the triangles of the patches to be drawn, of what [`super::Screen`] says a vertical segment
//! spans whose drawn end is seen on the triangle and whose length is at most e, the most by which the drawn surface may
//! stray there from the DEM's own (`stray.rs`). It speaks of places where both exist, not of silhouettes or shading.
//!
//! *In few steps.* What a patch's box and stored errors allow is no less than what its triangles do, and costs far
//! less. So all patches are bounded by their boxes, and those that allow most are looked at triangle by triangle,
//! until what remains allows no more than what was found.
//!
//! *A box holds its triangles*, e on them is at most that of the patch, and [`super::Screen`]'s bounds rise with both.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::stray::{Stray, Strays};
use super::{Clipmap, no_frame};
use crate::error::Result;
use crate::grid::Patch;

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
    let strays = strays(clipmap, terms)?;
    if clipmap.report.provisional {
        return Ok(Certificate {
            error_px: Err(Uncertified::Provisional),
            patch: None,
        });
    }
    let mut suspects: BinaryHeap<Suspect> = suspects(clipmap, &strays).collect();
    let mut certificate = Certificate {
        error_px: Ok(0.0),
        patch: suspects.peek().map(|s| s.patch),
    };
    let mut found_px = -1.0;
    let counts = |s: &Suspect, found_px: f64| s.at_most_px > found_px || s.at_most_px == f64::INFINITY;
    while let Some(suspect) = suspects.pop().filter(|s| counts(s, found_px)) {
        let error_px = pixels(strays.of(suspect.patch));
        let px = error_px.unwrap_or(f64::INFINITY);
        // That data are missing is said rather than that a plane is reached.
        if px > found_px || error_px == Err(Uncertified::Missing) {
            found_px = px;
            certificate = Certificate {
                error_px,
                patch: Some(suspect.patch),
            };
        }
    }
    Ok(certificate)
}

/// A patch that may decide.
#[derive(Clone, Copy, Debug)]
struct Suspect {
    at_most_px: f64,
    patch: Patch,
    /// By which of two that may be as wrong is looked at first.
    order: usize,
}

impl PartialEq for Suspect {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Suspect {}

impl PartialOrd for Suspect {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Suspect {
    fn cmp(&self, other: &Self) -> Ordering {
        let by_px = self.at_most_px.total_cmp(&other.at_most_px);
        by_px.then(other.order.cmp(&self.order))
    }
}

fn strays(clipmap: &Clipmap, terms: Terms) -> Result<Strays<'_>> {
    let (Some(scene), Some(screen)) = (clipmap.scene(), clipmap.screen.as_ref()) else {
        return Err(no_frame("that could be certified"));
    };
    Ok(Strays {
        clipmap,
        scene,
        screen,
        terms,
    })
}

fn suspects(clipmap: &Clipmap, strays: &Strays<'_>) -> impl Iterator<Item = Suspect> {
    let still = clipmap.selection.still.len();
    let instances = clipmap.selection.instances().enumerate();
    instances.map(move |(order, instance)| {
        let patch = instance.patch();
        Suspect {
            at_most_px: strays.at_most_px(patch, order < still),
            patch,
            order,
        }
    })
}

fn pixels(stray: Option<Stray>) -> std::result::Result<f64, Uncertified> {
    match stray {
        None => Err(Uncertified::Missing),
        Some(stray) if stray.error_px.is_finite() => Ok(stray.error_px),
        Some(_) => Err(Uncertified::CameraPlane),
    }
}

/// What is certified of one patch.
#[doc(hidden)]
#[derive(Clone, Copy, Debug)]
pub struct CertifiedPatch {
    /// The patch.
    pub patch: Patch,
    /// How far its surface may stray, in metres; none where bounds have not arrived.
    pub error_m: Option<f64>,
    /// The same in pixels, as far as it is seen.
    pub error_px: std::result::Result<f64, Uncertified>,
    /// What its box and stored errors allow in pixels.
    pub at_most_px: f64,
}

/// The certificate patch by patch of the selection: for tests.
///
/// # Errors
/// As [`certify`].
#[doc(hidden)]
pub fn certified_patches(clipmap: &Clipmap, terms: Terms) -> Result<Vec<CertifiedPatch>> {
    let strays = strays(clipmap, terms)?;
    let certified = |suspect: Suspect| {
        let stray = strays.of(suspect.patch);
        CertifiedPatch {
            patch: suspect.patch,
            error_m: stray.map(|s| s.error_m),
            error_px: pixels(stray),
            at_most_px: suspect.at_most_px,
        }
    };
    Ok(suspects(clipmap, &strays).map(certified).collect())
}
