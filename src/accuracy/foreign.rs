//! Frames that another program drew of the same DEM, measured by the same ruler.
//!
//! *Distances* are an OpenEXR picture with a channel `Z` or `depth` (float, half or whole numbers; of other channels none
//! is looked at): metres along the view axis, not along the pixel's ray, from the eye to what is drawn at the pixel's
//! centre; 0, NaN or infinity where no terrain is drawn. Rows run from the top.
//!
//! *The camera* is JSON, in the DEM's world metres (x east, y up, z south of the north-western sample) and in degrees:
//!
//! ```json
//! {"eye": [40000, 3200, 75000], "heading": 330, "pitch": -12, "roll": 0, "fov": 60}
//! ```
//!
//! `roll` (0) may be left out; `fov` is the vertical field of view, and pixels are square.

use std::sync::Arc;

use serde::Deserialize;

use super::{DepthImage, FrameErrors, measure};
use crate::camera::{Camera, View, check_picture};
use crate::error::{Error, ErrorKind, Result};
use crate::query::Truth;
use crate::source::{ReadAt, Wanted, read_channel};
use crate::work::Work;

const CHANNEL: Wanted = Wanted {
    names: &["Z", "depth"],
    only: false,
    what: "distances",
    advice: "name it Z or depth: metres along the view axis, 0 or infinity where no terrain is",
};

/// Distances of a drawn frame: metres along the view axis, row by row from the upper left, 0 where no terrain is.
#[derive(Clone, Debug, PartialEq)]
pub struct Distances {
    size_px: [u32; 2],
    metres: Vec<f64>,
}

impl Distances {
    /// Reads the picture `name`.
    ///
    /// # Errors
    /// [`ErrorKind::Broken`], [`ErrorKind::Unsupported`] or [`ErrorKind::Limit`] where it cannot be read, has no channel of
    /// distances, has more pixels a side than a picture may, or holds a negative distance.
    pub fn open(name: &str, bytes: Arc<dyn ReadAt>) -> Result<Self> {
        let (size, mut metres) = read_channel(name, bytes, &CHANNEL)?;
        let side = |n: i64| u32::try_from(n).unwrap_or(u32::MAX);
        let size_px = [side(size.width), side(size.height)];
        check_picture(size_px).map_err(|e| e.about(name))?;
        for (k, metres) in metres.iter_mut().enumerate() {
            if *metres < 0.0 {
                let (x, y) = (k as i64 % size.width, k as i64 / size.width);
                let what = format!("has a distance of {metres} m at column {x}, row {y}");
                return Err(Error::new(ErrorKind::Broken, name, what)
                    .advice("give metres along the view axis, all of them 0 or more"));
            }
            if metres.is_nan() {
                *metres = 0.0;
            }
        }
        Ok(Self { size_px, metres })
    }

    /// Width and height in pixels.
    pub fn size_px(&self) -> [u32; 2] {
        self.size_px
    }

    /// The errors of the frame that `camera` took.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] for a camera that cannot be; those of reading the DEM.
    pub fn measure(&self, truth: &Truth<'_>, camera: &Camera, work: &dyn Work) -> Result<FrameErrors> {
        let view = View::new(*camera, self.size_px)?;
        let near_m = crate::clipmap::near_m(truth.grid());
        let depth = |&metres: &f64| {
            if metres > 0.0 {
                (near_m / metres) as f32
            } else {
                0.0
            }
        };
        let depths: Vec<f32> = self.metres.iter().map(depth).collect();
        measure(truth, &DepthImage::new(&depths, &view)?, work)
    }
}

/// A camera as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    eye: [f64; 3],
    heading: f64,
    pitch: f64,
    #[serde(default)]
    roll: f64,
    fov: f64,
}

