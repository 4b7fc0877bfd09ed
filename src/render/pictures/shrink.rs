//! Smaller pictures: each pixel is the mean, in linear light, of the area that it covers (a box filter).
//!
//! sRGB's transfer function is that of IEC 61966-2-1:1999: `v / 12.92` up to 0.04045, else
//! `((v + 0.055) / 1.055)^2.4`.

use std::sync::LazyLock;

/// The greatest size of the picture's own proportions within `most_width` x `most_height`, never larger than
/// itself and at least 1 x 1.
pub(super) fn fitted(width: u32, height: u32, most_width: u32, most_height: u32) -> (u32, u32) {
    let scale = (f64::from(most_width) / f64::from(width)).min(f64::from(most_height) / f64::from(height));
    let side = |n: u32| ((f64::from(n) * scale.min(1.0)).round() as u32).max(1);
    (side(width), side(height))
}

/// A frame of `width` x `height` RGBA pixels at `to_width` x `to_height`, neither larger than the frame's, as
/// RGB.
pub(super) fn shrunk(rgba8: &[u8], width: u32, height: u32, to_width: u32, to_height: u32) -> Vec<u8> {
    debug_assert!(0 < to_width && to_width <= width && 0 < to_height && to_height <= height);
    let (width, to_width) = (width as usize, to_width as usize);
    let (columns, rows) = (cover(width, to_width), cover(height as usize, to_height as usize));
    let mut rgb = Vec::with_capacity(to_width * to_height as usize * 3);
    // The last source row that was narrowed: one that straddles two rows of the result is needed twice.
    let mut narrowed = (usize::MAX, vec![[0.0_f32; 3]; to_width]);
    for row in &rows {
        let mut sums = vec![[0.0_f32; 3]; to_width];
        for &(y, weight) in row {
            if narrowed.0 != y {
                narrow(&rgba8[y * width * 4..][..width * 4], &columns, &mut narrowed.1);
                narrowed.0 = y;
            }
            for (sum, pixel) in sums.iter_mut().zip(&narrowed.1) {
                for c in 0..3 {
                    sum[c] += weight * pixel[c];
                }
            }
        }
        rgb.extend(sums.iter().flat_map(|sum| sum.map(encoded)));
    }
    rgb
}

/// One row of RGBA as fewer pixels of linear light.
fn narrow(row: &[u8], columns: &[Vec<(usize, f32)>], out: &mut [[f32; 3]]) {
    let linear = &LIGHT.linear;
    for (pixel, column) in out.iter_mut().zip(columns) {
        *pixel = [0.0; 3];
        for &(x, weight) in column {
            for c in 0..3 {
                pixel[c] += weight * linear[usize::from(row[4 * x + c])];
            }
        }
    }
}

/// For each of `to` equal parts of `from` samples: the samples that it covers and their shares of it.
fn cover(from: usize, to: usize) -> Vec<Vec<(usize, f32)>> {
    // In units of 1/to of a sample all borders are whole: part p covers [p from, (p + 1) from).
    (0..to)
        .map(|part| {
            let (start, end) = (part * from, (part + 1) * from);
            (start / to..end.div_ceil(to))
                .map(|i| {
                    let covered = ((i + 1) * to).min(end) - (i * to).max(start);
                    (i, covered as f32 / from as f32)
                })
                .collect()
        })
        .collect()
}

/// The two directions of sRGB's transfer function for 8 bits.
struct Light {
    /// Linear light of each code.
    linear: [f32; 256],
    /// Linear light half-way between a code and the next: above `limits[v]`, the code is above v.
    limits: [f32; 255],
}

static LIGHT: LazyLock<Light> = LazyLock::new(|| {
    let linear = |code: f64| {
        let v = code / 255.0;
        (if v <= 0.04045 {
            v / 12.92
        } else {
            ((v + 0.055) / 1.055).powf(2.4)
        }) as f32
    };
    Light {
        linear: std::array::from_fn(|v| linear(v as f64)),
        limits: std::array::from_fn(|v| linear(v as f64 + 0.5)),
    }
});

/// The 8-bit code nearest to linear light `light`.
fn encoded(light: f32) -> u8 {
    LIGHT.limits.partition_point(|&limit| limit < light) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(values: &[u8]) -> Vec<u8> {
        values.iter().flat_map(|&v| [v, v, v, 255]).collect()
    }

    #[test]
    fn every_code_comes_back_and_equal_pixels_stay_equal() {
        for v in 0..=255 {
            assert_eq!(encoded(LIGHT.linear[usize::from(v)]), v);
            assert_eq!(shrunk(&grey(&[v; 35]), 7, 5, 3, 2), [v; 18], "code {v}");
        }
    }

    #[test]
    fn black_and_white_mix_in_linear_light() {
        let mixed = shrunk(&grey(&[0, 255, 255, 0]), 2, 2, 1, 1);
        assert_eq!(mixed, [188; 3], "half the light of white is code 188");
        assert_ne!(mixed[0], 128, "control: the mean of the codes");
        // Two thirds of the first part are white: 2/3 of the light is code 213.
        assert_eq!(shrunk(&grey(&[255, 0, 0]), 3, 1, 2, 1), [213, 213, 213, 0, 0, 0]);
    }

    #[test]
    fn shares_are_whole_and_cover_each_sample_once() {
        for from in 1..60 {
            for to in 1..=from {
                let parts = cover(from, to);
                let mut covered = vec![0.0; from];
                for part in &parts {
                    let whole: f32 = part.iter().map(|p| p.1).sum();
                    assert!((whole - 1.0).abs() < 1e-6, "{from} to {to}");
                    for &(i, share) in part {
                        assert!(share > 0.0, "{from} to {to}");
                        covered[i] += share * from as f32 / to as f32;
                    }
                }
                assert!(
                    covered.iter().all(|c| (c - 1.0).abs() < 1e-5),
                    "{from} to {to}: {covered:?}"
                );
            }
        }
    }

    #[test]
    fn the_same_size_is_the_same_picture() {
        let rgba: Vec<u8> = (0..4 * 6 * 5).map(|v| (v * 37 % 256) as u8).collect();
        let rgb: Vec<u8> = rgba.chunks(4).flat_map(|p| p[..3].to_vec()).collect();
        assert_eq!(shrunk(&rgba, 6, 5, 6, 5), rgb);
    }

    #[test]
    fn proportions_are_kept_within_the_box() {
        assert_eq!(fitted(1280, 720, 480, 480), (480, 270));
        assert_eq!(fitted(720, 1280, 480, 480), (270, 480));
        assert_eq!(fitted(64, 64, 480, 480), (64, 64));
        assert_eq!(fitted(8192, 16, 320, 320), (320, 1));
        assert_eq!(fitted(1, 1, 320, 320), (1, 1));
    }
}
