//! Tracing a day: when the sun's disc first and last stands over the horizon of each sample.

use std::ops::Range;

use super::{Day, LEAST_SOFT, LitTimes, NEVER};
use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::light::crests::Crests;
use crate::light::earth::Earth;
use crate::light::horizon::{all_rows, each_block};
use crate::light::rays::Rays;
use crate::light::relief::{LANES, Relief, Whole, place};
use crate::light::{DISC_DEG, check};
use crate::progress::Progress;
use crate::work::Work;

/// Traces the light of `day` over `heights` (level 0 of `grid`) on `earth`, for every sample.
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
) -> Result<Vec<LitTimes>> {
    check(grid, heights.len())?;
    let light = Daylight::new(grid, earth, day)?;
    progress.begin("day", grid.size.height as u64);
    let whole = Whole::of(heights, grid);
    let relief = Relief::new(grid, &whole, Crests::of(heights, grid, work));
    all_rows(grid, "day", progress, |rows, out| {
        light.rows(&relief, rows, out, work, progress)
    })
}

/// The light of a day over a grid.
pub struct Daylight {
    positions: Vec<Position>,
    /// The time from one position to the next.
    step: f32,
    /// Of the sun's disc, radians.
    radius: f32,
}

/// The sun at one time of the day.
struct Position {
    time: f32,
    /// Radians.
    altitude: f32,
    rays: Rays,
}

impl Daylight {
    /// That of `day` over `grid` on `earth`.
    ///
    /// # Errors
    /// Those of [`Day::sun`].
    pub fn new(grid: &Grid, earth: &Earth, day: &Day) -> Result<Self> {
        let position = |k: u32| -> Result<Position> {
            let time = day.time_of_position(k);
            let sun = day.sun(time)?;
            let azimuth_deg = earth.on_grid_deg(sun.azimuth_deg);
            Ok(Position {
                time: time as f32,
                altitude: sun.altitude_deg.to_radians() as f32,
                rays: Rays::new(grid, azimuth_deg, earth.radius_m, 0.0, day.positions),
            })
        };
        Ok(Self {
            positions: (0..day.positions).map(position).collect::<Result<_>>()?,
            step: (day.time_of_position(1) - day.time_of_position(0)) as f32,
            radius: (DISC_DEG / 2.0).to_radians() as f32,
        })
    }

    /// What it is at samples of `rows`, row by row, beginning with a multiple of [`super::super::ROWS`].
    ///
    /// # Errors
    /// What the ground meets; [`crate::ErrorKind::Cancelled`].
    pub fn rows(
        &self,
        relief: &Relief<'_>,
        rows: Range<i64>,
        out: &mut [LitTimes],
        work: &dyn Work,
        progress: &dyn Progress,
    ) -> Result<()> {
        each_block(relief, rows, out, work, |block, scratch, times| {
            relief.settle(block, scratch)?;
            let mut lit = vec![Lit::BEFORE; times.len()];
            let [mut tangents, rises] = std::mem::take(&mut scratch.kept);
            tangents.resize(times.len(), 0.0);
            for position in &self.positions {
                if progress.cancelled() {
                    return Err(Error::cancelled("day"));
                }
                tangents.fill(0.0);
                relief.raise(&position.rays, block, f32::INFINITY, &mut tangents, scratch)?;
                for (lit, &tangent) in lit.iter_mut().zip(&tangents) {
                    // No ground stands at a right angle: it is a void that does, and goes on by nothing.
                    if tangent < f32::INFINITY {
                        let margin = position.altitude - tangent.atan();
                        lit.go_on(position.time, self.step, margin, self.radius);
                    }
                }
            }
            let slopes = relief.slopes(scratch);
            for (group, (times, lit)) in times
                .chunks_exact_mut(LANES)
                .zip(lit.chunks_exact(LANES))
                .enumerate()
            {
                let [east, south] = slopes.rises(place(group as u32));
                for l in 0..LANES {
                    times[l] = lit[l].times([east[l], south[l]]);
                }
            }
            scratch.kept = [tangents, rises];
            Ok(())
        })
    }
}

/// What a day's tracing knows of a sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lit {
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

impl Lit {
    /// Before the first position.
    pub(super) const BEFORE: Self = Self {
        margin: f32::NAN,
        first: 0.0,
        first_soft: f32::NEG_INFINITY,
        last: f32::NAN,
        last_soft: LEAST_SOFT,
    };

    /// Goes on to the position at `time`, a `step` after the one before, at which the disc of `radius` stands `margin`
    /// over the horizon.
    pub(super) fn go_on(&mut self, time: f32, step: f32, margin: f32, radius: f32) {
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

    /// After the last position, on ground that rises so much a metre eastward and southward: NaN at voids.
    pub(super) fn times(&self, [east, south]: [f32; 2]) -> LitTimes {
        if east.is_nan() {
            return LitTimes::VOID;
        }
        let never = self.last.is_nan();
        LitTimes {
            first: self.first,
            first_soft: if never { LEAST_SOFT } else { self.first_soft },
            last: if never { self.first } else { self.last },
            last_soft: self.last_soft,
            // A cliff beyond what f16 holds is as steep.
            slope_square: (east * east + south * south).min(4e9),
        }
    }
}
