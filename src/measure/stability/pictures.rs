//! Comparisons of pictures: of pixels whose colour or depth differ in any bit, and of cracks.

use std::sync::Arc;

use glam::DVec3;

use super::Comparison;
use super::ground::{camera, hash, noise, pyramid, rough};
use crate::camera::Camera;
use crate::clipmap::{ClipmapOptions, certify};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::grid::Grid;
use crate::levels::Levels;
use crate::progress::Silent;
use crate::render::{Headless, HeadlessOptions};
use crate::stream::Terrain;

const SIZE_PX: [u32; 2] = [96, 64];

/// Cameras of a comparison.
const CAMERAS: i64 = 12;

/// A height by column and row, and between which heights it lies.
type Field = (fn(i64, i64) -> f32, [f64; 2]);

const FIELDS: [Field; 2] = [(rough, [-400.0, 460.0]), (noise, [0.0, 9000.0])];

pub(super) fn options(cull: bool, look: bool) -> HeadlessOptions {
    HeadlessOptions {
        size_px: SIZE_PX,
        tint: look,
        haze: look,
        traced_light: false,
        clipmap: ClipmapOptions {
            clip_size: 64,
            cull,
            ..Default::default()
        },
        ..Default::default()
    }
}

/// Colours and depths of a picture.
pub(super) type Picture = (Vec<u8>, Vec<f32>);

fn draw(headless: &mut Headless, levels: &dyn Levels, camera: &Camera) -> Result<Picture> {
    let colours = headless.frame(levels, camera, 0.0)?.rgba8;
    Ok((colours, headless.read_depth()?))
}

pub(super) fn pictures(
    gpu: &Gpu,
    levels: &dyn Levels,
    options: &HeadlessOptions,
    cameras: &[Camera],
) -> Result<Vec<Picture>> {
    let mut headless = Headless::new(gpu.clone(), levels, options)?;
    cameras
        .iter()
        .map(|camera| draw(&mut headless, levels, camera))
        .collect()
}

/// Pixels that differ in any bit.
pub(super) fn differing(a: &[Picture], b: &[Picture]) -> usize {
    let pixel = |picture: &Picture, k: usize| {
        let colour: [u8; 4] = std::array::from_fn(|c| picture.0[4 * k + c]);
        (colour, picture.1[k].to_bits())
    };
    let pairs = a.iter().zip(b);
    pairs
        .map(|(a, b)| (0..a.1.len()).filter(|&k| pixel(a, k) != pixel(b, k)).count())
        .sum()
}

fn terrain_pixels(pictures: &[Picture]) -> usize {
    pictures.iter().flat_map(|p| &p.1).filter(|d| **d != 0.0).count()
}

fn grid() -> Grid {
    Grid::new(501, 423, [9.0, 11.0])
}

fn cameras(grid: &Grid) -> Vec<Camera> {
    (0..CAMERAS).map(|k| camera(k, grid, -400.0, 460.0)).collect()
}

/// The DEM's index offset and the camera's sample shifted by 2^40.
pub(super) fn shift(gpu: &Gpu) -> Result<Comparison> {
    const FAR: i64 = 1 << 40;
    let of = |offset| {
        let levels = pyramid(Grid { offset, ..grid() }, rough)?;
        pictures(gpu, &levels, &options(true, true), &cameras(&grid()))
    };
    let here = of([0, 0])?;
    let mut largest = 0;
    let offsets = [[FAR, FAR], [-FAR, FAR], [FAR + 12_345, 777 - FAR], [1 - FAR, 3]];
    for offset in offsets {
        largest = largest.max(differing(&here, &of(offset)?));
    }
    let compared = format!(
        "pixels of {CAMERAS} pictures ({} of terrain) that differ in any bit, {} shifts",
        terrain_pixels(&here),
        offsets.len()
    );
    Ok(line("the DEM's indices shifted by 2^40", compared, largest))
}

/// All lengths times powers of two.
pub(super) fn scale(gpu: &Gpu) -> Result<Comparison> {
    let of = |scale: f64| {
        let grid = Grid::new(501, 423, [9.0 * scale, 11.0 * scale]);
        let levels = pyramid(grid, |i, j| (f64::from(rough(i, j)) * scale) as f32)?;
        let cameras: Vec<Camera> = cameras(&self::grid())
            .into_iter()
            .map(|camera| Camera {
                eye: camera.eye * scale,
                ..camera
            })
            .collect();
        pictures(gpu, &levels, &options(true, false), &cameras)
    };
    let here = of(1.0)?;
    let mut largest = 0;
    for power in [-20, -7, 9, 20] {
        largest = largest.max(differing(&here, &of(2f64.powi(power))?));
    }
    let compared = format!(
        "pixels of {CAMERAS} pictures ({} of terrain) that differ in any bit, without haze and tint",
        terrain_pixels(&here)
    );
    Ok(line(
        "all lengths times 2^-20, 2^-7, 2^9, 2^20",
        compared,
        largest,
    ))
}

/// With and without culling.
pub(super) fn culling(gpu: &Gpu) -> Result<Comparison> {
    let mut largest = 0;
    let mut terrain = 0;
    for (height, [low_m, high_m]) in FIELDS {
        let levels = pyramid(grid(), height)?;
        let cameras: Vec<Camera> = (0..CAMERAS).map(|k| camera(k, &grid(), low_m, high_m)).collect();
        let whole = pictures(gpu, &levels, &options(false, true), &cameras)?;
        let culled = pictures(gpu, &levels, &options(true, true), &cameras)?;
        largest += differing(&whole, &culled);
        terrain += terrain_pixels(&whole);
    }
    let compared = format!(
        "pixels of {} pictures ({terrain} of terrain), hills and white noise, that differ in any bit",
        2 * CAMERAS
    );
    Ok(line("with and without culling", compared, largest))
}

