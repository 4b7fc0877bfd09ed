//! Frames per second by clip size and number of levels, on a small and on a large terrain: Holkner 2004, tables 1
//! and 2, as one.
//!
//!     cargo bench --bench holkner [-- ROUNDS [WxH]]
//!
//! The small terrain is the middle 1024 x 1024 of the large one, so that where all windows lie inside it both draw the
//! same picture (checked before any time is taken). The camera stands over the middle and looks north and a little
//! down; Holkner's drew everything around it, so nothing is culled here either. All settings are drawn once a round,
//! small and large in turn, in the opposite order every other round, and each after an untimed frame of its own; printed
//! are medians over the rounds, of frames drawn to completion without reading back.
#![allow(clippy::print_stdout, reason = "a bench prints its table")]

#[path = "support/rounds.rs"]
mod rounds;

use clipscape::camera::Camera;
use clipscape::clipmap::ClipmapOptions;
use clipscape::grid::{Grid, PATCH, Rect};
use clipscape::levels::{Arrival, Bounds, Levels, LightSample};
use clipscape::render::{Headless, HeadlessOptions};
use clipscape::source::Synth;
use clipscape::{Error, ErrorKind, Result};
use glam::DVec3;
use rounds::median;

const SMALL: i64 = 1024;
const LARGE: i64 = 8192;
const CLIP_SIZES: [i64; 3] = [64, 128, 256];
const LEVELS: std::ops::RangeInclusive<u32> = 1..=7;

/// A square part of a terrain's levels, as a terrain of its own.
struct Crop<'a> {
    whole: &'a dyn Levels,
    grid: Grid,
    first: i64,
}

impl<'a> Crop<'a> {
    /// The `size` x `size` samples from column and row `first` on, which must begin a patch on every level.
    fn new(whole: &'a dyn Levels, first: i64, size: i64) -> Result<Self> {
        let grid = Grid::new(size, size, whole.grid().spacing_m);
        if first % (PATCH << (grid.file_levels() - 1)) != 0 {
            return Err(Error::new(
                ErrorKind::Misuse,
                "crop",
                "does not begin with a patch of its coarsest level",
            ));
        }
        Ok(Self { whole, grid, first })
    }
}

impl Levels for Crop<'_> {
    fn grid(&self) -> &Grid {
        &self.grid
    }

    fn heights(&self, level: u32, rect: Rect, out: &mut [f32]) -> Result<Arrival> {
        let first = self.first >> level;
        self.whole.heights(level, rect.moved(first, first), out)
    }

    fn bounds(&self, level: u32, patches: Rect, out: &mut [Bounds]) -> Result<Arrival> {
        let first = (self.first >> level) / PATCH;
        self.whole.bounds(level, patches.moved(first, first), out)
    }

    fn has_light(&self) -> bool {
        self.whole.has_light()
    }

    fn light(&self, level: u32, rect: Rect, out: &mut [LightSample]) -> Result<Arrival> {
        let first = self.first >> level;
        self.whole.light(level, rect.moved(first, first), out)
    }
}

/// One cell of the table.
struct Setting<'a> {
    terrain: &'a dyn Levels,
    headless: Headless,
    camera: Camera,
    draw_ms: Vec<f64>,
}

impl Setting<'_> {
    /// Draws twice and takes the time of the second frame: the first pays for what the setting before left in caches.
    fn time(&mut self) -> Result<()> {
        self.headless.frame(self.terrain, &self.camera, 0.0)?;
        let frame = self.headless.frame(self.terrain, &self.camera, 0.0)?;
        self.draw_ms.push(frame.plan_ms + frame.upload_ms + frame.draw_ms);
        Ok(())
    }

    /// What was drawn, as depth: colours depend on a terrain's range of heights, which the two do not share.
    fn first_draw(&mut self) -> Result<Vec<f32>> {
        self.headless.frame(self.terrain, &self.camera, 0.0)?;
        self.headless.read_depth()
    }

    fn fps(&self) -> f64 {
        1e3 / median(&self.draw_ms)
    }
}

fn main() {
    let mut arguments = std::env::args().skip(1).filter(|a| a != "--bench");
    let rounds = arguments.next().and_then(|a| a.parse().ok()).unwrap_or(21).max(1);
    let size_px = arguments.next().and_then(|a| size(&a)).unwrap_or([640, 480]);
    if let Err(error) = run(rounds, size_px) {
        println!("holkner: {error}");
        std::process::exit(1);
    }
}

