//! Pipelines that draw a clipmap into the caller's render pass.

use wgpu::util::DeviceExt as _;

use super::options::RendererOptions;
use super::resident::UploadReport;
use super::shader;
use super::textures::ViewTextures;
use crate::clipmap::{CLOSER_TRIANGLES, Clipmap, Instance, PATCH_TRIANGLES, Side};
use crate::error::{Error, ErrorKind, Result};
use crate::grid::PATCH;
use crate::light::Sun;

/// What a draw did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DrawReport {
    /// Draw calls.
    pub draw_calls: u64,
    /// Triangles, closing ones included.
    pub triangles: u64,
}

/// Pipelines and static buffers for one target format; shared by any number of views.
#[derive(Debug)]
pub struct ClipmapRenderer {
    layout: wgpu::BindGroupLayout,
    sampler: wgpu::Sampler,
    still: wgpu::RenderPipeline,
    whole: wgpu::RenderPipeline,
    ragged: wgpu::RenderPipeline,
    closer: wgpu::RenderPipeline,
    indices: wgpu::Buffer,
    options: RendererOptions,
}

impl ClipmapRenderer {
    /// Pipelines for `options`.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] for options that [`RendererOptions::check`] refuses, and for a surface function that does not
    /// compile; its source is then a [`super::ShaderError`] with the line.
    pub fn new(device: &wgpu::Device, options: &RendererOptions) -> Result<Self> {
        options.check(device)?;
        let layout = bind_group_layout(device);
        let pipelines = pipeline_layout(device, &layout);
        let terrain = shader::module(device, "terrain.wgsl", &options.parts())?;
        let closer = shader::module(device, "closer.wgsl", &options.parts())?;
        let pipeline = |label, module, entries, morphs| {
            pipeline(device, label, module, &pipelines, options, entries, morphs)
        };
        let whole = ["whole_vertex", "whole_fragment"];
        let ragged = ["ragged_vertex", "ragged_fragment"];
        let closing = ["vertex", "fragment"];
        Ok(Self {
            still: pipeline("clipscape terrain still patches", &terrain, whole, false)?,
            whole: pipeline("clipscape terrain whole patches", &terrain, whole, true)?,
            ragged: pipeline("clipscape terrain ragged patches", &terrain, ragged, true)?,
            closer: pipeline("clipscape terrain closing triangles", &closer, closing, true)?,
            sampler: device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("clipscape light sampler"),
                address_mode_u: wgpu::AddressMode::Repeat,
                address_mode_v: wgpu::AddressMode::Repeat,
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                ..Default::default()
            }),
            indices: device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("clipscape patch indices"),
                contents: bytemuck::cast_slice(&patch_indices()),
                usage: wgpu::BufferUsages::INDEX,
            }),
            layout,
            options: options.clone(),
        })
    }

    /// GPU state for a view of `clipmap`, lit by `sun` where no light was traced.
    ///
    /// # Errors
    /// [`ErrorKind::Limit`] where the device's textures are too small for the clipmap.
    pub fn textures(&self, device: &wgpu::Device, clipmap: &Clipmap, sun: Sun) -> Result<ViewTextures> {
        ViewTextures::new(device, &self.layout, &self.sampler, clipmap, sun)
    }

    /// The layout of a view's bind group.
    pub fn bind_group_layout(&self) -> &wgpu::BindGroupLayout {
        &self.layout
    }

    /// What these pipelines are made for.
    pub fn options(&self) -> &RendererOptions {
        &self.options
    }

    /// Records into `encoder` what brings `textures` up to the clipmap's last update; outside of a pass, before the one
    /// that draws. It needs no queue: all of it is copies from mapped memory, which take effect where they are recorded.
    /// So several views, and several updates of one, may share a submission. Encoders must be submitted in the order in
    /// which updates were recorded into them; one that is dropped instead costs the next upload whole windows.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] for textures made for a clipmap of other sizes, a clipmap that has not been updated yet, and
    /// a view whose depth is not that of the options; [`ErrorKind::Device`] where the device fails.
    pub fn upload(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        clipmap: &Clipmap,
        textures: &mut ViewTextures,
    ) -> Result<UploadReport> {
        textures.upload(encoder, clipmap, &self.options)
    }

    /// Draws the clipmap's selection. The pass must have a colour and a depth target as in the options, depth cleared to
    /// [`RendererOptions::clear_depth`] before the first draw of the pass or pass before.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] where the clipmap's last update was not uploaded into `textures`; nothing is then drawn.
    pub fn draw(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        clipmap: &Clipmap,
        textures: &ViewTextures,
    ) -> Result<DrawReport> {
        textures.check_drawable(clipmap, &self.options)?;
        let selection = clipmap.selection();
        let mut report = DrawReport::default();
        pass.set_bind_group(0, textures.bind_group(), &[]);
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint16);
        pass.set_vertex_buffer(0, textures.instances().slice(..));
        let patch = 0..3 * PATCH_TRIANGLES as u32;
        let mut first = 0;
        let mut draw = |pass: &mut wgpu::RenderPass<'_>, indices: std::ops::Range<u32>, count: usize| {
            let instances = first..first + count as u32;
            first = instances.end;
            if !instances.is_empty() {
                report.draw_calls += 1;
                report.triangles += u64::from(indices.end - indices.start) / 3 * count as u64;
                pass.draw_indexed(indices, 0, instances);
            }
        };
        pass.set_pipeline(&self.still);
        draw(pass, patch.clone(), selection.still.len());
        pass.set_pipeline(&self.whole);
        draw(pass, patch.clone(), selection.whole.len());
        pass.set_pipeline(&self.ragged);
        draw(pass, patch.clone(), selection.ragged.len());
        pass.set_pipeline(&self.closer);
        let mut closers = patch.end;
        for side in &selection.closers {
            let indices = closers..closers + 3 * CLOSER_TRIANGLES as u32;
            closers = indices.end;
            draw(pass, indices, side.len());
        }
        Ok(report)
    }
}

