//! Selection: one recursive walk from the coarsest level down to the patches that a frame draws.

use bytemuck::{Pod, Zeroable};

use super::clearance;
use super::frustum::Frustum;
use super::occlusion::{OcclusionHorizon, Sector};
use super::scene::{Scene, hull};
use crate::grid::{PATCH, Patch};

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
    /// Subtrees of the walk that were dropped because they are not seen: beside the picture, or hidden by nearer ground.
    pub culled: u64,
    /// A bit for each level that is drawn.
    pub levels: u32,
    occlusion: OcclusionHorizon,
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
        let slack = scene.occlusion.filter(|slack| clearance::is_above(scene, slack));
        self.occlusion.begin(slack);
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
                    self.walk(scene, root, Frustum::ALL);
                } else {
                    self.open(scene, root);
                }
            }
        }
        (self.columns, self.rows) = (columns, rows);
    }

    /// Not to heed gaps behind which things are seen that would be hidden: a control of tests.
    #[doc(hidden)]
    pub fn ignore_gaps(&mut self) {
        self.occlusion.heeds_gaps = false;
    }

    /// `planes` are those of the frustum that may cut what is drawn of the patch and all below it.
    fn walk(&mut self, scene: &Scene<'_>, patch: Patch, planes: u8) {
        if !scene.exists(patch) {
            return;
        }
        if !scene.refined(patch) {
            self.draw(scene, patch, planes);
            return;
        }
        let mut cutting = planes;
        if let Some(frustum) = scene.frustum {
            let [low, high] = scene.patch_box(patch, scene.subtree_heights(patch));
            let Some(rest) = frustum.cutting(low, high, planes) else {
                if scene.may_have_gaps(patch) {
                    self.open(scene, patch);
                }
                self.culled += 1;
                return;
            };
            if self.occlusion.is_used() && Sector::new(low, high).is_some_and(|s| self.occlusion.hides(&s)) {
                self.culled += 1;
                return;
            }
            cutting = rest;
        }
        let [x, z] = scene.eye_in_patches(patch.level);
        let east_first = usize::from(x > patch.a as f64 + 0.5);
        let south_first = usize::from(z > patch.b as f64 + 0.5);
        let children = patch.children();
        for k in [0, 1, 2, 3] {
            self.walk(scene, children[k ^ east_first ^ (south_first << 1)], cutting);
        }
    }

    fn draw(&mut self, scene: &Scene<'_>, patch: Patch, planes: u8) {
        let own = scene.info(patch);
        let parent = scene
            .has_coarser(patch.level)
            .then(|| scene.info(patch.parent()))
            .flatten();
        let heights = hull([own, parent]);
        if heights[0].is_nan() {
            self.open(scene, patch);
            return; // wholly void on both levels: nothing is there
        }
        // A vertex is void as its own sample is, but where alpha is 1 as the coarser ones are.
        let own_voids = own.is_some_and(|p| p.voids);
        let voids = own_voids || parent.is_some_and(|p| p.voids) && scene.may_reach_1(patch);
        if voids {
            self.open(scene, patch);
        }
        let ragged = voids || scene.over_the_edge(patch);
        if let Some(frustum) = scene.frustum {
            let [low, high] = scene.patch_box(patch, heights);
            if frustum.cutting(low, high, planes).is_none() {
                self.culled += 1;
                return;
            }
            if self.occlusion.is_used()
                && let Some(sector) = Sector::new(low, high)
            {
                if self.occlusion.hides(&sector) {
                    self.culled += 1;
                    return;
                }
                if !ragged {
                    self.occlusion.raise(&sector);
                }
            }
        }
        let instance = Instance {
            origin: [(patch.a * PATCH) as i32, (patch.b * PATCH) as i32],
            level: patch.level,
            fill: heights[0],
        };
        self.levels |= 1 << patch.level;
        if ragged {
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

    /// Nothing behind the ground of `patch` hides anything: rays may have gone through.
    fn open(&mut self, scene: &Scene<'_>, patch: Patch) {
        if self.occlusion.is_used() {
            let [low, high] = scene.patch_box(patch, [0.0; 2]);
            self.occlusion.open(Sector::new(low, high).as_ref());
        }
    }
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
