//! The names in the reports' JSON: what `--stats` writes, one object a line.
//!
//! A field is here from the moment that what it names is measured, not before.

use serde::{Deserialize, Serialize};

/// What `render` reports of one frame.
///
/// Times are wall time in milliseconds. Bytes are those of the samples that were sent, without padding.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrameStats {
    /// The frame's number, from 0.
    pub frame: u64,
    /// Its time in the flight, seconds.
    pub t_s: f64,
    /// Where the camera stood: world metres, before vertical scale.
    pub eye: [f64; 3],
    /// Moving the windows, reading what that exposes, and choosing patches.
    pub plan_ms: f64,
    /// Finding what can be certified of it.
    pub certify_ms: f64,
    /// Handing what is newly exposed to the device.
    pub upload_ms: f64,
    /// Drawing, to completion.
    pub draw_ms: f64,
    /// Drawing by the device's own clock; null where it has none.
    pub gpu_ms: Option<f64>,
    /// The whole frame, without writing its picture.
    pub frame_ms: f64,
    /// Triangles drawn, those that close T-junctions included.
    pub triangles: u64,
    /// Draw calls.
    pub draw_calls: u64,
    /// Patches drawn.
    pub patches: u64,
    /// Patches dropped by the walk because they lie outside the frustum.
    pub patches_culled: u64,
    /// Levels of which at least one patch was drawn.
    pub levels_drawn: u32,
    /// Rectangles sent to the device.
    pub uploads: u64,
    /// Bytes sent to the device for heights and light.
    pub upload_bytes: u64,
    /// Bytes newly exposed, computed from the windows before and after and not from the plan.
    pub upload_bytes_exposed: u64,
    /// Whether all data that the frame should show were there, and had faded in.
    pub complete: bool,
    /// Whether the coarsest level's window ended before the DEM did.
    pub cut: bool,
    /// Levels of which something was drawn coarser than it would have been with its data there in time.
    pub stale_levels: u32,
    /// Patches whose detail vanished at once, because their data came too late to be taken back gently.
    pub pops: u64,
    /// Whether some of what was resident stood in for data that were not there yet.
    pub provisional: bool,
    /// Greatest error on the screen, in pixels ([`crate::accuracy`] says what is measured); null unless measured, as all
    /// up to `silhouette_px`.
    pub error_px_max: Option<f64>,
    /// Its 99th percentile over the pixels of terrain.
    pub error_px_p99: Option<f64>,
    /// The root of its mean square.
    pub error_px_rms: Option<f64>,
    /// Greatest error of a height in metres, before vertical scale.
    pub error_m_max: Option<f64>,
    /// The greatest floor that was taken off an error in pixels: what the rasteriser's grid and f32 may add.
    pub error_floor_px: Option<f64>,
    /// Pixels that see through the drawn surface.
    pub cracks: Option<u64>,
    /// Pixels whose depth is that of a triangle beside them, and which were measured on it.
    pub beside_px: Option<u64>,
    /// Pixels at which the exact image and the drawn one disagree about being terrain.
    pub silhouette_px: Option<u64>,
    /// An upper bound of the error anywhere in the frame, known before it was drawn; null where there is none.
    pub certified_error_px: Option<f64>,
    /// Why there is none; null where there is one.
    pub certificate_reason: Option<String>,
    /// The error that was promised; null where none was.
    pub max_error_px: Option<f64>,
    /// Whether what is certified keeps the promise; null where there was none.
    pub keeps_max_error: Option<bool>,
}

/// Median and 99th percentile of one quantity over a run, by [`percentile`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spread {
    /// The 50th percentile.
    pub median: f64,
    /// The 99th percentile.
    pub p99: f64,
}

impl Spread {
    /// Of `values`; none where there are none, or one of them is NaN.
    pub fn of(mut values: Vec<f64>) -> Option<Self> {
        if values.is_empty() || values.iter().any(|v| v.is_nan()) {
            return None;
        }
        values.sort_by(f64::total_cmp);
        Some(Self {
            median: percentile(&values, 50.0),
            p99: percentile(&values, 99.0),
        })
    }
}

