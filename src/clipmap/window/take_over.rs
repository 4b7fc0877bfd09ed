//! What a window takes over from another over the same ground, whose data are better.

use super::{Window, both};
use crate::clipmap::plan::LevelPlan;
use crate::grid::Rect;

impl Window {
    /// Notes that samples of `other`, a window over the same ground, will lie beside its own: bounds of both hold.
    pub(in crate::clipmap) fn meet_bounds(&mut self, other: &Self) {
        for (own, other) in self.patches.iter_mut().zip(&other.patches) {
            if let (Some(own), Some(other)) = (own, other) {
                own.bounds = both(&own.bounds, &other.bounds);
                own.voids |= other.voids;
                own.voids_below |= other.voids_below;
            }
        }
        self.note_all(other);
    }

    /// Notes all patches, after voids of `other` came to their own.
    fn note_all(&mut self, other: &Self) {
        self.has_met_voids |= other.has_met_voids;
        self.noted
            .extend(self.patch_resident.cells().map(|(a, b)| [a, b]));
    }

    /// Takes the samples `rect` and their light from `other`, a window over the same ground that has them, and lists the
    /// rectangles that were written.
    pub(in crate::clipmap) fn take_samples(&mut self, other: &Self, rect: Rect, written: &mut LevelPlan) {
        let light = self.light_of(rect);
        for piece in other.pieces(rect) {
            let at = self.slot_of(piece.x0, piece.z0);
            copy_slots(&other.heights, &mut self.heights, at, piece, self.n);
        }
        for piece in other.light_pieces(light) {
            let at = self.light_slot_of(piece.x0, piece.z0);
            copy_slots(&other.light, &mut self.light, at, piece, self.light_n);
            if !self.day.is_empty() {
                copy_slots(&other.day, &mut self.day, at, piece, self.light_n);
            }
        }
        written.heights.extend(self.pieces(rect));
        written.light.extend(self.light_pieces(light));
    }

    /// Takes what `other`, a window over the same ground whose samples it has all taken, knows of the patches.
    pub(in crate::clipmap) fn take_bounds(&mut self, other: &Self) {
        for (own, other) in self.patches.iter_mut().zip(&other.patches) {
            if let (Some(own), Some(other)) = (own, other) {
                let voids_below = own.voids_below;
                *own = *other;
                own.voids_below |= voids_below;
            }
        }
        self.provisional = other.provisional;
        self.note_all(other);
    }
}

/// Copies the slots of `rect`, which begin at column and row `at`, from one square of `n` slots a side to another.
fn copy_slots<T: Copy>(from: &[T], to: &mut [T], at: [i64; 2], rect: Rect, n: i64) {
    let width = rect.width() as usize;
    for z in at[1]..at[1] + rect.height() {
        let first = (z * n + at[0]) as usize;
        to[first..first + width].copy_from_slice(&from[first..first + width]);
    }
}
