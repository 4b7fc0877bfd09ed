//! What heights stored in fewer bits would cost: in metres over level 0, in pixels over the flight, in bytes.
//!
//! *Metres*: of what a height becomes when it is stored so, less the height, over all valid samples of level 0. *Pixels*: a
//! picture drawn exactly (one ray a pixel, f64) of the DEM with its heights stored so, measured against the DEM as any
//! drawn picture is: floor taken off, pooled over the measured frames. So it is what storing alone adds, of whatever
//! levels are drawn. *16-bit integers* are the 65,536 heights that divide the range of the DEM's levels evenly.

use half::f16;

use super::sweep::{Sweep, cancel};
use crate::accuracy::{DepthImage, ErrorPool, ErrorSummary, ExactImage, measure};
use crate::build::Threads;
use crate::camera::View;
use crate::clipmap::near_of_m;
use crate::error::Result;
use crate::grid::{Grid, Rect};
use crate::levels::{Arrival, Bounds, Levels, LightSample};
use crate::progress::Progress;
use crate::query::Truth;

/// A way to store a height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Format {
    /// 32-bit floating point: what this crate uses.
    F32,
    /// 16-bit floating point: 11 significant bits.
    F16,
    /// 16-bit integers over the range from `low_m` to `high_m`.
    Int16 {
        /// The height of 0.
        low_m: f32,
        /// The height of 65,535.
        high_m: f32,
    },
}

impl Format {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::F16 => "f16",
            Self::Int16 { .. } => "16-bit integer",
        }
    }

    /// Bytes of a height.
    pub fn bytes(self) -> u64 {
        match self {
            Self::F32 => 4,
            Self::F16 | Self::Int16 { .. } => 2,
        }
    }

    /// What a height becomes, void stays void.
    pub fn stored(self, height_m: f32) -> f32 {
        match self {
            Self::F32 => height_m,
            Self::F16 => f16::from_f32(height_m).to_f32(),
            Self::Int16 { low_m, high_m } => {
                let step_m = (f64::from(high_m) - f64::from(low_m)) / 65_535.0;
                if step_m == 0.0 || height_m.is_nan() {
                    return height_m;
                }
                let count = ((f64::from(height_m) - f64::from(low_m)) / step_m).round();
                (f64::from(low_m) + count.clamp(0.0, 65_535.0) * step_m) as f32
            }
        }
    }

    /// The most by which a height of size up to `greatest_m` changes.
    fn most_m(self, greatest_m: f64) -> f64 {
        match self {
            Self::F32 => 0.0,
            // Half of the distance to the next of 11 bits; subnormal ones are 2^-24 apart.
            Self::F16 => (greatest_m * 2f64.powi(-11)).max(2f64.powi(-25)),
            Self::Int16 { low_m, high_m } => (f64::from(high_m) - f64::from(low_m)) / 65_535.0,
        }
    }
}

/// What one way to store heights costs.
#[derive(Clone, Debug, PartialEq)]
pub struct StorageCost {
    /// The way.
    pub format: Format,
    /// Greatest and root-mean-square change of a height of level 0 in metres; infinite where it overflows.
    pub change_m: [f64; 2],
    /// Errors over the measured frames; zero for what changes nothing.
    pub errors: ErrorSummary,
    /// Bytes of heights in the windows of the base setting, on the device.
    pub window_bytes: u64,
    /// Bytes of heights uploaded a frame by the base setting, median.
    pub upload_bytes: u64,
}

/// Levels whose heights are stored in another format.
struct Stored<'a> {
    levels: &'a dyn Levels,
    format: Format,
}

impl Levels for Stored<'_> {
    fn grid(&self) -> &Grid {
        self.levels.grid()
    }

    fn level_count(&self) -> u32 {
        self.levels.level_count()
    }

    fn heights(&self, level: u32, rect: Rect, out: &mut [f32]) -> Result<Arrival> {
        let arrival = self.levels.heights(level, rect, out)?;
        out.iter_mut().for_each(|h| {
            let stored = self.format.stored(*h);
            // What a format cannot hold is no ground.
            *h = if stored.is_finite() { stored } else { f32::NAN };
        });
        Ok(arrival)
    }

    fn bounds(&self, level: u32, patches: Rect, out: &mut [Bounds]) -> Result<Arrival> {
        let arrival = self.levels.bounds(level, patches, out)?;
        for bounds in out {
            let greatest_m = [bounds.min, bounds.max, bounds.need_min, bounds.need_max]
                .into_iter()
                .fold(0.0f32, |most, h| most.max(h.abs()));
            let most_m = (self.format.most_m(f64::from(greatest_m)) as f32).next_up();
            let (lower, raise) = (|h: f32| (h - most_m).next_down(), |h: f32| (h + most_m).next_up());
            *bounds = Bounds {
                min: lower(bounds.min),
                max: raise(bounds.max),
                error: raise(bounds.error + most_m),
                need_min: lower(bounds.need_min),
                need_max: raise(bounds.need_max),
                need_error: raise(bounds.need_error + most_m),
            };
        }
        Ok(arrival)
    }

    fn has_light(&self) -> bool {
        false
    }

    fn light(&self, level: u32, rect: Rect, out: &mut [LightSample]) -> Result<Arrival> {
        self.levels.light(level, rect, out)
    }
}

