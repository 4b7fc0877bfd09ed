//! The folder of terrain files that were built in the background, for the next run.
//!
//! It is `CLIPSCAPE_CACHE`, or `clipscape` in the user's cache folder (`XDG_CACHE_HOME`, else `~/.cache`; `LOCALAPPDATA` on
//! Windows). A file is found by what it was made of: the paths, lengths and times of the DEM's files and the options it is
//! read with. Files appear whole or not at all, so processes that build the same one do not harm each other: the last
//! one's replaces the others', which are the same. Together they take at most [`DEFAULT_CACHE_BYTES`], or
//! `CLIPSCAPE_CACHE_BYTES`; those that were not opened for the longest time go first.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use crate::error::{Error, ErrorKind, Result};
use crate::light::LightOptions;
use crate::progress::Progress;
use crate::source::{self, OpenOptions};
use crate::terrain::SourceStamp;

/// What the files in the folder may take together where nothing else is said: 16 GiB.
pub const DEFAULT_CACHE_BYTES: u64 = 16 << 30;

/// What a file's name ends in.
const ENDING: &str = ".terrain.exr";

/// An unfinished file that is older than this was left by a process that was killed.
const ABANDONED: Duration = Duration::from_secs(24 * 3600);

/// The folder of terrain files that were built in the background.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CacheFolder {
    path: PathBuf,
    most_bytes: u64,
}

/// A file in the folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CachedFile {
    /// Where it is.
    pub path: PathBuf,
    /// Its length in bytes.
    pub bytes: u64,
    /// When it was opened last, or made.
    pub used: SystemTime,
}

/// What a DEM's files and the way they are read are told by.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fingerprint {
    /// The name by which messages speak of the DEM.
    pub name: String,
    inputs: Vec<PathBuf>,
    options: String,
    files: Vec<FileMark>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
struct FileMark {
    path: PathBuf,
    length_bytes: u64,
    modified: Option<Duration>,
}

impl Fingerprint {
    /// Of the DEM in `inputs`, read as `options` say, and of the light that is to be traced over it.
    ///
    /// # Errors
    /// Where a file cannot be looked at.
    pub fn new(inputs: &[impl AsRef<Path>], options: &OpenOptions, light: &LightOptions) -> Result<Self> {
        let inputs: Vec<PathBuf> = inputs.iter().map(|i| i.as_ref().to_path_buf()).collect();
        Ok(Self {
            name: source::name_of(&inputs),
            files: marks(&inputs)?,
            options: format!("{options:?} {light:?}"),
            inputs,
        })
    }

    /// Whether the files are still as they were.
    pub fn is_current(&self) -> bool {
        marks(&self.inputs).is_ok_and(|files| files == self.files)
    }

    /// The name of its terrain file: the DEM's, and a hash of all there is to tell it by.
    pub fn file_name(&self) -> String {
        let mut hash = Fnv::new();
        hash.add(crate::terrain::TOOL.as_bytes());
        hash.add(&crate::terrain::FORMAT_VERSION.to_le_bytes());
        hash.add(self.options.as_bytes());
        for file in &self.files {
            hash.add(file.path.as_os_str().as_encoded_bytes());
            hash.add(&file.length_bytes.to_le_bytes());
            hash.add(&file.modified.map_or([0xFF; 16], |d| d.as_nanos().to_le_bytes()));
        }
        let first = self.inputs.first().and_then(|i| i.file_name());
        let name = first.map_or("terrain".into(), |n| n.to_string_lossy().into_owned());
        let plain = |c: char| {
            if c.is_alphanumeric() || "-_.".contains(c) {
                c
            } else {
                '_'
            }
        };
        let stem: String = name.trim_start_matches('.').chars().take(60).map(plain).collect();
        format!("{stem}-{:016x}{ENDING}", hash.0)
    }

    /// What the terrain file keeps of the DEM's files.
    pub fn stamp(&self) -> SourceStamp {
        let seconds = |mark: &FileMark| mark.modified.and_then(|d| i64::try_from(d.as_secs()).ok());
        SourceStamp {
            name: self.name.clone(),
            length_bytes: self.files.iter().map(|f| f.length_bytes).sum(),
            modified_s: self.files.iter().filter_map(seconds).max(),
        }
    }
}

fn marks(inputs: &[PathBuf]) -> Result<Vec<FileMark>> {
    let mark = |path: PathBuf| {
        let refused = |e| Error::io(path.display(), e);
        let metadata = fs::metadata(&path).map_err(refused)?;
        let modified = metadata.modified().ok();
        Ok(FileMark {
            length_bytes: metadata.len(),
            modified: modified.and_then(|t| t.duration_since(UNIX_EPOCH).ok()),
            path: fs::canonicalize(&path).map_err(refused)?,
        })
    };
    source::files_of(inputs)?.into_iter().map(mark).collect()
}

