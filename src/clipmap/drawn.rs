//! The drawn surface: what a frame draws over every place of the ground, seen or not, as a tree of patches.
//!
//! The walk is the selection's, from the coarsest level down by the same [`Scene::refined`], but without the frustum;
//! vertices come from the twin of the vertex function, [`displace`]. So patches, heights, alpha and voids are those of
//! the picture. Quads are split from north-west to south-east, and the surface is cut at the DEM's edge.
//!
//! Ground positions are exact here: vertex (i, j) of level l lies `((i 2^l - anchor) - fraction) spacing` metres from
//! the eye, in f64. The device computes the same in f32. It rounds the fraction (an error of `2^-25` of a sample, or
//! `2^-24` of the distance of an eye so far that the fraction is the whole of it), the difference, the spacing and the
//! product (each `2^-24` of the result): a vertex is drawn at most `2^-22` of its distance and `2^-25` of a sample
//! away from where this surface has it.

use std::sync::OnceLock;

use super::eye::Eye;
use super::scene::{Scene, hull};
use super::selection::Instance;
use super::vertex::displace;
use super::{Clipmap, no_frame};
use crate::error::Result;
use crate::grid::{Grid, PATCH, Patch, Rect};

/// Corners along a patch's side.
pub const CORNERS: usize = PATCH as usize + 1;

/// Heights at a patch's 9 x 9 corners, row by row, in metres above the DEM's base; NaN for no data.
pub type Corners = [f32; CORNERS * CORNERS];

/// What a surface made of patches has over the ground of one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// Nothing.
    Nothing,
    /// Patches of the next finer level.
    Finer,
    /// The patch itself.
    Patch,
}

/// The surface that the last update of a clipmap draws. May be read by several threads at once.
#[derive(Debug)]
pub struct Drawn<'a> {
    clipmap: &'a Clipmap,
    eye: Eye,
    roots: Rect,
    levels: Vec<Nodes>,
    corners: Vec<OnceLock<Box<Corners>>>,
}

/// What is known of a level's patches, row by row.
#[derive(Debug)]
struct Nodes {
    patches: Rect,
    nodes: Vec<Node>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    place: Place,
    /// Which of the drawn patches it is.
    drawn: u32,
    /// Least and greatest height of what is drawn over it; NaN where that is not known.
    heights: [f32; 2],
}

const NOTHING: Node = Node {
    place: Place::Nothing,
    drawn: 0,
    heights: [f32::NAN; 2],
};

/// What a walk from the coarsest level down found.
#[derive(Default)]
struct Walk {
    nodes: Vec<(Patch, Node)>,
    drawn: u32,
}

impl Walk {
    fn visit(&mut self, scene: &Scene<'_>, patch: Patch) {
        if !scene.exists(patch) {
            return;
        }
        if scene.refined(patch) {
            let node = Node {
                place: Place::Finer,
                heights: scene.subtree_heights(patch),
                ..NOTHING
            };
            self.nodes.push((patch, node));
            for child in patch.children() {
                self.visit(scene, child);
            }
            return;
        }
        let parent = scene
            .has_coarser(patch.level)
            .then(|| scene.info(patch.parent()))
            .flatten();
        let node = Node {
            place: Place::Patch,
            drawn: self.drawn,
            heights: hull([scene.info(patch), parent]),
        };
        self.nodes.push((patch, node));
        self.drawn += 1;
    }
}

impl Nodes {
    /// Those of `level`. Drawn patches may reach beyond the level's window, where they lie on the next coarser surface.
    fn new(level: u32, nodes: &[(Patch, Node)]) -> Self {
        let of_level = || nodes.iter().filter(|(patch, _)| patch.level == level);
        let patches = of_level()
            .map(|(p, _)| Rect::new(p.a, p.b, p.a + 1, p.b + 1))
            .reduce(|r, p| Rect::new(r.x0.min(p.x0), r.z0.min(p.z0), r.x1.max(p.x1), r.z1.max(p.z1)))
            .unwrap_or(Rect::EMPTY);
        let mut all = Self {
            patches,
            nodes: vec![NOTHING; patches.area() as usize],
        };
        for &(patch, node) in of_level() {
            if let Some(index) = all.index(patch) {
                all.nodes[index] = node;
            }
        }
        all
    }

    fn index(&self, patch: Patch) -> Option<usize> {
        self.patches.contains(patch.a, patch.b).then(|| {
            let (x, z) = (patch.a - self.patches.x0, patch.b - self.patches.z0);
            (z * self.patches.width() + x) as usize
        })
    }
}

impl<'a> Drawn<'a> {
    /// The surface that `clipmap` draws.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Misuse`] where it was never updated, or its last update failed.
    pub fn new(clipmap: &'a Clipmap) -> Result<Self> {
        let Some(scene) = clipmap.scene() else {
            return Err(no_frame("whose surface could be queried"));
        };
        let (roots, coarsest) = (scene.roots(), clipmap.windows.len() as u32 - 1);
        let mut walk = Walk::default();
        for (a, b) in roots.cells() {
            let root = Patch::new(coarsest, a, b);
            if scene.has_arrived(root) {
                walk.visit(&scene, root);
            }
        }
        Ok(Self {
            clipmap,
            eye: *scene.eye,
            roots,
            levels: (0..=coarsest).map(|l| Nodes::new(l, &walk.nodes)).collect(),
            corners: (0..walk.drawn).map(|_| OnceLock::new()).collect(),
        })
    }

    fn node(&self, patch: Patch) -> Node {
        let Some(level) = self.levels.get(patch.level as usize) else {
            return NOTHING;
        };
        level.index(patch).map_or(NOTHING, |k| level.nodes[k])
    }

    /// Where the samples lie.
    pub fn grid(&self) -> &Grid {
        &self.clipmap.grid
    }

    /// The clipmap whose frame this is.
    pub fn clipmap(&self) -> &Clipmap {
        self.clipmap
    }

    /// The eye for which it is drawn.
    pub fn eye(&self) -> &Eye {
        &self.eye
    }

    /// The coarsest level.
    pub fn coarsest(&self) -> u32 {
        self.levels.len() as u32 - 1
    }

    /// The patches of the coarsest level under which all lies that is drawn.
    pub fn roots(&self) -> Rect {
        self.roots
    }

    /// What is drawn over the ground of a patch, once its parent's ground is drawn finer than the parent.
    pub fn place(&self, patch: Patch) -> Place {
        self.node(patch).place
    }

    /// Least and greatest height of what is drawn over a patch's ground, in metres above the DEM's base; NaN where
    /// that is not known.
    pub fn heights(&self, patch: Patch) -> [f32; 2] {
        self.node(patch).heights
    }

    /// The corners of a drawn patch as drawn; none where that patch is not what is drawn there. Corners past the
    /// level's last sample are that sample's.
    pub fn corners(&self, patch: Patch) -> Option<&Corners> {
        let node = self.node(patch);
        if node.place != Place::Patch {
            return None;
        }
        let corners = self.corners.get(node.drawn as usize)?;
        Some(corners.get_or_init(|| {
            let instance = Instance {
                origin: [(patch.a * PATCH) as i32, (patch.b * PATCH) as i32],
                level: patch.level,
                fill: 0.0,
            };
            let height = |k: usize| {
                let vertex = displace(
                    self.clipmap,
                    &instance,
                    (k % CORNERS) as i32,
                    (k / CORNERS) as i32,
                );
                if vertex.void { f32::NAN } else { vertex.height }
            };
            Box::new(std::array::from_fn(height))
        }))
    }
}
