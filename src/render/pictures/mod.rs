//! Pictures on disk: a frame, a sheet of small frames, an animation. None is ever there half-written.
//!
//! Frames are RGBA, 8 bits a channel, sRGB encoded, row by row from the top; their alpha is ignored. A picture
//! that exists is replaced: whoever calls decides beforehand whether it may be.

mod animation;
mod contact_sheet;
mod shrink;
mod still;

pub use animation::Animation;
pub use contact_sheet::ContactSheet;
pub use still::write_png;

use std::path::Path;

use crate::error::{Error, ErrorKind, Result};

/// Refuses a frame that is not `width` x `height` pixels of 4 bytes.
fn check_frame(path: &Path, width: u32, height: u32, rgba8: &[u8]) -> Result<()> {
    let bytes = u128::from(width) * u128::from(height) * 4;
    if bytes == 0 || bytes != rgba8.len() as u128 {
        let found = rgba8.len();
        let what = format!("a frame of {found} bytes is not a picture of {width} x {height} pixels");
        return Err(Error::new(ErrorKind::Misuse, path.display(), what));
    }
    Ok(())
}

/// What the PNG library says, as an error about `path`.
fn encoding_error(path: &Path, error: png::EncodingError) -> Error {
    match error {
        png::EncodingError::IoError(error) => Error::io(path.display(), error),
        png::EncodingError::LimitsExceeded => Error::new(
            ErrorKind::Limit,
            path.display(),
            "the picture is too large for a PNG",
        ),
        error => Error::new(
            ErrorKind::Misuse,
            path.display(),
            format!("cannot be a PNG: {error}"),
        ),
    }
}

#[cfg(test)]
mod test_pictures {
    //! Frames with known contents, and what is in a PNG, for the tests of this folder.

    use std::path::Path;

    /// A frame in which every pixel says where it is and in which frame.
    pub(super) fn frame(width: u32, height: u32, number: u32) -> Vec<u8> {
        (0..width * height)
            .flat_map(|p| [p % width * 7, p / width * 5, number * 31, 9].map(|v| v as u8))
            .collect()
    }

    /// The first image of a PNG: width, height and its RGB.
    pub(super) fn read(path: &Path) -> (u32, u32, Vec<u8>) {
        let mut reader = png::Decoder::new(std::io::Cursor::new(std::fs::read(path).unwrap()))
            .read_info()
            .unwrap();
        let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut rgb).unwrap();
        assert_eq!(
            (info.color_type, info.bit_depth),
            (png::ColorType::Rgb, png::BitDepth::Eight)
        );
        assert!(reader.info().srgb.is_some());
        rgb.truncate(info.buffer_size());
        (info.width, info.height, rgb)
    }

    /// The names in a folder.
    pub(super) fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> = std::fs::read_dir(folder)
            .unwrap()
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }
}
