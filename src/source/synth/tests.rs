//! Tests of procedural terrain: bounds by brute force, nesting, samples alone and in rectangles.

use super::*;

/// The triangulated surface of `level` at sample (x, z) of level 0.
fn surface(synth: &Synth, level: u32, x: i64, z: i64) -> f64 {
    let (i, j) = (x >> level, z >> level);
    let step = (1i64 << level) as f64;
    let (u, v) = ((x - (i << level)) as f64 / step, (z - (j << level)) as f64 / step);
    let at = |i: i64, j: i64| {
        let mut out = [0.0];
        synth.fill(level, Rect::new(i, j, i + 1, j + 1), &mut out);
        f64::from(out[0])
    };
    let (nw, se) = (at(i, j), at(i + 1, j + 1));
    // The diagonal runs from north-west to south-east: north-east of it u > v.
    if u >= v {
        let ne = at(i + 1, j);
        nw + u * (ne - nw) + v * (se - ne)
    } else {
        let sw = at(i, j + 1);
        nw + v * (sw - nw) + u * (se - sw)
    }
}

fn one(synth: &Synth, level: u32, a: i64, b: i64) -> Bounds {
    let mut out = [Bounds::VOID];
    synth.row_bounds(level, [a, a + 1], b, &mut out);
    out[0]
}

/// Greatest share of its bound that any error reaches, over all patches and samples of level 0, where bounds
/// are multiplied by `factor`; and how many errors exceed their bound.
fn worst(size: i64, seed: u64, factor: f64) -> (f64, u64) {
    let synth = Synth::new(size, seed).unwrap();
    let mut truth = vec![0.0; (size * size) as usize];
    synth.read(synth.grid().size.rect(), &mut truth).unwrap();
    let (mut share, mut broken) = (0.0f64, 0);
    for level in 1..synth.level_count() {
        let patches = synth.size(level).patches();
        let mut bounds = vec![Bounds::VOID; patches.samples() as usize];
        let _ = synth.bounds(level, patches.rect(), &mut bounds).unwrap();
        for (z, row) in truth.chunks(size as usize).enumerate() {
            for (x, height) in row.iter().enumerate() {
                let error = (surface(&synth, level, x as i64, z as i64) - f64::from(*height)).abs();
                // Every patch on whose closed ground the sample lies.
                let span = PATCH << level;
                for a in (x as i64 - 1).div_euclid(span).max(0)..=(x as i64 / span).min(patches.width - 1) {
                    for b in
                        (z as i64 - 1).div_euclid(span).max(0)..=(z as i64 / span).min(patches.height - 1)
                    {
                        let bound = factor * f64::from(bounds[(b * patches.width + a) as usize].error);
                        share = share.max(error / bound);
                        broken += u64::from(error > bound);
                    }
                }
            }
        }
    }
    (share, broken)
}

#[test]
fn no_sample_strays_from_any_level_by_more_than_its_bound() {
    for (size, seed) in [(130, 1), (257, 2), (300, 3), (61, 4)] {
        let (share, broken) = worst(size, seed, 1.0);
        assert_eq!(broken, 0, "size {size}, seed {seed}: {share} of its bound");
    }
    // Control: bounds that are half as large are caught.
    let (_, broken) = worst(257, 2, 0.5);
    assert!(broken > 100, "only {broken} caught");
}

/// Numbers from SplitMix64, for places.
struct Random(u64);

impl Random {
    fn below(&mut self, n: i64) -> i64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let word = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        ((word ^ (word >> 27)) % n as u64) as i64
    }
}

#[test]
fn the_bounds_of_the_coarsest_levels_hold_at_random_places() {
    let synth = Synth::new(MAX_SYNTH_SIZE, 9).unwrap();
    let mut random = Random(77);
    for level in 1..synth.level_count() {
        let mut share = 0.0f64;
        for _ in 0..25 {
            let patches = synth.size(level).patches();
            let (a, b) = (random.below(patches.width), random.below(patches.height));
            let bounds = one(&synth, level, a, b);
            for _ in 0..60 {
                let span = PATCH << level;
                let (x, z) = (a * span + random.below(span), b * span + random.below(span));
                let mut truth = [0.0];
                synth.fill(0, Rect::new(x, z, x + 1, z + 1), &mut truth);
                let error = (surface(&synth, level, x, z) - f64::from(truth[0])).abs();
                share = share.max(error / f64::from(bounds.error));
                assert!(f64::from(truth[0]) >= f64::from(bounds.need_min));
                assert!(f64::from(truth[0]) <= f64::from(bounds.need_max));
            }
        }
        assert!(share <= 1.0, "level {level}: {share} of the bound");
        // Not vacuous: somewhere a sample comes within an order or two of its bound.
        assert!(share > 0.03, "level {level}: {share} of the bound");
    }
}

#[test]
fn least_and_greatest_are_those_of_the_samples() {
    let synth = Synth::new(333, 5).unwrap();
    for level in 0..synth.level_count() {
        let size = synth.size(level);
        let mut heights = vec![0.0; size.samples() as usize];
        let _ = Levels::heights(&synth, level, size.rect(), &mut heights).unwrap();
        let patches = size.patches();
        let mut bounds = vec![Bounds::VOID; patches.samples() as usize];
        let _ = synth.bounds(level, patches.rect(), &mut bounds).unwrap();
        for ((a, b), bounds) in patches.rect().cells().zip(&bounds) {
            let samples = Patch::new(level, a, b).samples_within(size);
            let of = |x: i64, z: i64| heights[(z * size.width + x) as usize];
            let min = samples
                .cells()
                .map(|(x, z)| of(x, z))
                .fold(f32::INFINITY, f32::min);
            let max = samples
                .cells()
                .map(|(x, z)| of(x, z))
                .fold(f32::NEG_INFINITY, f32::max);
            assert_eq!(
                (bounds.min, bounds.max),
                (min, max),
                "level {level}, patch ({a}, {b})"
            );
            assert_eq!(bounds.error == 0.0, level == 0);
        }
    }
}