/// Reads a camera from JSON; `name` is how messages speak of it.
///
/// # Errors
/// [`ErrorKind::Broken`] where it is not one, or shows nothing.
pub fn parse_camera(name: &str, json: &str) -> Result<Camera> {
    let broken = |what: String| {
        Error::new(ErrorKind::Broken, name, what)
            .advice(r#"give {"eye": [x, y, z], "heading": 0, "pitch": 0, "roll": 0, "fov": 60}"#)
    };
    let written: Written = serde_json::from_str(json).map_err(|e| broken(format!("is no camera: {e}")))?;
    let camera = Camera {
        eye: written.eye.into(),
        heading_deg: written.heading,
        pitch_deg: written.pitch,
        roll_deg: written.roll,
        fov_deg: written.fov,
    };
    camera.check().map_err(|e| broken(e.to_string()))?;
    Ok(camera)
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::prelude::*;

    fn picture(channel: &str, values: Vec<f32>, width: usize) -> Arc<Vec<u8>> {
        let size = (width, values.len() / width);
        let other = AnyChannel::new("R", FlatSamples::F32(vec![7.0; values.len()]));
        let wanted = AnyChannel::new(channel, FlatSamples::F32(values));
        let layer = Layer::new(
            size,
            LayerAttributes::named("main"),
            Encoding::SMALL_LOSSLESS,
            AnyChannels::sort([other, wanted].into_iter().collect()),
        );
        let mut out = std::io::Cursor::new(Vec::new());
        Image::from_layer(layer)
            .write()
            .non_parallel()
            .to_buffered(&mut out)
            .unwrap();
        Arc::new(out.into_inner())
    }

    #[test]
    fn distances_are_those_of_their_channel() {
        let inf = f32::INFINITY;
        for channel in ["Z", "depth"] {
            let bytes = picture(channel, vec![1.5, 0.0, inf, f32::NAN, 2e6, 3.0], 3);
            let distances = Distances::open("d.exr", bytes).unwrap();
            assert_eq!(distances.size_px(), [3, 2]);
            assert_eq!(distances.metres, [1.5, 0.0, 0.0, 0.0, 2e6, 3.0]);
        }
    }

    #[test]
    fn what_are_no_distances_is_refused() {
        let error = |bytes: Arc<Vec<u8>>| Distances::open("d.exr", bytes).unwrap_err();
        let lone = error(picture("Y", vec![1.0; 6], 3));
        assert_eq!(lone.kind(), ErrorKind::Unsupported);
        assert!(
            lone.to_string()
                .contains("has no channel of distances among R, Y; name it Z or depth"),
            "{lone}"
        );
        let negative = error(picture("Z", vec![1.0, 1.0, 1.0, 1.0, -4.0, 1.0], 3));
        assert_eq!(negative.kind(), ErrorKind::Broken);
        assert!(
            negative.to_string().contains("-4 m at column 1, row 1"),
            "{negative}"
        );
        assert_eq!(error(picture("Z", vec![1.0; 8193], 8193)).subject(), "d.exr");
        assert_eq!(error(Arc::new(b"no picture".to_vec())).subject(), "d.exr");
    }

    #[test]
    fn a_camera_is_what_is_written() {
        let camera = parse_camera(
            "c.json",
            r#"{"eye": [1, -2, 3e3], "heading": -10, "pitch": 5, "fov": 45.5}"#,
        )
        .unwrap();
        assert_eq!(
            (camera.eye.to_array(), camera.roll_deg, camera.fov_deg),
            ([1.0, -2.0, 3000.0], 0.0, 45.5)
        );
        for bad in [
            "",
            "[]",
            r#"{"eye": [1, 2], "heading": 0, "pitch": 0, "fov": 60}"#,
            r#"{"eye": [1, 2, 3], "heading": 0, "pitch": 0}"#,
            r#"{"eye": [1, 2, 3], "heading": 0, "pitch": 0, "fov": 180}"#,
            r#"{"eye": [1, 2, 3], "heading": 0, "pitch": 91, "fov": 60}"#,
            r#"{"eye": [1, 2, 3], "heading": 0, "pitch": 0, "fov": 60, "zoom": 2}"#,
            r#"{"eye": [1e40, 2, 3], "heading": 0, "pitch": 0, "fov": 60}"#,
        ] {
            let error = parse_camera("c.json", bad).unwrap_err();
            assert_eq!(
                (error.kind(), error.subject()),
                (ErrorKind::Broken, "c.json"),
                "{bad}"
            );
        }
    }
}