/// The layout of a view's bind group.
pub(super) fn bind_group_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    use wgpu::ShaderStages as Stages;
    let uniform = wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    let texture = |filterable| wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable },
        view_dimension: wgpu::TextureViewDimension::D2Array,
        multisampled: false,
    };
    let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
    let both = Stages::VERTEX_FRAGMENT;
    let bindings = [
        (both, uniform),
        (both, uniform),
        (Stages::VERTEX | Stages::COMPUTE, texture(false)),
        (both | Stages::COMPUTE, texture(false)),
        (Stages::FRAGMENT, uniform),
        (Stages::FRAGMENT, texture(true)),
        (Stages::FRAGMENT, sampler),
    ];
    let entries: Vec<_> = bindings
        .into_iter()
        .zip(0..)
        .map(|((visibility, ty), binding)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: if ty == uniform && visibility == both {
                both | Stages::COMPUTE
            } else {
                visibility
            },
            ty,
            count: None,
        })
        .collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("clipscape view layout"),
        entries: &entries,
    })
}

/// The layout of all pipelines.
pub(super) fn pipeline_layout(device: &wgpu::Device, view: &wgpu::BindGroupLayout) -> wgpu::PipelineLayout {
    device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("clipscape layout"),
        bind_group_layouts: &[Some(view)],
        immediate_size: 0,
    })
}

/// What `create` makes, where the device has nothing against it.
pub(super) fn created<T>(device: &wgpu::Device, label: &str, create: impl FnOnce() -> T) -> Result<T> {
    let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let made = create();
    match pollster::block_on(scope.pop()) {
        None => Ok(made),
        Some(error) => {
            let text = error.to_string();
            let words: Vec<&str> = text.split_whitespace().collect();
            let what = format!("cannot be made ({})", words.join(" "));
            Err(Error::new(ErrorKind::Misuse, label, what))
        }
    }
}