/// Under what a run was made: the part of [`SummaryStats`] that does not follow from its frames.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Run {
    /// The adapter's name.
    pub device: String,
    /// The driver and its version, as it names itself.
    pub driver: String,
    /// The command line, as one line.
    pub command: String,
    /// The flight's checksum, with the name of its kind before it (`crc32c:...`).
    pub flight_checksum: Option<String>,
    /// The input's checksum, likewise.
    pub input_checksum: Option<String>,
    /// Faults met on the way that did not end the run.
    pub faults: u64,
    /// The fastest flight at which every level would have stayed fresh, by what loading took; none where nothing limits it.
    pub fastest_fresh_m_s: Option<f64>,
    /// The errors of all frames together, where they were measured.
    pub errors: Option<PooledErrors>,
}

/// The errors of all frames together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PooledErrors {
    /// Of [`FrameStats::error_px_max`], the greatest.
    pub error_px_max: f64,
    /// The 99th percentile over the pixels of all frames, too great by less than 1/128 of itself.
    pub error_px_p99: f64,
    /// The root of the mean square over the pixels of all frames.
    pub error_px_rms: f64,
    /// Of [`FrameStats::error_m_max`], the greatest.
    pub error_m_max: f64,
    /// Of [`FrameStats::error_floor_px`], the greatest.
    pub error_floor_px: f64,
    /// Which of the frames has the greatest error.
    pub worst_frame: u64,
}

/// The last line of `render --stats`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SummaryStats {
    /// Always true: the mark by which this line is told from a frame's.
    pub summary: bool,
    /// The number of frames summed up.
    pub frames: u64,
    /// The adapter's name.
    pub device: String,
    /// The driver and its version, as it names itself.
    pub driver: String,
    /// The version of this crate.
    pub version: String,
    /// The command line, as one line.
    pub command: String,
    /// The flight's checksum, with the name of its kind before it; null without a flight file.
    pub flight_checksum: Option<String>,
    /// The input's checksum, likewise; null where the input is no file.
    pub input_checksum: Option<String>,
    /// Faults met on the way that did not end the run.
    pub faults: u64,
    /// The fastest flight in m/s at which every level would have stayed fresh, by what loading tiles took; null where that
    /// is not known, or nothing limits it.
    pub fastest_fresh_m_s: Option<f64>,
    /// The greatest error that is certified of any frame; null where one has no certificate.
    pub certified_error_px: Option<f64>,
    /// Frames that keep the promised error; null where none was promised.
    pub frames_keeping_max_error: Option<u64>,
    /// Of [`FrameStats::plan_ms`]; null without frames, as all that follow.
    pub plan_ms: Option<Spread>,
    /// Of [`FrameStats::upload_ms`].
    pub upload_ms: Option<Spread>,
    /// Of [`FrameStats::draw_ms`].
    pub draw_ms: Option<Spread>,
    /// Of [`FrameStats::frame_ms`].
    pub frame_ms: Option<Spread>,
    /// Of [`FrameStats::triangles`].
    pub triangles: Option<Spread>,
    /// Of [`FrameStats::upload_bytes`].
    pub upload_bytes: Option<Spread>,
    /// Of [`PooledErrors::error_px_max`]; null unless measured, as all that follow.
    pub error_px_max: Option<f64>,
    /// Of [`PooledErrors::error_px_p99`].
    pub error_px_p99: Option<f64>,
    /// Of [`PooledErrors::error_px_rms`].
    pub error_px_rms: Option<f64>,
    /// Of [`PooledErrors::error_m_max`].
    pub error_m_max: Option<f64>,
    /// Of [`PooledErrors::error_floor_px`].
    pub error_floor_px: Option<f64>,
    /// Of [`PooledErrors::worst_frame`].
    pub error_worst_frame: Option<u64>,
    /// The sum of [`FrameStats::cracks`].
    pub cracks: Option<u64>,
    /// The sum of [`FrameStats::beside_px`].
    pub beside_px: Option<u64>,
    /// The sum of [`FrameStats::silhouette_px`].
    pub silhouette_px: Option<u64>,
}

