//! Names for what is written: numbered, beside what is there already, never over it.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::error::{Error, ErrorKind, Result};

/// The most files of one name in a folder.
const MOST: u32 = 99_999;

/// Makes the first file of `STEM-001ENDING` and on that is not there yet in `folder`, and has `write` fill it; one
/// that cannot be filled is removed. Returns its path.
///
/// # Errors
/// [`ErrorKind::Io`] where the folder cannot be written to, [`ErrorKind::Limit`] where all numbers are taken; those of
/// `write`.
pub(super) fn write_new(
    folder: &Path,
    stem: &str,
    ending: &str,
    write: impl FnOnce(&Path) -> Result<()>,
) -> Result<PathBuf> {
    let path = reserve(folder, stem, ending)?;
    if let Err(error) = write(&path) {
        // What is left of it is nobody's; where not even that can be removed, the first error says enough.
        let _ = fs::remove_file(&path);
        return Err(error);
    }
    Ok(path)
}

/// Writes a text into a file that was made for it.
pub(super) fn write_text(path: &Path, text: &str) -> Result<()> {
    let written = File::create(path).and_then(|mut file| file.write_all(text.as_bytes()));
    written.map_err(|e| Error::io(path.display(), e))
}

fn reserve(folder: &Path, stem: &str, ending: &str) -> Result<PathBuf> {
    for number in 1..=MOST {
        let path = folder.join(format!("{stem}-{number:03}{ending}"));
        match OpenOptions::new().write(true).create_new(true).open(&path) {
            Ok(_) => return Ok(path),
            Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
            Err(e) => return Err(Error::io(path.display(), e)),
        }
    }
    let what = format!("holds {MOST} files {stem}-NUMBER{ending} already");
    Err(Error::new(ErrorKind::Limit, folder.display(), what)
        .advice("choose another folder with --output-dir"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_that_exists_is_touched() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("a-001.json"), "mine").unwrap();
        fs::create_dir(folder.path().join("a-002.json")).unwrap();
        let write = |path: &Path| write_text(path, "new");
        let path = write_new(folder.path(), "a", ".json", write).unwrap();
        assert_eq!(path, folder.path().join("a-003.json"));
        assert_eq!(
            fs::read_to_string(folder.path().join("a-001.json")).unwrap(),
            "mine"
        );
        assert_eq!(fs::read_to_string(path).unwrap(), "new");
        let path = write_new(folder.path(), "a", ".png", write).unwrap();
        assert!(path.ends_with("a-001.png"));
    }

    #[test]
    fn what_fails_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let fail = |path: &Path| Err(Error::new(ErrorKind::Io, path.display(), "full"));
        assert!(write_new(folder.path(), "a", ".png", fail).is_err());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
        let missing = folder.path().join("missing");
        let error = write_new(&missing, "a", ".png", |_| Ok(())).unwrap_err();
        assert!(
            error.to_string().contains("missing") && error.kind() == ErrorKind::Io,
            "{error}"
        );
    }
}
