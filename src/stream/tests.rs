//! Tiles, loaders and views, over levels that count what is read of them.

use std::collections::HashMap;
use std::sync::{Arc, Barrier, Mutex};
use std::time::{Duration, Instant};

use super::stage::{Current, Stage};
use super::tiles::{Patience, Tiles};
use super::{Arriving, LEAST_TILE_BYTES, Terrain, TileOptions};
use crate::error::{Error, ErrorKind, Result};
use crate::grid::{Grid, Rect};
use crate::levels::{Arrival, Bounds, Data, DaySample, Levels, LightSample, Wanted};
use crate::progress::Silent;
use crate::terrain::testing::{Arrays, Look, Random, all_bits};

/// Arrays that count the reads of each rectangle, and take their time.
struct Counted {
    arrays: Arrays,
    reads: Mutex<HashMap<(Data, u32, Rect), u32>>,
    delay: Duration,
    /// Panics, or fails, where heights of level 0 are asked for.
    broken: Option<bool>,
}

impl Counted {
    fn new(arrays: Arrays) -> Self {
        Self {
            arrays,
            reads: Mutex::default(),
            delay: Duration::ZERO,
            broken: None,
        }
    }

    fn count(&self, data: Data, level: u32, rect: Rect) -> Result<()> {
        *self.reads.lock().unwrap().entry((data, level, rect)).or_default() += 1;
        std::thread::sleep(self.delay);
        match self.broken.filter(|_| (data, level) == (Data::Heights, 0)) {
            Some(true) => panic!("a reader that panics on purpose"),
            Some(false) => Err(Error::new(ErrorKind::Broken, "tile", "damaged")),
            None => Ok(()),
        }
    }

    fn reads(&self) -> Vec<u32> {
        self.reads.lock().unwrap().values().copied().collect()
    }
}

impl Levels for Counted {
    fn grid(&self) -> &Grid {
        self.arrays.grid()
    }

    fn heights(&self, level: u32, rect: Rect, out: &mut [f32]) -> Result<Arrival> {
        self.count(Data::Heights, level, rect)?;
        self.arrays.heights(level, rect, out)
    }

    fn bounds(&self, level: u32, patches: Rect, out: &mut [Bounds]) -> Result<Arrival> {
        self.count(Data::Bounds, level, patches)?;
        self.arrays.bounds(level, patches, out)
    }

    fn has_light(&self) -> bool {
        self.arrays.has_light()
    }

    fn light(&self, level: u32, rect: Rect, out: &mut [LightSample]) -> Result<Arrival> {
        self.count(Data::Light, level, rect)?;
        self.arrays.light(level, rect, out)
    }

    fn has_day(&self) -> bool {
        self.arrays.has_day()
    }

    fn day(&self, level: u32, rect: Rect, out: &mut [DaySample]) -> Result<Arrival> {
        self.count(Data::Day, level, rect)?;
        self.arrays.day(level, rect, out)
    }
}

fn options(loaders: usize) -> TileOptions {
    TileOptions {
        memory_bytes: LEAST_TILE_BYTES,
        loaders,
    }
}

/// A terrain that answers from `source`, and its tiles.
fn current(source: Arc<dyn Levels>, loaders: usize) -> (Arc<Current>, Arc<Tiles>) {
    let stage = Stage::computed(source, 32, &options(loaders));
    let tiles = stage.tiles.clone().expect("it has been given some");
    (Arc::new(Current::new(stage)), tiles)
}

fn arrays(seed: u64) -> Arrays {
    Arrays::random(700, 530, true, Look::Smooth, seed)
}

/// All there is to want, coarse levels first.
fn everything(levels: &dyn Levels) -> Vec<Wanted> {
    let grid = *levels.grid();
    let of = |level: u32| {
        let want = move |data, rect| Wanted { data, level, rect };
        [
            want(Data::Bounds, grid.patches(level).rect()),
            want(Data::Heights, grid.level(level).rect()),
            want(Data::Light, grid.level(level).rect()),
            want(Data::Day, grid.level(level).rect()),
        ]
    };
    (0..levels.level_count()).rev().flat_map(of).collect()
}

