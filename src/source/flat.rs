//! A DEM whose samples stand in a file as they are, at a place that follows from their column and row: read where they
//! are asked for, nothing held.

use std::sync::Arc;

use super::held::{HEIGHTS_ASSUMED, check_claim};
use super::open::Input;
use super::sample::Coding;
use super::unnamed::Located;
use super::{Description, HeightSource, ReadAt};
use crate::error::{Error, ErrorKind, Result};
use crate::grid::{Grid, Rect, Size};
use crate::progress::{Progress, Silent};

/// Bytes read at once while a whole file is looked through.
const BAND_BYTES: u64 = 1 << 20;

/// Where the samples stand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Layout {
    pub(super) width: u64,
    pub(super) height: u64,
    pub(super) coding: Coding,
    /// The first byte of the first sample.
    pub(super) start: u64,
    /// Bytes from a sample to its eastern neighbour.
    pub(super) pixel_bytes: u64,
    /// Bytes from a row to the next one south.
    pub(super) row_bytes: u64,
}

impl Layout {
    /// Samples one after another without gaps.
    pub(super) fn dense(width: u64, height: u64, coding: Coding) -> Self {
        let pixel_bytes = coding.sample.bytes() as u64;
        Self {
            width,
            height,
            coding,
            start: 0,
            pixel_bytes,
            row_bytes: pixel_bytes.saturating_mul(width),
        }
    }

    /// The size, once it is known to be in the file.
    ///
    /// # Errors
    /// [`ErrorKind::Broken`] where the file `name` of `file_bytes` ends before the last sample.
    pub(super) fn check(&self, name: &str, file_bytes: u64) -> Result<Size> {
        let sample_bytes = self.coding.sample.bytes() as u64;
        check_claim(name, self.width, self.height, sample_bytes, file_bytes)?;
        let needed = u128::from(self.start)
            + u128::from(self.height - 1) * u128::from(self.row_bytes)
            + u128::from(self.width - 1) * u128::from(self.pixel_bytes)
            + u128::from(sample_bytes);
        if needed > u128::from(file_bytes) {
            let what = format!(
                "ends too early: {} x {} samples of {} need {needed} bytes, it has {file_bytes}",
                self.width,
                self.height,
                self.coding.sample.name()
            );
            return Err(Error::new(ErrorKind::Broken, name, what).advice("fetch the file again"));
        }
        Ok(super::held::size(self.width, self.height))
    }
}

/// The samples of a file as a DEM, in metres as they are.
pub(super) struct Flat {
    description: Description,
    bytes: Arc<dyn ReadAt>,
    layout: Layout,
}

impl Flat {
    /// The DEM of a file that leaves the unit of its heights open, of `size` samples.
    ///
    /// # Errors
    /// As [`Flat::new`].
    pub(super) fn located(
        input: &Input,
        format: &str,
        mut located: Located,
        layout: Layout,
        size: Size,
    ) -> Result<Self> {
        located.assumed.push(HEIGHTS_ASSUMED.into());
        let sample = layout.coding.sample;
        let description = Description {
            grid: Grid::new(size.width, size.height, located.spacing_m),
            format: format.into(),
            sample_type: sample.name().into(),
            step_m: sample.integer().then_some(1.0),
            place: located.place,
            vertical_unit: "unknown".into(),
            assumed: located.assumed,
            name: input.name.into(),
        };
        Self::new(description, input.bytes.clone(), layout)
    }

    /// The DEM of `layout`, which has been checked against `bytes`. Where f32 does not hold every value, all are looked
    /// through for the base height.
    ///
    /// # Errors
    /// Those of reading.
    pub(super) fn new(description: Description, bytes: Arc<dyn ReadAt>, layout: Layout) -> Result<Self> {
        let mut flat = Self {
            description,
            bytes,
            layout,
        };
        if !layout.coding.fits_f32() {
            let (mut first, mut exact) = (None, true);
            flat.look_through(&Silent, |_, v| {
                if v.is_finite() {
                    first = first.or(Some(v));
                    exact &= f64::from(v as f32) == v;
                }
            })?;
            if !exact {
                flat.description.grid.base_m = first.unwrap_or(0.0);
            }
        }
        let Description { grid, name, .. } = &flat.description;
        grid.check()
            .map_err(|what| Error::new(ErrorKind::Broken, name, what))?;
        Ok(flat)
    }

    /// Calls `put` with every value, row by row, and its number within its piece.
    fn look_through(&self, progress: &dyn Progress, mut put: impl FnMut(usize, f64)) -> Result<()> {
        let Layout {
            width,
            height,
            pixel_bytes,
            ..
        } = self.layout;
        // Long rows are taken in pieces.
        let columns = (BAND_BYTES / pixel_bytes).clamp(1, width);
        let mut piece = Vec::new();
        for z in 0..height {
            if progress.cancelled() {
                return Err(Error::cancelled(&self.description.name));
            }
            for x in (0..width).step_by(columns as usize) {
                self.fetch(x, z, columns.min(width - x), &mut piece)?;
                self.layout.coding.each(&piece, pixel_bytes as usize, &mut put);
            }
        }
        Ok(())
    }

    /// The bytes of `columns` samples from (x, z) on.
    fn fetch(&self, x: u64, z: u64, columns: u64, out: &mut Vec<u8>) -> Result<()> {
        let l = &self.layout;
        let length = (columns - 1) * l.pixel_bytes + l.coding.sample.bytes() as u64;
        out.resize(length as usize, 0);
        self.bytes
            .read_exact_at(l.start + z * l.row_bytes + x * l.pixel_bytes, out)
            .map_err(|error| Error::io(&self.description.name, error))
    }
}

