//! A day: light at every time of it, from the sun at a number of positions between its rise and its set.
//!
//! Stored are for each sample the times at which the sun's disc first and last stands over the horizon. Those two suffice:
//! of the time in which ground is lit, by 48 positions, what lies in the dark between its first and its last light is
//! 0.002, 0.010 and 0.088 % over the Pyrenees at midsummer, equinox and midwinter (`tests/day.rs`). So a day takes ten
//! bytes a sample however many positions it is traced from, and at a time between two of these shadows stand between:
//! their edge is where the time is that of first or last light.
//!
//! *Tracing* ([`trace_day`]). At position k the disc's middle stands `m[k]` above the horizon at its azimuth; between two
//! positions m is taken as linear, so its zero is a time. How fast it rises there says how long the disc takes: `soft` is
//! the time in which it rises by the disc's radius, so that the share at time t is that of a disc cut at
//! `x = (t - first) / soft`, 0 at x = -1, 1 at 1 ([`disc`]).
//!
//! *Filtering* ([`day_levels`]). Ground under a coarse sample is lit piece by piece, so its share rises as a distribution of
//! times does. Mean and variance of it are filtered like heights: `first`, and `first^2 + soft^2 / 4`, as the cut of a disc
//! is the distribution function of a half circle, whose standard deviation is half its radius. The coarser level's soft is
//! what these two leave, so the share of coarse ground rises over as long as its pieces take.
//!
//! *Drawing* ([`sun_of_day`]). The share is the difference of those that first and last light have reached. The cosine
//! between normal and sun follows from the sun's place at that time and the slopes of the level; those of the ground under
//! a coarse sample are spread about these, and what of them turns away from the sun is dark rather than negative: the mean
//! of `max(0, normal . sun)` over a half circle's distribution, whose width the stored mean square of level 0's slopes
//! gives. Ground that turns away is in its own shadow, which the share counts already: it is divided by the part that faces
//! the sun.

use std::fmt;
use std::str::FromStr;

use half::f16;

use super::earth::Earth;
use super::sun_at::Moment;
use super::{DISC_DEG, Sun, check, fill_voids, horizon_tangents_on, misuse};
use crate::error::Result;
use crate::grid::Grid;
use crate::levels::DaySample;
use crate::progress::Progress;
use crate::pyramid::{Filter, downsample};
use crate::work::{Work, each_chunk};

/// The least and the most positions of a day.
pub const DAY_POSITIONS: std::ops::RangeInclusive<u32> = 2..=1024;

/// A time before or after any of the day: where the sun neither rises nor sets.
const NEVER: f32 = 2.0;

/// The least softness that is stored, of half a day: below what f16 tells of times.
const LEAST_SOFT: f32 = 1.0 / 4096.0;

/// Samples that are worked on at once.
const CHUNK: usize = 1 << 16;

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

/// What a day's tracing knows of a sample.
#[derive(Clone, Copy, Debug)]
struct Lit {
    /// The disc's middle over the horizon at the last position, radians.
    margin: f32,
    /// First light; before there is any, the time of the greatest margin.
    first: f32,
    /// Its softness; before there is any, that margin.
    first_soft: f32,
    /// Last light; [`NEVER`] while there is light, NaN before.
    last: f32,
    last_soft: f32,
}

/// Light over a day at level 0: four values a sample, each NaN at voids. Times and softnesses as in [`DaySample`].
#[derive(Clone, Debug, Default)]
pub struct DayTrace {
    /// First light.
    pub first: Vec<f32>,
    /// Its softness.
    pub first_soft: Vec<f32>,
    /// Last light.
    pub last: Vec<f32>,
    /// Its softness.
    pub last_soft: Vec<f32>,
}

/// Traces the light of `day` over `heights` (level 0 of `grid`) on `earth`.
///
/// # Errors
/// [`crate::ErrorKind::Misuse`] where the grid is impossible or `heights` has another length;
/// [`crate::ErrorKind::Cancelled`].
pub fn trace_day(
    heights: &[f32],
    grid: &Grid,
    earth: &Earth,
    day: &Day,
    work: &dyn Work,
    progress: &dyn Progress,
) -> Result<DayTrace> {
    check(grid, heights.len())?;
    let before = Lit {
        margin: f32::NAN,
        first: 0.0,
        first_soft: f32::NEG_INFINITY,
        last: f32::NAN,
        last_soft: LEAST_SOFT,
    };
    let radius = (DISC_DEG / 2.0).to_radians() as f32;
    let step = (day.time_of_position(1) - day.time_of_position(0)) as f32;
    let mut lit = vec![before; heights.len()];
    for k in 0..day.positions {
        let time = day.time_of_position(k);
        let sun = day.sun(time)?;
        let tangents = horizon_tangents_on(heights, grid, earth, sun.azimuth_deg, work, progress)?;
        let altitude = sun.altitude_deg.to_radians() as f32;
        let time = time as f32;
        each_chunk(work, &mut lit, CHUNK, |chunk, lit| {
            for (lit, tangent) in lit.iter_mut().zip(&tangents[chunk * CHUNK..]) {
                lit.go_on(time, step, altitude - tangent.atan(), radius);
            }
        });
    }
    let mut trace = DayTrace::default();
    let void = |value: f32, h: f32| if h.is_nan() { f32::NAN } else { value };
    let all = || lit.iter().zip(heights);
    trace.first = all().map(|(l, &h)| void(l.first, h)).collect();
    trace.first_soft = all().map(|(l, &h)| void(l.softness()[0], h)).collect();
    trace.last = all()
        .map(|(l, &h)| void(if l.last.is_nan() { l.first } else { l.last }, h))
        .collect();
    trace.last_soft = all().map(|(l, &h)| void(l.softness()[1], h)).collect();
    Ok(trace)
}

