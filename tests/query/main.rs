//! Queries on the DEM's own surface and on the drawn one: closed forms, and brute force over all triangles.

mod answers;
mod brute_force;
mod closed_forms;
#[path = "../support/mod.rs"]
mod support;
#[path = "../support/surfaces.rs"]
mod surfaces;

use clipscape::camera::{Camera, View};
use clipscape::clipmap::{Clipmap, ClipmapOptions};
use clipscape::levels::Levels;
use glam::DVec3;

fn camera(eye: DVec3) -> Camera {
    Camera {
        eye,
        heading_deg: 30.0,
        pitch_deg: -20.0,
        roll_deg: 3.0,
        fov_deg: 60.0,
    }
}

fn clipmap(levels: &dyn Levels, eye: DVec3, options: &ClipmapOptions) -> Clipmap {
    let mut clipmap = Clipmap::new(levels, options).unwrap();
    clipmap
        .update(levels, &View::new(camera(eye), [64, 64]).unwrap(), 0.0)
        .unwrap();
    clipmap
}
