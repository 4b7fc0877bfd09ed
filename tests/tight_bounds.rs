//! How tight the stored errors are: for every patch of a real DEM the greatest difference between its level and the DEM's
//! own surface, found by brute force in f64, over what is stored. `--nocapture` prints the medians.
#![allow(clippy::print_stderr, reason = "says what it found")]

use std::path::Path;

use clipscape::build::build_pyramid;
use clipscape::grid::{PATCH, Rect, Size};
use clipscape::levels::{Bounds, Levels};
use clipscape::progress::Silent;
use clipscape::pyramid::Filter;

/// Heights of a level, row by row.
fn heights_of(levels: &dyn Levels, level: u32) -> (Size, Vec<f32>) {
    let size = levels.grid().level(level);
    let mut heights = vec![0.0; size.samples() as usize];
    let _ = levels.heights(level, size.rect(), &mut heights).unwrap();
    (size, heights)
}

/// The level's surface over the sample (x, z) of level 0; NaN where a corner that has weight is void or beyond it.
fn surface(size: Size, heights: &[f32], level: u32, x: i64, z: i64) -> f64 {
    let step = 1i64 << level;
    let (i, j) = (x >> level, z >> level);
    let (u, v) = (
        (x - i * step) as f64 / step as f64,
        (z - j * step) as f64 / step as f64,
    );
    let corner = |weight: f64, di: i64, dj: i64| match weight {
        0.0 => 0.0,
        _ if size.rect().contains(i + di, j + dj) => {
            weight * f64::from(heights[((j + dj) * size.width + i + di) as usize])
        }
        _ => f64::NAN,
    };
    let middle = if u < v {
        corner(v - u, 0, 1)
    } else {
        corner(u - v, 1, 0)
    };
    corner(1.0 - u.max(v), 0, 0) + middle + corner(u.min(v), 1, 1)
}

#[test]
fn stored_errors_are_those_that_brute_force_finds() {
    let source = clipscape::source::open(Path::new("data/N42E001.hgt")).unwrap();
    let pyramid = build_pyramid(source.as_ref(), &Filter::default(), &Silent).unwrap();
    let (whole, truth) = heights_of(&pyramid, 0);
    for level in 1..pyramid.level_count() {
        let (size, heights) = heights_of(&pyramid, level);
        let patches = pyramid.grid().patches(level);
        let mut stored = vec![Bounds::VOID; patches.samples() as usize];
        let _ = pyramid.bounds(level, patches.rect(), &mut stored).unwrap();
        let mut ratios = Vec::new();
        for ((a, b), bounds) in patches.rect().cells().zip(&stored) {
            let side = PATCH << level;
            let ground = Rect::new(a * side, b * side, (a + 1) * side + 1, (b + 1) * side + 1);
            let found = ground
                .intersection(whole.rect())
                .cells()
                .map(|(x, z)| {
                    surface(size, &heights, level, x, z) - f64::from(truth[(z * whole.width + x) as usize])
                })
                .fold(0.0f64, |most, difference| most.max(difference.abs()));
            let error = f64::from(bounds.error);
            // Those of void patches are NaN.
            assert!(
                found <= error || error.is_nan(),
                "level {level}, patch ({a}, {b}): {found} m, stored {error}"
            );
            if error > 0.0 {
                ratios.push(found / error);
            }
            // A control: stored at half their size, they would not hold.
            assert!(
                error == 0.0 || error.is_nan() || found > 0.5 * error,
                "level {level}, patch ({a}, {b}) is loose"
            );
        }
        ratios.sort_unstable_by(f64::total_cmp);
        let (median, least) = (ratios[ratios.len() / 2], ratios[0]);
        eprintln!(
            "level {level}: found over stored error of {} patches: median {median:.6}, least {least:.6}",
            ratios.len()
        );
        assert!(median > 0.9999, "level {level}: {median}");
    }
}
