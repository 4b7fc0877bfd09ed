//! A contact sheet: frames of a flight, small, in one near-square grid, row by row.

use std::path::Path;

use super::shrink::{fitted, shrunk};
use super::{check_frame, still};
use crate::error::Result;

/// The greatest width and height of a frame on the sheet, pixels.
const CELL_PX: u32 = 320;

/// Pixels between frames and around them.
const GAP_PX: u32 = 4;

/// The sheet between the frames, sRGB.
const GROUND: [u8; 3] = [24, 24, 26];

/// A sheet of up to a given number of a flight's frames, filled as they are drawn.
#[derive(Debug)]
pub struct ContactSheet {
    frame: (u32, u32),
    cell: (u32, u32),
    columns: u32,
    /// The frames on the sheet, rising.
    chosen: Vec<u64>,
    /// Width and height of the sheet.
    size: (u32, u32),
    rgb: Vec<u8>,
}

impl ContactSheet {
    /// An empty sheet for a flight of `frame_count` frames of `width` x `height` pixels, all at least 1, of
    /// which at most `most` are shown: the first, the last, and others evenly between.
    pub fn new(frame_count: u64, most: u32, width: u32, height: u32) -> Self {
        let shown = frame_count.min(u64::from(most.max(1)));
        let chosen: Vec<u64> = match shown {
            0 | 1 => vec![0],
            n => (0..n)
                .map(|i| (2 * i * (frame_count - 1) + (n - 1)) / (2 * (n - 1)))
                .collect(),
        };
        let cell = fitted(width, height, CELL_PX, CELL_PX);
        let columns = (1..).find(|c| c * c >= chosen.len()).map_or(1, |c| c as u32);
        let rows = (chosen.len() as u32).div_ceil(columns);
        let size = (
            columns * (cell.0 + GAP_PX) + GAP_PX,
            rows * (cell.1 + GAP_PX) + GAP_PX,
        );
        let rgb = GROUND.repeat(size.0 as usize * size.1 as usize);
        Self {
            frame: (width, height),
            cell,
            columns,
            chosen,
            size,
            rgb,
        }
    }

    /// Whether frame `k` (from 0) is shown.
    pub fn wants(&self, k: u64) -> bool {
        self.chosen.binary_search(&k).is_ok()
    }

    /// Puts frame `k` in its place; one that is not shown is left out.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Misuse`] where the frame has another size.
    pub fn add(&mut self, k: u64, rgba8: &[u8]) -> Result<()> {
        let (width, height) = self.frame;
        check_frame(Path::new("contact sheet"), width, height, rgba8)?;
        let Ok(place) = self.chosen.binary_search(&k) else {
            return Ok(());
        };
        let small = shrunk(rgba8, width, height, self.cell.0, self.cell.1);
        let (column, row) = (place as u32 % self.columns, place as u32 / self.columns);
        let left = (GAP_PX + column * (self.cell.0 + GAP_PX)) as usize * 3;
        let top = (GAP_PX + row * (self.cell.1 + GAP_PX)) as usize;
        let stride = self.size.0 as usize * 3;
        for (y, line) in small.chunks_exact(self.cell.0 as usize * 3).enumerate() {
            self.rgb[(top + y) * stride + left..][..line.len()].copy_from_slice(line);
        }
        Ok(())
    }

    /// Writes the sheet as a PNG, replacing what is there. Frames that never came are left blank.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Io`] where it cannot be written; then the target is as it was.
    pub fn write(&self, path: &Path) -> Result<()> {
        still::write_rgb(
            path,
            self.size.0,
            self.size.1,
            &self.rgb,
            png::Compression::Balanced,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_pictures::{frame, names, read};
    use super::*;

    #[test]
    fn the_frames_shown_are_even_and_include_both_ends() {
        let chosen = |count, most| ContactSheet::new(count, most, 16, 9).chosen;
        assert_eq!(chosen(120, 4), [0, 40, 79, 119]);
        assert_eq!(chosen(3, 25), [0, 1, 2]);
        assert_eq!(chosen(1, 25), [0]);
        assert_eq!(chosen(9, 1), [0]);
        for (count, most) in [(120, 25), (121, 24), (26, 25), (10_000_000, 25)] {
            let chosen = chosen(count, most);
            assert_eq!(
                (chosen.len() as u32, chosen[0], chosen[chosen.len() - 1]),
                (most, 0, count - 1)
            );
            let steps: Vec<u64> = chosen.windows(2).map(|w| w[1] - w[0]).collect();
            let (least, greatest) = (steps.iter().min().unwrap(), steps.iter().max().unwrap());
            assert!(*least > 0 && greatest - least <= 1, "{count} frames: {steps:?}");
        }
    }

    #[test]
    fn frames_stand_row_by_row_whatever_order_they_come_in() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sheet.png");
        let mut sheet = ContactSheet::new(7, 7, 5, 4);
        for k in [3, 0, 6, 1, 5, 4, 2] {
            assert!(sheet.wants(k));
            sheet.add(k, &frame(5, 4, k as u32)).unwrap();
        }
        assert!(!sheet.wants(7));
        sheet.write(&path).unwrap();
        let (width, height, rgb) = read(&path);
        assert_eq!(
            (width, height),
            (3 * 9 + 4, 3 * 8 + 4),
            "a grid of 3 x 3 for 7 frames"
        );
        let pixel = |x: u32, y: u32| &rgb[((y * width + x) * 3) as usize..][..3];
        for k in 0..9 {
            let (left, top) = (4 + k % 3 * 9, 4 + k / 3 * 8);
            let want = if k < 7 {
                frame(5, 4, k)
            } else {
                [24, 24, 26, 0].repeat(20)
            };
            for (p, want) in want.chunks(4).enumerate() {
                let p = p as u32;
                assert_eq!(pixel(left + p % 5, top + p / 5), &want[..3], "frame {k}");
            }
            assert_eq!(pixel(left - 1, top), GROUND);
        }
        assert_eq!(names(folder.path()), ["sheet.png"]);
    }

    #[test]
    fn a_wide_flight_is_shrunk_and_the_same_frames_give_the_same_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str| {
            let mut sheet = ContactSheet::new(120, 25, 1280, 720);
            for k in [0, 119] {
                sheet.add(k, &frame(1280, 720, k as u32)).unwrap();
            }
            sheet.write(&folder.path().join(name)).unwrap();
            std::fs::read(folder.path().join(name)).unwrap()
        };
        assert_eq!(write("a.png"), write("b.png"));
        let (width, height, _) = read(&folder.path().join("a.png"));
        assert_eq!((width, height), (5 * 324 + 4, 5 * 184 + 4));
    }
}
