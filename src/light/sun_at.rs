//! Where the sun stands at a time and place: a moment as it is written, and the sun of that moment.
//!
//! By the algorithm of I. Reda and A. Andreas, Solar position algorithm for solar radiation applications, Solar Energy 76,
//! 2004 (within 0.0003 degrees), as the crate solar-positioning has it. What is given is the sun as it is seen: raised by
//! the air's refraction at 1010 hPa and 10 degrees (0.5 degrees at the horizon, 0.24 at 3 degrees).

use std::fmt;
use std::str::FromStr;

use solar_positioning::time::JulianDate;
use solar_positioning::{Location, RefractionCorrection, SolarPositions, delta_t};

use super::{Sun, misuse};
use crate::error::Result;

/// A moment, in the words of RFC 3339.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// Days since noon of the first of January 4713 B.C. (UT).
    julian_date: JulianDate,
}

impl fmt::Display for Moment {
    /// To the second, UT. The civil date by the algorithm of H. F. Fliegel and T. C. Van Flandern, A machine algorithm for
    /// processing calendar dates, Communications of the ACM 11, 1968 (Gregorian).
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let seconds = ((self.julian()[0] + 0.5) * 86_400.0).round() as i64;
        let (days, rest) = (seconds.div_euclid(86_400), seconds.rem_euclid(86_400));
        let mut l = days + 68_569;
        let n = 4 * l / 146_097;
        l -= (146_097 * n + 3) / 4;
        let i = 4000 * (l + 1) / 1_461_001;
        l = l - 1461 * i / 4 + 31;
        let j = 80 * l / 2447;
        let day = l - 2447 * j / 80;
        let month = j + 2 - 12 * (j / 11);
        let year = 100 * (n - 49) + i + j / 11;
        let (hour, minute, second) = (rest / 3600, rest / 60 % 60, rest % 60);
        write!(
            f,
            "{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}Z"
        )
    }
}

impl FromStr for Moment {
    type Err = String;

    /// Reads `2026-06-21T09:00:00Z`; seconds may be left out or have a fraction, and an offset as `-08:00` may stand in
    /// place of `Z`. What is wrong is said as a phrase.
    fn from_str(text: &str) -> Result<Self, String> {
        let wanted = || "not a time as in 2026-06-21T09:00:00Z or 2026-06-21T01:00-08:00".to_string();
        let (date, time) = text.split_once(['T', 't', ' ']).ok_or_else(wanted)?;
        let digits = |text: &str, count: usize| {
            let all = text.len() == count && text.bytes().all(|b| b.is_ascii_digit());
            all.then(|| text.parse::<u32>().ok()).flatten().ok_or_else(wanted)
        };
        let mut parts = date.split('-');
        let mut next = |count| {
            parts
                .next()
                .ok_or_else(wanted)
                .and_then(|part| digits(part, count))
        };
        let (year, month, day) = (next(4)?, next(2)?, next(2)?);
        if parts.next().is_some() {
            return Err(wanted());
        }
        let sign = time.find(['Z', 'z', '+', '-']).ok_or_else(wanted)?;
        let (clock, offset) = time.split_at(sign);
        let offset_minutes = match offset {
            "Z" | "z" => 0.0,
            _ => {
                let (hours, minutes) = offset[1..].split_once(':').ok_or_else(wanted)?;
                let (hours, minutes) = (digits(hours, 2)?, digits(minutes, 2)?);
                if hours > 23 || minutes > 59 {
                    return Err(wanted());
                }
                let all = f64::from(60 * hours + minutes);
                if offset.starts_with('-') { -all } else { all }
            }
        };
        let mut parts = clock.split(':');
        let mut next = || parts.next().ok_or_else(wanted).and_then(|part| digits(part, 2));
        let (hour, minute) = (next()?, next()?);
        let second = match parts.next() {
            None => 0.0,
            Some(part) => {
                let (whole, fraction) = part.split_once('.').unwrap_or((part, "0"));
                digits(whole, 2)?;
                digits(fraction, fraction.len().max(1))?;
                part.parse().map_err(|_| wanted())?
            }
        };
        if parts.next().is_some() {
            return Err(wanted());
        }
        let year = i32::try_from(year).map_err(|_| wanted())?;
        let late_s = delta_t::estimate_from_date(year, month).map_err(|e| e.to_string())?;
        let local = JulianDate::from_utc(year, month, day, hour, minute, second, late_s);
        let local = local.map_err(|e| e.to_string())?;
        let julian_date = JulianDate::new(local.julian_date() - offset_minutes / 1440.0, late_s);
        Ok(Self {
            julian_date: julian_date.map_err(|e| e.to_string())?,
        })
    }
}

impl Moment {
    /// The moment `seconds` later.
    #[must_use]
    pub fn later(self, seconds: f64) -> Self {
        let [days, late_s] = self.julian();
        Self::of_julian([days + seconds / 86_400.0, late_s]).unwrap_or(self)
    }

    /// Seconds from `other` to this moment.
    pub fn seconds_since(self, other: Self) -> f64 {
        (self.julian()[0] - other.julian()[0]) * 86_400.0
    }

    /// Seconds since midnight, UT.
    pub(super) fn utc_s_of_day(self) -> f64 {
        // Julian days begin at noon.
        (self.julian()[0] + 0.5).rem_euclid(1.0) * 86_400.0
    }

