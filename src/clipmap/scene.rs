//! What a walk over the patches looks at, and what it asks of a patch.

use glam::DVec3;

use super::alpha::MARGIN;
use super::constants::{LevelConstants, Ring};
use super::extent::Extent;
use super::eye::Eye;
use super::frustum::Frustum;
use super::held::HeldField;
use super::occlusion::Slack;
use super::window::{PatchInfo, Window};
use crate::grid::{Grid, PATCH, Patch, Rect};

/// What the walk looks at.
pub struct Scene<'a> {
    /// Where the samples lie.
    pub grid: &'a Grid,
    /// Clip size and transition.
    pub ring: &'a Ring,
    /// The eye.
    pub eye: &'a Eye,
    /// A window per level, finest first.
    pub windows: &'a [Window],
    /// The levels' constants, finest first.
    pub levels: &'a [LevelConstants],
    /// What holds levels back.
    pub held: &'a HeldField,
    /// What is seen; none to select without culling.
    pub frustum: Option<&'a Frustum>,
    /// How much room is kept beside ground that hides other ground; none where nothing is left out for that.
    pub(super) occlusion: Option<Slack>,
    /// Factor on heights relative to the eye.
    pub vertical_scale: f64,
}

impl Scene<'_> {
    /// The patches of the coarsest level: all of them, or those wholly in its window where finer levels are all that
    /// was asked for.
    pub(super) fn roots(&self) -> Rect {
        let window = &self.windows[self.windows.len() - 1];
        let level = self.grid.level(window.level());
        let resident = window.resident();
        if resident == level.rect() {
            return level.patches().rect();
        }
        let inner =
            |first: i64, end: i64| ((first + PATCH - 1).div_euclid(PATCH), (end - 1).div_euclid(PATCH));
        let (x0, mut x1) = inner(resident.x0, resident.x1);
        let (z0, mut z1) = inner(resident.z0, resident.z1);
        // The last patch ends where the level does, which need not be a whole patch on.
        if resident.x1 == level.width {
            x1 = level.patches().width;
        }
        if resident.z1 == level.height {
            z1 = level.patches().height;
        }
        Rect::new(x0, z0, x1, z1)
    }

    pub(super) fn has_coarser(&self, level: u32) -> bool {
        level as usize + 1 < self.windows.len()
    }

    pub(super) fn exists(&self, patch: Patch) -> bool {
        self.grid.patches(patch.level).rect().contains(patch.a, patch.b)
    }

    pub(super) fn info(&self, patch: Patch) -> Option<&PatchInfo> {
        self.windows[patch.level as usize].patch(patch.a, patch.b)
    }

    pub(super) fn eye_in_patches(&self, level: u32) -> [f64; 2] {
        self.eye.samples().map(|s| s / (PATCH << level) as f64)
    }

    /// Whether the patch's four children are drawn instead of it: unless alpha of their level is 1 on all of it.
    /// A function of the view and the held field alone, not of what was culled or walked.
    pub fn refined(&self, patch: Patch) -> bool {
        if patch.level == 0 {
            return false;
        }
        let finer = patch.level - 1;
        let side = PATCH << patch.level;
        // Taken from the integer anchor first: exact, however far from the DEM's corner.
        let distance = |index: i64, axis: usize| {
            let first = (index * side - self.eye.anchor[axis]) as f64 - self.eye.fraction[axis];
            first.max(-(first + side as f64)).max(0.0)
        };
        let ground = distance(patch.a, 0).max(distance(patch.b, 1)) / (1i64 << finer) as f64;
        let d = ground.max(f64::from(self.levels[finer as usize].climb));
        d < self.ring.reach() as f64 + MARGIN
            && (self.held.is_quiet() || self.held.least(finer, patch.a, patch.b) < 1.0)
    }

    /// Whether all of a patch of the coarsest level is there: else nothing could be drawn in its place.
    pub(super) fn has_arrived(&self, root: Patch) -> bool {
        self.windows[root.level as usize].has_all_of(root.a, root.b)
    }

    /// Whether alpha may be 1 somewhere on a patch that is drawn; with a margin for what the shader rounds.
    pub(super) fn may_reach_1(&self, patch: Patch) -> bool {
        let parent = patch.parent();
        self.distances(patch)[1] > self.ring.reach() as f64 - MARGIN
            || (!self.held.is_quiet()
                && f64::from(self.held.greatest(patch.level, parent.a, parent.b)) > 1.0 - MARGIN)
    }

    /// Whether alpha may be other than 0 somewhere on a patch that is drawn; with a margin for what the shader rounds.
    pub(super) fn may_leave_0(&self, patch: Patch) -> bool {
        let parent = patch.parent();
        let start = (self.ring.reach() - self.ring.transition) as f64;
        self.has_coarser(patch.level)
            && (self.distances(patch)[1] > start - MARGIN
                || (!self.held.is_quiet() && self.held.greatest(patch.level, parent.a, parent.b) > 0.0))
    }

    /// The least and the greatest `d` on a patch, in steps of its level.
    pub(super) fn distances(&self, patch: Patch) -> [f64; 2] {
        let side = PATCH << patch.level;
        let axis = |index: i64, axis: usize| {
            let first = (index * side - self.eye.anchor[axis]) as f64 - self.eye.fraction[axis];
            let last = first + side as f64;
            [first.max(-last).max(0.0), first.abs().max(last.abs())]
        };
        let (x, z) = (axis(patch.a, 0), axis(patch.b, 1));
        let step = (1i64 << patch.level) as f64;
        let climb = f64::from(self.levels[patch.level as usize].climb);
        [0, 1].map(|end| (x[end].max(z[end]) / step).max(climb))
    }

    /// `d` of sample (i, j) of `level`, in steps of the level.
    pub(super) fn distance(&self, level: u32, i: i64, j: i64) -> f64 {
        let axis = |index: i64, axis: usize| {
            ((index << level) - self.eye.anchor[axis]) as f64 - self.eye.fraction[axis]
        };
        let ground = axis(i, 0).abs().max(axis(j, 1).abs()) / (1i64 << level) as f64;
        ground.max(f64::from(self.levels[level as usize].climb))
    }

    pub(super) fn borders_coarser(&self, patch: Patch, neighbour: Patch) -> bool {
        self.has_coarser(patch.level)
            && neighbour.parent() != patch.parent()
            && self.exists(neighbour)
            && !self.refined(neighbour.parent())
    }

    /// Whether a patch reaches over the DEM's edge. Its vertices end with its level's last samples, which lie on the edge
    /// or beyond it by less than a step.
    pub(super) fn over_the_edge(&self, patch: Patch) -> bool {
        let (size, level) = (self.grid.size, self.grid.level(patch.level));
        let end = |index: i64, samples: i64| ((index + 1) * PATCH).min(samples - 1) << patch.level;
        end(patch.a, level.width) > size.width - 1 || end(patch.b, level.height) > size.height - 1
    }

    /// The least and greatest height of anything that may be drawn of a patch and all below it.
    pub(super) fn subtree_heights(&self, patch: Patch) -> [f32; 2] {
        match self.info(patch) {
            // NaN: neither the patch nor anything handed up to it has a valid sample; drop nothing on that word.
            Some(info) if !info.bounds.need_min.is_nan() => [info.bounds.need_min, info.bounds.need_max],
            _ => [f32::NEG_INFINITY, f32::INFINITY],
        }
    }

    fn extent(&self) -> Extent<'_> {
        Extent {
            grid: self.grid,
            eye: self.eye,
            vertical_scale: self.vertical_scale,
        }
    }

    /// Low and high corner of a patch's box, in metres from the eye as drawn.
    pub(super) fn patch_box(&self, patch: Patch, heights: [f32; 2]) -> [DVec3; 2] {
        let (x, z) = (patch.a * PATCH, patch.b * PATCH);
        let ground = Rect::new(x, z, x + PATCH, z + PATCH);
        self.extent().of(patch.level, ground, heights)
    }

    /// Where sample (i, j) of `level` is drawn that is `height_m` above the DEM's base, in metres from the eye.
    pub(super) fn place(&self, level: u32, at: [i64; 2], height_m: f64) -> DVec3 {
        self.extent().place(level, at, height_m)
    }

    /// Whether something of what is drawn of a patch and all below it may be void, or is not known.
    pub(super) fn may_have_gaps(&self, patch: Patch) -> bool {
        self.info(patch).is_none_or(|info| info.voids || info.voids_below)
    }
}

/// The least and greatest height of what is drawn between two levels' patches; NaN where both are void.
pub(super) fn hull(infos: [Option<&PatchInfo>; 2]) -> [f32; 2] {
    infos
        .into_iter()
        .flatten()
        .fold([f32::NAN; 2], |[low, high], info| {
            // `min` and `max` prefer what is a number.
            [low.min(info.bounds.min), high.max(info.bounds.max)]
        })
}
