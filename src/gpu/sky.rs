//! Draws the sky where no terrain is. Optional, and separate from the terrain.

use bytemuck::{Pod, Zeroable};

use super::renderer::{DEPTH_FORMAT, RendererOptions};
use super::shader;
use crate::camera::View;
use crate::shade::ShadeConstants;

/// The camera as the sky knows it, as in `shaders/sky.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct SkyConstants {
    /// Half the picture's width at distance 1, in metres east, up, south.
    pub right: [f32; 4],
    /// Half its height.
    pub up: [f32; 4],
    /// Unit vector.
    pub forward: [f32; 4],
}

impl SkyConstants {
    /// The constants of a view.
    pub fn new(view: &View) -> Self {
        let axes = view.camera.axes();
        let [tan_x, tan_y] = view.half_tangents();
        let four = |v: glam::DVec3| [v.x as f32, v.y as f32, v.z as f32, 0.0];
        Self {
            right: four(axes.col(0) * tan_x),
            up: four(axes.col(1) * tan_y),
            forward: four(axes.col(2)),
        }
    }
}

/// The sky's pipeline and constants, for one view.
#[derive(Debug)]
pub struct SkyRenderer {
    pipeline: wgpu::RenderPipeline,
    camera: wgpu::Buffer,
    shade: wgpu::Buffer,
    bind_group: wgpu::BindGroup,
}

impl SkyRenderer {
    /// A sky for targets as in `options`.
    pub fn new(device: &wgpu::Device, options: &RendererOptions) -> Self {
        let module = shader::module(device, "sky.wgsl");
        let constants = [(
            "ENCODE_SRGB",
            f64::from(u8::from(!options.colour_format.is_srgb())),
        )];
        let compilation_options = wgpu::PipelineCompilationOptions {
            constants: &constants,
            ..Default::default()
        };
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("clipscape sky"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vertex"),
                compilation_options: compilation_options.clone(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            // Infinitely far: it shows where depth is still as it was cleared.
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH_FORMAT,
                depth_write_enabled: Some(false),
                depth_compare: Some(wgpu::CompareFunction::Equal),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState {
                count: options.sample_count,
                ..Default::default()
            },
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("fragment"),
                compilation_options,
                targets: &[Some(options.colour_format.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let uniform = |label, size: usize| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: size as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let camera = uniform("clipscape sky camera", size_of::<SkyConstants>());
        let shade = uniform("clipscape sky shade constants", size_of::<ShadeConstants>());
        let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("clipscape sky"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[
                wgpu::BindGroupEntry {
                    binding: 0,
                    resource: camera.as_entire_binding(),
                },
                wgpu::BindGroupEntry {
                    binding: 4,
                    resource: shade.as_entire_binding(),
                },
            ],
        });
        Self {
            pipeline,
            camera,
            shade,
            bind_group,
        }
    }

    /// Sets the view and the shading constants. Takes effect before the commands of the queue's next submission.
    pub fn upload(&self, queue: &wgpu::Queue, view: &View, shade: &ShadeConstants) {
        queue.write_buffer(&self.camera, 0, bytemuck::bytes_of(&SkyConstants::new(view)));
        queue.write_buffer(&self.shade, 0, bytemuck::bytes_of(shade));
    }

    /// Draws the sky; after the terrain, so that only what is left is shaded.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bind_group, &[]);
        pass.draw(0..3, 0..1);
    }
}
