//! DEMs as their files give them: [`HeightSource`], one file per format, and procedural terrain.

#[cfg(feature = "dem")]
mod archive;
mod ascii_grid;
mod crop;
mod destep;
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
mod processors;
mod projection;
mod raw;
mod read_at;
mod sample;
mod synth;
mod unnamed;
mod usgs_dem;
#[cfg(feature = "dem")]
mod write;

pub use destep::Destepped;
pub use georeference::{Georeference, Registration};
pub use open::open_bytes;
pub(crate) use openexr::{Wanted, read_channel};
pub use options::{Band, Crop, OpenOptions, RawLayout, SampleType};
pub use paths::{files_of, name_of, open, open_file, open_with};
pub use projection::OnEarth;
pub use read_at::{Cursor, ReadAt};
pub use synth::{MAX_SYNTH_SIZE, Synth};
#[cfg(feature = "dem")]
pub use write::write_tiff;

use crate::error::{Error, ErrorKind, Result};
use crate::grid::{Grid, Rect};
use crate::progress::Progress;

/// Rows that are read at once where a DEM is read from north to south: what [`HeightSource::held_bytes`] speaks of.
pub(crate) const READ_ROWS: i64 = 256;

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

    /// The most memory that it holds while it is read from north to south, 256 rows at once, in bytes: what it takes for
    /// that beside the heights it gives; what it takes on the way back, and while it is opened, is not counted.
    fn held_bytes(&self) -> u64 {
        0
    }

    /// What all reads so far have met; zeros where a source does not count.
    fn reads(&self) -> Reads {
        Reads::default()
    }

    /// Coarser copies of itself that the file holds, the finest first, for a quick look: they are filtered and rounded
    /// as their writer chose, and lie beside the samples of the pyramid's levels.
    ///
    /// # Errors
    /// Where one is damaged, or uses what this crate does not read.
    fn overviews(&self) -> Result<Vec<Overview>> {
        Ok(Vec::new())
    }

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

/// What reading a file has met so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reads {
    /// Blocks (strips, tiles) of which the file consists.
    pub blocks: u64,
    /// Blocks decoded, each as often as it was.
    pub decoded: u64,
    /// Samples given as no data because they are infinite or beyond f32, each as often as it was read.
    pub infinite: u64,
}

/// A coarser copy of a DEM, and where its samples lie.
///
/// Its sample in column i lies over column `i * step[0] + shift[0]` of the DEM, likewise for rows; over a part of a larger
/// DEM it may reach beyond the part.
pub struct Overview {
    /// Its heights, above the DEM's own base.
    pub source: Box<dyn HeightSource>,
    /// Columns and rows of the DEM to one of the overview.
    pub step: [f64; 2],
    /// Column and row of the DEM over which the overview's first sample lies: half a step less half a sample, as a
    /// pixel of an overview covers whole pixels.
    pub shift: [f64; 2],
}
