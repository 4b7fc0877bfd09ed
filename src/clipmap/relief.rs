//! Light texels: light as it was traced, beside the slopes of the heights, at one level's resolution; and light over a day.

use half::f16;
use half::slice::HalfFloatSliceExt;

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
    let (width, around_width) = (rect.width() as usize, around.width() as usize);
    let row =
        |j: i64| ((j - around.z0) as usize * around_width)..((j + 1 - around.z0) as usize * around_width);
    let Scratch {
        relief,
        shares,
        texels,
        rows,
        ..
    } = scratch;
    texels.clear();
    for (j, shares) in (rect.z0..rect.z1).zip(shares.chunks_exact(width.max(1))) {
        // A row and its neighbours, one column more on each side than the rectangle has; NaN beyond the level's edges.
        for (k, padded) in rows.heights.iter_mut().enumerate() {
            padded.clear();
            let j = j - 1 + k as i64;
            if (around.z0..around.z1).contains(&j) {
                padded.extend((around.x0 == rect.x0).then_some(f32::NAN));
                padded.extend(&relief[row(j)]);
            }
            padded.resize(width + 2, f32::NAN);
        }
        rows.slopes.clear();
        let [north, here, south] = &rows.heights;
        let columns = north[1..].iter().zip(here.windows(3)).zip(&south[1..]);
        rows.slopes.extend(columns.flat_map(|((north, here), south)| {
            let east = slope(here[0], here[1], here[2], spacing_m[0]);
            [east, slope(*north, here[1], *south, spacing_m[1])]
        }));
        rows.halves.resize(2 * width, f16::ZERO);
        rows.halves.convert_from_f32_slice(&rows.slopes);
        let texel = |(share, slopes): (&LightSample, &[f16])| [share.sun, share.sky, slopes[0], slopes[1]];
        texels.extend(shares.iter().zip(rows.halves.chunks_exact(2)).map(texel));
    }
    if day {
        for (texel, sample) in scratch.texels.iter_mut().zip(&scratch.day_samples) {
            texel[0] = rough(level, sample.slope, texel[2], texel[3]);
        }
    }
    Ok(Arrival::Arrived)
}

/// Rows that are used anew for every row of texels.
#[derive(Clone, Debug, Default)]
pub(super) struct Rows {
    heights: [Vec<f32>; 3],
    slopes: Vec<f32>,
    halves: Vec<f16>,
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
fn slope(before: f32, here: f32, after: f32, spacing_m: f32) -> f32 {
    let (rise, steps) = match (before.is_nan(), here.is_nan(), after.is_nan()) {
        (false, false, false) => (after - before, 2.0),
        (true, false, false) => (after - here, 1.0),
        (false, false, true) => (here - before, 1.0),
        _ => (0.0, 1.0),
    };
    // Halves hold up to 65504; a cliff that is steeper than that is as steep.
    (rise / (spacing_m * steps)).clamp(-6e4, 6e4)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;
    use crate::levels::Bounds;

    /// A DEM of a formula with voids, without light.
    struct Rough(Grid);

    fn height(i: i64, j: i64) -> f32 {
        let void = (i * 7 + j * 13) % 11 == 0;
        if void {
            f32::NAN
        } else {
            ((i * i + 3 * j) % 17) as f32
        }
    }

    impl Levels for Rough {
        fn grid(&self) -> &Grid {
            &self.0
        }
        fn heights(&self, _: u32, rect: Rect, out: &mut [f32]) -> Result<Arrival> {
            rect.cells()
                .zip(out)
                .for_each(|((i, j), out)| *out = height(i, j));
            Ok(Arrival::Arrived)
        }
        fn bounds(&self, _: u32, _: Rect, _: &mut [Bounds]) -> Result<Arrival> {
            Ok(Arrival::Missing)
        }
        fn has_light(&self) -> bool {
            false
        }
        fn light(&self, _: u32, _: Rect, _: &mut [LightSample]) -> Result<Arrival> {
            Ok(Arrival::Missing)
        }
    }

    #[test]
    fn texels_by_rows_are_those_of_each_sample_alone() {
        let rough = Rough(Grid::new(40, 30, [10.0, 20.0]));
        let inside = rough.0.size.rect();
        for rect in [
            inside,
            Rect::new(3, 4, 20, 29),
            Rect::new(0, 7, 1, 8),
            Rect::new(39, 29, 40, 30),
            Rect::new(39, 0, 40, 30),
        ] {
            let texels = light_texels(&rough, 0, rect).unwrap().unwrap();
            assert_eq!(texels.len() as i64, rect.area());
            for ((i, j), texel) in rect.cells().zip(texels) {
                let at = |i, j| {
                    if inside.contains(i, j) {
                        height(i, j)
                    } else {
                        f32::NAN
                    }
                };
                let east = slope(at(i - 1, j), at(i, j), at(i + 1, j), 10.0);
                let south = slope(at(i, j - 1), at(i, j), at(i, j + 1), 20.0);
                let want = [f16::ZERO, f16::ZERO, f16::from_f32(east), f16::from_f32(south)];
                assert_eq!(texel, want, "({i}, {j}) of {rect:?}");
            }
        }
    }

    #[test]
    fn slopes_are_central_one_sided_or_flat() {
        let nan = f32::NAN;
        let of = |b, h, a| slope(b, h, a, 10.0);
        assert_eq!(of(0.0, 7.0, 40.0), 2.0);
        assert_eq!(of(nan, 0.0, 10.0), 1.0);
        assert_eq!(of(0.0, 10.0, nan), 1.0);
        assert_eq!(of(nan, 10.0, nan), 0.0);
        assert_eq!(of(0.0, nan, 10.0), 0.0);
        assert!(of(-1e30, 0.0, 1e30).is_finite());
    }
}
