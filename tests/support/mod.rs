//! What several test programs share: levels from a formula, a seeded generator, an adapter or a word of its absence.
#![allow(clippy::print_stderr, reason = "a skipped test says so")]
#![allow(unreachable_pub, reason = "a module of test programs has no outside")]
#![allow(dead_code, reason = "each test program uses its own part of this")]

use clipscape::Result;
use clipscape::grid::{Grid, Patch, Rect};
use clipscape::levels::{Arrival, Bounds, Levels, LightSample};
use half::f16;

#[cfg(feature = "gpu")]
pub mod depths;
pub mod facts;
pub mod flights;
pub mod motion;
pub mod places;
pub mod scenes;

/// Levels whose every sample is a function of level, column and row; NaN for no data.
pub struct Formula<F> {
    pub grid: Grid,
    pub height: F,
    pub has_light: bool,
}

impl<F: Fn(u32, i64, i64) -> f32 + Send + Sync> Formula<F> {
    pub fn new(grid: Grid, height: F) -> Self {
        Self {
            grid,
            height,
            has_light: true,
        }
    }

    /// A share of light that tells its sample.
    pub fn light_at(level: u32, i: i64, j: i64) -> LightSample {
        let share = |salt: i64| f16::from_f32(hash(level, i + salt, j) as f32);
        LightSample {
            sun: share(0),
            sky: share(1 << 40),
        }
    }
}

impl<F: Fn(u32, i64, i64) -> f32 + Send + Sync> Levels for Formula<F> {
    fn grid(&self) -> &Grid {
        &self.grid
    }

    fn heights(&self, level: u32, rect: Rect, out: &mut [f32]) -> Result<Arrival> {
        assert!(
            self.grid.level(level).rect().contains_rect(rect),
            "{rect:?} of level {level}"
        );
        assert_eq!(out.len(), rect.area() as usize);
        for ((i, j), out) in rect.cells().zip(out) {
            *out = (self.height)(level, i, j);
        }
        Ok(Arrival::Arrived)
    }

    fn bounds(&self, level: u32, patches: Rect, out: &mut [Bounds]) -> Result<Arrival> {
        assert!(
            self.grid.patches(level).rect().contains_rect(patches),
            "{patches:?} of level {level}"
        );
        for ((a, b), out) in patches.cells().zip(out) {
            let samples = Patch::new(level, a, b).samples_within(self.grid.level(level));
            let heights = samples.cells().map(|(i, j)| (self.height)(level, i, j));
            let (min, max) = heights.fold((f32::NAN, f32::NAN), |(lo, hi), h| (lo.min(h), hi.max(h)));
            *out = Bounds {
                min,
                max,
                error: 0.0,
                need_min: -1e5,
                need_max: 1e5,
                need_error: 0.0,
            };
            if min.is_nan() {
                *out = Bounds::VOID;
            }
        }
        Ok(Arrival::Arrived)
    }

    fn has_light(&self) -> bool {
        self.has_light
    }

    fn light(&self, level: u32, rect: Rect, out: &mut [LightSample]) -> Result<Arrival> {
        assert!(
            self.grid.level(level).rect().contains_rect(rect),
            "{rect:?} of level {level}"
        );
        for ((i, j), out) in rect.cells().zip(out) {
            *out = Self::light_at(level, i, j);
        }
        Ok(Arrival::Arrived)
    }
}

/// A number in 0 to 1 that depends on all of its arguments.
pub fn hash(level: u32, i: i64, j: i64) -> f64 {
    let mut x =
        (i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ (j as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f);
    x = (x ^ u64::from(level) << 56 ^ x >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ x >> 32).wrapping_mul(0x94d0_49bb_1331_11eb);
    (x >> 11) as f64 / (1u64 << 53) as f64
}

/// Hills of many sizes, the same ground on every level.
pub fn hills(level: u32, i: i64, j: i64) -> f32 {
    let (x, z) = ((i << level) as f64, (j << level) as f64);
    let wave = |length: f64, x: f64, z: f64| length * ((x / length).sin() + (z / length * 1.3).cos());
    (wave(160.0, x, z) + wave(31.0, z, x) + wave(7.0, x + z, x - z) + 0.5 * wave(2.1, x, z)) as f32
}

/// A seeded generator (splitmix64).
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ x >> 31
    }

    /// Uniform in `low` to `high`.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[(self.bits() % from.len() as u64) as usize]
    }
}

/// The seed of a random test: `CLIPSCAPE_SEED`, or the default.
pub fn seed(default: u64) -> u64 {
    std::env::var("CLIPSCAPE_SEED")
        .ok()
        .and_then(|s| s.parse().ok())
        .unwrap_or(default)
}

/// A device, or none where there is no adapter; then the test says so, and fails if one is required.
#[cfg(feature = "gpu")]
pub fn gpu() -> Option<clipscape::gpu::Gpu> {
    match clipscape::gpu::open() {
        Ok(gpu) => Some(gpu),
        Err(error) => {
            let required = std::env::var_os("CLIPSCAPE_REQUIRE_GPU").is_some_and(|v| v == "1");
            assert!(!required, "CLIPSCAPE_REQUIRE_GPU is set, but {error}");
            eprintln!("skipped: {error}");
            None
        }
    }
}
