//! What was measured of one setting, and the columns of `tradeoff.csv` with their schema.

use serde_json::{Value, json};

use super::settings::Setting;
use crate::accuracy::ErrorSummary;

/// What was measured of one setting.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Its number, from 0; the first is the base setting.
    pub number: usize,
    /// How it draws.
    pub setting: Setting,
    /// The name of the filter that made its coarser levels.
    pub filter: String,
    /// Levels of its clipmap.
    pub level_count: u32,
    /// Width of its morph band in steps.
    pub transition: i64,
    /// Whether its picture ends before the DEM does.
    pub cut: bool,
    /// Wall time of whole frames in milliseconds, over all rounds: the median.
    pub frame_ms_median: f64,
    /// The 99th percentile.
    pub frame_ms_p99: f64,
    /// The least and the greatest of the rounds' medians.
    pub frame_ms_spread: [f64; 2],
    /// Triangles, by every frame of the flight: median and greatest.
    pub triangles: [u64; 2],
    /// Bytes uploaded, by every frame of the flight but the first: median and greatest.
    pub upload_bytes: [u64; 2],
    /// Of these the bytes of heights: median.
    pub height_bytes: u64,
    /// Bytes of windows and textures.
    pub memory_bytes: u64,
    /// Errors pooled over the frames that were measured.
    pub errors: ErrorSummary,
    /// The measured frame whose greatest error is the greatest.
    pub worst_frame: Option<u64>,
    /// The greatest error certified beforehand over every frame of the flight, in pixels; none where a frame had none.
    pub certified_error_px: Option<f64>,
    /// Frames of the flight for which nothing was certified.
    pub uncertified_frames: u64,
    /// Pixels that see through the drawn surface, over the measured frames.
    pub cracks: u64,
    /// Peak signal to noise ratio of all shaded pictures against the exact ones, in decibels over a peak of 255; none where
    /// they are equal.
    pub psnr_db: Option<f64>,
    /// Whether no other setting is both quicker and less wrong.
    pub pareto: bool,
}

/// A column of `tradeoff.csv`.
struct Column {
    name: &'static str,
    kind: &'static str,
    unit: &'static str,
    describes: &'static str,
    value: fn(&Row) -> Value,
}

macro_rules! column {
    ($name:literal, $kind:literal, $unit:literal, $describes:literal, $value:expr) => {
        Column {
            name: $name,
            kind: $kind,
            unit: $unit,
            describes: $describes,
            value: $value,
        }
    };
}

