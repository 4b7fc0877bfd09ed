//! GeoTIFF: one band of heights in strips or tiles, of any type of whole numbers or floats, read block by block.
//!
//! `geotiff/` holds a step of the way each: `ifd` the file's directories, `layout` where the blocks of an image lie,
//! `codec`, `lerc` and `predictor` what they are packed with, `block` these together, `samples` and `nodata` how their bytes
//! become heights, `raster` reading by rectangles with a `cache`; `place` and `keys` where the image lies, `metadata`
//! scale, offset and unit of its heights.
//!
//! Samples equal to `GDAL_NODATA` (tag 42113, text) in their own type, NaN, infinities and what an internal mask hides
//! are no data; blocks that are not stored are no data, or 0 where the file names no value for it, as in GDAL. Rows that
//! run from south to north are given from north to south. A base is subtracted where the first block that holds a value
//! has one that f32 does not hold.

mod block;
mod cache;
mod codec;
mod ifd;
mod keys;
mod layout;
mod lerc;
mod metadata;
mod nodata;
mod place;
mod predictor;
mod raster;
mod samples;

use std::sync::Arc;

use self::ifd::{Directory, File};
use self::layout::{Kind, Layout};
use self::nodata::Nodata;
use self::raster::Raster;
use self::samples::Samples;
use super::held::{HEIGHTS_ASSUMED, Scale, size};
use super::processors::Processors;
use super::{Description, HeightSource, OpenOptions, Overview, READ_ROWS, ReadAt, Reads};
use crate::error::{Error, ErrorKind, Result};
use crate::grid::{Grid, Rect};
use crate::progress::Progress;

/// Later images of the file that are looked at for masks and overviews.
const MAX_IMAGES: usize = 256;

/// Bits of the tag that says what an image is to the one before it.
const OVERVIEW: u64 = 1;
const MASK: u64 = 4;

/// A GeoTIFF whose blocks are decoded when they are asked for.
pub(super) struct GeoTiff {
    description: Description,
    raster: Raster,
    mask: Option<Raster>,
    /// Whether the file's rows run from south to north.
    south_up: bool,
    overviews: Vec<Reduced>,
    file: File,
    band: u64,
}

/// An overview, and the mask of it.
struct Reduced {
    image: Directory,
    mask: Option<Directory>,
}

/// Opens the image `name`.
///
/// # Errors
/// One clear line where its directories are damaged, or say what is not read here.
pub(super) fn open(name: &str, bytes: Arc<dyn ReadAt>, options: &OpenOptions) -> Result<GeoTiff> {
    let (file, first) = File::open(name, bytes)?;
    let image = file.directory(first)?;
    let bands = file.scalar(&image, ifd::BANDS, Some(1))?;
    let band = options.band_index(name, u32::try_from(bands).unwrap_or(u32::MAX))?;
    let layout = Layout::read(&file, &image, u64::from(band))?;
    let size = size(layout.width as u64, layout.height as u64);

    let mut assumed = Vec::new();
    let located = place::locate(&file, &image, size)?;
    let items = metadata::read(&file.text(&image, ifd::GDAL_METADATA).unwrap_or_default(), band);
    let unit = vertical_unit(&located, &items, &mut assumed);
    let scale = Scale {
        scale: items.scale * unit.metres,
        offset: items.offset * unit.metres,
    };
    let nodata = match options.nodata {
        Some(value) => Nodata::parse(&format!("{value:?}"), layout.kind.integer()),
        None => nodata_of(&file, &image, layout.kind, &mut assumed),
    };
    let (integer, wide) = (layout.kind.integer(), layout.kind.wide());
    let sample_type = sample_type(&layout);
    let mut raster = raster(&file, layout, nodata, scale);
    if wide {
        raster.choose_base();
    }
    let others = Others::find(&file, &image, &mut assumed);
    let mask = others
        .mask
        .map(|mask| self::mask(&file, &mask, &raster))
        .transpose()?;
    assumed.splice(0..0, located.assumed);
    let description = Description {
        grid: Grid {
            base_m: raster.samples().base_m,
            ..Grid::new(size.width, size.height, located.spacing_m)
        },
        format: "GeoTIFF".into(),
        sample_type,
        step_m: integer.then_some(scale.scale.abs()),
        place: located.place,
        vertical_unit: unit.name.into(),
        assumed,
        name: name.into(),
    };
    let grid = &description.grid;
    grid.check()
        .map_err(|what| Error::new(ErrorKind::Broken, name, what))?;
    Ok(GeoTiff {
        description,
        raster,
        mask,
        south_up: located.south_up,
        overviews: others.overviews,
        file,
        band: u64::from(band),
    })
}

