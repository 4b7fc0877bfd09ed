//! The plots of the report.

use crate::measure::row::Row;
use crate::measure::settings::Family;
use crate::measure::svg::{Axis, COLOURS, DotRow, Dots, Key, Line, Mark, Plot, Shape, number};

/// The families of settings that vary one thing, with the title and the words of their plots.
pub(super) const FAMILIES: [(Family, &str, &str); 3] = [
    (
        Family::Filter,
        "Filters of the coarser levels",
        "The base setting with coarser levels made by other filters. Left is better.",
    ),
    (
        Family::Transition,
        "Width of the morph band",
        "The base setting with other transitions T, in steps of a level: a wide band moves more vertices to the coarser \
         surface, a narrow one changes faster.",
    ),
    (
        Family::Levels,
        "Number of levels",
        "The base setting with only its finest levels. What lies beyond them is not drawn, so it is not measured either, \
         and the picture ends early.",
    ),
];

/// What is written under the pointer.
fn title(row: &Row) -> String {
    format!(
        "{}: {} ms, {} triangles; max {} px, 99 % {} px, RMS {} px",
        row.setting.arguments(),
        number(row.frame_ms_median),
        number(row.triangles[0] as f64),
        number(row.errors.error_px_max),
        number(row.errors.error_px_p99),
        number(row.errors.error_px_rms)
    )
}

/// The values that occur, in order of first appearance.
fn distinct<T: PartialEq>(values: impl Iterator<Item = T>) -> Vec<T> {
    let mut all = Vec::new();
    for value in values {
        if !all.contains(&value) {
            all.push(value);
        }
    }
    all
}

/// How rows look: a colour for each clip size, a shape for each promised error.
struct Look {
    clip_sizes: Vec<i64>,
    promises: Vec<Option<f64>>,
}

impl Look {
    fn new(rows: &[&Row]) -> Self {
        let mut clip_sizes = distinct(rows.iter().map(|r| r.setting.clip_size));
        clip_sizes.sort_unstable();
        let mut promises = distinct(rows.iter().map(|r| r.setting.max_error_px));
        promises.sort_by(|a, b| a.unwrap_or(0.0).total_cmp(&b.unwrap_or(0.0)));
        Self { clip_sizes, promises }
    }

    fn of(&self, row: &Row) -> (Shape, &'static str) {
        let place = |at: Option<usize>| at.unwrap_or_default();
        let colour = place(self.clip_sizes.iter().position(|n| *n == row.setting.clip_size));
        let shape = place(self.promises.iter().position(|e| *e == row.setting.max_error_px));
        (
            Shape::ALL[shape % Shape::ALL.len()],
            COLOURS[colour % COLOURS.len()],
        )
    }

    fn keys(&self) -> Vec<Key> {
        let mut keys = vec![Key::Head("clip size".into())];
        for (k, n) in self.clip_sizes.iter().enumerate() {
            keys.push(Key::Mark(
                Shape::Circle,
                COLOURS[k % COLOURS.len()],
                n.to_string(),
            ));
        }
        keys.push(Key::Head("promised error".into()));
        for (k, promise) in self.promises.iter().enumerate() {
            let name = promise.map_or_else(|| "none".into(), |px| format!("{px} px"));
            keys.push(Key::Mark(Shape::ALL[k % Shape::ALL.len()], "#555555", name));
        }
        keys
    }
}

/// Rows that are no others' filter, transition or levels, and whose pictures are whole.
fn grid(rows: &[Row]) -> Vec<&Row> {
    rows.iter()
        .filter(|r| r.setting.family == Family::Grid && !r.cut)
        .collect()
}

fn marks(rows: &[&Row], look: &Look, at: impl Fn(&Row) -> [f64; 2], with_spread: bool) -> Vec<Mark> {
    let mark = |row: &&Row| {
        let (shape, colour) = look.of(row);
        Mark {
            at: at(row),
            spread: with_spread.then_some(row.frame_ms_spread),
            shape,
            colour,
            title: title(row),
            label: row.pareto.then(|| row.setting.label()),
        }
    };
    rows.iter().map(mark).collect()
}

/// Frame time against the greatest error, with the front.
pub(super) fn time_against_error(rows: &[Row]) -> String {
    // Those on the front are shown whatever their family.
    let shown: Vec<&Row> = rows
        .iter()
        .filter(|r| !r.cut && (r.setting.family == Family::Grid || r.pareto))
        .collect();
    let look = Look::new(&shown);
    let at = |row: &Row| [row.frame_ms_median, row.errors.error_px_max];
    let mut front: Vec<[f64; 2]> = rows.iter().filter(|r| r.pareto).map(at).collect();
    front.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut legend = look.keys();
    legend.push(Key::Line("#999999", false, "Pareto front".into()));
    Plot {
        x: Axis::log(
            "frame time, median, ms",
            shown
                .iter()
                .flat_map(|r| [r.frame_ms_median, r.frame_ms_spread[0], r.frame_ms_spread[1]]),
        ),
        y: Axis::log(
            "greatest error, pixels",
            shown.iter().map(|r| r.errors.error_px_max),
        ),
        lines: vec![Line {
            points: front,
            colour: "#999999",
            dashed: false,
        }],
        marks: marks(&shown, &look, at, true),
        legend,
    }
    .svg()
}

