//! The device and the window's surface: made, configured anew when the window changes, and replaced when lost.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use winit::dpi::PhysicalSize;
use winit::window::Window;

use crate::error::{Error, ErrorKind, Result};
use crate::gpu::{self, Gpu};

/// What is seen before there is terrain.
const BACKGROUND: wgpu::Color = wgpu::Color {
    r: 0.05,
    g: 0.06,
    b: 0.08,
    a: 1.0,
};

/// What the device has said since it was made.
#[derive(Default)]
struct Complaints {
    lost: AtomicBool,
    error: Mutex<Option<String>>,
}

/// A device that draws into the window.
pub(super) struct Graphics {
    pub(super) gpu: Gpu,
    window: Arc<Window>,
    instance: wgpu::Instance,
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    blitter: wgpu::util::TextureBlitter,
    complaints: Arc<Complaints>,
}

/// What there is to draw into.
pub(super) enum Acquired {
    /// A picture of the surface.
    Picture(wgpu::SurfaceTexture),
    /// Nothing now: the window is hidden or changing. Later there is.
    Nothing,
    /// The device is lost: all that was made with it is gone.
    Lost,
}

impl Graphics {
    /// Opens the best adapter that can draw into `window`.
    ///
    /// # Errors
    /// [`ErrorKind::Device`] where there is none.
    pub(super) fn new(window: Arc<Window>) -> Result<Self> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let surface = surface(&instance, &window)?;
        let (gpu, adapter) = gpu::open_for(&instance, Some(&surface))?;
        let capabilities = surface.get_capabilities(&adapter);
        let format = surface_format(&capabilities.formats).ok_or_else(|| {
            let what = "the adapter has no 8-bit colours for this window";
            Error::new(ErrorKind::Device, "graphics", what).advice("clipscape render draws without a window")
        })?;
        let size = window.inner_size();
        let config = wgpu::SurfaceConfiguration {
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            format,
            color_space: wgpu::SurfaceColorSpace::Auto,
            width: size.width.max(1),
            height: size.height.max(1),
            present_mode: wgpu::PresentMode::AutoVsync,
            desired_maximum_frame_latency: 2,
            alpha_mode: wgpu::CompositeAlphaMode::Auto,
            view_formats: Vec::new(),
        };
        let complaints = Arc::new(Complaints::default());
        let heard = complaints.clone();
        gpu.device.set_device_lost_callback(move |_, _| {
            heard.lost.store(true, Ordering::Relaxed);
        });
        let heard = complaints.clone();
        // Otherwise the library would panic, in the midst of whatever is going on.
        gpu.device
            .on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
                let mut first = heard.error.lock().unwrap_or_else(PoisonError::into_inner);
                first.get_or_insert_with(|| error.to_string());
            }));
        surface.configure(&gpu.device, &config);
        Ok(Self {
            blitter: wgpu::util::TextureBlitter::new(&gpu.device, format),
            gpu,
            window,
            instance,
            surface,
            config,
            complaints,
        })
    }

    /// The format of the surface's pictures.
    pub(super) fn format(&self) -> wgpu::TextureFormat {
        self.config.format
    }

    /// Whether what is laid into pictures is shown as its bytes are, so that they must be encoded already.
    pub(super) fn encodes(&self) -> bool {
        !self.config.format.is_srgb()
    }

    /// Records the copy of a picture of the same size into the surface's.
    pub(super) fn lay(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        from: &wgpu::TextureView,
        to: &wgpu::TextureView,
    ) {
        self.blitter.copy(&self.gpu.device, encoder, from, to);
    }

    /// Records a surface's picture without anything in it.
    pub(super) fn clear(&self, encoder: &mut wgpu::CommandEncoder, to: &wgpu::TextureView) {
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("clipscape empty window"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: to,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(BACKGROUND),
                    store: wgpu::StoreOp::Store,
                },
            })],
            ..Default::default()
        });
    }

    /// Width and height of the surface's pictures in pixels.
    pub(super) fn size_px(&self) -> [u32; 2] {
        [self.config.width, self.config.height]
    }

    /// Fits the surface to a window of another size; a minimised one of none keeps what it has.
    pub(super) fn resize(&mut self, size: PhysicalSize<u32>) {
        if size.width == 0 || size.height == 0 || [size.width, size.height] == self.size_px() {
            return;
        }
        let most = self.gpu.device.limits().max_texture_dimension_2d;
        self.config.width = size.width.min(most);
        self.config.height = size.height.min(most);
        self.surface.configure(&self.gpu.device, &self.config);
    }

    /// The next picture to draw into. A surface that no longer fits its window is configured anew, one that is lost is
    /// replaced, and it is then tried once more.
    ///
    /// # Errors
    /// [`ErrorKind::Device`] where the surface cannot be replaced, and for what the device has complained about.
    pub(super) fn acquire(&mut self) -> Result<Acquired> {
        // That it is lost is heard only by who asks; a device that is may not even be asked.
        let _ = self.gpu.device.poll(wgpu::PollType::Poll);
        self.check()?;
        for _ in 0..2 {
            if self.complaints.lost.load(Ordering::Relaxed) {
                return Ok(Acquired::Lost);
            }
            use wgpu::CurrentSurfaceTexture as Current;
            match self.surface.get_current_texture() {
                // What no longer fits is shown all the same: the window's next size configures it anew.
                Current::Success(picture) | Current::Suboptimal(picture) => {
                    return Ok(Acquired::Picture(picture));
                }
                Current::Timeout | Current::Occluded => return Ok(Acquired::Nothing),
                Current::Outdated => self.surface.configure(&self.gpu.device, &self.config),
                Current::Lost => {
                    self.surface = surface(&self.instance, &self.window)?;
                    self.surface.configure(&self.gpu.device, &self.config);
                }
                Current::Validation => self.check()?,
            }
        }
        Ok(Acquired::Nothing)
    }

    /// Shows a picture.
    pub(super) fn present(&self, picture: wgpu::SurfaceTexture) {
        self.window.pre_present_notify();
        self.gpu.queue.present(picture);
    }

    /// Whether the device is lost.
    pub(super) fn is_lost(&self) -> bool {
        self.complaints.lost.load(Ordering::Relaxed)
    }

    /// What the device has complained about, as an error. A lost device complains of all that is asked of it, which says
    /// nothing.
    fn check(&self) -> Result<()> {
        let mut error = self
            .complaints
            .error
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        match error.take() {
            Some(text) if !self.is_lost() => {
                let words: Vec<&str> = text.split_whitespace().collect();
                let what = format!("the device refuses to draw ({})", words.join(" "));
                Err(Error::new(ErrorKind::Device, "graphics", what)
                    .advice("try a smaller --clip-size; clipscape render draws without a window"))
            }
            _ => Ok(()),
        }
    }
}

