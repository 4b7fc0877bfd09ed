//! Metres from degrees: the spacing of a geographic grid on the WGS84 ellipsoid.
//!
//! At latitude f, with the ellipsoid's semi-major axis a and eccentricity e, a radian of latitude spans the
//! radius of curvature of the meridian, `M = a (1 - e^2) / (1 - e^2 sin^2 f)^(3/2)`, and a radian of
//! longitude the radius of the parallel, `N cos f` with `N = a / (1 - e^2 sin^2 f)^(1/2)` (J. P. Snyder, Map
//! Projections: A Working Manual, USGS Professional Paper 1395, 1987, pages 24 and 25). A grid has one spacing
//! for all its rows, taken at its middle latitude.

use super::Georeference;
use crate::grid::Size;

/// The figure of the earth of a reference system.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ellipsoid {
    name: &'static str,
    /// Semi-major axis in metres.
    a_m: f64,
    /// Flattening.
    f: f64,
}

impl Ellipsoid {
    /// That of systems that name none.
    pub(super) const WGS84: Self = Self {
        name: "WGS84",
        a_m: 6_378_137.0,
        f: 1.0 / 298.257_223_563,
    };

    /// The ellipsoid of an EPSG code: its own, or that of a geographic system in use.
    #[cfg(feature = "dem")]
    pub(super) fn of_code(code: u16) -> Option<Self> {
        let (name, a_m, inverse_f) = match code {
            7030 | 4326 | 4979 => return Some(Self::WGS84),
            7019 | 4269 | 4258 | 4283 | 4167 | 6318 | 7844 => ("GRS 1980", 6_378_137.0, 298.257_222_101),
            7043 | 4322 => ("WGS 72", 6_378_135.0, 298.26),
            7022 | 4230 => ("International 1924", 6_378_388.0, 297.0),
            7004 | 4314 => ("Bessel 1841", 6_377_397.155, 299.152_812_8),
            7024 | 4284 => ("Krassowsky 1940", 6_378_245.0, 298.3),
            7001 | 4277 => ("Airy 1830", 6_377_563.396, 299.324_964_6),
            // Clarke's axes of 1866 are given in metres: 6378206.4 and 6356583.8.
            7008 | 4267 => ("Clarke 1866", 6_378_206.4, 294.978_698_213_898),
            7012 => ("Clarke 1880 (RGS)", 6_378_249.145, 293.465),
            7011 | 4275 => ("Clarke 1880 (IGN)", 6_378_249.2, 293.466_021_293_627),
            _ => return None,
        };
        Some(Self {
            name,
            a_m,
            f: 1.0 / inverse_f,
        })
    }

    /// The ellipsoid of a semi-major axis in metres and a flattening, if they are the earth's.
    #[cfg(feature = "dem")]
    pub(super) fn of_axes(a_m: f64, f: f64) -> Option<Self> {
        let earth = (6.3e6..6.5e6).contains(&a_m) && (0.0..0.01).contains(&f);
        earth.then_some(Self {
            name: "file's own",
            a_m,
            f,
        })
    }

    /// Metres that a step of (`longitude_deg`, `latitude_deg`) degrees spans at latitude `at_deg`.
    fn metres(&self, at_deg: f64, longitude_deg: f64, latitude_deg: f64) -> [f64; 2] {
        let e2 = self.f * (2.0 - self.f);
        let (sin, cos) = at_deg.to_radians().sin_cos();
        let w2 = 1.0 - e2 * sin * sin;
        let parallel_m = self.a_m / w2.sqrt() * cos;
        let meridian_m = self.a_m * (1.0 - e2) / (w2 * w2.sqrt());
        [
            parallel_m * longitude_deg.to_radians(),
            meridian_m * latitude_deg.to_radians(),
        ]
    }
}

/// The spacing in metres of a grid placed in degrees, on WGS84, and the sentence that says so.
///
/// # Errors
/// A phrase, where its latitudes are not on the earth.
pub(super) fn spacing_m(place: &Georeference, size: Size) -> Result<([f64; 2], String), String> {
    spacing_on(None, place, size)
}

