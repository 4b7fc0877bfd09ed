//! Where the tiles of a mosaic lie on their common grid.

use std::path::PathBuf;

use crate::error::{Error, ErrorKind, Result};
use crate::grid::{Grid, MAX_SIZE, Rect, Size};
use crate::source::{Description, Georeference};

/// How far, in steps, a tile's samples may lie from the common grid's: coordinates are rounded where they are written.
const OFF_GRID_STEPS: f64 = 1e-3;

/// A file of the mosaic.
#[derive(Clone, Debug)]
pub(super) struct Tile {
    pub(super) path: PathBuf,
    /// Its samples on the mosaic's grid; until [`union`], on a grid whose (0, 0) is the first tile's.
    pub(super) rect: Rect,
    pub(super) base_m: f64,
    /// What it holds while it is open.
    pub(super) held_bytes: u64,
}

impl Tile {
    /// The tile `path`, which holds `held_bytes` while it is open, laid on the grid of the first one.
    ///
    /// # Errors
    /// [`ErrorKind::Unsupported`] where it tells no place, or another system, step or phase than the first.
    pub(super) fn new(
        path: PathBuf,
        description: &Description,
        held_bytes: u64,
        first: &Description,
    ) -> Result<Self> {
        let off = |what: String| {
            Err(Error::new(ErrorKind::Unsupported, path.display(), what)
                .advice(format!("warp the tiles onto one grid, that of {}", first.name)))
        };
        let (Some(place), Some(other)) = (&description.place, &first.place) else {
            let what = "does not say where it lies, so it cannot be put beside other tiles";
            return Err(Error::new(ErrorKind::Unsupported, path.display(), what).advice("name it alone"));
        };
        if let (Some(own), Some(common)) = (&place.crs, &other.crs)
            && own != common
        {
            return off(format!("is in {own}, other tiles are in {common}"));
        }
        if place.geographic != other.geographic {
            return off("is in degrees or metres, other tiles are not".into());
        }
        let size = description.grid.size;
        let sides = [size.width, size.height];
        let mut at = [0; 2];
        for axis in 0..2 {
            let (step, common) = (place.pixel[axis], other.pixel[axis]);
            // A difference of steps adds up along a side.
            let drift = (step / common - 1.0).abs() * sides[axis] as f64;
            let shift = (place.origin[axis] - other.origin[axis]) / common;
            if drift.is_nan() || drift > OFF_GRID_STEPS {
                return off(format!("has a step of {step}, other tiles have {common}"));
            }
            let on_grid = (shift - shift.round()).abs() <= OFF_GRID_STEPS && shift.abs() < MAX_SIZE as f64;
            if !on_grid {
                return off(format!(
                    "lies {shift:.3} steps from {}, not a whole number",
                    first.name
                ));
            }
            at[axis] = shift.round() as i64;
        }
        Ok(Self {
            path,
            rect: size.rect().moved(at[0], at[1]),
            base_m: description.grid.base_m,
            held_bytes,
        })
    }

    pub(super) fn size(&self) -> Size {
        Size {
            width: self.rect.width(),
            height: self.rect.height(),
        }
    }
}

/// The grid that holds all tiles, whose rectangles are moved onto it, and its place.
///
/// # Errors
/// [`ErrorKind::Limit`] where it is larger than any grid may be.
pub(super) fn union(name: &str, tiles: &mut [Tile], first: &Description) -> Result<(Grid, Georeference)> {
    let hull = tiles
        .iter()
        .map(|t| t.rect)
        .reduce(|a, b| Rect::new(a.x0.min(b.x0), a.z0.min(b.z0), a.x1.max(b.x1), a.z1.max(b.z1)));
    let (Some(hull), Some(place)) = (hull, &first.place) else {
        return Err(Error::new(ErrorKind::Misuse, name, "holds no DEM"));
    };
    if hull.width() > MAX_SIZE || hull.height() > MAX_SIZE {
        let what = format!(
            "its tiles reach over {} x {} samples",
            hull.width(),
            hull.height()
        );
        return Err(Error::new(ErrorKind::Limit, name, what).advice("name fewer of them"));
    }
    for tile in tiles.iter_mut() {
        tile.rect = tile.rect.moved(-hull.x0, -hull.z0);
    }
    let mut place = place.clone();
    place.origin = place.place(hull.x0 as f64, hull.z0 as f64);
    let mut grid = Grid::new(hull.width(), hull.height(), first.grid.spacing_m);
    // One base for all: that of the first tile that needs one.
    grid.base_m = tiles.iter().map(|t| t.base_m).find(|b| *b != 0.0).unwrap_or(0.0);
    Ok((grid, place))
}
