//! A DEM held whole in memory: how its values become f32 heights, and the limits checked before it is read.

use super::{Description, HeightSource};
use crate::error::{Error, ErrorKind, Result};
use crate::grid::{Grid, MAX_SIZE, Rect, Size};

/// No lossless coder in use packs more than this many bytes of samples into one byte of a file (deflate,
/// the densest, ends at 1032).
pub(super) const MAX_COMPRESSION: u64 = 1040;

/// A DEM whose heights are all in memory.
#[derive(Debug)]
pub(super) struct Held {
    description: Description,
    heights: Vec<f32>,
}

impl Held {
    /// A DEM of `heights`, row by row. `description.grid` must be of their number.
    ///
    /// # Errors
    /// [`ErrorKind::Broken`] where the grid is one that this crate cannot hold.
    pub(super) fn new(description: Description, heights: Vec<f32>) -> Result<Self> {
        let Description { grid, name, .. } = &description;
        grid.check()
            .map_err(|what| Error::new(ErrorKind::Broken, name, what))?;
        debug_assert_eq!(grid.size.samples(), heights.len() as i64);
        Ok(Self { description, heights })
    }
}

impl HeightSource for Held {
    fn description(&self) -> &Description {
        &self.description
    }

    fn held_bytes(&self) -> u64 {
        size_of_val(&self.heights[..]) as u64
    }

    fn read(&self, rect: Rect, out: &mut [f32]) -> Result<()> {
        self.description.check_rect(rect, out)?;
        if rect.is_empty() {
            return Ok(());
        }
        let size = self.description.grid.size;
        for (z, row) in (rect.z0..rect.z1).zip(out.chunks_exact_mut(rect.width() as usize)) {
            let start = (z * size.width + rect.x0) as usize;
            row.copy_from_slice(&self.heights[start..start + row.len()]);
        }
        Ok(())
    }
}

/// Checks a size that a file claims against the grid's limits and the file's length, before anything is
/// allocated for it. Returns the number of samples.
///
/// # Errors
/// [`ErrorKind::Broken`] for an impossible size, [`ErrorKind::Limit`] for one that a file of `file_bytes`
/// cannot hold.
pub(super) fn check_claim(
    name: &str,
    width: u64,
    height: u64,
    sample_bytes: u64,
    file_bytes: u64,
) -> Result<usize> {
    let max = MAX_SIZE as u64;
    if width == 0 || height == 0 {
        let what = format!("claims a size of {width} x {height} samples, which holds no data");
        return Err(Error::new(ErrorKind::Broken, name, what));
    }
    if width > max || height > max {
        let what = format!("claims a size of {width} x {height} samples, above {max} a side");
        return Err(Error::new(ErrorKind::Limit, name, what));
    }
    let claimed = u128::from(width) * u128::from(height) * u128::from(sample_bytes);
    if claimed > u128::from(file_bytes) * u128::from(MAX_COMPRESSION) {
        let what = format!(
            "claims {width} x {height} samples ({claimed} bytes), more than {MAX_COMPRESSION} times its length \
             of {file_bytes} bytes"
        );
        return Err(Error::new(ErrorKind::Limit, name, what).advice("check that the file is whole"));
    }
    usize::try_from(width * height).map_err(|_| {
        Error::new(
            ErrorKind::Limit,
            name,
            "is too large for this machine's addresses",
        )
    })
}

/// The size as the grid wants it, after [`check_claim`].
pub(super) fn size(width: u64, height: u64) -> Size {
    Size {
        width: width as i64,
        height: height as i64,
    }
}

/// The values of a file while they are read: kept as f32 while every one of them is exact in f32, as f64 from
/// the first that is not.
#[derive(Debug)]
pub(super) struct Values {
    exact: Vec<f32>,
    wide: Vec<f64>,
    infinite: u64,
}

/// How a file's values become metres: `value * scale + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    pub(super) scale: f64,
    pub(super) offset: f64,
}

impl Scale {
    /// Values that are metres already.
    pub(super) const METRES: Self = Self {
        scale: 1.0,
        offset: 0.0,
    };
}

/// Heights ready for a grid.
#[derive(Debug)]
pub(super) struct Heights {
    /// Metres less `base_m`, NaN for no data.
    pub(super) heights: Vec<f32>,
    /// 0, or the first valid sample where the values need more bits than f32 has.
    pub(super) base_m: f64,
    /// How many values were infinite, or beyond f32, and became no data.
    pub(super) infinite: u64,
}

