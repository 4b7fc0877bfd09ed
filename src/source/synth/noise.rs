//! One octave of smooth noise: at each point of a square lattice a random value and a random slope, blended
//! over the cell.
//!
//! In a cell with local coordinates (u, v) in 0 to 1, `n = sum over the corners i of w_i (V a_i + G g_i . d_i)`
//! where a_i and both components of g_i are random in -1 to 1, d_i leads from the corner to the point, and
//! `w_i` is the product of S(u) or 1 - S(u) and S(v) or 1 - S(v) with `S(t) = t^3 (10 - 15 t + 6 t^2)` (K.
//! Perlin, Improving Noise, SIGGRAPH 2002; values besides slopes, so that lattice points do not all lie at
//! height 0). First and second derivatives of S vanish at 0 and 1, so n is twice continuously differentiable
//! everywhere. n and its derivatives at a point are linear in the twelve random numbers of the cell, so each
//! is at most the sum of its coefficients' magnitudes; the constants below are the greatest such sums.
//!
//! Random numbers come from an integer hash, everything else from + - * / and floor, so the bits are the same
//! on every machine.

/// Weight of the values, V.
const VALUE: f64 = 0.45;
/// Weight of the slopes, G.
const SLOPE: f64 = 0.55;

/// No noise is greater in magnitude (V + G).
pub(super) const PEAK: f64 = 1.0;
/// No derivative of the noise in any direction is greater in magnitude, per lattice cell.
pub(super) const FIRST: f64 = 3.25;
/// No second derivative in any one direction is greater in magnitude, per lattice cell squared.
pub(super) const SECOND: f64 = 11.7;

/// Rotations of lattices by Pythagorean triples, so that octaves share no axis with each other or the grid.
const ROTATIONS: [[f64; 2]; 6] = [
    [4.0 / 5.0, 3.0 / 5.0],
    [12.0 / 13.0, 5.0 / 13.0],
    [20.0 / 29.0, 21.0 / 29.0],
    [5.0 / 13.0, 12.0 / 13.0],
    [15.0 / 17.0, 8.0 / 17.0],
    [24.0 / 25.0, 7.0 / 25.0],
];

/// An octave: noise on a rotated and shifted lattice.
#[derive(Clone, Copy, Debug)]
pub(super) struct Octave {
    /// Samples along a side of a lattice cell.
    pub(super) cell: f64,
    key: u64,
    rotation: [f64; 2],
    shift: [f64; 2],
}

/// The cell that an octave was last asked for: neighbours mostly share it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    at: [i64; 2],
    corners: [[f64; 3]; 4],
}

impl Cell {
    /// A cell that no octave has been asked for.
    pub(super) const NONE: Self = Self {
        at: [i64::MIN; 2],
        corners: [[0.0; 3]; 4],
    };
}

