//! Opens a file as a DEM: tells its format by its first bytes, or by the name's ending where a format has none.

use std::path::Path;
use std::sync::Arc;

use super::{
    HeightSource, OpenOptions, ReadAt, ascii_grid, crop, dted, ehdr, envi, hgt, openexr, raw, usgs_dem,
};
use crate::error::{Error, ErrorKind, Result};

/// The formats by what messages call them, and the endings that promise them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    GeoTiff,
    Png,
    OpenExr,
    Srtm,
    Dted,
    UsgsDem,
    AsciiGrid,
}

/// Bytes from which a format is told.
const HEAD_BYTES: usize = 2048;

/// The most bytes of a text header beside a file.
const HEADER_BYTES: u64 = 1 << 16;

pub(super) const READ_HERE: &str = "give a GeoTIFF, a grey PNG, OpenEXR, SRTM .hgt, DTED, USGS .dem, ESRI .asc, .bil or .flt, ENVI, or --raw";

/// A file that is to be read as a DEM.
pub(super) struct Input<'a> {
    /// The name by which messages speak of it.
    pub(super) name: &'a str,
    /// Its own name, which may tell its format and place: that of the file within an archive.
    pub(super) file_name: &'a str,
    pub(super) bytes: Arc<dyn ReadAt>,
    pub(super) options: &'a OpenOptions,
    /// The file beside it of the same name but for this ending, if there is one.
    pub(super) beside: &'a Beside<'a>,
}

/// Finds a file beside another by its ending.
pub(super) type Beside<'a> = dyn Fn(&str) -> Result<Option<Arc<dyn ReadAt>>> + 'a;

impl Input<'_> {
    /// The ending of its own name in small letters; empty where it has none.
    pub(super) fn ending(&self) -> String {
        ending(self.file_name)
    }
}

#[cfg(test)]
impl<'a> Input<'a> {
    /// A file in memory with nothing beside it.
    pub(super) fn bare(name: &'a str, bytes: Vec<u8>, options: &'a OpenOptions) -> Self {
        Self {
            name,
            file_name: name,
            bytes: Arc::new(bytes),
            options,
            beside: &|_| Ok(None),
        }
    }
}

pub(super) fn ending(name: &str) -> String {
    let ending = Path::new(name).extension();
    ending
        .map(|e| e.to_string_lossy().to_ascii_lowercase())
        .unwrap_or_default()
}

/// Opens the DEM in `bytes`, which messages call `name`. The name's ending decides where the bytes do not, and
/// an SRTM tile's name is its place. Nothing lies beside it.
///
/// # Errors
/// As [`super::open_with`].
pub fn open_bytes(
    name: &str,
    bytes: Arc<dyn ReadAt>,
    options: &OpenOptions,
) -> Result<Box<dyn HeightSource>> {
    let whole = open_input(&Input {
        name,
        file_name: name,
        bytes,
        options,
        beside: &|_| Ok(None),
    })?;
    crop::apply(whole, options)
}

/// Opens a file, unpacked if it is packed.
pub(super) fn open_input(input: &Input) -> Result<Box<dyn HeightSource>> {
    let head = head(input)?;
    // A tile without a header may begin with anything, another format's first bytes included.
    let headless = input.ending() == "hgt" || (input.options.raw.is_some() && raw::is_raw(&input.ending()));
    if headless {
        return open_plain(input, &head);
    }
    unpack(input, &head)
}

#[cfg(feature = "dem")]
fn unpack(input: &Input, head: &[u8]) -> Result<Box<dyn HeightSource>> {
    use super::archive::{self, Packing, Zip};
    use super::paths::promises_dem;
    let name = input.name;
    let inside = |file_name: &str, bytes: Arc<dyn ReadAt>, beside: &Beside| {
        let inner = Input {
            name,
            file_name,
            bytes,
            options: input.options,
            beside,
        };
        // A tile of SRTM is told by its name: looking at its first bytes would unpack it before it is read.
        if inner.ending() == "hgt" {
            return open_plain(&inner, &[]);
        }
        let head = self::head(&inner)?;
        if Packing::of(&head).is_some() {
            let what = "holds another archive";
            return Err(Error::new(ErrorKind::Unsupported, name, what).advice("unpack it first"));
        }
        open_plain(&inner, &head)
    };
    match Packing::of(head) {
        None => open_plain(input, head),
        Some(Packing::Gzip) => {
            let unpacked = archive::gunzip(name, input.bytes.clone())?;
            let file_name = input.file_name.strip_suffix(".gz").unwrap_or(input.file_name);
            inside(file_name, unpacked, input.beside)
        }
        Some(Packing::Zip) => {
            let zip = Zip::open(name, input.bytes.clone())?;
            let with_header = |file: &Path| {
                let header = file.with_extension("hdr");
                zip.names()
                    .any(|n| Path::new(n) != file && n.eq_ignore_ascii_case(&header.to_string_lossy()))
            };
            let dems: Vec<&str> = zip
                .names()
                .filter(|n| !n.starts_with("__MACOSX/") && ending(n) != "zip")
                .filter(|n| {
                    promises_dem(Path::new(n), &with_header)
                        || (input.options.raw.is_some() && raw::is_raw(&ending(n)))
                })
                .collect();
            let [file_name] = dems[..] else {
                let what = match dems[..] {
                    [] => "is a ZIP archive without any DEM".to_string(),
                    [a, b, ..] => format!("is a ZIP archive of {} DEMs, {a} and {b} among them", dems.len()),
                    [_] => unreachable!("one is opened"),
                };
                return Err(Error::new(ErrorKind::Unsupported, name, what).advice("unpack it first"));
            };
            let bytes = zip
                .file(file_name)?
                .ok_or_else(|| Error::new(ErrorKind::Broken, name, "is damaged"))?;
            let beside =
                |wanted: &str| zip.file(&Path::new(file_name).with_extension(wanted).to_string_lossy());
            inside(file_name, bytes, &beside)
        }
    }
}

