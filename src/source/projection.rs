//! From a projected grid back to the earth: latitude, longitude and the direction of grid north at a place.
//!
//! Transverse Mercator by Krüger's series in the third flattening n, to n^4 (C. F. F. Karney, Transverse Mercator with an
//! accuracy of a few nanometers, Journal of Geodesy 85, 2011, equations 11, 15, 21 to 25 and 36; the latitude from the
//! conformal one by the series of L. Krüger, 1912): better than a millimetre within a zone. Web Mercator on its sphere.
//! Systems are told by their EPSG codes. Ellipsoids of systems are taken for those of WGS84 without a shift of datum: that
//! moves a place by some hundred metres, and the sun by a thousandth of a degree.

use super::Georeference;

/// A place on the earth, and where a grid's columns point there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OnEarth {
    /// Degrees north of the equator.
    pub latitude_deg: f64,
    /// Degrees east of Greenwich.
    pub longitude_deg: f64,
    /// Azimuth of grid north in degrees clockwise from true north: the convergence.
    pub grid_north_deg: f64,
}

/// Semi-major axis in metres and inverse flattening.
type Axes = (f64, f64);

/// Also near enough for WGS84: a tenth of a millimetre.
const GRS80: Axes = (6_378_137.0, 298.257_222_101);
const WGS72: Axes = (6_378_135.0, 298.26);
const CLARKE_1866: Axes = (6_378_206.4, 294.978_698_213_898);
const BESSEL: Axes = (6_377_397.155, 299.152_812_8);
const INTERNATIONAL: Axes = (6_378_388.0, 297.0);

/// A transverse Mercator projection that counts northings from the equator.
#[derive(Clone, Copy, Debug, PartialEq)]
struct TransverseMercator {
    axes: Axes,
    /// Degrees east of Greenwich.
    meridian_deg: f64,
    scale: f64,
    /// Metres that are added to easting and northing.
    false_m: [f64; 2],
}

impl TransverseMercator {
    fn utm(axes: Axes, zone: u16, south: bool) -> Self {
        Self {
            axes,
            meridian_deg: 6.0 * f64::from(zone) - 183.0,
            scale: 0.9996,
            false_m: [500_000.0, if south { 10_000_000.0 } else { 0.0 }],
        }
    }

    /// That of an EPSG code, of those in use.
    fn of_code(code: u16) -> Option<Self> {
        let zoned = |first: u16, zone: u16| zone + (code - first);
        Some(match code {
            32601..=32660 => Self::utm(GRS80, zoned(32601, 1), false), // WGS 84
            32701..=32760 => Self::utm(GRS80, zoned(32701, 1), true),
            32201..=32260 => Self::utm(WGS72, zoned(32201, 1), false), // WGS 72
            32301..=32360 => Self::utm(WGS72, zoned(32301, 1), true),
            26901..=26923 => Self::utm(GRS80, zoned(26901, 1), false), // NAD83
            6330..=6348 => Self::utm(GRS80, zoned(6330, 1), false),    // NAD83(2011)
            26701..=26722 => Self::utm(CLARKE_1866, zoned(26701, 1), false), // NAD27
            25828..=25838 => Self::utm(GRS80, zoned(25828, 28), false), // ETRS89
            23028..=23038 => Self::utm(INTERNATIONAL, zoned(23028, 28), false), // ED50
            28348..=28358 => Self::utm(GRS80, zoned(28348, 48), true), // GDA94, MGA
            7846..=7859 => Self::utm(GRS80, zoned(7846, 46), true),    // GDA2020, MGA
            3006 => Self::utm(GRS80, 33, false),                       // SWEREF99 TM
            3067 => Self::utm(GRS80, 35, false),                       // ETRS-TM35FIN
            2180 => Self {
                axes: GRS80,
                meridian_deg: 19.0,
                scale: 0.9993,
                false_m: [500_000.0, -5_300_000.0],
            }, // ETRF2000-PL, CS92
            2193 => Self {
                axes: GRS80,
                meridian_deg: 173.0,
                scale: 0.9996,
                false_m: [1_600_000.0, 10_000_000.0],
            }, // NZGD2000, NZTM
            31466..=31469 => {
                // DHDN, zones of three degrees
                let zone = f64::from(zoned(31466, 2));
                Self {
                    axes: BESSEL,
                    meridian_deg: 3.0 * zone,
                    scale: 1.0,
                    false_m: [1e6 * zone + 500_000.0, 0.0],
                }
            }
            _ => return None,
        })
    }

