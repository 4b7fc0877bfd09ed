//! Data that arrive late, or under a budget: what is drawn meanwhile, without a GPU.

mod support;

use std::sync::atomic::{AtomicU64, Ordering};

use clipscape::camera::{Camera, View};
use clipscape::clipmap::{Clipmap, ClipmapOptions, HEIGHT_BYTES, LIGHT_BYTES, Wait, displace};
use clipscape::grid::{Grid, PATCH, Rect};
use clipscape::levels::{Arrival, Bounds, Levels, LightSample};
use clipscape::{Error, ErrorKind, Result};
use glam::DVec3;
use support::facts::faults;
use support::{Formula, Random, hash, hills, seed};

type Hills = Formula<fn(u32, i64, i64) -> f32>;

/// Levels whose tiles of 256 x 256 arrive at frames of their own.
struct Late {
    levels: Hills,
    /// The level that is there from the first.
    coarsest: u32,
    /// The frame that is being made.
    frame: AtomicU64,
    /// The last frame at which something arrives.
    delay: f64,
    /// Whether tiles that have not arrived are damaged instead.
    damaged: bool,
}

impl Late {
    fn arrived(&self, level: u32, rect: Rect) -> Result<bool> {
        // The coarsest level's light has the resolution of the next finer one.
        if level + 1 >= self.coarsest {
            return Ok(true); // a frame without its coarsest level is tested apart
        }
        let tiles = |first: i64, end: i64| first.div_euclid(256)..(end - 1).div_euclid(256) + 1;
        let frame = self.frame.load(Ordering::Relaxed) as f64;
        let late = |(a, b): (i64, i64)| hash(level, a, b) * self.delay > frame;
        let mut all = tiles(rect.z0, rect.z1).flat_map(|b| tiles(rect.x0, rect.x1).map(move |a| (a, b)));
        let missing = all.any(late);
        if missing && self.damaged {
            return Err(Error::new(ErrorKind::Broken, "tile", format!("{level}: damaged")));
        }
        Ok(!missing)
    }
}

impl Levels for Late {
    fn grid(&self) -> &Grid {
        self.levels.grid()
    }

    fn heights(&self, level: u32, rect: Rect, out: &mut [f32]) -> Result<Arrival> {
        if !self.arrived(level, rect)? {
            out.fill(-7777.0); // unspecified: whoever draws it is caught
            return Ok(Arrival::Missing);
        }
        self.levels.heights(level, rect, out)
    }

    fn bounds(&self, level: u32, patches: Rect, out: &mut [Bounds]) -> Result<Arrival> {
        self.levels.bounds(level, patches, out)
    }

    fn has_light(&self) -> bool {
        true
    }

    fn light(&self, level: u32, rect: Rect, out: &mut [LightSample]) -> Result<Arrival> {
        self.levels.light(level, rect, out)
    }
}

fn view(eye: DVec3) -> View {
    let camera = Camera {
        eye,
        heading_deg: 0.0,
        pitch_deg: -30.0,
        roll_deg: 0.0,
        fov_deg: 60.0,
    };
    View::new(camera, [64, 64]).unwrap()
}

/// Drawn vertices that depend on a sample which has not arrived.
fn unfounded(clipmap: &Clipmap) -> usize {
    let mut count = 0;
    for instance in clipmap.selection().instances() {
        let level = instance.level as usize;
        let size = clipmap.grid().level(instance.level);
        let has = |l: usize, i: i64, j: i64| clipmap.windows()[l].height(i, j).is_some();
        for k in 0..81 {
            let (x, z) = (k % 9, k / 9);
            let alpha = displace(clipmap, instance, x, z).alpha;
            let i = i64::from(instance.origin[0] + x).min(size.width - 1);
            let j = i64::from(instance.origin[1] + z).min(size.height - 1);
            let own = alpha < 1.0 && !has(level, i, j);
            let coarse = |i: i64, j: i64| alpha > 0.0 && !has(level + 1, i, j);
            count += usize::from(own || coarse(i >> 1, j >> 1) || coarse((i + 1) >> 1, (j + 1) >> 1));
        }
    }
    count
}