    /// Days since noon of the first of January 4713 B.C. (UT), and terrestrial time less UT in seconds.
    pub(super) fn julian(self) -> [f64; 2] {
        [self.julian_date.julian_date(), self.julian_date.delta_t()]
    }

    /// The inverse of [`Moment::julian`]; none where there is no such time.
    pub(super) fn of_julian([days, late_s]: [f64; 2]) -> Option<Self> {
        JulianDate::new(days, late_s)
            .ok()
            .map(|julian_date| Self { julian_date })
    }
}

impl Sun {
    /// Where the sun stands at `moment`, seen from `latitude_deg` north of the equator and `longitude_deg` east of
    /// Greenwich, at sea level.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Misuse`] where there is no such place, or the moment is not within the years -2000 to 6000.
    pub fn at(moment: Moment, latitude_deg: f64, longitude_deg: f64) -> Result<Self> {
        let location = Location {
            latitude: latitude_deg,
            longitude: longitude_deg,
        };
        let refraction = RefractionCorrection::standard();
        let position = SolarPositions::new()
            .at_from_julian(moment.julian_date, location, 0.0, Some(refraction))
            .map_err(|e| {
                misuse(format!(
                    "the sun's position at {latitude_deg}, {longitude_deg} degrees is not known"
                ))
                .because(e)
            })?;
        Ok(Self {
            azimuth_deg: position.azimuth(),
            altitude_deg: position.elevation_angle(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sun(time: &str, latitude_deg: f64, longitude_deg: f64) -> Sun {
        Sun::at(time.parse().unwrap(), latitude_deg, longitude_deg).unwrap()
    }

    #[test]
    fn the_published_example_is_met() {
        // Reda and Andreas, table A5.1: 820 hPa, 11 degrees and 1830 m there, which moves it by less than 0.005 degrees.
        for time in [
            "2003-10-17T12:30:30-07:00",
            "2003-10-17T19:30:30Z",
            "2003-10-17 19:30:30.00Z",
            "2003-10-18T01:00:30+05:30",
        ] {
            let got = sun(time, 39.742_476, -105.178_6);
            assert!(
                (got.altitude_deg - (90.0 - 50.111_62)).abs() < 0.01,
                "{time}: {got:?}"
            );
            assert!((got.azimuth_deg - 194.340_24).abs() < 0.01, "{time}: {got:?}");
        }
        let control = sun("2003-10-17T19:31:30Z", 39.742_476, -105.178_6);
        assert!(
            (control.azimuth_deg - 194.340_24).abs() > 0.1,
            "a minute later shows"
        );
    }

    #[test]
    fn solstices_equinoxes_and_a_sunrise_are_where_almanacs_have_them() {
        // The year's highest noon at 50 degrees north: 40 degrees and the ecliptic's 23.436; refraction adds 0.008.
        let noon = (0..120)
            .map(|m| {
                sun(
                    &format!("2026-06-21T{:02}:{:02}Z", 11 + m / 60, m % 60),
                    50.0,
                    0.0,
                )
            })
            .max_by(|a, b| a.altitude_deg.total_cmp(&b.altitude_deg))
            .unwrap();
        assert!((noon.altitude_deg - 63.444).abs() < 0.01, "{noon:?}");
        assert!((noon.azimuth_deg - 180.0).abs() < 0.5, "{noon:?}");
        // The equinox of 2026-03-20, 14:46 UTC: the sun rises in the east.
        let east = sun("2026-03-20T06:08Z", 0.0, 0.0);
        assert!(
            (east.azimuth_deg - 90.0).abs() < 0.2 && east.altitude_deg.abs() < 1.0,
            "{east:?}"
        );
        // Sunrise at Greenwich on the 21st of June 2026, 04:43 British Summer Time: the upper limb on the horizon.
        let rise = sun("2026-06-21T04:43+01:00", 51.476_9, 0.0);
        assert!((rise.altitude_deg + 0.266).abs() < 0.15, "{rise:?}");
        // South of the tropics the noon sun stands in the north.
        let north = sun("2026-06-21T12:00Z", -35.0, 0.0).azimuth_deg;
        assert!(!(5.0..=355.0).contains(&north), "{north}");
    }

    #[test]
    fn what_is_no_time_or_no_place_is_refused() {
        for text in [
            "",
            "2026-06-21",
            "2026-06-21T09:00:00",
            "2026-13-21T09:00:00Z",
            "2026-02-30T09:00:00Z",
            "2026-06-21T25:00:00Z",
            "2026-06-21T09:61:00Z",
            "2026-06-21T09:00:00+1",
            "2026-06-21T09:00:00+24:00",
            "26-06-21T09:00:00Z",
            "2026-06-21T9:00Z",
            "2026-06-21T09:00:0xZ",
            "2026-06-21T09:00:00.Z",
            "2026-06-21T09:00:00é",
        ] {
            assert!(text.parse::<Moment>().is_err(), "{text}");
        }
        let moment: Moment = "2026-06-21T09:00Z".parse().unwrap();
        for (latitude_deg, longitude_deg) in [(91.0, 0.0), (f64::NAN, 0.0), (0.0, f64::INFINITY)] {
            let refused = Sun::at(moment, latitude_deg, longitude_deg).unwrap_err();
            assert_eq!(refused.kind(), crate::ErrorKind::Misuse);
        }
    }
}
