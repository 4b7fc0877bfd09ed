//! Records a flight: the camera as keys over time, which `render --flight` replays.
//!
//! Between keys a flight is interpolated by cubics, so a key every tenth of a second follows a hand closely. A jump of the
//! camera is no motion to be interpolated: it takes place between two frames of the flight, in four keys a millisecond
//! apart, where no frame falls. The last key lies on a frame, so the last frame shows it exactly.

use crate::camera::{Camera, Flight, Key};
use crate::error::Result;

/// Frames a second of recorded flights.
const FPS: f64 = 30.0;

/// Seconds from key to key.
const KEY_S: f64 = 0.1;

/// Seconds between the keys of a jump.
const JUMP_S: f64 = 1e-3;

/// A flight being recorded.
#[derive(Debug)]
pub(super) struct Recorder {
    start_s: f64,
    keys: Vec<Key>,
}

impl Recorder {
    /// Begins at `now_s` seconds of any clock.
    pub(super) fn new(now_s: f64, camera: &Camera) -> Self {
        Self {
            start_s: now_s,
            keys: vec![Key::new(0.0, camera)],
        }
    }

    /// Seconds recorded so far.
    pub(super) fn length_s(&self, now_s: f64) -> f64 {
        now_s - self.start_s
    }

    /// The camera has moved, or not, up to `now_s`.
    pub(super) fn follow(&mut self, now_s: f64, camera: &Camera) {
        let t_s = self.length_s(now_s);
        if t_s - self.last_s() >= KEY_S {
            self.keys.push(Key::new(t_s, camera));
        }
    }

    /// The camera jumps from one place to another at `now_s`.
    pub(super) fn jump(&mut self, now_s: f64, from: &Camera, to: &Camera) {
        // The middle between frames, at or after now.
        let t_s = ((self.length_s(now_s) * FPS - 0.5).ceil().max(0.0) + 0.5) / FPS;
        let first_s = t_s - 1.5 * JUMP_S;
        let same = (self.last_s() - first_s - 3.0 * JUMP_S).abs() < 0.5 * JUMP_S;
        if let (true, [.., third, fourth]) = (same, &mut self.keys[..]) {
            // A second jump between the same frames: only where the first one led is another place.
            (*third, *fourth) = (Key::new(third.t_s, to), Key::new(fourth.t_s, to));
            return;
        }
        self.keys.retain(|k| k.t_s < first_s - JUMP_S);
        for (k, camera) in [from, from, to, to].into_iter().enumerate() {
            self.keys.push(Key::new(first_s + k as f64 * JUMP_S, camera));
        }
    }

    /// Ends at `now_s`, at the next frame of the flight.
    ///
    /// # Errors
    /// Those of [`Flight::new`]: a flight of days has too many frames.
    pub(super) fn finish(mut self, now_s: f64, camera: &Camera) -> Result<Flight> {
        let after = self.length_s(now_s).max(self.last_s());
        let end_s = (after * FPS).ceil() / FPS;
        if end_s - self.last_s() < JUMP_S && self.keys.len() > 1 {
            self.keys.pop();
        }
        // A flight of no length at all is its first key.
        if end_s > self.last_s() {
            self.keys.push(Key::new(end_s, camera));
        }
        Flight::new(FPS, self.keys)
    }

    fn last_s(&self) -> f64 {
        self.keys.last().map_or(0.0, |k| k.t_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn camera(x: f64) -> Camera {
        Camera {
            eye: DVec3::new(x, 1000.0 + 0.1 * x, -x / 3.0),
            heading_deg: (350.0 + x).rem_euclid(360.0),
            pitch_deg: -10.0,
            roll_deg: 0.0,
            fov_deg: 45.0,
        }
    }

    /// Flies along x at 100 m/s with frames at uneven times.
    fn fly(until_s: f64) -> (Recorder, f64) {
        let mut recorder = Recorder::new(7.0, &camera(0.0));
        let mut t = 0.0;
        let mut k = 0;
        while t < until_s {
            t += 0.004 + 0.003 * f64::from(k % 7);
            k += 1;
            recorder.follow(7.0 + t, &camera(100.0 * t));
        }
        (recorder, t)
    }

    #[test]
    fn what_was_flown_is_what_is_replayed() {
        let (recorder, t) = fly(5.0);
        let flight = recorder.finish(7.0 + t, &camera(100.0 * t)).unwrap();
        let again = Flight::parse("flight.json", &flight.to_json()).unwrap();
        assert!(again == flight, "the file holds the flight, bit for bit");
        for k in 0..flight.frame_count() - 1 {
            let at = flight.camera_at_frame(k);
            // The last stretch, up to the end at a frame, is as long as it takes and not flown on.
            let wanted = camera(100.0 * flight.time_of_frame_s(k));
            if flight.time_of_frame_s(k) < t - 0.3 {
                assert!(
                    (at.eye - wanted.eye).length() < 1e-6,
                    "frame {k}: {} {}",
                    at.eye,
                    wanted.eye
                );
            }
        }
        let last = flight.camera_at_frame(flight.frame_count() - 1);
        assert_eq!(
            last,
            camera(100.0 * t),
            "the last frame is the camera at the end, exactly"
        );
    }

    #[test]
    fn a_jump_is_between_frames() {
        for (until, extra) in [(2.0, 0.0), (2.01, 0.0005), (0.001, 0.0), (0.0, 0.0)] {
            let (mut recorder, t) = fly(until);
            let (from, to) = (camera(100.0 * t), camera(1e6));
            let now = 7.0 + t + extra;
            recorder.jump(now, &from, &camera(-1e7));
            recorder.jump(now, &camera(-1e7), &to);
            recorder.follow(now + 0.01, &to);
            recorder.follow(now + 0.5, &to);
            let flight = recorder.finish(now + 1.0, &to).unwrap();
            for k in 0..flight.frame_count() {
                let x = flight.camera_at_frame(k).eye.x;
                assert!(
                    (-10.0..=100.0 * t + 10.0).contains(&x) || (x - 1e6).abs() < 10.0,
                    "jump at {t} s, frame {k}: {x}"
                );
            }
            assert_eq!(flight.camera_at_frame(flight.frame_count() - 1).eye, to.eye);
        }
        // Control: as keys like any other, a jump is smeared over frames.
        let (mut recorder, t) = fly(2.0);
        recorder.follow(7.0 + t + 0.2, &camera(1e6));
        let flight = recorder.finish(7.0 + t + 1.0, &camera(1e6)).unwrap();
        let smeared =
            (0..flight.frame_count()).any(|k| (1e3..9e5).contains(&flight.camera_at_frame(k).eye.x));
        assert!(smeared);
    }

    #[test]
    fn a_flight_of_no_length_is_a_flight() {
        let recorder = Recorder::new(3.0, &camera(1.0));
        let flight = recorder.finish(3.0, &camera(1.0)).unwrap();
        assert_eq!((flight.frame_count(), flight.keys().len()), (1, 1));
    }
}