/// Triangles against the 99th percentile of the error.
pub(super) fn triangles_against_error(rows: &[Row]) -> String {
    let shown = grid(rows);
    let look = Look::new(&shown);
    let at = |row: &Row| [row.triangles[0] as f64, row.errors.error_px_p99];
    // Lines join settings of one promise: what the clip size does to them.
    let lines = look.promises.iter().map(|promise| {
        let mut points: Vec<[f64; 2]> = shown
            .iter()
            .filter(|r| r.setting.max_error_px == *promise)
            .map(|r| at(r))
            .collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        Line {
            points,
            colour: "#cccccc",
            dashed: promise.is_some(),
        }
    });
    let mut legend = look.keys();
    legend.push(Key::Line("#bbbbbb", false, "no promise".into()));
    if look.promises.len() > 1 {
        legend.push(Key::Line("#bbbbbb", true, "one promise".into()));
    }
    Plot {
        x: Axis::log(
            "triangles a frame, median",
            shown.iter().map(|r| r.triangles[0] as f64),
        ),
        y: Axis::log(
            "error of 99 of 100 pixels, pixels",
            shown.iter().map(|r| r.errors.error_px_p99),
        ),
        lines: lines.collect(),
        marks: marks(&shown, &look, at, false),
        legend,
    }
    .svg()
}

/// The greatest error measured against the one certified; none where nothing was certified.
pub(super) fn measured_against_certified(rows: &[Row]) -> Option<String> {
    let shown: Vec<&Row> = grid(rows)
        .into_iter()
        .filter(|r| r.certified_error_px.is_some())
        .collect();
    if shown.is_empty() {
        return None;
    }
    let look = Look::new(&shown);
    let certified = |row: &Row| row.certified_error_px.unwrap_or_default();
    let at = |row: &Row| [certified(row), row.errors.error_px_max];
    let both = || shown.iter().flat_map(|r| at(r));
    let (x, y) = (
        Axis::log("greatest error certified, pixels", both()),
        Axis::log("greatest error measured, pixels", both()),
    );
    let ends = both()
        .filter(|v| *v > 0.0)
        .fold((f64::INFINITY, 0.0f64), |(l, h), v| (l.min(v), h.max(v)));
    let mut legend = look.keys();
    legend.push(Key::Line("#d55e00", true, "both equal".into()));
    let plot = Plot {
        x,
        y,
        lines: vec![Line {
            points: vec![[ends.0, ends.0], [ends.1, ends.1]],
            colour: "#d55e00",
            dashed: true,
        }],
        marks: marks(&shown, &look, at, false),
        legend,
    };
    Some(plot.svg())
}

/// The errors of a family beside the base setting; empty where there is none.
pub(super) fn family(rows: &[Row], family: Family) -> String {
    let others: Vec<&Row> = rows.iter().filter(|r| r.setting.family == family).collect();
    let (Some(base), false) = (rows.first(), others.is_empty()) else {
        return String::new();
    };
    let name = |row: &Row| match family {
        Family::Filter if row.number == base.number => format!("{} (input)", row.filter),
        Family::Filter => row.filter.clone(),
        Family::Transition => format!("T = {}", row.transition),
        Family::Levels => format!("{} levels", row.level_count),
        Family::Grid => row.setting.label(),
    };
    let mut shown = vec![base];
    shown.extend(others);
    match family {
        Family::Transition => shown.sort_by_key(|r| r.transition),
        Family::Levels => shown.sort_by_key(|r| r.level_count),
        Family::Filter => shown.sort_by(|a, b| a.errors.error_px_rms.total_cmp(&b.errors.error_px_rms)),
        Family::Grid => {}
    }
    let errors = |r: &Row| {
        vec![
            r.errors.error_px_rms,
            r.errors.error_px_p99,
            r.errors.error_px_max,
        ]
    };
    Dots {
        x: Axis::log("error, pixels", shown.iter().flat_map(|r| errors(r))),
        series: ["RMS", "99 of 100 pixels", "greatest"].map(String::from).into(),
        rows: shown
            .iter()
            .map(|r| DotRow {
                name: name(r),
                values: errors(r),
            })
            .collect(),
    }
    .svg()
}
