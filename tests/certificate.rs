//! The certificate holds: no place that a frame shows is more wrong on the screen than what was certified before drawing.
//!
//! Rays over a grid of pixels find the drawn surface, as a frame would show it; the DEM's own surface is asked over the
//! same places, and both are projected. Cameras: 30 % within 50 m of the ground, pitch from -90 to +10 degrees, all
//! headings; clip sizes 64 to 256, transitions 1, 2, the default and the limit, the dial off and from 0.25 to 8 pixels.
//! Nothing here is drawn; `tests/certified_frames.rs` does the same with the depths of frames. 60 frames of each DEM by default;
//! the long form is
//!
//! ```sh
//! CLIPSCAPE_FRAMES=1250 cargo test --release --test certificate -- --nocapture
//! ```
//!
//! `CLIPSCAPE_SEED` sets the seed.
#![allow(clippy::print_stderr, reason = "long runs say what they saw")]

mod support;

use clipscape::build::Threads;
use clipscape::camera::View;
use clipscape::clipmap::{Clipmap, ClipmapOptions, Drawn, Terms, certify, certify_by};
use clipscape::levels::Levels;
use clipscape::query::{Picker, S0};
use clipscape::work::each_chunk;
use support::scenes::{self, camera, dems};
use support::{Random, seed};

/// What f64 may lose between a hit and its place on the screen, in pixels, seen from a near plane of centimetres.
const ROUNDING_PX: f64 = 1e-6;

/// Rays across and down a frame.
const RAYS: [u32; 2] = [320, 180];

fn options(random: &mut Random) -> ClipmapOptions {
    let clip_size = random.pick(&[64, 128, 256]);
    let limit = clip_size / 4 - 10;
    ClipmapOptions {
        clip_size,
        transition: random.pick(&[Some(1), Some(2), None, Some(limit)]),
        max_error_px: random.pick(&[None, None, Some(0.25), Some(1.0), Some(2.0), Some(8.0)]),
        vertical_scale: random.pick(&[1.0, 1.0, 1.0, 1.0, -1.0, 3.0]),
        ..Default::default()
    }
}

/// The greatest error in pixels over the rays of a frame; none where they hit nothing.
fn measured_px(levels: &dyn Levels, clipmap: &Clipmap, view: &View) -> Option<f64> {
    let (drawn, truth) = (Drawn::new(clipmap).unwrap(), S0::new(levels));
    let mut picker = Picker::new(&drawn, view).unwrap();
    let scale = clipmap.vertical_scale();
    let mut worst = None;
    for row in 0..RAYS[1] {
        for column in 0..RAYS[0] {
            let pixel = [0, 1].map(|k| {
                (f64::from([column, row][k]) + 0.5) / f64::from(RAYS[k]) * f64::from(view.size_px[k])
            });
            let Some(hit) = picker.cast(pixel).unwrap() else {
                continue;
            };
            let Some(error_px) = scenes::error_px(&truth, view, scale, pixel, hit.along) else {
                continue;
            };
            let error_px = (error_px - ROUNDING_PX).max(0.0);
            worst = Some(error_px.max(worst.unwrap_or(0.0)));
        }
    }
    worst
}

/// What was found over the frames of one DEM.
#[derive(Debug, Default)]
struct Found {
    frames: usize,
    null: usize,
    /// Frames that measure more than they certify, as `measured, certified`.
    broken: Vec<String>,
    /// The same with half of the errors, and without the covariance.
    broken_controls: [usize; 2],
    /// Measured over certified, where something is.
    shares: Vec<f64>,
    promised: usize,
    kept: usize,
}

impl Found {
    fn share(&mut self, quantile: f64) -> f64 {
        self.shares.sort_by(f64::total_cmp);
        let last = self.shares.len().saturating_sub(1) as f64;
        self.shares
            .get((last * quantile).round() as usize)
            .copied()
            .unwrap_or(f64::NAN)
    }
}

struct Scene {
    options: ClipmapOptions,
    view: View,
    /// What was measured, and what was certified: as it is, with half of the errors, without the covariance.
    found: Option<(Option<f64>, [f64; 3])>,
}

fn fly(levels: &dyn Levels, frames: usize, seed: u64) -> Found {
    let truth = S0::new(levels);
    let mut random = Random(seed);
    let mut scenes: Vec<Scene> = (0..frames)
        .map(|_| Scene {
            options: options(&mut random),
            view: View::new(camera(&mut random, &truth), [1280, 720]).unwrap(),
            found: None,
        })
        .collect();
    each_chunk(&Threads::new(0).unwrap(), &mut scenes, 1, |_, scene| {
        let Scene { options, view, found } = &mut scene[0];
        let view = &view.scaled_down(options.vertical_scale);
        let mut clipmap = Clipmap::new(levels, options).unwrap();
        clipmap.update(levels, view, 0.0).unwrap();
        let certified = |terms| {
            certify_by(&clipmap, terms)
                .unwrap()
                .error_px
                .unwrap_or(f64::INFINITY)
        };
        assert_eq!(
            certify(&clipmap).unwrap().error_px.unwrap_or(f64::INFINITY),
            certified(Terms::default())
        );
        let certified = [
            certified(Terms::default()),
            certified(Terms {
                errors: 0.5,
                ..Terms::default()
            }),
            certified(Terms {
                covariance: false,
                ..Terms::default()
            }),
        ];
        *found = Some((measured_px(levels, &clipmap, view), certified));
    });
    let mut all = Found {
        frames,
        ..Found::default()
    };
    for (k, scene) in scenes.iter().enumerate() {
        let (seen, [certified, halved, without]) = scene.found.unwrap();
        let measured = seen.unwrap_or(0.0);
        all.null += usize::from(certified == f64::INFINITY);
        if measured > certified {
            all.broken.push(format!(
                "seed {seed}, frame {k}: {measured} px of {certified}, {scene:?}",
                scene = scene.options
            ));
        }
        all.broken_controls[0] += usize::from(measured > halved);
        all.broken_controls[1] += usize::from(measured > without);
        if seen.is_some() && certified.is_finite() && certified > 0.0 {
            all.shares.push(measured / certified);
        }
        if let Some(promised) = scene.options.max_error_px {
            all.promised += 1;
            all.kept += usize::from(certified <= promised);
        }
    }
    all
}

#[test]
fn nothing_seen_is_more_wrong_than_certified() {
    let frames = scenes::count("CLIPSCAPE_FRAMES", 60);
    let seed = seed(21);
    let mut controls = [0, 0];
    for dem in dems() {
        let mut found = fly(dem.levels.as_ref(), frames, seed);
        let (median, most) = (found.share(0.5), found.share(1.0));
        eprintln!(
            "{}: {} frames, {} null, measured over certified {median:.3} in the median and {most:.3} at most; {} of {} \
             frames with a dial keep it; controls: {:?}",
            dem.name, found.frames, found.null, found.kept, found.promised, found.broken_controls
        );
        assert!(found.broken.is_empty(), "{}: {:?}", dem.name, found.broken);
        if dem.real {
            assert!(found.null * 10 < frames, "{}: {} null", dem.name, found.null);
            assert!(median > 0.4, "{}: {median}", dem.name);
        }
        for k in [0, 1] {
            controls[k] += found.broken_controls[k];
        }
    }
    assert!(
        controls[0] > frames / 20,
        "control: halved errors are caught: {controls:?}"
    );
}
