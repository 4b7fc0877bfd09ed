//! `UpdatePlan`: for each level the rectangles that an update writes.
//!
//! Where every frame waits for its data, they cover exactly what the moves of the windows expose. Where none does, or
//! under a budget, they cover what has arrived of that and of what was missing before.

use super::eye::Eye;
use super::window::{LightTexel, Window};
use crate::grid::Rect;

/// What one level's window gains in an update.
#[derive(Clone, Debug)]
pub struct LevelPlan {
    /// The level.
    pub level: u32,
    /// The samples that the window was for.
    pub from: Rect,
    /// The samples that it is for now.
    pub to: Rect,
    /// Disjoint rectangles of samples of `to`, split at the texture's seam, that are written.
    pub heights: Vec<Rect>,
    /// Disjoint rectangles of light texels, split at their texture's seam, over the same ground.
    pub light: Vec<Rect>,
    /// Whether light over a day is written with it, a rectangle and as many bytes more for each of light.
    pub day: bool,
}

impl LevelPlan {
    /// An empty plan for `level`.
    pub(super) fn new(level: u32) -> Self {
        Self {
            level,
            from: Rect::EMPTY,
            to: Rect::EMPTY,
            heights: Vec::new(),
            light: Vec::new(),
            day: false,
        }
    }
}

/// What all windows gain in an update, coarse levels first.
#[derive(Clone, Debug, Default)]
pub struct UpdatePlan {
    levels: Vec<LevelPlan>,
}

impl UpdatePlan {
    /// An empty plan for `levels` levels, whose memory later plans use again.
    pub fn new(levels: u32) -> Self {
        let level = |level| LevelPlan {
            level,
            from: Rect::EMPTY,
            to: Rect::EMPTY,
            heights: Vec::with_capacity(16),
            light: Vec::with_capacity(16),
            day: false,
        };
        Self {
            levels: (0..levels).rev().map(level).collect(),
        }
    }

    /// Begins an update that moves `windows` (by level, finest first) to where they belong for `eye`.
    pub(super) fn begin(&mut self, windows: &[Window], eye: &Eye) {
        for plan in &mut self.levels {
            let window = &windows[plan.level as usize];
            plan.from = window.resident();
            plan.to = window.target(eye);
            plan.heights.clear();
            plan.light.clear();
            plan.day = !window.day().is_empty();
        }
    }

    /// The levels' plans, coarse levels first, to be written to.
    pub(super) fn levels_mut(&mut self) -> &mut [LevelPlan] {
        &mut self.levels
    }

    /// The levels' plans, coarse levels first.
    pub fn levels(&self) -> &[LevelPlan] {
        &self.levels
    }

    /// The rectangles that are written.
    pub fn uploads(&self) -> usize {
        self.levels
            .iter()
            .map(|l| l.heights.len() + l.light.len() * (1 + usize::from(l.day)))
            .sum()
    }

    /// The bytes that are written: 4 a height, 8 a light texel, 8 more where light over a day is held.
    pub fn bytes(&self) -> u64 {
        let area = |rects: &[Rect]| rects.iter().map(|r| r.area()).sum::<i64>() as u64;
        self.levels
            .iter()
            .map(|l| area(&l.heights) * HEIGHT_BYTES + area(&l.light) * LIGHT_BYTES * (1 + u64::from(l.day)))
            .sum()
    }
}

/// Bytes of a height texel.
pub const HEIGHT_BYTES: u64 = size_of::<f32>() as u64;

/// Bytes of a light texel.
pub const LIGHT_BYTES: u64 = size_of::<LightTexel>() as u64;

/// The bytes that a move of a level's window from `from` to `to` exposes, computed from the two windows alone: what
/// an update must write at least. `light_level_size` is the size of the level whose light it holds.
pub fn exposed_bytes(level: u32, from: Rect, to: Rect, light_level_size: crate::grid::Size) -> u64 {
    exposed_bytes_of(level, from, to, light_level_size, LIGHT_BYTES)
}

/// The same where a texel of light takes `light_bytes`.
pub(super) fn exposed_bytes_of(
    level: u32,
    from: Rect,
    to: Rect,
    light_level_size: crate::grid::Size,
    light_bytes: u64,
) -> u64 {
    let fresh = |from: Rect, to: Rect| (to.area() - to.intersection(from).area()) as u64;
    let scale = if level == 0 { 1 } else { 2 };
    let light = |r: Rect| {
        let end = |end: i64, size: i64| (end * scale).min(size);
        Rect::new(
            r.x0 * scale,
            r.z0 * scale,
            end(r.x1, light_level_size.width),
            end(r.z1, light_level_size.height),
        )
    };
    let light_from = if from.is_empty() { Rect::EMPTY } else { light(from) };
    fresh(from, to) * HEIGHT_BYTES + fresh(light_from, light(to)) * light_bytes
}
