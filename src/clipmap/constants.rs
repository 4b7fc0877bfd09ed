//! What the vertex function knows of a frame, in f32: written here, read by the shader and by its twin.
//!
//! The same structs stand in `shaders/shared/surface.wgsl`; a test compares their layouts.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use super::Eye;
use crate::camera::View;
use crate::error::{Error, ErrorKind, Result};
use crate::grid::{Grid, MAX_LEVELS, PATCH, slot};

/// A void height on the GPU: finite, because shading languages may assume that NaN never occurs.
pub const VOID_HEIGHT: f32 = f32::MIN;

/// One past the greatest level index that the shader's array of [`LevelConstants`] holds.
pub const LEVEL_SLOTS: usize = MAX_LEVELS as usize;

/// Steps into which a light texel is divided where light is looked up. With up to 2^12 texels along a side, twice that
/// between a texel's slot and its place from the eye, f32 holds such places exactly, whatever their slots.
pub const LIGHT_TEXEL_STEPS: f64 = 1024.0;

/// Constants of a frame.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct ViewConstants {
    /// Clip x, y, z, w of a metre to the east of the eye. Clip z follows from clip w.
    pub clip_from_east: [f32; 4],
    /// Clip x, y, z, w of a metre up.
    pub clip_from_up: [f32; 4],
    /// Clip x, y, z, w of a metre to the south.
    pub clip_from_south: [f32; 4],
    /// What the right edge of the picture adds to `ray_middle`; the fourth is unused.
    pub ray_right: [f32; 4],
    /// What its upper edge adds.
    pub ray_up: [f32; 4],
    /// Metres east, up and south of the eye to the picture's middle, at distance 1 along the view axis.
    pub ray_middle: [f32; 4],
    /// The level-0 sample on which all positions are based, in the DEM's own indices.
    pub anchor: [i32; 2],
    /// Samples from the anchor to the eye.
    pub fraction: [f32; 2],
    /// Metres between columns and rows of level 0.
    pub spacing_m: [f32; 2],
    /// The eye's height above the DEM's base in metres, as a high and a low part.
    pub eye_height_m: [f32; 2],
    /// Samples from the eye to the DEM's last column and row.
    pub edge: [f32; 2],
    /// Width and height of the picture in pixels.
    pub size_px: [f32; 2],
    /// Factor on heights relative to the eye.
    pub vertical_scale: f32,
    /// Nearest drawn distance along the view axis in metres.
    pub near_m: f32,
    /// A level's reach R in its own steps.
    pub reach: f32,
    /// Width of the transition band T in steps.
    pub transition: f32,
    /// Clip size less one: a slot is an index and this mask.
    pub slot_mask: i32,
    /// Slots along a side of the held field's grids, less one.
    pub held_mask: i32,
    /// The terms a and b of clip z = `a w + b`.
    pub depth: [f32; 2],
}

/// Constants of a level.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct LevelConstants {
    /// The level's last column and row.
    pub last: [i32; 2],
    /// Added to an index before its slot is taken: the DEM's offset in this level's steps, modulo the clip size.
    pub slot_shift: [i32; 2],
    /// The last patch of the next coarser level.
    pub parent_last: [i32; 2],
    /// Steps per level-0 sample: `2^-l`.
    pub inverse_step: f32,
    /// The camera's height over the ground as a distance in steps: `1.25 (eye.y - ground) / (sqrt(dx dz) 2^l)`.
    pub climb: f32,
    /// Slot of the light texel at the eye, east and south, with its fraction.
    pub light_at_eye: [f32; 2],
    /// Light texels per level-0 sample.
    pub light_scale: f32,
    /// 1 where there is a coarser level to morph towards, 0 on the coarsest.
    pub has_coarser: u32,
}

/// How the ring is laid out: clip size N, transition T, reach R = N/2 - 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ring {
    /// Samples along a window's side: a power of two, 64 to 2048.
    pub clip_size: i64,
    /// Width of the transition band in steps, 0 to `N/4 - 10`.
    pub transition: i64,
}

impl Ring {
    /// Refuses a clip size that is no power of two in range, and a transition beyond its limit.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`], naming the value and what is allowed.
    pub fn check(&self) -> Result<()> {
        let misuse = |subject: &str, what: String, advice: String| {
            Err(Error::new(ErrorKind::Misuse, subject, what).advice(advice))
        };
        let n = self.clip_size;
        if !(64..=2048).contains(&n) || n & (n - 1) != 0 {
            return misuse(
                "clip size",
                format!("{n} samples"),
                "use 64, 128, 256, 512, 1024 or 2048".to_string(),
            );
        }
        let limit = Self::transition_limit(n);
        if !(0..=limit).contains(&self.transition) {
            let advice = format!("a clip size of {n} allows 0 to {limit}");
            return misuse("transition", format!("{} steps", self.transition), advice);
        }
        Ok(())
    }

    /// A level's reach in its own steps.
    pub fn reach(&self) -> i64 {
        self.clip_size / 2 - 2
    }

