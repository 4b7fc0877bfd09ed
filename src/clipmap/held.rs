//! The held field: what keeps a level from being drawn finer than its data allow, or than the promised error needs.
//!
//! Level `l` is held by values in 0 to 1 at the corners of the patches of level `l + 1`. They live in one small
//! toroidal grid per level, which the shader and its twin read by index, so that all patches that touch a corner
//! read the same bits. A corner's value is the greater of two: the greatest *fade* of the patches that touch it, and,
//! where an error is promised, the least of their *need* ([`super::need`]). Need has no memory: it is a function of the
//! view and the patches' bounds.
//!
//! A patch's fade says how far the data of its children are from being shown:
//! - It is at least `clamp(R + 2 - d, 0, 1)`, with `d` the distance in steps of level `l` from the eye to the nearest
//!   of those samples that has not arrived. A window gains samples at a distance of `R + 1` to `R + 2`, so fade rises
//!   continuously as ground that is still missing comes nearer, and is 1 from `d = R + 1` on: one step before alpha
//!   would need the sample, because light is interpolated over a step.
//! - Else it falls, from where it was, by 1 in [`FADE_S`] seconds.
//! - It is 1 while the fade of the patch's parent or of one of the parent's eight neighbours is not 0. This is the
//!   order on which fact (c) of [`super::alpha`] rests: where the children of a patch are drawn, its fade is below 1
//!   somewhere, hence its parent and all around it have fade 0, hence the corners of the parent are 0, hence alpha of
//!   the patch's own level is 0 on all of it.
//!
//! A patch of which all data are there when the window reaches it starts at 0: nothing has to be hidden.

use super::constants::LEVEL_SLOTS;
use super::eye::Eye;
use super::missing::distance;
use super::need::Dial;
use super::window::Window;
use crate::grid::{Grid, PATCH, Patch, Rect, slot};

/// Seconds in which what has arrived fades in.
pub const FADE_S: f64 = 0.25;

/// Samples of a level along a side of a patch of the next coarser one.
const SPAN: i64 = 2 * PATCH;

/// Corner values of all levels but the coarsest.
#[derive(Clone, Debug)]
pub struct HeldField {
    size: i64,
    levels: Vec<LevelField>,
    ordered: bool,
    fading: bool,
    quiet: bool,
    dialled: bool,
    required: Vec<f32>,
    needs: Vec<f32>,
}

#[derive(Clone, Debug)]
struct LevelField {
    /// The patches of the next coarser level that the level's window touches.
    patches: Rect,
    /// Fade by slot of patch.
    fades: Vec<f32>,
    /// The greatest fade around it, by slot of corner.
    faded: Vec<f32>,
    /// Value by slot of corner.
    corners: Vec<f32>,
    generation: u64,
}

/// What an update of the field met.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct FadeReport {
    /// By level: whether it is held back somewhere within its reach on the ground.
    pub(super) held: [bool; LEVEL_SLOTS],
    /// By level: patches within the reach whose children were taken back at once, or faster than the camera's motion
    /// explains, because their data came too late.
    pub(super) pops: [u64; LEVEL_SLOTS],
}

/// Where the eye is and has been, for an update of the field.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moment<'a> {
    pub(super) grid: &'a Grid,
    pub(super) eye: &'a Eye,
    /// Where it was at the last update, in samples of level 0.
    pub(super) last_eye: [f64; 2],
    /// A level's reach R.
    pub(super) reach: f64,
    /// Seconds since the last update.
    pub(super) passed_s: f64,
}

impl HeldField {
    /// A field for `levels` levels that holds nothing back, `size` slots along a side.
    pub fn new(levels: u32, size: i64) -> Self {
        let level = LevelField {
            patches: Rect::EMPTY,
            fades: vec![0.0; (size * size) as usize],
            faded: vec![0.0; (size * size) as usize],
            corners: vec![0.0; (size * size) as usize],
            generation: 0,
        };
        Self {
            size,
            levels: vec![level; levels as usize],
            ordered: true,
            fading: true,
            quiet: true,
            dialled: false,
            required: Vec::new(),
            needs: Vec::new(),
        }
    }

    /// Slots along a side.
    pub fn size(&self) -> i64 {
        self.size
    }

    /// The grid of `level`, row by row of slots.
    pub fn grid(&self, level: u32) -> &[f32] {
        &self.levels[level as usize].corners
    }

    /// Changes with every change of a value of `level`.
    pub fn generation(&self, level: u32) -> u64 {
        self.levels[level as usize].generation
    }

