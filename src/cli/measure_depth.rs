//! `clipscape measure --depth`: a frame that another program drew of a DEM, by the ruler of this one's own frames.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use super::args::MeasureArgs;
use super::progress::Terminal;
use super::{Outcome, print};
use crate::accuracy::{Distances, ErrorSummary, parse_camera};
use crate::build::Threads;
use crate::clipmap::ClipmapOptions;
use crate::error::Error;
use crate::query::Truth;
use crate::source;
use crate::stream::Terrain;

/// Runs the command for the files of distances and of the camera.
pub(super) fn run(args: &MeasureArgs, [depth, camera]: [&Path; 2], terminal: &Terminal) -> Outcome {
    let clipmap = ClipmapOptions {
        vertical_scale: args.vertical_scale,
        ..Default::default()
    };
    clipmap.check()?;
    let name = camera.display().to_string();
    let json = fs::read_to_string(camera).map_err(|e| Error::io(&name, e))?;
    let camera = parse_camera(&name, &json)?;
    let distances = Distances::open(&depth.display().to_string(), source::open_file(depth)?)?;
    let terrain = Terrain::open_with(&args.input.inputs, &args.input.read.options(), terminal)?;
    let truth = Truth::new(&terrain, args.vertical_scale);
    let errors = distances.measure(&truth, &camera, &Threads::new(0)?)?;
    print(&text(distances.size_px(), &errors.summary, args.json))
}

/// The figures for a program, or for a person.
fn text([width, height]: [u32; 2], summary: &ErrorSummary, json: bool) -> String {
    let figures = [
        ("error_px_max", "greatest error", summary.error_px_max, "px"),
        ("error_px_p99", "99th percentile", summary.error_px_p99, "px"),
        ("error_px_rms", "root mean square", summary.error_px_rms, "px"),
        (
            "error_m_max",
            "greatest error of a height",
            summary.error_m_max,
            "m",
        ),
        (
            "error_floor_px",
            "greatest floor taken off",
            summary.error_floor_px,
            "px",
        ),
    ];
    if json {
        let mut object = serde_json::Map::new();
        object.insert("width".into(), width.into());
        object.insert("height".into(), height.into());
        object.insert("terrain_px".into(), summary.terrain_px.into());
        for (name, _, value, _) in figures {
            object.insert(name.into(), value.into());
        }
        object.insert("silhouette_px".into(), summary.silhouette_px.into());
        return format!("{}\n", serde_json::Value::Object(object));
    }
    let mut out = format!(
        "{width} x {height} pixels, {} of them terrain\n",
        summary.terrain_px
    );
    for (_, what, value, unit) in figures {
        writeln!(out, "{what}: {value:.4} {unit}").expect("a String takes all that is written");
    }
    out + &format!(
        "terrain where none should be, or none where some should: {} pixels\n",
        summary.silhouette_px
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_for_programs_or_for_people() {
        let summary = ErrorSummary {
            terrain_px: 5,
            error_px_max: f64::MAX,
            silhouette_px: 1,
            ..ErrorSummary::default()
        };
        let json: serde_json::Value = serde_json::from_str(&text([3, 2], &summary, true)).unwrap();
        assert_eq!(
            (json["width"].as_u64(), json["terrain_px"].as_u64()),
            (Some(3), Some(5))
        );
        assert_eq!(json["error_px_max"].as_f64(), Some(f64::MAX));
        assert!(text([3, 2], &summary, false).contains("3 x 2 pixels, 5 of them terrain"));
    }
}
