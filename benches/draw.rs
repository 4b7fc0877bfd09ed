//! What drawing a clipmap costs beside drawing its triangles, what culling saves, and what selection and plans cost.
//!
//!     cargo bench --bench draw [-- ROUNDS]
//!
//! Over the shipped DEM and flight, clip size 256, in one run. Whatever is compared is drawn in turn, in the opposite
//! order every other round, each after an untimed draw of its own; printed are medians over all frames and rounds, and
//! medians of the ratios of what was drawn side by side. Times are wall milliseconds from recording to completion.
//!
//! 1. *Displaced or static*: the same triangles from a vertex buffer that the twin filled beforehand (place, height,
//!    alpha, level: what the vertex function computes from textures and the held field), shaded by the same fragment
//!    function, with the same indices.
//! 2. *Culling* on and off; and the same triangles from static vertex buffers, whose ratio is that of a vertex function
//!    without work: the cheaper vertices are, the less culling them saves.
//! 3. *CPU*: an update that only turns (selection alone), and the flight's own, which move windows.
#![allow(clippy::print_stdout, reason = "a bench prints its table")]

mod support;

use std::time::Instant;

use bytemuck::{Pod, Zeroable};
use clipscape::camera::{Camera, View};
use clipscape::clipmap::{CLOSER_TRIANGLES, Clipmap, Instance, Side, displace};
use clipscape::gpu::Gpu;
use clipscape::grid::PATCH;
use clipscape::progress::Silent;
use clipscape::render::Headless;
use clipscape::stream::Terrain;
use clipscape::{Flight, Result};
use support::rounds::{median, percentile};
use support::{Targets, met, module, options, pipeline, shader_constants};
use wgpu::util::DeviceExt as _;

const SIZES_PX: [[u32; 2]; 2] = [[1280, 720], [16, 9]];

/// Every fourth of the flight's 120 frames.
const FRAME_STEP: usize = 4;

/// What the terrain's vertex function hands on, but for the projection.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct StaticVertex {
    /// Samples from the eye, height, level and alpha in one.
    ground: [f32; 4],
    valid: f32,
}

const STATIC_SHADER: &str = "
#import terrain.wgsl

fn projected(ground: vec4<f32>) -> vec4<f32> {
    let east = ground.x * view.spacing_m.x;
    let up = ((ground.z - view.eye_height_m.x) - view.eye_height_m.y) * view.vertical_scale;
    let south = ground.y * view.spacing_m.y;
    let position = view.clip_from_east * east + view.clip_from_up * up + view.clip_from_south * south;
    return vec4(position.x, position.y, view.near_m, position.w);
}

@vertex
fn static_whole(@location(0) ground: vec4<f32>, @location(1) valid: f32) -> WholeVaryings {
    return WholeVaryings(projected(ground), ground);
}

@vertex
fn static_ragged(@location(0) ground: vec4<f32>, @location(1) valid: f32) -> RaggedVaryings {
    return RaggedVaryings(projected(ground), ground, valid);
}
";

/// A frame's triangles in static buffers.
struct StaticMesh {
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    /// Ends of the indices of still and of whole patches, and of all.
    ends: [u32; 3],
}

