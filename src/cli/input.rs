//! Opens what a user names as an INPUT: a terrain file, a DEM, or a procedural one.

use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use crate::error::Result;
use crate::source::{self, HeightSource, OpenOptions, Synth};
use crate::terrain::{self, SourceStamp, TerrainFile};

/// An opened INPUT.
pub(super) enum Input {
    /// Heights alone.
    Dem(Box<dyn HeightSource>),
    /// Levels with bounds, and perhaps light.
    Terrain(Box<TerrainFile>),
}

/// Opens `path`, which is told by its contents; a path that begins with `synth:` names procedural terrain.
pub(super) fn open(path: &Path) -> Result<Input> {
    if let Some(synth) = synth(path) {
        return Ok(Input::Dem(Box::new(synth?)));
    }
    let name = path.display().to_string();
    let bytes = source::open_file(path)?;
    if terrain::is_terrain(bytes.as_ref()) {
        return Ok(Input::Terrain(Box::new(TerrainFile::open(&name, bytes)?)));
    }
    Ok(Input::Dem(source::open_bytes(
        &name,
        bytes,
        &OpenOptions::default(),
    )?))
}

fn synth(path: &Path) -> Option<Result<Synth>> {
    Synth::parse(path.to_str()?)
}

/// What a terrain file keeps of the file `path`, so that a change of it can be told.
pub(super) fn stamp(path: &Path) -> SourceStamp {
    let name = path.display().to_string();
    if synth(path).is_some() {
        return SourceStamp {
            name,
            ..SourceStamp::default()
        };
    }
    let metadata = std::fs::metadata(path).ok();
    let modified = metadata.as_ref().and_then(|m| m.modified().ok());
    let since_1970 = modified.and_then(|time| time.duration_since(UNIX_EPOCH).ok());
    SourceStamp {
        name,
        length_bytes: metadata.map_or(0, |m| m.len()),
        modified_s: since_1970.and_then(|time| i64::try_from(time.as_secs()).ok()),
    }
}

/// The name of what is made of `path` and ends in `ending`: beside the input, in the current folder for terrain
/// that is no file. `a/N42E001.hgt` gives `a/N42E001` and the ending; so does `a/N42E001.terrain.exr`.
pub(super) fn beside(path: &Path, ending: &str) -> PathBuf {
    let name = path
        .file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned();
    let stem = match name.strip_suffix(".terrain.exr") {
        Some(stem) => stem.to_string(),
        None if synth(path).is_some() => name.replace(':', "-"),
        None => Path::new(&name)
            .file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned(),
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
        let stamp = stamp(&path);
        assert_eq!(stamp.length_bytes, 77);
        assert!(stamp.modified_s.is_some_and(|s| s > 1_500_000_000));
        assert_eq!(super::stamp(Path::new("synth:64:2")).length_bytes, 0);
    }
}
