//! A day in memory, one whole array after another: what [`super::Daylight`] and [`super::DayLevels`] are tested against.

use half::f16;

use super::trace::Lit;
use super::{Day, LEAST_SOFT, LitTimes, NEVER};
use crate::error::Result;
use crate::grid::Grid;
use crate::levels::DaySample;
use crate::light::{DISC_DEG, Earth, fill_voids, horizon_tangents_on};
use crate::progress::Silent;
use crate::pyramid::{Filter, downsample};
use crate::work::Serial;

/// As [`super::trace_day`].
pub(crate) fn trace_day(heights: &[f32], grid: &Grid, earth: &Earth, day: &Day) -> Result<Vec<LitTimes>> {
    let radius = (DISC_DEG / 2.0).to_radians() as f32;
    let step = (day.time_of_position(1) - day.time_of_position(0)) as f32;
    let mut lit = vec![Lit::BEFORE; heights.len()];
    for k in 0..day.positions {
        let time = day.time_of_position(k);
        let sun = day.sun(time)?;
        let tangents = horizon_tangents_on(heights, grid, earth, sun.azimuth_deg, &Serial, &Silent)?;
        let altitude = sun.altitude_deg.to_radians() as f32;
        for (lit, tangent) in lit.iter_mut().zip(&tangents) {
            lit.go_on(time as f32, step, altitude - tangent.atan(), radius);
        }
    }
    let squares = squared_slopes(grid, heights);
    let times = |((lit, h), slope_square): ((Lit, &f32), f32)| {
        if h.is_nan() {
            return LitTimes::VOID;
        }
        LitTimes {
            slope_square,
            ..lit.times([0.0; 2])
        }
    };
    Ok(lit.into_iter().zip(heights).zip(squares).map(times).collect())
}

/// As [`super::day_levels`].
pub(crate) fn day_levels(grid: &Grid, trace: &[LitTimes], filter: &Filter) -> Result<Vec<Vec<DaySample>>> {
    let mut fields: [Vec<f32>; 5] = std::array::from_fn(|field| {
        let mut values: Vec<f32> = trace.iter().map(|times| times.fields()[field]).collect();
        fill_voids(&mut values, grid.size);
        values
    });
    // From softness to mean square: what is filtered.
    let [first, first_soft, last, last_soft, _] = &mut fields;
    for (times, softs) in [(first, first_soft), (last, last_soft)] {
        for (soft, &mut time) in softs.iter_mut().zip(times) {
            *soft = time * time + 0.25 * *soft * *soft;
        }
    }
    let mut levels = Vec::new();
    for l in 0..grid.file_levels() {
        if l > 0 {
            for field in &mut fields {
                *field = downsample(field, grid.level(l - 1), filter, None, &Serial, &Silent)?;
            }
        }
        let sample = |n: usize| {
            let time = |time: f32| time.clamp(-NEVER, NEVER);
            let soft = |time: f32, square: f32| {
                let variance = square - time * time;
                (2.0 * variance.max(0.0).sqrt()).clamp(LEAST_SOFT, NEVER)
            };
            let [first, first_square, last, last_square, slope_square] = &fields;
            DaySample {
                first: f16::from_f32(time(first[n])),
                first_soft: f16::from_f32(soft(first[n], first_square[n])),
                last: f16::from_f32(time(last[n])),
                last_soft: f16::from_f32(soft(last[n], last_square[n])),
                slope: f16::from_f32(slope_square[n].max(0.0).sqrt().min(6e4)),
                unused: f16::ZERO,
            }
        };
        levels.push((0..fields[0].len()).map(sample).collect());
    }
    Ok(levels)
}

/// The squared slope of the ground at every sample of level 0, by central differences, one-sided at edges and beside
/// voids; NaN at voids.
fn squared_slopes(grid: &Grid, heights: &[f32]) -> Vec<f32> {
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
    for (j, row) in squares.chunks_mut(width).enumerate() {
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
    }
    squares
}
