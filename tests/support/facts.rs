//! The checker of alpha's three facts: what a selection covers, and what its patches share with their neighbours.

use std::collections::{HashMap, HashSet};

use clipscape::clipmap::{Clipmap, Instance, Selection, Side, Vertex, displace};
use clipscape::grid::{MAX_LEVELS, PATCH, Patch};

/// A drawn patch's side: level, which end of the axis it faces, and its nine vertices by place along it.
struct Line<'a> {
    level: u32,
    faces_on: bool,
    instance: &'a Instance,
    vertices: Vec<(i64, Vertex)>,
}

/// The patch that an instance draws.
pub fn patch_of(instance: &Instance) -> Patch {
    let [a, b] = instance.origin.map(|o| i64::from(o) / PATCH);
    Patch::new(instance.level, a, b)
}

/// Checks the selection of `clipmap`, made without culling, against the alpha of `shader`, usually the same: that it
/// covers the DEM once, that neighbours share their vertices, and the facts (b) and (c). Says what is wrong.
pub fn faults(clipmap: &Clipmap, shader: &Clipmap) -> Vec<String> {
    let mut faults = Vec::new();
    if !clipmap.report().cut {
        cover_faults(clipmap, &mut faults);
    }
    for line in lines(clipmap, shader).values() {
        for fine in line {
            for coarse in line
                .iter()
                .filter(|c| c.faces_on != fine.faces_on && c.level >= fine.level)
            {
                neighbour_faults(fine, coarse, &mut faults);
            }
        }
    }
    faults.extend(closer_faults(clipmap.selection()));
    // (c): wherever children are drawn, alpha of their parent's level is 0 on the parent.
    for instance in clipmap.selection().instances() {
        if instance.level as usize + 1 == clipmap.windows().len() {
            continue;
        }
        let parent = patch_of(instance).parent();
        let origin = [(parent.a * PATCH) as i32, (parent.b * PATCH) as i32];
        let parent = Instance {
            origin,
            level: parent.level,
            fill: 0.0,
        };
        let zero = |k: i32| displace(shader, &parent, k % 9, k / 9).alpha == 0.0;
        if !(0..81).all(zero) {
            faults.push(format!("(c): {instance:?} is drawn where its parent morphs"));
        }
    }
    faults
}

/// The sides of all drawn patches, by the line of the ground on which they lie.
fn lines<'a>(clipmap: &'a Clipmap, shader: &Clipmap) -> HashMap<(bool, i64), Vec<Line<'a>>> {
    let grid = clipmap.grid();
    let mut lines: HashMap<(bool, i64), Vec<Line<'_>>> = HashMap::new();
    for instance in clipmap.selection().instances() {
        let step = 1i64 << instance.level;
        let [x, z] = instance.origin.map(|o| i64::from(o) * step);
        let side = PATCH * step;
        for (along_x, far) in [(true, false), (true, true), (false, false), (false, true)] {
            let at = if far { side } else { 0 };
            let end = if far { PATCH as i32 } else { 0 };
            let key = (along_x, if along_x { z + at } else { x + at });
            let vertices = (0..=PATCH).map(|k| {
                let (cx, cz) = if along_x { (k as i32, end) } else { (end, k as i32) };
                // Vertices past a level's last sample fall on it.
                let size = grid.level(instance.level);
                let last = (if along_x { size.width } else { size.height } - 1) * step;
                let place = (k * step + if along_x { x } else { z }).min(last);
                (place, displace(shader, instance, cx, cz))
            });
            let line = Line {
                level: instance.level,
                faces_on: far,
                instance,
                vertices: vertices.collect(),
            };
            lines.entry(key).or_default().push(line);
        }
    }
    lines
}

/// What is wrong between two patches that face each other along a line, the second as coarse or coarser.
fn neighbour_faults(fine: &Line<'_>, coarse: &Line<'_>, faults: &mut Vec<String>) {
    let overlap = |a: &Line<'_>, b: &Line<'_>| a.vertices[0].0 < b.vertices[PATCH as usize].0;
    if !overlap(fine, coarse) || !overlap(coarse, fine) {
        return;
    }
    if coarse.level > fine.level + 1 {
        faults.push(format!("levels {} and {} meet", fine.level, coarse.level));
    }
    if coarse.level == fine.level + 1 && fine.vertices.iter().any(|(_, v)| v.alpha != 1.0) {
        faults.push(format!(
            "(b): {:?} meets a coarser patch with alpha below 1",
            fine.instance
        ));
    }
    for (place, theirs) in &coarse.vertices {
        let Some((_, ours)) = fine.vertices.iter().find(|(p, _)| p == place) else {
            continue;
        };
        // Where there is no data, each patch puts its vertices where its own bounds are.
        let same = ours.void == theirs.void
            && ours.from_eye == theirs.from_eye
            && (ours.void || (ours.height, ours.clip) == (theirs.height, theirs.clip));
        if !same {
            faults.push(format!(
                "a vertex at {place} differs: {ours:?} {theirs:?} between {:?} and {:?}",
                fine.instance, coarse.instance
            ));
        }
    }
}

