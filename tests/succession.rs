//! Better data that take the place of what is drawn: piece by piece within the budget, watertight, and in the end all of
//! it.

#![allow(clippy::print_stdout, reason = "what was found is printed")]

mod support;

use std::sync::atomic::{AtomicU64, Ordering};

use clipscape::Result;
use clipscape::clipmap::{Clipmap, ClipmapOptions, Uncertified, Wait, certify};
use clipscape::grid::{Grid, Rect};
use clipscape::levels::{Arrival, Bounds, Levels, LightSample};
use glam::DVec3;
use support::flights::view;
use support::{Formula, facts, hash, hills};

type Hills = Formula<fn(u32, i64, i64) -> f32>;

/// A draft, then what it stands for.
struct Editions {
    levels: [Hills; 2],
    edition: AtomicU64,
}

impl Editions {
    fn new() -> Self {
        let grid = Grid::new(700, 600, [10.0, 10.0]);
        let whole: fn(u32, i64, i64) -> f32 = |level, i, j| {
            let void = hash(5, (i << level) / 40, (j << level) / 40) < 0.02;
            if void { f32::NAN } else { hills(level, i, j) }
        };
        let mut draft = Formula::new(grid, draft as fn(u32, i64, i64) -> f32);
        draft.has_light = false;
        Self {
            levels: [draft, Formula::new(grid, whole)],
            edition: AtomicU64::new(0),
        }
    }

    fn now(&self) -> &Hills {
        &self.levels[self.edition.load(Ordering::Relaxed) as usize]
    }
}

/// Flat, and where the DEM has ground: it has no voids.
fn draft(_: u32, _: i64, _: i64) -> f32 {
    -12.5
}

impl Levels for Editions {
    fn grid(&self) -> &Grid {
        &self.levels[0].grid
    }

    fn heights(&self, level: u32, rect: Rect, out: &mut [f32]) -> Result<Arrival> {
        self.now().heights(level, rect, out)
    }

    fn bounds(&self, level: u32, patches: Rect, out: &mut [Bounds]) -> Result<Arrival> {
        self.now().bounds(level, patches, out)
    }

    fn has_light(&self) -> bool {
        self.now().has_light()
    }

    fn light(&self, level: u32, rect: Rect, out: &mut [LightSample]) -> Result<Arrival> {
        self.now().light(level, rect, out)
    }

    fn edition(&self) -> u64 {
        self.edition.load(Ordering::Relaxed)
    }

    fn is_provisional(&self) -> bool {
        self.edition() == 0
    }
}

fn options(upload_budget_bytes: Option<u64>) -> ClipmapOptions {
    ClipmapOptions {
        clip_size: 64,
        wait: Wait::None,
        cull: false,
        upload_budget_bytes,
        ..Default::default()
    }
}

/// Samples that are the draft's, and those of the whole. Fails where there are others.
fn samples(clipmap: &Clipmap, editions: &Editions) -> [usize; 2] {
    let mut counts = [0, 0];
    for window in clipmap.windows() {
        for (i, j) in window.arrived().into_iter().flat_map(|rect| rect.cells()) {
            let height = window.height(i, j).expect("it has arrived");
            let whole = (editions.levels[1].height)(window.level(), i, j);
            match height.to_bits() == whole.to_bits() || height.is_nan() && whole.is_nan() {
                true => counts[1] += 1,
                false if height == draft(0, i, j) => counts[0] += 1,
                false => panic!("({i}, {j}) of level {} is {height}", window.level()),
            }
        }
    }
    counts
}

/// Heights, light, bounds.
type Contents = (Vec<u32>, Vec<[u16; 4]>, Vec<String>);

/// What a window holds, as bits: heights, light, and the bounds of each patch. Whether one has voids may be said in vain of
/// samples that have left the window.
fn contents(clipmap: &Clipmap) -> Vec<Contents> {
    let of = |window: &clipscape::clipmap::Window| {
        let heights = window
            .resident()
            .cells()
            .map(|(i, j)| window.slot_height(i, j).to_bits());
        let texels = window.light_resident().cells().map(|(i, j)| {
            let [x, z] = window.light_slot_of(i, j);
            window.light()[(z * window.light_size() + x) as usize].map(|half| half.to_bits())
        });
        let patches = window
            .resident()
            .touching_patches(clipmap.grid().level(window.level()));
        let known = patches
            .cells()
            .map(|(a, b)| format!("{:?}", window.patch(a, b).map(|p| p.bounds)));
        (heights.collect(), texels.collect(), known.collect())
    };
    clipmap.windows().iter().map(of).collect()
}

/// Flies over the draft, then on while the whole takes its place, until that has; the most bytes of a frame after the
/// first, and the frames in which both were drawn.
fn fly(budget_bytes: Option<u64>, step_m: f64) -> (u64, u32) {
    let editions = Editions::new();
    let mut clipmap = Clipmap::new(&editions, &options(budget_bytes)).unwrap();
    let (mut most, mut mixed, mut since) = (0, 0, None);
    for k in 0..4000 {
        let flown_m = step_m * f64::from(k.min(300));
        let spot = view(DVec3::new(2000.0 + flown_m, 300.0, 2500.0 + 0.4 * flown_m));
        if k == 100 {
            editions.edition.store(1, Ordering::Relaxed);
        }
        let report = *clipmap.update(&editions, &spot, f64::from(k) / 30.0).unwrap();
        if k > 0 {
            most = most.max(report.upload_bytes);
        }
        assert_eq!(report.upload_bytes, clipmap.plan().bytes());
        let [old, new] = samples(&clipmap, &editions);
        assert!(k >= 100 || new == 0, "frame {k}");
        if old > 0 && new > 0 {
            mixed += 1;
            assert!(report.provisional && !report.complete, "frame {k}");
            assert_eq!(certify(&clipmap).unwrap().error_px, Err(Uncertified::Provisional));
        }
        if k % 7 == 0 || (100..130).contains(&k) {
            let faults = facts::faults(&clipmap, &clipmap);
            assert!(
                faults.is_empty(),
                "frame {k}: {:?}",
                &faults[..faults.len().min(3)]
            );
        }
        if k > 100 && report.complete && old == 0 {
            let since = *since.get_or_insert(k);
            if k > since + 20 && k > 320 {
                break;
            }
        }
    }
    assert!(clipmap.report().complete && !clipmap.report().provisional && clipmap.has_light());
    let mut fresh = Clipmap::new(&editions, &options(None)).unwrap();
    let flown_m = step_m * 300.0;
    let spot = view(DVec3::new(2000.0 + flown_m, 300.0, 2500.0 + 0.4 * flown_m));
    for k in 0..40 {
        fresh.update(&editions, &spot, f64::from(k)).unwrap();
    }
    assert!(contents(&clipmap) == contents(&fresh), "{step_m} m a frame");
    (most, mixed)
}

#[test]
fn what_replaces_a_draft_keeps_to_the_budget_and_ends_as_if_there_had_been_none() {
    for (budget_bytes, step_m) in [(20_000, 0.0), (20_000, 3.0), (60_000, 12.0)] {
        let (most, mixed) = fly(Some(budget_bytes), step_m);
        println!("{budget_bytes} bytes a frame, {step_m} m: at most {most}, {mixed} frames show both");
        assert!(most <= budget_bytes, "{most} bytes in a frame");
        assert!(mixed > 5, "{mixed} frames");
    }
    // Control: a level is more than the budget, and comes at once where there is none.
    let (most, _) = fly(None, 0.0);
    assert!(most > 140_000, "{most} bytes in a frame");
}
