//! `report.html`: one page without outside parts that says what each setting costs and how wrong it is.

mod plots;
mod tables;

use std::fmt::Write;

use super::pareto::{Criterion, nearest, quickest};
use super::row::Row;
use super::stability::Comparison;
use super::storage::StorageCost;
use super::svg::{escape, number};

/// The errors for which the page says what to use, in pixels.
pub const LIMITS_PX: [f64; 3] = [0.5, 1.0, 2.0];

/// What a page speaks of.
#[derive(Clone, Debug)]
pub struct Page<'a> {
    /// The terrain's name.
    pub terrain: &'a str,
    /// Its samples and spacing, as a phrase.
    pub extent: String,
    /// Pixels of a frame.
    pub size_px: [u32; 2],
    /// Frames of the flight, those timed, those measured, and rounds.
    pub frames: [u64; 4],
    /// Adapter, driver and version of this program, as a phrase.
    pub device: String,
    /// The command line.
    pub command: &'a str,
    /// The settings; the first is the base setting.
    pub rows: &'a [Row],
    /// The comparisons of numerical stability.
    pub stability: &'a [Comparison],
    /// What fewer bits would cost.
    pub storage: &'a [StorageCost],
}

const STYLE: &str = "
body { font: 15px/1.5 system-ui, sans-serif; color: #222; background: #fff; margin: 0 auto; padding: 1.5rem 1.5rem 4rem;
  max-width: 76rem; }
