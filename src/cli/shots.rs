//! What `render` draws: where its cameras stand, from numbers, places of the DEM's reference system, or a flight.

use glam::DVec3;

use super::args::{CameraArgs, RenderArgs};
use crate::camera::{Camera, CrsFlight, Flight, View, is_crs};
use crate::error::Result;
use crate::query::Places;
use crate::stream::Terrain;

/// Vertical field of view where none is given, degrees.
const FOV_DEG: f64 = 60.0;

/// Metres above the ground where none are given: about a person's eyes.
const ABOVE_M: f64 = 2.0;

/// What is drawn.
pub(super) enum Shots {
    Flight(Flight),
    Still(Camera),
}

impl Shots {
    /// The views of the frames that are asked for.
    pub(super) fn views(&self, args: &RenderArgs) -> Result<Vec<View>> {
        let view = |camera| View::new(camera, args.view.size);
        match self {
            Self::Still(camera) => Ok(vec![view(*camera)?]),
            Self::Flight(flight) => {
                let frames = args.frames.clone().unwrap_or(0..flight.frame_count());
                frames.map(|k| view(flight.camera_at_frame(k))).collect()
            }
        }
    }
}

/// A flight before the terrain is open.
pub(super) enum Planned {
    World(Flight),
    Crs(CrsFlight),
}

impl Planned {
    pub(super) fn parse(name: &str, json: &str) -> Result<Self> {
        if is_crs(json) {
            CrsFlight::parse(name, json).map(Self::Crs)
        } else {
            Flight::parse(name, json).map(Self::World)
        }
    }

    /// Its times; places in a reference system are not known yet.
    pub(super) fn times(&self) -> &Flight {
        match self {
            Self::World(flight) => flight,
            Self::Crs(flight) => flight.times(),
        }
    }

    pub(super) fn over(self, terrain: &Terrain) -> Result<Flight> {
        match self {
            Self::World(flight) => Ok(flight),
            Self::Crs(flight) => {
                let places = Places::new(terrain, terrain.place(), terrain.name())?;
                flight.resolve(|key| places.above(key.at, key.above_m).map(|eye| eye.to_array()))
            }
        }
    }
}

/// The camera that is asked for, if one is.
pub(super) fn camera(args: &CameraArgs, vertical_scale: f64, terrain: &Terrain) -> Result<Option<Camera>> {
    let places = || Places::new(terrain, terrain.place(), terrain.name());
    let eye: DVec3 = match (args.eye, args.eye_at) {
        (Some(eye), _) => eye.into(),
        (None, Some(at)) => places()?.above(at, args.above.unwrap_or(ABOVE_M))?,
        (None, None) => return Ok(None),
    };
    let (mut heading_deg, mut pitch_deg) = (args.heading.unwrap_or(0.0), args.pitch.unwrap_or(0.0));
    if let Some(at) = args.look_at {
        // As drawn: directions are those of the scaled world.
        let drawn = DVec3::new(1.0, vertical_scale, 1.0);
        (heading_deg, pitch_deg) = Camera::toward(eye * drawn, places()?.ground(at)? * drawn);
    }
    Ok(Some(Camera {
        eye,
        heading_deg,
        pitch_deg,
        roll_deg: args.roll.unwrap_or(0.0),
        fov_deg: args.fov.unwrap_or(FOV_DEG),
    }))
}