impl Values {
    /// `count` values, all void.
    ///
    /// # Errors
    /// [`ErrorKind::Limit`] where the memory is not there.
    pub(super) fn new(name: &str, count: usize) -> Result<Self> {
        let exact = filled(name, count, f32::NAN)?;
        Ok(Self {
            exact,
            wide: Vec::new(),
            infinite: 0,
        })
    }

    /// Sets value `index`; NaN is void, and so is an infinite value, which is counted.
    ///
    /// # Errors
    /// [`ErrorKind::Limit`] where the memory is not there.
    pub(super) fn set(&mut self, name: &str, index: usize, value: f64) -> Result<()> {
        let mut value = value;
        if value.is_infinite() {
            self.infinite += 1;
            value = f64::NAN;
        }
        if self.wide.is_empty() {
            let narrow = value as f32;
            if value.is_nan() || f64::from(narrow) == value {
                self.exact[index] = narrow;
                return Ok(());
            }
            self.wide = filled(name, self.exact.len(), f64::NAN)?;
            for (wide, exact) in self.wide.iter_mut().zip(&self.exact) {
                *wide = f64::from(*exact);
            }
            self.exact = Vec::new();
        }
        self.wide[index] = value;
        Ok(())
    }

    /// The heights in metres, each rounded once to f32.
    ///
    /// # Errors
    /// [`ErrorKind::Limit`] where the memory is not there.
    pub(super) fn finish(self, name: &str, scale: Scale) -> Result<Heights> {
        let metres = |value: f64| value * scale.scale + scale.offset;
        let mut infinite = self.infinite;
        let (mut heights, base_m) = if self.wide.is_empty() {
            let mut heights = self.exact;
            if scale != Scale::METRES {
                heights.iter_mut().for_each(|h| *h = metres(f64::from(*h)) as f32);
            }
            (heights, 0.0)
        } else {
            let base_m = self
                .wide
                .iter()
                .copied()
                .find(|v| !v.is_nan())
                .map_or(0.0, metres);
            let mut heights = filled(name, self.wide.len(), f32::NAN)?;
            for (height, value) in heights.iter_mut().zip(&self.wide) {
                *height = (metres(*value) - base_m) as f32;
            }
            (heights, base_m)
        };
        for height in heights.iter_mut().filter(|h| h.is_infinite()) {
            *height = f32::NAN;
            infinite += 1;
        }
        Ok(Heights {
            heights,
            base_m,
            infinite,
        })
    }
}

impl Heights {
    /// What `assumed` says of infinite heights, if there were any.
    pub(super) fn infinite_sentence(&self) -> Option<String> {
        infinite_sentence(self.infinite)
    }
}

/// What is said of `count` infinite heights, if there are any.
pub(super) fn infinite_sentence(count: u64) -> Option<String> {
    match count {
        0 => None,
        1 => Some("One height is infinite or beyond f32; it is taken as no data.".into()),
        n => Some(format!(
            "{n} heights are infinite or beyond f32; they are taken as no data."
        )),
    }
}

/// The description of a file that says nothing of its place: spacing 1 m, heights in metres, both assumed.
pub(super) fn bare_description(name: &str, format: &str, sample_type: &str, size: Size) -> Description {
    Description {
        grid: Grid::new(size.width, size.height, [1.0, 1.0]),
        format: format.into(),
        sample_type: sample_type.into(),
        step_m: None,
        place: None,
        vertical_unit: "unknown".into(),
        assumed: vec![
            "The file does not say where it lies: the spacing is taken as 1 m.".into(),
            HEIGHTS_ASSUMED.into(),
        ],
        name: name.into(),
    }
}

/// What `assumed` says where a file names no unit of heights.
pub(super) const HEIGHTS_ASSUMED: &str = "The unit of heights is unknown and taken as metres.";

/// Turns the order of rows about: the last of `width` values becomes the first.
#[cfg(feature = "dem")]
pub(super) fn flip<T>(values: &mut [T], width: usize) {
    let rows = values.len() / width.max(1);
    for z in 0..rows / 2 {
        let (north, south) = values.split_at_mut((rows - 1 - z) * width);
        north[z * width..(z + 1) * width].swap_with_slice(&mut south[..width]);
    }
}

