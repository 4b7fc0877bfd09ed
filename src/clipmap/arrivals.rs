//! Arrivals: reading what windows miss, coarse levels first, within a frame's budget.

use std::collections::HashSet;

use super::eye::Eye;
use super::missing::distance;
use super::plan::{HEIGHT_BYTES, LevelPlan, UpdatePlan};
use super::succession::Successor;
use super::window::{Scratch, Window, is_damage};
use crate::error::{Error, ErrorKind, Result};
use crate::grid::Rect;
use crate::levels::{Arrival, Levels, Wanted};

/// Samples along a side of the tiles that data come in: nothing that is asked for at once crosses their borders, so
/// that a tile which is late, or damaged, holds up no other.
const TILE: i64 = 256;

/// Whether frames wait for their data.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wait {
    /// Every frame has all of its data, and the same camera makes the same picture.
    #[default]
    All,
    /// A frame is drawn with what is there, and from the next coarser surface where that is not enough.
    None,
}

/// Faults that are told apart, at most: a file that is damaged all over must not fill the memory.
const MOST_FAULTS: usize = 1024;

/// What an update's reading met.
#[derive(Debug, Default)]
pub(super) struct Arrivals {
    faults: Faults,
    wanted: Vec<Wanted>,
    /// Whether the last that `levels` heard was that something is wanted.
    wants: bool,
}

/// Faults that did not end an update, each about rectangles that stay missing.
#[derive(Debug, Default)]
pub(super) struct Faults {
    /// Those that nobody has taken yet.
    kept: Vec<Error>,
    said: HashSet<String>,
}

impl Faults {
    /// Keeps a fault, unless it was said before: new ground of a damaged tile says it again.
    pub(super) fn push(&mut self, fault: Error) {
        if self.said.len() < MOST_FAULTS && self.said.insert(fault.to_string()) {
            self.kept.push(fault);
        }
    }
}

/// Bytes of samples that an update writes at most where no budget is set, but for the first: filling in that much takes
/// 1 to 2 ms, and what has arrived all at once can wait a frame.
pub const FRAME_BYTES: u64 = 768 << 10;

/// Where the eye is, and where it is going.
#[derive(Clone, Copy, Debug)]
pub(super) struct Course<'a> {
    pub(super) eye: &'a Eye,
    /// Where it will be in a moment, if it goes on like that.
    pub(super) ahead: Eye,
    /// The finest level that shows anything from here.
    pub(super) finest_shown: usize,
}

