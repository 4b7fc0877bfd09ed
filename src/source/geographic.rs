//! Metres from degrees: the spacing of a geographic grid on the WGS84 ellipsoid.
//!
//! At latitude f, with the ellipsoid's semi-major axis a and eccentricity e, a radian of latitude spans the
//! radius of curvature of the meridian, `M = a (1 - e^2) / (1 - e^2 sin^2 f)^(3/2)`, and a radian of
//! longitude the radius of the parallel, `N cos f` with `N = a / (1 - e^2 sin^2 f)^(1/2)` (J. P. Snyder, Map
//! Projections: A Working Manual, USGS Professional Paper 1395, 1987, pages 24 and 25). A grid has one spacing
//! for all its rows, taken at its middle latitude.

use super::Georeference;
use crate::grid::Size;

/// Semi-major axis of WGS84 in metres.
const A_M: f64 = 6_378_137.0;
/// Flattening of WGS84.
const F: f64 = 1.0 / 298.257_223_563;

/// Metres that a step of (`longitude_deg`, `latitude_deg`) degrees spans at latitude `at_deg`.
fn metres(at_deg: f64, longitude_deg: f64, latitude_deg: f64) -> [f64; 2] {
    let e2 = F * (2.0 - F);
    let (sin, cos) = at_deg.to_radians().sin_cos();
    let w2 = 1.0 - e2 * sin * sin;
    let parallel_m = A_M / w2.sqrt() * cos;
    let meridian_m = A_M * (1.0 - e2) / (w2 * w2.sqrt());
    [
        parallel_m * longitude_deg.to_radians(),
        meridian_m * latitude_deg.to_radians(),
    ]
}

/// The spacing in metres of a grid placed in degrees, and the sentence that says so.
///
/// # Errors
/// A phrase, where its latitudes are not on the earth.
pub(super) fn spacing_m(place: &Georeference, size: Size) -> Result<([f64; 2], String), String> {
    let [_, first] = place.origin;
    let [_, last] = place.place(0.0, (size.height - 1) as f64);
    let middle = 0.5 * (first + last);
    if !(first.abs() <= 90.0 && last.abs() <= 90.0 && middle.abs() < 90.0) {
        return Err(format!(
            "its latitudes, {first} to {last} degrees, are not between -90 and 90"
        ));
    }
    let spacing_m = metres(middle, place.pixel[0].abs(), place.pixel[1].abs());
    let sentence = format!(
        "Its degrees are turned into a spacing of {:.3} x {:.3} m on the WGS84 ellipsoid at its middle latitude, \
         {middle:.4}.",
        spacing_m[0], spacing_m[1]
    );
    Ok((spacing_m, sentence))
}

/// Whether a grid without a named reference system can only sensibly be in degrees: steps below 0.1, and all of
/// it between -180 and 180, -90 and 90.
pub(super) fn looks_like_degrees(place: &Georeference, size: Size) -> bool {
    let [x1, y1] = place.place((size.width - 1) as f64, (size.height - 1) as f64);
    let [x0, y0] = place.origin;
    place.pixel.iter().all(|p| p.abs() < 0.1)
        && [x0, x1].iter().all(|x| x.abs() <= 180.0)
        && [y0, y1].iter().all(|y| y.abs() <= 90.0)
}

/// What `assumed` says where [`looks_like_degrees`] decided.
pub(super) const DEGREES_ASSUMED: &str =
    "The coordinate reference system is unknown; from its extent and cell size it is taken to be in degrees.";

/// What `assumed` says of a projected grid, whose columns point to grid north.
pub(super) const GRID_NORTH_ASSUMED: &str = "Grid north is taken for true north.";

/// What `assumed` says where nothing tells the horizontal unit.
pub(super) const METRES_ASSUMED: &str =
    "The coordinate reference system is unknown; its units are taken as metres.";

#[cfg(test)]
mod tests {
    use super::super::Registration;
    use super::*;

    #[test]
    fn a_degree_has_the_published_length() {
        // Snyder's table of lengths of a degree (Clarke 1866 differs); these are WGS84's: equator, 45, 60.
        for (at, longitude_m, latitude_m) in [
            (0.0, 111_319.491, 110_574.276),
            (45.0, 78_846.835, 111_131.778),
            (60.0, 55_800.0, 111_412.27),
        ] {
            let [x, z] = metres(at, 1.0, 1.0);
            assert!((x - longitude_m).abs() < 0.5, "{at}: {x}");
            assert!((z - latitude_m).abs() < 1.0, "{at}: {z}");
        }
        // The meridian's quarter, 10,001,965.729 m, is the sum of its degrees.
        let quarter: f64 = (0..9000)
            .map(|i| metres((f64::from(i) + 0.5) / 100.0, 0.0, 0.01)[1])
            .sum();
        assert!((quarter - 10_001_965.729).abs() < 0.01, "{quarter}");
    }

    fn place(origin: [f64; 2], pixel: f64) -> Georeference {
        Georeference {
            crs: None,
            origin,
            pixel: [pixel, -pixel],
            registration: Registration::Point,
            geographic: true,
        }
    }

    #[test]
    fn the_middle_latitude_counts_and_the_poles_are_refused() {
        let size = Size {
            width: 11,
            height: 11,
        };
        let ([dx, dz], sentence) = spacing_m(&place([1.0, 43.0], 0.1), size).unwrap();
        assert_eq!([dx, dz], metres(42.5, 0.1, 0.1));
        assert!(sentence.contains("42.5"), "{sentence}");
        assert!(spacing_m(&place([1.0, 91.0], 0.1), size).is_err());
        assert!(spacing_m(&place([1.0, f64::NAN], 0.1), size).is_err());
        let pole = Size { width: 1, height: 1 };
        assert!(spacing_m(&place([1.0, 90.0], 0.1), pole).is_err());
    }

    #[test]
    fn only_small_steps_within_the_earth_look_like_degrees() {
        let size = Size {
            width: 11,
            height: 11,
        };
        assert!(looks_like_degrees(&place([1.0, 43.0], 0.01), size));
        assert!(!looks_like_degrees(&place([1.0, 43.0], 0.1), size));
        assert!(!looks_like_degrees(&place([179.95, 43.0], 0.01), size));
        assert!(!looks_like_degrees(&place([500_000.0, 4_000_000.0], 0.05), size));
    }
}
