//! Windows and their update plans against naive re-reads, without a GPU.

mod support;

use clipscape::camera::{Camera, View};
use clipscape::clipmap::{Clipmap, ClipmapOptions, LevelPlan, light_level};
use clipscape::grid::{Grid, Rect, slot};
use clipscape::levels::Levels;
use glam::DVec3;
use support::{Formula, Random, hash, seed};

fn view(x: f64, z: f64) -> View {
    let eye = DVec3::new(x, 500.0, z);
    let camera = Camera {
        eye,
        heading_deg: 30.0,
        pitch_deg: -20.0,
        roll_deg: 0.0,
        fov_deg: 60.0,
    };
    View::new(camera, [64, 64]).unwrap()
}

/// A texture as the GPU would hold it: `n` x `n` slots that only the plan's rectangles write.
struct Torus {
    n: i64,
    shift: [i64; 2],
    slots: Vec<f32>,
}

impl Torus {
    fn write(&mut self, rect: Rect, value: impl Fn(i64, i64) -> f32) {
        let first = [
            slot(rect.x0 + self.shift[0], self.n),
            slot(rect.z0 + self.shift[1], self.n),
        ];
        for (i, j) in rect.cells() {
            // As a sub-region write does it: from the first slot on, without wrapping.
            let (x, z) = (first[0] + i - rect.x0, first[1] + j - rect.z0);
            assert!(x < self.n && z < self.n, "{rect:?} crosses the seam");
            self.slots[(z * self.n + x) as usize] = value(i, j);
        }
    }

    fn at(&self, i: i64, j: i64) -> f32 {
        self.slots[(slot(j + self.shift[1], self.n) * self.n + slot(i + self.shift[0], self.n)) as usize]
    }
}

fn assert_exact_cover(rects: &[Rect], from: Rect, to: Rect, what: &str) {
    let area: i64 = rects.iter().map(|r| r.area()).sum();
    assert_eq!(area, to.area() - to.intersection(from).area(), "{what}: area");
    for (k, r) in rects.iter().enumerate() {
        assert!(
            to.contains_rect(*r) && r.intersection(from).is_empty(),
            "{what}: {r:?} is not newly exposed"
        );
        assert!(
            rects[..k].iter().all(|s| s.intersection(*r).is_empty()),
            "{what}: {r:?} overlaps another"
        );
    }
}

