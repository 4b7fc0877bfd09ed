//! The tables of the report.

use std::fmt::Write;

use super::LIMITS_PX;
use crate::measure::pareto::{Criterion, nearest, quickest};
use crate::measure::row::Row;
use crate::measure::stability::Comparison;
use crate::measure::storage::StorageCost;
use crate::measure::svg::{escape, number};

/// A table: heads, and cells a line; what begins with `<` left is text and stands left, what is below a `class` is marked.
struct Table {
    wide: bool,
    heads: Vec<Cell>,
    lines: Vec<(&'static str, Vec<Cell>)>,
}

enum Cell {
    Text(String),
    Number(String),
    /// HTML that is written as it is.
    Markup(String),
}

impl Table {
    fn html(&self) -> String {
        let mut text = format!(
            "<div class=\"scroll\"><table{}>",
            if self.wide { " class=\"wide\"" } else { "" }
        );
        row(&mut text, "th", "", &self.heads);
        for (class, cells) in &self.lines {
            row(&mut text, "td", class, cells);
        }
        text + "</table></div>\n"
    }
}

fn row(text: &mut String, tag: &str, class: &str, cells: &[Cell]) {
    let class = if class.is_empty() {
        String::new()
    } else {
        format!(" class=\"{class}\"")
    };
    let _ = write!(text, "<tr{class}>");
    for cell in cells {
        let _ = match cell {
            Cell::Text(t) => write!(text, "<{tag} class=\"text\">{}</{tag}>", escape(t)),
            Cell::Number(t) => write!(text, "<{tag}>{}</{tag}>", escape(t)),
            Cell::Markup(t) => write!(text, "<{tag} class=\"text\">{t}</{tag}>"),
        };
    }
    text.push_str("</tr>\n");
}

fn text(t: impl Into<String>) -> Cell {
    Cell::Text(t.into())
}

fn of(value: f64) -> Cell {
    Cell::Number(number(value))
}

fn maybe(value: Option<f64>) -> Cell {
    Cell::Number(value.map_or_else(|| "–".into(), number))
}

/// Bytes as people read them.
fn bytes(count: u64) -> Cell {
    let count = count as f64;
    let (value, unit) = match count {
        c if c >= 1_048_576.0 => (c / 1_048_576.0, "MiB"),
        c if c >= 1024.0 => (c / 1024.0, "KiB"),
        c => (c, "B"),
    };
    Cell::Number(format!("{} {unit}", number(value)))
}

/// The quickest setting for each limit by each criterion.
pub(super) fn answers(rows: &[Row]) -> String {
    let unit = |px: f64| if px == 1.0 { "pixel" } else { "pixels" };
    let mut table = Table {
        wide: false,
        heads: vec![text("error kept by")],
        lines: Vec::new(),
    };
    for px in LIMITS_PX {
        table.heads.push(text(format!("{} {}", number(px), unit(px))));
    }
    for criterion in Criterion::ALL {
        let mut cells = vec![text(criterion.phrase())];
        for px in LIMITS_PX {
            cells.push(match quickest(rows, criterion, px) {
                Some(row) => Cell::Markup(format!(
                    "<code>{}</code><br>{} ms, {} px",
                    escape(&row.setting.arguments()),
                    number(row.frame_ms_median),
                    criterion.error_px(row).map_or_else(String::new, number)
                )),
                None => Cell::Markup(nearest(rows, criterion).map_or_else(
                    || "<span class=\"quiet\">none</span>".into(),
                    |row| {
                        format!(
                            "<span class=\"quiet\">none; nearest <code>{}</code>, {} px</span>",
                            escape(&row.setting.arguments()),
                            criterion.error_px(row).map_or_else(String::new, number)
                        )
                    },
                )),
            });
        }
        table.lines.push(("", cells));
    }
    table.html()
}

/// Every setting.
pub(super) fn settings(rows: &[Row]) -> String {
    let number_heads = [
        "clip size",
        "promised px",
        "T",
        "levels",
        "frame ms",
        "spread ms",
        "99 % ms",
        "triangles",
        "upload",
        "memory",
        "max px",
        "99 % px",
        "RMS px",
        "max m",
        "certified px",
        "cracks",
        "silhouette px",
    ];
    let mut heads = vec![text("varies"), text("filter")];
    heads.extend(number_heads.map(|h| Cell::Number(h.into())));
    let line = |row: &Row| {
        let class = if row.cut {
            "cut"
        } else if row.pareto {
            "front"
        } else {
            ""
        };
        let [least, most] = row.frame_ms_spread;
        let cells = vec![
            text(row.setting.family.name()),
            text(row.filter.clone()),
            Cell::Number(row.setting.clip_size.to_string()),
            maybe(row.setting.max_error_px),
            Cell::Number(row.transition.to_string()),
            Cell::Number(row.level_count.to_string()),
            of(row.frame_ms_median),
            Cell::Number(format!("{}–{}", number(least), number(most))),
            of(row.frame_ms_p99),
            of(row.triangles[0] as f64),
            bytes(row.upload_bytes[0]),
            bytes(row.memory_bytes),
            of(row.errors.error_px_max),
            of(row.errors.error_px_p99),
            of(row.errors.error_px_rms),
            of(row.errors.error_m_max),
            maybe(row.certified_error_px),
            Cell::Number(row.cracks.to_string()),
            Cell::Number(row.errors.silhouette_px.to_string()),
        ];
        (class, cells)
    };
    Table {
        wide: true,
        heads,
        lines: rows.iter().map(line).collect(),
    }
    .html()
}

/// The comparisons of numerical stability.
pub(super) fn stability(lines: &[Comparison]) -> String {
    let line = |line: &Comparison| {
        let found = format!("{} {}", number(line.largest), line.unit);
        let cells = vec![
            text(line.what.clone()),
            text(line.compared.clone()),
            if line.holds() {
                Cell::Number(found)
            } else {
                Cell::Markup(format!("<span class=\"fails\">{}</span>", escape(&found)))
            },
            Cell::Number(format!("{} {}", number(line.allowed), line.unit)),
        ];
        ("", cells)
    };
    Table {
        wide: false,
        heads: vec![
            text("extreme"),
            text("compared"),
            Cell::Number("largest difference".into()),
            Cell::Number("allowed".into()),
        ],
        lines: lines.iter().map(line).collect(),
    }
    .html()
}

/// What fewer bits cost.
pub(super) fn storage(costs: &[StorageCost]) -> String {
    let heads = [
        "changes at most, m",
        "RMS, m",
        "adds at most, px",
        "99 % px",
        "RMS px",
        "windows on the device",
        "upload a frame",
    ];
    let line = |cost: &StorageCost| {
        let cells = vec![
            text(cost.format.name()),
            of(cost.change_m[0]),
            of(cost.change_m[1]),
            of(cost.errors.error_px_max),
            of(cost.errors.error_px_p99),
            of(cost.errors.error_px_rms),
            bytes(cost.window_bytes),
            bytes(cost.upload_bytes),
        ];
        ("", cells)
    };
    let mut all = vec![text("heights as")];
    all.extend(heads.map(|h| Cell::Number(h.into())));
    Table {
        wide: false,
        heads: all,
        lines: costs.iter().map(line).collect(),
    }
    .html()
}
