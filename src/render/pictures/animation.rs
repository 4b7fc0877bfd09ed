//! An animated PNG of a flight, which any browser plays, written frame by frame.
//!
//! Frames are shrunk to at most 480 pixels a side. The format wants their number before the first of them.

use std::fs::File;
use std::path::Path;

use super::shrink::{fitted, shrunk};
use super::{check_frame, encoding_error};
use crate::build::Output;
use crate::error::{Error, ErrorKind, Result};

/// The greatest width and height of the animation, pixels.
const MOST_PX: u32 = 480;

/// An animation that is being written; without [`Animation::finish`] nothing is left of it.
pub struct Animation {
    // Before the output, so that the handle is closed when that is renamed or removed.
    writer: png::Writer<File>,
    output: Output,
    frame: (u32, u32),
    small: (u32, u32),
    frames_left: u32,
}

impl Animation {
    /// Begins an animation of `frame_count` frames of `width` x `height` pixels, shown at `fps` frames a second
    /// and repeated for ever.
    ///
    /// The time of a frame is exact for whole `fps`, else rounded to milliseconds.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] where there are no frames or pixels, or `fps` is not above 0 and finite;
    /// [`ErrorKind::Io`] where the file cannot be made.
    pub fn create(path: &Path, frame_count: u32, width: u32, height: u32, fps: f64) -> Result<Self> {
        let misuse = |what: String| Error::new(ErrorKind::Misuse, path.display(), what);
        if frame_count == 0 || width == 0 || height == 0 {
            return Err(misuse(format!(
                "{frame_count} frames of {width} x {height} pixels show nothing"
            )));
        }
        if !(fps.is_finite() && fps > 0.0) {
            return Err(misuse(format!(
                "{fps} frames a second are not above 0 and finite"
            )));
        }
        let (output, file) = Output::create(path, true)?;
        let small = fitted(width, height, MOST_PX, MOST_PX);
        let (numerator, denominator) = delay_s(fps);
        let mut encoder = png::Encoder::new(file, small.0, small.1);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        encoder.set_compression(png::Compression::Balanced);
        encoder.validate_sequence(true);
        let started = encoder.set_animated(frame_count, 0).and_then(|()| {
            encoder.set_frame_delay(numerator, denominator)?;
            encoder.write_header()
        });
        let writer = started.map_err(|e| encoding_error(path, e))?;
        Ok(Self {
            writer,
            output,
            frame: (width, height),
            small,
            frames_left: frame_count,
        })
    }

    /// Adds the next frame.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] where the frame has another size or is one too many, [`ErrorKind::Io`] where it
    /// cannot be written.
    pub fn add(&mut self, rgba8: &[u8]) -> Result<()> {
        let (width, height) = self.frame;
        check_frame(self.output.target(), width, height, rgba8)?;
        if self.frames_left == 0 {
            let what = "the animation has all the frames that were announced";
            return Err(Error::new(
                ErrorKind::Misuse,
                self.output.target().display(),
                what,
            ));
        }
        let small = shrunk(rgba8, width, height, self.small.0, self.small.1);
        self.writer
            .write_image_data(&small)
            .map_err(|e| encoding_error(self.output.target(), e))?;
        self.frames_left -= 1;
        Ok(())
    }

    /// Ends the animation and gives the file its name, replacing what had it.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] where frames are missing, [`ErrorKind::Io`] where it cannot be written; then the
    /// target is as it was.
    pub fn finish(self) -> Result<()> {
        let Self {
            writer,
            output,
            frames_left,
            ..
        } = self;
        if frames_left > 0 {
            let what = format!("the animation lacks {frames_left} of its frames");
            return Err(Error::new(ErrorKind::Misuse, output.target().display(), what));
        }
        writer.finish().map_err(|e| encoding_error(output.target(), e))?;
        output.publish_unsynced()
    }
}

