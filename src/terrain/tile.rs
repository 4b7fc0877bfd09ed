//! The bytes of one tile: samples laid out as OpenEXR wants them, and their check.
//!
//! A decoded tile is row by row, in each row channel by channel. Samples are in the machine's own byte order,
//! as the exr crate has them; files and checks are little-endian.

use half::f16;

use bytemuck::{Pod, bytes_of, pod_read_unaligned};

use crate::grid::Rect;

/// For each channel of a bounds part (alphabetical) the field of [`crate::levels::Bounds`] it holds.
pub(crate) const BOUNDS_FIELDS: [usize; 6] = [2, 1, 0, 5, 4, 3];
/// For each channel of a light part the field of [`crate::levels::LightSample`] it holds.
pub(crate) const LIGHT_FIELDS: [usize; 2] = [1, 0];

/// For each channel of a day part the field of [`crate::levels::DaySample`] it holds.
pub(crate) const DAY_FIELDS: [usize; 5] = [0, 1, 2, 3, 4];

/// The CRC-32C of a decoded tile, over its little-endian bytes.
pub(super) fn check(bytes: &[u8], sample_bytes: usize) -> u32 {
    if cfg!(target_endian = "little") {
        return crc32c::crc32c(bytes);
    }
    crc32c::crc32c(&little_endian(bytes.to_vec(), sample_bytes))
}

/// Samples between the machine's byte order and that of files, either way.
pub(super) fn little_endian(mut bytes: Vec<u8>, sample_bytes: usize) -> Vec<u8> {
    if cfg!(target_endian = "big") {
        bytes.chunks_exact_mut(sample_bytes).for_each(<[u8]>::reverse);
    }
    bytes
}

/// Lays samples of `N` fields out as a tile `width` samples wide; channel c holds field `fields[c]`.
pub(super) fn pack<T: Pod, const N: usize>(samples: &[[T; N]], width: usize, fields: [usize; N]) -> Vec<u8> {
    pack_columns(samples, width as i64, 0..width as i64, fields)
}

/// The same of some columns of rows `width` samples wide.
pub(crate) fn pack_columns<T: Pod, const N: usize>(
    samples: &[[T; N]],
    width: i64,
    columns: std::ops::Range<i64>,
    fields: [usize; N],
) -> Vec<u8> {
    let rows = samples.len() / width as usize;
    let columns = columns.start as usize..columns.end as usize;
    let mut bytes = Vec::with_capacity(rows * columns.len() * size_of::<[T; N]>());
    for row in samples.chunks_exact(width as usize) {
        let row = &row[columns.clone()];
        if N == 1 {
            bytes.extend_from_slice(bytemuck::cast_slice(row.as_flattened()));
            continue;
        }
        for field in fields {
            for sample in row {
                bytes.extend_from_slice(bytes_of(&sample[field]));
            }
        }
    }
    bytes
}

/// Lays some columns of rows of light, `width` samples wide, out as a tile: of [sun, sky], where no sky stands for 1.
pub(crate) fn pack_light(shares: &[Vec<f16>; 2], width: usize, columns: std::ops::Range<i64>) -> Vec<u8> {
    let [sun, sky] = shares;
    let columns = columns.start as usize..columns.end as usize;
    let whole = vec![f16::ONE; columns.len()];
    let mut bytes = Vec::with_capacity(sun.len() / width * columns.len() * 4);
    for row in (0..sun.len()).step_by(width) {
        let columns = row + columns.start..row + columns.end;
        let sky = if sky.is_empty() {
            &whole
        } else {
            &sky[columns.clone()]
        };
        bytes.extend_from_slice(bytemuck::cast_slice(sky));
        bytes.extend_from_slice(bytemuck::cast_slice(&sun[columns]));
    }
    bytes
}