    /// The value that holds `level` at corner (x, z) of the patches of the next coarser level.
    pub fn corner(&self, level: u32, x: i64, z: i64) -> f32 {
        self.levels[level as usize].corners[self.index(x, z)]
    }

    /// The fade's share of the value at a corner.
    pub(super) fn faded(&self, level: u32, x: i64, z: i64) -> f32 {
        self.levels[level as usize].faded[self.index(x, z)]
    }

    /// Sets a corner to a value in 0 to 1, until the next update.
    pub fn set_corner(&mut self, level: u32, x: i64, z: i64, value: f32) {
        self.quiet &= value <= 0.0;
        self.write_corner(level, x, z, value);
    }

    fn write_corner(&mut self, level: u32, x: i64, z: i64, value: f32) {
        let index = self.index(x, z);
        let level = &mut self.levels[level as usize];
        let value = value.clamp(0.0, 1.0);
        if level.corners[index] != value {
            level.corners[index] = value;
            level.generation += 1;
        }
    }

    /// The least of the values at the corners of patch (a, b) of the level above `level`.
    pub fn least(&self, level: u32, a: i64, b: i64) -> f32 {
        let corner = |da, db| self.corner(level, a + da, b + db);
        corner(0, 0).min(corner(1, 0)).min(corner(0, 1)).min(corner(1, 1))
    }

    /// The greatest of the values at the corners of patch (a, b) of the level above `level`.
    pub fn greatest(&self, level: u32, a: i64, b: i64) -> f32 {
        let corner = |da, db| self.corner(level, a + da, b + db);
        corner(0, 0).max(corner(1, 0)).max(corner(0, 1)).max(corner(1, 1))
    }

    /// Whether no value is above 0.
    pub fn is_quiet(&self) -> bool {
        self.quiet && !self.dialled
    }

    /// Whether no fade is above 0.
    pub(super) fn has_faded_in(&self) -> bool {
        self.quiet
    }

    /// Whether a patch waits for its parent's surroundings. Without it the surface cracks: a control for tests.
    #[doc(hidden)]
    pub fn set_ordered(&mut self, ordered: bool) {
        self.ordered = ordered;
    }

    /// Whether anything is held back. Without it samples are drawn that have not arrived: a control for tests.
    #[doc(hidden)]
    pub fn set_fading(&mut self, fading: bool) {
        self.fading = fading;
    }

    /// Brings the field up to what `windows` (by level, finest first) miss.
    pub(super) fn update(&mut self, windows: &[Window], moment: &Moment<'_>) -> FadeReport {
        let mut report = FadeReport::default();
        let complete = windows.iter().all(|w| w.missing.is_empty());
        if complete && self.quiet || !self.fading {
            for window in windows {
                self.levels[window.level() as usize].patches = touched(window, moment.grid);
            }
            return report;
        }
        self.quiet = complete;
        for window in windows.iter().rev().skip(1) {
            self.update_level(window, moment, &mut report);
        }
        if self.quiet {
            // What lies outside the windows now must not be met again when they come back.
            for level in &mut self.levels {
                level.fades.fill(0.0);
                level.faded.fill(0.0);
                if level.corners.iter().any(|c| *c != 0.0) {
                    level.corners.fill(0.0);
                    level.generation += 1;
                }
            }
        }
        report
    }