/// A clipmap that flew to a place against one that was made there.
pub(super) fn history(gpu: &Gpu) -> Result<Comparison> {
    let levels = pyramid(grid(), rough)?;
    let cameras = cameras(&grid());
    let flown = pictures(gpu, &levels, &options(true, true), &cameras)?;
    let mut fresh = Vec::new();
    for camera in &cameras {
        fresh.extend(pictures(
            gpu,
            &levels,
            &options(true, true),
            std::slice::from_ref(camera),
        )?);
    }
    let compared =
        format!("pixels of {CAMERAS} pictures that differ in any bit from those of a clipmap made there");
    Ok(line(
        "whatever was drawn before",
        compared,
        differing(&flown, &fresh),
    ))
}

/// Relief of 1 m in steps of 1/1024 m, 0 at sample (0, 0).
fn metre(i: i64, j: i64) -> f64 {
    if (i, j) == (0, 0) {
        return 0.0;
    }
    (512.0 * (hash(5, i / 4, j / 4) + hash(6, i, j))).floor() / 1024.0
}

/// Relief of 1 m on an offset of 1e7 m, read from a file.
pub(super) fn metre_on_ten_million(gpu: &Gpu) -> Result<Comparison> {
    let size = [141, 120];
    let open = |offset_m: f64| {
        let mut text = format!(
            "ncols {}\nnrows {}\nxllcorner 0\nyllcorner 0\ncellsize 30\n",
            size[0], size[1]
        );
        for j in 0..size[1] {
            let row: Vec<String> = (0..size[0])
                .map(|i| format!("{:.10}", offset_m + metre(i, j)))
                .collect();
            text += &row.join(" ");
            text.push('\n');
        }
        Terrain::from_bytes("relief.asc", Arc::new(text.into_bytes()), &Silent)
    };
    let cameras = |offset_m: f64| -> Vec<Camera> {
        let at = |up_m: f64, heading_deg, pitch_deg| Camera {
            eye: DVec3::new(2000.0, offset_m + up_m, 2100.0),
            heading_deg,
            pitch_deg,
            roll_deg: 0.0,
            fov_deg: 60.0,
        };
        vec![at(3.0, 40.0, -10.0), at(900.0, 40.0, -70.0), at(1.5, 220.0, -2.0)]
    };
    // Air knows absolute heights.
    let options = options(true, false);
    let high = pictures(gpu, &open(1e7)?, &options, &cameras(1e7))?;
    let low = pictures(gpu, &open(0.0)?, &options, &cameras(0.0))?;
    let compared = format!(
        "pixels of 3 pictures ({} of terrain) that differ in any bit from those of the relief alone",
        terrain_pixels(&low)
    );
    Ok(line(
        "relief of 1 m on 10,000,000 m",
        compared,
        differing(&high, &low),
    ))
}

/// Pixels that see through the drawn surface.
pub(super) fn cracks(gpu: &Gpu) -> Result<Comparison> {
    let (mut cracks, mut terrain) = (0, 0);
    for (height, [low_m, high_m]) in FIELDS {
        let levels = pyramid(grid(), height)?;
        let mut headless = Headless::new(gpu.clone(), &levels, &options(true, true))?;
        headless.measure()?;
        for k in 0..CAMERAS {
            let frame = headless.frame(&levels, &camera(k, &grid(), low_m, high_m), 0.0)?;
            cracks += frame.measured.map_or(0, |m| m.cracks as usize);
            terrain += headless.read_depth()?.iter().filter(|d| **d != 0.0).count();
        }
    }
    let compared = format!(
        "pixels that see through the drawn surface, of {terrain} of terrain in {} pictures of hills and white noise",
        2 * CAMERAS
    );
    Ok(line("cracks", compared, cracks))
}

/// The greatest error measured over that certified, by frame, with the dial at all settings.
pub(super) fn certificate(gpu: &Gpu) -> Result<Comparison> {
    const DIAL_PX: [Option<f64>; 4] = [None, Some(0.01), Some(1.0), Some(100.0)];
    let (mut share, mut frames, mut none) = (0.0f64, 0, 0);
    for (height, [low_m, high_m]) in FIELDS {
        let levels = pyramid(grid(), height)?;
        for max_error_px in DIAL_PX {
            let mut options = options(true, true);
            options.clipmap.max_error_px = max_error_px;
            let mut headless = Headless::new(gpu.clone(), &levels, &options)?;
            headless.measure()?;
            for k in 0..CAMERAS {
                let frame = headless.frame(&levels, &camera(k, &grid(), low_m, high_m), 0.0)?;
                frames += 1;
                match certify(headless.clipmap())?.error_px {
                    Ok(certified_px) => {
                        let measured_px = frame.measured.map_or(0.0, |m| m.errors.summary.error_px_max);
                        if measured_px > 0.0 {
                            share = share.max(measured_px / certified_px);
                        }
                    }
                    Err(_) => none += 1,
                }
            }
        }
    }
    let compared = format!(
        "the greatest error measured over that certified beforehand, {frames} frames of hills and white noise ({none} \
         without certificate), the dial off and at 0.01, 1 and 100 px"
    );
    Ok(Comparison::new(
        "the certificate",
        compared,
        share,
        1.0,
        "of the certificate",
    ))
}

fn line(what: &str, compared: String, pixels: usize) -> Comparison {
    Comparison::new(what, compared, pixels as f64, 0.0, "px")
}
