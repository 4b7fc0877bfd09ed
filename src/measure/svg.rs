//! Plots as SVG text: [`Plot`], marks and lines over two axes, and [`Dots`], rows of dots over one; here what they share.
//!
//! Light, without scripts or outside parts; every mark tells its numbers where the pointer rests on it (a `title`).

mod axis;
mod dots;
mod plot;
mod shape;

pub(super) use axis::Axis;
pub(super) use dots::{DotRow, Dots};
pub(super) use plot::{Line, Mark, Plot};
pub(super) use shape::{COLOURS, Shape};

use std::fmt::Write;

const WIDTH: f64 = 860.0;
const HEIGHT: f64 = 460.0;
const LEFT: f64 = 78.0;
const RIGHT: f64 = 190.0;
const TOP: f64 = 16.0;
const BOTTOM: f64 = 56.0;

/// A line of the legend: a mark or a line, and its meaning.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Key {
    Head(String),
    Mark(Shape, &'static str, String),
    Line(&'static str, bool, String),
}

fn open(height: f64) -> String {
    format!(
        "<div class=\"scroll\"><svg viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" xmlns=\"http://www.w3.org/2000/svg\">"
    )
}

fn dash(dashed: bool) -> &'static str {
    if dashed { " stroke-dasharray=\"6 4\"" } else { "" }
}

/// Where a value lies along the x axis.
fn along(axis: &Axis, left: f64, value: f64) -> f64 {
    left + axis.at(value) * (WIDTH - left - RIGHT)
}

/// The x axis at the foot of a picture, from `left` on, with its grid up to the top.
fn axis_x(axis: &Axis, height: f64, left: f64) -> String {
    let mut text = String::new();
    for tick in axis.ticks() {
        let x = along(axis, left, tick);
        let _ = write!(
            text,
            "<line class=\"grid\" x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{TOP}\" y2=\"{:.1}\"/>\
             <text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
            height - BOTTOM,
            height - BOTTOM + 18.0,
            number(tick)
        );
    }
    let _ = write!(
        text,
        "<text class=\"axis\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
        (left + WIDTH - RIGHT) / 2.0,
        height - 12.0,
        escape(&axis.label)
    );
    text
}

fn legend(keys: &[Key]) -> String {
    let mut text = String::new();
    let x = WIDTH - RIGHT + 18.0;
    for (k, key) in keys.iter().enumerate() {
        let y = TOP + 12.0 + 21.0 * k as f64;
        let name = match key {
            Key::Head(name) => {
                let _ = write!(
                    text,
                    "<text class=\"axis\" x=\"{x:.1}\" y=\"{:.1}\">{}</text>",
                    y + 4.0,
                    escape(name)
                );
                continue;
            }
            Key::Mark(shape, colour, name) => {
                text += &shape.draw(x + 6.0, y, 5.5, colour);
                text += shape.end();
                name
            }
            Key::Line(colour, dashed, name) => {
                let _ = write!(
                    text,
                    "<line stroke=\"{colour}\" stroke-width=\"1.8\"{} x1=\"{:.1}\" x2=\"{:.1}\" y1=\"{y:.1}\" y2=\"{y:.1}\"/>",
                    dash(*dashed),
                    x - 3.0,
                    x + 15.0
                );
                name
            }
        };
        let _ = write!(
            text,
            "<text x=\"{:.1}\" y=\"{:.1}\">{}</text>",
            x + 22.0,
            y + 4.0,
            escape(name)
        );
    }
    text
}

/// A number as people read it: three figures, thousands and millions by letter.
pub(super) fn number(value: f64) -> String {
    let size = value.abs();
    let (value, unit) = match size {
        // What measuring says where no number of pixels is enough.
        s if s >= 1e300 => return "∞".into(),
        s if s >= 1e15 || s.is_nan() => return format!("{value:.2e}"),
        s if s >= 1e6 => (value / 1e6, " M"),
        s if s >= 1e4 => (value / 1e3, " k"),
        _ => (value, ""),
    };
    let size = value.abs();
    let text = match size {
        0.0 => "0".into(),
        s if s >= 100.0 => format!("{value:.0}"),
        s if s >= 10.0 => format!("{value:.1}"),
        s if s >= 1.0 => format!("{value:.2}"),
        s if s >= 0.1 => format!("{value:.3}"),
        s if s >= 0.001 => format!("{value:.4}"),
        _ => format!("{value:.2e}"),
    };
    let text = if text.contains('.') && !text.contains('e') {
        text.trim_end_matches('0').trim_end_matches('.').to_string()
    } else {
        text
    };
    text + unit
}

/// Text for HTML and SVG.
pub(super) fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        for (value, text) in [
            (0.0, "0"),
            (0.25, "0.25"),
            (1.0, "1"),
            (48.04, "48"),
            (86_712.0, "86.7 k"),
            (1_500_000.0, "1.5 M"),
            (0.00012, "1.20e-4"),
            (-3.5, "-3.5"),
            (f64::MAX, "∞"),
        ] {
            assert_eq!(number(value), text);
        }
    }
}
