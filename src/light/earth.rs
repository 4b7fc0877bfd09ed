//! The earth under a DEM, as far as light cares: how it curves, and where its north is.

use super::misuse;
use crate::error::Result;
use crate::grid::Grid;
use crate::source::{Georeference, OnEarth};

/// How much of the earth's curve the bending of light in the air makes up for, unless told otherwise: the mean of
/// C. F. Gauss's measurements in Hanover, as F. K. Brunner (editor), Geodetic Refraction, 1984, quotes it.
pub const DEFAULT_REFRACTION: f64 = 0.13;

/// The mean radius of the earth in metres (IUGG, 1980), where no latitude is known.
const MEAN_RADIUS_M: f64 = 6_371_008.8;

/// The sentences on light in what was assumed of a DEM begin so.
const SENTENCE: &str = "Its light ";

/// The earth on which light is traced. The default is flat, its grid north true north.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Earth {
    /// Azimuth of the grid's columns, northward, in degrees clockwise from true north.
    pub grid_north_deg: f64,
    /// The radius, in metres, of the sphere over which light would run straight; infinite for a flat earth.
    pub radius_m: f64,
}

impl Default for Earth {
    fn default() -> Self {
        Self {
            grid_north_deg: 0.0,
            radius_m: f64::INFINITY,
        }
    }
}

impl Earth {
    /// The earth at the middle of a DEM of `grid` at `place`: its convergence, where its projection is known; and its
    /// curve where a coefficient of refraction is given. The radius R is that of Gauss, the root of those of meridian
    /// and prime vertical (Snyder, Map Projections, 1987, page 24) on WGS84; light that bends with the coefficient k
    /// runs straight over a sphere of radius R / (1 - k).
    ///
    /// # Errors
    /// [`crate::ErrorKind::Misuse`] where the DEM has no reference system to say whose curve that is, or the coefficient
    /// is not from -1 to below 1.
    pub fn of(grid: &Grid, place: Option<&Georeference>, refraction: Option<f64>) -> Result<Self> {
        let on_earth = place.and_then(|place| middle(grid, place));
        let mut earth = Self {
            grid_north_deg: on_earth.map_or(0.0, |at| at.grid_north_deg),
            ..Self::default()
        };
        if let Some(k) = refraction {
            if !(-1.0..1.0).contains(&k) {
                let what = format!("a coefficient of refraction of {k} is not from -1 to below 1");
                return Err(misuse(what).advice(format!("give one like {DEFAULT_REFRACTION}")));
            }
            let named = place.is_some_and(|place| place.geographic || place.crs.is_some());
            if !named {
                return Err(misuse("a DEM without a reference system lies on no known earth")
                    .advice("leave the curvature out"));
            }
            let radius_m = on_earth.map_or(MEAN_RADIUS_M, |at| gauss_radius_m(at.latitude_deg));
            earth.radius_m = radius_m / (1.0 - k);
        }
        Ok(earth)
    }

    /// Puts what holds of light over the earth of `light`, if there is light, into `assumed`, in place of what was said
    /// of earlier light.
    pub fn assume(
        light: Option<&Self>,
        place: Option<&Georeference>,
        grid: &Grid,
        assumed: &mut Vec<String>,
    ) {
        assumed.retain(|sentence| !sentence.starts_with(SENTENCE));
        let Some(earth) = light else {
            return;
        };
        if let Some(place) = place
            && !place.geographic
            && middle(grid, place).is_some()
        {
            assumed.push(format!(
                "{SENTENCE}alone is turned to true north: grid north lies {:.3} degrees east of it at the DEM's middle.",
                earth.grid_north_deg
            ));
        }
        if earth.radius_m.is_finite() {
            assumed.push(format!(
                "{SENTENCE}runs straight over an earth of {:.1} km radius, refraction included.",
                earth.radius_m / 1e3
            ));
        }
    }

    /// A true azimuth as the grid has it.
    pub(crate) fn on_grid_deg(&self, azimuth_deg: f64) -> f64 {
        azimuth_deg - self.grid_north_deg
    }
}

/// Where the middle of a DEM of `grid` at `place` lies, if its reference system is known here.
pub fn middle(grid: &Grid, place: &Georeference) -> Option<OnEarth> {
    let half = |n: i64| 0.5 * (n - 1) as f64;
    place.on_earth(place.place(half(grid.size.width), half(grid.size.height)))
}

