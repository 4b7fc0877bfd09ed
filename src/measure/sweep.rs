//! The sweep: one flight over many settings, planned, timed in turns, and measured.
//!
//! *Planned*: every frame of the flight by the CPU alone: triangles, bytes, what is certified. *Timed*: whole frames, in
//! rounds; each round flies each setting once, begun with another setting each time, so that what drifts hits all alike;
//! a frame that is not counted goes before each. *Measured*: frames spread evenly over the flight, against `S0`.

use super::row::Row;
use super::score::{Scene, Score};
use super::settings::Setting;
use crate::build::Threads;
use crate::camera::{Flight, View};
use crate::clipmap::{Clipmap, HEIGHT_BYTES, certify};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::levels::Levels;
use crate::progress::Progress;
use crate::pyramid::FilterKind;
use crate::render::{Headless, HeadlessOptions};
use crate::stats::percentile;

/// How much is flown.
#[derive(Clone, Debug, PartialEq)]
pub struct Effort {
    /// Every how many frames of the flight one is timed.
    pub stride: u64,
    /// Rounds of timing.
    pub rounds: u32,
    /// Frames that are measured.
    pub measured_frames: u64,
}

impl Effort {
    /// For [`super::SettingLists::quick`].
    pub const QUICK: Self = Self {
        stride: 8,
        rounds: 3,
        measured_frames: 5,
    };

    /// For [`super::SettingLists::full`].
    pub const FULL: Self = Self {
        stride: 1,
        rounds: 5,
        measured_frames: 25,
    };

    /// The frames that are timed.
    pub fn timed(&self, flight: &Flight) -> Vec<u64> {
        (0..flight.frame_count())
            .step_by(self.stride.max(1) as usize)
            .collect()
    }

    /// The frames that are measured: evenly from the first to the last.
    pub fn measured(&self, flight: &Flight) -> Vec<u64> {
        let last = flight.frame_count() - 1;
        let count = self.measured_frames.clamp(1, last + 1);
        match count {
            1 => vec![last / 2],
            _ => (0..count).map(|k| k * last / (count - 1)).collect(),
        }
    }
}

/// What is swept over.
pub struct Sweep<'a> {
    /// The device.
    pub gpu: &'a Gpu,
    /// The terrain, and the name of the filter that made its coarser levels.
    pub terrain: (&'a dyn Levels, &'a str),
    /// The same with coarser levels made by other filters.
    pub rebuilt: &'a [(FilterKind, Box<dyn Levels + 'a>)],
    /// The path.
    pub flight: &'a Flight,
    /// Size and look of frames, and what of the clipmap no setting says.
    pub options: HeadlessOptions,
    /// How much is flown.
    pub effort: Effort,
}

/// A setting while it is swept.
struct Case {
    setting: Setting,
    times_ms: Vec<f64>,
    medians_ms: Vec<f64>,
}