impl SummaryStats {
    /// Sums up `frames` of `run`.
    pub fn new(run: Run, frames: &[FrameStats]) -> Self {
        let spread = |of: fn(&FrameStats) -> f64| Spread::of(frames.iter().map(of).collect());
        let measured = run.errors.is_some();
        let sum = |of: fn(&FrameStats) -> Option<u64>| measured.then(|| frames.iter().filter_map(of).sum());
        Self {
            summary: true,
            frames: frames.len() as u64,
            device: run.device,
            driver: run.driver,
            version: env!("CARGO_PKG_VERSION").into(),
            command: run.command,
            flight_checksum: run.flight_checksum,
            input_checksum: run.input_checksum,
            faults: run.faults,
            fastest_fresh_m_s: run.fastest_fresh_m_s.filter(|v| v.is_finite()),
            certified_error_px: frames
                .iter()
                .map(|f| f.certified_error_px)
                .try_fold(0.0, |most: f64, px| px.map(|px| most.max(px)))
                .filter(|_| !frames.is_empty()),
            frames_keeping_max_error: frames
                .iter()
                .map(|f| f.keeps_max_error.map(u64::from))
                .sum::<Option<u64>>()
                .filter(|_| !frames.is_empty()),
            plan_ms: spread(|f| f.plan_ms),
            upload_ms: spread(|f| f.upload_ms),
            draw_ms: spread(|f| f.draw_ms),
            frame_ms: spread(|f| f.frame_ms),
            triangles: spread(|f| f.triangles as f64),
            upload_bytes: spread(|f| f.upload_bytes as f64),
            error_px_max: run.errors.map(|e| e.error_px_max),
            error_px_p99: run.errors.map(|e| e.error_px_p99),
            error_px_rms: run.errors.map(|e| e.error_px_rms),
            error_m_max: run.errors.map(|e| e.error_m_max),
            error_floor_px: run.errors.map(|e| e.error_floor_px),
            error_worst_frame: run.errors.map(|e| e.worst_frame),
            cracks: sum(|f| f.cracks),
            beside_px: sum(|f| f.beside_px),
            silhouette_px: sum(|f| f.silhouette_px),
        }
    }
}