/// Copies what `tile` (its samples lie at `tile_rect`) has of `rect` into `out`, which holds `rect` row by row.
pub(super) fn unpack<T: Pod, const N: usize>(
    tile: &[u8],
    tile_rect: Rect,
    fields: [usize; N],
    rect: Rect,
    out: &mut [[T; N]],
) {
    let both = tile_rect.intersection(rect);
    let size = size_of::<T>();
    let plane = tile_rect.width() as usize * size;
    let count = both.width() as usize;
    for z in both.z0..both.z1 {
        let row = (z - tile_rect.z0) as usize * plane * N + (both.x0 - tile_rect.x0) as usize * size;
        let start = ((z - rect.z0) * rect.width() + both.x0 - rect.x0) as usize;
        for (channel, field) in fields.into_iter().enumerate() {
            let from = &tile[row + channel * plane..][..count * size];
            if N == 1 {
                let to: &mut [u8] = bytemuck::cast_slice_mut(out[start..start + count].as_flattened_mut());
                to.copy_from_slice(from);
                continue;
            }
            for (sample, bytes) in out[start..start + count].iter_mut().zip(from.chunks_exact(size)) {
                sample[field] = pod_read_unaligned(bytes);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::levels::{Bounds, LightSample};
    use crate::terrain::layout::{Kind, Part};

    #[test]
    fn rows_hold_one_channel_after_another_and_come_back() {
        let samples: Vec<[u16; 2]> = (0..12).map(|i| [i, 100 + i]).collect();
        let bytes = pack(&samples, 4, [1, 0]);
        let values: Vec<u16> = bytes.chunks_exact(2).map(pod_read_unaligned).collect();
        assert_eq!(values[..8], [100, 101, 102, 103, 0, 1, 2, 3]);
        let tile_rect = Rect::new(10, 20, 14, 23);
        let rect = Rect::new(8, 21, 13, 30);
        let mut out = vec![[7u16; 2]; rect.area() as usize];
        unpack(&bytes, tile_rect, [1, 0], rect, &mut out);
        for (index, (x, z)) in rect.cells().enumerate() {
            let want = match tile_rect.contains(x, z) {
                true => samples[((z - 20) * 4 + x - 10) as usize],
                false => [7; 2],
            };
            assert_eq!(out[index], want, "({x}, {z})");
        }
    }

    #[test]
    fn channels_hold_the_fields_of_their_names() {
        let bounds = Bounds {
            min: 1.0,
            max: 2.0,
            error: 3.0,
            need_min: 4.0,
            need_max: 5.0,
            need_error: 6.0,
        };
        let part = |kind| Part {
            kind,
            level: 0,
            size: crate::grid::Size { width: 1, height: 1 },
        };
        let bytes = pack::<f32, 6>(&[bytemuck::cast(bounds)], 1, BOUNDS_FIELDS);
        let named = |name: &str| {
            let at = part(Kind::Bounds)
                .channels()
                .0
                .iter()
                .position(|c| *c == name)
                .unwrap();
            pod_read_unaligned::<f32>(&bytes[4 * at..][..4])
        };
        let names = ["min", "max", "error", "need_min", "need_max", "need_error"];
        assert_eq!(names.map(named), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        let light = LightSample {
            sun: f16::from_f32(0.25),
            sky: f16::from_f32(0.75),
        };
        let bytes = pack::<u16, 2>(&[bytemuck::cast(light)], 1, LIGHT_FIELDS);
        assert_eq!(part(Kind::Light).channels().0, ["sky", "sun"]);
        assert_eq!(bytes, [bytes_of(&light.sky), bytes_of(&light.sun)].concat());
        // Share by share the same, and where the sky is whole.
        assert_eq!(pack_light(&[vec![light.sun], vec![light.sky]], 1, 0..1), bytes);
        let whole = LightSample {
            sky: f16::ONE,
            ..light
        };
        let bytes = pack::<u16, 2>(&[bytemuck::cast(whole)], 1, LIGHT_FIELDS);
        assert_eq!(pack_light(&[vec![light.sun], Vec::new()], 1, 0..1), bytes);
    }

    #[test]
    fn the_check_is_crc_32c() {
        // The check value of CRC-32C: of the nine digits (Koopman 2002, and RFC 3720, appendix B.4).
        assert_eq!(check(b"123456789", 1), 0xE306_9283);
    }
}
