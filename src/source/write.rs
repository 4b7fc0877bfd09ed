//! Writes a DEM as a GeoTIFF of floats, strip by strip.

use std::io::{Seek, Write};

use tiff::TiffError;
use tiff::encoder::colortype::{ColorType, Gray32Float, Gray64Float};
use tiff::encoder::{TiffEncoder, TiffKind, TiffKindBig, TiffKindStandard, TiffValue};
use tiff::tags::Tag;

use super::held::filled;
use super::{Description, Georeference, HeightSource, Registration};
use crate::error::{Error, ErrorKind, Result};
use crate::grid::Rect;
use crate::progress::Progress;

/// A strip holds as many rows as fit, at least one.
const STRIP_BYTES: i64 = 1 << 20;
/// Beyond this a classic TIFF, whose offsets have 32 bits, could overflow.
const CLASSIC_BYTES: i64 = 4_000_000_000;

/// Writes all heights of `source` to `out`: uncompressed strips, no data as NaN (`GDAL_NODATA` says so), pixel
/// scale and tie point in the source's reference system or, where it has none, in metres from sample (0, 0);
/// registration as the source's, else point. Heights are float32, or float64 where the source has a base.
/// BigTIFF from 4 GB on.
///
/// # Errors
/// What `source` fails with; [`ErrorKind::Io`] where `out` fails (its subject is `output`: call
/// [`Error::about`] with the path); [`ErrorKind::Cancelled`].
pub fn write_tiff(out: impl Write + Seek, source: &dyn HeightSource, progress: &dyn Progress) -> Result<()> {
    let grid = source.description().grid;
    let base_m = grid.base_m;
    let bytes = grid
        .size
        .samples()
        .saturating_mul(if base_m == 0.0 { 4 } else { 8 });
    match (base_m == 0.0, bytes < CLASSIC_BYTES) {
        (true, false) => write::<_, Gray32Float, TiffKindBig>(out, source, progress, |h| h),
        (true, true) => write::<_, Gray32Float, TiffKindStandard>(out, source, progress, |h| h),
        (false, false) => {
            write::<_, Gray64Float, TiffKindBig>(out, source, progress, |h| f64::from(h) + base_m)
        }
        (false, true) => {
            write::<_, Gray64Float, TiffKindStandard>(out, source, progress, |h| f64::from(h) + base_m)
        }
    }
}

fn write<W: Write + Seek, C: ColorType, K: TiffKind>(
    out: W,
    source: &dyn HeightSource,
    progress: &dyn Progress,
    sample: impl Fn(f32) -> C::Inner,
) -> Result<()>
where
    C::Inner: Copy,
    [C::Inner]: TiffValue,
{
    let description = source.description();
    let size = description.grid.size;
    let side = |n: i64| u32::try_from(n).expect("a grid's sides are at most 2^30");
    let mut encoder = TiffEncoder::<W, K>::new_generic(out).map_err(failed)?;
    let mut image = encoder
        .new_image::<C>(side(size.width), side(size.height))
        .map_err(failed)?;
    let rows = (STRIP_BYTES / (size.width * i64::from(C::BITS_PER_SAMPLE[0]) / 8)).clamp(1, size.height);
    image.rows_per_strip(side(rows)).map_err(failed)?;

    let georeference = Tags::of(description);
    let tags = image.encoder();
    tags.write_tag(Tag::ModelPixelScaleTag, &georeference.scale[..])
        .map_err(failed)?;
    tags.write_tag(Tag::ModelTiepointTag, &georeference.tie[..])
        .map_err(failed)?;
    tags.write_tag(Tag::GeoKeyDirectoryTag, &georeference.keys[..])
        .map_err(failed)?;
    if let Some(citation) = &georeference.citation {
        tags.write_tag(Tag::GeoAsciiParamsTag, citation.as_str())
            .map_err(failed)?;
    }
    tags.write_tag(Tag::GdalNodata, "nan").map_err(failed)?;

    progress.begin("write", size.height as u64);
    let mut heights = filled(&description.name, (rows * size.width) as usize, 0.0f32)?;
    let mut strip: Vec<C::Inner> = Vec::new();
    let mut z = 0;
    while z < size.height {
        if progress.cancelled() {
            return Err(Error::cancelled(&description.name));
        }
        let rect = Rect::new(0, z, size.width, (z + rows).min(size.height));
        let heights = &mut heights[..rect.area() as usize];
        source.read(rect, heights)?;
        strip.clear();
        strip.extend(heights.iter().map(|h| sample(*h)));
        image.write_strip(&strip).map_err(failed)?;
        progress.advance(rect.height() as u64);
        z = rect.z1;
    }
    image.finish().map_err(failed)
}