/// The `percent`-th percentile of `sorted` by nearest rank: the smallest value such that at least `percent` of
/// a hundred values are not above it, `sorted[ceil(percent / 100 * n) - 1]`; the least value for 0.
///
/// It is always one of the values, so the median of an even number is the lower of the middle two.
///
/// # Panics
/// Where `sorted` is empty or `percent` is outside 0 to 100.
pub fn percentile(sorted: &[f64], percent: f64) -> f64 {
    assert!(!sorted.is_empty(), "nothing has no percentile");
    assert!(
        (0.0..=100.0).contains(&percent),
        "the {percent}th percentile does not exist"
    );
    debug_assert!(sorted.is_sorted(), "percentiles are of sorted values");
    // Multiplied before it is divided: 99 * 100 / 100 is exact, 0.99 * 100 is not.
    let rank = (percent * sorted.len() as f64 / 100.0).ceil() as usize;
    sorted[rank.max(1) - 1]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(frame: u64) -> FrameStats {
        FrameStats {
            frame,
            t_s: frame as f64 / 30.0,
            eye: [1.0, 2.0, 3.0],
            plan_ms: frame as f64,
            certify_ms: 0.125,
            upload_ms: 0.25,
            draw_ms: 5.0,
            gpu_ms: None,
            frame_ms: 6.0,
            triangles: 1000 * frame,
            draw_calls: 4,
            patches: 10,
            patches_culled: 3,
            levels_drawn: 5,
            uploads: 2,
            upload_bytes: 800,
            upload_bytes_exposed: 800,
            complete: true,
            cut: false,
            stale_levels: 0,
            pops: 0,
            provisional: false,
            error_px_max: Some(0.5 * frame as f64),
            error_px_p99: None,
            error_px_rms: None,
            error_m_max: None,
            error_floor_px: None,
            cracks: None,
            beside_px: Some(1),
            silhouette_px: Some(2),
            certified_error_px: Some(frame as f64 / 100.0),
            certificate_reason: None,
            max_error_px: Some(1.0),
            keeps_max_error: Some(frame <= 100),
        }
    }

    #[test]
    fn a_percentile_is_the_least_value_with_enough_below_it() {
        for n in 1..=205_usize {
            let values: Vec<f64> = (1..=n).map(|v| v as f64).collect();
            for percent in 0..=100_usize {
                let enough = |v: &&f64| 100 * (**v as usize) >= percent * n; // v values are not above v
                let naive = values.iter().find(enough).expect("all values are enough");
                assert_eq!(percentile(&values, percent as f64), *naive, "{percent} % of {n}");
            }
        }
        let values: Vec<f64> = (1..=100).map(f64::from).collect();
        assert_eq!(percentile(&values, 99.0), 99.0);
        assert_ne!(percentile(&values, 99.5), 99.0, "control");
        assert_eq!(percentile(&[3.0, 8.0], 50.0), 3.0);
    }

    #[test]
    fn spreads_are_of_any_order_and_refuse_nan() {
        let spread = Spread::of(vec![9.0, 1.0, 5.0]).unwrap();
        assert_eq!((spread.median, spread.p99), (5.0, 9.0));
        assert!(Spread::of(vec![1.0, f64::NAN]).is_none());
        assert!(Spread::of(vec![]).is_none());
    }

    #[test]
    fn a_frame_has_the_documented_names_in_order_and_comes_back() {
        let json = serde_json::to_string(&frame(3)).unwrap();
        let names: Vec<&str> = json.split('"').skip(1).step_by(2).collect();
        let documented = "frame t_s eye plan_ms certify_ms upload_ms draw_ms gpu_ms frame_ms triangles draw_calls \
            patches patches_culled levels_drawn uploads upload_bytes upload_bytes_exposed complete cut stale_levels pops \
            provisional error_px_max error_px_p99 error_px_rms error_m_max error_floor_px cracks beside_px silhouette_px \
            certified_error_px \
            certificate_reason max_error_px keeps_max_error";
        assert_eq!(names, documented.split_whitespace().collect::<Vec<_>>());
        assert!(
            json.contains("\"gpu_ms\":null") && json.contains("\"cracks\":null"),
            "{json}"
        );
        assert_eq!(serde_json::from_str::<FrameStats>(&json).unwrap(), frame(3));
    }

    #[test]
    fn a_summary_sums_up_its_frames_and_is_told_from_them() {
        let frames: Vec<_> = (0..200).map(frame).collect();
        let summary = SummaryStats::new(
            Run {
                device: "llvmpipe".into(),
                ..Run::default()
            },
            &frames,
        );
        assert_eq!(
            summary.plan_ms,
            Some(Spread {
                median: 99.0,
                p99: 197.0
            })
        );
        assert_eq!(
            summary.triangles,
            Some(Spread {
                median: 99_000.0,
                p99: 197_000.0
            })
        );
        assert_eq!(
            (summary.certified_error_px, summary.frames_keeping_max_error),
            (Some(1.99), Some(101))
        );
        let mut uncertified = frames.clone();
        uncertified[7].certified_error_px = None;
        assert_eq!(
            SummaryStats::new(Run::default(), &uncertified).certified_error_px,
            None
        );
        let json = serde_json::to_string(&summary).unwrap();
        assert!(json.starts_with("{\"summary\":true,"), "{json}");
        assert!(serde_json::from_str::<FrameStats>(&json).is_err());
        assert_eq!((summary.error_px_max, summary.silhouette_px), (None, None));
        let run = Run {
            errors: Some(PooledErrors {
                error_px_max: 99.5,
                worst_frame: 199,
                ..PooledErrors::default()
            }),
            ..Run::default()
        };
        let summary = SummaryStats::new(run, &frames);
        assert_eq!(
            (summary.error_px_max, summary.error_worst_frame),
            (Some(99.5), Some(199))
        );
        assert_eq!((summary.silhouette_px, summary.cracks), (Some(400), Some(0)));
        assert_eq!(summary.beside_px, Some(200));
        let empty = SummaryStats::new(Run::default(), &[]);
        assert_eq!((empty.frames, empty.frame_ms), (0, None));
        assert_eq!(
            (empty.certified_error_px, empty.frames_keeping_max_error),
            (None, None)
        );
    }
}