/// Random walks with teleports; `spoil` may damage each level's plan. Says what first went wrong.
fn walk(moves: usize, seed: u64, spoil: impl Fn(&mut LevelPlan)) -> Result<(), String> {
    let mut random = Random(seed);
    for (width, height, n, offset) in [
        (1201, 777, 64, [0, 0]),
        (300, 1000, 128, [-12_345, 1 << 40]),
        (90, 50, 64, [7, 7]),
    ] {
        let mut grid = Grid::new(width, height, [3.0, 5.0]);
        grid.offset = offset;
        let value = |l: u32, i: i64, j: i64| hash(l, i, j) as f32;
        let levels = Formula::new(grid, value);
        let options = ClipmapOptions {
            clip_size: n,
            ..Default::default()
        };
        let mut clipmap = Clipmap::new(&levels, &options).unwrap();
        let torus = |l: u32, n| Torus {
            n,
            shift: offset.map(|o| o >> l),
            slots: vec![f32::NAN; (n * n) as usize],
        };
        let count = clipmap.windows().len() as u32;
        let mut heights: Vec<_> = (0..count).map(|l| torus(l, n)).collect();
        let mut light: Vec<_> = (0..count).map(|l| torus(light_level(l), 2 * n)).collect();
        let (mut x, mut z) = (0.0f64, 0.0f64);
        for step in 0..moves {
            let place = format!("seed {seed}, {width} x {height}, move {step}");
            if random.uniform(0.0, 1.0) < 0.02 {
                // Teleports reach far off the DEM, to negative coordinates too.
                x = random.uniform(-2.0, 3.0) * width as f64 * 3.0;
                z = random.uniform(-2.0, 3.0) * height as f64 * 5.0;
            } else {
                let stride = random.pick(&[0.1, 3.0, 50.0]);
                x += random.uniform(-stride, stride);
                z += random.uniform(-stride, stride);
            }
            let report = *clipmap.update(&levels, &view(x, z), 0.0).unwrap();
            assert_eq!(report.upload_bytes, report.upload_bytes_exposed, "{place}");
            for plan in clipmap.plan().levels() {
                let (l, window) = (plan.level, &clipmap.windows()[plan.level as usize]);
                let mut plan = plan.clone();
                spoil(&mut plan);
                if plan.heights.len() == clipmap.plan().levels()[(count - 1 - l) as usize].heights.len() {
                    assert_exact_cover(&plan.heights, plan.from, plan.to, &format!("{place}, level {l}"));
                    let light_from = if plan.from.is_empty() {
                        Rect::EMPTY
                    } else {
                        window.light_of(plan.from)
                    };
                    assert_exact_cover(&plan.light, light_from, window.light_of(plan.to), &place);
                }
                plan.heights
                    .iter()
                    .for_each(|r| heights[l as usize].write(*r, |i, j| value(l, i, j)));
                let sun = |i, j| {
                    Formula::<fn(u32, i64, i64) -> f32>::light_at(light_level(l), i, j)
                        .sun
                        .to_f32()
                };
                plan.light.iter().for_each(|r| light[l as usize].write(*r, sun));
                for (i, j) in window.resident().cells() {
                    let naive = value(l, i, j);
                    if heights[l as usize].at(i, j) != naive || window.height(i, j) != Some(naive) {
                        return Err(format!("{place}, level {l}: sample ({i}, {j}) is stale"));
                    }
                }
                if step % 16 == 0 {
                    for (i, j) in window.light_resident().cells() {
                        let [sx, sz] = window.light_slot_of(i, j);
                        let mirror = window.light()[(sz * window.light_size() + sx) as usize][0].to_f32();
                        if light[l as usize].at(i, j) != sun(i, j) || mirror != sun(i, j) {
                            return Err(format!("{place}, level {l}: light ({i}, {j}) is stale"));
                        }
                    }
                }
            }
        }
    }
    Ok(())
}

#[test]
fn planned_contents_equal_a_naive_re_read_after_any_walk() {
    // 3 x 3,400 moves and teleports.
    walk(3_400, seed(1), |_| {}).unwrap();
}

#[test]
fn control_a_plan_that_forgets_a_rectangle_is_caught() {
    let forget = |plan: &mut LevelPlan| {
        plan.heights.pop();
    };
    assert!(walk(100, seed(1), forget).unwrap_err().contains("stale"));
    let shrink = |plan: &mut LevelPlan| plan.light.iter_mut().for_each(|r| r.x1 -= 1);
    let shrunk = std::panic::catch_unwind(|| walk(100, seed(1), shrink));
    assert!(shrunk.is_err() || shrunk.unwrap().is_err());
}

#[test]
fn windows_hold_all_that_the_ring_reaches() {
    let mut random = Random(seed(2));
    for _ in 0..20_000 {
        let n = random.pick(&[64i64, 128, 256]);
        let grid = Grid::new(random.pick(&[1201, 5000]), random.pick(&[1201, 300]), [1.0, 1.0]);
        let level = random.pick(&[0u32, 1, 2, 3]);
        let size = grid.level(level);
        let (x, z) = (random.uniform(-100.0, 6000.0), random.uniform(-100.0, 1300.0));
        let eye = clipscape::clipmap::Eye::new(view(x, z).eye, &grid);
        let window = clipscape::clipmap::Window::placed(size, n, level, &eye);
        let (reach, step) = ((n / 2 - 2) as f64, (1i64 << level) as f64);
        let within = |e: f64, samples: i64| {
            // Samples nearer than the reach, and one more on each side for what is interpolated between them.
            let low = (e / step - reach).floor() as i64;
            let high = (e / step + reach).ceil() as i64;
            (low.clamp(0, samples), (high + 1).clamp(0, samples))
        };
        let ((x0, x1), (z0, z1)) = (within(x, size.width), within(z, size.height));
        assert!(
            window.contains_rect(Rect::new(x0, z0, x1, z1)),
            "{window:?} at {x}, {z}, level {level}, clip size {n}"
        );
        assert!(size.rect().contains_rect(window));
    }
}

