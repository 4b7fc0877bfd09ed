//! Tests of mosaics of tiles that the tests make.

use std::collections::HashMap;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::super::held::{Held, bare_description};
use super::super::{Georeference, Registration};
use super::*;
use crate::grid::Size;
use crate::progress::Silent;

/// Tiles by name: place of the first sample in steps, size, and heights.
#[derive(Clone)]
struct Made {
    at: [f64; 2],
    size: Size,
    heights: Vec<f32>,
    base_m: f64,
    pixel: f64,
    crs: Option<&'static str>,
}

impl Made {
    fn new(at: [f64; 2], width: i64, height: i64, of: impl Fn(i64, i64) -> f32) -> Self {
        let size = Size { width, height };
        let heights = size
            .rect()
            .cells()
            .map(|(x, z)| of(x + at[0] as i64, z + at[1] as i64))
            .collect();
        Self {
            at,
            size,
            heights,
            base_m: 0.0,
            pixel: 10.0,
            crs: Some("EPSG:32633"),
        }
    }

    fn open(&self, name: &str) -> Held {
        let mut description = bare_description(name, "test", "float32", self.size);
        description.grid.base_m = self.base_m;
        description.place = Some(Georeference {
            crs: self.crs.map(String::from),
            origin: [500.0 + self.at[0] * 10.0, 900.0 - self.at[1] * 10.0],
            pixel: [self.pixel, -self.pixel],
            registration: Registration::Point,
            geographic: false,
        });
        Held::new(description, self.heights.clone()).unwrap()
    }
}

fn mosaic(tiles: &[(&str, Made)]) -> Result<Mosaic> {
    counted(tiles, Arc::default())
}

fn counted(tiles: &[(&str, Made)], opened: Arc<AtomicUsize>) -> Result<Mosaic> {
    let paths: Vec<PathBuf> = tiles.iter().map(|(name, _)| name.into()).collect();
    let made: HashMap<String, Made> = tiles.iter().map(|(n, t)| ((*n).into(), t.clone())).collect();
    let open = move |path: &std::path::Path, _: &OpenOptions| {
        opened.fetch_add(1, Ordering::Relaxed);
        let name = path.display().to_string();
        Ok(Box::new(made[&name].open(&name)) as Box<dyn HeightSource>)
    };
    Mosaic::new("m", &paths, &OpenOptions::default(), Box::new(open))
}

fn all(source: &dyn HeightSource) -> Vec<f32> {
    let rect = source.description().grid.size.rect();
    let mut out = vec![0.0; rect.area() as usize];
    source.read(rect, &mut out).unwrap();
    out
}

fn ramp(x: i64, z: i64) -> f32 {
    (100 * z + x) as f32
}

#[test]
fn tiles_that_share_edges_become_one_and_gaps_are_no_data() {
    let tiles = [
        ("a", Made::new([0.0, 0.0], 4, 3, ramp)),
        ("b", Made::new([3.0, 0.0], 4, 3, ramp)),
        ("c", Made::new([-2.0, 2.0], 3, 3, ramp)),
    ];
    let m = mosaic(&tiles).unwrap();
    let d = m.description();
    assert_eq!((d.grid.size.width, d.grid.size.height), (9, 5));
    assert_eq!(d.place.as_ref().unwrap().origin, [480.0, 900.0]);
    let covered = |x: i64, z: i64| {
        tiles
            .iter()
            .any(|(_, t)| t.size.rect().moved(t.at[0] as i64, t.at[1] as i64).contains(x, z))
    };
    for ((x, z), h) in d.grid.size.rect().moved(-2, 0).cells().zip(all(&m)) {
        if covered(x, z) {
            assert_eq!(h, ramp(x, z), "{x}, {z}");
        } else {
            assert!(h.is_nan(), "{x}, {z}: {h}");
        }
    }
    // Any rectangle is a part of the whole.
    let whole = all(&m);
    for rect in [
        Rect::new(1, 1, 6, 4),
        Rect::new(8, 4, 9, 5),
        Rect::new(4, 0, 7, 1),
    ] {
        let mut out = vec![0.0; rect.area() as usize];
        m.read(rect, &mut out).unwrap();
        let want = rect.cells().map(|(x, z)| whole[(z * 9 + x) as usize].to_bits());
        assert!(out.iter().map(|h| h.to_bits()).eq(want), "{rect:?}");
    }
    assert!(m.remarks(&Silent).unwrap().is_empty());
}