/// Gauss's radius of curvature at a latitude of WGS84.
fn gauss_radius_m(latitude_deg: f64) -> f64 {
    let (a_m, f) = (6_378_137.0, 1.0 / 298.257_223_563);
    let e2: f64 = f * (2.0 - f);
    let sin = latitude_deg.to_radians().sin();
    a_m * (1.0 - e2).sqrt() / (1.0 - e2 * sin * sin)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::{Sun, horizon_tangents, horizon_tangents_on, sun_share, sun_share_on};
    use crate::progress::Silent;
    use crate::source::Registration;
    use crate::work::Serial;

    fn place(crs: Option<&str>, geographic: bool, origin: [f64; 2]) -> Georeference {
        Georeference {
            crs: crs.map(Into::into),
            origin,
            pixel: [1.0, -1.0],
            registration: Registration::Point,
            geographic,
        }
    }

    /// Over level sea a tower of height h stands above the level horizon as far as the distance to the horizon,
    /// sqrt(2 R h), and at distance d its tangent is h / d - d / 2R.
    #[test]
    fn a_tower_sets_at_the_distance_to_the_horizon() {
        let radius_m = 6_371_000.0 / 0.87;
        let grid = Grid::new(1200, 3, [50.0, 50.0]);
        for height_m in [10.0f32, 100.0] {
            let mut heights = vec![0.0; 3600];
            heights[1200] = height_m;
            let earth = Earth {
                radius_m,
                ..Earth::default()
            };
            let curved = horizon_tangents_on(&heights, &grid, &earth, 270.0, &Serial, &Silent).unwrap();
            let flat = horizon_tangents(&heights, &grid, 270.0, &Serial, &Silent).unwrap();
            let horizon_m = (2.0 * radius_m * f64::from(height_m)).sqrt();
            let mut beyond = 0;
            for i in 1..1200 {
                let d = f64::from(i) * 50.0;
                let want = (f64::from(height_m) / d - d / 2.0 / radius_m).max(0.0);
                let got = f64::from(curved[1200 + i as usize]);
                assert!(
                    (got - want).abs() < 1e-7,
                    "{height_m} m, {d} m: {got}, not {want}"
                );
                assert_eq!(got > 0.0, d < horizon_m, "{height_m} m, {d} m of {horizon_m}");
                // A control: on a flat earth it never sets.
                assert!(flat[1200 + i as usize] > 0.0);
                beyond += u32::from(d > horizon_m);
            }
            assert!(beyond > 100, "{height_m} m: the horizon lies on the DEM");
        }
    }

    #[test]
    fn true_azimuths_are_turned_to_the_grid() {
        let grid = Grid::new(101, 101, [100.0, 100.0]);
        // Zone 11 from its central meridian eastward, in the north.
        let at = place(Some("EPSG:32611"), false, [700_000.0, 7_000_000.0]);
        let earth = Earth::of(&grid, Some(&at), None).unwrap();
        assert!((3.0..4.0).contains(&earth.grid_north_deg), "{earth:?}");
        assert!(earth.radius_m.is_infinite());
        let heights: Vec<f32> = (0..10201).map(|k| (k % 101) as f32 * 7.0).collect();
        let sun = |azimuth_deg| Sun {
            azimuth_deg,
            altitude_deg: 20.0,
        };
        let turned = sun_share_on(&heights, &grid, &earth, sun(30.0), &Serial, &Silent).unwrap();
        let by_hand = sun(30.0 - earth.grid_north_deg);
        assert_eq!(
            turned,
            sun_share(&heights, &grid, by_hand, &Serial, &Silent).unwrap()
        );
        assert_ne!(
            turned,
            sun_share(&heights, &grid, sun(30.0), &Serial, &Silent).unwrap()
        );

        let mut assumed = vec!["Heights are metres.".to_string(), format!("{SENTENCE}is old.")];
        Earth::assume(Some(&earth), Some(&at), &grid, &mut assumed);
        assert_eq!(assumed.len(), 2);
        assert!(
            assumed[1].contains("3.") && assumed[1].contains("turned"),
            "{assumed:?}"
        );
        let degrees = place(Some("EPSG:4326"), true, [10.0, 45.0]);
        let geographic = Earth::of(&grid, Some(&degrees), None).unwrap();
        assert_eq!(geographic, Earth::default());
        Earth::assume(Some(&geographic), Some(&degrees), &grid, &mut assumed);
        assert_eq!(assumed, ["Heights are metres."]);
    }

    #[test]
    fn only_a_known_earth_curves() {
        let grid = Grid::new(3, 3, [1.0, 1.0]);
        let curved = |place: Option<&Georeference>, k| Earth::of(&grid, place, Some(k)).map(|e| e.radius_m);
        // Gauss's radius at 45 degrees on WGS84: 6,378.1 km; at the equator b, at the poles a^2 / b.
        let middle = curved(Some(&place(None, true, [10.0, 46.0])), 0.0).unwrap();
        assert!((middle - 6_378_101.0).abs() < 1.0, "{middle}");
        assert!((gauss_radius_m(0.0) - 6_356_752.3).abs() < 0.1);
        assert!((gauss_radius_m(90.0) - 6_399_593.6).abs() < 0.1);
        let other = curved(Some(&place(Some("a grid"), false, [0.0, 0.0])), 0.13).unwrap();
        assert_eq!(other, MEAN_RADIUS_M / 0.87);
        for refused in [
            curved(None, 0.13),
            curved(Some(&place(None, false, [0.0, 0.0])), 0.13),
            curved(Some(&place(None, true, [0.0, 0.0])), 1.0),
            curved(Some(&place(None, true, [0.0, 0.0])), f64::NAN),
        ] {
            assert_eq!(refused.unwrap_err().kind(), crate::ErrorKind::Misuse);
        }
    }
}
