//! What `render` draws: where its cameras stand, from numbers, places of the DEM's reference system, or a flight.

use glam::DVec3;

use super::args::{CameraArgs, RenderArgs};
use crate::camera::{Camera, CrsFlight, Flight, MAX_EYE_M, View, is_crs, overview};
use crate::clipmap::height_range_m;
use crate::error::{Error, ErrorKind, Result};
use crate::levels::Levels;
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
    /// The flight or the camera that is asked for, or a view of the whole.
    ///
    /// # Errors
    /// For a place off the terrain, and heights beyond any camera's; those of reading the terrain.
    pub(super) fn of(args: &RenderArgs, flight: Option<Flight>, terrain: &Terrain) -> Result<Self> {
        if let Some(flight) = flight {
            return Ok(Self::Flight(flight));
        }
        let scale = args.view.vertical_scale;
        if let Some(camera) = camera(&args.camera, scale, terrain)? {
            return Ok(Self::Still(camera));
        }
        let heights = height_range_m(terrain)?.map(|h| (f64::from(h) + terrain.grid().base_m) * scale);
        let (low, high) = (heights[0].min(heights[1]), heights[0].max(heights[1]));
        check_heights(terrain, low, high)?;
        if args.flight.is_some() {
            let orbit = Flight::orbit(terrain.grid(), low, high);
            return Ok(Self::Flight(orbit.scaled_down(scale)?));
        }
        let aspect = f64::from(args.view.size[0]) / f64::from(args.view.size[1]);
        Ok(Self::Still(
            overview(terrain.grid(), low, high, aspect).scaled_down(scale),
        ))
    }

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

/// Refuses to look for a place from which heights beyond any camera's would be seen: most often they stand for no data.
fn check_heights(terrain: &Terrain, low: f64, high: f64) -> Result<()> {
    let most = if -low > high { low } else { high };
    if most.abs() <= MAX_EYE_M / 8.0 {
        return Ok(());
    }
    let what = format!("has heights of {most:.1e} m as drawn, too far up or down for a view of the whole");
    Err(Error::new(ErrorKind::Limit, terrain.name(), what).advice(
        "if they stand for no data, name their value with --nodata; else place the camera with --eye",
    ))
}
