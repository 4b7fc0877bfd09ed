//! `CrsFlight`: a flight whose places are in the DEM's own coordinate reference system, at heights over its ground.
//!
//! ```json
//! {"fps": 30, "frame": "crs", "keys": [
//!   {"t": 0, "at": [603000, 5024000], "above_m": 800, "heading": 90, "pitch": -20},
//!   {"t": 4, "at": [606000, 5026500], "above_m": 400, "heading": 120, "pitch": -5}
//! ]}
//! ```
//!
//! `at` is easting and northing, or longitude and latitude in degrees; `above_m` metres above the ground there, before
//! vertical scale. All else is as in a [`Flight`] in world metres, which [`CrsFlight::resolve`] makes of it: the path
//! from key to key is that of the resolved places.

use serde::Deserialize;

use super::Flight;
use super::flight::{DEFAULT_FPS, Key, default_fov_deg};
use crate::error::{Error, ErrorKind, Result};

/// A flight over places of a reference system.
#[derive(Clone, Debug, PartialEq)]
pub struct CrsFlight {
    name: String,
    /// Times and directions of the keys; their eyes are none.
    times: Flight,
    places: Vec<CrsPlace>,
}

/// Where a key of a [`CrsFlight`] stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrsPlace {
    /// Easting and northing, or longitude and latitude in degrees.
    pub at: [f64; 2],
    /// Metres above the ground.
    pub above_m: f64,
}

/// A flight as it stands in its file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    #[serde(default = "default_fps")]
    fps: f64,
    #[serde(rename = "frame")]
    _frame: Frame,
    keys: Vec<WrittenKey>,
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum Frame {
    Crs,
}

fn default_fps() -> f64 {
    DEFAULT_FPS
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenKey {
    t: f64,
    at: [f64; 2],
    above_m: f64,
    heading: f64,
    pitch: f64,
    #[serde(default)]
    roll: f64,
    #[serde(default = "default_fov_deg")]
    fov: f64,
    #[serde(default)]
    sun_time: Option<f64>,
}

impl CrsFlight {
    /// Reads a flight from JSON; `name` is what errors call it.
    ///
    /// # Errors
    /// As [`Flight::parse`].
    pub fn parse(name: &str, json: &str) -> Result<Self> {
        let written: Written = serde_json::from_str(json).map_err(|e| {
            Error::new(ErrorKind::Broken, name, format!("is not a flight: {e}"))
                .advice(
                    "in the frame \"crs\" a key is {\"t\": 0, \"at\": [E, N], \"above_m\": 2, \"heading\": 0, \"pitch\": 0}",
                )
                .because(e)
        })?;
        let mut places = Vec::new();
        let mut keys = Vec::new();
        for (i, key) in written.keys.into_iter().enumerate() {
            if ![key.at[0], key.at[1], key.above_m].iter().all(|v| v.is_finite()) {
                let what = format!("key {i}: the place is not of finite numbers");
                return Err(Error::new(ErrorKind::Broken, name, what));
            }
            places.push(CrsPlace {
                at: key.at,
                above_m: key.above_m,
            });
            keys.push(Key {
                t_s: key.t,
                eye: [0.0; 3],
                heading_deg: key.heading,
                pitch_deg: key.pitch,
                roll_deg: key.roll,
                fov_deg: key.fov,
                sun_hour: key.sun_time,
            });
        }
        Ok(Self {
            name: name.into(),
            times: Flight::checked(name, ErrorKind::Broken, written.fps, keys)?,
            places,
        })
    }

    /// The flight's times and directions, with every eye at the origin: as many frames, before its places are known.
    pub fn times(&self) -> &Flight {
        &self.times
    }

    /// The flight in world metres, of which `eye` finds the place of a key.
    ///
    /// # Errors
    /// Those of `eye`; [`ErrorKind::Broken`] where a place is beyond what a camera may be at.
    pub fn resolve(&self, eye: impl Fn(CrsPlace) -> Result<[f64; 3]>) -> Result<Flight> {
        let mut keys = self.times.keys().to_vec();
        for (key, place) in keys.iter_mut().zip(&self.places) {
            key.eye = eye(*place)?;
        }
        Flight::checked(&self.name, ErrorKind::Broken, self.times.fps(), keys)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const JSON: &str = r#"{"frame": "crs", "keys": [
        {"t": 0, "at": [500, 900], "above_m": 10, "heading": 90, "pitch": -20},
        {"t": 2, "at": [510, 890], "above_m": 30, "heading": 100, "pitch": 0, "fov": 40}
    ]}"#;

    #[test]
    fn keys_get_their_places_and_keep_all_else() {
        let flight = CrsFlight::parse("f", JSON).unwrap();
        assert_eq!(flight.times().frame_count(), 61);
        let world = flight
            .resolve(|place| Ok([place.at[0] - 500.0, 7.0 + place.above_m, 900.0 - place.at[1]]))
            .unwrap();
        assert_eq!(world.keys()[1].eye, [10.0, 37.0, 10.0]);
        assert_eq!((world.keys()[1].fov_deg, world.fps()), (40.0, 30.0));
        let error = flight.resolve(|_| Err(Error::new(ErrorKind::Misuse, "f", "no ground")));
        assert_eq!(error.unwrap_err().kind(), ErrorKind::Misuse);
        assert!(flight.resolve(|_| Ok([f64::NAN; 3])).is_err());
    }

    #[test]
    fn what_is_no_such_flight_is_refused() {
        for (from, to) in [
            ("crs", "world"),
            ("above_m", "above"),
            ("\"at\"", "\"eye\""),
            ("500, 900", "500, 900, 1"),
            ("\"t\": 2", "\"t\": 0"),
            ("500", "1e999"),
        ] {
            let json = JSON.replace(from, to);
            assert_ne!(json, JSON, "{from}");
            assert_eq!(
                CrsFlight::parse("f", &json).unwrap_err().kind(),
                ErrorKind::Broken,
                "{to}"
            );
        }
    }
}
