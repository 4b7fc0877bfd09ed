//! A small seeded generator for tests (`SplitMix64`, Steele, Lea and Flood 2014).

/// The generator's state.
pub(crate) struct Random(u64);

impl Random {
    /// The generator of `seed`.
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// The next 64 bits.
    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in 0 to 1, 1 excluded.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in `low` to `high`.
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Uniform in 0 to `count - 1`.
    pub(crate) fn below(&mut self, count: i64) -> i64 {
        (self.bits() % count as u64) as i64
    }

    /// `count` heights uniform in `low` to `high`, each void with probability `voids`.
    pub(crate) fn heights(&mut self, count: i64, low: f64, high: f64, voids: f64) -> Vec<f32> {
        let one = |r: &mut Self| {
            let h = r.between(low, high) as f32;
            if r.unit() < voids { f32::NAN } else { h }
        };
        (0..count).map(|_| one(self)).collect()
    }
}
