//! What every extreme must hold: all numbers finite, the facts about alpha, and the same picture with and without
//! culling.

use clipscape::camera::{Camera, View};
use clipscape::clipmap::{Clipmap, ClipmapOptions, displace};
use clipscape::grid::Grid;
use clipscape::levels::Levels;
use clipscape::progress::Silent;
use clipscape::pyramid::{Filter, Pyramid};
use clipscape::work::Serial;
use glam::DVec3;

use crate::support::facts::faults;
use crate::support::{hash, hills};

/// The pyramid of a DEM whose sample (i, j) is `height(i, j)`, with its bounds.
pub(crate) fn pyramid(grid: Grid, height: impl Fn(i64, i64) -> f32) -> Pyramid {
    let heights = grid.size.rect().cells().map(|(i, j)| height(i, j)).collect();
    let filter = Filter::default();
    let mut pyramid = Pyramid::new(grid, heights, None, &filter, &Serial, &Silent).unwrap();
    pyramid.bound(&Serial, &Silent).unwrap();
    pyramid
}

/// Hills with rough ground and holes.
pub(crate) fn rough(i: i64, j: i64) -> f32 {
    if hash(9, i / 16, j / 16) < 0.07 {
        f32::NAN
    } else {
        hills(0, i, j) + 60.0 * hash(0, i, j) as f32
    }
}

/// A camera at `eye` with this heading and pitch, level, with a field of view of 60 degrees.
pub(crate) fn camera(eye: DVec3, heading_deg: f64, pitch_deg: f64) -> Camera {
    Camera {
        eye,
        heading_deg,
        pitch_deg,
        roll_deg: 0.0,
        fov_deg: 60.0,
    }
}

/// Clip size 64 and all else as it comes.
pub(crate) fn small() -> ClipmapOptions {
    ClipmapOptions {
        clip_size: 64,
        ..Default::default()
    }
}

/// An update of a fresh clipmap, without culling.
pub(crate) fn updated(levels: &dyn Levels, options: &ClipmapOptions, view: &View) -> Clipmap {
    let options = ClipmapOptions {
        cull: false,
        ..*options
    };
    let mut clipmap = Clipmap::new(levels, &options).unwrap();
    clipmap.update(levels, view, 0.0).unwrap();
    clipmap
}

/// What must hold without a GPU.
pub(crate) fn check_facts(clipmap: &Clipmap, what: &str) {
    let odd = unfit_numbers(clipmap);
    assert!(odd.is_empty(), "{what}: {:?}", &odd[..odd.len().min(3)]);
    let faults = faults(clipmap, clipmap);
    let first = &faults[..faults.len().min(3)];
    assert!(faults.is_empty(), "{what}: {} faults: {first:?}", faults.len());
}

/// The numbers of a frame's constants and vertices that are not finite, or alphas outside 0 to 1.
pub(crate) fn unfit_numbers(clipmap: &Clipmap) -> Vec<String> {
    let mut odd = Vec::new();
    let mut check = |name: &str, numbers: &[f32]| {
        if !numbers.iter().all(|n| n.is_finite()) {
            odd.push(format!("{name} is {numbers:?}"));
        }
    };
    let view = clipmap.view_constants();
    check("clip from east", &view.clip_from_east);
    check("clip from up", &view.clip_from_up);
    check("clip from south", &view.clip_from_south);
    check("fraction", &view.fraction);
    check("spacing", &view.spacing_m);
    check("eye height", &view.eye_height_m);
    check("edge", &view.edge);
    check("scale and near", &[view.vertical_scale, view.near_m]);
    for level in clipmap.level_constants() {
        check("climb", &[level.climb, level.inverse_step, level.light_scale]);
        check("light at the eye", &level.light_at_eye);
    }
    for instance in clipmap.selection().instances() {
        check("fill", &[instance.fill]);
        for k in 0..81 {
            let vertex = displace(clipmap, instance, k % 9, k / 9);
            check("a vertex' place", &vertex.from_eye);
            check("a vertex' clip", &vertex.clip);
            check("a vertex' height", &[vertex.height]);
            if !(0.0..=1.0).contains(&vertex.alpha) {
                check("alpha outside 0 to 1", &[f32::NAN, vertex.alpha]);
            }
        }
    }
    odd
}

/// A terrain and how its clipmap is laid out, under a name for messages.
pub(crate) struct Subject<'a> {
    pub(crate) what: String,
    pub(crate) levels: &'a dyn Levels,
    pub(crate) options: ClipmapOptions,
    pub(crate) size_px: [u32; 2],
}

impl<'a> Subject<'a> {
    pub(crate) fn new(what: impl Into<String>, levels: &'a dyn Levels) -> Self {
        Self {
            what: what.into(),
            levels,
            options: small(),
            size_px: [48, 32],
        }
    }

    /// Checks a frame from each camera; returns how many pixels of terrain each drew, none without an adapter.
    pub(crate) fn check(&self, cameras: &[Camera]) -> Option<Vec<usize>> {
        for camera in cameras {
            let view = View::new(*camera, self.size_px).unwrap();
            let what = format!("{}, {camera:?}", self.what);
            check_facts(&updated(self.levels, &self.options, &view), &what);
        }
        self.draw(cameras)
    }

    #[cfg(not(feature = "gpu"))]
    fn draw(&self, _: &[Camera]) -> Option<Vec<usize>> {
        None
    }

    #[cfg(feature = "gpu")]
    fn draw(&self, cameras: &[Camera]) -> Option<Vec<usize>> {
        use crate::draw::{Floats, frame, headless, options};
        let gpu = crate::support::gpu()?;
        let mut drawn = Vec::new();
        let options = |cull| {
            let mut options = options(self.size_px);
            options.clipmap = ClipmapOptions { cull, ..self.options };
            options
        };
        let mut culled = headless(&gpu, self.levels, &options(true));
        let mut all = headless(&gpu, self.levels, &options(false));
        let mut floats = Floats::new(&all, self.size_px);
        for camera in cameras {
            let what = format!("{}, {camera:?}", self.what);
            let picture = frame(&mut culled, self.levels, camera);
            let whole = frame(&mut all, self.levels, camera);
            assert_eq!(
                picture.differing(&whole),
                0,
                "{what}: culling changes the picture"
            );
            let depths = whole.depth.iter();
            let odd = depths.filter(|d| !(0.0..=1.0).contains(*d)).count();
            assert_eq!(odd, 0, "{what}: depths outside 0 to 1");
            assert_eq!(floats.unfit_pixels(&all), 0, "{what}: pixels that are no colour");
            drawn.push(whole.terrain_pixels());
        }
        Some(drawn)
    }
}