#[cfg(not(feature = "dem"))]
fn unpack(input: &Input, head: &[u8]) -> Result<Box<dyn HeightSource>> {
    match head {
        [b'P', b'K', 3 | 5, 4 | 6, ..] => Err(left_out(input.name, "ZIP archive")),
        [0x1f, 0x8b, ..] => Err(left_out(input.name, "gzip file")),
        _ => open_plain(input, head),
    }
}

/// The first bytes of a file that is not empty.
fn head(input: &Input) -> Result<Vec<u8>> {
    let Input { name, bytes, .. } = input;
    if bytes.size_bytes() == 0 {
        return Err(Error::new(ErrorKind::Broken, name, "is empty").advice("fetch the file again"));
    }
    let mut head = vec![0; HEAD_BYTES.min(usize::try_from(bytes.size_bytes()).unwrap_or(HEAD_BYTES))];
    bytes
        .read_exact_at(0, &mut head)
        .map_err(|error| Error::io(name, error))?;
    Ok(head)
}

/// Opens a file that is not packed.
fn open_plain(input: &Input, head: &[u8]) -> Result<Box<dyn HeightSource>> {
    if let Some(layout) = input.options.raw {
        return Ok(Box::new(raw::open(input, layout)?));
    }
    Ok(match told(input, head) {
        Some(Format::GeoTiff) => geotiff(input)?,
        Some(Format::Png) => png(input)?,
        Some(Format::OpenExr) => Box::new(openexr::open(input)?),
        Some(Format::Srtm) => Box::new(hgt::open(input)?),
        Some(Format::Dted) => Box::new(dted::open(input)?),
        Some(Format::UsgsDem) => Box::new(usgs_dem::open(input)?),
        Some(Format::AsciiGrid) => Box::new(ascii_grid::open(input)?),
        None => return beside_header(input, head),
    })
}

/// Opens a file whose header stands beside it.
fn beside_header(input: &Input, head: &[u8]) -> Result<Box<dyn HeightSource>> {
    let ending = input.ending();
    if ending == "hdr" {
        let what = "is the header of a DEM, not the DEM";
        return Err(
            Error::new(ErrorKind::Misuse, input.name, what).advice("name the file of samples beside it")
        );
    }
    if let Some(text) = header_text(input)? {
        if envi::is_header(&text) {
            return Ok(Box::new(envi::open(input, &text)?));
        }
        if ehdr::is_header(&text) {
            return Ok(Box::new(ehdr::open(input, &text)?));
        }
        let what = "has a .hdr beside it that is no header of ESRI's or ENVI's";
        return Err(Error::new(ErrorKind::Unsupported, input.name, what)
            .advice("give size and type with --raw, as in --raw 1024x1024:int16"));
    }
    if raw::is_raw(&ending) {
        return Err(raw::untold(input.name, &ending));
    }
    if ["bil", "bip", "bsq", "flt"].contains(&ending.as_str()) {
        let what = "has no header .hdr beside it";
        return Err(Error::new(ErrorKind::Broken, input.name, what)
            .advice("fetch it too, or give size and type with --raw"));
    }
    Err(unknown(input.name, &ending, head))
}

