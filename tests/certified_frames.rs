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
//! `CLIPSCAPE_FIRST` leaves out the frames before one: a long form may be run in pieces.
#![cfg(feature = "gpu")]
#![allow(clippy::print_stderr, reason = "long runs say what they saw")]

mod support;

use clipscape::accuracy::{DepthImage, measure_drawn};
use clipscape::build::Threads;
use clipscape::camera::View;
use clipscape::clipmap::{Clipmap, ClipmapOptions, Drawn, Terms, certify_by};
use clipscape::query::{S0, Truth};
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
    /// Pixels that were measured on a triangle beside them.
    beside_px: u64,
    /// Frames that claim to keep their promise.
    claims: usize,
}

fn fly(depths: &Depths, dem: &Dem, [first, frames]: [usize; 2], seed: u64) -> Found {
    let levels = dem.levels.as_ref();
    let (truth, ground) = (Truth::new(levels, 1.0), S0::new(levels));
    let threads = Threads::new(0).unwrap();
    let mut random = Random(seed);
    let mut found = Found::default();
    for k in 0..frames {
        let options = options(&mut random);
        let view = View::new(camera(&mut random, &ground), SIZE_PX).unwrap();
        if k < first {
            continue;
        }
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
        let drawn = Drawn::new(&clipmap).unwrap();
        let measured = measure_drawn(&truth, &drawn, &image, &threads).unwrap().summary;
        if measured.terrain_px == 0 {
            continue;
        }
        let px = measured.error_px_max;
        found.beside_px += measured.beside_px;
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
    let first = scenes::count("CLIPSCAPE_FIRST", 0).min(frames);
    let seed = seed(51);
    let mut halved = 0;
    for dem in dems() {
        let found = fly(&depths, &dem, [first, frames], seed);
        let median = found
            .shares
            .get(found.shares.len() / 2)
            .copied()
            .unwrap_or(f64::NAN);
        eprintln!(
            "{}: {} of {} frames show terrain, {} without a certificate; measured over certified {median:.3} in the \
             median, {:.3} at most; {} keep their promise; {} pixels are measured beside their centre; control: {} break with half of the errors",
            dem.name,
            found.frames,
            frames - first,
            found.null,
            found.shares.last().copied().unwrap_or(f64::NAN),
            found.claims,
            found.beside_px,
            found.halved
        );
        assert!(
            found.broken.is_empty(),
            "{}, seed {seed}: {:#?}",
            dem.name,
            found.broken
        );
        assert!(
            found.frames > (frames - first) / 3,
            "{}: {}",
            dem.name,
            found.frames
        );
        if dem.real {
            assert!(found.null * 10 < frames, "{}: {}", dem.name, found.null);
            assert!(median > 0.3 || frames < 25, "{}: {median}", dem.name);
        }
        halved += found.halved;
    }
    assert!(halved > 0, "control: half of the errors are caught");
}
