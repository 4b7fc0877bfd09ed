//! The twin of the vertex function: the displaced vertices of a frame, computed on the CPU.
//!
//! Same names and same order of steps as `shaders/shared/surface.wgsl`, in f32, scalar and plain; the two share the
//! constants and nothing else. On an adapter that computes + - * / and comparisons in IEEE single precision without
//! contraction the two agree bit for bit. Contraction to fused multiply-add may differ: in `height` by at most
//! `2^-23 (|h| + |c|)`, in a clip coordinate by at most `2^-22` times the sum of its three products' magnitudes.

use super::Clipmap;
use super::alpha::{held, ring};
use super::constants::VOID_HEIGHT;
use super::selection::Instance;

/// A displaced vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertex {
    /// Samples of level 0 east and south of the eye.
    pub from_eye: [f32; 2],
    /// Metres above the DEM's base, before vertical scale.
    pub height: f32,
    /// 0 on the vertex's own level, 1 on the next coarser surface.
    pub alpha: f32,
    /// Whether the vertex has no data: its triangles are holes.
    pub void: bool,
    /// Clip space: x, y, z, and the distance along the view axis.
    pub clip: [f32; 4],
}

/// The vertex at column `x` and row `z` (0 to 8) of a drawn patch.
pub fn displace(clipmap: &Clipmap, instance: &Instance, x: i32, z: i32) -> Vertex {
    let view = clipmap.view_constants();
    let level = &clipmap.level_constants()[instance.level as usize];
    // Vertices past the last sample fall on it.
    let i = (instance.origin[0] + x).min(level.last[0]);
    let j = (instance.origin[1] + z).min(level.last[1]);

    let kx = (i << instance.level) - view.anchor[0];
    let kz = (j << instance.level) - view.anchor[1];
    let from_eye = [kx as f32 - view.fraction[0], kz as f32 - view.fraction[1]];

    let ground = from_eye[0].abs().max(from_eye[1].abs()) * level.inverse_step;
    let d = ground.max(level.climb);
    let alpha = if level.has_coarser == 0 {
        0.0
    } else {
        ring(view, d).max(held(clipmap.held(), level.parent_last, instance.level, i, j))
    };

    let h = load_height(clipmap, instance.level, i, j);
    let (c0, c1) = if level.has_coarser == 0 {
        (h, h)
    } else {
        // The coarse sample where both indices are even, else the ends of the edge or diagonal that holds the vertex.
        let coarser = instance.level + 1;
        (
            load_height(clipmap, coarser, i >> 1, j >> 1),
            load_height(clipmap, coarser, (i + 1) >> 1, (j + 1) >> 1),
        )
    };
    let c_void = c0 == VOID_HEIGHT || c1 == VOID_HEIGHT;
    let c = c0 * 0.5 + c1 * 0.5;

    let morphed = if alpha == 0.0 || c_void {
        h
    } else {
        h + alpha * (c - h)
    };
    let void = if alpha == 1.0 { c_void } else { h == VOID_HEIGHT };
    let drawn = if alpha == 1.0 { c } else { morphed };
    let height = if void { instance.fill } else { drawn };

    let east = from_eye[0] * view.spacing_m[0];
    let up = ((height - view.eye_height_m[0]) - view.eye_height_m[1]) * view.vertical_scale;
    let south = from_eye[1] * view.spacing_m[1];
    // Summed in this order, term by term: a matrix product's order differs between adapters.
    let row = |k: usize| {
        view.clip_from_east[k] * east + view.clip_from_up[k] * up + view.clip_from_south[k] * south
    };
    let w = row(3);
    Vertex {
        from_eye,
        height,
        alpha,
        void,
        clip: [row(0), row(1), view.depth[0] * w + view.depth[1], w],
    }
}

/// What the height texture holds in the slot of sample (i, j).
fn load_height(clipmap: &Clipmap, level: u32, i: i32, j: i32) -> f32 {
    let height = clipmap.windows()[level as usize].slot_height(i64::from(i), i64::from(j));
    if height.is_nan() { VOID_HEIGHT } else { height }
}