/// Mixes the bits of a word (the finaliser of SplitMix64: G. Steele, D. Lea and C. Flood, Fast Splittable
/// Pseudorandom Number Generators, OOPSLA 2014).
fn mix(word: u64) -> u64 {
    let word = (word ^ (word >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let word = (word ^ (word >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    word ^ (word >> 31)
}

/// 21 bits of a word as a number from -1 up to 1, exact in f64.
fn unit(word: u64, shift: u32) -> f64 {
    let bits = (word >> shift) & 0x1f_ffff;
    bits as f64 / f64::from(1u32 << 20) - 1.0
}

impl Octave {
    /// Octave `k` of `seed`, with lattice cells of 2^k samples.
    pub(super) fn new(k: u32, seed: u64) -> Self {
        let key = mix(seed.wrapping_add(mix(u64::from(k) + 1)));
        let place = mix(key);
        Self {
            cell: (1u64 << k) as f64,
            key,
            rotation: ROTATIONS[k as usize % ROTATIONS.len()],
            shift: [unit(place, 0), unit(place, 21)],
        }
    }

    fn corner(&self, x: i64, z: i64) -> [f64; 3] {
        let word = self
            .key
            .wrapping_add((x as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let word = mix(mix(word).wrapping_add((z as u64).wrapping_mul(0xd1b5_4a32_d192_ed03)));
        [
            VALUE * unit(word, 0),
            SLOPE * unit(word, 21),
            SLOPE * unit(word, 42),
        ]
    }

    /// The noise at a sample, within -1 and 1.
    pub(super) fn at(&self, x: f64, z: f64, last: &mut Cell) -> f64 {
        let [cos, sin] = self.rotation;
        let u = (x * cos - z * sin) / self.cell + self.shift[0];
        let v = (x * sin + z * cos) / self.cell + self.shift[1];
        let at = [floor(u), floor(v)];
        if last.at != at {
            let [i, j] = at;
            last.at = at;
            last.corners = [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)].map(|(i, j)| self.corner(i, j));
        }
        let (u, v) = (u - at[0] as f64, v - at[1] as f64);
        let plane = |[value, du, dv]: [f64; 3], u: f64, v: f64| value + du * u + dv * v;
        let [a, b, c, d] = last.corners;
        let (s, t) = (blend(u), blend(v));
        let north = plane(a, u, v) * (1.0 - s) + plane(b, u - 1.0, v) * s;
        let south = plane(c, u, v - 1.0) * (1.0 - s) + plane(d, u - 1.0, v - 1.0) * s;
        north * (1.0 - t) + south * t
    }
}

/// The greatest integer not above `t`, which is far within i64. (`f64::floor` is a call on processors without
/// SSE 4.1, and twice as slow in all.)
fn floor(t: f64) -> i64 {
    let toward_0 = t as i64;
    toward_0 - i64::from(toward_0 as f64 > t)
}

fn blend(t: f64) -> f64 {
    t * t * t * (10.0 + t * (6.0 * t - 15.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// S, S' and S'' of one corner's side, times the distance from it where `linear`.
    fn side(t: f64, far: bool, linear: bool) -> [f64; 3] {
        let s = [
            blend(t),
            30.0 * t * t * (1.0 - t) * (1.0 - t),
            60.0 * t * (1.0 - t) * (1.0 - 2.0 * t),
        ];
        let w = if far { s } else { [1.0 - s[0], -s[1], -s[2]] };
        let l = t - f64::from(u8::from(far));
        if linear {
            [w[0] * l, w[1] * l + w[0], w[2] * l + 2.0 * w[1]]
        } else {
            w
        }
    }

    /// The greatest noise, first and second derivative that any random numbers give, over a grid of points and
    /// directions.
    fn greatest(points: u32, directions: u32) -> [f64; 3] {
        let mut most = [0.0f64; 3];
        for p in 0..=points {
            for q in 0..=points {
                let (u, v) = (f64::from(p) / f64::from(points), f64::from(q) / f64::from(points));
                for d in 0..directions {
                    let (sin, cos) = (std::f64::consts::PI * f64::from(d) / f64::from(directions)).sin_cos();
                    let mut sums = [0.0; 3];
                    for (far_u, far_v) in [(false, false), (true, false), (false, true), (true, true)] {
                        for (lu, lv, weight) in
                            [(false, false, VALUE), (true, false, SLOPE), (false, true, SLOPE)]
                        {
                            let (a, b) = (side(u, far_u, lu), side(v, far_v, lv));
                            let first = cos * a[1] * b[0] + sin * a[0] * b[1];
                            let second = cos * cos * a[2] * b[0]
                                + 2.0 * cos * sin * a[1] * b[1]
                                + sin * sin * a[0] * b[2];
                            for (sum, term) in sums.iter_mut().zip([a[0] * b[0], first, second]) {
                                *sum += weight * term.abs();
                            }
                        }
                    }
                    for (m, s) in most.iter_mut().zip(sums) {
                        *m = m.max(s);
                    }
                }
            }
        }
        most
    }

    #[test]
    fn no_random_numbers_exceed_the_stated_bounds() {
        let [peak, first, second] = greatest(240, 60);
        assert!(peak <= PEAK + 1e-12, "{peak}");
        // The grid's gaps hide at most a percent: both are smooth, with steps of 1/240 cell and 3 degrees.
        assert!(first <= FIRST * 0.99 && first > 0.95 * FIRST, "{first}");
        assert!(second <= SECOND * 0.99 && second > 0.95 * SECOND, "{second}");
    }

    #[test]
    fn differences_of_the_noise_itself_keep_the_bounds_across_cells() {
        let octave = Octave::new(4, 7);
        let mut cell = Cell::NONE;
        let h = 1e-3; // samples; a cell has 16
        let mut most = [0.0f64; 2];
        for i in 0..200_000 {
            let (x, z) = (
                f64::from(i % 499) * 0.137 - 31.0,
                f64::from(i / 499) * 0.173 - 29.0,
            );
            let mut n = |dx: f64| octave.at(x + dx, z - dx, &mut cell);
            let step = h * std::f64::consts::SQRT_2 / octave.cell;
            let [west, here, east] = [n(-h), n(0.0), n(h)];
            assert!(here.abs() <= PEAK);
            most[0] = most[0].max(((east - west) / (2.0 * step)).abs());
            most[1] = most[1].max(((east - 2.0 * here + west) / (step * step)).abs());
        }
        assert!(most[0] <= FIRST && most[0] > 0.3 * FIRST, "{most:?}");
        assert!(most[1] <= SECOND + 1e-3 && most[1] > 0.3 * SECOND, "{most:?}");
    }

    #[test]
    fn the_cell_kept_between_calls_changes_nothing() {
        let octave = Octave::new(3, 1);
        let mut kept = Cell::NONE;
        for i in 0..5000 {
            let (x, z) = (
                f64::from(i * 7919 % 301) - 150.0,
                f64::from(i * 104_729 % 211) - 100.0,
            );
            assert_eq!(
                octave.at(x, z, &mut kept).to_bits(),
                octave.at(x, z, &mut { Cell::NONE }).to_bits()
            );
        }
    }
}
