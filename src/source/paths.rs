//! Opens DEMs by their paths: a file with what lies beside it, several files or folders as one DEM, procedural terrain.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::file::OpenFile;
use super::mosaic::Mosaic;
use super::open::{Input, READ_HERE, ending, open_input};
use super::{HeightSource, OpenOptions, ReadAt, Synth, crop};
use crate::error::{Error, ErrorKind, Result};

/// Files of a folder, or tiles of a mosaic, at most.
const MAX_FILES: usize = 1 << 16;

/// Endings by which a folder's DEMs are known; `.hdr` beside makes one of any other.
const ENDINGS: [&str; 17] = [
    "tif", "tiff", "png", "exr", "hgt", "asc", "agr", "dem", "dt0", "dt1", "dt2", "bil", "bip", "bsq", "flt",
    "r16", "r32",
];

/// Opens the DEM at `path` as its file gives it; messages speak of it by the path as given.
///
/// # Errors
/// As [`open_with`].
pub fn open(path: &Path) -> Result<Box<dyn HeightSource>> {
    open_with(&[path], &OpenOptions::default())
}

/// Opens the DEM in `inputs`: a file, `synth:SIZE[:SEED]`, or a mosaic of files and of the DEMs in folders, sorted by
/// name, where the later ones win. Tiles of a mosaic are read as they are asked for.
///
/// # Errors
/// One clear line where an input is missing, no plain file, empty, damaged, of a kind that is not read or off the grid
/// of the others, and where the options do not suit it.
pub fn open_with(inputs: &[impl AsRef<Path>], options: &OpenOptions) -> Result<Box<dyn HeightSource>> {
    let whole: Box<dyn HeightSource> = match inputs {
        [] => return Err(Error::new(ErrorKind::Misuse, "input", "is missing").advice(READ_HERE)),
        [one] if let Some(synth) = one.as_ref().to_str().and_then(Synth::parse) => {
            options.refuse_of_file("synth:")?;
            Box::new(synth?)
        }
        [one] if !one.as_ref().is_dir() => open_path(one.as_ref(), options)?,
        many => Box::new(open_mosaic(many, options)?),
    };
    crop::apply(whole, options)
}

fn open_mosaic(inputs: &[impl AsRef<Path>], options: &OpenOptions) -> Result<Mosaic> {
    let of_tile = OpenOptions {
        crop: None,
        spacing_m: None,
        ..options.clone()
    };
    Mosaic::new(
        &name_of(inputs),
        &files_of(inputs)?,
        &of_tile,
        Box::new(open_path),
    )
}

/// The name by which messages speak of all of `inputs`: the first one's, and how many more there are.
pub fn name_of(inputs: &[impl AsRef<Path>]) -> String {
    match inputs {
        [] => String::new(),
        [one] => one.as_ref().display().to_string(),
        [first, more @ ..] => format!("{} and {} more", first.as_ref().display(), more.len()),
    }
}

/// The files of `inputs`: of a folder the DEMs in it. Procedural terrain has none.
///
/// # Errors
/// Where a folder cannot be read or holds no DEM; [`ErrorKind::Limit`] for more files than a mosaic may have.
pub fn files_of(inputs: &[impl AsRef<Path>]) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for input in inputs {
        let path = input.as_ref();
        if path.is_dir() {
            files.extend(folder(path)?);
        } else if path.to_str().and_then(Synth::parse).is_none() || inputs.len() > 1 {
            files.push(path.to_path_buf());
        }
        if files.len() > MAX_FILES {
            let what = format!("is a mosaic of more than {MAX_FILES} files");
            return Err(Error::new(ErrorKind::Limit, path.display(), what));
        }
    }
    Ok(files)
}