/// The costs of f32, f16 and 16-bit integers over the flight of `sweep`; `range_m` are the least and greatest height of
/// all levels, `window_bytes` and `upload_bytes` those of f32 in the base setting.
///
/// # Errors
/// Those of reading; [`crate::ErrorKind::Cancelled`].
pub fn storage_costs(
    sweep: &Sweep<'_>,
    range_m: [f32; 2],
    [window_bytes, upload_bytes]: [u64; 2],
    threads: &Threads,
    progress: &dyn Progress,
) -> Result<Vec<StorageCost>> {
    let [low_m, high_m] = range_m;
    let frames = sweep.effort.measured(sweep.flight);
    let levels = sweep.terrain.0;
    let scale = sweep.options.clipmap.vertical_scale;
    let truth = Truth::new(levels, scale);
    let formats = [Format::F32, Format::F16, Format::Int16 { low_m, high_m }];
    progress.begin("storage", (formats.len() * frames.len()) as u64);
    let mut costs = Vec::new();
    for format in formats {
        let stored = Stored { levels, format };
        let changed = Truth::new(&stored, scale);
        let mut pool = ErrorPool::default();
        for &frame in &frames {
            cancel(progress)?;
            progress.advance(1);
            if format == Format::F32 {
                continue; // it is what the DEM is held in
            }
            let view = View::new(sweep.flight.camera_at_frame(frame), sweep.options.size_px)?;
            let exact = ExactImage::new(&changed, &view, threads)?;
            let near_m = near_of_m(&view, levels.grid());
            let depths: Vec<f32> = exact.distances_m().iter().map(|d| (near_m / d) as f32).collect();
            pool.add(
                frame,
                &measure(&truth, &DepthImage::new(&depths, &view)?, threads)?,
            );
        }
        costs.push(StorageCost {
            format,
            change_m: change_m(levels, format)?,
            errors: pool.summary(),
            window_bytes: window_bytes / 4 * format.bytes(),
            upload_bytes: upload_bytes / 4 * format.bytes(),
        });
    }
    Ok(costs)
}

/// Greatest and root-mean-square change of a height of level 0.
fn change_m(levels: &dyn Levels, format: Format) -> Result<[f64; 2]> {
    let size = levels.grid().size;
    let (mut greatest, mut squares, mut count) = (0.0f64, 0.0, 0u64);
    let mut row = vec![0.0; size.width as usize];
    for z in 0..size.height {
        if levels.heights(0, Rect::new(0, z, size.width, z + 1), &mut row)? == Arrival::Missing {
            continue;
        }
        for height in row.iter().filter(|h| !h.is_nan()) {
            let change = (f64::from(format.stored(*height)) - f64::from(*height)).abs();
            greatest = greatest.max(change);
            squares += change * change;
            count += 1;
        }
    }
    Ok([greatest, (squares / count.max(1) as f64).sqrt()])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::Silent;
    use crate::pyramid::{Filter, Pyramid};
    use crate::work::Serial;

    #[test]
    fn heights_change_by_no_more_than_stated_and_bounds_hold_them() {
        let grid = Grid::new(90, 70, [30.0, 30.0]);
        let height = |(i, j): (i64, i64)| {
            if i == 7 && j > 60 {
                f32::NAN
            } else {
                353.7 + (i * 37 % 41 * j) as f32
            }
        };
        let mut made = Pyramid::new(
            grid,
            grid.size.rect().cells().map(height).collect(),
            None,
            &Filter::default(),
            &Serial,
            &Silent,
        )
        .unwrap();
        made.bound(&Serial, &Silent).unwrap();
        let (low_m, high_m) = (300.0, 3500.0);
        for format in [Format::F32, Format::F16, Format::Int16 { low_m, high_m }] {
            let [greatest, rms] = change_m(&made, format).unwrap();
            assert!(
                rms <= greatest && greatest <= format.most_m(3500.0),
                "{format:?}: {greatest}"
            );
            assert_eq!(format == Format::F32, greatest == 0.0);
            let stored = Stored {
                levels: &made,
                format,
            };
            let patches = grid.patches(0).rect();
            let mut bounds = vec![Bounds::VOID; patches.area() as usize];
            assert_eq!(stored.bounds(0, patches, &mut bounds).unwrap(), Arrival::Arrived);
            let mut heights = vec![0.0; grid.size.samples() as usize];
            assert_eq!(
                stored.heights(0, grid.size.rect(), &mut heights).unwrap(),
                Arrival::Arrived
            );
            for ((i, j), h) in grid.size.rect().cells().zip(&heights) {
                let patch = &bounds[(j / 8 * patches.width() + i / 8).min(bounds.len() as i64 - 1) as usize];
                assert!(
                    h.is_nan()
                        || (i / 8 >= patches.width() || j / 8 >= patches.height())
                        || (patch.min <= *h && *h <= patch.max)
                );
            }
        }
        assert_eq!(Format::F16.stored(2049.0), 2048.0);
        assert!(Format::F16.stored(70_000.0).is_infinite());
        assert!(Format::Int16 { low_m, high_m }.stored(f32::NAN).is_nan());
        assert_eq!(
            Format::Int16 {
                low_m: 5.0,
                high_m: 5.0
            }
            .stored(5.0),
            5.0
        );
    }
}
