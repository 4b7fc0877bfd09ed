//! Light texels: light as it was traced, beside the slopes of the heights, at one level's resolution; and light over a day.

use half::f16;

use super::window::{DayTexel, LightTexel, Scratch};
use crate::error::Result;
use crate::grid::Rect;
use crate::levels::{Arrival, DaySample, Levels, LightSample};

/// Reads `rect` of level `level` into `scratch.texels`, and its light over a day into `scratch.days` if `day`.
pub(super) fn read(
    source: &dyn Levels,
    level: u32,
    rect: Rect,
    day: bool,
    scratch: &mut Scratch,
) -> Result<Arrival> {
    let grid = source.grid();
    let around = rect.grown(1).intersection(grid.level(level).rect());
    scratch.relief.resize(around.area() as usize, 0.0);
    if source.heights(level, around, &mut scratch.relief)? == Arrival::Missing {
        return Ok(Arrival::Missing);
    }
    scratch
        .shares
        .resize(rect.area() as usize, LightSample::default());
    if source.has_light() && source.light(level, rect, &mut scratch.shares)? == Arrival::Missing {
        return Ok(Arrival::Missing);
    }
    scratch.days.clear();
    if day {
        scratch
            .day_samples
            .resize(rect.area() as usize, DaySample::default());
        if source.day(level, rect, &mut scratch.day_samples)? == Arrival::Missing {
            return Ok(Arrival::Missing);
        }
        let texel = |s: &DaySample| -> DayTexel { [s.first, s.first_soft, s.last, s.last_soft] };
        scratch.days.extend(scratch.day_samples.iter().map(texel));
    }
    let step = (1i64 << level) as f64;
    let spacing_m = grid.spacing_m.map(|s| (s * step) as f32);
    let heights = &scratch.relief;
    let at = |i: i64, j: i64| {
        if around.contains(i, j) {
            heights[((j - around.z0) * around.width() + (i - around.x0)) as usize]
        } else {
            f32::NAN
        }
    };
    scratch.texels.clear();
    scratch.texels.extend(
        rect.cells()
            .zip(&scratch.shares)
            .map(|((i, j), share)| -> LightTexel {
                let h = at(i, j);
                let east = slope(at(i - 1, j), h, at(i + 1, j), spacing_m[0]);
                let south = slope(at(i, j - 1), h, at(i, j + 1), spacing_m[1]);
                [share.sun, share.sky, east, south]
            }),
    );
    if day {
        for (texel, sample) in scratch.texels.iter_mut().zip(&scratch.day_samples) {
            texel[0] = rough(level, sample.slope, texel[2], texel[3]);
        }
    }
    Ok(Arrival::Arrived)
}

/// The light texels of `rect` of level `level`; none where data are missing.
///
/// # Errors
/// Those of `source`.
pub(crate) fn light_texels(source: &dyn Levels, level: u32, rect: Rect) -> Result<Option<Vec<LightTexel>>> {
    let mut scratch = Scratch::default();
    Ok(match read(source, level, rect, false, &mut scratch)? {
        Arrival::Arrived => Some(scratch.texels),
        Arrival::Missing => None,
    })
}

/// Reads `rect` of level `level` from the next coarser level into `scratch.texels`: half as fine, where the level's own
/// data cannot be read.
pub(super) fn read_coarser(
    source: &dyn Levels,
    level: u32,
    rect: Rect,
    day: bool,
    scratch: &mut Scratch,
) -> Result<Arrival> {
    // The coarse sample where both indices are even, else the ends of the edge or diagonal that holds the texel.
    let coarse = Rect::new(rect.x0 >> 1, rect.z0 >> 1, (rect.x1 >> 1) + 1, (rect.z1 >> 1) + 1)
        .intersection(source.grid().level(level + 1).rect());
    if read(source, level + 1, coarse, day, scratch)? == Arrival::Missing {
        return Ok(Arrival::Missing);
    }
    let between = |texels: Vec<[f16; 4]>| {
        let at = |i: i64, j: i64| texels[((j - coarse.z0) * coarse.width() + (i - coarse.x0)) as usize];
        let mean = |(i, j): (i64, i64)| -> [f16; 4] {
            let (a, b) = (at(i >> 1, j >> 1), at((i + 1) >> 1, (j + 1) >> 1));
            std::array::from_fn(|k| f16::from_f32((a[k].to_f32() + b[k].to_f32()) / 2.0))
        };
        rect.cells().map(mean).collect()
    };
    scratch.texels = between(std::mem::take(&mut scratch.texels));
    if day {
        scratch.days = between(std::mem::take(&mut scratch.days));
    }
    Ok(Arrival::Arrived)
}

/// How far the slopes of level 0 under a sample spread about those of its level, root mean square of an axis, from the
/// root of their mean square. On level 0 they are its own.
fn rough(level: u32, slope: f16, east: f16, south: f16) -> f16 {
    if level == 0 {
        return f16::ZERO;
    }
    let [slope, east, south] = [slope, east, south].map(f16::to_f32);
    f16::from_f32(
        (0.5 * (slope * slope - east * east - south * south))
            .max(0.0)
            .sqrt(),
    )
}

/// The slope at `here` (rise over run, no unit) from its neighbours: central where both are there, one-sided where
/// one is, 0 where none is or where there is no height at all.
fn slope(before: f32, here: f32, after: f32, spacing_m: f32) -> f16 {
    let (rise, steps) = match (before.is_nan(), here.is_nan(), after.is_nan()) {
        (false, false, false) => (after - before, 2.0),
        (true, false, false) => (after - here, 1.0),
        (false, false, true) => (here - before, 1.0),
        _ => (0.0, 1.0),
    };
    // Halves hold up to 65504; a cliff that is steeper than that is as steep.
    f16::from_f32((rise / (spacing_m * steps)).clamp(-6e4, 6e4))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_central_one_sided_or_flat() {
        let nan = f32::NAN;
        let of = |b, h, a| slope(b, h, a, 10.0).to_f32();
        assert_eq!(of(0.0, 7.0, 40.0), 2.0);
        assert_eq!(of(nan, 0.0, 10.0), 1.0);
        assert_eq!(of(0.0, 10.0, nan), 1.0);
        assert_eq!(of(nan, 10.0, nan), 0.0);
        assert_eq!(of(0.0, nan, 10.0), 0.0);
        assert!(of(-1e30, 0.0, 1e30).is_finite());
    }
}
