//! The whole way from a source in memory to a file on the disk and back.

use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::*;
use crate::error::{Error, ErrorKind, Result};
use crate::grid::{Grid, Rect};
use crate::levels::Levels;
use crate::light::{Day, LightOptions, trace_light};
use crate::progress::{Progress, Silent};
use crate::pyramid::random::Random;
use crate::pyramid::{DEFAULT_LOBES, Filter, FilterKind};
use crate::source::{Description, HeightSource};
use crate::terrain::TerrainFile;
use crate::terrain::testing::all_bits;
use crate::work::Serial;

mod plain;

/// Whole metres of hills, with voids; it breaks off at a row if told so.
struct Hills {
    description: Description,
    breaks_at: i64,
    /// Voids in a hundred samples; beside those none where x is below `coast`.
    voids: i64,
    coast: i64,
}

impl Hills {
    fn new(width: i64, height: i64) -> Self {
        let description = Description {
            grid: Grid::new(width, height, [30.0, 25.0]),
            format: "test".into(),
            sample_type: "int16".into(),
            step_m: Some(1.0),
            place: None,
            vertical_unit: "unknown".into(),
            assumed: vec!["heights are metres".into()],
            name: "hills".into(),
        };
        Self {
            description,
            breaks_at: i64::MAX,
            voids: 3,
            coast: 0,
        }
    }
}

impl HeightSource for Hills {
    fn description(&self) -> &Description {
        &self.description
    }

    fn read(&self, rect: Rect, out: &mut [f32]) -> Result<()> {
        if rect.z1 > self.breaks_at {
            return Err(Error::new(ErrorKind::Broken, "hills", "ends too early"));
        }
        for ((x, z), out) in rect.cells().zip(out) {
            let random = Random::new((x * 7919 + z * 104_729) as u64).below(100);
            let hill = 800.0 * (x as f32 / 40.0).sin() * (z as f32 / 55.0).cos();
            *out = if random < self.voids || x < self.coast + 9 * (z / 7 % 5) * self.coast.signum() {
                f32::NAN
            } else {
                (hill + random as f32).round()
            };
        }
        Ok(())
    }
}

fn options(threads: usize) -> PreprocessOptions {
    let source = SourceStamp {
        name: "a/hills.tif".into(),
        length_bytes: 77,
        modified_s: Some(5),
    };
    PreprocessOptions {
        threads,
        source,
        ..PreprocessOptions::default()
    }
}

fn open(path: &Path) -> TerrainFile {
    TerrainFile::open("t", Arc::new(fs::read(path).unwrap())).unwrap()
}

fn entries(folder: &Path) -> usize {
    fs::read_dir(folder).unwrap().count()
}

#[test]
fn a_file_holds_what_the_pyramid_holds() {
    for (width, height) in [(300, 261), (1, 1), (70, 2)] {
        for light in [None, Some(LightOptions::default())] {
            let hills = Hills::new(width, height);
            let folder = tempfile::tempdir().unwrap();
            let out = folder.path().join("hills.terrain.exr");
            let options = PreprocessOptions { light, ..options(2) };
            let report = preprocess(&hills, &out, &options, &Silent).unwrap();
            assert_eq!(entries(folder.path()), 1);

            let mut pyramid = build_pyramid(&hills, &Filter::default(), &Silent).unwrap();
            if let Some(light) = &light {
                let (grid, filter) = (hills.description.grid, Filter::default());
                let heights = pyramid.level(0).to_vec();
                let traced = trace_light(&grid, &heights, light, &filter, &Serial, &Silent).unwrap();
                pyramid.set_light(traced).unwrap();
            }
            let file = open(&out);
            let case = format!("{width} x {height}, {light:?}");
            assert_eq!(file.has_light(), light.is_some(), "{case}");
            assert!(all_bits(&file).unwrap() == all_bits(&pyramid).unwrap(), "{case}");
            assert_eq!(file.verify(&Silent).unwrap().len(), 0, "{case}");

            let meta = file.meta();
            assert_eq!(meta.source, options.source);
            assert_eq!(meta.assumed, hills.description.assumed);
            assert_eq!(
                (meta.filter.as_str(), meta.lobes, meta.rounding_step_m),
                ("sinc-blackman", DEFAULT_LOBES, Some(1.0 / 4.0))
            );
            assert_eq!(
                meta.light.map(|l| l.sky_directions),
                light.map(|l| l.sky_directions)
            );
            assert_eq!((report.samples, report.threads), ((width * height) as u64, 2));
            assert_eq!(report.rounding_m, 0.0);
            assert_eq!(report.overshoot_m, f64::from(pyramid.overshoot_m()));
            let parts = [
                report.read_s,
                report.pyramid_s,
                report.bounds_s,
                report.sun_s,
                report.sky_s,
                report.write_s,
            ];
            assert!(parts.iter().all(|s| *s >= 0.0) && parts.iter().sum::<f64>() <= report.total_s + 1e-6);
        }
    }
}