fn raster(file: &File, layout: Layout, nodata: Nodata, scale: Scale) -> Raster {
    let samples = Samples {
        kind: layout.kind,
        order: block::order(&layout),
        nodata,
        scale,
        base_m: 0.0,
    };
    Raster::new(file.clone(), layout, samples, Box::new(Processors))
}

/// The mask of an image: 0 where it has no data.
fn mask(file: &File, directory: &Directory, of: &Raster) -> Result<Raster> {
    let layout = Layout::read(file, directory, 0)?;
    let (width, height) = (of.layout().width, of.layout().height);
    if (layout.width, layout.height) != (width, height) || layout.kind != Kind::U8 {
        let what = format!(
            "has a mask of {} x {} samples for an image of {width} x {height}",
            layout.width, layout.height
        );
        return Err(file.broken(what));
    }
    Ok(raster(file, layout, Nodata::None, Scale::METRES))
}

impl HeightSource for GeoTiff {
    fn description(&self) -> &Description {
        &self.description
    }

    fn held_bytes(&self) -> u64 {
        // Of a mask the blocks, and what they say of the rows that are read at once.
        let row_bytes = size_of::<f32>() as u64 * self.description.grid.size.width as u64;
        let mask = self.mask.as_ref().map_or(0, Raster::held_bytes);
        let hidden = self.mask.as_ref().map_or(0, |_| READ_ROWS as u64 * row_bytes);
        self.file.held_bytes() + self.raster.held_bytes() + mask + hidden
    }

    fn read(&self, rect: Rect, out: &mut [f32]) -> Result<()> {
        let size = self.description.grid.size;
        if !size.rect().contains_rect(rect) || out.len() as i64 != rect.area() {
            let what = format!("{rect:?} with {} places does not fit {size:?}", out.len());
            return Err(Error::new(ErrorKind::Misuse, &self.description.name, what));
        }
        if rect.is_empty() {
            return Ok(());
        }
        let stored = if self.south_up {
            Rect::new(rect.x0, size.height - rect.z1, rect.x1, size.height - rect.z0)
        } else {
            rect
        };
        self.raster.read(stored, out)?;
        if let Some(mask) = &self.mask {
            let mut valid = super::held::filled(&self.description.name, out.len(), 0.0f32)?;
            mask.read(stored, &mut valid)?;
            let hidden = out.iter_mut().zip(&valid).filter(|(_, valid)| **valid == 0.0);
            hidden.for_each(|(height, _)| *height = f32::NAN);
        }
        if self.south_up {
            super::held::flip(out, rect.width() as usize);
        }
        Ok(())
    }

    fn reads(&self) -> Reads {
        self.raster.reads()
    }

    fn remarks(&self, _: &dyn Progress) -> Result<Vec<String>> {
        Ok(match self.raster.reads().infinite {
            0 => Vec::new(),
            1 => vec!["One height is infinite or beyond f32; it is taken as no data.".into()],
            n => vec![format!(
                "{n} heights are infinite or beyond f32; they are taken as no data."
            )],
        })
    }

    fn overviews(&self) -> Result<Vec<Overview>> {
        self.overviews
            .iter()
            .map(|reduced| self.overview(reduced))
            .collect()
    }
}

impl GeoTiff {
    /// An overview as a DEM of its own, with the image's scale, base and unit.
    fn overview(&self, reduced: &Reduced) -> Result<Overview> {
        let layout = Layout::read(&self.file, &reduced.image, self.band)?;
        let (size, full) = (
            size(layout.width as u64, layout.height as u64),
            self.description.grid.size,
        );
        let step = [
            full.width as f64 / size.width as f64,
            full.height as f64 / size.height as f64,
        ];
        // A pixel of the overview covers `step` pixels of the image, and its sample stands in the middle of them.
        let shift = step.map(|step| (step - 1.0) / 2.0);
        let samples = Samples {
            kind: layout.kind,
            order: block::order(&layout),
            ..*self.raster.samples()
        };
        let raster = Raster::new(self.file.clone(), layout, samples, Box::new(Processors));
        let mask = match &reduced.mask {
            Some(mask) => Some(self::mask(&self.file, mask, &raster)?),
            None => None,
        };
        let mut description = self.description.clone();
        let spacing_m = description.grid.spacing_m;
        description.grid.size = size;
        description.grid.spacing_m = [spacing_m[0] * step[0], spacing_m[1] * step[1]];
        if let Some(place) = &mut description.place {
            place.origin = place.place(shift[0], shift[1]);
            place.pixel = [place.pixel[0] * step[0], place.pixel[1] * step[1]];
        }
        let source = Self {
            description,
            raster,
            mask,
            south_up: self.south_up,
            overviews: Vec::new(),
            file: self.file.clone(),
            band: self.band,
        };
        Ok(Overview {
            source: Box::new(source),
            step,
            shift,
        })
    }
}

