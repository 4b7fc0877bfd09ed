//! The held field: what keeps a level from being drawn finer than its data or its need allow.
//!
//! Level `l` is held by values at the corners of the patches of level `l + 1`, in 0 to 1. They live in one small
//! toroidal grid per level, which the shader and its twin read by index, so that all patches that touch a corner
//! read the same bits. Slots are taken in the DEM's own indices.

use crate::grid::slot;

/// Corner values of all levels but the coarsest.
#[derive(Clone, Debug)]
pub struct HeldField {
    size: i64,
    levels: Vec<Vec<f32>>,
    generation: u64,
}

impl HeldField {
    /// A field for `levels` levels that holds nothing back, `size` slots along a side.
    pub fn new(levels: u32, size: i64) -> Self {
        Self {
            size,
            levels: vec![vec![0.0; (size * size) as usize]; levels as usize],
            generation: 0,
        }
    }

    /// Slots along a side.
    pub fn size(&self) -> i64 {
        self.size
    }

    /// The grid of `level`, row by row of slots.
    pub fn grid(&self, level: u32) -> &[f32] {
        &self.levels[level as usize]
    }

    /// Changes with every change of a value.
    pub fn generation(&self) -> u64 {
        self.generation
    }

    /// The value that holds `level` at corner (x, z) of the patches of the next coarser level.
    pub fn corner(&self, level: u32, x: i64, z: i64) -> f32 {
        self.levels[level as usize][self.index(x, z)]
    }

    /// Sets a corner to a value in 0 to 1.
    pub fn set_corner(&mut self, level: u32, x: i64, z: i64, value: f32) {
        let index = self.index(x, z);
        let corner = &mut self.levels[level as usize][index];
        let value = value.clamp(0.0, 1.0);
        if *corner != value {
            *corner = value;
            self.generation += 1;
        }
    }

    /// The least of the values at the corners of patch (a, b) of the level above `level`.
    pub fn least(&self, level: u32, a: i64, b: i64) -> f32 {
        let corner = |da, db| self.corner(level, a + da, b + db);
        corner(0, 0).min(corner(1, 0)).min(corner(0, 1)).min(corner(1, 1))
    }

    fn index(&self, x: i64, z: i64) -> usize {
        (slot(z, self.size) * self.size + slot(x, self.size)) as usize
    }
}
