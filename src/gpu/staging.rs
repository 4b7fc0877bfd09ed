//! The one path on which bytes reach the GPU: mapped memory, and copies from it in the caller's encoder.
//!
//! What is uploaded takes effect where it is recorded: two views, or two updates of one view, may share a submission, and
//! nothing depends on when it is submitted. `queue.write_texture` would put all writes before all commands.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use wgpu::util::StagingBelt;

use crate::error::{Error, ErrorKind, Result};

/// Bytes of a piece of mapped memory: a frame's uploads of the usual clip sizes fit into one.
const CHUNK_BYTES: u64 = 1 << 20;

/// Mapped memory is kept for later frames, but after an upload of more than this it is let go: windows that were written
/// whole take hundreds of times what a frame does.
const KEEP_BYTES: u64 = 8 << 20;

/// Every piece lies at a multiple of this, as both texture formats and buffer copies want.
const ALIGNMENT: wgpu::BufferSize = wgpu::BufferSize::new(8).unwrap();

/// Mapped memory that is used anew once the GPU has copied from it.
#[derive(Debug)]
pub(super) struct Staging {
    device: wgpu::Device,
    belt: StagingBelt,
    dropped: Arc<AtomicBool>,
}

impl Staging {
    pub(super) fn new(device: &wgpu::Device) -> Self {
        Self {
            device: device.clone(),
            belt: StagingBelt::new(device.clone(), CHUNK_BYTES),
            dropped: Arc::new(AtomicBool::new(false)),
        }
    }

    /// Whether an encoder into which an upload was recorded has been dropped without being submitted.
    pub(super) fn was_dropped(&self) -> bool {
        self.dropped.load(Ordering::Acquire)
    }

    /// Begins an upload whose copies are recorded into `encoder`. What was dropped before is forgotten.
    pub(super) fn begin<'a>(&'a mut self, encoder: &'a mut wgpu::CommandEncoder) -> Upload<'a> {
        self.dropped.store(false, Ordering::Release);
        Upload {
            staging: self,
            encoder,
            bytes: 0,
        }
    }
}

/// An upload that is being recorded.
pub(super) struct Upload<'a> {
    staging: &'a mut Staging,
    encoder: &'a mut wgpu::CommandEncoder,
    bytes: u64,
}

/// A rectangle of a layer of a texture, in texels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) layer: u32,
    pub(super) origin: [u32; 2],
    pub(super) size: [u32; 2],
}

impl Upload<'_> {
    /// Writes `bytes` to the beginning of a buffer. Their number must be a multiple of 4.
    pub(super) fn buffer(&mut self, target: &wgpu::Buffer, bytes: &[u8]) -> Result<()> {
        let Some(size) = wgpu::BufferSize::new(bytes.len() as u64) else {
            return Ok(());
        };
        self.bytes += size.get();
        let slice = self.staging.belt.allocate(size, ALIGNMENT);
        slice
            .get_mapped_range_mut()
            .map_err(unmapped)?
            .copy_from_slice(bytes);
        self.encoder
            .copy_buffer_to_buffer(slice.buffer(), slice.offset(), target, 0, size.get());
        Ok(())
    }

    /// Writes a rectangle of a texture of `texel_bytes` each; `row` writes its k-th row.
    pub(super) fn texture(
        &mut self,
        target: &wgpu::Texture,
        place: Place,
        texel_bytes: u32,
        mut row: impl FnMut(usize, wgpu::WriteOnly<'_, [u8]>),
    ) -> Result<()> {
        let [width, height] = place.size;
        let row_bytes = width * texel_bytes;
        // Rows of a copy begin at multiples of 256 bytes; a single one may begin anywhere.
        let padded = if height > 1 {
            row_bytes.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)
        } else {
            row_bytes
        };
        let all = u64::from(padded) * u64::from(height.saturating_sub(1)) + u64::from(row_bytes);
        let Some(size) = wgpu::BufferSize::new(if width == 0 || height == 0 { 0 } else { all }) else {
            return Ok(());
        };
        self.bytes += all;
        let slice = self.staging.belt.allocate(size, ALIGNMENT);
        let mut mapped = slice.get_mapped_range_mut().map_err(unmapped)?;
        let mut rows = mapped.slice(..);
        for k in 0..height as usize {
            let first = k * padded as usize;
            row(k, rows.slice(first..first + row_bytes as usize));
        }
        drop(mapped);
        let [x, y] = place.origin;
        self.encoder.copy_buffer_to_texture(
            wgpu::TexelCopyBufferInfo {
                buffer: slice.buffer(),
                layout: wgpu::TexelCopyBufferLayout {
                    offset: slice.offset(),
                    bytes_per_row: (height > 1).then_some(padded),
                    rows_per_image: None,
                },
            },
            wgpu::TexelCopyTextureInfo {
                texture: target,
                mip_level: 0,
                origin: wgpu::Origin3d { x, y, z: place.layer },
                aspect: wgpu::TextureAspect::All,
            },
            wgpu::Extent3d {
                width,
                height,
                depth_or_array_layers: 1,
            },
        );
        Ok(())
    }

    /// Ends the upload: its memory comes back when the encoder's commands are done, and an encoder that is dropped
    /// instead leaves word.
    pub(super) fn finish(self) {
        let staging = self.staging;
        staging.belt.finish_and_recall_on_submit(self.encoder);
        if self.bytes > KEEP_BYTES {
            staging.belt = StagingBelt::new(staging.device.clone(), CHUNK_BYTES);
        }
        let ticket = Ticket {
            submitted: false,
            dropped: staging.dropped.clone(),
        };
        self.encoder.on_submitted_work_done(move || {
            let mut ticket = ticket;
            ticket.submitted = true;
        });
    }
}

/// Waits in an encoder for its submission.
struct Ticket {
    submitted: bool,
    dropped: Arc<AtomicBool>,
}

impl Drop for Ticket {
    fn drop(&mut self) {
        if !self.submitted {
            self.dropped.store(true, Ordering::Release);
        }
    }
}

fn unmapped(error: wgpu::MapRangeError) -> Error {
    Error::new(
        ErrorKind::Device,
        "graphics",
        format!("staging memory cannot be written ({error})"),
    )
}
