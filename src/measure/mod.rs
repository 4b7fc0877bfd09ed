//! Measuring what speed costs in accuracy: one flight over many settings, and a report.
//!
//! [`SettingLists`] make the settings, a [`Sweep`] flies them, each becomes a [`Row`]. [`compare`] runs the comparisons of
//! numerical stability, [`storage_costs`] says what heights in fewer bits would cost. [`measure`] does all of it and
//! returns the four files of a [`Folder`]: `tradeoff.csv`, `tradeoff.schema.json`, `summary.json`, `report.html`.

mod folder;
mod pareto;
mod rebuilt;
mod report;
mod row;
mod score;
mod settings;
mod stability;
mod storage;
mod svg;
mod sweep;

pub use folder::Folder;
pub use pareto::{Criterion, nearest, quickest};
pub use rebuilt::rebuilt;
pub use report::{LIMITS_PX, Page};
pub use row::{Row, csv, schema};
pub use settings::{Family, Setting, SettingLists};
pub use stability::{Comparison, SEED, compare};
pub use storage::{Format, StorageCost, storage_costs};
pub use sweep::{Effort, Sweep};

use std::time::Instant;

use serde_json::{Value, json};

use crate::build::Threads;
use crate::camera::Flight;
use crate::clipmap::{Clipmap, HEIGHT_BYTES};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::levels::Levels;
use crate::progress::Progress;
use crate::pyramid::FilterKind;
use crate::render::HeadlessOptions;
use crate::stats::Run;
use crate::stream::{Origin, Terrain};

/// The names of the files, in the order in which [`measure`] returns them.
pub const FILES: [&str; 4] = [
    "tradeoff.csv",
    "tradeoff.schema.json",
    "summary.json",
    "report.html",
];

/// The commit that this was built from: what `CLIPSCAPE_COMMIT` said, or in a release build git, see `build.rs`.
pub const COMMIT: Option<&str> = option_env!("CLIPSCAPE_COMMIT");

/// What to measure.
#[derive(Clone, Debug)]
pub struct MeasureOptions {
    /// The settings.
    pub lists: SettingLists,
    /// How much is flown.
    pub effort: Effort,
    /// Size and look of frames, and what of the clipmap no setting says.
    pub headless: HeadlessOptions,
    /// Memory in which coarser levels may be rebuilt by other filters.
    pub memory_bytes: u64,
}

/// Measures `terrain` along `flight` and returns the contents of [`FILES`]. `run` says under what.
///
/// # Errors
/// [`crate::ErrorKind::Misuse`] for settings out of range; [`crate::ErrorKind::Limit`] where rebuilding needs more memory
/// than is allowed; those of reading and drawing; [`crate::ErrorKind::Cancelled`].
pub fn measure(
    gpu: &Gpu,
    terrain: &Terrain,
    flight: &Flight,
    options: &MeasureOptions,
    run: &Run,
    progress: &dyn Progress,
) -> Result<[String; 4]> {
    let start = Instant::now();
    let settings = options.lists.settings()?;
    let threads = Threads::new(0)?;
    let kinds: Vec<FilterKind> = settings.iter().filter_map(|s| s.filter).collect();
    let others = rebuilt(terrain, &kinds, options.memory_bytes, &threads, progress)?;
    let filter = match terrain.origin() {
        Origin::File(meta) => meta.filter.clone(),
        Origin::Dem(description) if description.format == "synth" => "as computed".into(),
        Origin::Dem(_) => FilterKind::default().name().into(),
    };
    let sweep = Sweep {
        gpu,
        terrain: (terrain, &filter),
        rebuilt: &others,
        flight,
        options: options.headless,
        effort: options.effort.clone(),
    };
    let rows = sweep.run(&settings, &threads, progress)?;
    let base = Clipmap::new(terrain, &settings[0].clipmap(&options.headless.clipmap))?;
    let samples: u64 = base.windows().iter().map(|w| w.heights().len() as u64).sum();
    let height_bytes = [samples * HEIGHT_BYTES, rows[0].height_bytes];
    let storage = storage_costs(&sweep, base.height_range_m(), height_bytes, &threads, progress)?;
    let stability = compare(gpu, progress)?;

    let [dx, dz] = terrain.grid().spacing_m;
    let size = terrain.grid().size;
    let frames = [
        flight.frame_count(),
        sweep.effort.timed(flight).len() as u64,
        sweep.effort.measured(flight).len() as u64,
        u64::from(sweep.effort.rounds),
    ];
    let page = Page {
        terrain: terrain.name(),
        extent: format!(
            "{} x {} samples, {dx:.2} x {dz:.2} m apart",
            size.width, size.height
        ),
        size_px: options.headless.size_px,
        frames,
        device: format!(
            "{} ({}), clipscape {}",
            run.device,
            run.driver,
            env!("CARGO_PKG_VERSION")
        ),
        command: &run.command,
        rows: &rows,
        stability: &stability,
        storage: &storage,
    };
    let report = page.html();
    let summary = json!({
        "version": env!("CARGO_PKG_VERSION"),
        "commit": COMMIT,
        "command": run.command,
        "input": terrain.name(),
        "input_checksum": run.input_checksum,
        "flight_checksum": run.flight_checksum,
        "device": run.device,
        "driver": run.driver,
        "threads": threads.count(),
        "seeds": {"stability": SEED},
        "size_px": options.headless.size_px,
        "frames": frames[0],
        "frames_timed": sweep.effort.timed(flight),
        "frames_measured": sweep.effort.measured(flight),
        "rounds": sweep.effort.rounds,
        "settings": rows.len(),
        "answers": answers(&rows),
        "stability": stability.iter().map(line).collect::<Vec<_>>(),
        "storage": storage.iter().map(cost).collect::<Vec<_>>(),
        "total_s": start.elapsed().as_secs_f64(),
    });
    Ok([csv(&rows), pretty(&schema()), pretty(&summary), report])
}

fn pretty(value: &Value) -> String {
    serde_json::to_string_pretty(value).expect("texts and numbers are valid JSON") + "\n"
}

/// The number of the setting to use for each limit, by each way to keep it; null where none keeps it.
fn answers(rows: &[Row]) -> Vec<Value> {
    let of = |px: f64, criterion| quickest(rows, criterion, px).map(|row| row.number);
    LIMITS_PX
        .iter()
        .map(|&px| {
            json!({
                "error_px": px,
                "measured_p99": of(px, Criterion::Most),
                "measured_max": of(px, Criterion::Greatest),
                "certified": of(px, Criterion::Certified),
            })
        })
        .collect()
}

fn line(line: &Comparison) -> Value {
    json!({
        "what": line.what,
        "compared": line.compared,
        "largest": line.largest,
        "allowed": line.allowed,
        "unit": line.unit,
        "holds": line.holds(),
    })
}

fn cost(cost: &StorageCost) -> Value {
    json!({
        "format": cost.format.name(),
        "change_m_max": cost.change_m[0],
        "change_m_rms": cost.change_m[1],
        "error_px_max": cost.errors.error_px_max,
        "error_px_p99": cost.errors.error_px_p99,
        "error_px_rms": cost.errors.error_px_rms,
        "window_bytes": cost.window_bytes,
        "upload_bytes": cost.upload_bytes,
    })
}