    fn update_level(&mut self, window: &Window, moment: &Moment<'_>, report: &mut FadeReport) {
        let level = window.level();
        let patches = touched(window, moment.grid);
        let step = (1i64 << level) as f64;
        let eye = moment.eye.samples().map(|s| s / step);
        let last_eye = moment.last_eye.map(|s| s / step);
        let moved = (eye[0] - last_eye[0]).abs().max((eye[1] - last_eye[1]).abs()) * step;
        let span = |a: i64, b: i64| Rect::new(a * SPAN, b * SPAN, (a + 1) * SPAN + 1, (b + 1) * SPAN + 1);
        self.require(window, patches, eye, moment.reach, span);
        let fallen = (moment.passed_s / FADE_S) as f32;
        let before = self.levels[level as usize].patches;
        for ((a, b), k) in patches.cells().zip(0..) {
            let required = self.required[k];
            let index = self.index(a, b);
            let known = before
                .contains(a, b)
                .then(|| self.levels[level as usize].fades[index]);
            let fade = if self.ordered && self.held_around(Patch::new(level + 1, a, b).parent()) {
                1.0
            } else {
                known.map_or(required, |fade| required.max(fade - fallen))
            };
            self.levels[level as usize].fades[index] = fade;
            if fade > 0.0 {
                self.quiet = false;
                if distance(span(a, b), eye) < moment.reach {
                    report.held[level as usize] = true;
                    // Fade rises by 1 a step; what is beyond that but for rounding, or by more than half, is a pop.
                    let explained = (moved / step).min(0.5) + 1e-3;
                    let was_near = distance(span(a, b), last_eye) < moment.reach;
                    let pops = was_near && known.is_some_and(|f| f64::from(fade - f) > explained);
                    report.pops[level as usize] += u64::from(pops);
                }
            }
        }
        let field = &mut self.levels[level as usize];
        field.patches = patches;
        let corners = Rect::new(patches.x0, patches.z0, patches.x1 + 1, patches.z1 + 1);
        for (x, z) in corners.cells() {
            let touching = Rect::new(x - 1, z - 1, x + 1, z + 1).intersection(patches);
            let fades = &self.levels[level as usize].fades;
            let value = touching
                .cells()
                .map(|(a, b)| fades[self.index(a, b)])
                .fold(0.0, f32::max);
            let index = self.index(x, z);
            self.levels[level as usize].faded[index] = value;
            self.write_corner(level, x, z, value);
        }
    }

    /// Adds to the fade, which is up to date, what the promised error needs.
    pub(super) fn dial(&mut self, windows: &[Window], dial: &Dial<'_>) {
        self.dialled = true;
        for pair in windows.windows(2) {
            let [window, coarser] = pair else { continue };
            let level = window.level();
            let patches = touched(window, dial.extent.grid);
            self.needs.clear();
            self.needs
                .extend(patches.cells().map(|(a, b)| dial.need(coarser, a, b)));
            let corners = Rect::new(patches.x0, patches.z0, patches.x1 + 1, patches.z1 + 1);
            for (x, z) in corners.cells() {
                let touching = Rect::new(x - 1, z - 1, x + 1, z + 1).intersection(patches);
                let need = touching
                    .cells()
                    .map(|(a, b)| {
                        self.needs[((b - patches.z0) * patches.width() + (a - patches.x0)) as usize]
                    })
                    .fold(1.0, f32::min);
                self.write_corner(level, x, z, need.max(self.faded(level, x, z)));
            }
        }
    }

    /// Fills `required` with the least fade that the missing samples of `window` ask for, patch by patch.
    fn require(
        &mut self,
        window: &Window,
        patches: Rect,
        eye: [f64; 2],
        reach: f64,
        span: impl Fn(i64, i64) -> Rect,
    ) {
        self.required.clear();
        self.required.resize(patches.area() as usize, 0.0);
        for missing in window.missing.rects() {
            for (a, b) in touched_by(missing).intersection(patches).cells() {
                let nearest = distance(span(a, b).intersection(missing), eye);
                let k = ((b - patches.z0) * patches.width() + (a - patches.x0)) as usize;
                let required = (reach + 2.0 - nearest).clamp(0.0, 1.0) as f32;
                self.required[k] = self.required[k].max(required);
            }
        }
    }

    /// Whether a patch or one of its eight neighbours has not finished its fade.
    fn held_around(&self, patch: Patch) -> bool {
        let Some(field) = self.levels.get(patch.level as usize - 1) else {
            return false;
        };
        let around =
            Rect::new(patch.a - 1, patch.b - 1, patch.a + 2, patch.b + 2).intersection(field.patches);
        around.cells().any(|(a, b)| field.fades[self.index(a, b)] > 0.0)
    }

    fn index(&self, x: i64, z: i64) -> usize {
        (slot(z, self.size) * self.size + slot(x, self.size)) as usize
    }
}

/// The patches of the next coarser level that a window touches.
fn touched(window: &Window, grid: &Grid) -> Rect {
    touched_by(window.resident()).intersection(grid.patches(window.level() + 1).rect())
}

/// The patches of the next coarser level that have one of the samples `rect` on or in them.
fn touched_by(rect: Rect) -> Rect {
    if rect.is_empty() {
        return Rect::EMPTY;
    }
    let low = |first: i64| (first - 1).div_euclid(SPAN); // a shared side belongs to both
    let high = |end: i64| (end - 1).div_euclid(SPAN) + 1;
    Rect::new(low(rect.x0), low(rect.z0), high(rect.x1), high(rect.z1))
}
