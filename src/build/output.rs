//! A file that appears whole or not at all: written beside its target, synced, renamed.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::{Error, ErrorKind, Result};

/// A temporary file beside its target. Dropped without being published, it is removed.
#[derive(Debug)]
pub struct Output {
    target: PathBuf,
    temporary: PathBuf,
    force: bool,
}

impl Output {
    /// Creates the temporary file, open for writing. A target that exists is refused unless `force`.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] where the target exists or names no file, [`ErrorKind::Io`] where its folder is missing
    /// or may not be written to.
    pub fn create(target: &Path, force: bool) -> Result<(Self, File)> {
        static COUNT: AtomicU64 = AtomicU64::new(0);
        let Some(name) = target.file_name() else {
            let what = "names no file";
            return Err(Error::new(ErrorKind::Misuse, target.display(), what).advice("give a file's path"));
        };
        match fs::symlink_metadata(target) {
            Ok(found) if found.is_dir() => {
                let what = "is a folder";
                return Err(
                    Error::new(ErrorKind::Misuse, target.display(), what).advice("give a file's path")
                );
            }
            Ok(_) if !force => return Err(exists(target)),
            // A device or a pipe is nobody's output to replace; a link is replaced, not what it leads to.
            Ok(found) if !found.is_file() && !found.is_symlink() => {
                let what = "is no plain file, so it is not replaced";
                return Err(
                    Error::new(ErrorKind::Misuse, target.display(), what).advice("choose another name")
                );
            }
            Ok(_) => {}
            Err(e) if e.kind() == io::ErrorKind::NotFound => {}
            Err(e) => return Err(Error::io(target.display(), e)),
        }
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let mut temporary_name = std::ffi::OsString::from(".");
        temporary_name.push(name);
        temporary_name.push(format!(".{}-{count}.part", std::process::id()));
        let temporary = target.with_file_name(temporary_name);
        // Readable too, so that its maker can check it before it is published.
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .create_new(true)
            .open(&temporary);
        let file = file.map_err(|e| Error::io(target.display(), e))?;
        Ok((
            Self {
                target: target.into(),
                temporary,
                force,
            },
            file,
        ))
    }

    /// What the file will be called.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Where the file is until then.
    pub(super) fn temporary(&self) -> &Path {
        &self.temporary
    }

    /// Syncs the file and gives it its name. Without `force` a target that has appeared meanwhile stays.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] where the system refuses, [`ErrorKind::Misuse`] where the target has appeared; then the
    /// target is as it was.
    pub fn publish(self, file: &File) -> Result<()> {
        file.sync_all().map_err(|e| Error::io(self.target.display(), e))?;
        let folder = self.target.parent().map(Path::to_path_buf);
        self.publish_unsynced()?;
        // The name itself is safe once the folder is synced; where folders cannot be, nothing is lost.
        let folder = folder
            .filter(|f| !f.as_os_str().is_empty())
            .unwrap_or_else(|| ".".into());
        let _ = File::open(folder).and_then(|f| f.sync_all());
        Ok(())
    }

    /// Gives the file its name without waiting for the disk: for what can be made again, hundreds of it.
    ///
    /// # Errors
    /// As [`Output::publish`].
    pub fn publish_unsynced(self) -> Result<()> {
        let refused = |e| Error::io(self.target.display(), e);
        if self.force {
            fs::rename(&self.temporary, &self.target).map_err(refused)?;
        } else {
            // A link, unlike a rename, fails where the name is taken. Some file systems have none.
            match fs::hard_link(&self.temporary, &self.target) {
                // Dropping removes the other name.
                Ok(()) => {}
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => return Err(exists(&self.target)),
                Err(_) if fs::symlink_metadata(&self.target).is_ok() => return Err(exists(&self.target)),
                Err(_) => fs::rename(&self.temporary, &self.target).map_err(refused)?,
            }
        }
        Ok(())
    }
}

impl Drop for Output {
    fn drop(&mut self) {
        // After a rename there is nothing left to remove.
        let _ = fs::remove_file(&self.temporary);
    }
}

/// Refuses a target that exists, for whoever will be writing it much later.
///
/// # Errors
/// [`ErrorKind::Misuse`] where it exists.
pub fn refuse_existing(target: &Path) -> Result<()> {
    if fs::symlink_metadata(target).is_ok() {
        Err(exists(target))
    } else {
        Ok(())
    }
}

fn exists(target: &Path) -> Error {
    Error::new(ErrorKind::Misuse, target.display(), "exists already")
        .advice("use --force to replace it, or choose another name")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn names(folder: &Path) -> Vec<String> {
        fs::read_dir(folder)
            .unwrap()
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect()
    }

    #[test]
    fn a_file_appears_whole_and_leaves_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("a.exr");
        let (output, mut file) = Output::create(&target, false).unwrap();
        file.write_all(b"new").unwrap();
        assert!(!target.exists() && names(folder.path()).len() == 1);
        output.publish(&file).unwrap();
        assert_eq!(fs::read(&target).unwrap(), b"new");
        assert_eq!(names(folder.path()), ["a.exr"]);
        drop(Output::create(&target, true).unwrap());
        assert_eq!(names(folder.path()), ["a.exr"]);
    }

    #[test]
    fn what_exists_is_replaced_only_by_force_even_if_it_appeared_meanwhile() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("a.exr");
        let (late, file) = Output::create(&target, false).unwrap();
        fs::write(&target, "old").unwrap();
        assert!(
            late.publish(&file)
                .unwrap_err()
                .to_string()
                .contains("exists already")
        );
        assert!(Output::create(&target, false).is_err());
        assert_eq!(fs::read(&target).unwrap(), b"old");
        let (forced, mut file) = Output::create(&target, true).unwrap();
        file.write_all(b"new").unwrap();
        forced.publish(&file).unwrap();
        assert_eq!(fs::read(&target).unwrap(), b"new");
        assert_eq!(names(folder.path()), ["a.exr"]);
    }

    #[test]
    fn folders_that_are_missing_or_in_the_way_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let error = Output::create(&folder.path().join("none/a.exr"), false)
            .err()
            .unwrap();
        assert_eq!(error.kind(), ErrorKind::Io);
        assert!(error.subject().ends_with("a.exr"), "{error}");
        assert_eq!(
            Output::create(folder.path(), true).err().unwrap().kind(),
            ErrorKind::Misuse
        );
        assert_eq!(
            Output::create(Path::new("/"), true).err().unwrap().kind(),
            ErrorKind::Misuse
        );
    }
}
