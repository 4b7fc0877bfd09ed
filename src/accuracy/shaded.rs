//! The picture of the exact image: `S0` under the light of level 0, by the twin of the fragment stage.
//!
//! A point's light texel is bilinear between the samples of level 0 about it, as on the GPU: traced light where it came
//! with the terrain, and slopes by central differences. The point is exact, and so is its height.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::exact::each_row;
use crate::camera::View;
use crate::clipmap::{LIGHT_TEXEL_STEPS, LightTexel, height_range_m, light_texels};
use crate::error::{Error, ErrorKind, Result};
use crate::grid::Rect;
use crate::levels::Levels;
use crate::light::Sun;
use crate::query::{Crossing, Probe, Remembered, Shelf, Truth};
use crate::shade::{Fragment, ShadeConstants, encode8};
use crate::work::Work;

/// Light texels along a side of a tile.
const TILE: i64 = 256;

/// Bytes of light texels that are kept, about: those of 30 million samples.
const BUDGET_BYTES: usize = 256 << 20;

/// How frames look.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// The sun: by it slopes are lit where no traced light is used, and around it the sky glows.
    pub sun: Sun,
    /// Whether the light that came with the terrain is used.
    pub traced_light: bool,
    /// Whether the ground is tinted by height and slope.
    pub tint: bool,
    /// Whether air lies between ground and eye.
    pub haze: bool,
}

/// Shades exact images of one terrain, and keeps the light that it has read.
pub struct Shading {
    look: Look,
    range_m: [f32; 2],
    tiles: Shelf<LightTile>,
}

impl std::fmt::Debug for Shading {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Shading")
            .field("look", &self.look)
            .finish_non_exhaustive()
    }
}

struct LightTile {
    rect: Rect,
    texels: Vec<LightTexel>,
}

impl Shading {
    /// For the terrain of `levels`.
    ///
    /// # Errors
    /// Those of `levels`.
    pub fn new(levels: &dyn Levels, look: &Look) -> Result<Self> {
        Ok(Self {
            look: Look {
                traced_light: look.traced_light && levels.has_light(),
                ..*look
            },
            range_m: height_range_m(levels)?,
            tiles: Shelf::new(BUDGET_BYTES),
        })
    }