/// The text of the `.hdr` file beside the input, if there is one.
fn header_text(input: &Input) -> Result<Option<String>> {
    let Some(bytes) = (input.beside)("hdr")? else {
        return Ok(None);
    };
    let mut text = vec![0; bytes.size_bytes().min(HEADER_BYTES) as usize];
    bytes
        .read_exact_at(0, &mut text)
        .map_err(|error| Error::io(input.name, error))?;
    // Descriptions may be in any alphabet; what counts is ASCII.
    Ok(Some(String::from_utf8_lossy(&text).into_owned()))
}

#[cfg(feature = "dem")]
fn geotiff(input: &Input) -> Result<Box<dyn HeightSource>> {
    Ok(Box::new(super::geotiff::open(
        input.name,
        input.bytes.clone(),
        input.options,
    )?))
}

#[cfg(feature = "dem")]
fn png(input: &Input) -> Result<Box<dyn HeightSource>> {
    Ok(Box::new(super::png::open(input)?))
}

#[cfg(not(feature = "dem"))]
fn geotiff(input: &Input) -> Result<Box<dyn HeightSource>> {
    Err(left_out(input.name, "GeoTIFF"))
}

#[cfg(not(feature = "dem"))]
fn png(input: &Input) -> Result<Box<dyn HeightSource>> {
    Err(left_out(input.name, "PNG"))
}

#[cfg(not(feature = "dem"))]
fn left_out(name: &str, format: &str) -> Error {
    let what = format!("is a {format}, which this build does not read");
    Error::new(ErrorKind::Unsupported, name, what).advice("build with the feature `dem`")
}

/// The format of a file that begins with `head`, if it can be told without a header beside it.
fn told(input: &Input, head: &[u8]) -> Option<Format> {
    let ending = input.ending();
    if ending == "hgt" {
        return Some(Format::Srtm);
    }
    let begins = |magic: &[u8]| head.starts_with(magic);
    match ending.as_str() {
        _ if begins(b"II*\0") || begins(b"MM\0*") || begins(b"II+\0") || begins(b"MM\0+") => {
            Some(Format::GeoTiff)
        }
        _ if begins(b"\x89PNG\r\n\x1a\n") => Some(Format::Png),
        _ if begins(b"\x76\x2f\x31\x01") => Some(Format::OpenExr),
        // ESRI's headers begin as its ASCII grids do.
        "hdr" => None,
        "dt0" | "dt1" | "dt2" => Some(Format::Dted),
        "dem" => Some(Format::UsgsDem),
        "asc" | "agr" => Some(Format::AsciiGrid),
        _ if dted::is_dted(head) => Some(Format::Dted),
        _ if usgs_dem::is_usgs_dem(head) => Some(Format::UsgsDem),
        _ if ascii_grid::is_ascii_grid(head) => Some(Format::AsciiGrid),
        _ => None,
    }
}

/// What is wrong with a file of no known format.
fn unknown(name: &str, ending: &str, head: &[u8]) -> Error {
    let promised = match ending {
        "tif" | "tiff" => "TIFF",
        "png" => "PNG",
        "exr" => "OpenEXR file",
        "zip" => "ZIP archive",
        "gz" => "gzip file",
        _ => {
            return Error::new(ErrorKind::Unsupported, name, "is no DEM of a known format").advice(READ_HERE);
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
        let options = OpenOptions::default();
        let told = |name: &str, head: &[u8]| told(&Input::bare(name, Vec::new(), &options), head).unwrap();
        assert_eq!(told("a.png", b"II*\0...."), Format::GeoTiff);
        assert_eq!(told("a", b"MM\0+...."), Format::GeoTiff);
        assert_eq!(told("a.tif", b"\x89PNG\r\n\x1a\n"), Format::Png);
        assert_eq!(told("a.dat", b"\x76\x2f\x31\x01"), Format::OpenExr);
        assert_eq!(told("a.txt", b"ncols 4"), Format::AsciiGrid);
        assert_eq!(told("a.ASC", b"4 5 6"), Format::AsciiGrid);
        assert_eq!(told("N00E000.HGT", b"II*\0...."), Format::Srtm);
        assert_eq!(told("a.DT1", b"...."), Format::Dted);
        assert_eq!(told("a", b"UHL1"), Format::Dted);
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
                "a.md",
                b"USGS",
                ErrorKind::Unsupported,
                "no DEM of a known format; give a GeoTIFF",
            ),
            ("a.dem", b"USGS", ErrorKind::Broken, "ends within its header"),
            (
                "a.zip",
                b"hello",
                ErrorKind::Broken,
                "is no ZIP archive: it begins with \"hello\"",
            ),
            ("a.bil", b"1234", ErrorKind::Broken, "no header .hdr beside it"),
            ("a.hdr", b"ncols 1", ErrorKind::Misuse, "header of a DEM"),
            (
                "a.r16",
                b"1234",
                ErrorKind::Misuse,
                "as in --raw 1024x1024:uint16",
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
