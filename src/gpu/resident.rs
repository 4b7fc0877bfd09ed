//! What the GPU holds of one view: its levels' textures, constants and instances, and how a frame's bytes get there.

use super::staging::{Place, Upload};
use crate::clipmap::{
    Clipmap, HEIGHT_BYTES, Instance, LEVEL_SLOTS, LIGHT_BYTES, LevelConstants, Ring, VOID_HEIGHT,
    ViewConstants, Window,
};
use crate::error::Result;
use crate::grid::Rect;
use crate::shade::ShadeConstants;

/// Instances for which there is room at first.
const INSTANCES: usize = 1024;

/// What an upload wrote into textures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct UploadReport {
    /// Rectangles of heights and light.
    pub uploads: u64,
    /// The bytes of their samples.
    pub bytes: u64,
}

/// One view's textures and buffers.
#[derive(Debug)]
pub(super) struct Resident {
    device: wgpu::Device,
    pub(super) heights: wgpu::Texture,
    pub(super) light: wgpu::Texture,
    corners: Corners,
    view_constants: wgpu::Buffer,
    level_constants: wgpu::Buffer,
    shade_constants: wgpu::Buffer,
    pub(super) bind_group: wgpu::BindGroup,
    pub(super) instances: wgpu::Buffer,
    row: Vec<f32>,
    instance_list: Vec<Instance>,
}

impl Resident {
    pub(super) fn new(
        device: &wgpu::Device,
        layout: &wgpu::BindGroupLayout,
        sampler: &wgpu::Sampler,
        ring: &Ring,
        levels: u32,
        day: bool,
    ) -> Self {
        let light_layers = levels * (1 + u32::from(day));
        let layers = |label, side, format| layers(device, label, side, levels, format);
        let heights = layers("clipscape heights", ring.clip_size, wgpu::TextureFormat::R32Float);
        let corners = Corners {
            texture: layers(
                "clipscape held corners",
                ring.held_size(),
                wgpu::TextureFormat::R32Float,
            ),
            generations: vec![None; levels as usize],
        };
        let light = self::layers(
            device,
            "clipscape light",
            ring.light_size(),
            light_layers,
            wgpu::TextureFormat::Rgba16Float,
        );
        let uniform = |label, size: usize| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: size as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let view_constants = uniform("clipscape view constants", size_of::<ViewConstants>());
        let level_constants = uniform(
            "clipscape level constants",
            size_of::<LevelConstants>() * LEVEL_SLOTS,
        );
        let shade_constants = uniform("clipscape shade constants", size_of::<ShadeConstants>());
        let array = |texture: &wgpu::Texture| {
            texture.create_view(&wgpu::TextureViewDescriptor {
                label: Some("clipscape levels"),
                dimension: Some(wgpu::TextureViewDimension::D2Array),
                ..Default::default()
            })
        };
        let views = [array(&heights), array(&corners.texture), array(&light)];
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
            corners,
            view_constants,
            level_constants,
            shade_constants,
            bind_group,
            instances: instance_buffer(device, INSTANCES),
            row: Vec::new(),
            instance_list: Vec::new(),
        }
    }

    /// Forgets what the held corners' texture holds.
    pub(super) fn forget(&mut self) {
        self.corners.generations.fill(None);
    }

    /// Records what leads to the clipmap's last update: from the one before, or from nothing.
    pub(super) fn record(
        &mut self,
        upload: &mut Upload<'_>,
        clipmap: &Clipmap,
        shade: &ShadeConstants,
        from_the_one_before: bool,
    ) -> Result<UploadReport> {
        let mut report = UploadReport::default();
        for plan in clipmap.plan().levels() {
            let window = &clipmap.windows()[plan.level as usize];
            if from_the_one_before {
                for &rect in &plan.heights {
                    self.heights(upload, window, rect, &mut report)?;
                }
                for &rect in &plan.light {
                    self.light(upload, window, rect, &mut report)?;
                }
            } else {
                for arrived in window.arrived() {
                    for rect in window.pieces(arrived) {
                        self.heights(upload, window, rect, &mut report)?;
                    }
                    for rect in window.light_pieces(window.light_of(arrived)) {
                        self.light(upload, window, rect, &mut report)?;
                    }
                }
            }
        }
        self.frame(upload, clipmap, shade)?;
        Ok(report)
    }

    /// Records what every frame has anew: held corners, constants, instances.
    pub(super) fn frame(
        &mut self,
        upload: &mut Upload<'_>,
        clipmap: &Clipmap,
        shade: &ShadeConstants,
    ) -> Result<()> {
        self.corners.record(upload, clipmap)?;
        upload.buffer(&self.view_constants, bytemuck::bytes_of(clipmap.view_constants()))?;
        upload.buffer(
            &self.level_constants,
            bytemuck::cast_slice(clipmap.level_constants()),
        )?;
        upload.buffer(&self.shade_constants, bytemuck::bytes_of(shade))?;
        self.instances(upload, clipmap)
    }

    fn heights(
        &mut self,
        upload: &mut Upload<'_>,
        window: &Window,
        rect: Rect,
        report: &mut UploadReport,
    ) -> Result<()> {
        let (n, [x, z]) = (self.heights.width() as usize, window.slot_of(rect.x0, rect.z0));
        let width = rect.width() as usize;
        let row = &mut self.row;
        upload.texture(
            &self.heights,
            place(window.level(), [x, z], rect),
            HEIGHT_BYTES as u32,
            |k, mut out| {
                let first = (z as usize + k) * n + x as usize;
                let heights = &window.heights()[first..first + width];
                row.clear();
                row.extend(heights.iter().map(|h| if h.is_nan() { VOID_HEIGHT } else { *h }));
                out.copy_from_slice(bytemuck::cast_slice(row));
            },
        )?;
        report.uploads += 1;
        report.bytes += rect.area() as u64 * HEIGHT_BYTES;
        Ok(())
    }

    fn light(
        &mut self,
        upload: &mut Upload<'_>,
        window: &Window,
        rect: Rect,
        report: &mut UploadReport,
    ) -> Result<()> {
        let n = self.light.width() as usize;
        let [x, z] = window.light_slot_of(rect.x0, rect.z0);
        let width = rect.width() as usize;
        upload.texture(
            &self.light,
            place(window.level(), [x, z], rect),
            LIGHT_BYTES as u32,
            |k, mut out| {
                let first = (z as usize + k) * n + x as usize;
                out.copy_from_slice(bytemuck::cast_slice(&window.light()[first..first + width]));
            },
        )?;
        report.uploads += 1;
        report.bytes += rect.area() as u64 * LIGHT_BYTES;
        if window.day().is_empty() {
            return Ok(());
        }
        // Light over a day stands in the layers behind.
        let layer = self.light.depth_or_array_layers() / 2 + window.level();
        upload.texture(
            &self.light,
            place(layer, [x, z], rect),
            LIGHT_BYTES as u32,
            |k, mut out| {
                let first = (z as usize + k) * n + x as usize;
                out.copy_from_slice(bytemuck::cast_slice(&window.day()[first..first + width]));
            },
        )?;
        report.uploads += 1;
        report.bytes += rect.area() as u64 * LIGHT_BYTES;
        Ok(())
    }

    fn instances(&mut self, upload: &mut Upload<'_>, clipmap: &Clipmap) -> Result<()> {
        let selection = clipmap.selection();
        self.instance_list.clear();
        self.instance_list.extend(selection.instances());
        for side in &selection.closers {
            self.instance_list.extend(side);
        }
        let bytes: &[u8] = bytemuck::cast_slice(&self.instance_list);
        if bytes.len() as u64 > self.instances.size() {
            // What was recorded before draws from the buffer that it was recorded with.
            self.instances = instance_buffer(&self.device, self.instance_list.len().next_power_of_two());
        }
        upload.buffer(&self.instances, bytes)
    }
}