/// The images behind the first that belong to it.
#[derive(Default)]
struct Others {
    mask: Option<Directory>,
    overviews: Vec<Reduced>,
}

impl Others {
    /// Walks the directories behind `image` up to the next image of its own. A damaged one ends the walk, and does not
    /// touch the image itself.
    fn find(file: &File, image: &Directory, assumed: &mut Vec<String>) -> Self {
        let mut others = Self::default();
        let (mut next, mut seen) = (image.next, Vec::new());
        while next != 0 && seen.len() < MAX_IMAGES && !seen.contains(&next) {
            seen.push(next);
            let Ok(directory) = file.directory(next) else {
                break;
            };
            next = directory.next;
            let Ok(kind) = file.scalar(&directory, ifd::NEW_SUBFILE_TYPE, Some(0)) else {
                break;
            };
            match (kind & OVERVIEW != 0, kind & MASK != 0) {
                (false, true) => others.mask = others.mask.or(Some(directory)),
                (true, false) => others.overviews.push(Reduced {
                    image: directory,
                    mask: None,
                }),
                (true, true) => {
                    let size = |of: &Directory| {
                        [ifd::WIDTH, ifd::HEIGHT].map(|tag| file.scalar(of, tag, Some(0)).unwrap_or(0))
                    };
                    let of = others
                        .overviews
                        .iter_mut()
                        .find(|o| size(&o.image) == size(&directory));
                    if let Some(of) = of {
                        of.mask = Some(directory);
                    }
                }
                (false, false) => {
                    assumed.push("It holds several images, of which the first is read.".into());
                    break;
                }
            }
        }
        others
    }
}

/// The name of the type of samples as they are stored.
fn sample_type(layout: &Layout) -> String {
    let name = match layout.kind {
        Kind::U8 | Kind::U16 | Kind::U32 | Kind::U64 => "uint",
        Kind::I8 | Kind::I16 | Kind::I32 | Kind::I64 => "int",
        Kind::F16 | Kind::F32 | Kind::F64 => "float",
    };
    format!("{name}{}", layout.bits)
}

/// The value that means no data, if the file names one that its samples can have.
fn nodata_of(file: &File, image: &Directory, kind: Kind, assumed: &mut Vec<String>) -> Nodata {
    let Some(text) = file.text(image, ifd::GDAL_NODATA) else {
        return Nodata::None;
    };
    let text = text.trim();
    let nodata = Nodata::parse(text, kind.integer());
    if matches!(nodata, Nodata::None) && !text.is_empty() {
        assumed.push(format!(
            "Its no-data value, {text:?}, is no number that its samples can have."
        ));
    }
    nodata
}

/// A unit of heights.
struct Unit {
    name: &'static str,
    metres: f64,
}

fn vertical_unit(located: &place::Located, items: &metadata::Items, assumed: &mut Vec<String>) -> Unit {
    let key = located
        .vertical_unit
        .map(|code| (keys::linear_unit(code), format!("code {code}")));
    let text = items
        .unit
        .as_deref()
        .map(|unit| (metadata::linear_unit(unit), format!("{unit:?}")));
    match text.or(key) {
        Some((Some((name, metres)), _)) => Unit { name, metres },
        Some((None, said)) => {
            assumed.push(format!(
                "The unit of heights is given as {said}, not known here, and taken as metres."
            ));
            Unit {
                name: "unknown",
                metres: 1.0,
            }
        }
        None => {
            assumed.push(HEIGHTS_ASSUMED.into());
            Unit {
                name: "unknown",
                metres: 1.0,
            }
        }
    }
}

#[cfg(test)]
mod tests;
