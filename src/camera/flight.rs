//! `Flight`: a camera's path as keys over time, read from and written to JSON.
//!
//! ```json
//! {"fps": 30, "frame": "world", "keys": [
//!   {"t": 0, "eye": [0, 4000, 0], "heading": 90, "pitch": -20, "roll": 0, "fov": 60},
//!   {"t": 4, "eye": [9000, 2500, 0], "heading": 120, "pitch": -5}
//! ]}
//! ```
//!
//! `t` in seconds, strictly rising; `eye` in world metres (x east, y up, z south; before vertical scale);
//! angles in degrees. `fps` (30), `frame` (`world`), `roll` (0) and `fov` (60) may be left out; unknown keys
//! are refused. `sun_time`, in all keys or in none, is the hour by the sun of terrain with light over a day: it stands highest
//! at 12; between keys it is linear.
//!
//! Between keys i and i + 1, with h = t[i+1] - t[i] and u = (t - t[i]) / h, every value is the cubic Hermite
//! polynomial
//!
//! `p = (2u^3 - 3u^2 + 1) p[i] + (u^3 - 2u^2 + u) h m[i] + (3u^2 - 2u^3) p[i+1] + (u^3 - u^2) h m[i+1]`
//!
//! with the tangents of Catmull and Rom (A class of local interpolating splines, 1974) over uneven times,
//! `m[i] = (p[i+1] - p[i-1]) / (t[i+1] - t[i-1])`, one-sided at the ends. Headings and rolls go the short way
//! from key to key (a half turn goes clockwise) and are interpolated unwrapped. Pitch is kept within -90 to 90
//! and the field of view within the keys' own, which a cubic may overshoot.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::Camera;
use crate::error::{Error, ErrorKind, Result};

/// Frames a second where a flight does not say.
pub(super) const DEFAULT_FPS: f64 = 30.0;

/// Degrees of vertical field of view where a key does not say.
const DEFAULT_FOV_DEG: f64 = 60.0;

/// The most frames of one flight: 92 hours at 30 frames a second.
const MAX_FRAMES: f64 = 1e7;

/// The greatest heading and roll of a key: enough for any number of turns, and no interpolation overflows.
const MAX_TURN_DEG: f64 = 1e6;

/// A camera at a time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Key {
    /// Seconds since the flight began, at least 0.
    #[serde(rename = "t")]
    pub t_s: f64,
    /// Position in world metres, before vertical scale.
    pub eye: [f64; 3],
    /// Degrees clockwise from north.
    #[serde(rename = "heading")]
    pub heading_deg: f64,
    /// Degrees above the horizon, -90 to 90.
    #[serde(rename = "pitch")]
    pub pitch_deg: f64,
    /// Degrees by which the right side is tilted down.
    #[serde(rename = "roll", default)]
    pub roll_deg: f64,
    /// Vertical field of view in degrees, above 0 and below 180.
    #[serde(rename = "fov", default = "default_fov_deg")]
    pub fov_deg: f64,
    /// The hour by the sun, which stands highest at 12, for terrain with light over a day.
    #[serde(rename = "sun_time", default, skip_serializing_if = "Option::is_none")]
    pub sun_hour: Option<f64>,
}

pub(super) fn default_fov_deg() -> f64 {
    DEFAULT_FOV_DEG
}

impl Key {
    /// The key at `t_s` seconds of what `camera` is.
    pub fn new(t_s: f64, camera: &Camera) -> Self {
        Self {
            t_s,
            eye: camera.eye.to_array(),
            heading_deg: camera.heading_deg,
            pitch_deg: camera.pitch_deg,
            roll_deg: camera.roll_deg,
            fov_deg: camera.fov_deg,
            sun_hour: None,
        }
    }

    fn camera(&self) -> Camera {
        Camera {
            eye: DVec3::from_array(self.eye),
            heading_deg: self.heading_deg,
            pitch_deg: self.pitch_deg,
            roll_deg: self.roll_deg,
            fov_deg: self.fov_deg,
        }
    }
}

/// A camera's path: at least one key, strictly rising in time.
#[derive(Clone, Debug, PartialEq)]
pub struct Flight {
    fps: f64,
    keys: Vec<Key>,
    /// The keys' headings, each within half a turn of the one before.
    headings_deg: Vec<f64>,
    /// The keys' rolls, likewise.
    rolls_deg: Vec<f64>,
}

/// A flight as it stands in its file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    #[serde(default = "default_fps")]
    fps: f64,
    #[serde(default, rename = "frame")]
    _frame: Frame,
    keys: Vec<Key>,
}

fn default_fps() -> f64 {
    DEFAULT_FPS
}

/// What the keys' places are measured in.
#[derive(Default, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Frame {
    #[default]
    World,
}

/// The one member that decides which keys a flight may have.
#[derive(Deserialize)]
struct OnlyFrame {
    frame: Option<String>,
}