/// A walk over late data, under a budget or none.
struct Walk {
    late: Late,
    clipmap: Clipmap,
    options: ClipmapOptions,
    random: Random,
    eye: DVec3,
    velocity: DVec3,
    frame: u64,
}

impl Walk {
    fn new(random: &mut Random) -> Self {
        let grid = Grid::new(
            random.pick(&[1201, 2000, 777]),
            random.pick(&[1100, 600]),
            [10.0, 10.0],
        );
        let options = ClipmapOptions {
            clip_size: random.pick(&[64, 64, 128, 256]),
            wait: Wait::None,
            cull: false,
            upload_budget_bytes: random.pick(&[None, Some(1 << 20), Some(40_000), Some(5_000), Some(100)]),
            ..Default::default()
        };
        let late = Late {
            levels: Formula::new(grid, hills),
            coarsest: grid.levels_until(options.clip_size) - 1,
            frame: AtomicU64::new(0),
            delay: random.pick(&[0.0, 5.0, 60.0]),
            damaged: false,
        };
        Self {
            clipmap: Clipmap::new(&late, &options).unwrap(),
            late,
            options,
            eye: DVec3::new(
                random.uniform(0.0, 12e3),
                random.pick(&[200.0, 900.0]),
                random.uniform(0.0, 6e3),
            ),
            velocity: DVec3::ZERO,
            random: Random(random.bits()),
            frame: 0,
        }
    }

    fn step(&mut self) {
        if self.frame.is_multiple_of(10) {
            let speed = self.random.pick(&[0.0, 3.0, 30.0]);
            let mut turn = || self.random.uniform(-speed, speed);
            self.velocity = DVec3::new(turn(), turn() / 8.0, turn());
        }
        if self.random.uniform(0.0, 1.0) < 0.02 {
            self.eye.x = self.random.uniform(-1e3, 13e3);
        }
        self.eye += self.velocity;
        self.late.frame.store(self.frame, Ordering::Relaxed);
        self.clipmap
            .update(&self.late, &view(self.eye), self.frame as f64 / 30.0)
            .unwrap();
        self.frame += 1;
    }
}

#[test]
fn what_is_drawn_is_founded_watertight_and_within_the_budget() {
    let seed = seed(31);
    let mut random = Random(seed);
    let (mut stale, mut complete) = (0, 0);
    for k in 0..16 {
        let mut walk = Walk::new(&mut random);
        for _ in 0..60 {
            walk.step();
            let place = format!("seed {seed}, walk {k}, frame {}: {:?}", walk.frame, walk.options);
            let clipmap = &walk.clipmap;
            assert_eq!(unfounded(clipmap), 0, "{place}");
            let faults = faults(clipmap, clipmap);
            assert!(
                faults.is_empty(),
                "{place}: {} faults, {:?}",
                faults.len(),
                &faults[..faults.len().min(3)]
            );
            let coarsest = clipmap.windows().len() as u32 - 1;
            let within: u64 = clipmap
                .plan()
                .levels()
                .iter()
                .filter(|p| p.level != coarsest)
                .map(|p| {
                    let area = |rects: &[Rect]| rects.iter().map(|r| r.area()).sum::<i64>() as u64;
                    area(&p.heights) * HEIGHT_BYTES + area(&p.light) * LIGHT_BYTES
                })
                .sum();
            let budget = walk.options.upload_budget_bytes.unwrap_or(u64::MAX);
            assert!(within <= budget, "{place}: {within} bytes");
            let report = clipmap.report();
            assert_eq!(report.complete, report.stale_levels == 0, "{place}");
            stale += u32::from(report.stale_levels > 0);
            complete += u32::from(report.complete);
        }
    }
    assert!(
        stale > 200 && complete > 200,
        "{stale} stale, {complete} complete"
    );
}