    /// The picture of `view`: red, green, blue, alpha of each pixel, sRGB, row by row from the upper left, as the shaded
    /// view of a frame is stored.
    ///
    /// # Errors
    /// [`ErrorKind::Misuse`] for a view of other than finite numbers; those of reading.
    pub fn picture(&self, truth: &Truth<'_>, view: &View, work: &dyn Work) -> Result<Vec<u8>> {
        let grid = truth.grid();
        let scale = truth.vertical_scale();
        let shade = |eye_height_m| {
            ShadeConstants::new(&self.look.sun, self.range_m, grid.base_m, scale, eye_height_m)
        };
        let fragment = |probe: &Probe<'_>| Fragment {
            shade: shade(probe.eye().height_high_low()[0]),
            eye_height_m: probe.eye().height_high_low(),
            vertical_scale: scale as f32,
            spacing_m: grid.spacing_m.map(|s| s as f32),
            traced_light: self.look.traced_light,
            tint: self.look.tint,
            haze: self.look.haze,
        };
        let mut pixels = vec![[0u8; 4]; view.size_px.iter().map(|&n| n as usize).product()];
        each_row(
            truth,
            view,
            work,
            &mut pixels,
            Remembered::new,
            |probe, tiles, pixel, out| {
                let ray = view.ray(pixel);
                let colour = match probe.cast(pixel)? {
                    Some(hit) => self.ground(truth, &fragment(probe), probe, tiles, ray, &hit)?,
                    None => fragment(probe).sky(ray.as_vec3()),
                };
                let [red, green, blue] = encode8(colour);
                *out = [red, green, blue, 255];
                Ok(())
            },
        )?;
        Ok(pixels.into_flattened())
    }

    fn ground(
        &self,
        truth: &Truth<'_>,
        fragment: &Fragment,
        probe: &Probe<'_>,
        tiles: &mut Remembered<LightTile>,
        ray: DVec3,
        hit: &Crossing,
    ) -> Result<Vec3> {
        let grid = truth.grid();
        let point = ray * hit.along;
        let from_eye = [point.x / grid.spacing_m[0], point.z / grid.spacing_m[1]];
        let last = [grid.size.width, grid.size.height].map(|n| n - 1);
        // The texel's place in steps, as on the GPU.
        let stepped = |v: f64| (v * LIGHT_TEXEL_STEPS).round() / LIGHT_TEXEL_STEPS;
        let (mut first, mut share) = ([0; 2], [0.0f32; 2]);
        for axis in 0..2 {
            let place = stepped(probe.eye().fraction[axis]) + stepped(from_eye[axis]);
            let sample = probe.eye().anchor[axis] + place.floor() as i64;
            first[axis] = sample.clamp(0, last[axis]);
            share[axis] = if first[axis] == sample {
                (place - place.floor()) as f32
            } else {
                0.0
            };
        }
        let key = first.map(|s| s.div_euclid(TILE));
        let tile = tiles.get(key, || self.tile(truth.levels(), key))?;
        let at = |dx: i64, dz: i64| {
            let [i, j] = [(first[0] + dx).min(last[0]), (first[1] + dz).min(last[1])];
            tile.texels[((j - tile.rect.z0) * tile.rect.width() + (i - tile.rect.x0)) as usize]
                .map(|v| v.to_f32())
        };
        let mix = |a: [f32; 4], b: [f32; 4], t: f32| std::array::from_fn(|k| a[k] + (b[k] - a[k]) * t);
        let north = mix(at(0, 0), at(1, 0), share[0]);
        let south = mix(at(0, 1), at(1, 1), share[0]);
        let texel = mix(north, south, share[1]);
        Ok(fragment.point_colour(from_eye.map(|v| v as f32), hit.height_m as f32, texel))
    }

    fn tile(&self, levels: &dyn Levels, [x, z]: [i64; 2]) -> Result<Arc<LightTile>> {
        self.tiles.get([x, z], || {
            let (x0, z0) = (x * TILE, z * TILE);
            // One more column and row, for what lies between this tile and the next.
            let rect =
                Rect::new(x0, z0, x0 + TILE + 1, z0 + TILE + 1).intersection(levels.grid().size.rect());
            let texels = light_texels(levels, 0, rect)?.ok_or_else(|| {
                Error::new(
                    ErrorKind::Unsupported,
                    "terrain",
                    "light is missing that the picture needs",
                )
                .advice("use a source that waits for its data")
            })?;
            let bytes = size_of_val(&texels[..]);
            Ok((LightTile { rect, texels }, bytes))
        })
    }
}

/// Peak signal-to-noise ratio of two pictures of red, green, blue, alpha: `10 log10(255^2 / mean square difference)`, in
/// decibels, over red, green and blue; infinite where they are the same, and for pictures of different sizes none.
pub fn psnr_db(a: &[u8], b: &[u8]) -> Option<f64> {
    if a.len() != b.len() || a.is_empty() {
        return None;
    }
    let square = |(a, b): (&u8, &u8)| u64::from(a.abs_diff(*b)).pow(2);
    let colours = |pixels: (&[u8], &[u8])| pixels.0[..3].iter().zip(&pixels.1[..3]).map(square).sum::<u64>();
    let squares: u64 = a.chunks_exact(4).zip(b.chunks_exact(4)).map(colours).sum();
    let mean = squares as f64 / (a.len() / 4 * 3) as f64;
    Some(10.0 * (255.0 * 255.0 / mean).log10())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_told_in_decibels() {
        let (a, b) = ([10, 20, 30, 255, 0, 0, 0, 255], [10, 20, 30, 0, 0, 0, 0, 9]);
        assert_eq!(psnr_db(&a, &b), Some(f64::INFINITY), "alpha does not count");
        let c = [11, 20, 30, 255, 0, 0, 0, 255];
        // One of six colours is off by one.
        let want = 10.0 * (255.0f64.powi(2) * 6.0).log10();
        assert!((psnr_db(&a, &c).unwrap() - want).abs() < 1e-9);
        assert_eq!((psnr_db(&a, &c[..4]), psnr_db(&[], &[])), (None, None));
    }
}
