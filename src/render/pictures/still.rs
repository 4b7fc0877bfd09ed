//! One frame as a PNG: 8-bit RGB, marked as sRGB, packed fast rather than small.

use std::io::Write;
use std::path::Path;

use super::{check_frame, encoding_error};
use crate::build::Output;
use crate::error::{Error, Result};

/// Writes a frame of `width` x `height` RGBA pixels as a PNG, replacing what is there.
///
/// # Errors
/// [`crate::ErrorKind::Misuse`] where the frame has another size, [`crate::ErrorKind::Io`] where it cannot be
/// written; then the target is as it was.
pub fn write_png(path: &Path, width: u32, height: u32, rgba8: &[u8]) -> Result<()> {
    check_frame(path, width, height, rgba8)?;
    let rgb: Vec<u8> = rgba8
        .chunks_exact(4)
        .flat_map(|pixel| [pixel[0], pixel[1], pixel[2]])
        .collect();
    write_rgb(path, width, height, &rgb, png::Compression::Fast)
}

/// Writes `width` x `height` RGB pixels as a PNG.
pub(super) fn write_rgb(
    path: &Path,
    width: u32,
    height: u32,
    rgb: &[u8],
    compression: png::Compression,
) -> Result<()> {
    let (output, mut file) = Output::create(path, true)?;
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    encoder.set_compression(compression);
    let packed = encoder.write_header().and_then(|mut writer| {
        writer.write_image_data(rgb)?;
        writer.finish()
    });
    packed.map_err(|e| encoding_error(path, e))?;
    file.write_all(&bytes).map_err(|e| Error::io(path.display(), e))?;
    drop(file);
    output.publish_unsynced()
}

#[cfg(test)]
mod tests {
    use super::super::test_pictures::{frame, names, read};
    use super::*;
    use crate::ErrorKind;

    #[test]
    fn a_picture_comes_back_and_replaces_what_was_there() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a b.png");
        for (width, height, number) in [(1, 1, 0), (37, 23, 1), (640, 16, 2)] {
            let rgba = frame(width, height, number);
            write_png(&path, width, height, &rgba).unwrap();
            let rgb: Vec<u8> = rgba.chunks(4).flat_map(|p| p[..3].to_vec()).collect();
            assert_eq!(read(&path), (width, height, rgb));
        }
        assert_eq!(names(folder.path()), ["a b.png"]);
    }

    #[test]
    fn a_folder_that_is_none_gives_one_line_and_nothing_is_left() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("file"), "text").unwrap();
        for path in ["missing/a.png", "file/a.png"] {
            let error = write_png(&folder.path().join(path), 2, 2, &[0; 16]).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::Io, "{error}");
            assert!(
                error.to_string().lines().count() == 1 && error.to_string().contains(path),
                "{error}"
            );
        }
        assert_eq!(names(folder.path()), ["file"]);
        assert_eq!(std::fs::read(folder.path().join("file")).unwrap(), b"text");
    }

    #[test]
    fn a_frame_of_another_size_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        for (width, height, bytes) in [(2, 2, 15), (2, 2, 12), (0, 2, 0), (u32::MAX, u32::MAX, 16)] {
            let error = write_png(&path, width, height, &vec![0; bytes]).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::Misuse);
        }
        assert!(names(folder.path()).is_empty());
    }
}
