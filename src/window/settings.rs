//! What can be changed while flying: dials with steps and ends, tint, haze, and what is shown.

use crate::clipmap::{ClipmapOptions, Ring};
use crate::light::Sun;
use crate::shade::ViewMode;

/// The promised errors that the dial stops at, in pixels; beyond the last it is off.
const MAX_ERRORS_PX: [f64; 8] = [0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0];

/// The exaggerations that the dial stops at.
const EXAGGERATIONS: [f64; 9] = [0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0];

/// Steps of the transition band, and degrees of the sun, from one stop to the next.
const TRANSITION_STEP: i64 = 4;
const AZIMUTH_STEP_DEG: f64 = 15.0;
const ALTITUDE_STEP_DEG: f64 = 5.0;

/// Hours from one stop of the time of day to the next: that of the light of a day is turned in place of the sun's azimuth.
const HOUR_STEP: f64 = 0.25;

/// Least and greatest clip size.
pub(super) const CLIP_SIZES: [i64; 2] = [64, 2048];

/// Something that is turned up and down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Dial {
    MaxError,
    ClipSize,
    Transition,
    Exaggeration,
    SunAzimuth,
    SunAltitude,
}

impl Dial {
    #[cfg(test)]
    pub(super) const ALL: [Self; 6] = [
        Self::MaxError,
        Self::ClipSize,
        Self::Transition,
        Self::Exaggeration,
        Self::SunAzimuth,
        Self::SunAltitude,
    ];
}

/// How terrain is shown now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Settings {
    /// Clip size, levels, transition, vertical scale, culling, promised error, waiting.
    pub(super) clipmap: ClipmapOptions,
    /// What is shown.
    pub(super) view_mode: ViewMode,
    /// Whether the ground is tinted by height and slope.
    pub(super) tint: bool,
    /// Whether air lies between ground and eye.
    pub(super) haze: bool,
    /// The sun, where no light was traced.
    pub(super) sun: Sun,
    /// The hour by the sun, where light is of a day.
    pub(super) sun_hour: Option<f64>,
}

impl Settings {
    /// Turns a dial to its next stop.
    pub(super) fn turn(&mut self, dial: Dial, up: bool) {
        let clipmap = &mut self.clipmap;
        match dial {
            Dial::MaxError => {
                let now = clipmap.max_error_px.unwrap_or(f64::INFINITY);
                let last = MAX_ERRORS_PX[MAX_ERRORS_PX.len() - 1];
                clipmap.max_error_px = if up && now >= last {
                    None
                } else {
                    Some(next(&MAX_ERRORS_PX, now, up))
                };
            }
            Dial::ClipSize => {
                let size = if up {
                    clipmap.clip_size * 2
                } else {
                    clipmap.clip_size / 2
                };
                self.set_clip_size(size);
            }
            Dial::Transition => {
                let step = if up { TRANSITION_STEP } else { -TRANSITION_STEP };
                self.set_transition(self.transition() + step);
            }
            Dial::Exaggeration => {
                clipmap.vertical_scale = next(&EXAGGERATIONS, clipmap.vertical_scale, up);
            }
            Dial::SunAzimuth if self.sun_hour.is_some() => {
                let step = if up { HOUR_STEP } else { -HOUR_STEP };
                self.sun_hour = self.sun_hour.map(|hour| (hour + step).rem_euclid(24.0));
            }
            Dial::SunAzimuth => {
                let step = if up { AZIMUTH_STEP_DEG } else { -AZIMUTH_STEP_DEG };
                self.sun.azimuth_deg = (self.sun.azimuth_deg + step).rem_euclid(360.0);
            }
            Dial::SunAltitude => {
                let step = if up { ALTITUDE_STEP_DEG } else { -ALTITUDE_STEP_DEG };
                self.sun.altitude_deg = (self.sun.altitude_deg + step).clamp(-90.0, 90.0);
            }
        }
    }