h1 { font-size: 1.7rem; margin: 0 0 .2rem; } h2 { font-size: 1.2rem; margin: 2.6rem 0 .4rem; }
p { margin: .5rem 0; max-width: 50rem; } .quiet { color: #666; } code { font: .87em ui-monospace, monospace; }
svg { width: 100%; min-width: 42rem; max-width: 58rem; height: auto; display: block; margin: .6rem 0; }
svg text { font: 12.5px system-ui, sans-serif; fill: #444; } svg .axis { font-weight: 600; fill: #222; }
svg .label { font-size: 11.5px; fill: #222; } svg .grid { stroke: #e4e4e4; stroke-width: 1; }
.scroll { overflow-x: auto; } table { border-collapse: collapse; margin: .6rem 0; font-variant-numeric: tabular-nums; }
th, td { padding: .28rem .6rem; border-bottom: 1px solid #e4e4e4; text-align: right; vertical-align: top; }
th { font-weight: 600; border-bottom: 2px solid #bbb; vertical-align: bottom; } td.text, th.text { text-align: left; }
.wide { font-size: 12.5px; } .wide th, .wide td { padding: .2rem .38rem; } .wide td { white-space: nowrap; }
tr.front td { background: #eef6fb; } tr.cut td { color: #888; }
.answer code, table code { white-space: nowrap; }
.answer { border-left: 4px solid #0072b2; padding: .1rem 0 .1rem 1rem; margin: .8rem 0; }
.fails { color: #b00020; font-weight: 600; }
";

impl Page<'_> {
    /// The page.
    pub fn html(&self) -> String {
        let title = format!("Speed against accuracy: {}", self.terrain);
        let mut text = format!(
            "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
             <meta name=\"viewport\" content=\"width=device-width\"><title>{}</title><style>{STYLE}</style></head>\n\
             <body><h1>{}</h1>\n",
            escape(&title),
            escape(&title)
        );
        self.head(&mut text);
        self.answers(&mut text);
        self.tradeoff(&mut text);
        self.one_at_a_time(&mut text);
        section(&mut text, "All settings");
        text += "<p>Shaded lines are on the Pareto front. <i>Promised</i> is the error that the dial was asked for; \
                 <i>certified</i> what was known of every frame of the flight before it was drawn. Grey lines leave \
                 coarse levels out, so their pictures end before the DEM does.</p>\n";
        text += &tables::settings(self.rows);
        self.stability(&mut text);
        self.storage(&mut text);
        self.how(&mut text);
        text + "</body></html>\n"
    }

    fn head(&self, text: &mut String) {
        let [width, height] = self.size_px;
        let [all, timed, measured, rounds] = self.frames;
        let _ = writeln!(
            text,
            "<p class=\"quiet\">{}. A flight of {all} frames of {width} x {height} pixels; {timed} of them timed in \
             {rounds} rounds, {measured} measured against the DEM pixel by pixel, for each of {} settings. On {}.</p>",
            escape(&self.extent),
            self.rows.len(),
            escape(&self.device)
        );
    }

    fn answers(&self, text: &mut String) {
        section(text, "Which setting to use");
        let [width, height] = self.size_px;
        let _ = writeln!(
            text,
            "<p>The quickest setting that keeps an error, by three ways to keep it. A pixel's error is how far on the \
             screen, at {width} x {height}, the point drawn there lies from where the DEM's own surface would put it.</p>"
        );
        for limit_px in LIMITS_PX {
            let _ = writeln!(text, "<p class=\"answer\">{}</p>", self.answer(limit_px));
        }
        text.push_str(&tables::answers(self.rows));
    }

    /// One sentence on what to use for an error.
    fn answer(&self, limit_px: f64) -> String {
        let unit = if limit_px == 1.0 { "pixel" } else { "pixels" };
        match quickest(self.rows, Criterion::Greatest, limit_px) {
            Some(row) => format!(
                "For <b>{} {unit}</b> at every measured pixel: <b><code>{}</code></b>, {} ms a frame, {} triangles; worst \
                 pixel {} px, 99 of 100 within {} px{}.",
                number(limit_px),
                escape(&row.setting.arguments()),
                number(row.frame_ms_median),
                number(row.triangles[0] as f64),
                number(row.errors.error_px_max),
                number(row.errors.error_px_p99),
                match row.certified_error_px {
                    Some(px) if px <= limit_px =>
                        format!("; {} px were certified before drawing", number(px)),
                    Some(px) => format!(
                        "; before drawing no less than {} px could be certified",
                        number(px)
                    ),
                    None => String::new(),
                }
            ),
            None => format!(
                "For <b>{} {unit}</b> at every measured pixel: none of these settings{}.",
                number(limit_px),
                nearest(self.rows, Criterion::Greatest).map_or_else(String::new, |row| format!(
                    "; the nearest is <code>{}</code> with {} px at its worst",
                    escape(&row.setting.arguments()),
                    number(row.errors.error_px_max)
                ))
            ),
        }
    }

    fn tradeoff(&self, text: &mut String) {
        section(text, "Frame time against error");
        text.push_str(
            "<p>Down and to the left is better. The line joins the Pareto front: the settings that no other beats in both \
             frame time and greatest error. Bars reach from the least to the greatest of the rounds' medians.</p>\n",
        );
        text.push_str(&plots::time_against_error(self.rows));
        section(text, "Triangles against error");
        text.push_str(
            "<p>The same without the clock: triangles do not depend on the machine. The error here is the one that 99 of \
             100 pixels do not exceed; 0 lies on the lower edge.</p>\n",
        );
        text.push_str(&plots::triangles_against_error(self.rows));
        if let Some(plot) = plots::measured_against_certified(self.rows) {
            section(text, "What was certified against what was measured");
            text.push_str(
                "<p>Each setting's greatest error over the flight, certified before drawing and measured afterwards. No \
                 mark may lie above the line, on which both are equal. Where a promise is less than a clip size can keep, what \
                 is certified says so.</p>\n",
            );
            text.push_str(&plot);
        }
    }

    fn one_at_a_time(&self, text: &mut String) {
        for (family, title, says) in plots::FAMILIES {
            let dots = plots::family(self.rows, family);
            if dots.is_empty() {
                continue;
            }
            section(text, title);
            let _ = writeln!(text, "<p>{says}</p>");
            text.push_str(&dots);
        }
    }

    fn stability(&self, text: &mut String) {
        section(text, "Numerical stability");
        let failed = self.stability.iter().filter(|line| !line.holds()).count();
        let _ = writeln!(
            text,
            "<p>Extreme inputs, made from a seed and drawn on this device: what was compared, the largest difference \
             found, and the most that the arithmetic allows. {} of {} hold.</p>",
            self.stability.len() - failed,
            self.stability.len()
        );
        text.push_str(&tables::stability(self.stability));
    }

    fn storage(&self, text: &mut String) {
        section(text, "Heights in fewer bits");
        text.push_str(
            "<p>Windows hold heights as f32. What other formats would change of this DEM's heights, what storing alone \
             would add on the screen over the measured frames (the DEM drawn exactly, with its heights stored so), and \
             what they would save in the base setting. 16-bit integers divide the range of the DEM's heights evenly.</p>\n",
        );
        text.push_str(&tables::storage(self.storage));
    }

    fn how(&self, text: &mut String) {
        section(text, "How this was made");
        let _ = writeln!(
            text,
            "<p><code>{}</code></p>\n<p>Frame time is wall time from a camera to the picture read back. All settings are \
             flown once a round, in turn, so that a machine that slows down slows all. Errors are pooled over all pixels \
             of the measured frames; what the rasteriser's grid and f32 depth could do at a pixel is taken off and \
             reported (<code>error_floor_px</code>). Triangles, bytes and certificates are of every frame of the flight. \
             Memory is the windows on the processor and their textures on the device, from their sizes. PSNR compares \
             the shaded pictures with pictures of the DEM's own surface, shaded by the same rules. The numbers are in \
             <code>tradeoff.csv</code>, their units in <code>tradeoff.schema.json</code>, checksums and versions in \
             <code>summary.json</code>.</p>",
            escape(self.command)
        );
    }
}

fn section(text: &mut String, title: &str) {
    let _ = writeln!(text, "<h2>{}</h2>", escape(title));
}

#[cfg(test)]
mod tests {
    use super::super::row::tests::row;
    use super::*;

    #[test]
    fn a_page_answers_and_refers_to_nothing_outside() {
        let mut rows = vec![row(0, 9.0, 0.4), row(1, 5.0, 0.9), row(2, 3.0, 3.0)];
        super::super::pareto::mark_front(&mut rows);
        let stability = [Comparison {
            what: "a < b".into(),
            compared: "pixels".into(),
            largest: 2.0,
            allowed: 0.0,
            unit: "px",
        }];
        let page = Page {
            terrain: "a&b.tif",
            extent: "100 x 90 samples".into(),
            size_px: [640, 360],
            frames: [120, 24, 5, 3],
            device: "a device".into(),
            command: "clipscape measure <x>",
            rows: &rows,
            stability: &stability,
            storage: &[],
        };
        let html = page.html();
        for says in [
            "a&amp;b.tif",
            "For <b>0.5 pixels</b> at every measured pixel: <b><code>--clip-size 256</code></b>, 9 ms",
            "For <b>1 pixel</b> at every measured pixel: <b><code>--clip-size 256</code></b>, 5 ms",
            "a &lt; b",
            "0 of 1 hold",
            "clipscape measure &lt;x&gt;",
        ] {
            assert!(html.contains(says), "{says}");
        }
        for outside in ["http:", "https:", "<script", "src=", "@import", "url("] {
            let places = html.matches(outside).count();
            let namespaces = html.matches("xmlns=\"http:").count();
            assert_eq!(
                places,
                if outside == "http:" { namespaces } else { 0 },
                "{outside}"
            );
        }
        for tag in [
            "svg", "table", "p", "h2", "tr", "td", "th", "text", "body", "html",
        ] {
            let opened =
                html.matches(&format!("<{tag}>")).count() + html.matches(&format!("<{tag} ")).count();
            assert_eq!(opened, html.matches(&format!("</{tag}>")).count(), "{tag}");
        }
        let mut worse = vec![rows[0].clone()];
        worse[0].errors.error_px_max = 7.0;
        assert!(
            Page { rows: &worse, ..page }
                .html()
                .contains("the nearest is <code>--clip-size 256</code> with 7 px")
        );
    }
}
