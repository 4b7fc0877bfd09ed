//! The clipmap of one view, on the CPU: windows, update plan, alpha, selection, and the twin of the vertex function.
//!
//! Each frame, [`Clipmap::update`] moves every level's [`Window`] to where the eye is (the [`UpdatePlan`] lists exactly
//! what that exposes), then selects the patches to draw. The GPU holds copies of the windows' mirrors and draws the
//! [`Selection`]; it knows nothing more.

mod access;
pub mod alpha;
mod arrivals;
mod certificate;
mod clearance;
mod constants;
mod drawn;
mod extent;
mod eye;
mod fit;
mod frustum;
mod gaps;
mod ground;
mod held;
mod identity;
mod missing;
mod need;
mod occlusion;
mod options;
mod plan;
mod range;
mod relief;
mod report;
mod scene;
mod screen;
mod selection;
mod stray;
mod succession;
mod vertex;
mod window;

pub use arrivals::{FRAME_BYTES, Wait};
pub use certificate::{
    Certificate, CertifiedPatch, Terms, Uncertified, certified_patches, certify, certify_by,
};
pub use constants::{
    LEVEL_SLOTS, LIGHT_TEXEL_STEPS, LevelConstants, Ring, VOID_HEIGHT, ViewConstants, light_level, near_m,
    near_of_m,
};
pub use drawn::{CORNERS, Corners, Drawn, Place};
pub use eye::Eye;
pub use fit::{ClipSizeFit, fit_clip_size};
pub use frustum::Frustum;
pub use held::{FADE_S, HeldField};
pub use options::{ClipmapOptions, MAX_ERROR_PX, MAX_VERTICAL_SCALE};
use plan::exposed_bytes_of;
pub use plan::{HEIGHT_BYTES, LIGHT_BYTES, LevelPlan, UpdatePlan, exposed_bytes};
pub use range::height_range_m;
pub(crate) use relief::light_texels;
pub use report::UpdateReport;
pub use scene::Scene;
pub use screen::Screen;
pub use selection::{CLOSER_TRIANGLES, Instance, PATCH_TRIANGLES, Selection, Side};
pub use vertex::{Vertex, displace};
pub use window::{DayTexel, LightTexel, PatchInfo, Window};

use crate::camera::View;
use crate::error::{Error, ErrorKind, Result};
use crate::grid::Grid;
use crate::levels::Levels;
use arrivals::{Arrivals, Course};
use extent::Extent;
use ground::Ground;
use held::{FadeReport, Moment};
use identity::Identity;
use need::Dial;
use occlusion::Slack;
use range::range_of;
use succession::Successor;
use window::Scratch;

/// Seconds of flight for which what windows will gain is wanted beforehand, without waiting.
pub const AHEAD_S: f64 = 1.0;

/// The clipmap of one view.
#[derive(Clone, Debug)]
pub struct Clipmap {
    identity: Identity,
    grid: Grid,
    ring: Ring,
    vertical_scale: f64,
    cull: bool,
    occlusion: bool,
    max_error_px: Option<f64>,
    levels_asked: Option<u32>,
    cut: bool,
    has_light: bool,
    day_asked: bool,
    has_day: bool,
    range_m: [f32; 2],
    windows: Vec<Window>,
    /// By level: the window that is to take a window's place, where the terrain has something better.
    successors: Vec<Option<Successor>>,
    edition: u64,
    held: HeldField,
    wait: Wait,
    upload_budget_bytes: Option<u64>,
    last_time_s: Option<f64>,
    last_eye: Option<[f64; 2]>,
    plan: UpdatePlan,
    generation: u64,
    eye: Option<Eye>,
    screen: Option<Screen>,
    view_constants: ViewConstants,
    level_constants: Vec<LevelConstants>,
    grounds: Vec<f64>,
    selection: Selection,
    scratch: Scratch,
    arrivals: Arrivals,
    report: UpdateReport,
}

impl Clipmap {
    /// A clipmap over `levels`, with nothing resident yet.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] for options out of range; those of `levels`.
    pub fn new(levels: &dyn Levels, options: &ClipmapOptions) -> Result<Self> {
        let grid = *levels.grid();
        grid.check()
            .map_err(|what| Error::new(ErrorKind::Misuse, "terrain", what))?;
        options.check()?;
        let ring = options.ring()?;
        // Beyond the first level that fits into one window the rings have nothing to add, the dial has.
        let fitting = match options.max_error_px {
            None => grid.levels_until(ring.clip_size).min(levels.level_count()),
            Some(_) => levels.level_count(),
        };
        let count = options.levels.map_or(fitting, |l| l.min(fitting));
        let has_day = options.day && levels.has_day();
        Ok(Self {
            identity: Identity::new(),
            grid,
            ring,
            vertical_scale: options.vertical_scale,
            cull: options.cull,
            occlusion: options.occlusion,
            max_error_px: options.max_error_px,
            levels_asked: options.levels,
            cut: count < fitting,
            has_light: levels.has_light(),
            day_asked: options.day,
            has_day,
            range_m: height_range_m(levels)?,
            windows: (0..count)
                .map(|l| Window::new(l, &grid, &ring).with_day(has_day))
                .collect(),
            successors: vec![None; count as usize],
            edition: levels.edition(),
            held: HeldField::new(count, ring.held_size()),
            wait: options.wait,
            upload_budget_bytes: options.upload_budget_bytes,
            last_time_s: None,
            last_eye: None,
            plan: UpdatePlan::new(count),
            generation: 0,
            eye: None,
            screen: None,
            view_constants: bytemuck::Zeroable::zeroed(),
            level_constants: Vec::with_capacity(count as usize),
            grounds: Vec::with_capacity(count as usize),
            selection: Selection::default(),
            scratch: Scratch::default(),
            arrivals: Arrivals::default(),
            report: UpdateReport::default(),
        })
    }

