//! The clipmap of one view, on the CPU: windows, update plan, alpha, selection, and the twin of the vertex function.
//!
//! Each frame, [`Clipmap::update`] moves every level's [`Window`] to where the eye is (the [`UpdatePlan`] lists exactly
//! what that exposes), then selects the patches to draw. The GPU holds copies of the windows' mirrors and draws the
//! [`Selection`]; it knows nothing more.

pub mod alpha;
mod constants;
mod eye;
mod frustum;
mod ground;
mod held;
mod plan;
mod relief;
mod selection;
mod vertex;
mod window;

pub use constants::{
    LEVEL_SLOTS, LIGHT_TEXEL_STEPS, LevelConstants, Ring, VOID_HEIGHT, ViewConstants, light_level, near_m,
};
pub use eye::Eye;
pub use frustum::Frustum;
pub use held::HeldField;
pub use plan::{HEIGHT_BYTES, LIGHT_BYTES, LevelPlan, UpdatePlan, exposed_bytes};
pub use selection::{CLOSER_TRIANGLES, Instance, PATCH_TRIANGLES, Scene, Selection, Side};
pub use vertex::{Vertex, displace};
pub use window::{LightTexel, PatchInfo, Window};

use crate::camera::View;
use crate::error::{Error, ErrorKind, Result};
use crate::grid::Grid;
use crate::levels::{Bounds, Levels};
use window::{Scratch, arrived};

/// How a clipmap is laid out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClipmapOptions {
    /// Clip size N, samples along a window's side: a power of two, 64 to 2048.
    pub clip_size: i64,
    /// Keep only this many levels, the finest; all that the DEM has where none.
    pub levels: Option<u32>,
    /// Width of the transition band in steps, 0 to `N/4 - 10`; `N/10` rounded down where none.
    pub transition: Option<i64>,
    /// Factor on heights relative to the eye; may be 0 or negative.
    pub vertical_scale: f64,
    /// Whether patches that are not seen are left out.
    pub cull: bool,
}

impl Default for ClipmapOptions {
    fn default() -> Self {
        Self {
            clip_size: 256,
            levels: None,
            transition: None,
            vertical_scale: 1.0,
            cull: true,
        }
    }
}

impl ClipmapOptions {
    /// Clip size and transition.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] where they are out of range.
    pub fn ring(&self) -> Result<Ring> {
        let transition = self
            .transition
            .unwrap_or((self.clip_size / 10).min(Ring::transition_limit(self.clip_size)));
        let ring = Ring {
            clip_size: self.clip_size,
            transition,
        };
        ring.check()?;
        Ok(ring)
    }
}

/// What an update did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct UpdateReport {
    /// Rectangles to upload.
    pub uploads: u64,
    /// Their bytes.
    pub upload_bytes: u64,
    /// The bytes that the windows' moves exposed, computed from the windows alone.
    pub upload_bytes_exposed: u64,
    /// Patches drawn.
    pub patches: u64,
    /// Subtrees of patches that were dropped because they are not seen.
    pub patches_culled: u64,
    /// Triangles drawn.
    pub triangles: u64,
    /// Levels of which something is drawn.
    pub levels_drawn: u32,
    /// Whether all data that the frame draws are there.
    pub complete: bool,
    /// Whether coarser levels were left out by [`ClipmapOptions::levels`], so that the picture ends at a border.
    pub cut: bool,
}

/// The clipmap of one view.
#[derive(Clone, Debug)]
pub struct Clipmap {
    grid: Grid,
    ring: Ring,
    vertical_scale: f64,
    cull: bool,
    cut: bool,
    has_light: bool,
    range_m: [f32; 2],
    windows: Vec<Window>,
    held: HeldField,
    plan: UpdatePlan,
    generation: u64,
    view_constants: ViewConstants,
    level_constants: Vec<LevelConstants>,
    grounds: Vec<f64>,
    selection: Selection,
    scratch: Scratch,
    report: UpdateReport,
}

impl Clipmap {
    /// A clipmap over `levels`, with nothing resident yet.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] for options out of range; those of `levels`.
    pub fn new(levels: &dyn Levels, options: &ClipmapOptions) -> Result<Self> {
        let grid = *levels.grid();
        let ring = options.ring()?;
        if !options.vertical_scale.is_finite() {
            let what = format!("{} is not finite", options.vertical_scale);
            return Err(Error::new(ErrorKind::Misuse, "vertical scale", what));
        }
        if options.levels == Some(0) {
            return Err(
                Error::new(ErrorKind::Misuse, "levels", "0 levels draw nothing").advice("ask for at least 1")
            );
        }
        let fitting = grid.levels_until(ring.clip_size).min(levels.level_count());
        let count = options.levels.map_or(fitting, |l| l.min(fitting));
        Ok(Self {
            grid,
            ring,
            vertical_scale: options.vertical_scale,
            cull: options.cull,
            cut: count < fitting,
            has_light: levels.has_light(),
            range_m: height_range(levels)?,
            windows: (0..count).map(|l| Window::new(l, &grid, &ring)).collect(),
            held: HeldField::new(count, ring.held_size()),
            plan: UpdatePlan::new(count),
            generation: 0,
            view_constants: bytemuck::Zeroable::zeroed(),
            level_constants: Vec::with_capacity(count as usize),
            grounds: Vec::with_capacity(count as usize),
            selection: Selection::default(),
            scratch: Scratch::default(),
            report: UpdateReport::default(),
        })
    }