    /// Sets the clip size, as far as there are such; a transition that no longer fits is narrowed.
    pub(super) fn set_clip_size(&mut self, size: i64) {
        self.clipmap.clip_size = size.clamp(CLIP_SIZES[0], CLIP_SIZES[1]);
        if let Some(transition) = self.clipmap.transition {
            self.set_transition(transition);
        }
    }

    /// Sets the width of the transition band, as far as the clip size allows.
    pub(super) fn set_transition(&mut self, transition: i64) {
        let limit = Ring::transition_limit(self.clipmap.clip_size);
        self.clipmap.transition = Some(transition.clamp(0, limit));
    }

    /// The width of the transition band in steps, asked for or not.
    pub(super) fn transition(&self) -> i64 {
        self.clipmap.ring().map_or(0, |ring| ring.transition)
    }
}

/// The stop beyond `now`; the last one stays.
fn next(stops: &[f64], now: f64, up: bool) -> f64 {
    let beyond = if up {
        stops.iter().copied().find(|&s| s > now)
    } else {
        stops.iter().copied().rev().find(|&s| s < now)
    };
    // Beyond all stops, where only flags lead, nothing moves further out.
    beyond.unwrap_or(now)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings() -> Settings {
        Settings {
            clipmap: ClipmapOptions::default(),
            view_mode: ViewMode::Shaded,
            tint: true,
            haze: true,
            sun: Sun::default(),
            sun_hour: None,
        }
    }

    #[test]
    fn all_stops_are_settings_that_a_clipmap_takes() {
        for dial in Dial::ALL {
            for up in [false, true] {
                let mut settings = settings();
                for _ in 0..60 {
                    settings.turn(dial, up);
                    settings.clipmap.check().unwrap();
                    settings.sun.check().unwrap();
                }
            }
        }
        // Control: a band that a smaller clip size has no room for is refused, were it not narrowed.
        let mut narrow = settings();
        narrow.set_clip_size(2048);
        narrow.set_transition(500);
        let wide = narrow;
        narrow.set_clip_size(64);
        narrow.clipmap.check().unwrap();
        assert_eq!(narrow.clipmap.transition, Some(6));
        let broken = ClipmapOptions {
            clip_size: 64,
            ..wide.clipmap
        };
        assert!(broken.check().is_err());
    }

    #[test]
    fn dials_lead_there_and_back() {
        let mut s = settings();
        s.turn(Dial::MaxError, true);
        assert_eq!(s.clipmap.max_error_px, None);
        s.turn(Dial::MaxError, false);
        assert_eq!(s.clipmap.max_error_px, Some(16.0));
        for _ in 0..4 {
            s.turn(Dial::MaxError, false);
        }
        assert_eq!(s.clipmap.max_error_px, Some(1.0));
        s.clipmap.max_error_px = Some(0.7);
        s.turn(Dial::MaxError, true);
        assert_eq!(s.clipmap.max_error_px, Some(1.0));
        for _ in 0..9 {
            s.turn(Dial::MaxError, true);
        }
        assert_eq!(s.clipmap.max_error_px, None);

        s.turn(Dial::ClipSize, true);
        assert_eq!((s.clipmap.clip_size, s.transition()), (512, 51));
        s.turn(Dial::Transition, true);
        assert_eq!(s.transition(), 55);

        s.turn(Dial::Exaggeration, true);
        assert_eq!(s.clipmap.vertical_scale, 1.5);
        s.clipmap.vertical_scale = -3.0;
        s.turn(Dial::Exaggeration, false);
        assert_eq!(s.clipmap.vertical_scale, -3.0, "a flag leads where no stop is");
        s.turn(Dial::Exaggeration, true);
        assert_eq!(s.clipmap.vertical_scale, 0.0);

        for _ in 0..3 {
            s.turn(Dial::SunAzimuth, true);
        }
        assert_eq!(s.sun.azimuth_deg, 0.0);
        for _ in 0..10 {
            s.turn(Dial::SunAltitude, true);
        }
        assert_eq!(s.sun.altitude_deg, 90.0);
    }
}
