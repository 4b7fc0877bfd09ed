//! Whether the eye is above all that is drawn about it: else what near ground hides is not known.

use super::occlusion::Slack;
use super::scene::{Scene, hull};
use crate::grid::{PATCH, Patch, Rect};

/// The most vertices of a patch that are looked at one by one.
const MOST_VERTICES: i64 = 100;

/// Whether all that is drawn within the distance before which things may be cut away is below the eye by more than
/// that, and without voids, and the eye stands over it.
pub(super) fn is_above(scene: &Scene<'_>, slack: &Slack) -> bool {
    let radius_m = slack.cut_m();
    let reach = scene.grid.spacing_m.map(|spacing| radius_m / spacing);
    // Level-0 samples from the anchor to the sides of the square about the eye.
    let sides = [0, 1].map(|axis| {
        let at = scene.eye.fraction[axis];
        [at - reach[axis], at + reach[axis]]
    });
    let is_finite = sides.iter().flatten().all(|s| s.abs() < 1e12);
    let [x, z] = scene.eye.samples();
    let last = [scene.grid.size.width - 1, scene.grid.size.height - 1].map(|s| s as f64);
    if !is_finite || !(0.0..=last[0]).contains(&x) || !(0.0..=last[1]).contains(&z) {
        return false;
    }
    let square = Square {
        sides,
        below_m: radius_m + 2.0 * slack.height_m(),
    };
    let coarsest = scene.windows.len() as u32 - 1;
    let roots = scene.roots();
    let touched = square.cells(scene, PATCH << coarsest);
    let inside = touched.intersection(scene.grid.patches(coarsest).rect());
    inside.intersection(roots) == inside
        && inside.cells().all(|(a, b)| {
            let root = Patch::new(coarsest, a, b);
            scene.has_arrived(root) && square.is_above(scene, root)
        })
}

/// The ground about the eye.
struct Square {
    /// Its west and east, and its north and south, in samples of level 0 from the anchor.
    sides: [[f64; 2]; 2],
    /// How far all must be below the eye, in metres as drawn.
    below_m: f64,
}

impl Square {
    /// The cells of `side` samples of level 0 that it touches.
    fn cells(&self, scene: &Scene<'_>, side: i64) -> Rect {
        let [x, z] = [0, 1].map(|axis| {
            let anchor = scene.eye.anchor[axis];
            let [first, last] = self.sides[axis].map(|s| (anchor + s.floor() as i64).div_euclid(side));
            // A vertex on its last side belongs to the cell before as well.
            [first, last + 1]
        });
        Rect::new(x[0], z[0], x[1], z[1])
    }

    fn touches(&self, scene: &Scene<'_>, patch: Patch) -> bool {
        self.cells(scene, PATCH << patch.level).contains(patch.a, patch.b)
    }

    fn is_above(&self, scene: &Scene<'_>, patch: Patch) -> bool {
        if !scene.exists(patch) || !self.touches(scene, patch) {
            return true;
        }
        if scene.refined(patch) {
            return patch
                .children()
                .into_iter()
                .all(|child| self.is_above(scene, child));
        }
        let has_coarser = scene.has_coarser(patch.level);
        let own = scene.info(patch);
        let parent = has_coarser.then(|| scene.info(patch.parent())).flatten();
        let voids = [own, parent].into_iter().flatten().any(|p| p.voids);
        let heights = hull([own, parent]);
        !voids
            && !heights[0].is_nan()
            && (self.is_below(scene, patch, heights) || self.is_above_cells(scene, patch))
    }

    fn is_below(&self, scene: &Scene<'_>, patch: Patch, heights: [f32; 2]) -> bool {
        let [_, high] = scene.patch_box(patch, heights);
        high.y < -self.below_m
    }

    /// The same by the vertices of those of a patch's cells that it touches, wherever alpha has them between two levels.
    fn is_above_cells(&self, scene: &Scene<'_>, patch: Patch) -> bool {
        let level = patch.level as usize;
        let size = scene.grid.level(patch.level);
        let cells = self.cells(scene, 1 << patch.level);
        let vertices = Rect::new(cells.x0, cells.z0, cells.x1 + 1, cells.z1 + 1)
            .intersection(patch.samples_within(size));
        let (window, coarser) = (&scene.windows[level], scene.windows.get(level + 1));
        vertices.area() <= MOST_VERTICES
            && vertices.cells().all(|(i, j)| {
                let own = window.height(i, j);
                let ends = coarser.map(|w| [w.height(i >> 1, j >> 1), w.height((i + 1) >> 1, (j + 1) >> 1)]);
                let coarse = ends.and_then(|[a, b]| Some(f32::max(a?, b?)));
                let known = [own, coarse].into_iter().flatten();
                let hull = known.fold([f32::NAN; 2], |[low, high], h| [low.min(h), high.max(h)]);
                (own.is_some() || coarse.is_some()) && self.is_below(scene, patch, hull)
            })
    }
}