#[test]
fn what_has_all_arrived_and_faded_in_is_what_a_frame_that_waits_draws() {
    let seed = seed(32);
    let mut random = Random(seed);
    for k in 0..8 {
        let mut walk = Walk::new(&mut random);
        (0..30).for_each(|_| walk.step());
        // Stand still until all is there: at most 500 levels of 0.25 s, once the last tile has come.
        walk.late.delay = 0.0;
        walk.velocity = DVec3::ZERO;
        let mut frames = 0;
        let budget = walk.options.upload_budget_bytes.unwrap_or(u64::MAX);
        while !walk
            .clipmap
            .windows()
            .iter()
            .all(|w| w.missing().next().is_none())
            || !walk.clipmap.report().complete
        {
            let time_s = walk.frame as f64 / 30.0;
            walk.clipmap.update(&walk.late, &view(walk.eye), time_s).unwrap();
            walk.frame += 1;
            frames += 1;
            let enough = 100 + 40_000_000 / budget.max(1);
            assert!(
                frames < enough,
                "seed {seed}, walk {k}: not there after {frames} frames"
            );
        }
        let waiting = ClipmapOptions {
            wait: Wait::All,
            upload_budget_bytes: None,
            ..walk.options
        };
        let mut other = Clipmap::new(&walk.late, &waiting).unwrap();
        other.update(&walk.late, &view(walk.eye), 0.0).unwrap();
        let drawn = |c: &Clipmap| {
            let patch = |i: &clipscape::clipmap::Instance| {
                (0..81).map(|k| displace(c, i, k % 9, k / 9)).collect::<Vec<_>>()
            };
            c.selection()
                .instances()
                .map(|i| (*i, patch(i)))
                .collect::<Vec<_>>()
        };
        // The last of it may still be fading in beyond the reach, where nothing of it is drawn.
        assert!(drawn(&walk.clipmap) == drawn(&other), "seed {seed}, walk {k}");
        assert!(walk.clipmap.take_faults().is_empty());
    }
}

#[test]
fn control_without_the_fade_s_order_the_facts_fail() {
    let seed = seed(33);
    let mut random = Random(seed);
    let mut caught = 0;
    for _ in 0..12 {
        let mut walk = Walk::new(&mut random);
        walk.clipmap.held_mut().set_ordered(false);
        let mut broken = false;
        for _ in 0..40 {
            walk.step();
            broken |= !faults(&walk.clipmap, &walk.clipmap).is_empty();
        }
        caught += u32::from(broken);
    }
    assert!(caught >= 3, "seed {seed}: {caught} of 12");
}

#[test]
fn control_without_the_held_field_missing_samples_are_drawn() {
    let seed = seed(34);
    let mut random = Random(seed);
    let mut caught = 0;
    for _ in 0..12 {
        let mut walk = Walk::new(&mut random);
        walk.clipmap.held_mut().set_fading(false);
        for _ in 0..5 {
            walk.step();
        }
        caught += u32::from(unfounded(&walk.clipmap) > 0);
    }
    assert!(caught >= 3, "seed {seed}: {caught} of 12");
}

#[test]
fn damaged_tiles_are_noted_once_and_drawn_from_the_next_coarser_level() {
    let mut random = Random(seed(35));
    let mut walk = Walk::new(&mut random);
    let options = ClipmapOptions {
        clip_size: 64,
        upload_budget_bytes: None,
        ..walk.options
    };
    (walk.late.damaged, walk.late.delay) = (true, 1e9);
    walk.late.coarsest = walk.late.levels.grid.levels_until(64) - 1;
    walk.eye.y = 50.0;
    walk.clipmap = Clipmap::new(&walk.late, &options).unwrap();
    walk.clipmap
        .update(&walk.late, &view(walk.eye), 0.0)
        .unwrap_or_else(|e| panic!("{e}"));
    let faults = walk.clipmap.take_faults();
    assert!(!faults.is_empty() && faults.iter().all(|f| f.kind() == ErrorKind::Broken));
    for frame in 1..20 {
        let report = *walk
            .clipmap
            .update(&walk.late, &view(walk.eye), frame as f64)
            .unwrap();
        assert!(!report.complete && report.stale_levels > 0);
        assert_eq!(unfounded(&walk.clipmap), 0);
    }
    assert!(
        walk.clipmap.take_faults().is_empty(),
        "ground that stays is not read again"
    );
    // A frame that waits ends with the first of them.
    let options = ClipmapOptions {
        wait: Wait::All,
        ..Default::default()
    };
    let mut waiting = Clipmap::new(&walk.late, &options).unwrap();
    assert_eq!(
        waiting
            .update(&walk.late, &view(walk.eye), 0.0)
            .unwrap_err()
            .kind(),
        ErrorKind::Broken
    );
}

