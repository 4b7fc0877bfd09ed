//! Succession: a window whose level the terrain now has better data for takes them over piece by piece.
//!
//! A level is drawn from what it has until all that it should show has come anew: that gathers in a window of its own, the
//! *successor*, which moves as the drawn one does. Then its samples take the place of the others in the drawn window, as
//! many in a frame as the budget of uploads pays for. In between the level is a mixture, as watertight as any samples are,
//! and each patch's bounds hold both kinds. Ground that the drawn window gains meanwhile is read anew in any case.

use super::arrivals::{affordable, bytes};
use super::plan::LevelPlan;
use super::window::Window;
use crate::grid::Rect;

/// What takes a window's place.
#[derive(Clone, Debug)]
pub(super) struct Successor {
    pub(super) window: Window,
    /// The parts of the drawn window that hold what was there before, once the successor has begun to take its place.
    before: Option<Vec<Rect>>,
}

impl Successor {
    /// One that has nothing yet.
    pub(super) fn new(window: Window) -> Self {
        Self { window, before: None }
    }

    /// Follows the drawn window to `target`.
    pub(super) fn move_to(&mut self, target: Rect) {
        self.window.move_to(target);
        if let Some(rects) = &mut self.before {
            rects.retain_mut(|rect| {
                *rect = rect.intersection(target);
                !rect.is_empty()
            });
        }
    }

    /// Whether it is, or will be, written into the drawn window: all of it has come once.
    fn has_begun(&mut self, drawn: &mut Window) -> bool {
        if self.before.is_none() && self.window.missing().next().is_none() {
            drawn.meet_bounds(&self.window);
            self.before = Some(drawn.arrived());
        }
        self.before.is_some()
    }

    /// Writes what `left_bytes` pay for into `drawn`, from what is nearest to `eye` (in samples of the level) in each
    /// part, and lists it in `written`. Whether nothing is left to be done.
    pub(super) fn take_over(
        &mut self,
        drawn: &mut Window,
        eye: [f64; 2],
        left_bytes: &mut u64,
        written: &mut LevelPlan,
    ) -> bool {
        if !self.has_begun(drawn) {
            return false;
        }
        let mut rest = Vec::new();
        for rect in self.before.take().unwrap_or_default() {
            let part = affordable(drawn, rect, eye, *left_bytes);
            if part.is_empty() {
                rest.push(rect);
                continue;
            }
            *left_bytes -= bytes(drawn, part);
            drawn.take_samples(&self.window, part, written);
            rest.extend(rect.difference(part));
        }
        let done = rest.is_empty() && self.window.missing().next().is_none();
        if done {
            drawn.take_bounds(&self.window);
        }
        self.before = Some(rest);
        done
    }
}
