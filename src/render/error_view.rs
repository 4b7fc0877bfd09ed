//! Errors as colours, laid over a frame of bare light.
//!
//! | error | colour |
//! |---|---|
//! | 0 px, or nothing beyond the floor | none: the grey of the light |
//! | 0.1 px | blue |
//! | 0.25 px | cyan |
//! | 0.5 px | green |
//! | 1 px | yellow |
//! | 2 px and more | red |
//! | drawn and true ground disagree about being there | magenta |
//!
//! Between these, colours run into each other. All but the last are darkened by the light, so that the ground stays
//! readable; the last is not, as it may lie in the sky.

use crate::accuracy::{FrameErrors, PixelError};

/// Colours by error in pixels: sRGB, 0 to 1.
const SCALE: [(f32, [f32; 3]); 5] = [
    (0.1, [0.20, 0.30, 1.00]),
    (0.25, [0.10, 0.85, 1.00]),
    (0.5, [0.20, 0.90, 0.25]),
    (1.0, [1.00, 0.90, 0.15]),
    (2.0, [1.00, 0.10, 0.10]),
];

/// Of a pixel where drawn and true ground disagree.
const SILHOUETTE: [u8; 3] = [255, 0, 255];

/// The least share of a colour that is left in the dark.
const DARKEST: f32 = 0.35;

/// Lays the colours of `errors` over the picture of their frame: red, green, blue, alpha of each pixel.
pub(super) fn colour_errors(errors: &FrameErrors, rgba8: &mut [u8]) {
    for (pixel, out) in errors.pixels.iter().zip(rgba8.chunks_exact_mut(4)) {
        if let Some(colour) = colour(pixel, out[0]) {
            out[..3].copy_from_slice(&colour);
        }
    }
}

/// The colour of a pixel in a grey light; none where it stays as it is.
fn colour(pixel: &PixelError, light: u8) -> Option<[u8; 3]> {
    if pixel.silhouette {
        return Some(SILHOUETTE);
    }
    if pixel.error_px.is_nan() || pixel.error_px == 0.0 {
        return None;
    }
    let grey = f32::from(light) / 255.0;
    let share = DARKEST + (1.0 - DARKEST) * grey;
    let coloured = (pixel.error_px / SCALE[0].0).min(1.0);
    Some(scale(pixel.error_px).map(|c| {
        let mixed = grey + (c * share - grey) * coloured;
        (mixed * 255.0).round() as u8
    }))
}

fn scale(error_px: f32) -> [f32; 3] {
    let above = SCALE.iter().position(|(at, _)| *at >= error_px);
    match above {
        None => SCALE[SCALE.len() - 1].1,
        Some(0) => SCALE[0].1,
        Some(k) => {
            let ((from, low), (to, high)) = (SCALE[k - 1], SCALE[k]);
            let share = (error_px - from) / (to - from);
            std::array::from_fn(|c| low[c] + (high[c] - low[c]) * share)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pixel(error_px: f32) -> PixelError {
        PixelError {
            error_px,
            ..PixelError::default()
        }
    }

    #[test]
    fn colours_are_those_of_the_table() {
        let bright = |error_px| colour(&pixel(error_px), 255);
        assert_eq!((bright(0.0), bright(f32::NAN)), (None, None));
        let near_grey = colour(&pixel(1e-3), 128).unwrap();
        assert!(near_grey.iter().all(|c| c.abs_diff(128) <= 2), "{near_grey:?}");
        assert_eq!(bright(0.1), Some([51, 77, 255]));
        assert_eq!(bright(0.25), Some([26, 217, 255]));
        assert_eq!(bright(1.0), Some([255, 230, 38]));
        assert_eq!(bright(2.0), bright(f32::MAX));
        assert_ne!(bright(1.5), bright(2.0));
        let dark = colour(&pixel(2.0), 0).unwrap();
        assert_eq!(dark, [89, 9, 9]);
        let silhouette = PixelError {
            silhouette: true,
            ..pixel(1.0)
        };
        assert_eq!(colour(&silhouette, 0), Some(SILHOUETTE));
    }
}