fn pipeline(
    device: &wgpu::Device,
    label: &str,
    module: &wgpu::ShaderModule,
    layout: &wgpu::PipelineLayout,
    options: &RendererOptions,
    [vertex, fragment]: [&str; 2],
    morphs: bool,
) -> Result<wgpu::RenderPipeline> {
    let on = |flag: bool| f64::from(u8::from(flag));
    let constants = [
        ("MORPHS", on(morphs)),
        ("TRACED_LIGHT", on(options.traced_light)),
        ("DAY", on(options.day && options.traced_light)),
        ("TINT", on(options.tint)),
        ("HAZE", on(options.haze)),
        ("ENCODE_SRGB", on(options.encodes_srgb())),
    ];
    let compilation_options = wgpu::PipelineCompilationOptions {
        constants: &constants,
        ..Default::default()
    };
    created(device, label, || {
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(label),
            layout: Some(layout),
            vertex: wgpu::VertexState {
                module,
                entry_point: Some(vertex),
                compilation_options: compilation_options.clone(),
                buffers: &[Some(wgpu::VertexBufferLayout {
                    array_stride: size_of::<Instance>() as u64,
                    step_mode: wgpu::VertexStepMode::Instance,
                    attributes: &wgpu::vertex_attr_array![0 => Sint32x2, 1 => Uint32, 2 => Float32],
                })],
            },
            // No culling: closing triangles have no front, and terrain may be seen from below.
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(options.depth_state(true, options.nearer())),
            multisample: wgpu::MultisampleState {
                count: options.sample_count,
                ..Default::default()
            },
            fragment: Some(wgpu::FragmentState {
                module,
                entry_point: Some(fragment),
                compilation_options,
                targets: &[Some(options.colour_format.into())],
            }),
            multiview_mask: None,
            cache: None,
        })
    })
}

/// Indices into the 9 x 9 corners of a patch: its quads, split from north-west to south-east, then for each [`Side`]
/// the triangles of no area (middle, coarse end, coarse end) that close it against a coarser neighbour, as indices into
/// the four sides' nine vertices each: `closer.wgsl` numbers them so.
fn patch_indices() -> Vec<u16> {
    let corner = |x: i64, z: i64| (z * (PATCH + 1) + x) as u16;
    let mut indices = Vec::new();
    for z in 0..PATCH {
        for x in 0..PATCH {
            let [nw, ne] = [corner(x, z), corner(x + 1, z)];
            let [sw, se] = [corner(x, z + 1), corner(x + 1, z + 1)];
            indices.extend([nw, sw, se, nw, se, ne]);
        }
    }
    for side in 0..Side::ALL.len() as i64 {
        for k in (0..PATCH).step_by(2) {
            indices.extend([k + 1, k, k + 2].map(|k| (side * (PATCH + 1) + k) as u16));
        }
    }
    indices
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quads_are_split_from_north_west_to_south_east_and_sides_closed() {
        let indices = patch_indices();
        let triangles = PATCH_TRIANGLES + 4 * CLOSER_TRIANGLES;
        assert_eq!(indices.len() as u64, 3 * triangles);
        let point = |i: u16| (i64::from(i) % (PATCH + 1), i64::from(i) / (PATCH + 1));
        for t in indices[..3 * PATCH_TRIANGLES as usize].chunks(3) {
            let points = t.iter().map(|&i| point(i)).collect::<Vec<_>>();
            let low = (
                points.iter().map(|p| p.0).min().unwrap(),
                points.iter().map(|p| p.1).min().unwrap(),
            );
            assert!(
                points.contains(&low) && points.contains(&(low.0 + 1, low.1 + 1)),
                "{points:?}"
            );
        }
        for (n, t) in indices[3 * PATCH_TRIANGLES as usize..].chunks(3).enumerate() {
            let [middle, start, end] = [i64::from(t[0]), i64::from(t[1]), i64::from(t[2])];
            assert_eq!(
                (start + 1, end - 1),
                (middle, middle),
                "the middle comes first and lies between the ends"
            );
            assert_eq!(
                middle / (PATCH + 1),
                n as i64 / CLOSER_TRIANGLES as i64,
                "sides follow each other"
            );
        }
    }
}
