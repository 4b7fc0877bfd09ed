//! Popping, measured on the twin: no height that is drawn changes by more than the camera's own motion explains.
//!
//! Measured is the drawn surface at every vertex of level 0, in two frames that follow each other. Every vertex of any
//! level lies over one of them; which level draws the place may differ between the frames, so arrivals and departures of
//! levels are seen.
//!
//! *The bound.* Let a place lie in a triangle of level `l`, `M_l` be the greatest `|c - h|` over the triangle's corners
//! that carry weight there, and T the transition, 1 or more. The drawn height is the corners' mean of `h + alpha (c - h)`,
//! so it changes by at most `M_l |d alpha|`, and `alpha`, a clamped `(d - (R - T)) / T`, by at most `D_l / T`, where D_l is
//! the change of `d` in steps of level `l`: the greater of what a move by (x, z) samples and y metres does to the
//! distance, `max(x, z) / 2^l`, and to the climb, `1.25 (|y| + g) / (sqrt(dx dz) 2^l)`. `g` is by how much the ground may
//! differ between the two places under the eye: the greatest slopes of any level from 1 on, times the metres moved.
//! Where level `l` draws the place in one frame and `l + 1` in the other, both terms count: alpha of level `l` was within
//! `D_l / T` of 1 (fact (b): its whole patch is let go at 1), and that of level `l + 1` within `D_{l+1} / T` of 0 (fact
//! (c)). So the bound is the sum over the levels that draw the place in either frame.
//!
//! *Data that arrive late* add the held field's share of alpha: it falls by the time that has passed over
//! [`FADE_S`], or rises by at most 1 a step that the eye moves (see `HeldField`); and, through the ground under the eye,
//! to the climb. Frames that report pops, of a budget too small for anything better, are left out.
//!
//! *Rounding.* Each `d` is off by less than `2^-22 R` steps (a difference and a product of f32, and the climb's rounding),
//! alpha by 2^-24 more, and a height by `2^-22` of the greatest height; each counts twice, once for each frame.

#![allow(clippy::print_stdout, reason = "the greatest changes are printed")]

mod support;

use clipscape::camera::Camera;
use clipscape::clipmap::{Clipmap, ClipmapOptions, FADE_S, Instance, Wait, displace};
use clipscape::grid::PATCH;
use support::facts::patch_of;
use support::motion::{
    ARRIVAL, ARRIVAL_OF_LEVEL_1, Bound, Found, Motion, Surface, TRANSITION, camera, clipmap, creep, frame,
    options, terrain,
};

fn fly(transition: i64, cameras: &[Camera]) -> Found {
    let levels = terrain();
    let bound = Bound::new(&levels);
    let mut clipmap = clipmap(&levels, transition);
    let mut found = Found::default();
    let mut before = frame(&mut clipmap, &levels, &cameras[0], 0.0);
    for pair in cameras.windows(2) {
        let after = frame(&mut clipmap, &levels, &pair[1], 0.0);
        found.add(&bound, [&before, &after], &Motion::of([&pair[0], &pair[1]]));
        before = after;
    }
    found
}

fn assert_smooth(what: &str, found: &Found) {
    println!("{what}: {found:?}");
    assert_eq!(found.pops, 0, "{what}: {found:?}");
}

#[test]
fn creeping_across_a_snap_of_every_window() {
    let found = fly(TRANSITION, &creep(256.0, 70.0, 24));
    assert_smooth("across a snap", &found);
    assert!(found.changed > 10_000, "{found:?}");
}

#[test]
fn creeping_through_the_arrival_of_patches() {
    for x in [ARRIVAL, ARRIVAL_OF_LEVEL_1] {
        let found = fly(TRANSITION, &creep(x, 70.0, 12));
        assert_smooth("arrival of patches", &found);
        assert!(found.handed_over > 50 && found.changed > 10_000, "{found:?}");
    }
}

#[test]
fn control_transition_0_is_caught() {
    let found = fly(0, &creep(ARRIVAL, 70.0, 12));
    println!("transition 0: {found:?}");
    assert!(found.pops > 50 && found.share > 100.0, "{found:?}");
}

/// Heights through which level 0, then level 1, is let go: R steps and some are reached at 263 m over its ground, and
/// twice that.
fn climb(from: f64, to: f64, count: i32) -> Vec<Camera> {
    let height = |k: i32| from + (to - from) * f64::from(k) / f64::from(count - 1);
    (0..count)
        .map(|k| camera(171.4, height(k), 150.3, 80.0))
        .collect()
}

