//! How far the tiles of a mosaic agree where they overlap.

use super::Mosaic;
use crate::error::{Error, Result};
use crate::grid::Rect;
use crate::progress::Progress;

/// Samples that are compared at once.
const BAND_SAMPLES: i64 = 1 << 18;

/// Samples where several tiles have heights, and those of them where the heights differ.
#[derive(Debug, Default)]
pub(super) struct Seams {
    pub(super) shared: u64,
    pub(super) differing: u64,
    pub(super) most_m: f32,
}

impl Seams {
    /// What is said of it, if anything differs.
    pub(super) fn sentence(&self) -> Option<String> {
        let Self {
            shared,
            differing,
            most_m,
        } = self;
        (*differing > 0).then(|| {
            format!(
                "Of {shared} samples that several tiles hold, {differing} differ, by up to {most_m} m; the later tile's \
                 are taken."
            )
        })
    }
}

impl Mosaic {
    /// Compares tile `k` with the earlier ones wherever it is the last: each sample is so looked at once.
    pub(super) fn compare(&self, k: usize, seams: &mut Seams, progress: &dyn Progress) -> Result<()> {
        let own = self.tiles[k].rect;
        let mut pieces: Vec<Rect> = Vec::new();
        for earlier in self.tiles[..k].iter().rev() {
            let mut new = vec![own.intersection(earlier.rect)];
            let later = self.tiles[k + 1..].iter().map(|t| t.rect);
            for taken in pieces.iter().copied().chain(later) {
                new = new.into_iter().flat_map(|r| r.difference(taken)).collect();
            }
            pieces.extend(new.into_iter().filter(|r| !r.is_empty()));
        }
        for piece in pieces {
            let rows = (BAND_SAMPLES / piece.width()).max(1);
            for z in (piece.z0..piece.z1).step_by(rows as usize) {
                if progress.cancelled() {
                    return Err(Error::cancelled(&self.description.name));
                }
                let band = Rect::new(piece.x0, z, piece.x1, (z + rows).min(piece.z1));
                self.compare_band(k, band, seams)?;
            }
        }
        Ok(())
    }

    fn compare_band(&self, k: usize, band: Rect, seams: &mut Seams) -> Result<()> {
        let mut low = vec![f32::INFINITY; band.area() as usize];
        let mut high = vec![f32::NEG_INFINITY; band.area() as usize];
        let mut holders = vec![0u32; band.area() as usize];
        let mut part = Vec::new();
        for other in 0..=k {
            let cut = self.tiles[other].rect.intersection(band);
            if cut.is_empty() {
                continue;
            }
            self.read_tile(other, cut, &mut part)?;
            for ((x, z), h) in cut.cells().zip(&part) {
                if !h.is_nan() {
                    let at = ((z - band.z0) * band.width() + x - band.x0) as usize;
                    low[at] = low[at].min(*h);
                    high[at] = high[at].max(*h);
                    holders[at] += 1;
                }
            }
        }
        for ((low, high), holders) in low.into_iter().zip(high).zip(holders) {
            if holders > 1 {
                seams.shared += 1;
                if low < high {
                    seams.differing += 1;
                    seams.most_m = seams.most_m.max(high - low);
                }
            }
        }
        Ok(())
    }
}
