//! On an adapter: read-back textures, the vertex twin, and displaced depths.
#![cfg(feature = "gpu")]

mod support;

use clipscape::camera::{Camera, Depth, DepthDirection, View};
use clipscape::clipmap::{Clipmap, ClipmapOptions, VOID_HEIGHT, Vertex, displace, light_level};
use clipscape::gpu::{Parts, compose, read};
use clipscape::grid::{Grid, PATCH};
use clipscape::levels::Levels;
use clipscape::light::Sun;
use clipscape::render::{Headless, HeadlessOptions};
use glam::DVec3;
use glam::dcamera::rh::proj::directx;
use glam::dcamera::rh::view::look_to_mat4;
use support::{Formula, Random, gpu, hash, hills, seed};
use wgpu::util::DeviceExt as _;

/// Hills with voids here and there.
fn ground(level: u32, i: i64, j: i64) -> f32 {
    let (x, z) = (i << level, j << level);
    let lake = (x / 90 + z / 70) % 5 == 3 && hash(level, i, j) < 0.1;
    if lake { f32::NAN } else { hills(level, i, j) }
}

fn camera(random: &mut Random, grid: &Grid) -> Camera {
    let side = |axis: usize, samples: i64| grid.spacing_m[axis] * samples as f64;
    let near_ground = random.uniform(0.0, 1.0) < 0.3;
    let eye = DVec3::new(
        random.uniform(-0.1, 1.1) * side(0, grid.size.width),
        if near_ground {
            random.uniform(-50.0, 250.0)
        } else {
            random.uniform(250.0, 6000.0)
        },
        random.uniform(-0.1, 1.1) * side(1, grid.size.height),
    );
    Camera {
        eye,
        heading_deg: random.uniform(0.0, 360.0),
        pitch_deg: random.uniform(-90.0, 10.0),
        roll_deg: random.uniform(-20.0, 20.0),
        fov_deg: random.uniform(20.0, 90.0),
    }
}

/// A view by matrices: a part beside the middle of what the camera sees, reversed depth with an end.
fn off_axis(camera: &Camera, random: &mut Random) -> View {
    let axes = camera.axes();
    let view = look_to_mat4(camera.eye, axes.col(2), axes.col(1));
    let (left, bottom) = (random.uniform(-1.0, 0.2), random.uniform(-1.0, 0.2));
    let far = random.uniform(4e3, 4e4);
    let mut projection = directx::frustum(left, left + 0.8, bottom, bottom + 0.7, 1.0, 2.0);
    let depth = Depth::new(DepthDirection::Reversed, 2.0, far).unwrap();
    let [a, b] = depth.terms();
    (projection.z_axis.z, projection.w_axis.z) = (-a, b);
    View::from_matrices(view, projection, [64, 64]).unwrap()
}

fn options(clip_size: i64, size_px: [u32; 2]) -> HeadlessOptions {
    HeadlessOptions {
        size_px,
        sun: Sun {
            azimuth_deg: 315.0,
            altitude_deg: 45.0,
        },
        clipmap: ClipmapOptions {
            clip_size,
            ..Default::default()
        },
        ..Default::default()
    }
}

fn levels(width: i64, height: i64) -> Formula<fn(u32, i64, i64) -> f32> {
    let mut grid = Grid::new(width, height, [9.0, 11.0]);
    grid.offset = [1 << 33, -77];
    Formula::new(grid, ground)
}

#[test]
fn read_back_textures_equal_the_mirror_after_a_walk() {
    let Some(gpu) = gpu() else { return };
    let levels = levels(701, 523);
    let mut headless = Headless::new(gpu, &levels, &options(64, [32, 32])).unwrap();
    let seed = seed(3);
    let mut random = Random(seed);
    let mut eye = DVec3::new(900.0, 300.0, 900.0);
    for step in 0..300 {
        if step % 50 == 49 {
            eye = DVec3::new(random.uniform(-3e3, 9e3), 300.0, random.uniform(-3e3, 9e3));
        }
        eye += DVec3::new(random.uniform(-90.0, 90.0), 0.0, random.uniform(-90.0, 90.0));
        let camera = Camera {
            eye,
            heading_deg: 0.0,
            pitch_deg: -30.0,
            roll_deg: 0.0,
            fov_deg: 60.0,
        };
        let frame = headless.frame(&levels, &camera, 0.0).unwrap();
        assert_eq!(
            frame.upload.bytes, frame.update.upload_bytes_exposed,
            "seed {seed}, step {step}"
        );
    }
    assert_eq!(stale_texels(&headless, &levels), 0, "seed {seed}");
    // Control: the same comparison finds a source that changed behind the textures' back.
    let mut other = self::levels(701, 523);
    other.height = |l, i, j| ground(l, i, j) + 1.0;
    assert!(stale_texels(&headless, &other) > 1000);
}

