//! A folder of results: all of its files are written beside their names, and get them together when all are whole.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::build::Output;
use crate::error::{Error, ErrorKind, Result};

/// The files of a folder, open for writing. Dropped without being published, they vanish, and the folder too where it was
/// made for them.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    made: bool,
    files: Vec<(Output, File)>,
}

impl Folder {
    /// Opens files of these `names` in `path`, which is made where it is missing.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] where `path` is no folder, or has files in it and `force` is not set; [`ErrorKind::Io`] where
    /// the system refuses.
    pub fn create(path: &Path, names: &[&str], force: bool) -> Result<Self> {
        let made = match fs::create_dir(path) {
            Ok(()) => true,
            Err(e) if e.kind() == io::ErrorKind::AlreadyExists => false,
            Err(e) => return Err(Error::io(path.display(), e)),
        };
        if !made {
            let mut entries = fs::read_dir(path).map_err(|_| {
                Error::new(ErrorKind::Misuse, path.display(), "is no folder")
                    .advice("name a folder for the results")
            })?;
            if !force && entries.next().is_some() {
                let what = "has files in it already";
                return Err(Error::new(ErrorKind::Misuse, path.display(), what)
                    .advice("use --force to replace results in it, or choose another name"));
            }
        }
        let mut folder = Self {
            path: path.into(),
            made,
            files: Vec::new(),
        };
        for name in names {
            folder.files.push(Output::create(&path.join(name), force)?);
        }
        Ok(folder)
    }

    /// Writes the files, in the order of their names, and gives them these.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] where the system refuses; those of [`Output::publish`].
    ///
    /// # Panics
    /// Where there are not as many contents as names.
    pub fn publish(mut self, contents: &[String]) -> Result<()> {
        assert_eq!(contents.len(), self.files.len(), "a content for each name");
        for ((output, file), content) in self.files.iter_mut().zip(contents) {
            let written = file.write_all(content.as_bytes()).and_then(|()| file.sync_all());
            written.map_err(|e| Error::io(output.target().display(), e))?;
        }
        self.made = false;
        for (output, file) in std::mem::take(&mut self.files) {
            output.publish(&file)?;
        }
        Ok(())
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // The temporary files first, else the folder is not empty.
        self.files.clear();
        if self.made {
            let _ = fs::remove_dir(&self.path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<_> = entries
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn all_files_appear_or_none_and_nothing_is_replaced_without_force() {
        let outer = tempfile::tempdir().unwrap();
        let path = outer.path().join("results");
        let both = ["a.csv", "b.json"];
        let texts = |text: &str| vec![text.to_string(); 2];
        drop(Folder::create(&path, &both, false).unwrap());
        assert!(!path.exists(), "a folder that was made for nothing is gone");
        Folder::create(&path, &both, false)
            .unwrap()
            .publish(&texts("one"))
            .unwrap();
        assert_eq!(names(&path), both);
        let error = Folder::create(&path, &both, false).unwrap_err().to_string();
        assert!(
            error.contains("results: has files in it already; use --force"),
            "{error}"
        );
        let forced = Folder::create(&path, &both, true).unwrap();
        assert_eq!(fs::read(path.join("a.csv")).unwrap(), b"one");
        drop(forced);
        assert_eq!(
            (names(&path), fs::read(path.join("a.csv")).unwrap()),
            (both.map(String::from).to_vec(), b"one".to_vec())
        );
        fs::write(path.join("other"), "mine").unwrap();
        Folder::create(&path, &both, true)
            .unwrap()
            .publish(&texts("two"))
            .unwrap();
        assert_eq!(fs::read(path.join("b.json")).unwrap(), b"two");
        assert_eq!(fs::read(path.join("other")).unwrap(), b"mine");
    }

    #[test]
    fn what_is_no_folder_is_named() {
        let outer = tempfile::tempdir().unwrap();
        let file = outer.path().join("file");
        fs::write(&file, "").unwrap();
        assert!(
            Folder::create(&file, &["a"], true)
                .unwrap_err()
                .to_string()
                .contains("is no folder")
        );
        let error = Folder::create(&outer.path().join("none/inner"), &["a"], false).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Io);
    }
}
