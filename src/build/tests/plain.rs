//! A streamed file against one that is made of whole arrays in memory, byte for byte.

use super::*;
use crate::levels::{Arrival, Bounds, DaySample, LightSample};
use crate::light::{Earth, plain_day};
use crate::pyramid::Pyramid;

/// The bytes of a streamed file.
fn streamed(hills: &Hills, options: &PreprocessOptions) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("a.terrain.exr");
    preprocess(hills, &out, options, &Silent).unwrap();
    fs::read(out).unwrap()
}

/// The bytes of the file that the plain version in memory writes where the streamed one describes itself as `like` does.
fn plain(hills: &Hills, options: &PreprocessOptions, like: &[u8]) -> Vec<u8> {
    let meta = TerrainFile::open("t", Arc::new(like.to_vec()))
        .unwrap()
        .meta()
        .clone();
    let mut pyramid = build_pyramid(hills, &options.filter, &Silent).unwrap();
    if let Some(light) = &options.light {
        let heights = pyramid.level(0).to_vec();
        let grid = hills.description.grid;
        let traced = trace_light(&grid, &heights, light, &options.filter, &Serial, &Silent).unwrap();
        pyramid.set_light(traced).unwrap();
    }
    let day = options.day.map(|day| {
        let (grid, heights) = (hills.description.grid, pyramid.level(0));
        let traced = plain_day::trace_day(heights, &grid, &Earth::default(), &day).unwrap();
        plain_day::day_levels(&grid, &traced, &options.filter).unwrap()
    });
    let bytes = std::io::Cursor::new(Vec::new());
    let levels = WithDay { pyramid, day };
    crate::terrain::write(bytes, &meta, &levels, &Serial, &Silent)
        .unwrap()
        .into_inner()
}

/// A pyramid, and perhaps the light of a day, in memory.
struct WithDay {
    pyramid: Pyramid,
    day: Option<Vec<Vec<DaySample>>>,
}

impl Levels for WithDay {
    fn grid(&self) -> &Grid {
        self.pyramid.grid()
    }

    fn heights(&self, level: u32, rect: Rect, out: &mut [f32]) -> Result<Arrival> {
        self.pyramid.heights(level, rect, out)
    }

    fn bounds(&self, level: u32, patches: Rect, out: &mut [Bounds]) -> Result<Arrival> {
        self.pyramid.bounds(level, patches, out)
    }

    fn has_light(&self) -> bool {
        self.pyramid.has_light()
    }

    fn light(&self, level: u32, rect: Rect, out: &mut [LightSample]) -> Result<Arrival> {
        self.pyramid.light(level, rect, out)
    }

    fn has_day(&self) -> bool {
        self.day.is_some()
    }

    fn day(&self, level: u32, rect: Rect, out: &mut [DaySample]) -> Result<Arrival> {
        let level_of_day = &self.day.as_ref().expect("asked for a day where there is none")[level as usize];
        let width = self.grid().level(level).width;
        for ((x, z), out) in rect.cells().zip(out) {
            *out = level_of_day[(z * width + x) as usize];
        }
        Ok(Arrival::Arrived)
    }
}

#[test]
fn any_ceiling_and_any_threads_give_the_bytes_of_the_plain_version() {
    let sizes = [
        (1, 1),
        (1, 900),
        (900, 1),
        (2, 3),
        (256, 256),
        (257, 513),
        (513, 257),
        (1013, 300),
        (13201, 20),
        (20, 5000),
        (600, 1400),
    ];
    let low = |sky_directions| LightOptions {
        sun: crate::light::Sun {
            azimuth_deg: 190.0,
            altitude_deg: 4.0,
        },
        sky_directions,
    };
    for (width, height) in sizes {
        for (voids, coast, light, day) in [
            (0, 0, None, None),
            (30, 0, None, None),
            (3, 40, None, None),
            (0, 0, Some(low(3)), None),
            (30, 0, Some(low(0)), None),
            (0, 0, Some(low(0)), Some(day(3))),
            (
                3,
                40,
                Some(LightOptions {
                    sky_directions: 1,
                    ..Default::default()
                }),
                Some(day(2)),
            ),
        ] {
            let hills = Hills {
                voids,
                coast,
                ..Hills::new(width, height)
            };
            let lowest = preprocess_bytes(&hills.description.grid, light.is_some(), day.is_some(), 0);
            let mut want = None;
            for (threads, memory_bytes) in [(1, lowest), (2, lowest), (1, 4 << 30), (2, 4 << 30)] {
                let options = PreprocessOptions {
                    light,
                    day,
                    memory_bytes,
                    ..options(threads)
                };
                let case = format!(
                    "{width} x {height}, voids {voids}, coast {coast}, {light:?}, {day:?}, {threads} threads"
                );
                let streamed = streamed(&hills, &options);
                let want = want.get_or_insert_with(|| plain(&hills, &options, &streamed));
                assert!(streamed == *want, "{case}, {memory_bytes} bytes");
            }
        }
    }
    // Controls: another filter, other voids and another day give other bytes.
    let hills = Hills::new(300, 300);
    let options = |filter: FilterKind| PreprocessOptions {
        light: None,
        filter: filter.into(),
        ..options(1)
    };
    let one = streamed(&hills, &options(FilterKind::default()));
    let other = streamed(&hills, &options(FilterKind::Cubic));
    let holed = Hills {
        voids: 4,
        ..Hills::new(300, 300)
    };
    let third = streamed(&holed, &options(FilterKind::default()));
    assert!(one != other && one != third);
    let times = |hills: &Hills, day| {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("a.terrain.exr");
        let options = PreprocessOptions {
            light: Some(low(0)),
            day: Some(day),
            ..options(FilterKind::default())
        };
        preprocess(hills, &out, &options, &Silent).unwrap();
        let mut samples = vec![DaySample::default(); 150 * 150];
        let _ = open(&out)
            .day(1, Rect::new(0, 0, 150, 150), &mut samples)
            .unwrap();
        samples
    };
    let three = times(&hills, day(3));
    assert!(three != times(&hills, day(4)) && three != times(&holed, day(3)));
}

#[test]
fn however_many_rows_are_traced_at_once_the_bytes_are_the_same() {
    let hills = Hills::new(1000, 3500);
    let grid = hills.description.grid;
    let options = |day, memory_bytes| PreprocessOptions {
        light: Some(LightOptions {
            sky_directions: 1,
            ..Default::default()
        }),
        day,
        memory_bytes,
        ..options(2)
    };
    for (day, left) in [(None, 10 << 20), (Some(day(2)), 8 << 20)] {
        let lowest = preprocess_bytes(&grid, true, day.is_some(), 0);
        let rows = [0, left].map(|left| memory::light_room(&grid, day.is_some(), left).0);
        assert!(rows[0] < rows[1], "{rows:?}");
        let one = streamed(&hills, &options(day, lowest));
        assert!(one == streamed(&hills, &options(day, lowest + left)), "{day:?}");
    }
}