/// Texels whose contents, read back, are not what `levels` says of their samples.
fn stale_texels(headless: &Headless, levels: &dyn Levels) -> usize {
    let mut stale = 0;
    for window in headless.clipmap().windows() {
        let layer = headless
            .gpu()
            .read_texture(headless.textures().heights(), window.level())
            .unwrap();
        let texels: Vec<f32> = bytemuck::pod_collect_to_vec(&layer);
        let mut naive = vec![0.0; window.resident().area() as usize];
        let _ = levels
            .heights(window.level(), window.resident(), &mut naive)
            .unwrap();
        let n = headless.textures().heights().width() as i64;
        for ((i, j), naive) in window.resident().cells().zip(naive) {
            let [x, z] = window.slot_of(i, j);
            let want = if naive.is_nan() { VOID_HEIGHT } else { naive };
            stale += usize::from(texels[(z * n + x) as usize].to_bits() != want.to_bits());
        }
        let layer = headless
            .gpu()
            .read_texture(headless.textures().light(), window.level())
            .unwrap();
        let texels: Vec<[u16; 4]> = bytemuck::pod_collect_to_vec(&layer);
        for (i, j) in window.light_resident().cells() {
            let [x, z] = window.light_slot_of(i, j);
            let texel = texels[(z * 2 * n + x) as usize];
            let want = Formula::<fn(u32, i64, i64) -> f32>::light_at(light_level(window.level()), i, j);
            stale += usize::from(texel[0] != want.sun.to_bits() || texel[1] != want.sky.to_bits());
        }
    }
    stale
}

/// Computes the vertices of all drawn patches on the device, with the shader's own `displace`.
fn displace_on_device(headless: &Headless) -> Vec<Vertex> {
    const PROBE: &str = "
#import shared/surface.wgsl
struct Instance { origin: vec2<i32>, level: u32, fill: f32 }
struct Out { from_eye: vec2<f32>, height: f32, alpha: f32, clip: vec4<f32>, void: u32, a: u32, b: u32, c: u32 }
@group(1) @binding(0) var<storage, read> instances: array<Instance>;
@group(1) @binding(1) var<storage, read_write> out: array<Out>;
@compute @workgroup_size(64)
fn probe(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&out) { return; }
    let instance = instances[id.x / 81u];
    let corner = vec2<i32>(vec2(id.x % 81u % PATCH_CORNERS, id.x % 81u / PATCH_CORNERS));
    let v = displace(instance.origin, instance.level, instance.fill, corner);
    out[id.x] = Out(v.from_eye, v.height, v.alpha, v.clip, u32(v.void), 0u, 0u, 0u);
}";
    let device = &headless.gpu().device;
    let instances: Vec<_> = headless.clipmap().selection().instances().copied().collect();
    if instances.is_empty() {
        return Vec::new();
    }
    let count = instances.len() * 81;
    let source = compose("probe.wgsl", PROBE, &Parts::default()).unwrap().source;
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    let storage = |binding, read_only| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    };
    let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: None,
        entries: &[storage(0, true), storage(1, false)],
    });
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(headless.renderer().bind_group_layout()), Some(&layout)],
        immediate_size: 0,
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: None,
        layout: Some(&pipeline_layout),
        module: &module,
        entry_point: Some("probe"),
        compilation_options: Default::default(),
        cache: None,
    });
    let input = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: None,
        contents: bytemuck::cast_slice(&instances),
        usage: wgpu::BufferUsages::STORAGE,
    });
    let buffer = |usage| {
        device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: count as u64 * 48,
            usage,
            mapped_at_creation: false,
        })
    };
    let output = buffer(wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
    let mappable = buffer(wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ);
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &layout,
        entries: &[
            wgpu::BindGroupEntry {
                binding: 0,
                resource: input.as_entire_binding(),
            },
            wgpu::BindGroupEntry {
                binding: 1,
                resource: output.as_entire_binding(),
            },
        ],
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, headless.textures().bind_group(), &[]);
    pass.set_bind_group(1, &group, &[]);
    pass.dispatch_workgroups((count as u32).div_ceil(64), 1, 1);
    drop(pass);
    encoder.copy_buffer_to_buffer(&output, 0, &mappable, 0, count as u64 * 48);
    headless.gpu().queue.submit([encoder.finish()]);
    let words: Vec<[f32; 12]> = bytemuck::pod_collect_to_vec(&read(device, &mappable).unwrap());
    let vertex = |w: [f32; 12]| Vertex {
        from_eye: [w[0], w[1]],
        height: w[2],
        alpha: w[3],
        clip: [w[4], w[5], w[6], w[7]],
        void: w[8].to_bits() != 0,
    };
    words.into_iter().map(vertex).collect()
}