#[test]
fn a_damaged_level_costs_no_more_than_its_own_detail() {
    /// One level cannot be read.
    struct Damaged(Hills, u32);
    impl Levels for Damaged {
        fn grid(&self) -> &Grid {
            self.0.grid()
        }
        fn heights(&self, level: u32, rect: Rect, out: &mut [f32]) -> Result<Arrival> {
            if level == self.1 {
                return Err(Error::new(ErrorKind::Broken, "tile", "damaged"));
            }
            self.0.heights(level, rect, out)
        }
        fn bounds(&self, level: u32, patches: Rect, out: &mut [Bounds]) -> Result<Arrival> {
            self.0.bounds(level, patches, out)
        }
        fn has_light(&self) -> bool {
            true
        }
        fn light(&self, level: u32, rect: Rect, out: &mut [LightSample]) -> Result<Arrival> {
            self.0.light(level, rect, out)
        }
    }
    let grid = Grid::new(1200, 900, [10.0, 10.0]);
    let coarsest = grid.levels_until(64) - 1;
    let options = ClipmapOptions {
        clip_size: 64,
        wait: Wait::None,
        ..Default::default()
    };
    for damaged in 0..=coarsest {
        let levels = Damaged(Formula::new(grid, hills), damaged);
        let mut clipmap = Clipmap::new(&levels, &options).unwrap();
        let spot = view(DVec3::new(6000.0, 50.0, 4500.0));
        let update = clipmap.update(&levels, &spot, 0.0);
        if damaged == coarsest {
            // Nothing could be drawn instead.
            assert_eq!(update.unwrap_err().kind(), ErrorKind::Broken);
            continue;
        }
        assert!(!update.unwrap().complete);
        let finest = clipmap.selection().instances().map(|i| i.level).min();
        assert_eq!(finest, Some(damaged + 1), "level {damaged} is damaged");
        assert_eq!(unfounded(&clipmap), 0);
        assert!(!clipmap.take_faults().is_empty());
        // Its light is there, half as fine: that of another level would say it lies elsewhere.
        let window = &clipmap.windows()[damaged as usize + 1];
        let own = |i: i64, j: i64| Hills::light_at(damaged + 1, i, j).sun.to_f32();
        let at = window.light_resident();
        for (i, j) in [(at.x0 + 4, at.z0 + 6), (at.x1 - 9, at.z0 + 3)] {
            let [x, z] = window.light_slot_of(i, j);
            let texel = window.light()[(z * window.light_size() + x) as usize][0].to_f32();
            let mean = (own(i >> 1, j >> 1) + own((i + 1) >> 1, (j + 1) >> 1)) / 2.0;
            assert!((texel - mean).abs() < 1e-3, "level {damaged}: {texel} for {mean}");
        }
    }
}

#[test]
fn a_frame_is_complete_only_if_it_is_what_a_frame_that_waits_draws() {
    let seed = seed(38);
    let mut random = Random(seed);
    let (mut complete, mut differing) = (0, 0);
    for k in 0..10 {
        // White noise: the ground from which the climb is measured differs by kilometres from level to level.
        let grid = Grid::new(600, 500, [10.0, 10.0]);
        let noise: fn(u32, i64, i64) -> f32 = |l, i, j| 2000.0 * hash(l, i, j) as f32;
        let levels = Formula::new(grid, noise);
        let late = ClipmapOptions {
            clip_size: 64,
            wait: Wait::None,
            upload_budget_bytes: Some(random.pick(&[0, 5_000, 40_000])),
            cull: false,
            ..Default::default()
        };
        let waiting = ClipmapOptions {
            wait: Wait::All,
            upload_budget_bytes: None,
            ..late
        };
        let mut late = Clipmap::new(&levels, &late).unwrap();
        let mut waiting = Clipmap::new(&levels, &waiting).unwrap();
        let mut eye = DVec3::new(3000.0, random.uniform(500.0, 4000.0), 2500.0);
        for frame in 0..40 {
            eye += DVec3::new(random.uniform(-40.0, 40.0), 0.0, random.uniform(-40.0, 40.0));
            let report = *late.update(&levels, &view(eye), frame as f64 / 10.0).unwrap();
            waiting.update(&levels, &view(eye), 0.0).unwrap();
            let drawn = |c: &Clipmap| {
                let heights = |i: &clipscape::clipmap::Instance| {
                    (0..81)
                        .map(|k| displace(c, i, k % 9, k / 9).height.to_bits())
                        .collect::<Vec<_>>()
                };
                c.selection()
                    .instances()
                    .map(|i| (i.level, i.origin, heights(i)))
                    .collect::<Vec<_>>()
            };
            let same = drawn(&late) == drawn(&waiting);
            assert!(same || !report.complete, "seed {seed}, walk {k}, frame {frame}");
            complete += u32::from(report.complete);
            differing += u32::from(!same);
        }
    }
    assert!(
        complete > 20 && differing > 20,
        "seed {seed}: {complete} complete, {differing} differing"
    );
}