impl Lit {
    /// Goes on to the position at `time`, a `step` after the one before, at which the disc of `radius` stands `margin`
    /// over the horizon.
    fn go_on(&mut self, time: f32, step: f32, margin: f32, radius: f32) {
        let before = std::mem::replace(&mut self.margin, margin);
        let (was_up, is_up) = (before > 0.0, margin > 0.0);
        if was_up == is_up {
            if !is_up && self.last.is_nan() && margin > self.first_soft {
                (self.first, self.first_soft) = (time, margin);
            }
            return;
        }
        let (crossing, soft) = if before.is_nan() {
            // It is up all day round.
            (-NEVER, LEAST_SOFT)
        } else {
            let rise = margin - before;
            (
                time - step * margin / rise,
                (step * radius / rise.abs()).clamp(LEAST_SOFT, 1.0),
            )
        };
        if is_up {
            if self.last.is_nan() {
                (self.first, self.first_soft) = (crossing, soft);
            }
            self.last = NEVER;
        } else {
            (self.last, self.last_soft) = (crossing, soft);
        }
    }

    /// The softness of first and last light.
    fn softness(&self) -> [f32; 2] {
        if self.last.is_nan() {
            [LEAST_SOFT; 2]
        } else {
            [self.first_soft, self.last_soft]
        }
    }
}

/// The day's light of all of [`Grid::file_levels`] from that of level 0, `heights` and `trace`: under voids it is filled
/// outward from valid neighbours, then filtered as the head of this file says.
///
/// # Errors
/// [`crate::ErrorKind::Misuse`] where the grid is impossible or a length is not the grid's;
/// [`crate::ErrorKind::Cancelled`].
pub fn day_levels(
    grid: &Grid,
    heights: &[f32],
    trace: DayTrace,
    filter: &Filter,
    work: &dyn Work,
    progress: &dyn Progress,
) -> Result<Vec<Vec<DaySample>>> {
    let DayTrace {
        first,
        first_soft,
        last,
        last_soft,
    } = trace;
    let mut fields = [
        first,
        first_soft,
        last,
        last_soft,
        squared_slopes(grid, heights, work)?,
    ];
    for field in &mut fields {
        check(grid, field.len())?;
        if field.iter().any(|v| v.is_nan()) {
            fill_voids(field, grid.size);
        }
    }
    // From softness to mean square: what is filtered.
    for [time, soft] in [[0, 1], [2, 3]] {
        let times = std::mem::take(&mut fields[time]);
        each_chunk(work, &mut fields[soft], CHUNK, |chunk, soft| {
            for (soft, time) in soft.iter_mut().zip(&times[chunk * CHUNK..]) {
                *soft = time * time + 0.25 * *soft * *soft;
            }
        });
        fields[time] = times;
    }
    let count = grid.file_levels();
    progress.begin(
        "day levels",
        (1..count).map(|l| 5 * grid.level(l).samples() as u64).sum(),
    );
    let mut levels = Vec::with_capacity(count as usize);
    for l in 0..count {
        if l > 0 {
            for field in &mut fields {
                *field = downsample(field, grid.level(l - 1), filter, None, work, progress)?;
            }
        }
        let [first, first_square, last, last_square, slope_square] = &fields;
        let mut level = vec![DaySample::default(); first.len()];
        each_chunk(work, &mut level, CHUNK, |chunk, samples| {
            for (k, sample) in (chunk * CHUNK..).zip(samples) {
                let time = |time: f32| time.clamp(-NEVER, NEVER);
                let soft = |time: f32, square: f32| {
                    let variance = square - time * time;
                    (2.0 * variance.max(0.0).sqrt()).clamp(LEAST_SOFT, NEVER)
                };
                *sample = DaySample {
                    first: f16::from_f32(time(first[k])),
                    first_soft: f16::from_f32(soft(first[k], first_square[k])),
                    last: f16::from_f32(time(last[k])),
                    last_soft: f16::from_f32(soft(last[k], last_square[k])),
                    slope: f16::from_f32(slope_square[k].max(0.0).sqrt().min(6e4)),
                    unused: f16::ZERO,
                };
            }
        });
        levels.push(level);
    }
    Ok(levels)
}

