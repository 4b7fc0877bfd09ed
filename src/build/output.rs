//! A file that appears whole or not at all: written beside its target, synced, renamed.
//!
//! Until then it is called `.NAME.PLACE-PROCESS-COUNT.part`. A process that is killed leaves it; whoever next makes a
//! file of the same name removes what processes left that are no more. That they are no more is known only of those
//! whose numbers count where we run: PLACE is a check of the system's boot and of the numbering of processes (Linux).
//! Elsewhere nothing is known, and nothing removed.

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
        let mut before = std::ffi::OsString::from(".");
        before.push(name);
        before.push(format!(".{:08x}-", place().unwrap_or_default()));
        remove_leftovers(target, &before);
        let mut temporary_name = before;
        temporary_name.push(format!("{}-{count}.part", std::process::id()));
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

/// A check of where a process's number means the same process: one boot of one system, one numbering.
fn place() -> Option<u32> {
    let boot = fs::read("/proc/sys/kernel/random/boot_id").ok()?;
    let numbering = fs::read_link("/proc/self/ns/pid").ok()?;
    let check = crc32c::crc32c(&boot);
    Some(crc32c::crc32c_append(
        check,
        numbering.as_os_str().as_encoded_bytes(),
    ))
}

/// Removes what processes that are no more left beside `target`, whose names begin with `before`. What cannot be removed
/// stays.
fn remove_leftovers(target: &Path, before: &std::ffi::OsStr) {
    if place().is_none() {
        return;
    }
    let folder = target.parent().filter(|f| !f.as_os_str().is_empty());
    let Ok(entries) = fs::read_dir(folder.unwrap_or(Path::new("."))) else {
        return;
    };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let process = name
            .as_encoded_bytes()
            .strip_prefix(before.as_encoded_bytes())
            .and_then(|rest| rest.strip_suffix(b".part"))
            .and_then(|rest| std::str::from_utf8(rest).ok())
            .and_then(|rest| rest.split_once('-'))
            .and_then(|(process, _)| process.parse::<u32>().ok());
        if process.is_some_and(|p| !Path::new(&format!("/proc/{p}")).exists()) {
            let _ = fs::remove_file(entry.path());
        }
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

    #[cfg(target_os = "linux")]
    #[test]
    fn what_a_killed_process_left_is_removed_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("a.exr");
        let mut child = std::process::Command::new("true").spawn().unwrap();
        let gone = child.id();
        child.wait().unwrap();
        let here = place().unwrap();
        let own = std::process::id();
        let left = format!(".a.exr.{here:08x}-{gone}-0.part");
        // Of a process that lives, of another boot or machine, of another target, and no such file at all.
        let others = [
            format!(".a.exr.{here:08x}-{own}-77.part"),
            format!(".a.exr.{:08x}-{gone}-0.part", !here),
            format!(".b.exr.{here:08x}-{gone}-0.part"),
            format!(".a.exr.{here:08x}-{gone}x-0.part"),
            "a.exr.part".into(),
        ];
        for name in others.iter().chain([&left]) {
            fs::write(folder.path().join(name), "").unwrap();
        }
        drop(Output::create(&target, false).unwrap());
        let mut found = names(folder.path());
        found.sort_unstable();
        let mut want = others.to_vec();
        want.sort_unstable();
        assert_eq!(found, want);
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
