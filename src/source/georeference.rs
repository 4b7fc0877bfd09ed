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
    /// The reference system: `EPSG:n` where the file names one, else its WKT or the file's own words.
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
}