impl Clone for Arrivals {
    /// Faults stay with the original: each is reported once.
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl Arrivals {
    /// Takes the faults that were met since the last call.
    pub(super) fn take_faults(&mut self) -> Vec<Error> {
        std::mem::take(&mut self.faults.kept)
    }

    /// Reads all that `windows` miss, and lists what is written in `plan`.
    ///
    /// # Errors
    /// Those of `levels`, and [`ErrorKind::Unsupported`] where it answers without the data.
    pub(super) fn all(
        &mut self,
        levels: &dyn Levels,
        windows: &mut [Window],
        plan: &mut UpdatePlan,
        scratch: &mut Scratch,
    ) -> Result<()> {
        self.wanted.clear();
        for written in plan.levels_mut() {
            let window = &windows[written.level as usize];
            for rect in window.missing.waiting() {
                window.wants(*rect, levels.has_light(), &mut self.wanted);
            }
        }
        self.ask(levels);
        for written in plan.levels_mut() {
            let window = &mut windows[written.level as usize];
            each(window, |window, rect| {
                match window.fill(levels, rect, written, scratch, None)? {
                    Arrival::Arrived => Ok(Rect::EMPTY),
                    Arrival::Missing => {
                        let what = "data are missing that the frame needs";
                        Err(Error::new(ErrorKind::Unsupported, "terrain", what)
                            .advice("draw without waiting, or use a source that waits for its data"))
                    }
                }
            })?;
        }
        Ok(())
    }

    /// Reads what is there of what `windows` miss, near ground first, until `budget_bytes` of samples are written, or where
    /// none are said and there is something to be drawn, [`FRAME_BYTES`]; how much of it is left. The coarsest level is
    /// beyond any budget: without it nothing can be drawn.
    ///
    /// # Errors
    /// Those of `levels` but for data that are damaged or cannot be read, which stay missing and are noted; there is
    /// nothing to be drawn instead of the coarsest level.
    pub(super) fn some(
        &mut self,
        levels: &dyn Levels,
        windows: &mut [Window],
        successors: &mut [Option<Successor>],
        plan: &mut UpdatePlan,
        scratch: &mut Scratch,
        course: &Course<'_>,
        budget_bytes: Option<u64>,
    ) -> Result<u64> {
        let coarsest = windows.len() as u32 - 1;
        let first = plan.levels().iter().all(|p| p.from.is_empty());
        let mut left_bytes = budget_bytes.unwrap_or(if first { u64::MAX } else { FRAME_BYTES });
        let has_light = levels.has_light();
        // The first frame is not kept waiting by levels that it does not show.
        let finest = if first { course.finest_shown as u32 } else { 0 };
        self.wanted.clear();
        for written in plan.levels_mut().iter().filter(|p| p.level >= finest) {
            let window = &mut windows[written.level as usize];
            let at = course.ahead.samples().map(|s| s / (1i64 << written.level) as f64);
            window.missing.by_tile(TILE, at);
            for rect in window.missing.waiting() {
                window.wants(*rect, has_light, &mut self.wanted);
            }
        }
        // Then what is to take the place of what is drawn.
        for written in plan.levels_mut() {
            let Some(Successor { window, .. }) = &mut successors[written.level as usize] else {
                continue;
            };
            let at = course.eye.samples().map(|s| s / (1i64 << written.level) as f64);
            window.missing.by_tile(TILE, at);
            for rect in window.missing.waiting() {
                window.wants(*rect, has_light, &mut self.wanted);
            }
        }
        // Then what the windows will gain in a moment.
        for written in plan.levels_mut() {
            let window = &windows[written.level as usize];
            let target = window.target(&course.ahead);
            // A level that the eye leaves behind at that speed has nothing to gain.
            if target.intersection(window.resident()).is_empty() {
                continue;
            }
            for rect in target.difference(window.resident()) {
                window.wants(rect, has_light, &mut self.wanted);
            }
        }
        self.ask(levels);
        let faults = &mut self.faults;
        for written in plan.levels_mut().iter_mut().filter(|p| p.level >= finest) {
            let window = &mut windows[written.level as usize];
            let at = course.eye.samples().map(|s| s / (1i64 << written.level) as f64);
            let first = window.level() == coarsest && written.from.is_empty();
            each(window, |window, rect| {
                if first {
                    // Nothing can be drawn before it is there.
                    self.wanted.clear();
                    window.wants(rect, has_light, &mut self.wanted);
                    levels.wait_for(&self.wanted);
                }
                let limit = if window.level() == coarsest {
                    u64::MAX
                } else {
                    left_bytes
                };
                let part = affordable(window, rect, at, limit);
                if part.is_empty() {
                    return Ok(rect);
                }
                match window.fill(levels, part, written, scratch, Some(&mut *faults)) {
                    Ok(Arrival::Arrived) if window.level() == coarsest => {}
                    Ok(Arrival::Arrived) => left_bytes -= bytes(window, part),
                    Ok(Arrival::Missing) => return Ok(rect),
                    Err(error) if is_damage(&error) && window.level() != coarsest => {
                        window.missing.lose(part);
                        faults.push(error);
                    }
                    Err(error) => return Err(error),
                }
                rect.difference(part).for_each(|rest| window.missing.wait(rest));
                Ok(Rect::EMPTY)
            })?;
        }
        Ok(left_bytes)
    }

    /// Reads what is there of the windows that are to take others' places, coarse levels first, and lets those of which all
    /// is there do so, as far as `left_bytes` of uploads go.
    ///
    /// # Errors
    /// As [`Arrivals::some`].
    pub(super) fn succeed(
        &mut self,
        levels: &dyn Levels,
        windows: &mut [Window],
        successors: &mut [Option<Successor>],
        plan: &mut UpdatePlan,
        scratch: &mut Scratch,
        eye: &Eye,
        mut left_bytes: u64,
    ) -> Result<()> {
        let faults = &mut self.faults;
        // What was read for the windows themselves has taken its time already.
        let mut left_to_read = FRAME_BYTES.saturating_sub(plan.bytes());
        for written in plan.levels_mut() {
            let level = written.level as usize;
            let Some(successor) = &mut successors[level] else {
                continue;
            };
            let mut unseen = LevelPlan::new(written.level);
            let at = eye.samples().map(|s| s / (1i64 << written.level) as f64);
            each(&mut successor.window, |window, rect| {
                let part = affordable(window, rect, at, left_to_read);
                if part.is_empty() {
                    return Ok(rect);
                }
                match window.fill(levels, part, &mut unseen, scratch, Some(&mut *faults)) {
                    Ok(Arrival::Arrived) => left_to_read -= bytes(window, part),
                    Ok(Arrival::Missing) => return Ok(rect),
                    // What cannot be read stays as it was drawn.
                    Err(error) if is_damage(&error) => {
                        window.missing.lose(part);
                        faults.push(error);
                    }
                    Err(error) => return Err(error),
                }
                rect.difference(part).for_each(|rest| window.missing.wait(rest));
                Ok(Rect::EMPTY)
            })?;
            if successor.take_over(&mut windows[level], at, &mut left_bytes, written) {
                successors[level] = None;
            }
        }
        Ok(())
    }

    /// Tells `levels` what is wanted, and once that nothing is.
    fn ask(&mut self, levels: &dyn Levels) {
        if self.wants || !self.wanted.is_empty() {
            levels.want(&self.wanted);
        }
        self.wants = !self.wanted.is_empty();
    }
}

/// Hands every rectangle that `window` waits for to `read`, which answers with what is still to be waited for.
fn each(window: &mut Window, mut read: impl FnMut(&mut Window, Rect) -> Result<Rect>) -> Result<()> {
    let taken = window.missing.take();
    let mut result = Ok(());
    for &rect in &taken {
        let rest = match &result {
            Ok(()) => read(window, rect).unwrap_or_else(|error| {
                result = Err(error);
                rect
            }),
            Err(_) => rect,
        };
        window.missing.wait(rest);
    }
    window.missing.done(taken);
    result
}

/// The bytes of samples that `rect` writes.
pub(super) fn bytes(window: &Window, rect: Rect) -> u64 {
    let light = window.light_of(rect);
    rect.area() as u64 * HEIGHT_BYTES + light.area() as u64 * window.light_bytes()
}

/// The part of `rect` that `limit_bytes` pay for: whole rows where that is one, else a part of a row; from the side
/// that is nearer to `eye` (in samples of the level).
pub(super) fn affordable(window: &Window, rect: Rect, eye: [f64; 2], limit_bytes: u64) -> Rect {
    if bytes(window, rect) <= limit_bytes {
        return rect;
    }
    let row = Rect {
        z1: rect.z0 + 1,
        ..rect
    };
    let rows = count(limit_bytes, bytes(window, row), rect.height());
    if rows > 0 {
        let south = Rect {
            z0: rect.z1 - rows,
            ..rect
        };
        let north = Rect {
            z1: rect.z0 + rows,
            ..rect
        };
        return if distance(south, eye) < distance(north, eye) {
            south
        } else {
            north
        };
    }
    let sample = Rect {
        x1: rect.x0 + 1,
        ..row
    };
    let columns = count(limit_bytes, bytes(window, sample), rect.width());
    if columns == 0 {
        return Rect::EMPTY;
    }
    let east = Rect {
        x0: rect.x1 - columns,
        ..row
    };
    let west = Rect {
        x1: rect.x0 + columns,
        ..row
    };
    if distance(east, eye) < distance(west, eye) {
        east
    } else {
        west
    }
}

/// How many of at most `most` parts of `part_bytes` each fit into `limit_bytes`. The first part of a rectangle never
/// has fewer bytes of light than another: only a level's last samples lack some.
fn count(limit_bytes: u64, part_bytes: u64, most: i64) -> i64 {
    i64::try_from(limit_bytes / part_bytes.max(1)).map_or(most, |n| n.min(most))
}