/// The squared slope of the ground at every sample of level 0, by central differences, one-sided at edges and beside
/// voids; NaN at voids.
fn squared_slopes(grid: &Grid, heights: &[f32], work: &dyn Work) -> Result<Vec<f32>> {
    check(grid, heights.len())?;
    let (width, height) = (grid.size.width as usize, grid.size.height as usize);
    let per_m = grid.spacing_m.map(|m| (1.0 / m) as f32);
    let slope = |before: Option<f32>, here: f32, after: Option<f32>, per_m: f32| {
        let known = |h: Option<f32>| h.filter(|h| !h.is_nan());
        match (known(before), known(after)) {
            (Some(before), Some(after)) => 0.5 * (after - before) * per_m,
            (None, Some(after)) => (after - here) * per_m,
            (Some(before), None) => (here - before) * per_m,
            (None, None) => 0.0,
        }
    };
    let mut squares = vec![0.0; heights.len()];
    each_chunk(work, &mut squares, width, |j, row| {
        let at = |i: usize, j: usize| heights[j * width + i];
        for (i, square) in row.iter_mut().enumerate() {
            let here = at(i, j);
            let (west, east) = (
                (i > 0).then(|| at(i - 1, j)),
                (i + 1 < width).then(|| at(i + 1, j)),
            );
            let (north, south) = (
                (j > 0).then(|| at(i, j - 1)),
                (j + 1 < height).then(|| at(i, j + 1)),
            );
            let (e, s) = (
                slope(west, here, east, per_m[0]),
                slope(north, here, south, per_m[1]),
            );
            // A cliff beyond what f16 holds is as steep.
            *square = if here.is_nan() {
                f32::NAN
            } else {
                (e * e + s * s).min(4e9)
            };
        }
    });
    Ok(squares)
}

/// Coefficients of [`disc`]: of x, x^3 and x^5.
#[allow(clippy::approx_constant, reason = "the three are to sum to a half in f32 too")]
const DISC: [f32; 3] = [0.636_62, -0.1017, -0.034_92];

/// The coefficients of [`disc`]: of x, x^3 and x^5.
pub(crate) fn disc_coefficients() -> [f32; 3] {
    DISC
}

/// The share of a disc of radius 1 that lies on one side of a line at distance x from its middle: 0 at -1 and below, 1 at
/// 1 and above. Within 0.006 of `1 - (acos x - x sqrt(1 - x^2)) / pi`.
pub fn disc(x: f32) -> f32 {
    let x = x.clamp(-1.0, 1.0);
    let square = x * x;
    0.5 + x * (DISC[0] + square * (DISC[1] + square * DISC[2]))
}

/// The integral of [`disc`] from -1 to x: the mean of `max(0, x + u)` over u of a half circle's distribution.
pub fn disc_integral(x: f32) -> f32 {
    let clamped = x.clamp(-1.0, 1.0);
    let square = clamped * clamped;
    let least = 0.5 - DISC[0] / 2.0 - DISC[1] / 4.0 - DISC[2] / 6.0;
    let inner = least
        + clamped * 0.5
        + square * (DISC[0] / 2.0 + square * (DISC[1] / 4.0 + square * (DISC[2] / 6.0)));
    inner + (x - 1.0).max(0.0)
}

/// The sun's share at `time` of a day on ground of `slopes` (rise over run to the east and to the south), of which `day`
/// is (first, first_soft, last, last_soft), and `rough` how far the slopes of the ground under it spread about those (root
/// mean square, an axis). `to_sun` is the unit vector to the sun: east, up, south.
///
/// The twin of `day_sun` in `shaders/shared/ground.wgsl`.
pub fn sun_of_day(day: [f32; 4], rough: f32, slopes: [f32; 2], to_sun: [f32; 3], time: f32) -> f32 {
    let share = (disc((time - day[0]) / day[1]) - disc((time - day[2]) / day[3])).max(0.0);
    let level = (to_sun[0] * to_sun[0] + to_sun[2] * to_sun[2]).sqrt();
    let mean = to_sun[1] - slopes[0] * to_sun[0] - slopes[1] * to_sun[2];
    let width = (2.0 * rough * level).max(1e-4);
    let x = mean / width;
    let facing = disc(x);
    let cosine = width * disc_integral(x)
        / (1.0 + slopes[0] * slopes[0] + slopes[1] * slopes[1] + 2.0 * rough * rough).sqrt();
    (cosine * (share / facing.max(1e-3)).min(1.0)).min(1.0)
}

#[cfg(test)]
mod tests;
