//! The highest ground on the way of a run, as a block of samples sees it.

use super::crests::{CREST, Crests};
use super::relief::{BLOCK, greater};
use super::strips::Strips;
use crate::grid::Rect;

/// The highest ground that one of the longest runs may pass over, by the block of crests that it begins in.
pub(super) struct Tops {
    /// Where the samples of the block of light at (0, 0) see it begin, from the corner of the first block of crests.
    begin: [usize; 2],
    highest: [[f32; BLOCK[0] / CREST + 1]; BLOCK[1] / CREST + 1],
}

impl Tops {
    /// That of a run that begins at `begin` from the sample that looks, over `crests`, as samples of `block` see it.
    pub(super) fn new(crests: &Crests, strips: &Strips, block: Rect, begin: [i64; 2]) -> Self {
        let side = CREST as i64;
        let first = [block.x0 + begin[0], block.z0 + begin[1]];
        let mut tops = Self {
            begin: first.map(|c| c.rem_euclid(side) as usize),
            highest: Default::default(),
        };
        let corner = first.map(|c| c.div_euclid(side) * side);
        for (z, row) in (corner[1]..).step_by(CREST).zip(&mut tops.highest) {
            for (x, most) in (corner[0]..).step_by(CREST).zip(row) {
                *most = strips
                    .under(Rect::new(x, z, x + side, z + side))
                    .fold(f32::NEG_INFINITY, |most, rect| greater(most, crests.over(rect)));
            }
        }
        tops
    }

    /// Of all.
    pub(super) fn greatest(&self) -> f32 {
        self.highest
            .as_flattened()
            .iter()
            .fold(f32::NEG_INFINITY, |most, &h| greater(most, h))
    }

    /// As the samples from (x, z) of the block on see it.
    pub(super) fn highest(&self, [x, z]: [usize; 2]) -> f32 {
        self.highest[(self.begin[1] + z) / CREST][(self.begin[0] + x) / CREST]
    }
}
