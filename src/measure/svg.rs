//! Plots as SVG text: marks and lines over two axes, and rows of dots over one.
//!
//! Light, without scripts or outside parts; every mark tells its numbers where the pointer rests on it (a `title`).

use std::fmt::Write;

/// Colours that people with any colour vision tell apart (M. Okabe and K. Ito, *Color Universal Design*, 2008).
pub(super) const COLOURS: [&str; 7] = [
    "#0072b2", "#e69f00", "#009e73", "#cc79a7", "#d55e00", "#56b4e9", "#555555",
];

const WIDTH: f64 = 860.0;
const HEIGHT: f64 = 460.0;
const LEFT: f64 = 78.0;
const RIGHT: f64 = 190.0;
const TOP: f64 = 16.0;
const BOTTOM: f64 = 56.0;

/// The form of a mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    Circle,
    Square,
    Triangle,
    Diamond,
    Cross,
    Plus,
}

impl Shape {
    pub(super) const ALL: [Self; 6] = [
        Self::Circle,
        Self::Square,
        Self::Triangle,
        Self::Diamond,
        Self::Cross,
        Self::Plus,
    ];

    /// The mark at (x, y), `r` in size.
    fn draw(self, x: f64, y: f64, r: f64, colour: &str) -> String {
        let solid = format!("fill=\"{colour}\" fill-opacity=\"0.85\" stroke=\"#fff\" stroke-width=\"0.8\"");
        let stroke = format!("fill=\"none\" stroke=\"{colour}\" stroke-width=\"2.2\"");
        let path = |points: &[[f64; 2]]| {
            let points: Vec<String> = points
                .iter()
                .map(|[dx, dy]| format!("{:.1},{:.1}", x + dx * r, y + dy * r))
                .collect();
            points.join(" ")
        };
        match self {
            Self::Circle => format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{r:.1}\" {solid}>"),
            Self::Square => {
                let points = path(&[[-0.9, -0.9], [0.9, -0.9], [0.9, 0.9], [-0.9, 0.9]]);
                format!("<polygon points=\"{points}\" {solid}>")
            }
            Self::Triangle => {
                let points = path(&[[0.0, -1.15], [1.1, 0.85], [-1.1, 0.85]]);
                format!("<polygon points=\"{points}\" {solid}>")
            }
            Self::Diamond => {
                let points = path(&[[0.0, -1.25], [1.1, 0.0], [0.0, 1.25], [-1.1, 0.0]]);
                format!("<polygon points=\"{points}\" {solid}>")
            }
            Self::Cross => {
                let (a, b) = (0.85 * r, 0.85 * r);
                format!(
                    "<path d=\"M{:.1} {:.1}L{:.1} {:.1}M{:.1} {:.1}L{:.1} {:.1}\" {stroke}>",
                    x - a,
                    y - b,
                    x + a,
                    y + b,
                    x - a,
                    y + b,
                    x + a,
                    y - b
                )
            }
            Self::Plus => format!(
                "<path d=\"M{:.1} {y:.1}L{:.1} {y:.1}M{x:.1} {:.1}L{x:.1} {:.1}\" {stroke}>",
                x - r,
                x + r,
                y - r,
                y + r
            ),
        }
    }

    fn end(self) -> &'static str {
        match self {
            Self::Circle => "</circle>",
            Self::Cross | Self::Plus => "</path>",
            _ => "</polygon>",
        }
    }
}

/// A logarithmic axis: what it says, and the range of its values.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Axis {
    label: String,
    low: f64,
    high: f64,
}

impl Axis {
    /// A logarithmic axis over `values`, those not above 0 left out and those that stand for no number.
    pub(super) fn log(label: &str, values: impl Iterator<Item = f64>) -> Self {
        let (low, high) = values
            .filter(|v| (f64::MIN_POSITIVE..1e300).contains(v))
            .fold((f64::INFINITY, 0.0f64), |(low, high), v| {
                (low.min(v), high.max(v))
            });
        let (low, high) = if low <= high { (low, high) } else { (0.1, 10.0) };
        // Room at both ends, and never less than a factor of 3 between them.
        let widen = (3f64.sqrt() / (high / low).sqrt()).max(1.12);
        Self {
            label: label.into(),
            low: low / widen,
            high: high * widen,
        }
    }

    /// Where a value lies: 0 at the low end, 1 at the high one; values outside lie on the nearest end.
    fn at(&self, value: f64) -> f64 {
        let share = (value.max(f64::MIN_POSITIVE) / self.low).ln() / (self.high / self.low).ln();
        share.clamp(0.0, 1.0)
    }

    /// Values at which the axis is marked.
    fn ticks(&self) -> Vec<f64> {
        let (from, to) = (self.low.log10().floor() as i32, self.high.log10().ceil() as i32);
        // The fewer powers of ten, the more between them.
        let steps: &[f64] = match (self.high / self.low).log10() {
            powers if powers < 0.9 => &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0],
            powers if powers < 4.0 => &[1.0, 2.0, 5.0],
            _ => &[1.0],
        };
        let all = (from..=to).flat_map(|k| steps.iter().map(move |m| m * 10f64.powi(k)));
        all.filter(|v| (self.low..=self.high).contains(v)).collect()
    }
}

