//! The forms of marks, and their colours.

/// Colours that people with any colour vision tell apart (M. Okabe and K. Ito, *Color Universal Design*, 2008).
pub(in crate::measure) const COLOURS: [&str; 7] = [
    "#0072b2", "#e69f00", "#009e73", "#cc79a7", "#d55e00", "#56b4e9", "#555555",
];

/// The form of a mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::measure) enum Shape {
    Circle,
    Square,
    Triangle,
    Diamond,
    Cross,
    Plus,
}

impl Shape {
    pub(in crate::measure) const ALL: [Self; 6] = [
        Self::Circle,
        Self::Square,
        Self::Triangle,
        Self::Diamond,
        Self::Cross,
        Self::Plus,
    ];

    /// The mark at (x, y), `r` in size.
    pub(super) fn draw(self, x: f64, y: f64, r: f64, colour: &str) -> String {
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

    pub(super) fn end(self) -> &'static str {
        match self {
            Self::Circle => "</circle>",
            Self::Cross | Self::Plus => "</path>",
            _ => "</polygon>",
        }
    }
}