impl StaticMesh {
    fn new(gpu: &Gpu, clipmap: &Clipmap) -> Self {
        let (mut vertices, mut indices) = (Vec::new(), Vec::<u32>::new());
        let corners = PATCH as i32 + 1;
        let corner = |x: i32, z: i32| (z * corners + x) as u32;
        let selection = clipmap.selection();
        let add = |instance: &Instance, vertices: &mut Vec<StaticVertex>| {
            let first = vertices.len() as u32;
            vertices.extend((0..corners * corners).map(|k| {
                let vertex = displace(clipmap, instance, k % corners, k / corners);
                StaticVertex {
                    ground: [
                        vertex.from_eye[0],
                        vertex.from_eye[1],
                        vertex.height,
                        2.0 * instance.level as f32 + vertex.alpha,
                    ],
                    valid: f32::from(u8::from(!vertex.void)),
                }
            }));
            first
        };
        let mut ends = [0; 3];
        for (patches, end) in [&selection.still, &selection.whole, &selection.ragged]
            .into_iter()
            .zip(&mut ends)
        {
            for instance in patches {
                let first = add(instance, &mut vertices);
                for k in 0..(PATCH * PATCH) as i32 {
                    let (x, z) = (k % PATCH as i32, k / PATCH as i32);
                    let [nw, ne] = [corner(x, z), corner(x + 1, z)];
                    let [sw, se] = [corner(x, z + 1), corner(x + 1, z + 1)];
                    indices.extend([nw, sw, se, nw, se, ne].map(|k| first + k));
                }
            }
            *end = indices.len() as u32;
        }
        for (side, patches) in Side::ALL.into_iter().zip(&selection.closers) {
            for instance in patches {
                let first = add(instance, &mut vertices);
                let at = |k: i32| match side {
                    Side::West => corner(0, k),
                    Side::East => corner(PATCH as i32, k),
                    Side::North => corner(k, 0),
                    Side::South => corner(k, PATCH as i32),
                };
                for k in 0..CLOSER_TRIANGLES as i32 {
                    indices.extend([2 * k + 1, 2 * k, 2 * k + 2].map(|k| first + at(k)));
                }
            }
        }
        ends[2] = indices.len() as u32;
        let buffer = |contents: &[u8], usage| {
            gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("clipscape bench static mesh"),
                contents,
                usage,
            })
        };
        Self {
            vertices: buffer(bytemuck::cast_slice(&vertices), wgpu::BufferUsages::VERTEX),
            indices: buffer(bytemuck::cast_slice(&indices), wgpu::BufferUsages::INDEX),
            ends,
        }
    }
}

struct StaticPipelines {
    still: wgpu::RenderPipeline,
    whole: wgpu::RenderPipeline,
    ragged: wgpu::RenderPipeline,
}

impl StaticPipelines {
    fn new(gpu: &Gpu, headless: &Headless) -> Result<Self> {
        let module = module(gpu, "static.wgsl", STATIC_SHADER)?;
        let layout = headless.renderer().bind_group_layout();
        let make = |entries, morphs: f64| {
            let mut constants = shader_constants().to_vec();
            constants.push(("MORPHS", morphs));
            let buffers = [Some(wgpu::VertexBufferLayout {
                array_stride: size_of::<StaticVertex>() as u64,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &wgpu::vertex_attr_array![0 => Float32x4, 1 => Float32],
            })];
            pipeline(
                gpu,
                "clipscape bench static",
                &module,
                &[Some(layout)],
                &constants,
                entries,
                &buffers,
            )
        };
        let whole = ["static_whole", "whole_fragment"];
        Ok(Self {
            still: make(whole, 0.0),
            whole: make(whole, 1.0),
            ragged: make(["static_ragged", "ragged_fragment"], 1.0),
        })
    }

    fn draw(&self, pass: &mut wgpu::RenderPass<'_>, mesh: &StaticMesh, headless: &Headless) {
        pass.set_bind_group(0, headless.textures().bind_group(), &[]);
        pass.set_vertex_buffer(0, mesh.vertices.slice(..));
        pass.set_index_buffer(mesh.indices.slice(..), wgpu::IndexFormat::Uint32);
        let mut first = 0;
        for (pipeline, end) in [&self.still, &self.whole, &self.ragged]
            .into_iter()
            .zip(mesh.ends)
        {
            pass.set_pipeline(pipeline);
            pass.draw_indexed(first..end, 0, 0..1);
            first = end;
        }
    }
}

/// Two ways of drawing, side by side.
#[derive(Default)]
struct Pair {
    ms: [Vec<f64>; 2],
}