/// A point of a plot.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Mark {
    pub(super) at: [f64; 2],
    /// From where to where it spreads along the x axis.
    pub(super) spread: Option<[f64; 2]>,
    pub(super) shape: Shape,
    pub(super) colour: &'static str,
    /// What it says under the pointer.
    pub(super) title: String,
    /// What is written beside it.
    pub(super) label: Option<String>,
}

/// A line through points.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Line {
    pub(super) points: Vec<[f64; 2]>,
    pub(super) colour: &'static str,
    pub(super) dashed: bool,
}

/// A line of the legend: a mark or a line, and its meaning.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Key {
    Head(String),
    Mark(Shape, &'static str, String),
    Line(&'static str, bool, String),
}

/// Marks and lines over two axes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Plot {
    pub(super) x: Axis,
    pub(super) y: Axis,
    pub(super) lines: Vec<Line>,
    pub(super) marks: Vec<Mark>,
    pub(super) legend: Vec<Key>,
}

impl Plot {
    pub(super) fn svg(&self) -> String {
        let place = |[x, y]: [f64; 2]| {
            [
                LEFT + self.x.at(x) * (WIDTH - LEFT - RIGHT),
                HEIGHT - BOTTOM - self.y.at(y) * (HEIGHT - TOP - BOTTOM),
            ]
        };
        let mut text = open(HEIGHT);
        text += &axis_x(&self.x, HEIGHT, TOP);
        for tick in self.y.ticks() {
            let [_, y] = place([self.x.low, tick]);
            let _ = write!(
                text,
                "<line class=\"grid\" x1=\"{LEFT}\" x2=\"{:.1}\" y1=\"{y:.1}\" y2=\"{y:.1}\"/>\
                 <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                WIDTH - RIGHT,
                LEFT - 8.0,
                y + 4.0,
                number(tick)
            );
        }
        let middle = TOP + (HEIGHT - TOP - BOTTOM) / 2.0;
        let _ = write!(
            text,
            "<text class=\"axis\" text-anchor=\"middle\" transform=\"translate(18 {middle:.1}) rotate(-90)\">{}</text>",
            escape(&self.y.label)
        );
        for line in &self.lines {
            let points: Vec<String> = line
                .points
                .iter()
                .map(|p| place(*p))
                .map(|[x, y]| format!("{x:.1},{y:.1}"))
                .collect();
            let _ = write!(
                text,
                "<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"1.8\"{} points=\"{}\"/>",
                line.colour,
                dash(line.dashed),
                points.join(" ")
            );
        }
        for mark in &self.marks {
            if let Some([from, to]) = mark.spread {
                let ([x0, y], [x1, _]) = (place([from, mark.at[1]]), place([to, mark.at[1]]));
                let _ = write!(
                    text,
                    "<line stroke=\"{}\" stroke-opacity=\"0.6\" x1=\"{x0:.1}\" x2=\"{x1:.1}\" y1=\"{y:.1}\" y2=\"{y:.1}\"/>",
                    mark.colour
                );
            }
        }
        for mark in &self.marks {
            let [x, y] = place(mark.at);
            text += &mark.shape.draw(x, y, 5.5, mark.colour);
            let _ = write!(text, "<title>{}</title>{}", escape(&mark.title), mark.shape.end());
        }
        text += &self.labels(&place);
        text += &legend(&self.legend);
        text + "</svg>"
    }

    /// The marks' labels, each where it covers no other: right, left, above or below of its mark.
    fn labels(&self, place: &dyn Fn([f64; 2]) -> [f64; 2]) -> String {
        let mut taken: Vec<[f64; 4]> = self
            .marks
            .iter()
            .map(|m| place(m.at))
            .map(|[x, y]| [x - 6.0, y - 6.0, x + 6.0, y + 6.0])
            .collect();
        let mut text = String::new();
        for mark in &self.marks {
            let Some(label) = &mark.label else { continue };
            let [x, y] = place(mark.at);
            let width = 6.4 * label.chars().count() as f64;
            let places = [
                [x + 9.0, y - 9.0],
                [x + 9.0, y + 15.0],
                [x - 9.0 - width, y + 15.0],
                [x - 9.0 - width, y - 9.0],
                [x - width / 2.0, y - 12.0],
                [x - width / 2.0, y + 22.0],
            ];
            let boxed = |[x, y]: [f64; 2]| [x, y - 11.0, x + width, y + 3.0];
            let free = |b: &[f64; 4]| {
                let inside = b[0] >= LEFT && b[2] <= WIDTH - 2.0 && b[1] >= 0.0 && b[3] <= HEIGHT - BOTTOM;
                inside
                    && taken
                        .iter()
                        .all(|t| b[2] < t[0] || b[0] > t[2] || b[3] < t[1] || b[1] > t[3])
            };
            // Where there is no room, what the pointer tells must do.
            let Some(at) = places.into_iter().find(|p| free(&boxed(*p))) else {
                continue;
            };
            taken.push(boxed(at));
            let _ = write!(
                text,
                "<text class=\"label\" x=\"{:.1}\" y=\"{:.1}\">{}</text>",
                at[0],
                at[1],
                escape(label)
            );
        }
        text
    }
}