/// Whether the needs of a patch hold those of its children and their neighbours.
fn nests(parent: Bounds, child: Bounds, saturation: f64) -> bool {
    parent.need_min <= child.need_min
        && parent.need_max >= child.need_max
        && f64::from(parent.need_error) >= saturation * f64::from(child.need_error)
}

#[test]
fn needs_nest_over_children_and_their_neighbours() {
    let synth = Synth::new(MAX_SYNTH_SIZE, 21).unwrap();
    let mut random = Random(4);
    let (mut checked, mut control) = (0, 0);
    for _ in 0..150 {
        let level = 1 + random.below(i64::from(synth.level_count()) - 1) as u32;
        let patches = synth.size(level).patches();
        let parent = Patch::new(level, random.below(patches.width), random.below(patches.height));
        let bounds = one(&synth, level, parent.a, parent.b);
        assert!(bounds.need_min <= bounds.min && bounds.need_max >= bounds.max);
        assert!(bounds.need_error >= bounds.error);
        for a in 2 * parent.a - 1..2 * parent.a + 3 {
            for b in 2 * parent.b - 1..2 * parent.b + 3 {
                if a < 0 || b < 0 {
                    continue;
                }
                let child = one(&synth, level - 1, a, b);
                assert!(
                    nests(bounds, child, 1.3),
                    "{parent:?} {bounds:?} against ({a}, {b}) {child:?}"
                );
                checked += 1;
                // Control: the unsaturated bounds of a patch do not hold those of all its neighbourhood.
                let bare = Bounds {
                    need_min: bounds.min,
                    need_max: bounds.max,
                    ..bounds
                };
                control += u32::from(!nests(bare, child, 1.3));
            }
        }
    }
    assert!(
        checked > 1500 && control > 1000,
        "{checked} checked, {control} caught"
    );
}

#[test]
fn a_sample_is_the_same_alone_and_in_any_rectangle() {
    let synth = Synth::new(500, 8).unwrap();
    let mut random = Random(15);
    for level in 0..synth.level_count() {
        let size = synth.size(level);
        for _ in 0..20 {
            let (x, z) = (random.below(size.width - 1), random.below(size.height - 1));
            let rect = Rect::new(
                x,
                z,
                x + 1 + random.below(size.width - x),
                z + 1 + random.below(size.height - z),
            );
            let mut out = vec![0.0; rect.area() as usize];
            let _ = Levels::heights(&synth, level, rect, &mut out).unwrap();
            for _ in 0..50 {
                let at = random.below(rect.area());
                let (x, z) = (rect.x0 + at % rect.width(), rect.z0 + at / rect.width());
                let mut alone = [0.0];
                let _ = Levels::heights(&synth, level, Rect::new(x, z, x + 1, z + 1), &mut alone).unwrap();
                assert_eq!(
                    alone[0].to_bits(),
                    out[at as usize].to_bits(),
                    "level {level} ({x}, {z})"
                );
            }
        }
    }
}

#[test]
fn heights_are_those_of_mountains_and_never_change() {
    let synth = Synth::new(MAX_SYNTH_SIZE, 1).unwrap();
    let mut out = vec![0.0; 1024 * 1024];
    let _ = Levels::heights(&synth, 8, Rect::new(0, 0, 1024, 1024), &mut out).unwrap();
    let min = out.iter().copied().fold(f32::INFINITY, f32::min);
    let max = out.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    assert!(min >= -500.0 && max > 3000.0 && max < 6000.0, "{min} to {max}");
    let mut some = [0.0; 3];
    synth.read(Rect::new(1000, 2000, 1003, 2001), &mut some).unwrap();
    assert_eq!(
        some.map(f32::to_bits),
        [1158290043, 1158292861, 1158302786],
        "{some:?}"
    );
}

#[test]
fn names_are_parsed_and_sizes_checked() {
    let name = |text: &str| Synth::parse(text).map(|s| s.map(|s| s.description().name.clone()));
    assert!(name("mountains.tif").is_none());
    assert_eq!(name("synth:64").unwrap().unwrap(), "synth:64:1");
    assert_eq!(
        name("synth:1048576:18446744073709551615").unwrap().unwrap(),
        "synth:1048576:18446744073709551615"
    );
    for bad in [
        "synth:",
        "synth:x",
        "synth:64:",
        "synth:64:-1",
        "synth:64:1:2",
        "synth:0",
        "synth:1048577",
        "synth:-5",
    ] {
        let error = name(bad).unwrap().unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Misuse, "{bad}: {error}");
    }
    let synth = Synth::new(1, 1).unwrap();
    assert_eq!((synth.level_count(), synth.has_light()), (1, false));
    let mut out = [Bounds::VOID];
    let _ = synth.bounds(0, Rect::new(0, 0, 1, 1), &mut out).unwrap();
    assert_eq!(out[0].min, out[0].max);
    let outside = Levels::heights(&synth, 0, Rect::new(0, 0, 2, 1), &mut [0.0; 2]).unwrap_err();
    assert_eq!(outside.kind(), ErrorKind::Misuse);
    assert!(Levels::heights(&synth, 1, Rect::EMPTY, &mut []).is_err());
}