/// Whether all ground is drawn exactly once, but for patches of which neither level has a sample.
fn cover_faults(clipmap: &Clipmap, faults: &mut Vec<String>) {
    let drawn: Vec<Patch> = clipmap.selection().instances().map(patch_of).collect();
    let cover = Cover {
        clipmap,
        above: above(&drawn),
        drawn: drawn.iter().copied().collect(),
    };
    if cover.drawn.len() != drawn.len() {
        faults.push("cover: a patch is drawn twice".to_string());
    }
    let coarsest = clipmap.windows().len() as u32 - 1;
    for (a, b) in clipmap.grid().patches(coarsest).rect().cells() {
        cover.check(Patch::new(coarsest, a, b), faults);
    }
}

/// All patches that hold one of `drawn`.
fn above(drawn: &[Patch]) -> HashSet<Patch> {
    let mut above = HashSet::new();
    for patch in drawn {
        let mut parent = patch.parent();
        while parent.level < MAX_LEVELS && above.insert(parent) {
            parent = parent.parent();
        }
    }
    above
}

struct Cover<'a> {
    clipmap: &'a Clipmap,
    drawn: HashSet<Patch>,
    /// All that hold a drawn patch.
    above: HashSet<Patch>,
}

impl Cover<'_> {
    fn check(&self, patch: Patch, faults: &mut Vec<String>) {
        match (self.drawn.contains(&patch), self.above.contains(&patch)) {
            (true, false) => {}
            (true, true) => faults.push(format!("cover: {patch:?} and some of its children are drawn")),
            (false, true) => self.children(patch).for_each(|child| self.check(child, faults)),
            (false, false) if self.is_void(patch) => {}
            (false, false) => faults.push(format!("cover: {patch:?} is not drawn")),
        }
    }

    fn children(&self, patch: Patch) -> impl Iterator<Item = Patch> + '_ {
        let children = patch.children().into_iter();
        children.filter(|c| self.clipmap.grid().patches(c.level).rect().contains(c.a, c.b))
    }

    /// Whether neither the patch nor its parent has a sample, or the same holds for all of its children. A patch that
    /// is not resident is drawn as its parent's surface alone.
    fn is_void(&self, patch: Patch) -> bool {
        let empty = |p: Patch| {
            let window = self.clipmap.windows().get(p.level as usize);
            window.is_none_or(|w| w.patch(p.a, p.b).is_none_or(|info| info.bounds.is_void()))
        };
        (empty(patch) && empty(patch.parent()))
            || (patch.level > 0 && self.children(patch).all(|child| self.is_void(child)))
    }
}

/// A side is closed exactly where a patch of the next coarser level is drawn beyond it. Where nothing is drawn beyond
/// it because no sample is there, closing it does no harm.
pub fn closer_faults(selection: &Selection) -> Vec<String> {
    let drawn: Vec<_> = selection.instances().map(patch_of).collect();
    let above = above(&drawn);
    let drawn: HashSet<_> = drawn.into_iter().collect();
    let mut faults = Vec::new();
    for instance in selection.instances() {
        let Patch { level, a, b } = patch_of(instance);
        for (side, closers) in Side::ALL.into_iter().zip(&selection.closers) {
            let (a, b) = match side {
                Side::West => (a - 1, b),
                Side::East => (a + 1, b),
                Side::North => (a, b - 1),
                Side::South => (a, b + 1),
            };
            let beyond = Patch::new(level, a, b);
            let coarser = drawn.contains(&beyond.parent());
            let nothing = !coarser && !drawn.contains(&beyond) && !above.contains(&beyond);
            if coarser != closers.contains(instance) && !nothing {
                faults.push(format!(
                    "closer: {side:?} of {instance:?} beside a coarser patch: {coarser}"
                ));
            }
        }
    }
    faults
}
