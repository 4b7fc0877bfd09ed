//! What the tests of this room share: random levels in memory, a description, a file made of both.

use std::io::Cursor;
use std::sync::Arc;

use half::f16;

use super::{LightMeta, Meta, SourceStamp, TerrainFile, write};
use crate::error::Result;
use crate::grid::{Grid, Rect, Size};
use crate::levels::{Arrival, Bounds, DaySample, Levels, LightSample};
use crate::light::Day;
use crate::progress::Silent;
pub(crate) use crate::pyramid::random::Random;
use crate::source::{Georeference, Registration};
use crate::work::Serial;

/// Levels held as arrays, with any content: the file must not care what the numbers mean.
pub(crate) struct Arrays {
    pub(crate) grid: Grid,
    pub(crate) heights: Vec<Vec<f32>>,
    pub(crate) bounds: Vec<Vec<Bounds>>,
    pub(crate) light: Option<Vec<Vec<LightSample>>>,
    /// There is a day where there is light.
    pub(crate) day: Option<Vec<Vec<DaySample>>>,
}

/// What the heights are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Look {
    /// All bits random: no tile shrinks, so all are stored as they are.
    Noise,
    /// Smooth, with a fifth of voids.
    Smooth,
}

impl Arrays {
    pub(crate) fn random(width: i64, height: i64, light: bool, look: Look, seed: u64) -> Self {
        let grid = Grid::new(width, height, [30.0, 10.0 / 3.0]);
        let random = &mut Random::new(seed);
        let levels = grid.file_levels();
        let heights = (0..levels).map(|l| {
            let size = grid.level(l);
            let height = |(x, z): (i64, i64), random: &mut Random| match look {
                Look::Smooth if random.below(5) == 0 => f32::NAN,
                Look::Noise => Some(f32::from_bits(random.bits() as u32))
                    .filter(|h| !h.is_nan())
                    .unwrap_or(0.0),
                Look::Smooth => (x * 3 + z * 2) as f32,
            };
            size.rect().cells().map(|cell| height(cell, random)).collect()
        });
        let heights = heights.collect();
        let bounds = (0..levels).map(|l| {
            let bounds = |random: &mut Random| match random.below(6) {
                0 => Bounds::VOID,
                // Void itself, over valid ground of finer levels.
                1 => Bounds {
                    need_min: -7.5,
                    need_max: 1000.0 * random.unit() as f32,
                    need_error: 3.25,
                    ..Bounds::VOID
                },
                _ => bytemuck::cast([0; 6].map(|_: u32| 1000.0 * random.unit() as f32)),
            };
            (0..grid.patches(l).samples()).map(|_| bounds(random)).collect()
        });
        let bounds = bounds.collect();
        let day = light.then(|| {
            let mut half = || f16::from_f64(random.unit());
            let mut all = |size: Size| -> Vec<DaySample> {
                (0..size.samples())
                    .map(|_| DaySample {
                        first: half(),
                        first_soft: half(),
                        last: half(),
                        last_soft: half(),
                        slope: half(),
                        unused: f16::ZERO,
                    })
                    .collect()
            };
            (0..levels).map(|l| all(grid.level(l))).collect()
        });
        let light = light.then(|| {
            let mut half = || f16::from_f64(random.unit());
            let mut all = |size: Size| -> Vec<LightSample> {
                (0..size.samples())
                    .map(|_| LightSample {
                        sun: half(),
                        sky: half(),
                    })
                    .collect()
            };
            (0..levels).map(|l| all(grid.level(l))).collect()
        });
        Self {
            grid,
            heights,
            bounds,
            light,
            day,
        }
    }

    /// A terrain file of these levels.
    pub(crate) fn file(&self) -> Vec<u8> {
        let out = Cursor::new(Vec::new());
        let meta = meta(self.grid, self.light.is_some());
        write(out, &meta, self, &Serial, &Silent).unwrap().into_inner()
    }
}

fn copy<T: Copy>(from: &[T], size: Size, rect: Rect, out: &mut [T]) {
    for ((x, z), out) in rect.cells().zip(out) {
        *out = from[(z * size.width + x) as usize];
    }
}

impl Levels for Arrays {
    fn grid(&self) -> &Grid {
        &self.grid
    }

