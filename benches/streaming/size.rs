//! The frame time over a terrain of 2^20 x 2^20 samples against that over one of 4096 x 4096, frames in turn.
//!
//! All draw the same levels. With those whose windows lie within the smaller terrain (five at clip size 256) a view from
//! its middle shows no edge of it, so the middle 4097 x 4097 samples of the larger one, taken for a terrain of their own,
//! are drawn as the larger one is, bit for bit but for colours, which follow from all heights: their ratio is what size
//! costs. `synth:4096:1` has other ground there. With all levels that the smaller one has, six, the window of the coarsest
//! is larger than it, and the larger terrain shows more ground by more triangles.

use clipscape::camera::Camera;
use clipscape::clipmap::ClipmapOptions;
use clipscape::gpu::{self, Gpu};
use clipscape::grid::{Grid, PATCH, Rect};
use clipscape::levels::{Arrival, Bounds, Levels, LightSample};
use clipscape::query::{S0, Surface};
use clipscape::render::{Headless, HeadlessOptions};
use clipscape::source::Synth;
use clipscape::stats::percentile;
use clipscape::{Error, ErrorKind, Result};
use glam::DVec3;

const SMALL: i64 = 4096;
const LARGE: i64 = 1 << 20;
const CLIP_SIZE: i64 = 256;

/// Frames of a round: once around the middle.
const FRAMES: u32 = 30;

/// The middle of the larger terrain as one of its own, a sample larger: its edge lies on a sample of every level.
struct Middle {
    grid: Grid,
    whole: Synth,
}

impl Middle {
    fn new(whole: Synth) -> Self {
        let spacing_m = Levels::grid(&whole).spacing_m;
        Self {
            grid: Grid::new(SMALL + 1, SMALL + 1, spacing_m),
            whole,
        }
    }

    /// Where a rectangle of it lies in the whole, in units of `unit` samples of level 0.
    fn placed(rect: Rect, unit: i64) -> Rect {
        let shift = (LARGE - SMALL) / 2 / unit;
        Rect::new(rect.x0 + shift, rect.z0 + shift, rect.x1 + shift, rect.z1 + shift)
    }
}

impl Levels for Middle {
    fn grid(&self) -> &Grid {
        &self.grid
    }

    fn heights(&self, level: u32, rect: Rect, out: &mut [f32]) -> Result<Arrival> {
        self.whole.heights(level, Self::placed(rect, 1 << level), out)
    }

    fn bounds(&self, level: u32, patches: Rect, out: &mut [Bounds]) -> Result<Arrival> {
        self.whole
            .bounds(level, Self::placed(patches, PATCH << level), out)
    }

    fn has_light(&self) -> bool {
        false
    }

    fn light(&self, level: u32, rect: Rect, out: &mut [LightSample]) -> Result<Arrival> {
        self.whole.light(level, rect, out)
    }
}

/// What frames over a terrain took.
#[derive(Default)]
struct Taken {
    ms: Vec<f64>,
    triangles: u64,
    depths: Vec<Vec<f32>>,
}

impl Taken {
    /// Median and 99th percentile in ms, triangles a frame in thousands.
    fn figures(&self) -> [f64; 3] {
        let mut ms = self.ms.clone();
        ms.sort_by(f64::total_cmp);
        let triangles = self.triangles as f64 / ms.len() as f64;
        [percentile(&ms, 50.0), percentile(&ms, 99.0), triangles / 1e3]
    }
}