#[test]
fn climbing_through_the_departure_of_levels_and_descending() {
    let (up, mut down) = (climb(150.0, 620.0, 60), climb(150.0, 620.0, 60));
    down.reverse();
    for (what, cameras) in [("climbing", up), ("descending", down)] {
        let found = fly(TRANSITION, &cameras);
        assert_smooth(what, &found);
        assert!(found.handed_over > 5_000, "{found:?}");
    }
    let found = fly(0, &climb(150.0, 620.0, 60));
    assert!(found.pops > 1_000, "control: transition 0 is caught: {found:?}");
}

#[test]
fn turning_on_the_spot_changes_nothing() {
    let turn = |k| camera(ARRIVAL, 70.0, 150.3, 10.0 * f64::from(k));
    let found = fly(TRANSITION, &(0..36).map(turn).collect::<Vec<_>>());
    assert_smooth("turning", &found);
    assert_eq!((found.changed, found.change_m), (0, 0.0));
}

#[test]
fn control_a_level_let_go_before_alpha_is_1_is_caught() {
    let levels = terrain();
    let bound = Bound::new(&levels);
    let mut clipmap = clipmap(&levels, TRANSITION);
    let here = camera(ARRIVAL - 5.0, 70.0, 150.3, 80.0);
    let before = frame(&mut clipmap, &levels, &here, 0.0);
    let mut instances: Vec<_> = clipmap.selection().instances().copied().collect();
    // The parent of a patch of level 0 that is still on its way to 1.
    let early = instances.iter().find(|i| {
        let mut alphas = (0..81).map(|k| displace(&clipmap, i, k % 9, k / 9).alpha);
        i.level == 0 && alphas.any(|alpha| alpha > 0.5) && alphas.any(|alpha| alpha < 0.9)
    });
    let parent = patch_of(early.expect("a patch morphs")).parent();
    instances.retain(|i| patch_of(i).level != 0 || patch_of(i).parent() != parent);
    instances.push(Instance {
        origin: [(parent.a * PATCH) as i32, (parent.b * PATCH) as i32],
        level: parent.level,
        fill: 0.0,
    });
    let after = Surface::new(&clipmap, &instances);
    let mut found = Found::default();
    let moved = camera(ARRIVAL - 5.0 + 0.001, 70.0, 150.3, 80.0);
    found.add(&bound, [&before, &after], &Motion::of([&here, &moved]));
    assert!(found.pops > 50, "{found:?}");
}

/// Flies over data that come under a budget, `fps` frames a second; also how many frames had data missing, and popped.
fn fly_late(cameras: &[Camera], budget_bytes: u64, fps: f64, fade: bool) -> (Found, [u32; 2]) {
    let levels = terrain();
    let bound = Bound::new(&levels);
    let options = ClipmapOptions {
        wait: Wait::None,
        upload_budget_bytes: Some(budget_bytes),
        ..options(TRANSITION)
    };
    let mut clipmap = Clipmap::new(&levels, &options).unwrap();
    let mut found = Found::default();
    let mut counts = [0, 0];
    let mut before = frame(&mut clipmap, &levels, &cameras[0], 0.0);
    for (pair, k) in cameras.windows(2).zip(1..) {
        // Without a fade, as if a second passed from frame to frame: what arrives is there at once.
        let time_s = f64::from(k) / if fade { fps } else { 1.0 };
        let after = frame(&mut clipmap, &levels, &pair[1], time_s);
        let report = clipmap.report();
        counts[0] += u32::from(!report.complete);
        counts[1] += u32::from(report.pops > 0);
        if report.pops == 0 {
            let motion = Motion {
                faded: 1.0 / (fps * FADE_S),
                ..Motion::of([&pair[0], &pair[1]])
            };
            found.add(&bound, [&before, &after], &motion);
        }
        before = after;
    }
    (found, counts)
}

#[test]
fn data_that_arrive_late_fade_in() {
    let spot = vec![camera(171.4, 70.0, 150.3, 80.0); 80];
    let creeping = creep(171.4, 70.0, 80);
    let flying = |k| camera(120.0 + 0.7 * f64::from(k), 70.0, 150.3 + 0.3 * f64::from(k), 80.0);
    for (what, cameras, budget_bytes) in [
        ("on the spot", spot.clone(), 20_000),
        ("creeping", creeping, 20_000),
        ("flying", (0..120).map(flying).collect(), 20_000),
    ] {
        let (found, [late, popped]) = fly_late(&cameras, budget_bytes, 60.0, true);
        println!("{what}: {late} of {} frames late, {popped} popped", cameras.len());
        assert_smooth(what, &found);
        assert!(
            late > 20 && popped * 10 < cameras.len() as u32,
            "{what}: {late}, {popped}"
        );
        assert!(found.change_m > 0.1, "{what}: {found:?}");
    }
    let (found, _) = fly_late(&spot, 20_000, 60.0, false);
    assert!(found.pops > 1_000, "control: without the fade it pops: {found:?}");
}
