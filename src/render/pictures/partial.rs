//! A file that has its name only when it is whole: written beside its target, then renamed.

use std::fs::{self, File, OpenOptions};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::{Error, Result};

/// The temporary file of one target; removed when dropped unfinished.
///
/// Not synced to the disk: pictures can be made again, and a flight has hundreds of them.
#[derive(Debug)]
pub(super) struct Partial {
    target: PathBuf,
    temporary: PathBuf,
    finished: bool,
}

impl Partial {
    /// A new empty file beside `target`, and its handle.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Io`] about `target` where its folder is missing or cannot be written to.
    pub(super) fn create(target: &Path) -> Result<(Self, File)> {
        // Apart from other threads by the count, from other processes by the id.
        static COUNT: AtomicU64 = AtomicU64::new(0);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let mut name = std::ffi::OsString::from(".");
        name.push(target.file_name().unwrap_or_default());
        name.push(format!(".{}-{count}.part", std::process::id()));
        let temporary = target.with_file_name(name);
        let file = OpenOptions::new()
            .write(true)
            .create_new(true)
            .open(&temporary)
            .map_err(|e| Error::io(target.display(), e))?;
        Ok((
            Self {
                target: target.into(),
                temporary,
                finished: false,
            },
            file,
        ))
    }

    /// What the file will be called.
    pub(super) fn target(&self) -> &Path {
        &self.target
    }

    /// Gives the whole file its name, replacing what had it.
    pub(super) fn finish(mut self) -> Result<()> {
        fs::rename(&self.temporary, &self.target).map_err(|e| Error::io(self.target.display(), e))?;
        self.finished = true;
        Ok(())
    }
}

impl Drop for Partial {
    fn drop(&mut self) {
        if !self.finished {
            // Nothing can be done where even that is refused.
            let _ = fs::remove_file(&self.temporary);
        }
    }
}