impl Pair {
    /// Draws both, each after an untimed draw; the second first in odd rounds.
    fn time(&mut self, round: usize, mut draw: impl FnMut(usize) -> Result<f64>) -> Result<()> {
        let order = if round.is_multiple_of(2) { [0, 1] } else { [1, 0] };
        for which in order {
            draw(which)?;
            self.ms[which].push(draw(which)?);
        }
        Ok(())
    }

    /// Medians of both, and of the first over the second.
    fn medians(&self) -> [f64; 3] {
        let ratios: Vec<_> = self.ms[0].iter().zip(&self.ms[1]).map(|(a, b)| a / b).collect();
        [median(&self.ms[0]), median(&self.ms[1]), median(&ratios)]
    }
}

fn main() {
    let mut arguments = std::env::args().skip(1).filter(|a| a != "--bench");
    let rounds = arguments.next().and_then(|a| a.parse().ok()).unwrap_or(3).max(1);
    if let Err(error) = run(rounds) {
        println!("draw: {error}");
        std::process::exit(1);
    }
}

fn run(rounds: usize) -> Result<()> {
    let terrain = Terrain::open("data/N42E001.hgt", &Silent)?;
    let json = std::fs::read_to_string("data/pyrenees.json")
        .map_err(|e| clipscape::Error::io("data/pyrenees.json", e))?;
    let flight = Flight::parse("data/pyrenees.json", &json)?;
    let flight: Vec<_> = (0..flight.frame_count())
        .map(|k| flight.camera_at_frame(k))
        .collect();
    let frames: Vec<_> = flight.iter().copied().step_by(FRAME_STEP).collect();
    let gpu = clipscape::gpu::open()?;
    println!(
        "{} ({}), {} of {} frames, {rounds} rounds, medians",
        gpu.info.name,
        gpu.driver(),
        frames.len(),
        flight.len()
    );
    displaced_or_static(&gpu, &terrain, &frames, rounds)?;
    culling(&gpu, &terrain, &frames, rounds)?;
    cpu(&terrain, &flight, rounds)
}

fn displaced_or_static(gpu: &Gpu, terrain: &Terrain, frames: &[Camera], rounds: usize) -> Result<()> {
    println!(
        "\ndraw, ms: clipmap, the same triangles from a static vertex buffer, ratio (aim: at most 1.10)"
    );
    for size_px in SIZES_PX {
        let mut headless = Headless::new(gpu.clone(), terrain, &options(size_px, true))?;
        let pipelines = StaticPipelines::new(gpu, &headless)?;
        let targets = Targets::new(gpu, size_px);
        let mut pair = Pair::default();
        let (mut triangles, mut differing, mut pixels) = (Vec::new(), 0, 0);
        for camera in frames.iter().step_by(2) {
            headless.frame(terrain, camera, 0.0)?;
            let mesh = StaticMesh::new(gpu, headless.clipmap());
            assert_eq!(
                u64::from(mesh.ends[2]) / 3,
                headless.clipmap().selection().triangles(),
                "both draw the same triangles"
            );
            triangles.push(f64::from(mesh.ends[2] / 3));
            let draw = |which| match which {
                0 => targets.clipmap_ms(&headless),
                _ => targets.draw_ms(|pass| pipelines.draw(pass, &mesh, &headless)),
            };
            draw(0)?;
            let ours = targets.read()?;
            draw(1)?;
            let theirs = targets.read()?;
            differing += (ours.1.iter().zip(&theirs.1)).filter(|(a, b)| a != b).count();
            pixels += ours.1.len();
            for round in 0..rounds {
                pair.time(round, draw)?;
            }
        }
        // Closing triangles interpolate differently; all else must be the same to the bit.
        assert!(
            differing * 1000 <= pixels,
            "{differing} of {pixels} pixels have another depth"
        );
        let [ours, theirs, ratio] = pair.medians();
        println!(
            "{:>9}  {ours:7.2}  {theirs:7.2}  {ratio:5.3} {}; {} triangles; {differing} of {pixels} \
             depths differ, by closing triangles",
            format!("{}x{}", size_px[0], size_px[1]),
            met(ratio <= 1.1),
            median(&triangles)
        );
    }
    Ok(())
}