fn displace_on_cpu(clipmap: &Clipmap) -> Vec<Vertex> {
    let corners = PATCH as i32 + 1;
    let patch =
        |instance| (0..corners * corners).map(move |k| displace(clipmap, instance, k % corners, k / corners));
    clipmap.selection().instances().flat_map(patch).collect()
}

/// The greatest difference of heights and clip coordinates over the stated bound, and how many vertices differ.
fn compare(device: &[Vertex], twin: &[Vertex], clipmap: &Clipmap) -> (f64, usize) {
    assert_eq!(device.len(), twin.len());
    let view = clipmap.view_constants();
    let (mut worst, mut differing) = (0.0f64, 0);
    for (d, t) in device.iter().zip(twin) {
        differing += usize::from(d != t);
        if (d.alpha == 0.0) != (t.alpha == 0.0) || (d.alpha == 1.0) != (t.alpha == 1.0) || d.void != t.void {
            return (f64::INFINITY, differing);
        }
        let ulp = f64::from(f32::EPSILON);
        // Both heights between which the vertex lies are hills of less than 300 m.
        let height_bound = 2.0 * ulp * 300.0;
        worst = worst.max(f64::from((d.height - t.height).abs()) / height_bound);
        let up = f64::from(t.height - view.eye_height_m[0]) - f64::from(view.eye_height_m[1]);
        let terms = [
            f64::from(t.from_eye[0] * view.spacing_m[0]),
            up,
            f64::from(t.from_eye[1] * view.spacing_m[1]),
        ];
        for k in [0, 1, 3] {
            let columns = [
                view.clip_from_east[k],
                view.clip_from_up[k],
                view.clip_from_south[k],
            ];
            let sum: f64 = terms
                .iter()
                .zip(columns)
                .map(|(t, c)| (t * f64::from(c)).abs())
                .sum();
            let bound = 2.0 * ulp * sum + height_bound * f64::from(columns[1].abs()) + f64::MIN_POSITIVE;
            worst = worst.max(f64::from((d.clip[k] - t.clip[k]).abs()) / bound);
        }
        let [a, b] = view.depth.map(f64::from);
        let w = f64::from(t.clip[3]);
        let of_w = a.abs() * f64::from((d.clip[3] - t.clip[3]).abs());
        let bound = of_w + 2.0 * ulp * ((a * w).abs() + b.abs());
        worst = worst.max(f64::from((d.clip[2] - t.clip[2]).abs()) / bound);
        // Independent of the twin: z follows from w.
        let z_off = (f64::from(t.clip[2]) - (a * w + b)).abs();
        worst = worst.max(z_off / (2.0 * ulp * ((a * w).abs() + b.abs())));
    }
    (worst, differing)
}