    fn heights(&self, level: u32, rect: Rect, out: &mut [f32]) -> Result<Arrival> {
        copy(&self.heights[level as usize], self.grid.level(level), rect, out);
        Ok(Arrival::Arrived)
    }

    fn bounds(&self, level: u32, patches: Rect, out: &mut [Bounds]) -> Result<Arrival> {
        copy(
            &self.bounds[level as usize],
            self.grid.patches(level),
            patches,
            out,
        );
        Ok(Arrival::Arrived)
    }

    fn has_light(&self) -> bool {
        self.light.is_some()
    }

    fn light(&self, level: u32, rect: Rect, out: &mut [LightSample]) -> Result<Arrival> {
        let light = self.light.as_ref().expect("asked for light where there is none");
        copy(&light[level as usize], self.grid.level(level), rect, out);
        Ok(Arrival::Arrived)
    }

    fn has_day(&self) -> bool {
        self.day.is_some()
    }

    fn day(&self, level: u32, rect: Rect, out: &mut [DaySample]) -> Result<Arrival> {
        let day = self.day.as_ref().expect("asked for a day where there is none");
        copy(&day[level as usize], self.grid.level(level), rect, out);
        Ok(Arrival::Arrived)
    }
}

/// A description in which nothing is left out.
pub(crate) fn meta(grid: Grid, light: bool) -> Meta {
    Meta {
        grid,
        place: Some(Georeference {
            crs: Some("EPSG:4326 \"W\u{fc}ste\"".into()),
            origin: [1.0 - f64::EPSILON, 43.0 + 8.0 * f64::EPSILON],
            pixel: [1.0 / 1200.0, -1.0 / 1200.0],
            registration: Registration::Point,
            geographic: true,
        }),
        vertical_unit: "metre".into(),
        filter: "sinc-blackman".into(),
        lobes: 4,
        rounding_step_m: Some(1.0 / 64.0),
        destep_m: Some(0.1),
        light: light.then_some(LightMeta {
            sun_azimuth_deg: 315.0,
            sun_altitude_deg: 44.99999999999999,
            sky_directions: 16,
        }),
        day: light.then(|| {
            let moment = "2026-06-21T09:00Z".parse().expect("a time");
            Day::of(moment, 42.5, 1.5 + 1.0 / 3.0, 48).expect("the sun rises there")
        }),
        source: SourceStamp {
            name: "folder/N42E001.hgt".into(),
            length_bytes: 2_884_802,
            modified_s: Some(-86_400),
        },
        tool: super::meta::TOOL.into(),
        assumed: vec!["heights are metres".into(), "the datum is EGM96".into()],
    }
}

pub(crate) fn open(bytes: Vec<u8>) -> Result<TerrainFile> {
    TerrainFile::open("test.terrain.exr", Arc::new(bytes))
}

/// All samples of all levels as bits, NaN for NaN.
pub(crate) fn all_bits(levels: &dyn Levels) -> Result<Vec<u32>> {
    let grid = *levels.grid();
    let mut all = Vec::new();
    for l in 0..levels.level_count() {
        let size = grid.level(l);
        let mut heights = vec![0f32; size.samples() as usize];
        let _ = levels.heights(l, size.rect(), &mut heights)?;
        all.extend(heights.iter().map(|h| h.to_bits()));
        let patches = grid.patches(l);
        let mut bounds = vec![Bounds::VOID; patches.samples() as usize];
        let _ = levels.bounds(l, patches.rect(), &mut bounds)?;
        all.extend_from_slice(bytemuck::cast_slice(&bounds));
        if levels.has_light() {
            let mut light = vec![LightSample::default(); size.samples() as usize];
            let _ = levels.light(l, size.rect(), &mut light)?;
            all.extend(light.iter().map(|s| bytemuck::cast::<_, u32>(*s)));
        }
        if levels.has_day() {
            let mut day = vec![DaySample::default(); size.samples() as usize];
            let _ = levels.day(l, size.rect(), &mut day)?;
            all.extend(day.iter().flat_map(|s| bytemuck::cast::<_, [u32; 3]>(*s)));
        }
    }
    Ok(all)
}

/// The offset of the first tile: the least in the tables, which is what the first table's first entry says.
pub(crate) fn first_tile(bytes: &[u8]) -> usize {
    let (_, _, tables) = super::header::read("t", Arc::new(bytes.to_vec())).unwrap();
    let at = tables as usize;
    u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as usize
}