#[test]
fn the_later_tile_wins_but_for_its_voids_and_differences_are_counted_once() {
    let plus = |by: f32| move |x, z| ramp(x, z) + by;
    // Four tiles meet in one sample; the second differs by 1, the fourth by 5 in a row of which one is void.
    let tiles = [
        ("a", Made::new([0.0, 0.0], 3, 3, ramp)),
        ("b", Made::new([2.0, 0.0], 3, 3, plus(1.0))),
        ("c", Made::new([0.0, 2.0], 3, 3, ramp)),
        (
            "d",
            Made::new([2.0, 2.0], 3, 3, |x, z| {
                if (x, z) == (3, 2) {
                    f32::NAN
                } else {
                    ramp(x, z) + 5.0
                }
            }),
        ),
    ];
    let m = mosaic(&tiles).unwrap();
    let heights = all(&m);
    let at = |x: usize, z: usize| heights[z * 5 + x];
    assert_eq!(
        (at(2, 0), at(2, 2), at(3, 2), at(4, 2)),
        (3.0, 207.0, 204.0, 209.0)
    );
    let remarks = m.remarks(&Silent).unwrap();
    // a/b: (2,0) (2,1); a/c: (0,2) (1,2) agree; all: (2,2); b/d: (4,2), while (3,2) is held by b alone; c/d: (2,3) (2,4).
    assert!(
        remarks[0].starts_with("Of 8 samples that several tiles hold, 6 differ, by up to 5 m"),
        "{remarks:?}"
    );
    // Control: with the order turned about other samples win.
    let turned: Vec<_> = tiles.iter().rev().cloned().collect();
    assert_ne!(all(&mosaic(&turned).unwrap())[2], 3.0);
}

#[test]
fn a_tile_off_the_grid_is_named() {
    let base = Made::new([0.0, 0.0], 3, 3, ramp);
    for (tile, part) in [
        (
            Made {
                at: [2.5, 0.0],
                ..base.clone()
            },
            "b: lies 2.500 steps",
        ),
        (
            Made {
                pixel: 10.01,
                ..base.clone()
            },
            "b: has a step of 10.01",
        ),
        (
            Made {
                crs: Some("EPSG:4326"),
                ..base.clone()
            },
            "b: is in EPSG:4326",
        ),
        (
            Made {
                at: [4e9, 0.0],
                ..base.clone()
            },
            "b: lies",
        ),
    ] {
        let error = mosaic(&[("a", base.clone()), ("b", tile)]).err().unwrap();
        assert_eq!(error.kind(), ErrorKind::Unsupported, "{error}");
        assert!(error.to_string().starts_with(part), "{error}");
    }
    let far = Made {
        at: [1e9, 0.0],
        ..base.clone()
    };
    let near = Made {
        at: [-1e9, 0.0],
        ..base.clone()
    };
    assert_eq!(
        mosaic(&[("a", base), ("b", far), ("c", near)])
            .err()
            .unwrap()
            .kind(),
        ErrorKind::Limit
    );
}

#[test]
fn bases_are_brought_to_one() {
    let high = Made {
        base_m: 1e7 + 0.5,
        ..Made::new([0.0, 0.0], 2, 1, |_, _| 0.25)
    };
    let low = Made::new([2.0, 0.0], 1, 1, |_, _| 3.0);
    let m = mosaic(&[("low", low), ("high", high)]).unwrap();
    let base_m = m.description().grid.base_m;
    let heights: Vec<f64> = all(&m).iter().map(|h| f64::from(*h) + base_m).collect();
    assert_eq!(base_m, 1e7 + 0.5);
    assert_eq!(heights[..2], [1e7 + 0.75; 2]);
    assert!((heights[2] - 3.0).abs() < 1.0);
}

#[test]
fn few_tiles_stay_open_and_rows_open_each_once() {
    let tiles: Vec<(String, Made)> = (0..200)
        .map(|k| {
            (
                format!("{k:03}"),
                Made::new([f64::from(k % 20) * 2.0, f64::from(k / 20) * 2.0], 2, 2, ramp),
            )
        })
        .collect();
    let tiles: Vec<(&str, Made)> = tiles.iter().map(|(n, t)| (n.as_str(), t.clone())).collect();
    let opened = Arc::new(AtomicUsize::new(0));
    let m = counted(&tiles, opened.clone()).unwrap();
    opened.store(0, Ordering::Relaxed);
    let mut row = vec![0.0; 40];
    for z in 0..20 {
        m.read(Rect::new(0, z, 40, z + 1), &mut row).unwrap();
        assert!(m.cache.lock().unwrap().len() <= CACHE_TILES);
    }
    assert_eq!(opened.load(Ordering::Relaxed), 200);
}