    /// Where (`easting_m`, `northing_m`) lies.
    fn on_earth(&self, easting_m: f64, northing_m: f64) -> OnEarth {
        let (a_m, inverse_f) = self.axes;
        let f = 1.0 / inverse_f;
        let n = f / (2.0 - f);
        let (n2, n3, n4) = (n * n, n * n * n, n * n * n * n);
        let rectifying_m = a_m / (1.0 + n) * (1.0 + n2 / 4.0 + n4 / 64.0);
        let beta = [
            n / 2.0 - n2 * 2.0 / 3.0 + n3 * 37.0 / 96.0 - n4 / 360.0,
            n2 / 48.0 + n3 / 15.0 - n4 * 437.0 / 1440.0,
            n3 * 17.0 / 480.0 - n4 * 37.0 / 840.0,
            n4 * 4397.0 / 161_280.0,
        ];
        let delta = [
            2.0 * n - n2 * 2.0 / 3.0 - 2.0 * n3 + n4 * 116.0 / 45.0,
            n2 * 7.0 / 3.0 - n3 * 8.0 / 5.0 - n4 * 227.0 / 45.0,
            n3 * 56.0 / 15.0 - n4 * 136.0 / 35.0,
            n4 * 4279.0 / 630.0,
        ];
        let xi = (northing_m - self.false_m[1]) / (self.scale * rectifying_m);
        let eta = (easting_m - self.false_m[0]) / (self.scale * rectifying_m);
        // Primed xi and eta, and the real and imaginary part of the derivative of one pair by the other.
        let (mut x, mut e, mut p, mut q) = (xi, eta, 1.0, 0.0);
        for (j, beta) in (1..).map(f64::from).zip(beta) {
            let (sin, cos) = (2.0 * j * xi).sin_cos();
            let (sinh, cosh) = ((2.0 * j * eta).sinh(), (2.0 * j * eta).cosh());
            x -= beta * sin * cosh;
            e -= beta * cos * sinh;
            p -= 2.0 * j * beta * cos * cosh;
            q += 2.0 * j * beta * sin * sinh;
        }
        let conformal = (x.sin() / e.cosh()).asin();
        let series = (1..).map(f64::from).zip(delta);
        let latitude = conformal
            + series
                .map(|(j, delta)| delta * (2.0 * j * conformal).sin())
                .sum::<f64>();
        let turned = x.tan() * e.tanh();
        OnEarth {
            latitude_deg: latitude.to_degrees(),
            longitude_deg: self.meridian_deg + e.sinh().atan2(x.cos()).to_degrees(),
            grid_north_deg: (q + p * turned).atan2(p - q * turned).to_degrees(),
        }
    }
}

