//! Downsampling against the plain version, and its properties one by one.

use super::oracle::Oracle;
use super::*;
use crate::grid::Rect;
use crate::progress::Silent;
use crate::pyramid::FilterKind;
use crate::pyramid::random::Random;
use crate::work::Serial;

/// Runs tasks last first, on two threads at a time.
struct Backwards;

impl Work for Backwards {
    fn each(&self, count: usize, task: &(dyn Fn(usize) + Sync)) {
        std::thread::scope(|scope| {
            for parity in 0..2 {
                scope.spawn(move || (0..count).rev().filter(|k| k % 2 == parity).for_each(task));
            }
        });
    }
}

fn run(fine: &[f32], width: i64, height: i64) -> Vec<f32> {
    run_with(&Filter::default(), fine, width, height)
}

fn run_with(filter: &Filter, fine: &[f32], width: i64, height: i64) -> Vec<f32> {
    downsample(fine, Size { width, height }, filter, None, &Serial, &Silent).expect("filters")
}

fn bits(level: &[f32]) -> Vec<u32> {
    level
        .iter()
        .map(|h| if h.is_nan() { u32::MAX } else { h.to_bits() })
        .collect()
}

#[test]
fn it_equals_the_plain_version_bit_for_bit() {
    let mut random = Random::new(20);
    for seed in 0..60 {
        let side = |r: &mut Random| {
            if r.unit() < 0.4 {
                1 + r.below(8)
            } else {
                1 + r.below(70)
            }
        };
        let mut size = Size {
            width: side(&mut random),
            height: side(&mut random),
        };
        if seed % 20 == 7 {
            size = Size {
                width: 1100 + seed,
                height: 9,
            }; // more than two blocks of columns
        } else if seed % 20 == 8 {
            size = Size {
                width: 9,
                height: 256 + seed,
            }; // several bands, the last of one row too
        } else if seed == 19 {
            size = Size {
                width: 5,
                height: 256,
            };
        }
        let voids = [0.0, 0.02, 0.3, 0.9][seed as usize % 4];
        let fine = random.heights(size.samples(), -500.0, 4000.0, voids);
        let filter = match FilterKind::ALL.get(seed as usize % 14) {
            Some(&kind) => kind.into(),
            None => Filter::sinc_blackman(1 + (seed % 7) as u32),
        };
        for rounding_m in [None, Some(1.0 / 64.0)] {
            let want = Oracle {
                fine: &fine,
                size,
                filter: &filter,
                rounding_m,
            }
            .level();
            for work in [&Serial as &dyn Work, &Backwards] {
                let got = downsample(&fine, size, &filter, rounding_m, work, &Silent).unwrap();
                assert_eq!(bits(&got), bits(&want), "seed {seed}, {size:?}");
            }
        }
    }
}

#[test]
fn a_symmetric_bump_stays_symmetric_about_its_even_centre() {
    let size = Size {
        width: 81,
        height: 65,
    };
    let bump = |shift: i64| -> Vec<f32> {
        let height = |(x, z): (i64, i64)| {
            let (dx, dz) = ((x - 40 - shift) as f32, (z - 32) as f32);
            1000.0 * (-(dx * dx + dz * dz) / 50.0).exp()
        };
        size.rect().cells().map(height).collect()
    };
    let mirrored = |coarse: &[f32]| {
        let at = |i: i64, j: i64| coarse[(j * 41 + i) as usize];
        size.level(1)
            .rect()
            .cells()
            .all(|(i, j)| at(i, j) == at(40 - i, j) && at(i, j) == at(i, 32 - j))
    };
    assert!(mirrored(&run(&bump(0), 81, 65)));
    assert!(
        !mirrored(&run(&bump(1), 81, 65)),
        "a shift by one fine sample must show"
    );
}

