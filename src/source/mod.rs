//! DEMs as their files give them: [`HeightSource`], one file per format, and procedural terrain.

#[cfg(feature = "dem")]
mod archive;
mod ascii_grid;
mod crop;
mod dted;
mod ehdr;
mod envi;
mod file;
mod flat;
mod geographic;
mod georeference;
#[cfg(feature = "dem")]
mod geotiff;
mod held;
mod hgt;
mod mosaic;
mod open;
mod openexr;
mod options;
mod paths;
#[cfg(feature = "dem")]
mod png;
mod raw;
mod read_at;
mod sample;
mod synth;
mod unnamed;
mod usgs_dem;
#[cfg(feature = "dem")]
mod write;

pub use georeference::{Georeference, Registration};
pub use open::open_bytes;
pub use options::{Band, Crop, OpenOptions, RawLayout, SampleType};
pub use paths::{files_of, name_of, open, open_file, open_with};
pub use read_at::{Cursor, ReadAt};
pub use synth::{MAX_SYNTH_SIZE, Synth};
#[cfg(feature = "dem")]
pub use write::write_tiff;

use crate::error::{Error, ErrorKind, Result};
use crate::grid::{Grid, Rect};
use crate::progress::Progress;

/// What a DEM says of itself, and what was assumed of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Description {
    /// Size, spacing in metres, base.
    pub grid: Grid,
    /// The file format, as `info` prints it: `GeoTIFF`, `PNG`, `OpenEXR`, `SRTM`, `DTED`, `USGS DEM`, `ESRI ASCII`,
    /// `ESRI BIL`, `ENVI`, `raw`, `synth`; of a mosaic those of its tiles.
    pub format: String,
    /// The type of its samples as stored: `int16`, `float32`.
    pub sample_type: String,
    /// The step between neighbouring heights in metres, where samples are integers (scale applied).
    pub step_m: Option<f64>,
    /// Where it lies, if the file says.
    pub place: Option<Georeference>,
    /// The unit of heights as read: `metre`, or `unknown` (then taken as metres and listed in `assumed`).
    pub vertical_unit: String,
    /// Whole sentences on what was assumed because the file does not say.
    pub assumed: Vec<String>,
    /// The name by which messages speak of it: the path as given, or `synth:1024:1`.
    pub name: String,
}

impl Description {
    /// Refuses a rectangle that does not lie in the grid, or has another area than `out` has places.
    fn check_rect(&self, rect: Rect, out: &[f32]) -> Result<()> {
        let size = self.grid.size;
        if size.rect().contains_rect(rect) && out.len() as i64 == rect.area() {
            return Ok(());
        }
        let what = format!("{rect:?} with {} places does not fit {size:?}", out.len());
        Err(Error::new(ErrorKind::Misuse, &self.name, what))
    }
}

/// A DEM that can be read by rectangles of its samples.
///
/// Sequential readers may be slow where rectangles are not asked for from north to south.
pub trait HeightSource: Send + Sync {
    /// What it says of itself.
    fn description(&self) -> &Description;

    /// The heights of `rect` of level 0, row by row: metres less [`Grid::base_m`], NaN for no data.
    ///
    /// `rect` lies within the grid and `out` is `rect.area()` long.
    ///
    /// # Errors
    /// Where the file is damaged, vanished, or uses what this crate does not read.
    fn read(&self, rect: Rect, out: &mut [f32]) -> Result<()>;

    /// Whole sentences on what only a look at the samples tells, as tiles that disagree where they overlap. It may
    /// read much of the DEM.
    ///
    /// # Errors
    /// Those of reading; [`ErrorKind::Cancelled`].
    fn remarks(&self, progress: &dyn Progress) -> Result<Vec<String>> {
        let _ = progress;
        Ok(Vec::new())
    }
}