#[test]
fn displaced_vertices_equal_the_twin_s() {
    let Some(gpu) = gpu() else { return };
    let software = gpu.info.device_type == wgpu::DeviceType::Cpu;
    let seed = seed(4);
    let mut random = Random(seed);
    let mut controlled = 0;
    for (width, height, clip_size) in [(701, 523, 64), (1300, 900, 128), (60, 40, 64)] {
        let levels = levels(width, height);
        let mut headless = Headless::new(gpu.clone(), &levels, &options(clip_size, [64, 64])).unwrap();
        for k in 0..20 {
            let camera = camera(&mut random, &levels.grid);
            let mut view = View::new(camera, [64, 64]).unwrap();
            if k % 3 == 1 {
                view = off_axis(&camera, &mut random);
            }
            headless.frame_of(&levels, &view, 0.0).unwrap();
            let twin = displace_on_cpu(headless.clipmap());
            let device = displace_on_device(&headless);
            let (worst, differing) = compare(&device, &twin, headless.clipmap());
            assert!(
                worst <= 1.0,
                "seed {seed}, camera {k} {camera:?}: {worst} times the bound"
            );
            if software {
                assert_eq!(
                    differing, 0,
                    "seed {seed}, camera {k}: a software adapter agrees bit for bit"
                );
            }
            // Control: a twin whose mirror holds other samples than the textures is caught.
            if k % 5 == 0 {
                let mut raised = self::levels(width, height);
                raised.height = |l, i, j| ground(l, i, j) + if (7 * i + j) % 13 == 0 { 0.01 } else { 0.0 };
                let mut other = Clipmap::new(&raised, &options(clip_size, [64, 64]).clipmap).unwrap();
                other.update(&raised, &view, 0.0).unwrap();
                // `fill` follows the bounds, which may differ.
                let patches = |c: &Clipmap| -> Vec<_> {
                    c.selection().instances().map(|i| (i.level, i.origin)).collect()
                };
                let same_patches = patches(&other) == patches(headless.clipmap());
                if !same_patches {
                    continue;
                }
                let differs = compare(&device, &displace_on_cpu(&other), headless.clipmap()).0 > 1.0;
                assert!(twin.is_empty() || differs);
                controlled += u32::from(differs);
            }
        }
    }
    assert!(controlled > 0, "seed {seed}: no control was made");
}

/// Depth of the twin's triangles at a point of the picture: the greatest (nearest) of all that cover it.
struct TwinDepth {
    triangles: Vec<[[f64; 3]; 3]>,
}

impl TwinDepth {
    fn new(clipmap: &Clipmap, size_px: [u32; 2]) -> Self {
        let view = clipmap.view_constants();
        let (near, corners) = (f64::from(view.near_m), PATCH as i32 + 1);
        let mut triangles = Vec::new();
        for instance in clipmap.selection().instances() {
            let vertex = |x, z| displace(clipmap, instance, x, z);
            for z in 0..corners - 1 {
                for x in 0..corners - 1 {
                    let (nw, ne) = (vertex(x, z), vertex(x + 1, z));
                    let (sw, se) = (vertex(x, z + 1), vertex(x + 1, z + 1));
                    for t in [[nw, sw, se], [nw, se, ne]] {
                        // Whatever crosses the near plane is clipped by the device; here such frames are not drawn.
                        if t.iter().any(|v| v.void) || t.iter().all(|v| v.clip[3] < view.near_m) {
                            continue;
                        }
                        assert!(
                            t.iter().all(|v| f64::from(v.clip[3]) > near),
                            "a triangle crosses the near plane"
                        );
                        triangles.push(t.map(|v| {
                            let w = f64::from(v.clip[3]);
                            [
                                (f64::from(v.clip[0]) / w + 1.0) / 2.0 * f64::from(size_px[0]),
                                (1.0 - f64::from(v.clip[1]) / w) / 2.0 * f64::from(size_px[1]),
                                near / w,
                            ]
                        }));
                    }
                }
            }
        }
        Self { triangles }
    }

