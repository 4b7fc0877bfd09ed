//! Opens what a user names as an INPUT: a terrain file, a DEM, or a procedural one.

use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use super::args::InputArgs;
use crate::error::{Error, ErrorKind, Result};
use crate::source::{self, HeightSource, Synth};
use crate::terrain::{self, SourceStamp, TerrainFile};

/// An opened INPUT.
pub(super) enum Input {
    /// Heights alone.
    Dem(Box<dyn HeightSource>),
    /// Levels with bounds, and perhaps light.
    Terrain(Box<TerrainFile>),
}

/// Opens what is named: a terrain file, told by its contents, or a DEM.
pub(super) fn open(args: &InputArgs) -> Result<Input> {
    let options = args.read.options();
    if let [path] = &args.inputs[..]
        && synth(path).is_none()
        && !path.is_dir()
    {
        let name = path.display().to_string();
        let bytes = source::open_file(path)?;
        if terrain::is_terrain(bytes.as_ref()) {
            options.refuse_for_terrain(&name)?;
            return Ok(Input::Terrain(Box::new(TerrainFile::open(&name, bytes)?)));
        }
    }
    Ok(Input::Dem(source::open_with(&args.inputs, &options)?))
}

/// The first of the inputs, after which results are named.
pub(super) fn first(args: &InputArgs) -> &Path {
    args.inputs.first().map_or(Path::new(""), PathBuf::as_path)
}

/// Refuses an output that is one of the inputs themselves.
pub(super) fn refuse_own(args: &InputArgs, out: &Path) -> Result<()> {
    let Ok(target) = std::fs::canonicalize(out) else {
        return Ok(());
    };
    let same = |input: &PathBuf| std::fs::canonicalize(input).is_ok_and(|input| input == target);
    if source::files_of(&args.inputs)?.iter().any(same) {
        let error = Error::new(
            ErrorKind::Misuse,
            out.display(),
            "is an input, so it is not replaced",
        );
        return Err(error.advice("choose another name"));
    }
    Ok(())
}

fn synth(path: &Path) -> Option<Result<Synth>> {
    Synth::parse(path.to_str()?)
}

/// What a terrain file keeps of the files `paths`, so that a change of them can be told: of several the first one's
/// name, the sum of their lengths, and the latest time.
pub(super) fn stamp(paths: &[PathBuf]) -> SourceStamp {
    let mut stamp = SourceStamp {
        name: source::name_of(paths),
        ..SourceStamp::default()
    };
    for file in source::files_of(paths).unwrap_or_default() {
        let Ok(metadata) = std::fs::metadata(&file) else {
            continue;
        };
        let modified = metadata.modified().ok();
        let since_1970 = modified.and_then(|time| time.duration_since(UNIX_EPOCH).ok());
        let modified_s = since_1970.and_then(|time| i64::try_from(time.as_secs()).ok());
        stamp.length_bytes += metadata.len();
        stamp.modified_s = stamp.modified_s.max(modified_s);
    }
    stamp
}

/// The name of what is made of `path` and ends in `ending`: beside the input, in the current folder for terrain
/// that is no file. `a/N42E001.hgt` gives `a/N42E001` and the ending; so do `a/N42E001.terrain.exr` and
/// `a/N42E001.hgt.zip`. What is made of a folder stands beside it.
pub(super) fn beside(path: &Path, ending: &str) -> PathBuf {
    let Some(name) = path.file_name() else {
        // `.` and `..` have no name of their own.
        let whole = std::fs::canonicalize(path).unwrap_or_default();
        let name = whole
            .file_name()
            .map_or("terrain".into(), |n| n.to_string_lossy());
        return PathBuf::from(name.into_owned() + ending);
    };
    let name = name.to_string_lossy().into_owned();
    let without_ending = |name: &str| {
        let stem = Path::new(name).file_stem().unwrap_or_default();
        stem.to_string_lossy().into_owned()
    };
    let stem = match name.strip_suffix(".terrain.exr") {
        Some(stem) => stem.to_string(),
        None if synth(path).is_some() => name.replace(':', "-"),
        None if path.is_dir() => name,
        None => match name.strip_suffix(".zip").or(name.strip_suffix(".gz")) {
            Some(inner) => without_ending(inner),
            None => without_ending(&name),
        },
    };
    path.with_file_name(stem + ending)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_stand_beside_their_input() {
        for (input, output) in [
            ("a/N42E001.hgt", "a/N42E001.terrain.exr"),
            ("b.c.tif", "b.c.terrain.exr"),
            ("/x/b.terrain.exr", "/x/b.terrain.exr"),
            ("plain", "plain.terrain.exr"),
            ("a/N42E001.hgt.zip", "a/N42E001.terrain.exr"),
            ("a.asc.gz", "a.terrain.exr"),
            ("src/cli", "src/cli.terrain.exr"),
            ("synth:64:2", "synth-64-2.terrain.exr"),
        ] {
            assert_eq!(beside(Path::new(input), ".terrain.exr"), Path::new(output));
        }
        assert_eq!(beside(Path::new("b.terrain.exr"), ".png"), Path::new("b.png"));
    }

    #[test]
    fn a_stamp_tells_a_files_length_and_time() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.tif");
        std::fs::write(&path, [0; 77]).unwrap();
        let one = stamp(std::slice::from_ref(&path));
        assert_eq!(one.length_bytes, 77);
        assert!(one.modified_s.is_some_and(|s| s > 1_500_000_000));
        assert_eq!(stamp(&["synth:64:2".into()]).length_bytes, 0);
        std::fs::write(folder.path().join("b.tif"), [0; 23]).unwrap();
        let all = stamp(&[folder.path().into()]);
        assert_eq!(
            (all.length_bytes, all.name),
            (100, folder.path().display().to_string())
        );
    }
}
