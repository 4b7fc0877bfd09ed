//! Heights of a rectangle at a level, laid out for a physics engine's height field.

use crate::error::{Error, ErrorKind, Result};
use crate::grid::Rect;
use crate::levels::{Arrival, Levels};

/// The most samples of one collider: 64 MiB of heights.
pub const MAX_COLLIDER_SAMPLES: i64 = 1 << 24;

/// Heights of a rectangle of a level.
///
/// `heights_m` is row by row from north to south, each row from west to east, `rect.width()` long: the sample at column
/// i and row j of the level is element `(j - rect.z0) * rect.width() + (i - rect.x0)`, and lies at
/// `first_m + [i - rect.x0, j - rect.z0] * spacing_m`. NaN is no data: a quad's triangle with such a corner is a hole.
/// Quads are split from their north-west (i, j) to their south-east (i + 1, j + 1) corner. Where the rectangle holds the
/// last column or row of a level above 0, those may lie beyond the DEM's edge by less than a step.
#[derive(Clone, Debug, PartialEq)]
pub struct Collider {
    /// The level.
    pub level: u32,
    /// Its samples.
    pub rect: Rect,
    /// World x and z in metres of the first sample.
    pub first_m: [f64; 2],
    /// Metres between columns and between rows.
    pub spacing_m: [f64; 2],
    /// Heights in metres before vertical scale, the DEM's base included; NaN for no data.
    pub heights_m: Vec<f64>,
}

/// The heights of `rect`, in samples of level `level` of `levels`.
///
/// # Errors
/// [`ErrorKind::Misuse`] for a level or a rectangle that there is not, [`ErrorKind::Limit`] for more than
/// [`MAX_COLLIDER_SAMPLES`], [`ErrorKind::Unsupported`] where data are missing; those of `levels`.
pub fn collider(levels: &dyn Levels, level: u32, rect: Rect) -> Result<Collider> {
    let refuse = |kind, what: String| Err(Error::new(kind, "collider", what));
    if level >= levels.level_count() {
        let what = format!("level {level} asked for, of {} levels", levels.level_count());
        return refuse(ErrorKind::Misuse, what);
    }
    let grid = levels.grid();
    let size = grid.level(level);
    if rect.is_empty() || !size.rect().contains_rect(rect) {
        let what = format!(
            "{rect:?} asked for, of {} x {} samples of level {level}",
            size.width, size.height
        );
        return refuse(ErrorKind::Misuse, what);
    }
    if rect.area() > MAX_COLLIDER_SAMPLES {
        let what = format!(
            "{} samples asked for, of at most {MAX_COLLIDER_SAMPLES}",
            rect.area()
        );
        return refuse(ErrorKind::Limit, what);
    }
    let mut heights = vec![0.0; rect.area() as usize];
    arrived(levels.heights(level, rect, &mut heights)?)?;
    let step = (1i64 << level) as f64;
    let spacing_m = grid.spacing_m.map(|s| s * step);
    Ok(Collider {
        level,
        rect,
        first_m: [rect.x0 as f64 * spacing_m[0], rect.z0 as f64 * spacing_m[1]],
        spacing_m,
        heights_m: heights.iter().map(|&h| f64::from(h) + grid.base_m).collect(),
    })
}

/// Queries need their data at once.
pub(super) fn arrived(arrival: Arrival) -> Result<()> {
    match arrival {
        Arrival::Arrived => Ok(()),
        Arrival::Missing => Err(Error::new(
            ErrorKind::Unsupported,
            "terrain",
            "data are missing that the query needs",
        )
        .advice("use a source that waits for its data")),
    }
}