#[test]
fn the_fine_nyquist_wave_vanishes_exactly() {
    let size = Size {
        width: 61,
        height: 57,
    };
    let waves: [fn(i64, i64) -> i64; 3] = [|x, _| x, |_, z| z, |x, z| x + z];
    for (wave, phase) in waves.iter().enumerate() {
        let amplitude = 1234.567_f32;
        let fine: Vec<f32> = size
            .rect()
            .cells()
            .map(|(x, z)| amplitude * [1.0, -1.0][(phase(x, z) & 1) as usize])
            .collect();
        for kind in FilterKind::ALL {
            let coarse = run_with(&kind.into(), &fine, size.width, size.height);
            let size = size.level(1);
            let inner = Rect::new(4, 4, size.width - 4, size.height - 4);
            let inner = inner
                .cells()
                .map(|(i, j)| ((i, j), coarse[(j * size.width + i) as usize]));
            for (at, h) in inner {
                match kind {
                    // The controls: each centre is a crest, which comes through whole, or in part.
                    FilterKind::Point => assert_eq!(h, amplitude, "wave {wave} at {at:?}"),
                    FilterKind::Box => assert!(h.abs() > amplitude / 10.0, "wave {wave} at {at:?}: {h}"),
                    _ => assert_eq!(h, 0.0, "{kind}, wave {wave} at {at:?}"),
                }
            }
        }
    }
}

#[test]
fn waves_follow_the_stated_response() {
    let size = Size {
        width: 401,
        height: 9,
    };
    for frequency in [0.1, 0.25, 0.5, 0.6, 0.75, 0.9] {
        let wave = |x: f64| 1000.0 * (std::f64::consts::PI * frequency * x).cos();
        let fine: Vec<f32> = size.rect().cells().map(|(x, _)| wave(x as f64) as f32).collect();
        let coarse = run(&fine, 401, 9);
        let factor = Filter::default().response(frequency);
        for i in 10..190 {
            let want = factor * wave(2.0 * i as f64);
            let got = f64::from(coarse[2 * 201 + i]);
            assert!(
                (got - want).abs() < 1e-3,
                "frequency {frequency}, sample {i}: {got} against {want}"
            );
        }
    }
}

#[test]
fn a_coarse_sample_is_void_exactly_where_its_centre_is_and_the_share_stays() {
    let size = Size {
        width: 700,
        height: 501,
    };
    let mut level = Random::new(31).heights(size.samples(), 0.0, 9000.0, 0.3);
    let mut size = size;
    for l in 1..4 {
        let coarse = run(&level, size.width, size.height);
        let small = size.level(1);
        for ((i, j), h) in small.rect().cells().zip(&coarse) {
            let (x, z) = ((2 * i).min(size.width - 1), (2 * j).min(size.height - 1));
            let centre = level[(z * size.width + x) as usize];
            assert_eq!(h.is_nan(), centre.is_nan(), "level {l}, ({i}, {j})");
        }
        let share = coarse.iter().filter(|h| h.is_nan()).count() as f64 / coarse.len() as f64;
        // Four deviations of a binomial share of 0.3.
        let allowed = 4.0 * (0.21 / coarse.len() as f64).sqrt();
        assert!((share - 0.3).abs() < allowed, "level {l}: {share}");
        (level, size) = (coarse, small);
    }
}

/// How far each centred sample leaves the range of the valid samples under its kernel, over that range.
fn worst_excess(fine: &[f32], size: Size, coarse: &[f32], reach: i64) -> f64 {
    let mut worst = 0.0f64;
    for ((i, j), &h) in size.level(1).rect().cells().zip(coarse) {
        if h.is_nan() || 2 * i >= size.width || 2 * j >= size.height {
            continue;
        }
        let under = Rect::new(2 * i, 2 * j, 2 * i + 1, 2 * j + 1)
            .grown(reach)
            .intersection(size.rect());
        let valid = under.cells().map(|(x, z)| fine[(z * size.width + x) as usize]);
        let (low, high) = valid.fold((f32::NAN, f32::NAN), |(l, u), h| (l.min(h), u.max(h)));
        let range = f64::from(high - low);
        if range > 0.0 {
            worst = worst.max(f64::from((low - h).max(h - high)) / range);
        }
    }
    worst
}