/// The tags that place an image.
struct Tags {
    scale: [f64; 3],
    tie: [f64; 6],
    keys: Vec<u16>,
    citation: Option<String>,
}

impl Tags {
    fn of(description: &Description) -> Self {
        let place = description.place.as_ref();
        let (origin, pixel) = match place {
            Some(place) => (place.origin, place.pixel),
            None => (
                [0.0; 2],
                [description.grid.spacing_m[0], -description.grid.spacing_m[1]],
            ),
        };
        let area = place.is_some_and(|p| p.registration == Registration::Area);
        let geographic = place.is_some_and(|p| p.geographic);
        // The tie point names the first sample; where pixels are areas, that is the middle of the first pixel.
        let at = if area { 0.5 } else { 0.0 };
        let crs = place.and_then(|p| p.crs.clone());
        let [code, vertical] = place.map_or([None; 2], Georeference::epsg);

        // Key, tag that holds it (0: the value itself), count, value; in rising order of keys.
        let mut keys = vec![
            [1024, 0, 1, if geographic { 2 } else { 1 }],
            [1025, 0, 1, if area { 1 } else { 2 }],
        ];
        let citation = match code {
            Some(_) => None,
            None => {
                let text = crs.unwrap_or_else(|| "unknown".into());
                let plain: String = text
                    .chars()
                    .filter(|c| c.is_ascii() && !c.is_ascii_control() && *c != '|')
                    .collect();
                Some(plain.chars().take(1000).collect::<String>() + "|")
            }
        };
        if let Some(text) = &citation {
            keys.push([1026, 34737, text.len() as u16, 0]);
        }
        match (geographic, code) {
            (true, code) => keys.extend([[2048, 0, 1, code.unwrap_or(32767)], [2054, 0, 1, 9102]]),
            (false, Some(code)) => keys.push([3072, 0, 1, code]),
            (false, None) => keys.push([3072, 0, 1, 32767]),
        }
        // A reference system with a code brings its own unit; else what the spacing says of the file's unit.
        if !geographic {
            let metres = description.grid.spacing_m[0] / pixel[0];
            let unit = [(9001, 1.0), (9002, 0.3048), (9003, 1200.0 / 3937.0)]
                .into_iter()
                .find(|(_, length_m): &(u16, f64)| (metres / length_m - 1.0).abs() < 1e-9);
            keys.extend(unit.map(|(unit, _)| [3076, 0, 1, unit]));
        }
        // Heights are metres by now, whatever they were read as; a system of heights in another unit is left out.
        keys.extend(
            vertical
                .filter(|_| description.vertical_unit == "metre")
                .map(|v| [4096, 0, 1, v]),
        );
        if description.vertical_unit != "unknown" {
            keys.push([4099, 0, 1, 9001]);
        }
        let mut directory = vec![[1, 1, 0, keys.len() as u16]];
        directory.extend(keys);
        Self {
            scale: [pixel[0], -pixel[1], 0.0],
            tie: [at, at, 0.0, origin[0], origin[1], 0.0],
            keys: directory.concat(),
            citation,
        }
    }
}

fn failed(error: TiffError) -> Error {
    match error {
        TiffError::IoError(error) => Error::io("output", error),
        other => Error::new(
            ErrorKind::Limit,
            "output",
            format!("cannot be written as a TIFF: {other}"),
        )
        .because(other),
    }
}

#[cfg(test)]
mod tests {
    use super::super::held::{Held, bare_description};
    use super::super::{OpenOptions, Synth, open_bytes};
    use super::*;
    use crate::grid::Size;
    use crate::progress::Silent;
    use std::io::Cursor;
    use std::sync::Arc;