/// The held field's corners on the GPU: a small grid a level, written where it has changed.
#[derive(Debug)]
struct Corners {
    texture: wgpu::Texture,
    /// By level: the generation of what the texture holds; none where that is unknown.
    generations: Vec<Option<u64>>,
}

impl Corners {
    fn record(&mut self, upload: &mut Upload<'_>, clipmap: &Clipmap) -> Result<()> {
        let field = clipmap.held();
        let side = field.size() as usize;
        let grid = Rect::new(0, 0, field.size(), field.size());
        for (level, held) in (0..).zip(&mut self.generations) {
            let now = Some(field.generation(level));
            if *held == now {
                continue;
            }
            let corners = field.grid(level);
            let place = place(level, [0, 0], grid);
            upload.texture(&self.texture, place, size_of::<f32>() as u32, |k, mut out| {
                out.copy_from_slice(bytemuck::cast_slice(&corners[k * side..(k + 1) * side]));
            })?;
            *held = now;
        }
        Ok(())
    }
}

fn place(layer: u32, [x, z]: [i64; 2], rect: Rect) -> Place {
    Place {
        layer,
        origin: [x as u32, z as u32],
        size: [rect.width() as u32, rect.height() as u32],
    }
}

fn layers(
    device: &wgpu::Device,
    label: &str,
    side: i64,
    levels: u32,
    format: wgpu::TextureFormat,
) -> wgpu::Texture {
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
}

fn instance_buffer(device: &wgpu::Device, instances: usize) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("clipscape instances"),
        size: (instances * size_of::<Instance>()) as u64,
        usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}