fn culling(gpu: &Gpu, terrain: &Terrain, frames: &[Camera], rounds: usize) -> Result<()> {
    println!(
        "\ndraw, ms: with culling, without, times as fast (aims: 1.25 at 1280x720, 1.8 at 16x9); triangles, ratio (aim: \
         at most 0.30)"
    );
    for (size_px, aim) in SIZES_PX.into_iter().zip([1.25, 1.8]) {
        let mut culled = Headless::new(gpu.clone(), terrain, &options(size_px, true))?;
        let mut all = Headless::new(gpu.clone(), terrain, &options(size_px, false))?;
        let pipelines = StaticPipelines::new(gpu, &culled)?;
        let targets = Targets::new(gpu, size_px);
        let (mut pair, mut fixed) = (Pair::default(), Pair::default());
        let mut triangles = [0, 0];
        for camera in frames {
            let pictures = [
                culled.frame(terrain, camera, 0.0)?,
                all.frame(terrain, camera, 0.0)?,
            ];
            assert!(
                pictures[0].rgba8 == pictures[1].rgba8,
                "culling changes the picture"
            );
            for (sum, picture) in triangles.iter_mut().zip(&pictures) {
                *sum += picture.draw.triangles;
            }
            for round in 0..rounds {
                pair.time(round, |which| targets.clipmap_ms([&culled, &all][which]))?;
            }
            let meshes = [&culled, &all].map(|headless| StaticMesh::new(gpu, headless.clipmap()));
            for round in 0..rounds {
                fixed.time(round, |which| {
                    let headless = [&culled, &all][which];
                    targets.draw_ms(|pass| pipelines.draw(pass, &meshes[which], headless))
                })?;
            }
        }
        let [on, off, ratio] = pair.medians();
        let share = triangles[0] as f64 / triangles[1] as f64;
        println!(
            "{:>9}  {on:7.2}  {off:7.2}  {:5.2} {}; {} / {} triangles a frame, {share:.3} {}",
            format!("{}x{}", size_px[0], size_px[1]),
            1.0 / ratio,
            met(1.0 / ratio >= aim),
            triangles[0] / frames.len() as u64,
            triangles[1] / frames.len() as u64,
            met(share <= 0.30)
        );
        let [on, off, ratio] = fixed.medians();
        println!("   static  {on:7.2}  {off:7.2}  {:5.2}", 1.0 / ratio);
    }
    Ok(())
}

fn cpu(terrain: &Terrain, flight: &[Camera], rounds: usize) -> Result<()> {
    println!("\nClipmap::update, ms: median, 99th percentile (aim: at most 0.2)");
    let options = options([1280, 720], true).clipmap;
    let mut clipmap = Clipmap::new(terrain, &options)?;
    let mut update_ms = |camera: &Camera| -> Result<f64> {
        let view = View::new(*camera, [1280, 720])?;
        let start = Instant::now();
        clipmap.update(terrain, &view, 0.0)?;
        Ok(start.elapsed().as_secs_f64() * 1e3)
    };
    let (mut turning, mut flying) = (Vec::new(), Vec::new());
    for _ in 0..rounds {
        update_ms(&flight[0])?;
        for camera in flight {
            flying.push(update_ms(camera)?);
            for turn in 1..=3 {
                let turned = Camera {
                    heading_deg: camera.heading_deg + f64::from(turn) * 0.7,
                    ..*camera
                };
                turning.push(update_ms(&turned)?);
            }
        }
    }
    for (what, ms) in [
        ("a frame that only turns: selection and plan", &turning),
        ("the flight's frames: windows moved as well", &flying),
    ] {
        let middle = median(ms);
        println!(
            "{what:>45}  {middle:.3}  {:.3}  {}",
            percentile(ms, 99.0),
            met(middle <= 0.2)
        );
    }
    Ok(())
}
