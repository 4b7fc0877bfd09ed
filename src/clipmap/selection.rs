//! Selection: one recursive walk from the coarsest level down to the patches that a frame draws.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use super::alpha::MARGIN;
use super::constants::{LevelConstants, Ring};
use super::extent::Extent;
use super::eye::Eye;
use super::frustum::Frustum;
use super::held::HeldField;
use super::window::{PatchInfo, Window};
use crate::grid::{Grid, PATCH, Patch, Rect};

/// A patch to draw, as the GPU reads it.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Instance {
    /// Its first column and row, in samples of its level.
    pub origin: [i32; 2],
    /// Its level.
    pub level: u32,
    /// The height in metres above the DEM's base at which void vertices are put: within the patch's bounds, so that
    /// the triangles of a hole, which are discarded, stay where the patch is.
    pub fill: f32,
}

impl Instance {
    /// The patch.
    pub fn patch(&self) -> Patch {
        let [a, b] = self.origin.map(|o| i64::from(o) / PATCH);
        Patch::new(self.level, a, b)
    }
}

/// A side of a patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Towards -x.
    West,
    /// Towards +x.
    East,
    /// Towards -z.
    North,
    /// Towards +z.
    South,
}

impl Side {
    /// All four, in the order of [`Selection::closers`].
    pub const ALL: [Self; 4] = [Self::West, Self::East, Self::North, Self::South];

    fn beyond(self, patch: Patch) -> Patch {
        let (da, db) = match self {
            Self::West => (-1, 0),
            Self::East => (1, 0),
            Self::North => (0, -1),
            Self::South => (0, 1),
        };
        Patch::new(patch.level, patch.a + da, patch.b + db)
    }
}

/// Triangles of a patch: 8 x 8 quads.
pub const PATCH_TRIANGLES: u64 = 2 * (PATCH * PATCH) as u64;

/// Zero-area triangles that close a side which borders a coarser patch.
pub const CLOSER_TRIANGLES: u64 = PATCH as u64 / 2;

/// The patches of a frame, near ones first.
#[derive(Clone, Debug, Default)]
pub struct Selection {
    /// Patches without voids, wholly within the DEM, with alpha 0 on all of them.
    pub still: Vec<Instance>,
    /// Other patches without voids, wholly within the DEM.
    pub whole: Vec<Instance>,
    /// Patches that may have voids or reach over the DEM's edge: their fragments may have to be discarded.
    pub ragged: Vec<Instance>,
    /// For each [`Side`], the patches that border a coarser one there.
    pub closers: [Vec<Instance>; 4],
    /// Subtrees of the walk that were dropped because they are not seen.
    pub culled: u64,
    /// A bit for each level that is drawn.
    pub levels: u32,
    columns: Vec<i64>,
    rows: Vec<i64>,
}

impl Selection {
    /// The patches drawn.
    pub fn patches(&self) -> u64 {
        (self.still.len() + self.whole.len() + self.ragged.len()) as u64
    }

    /// The triangles drawn, closing ones included.
    pub fn triangles(&self) -> u64 {
        let closers: usize = self.closers.iter().map(Vec::len).sum();
        self.patches() * PATCH_TRIANGLES + closers as u64 * CLOSER_TRIANGLES
    }

    /// All patches drawn.
    pub fn instances(&self) -> impl Iterator<Item = &Instance> {
        self.still.iter().chain(&self.whole).chain(&self.ragged)
    }

    /// Selects anew.
    pub fn select(&mut self, scene: &Scene<'_>) {
        self.still.clear();
        self.whole.clear();
        self.ragged.clear();
        self.closers.iter_mut().for_each(Vec::clear);
        self.culled = 0;
        self.levels = 0;
        let coarsest = scene.windows.len() as u32 - 1;
        let roots = scene.roots();
        let [x, z] = scene.eye_in_patches(coarsest);
        let (mut columns, mut rows) = (std::mem::take(&mut self.columns), std::mem::take(&mut self.rows));
        near_to_far(&mut columns, roots.x0, roots.x1, x);
        near_to_far(&mut rows, roots.z0, roots.z1, z);
        for &b in &rows {
            for &a in &columns {
                let root = Patch::new(coarsest, a, b);
                if scene.has_arrived(root) {
                    self.walk(scene, root);
                }
            }
        }
        (self.columns, self.rows) = (columns, rows);
    }