/// A vector of `count` values, or a clear error where there is no memory for it.
pub(super) fn filled<T: Clone>(name: &str, count: usize, value: T) -> Result<Vec<T>> {
    let mut out = Vec::new();
    out.try_reserve_exact(count).map_err(|error| {
        let what = format!("needs memory for {count} samples, which is not there");
        Error::new(ErrorKind::Limit, name, what).because(error)
    })?;
    out.resize(count, value);
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(all: &[f64]) -> Values {
        let mut values = Values::new("t", all.len()).unwrap();
        for (i, v) in all.iter().enumerate() {
            values.set("t", i, *v).unwrap();
        }
        values
    }

    #[test]
    fn the_base_is_0_while_f32_holds_every_value_and_else_the_first_valid_one() {
        let exact = values(&[f64::NAN, 16_777_216.0, -9e6, 0.5])
            .finish("t", Scale::METRES)
            .unwrap();
        assert_eq!((exact.base_m, exact.heights[1]), (0.0, 16_777_216.0));
        assert!(exact.heights[0].is_nan());
        let wide = values(&[f64::NAN, 1e7 + 0.25, 1e7 + 0.125, 3.0])
            .finish("t", Scale::METRES)
            .unwrap();
        assert_eq!(wide.base_m, 1e7 + 0.25);
        assert_eq!(wide.heights[1..3], [0.0, -0.125]);
        // A scale never makes a base: 0.1 of an integer is not exact in f32, but its source is.
        let tenths = values(&[123.0, 124.0])
            .finish(
                "t",
                Scale {
                    scale: 0.1,
                    offset: 1.0,
                },
            )
            .unwrap();
        assert_eq!((tenths.base_m, tenths.heights), (0.0, vec![13.3, 13.4]));
    }

    #[test]
    fn infinities_are_void_and_counted() {
        let h = values(&[f64::INFINITY, 1.0, f64::NEG_INFINITY])
            .finish("t", Scale::METRES)
            .unwrap();
        assert_eq!(h.infinite, 2);
        assert!(h.heights[0].is_nan() && h.heights[2].is_nan() && h.heights[1] == 1.0);
        assert!(h.infinite_sentence().unwrap().starts_with("2 heights"));
        let beyond = values(&[1.0, 1e300]).finish("t", Scale::METRES).unwrap();
        assert_eq!(beyond.infinite, 1);
        assert!(
            values(&[1.0])
                .finish("t", Scale::METRES)
                .unwrap()
                .infinite_sentence()
                .is_none()
        );
    }

    #[cfg(feature = "dem")]
    #[test]
    fn rows_are_flipped_for_odd_and_even_counts() {
        for rows in 1..5 {
            let mut v: Vec<usize> = (0..rows * 3).collect();
            flip(&mut v, 3);
            let want: Vec<usize> = (0..rows).rev().flat_map(|z| z * 3..z * 3 + 3).collect();
            assert_eq!(v, want);
        }
    }

    #[test]
    fn claims_are_checked_before_memory_is_taken() {
        assert_eq!(check_claim("t", 10, 10, 2, 200).unwrap(), 100);
        assert_eq!(
            check_claim("t", 0, 10, 2, 200).unwrap_err().kind(),
            ErrorKind::Broken
        );
        assert_eq!(
            check_claim("t", 1 << 31, 1, 2, 1 << 40).unwrap_err().kind(),
            ErrorKind::Limit
        );
        assert_eq!(
            check_claim("t", 1040, 100, 2, 199).unwrap_err().kind(),
            ErrorKind::Limit
        );
        assert_eq!(check_claim("t", 1040, 100, 2, 200).unwrap(), 104_000);
    }

    #[test]
    fn a_rectangle_is_read_and_one_outside_is_refused() {
        let mut description = bare_description("t", "PNG", "uint8", Size { width: 3, height: 2 });
        let held = Held::new(description.clone(), vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0]).unwrap();
        let mut out = [0.0; 4];
        held.read(Rect::new(1, 0, 3, 2), &mut out).unwrap();
        assert_eq!(out, [1.0, 2.0, 4.0, 5.0]);
        held.read(Rect::EMPTY, &mut []).unwrap();
        assert_eq!(
            held.read(Rect::new(2, 0, 4, 2), &mut out).unwrap_err().kind(),
            ErrorKind::Misuse
        );
        assert_eq!(
            held.read(Rect::new(0, 0, 1, 1), &mut out).unwrap_err().kind(),
            ErrorKind::Misuse
        );
        description.grid.spacing_m = [0.0, 1.0];
        assert_eq!(
            Held::new(description, vec![0.0; 6]).unwrap_err().kind(),
            ErrorKind::Broken
        );
    }
}