#[test]
fn no_result_leaves_the_range_under_the_kernel_by_more_than_the_overshoot() {
    let size = Size {
        width: 260,
        height: 231,
    };
    let filter = Filter::default();
    for (seed, voids) in [(1, 0.3), (2, 0.0), (3, 0.7)] {
        // Two heights only: the likeliest to drive the kernel to its limit.
        let mut random = Random::new(seed);
        let mut fine = random.heights(size.samples(), 0.0, 1.0, voids);
        fine.iter_mut()
            .for_each(|h| *h = if *h < 0.5 { 0.0 } else { *h / *h * 9000.0 });
        let coarse = run(&fine, size.width, size.height);
        let excess = worst_excess(&fine, size, &coarse, 7);
        assert!(
            excess <= filter.overshoot() + 1e-6,
            "seed {seed}: {excess} of {}",
            filter.overshoot()
        );
        assert!(
            excess > 0.02,
            "seed {seed}: {excess} is too tame to show anything"
        );
        // Control: counting a missing tap as 0, without the one rule, falls out of the range.
        if voids > 0.0 {
            let zero: Vec<f32> = fine
                .iter()
                .map(|h| if h.is_nan() { 0.0 } else { h + 5000.0 })
                .collect();
            let lifted: Vec<f32> = fine.iter().map(|h| h + 5000.0).collect();
            let mut broken = run(&zero, size.width, size.height);
            let voided = run(&lifted, size.width, size.height);
            broken
                .iter_mut()
                .zip(&voided)
                .for_each(|(b, v)| *b = if v.is_nan() { f32::NAN } else { *b });
            assert!(worst_excess(&lifted, size, &broken, 7) > filter.overshoot());
        }
    }
}

#[test]
fn the_clamped_filter_never_leaves_the_range_under_its_kernel() {
    let size = Size {
        width: 90,
        height: 77,
    };
    let clamped = Filter::from(FilterKind::SincBlackmanClamped);
    let reach = 2 * i64::from(clamped.lobes()) - 1;
    let step: Vec<f32> = size
        .rect()
        .cells()
        .map(|(x, z)| if 2 * x > 90 + z { 900.0 } else { 100.0 })
        .collect();
    let noise = |seed, voids| Random::new(seed).heights(size.samples(), -50.0, 9000.0, voids);
    for (name, fine) in [
        ("step", step),
        ("noise", noise(1, 0.0)),
        ("noise with voids", noise(2, 0.4)),
    ] {
        let kept = run_with(&clamped, &fine, size.width, size.height);
        assert_eq!(worst_excess(&fine, size, &kept, reach), 0.0, "{name}");
        // Control: the same kernel without the clamp does leave it on a step.
        let free = run(&fine, size.width, size.height);
        if name == "step" {
            assert!(worst_excess(&fine, size, &free, reach) > 0.01, "{name}");
        }
        assert_ne!(bits(&kept), bits(&free), "{name}");
    }
}

#[test]
fn the_last_row_and_column_follow_the_rule() {
    let nan = f32::NAN;
    assert_eq!(run(&[5.0], 1, 1), [5.0]);
    // Two: the fine row continued; a void first sample leaves the last, a void last is void.
    assert_eq!(run(&[3.0, 5.0], 2, 1), [3.0, 7.0]);
    assert_eq!(bits(&run(&[nan, 5.0], 2, 1)), bits(&[nan, 5.0]));
    assert_eq!(bits(&run(&[3.0, nan], 2, 1)), bits(&[3.0, nan]));
    assert_eq!(run(&[3.0, 5.0], 1, 2), [3.0, 7.0]);
    assert_eq!(run(&[1.0, 2.0, 3.0, 4.0], 2, 2), [1.0, 3.0, 5.0, 7.0]);
    // Four: 2 C[1] - C[0], and the last fine sample where one of these is void.
    let four = run(&[1.0, 5.0, 2.0, 9.0], 4, 1);
    assert_eq!(four[2], 2.0 * four[1] - four[0]);
    assert_eq!(run(&[1.0, 5.0, nan, 9.0], 4, 1)[2], 9.0);
    assert_eq!(run(&[nan, 5.0, 2.0, 9.0], 4, 1)[2], 9.0);
    assert!(run(&[1.0, 5.0, 2.0, nan], 4, 1)[2].is_nan());
}

#[test]
fn rounding_is_that_of_the_standard_library() {
    let random = &mut Random::new(31);
    let halves = (-9..9).map(|n| f64::from(n) / 2.0);
    let special = [
        0.0,
        -0.0,
        f64::INFINITY,
        f64::NEG_INFINITY,
        1e300,
        4503599627370495.5,
        4503599627370497.0,
    ];
    let any = (0..100_000)
        .map(|_| f64::from_bits(random.bits()))
        .filter(|x| !x.is_nan());
    for x in halves.chain(special).chain(any) {
        assert_eq!(round_ties_even(x).to_bits(), x.round_ties_even().to_bits(), "{x}");
    }
    assert!(round_ties_even(f64::NAN).is_nan());
}
