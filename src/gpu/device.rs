//! A device without a window, for whoever has none of their own.

use crate::error::{Error, ErrorKind, Result};

/// An adapter's device and queue.
#[derive(Clone, Debug)]
pub struct Gpu {
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// What the adapter says of itself.
    pub info: wgpu::AdapterInfo,
}

impl Gpu {
    /// Whether passes can be timed on the device itself.
    pub fn has_timestamps(&self) -> bool {
        self.device.features().contains(wgpu::Features::TIMESTAMP_QUERY)
    }

    /// The adapter's driver and its version, as one text.
    pub fn driver(&self) -> String {
        format!("{} {}", self.info.driver, self.info.driver_info)
            .trim()
            .to_string()
    }
}

/// Opens the best adapter that there is, software adapters included, with default limits and, where the adapter has
/// them, timestamps.
///
/// # Errors
/// [`ErrorKind::Device`] where there is no adapter or it gives no device.
pub fn open() -> Result<Gpu> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    open_for(&instance, None).map(|(gpu, _)| gpu)
}

/// The same of an instance of the caller's, able to draw into `surface` where one is given, with its adapter.
///
/// # Errors
/// As [`open`].
pub(crate) fn open_for(
    instance: &wgpu::Instance,
    surface: Option<&wgpu::Surface<'_>>,
) -> Result<(Gpu, wgpu::Adapter)> {
    let none = |cause: &dyn std::error::Error| {
        let what = format!(
            "no usable Vulkan, Metal or Direct3D 12 adapter ({})",
            short(cause)
        );
        Error::new(ErrorKind::Device, "graphics", what).advice(
            "install a Vulkan driver; mesa-vulkan-drivers on Debian has one that needs no graphics card",
        )
    };
    let options = wgpu::RequestAdapterOptions {
        power_preference: wgpu::PowerPreference::HighPerformance,
        compatible_surface: surface,
        ..Default::default()
    };
    let adapter = pollster::block_on(instance.request_adapter(&options)).map_err(|e| none(&e))?;
    let required_features = adapter.features() & wgpu::Features::TIMESTAMP_QUERY;
    let descriptor = wgpu::DeviceDescriptor {
        label: Some("clipscape device"),
        required_features,
        required_limits: wgpu::Limits::default(),
        ..Default::default()
    };
    let (device, queue) = pollster::block_on(adapter.request_device(&descriptor)).map_err(|e| none(&e))?;
    let gpu = Gpu {
        device,
        queue,
        info: adapter.get_info(),
    };
    Ok((gpu, adapter))
}

/// The beginning of a library's message, without the list of all that it tried.
fn short(cause: &dyn std::error::Error) -> String {
    let text = cause.to_string();
    let line = text.lines().next().unwrap_or_default();
    line.split(" (")
        .next()
        .unwrap_or(line)
        .split(';')
        .next()
        .unwrap_or(line)
        .trim_end_matches([':', '.'])
        .to_string()
}