    fn walk(&mut self, scene: &Scene<'_>, patch: Patch) {
        if !scene.exists(patch) {
            return;
        }
        if !scene.refined(patch) {
            self.draw(scene, patch);
            return;
        }
        if scene.unseen(patch, scene.subtree_heights(patch)) {
            self.culled += 1;
            return;
        }
        let [x, z] = scene.eye_in_patches(patch.level);
        let east_first = usize::from(x > patch.a as f64 + 0.5);
        let south_first = usize::from(z > patch.b as f64 + 0.5);
        let children = patch.children();
        for k in [0, 1, 2, 3] {
            self.walk(scene, children[k ^ east_first ^ (south_first << 1)]);
        }
    }

    fn draw(&mut self, scene: &Scene<'_>, patch: Patch) {
        let own = scene.info(patch);
        let parent = scene
            .has_coarser(patch.level)
            .then(|| scene.info(patch.parent()))
            .flatten();
        let heights = hull([own, parent]);
        if heights[0].is_nan() {
            return; // wholly void on both levels: nothing is there
        }
        if scene.unseen(patch, heights) {
            self.culled += 1;
            return;
        }
        // A vertex is void as its own sample is, but where alpha is 1 as the coarser ones are.
        let own_voids = own.is_some_and(|p| p.voids);
        let voids = own_voids || parent.is_some_and(|p| p.voids) && scene.may_reach_1(patch);
        let instance = Instance {
            origin: [(patch.a * PATCH) as i32, (patch.b * PATCH) as i32],
            level: patch.level,
            fill: heights[0],
        };
        self.levels |= 1 << patch.level;
        if voids || scene.over_the_edge(patch) {
            &mut self.ragged
        } else if scene.may_leave_0(patch) {
            &mut self.whole
        } else {
            &mut self.still
        }
        .push(instance);
        for (side, closers) in Side::ALL.into_iter().zip(&mut self.closers) {
            if scene.borders_coarser(patch, side.beyond(patch)) {
                closers.push(instance);
            }
        }
    }
}

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

    fn eye_in_patches(&self, level: u32) -> [f64; 2] {
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
    fn may_reach_1(&self, patch: Patch) -> bool {
        let parent = patch.parent();
        self.distances(patch)[1] > self.ring.reach() as f64 - MARGIN
            || (!self.held.is_quiet()
                && f64::from(self.held.greatest(patch.level, parent.a, parent.b)) > 1.0 - MARGIN)
    }

    /// Whether alpha may be other than 0 somewhere on a patch that is drawn; with a margin for what the shader rounds.
    fn may_leave_0(&self, patch: Patch) -> bool {
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

    fn borders_coarser(&self, patch: Patch, neighbour: Patch) -> bool {
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

    fn unseen(&self, patch: Patch, heights: [f32; 2]) -> bool {
        let Some(frustum) = self.frustum else { return false };
        let [low, high] = self.patch_box(patch, heights);
        frustum.excludes(low, high)
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

/// Lists `first..end` by distance from `eye`, nearest first.
fn near_to_far(order: &mut Vec<i64>, first: i64, end: i64, eye: f64) {
    order.clear();
    let mut above = (eye.clamp(first as f64, end as f64) as i64).clamp(first, end.max(first));
    let mut below = above - 1;
    while above < end || below >= first {
        // Indices are of unit cells: their centres are half a unit on.
        let take_above =
            below < first || (above < end && above as f64 + 0.5 - eye <= eye - (below as f64 + 0.5));
        if take_above {
            order.push(above);
            above += 1;
        } else {
            order.push(below);
            below -= 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_and_columns_are_listed_from_the_eye_outwards() {
        let mut order = Vec::new();
        near_to_far(&mut order, 0, 5, 2.2);
        assert_eq!(order, [2, 1, 3, 0, 4]);
        near_to_far(&mut order, 3, 6, -7.0);
        assert_eq!(order, [3, 4, 5]);
        near_to_far(&mut order, 3, 6, 1e30);
        assert_eq!(order, [5, 4, 3]);
        near_to_far(&mut order, 4, 4, 1.0);
        assert!(order.is_empty());
    }
}