    /// The greatest transition for a clip size: it keeps fact (c), see [`super::alpha`].
    pub fn transition_limit(clip_size: i64) -> i64 {
        clip_size / 4 - 10
    }

    /// Light texels along a side of a level's light texture: twice the heights. The finest level's light has the
    /// heights' own resolution and fills a quarter of its slots, so that one texture array serves all levels.
    pub fn light_size(&self) -> i64 {
        2 * self.clip_size
    }

    /// Slots along a side of a level's grid of held corner values. The corners whose children's ring is below 1
    /// span `2 R / 16 + 2` at most, which is less.
    pub fn held_size(&self) -> i64 {
        self.clip_size / PATCH
    }
}

/// The level whose light level `level` holds: the next finer one.
pub fn light_level(level: u32) -> u32 {
    level.saturating_sub(1)
}

impl ViewConstants {
    /// The constants of a view.
    pub fn new(view: &View, eye: &Eye, grid: &Grid, ring: &Ring, vertical_scale: f64) -> Self {
        let [x, y, w] = view.clip_rows();
        let near = near_m(grid);
        let depth = view.depth();
        let [a, b] = depth.map_or([0.0, near], |d| d.terms());
        let column = |c: [f64; 3]| [c[0] as f32, c[1] as f32, 0.0, c[2] as f32];
        let ray = |r: DVec3| [r.x as f32, r.y as f32, r.z as f32, 0.0];
        let [right, up, middle] = view.rays().map(ray);
        let edge =
            |axis: usize, samples: i64| ((samples - 1 - eye.anchor[axis]) as f64 - eye.fraction[axis]) as f32;
        Self {
            clip_from_east: column([x.x, y.x, w.x]),
            clip_from_up: column([x.y, y.y, w.y]),
            clip_from_south: column([x.z, y.z, w.z]),
            ray_right: right,
            ray_up: up,
            ray_middle: middle,
            anchor: eye
                .anchor
                .map(|a| i32::try_from(a).expect("anchors stay within 2^23 samples of the DEM")),
            fraction: eye.fraction.map(|f| f as f32),
            spacing_m: grid.spacing_m.map(|s| s as f32),
            eye_height_m: eye.height_high_low(),
            edge: [edge(0, grid.size.width), edge(1, grid.size.height)],
            size_px: view.size_px.map(|s| s as f32),
            vertical_scale: vertical_scale as f32,
            near_m: depth.map_or(near, |d| d.near_m()) as f32,
            reach: ring.reach() as f32,
            transition: ring.transition as f32,
            slot_mask: ring.clip_size as i32 - 1,
            held_mask: ring.held_size() as i32 - 1,
            depth: [a as f32, b as f32],
        }
    }
}

/// Nearest drawn distance along the view axis of a view without a depth of its own: 2^-10 of the smaller spacing, in
/// metres. Its depth is reversed and has no far end.
pub fn near_m(grid: &Grid) -> f64 {
    grid.spacing_m[0].min(grid.spacing_m[1]) / 1024.0
}

/// Nearest drawn distance of a view along its axis, in metres: its own, or the DEM's where it has none.
pub fn near_of_m(view: &View, grid: &Grid) -> f64 {
    view.depth().map_or(near_m(grid), |depth| depth.near_m())
}

impl LevelConstants {
    /// The constants of `level`; `climb_m` is the eye's height over the level's ground in metres.
    pub fn new(level: u32, coarser: bool, eye: &Eye, grid: &Grid, ring: &Ring, climb_m: f64) -> Self {
        let size = grid.level(level);
        let parents = grid.patches(level + 1);
        let step = (1i64 << level) as f64;
        let mean_spacing_m = (grid.spacing_m[0] * grid.spacing_m[1]).sqrt();
        let light_step = (1i64 << light_level(level)) as f64;
        let light_size = ring.light_size();
        // Light texels of the anchor and the fraction apart, so that a large index costs the fraction nothing. The
        // fraction is taken in steps that f32 holds beside any slot: where the slots begin must not change a bit.
        let light_at_eye = |axis: usize| {
            let shift = grid.offset[axis] >> light_level(level);
            let whole = eye.anchor[axis] >> light_level(level);
            let rest = (eye.anchor[axis] - (whole << light_level(level))) as f64 + eye.fraction[axis];
            let rest = (rest / light_step * LIGHT_TEXEL_STEPS).round() / LIGHT_TEXEL_STEPS;
            (slot(whole + shift, light_size) as f64 + rest) as f32
        };
        Self {
            last: [size.width as i32 - 1, size.height as i32 - 1],
            slot_shift: grid.offset.map(|o| slot(o >> level, ring.clip_size) as i32),
            parent_last: [parents.width as i32 - 1, parents.height as i32 - 1],
            inverse_step: (1.0 / step) as f32,
            climb: (1.25 * climb_m / (mean_spacing_m * step)) as f32,
            light_at_eye: [light_at_eye(0), light_at_eye(1)],
            light_scale: (1.0 / light_step) as f32,
            has_coarser: u32::from(coarser),
        }
    }
}
