//! Opens a DEM: tells its format by its first bytes, or by the name's ending where a format has none.

use std::fs::{self, File};
use std::path::Path;
use std::sync::Arc;

use super::file::OpenFile;
use super::{HeightSource, OpenOptions, ReadAt, ascii_grid, hgt, openexr};
use crate::error::{Error, ErrorKind, Result};

/// The formats by what messages call them, and the endings that promise them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    GeoTiff,
    Png,
    OpenExr,
    Srtm,
    AsciiGrid,
}

/// Bytes from which a format is told.
const HEAD_BYTES: usize = 512;

const READ_HERE: &str = "give a GeoTIFF, a grey PNG, OpenEXR, SRTM .hgt or ESRI ASCII .asc";

/// Opens the DEM at `path`; messages speak of it by the path as given.
///
/// # Errors
/// One clear line where the file is missing, no plain file, empty, damaged, or of a kind that is not read.
pub fn open(path: &Path) -> Result<Box<dyn HeightSource>> {
    open_bytes(
        &path.display().to_string(),
        open_file(path)?,
        &OpenOptions::default(),
    )
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

/// Opens the DEM in `bytes`, which messages call `name`. The name's ending decides where the bytes do not, and
/// an SRTM tile's name is its place.
///
/// # Errors
/// As [`open`].
pub fn open_bytes(
    name: &str,
    bytes: Arc<dyn ReadAt>,
    options: &OpenOptions,
) -> Result<Box<dyn HeightSource>> {
    if bytes.size_bytes() == 0 {
        return Err(Error::new(ErrorKind::Broken, name, "is empty").advice("fetch the file again"));
    }
    let mut head = vec![0; HEAD_BYTES.min(usize::try_from(bytes.size_bytes()).unwrap_or(HEAD_BYTES))];
    bytes
        .read_exact_at(0, &mut head)
        .map_err(|error| Error::io(name, error))?;
    Ok(match format(name, &head)? {
        Format::GeoTiff => geotiff(name, bytes, options)?,
        Format::Png => png(name, bytes)?,
        Format::OpenExr => Box::new(openexr::open(name, bytes)?),
        Format::Srtm => Box::new(hgt::open(name, bytes.as_ref())?),
        Format::AsciiGrid => Box::new(ascii_grid::open(name, bytes)?),
    })
}

#[cfg(feature = "dem")]
fn geotiff(name: &str, bytes: Arc<dyn ReadAt>, options: &OpenOptions) -> Result<Box<dyn HeightSource>> {
    Ok(Box::new(super::geotiff::open(name, bytes, options)?))
}

#[cfg(feature = "dem")]
fn png(name: &str, bytes: Arc<dyn ReadAt>) -> Result<Box<dyn HeightSource>> {
    Ok(Box::new(super::png::open(name, bytes)?))
}

#[cfg(not(feature = "dem"))]
fn geotiff(name: &str, _: Arc<dyn ReadAt>, _: &OpenOptions) -> Result<Box<dyn HeightSource>> {
    Err(left_out(name, "GeoTIFF"))
}

#[cfg(not(feature = "dem"))]
fn png(name: &str, _: Arc<dyn ReadAt>) -> Result<Box<dyn HeightSource>> {
    Err(left_out(name, "PNG"))
}

#[cfg(not(feature = "dem"))]
fn left_out(name: &str, format: &str) -> Error {
    let what = format!("is a {format}, which this build does not read");
    Error::new(ErrorKind::Unsupported, name, what).advice("build with the feature `dem`")
}

/// The format of a file that is called `name` and begins with `head`.
fn format(name: &str, head: &[u8]) -> Result<Format> {
    let ending = Path::new(name)
        .extension()
        .map(|e| e.to_string_lossy().to_ascii_lowercase());
    let ending = ending.as_deref().unwrap_or("");
    // A tile without a header may begin with anything, another format's first bytes included.
    if ending == "hgt" {
        return Ok(Format::Srtm);
    }
    let begins = |magic: &[u8]| head.starts_with(magic);
    let told = match () {
        () if begins(b"II*\0") || begins(b"MM\0*") || begins(b"II+\0") || begins(b"MM\0+") => Format::GeoTiff,
        () if begins(b"\x89PNG\r\n\x1a\n") => Format::Png,
        () if begins(b"\x76\x2f\x31\x01") => Format::OpenExr,
        () if ascii_grid::is_ascii_grid(head) || matches!(ending, "asc" | "agr") => Format::AsciiGrid,
        () => return Err(unknown(name, ending, head)),
    };
    Ok(told)
}

/// What is wrong with a file of no known format.
fn unknown(name: &str, ending: &str, head: &[u8]) -> Error {
    let promised = match ending {
        "tif" | "tiff" => "TIFF",
        "png" => "PNG",
        "exr" => "OpenEXR file",
        _ => {
            let what = match head {
                [b'P', b'K', 3, 4, ..] => "is a ZIP archive",
                [0x1f, 0x8b, ..] => "is compressed with gzip",
                _ => {
                    return Error::new(ErrorKind::Unsupported, name, "is no DEM of a known format")
                        .advice(READ_HERE);
                }
            };
            return Error::new(ErrorKind::Unsupported, name, what).advice("unpack it first");
        }
    };
    let shown = &head[..head.len().min(8)];
    let what = format!("is no {promised}: it begins with \"{}\"", shown.escape_ascii());
    Error::new(ErrorKind::Broken, name, what).advice("check that the file is what its name says")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn failure(name: &str, bytes: &[u8]) -> Error {
        match open_bytes(name, Arc::new(bytes.to_vec()), &OpenOptions::default()) {
            Ok(_) => panic!("{name} was opened"),
            Err(error) => error,
        }
    }

    #[test]
    fn first_bytes_decide_and_endings_only_where_there_are_none() {
        let told = |name: &str, head: &[u8]| format(name, head).unwrap();
        assert_eq!(told("a.png", b"II*\0...."), Format::GeoTiff);
        assert_eq!(told("a", b"MM\0+...."), Format::GeoTiff);
        assert_eq!(told("a.tif", b"\x89PNG\r\n\x1a\n"), Format::Png);
        assert_eq!(told("a.dat", b"\x76\x2f\x31\x01"), Format::OpenExr);
        assert_eq!(told("a.txt", b"ncols 4"), Format::AsciiGrid);
        assert_eq!(told("a.ASC", b"4 5 6"), Format::AsciiGrid);
        assert_eq!(told("N00E000.HGT", b"II*\0...."), Format::Srtm);
    }

    #[test]
    fn what_is_no_dem_gets_one_line() {
        for (name, bytes, kind, part) in [
            ("a.tif", &b""[..], ErrorKind::Broken, "a.tif: is empty"),
            (
                "a.tif",
                b"hello world",
                ErrorKind::Broken,
                "a.tif: is no TIFF: it begins with \"hello wo\"",
            ),
            ("a.png", b"GIF89a", ErrorKind::Broken, "is no PNG"),
            (
                "a.exr",
                b"\n\x1b[0m",
                ErrorKind::Broken,
                "is no OpenEXR file: it begins with \"\\n\\x1b[0m\"",
            ),
            (
                "a.dem",
                b"USGS",
                ErrorKind::Unsupported,
                "no DEM of a known format; give a GeoTIFF",
            ),
            (
                "a.hgt.zip",
                b"PK\x03\x04",
                ErrorKind::Unsupported,
                "ZIP archive; unpack",
            ),
            (
                "N42E001.hgt",
                b"short",
                ErrorKind::Broken,
                "5 bytes are no SRTM tile",
            ),
            ("a.exr", b"\x76\x2f\x31\x01", ErrorKind::Broken, "a.exr: "),
        ] {
            let error = failure(name, bytes);
            assert_eq!(error.kind(), kind, "{error}");
            let line = error.to_string();
            assert!(
                line.contains(part) && line.starts_with(name) && !line.contains('\n'),
                "{line}"
            );
        }
    }

    #[test]
    fn paths_are_named_as_given() {
        let folder = tempfile::tempdir().unwrap();
        let check = |path: &Path, kind: ErrorKind, part: &str| {
            let error = open(path).err().expect("nothing readable is there");
            assert_eq!(error.kind(), kind, "{error}");
            assert_eq!(error.subject(), path.display().to_string());
            assert!(error.to_string().contains(part), "{error}");
        };
        check(folder.path(), ErrorKind::Misuse, "is a folder");
        check(&folder.path().join("none.tif"), ErrorKind::Io, "no such file");
        let empty = folder.path().join("empty.tif");
        fs::write(&empty, "").unwrap();
        check(&empty, ErrorKind::Broken, "is empty");
        let grid = folder.path().join("grid.asc");
        fs::write(&grid, "ncols 1\nnrows 1\ncellsize 2\n7\n").unwrap();
        let source = open(&grid).unwrap();
        assert_eq!(source.description().name, grid.display().to_string());
    }

    #[cfg(not(feature = "dem"))]
    #[test]
    fn a_build_without_dem_says_so() {
        for (name, head) in [
            ("a.tif", &b"II*\0\x08\0\0\0"[..]),
            ("a.png", b"\x89PNG\r\n\x1a\n"),
        ] {
            let error = failure(name, head);
            assert_eq!(error.kind(), ErrorKind::Unsupported);
            assert!(error.to_string().contains("feature `dem`"), "{error}");
        }
    }
}