/// A day in the hills, from so many suns.
fn day(positions: u32) -> Day {
    Day::of("2026-12-21T12:00Z".parse().unwrap(), 42.0, 1.0, positions).unwrap()
}

#[test]
fn the_share_of_voids_stays_from_level_to_level() {
    let hills = Hills {
        voids: 30,
        ..Hills::new(1501, 1201)
    };
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("a.terrain.exr");
    let options = PreprocessOptions {
        light: None,
        ..options(2)
    };
    preprocess(&hills, &out, &options, &Silent).unwrap();
    let file = open(&out);
    for level in 0..4 {
        let size = file.grid().level(level);
        let mut heights = vec![0.0; size.samples() as usize];
        let _ = file.heights(level, size.rect(), &mut heights).unwrap();
        let share = heights.iter().filter(|h| h.is_nan()).count() as f64 / heights.len() as f64;
        // Five standard deviations of a random share; a rule that spreads voids would leave none or nearly all.
        let allowed = 5.0 * (0.21 / heights.len() as f64).sqrt();
        assert!((share - 0.3).abs() < allowed, "level {level}: {share}");
    }
}

#[test]
fn one_thread_or_many_the_same_bytes_whatever_the_filter() {
    let hills = Hills::new(530, 300);
    let folder = tempfile::tempdir().unwrap();
    let bytes = |threads, filter: FilterKind, light| {
        let out = folder.path().join(format!("{filter}-{threads}.terrain.exr"));
        let options = PreprocessOptions {
            filter: filter.into(),
            light,
            ..options(threads)
        };
        preprocess(&hills, &out, &options, &Silent).unwrap();
        assert_eq!(open(&out).meta().filter, filter.name());
        fs::read(out).unwrap()
    };
    let mut files = Vec::new();
    for filter in FilterKind::ALL {
        let light = (filter == FilterKind::default()).then(LightOptions::default);
        let one = bytes(1, filter, light);
        for threads in [2, 5] {
            assert!(
                one == bytes(threads, filter, light),
                "{filter}, {threads} threads"
            );
        }
        assert!(!files.contains(&one), "{filter} makes another's file");
        files.push(one);
    }
}

#[test]
fn an_existing_target_is_replaced_only_by_force() {
    let hills = Hills::new(30, 20);
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("a.terrain.exr");
    fs::write(&out, "old").unwrap();
    let error = preprocess(&hills, &out, &options(1), &Silent).unwrap_err();
    assert!(error.to_string().contains("exists already"), "{error}");
    assert_eq!(fs::read(&out).unwrap(), b"old");
    let forced = PreprocessOptions {
        force: true,
        ..options(1)
    };
    preprocess(&hills, &out, &forced, &Silent).unwrap();
    assert_eq!(open(&out).grid().size, hills.description.grid.size);
    // Not even force replaces the DEM itself.
    let name = out.to_str().unwrap().into();
    let own = PreprocessOptions {
        source: SourceStamp {
            name,
            ..SourceStamp::default()
        },
        ..forced
    };
    let error = preprocess(&hills, &out, &own, &Silent).unwrap_err();
    assert!(error.to_string().contains("is the input itself"), "{error}");
    assert_eq!(entries(folder.path()), 1);
}