#[test]
fn a_source_that_fails_leaves_a_window_that_heals() {
    use std::sync::atomic::{AtomicBool, Ordering};
    struct Flaky(Formula<fn(u32, i64, i64) -> f32>, AtomicBool);
    impl Levels for Flaky {
        fn grid(&self) -> &Grid {
            self.0.grid()
        }
        fn heights(&self, l: u32, r: Rect, out: &mut [f32]) -> clipscape::Result<clipscape::levels::Arrival> {
            if self.1.load(Ordering::Relaxed) {
                return Err(clipscape::Error::new(
                    clipscape::ErrorKind::Broken,
                    "tile",
                    "damaged",
                ));
            }
            self.0.heights(l, r, out)
        }
        fn bounds(
            &self,
            l: u32,
            r: Rect,
            out: &mut [clipscape::levels::Bounds],
        ) -> clipscape::Result<clipscape::levels::Arrival> {
            self.0.bounds(l, r, out)
        }
        fn has_light(&self) -> bool {
            false
        }
        fn light(
            &self,
            l: u32,
            r: Rect,
            out: &mut [clipscape::levels::LightSample],
        ) -> clipscape::Result<clipscape::levels::Arrival> {
            self.0.light(l, r, out)
        }
    }
    let value: fn(u32, i64, i64) -> f32 = |l, i, j| hash(l, i, j) as f32;
    let levels = Flaky(
        Formula::new(Grid::new(700, 700, [1.0, 1.0]), value),
        AtomicBool::new(false),
    );
    let mut clipmap = Clipmap::new(
        &levels,
        &ClipmapOptions {
            clip_size: 64,
            ..Default::default()
        },
    )
    .unwrap();
    clipmap.update(&levels, &view(300.0, 300.0), 0.0).unwrap();
    levels.1.store(true, Ordering::Relaxed);
    assert!(clipmap.update(&levels, &view(310.0, 303.0), 0.0).is_err());
    levels.1.store(false, Ordering::Relaxed);
    clipmap.update(&levels, &view(311.0, 303.0), 0.0).unwrap();
    for window in clipmap.windows() {
        for (i, j) in window.resident().cells() {
            assert_eq!(window.height(i, j), Some(value(window.level(), i, j)));
        }
    }
}

#[test]
fn slopes_have_the_ramp_s_direction_and_size_on_every_level() {
    // Rises by 0.5 to the east and falls by 0.25 to the south, over columns and rows of unlike spacing.
    let grid = Grid::new(500, 400, [4.0, 10.0]);
    let ramp = |l: u32, i: i64, j: i64| (0.5 * 4.0 * (i << l) as f64 - 0.25 * 10.0 * (j << l) as f64) as f32;
    let levels = Formula::new(grid, ramp);
    let mut clipmap = Clipmap::new(
        &levels,
        &ClipmapOptions {
            clip_size: 64,
            ..Default::default()
        },
    )
    .unwrap();
    clipmap.update(&levels, &view(900.0, 1700.0), 0.0).unwrap();
    assert!(clipmap.windows().len() >= 4);
    for window in clipmap.windows() {
        assert!(!window.light_resident().is_empty());
        for (i, j) in window.light_resident().cells() {
            let [x, z] = window.light_slot_of(i, j);
            let texel = window.light()[(z * window.light_size() + x) as usize];
            assert_eq!(
                [texel[2].to_f32(), texel[3].to_f32()],
                [0.5, -0.25],
                "level {}: ({i}, {j})",
                window.level()
            );
        }
    }
}
