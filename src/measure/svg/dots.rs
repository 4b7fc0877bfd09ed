//! Rows of dots over one axis.

use std::fmt::Write;

use super::{
    Axis, BOTTOM, COLOURS, Key, LEFT, RIGHT, Shape, TOP, WIDTH, along, axis_x, escape, legend, number, open,
};

/// A row of dots: a name, and a value for each series.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::measure) struct DotRow {
    pub(in crate::measure) name: String,
    pub(in crate::measure) values: Vec<f64>,
}

/// Rows of dots over one axis, a series a colour.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::measure) struct Dots {
    pub(in crate::measure) x: Axis,
    pub(in crate::measure) series: Vec<String>,
    pub(in crate::measure) rows: Vec<DotRow>,
}

impl Dots {
    pub(in crate::measure) fn svg(&self) -> String {
        const ROW: f64 = 30.0;
        // Names stand where a plot has its y axis, and need more room.
        const NAMES: f64 = LEFT + 92.0;
        let height = TOP + BOTTOM + ROW * self.rows.len() as f64;
        let mut text = open(height) + &axis_x(&self.x, height, NAMES);
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
                let (shape, colour) = look(s);
                text += &shape.draw(along(&self.x, NAMES, value), y, 5.5, colour);
                let title = format!("{}, {}: {}", row.name, self.series[s], number(value));
                let _ = write!(text, "<title>{}</title>{}", escape(&title), shape.end());
            }
        }
        let keys: Vec<Key> = self
            .series
            .iter()
            .enumerate()
            .map(|(s, name)| {
                let (shape, colour) = look(s);
                Key::Mark(shape, colour, name.clone())
            })
            .collect();
        text += &legend(&keys);
        text + "</svg></div>"
    }
}

/// The mark of a series.
fn look(series: usize) -> (Shape, &'static str) {
    (
        Shape::ALL[series % Shape::ALL.len()],
        COLOURS[series % COLOURS.len()],
    )
}
