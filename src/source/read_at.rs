//! Bytes at an offset, from a file, from memory, or from wherever a caller has them.

use std::io::{self, Read, Seek, SeekFrom};
use std::sync::Arc;

/// Something of a fixed length that can be read anywhere, from several threads at once.
pub trait ReadAt: Send + Sync {
    /// Its length in bytes.
    fn size_bytes(&self) -> u64;

    /// Bytes of memory that it holds beside its callers', once it has been read: none for a file on disk.
    fn held_bytes(&self) -> u64 {
        0
    }

    /// Fills `out` from `offset` on.
    ///
    /// # Errors
    /// [`io::ErrorKind::UnexpectedEof`] past the end, else the system's own.
    fn read_exact_at(&self, offset: u64, out: &mut [u8]) -> io::Result<()>;
}

impl ReadAt for Vec<u8> {
    fn size_bytes(&self) -> u64 {
        self.len() as u64
    }

    fn read_exact_at(&self, offset: u64, out: &mut [u8]) -> io::Result<()> {
        let start = usize::try_from(offset).map_err(|_| io::ErrorKind::UnexpectedEof)?;
        let end = start.checked_add(out.len()).ok_or(io::ErrorKind::UnexpectedEof)?;
        out.copy_from_slice(self.get(start..end).ok_or(io::ErrorKind::UnexpectedEof)?);
        Ok(())
    }
}

/// A cursor over a [`ReadAt`], for libraries that want `Read` and `Seek`.
#[derive(Clone)]
pub struct Cursor {
    bytes: Arc<dyn ReadAt>,
    position: u64,
}

impl Cursor {
    /// A cursor at the start.
    pub fn new(bytes: Arc<dyn ReadAt>) -> Self {
        Self { bytes, position: 0 }
    }
}

impl Read for Cursor {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let left = self.bytes.size_bytes().saturating_sub(self.position);
        let count = usize::try_from(left).unwrap_or(usize::MAX).min(out.len());
        self.bytes.read_exact_at(self.position, &mut out[..count])?;
        self.position += count as u64;
        Ok(count)
    }
}

impl Seek for Cursor {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let position = match to {
            SeekFrom::Start(offset) => Some(offset),
            SeekFrom::End(delta) => self.bytes.size_bytes().checked_add_signed(delta),
            SeekFrom::Current(delta) => self.position.checked_add_signed(delta),
        };
        self.position = position.ok_or(io::ErrorKind::InvalidInput)?;
        Ok(self.position)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cursor_reads_to_the_end_and_not_past_it() {
        let mut cursor = Cursor::new(Arc::new(vec![1u8, 2, 3, 4, 5]));
        let mut all = Vec::new();
        cursor.seek(SeekFrom::End(-3)).unwrap();
        cursor.read_to_end(&mut all).unwrap();
        assert_eq!(all, [3, 4, 5]);
        assert!(cursor.seek(SeekFrom::Current(-6)).is_err());
        let error = vec![0u8; 4].read_exact_at(2, &mut [0; 3]).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::UnexpectedEof);
    }
}