const COLUMNS: [Column; 32] = [
    column!(
        "setting",
        "integer",
        "",
        "number of the setting, the base setting is 0",
        |r| json!(r.number)
    ),
    column!(
        "family",
        "string",
        "",
        "what it varies against the base setting: grid (clip size and promised error), transition, levels or filter",
        |r| json!(r.setting.family.name())
    ),
    column!(
        "filter",
        "string",
        "",
        "filter that made the levels above 0",
        |r| json!(r.filter)
    ),
    column!(
        "clip_size",
        "integer",
        "samples",
        "samples along a window's side",
        |r| json!(r.setting.clip_size)
    ),
    column!("levels", "integer", "", "levels of the clipmap", |r| json!(
        r.level_count
    )),
    column!(
        "transition",
        "integer",
        "steps",
        "width of the morph band",
        |r| json!(r.transition)
    ),
    column!(
        "max_error_px",
        "number",
        "px",
        "promised error; empty without a promise",
        |r| json!(r.setting.max_error_px)
    ),
    column!(
        "cut",
        "boolean",
        "",
        "whether the picture ends before the DEM does",
        |r| json!(r.cut)
    ),
    column!(
        "frame_ms_median",
        "number",
        "ms",
        "wall time of whole frames, reading back included: median over all rounds",
        |r| json!(r.frame_ms_median)
    ),
    column!(
        "frame_ms_p99",
        "number",
        "ms",
        "the same: 99th percentile",
        |r| json!(r.frame_ms_p99)
    ),
    column!(
        "frame_ms_least",
        "number",
        "ms",
        "the least of the rounds' medians",
        |r| json!(r.frame_ms_spread[0])
    ),
    column!(
        "frame_ms_greatest",
        "number",
        "ms",
        "the greatest of the rounds' medians",
        |r| json!(r.frame_ms_spread[1])
    ),
    column!(
        "triangles_median",
        "integer",
        "",
        "triangles a frame over every frame of the flight: median",
        |r| json!(r.triangles[0])
    ),
    column!(
        "triangles_greatest",
        "integer",
        "",
        "the same: greatest",
        |r| json!(r.triangles[1])
    ),
    column!(
        "upload_bytes_median",
        "integer",
        "bytes",
        "bytes of samples uploaded a frame, over every frame of the flight but the first: median",
        |r| json!(r.upload_bytes[0])
    ),
    column!(
        "upload_bytes_greatest",
        "integer",
        "bytes",
        "the same: greatest",
        |r| json!(r.upload_bytes[1])
    ),
    column!(
        "memory_bytes",
        "integer",
        "bytes",
        "windows in memory and their textures on the device",
        |r| json!(r.memory_bytes)
    ),
    column!(
        "terrain_px",
        "integer",
        "px",
        "pixels whose error was measured",
        |r| json!(r.errors.terrain_px)
    ),
    column!(
        "error_px_max",
        "number",
        "px",
        "greatest error on the screen over the measured frames; 1.797e308 where a true point is not before the camera",
        |r| json!(r.errors.error_px_max)
    ),
    column!(
        "error_px_p99",
        "number",
        "px",
        "99th percentile over all pixels of the measured frames",
        |r| json!(r.errors.error_px_p99)
    ),
    column!(
        "error_px_rms",
        "number",
        "px",
        "root of the mean square over all pixels of the measured frames",
        |r| json!(r.errors.error_px_rms)
    ),
    column!(
        "error_m_max",
        "number",
        "m",
        "greatest vertical distance between drawn and true surface",
        |r| json!(r.errors.error_m_max)
    ),
    column!(
        "error_floor_px",
        "number",
        "px",
        "the most that rasteriser and f32 depth could add at a pixel, and was taken off",
        |r| json!(r.errors.error_floor_px)
    ),
    column!(
        "worst_frame",
        "integer",
        "",
        "frame of the flight with the greatest error",
        |r| json!(r.worst_frame)
    ),
    column!(
        "certified_error_px",
        "number",
        "px",
        "greatest error certified beforehand over every frame of the flight; empty where a frame had none",
        |r| json!(r.certified_error_px)
    ),
    column!(
        "uncertified_frames",
        "integer",
        "",
        "frames of the flight for which nothing was certified",
        |r| json!(r.uncertified_frames)
    ),
    column!(
        "cracks",
        "integer",
        "px",
        "pixels that see through the drawn surface, over the measured frames",
        |r| json!(r.cracks)
    ),
    column!(
        "beside_px",
        "integer",
        "px",
        "pixels whose depth is that of a triangle beside them, measured where a ray meets that triangle, over the measured frames",
        |r| json!(r.errors.beside_px)
    ),
    column!(
        "silhouette_px",
        "integer",
        "px",
        "pixels at which drawn and exact picture disagree about being terrain, over the measured frames",
        |r| json!(r.errors.silhouette_px)
    ),
    column!(
        "psnr_db",
        "number",
        "dB",
        "peak signal to noise ratio of all shaded pictures of the measured frames against those of the DEM's own surface; empty where they are equal",
        |r| json!(r.psnr_db)
    ),
    column!(
        "pareto",
        "boolean",
        "",
        "whether no other setting beats it in both frame_ms_median and error_px_max; those that are cut, other filters, and those that draw what an earlier one draws, do not compete",
        |r| json!(r.pareto)
    ),
    column!(
        "render",
        "string",
        "",
        "options of `clipscape render` that draw so",
        |r| json!(r.setting.arguments())
    ),
];