    /// Least and greatest of the nearest depths at a pixel's centre and `spread` pixels around it.
    fn image(&self, size_px: [u32; 2], spread: f64) -> Vec<[f64; 2]> {
        let offsets = [(0.0, 0.0), (-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0)];
        let (w, h) = (size_px[0] as i64, size_px[1] as i64);
        let mut nearest = vec![[0.0f64; 5]; (w * h) as usize];
        for [a, b, c] in &self.triangles {
            let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            if area == 0.0 {
                continue;
            }
            let low = |k: usize| a[k].min(b[k]).min(c[k]) - 1.0;
            let high = |k: usize| a[k].max(b[k]).max(c[k]) + 1.0;
            for y in (low(1).max(0.0) as i64)..=(high(1).min(h as f64 - 1.0) as i64) {
                for x in (low(0).max(0.0) as i64)..=(high(0).min(w as f64 - 1.0) as i64) {
                    for (k, (ox, oy)) in offsets.iter().enumerate() {
                        let p = [x as f64 + 0.5 + ox * spread, y as f64 + 0.5 + oy * spread];
                        let edge = |u: &[f64; 3], v: &[f64; 3]| {
                            ((v[0] - u[0]) * (p[1] - u[1]) - (v[1] - u[1]) * (p[0] - u[0])) / area
                        };
                        let (wa, wb, wc) = (edge(b, c), edge(c, a), edge(a, b));
                        if wa >= 0.0 && wb >= 0.0 && wc >= 0.0 {
                            let depth = wa * a[2] + wb * b[2] + wc * c[2];
                            let slot = &mut nearest[(y * w + x) as usize][k];
                            *slot = slot.max(depth);
                        }
                    }
                }
            }
        }
        let range = |d: &[f64; 5]| {
            [
                d.iter().copied().fold(f64::INFINITY, f64::min),
                d.iter().copied().fold(0.0, f64::max),
            ]
        };
        nearest.iter().map(range).collect()
    }
}

#[test]
fn drawn_depths_equal_those_of_the_twin_s_triangles() {
    let Some(gpu) = gpu() else { return };
    let size_px = [96, 64];
    let mut flat = levels(700, 500);
    flat.height = hills; // without voids: their outlines are drawn by interpolated validity
    let mut headless = Headless::new(gpu, &flat, &options(64, size_px)).unwrap();
    let seed = seed(5);
    let mut random = Random(seed);
    for k in 0..12 {
        let camera = Camera {
            eye: DVec3::new(
                random.uniform(500.0, 5500.0),
                random.uniform(700.0, 3000.0),
                random.uniform(500.0, 5000.0),
            ),
            heading_deg: random.uniform(0.0, 360.0),
            pitch_deg: random.uniform(-80.0, -45.0),
            roll_deg: 0.0,
            fov_deg: 50.0,
        };
        headless.frame(&flat, &camera, 0.0).unwrap();
        let drawn = headless.read_depth().unwrap();
        let grid = &flat.grid;
        let twin = TwinDepth::new(headless.clipmap(), size_px);
        // A pixel samples at its centre within the rasteriser's grid of 1/256 pixel; half as much again for f32.
        let image = twin.image(size_px, 1.5 / 256.0);
        let edge = headless.clipmap().view_constants().edge;
        assert!(edge[0] > 0.0 && edge[1] > 0.0, "the eye stands over {grid:?}");
        let mut wrong = 0;
        for (d, [low, high]) in drawn.iter().map(|d| f64::from(*d)).zip(&image) {
            // f32 depth is a quotient of rounded terms, interpolated: a few ulps of relative error.
            let slack = 16.0 * f64::from(f32::EPSILON) * high;
            // Triangles past the DEM's edge are cut on the device only.
            wrong += usize::from(d > 0.0 && !(low - slack <= d && d <= high + slack));
        }
        assert_eq!(wrong, 0, "seed {seed}, camera {k} {camera:?}");
        let covered = drawn.iter().filter(|d| **d > 0.0).count();
        assert!(
            covered > 500,
            "seed {seed}, camera {k}: only {covered} pixels of terrain"
        );
        // Control: terrain a hundredth of its distance nearer is caught.
        let nearer = drawn.iter().zip(&image).filter(|(d, [_, high])| {
            let d = f64::from(**d) * 1.01;
            d > 0.0 && d > high * (1.0 + 16.0 * f64::from(f32::EPSILON))
        });
        assert!(nearer.count() > covered / 2);
    }
}