/// FNV-1a of 64 bits (Fowler, Noll, Vo), with the length after each part.
struct Fnv(u64);

impl Fnv {
    fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    fn add(&mut self, bytes: &[u8]) {
        for byte in bytes.iter().chain(&(bytes.len() as u64).to_le_bytes()) {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }
}

impl CacheFolder {
    /// The user's folder, which need not exist; none where the system tells of no home.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] where `CLIPSCAPE_CACHE_BYTES` is no number.
    pub fn of_user() -> Result<Option<Self>> {
        let set = |name: &str| env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
        let ours = |folder: PathBuf| folder.join("clipscape");
        let home = || {
            if cfg!(windows) {
                set("LOCALAPPDATA")
            } else {
                set("HOME").map(|home| home.join(".cache"))
            }
        };
        // The XDG base directory specification has relative paths ignored.
        let xdg = || set("XDG_CACHE_HOME").filter(|path| path.is_absolute());
        let path = set("CLIPSCAPE_CACHE")
            .or_else(|| xdg().map(ours))
            .or_else(|| home().map(ours));
        let most_bytes = match env::var("CLIPSCAPE_CACHE_BYTES") {
            Ok(text) => text.trim().parse().map_err(|_| {
                let what = format!("{text:?} is no number of bytes");
                Error::new(ErrorKind::Misuse, "CLIPSCAPE_CACHE_BYTES", what)
            })?,
            Err(_) => DEFAULT_CACHE_BYTES,
        };
        Ok(path.map(|path| Self { path, most_bytes }))
    }