/// Seconds that a frame is shown, as a fraction of 16-bit numbers.
fn delay_s(fps: f64) -> (u16, u16) {
    if fps.fract() == 0.0 && fps <= f64::from(u16::MAX) {
        (1, fps as u16)
    } else {
        (
            (1000.0 / fps).round().clamp(1.0, f64::from(u16::MAX)) as u16,
            1000,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_pictures::{frame, names};
    use super::*;

    fn written(path: &Path, count: u32, width: u32, height: u32, fps: f64) {
        let mut animation = Animation::create(path, count, width, height, fps).unwrap();
        for k in 0..count {
            animation.add(&frame(width, height, k)).unwrap();
        }
        animation.finish().unwrap();
    }

    #[test]
    fn every_frame_comes_back_with_its_time_and_the_loop_is_endless() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flight.png");
        written(&path, 5, 31, 17, 30.0);
        let bytes = std::fs::read(&path).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes))
            .read_info()
            .unwrap();
        let control = *reader.info().animation_control().unwrap();
        assert_eq!((control.num_frames, control.num_plays), (5, 0));
        let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
        for k in 0..5 {
            reader.next_frame(&mut rgb).unwrap();
            let shown = reader.info().frame_control().unwrap();
            assert_eq!((shown.delay_num, shown.delay_den), (1, 30));
            let want: Vec<u8> = frame(31, 17, k).chunks(4).flat_map(|p| p[..3].to_vec()).collect();
            assert_eq!(rgb, want, "frame {k}");
        }
        assert_eq!(names(folder.path()), ["flight.png"]);
    }

    #[test]
    fn large_frames_are_shrunk_and_the_same_frames_give_the_same_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let (a, b) = (folder.path().join("a.png"), folder.path().join("b.png"));
        written(&a, 2, 1280, 720, 29.97);
        written(&b, 2, 1280, 720, 29.97);
        let bytes = std::fs::read(&a).unwrap();
        assert!(bytes == std::fs::read(&b).unwrap());
        let reader = png::Decoder::new(std::io::Cursor::new(bytes))
            .read_info()
            .unwrap();
        assert_eq!(reader.info().size(), (480, 270));
    }

    #[test]
    fn what_is_not_finished_leaves_nothing_and_keeps_what_was_there() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flight.png");
        std::fs::write(&path, "before").unwrap();
        let mut animation = Animation::create(&path, 3, 4, 4, 30.0).unwrap();
        animation.add(&frame(4, 4, 0)).unwrap();
        assert_eq!(
            names(folder.path()).len(),
            2,
            "control: the temporary file stands beside it"
        );
        assert_eq!(animation.add(&[0; 3]).unwrap_err().kind(), ErrorKind::Misuse);
        let error = animation.finish().unwrap_err();
        assert!(error.to_string().contains("lacks 2"), "{error}");
        drop(Animation::create(&path, 3, 4, 4, 30.0).unwrap());
        assert_eq!(names(folder.path()), ["flight.png"]);
        assert_eq!(std::fs::read(&path).unwrap(), b"before");
    }

    #[test]
    fn a_frame_too_many_is_refused_and_the_rest_stays_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flight.png");
        let mut animation = Animation::create(&path, 1, 4, 4, 30.0).unwrap();
        animation.add(&frame(4, 4, 0)).unwrap();
        assert_eq!(
            animation.add(&frame(4, 4, 1)).unwrap_err().kind(),
            ErrorKind::Misuse
        );
        animation.finish().unwrap();
        assert_eq!(names(folder.path()), ["flight.png"]);
    }

    #[test]
    fn a_folder_that_is_none_gives_one_line_and_nothing_is_left() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("file"), "text").unwrap();
        for path in ["missing/a.png", "file/a.png"] {
            let Err(error) = Animation::create(&folder.path().join(path), 1, 4, 4, 30.0) else {
                panic!("{path} was made");
            };
            assert_eq!(error.kind(), ErrorKind::Io, "{error}");
            assert!(
                error.to_string().lines().count() == 1 && error.to_string().contains(path),
                "{error}"
            );
        }
        assert_eq!(names(folder.path()), ["file"]);
    }

    #[test]
    fn times_are_exact_for_whole_rates_and_always_in_range() {
        assert_eq!(delay_s(30.0), (1, 30));
        assert_eq!(delay_s(12.5), (80, 1000));
        assert_eq!(delay_s(1e-9), (u16::MAX, 1000));
        assert_eq!(delay_s(1e9), (1, 1000));
    }
}
