//! Which ground may have voids on a level finer than its own: kept up as patches are read, so that a walk that leaves out
//! a subtree knows whether rays may slip through the ground there.

use super::window::Window;
use crate::grid::Patch;

/// Hands on what the windows (finest first) noted since the last call. A patch is told of voids in any patch below it that is
/// resident, whichever of them was read first; it is not told that they have left.
pub(super) fn hand_up(windows: &mut [Window]) {
    for level in 0..windows.len() {
        while let Some([a, b]) = windows[level].take_noted() {
            let patch = Patch::new(level as u32, a, b);
            if has_voids_below(windows, patch) {
                windows[level].note_voids_below(a, b);
            }
            let voids = windows[level]
                .patch(a, b)
                .is_some_and(|p| p.voids || p.voids_below);
            if voids {
                for (up, coarser) in windows[level + 1..].iter_mut().enumerate() {
                    coarser.note_voids_below(a >> (up + 1), b >> (up + 1));
                }
            }
        }
    }
}

/// Whether a patch below is known to have voids. Where one is not known, those below it are asked.
fn has_voids_below(windows: &[Window], patch: Patch) -> bool {
    let level = patch.level as usize;
    if !windows[..level].iter().any(Window::has_met_voids) {
        return false;
    }
    patch.children().into_iter().any(|child| {
        let window = &windows[level - 1];
        match window.patch(child.a, child.b) {
            Some(info) => info.voids || info.voids_below,
            None => window.is_for_patch(child.a, child.b) && has_voids_below(windows, child),
        }
    })
}