/// `tradeoff.csv`: a line of names, then a line for each setting. Texts with commas or quotes are quoted, what is not
/// known is empty.
pub fn csv(rows: &[Row]) -> String {
    let names: Vec<&str> = COLUMNS.iter().map(|c| c.name).collect();
    let mut text = names.join(",") + "\n";
    for row in rows {
        let cells: Vec<String> = COLUMNS.iter().map(|c| cell(&(c.value)(row))).collect();
        text += &cells.join(",");
        text.push('\n');
    }
    text
}

fn cell(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) if text.contains([',', '"', '\n']) => {
            format!("\"{}\"", text.replace('"', "\"\""))
        }
        Value::String(text) => text.clone(),
        // Times have no more than microseconds in them, errors no more than f32.
        Value::Number(n) if n.is_f64() => {
            let value = n.as_f64().unwrap_or_default();
            format!("{}", format!("{value:.6e}").parse::<f64>().unwrap_or(value))
        }
        other => other.to_string(),
    }
}

/// `tradeoff.schema.json`: the columns of `tradeoff.csv` as a Table Schema (Frictionless Data), each with its unit.
pub fn schema() -> Value {
    let fields: Vec<Value> = COLUMNS
        .iter()
        .map(|c| json!({"name": c.name, "type": c.kind, "unit": c.unit, "description": c.describes}))
        .collect();
    json!({"path": "tradeoff.csv", "fields": fields, "missingValues": [""], "primaryKey": "setting"})
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::measure::SettingLists;

    /// A row with these frame times and errors.
    pub(in crate::measure) fn row(number: usize, frame_ms: f64, error_px: f64) -> Row {
        Row {
            number,
            setting: SettingLists::quick().settings().unwrap()[0],
            filter: "sinc-blackman".into(),
            level_count: 4,
            transition: 25,
            cut: false,
            frame_ms_median: frame_ms,
            frame_ms_p99: 2.0 * frame_ms,
            frame_ms_spread: [0.9 * frame_ms, 1.1 * frame_ms],
            triangles: [1000 * number as u64, 2000],
            upload_bytes: [300, 400],
            height_bytes: 100,
            memory_bytes: 1 << 20,
            errors: ErrorSummary {
                error_px_max: error_px,
                error_px_p99: error_px / 4.0,
                error_px_rms: error_px / 9.0,
                ..ErrorSummary::default()
            },
            worst_frame: Some(3),
            certified_error_px: Some(2.0 * error_px),
            uncertified_frames: 0,
            cracks: 0,
            psnr_db: Some(40.0),
            pareto: false,
        }
    }

    #[test]
    fn every_line_has_a_cell_for_every_field_of_the_schema() {
        let mut odd = row(1, 4.0, 1.0 / 3.0);
        odd.filter = "a, \"b\"".into();
        odd.certified_error_px = None;
        let text = csv(&[row(0, 5.0, 0.5), odd]);
        let lines: Vec<&str> = text.lines().collect();
        let schema = schema();
        let fields = schema["fields"].as_array().unwrap();
        let names: Vec<&str> = fields.iter().map(|f| f["name"].as_str().unwrap()).collect();
        assert_eq!(lines[0].split(',').collect::<Vec<_>>(), names);
        assert_eq!(lines[1].split(',').count(), names.len());
        assert!(
            lines[2].contains("\"a, \"\"b\"\"\"") && lines[2].contains(",0.3333333,"),
            "{}",
            lines[2]
        );
        for field in fields {
            let kind = field["type"].as_str().unwrap();
            assert!(["string", "integer", "number", "boolean"].contains(&kind));
            assert!(!field["description"].as_str().unwrap().is_empty());
        }
        let mut unique = names.clone();
        unique.sort_unstable();
        unique.dedup();
        assert_eq!(unique.len(), names.len());
    }
}
