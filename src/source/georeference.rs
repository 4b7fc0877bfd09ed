//! Where a DEM lies on the earth, as its file says.

/// Whether a file's coordinates name the corner of a pixel or its centre. Heights are at centres either way.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Registration {
    /// The origin names the outer corner of the first pixel.
    Area,
    /// The origin names the first sample itself.
    Point,
}

/// The place of a DEM in its coordinate reference system.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Georeference {
    /// The reference system: `EPSG:n` where the file names one, `EPSG:n+m` where it names that of its heights too, else
    /// its WKT or the file's own words.
    pub crs: Option<String>,
    /// The CRS coordinates (easting or longitude, northing or latitude) of sample (0, 0) itself, whatever the
    /// registration.
    pub origin: [f64; 2],
    /// CRS units from a column to the next and from a row to the next; the second is usually negative.
    pub pixel: [f64; 2],
    /// How the file registered its pixels.
    pub registration: Registration,
    /// Whether the CRS's units are degrees.
    pub geographic: bool,
}

impl Georeference {
    /// The CRS coordinates of a point at (`column`, `row`), in samples of level 0.
    pub fn place(&self, column: f64, row: f64) -> [f64; 2] {
        [
            self.origin[0] + column * self.pixel[0],
            self.origin[1] + row * self.pixel[1],
        ]
    }

    /// Column and row, in samples of level 0, of a place in CRS coordinates; outside of the DEM too. Of a longitude those
    /// of the turn that is nearest to the middle of the DEM's `width` columns.
    pub fn sample(&self, place: [f64; 2], width: i64) -> [f64; 2] {
        let mut east = place[0];
        if self.geographic {
            let middle = self.origin[0] + 0.5 * (width - 1) as f64 * self.pixel[0];
            east += 360.0 * ((middle - east) / 360.0).round();
        }
        [
            (east - self.origin[0]) / self.pixel[0],
            (place[1] - self.origin[1]) / self.pixel[1],
        ]
    }

    /// The EPSG codes of the horizontal and of the vertical reference system, where `crs` gives them.
    pub fn epsg(&self) -> [Option<u16>; 2] {
        let Some(codes) = self.crs.as_deref().and_then(|crs| crs.strip_prefix("EPSG:")) else {
            return [None; 2];
        };
        let (horizontal, vertical) = codes.split_once('+').unwrap_or((codes, ""));
        [horizontal.parse().ok(), vertical.parse().ok()]
    }

    /// The name of the CRS's unit, of a grid of `spacing_m` metres between columns: `degree`, `metre`, `foot`,
    /// `US survey foot`, else its length.
    pub fn unit(&self, spacing_m: f64) -> String {
        if self.geographic {
            return "degree".into();
        }
        let metres = spacing_m / self.pixel[0].abs();
        let known = LENGTHS
            .iter()
            .find(|(_, length_m)| (metres / length_m - 1.0).abs() < 1e-9);
        known.map_or_else(|| format!("{metres} m"), |(name, _)| (*name).into())
    }
}

/// Units of length by name, and their metres.
pub(super) const LENGTHS: [(&str, f64); 4] = [
    ("metre", 1.0),
    ("foot", 0.3048),
    ("US survey foot", 1200.0 / 3937.0),
    ("kilometre", 1000.0),
];

#[cfg(test)]
mod tests {
    use super::*;

    fn place(crs: Option<&str>, geographic: bool) -> Georeference {
        Georeference {
            crs: crs.map(Into::into),
            origin: [179.0, 50.0],
            pixel: [0.5, -0.25],
            registration: Registration::Point,
            geographic,
        }
    }

    #[test]
    fn samples_and_places_are_each_others_inverse() {
        let projected = place(None, false);
        for at in [[0.0, 0.0], [3.5, -2.0], [-1000.0, 7.25]] {
            let [x, y] = projected.place(at[0], at[1]);
            assert_eq!(projected.sample([x, y], 9), at);
        }
        // A grid of 9 columns from 179 to 183 degrees east: -178 is 182, 179 itself, and half a degree is nearer a turn on.
        let degrees = place(None, true);
        assert_eq!(degrees.sample([-178.0, 49.0], 9), [6.0, 4.0]);
        assert_eq!(degrees.sample([179.0, 50.0], 9), [0.0, 0.0]);
        assert_eq!(degrees.sample([0.5, 50.0], 9), [363.0, 0.0]);
        assert_eq!(degrees.sample([1.5, 50.0], 9), [-355.0, 0.0]);
        assert_eq!(projected.sample([-178.0, 49.0], 9), [-714.0, 4.0]);
    }

    #[test]
    fn codes_and_units_are_told() {
        let codes = |crs| place(crs, false).epsg();
        assert_eq!(codes(Some("EPSG:32611")), [Some(32611), None]);
        assert_eq!(codes(Some("EPSG:32611+5703")), [Some(32611), Some(5703)]);
        assert_eq!(codes(Some("a grid of our own")), [None; 2]);
        assert_eq!(codes(None), [None; 2]);
        assert_eq!(place(None, true).unit(55_000.0), "degree");
        assert_eq!(place(None, false).unit(0.5), "metre");
        assert_eq!(place(None, false).unit(0.1524), "foot");
        assert_eq!(place(None, false).unit(600.0 / 3937.0), "US survey foot");
        assert_eq!(place(None, false).unit(1.0), "2 m");
    }
}