    /// Takes over from `options` what can change without reading anything anew, from the next update on: transition,
    /// vertical scale, culling, the promised error and the budget. False, and nothing changed, where they ask for another
    /// clip size or other levels, for a promise where none was or none where one was, and likewise for light over a day and
    /// for waiting: that takes a clipmap of its own.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] for options out of range.
    pub fn adopt(&mut self, options: &ClipmapOptions) -> Result<bool> {
        options.check()?;
        let ring = options.ring()?;
        let same = ring.clip_size == self.ring.clip_size
            && options.max_error_px.is_some() == self.max_error_px.is_some()
            && options.wait == self.wait
            && options.levels == self.levels_asked
            && options.day == self.day_asked;
        if same {
            self.ring = ring;
            self.vertical_scale = options.vertical_scale;
            self.cull = options.cull;
            self.occlusion = options.occlusion;
            self.max_error_px = options.max_error_px;
            self.upload_budget_bytes = options.upload_budget_bytes;
        }
        Ok(same)
    }

    /// Moves the windows to where the view's eye is, reading what that exposes, and selects what to draw.
    ///
    /// `time_s` is the time of the frame in seconds, from wherever it is counted: by it, data that arrive late fade
    /// in. Where every frame waits for its data it changes nothing.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] for a view or a time of other than finite numbers; those of `levels`, after which what
    /// could not be read is still missing and is read again by the next update. Without waiting, data that are
    /// damaged or cannot be read are no error but on the coarsest level: the next coarser one is drawn, see
    /// [`Clipmap::take_faults`].
    pub fn update(&mut self, levels: &dyn Levels, view: &View, time_s: f64) -> Result<&UpdateReport> {
        view.check()?;
        if !time_s.is_finite() {
            return Err(Error::new(
                ErrorKind::Misuse,
                "time",
                format!("{time_s} s is not finite"),
            ));
        }
        let eye = Eye::new(view.eye, &self.grid);
        self.eye = None; // until all is done, there is no frame
        self.generation += 1;
        self.meet_edition(levels);
        self.plan.begin(&self.windows, &eye);
        let mut exposed = 0;
        for plan in self.plan.levels() {
            let light_size = self.grid.level(light_level(plan.level));
            let light_bytes = self.windows[plan.level as usize].light_bytes();
            exposed += exposed_bytes_of(plan.level, plan.from, plan.to, light_size, light_bytes);
            self.windows[plan.level as usize].move_to(plan.to);
            if let Some(successor) = &mut self.successors[plan.level as usize] {
                successor.move_to(plan.to);
            }
        }
        let fades = self.read_and_fade(levels, &eye, time_s)?;
        gaps::hand_up(&mut self.windows);
        let ground = Ground {
            windows: &self.windows,
            grid: &self.grid,
            held: &self.held,
            least_m: self.range_m[0],
        };
        ground::grounds(&ground, &eye, &mut self.grounds);
        self.view_constants = ViewConstants::new(view, &eye, &self.grid, &self.ring, self.vertical_scale);
        self.level_constants.clear();
        for level in 0..self.windows.len() {
            let coarser = level + 1 < self.windows.len();
            let climb_m = if coarser {
                eye.height_m - self.grounds[level]
            } else {
                0.0
            };
            let constants = LevelConstants::new(level as u32, coarser, &eye, &self.grid, &self.ring, climb_m);
            self.level_constants.push(constants);
        }
        let screen = Screen::new(view, &self.grid);
        if let Some(max_error_px) = self.max_error_px {
            let extent = Extent {
                grid: &self.grid,
                eye: &eye,
                vertical_scale: self.vertical_scale,
            };
            let dial = Dial {
                extent,
                screen: &screen,
                max_error_px,
            };
            self.held.dial(&self.windows, &dial);
        }
        let frustum = Frustum::new(view);
        let greatest_m = self.range_m.map(|m| f64::from(m).abs());
        let greatest_m = greatest_m[0].max(greatest_m[1]) + eye.height_m.abs();
        let slack = Slack::new(&screen, greatest_m * self.vertical_scale.abs());
        self.selection.select(&Scene {
            grid: &self.grid,
            ring: &self.ring,
            eye: &eye,
            windows: &self.windows,
            levels: &self.level_constants,
            held: &self.held,
            frustum: self.cull.then_some(&frustum),
            occlusion: (self.cull && self.occlusion).then_some(slack),
            vertical_scale: self.vertical_scale,
        });
        self.eye = Some(eye);
        self.screen = Some(screen);
        let shown = self.finest_shown(&eye)..self.windows.len() - 1;
        let stale_levels = shown.clone().filter(|l| fades.held[*l]).count() as u32;
        let pops = shown.map(|l| fades.pops[l]).sum();
        let coarsest_there = self.windows[self.windows.len() - 1].missing().next().is_none();
        let provisional = self.windows.iter().any(Window::is_provisional);
        self.report = UpdateReport {
            uploads: self.plan.uploads() as u64,
            upload_bytes: self.plan.bytes(),
            upload_bytes_exposed: exposed,
            patches: self.selection.patches(),
            patches_culled: self.selection.culled,
            triangles: self.selection.triangles(),
            levels_drawn: self.selection.levels.count_ones(),
            complete: stale_levels == 0 && coarsest_there && !provisional,
            stale_levels,
            pops,
            cut: self.cut,
            provisional,
        };
        Ok(&self.report)
    }

