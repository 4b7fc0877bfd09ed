//! The pictures that the program writes, and how far they differ.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// The golden frames' tolerance: mean difference of 255, and the share of pixels that may differ by more than `FAR`.
pub(crate) const MEAN_LIMIT: f64 = 0.25;
pub(crate) const FAR_SHARE_LIMIT: f64 = 0.005;
pub(crate) const FAR: u8 = 4;

pub(crate) fn pixels(path: &Path) -> (u32, u32, Vec<u8>) {
    let file = BufReader::new(File::open(path).expect("the picture is there"));
    let mut reader = png::Decoder::new(file).read_info().expect("a PNG");
    let mut rgb = vec![0; reader.output_buffer_size().expect("it fits")];
    let info = reader.next_frame(&mut rgb).expect("a picture");
    rgb.truncate(info.buffer_size());
    (info.width, info.height, rgb)
}

/// The mean difference, and the share of pixels that are far off.
pub(crate) fn difference(a: &Path, b: &Path) -> (f64, f64) {
    let ((w, h, a), (v, g, b)) = (pixels(a), pixels(b));
    assert_eq!((w, h), (v, g));
    let off: Vec<u8> = a.iter().zip(&b).map(|(a, b)| a.abs_diff(*b)).collect();
    let mean = off.iter().map(|&d| f64::from(d)).sum::<f64>() / off.len() as f64;
    let far = off.chunks(3).filter(|p| p.iter().any(|&d| d > FAR)).count();
    (mean, far as f64 / f64::from(w * h))
}
