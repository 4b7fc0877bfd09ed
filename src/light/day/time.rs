//! A day at a place: when it is noon, how long it lasts, where the sun stands; and times of it as people write them.

use std::fmt;
use std::str::FromStr;

use crate::error::Result;
use crate::light::sun_at::Moment;
use crate::light::{DISC_DEG, Sun, misuse};

/// The least and the most positions of a day.
pub const DAY_POSITIONS: std::ops::RangeInclusive<u32> = 2..=1024;

/// A day at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Day {
    /// When the sun stands highest.
    pub noon: Moment,
    /// Seconds from noon to the day's ends, at which the last of the disc has set: at most 12 hours.
    pub half_s: f64,
    /// Degrees north of the equator.
    pub latitude_deg: f64,
    /// Degrees east of Greenwich.
    pub longitude_deg: f64,
    /// The number of suns from which light is traced, evenly from one end to the other.
    pub positions: u32,
}

impl Day {
    /// The day about the noon that is nearest to `moment`, at a place, from `positions` suns.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Misuse`] where the place or the number is impossible, or the sun does not rise.
    pub fn of(moment: Moment, latitude_deg: f64, longitude_deg: f64, positions: u32) -> Result<Self> {
        if !DAY_POSITIONS.contains(&positions) {
            let (least, most) = (DAY_POSITIONS.start(), DAY_POSITIONS.end());
            return Err(misuse(format!("a day of {positions} suns cannot be"))
                .advice(format!("ask for {least} to {most}")));
        }
        let altitude = |at: Moment| Sun::at(at, latitude_deg, longitude_deg).map(|sun| sun.altitude_deg);
        altitude(moment)?;
        // Noon by the mean sun, which the true one misses by less than 17 minutes.
        let mean_s = (moment.utc_s_of_day() + 240.0 * longitude_deg).rem_euclid(86_400.0);
        let near = moment.later(43_200.0 - mean_s);
        let (mut from, mut until) = (-1200.0, 1200.0);
        for _ in 0..60 {
            let third = (until - from) / 3.0;
            let (a, b) = (from + third, until - third);
            if altitude(near.later(a))? < altitude(near.later(b))? {
                from = a;
            } else {
                until = b;
            }
        }
        let noon = near.later((0.5 * (from + until)).round());
        let set = -DISC_DEG / 2.0;
        if altitude(noon)? <= set {
            return Err(misuse(format!(
                "the sun does not rise at latitude {latitude_deg:.3} on that day"
            ))
            .advice("choose another date"));
        }
        let end = |sign: f64| -> Result<f64> {
            let (mut up, mut down) = (0.0, 43_200.0);
            if altitude(noon.later(sign * down))? > set {
                return Ok(down);
            }
            while down - up > 0.5 {
                let middle = 0.5 * (up + down);
                if altitude(noon.later(sign * middle))? > set {
                    up = middle;
                } else {
                    down = middle;
                }
            }
            Ok(down)
        };
        let half_s = end(-1.0)?.max(end(1.0)?).ceil();
        Ok(Self {
            noon,
            half_s,
            latitude_deg,
            longitude_deg,
            positions,
        })
    }

    /// The time of position `k`: -1 for the first, 1 for the last.
    pub fn time_of_position(&self, k: u32) -> f64 {
        2.0 * f64::from(k) / f64::from(self.positions - 1) - 1.0
    }

    /// The time of an hour by the sun: it stands highest at 12.
    pub fn time_of_hour(&self, hour: f64) -> f64 {
        (hour - 12.0) * 3600.0 / self.half_s
    }

    /// The hour by the sun of a time.
    pub fn hour_of_time(&self, time: f64) -> f64 {
        12.0 + time * self.half_s / 3600.0
    }

    /// The time of a moment.
    pub fn time_of(&self, moment: Moment) -> f64 {
        moment.seconds_since(self.noon) / self.half_s
    }

    /// Where the sun stands at a time; below the horizon beyond -1 and 1.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Misuse`] where that is not known: for a time of other than finite numbers, or thousands of
    /// years away.
    pub fn sun(&self, time: f64) -> Result<Sun> {
        if !time.is_finite() {
            return Err(misuse(format!("a time of day of {time} is not finite")));
        }
        Sun::at(
            self.noon.later(time * self.half_s),
            self.latitude_deg,
            self.longitude_deg,
        )
    }
}

impl fmt::Display for Day {
    /// As it stands in a terrain file: numbers that read back as the same bits.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            noon,
            half_s,
            latitude_deg,
            longitude_deg,
            positions,
        } = self;
        let [days, late_s] = noon.julian();
        write!(
            f,
            "{positions} {half_s:?} {latitude_deg:?} {longitude_deg:?} {days:?} {late_s:?}"
        )
    }
}

impl FromStr for Day {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        let mut words = text.split_whitespace();
        let positions = words.next().and_then(|word| word.parse().ok()).ok_or(())?;
        let mut next = || -> Result<f64, ()> {
            let number = words.next().and_then(|word| word.parse().ok());
            number.filter(|n: &f64| n.is_finite()).ok_or(())
        };
        let [half_s, latitude_deg, longitude_deg] = [next()?, next()?, next()?];
        let noon = Moment::of_julian([next()?, next()?]).ok_or(())?;
        let day = Self {
            noon,
            half_s,
            latitude_deg,
            longitude_deg,
            positions,
        };
        let possible = words.next().is_none()
            && DAY_POSITIONS.contains(&positions)
            && (0.0..=43_200.0).contains(&half_s)
            && half_s > 0.0
            && day.sun(0.0).is_ok();
        if possible { Ok(day) } else { Err(()) }
    }
}

/// A time of a day as people write it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SunTime {
    /// An hour by the sun: it stands highest at 12.
    Hour(f64),
    /// A moment.
    At(Moment),
}

impl SunTime {
    /// The time of `day`.
    pub fn in_day(self, day: &Day) -> f64 {
        match self {
            Self::Hour(hour) => day.time_of_hour(hour),
            Self::At(moment) => day.time_of(moment),
        }
    }
}

impl FromStr for SunTime {
    type Err = String;

    /// Reads `9:30`, `09:30:15`, or a [`Moment`]. What is wrong is said as a phrase.
    fn from_str(text: &str) -> Result<Self, String> {
        if text.contains(['T', 't', ' ']) {
            return text.parse().map(Self::At);
        }
        let wanted = || "not a time as 9:30 by the sun, or as 2026-06-21T09:30:00Z".to_string();
        let mut hour = 0.0;
        let parts: Vec<&str> = text.split(':').collect();
        if !(2..=3).contains(&parts.len()) {
            return Err(wanted());
        }
        for ((part, unit), below) in parts.iter().zip([1.0, 60.0, 3600.0]).zip([24, 60, 60]) {
            let digits = matches!(part.len(), 1..=2) && part.bytes().all(|b| b.is_ascii_digit());
            let value: u32 = part
                .parse()
                .ok()
                .filter(|v| digits && *v < below)
                .ok_or_else(wanted)?;
            hour += f64::from(value) / unit;
        }
        Ok(Self::Hour(hour))
    }
}
