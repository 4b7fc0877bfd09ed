//! Damage: what happens to files on disks and lines, and what an attacker does to numbers.

/// SplitMix64 (G. L. Steele and others, 2014), seeded by a seed and a round.
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64, round: u64) -> Self {
        let mut random = Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ round.rotate_left(32));
        random.next();
        random
    }

    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub(crate) fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }
}

/// Numbers at the edges of types.
const EXTREMES: [u64; 14] = [
    0,
    1,
    2,
    0x7f,
    0xff,
    0x7fff,
    0xffff,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    1 << 30,
    0x7fff_ffff_ffff_ffff,
    0x8000_0000_0000_0000,
    u64::MAX,
];

/// The same as text.
const TEXTS: [&str; 16] = [
    "0",
    "-1",
    "1",
    "65536",
    "2147483647",
    "4294967296",
    "18446744073709551615",
    "99999999999999999999",
    "1e308",
    "-1e400",
    "nan",
    "inf",
    "1e-320",
    "",
    ".",
    "x",
];

/// One to four kinds of damage to `bytes`; `other` is a file from which parts may come.
pub(crate) fn mutate(bytes: &[u8], other: &[u8], random: &mut Random) -> Vec<u8> {
    let mut out = bytes.to_vec();
    for _ in 0..=random.below(4) {
        damage(&mut out, other, random);
    }
    out
}

fn damage(out: &mut Vec<u8>, other: &[u8], random: &mut Random) {
    // Headers are short and stand at the beginning: half of the damage is done there.
    let reach = if random.below(2) == 0 {
        out.len().min(256)
    } else {
        out.len()
    };
    let at = random.below(reach);
    if out.is_empty() {
        out.push(random.next() as u8);
        return;
    }
    match random.below(10) {
        0 => out[at] ^= 1 << random.below(8),
        1 => out[at] = random.next() as u8,
        2 => out.truncate(at),
        3 => {
            let end = (at + 1 + random.below(64)).min(out.len());
            out.drain(at..end);
        }
        4 => {
            let end = (at + 1 + random.below(64)).min(out.len());
            let part = out[at..end].to_vec();
            out.splice(at..at, part);
        }
        5 => {
            let from = random.below(other.len());
            let part = &other[from..(from + 1 + random.below(512)).min(other.len())];
            let end = (at + part.len()).min(out.len());
            out.splice(at..end, part.iter().copied());
        }
        6 | 7 => {
            let value = EXTREMES[random.below(EXTREMES.len())];
            let length = 1 << random.below(4);
            let mut word = value.to_le_bytes()[..length].to_vec();
            if random.below(2) == 0 {
                word.reverse();
            }
            for (to, from) in out[at..].iter_mut().zip(word) {
                *to = from;
            }
        }
        8 => {
            // A number in letters, if there is one near.
            let digit = |b: &u8| b.is_ascii_digit();
            if let Some(start) = out[at..].iter().position(digit).map(|p| at + p) {
                let length = out[start..].iter().take_while(|b| digit(b)).count();
                let text = TEXTS[random.below(TEXTS.len())];
                out.splice(start..start + length, text.bytes());
            }
        }
        _ => {
            let fill = [0, 0xff, b' '][random.below(3)];
            let end = (at + 1 + random.below(32)).min(out.len());
            out[at..end].fill(fill);
        }
    }
}
