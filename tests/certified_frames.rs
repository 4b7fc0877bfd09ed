//! No frame is measured to be more wrong than it was certified to be, nor than it was promised to be where it claims so.
//!
//! Frames are drawn, their depths read back and measured against the DEM's own surface ([`clipscape::accuracy`]); what was
//! certified was known before. Cameras: 30 % within 50 m of the ground, pitch from -90 to +10 degrees, all headings; clip
//! sizes 64 to 256, transitions 1, 2, the default and the limit, the dial off and from 0.25 to 8 pixels. 25 frames of each
//! DEM by default; the long form, 5,000 in all, is
//!
//! ```sh
//! CLIPSCAPE_FRAMES=1250 cargo test --test certified_frames -- --nocapture
//! ```
//!
//! `CLIPSCAPE_SEED` sets the seed.
//!
//! Of those 5,000 two break it, frame 746 of seed 51 over Mt Hood and over the Sierra: one pixel each measures 0.03 px where all
//! is drawn at full resolution, nearer than any ray around it meets the ground.
//!
//! *Second look.* Beside triangles seen edge on, and on slivers, f32 moves a depth by more than the floor allows for, which
//! knows the DEM's triangles and not the drawn ones: about one pixel in a million measures some hundredths of a pixel
//! where nothing is wrong. So a pixel that measures more than was certified is looked at again: if its depth is that of
//! the drawn triangle which a ray within 1/128 pixel meets, but for what [`Facet`] explains, the point that the ray meets is measured
//! in its place. That point lies on the surface of which the certificate speaks.
#![cfg(feature = "gpu")]
#![allow(clippy::print_stderr, reason = "long runs say what they saw")]

mod support;

use clipscape::accuracy::{DepthImage, Facet, FrameErrors, measure};
use clipscape::build::Threads;
use clipscape::camera::View;
use clipscape::clipmap::{Clipmap, ClipmapOptions, Drawn, Terms, certify_by};
use clipscape::query::{Picker, S0, Truth};
use support::depths::Depths;
use support::scenes::{self, Dem, camera, dems};
use support::{Random, gpu, seed};

/// What f64 may lose between a hit and its place on the screen, in pixels.
const ROUNDING_PX: f64 = 1e-6;

const SIZE_PX: [u32; 2] = [320, 180];

fn options(random: &mut Random) -> ClipmapOptions {
    let clip_size = random.pick(&[64, 128, 256]);
    let limit = clip_size / 4 - 10;
    ClipmapOptions {
        clip_size,
        transition: random.pick(&[Some(1), Some(2), None, None, Some(limit)]),
        max_error_px: random.pick(&[
            None,
            None,
            None,
            Some(0.25),
            Some(0.5),
            Some(1.0),
            Some(2.0),
            Some(4.0),
            Some(8.0),
        ]),
        ..Default::default()
    }
}

/// What was found over the frames of one DEM.
#[derive(Debug, Default)]
struct Found {
    /// Frames that show terrain.
    frames: usize,
    null: usize,
    /// Frames that measure more than they certify.
    broken: Vec<String>,
    /// The same with half of the stored errors.
    halved: usize,
    /// Measured over certified.
    shares: Vec<f64>,
    /// Pixels that were looked at twice.
    second_looks: usize,
    /// Frames that claim to keep their promise.
    claims: usize,
}

/// The errors of the pixels that measure more than `certified` pixels, after a second look.
fn second_looks(
    truth: &S0<'_>,
    clipmap: &Clipmap,
    image: &DepthImage<'_>,
    errors: &FrameErrors,
    certified: f64,
) -> Vec<f64> {
    let view = image.view();
    let drawn = Drawn::new(clipmap).unwrap();
    let mut picker = Picker::new(&drawn, view).unwrap();
    let suspects = errors.pixels.iter().enumerate();
    let suspects = suspects.filter(|(_, p)| f64::from(p.error_px) > certified);
    suspects
        .map(|(k, measured)| {
            let (x, y) = (k as u32 % SIZE_PX[0], k as u32 / SIZE_PX[0]);
            let depth = f64::from(image.row(y)[x as usize]);
            let centre = [f64::from(x) + 0.5, f64::from(y) + 0.5];
            let beside = [[0.0, 0.0], [-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0]];
            beside
                .iter()
                .filter_map(|side| {
                    let pixel = [0, 1].map(|k| centre[k] + side[k] / 128.0);
                    let hit = picker.cast(pixel).unwrap()?;
                    let scale = clipmap.vertical_scale();
                    let facet = Facet::new(clipmap.grid(), view, scale, &hit, centre)?;
                    let explained = (facet.depth - depth).abs() <= facet.rounding();
                    explained.then(|| scenes::error_px(truth, view, scale, pixel, hit.along))?
                })
                .fold(f64::from(measured.error_px), f64::min)
        })
        .collect()
}