    /// Moves the windows to where the view's eye is, reading what that exposes, and selects what to draw.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] for a view of other than finite numbers; those of `levels`, after which the level that
    /// could not be read is empty and is read again by the next update.
    pub fn update(&mut self, levels: &dyn Levels, view: &View) -> Result<&UpdateReport> {
        view.camera.check()?;
        let eye = Eye::new(&view.camera, &self.grid);
        self.generation += 1;
        self.plan.plan(&self.windows, &eye);
        let mut exposed = 0;
        for plan in self.plan.levels() {
            let light_size = self.grid.level(light_level(plan.level));
            exposed += exposed_bytes(plan.level, plan.from, plan.to, light_size);
            if plan.from != plan.to {
                let window = &mut self.windows[plan.level as usize];
                window.fill(levels, plan.to, &plan.heights, &plan.light, &mut self.scratch)?;
            }
        }
        ground::grounds(
            &self.windows,
            &self.grid,
            &eye,
            self.range_m[0],
            &mut self.grounds,
        );
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
        let frustum = Frustum::new(view);
        self.selection.select(&Scene {
            grid: &self.grid,
            ring: &self.ring,
            eye: &eye,
            windows: &self.windows,
            levels: &self.level_constants,
            held: &self.held,
            frustum: self.cull.then_some(&frustum),
            vertical_scale: self.vertical_scale,
        });
        self.report = UpdateReport {
            uploads: self.plan.uploads() as u64,
            upload_bytes: self.plan.bytes(),
            upload_bytes_exposed: exposed,
            patches: self.selection.patches(),
            patches_culled: self.selection.culled,
            triangles: self.selection.triangles(),
            levels_drawn: self.selection.levels.count_ones(),
            complete: self
                .plan
                .levels()
                .iter()
                .all(|p| self.windows[p.level as usize].resident() == p.to),
            cut: self.cut,
        };
        Ok(&self.report)
    }

    /// Where the samples lie.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Clip size and transition.
    pub fn ring(&self) -> &Ring {
        &self.ring
    }

    /// Factor on heights relative to the eye.
    pub fn vertical_scale(&self) -> f64 {
        self.vertical_scale
    }

    /// Whether the light texels hold traced light.
    pub fn has_light(&self) -> bool {
        self.has_light
    }

    /// Least and greatest height of the DEM in metres above its base; 0 where it has none.
    pub fn height_range_m(&self) -> [f32; 2] {
        self.range_m
    }

    /// The windows, finest first.
    pub fn windows(&self) -> &[Window] {
        &self.windows
    }

    /// What holds levels back from being drawn.
    pub fn held(&self) -> &HeldField {
        &self.held
    }

    /// What the last update exposed.
    pub fn plan(&self) -> &UpdatePlan {
        &self.plan
    }

    /// Counts updates: [`Clipmap::plan`] leads from the one before to this one.
    pub fn generation(&self) -> u64 {
        self.generation
    }

    /// The frame's constants.
    pub fn view_constants(&self) -> &ViewConstants {
        &self.view_constants
    }

    /// The levels' constants, finest first.
    pub fn level_constants(&self) -> &[LevelConstants] {
        &self.level_constants
    }

    /// The patches to draw.
    pub fn selection(&self) -> &Selection {
        &self.selection
    }

    /// What the last update did.
    pub fn report(&self) -> &UpdateReport {
        &self.report
    }
}

/// The least and greatest height of a DEM, from the saturated bounds of its coarsest level, which are small.
fn height_range(levels: &dyn Levels) -> Result<[f32; 2]> {
    let coarsest = levels.level_count() - 1;
    let patches = levels.grid().patches(coarsest).rect();
    let mut bounds = vec![Bounds::VOID; patches.area() as usize];
    arrived(levels.bounds(coarsest, patches, &mut bounds)?)?;
    let low = bounds.iter().fold(f32::NAN, |low, b| low.min(b.need_min));
    let high = bounds.iter().fold(f32::NAN, |high, b| high.max(b.need_max));
    Ok(if low.is_nan() { [0.0, 0.0] } else { [low, high] })
}
