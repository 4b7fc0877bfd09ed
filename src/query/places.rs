//! Places on the ground by the coordinates of the DEM's own reference system.

use glam::DVec3;

use super::{S0, Surface};
use crate::error::{Error, ErrorKind, Result};
use crate::levels::Levels;
use crate::source::Georeference;

/// Finds places of a reference system on the surface of the DEM's own samples.
#[derive(Debug)]
pub struct Places<'a> {
    surface: S0<'a>,
    place: &'a Georeference,
    name: &'a str,
}

impl<'a> Places<'a> {
    /// Places on level 0 of `levels`, a source that waits for its data, which lies at `place`; `name` is what messages
    /// call it.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] where it is not known where the DEM lies.
    pub fn new(levels: &'a dyn Levels, place: Option<&'a Georeference>, name: &'a str) -> Result<Self> {
        let Some(place) = place else {
            let what = "does not say where it lies, so there are no places in its reference system";
            return Err(Error::new(ErrorKind::Misuse, name, what).advice("give a place in world metres"));
        };
        Ok(Self {
            surface: S0::new(levels),
            place,
            name,
        })
    }

    /// The world coordinates of the ground at easting and northing, or longitude and latitude in degrees.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] off the DEM and in a hole; those of reading.
    pub fn ground(&self, at: [f64; 2]) -> Result<DVec3> {
        let grid = self.surface.grid();
        let [column, row] = self.place.sample(at, grid.size.width);
        let (x, z) = (column * grid.spacing_m[0], row * grid.spacing_m[1]);
        let [east, north] = at;
        let finite = x.is_finite() && z.is_finite();
        match finite
            .then(|| self.surface.height_at(x, z))
            .transpose()?
            .flatten()
        {
            Some(y) => Ok(DVec3::new(x, y, z)),
            None => {
                let size = grid.size;
                let first = self.place.origin;
                let last = self
                    .place
                    .place(size.width as f64 - 1.0, size.height as f64 - 1.0);
                let what = format!("has no ground at {east}, {north}");
                Err(Error::new(ErrorKind::Misuse, self.name, what).advice(format!(
                    "choose a place within {} to {}, {} to {}, that is no hole",
                    first[0].min(last[0]),
                    first[0].max(last[0]),
                    first[1].min(last[1]),
                    first[1].max(last[1])
                )))
            }
        }
    }

    /// The world coordinates `above_m` metres above the ground there.
    ///
    /// # Errors
    /// As [`Places::ground`].
    pub fn above(&self, at: [f64; 2], above_m: f64) -> Result<DVec3> {
        Ok(self.ground(at)? + DVec3::new(0.0, above_m, 0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::{Registration, Synth};

    #[test]
    fn places_stand_on_the_samples_that_are_there() {
        let synth = Synth::new(64, 3).unwrap();
        let spacing_m = Levels::grid(&synth).spacing_m;
        let place = Georeference {
            crs: None,
            origin: [500.0, 900.0],
            pixel: [2.0, -4.0],
            registration: Registration::Area,
            geographic: false,
        };
        let places = Places::new(&synth, Some(&place), "t").unwrap();
        let mut height = [0.0];
        synth
            .heights(0, crate::grid::Rect::new(5, 7, 6, 8), &mut height)
            .map(drop)
            .unwrap();
        let ground = places.ground([510.0, 872.0]).unwrap();
        assert_eq!([ground.x, ground.z], [5.0 * spacing_m[0], 7.0 * spacing_m[1]]);
        assert!((ground.y - f64::from(height[0])).abs() < 1e-9);
        assert_eq!(places.above([510.0, 872.0], 3.0).unwrap().y, ground.y + 3.0);
        // Half way to the next column it stands on the edge between them.
        let mut pair = [0.0; 2];
        synth
            .heights(0, crate::grid::Rect::new(5, 7, 7, 8), &mut pair)
            .map(drop)
            .unwrap();
        let between = places.ground([511.0, 872.0]).unwrap().y;
        assert!((between - 0.5 * f64::from(pair[0] + pair[1])).abs() < 1e-3);
        for off in [[499.0, 872.0], [510.0, 901.0], [f64::NAN, 872.0], [1e300, 872.0]] {
            let error = places.ground(off).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::Misuse, "{error}");
        }
        let error = places.ground([499.0, 872.0]).unwrap_err().to_string();
        assert!(error.contains("within 500 to 626, 648 to 900"), "{error}");
        assert!(Places::new(&synth, None, "t").is_err());
    }
}