/// Whether the keys of a flight's text are in the DEM's own reference system. They have other members than those in
/// world metres, which would be refused as unknown.
pub fn is_crs(json: &str) -> bool {
    let frame = serde_json::from_str(json)
        .ok()
        .and_then(|OnlyFrame { frame }| frame);
    frame.as_deref() == Some("crs")
}

impl Flight {
    /// A flight through `keys` at `fps` frames a second.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] where there is no key, times do not rise, or a value is not finite or outside its
    /// range; [`ErrorKind::Limit`] where it has more than ten million frames.
    pub fn new(fps: f64, keys: Vec<Key>) -> Result<Self> {
        Self::checked("flight", ErrorKind::Misuse, fps, keys)
    }

    /// The flight, or what is wrong with it as an error of kind `bad` about `name`.
    pub(super) fn checked(name: &str, bad: ErrorKind, fps: f64, keys: Vec<Key>) -> Result<Self> {
        let refuse = |what: String| Error::new(bad, name, what);
        if !(fps.is_finite() && fps > 0.0) {
            return Err(refuse(format!("fps of {fps} is not above 0 and finite")));
        }
        let Some(last) = keys.last() else {
            return Err(refuse("the flight has no keys".into()).advice("give at least one key"));
        };
        for (i, key) in keys.iter().enumerate() {
            key.camera()
                .check()
                .map_err(|e| refuse(format!("key {i}: {e}")))?;
            if key.heading_deg.abs().max(key.roll_deg.abs()) > MAX_TURN_DEG {
                return Err(refuse(format!(
                    "key {i}: the heading or roll is beyond {MAX_TURN_DEG} degrees"
                )));
            }
            if !(key.t_s.is_finite() && key.t_s >= 0.0) {
                return Err(refuse(format!(
                    "key {i}: t of {} s is not finite and at least 0",
                    key.t_s
                )));
            }
            if key.sun_hour.is_some_and(|hour| !(-24.0..=48.0).contains(&hour)) {
                return Err(refuse(format!("key {i}: sun_time is no hour from -24 to 48")));
            }
            if key.sun_hour.is_some() != keys[0].sun_hour.is_some() {
                return Err(refuse(format!("key {i}: sun_time is in some keys only"))
                    .advice("give it in all of them, or in none"));
            }
            if i > 0 && key.t_s <= keys[i - 1].t_s {
                let before = keys[i - 1].t_s;
                return Err(
                    refuse(format!("key {i}: t of {} s does not follow {before} s", key.t_s))
                        .advice("times must strictly rise"),
                );
            }
        }
        if last.t_s * fps > MAX_FRAMES {
            let what = format!(
                "{} s at {fps} frames a second are more than {MAX_FRAMES} frames",
                last.t_s
            );
            return Err(Error::new(ErrorKind::Limit, name, what).advice("shorten it or lower fps"));
        }
        let headings_deg = unwrapped(keys.iter().map(|k| k.heading_deg));
        let rolls_deg = unwrapped(keys.iter().map(|k| k.roll_deg));
        Ok(Self {
            fps,
            keys,
            headings_deg,
            rolls_deg,
        })
    }

    /// The flight with each key as [`Camera::scaled_down`].
    ///
    /// # Errors
    /// [`ErrorKind::Broken`] where a height leaves the range of keys.
    pub fn scaled_down(&self, vertical_scale: f64) -> Result<Self> {
        let scaled = |key: &Key| Key {
            sun_hour: key.sun_hour,
            ..Key::new(key.t_s, &key.camera().scaled_down(vertical_scale))
        };
        Self::new(self.fps, self.keys.iter().map(scaled).collect())
    }

    /// Reads a flight from JSON; `name` is what errors call it.
    ///
    /// # Errors
    /// [`ErrorKind::Broken`] where the text is not a flight, [`ErrorKind::Misuse`] where its keys are in the DEM's own
    /// CRS ([`CrsFlight`](super::CrsFlight) reads those), [`ErrorKind::Limit`] where it has more than ten million frames.
    pub fn parse(name: &str, json: &str) -> Result<Self> {
        if is_crs(json) {
            let what = "is in the frame \"crs\", which only a DEM that lies somewhere can place";
            return Err(
                Error::new(ErrorKind::Misuse, name, what).advice("give each key an \"eye\" in world metres")
            );
        }
        let written: Written = serde_json::from_str(json).map_err(|e| {
            Error::new(ErrorKind::Broken, name, format!("is not a flight: {e}"))
                .advice("a flight is {\"fps\": 30, \"keys\": [{\"t\": 0, \"eye\": [x, y, z], ...}]}")
                .because(e)
        })?;
        Self::checked(name, ErrorKind::Broken, written.fps, written.keys)
    }

    /// The flight as JSON, one key a line; [`Flight::parse`] reads the same flight from it.
    pub fn to_json(&self) -> String {
        let number = |v: f64| serde_json::to_string(&v).expect("a finite number is valid JSON");
        let keys: Vec<String> = self
            .keys
            .iter()
            .map(|key| serde_json::to_string(key).expect("a key of finite numbers is valid JSON"))
            .collect();
        format!(
            "{{\"fps\": {}, \"frame\": \"world\", \"keys\": [\n  {}\n]}}\n",
            number(self.fps),
            keys.join(",\n  ")
        )
    }

