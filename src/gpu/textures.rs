//! One view's state on the GPU: its levels' textures, constants and instances, and the one path that fills them.

use wgpu::util::DeviceExt as _;

use crate::clipmap::{
    Clipmap, HEIGHT_BYTES, Instance, LEVEL_SLOTS, LIGHT_BYTES, LevelConstants, VOID_HEIGHT, Window,
};
use crate::grid::Rect;
use crate::light::Sun;
use crate::shade::ShadeConstants;

/// What an upload wrote into textures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct UploadReport {
    /// Rectangles.
    pub uploads: u64,
    /// Their bytes.
    pub bytes: u64,
}

/// One view's state on the GPU. Made by [`super::ClipmapRenderer::textures`].
#[derive(Debug)]
pub struct ViewTextures {
    device: wgpu::Device,
    pub(super) heights: wgpu::Texture,
    pub(super) light: wgpu::Texture,
    held: wgpu::Texture,
    view_constants: wgpu::Buffer,
    level_constants: wgpu::Buffer,
    shade_constants: wgpu::Buffer,
    pub(super) bind_group: wgpu::BindGroup,
    pub(super) instances: wgpu::Buffer,
    generation: u64,
    held_generations: Vec<Option<u64>>,
    sun: Sun,
    staging: Vec<f32>,
    instance_staging: Vec<Instance>,
}