fn size(text: &str) -> Option<[u32; 2]> {
    let (width, height) = text.split_once('x')?;
    Some([width.parse().ok()?, height.parse().ok()?])
}

fn run(rounds: usize, size_px: [u32; 2]) -> Result<()> {
    let large = Synth::new(LARGE, 1)?;
    let first = (LARGE - SMALL) / 2;
    let small = Crop::new(&large, first, SMALL)?;
    let gpu = clipscape::gpu::open()?;
    println!(
        "{} ({}), {}x{} pixels, medians of {rounds} rounds",
        gpu.info.name,
        gpu.driver(),
        size_px[0],
        size_px[1]
    );
    let mut pairs = Vec::new();
    for clip_size in CLIP_SIZES {
        for count in LEVELS {
            let make = |terrain, first| setting(&gpu, terrain, first, clip_size, count, size_px);
            let small = (count <= small.grid.levels_until(clip_size)).then(|| make(&small, 0));
            pairs.push((
                clip_size,
                count,
                small.transpose()?,
                make(&large as &dyn Levels, first)?,
            ));
        }
    }
    for (clip_size, count, small, large) in &mut pairs {
        let reference = large.first_draw()?;
        if let Some(small) = small {
            let same = small.first_draw()? == reference;
            let inside = *clip_size << (*count - 1) <= SMALL;
            assert!(
                same || !inside,
                "clip size {clip_size}, {count} levels: the two terrains draw other pictures"
            );
        }
    }
    for round in 0..rounds {
        for (_, _, small, large) in &mut pairs {
            if round % 2 == 0 {
                small.as_mut().map(Setting::time).transpose()?;
                large.time()?;
            } else {
                large.time()?;
                small.as_mut().map(Setting::time).transpose()?;
            }
        }
    }
    table(&pairs);
    Ok(())
}

fn setting<'a>(
    gpu: &clipscape::gpu::Gpu,
    terrain: &'a dyn Levels,
    first: i64,
    clip_size: i64,
    levels: u32,
    size_px: [u32; 2],
) -> Result<Setting<'a>> {
    let options = HeadlessOptions {
        size_px,
        traced_light: false,
        clipmap: ClipmapOptions {
            clip_size,
            levels: Some(levels),
            cull: false,
            ..Default::default()
        },
        ..Default::default()
    };
    let middle = SMALL / 2 + first;
    let mut ground = [0.0];
    if terrain.heights(0, Rect::new(middle, middle, middle + 1, middle + 1), &mut ground)? != Arrival::Arrived
    {
        return Err(Error::new(
            ErrorKind::Broken,
            "terrain",
            "has no ground in the middle",
        ));
    }
    let [dx, dz] = terrain.grid().spacing_m;
    let eye = DVec3::new(
        middle as f64 * dx,
        f64::from(ground[0]) + 60.0,
        middle as f64 * dz,
    );
    let camera = Camera {
        eye,
        heading_deg: 0.0,
        pitch_deg: -10.0,
        roll_deg: 0.0,
        fov_deg: 60.0,
    };
    let headless = Headless::new(gpu.clone(), terrain, &options)?;
    Ok(Setting {
        terrain,
        headless,
        camera,
        draw_ms: Vec::new(),
    })
}

fn table(pairs: &[(i64, u32, Option<Setting<'_>>, Setting<'_>)]) {
    println!(
        "frames per second: terrain {SMALL} / terrain {LARGE} (ratio; * where all windows lie inside both)"
    );
    print!("{:>9}", "clip size");
    LEVELS.for_each(|count| print!("{:>26}", format!("{count} levels")));
    println!();
    for clip_size in CLIP_SIZES {
        print!("{clip_size:>9}");
        for (_, count, small, large) in pairs.iter().filter(|p| p.0 == clip_size) {
            let cell = match small {
                Some(small) => {
                    let (small, large) = (small.fps(), large.fps());
                    let mark = if clip_size << (count - 1) <= SMALL {
                        "*"
                    } else {
                        ""
                    };
                    format!("{small:.1} / {large:.1} ({:.2}{mark})", small / large)
                }
                None => format!("/ {:.1}", large.fps()),
            };
            print!("{cell:>26}");
        }
        println!();
    }
}