    /// Frames a second.
    pub fn fps(&self) -> f64 {
        self.fps
    }

    /// The keys, strictly rising in time.
    pub fn keys(&self) -> &[Key] {
        &self.keys
    }

    /// Seconds to the last key.
    pub fn end_s(&self) -> f64 {
        self.keys.last().map_or(0.0, |k| k.t_s)
    }

    /// The number of frames: `floor(t_end * fps) + 1`, at least 1.
    ///
    /// The product counts as the whole number above it where less than 1e-9 of its size is missing: 119/30 s,
    /// written as a decimal and rounded to binary, times 30 may lie just below 119, and has 120 frames.
    pub fn frame_count(&self) -> u64 {
        let product = self.end_s() * self.fps;
        // At most MAX_FRAMES, so the slack stays below a hundredth of a frame and the result is exact.
        (product + 1e-9 * product).floor() as u64 + 1
    }

    /// The time of frame `k` in seconds, `k / fps`, but not past the last key.
    pub fn time_of_frame_s(&self, k: u64) -> f64 {
        (k as f64 / self.fps).min(self.end_s())
    }

    /// The hour by the sun at `t_s` seconds, where the keys have hours: linear between keys, before the first that of the
    /// first, after the last that of the last.
    pub fn sun_hour_at(&self, t_s: f64) -> Option<f64> {
        let after = self.keys.partition_point(|k| k.t_s <= t_s);
        let (from, to) = (
            &self.keys[after.saturating_sub(1)],
            &self.keys[after.min(self.keys.len() - 1)],
        );
        let (a, b) = (from.sun_hour?, to.sun_hour?);
        if after == 0 || after == self.keys.len() {
            return Some(a);
        }
        let share = (t_s - from.t_s) / (to.t_s - from.t_s);
        Some(a + share * (b - a))
    }

    /// The camera of frame `k`.
    pub fn camera_at_frame(&self, k: u64) -> Camera {
        self.camera_at(self.time_of_frame_s(k))
    }

    /// The camera at `t_s` seconds; before the first key that of the first, after the last that of the last.
    pub fn camera_at(&self, t_s: f64) -> Camera {
        let after = self.keys.partition_point(|k| k.t_s <= t_s);
        if after == 0 || after == self.keys.len() {
            let mut camera = self.keys[after.saturating_sub(1)].camera();
            camera.heading_deg = camera.heading_deg.rem_euclid(360.0);
            return camera;
        }
        let i = after - 1;
        let value = |of: &dyn Fn(usize) -> f64| self.hermite(i, t_s, of);
        let axis = |a: usize| value(&|k| self.keys[k].eye[a]);
        let fovs = self.keys.iter().map(|k| k.fov_deg);
        let (narrowest, widest) = fovs.fold((f64::INFINITY, 0.0_f64), |(low, high), fov| {
            (low.min(fov), high.max(fov))
        });
        Camera {
            eye: DVec3::new(axis(0), axis(1), axis(2)),
            heading_deg: value(&|k| self.headings_deg[k]).rem_euclid(360.0),
            pitch_deg: value(&|k| self.keys[k].pitch_deg).clamp(-90.0, 90.0),
            roll_deg: value(&|k| self.rolls_deg[k]),
            fov_deg: value(&|k| self.keys[k].fov_deg).clamp(narrowest, widest),
        }
    }

    /// The cubic of the head of this file from key `i` to the next, at `t_s`, of the values `p` of the keys.
    fn hermite(&self, i: usize, t_s: f64, p: &dyn Fn(usize) -> f64) -> f64 {
        let t = |k: usize| self.keys[k].t_s;
        let last = self.keys.len() - 1;
        let h = t(i + 1) - t(i);
        // h times the tangent at key k; the quotient of times is at most 1, so that close keys do not overflow.
        let step = |k: usize| {
            let (before, after) = (k.saturating_sub(1), (k + 1).min(last));
            (p(after) - p(before)) * (h / (t(after) - t(before)))
        };
        let u = (t_s - t(i)) / h;
        let (u2, u3) = (u * u, u * u * u);
        (2.0 * u3 - 3.0 * u2 + 1.0) * p(i)
            + (u3 - 2.0 * u2 + u) * step(i)
            + (3.0 * u2 - 2.0 * u3) * p(i + 1)
            + (u3 - u2) * step(i + 1)
    }
}

/// The same directions, each within half a turn of the one before; a half turn goes clockwise.
fn unwrapped(degrees: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut last: Option<f64> = None;
    degrees
        .map(|angle| {
            let next = match last {
                None => angle,
                Some(before) => angle + 360.0 * ((before - angle) / 360.0 + 0.5).floor(),
            };
            last = Some(next);
            next
        })
        .collect()
}

#[cfg(test)]
mod tests;