/// The DEMs of a folder, sorted by name: files whose ending promises one, packed or not.
fn folder(path: &Path) -> Result<Vec<PathBuf>> {
    let failed = |error| Error::io(path.display(), error);
    let mut names = Vec::new();
    for entry in fs::read_dir(path).map_err(failed)? {
        names.push(entry.map_err(failed)?.path());
        if names.len() > 4 * MAX_FILES {
            let what = format!("holds more than {} files", 4 * MAX_FILES);
            return Err(Error::new(ErrorKind::Limit, path.display(), what));
        }
    }
    names.sort();
    let has_header = |file: &Path| {
        names
            .iter()
            .any(|n| n != file && n.file_stem() == file.file_stem() && is(n, "hdr"))
    };
    let mut files: Vec<PathBuf> = names
        .iter()
        .filter(|n| promises_dem(n, &has_header))
        .cloned()
        .collect();
    files.retain(|f| f.is_file());
    if files.is_empty() {
        let what = "is a folder without any DEM";
        return Err(Error::new(ErrorKind::Misuse, path.display(), what).advice(READ_HERE));
    }
    Ok(files)
}

fn is(file: &Path, wanted: &str) -> bool {
    file.extension().is_some_and(|e| e.eq_ignore_ascii_case(wanted))
}

pub(super) fn promises_dem(file: &Path, has_header: &dyn Fn(&Path) -> bool) -> bool {
    let Some(name) = file.file_name().and_then(OsStr::to_str) else {
        return false;
    };
    // A terrain file is made of a DEM, and lies beside it.
    if name.starts_with('.') || name.ends_with(".terrain.exr") {
        return false;
    }
    let name = name.to_ascii_lowercase();
    if name.ends_with(".zip") {
        return true;
    }
    let known = |name: &str| ENDINGS.contains(&ending(name).as_str());
    match name.strip_suffix(".gz") {
        Some(inner) => known(inner),
        None => {
            known(&name)
                || (["dat", "img", "bin", "raw"].contains(&ending(&name).as_str()) && has_header(file))
        }
    }
}

fn open_path(path: &Path, options: &OpenOptions) -> Result<Box<dyn HeightSource>> {
    let name = path.display().to_string();
    let bytes = open_file(path)?;
    let beside = |wanted: &str| {
        // `a.hdr`, `a.HDR` and `a.bil.hdr` are looked for: listing folders of many tiles would cost more.
        let longer = [path.as_os_str(), OsStr::new("."), OsStr::new(wanted)]
            .into_iter()
            .collect::<OsString>();
        let candidates = [
            path.with_extension(wanted),
            path.with_extension(wanted.to_ascii_uppercase()),
            longer.into(),
        ];
        let found = candidates.iter().find(|c| c.is_file() && c.as_path() != path);
        found.map(|c| open_file(c)).transpose()
    };
    open_input(&Input {
        name: &name,
        file_name: &name,
        bytes,
        options,
        beside: &beside,
    })
}

/// The bytes of the file at `path`, read where they are asked for.
///
/// # Errors
/// One clear line where the file is missing or no plain file.
pub fn open_file(path: &Path) -> Result<Arc<dyn ReadAt>> {
    let name = path.display().to_string();
    let metadata = fs::metadata(path).map_err(|error| Error::io(&name, error))?;
    if metadata.is_dir() {
        return Err(Error::new(ErrorKind::Misuse, &name, "is a folder").advice("name a file in it"));
    }
    if !metadata.is_file() {
        return Err(Error::new(ErrorKind::Misuse, &name, "is no plain file"));
    }
    let file = File::open(path)
        .and_then(OpenFile::new)
        .map_err(|error| Error::io(&name, error))?;
    Ok(Arc::new(file))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_named_as_given() {
        let folder = tempfile::tempdir().unwrap();
        let check = |path: &Path, kind: ErrorKind, part: &str| {
            let error = open(path).err().expect("nothing readable is there");
            assert_eq!(error.kind(), kind, "{error}");
            assert_eq!(error.subject(), path.display().to_string());
            assert!(error.to_string().contains(part), "{error}");
        };
        check(folder.path(), ErrorKind::Misuse, "is a folder without any DEM");
        check(&folder.path().join("none.tif"), ErrorKind::Io, "no such file");
        let empty = folder.path().join("empty.tif");
        fs::write(&empty, "").unwrap();
        check(&empty, ErrorKind::Broken, "is empty");
        let grid = folder.path().join("grid.asc");
        fs::write(&grid, "ncols 1\nnrows 1\ncellsize 2\n7\n").unwrap();
        let source = open(&grid).unwrap();
        assert_eq!(source.description().name, grid.display().to_string());
    }
}