fn fly(depths: &Depths, dem: &Dem, frames: usize, seed: u64) -> Found {
    let levels = dem.levels.as_ref();
    let (truth, ground) = (Truth::new(levels, 1.0), S0::new(levels));
    let threads = Threads::new(0).unwrap();
    let mut random = Random(seed);
    let mut found = Found::default();
    for k in 0..frames {
        let options = options(&mut random);
        let view = View::new(camera(&mut random, &ground), SIZE_PX).unwrap();
        let mut clipmap = Clipmap::new(levels, &options).unwrap();
        clipmap.update(levels, &view, 0.0).unwrap();
        let by = |terms| {
            certify_by(&clipmap, terms)
                .unwrap()
                .error_px
                .unwrap_or(f64::INFINITY)
        };
        let certified = by(Terms::default());
        let image = depths.draw(&clipmap);
        let image = DepthImage::new(&image, &view).unwrap();
        let frame_errors = measure(&truth, &image, &threads).unwrap();
        let measured = frame_errors.summary;
        if measured.terrain_px == 0 {
            continue;
        }
        let px = if measured.error_px_max > certified {
            let looks = second_looks(&ground, &clipmap, &image, &frame_errors, certified);
            found.second_looks += looks.len();
            let others = frame_errors.pixels.iter().map(|p| f64::from(p.error_px));
            let others = others.filter(|px| *px <= certified);
            looks.into_iter().chain(others).fold(0.0, f64::max)
        } else {
            measured.error_px_max
        };
        found.frames += 1;
        found.null += usize::from(certified == f64::INFINITY);
        if px > certified + ROUNDING_PX {
            found
                .broken
                .push(format!("frame {k}: {px} of {certified} px, {options:?} {view:?}"));
        }
        found.halved += usize::from(
            px > by(Terms {
                errors: 0.5,
                ..Terms::default()
            }),
        );
        if certified.is_finite() && certified > 0.0 {
            found.shares.push(px / certified);
        }
        if options.max_error_px.is_some_and(|promised| certified <= promised) {
            found.claims += 1;
            assert!(
                Some(px) <= options.max_error_px,
                "{}, frame {k}: {px} px, {options:?}",
                dem.name
            );
        }
    }
    found.shares.sort_by(f64::total_cmp);
    found
}

#[test]
fn no_frame_is_more_wrong_than_certified() {
    let Some(gpu) = gpu() else { return };
    let depths = Depths::new(gpu, SIZE_PX);
    let frames = scenes::count("CLIPSCAPE_FRAMES", 25);
    let seed = seed(51);
    let mut halved = 0;
    for dem in dems() {
        let found = fly(&depths, &dem, frames, seed);
        let median = found
            .shares
            .get(found.shares.len() / 2)
            .copied()
            .unwrap_or(f64::NAN);
        eprintln!(
            "{}: {} of {frames} frames show terrain, {} without a certificate; measured over certified {median:.3} in the \
             median, {:.3} at most; {} keep their promise; {} pixels looked at twice; control: {} break with half of the errors",
            dem.name,
            found.frames,
            found.null,
            found.shares.last().copied().unwrap_or(f64::NAN),
            found.claims,
            found.second_looks,
            found.halved
        );
        assert!(
            found.broken.is_empty(),
            "{}, seed {seed}: {:#?}",
            dem.name,
            found.broken
        );
        assert!(found.frames > frames / 3, "{}: {}", dem.name, found.frames);
        if dem.real {
            assert!(found.null * 10 < frames, "{}: {}", dem.name, found.null);
        }
        halved += found.halved;
    }
    assert!(halved > 0, "control: half of the errors are caught");
}
