//! Marks and lines over two axes.

use std::fmt::Write;

use super::{
    Axis, BOTTOM, HEIGHT, Key, LEFT, RIGHT, Shape, TOP, WIDTH, along, axis_x, dash, escape, legend, number,
    open,
};

/// A point of a plot.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::measure) struct Mark {
    pub(in crate::measure) at: [f64; 2],
    /// From where to where it spreads along the x axis.
    pub(in crate::measure) spread: Option<[f64; 2]>,
    pub(in crate::measure) shape: Shape,
    pub(in crate::measure) colour: &'static str,
    /// What it says under the pointer.
    pub(in crate::measure) title: String,
    /// What is written beside it.
    pub(in crate::measure) label: Option<String>,
}

/// A line through points.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::measure) struct Line {
    pub(in crate::measure) points: Vec<[f64; 2]>,
    pub(in crate::measure) colour: &'static str,
    pub(in crate::measure) dashed: bool,
}

/// Marks and lines over two axes.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::measure) struct Plot {
    pub(in crate::measure) x: Axis,
    pub(in crate::measure) y: Axis,
    pub(in crate::measure) lines: Vec<Line>,
    pub(in crate::measure) marks: Vec<Mark>,
    pub(in crate::measure) legend: Vec<Key>,
}

impl Plot {
    pub(in crate::measure) fn svg(&self) -> String {
        let place = |[x, y]: [f64; 2]| {
            [
                along(&self.x, LEFT, x),
                HEIGHT - BOTTOM - self.y.at(y) * (HEIGHT - TOP - BOTTOM),
            ]
        };
        let mut text = open(HEIGHT);
        text += &axis_x(&self.x, HEIGHT, LEFT);
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
        text + "</svg></div>"
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
                let inside =
                    b[0] >= LEFT && b[2] <= WIDTH - RIGHT + 12.0 && b[1] >= 0.0 && b[3] <= HEIGHT - BOTTOM;
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

#[cfg(test)]
mod tests {
    use super::super::COLOURS;
    use super::*;

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