    /// A folder at `path` whose files may take `most_bytes` together.
    pub fn new(path: impl Into<PathBuf>, most_bytes: u64) -> Self {
        Self {
            path: path.into(),
            most_bytes,
        }
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Makes the folder, where it is missing.
    ///
    /// # Errors
    /// [`ErrorKind::Io`].
    pub(super) fn create(&self) -> Result<()> {
        fs::create_dir_all(&self.path).map_err(|e| Error::io(self.path.display(), e))
    }

    /// Where the terrain file of a DEM is, or would be.
    pub fn path_of(&self, fingerprint: &Fingerprint) -> PathBuf {
        self.path.join(fingerprint.file_name())
    }

    /// Notes that a file was opened.
    pub(super) fn touch(&self, path: &Path) {
        // A folder that may only be read is used all the same.
        let _ = fs::OpenOptions::new()
            .write(true)
            .open(path)
            .and_then(|file| file.set_modified(SystemTime::now()));
    }

    /// The terrain files in it, the last used first.
    ///
    /// # Errors
    /// [`ErrorKind::Io`]; a folder that does not exist is empty.
    pub fn list(&self) -> Result<Vec<CachedFile>> {
        let mut files = self.files(|name| name.ends_with(ENDING) && !name.starts_with('.'))?;
        files.sort_by(|a, b| (b.used, &a.path).cmp(&(a.used, &b.path)));
        Ok(files)
    }

    /// Removes all terrain files in it, and what unfinished ones have left; how many, and their bytes.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] where one cannot be removed.
    pub fn clear(&self) -> Result<(usize, u64)> {
        let files = self.files(ours)?;
        for file in &files {
            remove(&file.path)?;
        }
        Ok((files.len(), files.iter().map(|f| f.bytes).sum()))
    }

    /// Lets go of files that were used least recently until the others fit, but not of `newest`, and of what was left
    /// unfinished long ago.
    pub(super) fn make_room(&self, newest: &Path, progress: &dyn Progress) {
        let Ok(files) = self.list() else { return };
        let mut bytes: u64 = files.iter().map(|f| f.bytes).sum();
        for file in files.iter().rev().filter(|f| f.path != newest) {
            if bytes <= self.most_bytes {
                break;
            }
            if remove(&file.path).is_ok() {
                bytes -= file.bytes;
            }
        }
        if bytes > self.most_bytes {
            let what = format!(
                "{}: is larger than all that may be kept, {} bytes; see CLIPSCAPE_CACHE_BYTES",
                newest.display(),
                self.most_bytes
            );
            progress.warn(&what);
        }
        let unfinished = self.files(|name| ours(name) && name.starts_with('.'));
        let old = |f: &&CachedFile| f.used.elapsed().is_ok_and(|age| age > ABANDONED);
        for file in unfinished.unwrap_or_default().iter().filter(old) {
            let _ = remove(&file.path);
        }
    }

    fn files(&self, wanted: impl Fn(&str) -> bool) -> Result<Vec<CachedFile>> {
        let refused = |e| Error::io(self.path.display(), e);
        let entries = match fs::read_dir(&self.path) {
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
            entries => entries.map_err(refused)?,
        };
        let mut files = Vec::new();
        for entry in entries {
            let entry = entry.map_err(refused)?;
            let name = entry.file_name();
            // What another process removes meanwhile is not there.
            let Ok(metadata) = entry.metadata() else { continue };
            if metadata.is_file() && name.to_str().is_some_and(&wanted) {
                files.push(CachedFile {
                    path: entry.path(),
                    bytes: metadata.len(),
                    used: metadata.modified().unwrap_or(UNIX_EPOCH),
                });
            }
        }
        Ok(files)
    }
}

/// Whether a name is one that this folder's files have, finished or not.
fn ours(name: &str) -> bool {
    name.ends_with(ENDING) || name.starts_with('.') && name.contains(ENDING) && name.ends_with(".part")
}

/// Removes a file; one that is gone already is removed.
fn remove(path: &Path) -> Result<()> {
    match fs::remove_file(path) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(Error::io(path.display(), e)),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::Silent;

    fn file(folder: &Path, name: &str, bytes: usize, age_s: u64) -> PathBuf {
        let path = folder.join(name);
        fs::write(&path, vec![0; bytes]).unwrap();
        let file = fs::OpenOptions::new().write(true).open(&path).unwrap();
        file.set_modified(SystemTime::now() - Duration::from_secs(age_s))
            .unwrap();
        path
    }

    #[test]
    fn a_fingerprint_tells_path_length_time_and_options() {
        let folder = tempfile::tempdir().unwrap();
        let (a, b) = (
            file(folder.path(), "a b.tif", 10, 5),
            file(folder.path(), "b.tif", 10, 5),
        );
        let of = |path: &Path, options: &OpenOptions| {
            Fingerprint::new(&[path], options, &LightOptions::default()).unwrap()
        };
        let first = of(&a, &OpenOptions::default());
        assert_eq!(first, of(&a, &OpenOptions::default()));
        assert!(first.file_name().starts_with("a_b.tif-") && first.file_name().ends_with(ENDING));
        let nodata = OpenOptions {
            nodata: Some(3.0),
            ..Default::default()
        };
        let names = |all: &[&Fingerprint]| {
            let mut names: Vec<_> = all.iter().map(|f| f.file_name()).collect();
            names.sort();
            names.dedup();
            names.len()
        };
        let (other, flagged) = (of(&b, &OpenOptions::default()), of(&a, &nodata));
        assert!(first.is_current());
        fs::write(&a, [0; 11]).unwrap();
        assert!(!first.is_current());
        let longer = of(&a, &OpenOptions::default());
        file(folder.path(), "a b.tif", 11, 50);
        let older = of(&a, &OpenOptions::default());
        assert_eq!(names(&[&first, &other, &flagged, &longer, &older]), 5);
        assert_eq!(older.stamp().length_bytes, 11);
        assert!(
            Fingerprint::new(
                &[folder.path().join("none")],
                &OpenOptions::default(),
                &LightOptions::default()
            )
            .is_err()
        );
    }

    #[test]
    fn the_least_recently_used_go_and_others_files_stay() {
        let folder = tempfile::tempdir().unwrap();
        let cache = CacheFolder::new(folder.path(), 250);
        let old = file(folder.path(), "old.terrain.exr", 100, 500);
        let used = file(folder.path(), "used.terrain.exr", 100, 900);
        let newest = file(folder.path(), "new.terrain.exr", 100, 0);
        let text = file(folder.path(), "text.txt", 1000, 9000);
        let left = file(folder.path(), ".x.terrain.exr.12-0.part", 50, 2 * 86_400);
        let busy = file(folder.path(), ".y.terrain.exr.13-0.part", 50, 10);
        cache.touch(&used);
        cache.make_room(&newest, &Silent);
        let there = |path: &Path| path.exists();
        assert_eq!(
            [&old, &used, &newest, &text, &left, &busy].map(|p| there(p)),
            [false, true, true, true, false, true]
        );
        assert_eq!(cache.list().unwrap().len(), 2);
        assert_eq!(cache.clear().unwrap(), (3, 250));
        assert!(there(&text) && cache.list().unwrap().is_empty());
        assert!(
            CacheFolder::new(folder.path().join("none"), 1)
                .list()
                .unwrap()
                .is_empty()
        );
    }
}