fn surface(instance: &wgpu::Instance, window: &Arc<Window>) -> Result<wgpu::Surface<'static>> {
    instance.create_surface(window.clone()).map_err(|e| {
        let what = format!("the window cannot be drawn into ({e})");
        Error::new(ErrorKind::Device, "graphics", what)
            .advice("clipscape render draws without a window")
            .because(e)
    })
}

/// The format to draw into: 8 bits a channel and not converted, as terrain and panel are encoded already; else one that
/// is converted.
fn surface_format(formats: &[wgpu::TextureFormat]) -> Option<wgpu::TextureFormat> {
    use wgpu::TextureFormat as Format;
    let wanted = [
        Format::Bgra8Unorm,
        Format::Rgba8Unorm,
        Format::Bgra8UnormSrgb,
        Format::Rgba8UnormSrgb,
    ];
    wanted.into_iter().find(|format| formats.contains(format))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_of_8_bits_are_taken_the_plain_ones_first() {
        use wgpu::TextureFormat as Format;
        let all = [Format::Rgba16Float, Format::Bgra8UnormSrgb, Format::Bgra8Unorm];
        assert_eq!(surface_format(&all), Some(Format::Bgra8Unorm));
        assert_eq!(surface_format(&all[..2]), Some(Format::Bgra8UnormSrgb));
        assert_eq!(surface_format(&all[..1]), None);
    }
}
