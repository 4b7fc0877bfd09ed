//! What a clipmap consists of, to be read: what it covers, what is resident, and the frame of its last update.

use super::Clipmap;
use super::constants::{LevelConstants, Ring, ViewConstants};
use super::eye::Eye;
use super::held::HeldField;
use super::plan::UpdatePlan;
use super::report::UpdateReport;
use super::scene::Scene;
use super::selection::Selection;
use super::window::Window;
use crate::grid::Grid;

impl Clipmap {
    /// A number that no other clipmap of this process has, clones included.
    pub fn identity(&self) -> u64 {
        self.identity.get()
    }

    /// Where the samples lie.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Clip size and transition.
    pub fn ring(&self) -> &Ring {
        &self.ring
    }

    /// Factor on heights relative to the eye.
    pub fn vertical_scale(&self) -> f64 {
        self.vertical_scale
    }

    /// Whether the light texels hold traced light.
    pub fn has_light(&self) -> bool {
        self.has_light
    }

    /// Whether the windows hold light over a day: the terrain has it, and [`ClipmapOptions::day`](super::ClipmapOptions::day)
    /// asked for it.
    pub fn has_day(&self) -> bool {
        self.has_day
    }

    /// Least and greatest height of the DEM in metres above its base; 0 where it has none.
    pub fn height_range_m(&self) -> [f32; 2] {
        self.range_m
    }

    /// The windows, finest first.
    pub fn windows(&self) -> &[Window] {
        &self.windows
    }

    /// What holds levels back from being drawn.
    pub fn held(&self) -> &HeldField {
        &self.held
    }

    /// The same, to break it on purpose: controls of tests.
    #[doc(hidden)]
    pub fn held_mut(&mut self) -> &mut HeldField {
        &mut self.held
    }

    /// What the last update wrote.
    pub fn plan(&self) -> &UpdatePlan {
        &self.plan
    }

    /// Counts updates: [`Clipmap::plan`] leads from the one before to this one.
    pub fn generation(&self) -> u64 {
        self.generation
    }

    /// The frame's constants.
    pub fn view_constants(&self) -> &ViewConstants {
        &self.view_constants
    }

    /// The levels' constants, finest first.
    pub fn level_constants(&self) -> &[LevelConstants] {
        &self.level_constants
    }

    /// The patches to draw.
    pub fn selection(&self) -> &Selection {
        &self.selection
    }

    /// The promised error in pixels, where one is.
    pub fn max_error_px(&self) -> Option<f64> {
        self.max_error_px
    }

    /// The selection's scene of the last update, without a frustum; none before the first, and after one that failed.
    pub(super) fn scene(&self) -> Option<Scene<'_>> {
        Some(Scene {
            grid: &self.grid,
            ring: &self.ring,
            eye: self.eye.as_ref()?,
            windows: &self.windows,
            levels: &self.level_constants,
            held: &self.held,
            frustum: None,
            occlusion: None,
            vertical_scale: self.vertical_scale,
        })
    }

    /// The eye of the last update; none before the first, and after one that failed.
    pub fn eye(&self) -> Option<&Eye> {
        self.eye.as_ref()
    }

    /// What the GPU is told of a frame, to be broken on purpose by tests whose controls must catch it.
    #[doc(hidden)]
    pub fn frame_mut(&mut self) -> (&mut ViewConstants, &mut [LevelConstants], &mut Selection) {
        (
            &mut self.view_constants,
            &mut self.level_constants,
            &mut self.selection,
        )
    }

    /// What the last update did.
    pub fn report(&self) -> &UpdateReport {
        &self.report
    }
}
