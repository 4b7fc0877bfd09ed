//! A terrain geometry clipmap engine.
//!
//! The way of the data, in the order of the rooms:
//!
//! 1. A DEM is *read* by rectangles: [`source::HeightSource`], one file per format.
//! 2. It is *filtered* into ever coarser levels, and each patch of each level bounded: [`pyramid`].
//! 3. Light is *traced* over the finest level and filtered likewise: [`light`].
//! 4. All of it is *stored* in a terrain file: [`build`] drives, [`terrain`] writes and reads.
//! 5. Any of these answers as [`levels::Levels`]; [`stream::Terrain`] opens whatever a user names, and brings it tile by
//!    tile to views that do not wait.
//! 6. Around the camera, each level's window is *made resident*: [`clipmap::Window`], moved by the rectangles of
//!    [`clipmap::UpdatePlan`]; [`clipmap::Selection`] lists the patches to draw.
//! 7. The GPU holds copies of the windows ([`gpu::ViewTextures`]). A vertex is *displaced* in
//!    `shaders/shared/surface.wgsl`, whose twin is [`clipmap::displace`], and slid towards the next coarser level by
//!    [`clipmap::alpha`].
//! 8. The surface that a frame draws is [`clipmap::Drawn`]; heights, normals and rays are *queried* on it and on the
//!    DEM's own surface alike: [`query::Surface`]. By it frames are *checked* for cracks: [`accuracy`].
//! 9. A fragment is *shaded* in `shaders/shared/ground.wgsl`, by the view's function or the caller's own, with the
//!    constants of [`shade`].
//! 10. [`render`] makes headless frames of it: pictures, contact sheets, animations, statistics.
//! 11. [`measure`] flies many settings and reports what each costs and how wrong it is.
//! 12. [`window`] flies through it on a screen.
//!
//! Underneath all: [`grid`] is the only index arithmetic, [`error::Error`] the only error, [`camera`] says what is
//! seen. Each room knows those above it in this file and none below.
//!
//! World coordinates are right-handed, in metres: x east, y up, z south; sample (0, 0) of a DEM lies at x = z = 0.

pub mod error;

pub mod progress;

pub mod work;

pub mod grid;

pub mod levels;

pub mod camera;

pub mod stats;

pub mod source;

pub mod pyramid;

pub mod light;

pub mod terrain;

pub mod build;

pub mod stream;

pub mod clipmap;

pub mod query;

pub mod shade;

pub mod accuracy;

#[cfg(feature = "gpu")]
pub mod gpu;

#[cfg(feature = "gpu")]
pub mod render;

#[cfg(feature = "gpu")]
pub mod measure;

#[cfg(feature = "window")]
pub mod window;

#[cfg(feature = "cli")]
pub mod cli;

pub use camera::{Camera, Flight, View};
pub use clipmap::{Clipmap, ClipmapOptions};
pub use error::{Error, ErrorKind, Result};

/// The README's library example, compiled as a test.
#[cfg(all(doctest, feature = "gpu"))]
#[doc = include_str!("../README.md")]
pub struct Readme;