impl Georeference {
    /// Where a place in CRS coordinates lies on the earth; none where its CRS is not known here, or the place is not on
    /// the earth.
    pub fn on_earth(&self, place: [f64; 2]) -> Option<OnEarth> {
        let [east, north] = place;
        let found = if self.geographic {
            OnEarth {
                latitude_deg: north,
                longitude_deg: east,
                grid_north_deg: 0.0,
            }
        } else {
            // All these systems count metres.
            let [east_m, north_m] = place;
            match self.epsg()[0]? {
                // Web Mercator: Snyder, Map Projections, 1987, equations 7-4 and 7-5 on a sphere.
                3857 => OnEarth {
                    latitude_deg: (north_m / GRS80.0).sinh().atan().to_degrees(),
                    longitude_deg: (east_m / GRS80.0).to_degrees(),
                    grid_north_deg: 0.0,
                },
                code => {
                    let projection = TransverseMercator::of_code(code)?;
                    // Beyond, the series is not good enough.
                    let reach_m = (east_m - projection.false_m[0]).abs();
                    if reach_m > 1e6 || (north_m - projection.false_m[1]).abs() > 1.0002e7 {
                        return None;
                    }
                    projection.on_earth(east_m, north_m)
                }
            }
        };
        let OnEarth {
            latitude_deg,
            longitude_deg,
            grid_north_deg,
        } = found;
        let on = latitude_deg.abs() <= 90.0 && longitude_deg.is_finite() && grid_north_deg.is_finite();
        // Longitudes of -180 to 180 degrees.
        on.then(|| OnEarth {
            longitude_deg: (longitude_deg + 180.0).rem_euclid(360.0) - 180.0,
            ..found
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::Registration;
    use super::*;

    fn of(crs: &str, geographic: bool, at: [f64; 2]) -> Option<OnEarth> {
        let place = Georeference {
            crs: Some(crs.into()),
            origin: [0.0, 0.0],
            pixel: [1.0, -1.0],
            registration: Registration::Point,
            geographic,
        };
        place.on_earth(at)
    }

    #[test]
    fn published_places_are_found() {
        // Snyder 1987, page 269: UTM zone 18 on Clarke 1866, 40.5 north, 73.5 west.
        let found = of("EPSG:26718", false, [627_106.5, 4_484_124.4]).unwrap();
        assert!((found.latitude_deg - 40.5).abs() < 1e-6, "{found:?}");
        assert!((found.longitude_deg + 73.5).abs() < 1e-6, "{found:?}");
        // Where the meridian's arc ends: 10,001,965.729 m on WGS84 is the pole.
        let pole = of("EPSG:32633", false, [500_000.0, 0.9996 * 10_001_965.729]).unwrap();
        assert!((pole.latitude_deg - 90.0).abs() < 1e-7, "{pole:?}");
        // Snyder, page 270, its inverse; and his table of the meridian: 45 degrees are 4,984,944.38 m on WGS84.
        let middle = of("EPSG:32611", false, [500_000.0, 0.9996 * 4_984_944.378]).unwrap();
        assert!((middle.latitude_deg - 45.0).abs() < 1e-7, "{middle:?}");
        assert_eq!((middle.longitude_deg, middle.grid_north_deg), (-117.0, 0.0));
        // The corner of Web Mercator's square: 85.051129 degrees.
        let corner = of("EPSG:3857", false, [20_037_508.342_789, 20_037_508.342_789]).unwrap();
        assert!(
            (corner.latitude_deg - 85.051_128_779_8).abs() < 1e-9,
            "{corner:?}"
        );
        let degrees = of("EPSG:4326", true, [190.0, -33.5]).unwrap();
        assert_eq!(
            (
                degrees.latitude_deg,
                degrees.longitude_deg,
                degrees.grid_north_deg
            ),
            (-33.5, -170.0, 0.0)
        );
    }

    #[test]
    fn grid_north_is_where_northings_grow() {
        for (crs, at) in [
            ("EPSG:32611", [300_000.0, 4_200_000.0]),
            ("EPSG:32611", [800_000.0, 7_500_000.0]),
            ("EPSG:32733", [300_000.0, 6_200_000.0]),
            ("EPSG:31467", [3_400_000.0, 5_500_000.0]),
            ("EPSG:2180", [200_000.0, 500_000.0]),
            ("EPSG:2193", [1_750_000.0, 5_427_000.0]),
        ] {
            let [south, here, north] =
                [-100.0, 0.0, 100.0].map(|up| of(crs, false, [at[0], at[1] + up]).unwrap());
            // Metres east and north of the step, on the ellipsoid.
            let (a_m, e2) = (GRS80.0, 0.006_694_38);
            let (sin, cos) = here.latitude_deg.to_radians().sin_cos();
            let w2 = 1.0 - e2 * sin * sin;
            let step = |of: fn(&OnEarth) -> f64| (of(&north) - of(&south)).to_radians() * a_m / w2.sqrt();
            let east_m = step(|at| at.longitude_deg) * cos;
            let north_m = step(|at| at.latitude_deg) * (1.0 - e2) / w2;
            let want = east_m.atan2(north_m).to_degrees();
            assert!(
                (here.grid_north_deg - want).abs() < 1e-5,
                "{crs}, {at:?}: {here:?}, {want}"
            );
            assert!(want.abs() > 0.5, "{crs}: something to find");
        }
        // On a sphere it would be atan(tan(longitude from the meridian) sin(latitude)).
        let found = of("EPSG:26718", false, [627_106.5, 4_484_124.4]).unwrap();
        let sphere = (1.5f64.to_radians().tan() * 40.5f64.to_radians().sin()).atan();
        assert!(
            (found.grid_north_deg - sphere.to_degrees()).abs() < 1e-4,
            "{found:?}"
        );
    }

    #[test]
    fn what_is_not_known_is_not_guessed() {
        assert_eq!(of("EPSG:2154", false, [700_000.0, 6_600_000.0]), None);
        assert_eq!(of("some grid", false, [700_000.0, 6_600_000.0]), None);
        assert_eq!(
            of("EPSG:32611", false, [9e6, 4e6]),
            None,
            "far outside of its zone"
        );
        assert_eq!(of("EPSG:4326", true, [0.0, 91.0]), None);
        assert_eq!(of("EPSG:4326", true, [f64::NAN, 0.0]), None);
    }
}
