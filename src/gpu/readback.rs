//! Reading textures back to the CPU.

use super::Gpu;
use crate::error::{Error, ErrorKind, Result};

/// A copy of a texture layer on its way to the CPU.
#[derive(Debug)]
pub struct Readback {
    buffer: wgpu::Buffer,
    row_bytes: usize,
    padded_row_bytes: usize,
}

impl Readback {
    /// Records the copy of layer `layer` of `texture` into a buffer of its own.
    pub fn record(
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        texture: &wgpu::Texture,
        layer: u32,
    ) -> Self {
        let aspect = if texture.format().has_depth_aspect() {
            wgpu::TextureAspect::DepthOnly
        } else {
            wgpu::TextureAspect::All
        };
        let texel_bytes = texture
            .format()
            .block_copy_size(Some(aspect))
            .expect("the format can be copied");
        let row_bytes = texel_bytes * texture.width();
        let padded_row_bytes = row_bytes.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("clipscape readback"),
            size: u64::from(padded_row_bytes) * u64::from(texture.height()),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        encoder.copy_texture_to_buffer(
            wgpu::TexelCopyTextureInfo {
                texture,
                mip_level: 0,
                origin: wgpu::Origin3d { x: 0, y: 0, z: layer },
                aspect,
            },
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(padded_row_bytes),
                    rows_per_image: None,
                },
            },
            wgpu::Extent3d {
                width: texture.width(),
                height: texture.height(),
                depth_or_array_layers: 1,
            },
        );
        Self {
            buffer,
            row_bytes: row_bytes as usize,
            padded_row_bytes: padded_row_bytes as usize,
        }
    }

    /// Waits for the copy, which must have been submitted, and returns its rows without padding.
    ///
    /// # Errors
    /// [`ErrorKind::Device`] where the device failed.
    pub fn wait(&self, device: &wgpu::Device) -> Result<Vec<u8>> {
        let bytes = read(device, &self.buffer)?;
        let mut out = Vec::with_capacity(bytes.len() / self.padded_row_bytes * self.row_bytes);
        for row in bytes.chunks_exact(self.padded_row_bytes) {
            out.extend_from_slice(&row[..self.row_bytes]);
        }
        Ok(out)
    }
}

impl Gpu {
    /// Reads back layer `layer` of a texture: its rows without padding.
    ///
    /// # Errors
    /// [`ErrorKind::Device`] where the device failed.
    pub fn read_texture(&self, texture: &wgpu::Texture, layer: u32) -> Result<Vec<u8>> {
        let mut encoder = self
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor {
                label: Some("clipscape readback"),
            });
        let readback = Readback::record(&self.device, &mut encoder, texture, layer);
        self.queue.submit([encoder.finish()]);
        readback.wait(&self.device)
    }
}

/// Waits for all that was submitted and returns a mappable buffer's bytes.
///
/// # Errors
/// [`ErrorKind::Device`] where the device failed.
pub fn read(device: &wgpu::Device, buffer: &wgpu::Buffer) -> Result<Vec<u8>> {
    let failed = |what: String| Error::new(ErrorKind::Device, "graphics", what);
    let (sender, receiver) = std::sync::mpsc::channel();
    buffer.map_async(wgpu::MapMode::Read, .., move |result| {
        // The receiver lives until the answer is there, or nobody waits for it any more.
        let _ = sender.send(result);
    });
    device
        .poll(wgpu::PollType::wait_indefinitely())
        .map_err(|e| failed(format!("the device does not answer ({e})")))?;
    let mapped = receiver
        .recv()
        .map_err(|_| failed("the device was lost".to_string()))?;
    mapped.map_err(|e| failed(format!("a buffer cannot be read back ({e})")))?;
    let bytes = buffer
        .get_mapped_range(..)
        .map_err(|e| failed(format!("a buffer cannot be read back ({e})")))?
        .to_vec();
    buffer.unmap();
    Ok(bytes)
}