/// Cancels at the n-th question.
struct CancelAt(AtomicUsize, usize);

impl Progress for CancelAt {
    fn cancelled(&self) -> bool {
        self.0.fetch_add(1, Ordering::Relaxed) >= self.1
    }
}

#[test]
fn cancelled_anywhere_nothing_is_left() {
    let hills = Hills::new(260, 120);
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("a.terrain.exr");
    let mut cancelled = 0;
    let options = PreprocessOptions {
        day: Some(day(3)),
        ..options(1)
    };
    for n in (0..).step_by(3) {
        match preprocess(&hills, &out, &options, &CancelAt(AtomicUsize::new(0), n)) {
            Ok(_) => break,
            Err(error) => {
                assert_eq!(error.kind(), ErrorKind::Cancelled, "after {n}: {error}");
                assert_eq!(error.to_string(), "hills: interrupted");
                assert_eq!(entries(folder.path()), 0, "after {n}");
                cancelled += 1;
            }
        }
    }
    assert!(cancelled > 5, "it was cancelled {cancelled} times only");
    assert_eq!(entries(folder.path()), 1);
}

#[test]
fn errors_are_one_line_and_leave_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("a.terrain.exr");
    let error_of = |hills: &Hills, out: &Path, options: &PreprocessOptions| {
        let error = preprocess(hills, out, options, &Silent).unwrap_err();
        assert_eq!(error.to_string().lines().count(), 1);
        error
    };
    let whole = Hills::new(300, 600);
    let broken = Hills {
        breaks_at: 512,
        ..Hills::new(300, 600)
    };
    assert_eq!(error_of(&broken, &out, &options(1)).kind(), ErrorKind::Broken);
    assert_eq!(
        error_of(&whole, &folder.path().join("none/a.exr"), &options(1)).kind(),
        ErrorKind::Io
    );
    let file = folder.path().join("file");
    fs::write(&file, "").unwrap();
    let error = error_of(&whole, &file.join("a.exr"), &options(1));
    assert_eq!(error.kind(), ErrorKind::Io);
    fs::remove_file(&file).unwrap();
    let little = PreprocessOptions {
        memory_bytes: 1 << 20,
        ..options(1)
    };
    let error = error_of(&whole, &out, &little);
    assert_eq!(error.kind(), ErrorKind::Limit);
    let needed = |day| preprocess_bytes(&whole.description.grid, true, day, 0).div_ceil(1 << 20);
    let said = |error: &Error, needed: u64| error.to_string().contains(&format!("need {needed} MiB"));
    assert!(said(&error, needed(false)), "{error}");
    let little_for_a_day = PreprocessOptions {
        memory_bytes: needed(false) << 20,
        day: Some(day(3)),
        ..options(1)
    };
    let error = error_of(&whole, &out, &little_for_a_day);
    assert_eq!(error.kind(), ErrorKind::Limit);
    assert!(
        said(&error, needed(true)) && needed(true) > needed(false),
        "{error}"
    );
    let mut light = LightOptions::default();
    light.sun.altitude_deg = 91.0;
    let nowhere = PreprocessOptions {
        light: Some(light),
        ..options(1)
    };
    assert_eq!(error_of(&whole, &out, &nowhere).kind(), ErrorKind::Misuse);
    assert_eq!(entries(folder.path()), 0);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_one_line() {
    let hills = Hills::new(64, 64);
    // Writing to /dev/full fails as a full disk does; the writer is the one that `preprocess` uses.
    let pyramid = build_pyramid(&hills, &Filter::default(), &Silent).unwrap();
    let meta = crate::terrain::testing::meta(hills.description.grid, false);
    let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let error = crate::terrain::write(full, &meta, &pyramid, &Serial, &Silent).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Io);
    assert!(error.to_string().contains("the disk is full"), "{error}");
}