/// A row of dots: a name, and a value for each series.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct DotRow {
    pub(super) name: String,
    pub(super) values: Vec<f64>,
}

/// Rows of dots over one axis, a series a colour.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Dots {
    pub(super) x: Axis,
    pub(super) series: Vec<String>,
    pub(super) rows: Vec<DotRow>,
}

impl Dots {
    pub(super) fn svg(&self) -> String {
        const ROW: f64 = 30.0;
        // Names stand where a plot has its y axis, and need more room.
        const NAMES: f64 = LEFT + 92.0;
        let height = TOP + BOTTOM + ROW * self.rows.len() as f64;
        let along = |value: f64| NAMES + self.x.at(value) * (WIDTH - NAMES - RIGHT);
        let mut text = open(height);
        for tick in self.x.ticks() {
            let x = along(tick);
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
            (NAMES + WIDTH - RIGHT) / 2.0,
            height - 12.0,
            escape(&self.x.label)
        );
        for (k, row) in self.rows.iter().enumerate() {
            let y = TOP + ROW * (k as f64 + 0.5);
            let _ = write!(
                text,
                "<line class=\"grid\" x1=\"{NAMES}\" x2=\"{:.1}\" y1=\"{y:.1}\" y2=\"{y:.1}\"/>\
                 <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                WIDTH - RIGHT,
                NAMES - 10.0,
                y + 4.0,
                escape(&row.name)
            );
            for (s, &value) in row.values.iter().enumerate() {
                let (shape, colour) = (Shape::ALL[s % Shape::ALL.len()], COLOURS[s % COLOURS.len()]);
                text += &shape.draw(along(value), y, 5.5, colour);
                let title = format!("{}, {}: {}", row.name, self.series[s], number(value));
                let _ = write!(text, "<title>{}</title>{}", escape(&title), shape.end());
            }
        }
        let keys: Vec<Key> = self
            .series
            .iter()
            .enumerate()
            .map(|(s, name)| {
                Key::Mark(
                    Shape::ALL[s % Shape::ALL.len()],
                    COLOURS[s % COLOURS.len()],
                    name.clone(),
                )
            })
            .collect();
        text += &legend(&keys);
        text + "</svg>"
    }
}

fn open(height: f64) -> String {
    format!("<svg viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" xmlns=\"http://www.w3.org/2000/svg\">")
}

fn dash(dashed: bool) -> &'static str {
    if dashed { " stroke-dasharray=\"6 4\"" } else { "" }
}

fn axis_x(axis: &Axis, height: f64, top: f64) -> String {
    let mut text = String::new();
    for tick in axis.ticks() {
        let x = LEFT + axis.at(tick) * (WIDTH - LEFT - RIGHT);
        let _ = write!(
            text,
            "<line class=\"grid\" x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{top}\" y2=\"{:.1}\"/>\
             <text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
            height - BOTTOM,
            height - BOTTOM + 18.0,
            number(tick)
        );
    }
    let _ = write!(
        text,
        "<text class=\"axis\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
        (LEFT + WIDTH - RIGHT) / 2.0,
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
    fn axes_hold_their_values_and_are_marked_within() {
        for axis in [
            Axis::log("x", [0.2, 40.0, f64::NAN, 0.0].into_iter()),
            Axis::log("x", [1e-9, 1e7].into_iter()),
            Axis::log("x", [5.0].into_iter()),
            Axis::log("x", std::iter::empty()),
        ] {
            let ticks = axis.ticks();
            assert!((1..=20).contains(&ticks.len()), "{axis:?}: {ticks:?}");
            for tick in ticks {
                assert!((axis.low..=axis.high).contains(&tick), "{axis:?}: {tick}");
            }
        }
        let axis = Axis::log("x", [1.0, 100.0].into_iter());
        assert!((axis.at(10.0) - 0.5).abs() < 1e-12);
        assert_eq!((axis.at(0.0), axis.at(1e9)), (0.0, 1.0));
    }

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

    #[test]
    fn labels_do_not_cover_each_other_and_texts_are_escaped() {
        let mark = |x: f64, label: &str| Mark {
            at: [x, 1.0],
            spread: None,
            shape: Shape::Circle,
            colour: COLOURS[0],
            title: "a < b & c".into(),
            label: Some(label.into()),
        };
        let plot = Plot {
            x: Axis::log("x", [1.0, 10.0].into_iter()),
            y: Axis::log("y", [1.0].into_iter()),
            lines: vec![],
            marks: (0..40).map(|_| mark(3.0, "the same place")).collect(),
            legend: vec![],
        };
        let svg = plot.svg();
        let labels = svg.matches("the same place").count();
        assert!(
            (1..=6).contains(&labels),
            "{labels} labels of one place are written"
        );
        assert!(svg.contains("a &lt; b &amp; c") && !svg.contains("a < b"));
        assert_eq!(svg.matches("<circle").count(), svg.matches("</circle>").count());
    }
}