/// The same on an ellipsoid; on WGS84 where none is known, which is then said.
///
/// # Errors
/// As [`spacing_m`].
pub(super) fn spacing_on(
    ellipsoid: Option<Ellipsoid>,
    place: &Georeference,
    size: Size,
) -> Result<([f64; 2], String), String> {
    let [_, first] = place.origin;
    let [_, last] = place.place(0.0, (size.height - 1) as f64);
    let middle = 0.5 * (first + last);
    if !(first.abs() <= 90.0 && last.abs() <= 90.0 && middle.abs() < 90.0) {
        return Err(format!(
            "its latitudes, {first} to {last} degrees, are not between -90 and 90"
        ));
    }
    let figure = ellipsoid.unwrap_or(Ellipsoid::WGS84);
    let [px, py] = place.pixel.map(f64::abs);
    let spacing_m = figure.metres(middle, px, py);
    // What one spacing for all rows costs is greatest at the northern or the southern edge.
    let [north, south] = [first, last].map(|at| {
        let [width_m, _] = figure.metres(at, px, py);
        100.0 * (width_m / spacing_m[0] - 1.0)
    });
    let sentence = format!(
        "Its degrees are turned into a spacing of {:.3} x {:.3} m on the {} ellipsoid at its middle latitude, \
         {middle:.4}; true columns are {} apart at its northern edge and {} at its southern.",
        spacing_m[0],
        spacing_m[1],
        figure.name,
        share(north),
        share(south)
    );
    Ok((spacing_m, sentence))
}

/// By how many hundredths something is more or less, as words.
fn share(percent: f64) -> String {
    let direction = if percent < 0.0 { "less" } else { "more" };
    format!("{:.2} % {direction}", percent.abs())
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
            let [x, z] = Ellipsoid::WGS84.metres(at, 1.0, 1.0);
            assert!((x - longitude_m).abs() < 0.5, "{at}: {x}");
            assert!((z - latitude_m).abs() < 1.0, "{at}: {z}");
        }
        // The meridian's quarter, 10,001,965.729 m, is the sum of its degrees.
        let quarter: f64 = (0..9000)
            .map(|i| Ellipsoid::WGS84.metres((f64::from(i) + 0.5) / 100.0, 0.0, 0.01)[1])
            .sum();
        assert!((quarter - 10_001_965.729).abs() < 0.01, "{quarter}");
    }

    #[cfg(feature = "dem")]
    #[test]
    fn a_systems_own_ellipsoid_is_taken() {
        let of = |code| Ellipsoid::of_code(code).unwrap();
        assert_eq!(of(4326), Ellipsoid::WGS84);
        // Snyder, table 1: a degree of longitude on the equator of Clarke 1866 is 111,320.7 m; his table of the
        // meridian's: 111,699.4 m at the pole end, 110,567.2 m at the equator.
        let clarke = of(4267);
        assert!((clarke.metres(0.0, 1.0, 0.0)[0] - 111_320.7).abs() < 0.1);
        assert!((clarke.metres(0.5, 0.0, 1.0)[1] - 110_567.2).abs() < 1.0);
        assert!((clarke.metres(89.5, 0.0, 1.0)[1] - 111_699.4).abs() < 1.0);
        let minor_m = clarke.a_m * (1.0 - clarke.f);
        assert!((minor_m - 6_356_583.8).abs() < 1e-3, "{minor_m}");
        assert_eq!(Ellipsoid::of_code(32633), None);
        assert_eq!(Ellipsoid::of_axes(1_737_400.0, 0.0), None, "the moon");
        assert!(Ellipsoid::of_axes(6_371_000.0, 0.0).is_some());
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
        assert_eq!([dx, dz], Ellipsoid::WGS84.metres(42.5, 0.1, 0.1));
        assert!(
            sentence.contains("WGS84 ellipsoid") && sentence.contains("42.5"),
            "{sentence}"
        );
        // cos 43 / cos 42.5 is 0.99195, cos 42 / cos 42.5 is 1.00796; the ellipsoid adds a hundredth of that.
        assert!(
            sentence.contains("0.80 % less apart at its northern edge and 0.79 % more"),
            "{sentence}"
        );
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