impl ViewTextures {
    pub(super) fn new(
        device: &wgpu::Device,
        layout: &wgpu::BindGroupLayout,
        sampler: &wgpu::Sampler,
        clipmap: &Clipmap,
        sun: Sun,
    ) -> Self {
        let levels = clipmap.windows().len() as u32;
        let ring = clipmap.ring();
        let layers = |label, side: i64, format| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d {
                    width: side as u32,
                    height: side as u32,
                    depth_or_array_layers: levels,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::TEXTURE_BINDING
                    | wgpu::TextureUsages::COPY_DST
                    | wgpu::TextureUsages::COPY_SRC,
                view_formats: &[],
            })
        };
        let heights = layers("clipscape heights", ring.clip_size, wgpu::TextureFormat::R32Float);
        let held = layers(
            "clipscape held corners",
            ring.held_size(),
            wgpu::TextureFormat::R32Float,
        );
        let light = layers(
            "clipscape light",
            ring.light_size(),
            wgpu::TextureFormat::Rgba16Float,
        );
        let uniform = |label, size| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let view_constants = uniform(
            "clipscape view constants",
            size_of_val(clipmap.view_constants()) as u64,
        );
        let level_constants = uniform(
            "clipscape level constants",
            (size_of::<LevelConstants>() * LEVEL_SLOTS) as u64,
        );
        let shade_constants = uniform("clipscape shade constants", size_of::<ShadeConstants>() as u64);
        let array = |texture: &wgpu::Texture| {
            texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2Array),
                ..Default::default()
            })
        };
        let views = [array(&heights), array(&held), array(&light)];
        let resources = [
            view_constants.as_entire_binding(),
            level_constants.as_entire_binding(),
            wgpu::BindingResource::TextureView(&views[0]),
            wgpu::BindingResource::TextureView(&views[1]),
            shade_constants.as_entire_binding(),
            wgpu::BindingResource::TextureView(&views[2]),
            wgpu::BindingResource::Sampler(sampler),
        ];
        let entries: Vec<_> = resources
            .into_iter()
            .zip(0..)
            .map(|(resource, binding)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("clipscape view"),
            layout,
            entries: &entries,
        });
        Self {
            device: device.clone(),
            heights,
            light,
            held,
            view_constants,
            level_constants,
            shade_constants,
            bind_group,
            instances: instance_buffer(device, &[bytemuck::Zeroable::zeroed(); 1024]),
            generation: 0,
            held_generations: vec![None; levels as usize],
            sun,
            staging: Vec::new(),
            instance_staging: Vec::new(),
        }
    }

    /// Sets the sun by which slopes are lit where no light was traced, and around which the sky glows.
    pub fn set_sun(&mut self, sun: Sun) {
        self.sun = sun;
    }

    /// The height texture: R32Float, clip size squared, a layer per level.
    pub fn heights(&self) -> &wgpu::Texture {
        &self.heights
    }

    /// The light texture: Rgba16Float, twice the clip size squared, a layer per level.
    pub fn light(&self) -> &wgpu::Texture {
        &self.light
    }

    /// The constants, textures and sampler as a group for [`super::ClipmapRenderer::bind_group_layout`].
    pub fn bind_group(&self) -> &wgpu::BindGroup {
        &self.bind_group
    }

    pub(super) fn upload(&mut self, queue: &wgpu::Queue, clipmap: &Clipmap) -> UploadReport {
        let mut report = UploadReport::default();
        if self.generation != clipmap.generation() {
            let follows = self.generation + 1 == clipmap.generation();
            for plan in clipmap.plan().levels() {
                let window = &clipmap.windows()[plan.level as usize];
                if follows {
                    plan.heights
                        .iter()
                        .for_each(|&r| self.write_heights(queue, window, r, &mut report));
                    plan.light
                        .iter()
                        .for_each(|&r| self.write_light(queue, window, r, &mut report));
                } else {
                    // An update was not uploaded, so what the GPU holds is unknown: whole windows.
                    for rect in window.pieces(window.resident()) {
                        self.write_heights(queue, window, rect, &mut report);
                    }
                    for rect in window.light_pieces(window.light_resident()) {
                        self.write_light(queue, window, rect, &mut report);
                    }
                }
            }
            self.generation = clipmap.generation();
        }
        self.write_held(queue, clipmap);
        queue.write_buffer(
            &self.view_constants,
            0,
            bytemuck::bytes_of(clipmap.view_constants()),
        );
        queue.write_buffer(
            &self.level_constants,
            0,
            bytemuck::cast_slice(clipmap.level_constants()),
        );
        let shade = self.shade_constants(clipmap);
        queue.write_buffer(&self.shade_constants, 0, bytemuck::bytes_of(&shade));
        self.write_instances(queue, clipmap);
        report
    }

    /// The shading constants of a frame of `clipmap` under this view's sun.
    pub fn shade_constants(&self, clipmap: &Clipmap) -> ShadeConstants {
        ShadeConstants::new(
            &self.sun,
            clipmap.height_range_m(),
            clipmap.grid().base_m,
            clipmap.vertical_scale(),
        )
    }

    fn write_heights(&mut self, queue: &wgpu::Queue, window: &Window, rect: Rect, report: &mut UploadReport) {
        let (n, [x, z]) = (self.heights.width() as usize, window.slot_of(rect.x0, rect.z0));
        self.staging.clear();
        for row in 0..rect.height() {
            let first = (z + row) as usize * n + x as usize;
            let heights = &window.heights()[first..first + rect.width() as usize];
            self.staging
                .extend(heights.iter().map(|h| if h.is_nan() { VOID_HEIGHT } else { *h }));
        }
        let row_bytes = rect.width() as u32 * HEIGHT_BYTES as u32;
        let bytes = bytemuck::cast_slice(&self.staging);
        write(
            queue,
            &self.heights,
            window.level(),
            [x, z],
            rect,
            bytes,
            row_bytes,
        );
        report.uploads += 1;
        report.bytes += rect.area() as u64 * HEIGHT_BYTES;
    }

    fn write_light(&mut self, queue: &wgpu::Queue, window: &Window, rect: Rect, report: &mut UploadReport) {
        let (n, [x, z]) = (
            self.light.width() as usize,
            window.light_slot_of(rect.x0, rect.z0),
        );
        // The mirror has the texture's own layout: rows lie a whole row of slots apart.
        let first = z as usize * n + x as usize;
        let last = first + (rect.height() - 1) as usize * n + rect.width() as usize;
        let bytes = bytemuck::cast_slice(&window.light()[first..last]);
        write(
            queue,
            &self.light,
            window.level(),
            [x, z],
            rect,
            bytes,
            n as u32 * LIGHT_BYTES as u32,
        );
        report.uploads += 1;
        report.bytes += rect.area() as u64 * LIGHT_BYTES;
    }

    /// A level's grid of the held field is small; a change writes all of it.
    fn write_held(&mut self, queue: &wgpu::Queue, clipmap: &Clipmap) {
        let field = clipmap.held();
        let grid = Rect::new(0, 0, field.size(), field.size());
        for (level, held) in (0..).zip(&mut self.held_generations) {
            if *held != Some(field.generation(level)) {
                let bytes = bytemuck::cast_slice(field.grid(level));
                let row_bytes = field.size() as u32 * size_of::<f32>() as u32;
                write(queue, &self.held, level, [0, 0], grid, bytes, row_bytes);
                *held = Some(field.generation(level));
            }
        }
    }

    fn write_instances(&mut self, queue: &wgpu::Queue, clipmap: &Clipmap) {
        let selection = clipmap.selection();
        self.instance_staging.clear();
        self.instance_staging.extend(selection.instances());
        selection
            .closers
            .iter()
            .for_each(|side| self.instance_staging.extend(side));
        let bytes: &[u8] = bytemuck::cast_slice(&self.instance_staging);
        if bytes.len() as u64 > self.instances.size() {
            self.instances = instance_buffer(&self.device, &self.instance_staging);
        } else if !bytes.is_empty() {
            queue.write_buffer(&self.instances, 0, bytes);
        }
    }
}

fn instance_buffer(device: &wgpu::Device, instances: &[Instance]) -> wgpu::Buffer {
    device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("clipscape instances"),
        contents: bytemuck::cast_slice(instances),
        usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
    })
}

fn write(
    queue: &wgpu::Queue,
    texture: &wgpu::Texture,
    layer: u32,
    [x, z]: [i64; 2],
    rect: Rect,
    bytes: &[u8],
    row_bytes: u32,
) {
    queue.write_texture(
        wgpu::TexelCopyTextureInfo {
            texture,
            mip_level: 0,
            origin: wgpu::Origin3d {
                x: x as u32,
                y: z as u32,
                z: layer,
            },
            aspect: wgpu::TextureAspect::All,
        },
        bytes,
        wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(row_bytes),
            rows_per_image: None,
        },
        wgpu::Extent3d {
            width: rect.width() as u32,
            height: rect.height() as u32,
            depth_or_array_layers: 1,
        },
    );
}