    /// The finest level that can show anything. A level shows nothing, late or not, where the camera has climbed beyond its
    /// reach. That is judged from the highest ground that there may be: the ground that its climb is measured from may
    /// itself be late.
    fn finest_shown(&self, eye: &Eye) -> usize {
        let over_all_m = eye.height_m - f64::from(self.range_m[1]);
        let mean_spacing_m = (self.grid.spacing_m[0] * self.grid.spacing_m[1]).sqrt();
        let coarsest = self.windows.len() - 1;
        let shows = |level: &usize| {
            let step_m = mean_spacing_m * (1i64 << level) as f64;
            1.25 * over_all_m / step_m < self.ring.reach() as f64
        };
        (0..coarsest).find(shows).unwrap_or(coarsest)
    }

    /// Where the terrain has something better than what was read so far, all of that is to be read anew.
    fn meet_edition(&mut self, levels: &dyn Levels) {
        let edition = levels.edition();
        if edition == self.edition {
            return;
        }
        self.edition = edition;
        for (window, successor) in self.windows.iter_mut().zip(&mut self.successors) {
            let fresh = Window::new(window.level(), &self.grid, &self.ring).with_day(self.has_day);
            match self.wait {
                Wait::All => *window = fresh,
                Wait::None => *successor = Some(Successor::new(fresh)),
            }
        }
        if self.wait == Wait::All {
            self.has_light = levels.has_light();
        }
    }

    /// Reads what the windows miss, and holds back what has not arrived.
    fn read_and_fade(&mut self, levels: &dyn Levels, eye: &Eye, time_s: f64) -> Result<FadeReport> {
        let samples = eye.samples();
        let last_eye = self.last_eye.unwrap_or(samples);
        let passed_s = self.last_time_s.map_or(0.0, |last| (time_s - last).max(0.0));
        (self.last_eye, self.last_time_s) = (Some(samples), Some(time_s));
        let finest_shown = self.finest_shown(eye);
        let (windows, plan, scratch) = (&mut self.windows, &mut self.plan, &mut self.scratch);
        if self.wait == Wait::All {
            self.arrivals.all(levels, windows, plan, scratch)?;
            return Ok(FadeReport::default());
        }
        let budget = self.upload_budget_bytes;
        let course = Course {
            eye,
            ahead: eye.ahead(last_eye, passed_s, AHEAD_S),
            finest_shown,
        };
        let successors = &mut self.successors;
        let left_bytes = self
            .arrivals
            .some(levels, windows, successors, plan, scratch, &course, budget)?;
        if successors.iter().any(Option::is_some) {
            self.arrivals
                .succeed(levels, windows, successors, plan, scratch, eye, left_bytes)?;
            if successors.iter().all(Option::is_none) {
                self.has_light = levels.has_light();
                self.range_m = range_of(&windows[windows.len() - 1]).unwrap_or(self.range_m);
            }
        }
        let moment = Moment {
            grid: &self.grid,
            eye,
            last_eye,
            reach: self.ring.reach() as f64,
            passed_s,
        };
        Ok(self.held.update(&self.windows, &moment))
    }

    /// Takes the faults that updates without waiting have met since the last call: data that are damaged or cannot
    /// be read, in whose place the next coarser level is drawn.
    pub fn take_faults(&mut self) -> Vec<Error> {
        self.arrivals.take_faults()
    }
}

/// That a clipmap has no frame to speak of.
fn no_frame(what: &str) -> Error {
    Error::new(ErrorKind::Misuse, "clipmap", format!("there is no frame {what}")).advice("update it first")
}
