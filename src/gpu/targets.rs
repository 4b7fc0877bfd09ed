//! The textures that a picture is drawn into where the caller has none of its own, and the pass that clears them.

use super::device::Gpu;
use super::options::RendererOptions;

/// Colour and depth of one picture.
#[derive(Debug)]
pub struct Targets {
    colour: wgpu::Texture,
    colour_view: wgpu::TextureView,
    multisampled_view: Option<wgpu::TextureView>,
    depth: wgpu::Texture,
    depth_view: wgpu::TextureView,
    clear_depth: f32,
    keep_depth: wgpu::StoreOp,
}

impl Targets {
    /// Textures of `size_px` pixels for what pipelines of `options` draw. Colour has one sample a pixel, resolved where
    /// more are drawn, and can be read back; so can depth where one sample a pixel is drawn.
    pub fn new(gpu: &Gpu, size_px: [u32; 2], options: &RendererOptions) -> Self {
        let keep_depth = match options.sample_count {
            1 => wgpu::StoreOp::Store,
            _ => wgpu::StoreOp::Discard,
        };
        Self::with(
            gpu,
            size_px,
            options,
            wgpu::TextureUsages::COPY_SRC,
            &[],
            keep_depth,
        )
    }

    /// The same for a picture that is shown: its colour can also be bound, as it is and as its bytes are, and its depth
    /// is not kept.
    #[cfg(feature = "window")]
    pub(crate) fn to_show(gpu: &Gpu, size_px: [u32; 2], options: &RendererOptions) -> Self {
        use wgpu::TextureUsages as Usage;
        let usage = Usage::COPY_SRC | Usage::TEXTURE_BINDING;
        let bytes = [options.colour_format.remove_srgb_suffix()];
        Self::with(gpu, size_px, options, usage, &bytes, wgpu::StoreOp::Discard)
    }

    fn with(
        gpu: &Gpu,
        size_px: [u32; 2],
        options: &RendererOptions,
        colour_usage: wgpu::TextureUsages,
        colour_views: &[wgpu::TextureFormat],
        keep_depth: wgpu::StoreOp,
    ) -> Self {
        use wgpu::TextureUsages as Usage;
        let texture = |label, format, sample_count, usage, view_formats| {
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d {
                    width: size_px[0],
                    height: size_px[1],
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: Usage::RENDER_ATTACHMENT | usage,
                view_formats,
            })
        };
        let samples = options.sample_count;
        let format = options.colour_format;
        let colour = texture("clipscape colour", format, 1, colour_usage, colour_views);
        let depth_usage = match keep_depth {
            wgpu::StoreOp::Store => Usage::COPY_SRC,
            wgpu::StoreOp::Discard => Usage::empty(),
        };
        let depth = texture("clipscape depth", options.depth_format, samples, depth_usage, &[]);
        let multisampled = (samples > 1).then(|| {
            let label = "clipscape multisampled colour";
            texture(label, format, samples, Usage::empty(), &[])
        });
        let view = |texture: &wgpu::Texture| texture.create_view(&Default::default());
        Self {
            colour_view: view(&colour),
            depth_view: view(&depth),
            multisampled_view: multisampled.as_ref().map(view),
            colour,
            depth,
            clear_depth: options.clear_depth(),
            keep_depth,
        }
    }

    /// A pass that begins with black and nothing near; `timestamp_writes` as in [`wgpu::RenderPassDescriptor`].
    pub fn pass<'e>(
        &self,
        encoder: &'e mut wgpu::CommandEncoder,
        timestamp_writes: Option<wgpu::RenderPassTimestampWrites<'_>>,
    ) -> wgpu::RenderPass<'e> {
        let (view, resolve_target) = match &self.multisampled_view {
            Some(view) => (view, Some(&self.colour_view)),
            None => (&self.colour_view, None),
        };
        let stencil = wgpu::Operations {
            load: wgpu::LoadOp::Clear(0),
            store: wgpu::StoreOp::Discard,
        };
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("clipscape picture"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth_view,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(self.clear_depth),
                    store: self.keep_depth,
                }),
                stencil_ops: self.depth.format().has_stencil_aspect().then_some(stencil),
            }),
            timestamp_writes,
            ..Default::default()
        })
    }

    /// The picture, one sample a pixel.
    pub fn colour(&self) -> &wgpu::Texture {
        &self.colour
    }

    /// Its depth, in as many samples a pixel as are drawn.
    pub fn depth(&self) -> &wgpu::Texture {
        &self.depth
    }

    /// Width and height in pixels.
    pub fn size_px(&self) -> [u32; 2] {
        [self.colour.width(), self.colour.height()]
    }
}