impl HeightSource for Flat {
    fn description(&self) -> &Description {
        &self.description
    }

    fn read(&self, rect: Rect, out: &mut [f32]) -> Result<()> {
        self.description.check_rect(rect, out)?;
        if rect.is_empty() {
            return Ok(());
        }
        let base_m = self.description.grid.base_m;
        let (coding, stride) = (self.layout.coding, self.layout.pixel_bytes as usize);
        let columns = (BAND_BYTES / self.layout.pixel_bytes).clamp(1, rect.width() as u64) as usize;
        let mut bytes = Vec::new();
        for (z, row) in (rect.z0..rect.z1).zip(out.chunks_exact_mut(rect.width() as usize)) {
            for (part, x) in row.chunks_mut(columns).zip((rect.x0..).step_by(columns)) {
                self.fetch(x as u64, z as u64, part.len() as u64, &mut bytes)?;
                coding.each(&bytes, stride, |i, v| {
                    let height = (v - base_m) as f32;
                    part[i] = if height.is_finite() { height } else { f32::NAN };
                });
            }
        }
        Ok(())
    }

    fn held_bytes(&self) -> u64 {
        self.bytes.held_bytes() + BAND_BYTES
    }

    fn remarks(&self, progress: &dyn Progress) -> Result<Vec<String>> {
        if self.layout.coding.sample.integer() {
            return Ok(Vec::new());
        }
        let mut infinite = 0;
        self.look_through(progress, |_, v| {
            infinite += u64::from(v.is_infinite() || (v as f32).is_infinite());
        })?;
        Ok(super::held::infinite_sentence(infinite).into_iter().collect())
    }
}

#[cfg(test)]
mod tests {
    use super::super::SampleType;
    use super::super::held::bare_description;
    use super::*;

    fn open(layout: Layout, bytes: Vec<u8>) -> Result<Flat> {
        let size = layout.check("t", bytes.len() as u64)?;
        let description = bare_description("t", "test", layout.coding.sample.name(), size);
        Flat::new(description, Arc::new(bytes), layout)
    }

    fn coding(sample: SampleType, big_endian: bool) -> Coding {
        Coding {
            sample,
            big_endian,
            nodata: Some(-9.0),
        }
    }

    #[test]
    fn rectangles_are_read_where_they_stand() {
        // Two interleaved bands of 3 x 2, of which the second is wanted, with two bytes after each row.
        let mut bytes = vec![7u8; 3];
        for z in 0..2i16 {
            for x in 0..3i16 {
                bytes.extend((-1i16).to_be_bytes());
                bytes.extend((if (x, z) == (1, 1) { -9 } else { 10 * z + x }).to_be_bytes());
            }
            bytes.extend([0, 0]);
        }
        let layout = Layout {
            start: 5,
            pixel_bytes: 4,
            row_bytes: 14,
            ..Layout::dense(3, 2, coding(SampleType::I16, true))
        };
        let flat = open(layout, bytes.clone()).unwrap();
        let mut out = [0.0; 4];
        flat.read(Rect::new(1, 0, 3, 2), &mut out).unwrap();
        assert_eq!((out[0], out[1], out[3]), (1.0, 2.0, 12.0));
        assert!(out[2].is_nan());
        // The last two bytes are not needed, the ones before are.
        bytes.truncate(bytes.len() - 2);
        assert!(open(layout, bytes.clone()).is_ok());
        bytes.pop();
        let error = open(layout, bytes).err().unwrap();
        assert_eq!(error.kind(), ErrorKind::Broken);
        assert!(
            error
                .to_string()
                .contains("3 x 2 samples of int16 need 29 bytes, it has 28"),
            "{error}"
        );
    }

    #[test]
    fn wide_values_get_the_first_one_as_their_base_and_infinities_are_remarked() {
        let values = [f64::NAN, 1e7 + 0.25, 1e7 + 0.5, f64::INFINITY, -9.0, 1e300];
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let flat = open(Layout::dense(2, 3, coding(SampleType::F64, false)), bytes).unwrap();
        assert_eq!(flat.description().grid.base_m, 1e7 + 0.25);
        let mut out = [0.0; 6];
        flat.read(Rect::new(0, 0, 2, 3), &mut out).unwrap();
        assert_eq!(out[1..3], [0.0, 0.25]);
        assert!([out[0], out[3], out[4], out[5]].iter().all(|h| h.is_nan()));
        let remarks = flat.remarks(&Silent).unwrap();
        assert!(remarks[0].starts_with("2 heights are infinite"), "{remarks:?}");
        // Small whole numbers need no base, whatever their type.
        let bytes: Vec<u8> = [5i32, -9, 16_777_216]
            .iter()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        let flat = open(Layout::dense(3, 1, coding(SampleType::I32, false)), bytes).unwrap();
        assert_eq!(flat.description().grid.base_m, 0.0);
    }

    #[test]
    fn absurd_sizes_are_refused_before_anything_is_read() {
        let layout = Layout {
            row_bytes: u64::MAX,
            ..Layout::dense(2, 1 << 20, coding(SampleType::U8, false))
        };
        assert_eq!(
            open(layout, vec![0; 1 << 12]).err().unwrap().kind(),
            ErrorKind::Broken
        );
        let layout = Layout::dense(1 << 30, 1 << 30, coding(SampleType::U8, false));
        assert_eq!(
            open(layout, vec![0; 1 << 12]).err().unwrap().kind(),
            ErrorKind::Limit
        );
    }
}