/// Waits until nothing more is on its way.
fn settle(arriving: &Arriving) {
    let start = Instant::now();
    while !arriving.is_idle() {
        assert!(start.elapsed() < Duration::from_secs(60), "it never settles");
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn what_arrives_is_what_was_there_and_is_read_once_for_all_views() {
    let want = all_bits(&arrays(1)).unwrap();
    for loaders in [1, 2, 4] {
        let source = Arc::new(Counted::new(arrays(1)));
        let (current, _) = current(source.clone(), loaders);
        let views: Vec<_> = (0..3).map(|_| Arriving::new(current.clone())).collect();
        let mut all: Vec<f32> = vec![0.0; 700 * 530];
        let whole = Rect::new(0, 0, 700, 530);
        assert_eq!(views[0].heights(0, whole, &mut all).unwrap(), Arrival::Missing);
        views.iter().for_each(|view| view.want(&everything(view)));
        settle(&views[0]);
        for view in &views {
            assert!(all_bits(view).unwrap() == want, "{loaders} loaders");
        }
        let reads = source.reads();
        assert!(reads.len() > 20 && reads.iter().all(|n| *n == 1), "{reads:?}");
    }
}

#[test]
fn those_who_wait_together_read_together_once() {
    let mut source = Counted::new(arrays(2));
    source.delay = Duration::from_millis(3);
    let source = Arc::new(source);
    for loaders in [0, 2] {
        source.reads.lock().unwrap().clear();
        let tiles = Tiles::new(source.clone(), 32, &options(loaders));
        let barrier = Barrier::new(4);
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    barrier.wait();
                    tiles.want(0, &everything(source.as_ref()));
                    for w in everything(source.as_ref())
                        .iter()
                        .filter(|w| w.data == Data::Heights)
                    {
                        let mut out = vec![0f32; w.rect.area() as usize];
                        let arrival = tiles.copy(w.data, w.level, w.rect, &mut out, Patience::Retry);
                        assert_eq!(arrival.unwrap(), Arrival::Arrived);
                        let bits = |of: &[f32]| of.iter().map(|h| h.to_bits()).collect::<Vec<_>>();
                        assert!(bits(&out) == bits(&source.arrays.heights[w.level as usize]));
                    }
                });
            }
        });
        assert!(source.reads().iter().all(|n| *n == 1));
    }
}

#[test]
fn a_tile_that_cannot_be_read_is_a_fault_and_read_once_even_if_its_reader_panics() {
    for panics in [false, true] {
        let mut source = Counted::new(arrays(3));
        source.broken = Some(panics);
        let source = Arc::new(source);
        let (current, tiles) = current(source.clone(), 2);
        let view = Arriving::new(current);
        let rect = Rect::new(10, 10, 20, 20);
        let mut out = [0f32; 100];
        view.want(&[Wanted {
            data: Data::Heights,
            level: 0,
            rect,
        }]);
        settle(&view);
        for _ in 0..3 {
            assert_eq!(
                view.heights(0, rect, &mut out).unwrap_err().kind(),
                ErrorKind::Broken
            );
        }
        assert_eq!(source.reads(), [1]);
        // Whoever waits may try again.
        assert!(
            tiles
                .copy(Data::Heights, 0, rect, &mut out, Patience::Retry)
                .is_err()
        );
        assert_eq!(source.reads(), [2]);
        assert!(view.heights(1, rect, &mut out).unwrap() == Arrival::Missing);
        settle(&view);
        assert!(view.heights(1, rect, &mut out).unwrap() == Arrival::Arrived);
    }
}

#[test]
fn views_that_are_gone_want_nothing_and_loaders_end_with_their_tiles() {
    let mut source = Counted::new(arrays(4));
    source.delay = Duration::from_millis(2);
    let source = Arc::new(source);
    let (current, tiles) = current(source.clone(), 2);
    let view = Arriving::new(current.clone());
    view.want(&everything(source.as_ref()));
    drop(view);
    let other = Arriving::new(current.clone());
    settle(&other);
    assert!(
        source.reads().len() < 12,
        "{} tiles were read in vain",
        source.reads().len()
    );
    drop((other, tiles, current));
    // The loaders held the source too.
    assert_eq!(Arc::strong_count(&source), 1);
}

#[test]
fn the_budget_holds_whoever_reads() {
    let random = &mut Random::new(6);
    let grid = Grid::new(9000, 9000, [1.0, 1.0]);
    let synth = Arc::new(crate::source::Synth::new(9000, 3).unwrap());
    let (current, tiles) = current(synth, 2);
    let views: Vec<_> = (0..2).map(|_| Arriving::new(current.clone())).collect();
    let some = |random: &mut Random| {
        let (x, z) = (random.below(8700), random.below(8700));
        Rect::new(x, z, x + 256, z + 256).intersection(grid.level(0).rect())
    };
    for _ in 0..30 {
        for view in &views {
            let rects = (0..20).map(|_| some(random));
            let wanted = rects.map(|rect| Wanted {
                data: Data::Heights,
                level: 0,
                rect,
            });
            view.want(&wanted.collect::<Vec<_>>());
        }
        std::thread::sleep(Duration::from_millis(3));
    }
    // However busy the machine is, some come.
    for _ in 0..30_000 {
        if tiles.most_bytes() > 1 << 20 {
            break;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    assert!(tiles.most_bytes() <= LEAST_TILE_BYTES, "{}", tiles.most_bytes());
    assert!(tiles.most_bytes() > 1 << 20);
}

#[test]
fn a_terrain_file_gives_the_same_through_tiles_waiting_or_not() {
    let arrays = arrays(7);
    let want = all_bits(&arrays).unwrap();
    let terrain = Terrain::from_bytes("t", Arc::new(arrays.file()), &Silent).unwrap();
    assert!(all_bits(&terrain).unwrap() == want);
    let terrain = terrain.with_tiles(&options(1)).unwrap();
    let arriving = terrain.arriving();
    arriving.wait_for(&everything(&arriving));
    assert!(all_bits(&arriving).unwrap() == want);
    assert!(terrain.with_tiles(&options(0)).is_err());
}