#[test]
fn ground_that_is_missing_is_met_gently_unless_the_budget_is_far_too_small() {
    let levels: Hills = Formula::new(Grid::new(1200, 900, [10.0, 10.0]), hills);
    let options = ClipmapOptions {
        clip_size: 256,
        wait: Wait::None,
        upload_budget_bytes: Some(20_000),
        ..Default::default()
    };
    let pops = |stride: f64| {
        let mut clipmap = Clipmap::new(&levels, &options).unwrap();
        let eye = |k: i32| DVec3::new(10.0 * (400.0 + f64::from(k) * stride), 50.0, 4500.0);
        let mut time_s = 0.0;
        while !clipmap.update(&levels, &view(eye(0)), time_s).unwrap().complete {
            time_s += 1.0;
        }
        let (mut pops, mut stale) = (0, 0);
        for k in 0..200 {
            let report = *clipmap
                .update(&levels, &view(eye(k)), time_s + f64::from(k))
                .unwrap();
            pops += report.pops;
            stale += report.stale_levels;
        }
        (pops, stale > 0)
    };
    assert_eq!(pops(0.2), (0, false), "the budget suffices");
    assert!(pops(1.6).1, "it does not");
    let (pops, stale) = pops(4.0);
    assert!(pops > 0 && stale, "{pops} pops");
}

#[test]
fn without_its_coarsest_level_nothing_is_drawn() {
    struct Nothing(Hills);
    impl Levels for Nothing {
        fn grid(&self) -> &Grid {
            self.0.grid()
        }
        fn heights(&self, _: u32, _: Rect, _: &mut [f32]) -> Result<Arrival> {
            Ok(Arrival::Missing)
        }
        fn bounds(&self, level: u32, patches: Rect, out: &mut [Bounds]) -> Result<Arrival> {
            self.0.bounds(level, patches, out)
        }
        fn has_light(&self) -> bool {
            false
        }
        fn light(&self, _: u32, _: Rect, _: &mut [LightSample]) -> Result<Arrival> {
            Ok(Arrival::Missing)
        }
    }
    let levels = Nothing(Formula::new(Grid::new(700, 700, [1.0, 1.0]), hills));
    let options = ClipmapOptions {
        wait: Wait::None,
        ..Default::default()
    };
    let mut clipmap = Clipmap::new(&levels, &options).unwrap();
    let report = *clipmap
        .update(&levels, &view(DVec3::new(300.0, 50.0, 300.0)), 0.0)
        .unwrap();
    assert!(!report.complete && report.patches == 0 && report.triangles == 0);
    let error = Clipmap::new(&levels, &ClipmapOptions::default())
        .unwrap()
        .update(&levels, &view(DVec3::ZERO), 0.0)
        .unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Unsupported);
}

#[test]
fn a_budget_needs_frames_that_do_not_wait() {
    let options = ClipmapOptions {
        upload_budget_bytes: Some(1000),
        ..Default::default()
    };
    assert_eq!(options.check().unwrap_err().kind(), ErrorKind::Misuse);
    let levels: Hills = Formula::new(Grid::new(70, 70, [1.0, 1.0]), hills);
    let error = Clipmap::new(&levels, &ClipmapOptions::default())
        .unwrap()
        .update(&levels, &view(DVec3::ZERO), f64::NAN)
        .unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Misuse);
    assert_eq!(PATCH, 8);
}