impl Sweep<'_> {
    /// Flies all of `settings`; the first is the base setting.
    ///
    /// # Errors
    /// Those of drawing and reading; [`crate::ErrorKind::Cancelled`].
    pub fn run(&self, settings: &[Setting], threads: &Threads, progress: &dyn Progress) -> Result<Vec<Row>> {
        let mut cases: Vec<Case> = settings
            .iter()
            .map(|setting| Case {
                setting: *setting,
                times_ms: Vec::new(),
                medians_ms: Vec::new(),
            })
            .collect();
        self.time(&mut cases, progress)?;
        let scene = Scene::new(self, threads)?;
        let measured = self.effort.measured(self.flight);
        progress.begin("measured frames", (cases.len() * measured.len()) as u64);
        let mut rows = Vec::new();
        for (number, case) in cases.iter_mut().enumerate() {
            let score = scene.score(self, &case.setting, &measured, progress)?;
            rows.push(self.row(number, case, score, progress)?);
        }
        super::pareto::mark_front(&mut rows);
        Ok(rows)
    }

    /// The levels that a setting draws, and the name of the filter that made the coarser ones.
    pub(super) fn levels(&self, setting: &Setting) -> (&dyn Levels, &str) {
        let (levels, filter) = self.terrain;
        match setting.filter {
            None => (levels, filter),
            Some(kind) => {
                let found = self.rebuilt.iter().find(|(other, _)| *other == kind);
                found.map_or((levels, filter), |(kind, levels)| (levels.as_ref(), kind.name()))
            }
        }
    }

    pub(super) fn headless(&self, setting: &Setting) -> Result<Headless> {
        let options = HeadlessOptions {
            clipmap: setting.clipmap(&self.options.clipmap),
            ..self.options
        };
        Headless::new(self.gpu.clone(), self.levels(setting).0, &options)
    }

    fn time(&self, cases: &mut [Case], progress: &dyn Progress) -> Result<()> {
        let frames = self.effort.timed(self.flight);
        let rounds = self.effort.rounds.max(1) as usize;
        progress.begin("timed frames", (rounds * cases.len() * frames.len()) as u64);
        let count = cases.len();
        for round in 0..rounds {
            let first = round * count / rounds;
            for k in 0..count {
                let case = &mut cases[(first + k) % count];
                let levels = self.levels(&case.setting).0;
                let mut headless = self.headless(&case.setting)?;
                let mut draw = |frame: u64| {
                    let camera = self.flight.camera_at_frame(frame);
                    headless.frame(levels, &camera, self.flight.time_of_frame_s(frame))
                };
                draw(frames[0])?;
                let mut times_ms = Vec::with_capacity(frames.len());
                for &frame in &frames {
                    cancel(progress)?;
                    times_ms.push(draw(frame)?.frame_ms);
                    progress.advance(1);
                }
                times_ms.sort_by(f64::total_cmp);
                case.medians_ms.push(percentile(&times_ms, 50.0));
                case.times_ms.extend(times_ms);
            }
        }
        Ok(())
    }

    fn row(&self, number: usize, case: &mut Case, score: Score, progress: &dyn Progress) -> Result<Row> {
        let plan = self.plan(&case.setting, progress)?;
        case.times_ms.sort_by(f64::total_cmp);
        let medians = &case.medians_ms;
        Ok(Row {
            number,
            setting: case.setting,
            filter: self.levels(&case.setting).1.into(),
            level_count: plan.level_count,
            transition: plan.transition,
            cut: plan.cut,
            frame_ms_median: percentile(&case.times_ms, 50.0),
            frame_ms_p99: percentile(&case.times_ms, 99.0),
            frame_ms_spread: [
                medians.iter().copied().fold(f64::INFINITY, f64::min),
                medians.iter().copied().fold(0.0, f64::max),
            ],
            triangles: median_and_greatest(plan.triangles),
            upload_bytes: median_and_greatest(plan.upload_bytes),
            height_bytes: median_and_greatest(plan.height_bytes)[0],
            memory_bytes: plan.mirror_bytes + score.texture_bytes,
            errors: score.pool.summary(),
            worst_frame: score.pool.worst_frame(),
            certified_error_px: plan.certified_error_px,
            uncertified_frames: plan.uncertified_frames,
            cracks: score.cracks,
            pareto: false,
        })
    }

    /// Every frame of the flight by the CPU alone.
    fn plan(&self, setting: &Setting, progress: &dyn Progress) -> Result<Plan> {
        let levels = self.levels(setting).0;
        let mut clipmap = Clipmap::new(levels, &setting.clipmap(&self.options.clipmap))?;
        let mut plan = Plan {
            level_count: clipmap.windows().len() as u32,
            transition: clipmap.ring().transition,
            mirror_bytes: clipmap
                .windows()
                .iter()
                .map(|w| (size_of_val(w.heights()) + size_of_val(w.light())) as u64)
                .sum(),
            certified_error_px: Some(0.0),
            ..Plan::default()
        };
        for frame in 0..self.flight.frame_count() {
            cancel(progress)?;
            let view = View::new(self.flight.camera_at_frame(frame), self.options.size_px)?;
            let report = *clipmap.update(levels, &view, self.flight.time_of_frame_s(frame))?;
            plan.cut |= report.cut;
            plan.triangles.push(report.triangles);
            if frame > 0 || self.flight.frame_count() == 1 {
                plan.upload_bytes.push(report.upload_bytes);
                let heights = clipmap.plan().levels().iter().flat_map(|level| &level.heights);
                plan.height_bytes
                    .push(heights.map(|rect| rect.area() as u64 * HEIGHT_BYTES).sum());
            }
            match certify(&clipmap)?.error_px {
                Ok(px) => plan.certified_error_px = plan.certified_error_px.map(|most: f64| most.max(px)),
                Err(_) => {
                    plan.certified_error_px = None;
                    plan.uncertified_frames += 1;
                }
            }
        }
        Ok(plan)
    }
}

/// What the CPU alone tells of a setting.
#[derive(Default)]
struct Plan {
    level_count: u32,
    transition: i64,
    cut: bool,
    mirror_bytes: u64,
    triangles: Vec<u64>,
    upload_bytes: Vec<u64>,
    height_bytes: Vec<u64>,
    certified_error_px: Option<f64>,
    uncertified_frames: u64,
}

fn median_and_greatest(mut values: Vec<u64>) -> [u64; 2] {
    values.sort_unstable();
    [values[(values.len() - 1) / 2], values[values.len() - 1]]
}

pub(super) fn cancel(progress: &dyn Progress) -> Result<()> {
    if progress.cancelled() {
        Err(Error::cancelled("measure"))
    } else {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;

    #[test]
    fn frames_are_spread_from_the_first_to_the_last() {
        let flight = Flight::orbit(&Grid::new(100, 100, [1.0, 1.0]), 0.0, 10.0);
        let last = flight.frame_count() - 1;
        for measured_frames in [1, 2, 7, last + 1, last + 99] {
            let effort = Effort {
                measured_frames,
                ..Effort::QUICK
            };
            let frames = effort.measured(&flight);
            assert_eq!(frames.len() as u64, measured_frames.min(last + 1));
            assert!(frames.is_sorted() && frames.windows(2).all(|w| w[0] < w[1]));
            if measured_frames > 1 {
                assert_eq!((frames[0], frames[frames.len() - 1]), (0, last));
            }
            assert!(effort.timed(&flight).iter().all(|k| *k <= last));
        }
        assert_eq!(median_and_greatest(vec![4, 1, 9, 2]), [2, 9]);
    }
}