pub(crate) fn size(rounds: u32) -> Result<()> {
    let gpu = match gpu::open() {
        Ok(gpu) => gpu,
        Err(error) => {
            println!("\nno frames of two sizes: {error}");
            return Ok(());
        }
    };
    let large = Synth::new(LARGE, 1)?;
    let terrains: [(&str, Box<dyn Levels>); 3] = [
        ("synth:4096:1", Box::new(Synth::new(SMALL, 1)?)),
        (
            "the middle 4097 of synth:1048576:1",
            Box::new(Middle::new(large.clone())),
        ),
        ("synth:1048576:1", Box::new(large)),
    ];
    let all = Grid::new(SMALL, SMALL, [1.0; 2]).levels_until(CLIP_SIZE);
    let within = (0..all).take_while(|l| CLIP_SIZE << l <= SMALL).count() as u32;
    for levels in [within, all] {
        let [small, middle, whole] = compare(&gpu, &terrains, levels, rounds)?;
        println!(
            "\nframe time, {levels} levels, 640x360, {} frames each in turn: milliseconds",
            small.ms.len()
        );
        println!("| terrain | median | p99 | thousand triangles | ms a million of them |");
        println!("|---|---|---|---|---|");
        for ((name, _), taken) in terrains.iter().zip([&small, &middle, &whole]) {
            let [median, p99, triangles] = taken.figures();
            println!(
                "| {name} | {median:.2} | {p99:.2} | {triangles:.1} | {:.1} |",
                1e3 * median / triangles
            );
        }
        let of = |taken: &Taken| taken.figures();
        for (name, other) in [("its middle", &middle), ("synth:4096:1", &small)] {
            let [[a, a99, at], [b, b99, bt]] = [of(&whole), of(other)];
            println!(
                "synth:1048576:1 over {name}: median {:.3}, p99 {:.3}, triangles {:.3}, median a triangle {:.3}",
                a / b,
                a99 / b99,
                at / bt,
                a / at / (b / bt)
            );
        }
        let same = middle.depths == whole.depths;
        println!(
            "depths of {} frames of it and of its middle: {}",
            whole.depths.len(),
            if same { "the same bits" } else { "not the same" }
        );
        if levels == within && !same {
            let what = "frames of the same ground differ, so their times say nothing";
            return Err(Error::new(ErrorKind::Misuse, "bench", what));
        }
    }
    Ok(())
}

/// Frames around the middle of each terrain, in turn.
fn compare(
    gpu: &Gpu,
    terrains: &[(&str, Box<dyn Levels>); 3],
    levels: u32,
    rounds: u32,
) -> Result<[Taken; 3]> {
    let options = HeadlessOptions {
        size_px: [640, 360],
        traced_light: false,
        clipmap: ClipmapOptions {
            clip_size: CLIP_SIZE,
            levels: Some(levels),
            ..Default::default()
        },
        ..Default::default()
    };
    let mut views = Vec::new();
    for (_, terrain) in terrains {
        let grid = terrain.grid();
        // The sample of the middle, whose place is a whole number of steps of every level that is drawn.
        let middle = (grid.size.width / 2) as f64 * grid.spacing_m[0];
        let ground = S0::new(terrain.as_ref()).height_at(middle, middle)?;
        let middle = DVec3::new(middle, ground.unwrap_or_default() + 1500.0, middle);
        views.push((Headless::new(gpu.clone(), terrain.as_ref(), &options)?, middle));
    }
    let mut taken = [(); 3].map(|()| Taken::default());
    for k in 0..rounds * FRAMES {
        let angle = std::f64::consts::TAU * f64::from(k % FRAMES) / f64::from(FRAMES);
        for ((terrain, view), taken) in terrains.iter().map(|t| &t.1).zip(&mut views).zip(&mut taken) {
            let (headless, middle) = view;
            let camera = Camera {
                // Within the 32 samples over which the coarsest window of the smaller terrain can follow.
                eye: *middle + 400.0 * DVec3::new(angle.sin(), 0.0, angle.cos()),
                heading_deg: 12.0 * f64::from(k),
                pitch_deg: -15.0,
                roll_deg: 0.0,
                fov_deg: 60.0,
            };
            let frame = headless.frame(terrain.as_ref(), &camera, 0.0)?;
            if k == 0 {
                continue; // it fills the windows
            }
            taken.ms.push(frame.frame_ms);
            taken.triangles += frame.draw.triangles;
            if k < FRAMES {
                taken.depths.push(headless.read_depth()?);
            }
        }
    }
    Ok(taken)
}