/// Every tile of a file's height and bounds parts, as it is stored.
fn stored(path: &Path) -> Vec<Vec<u8>> {
    let file = std::io::BufReader::new(fs::File::open(path).unwrap());
    let reader = exr::block::read(file, false).unwrap();
    let meta = reader.meta_data().clone();
    let chunks = reader.all_chunks(false).unwrap().map(|chunk| chunk.unwrap());
    let mut tiles: Vec<(String, Vec<u8>)> = chunks
        .map(|chunk| {
            let exr::block::chunk::CompressedBlock::Tile(tile) = chunk.compressed_block else {
                panic!("all parts are tiled");
            };
            let name = &meta.headers[chunk.layer_index].own_attributes.layer_name;
            let at = tile.coordinates.tile_index;
            (format!("{name:?} {at:?}"), tile.compressed_pixels_le)
        })
        .filter(|(name, _)| name.contains("height") || name.contains("bounds"))
        .collect();
    tiles.sort();
    tiles.into_iter().map(|(_, bytes)| bytes).collect()
}

#[test]
fn a_terrain_file_is_lit_anew_and_keeps_its_heights() {
    let folder = tempfile::tempdir().unwrap();
    let hills = Hills::new(300, 290);
    let [first, second, other] =
        ["a", "b", "c"].map(|name| folder.path().join(name).with_extension("terrain.exr"));
    preprocess(&hills, &first, &options(2), &Silent).unwrap();
    let low = PreprocessOptions {
        light: Some(LightOptions {
            sun: crate::light::Sun {
                azimuth_deg: 80.0,
                altitude_deg: 9.0,
            },
            sky_directions: 3,
        }),
        day: Some(day(3)),
        ..options(1)
    };
    preprocess(&hills, &other, &low, &Silent).unwrap();
    relight(&open(&first), &second, &low, &Silent).unwrap();
    assert_eq!(
        fs::read(&second).unwrap(),
        fs::read(&other).unwrap(),
        "as if made so"
    );
    assert_eq!(stored(&first), stored(&second));
    assert!(stored(&first).len() > 8);
    // A control: the light is another.
    assert_ne!(fs::read(&first).unwrap(), fs::read(&second).unwrap());

    // In place, but only where that is asked for; and back again, and without light.
    let before = fs::read(&second).unwrap();
    let refused = relight(&open(&second), &second, &options(1), &Silent).unwrap_err();
    assert_eq!(refused.kind(), ErrorKind::Misuse);
    assert_eq!(fs::read(&second).unwrap(), before);
    let force = PreprocessOptions {
        force: true,
        ..options(1)
    };
    relight(&open(&second), &second, &force, &Silent).unwrap();
    assert_eq!(fs::read(&second).unwrap(), fs::read(&first).unwrap());
    assert!(open(&other).has_day() && !open(&second).has_day());
    let dark = PreprocessOptions {
        light: None,
        ..force.clone()
    };
    relight(&open(&second), &second, &dark, &Silent).unwrap();
    assert!(!open(&second).has_light());
    assert_eq!(stored(&first), stored(&second));

    // Too little memory, cancelled, curved over no known earth: refused, and nothing is left.
    let before = fs::read(&second).unwrap();
    let little = PreprocessOptions {
        memory_bytes: 1 << 20,
        ..force.clone()
    };
    let curved = PreprocessOptions {
        curvature: Some(0.13),
        ..force.clone()
    };
    struct Stop;
    impl Progress for Stop {
        fn cancelled(&self) -> bool {
            true
        }
    }
    let kinds = [
        relight(&open(&first), &second, &little, &Silent),
        relight(&open(&first), &second, &curved, &Silent),
        relight(&open(&first), &second, &force, &Stop),
    ]
    .map(|result| result.unwrap_err().kind());
    assert_eq!(kinds, [ErrorKind::Limit, ErrorKind::Misuse, ErrorKind::Cancelled]);
    assert_eq!(fs::read(&second).unwrap(), before);
    assert_eq!(entries(folder.path()), 3);
}
