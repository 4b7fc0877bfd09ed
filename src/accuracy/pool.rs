//! The errors of many frames as one: exact maxima and root mean square, the 99th percentile from a histogram.
//!
//! *The histogram* counts errors in pixels by powers of two, each cut into 128 equal parts: the top bits of an f32. It
//! holds 32,640 counts (255 KiB), whatever the number of frames. A percentile is read as the upper end of its part,
//! so it is never below the true one, and above it by less than [`RESOLUTION`] of it; an error of 0 is itself.

use super::{ErrorSummary, FrameErrors};

/// By what share of itself a pooled percentile may be too large.
pub const RESOLUTION: f64 = 1.0 / (1 << PART_BITS) as f64;

/// Bits of an f32's mantissa that tell the parts of a power of two.
const PART_BITS: u32 = 7;

/// Bits of an f32 that do not count.
const DROPPED: u32 = 23 - PART_BITS;

/// Counts: one for 0, one for each part of all f32 that are finite.
const COUNTS: usize = (f32::INFINITY.to_bits() >> DROPPED) as usize + 1;

/// The errors of the frames of a flight, pooled.
#[derive(Clone, Debug)]
pub struct ErrorPool {
    counts: Vec<u64>,
    summary: ErrorSummary,
    squares: f64,
    worst_frame: Option<u64>,
    frames: u64,
}

impl Default for ErrorPool {
    fn default() -> Self {
        Self {
            counts: vec![0; COUNTS],
            summary: ErrorSummary::default(),
            squares: 0.0,
            worst_frame: None,
            frames: 0,
        }
    }
}

impl ErrorPool {
    /// Adds the frame of a number.
    pub fn add(&mut self, frame: u64, errors: &FrameErrors) {
        let (all, new) = (&mut self.summary, &errors.summary);
        if self.worst_frame.is_none() || new.error_px_max > all.error_px_max {
            self.worst_frame = Some(frame);
        }
        all.error_px_max = all.error_px_max.max(new.error_px_max);
        all.error_m_max = all.error_m_max.max(new.error_m_max);
        all.error_floor_px = all.error_floor_px.max(new.error_floor_px);
        all.terrain_px += new.terrain_px;
        all.silhouette_px += new.silhouette_px;
        all.beside_px += new.beside_px;
        self.squares += new.error_px_rms * new.error_px_rms * new.terrain_px as f64;
        self.frames += 1;
        for error in errors.pixels.iter().map(|p| p.error_px).filter(|e| !e.is_nan()) {
            self.counts[part(error)] += 1;
        }
    }

    /// The frame whose greatest error is the greatest, the first of several; none without a frame.
    pub fn worst_frame(&self) -> Option<u64> {
        self.worst_frame
    }

    /// The number of frames.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// What all pixels of all frames come to.
    pub fn summary(&self) -> ErrorSummary {
        let mut summary = self.summary;
        if summary.terrain_px > 0 {
            summary.error_px_rms = (self.squares / summary.terrain_px as f64).sqrt();
            summary.error_px_p99 = self.percentile(99).min(summary.error_px_max);
        }
        summary
    }

    /// By nearest rank, as `stats::percentile`.
    fn percentile(&self, percent: u64) -> f64 {
        let rank = (percent * self.summary.terrain_px).div_ceil(100).max(1);
        let mut seen = 0;
        let found = self.counts.iter().position(|count| {
            seen += count;
            seen >= rank
        });
        let upper_end = |part: usize| f32::from_bits((part as u32) << DROPPED);
        f64::from(upper_end(found.unwrap_or(0)))
    }
}

/// Which count is that of an error: 0 for 0, else the part that ends at or after it.
fn part(error_px: f32) -> usize {
    (error_px.to_bits().div_ceil(1 << DROPPED) as usize).min(COUNTS - 1)
}

#[cfg(test)]
mod tests {
    use super::super::PixelError;
    use super::*;
    use crate::pyramid::random::Random;
    use crate::stats::percentile;

    fn frame(errors: &[f32]) -> FrameErrors {
        let pixel = |&error_px: &f32| PixelError {
            error_px,
            floor_px: error_px / 2.0,
            error_m: error_px * 3.0,
            silhouette: error_px.is_nan(),
            beside: error_px > 1.0,
        };
        let pixels: Vec<_> = errors.iter().map(pixel).collect();
        let summary = ErrorSummary::of(&pixels);
        FrameErrors { pixels, summary }
    }

    #[test]
    fn a_pool_is_its_pixels_taken_together() {
        let mut random = Random::new(3);
        let mut pool = ErrorPool::default();
        let mut all = Vec::new();
        for k in 0..40 {
            let count = random.between(0.0, 300.0) as usize;
            let errors: Vec<f32> = (0..count)
                .map(|_| match random.between(0.0, 10.0) as u32 {
                    0 => f32::NAN,
                    1..=3 => 0.0,
                    _ => random.between(-30.0, 3.0).exp2() as f32,
                })
                .collect();
            pool.add(k, &frame(&errors));
            all.extend(errors);
            let whole = frame(&all).summary;
            let pooled = pool.summary();
            assert_eq!(pooled.error_px_max, whole.error_px_max);
            assert_eq!(
                (pooled.terrain_px, pooled.silhouette_px, pooled.beside_px),
                (whole.terrain_px, whole.silhouette_px, whole.beside_px)
            );
            assert_eq!(
                (pooled.error_m_max, pooled.error_floor_px),
                (whole.error_m_max, whole.error_floor_px)
            );
            assert!((pooled.error_px_rms - whole.error_px_rms).abs() <= 1e-12 * whole.error_px_rms);
            let p99 = whole.error_px_p99;
            assert!(
                (p99..=p99 * (1.0 + RESOLUTION)).contains(&pooled.error_px_p99),
                "frame {k}: {} for {p99}",
                pooled.error_px_p99
            );
        }
        assert_eq!(pool.frames(), 40);
    }

    #[test]
    fn a_percentile_is_that_of_the_reports() {
        let errors: Vec<f32> = (0..257).map(|k| (k * 7919 % 257) as f32).collect();
        let mut sorted: Vec<f64> = errors.iter().map(|&e| f64::from(e)).collect();
        sorted.sort_by(f64::total_cmp);
        assert_eq!(frame(&errors).summary.error_px_p99, percentile(&sorted, 99.0));
    }

    #[test]
    fn the_worst_frame_is_the_first_of_the_greatest_error() {
        let mut pool = ErrorPool::default();
        assert_eq!(
            (pool.worst_frame(), pool.summary()),
            (None, ErrorSummary::default())
        );
        for (k, error) in [(7, 0.0), (8, 2.5), (9, 2.5), (10, 1.0)] {
            pool.add(k, &frame(&[error, 0.0]));
        }
        assert_eq!(pool.worst_frame(), Some(8));
        pool.add(11, &frame(&[f32::MAX]));
        assert_eq!(
            (pool.worst_frame(), pool.summary().error_px_max),
            (Some(11), f64::MAX)
        );
    }

    #[test]
    fn nothing_is_counted_as_less_than_it_is() {
        for error in [
            0.0,
            f32::MIN_POSITIVE,
            1e-40,
            0.3,
            1.0,
            1.0 + f32::EPSILON,
            2e9,
            f32::MAX,
        ] {
            let upper = f32::from_bits((part(error) as u32) << DROPPED);
            assert!(upper >= error, "{error}: {upper}");
            assert!(error == 0.0 || part(error) > 0, "{error}");
        }
        assert_eq!(
            f32::from_bits((part(1.0) as u32) << DROPPED),
            1.0,
            "an end is its own part's"
        );
    }
}
