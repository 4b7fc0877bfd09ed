//! A file on disk as [`ReadAt`].

use std::fs::File;
use std::io;

use super::ReadAt;

/// An open file, read at offsets without moving a shared cursor where the system can do that.
#[derive(Debug)]
pub(super) struct OpenFile {
    #[cfg(unix)]
    file: File,
    #[cfg(not(unix))]
    file: std::sync::Mutex<File>,
    size_bytes: u64,
}

impl OpenFile {
    /// Takes an open file, whose length is fixed from now on.
    pub(super) fn new(file: File) -> io::Result<Self> {
        let size_bytes = file.metadata()?.len();
        #[cfg(not(unix))]
        let file = std::sync::Mutex::new(file);
        Ok(Self { file, size_bytes })
    }
}

impl ReadAt for OpenFile {
    fn size_bytes(&self) -> u64 {
        self.size_bytes
    }

    #[cfg(unix)]
    fn read_exact_at(&self, offset: u64, out: &mut [u8]) -> io::Result<()> {
        std::os::unix::fs::FileExt::read_exact_at(&self.file, out, offset)
    }

    #[cfg(not(unix))]
    fn read_exact_at(&self, offset: u64, out: &mut [u8]) -> io::Result<()> {
        use std::io::{Read, Seek};
        let mut file = self
            .file
            .lock()
            .map_err(|_| io::Error::other("a reader of the file panicked"))?;
        file.seek(io::SeekFrom::Start(offset))?;
        file.read_exact(out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn bytes_are_read_at_offsets_and_not_past_the_end() {
        let mut file = tempfile::tempfile().unwrap();
        file.write_all(&[1, 2, 3, 4, 5]).unwrap();
        let file = OpenFile::new(file).unwrap();
        let mut out = [0; 3];
        file.read_exact_at(2, &mut out).unwrap();
        assert_eq!((file.size_bytes(), out), (5, [3, 4, 5]));
        assert_eq!(
            file.read_exact_at(3, &mut out).unwrap_err().kind(),
            io::ErrorKind::UnexpectedEof
        );
    }
}