    fn round_trip(source: &dyn HeightSource) -> (Description, Vec<f32>) {
        let mut out = Cursor::new(Vec::new());
        write_tiff(&mut out, source, &Silent).unwrap();
        let back = open_bytes("back.tif", Arc::new(out.into_inner()), &OpenOptions::default()).unwrap();
        (back.description().clone(), all(back.as_ref()))
    }

    fn all(source: &dyn HeightSource) -> Vec<f32> {
        let size = source.description().grid.size;
        let mut out = vec![0.0; size.samples() as usize];
        source.read(size.rect(), &mut out).unwrap();
        out
    }

    fn bits(heights: &[f32]) -> Vec<u32> {
        heights
            .iter()
            .map(|h| {
                if h.is_nan() {
                    f32::NAN.to_bits()
                } else {
                    h.to_bits()
                }
            })
            .collect()
    }

    #[test]
    fn synth_comes_back_with_its_spacing() {
        let synth = Synth::new(700, 2).unwrap(); // several strips, the last one shorter
        let (d, heights) = round_trip(&synth);
        assert_eq!(bits(&heights), bits(&all(&synth)));
        assert_eq!(
            (d.grid, d.vertical_unit.as_str()),
            (synth.description().grid, "metre")
        );
        assert_eq!(d.place.unwrap().origin, [0.0, 0.0]);
    }

    #[test]
    fn places_voids_and_bases_come_back() {
        for (registration, geographic, crs) in [
            (Registration::Area, false, Some("EPSG:32633")),
            (Registration::Area, false, Some("EPSG:32633+5703")),
            (Registration::Point, true, Some("EPSG:4326")),
            (Registration::Point, false, Some("a grid of our own")),
        ] {
            let mut description = bare_description("t", "PNG", "uint8", Size { width: 3, height: 2 });
            let (origin, pixel) = if geographic {
                ([7.25, 46.5], [0.01, -0.02])
            } else {
                description.grid.spacing_m = [25.0, 50.0];
                ([500_012.5, 4_999_975.0], [25.0, -50.0])
            };
            let place = Georeference {
                crs: crs.map(String::from),
                origin,
                pixel,
                registration,
                geographic,
            };
            description.place = Some(place.clone());
            if place.epsg()[1].is_some() {
                description.vertical_unit = "metre".into();
            }
            description.grid.base_m = if geographic { 10_000_000.125 } else { 0.0 };
            let heights = vec![0.0, f32::NAN, -3.5, 4.0, 5.25, 1e4];
            let (d, back) = round_trip(&Held::new(description.clone(), heights.clone()).unwrap());
            assert_eq!(d.place, Some(place));
            assert_eq!(d.grid.base_m, description.grid.base_m);
            assert_eq!(bits(&back), bits(&heights));
            if !geographic {
                assert_eq!(d.grid.spacing_m, [25.0, 50.0]);
            }
        }
    }

    #[test]
    fn a_full_disk_and_a_cancel_are_told() {
        struct Full(u64);
        impl Write for Full {
            fn write(&mut self, data: &[u8]) -> std::io::Result<usize> {
                self.0 += data.len() as u64;
                if self.0 > 100_000 {
                    Err(std::io::ErrorKind::StorageFull.into())
                } else {
                    Ok(data.len())
                }
            }
            fn flush(&mut self) -> std::io::Result<()> {
                Ok(())
            }
        }
        impl Seek for Full {
            fn seek(&mut self, _: std::io::SeekFrom) -> std::io::Result<u64> {
                Ok(self.0)
            }
        }
        struct Stop;
        impl Progress for Stop {
            fn cancelled(&self) -> bool {
                true
            }
        }
        let synth = Synth::new(300, 1).unwrap();
        let error = write_tiff(Full(0), &synth, &Silent).unwrap_err();
        assert_eq!(
            (error.kind(), error.subject()),
            (ErrorKind::Io, "output"),
            "{error}"
        );
        let error = write_tiff(Cursor::new(Vec::new()), &synth, &Stop).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Cancelled);
    }
}
