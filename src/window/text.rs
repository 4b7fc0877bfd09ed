//! The panel's words: figures of a frame as text, apart from how they are laid out.

use glam::DVec3;

use super::settings::Settings;
use crate::clipmap::{Certificate, UpdateReport};
use crate::grid::Grid;
use crate::light::Sun;
use crate::shade::ViewMode;
use crate::source::Georeference;

/// What the panel says of the frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Facts {
    /// Wall milliseconds from frame to frame, smoothed; none where frames come only on demand.
    pub(super) frame_ms: Option<f64>,
    /// Of them those in which the frame was prepared and recorded.
    pub(super) cpu_ms: f64,
    pub(super) triangles: u64,
    pub(super) draw_calls: u64,
    pub(super) update: UpdateReport,
    /// Bytes uploaded since the window was opened.
    pub(super) streamed_bytes: u64,
    pub(super) certificate: Option<Certificate>,
    /// Metres of the eye above the ground, as drawn.
    pub(super) above_m: f64,
    pub(super) speed_m_per_s: f64,
    pub(super) heading_deg: f64,
    pub(super) pitch_deg: f64,
    /// The place under the pointer; none where no terrain is.
    pub(super) under: Option<Under>,
}

/// A place on the ground.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Under {
    /// Where, in the words of [`place`].
    pub(super) place: String,
    pub(super) height_m: f64,
    pub(super) distance_m: f64,
    pub(super) level: u32,
}

/// The lines of the panel: what, and how much.
pub(super) fn lines(facts: &Facts) -> Vec<(&'static str, String)> {
    let frame = match facts.frame_ms {
        Some(ms) => format!(
            "{ms:.1} ms ({:.0}/s), of it {:.1} prepared",
            1e3 / ms,
            facts.cpu_ms
        ),
        None => format!("at rest; {:.1} ms prepared", facts.cpu_ms),
    };
    let update = &facts.update;
    let triangles = format!(
        "{} in {} patches, {} calls",
        count(facts.triangles),
        count(update.patches),
        facts.draw_calls
    );
    let streamed = format!(
        "{}, this frame {}",
        bytes(facts.streamed_bytes),
        bytes(update.upload_bytes)
    );
    let mut lines = vec![
        ("Frame", frame),
        ("Triangles", triangles),
        ("Streamed", streamed),
        ("Data", state(update)),
        ("Certified", certified(facts.certificate.as_ref())),
        (
            "Camera",
            format!(
                "{} above ground, heading {:.0}\u{b0}, pitch {:.0}\u{b0}",
                metres(facts.above_m),
                // 359.7 is 0, not 360.
                facts.heading_deg.round().rem_euclid(360.0),
                facts.pitch_deg.round() + 0.0
            ),
        ),
        ("Speed", format!("{}/s", metres(facts.speed_m_per_s))),
    ];
    match &facts.under {
        Some(under) => {
            lines.push(("Pointer", under.place.clone()));
            lines.push((
                "",
                format!(
                    "height {:.1} m, {} away, level {}",
                    under.height_m,
                    metres(under.distance_m),
                    under.level
                ),
            ));
        }
        None => {
            lines.push(("Pointer", "no ground".into()));
            lines.push(("", String::new()));
        }
    }
    lines
}

/// Whether all data are there.
pub(super) fn state(update: &UpdateReport) -> String {
    let mut text = match (update.complete, update.stale_levels) {
        (true, _) => "complete".to_string(),
        (false, 0) if update.provisional => "a draft, while the terrain file is built".to_string(),
        (false, 0) => "the coarsest level is not complete".to_string(),
        (false, 1) => "1 level behind".to_string(),
        (false, n) => format!("{n} levels behind"),
    };
    if update.cut {
        text += ", cut by --levels";
    }
    text
}

/// What is certified of the frame's error.
pub(super) fn certified(certificate: Option<&Certificate>) -> String {
    match certificate.map(|c| c.error_px) {
        None => "not looked at yet".into(),
        Some(Ok(px)) if px < 1e3 => format!("at most {px:.2} px"),
        Some(Ok(px)) => format!("at most {px:.0} px"),
        Some(Err(reason)) => format!("nothing: {}", reason.reason()),
    }
}

/// A place in the DEM's own reference system, or in the world where it lies nowhere.
pub(super) fn place(point: DVec3, grid: &Grid, place: Option<&Georeference>) -> String {
    let [column, row] = [point.x / grid.spacing_m[0], point.z / grid.spacing_m[1]];
    let Some(reference) = place else {
        return format!("x {:.1} m, z {:.1} m", point.x, point.z);
    };
    let [east, north] = reference.place(column, row);
    // A code of a reference system is short; its definition is not.
    let name = reference.crs.as_deref().filter(|crs| crs.len() <= 24);
    let crs = name.map_or(String::new(), |crs| format!(" ({crs})"));
    if reference.geographic {
        let east = (east + 180.0).rem_euclid(360.0) - 180.0;
        let side = |v: f64, plus, minus| if v < 0.0 { minus } else { plus };
        format!(
            "{:.5}\u{b0} {}, {:.5}\u{b0} {}{crs}",
            north.abs(),
            side(north, "N", "S"),
            east.abs(),
            side(east, "E", "W")
        )
    } else {
        format!("E {east:.1}, N {north:.1}{crs}")
    }
}

/// The flags by which `render` draws what the window shows.
pub(super) fn render_flags(settings: &Settings, size_px: [u32; 2], sample_count: u32) -> String {
    let clipmap = &settings.clipmap;
    let mut flags = format!(
        " --size {}x{} --clip-size {}",
        size_px[0], size_px[1], clipmap.clip_size
    );
    let mut add = |flag: String| {
        flags.push(' ');
        flags += &flag;
    };
    if let Some(levels) = clipmap.levels {
        add(format!("--levels {levels}"));
    }
    if let Some(transition) = clipmap.transition {
        add(format!("--transition {transition}"));
    }
    if let Some(px) = clipmap.max_error_px {
        add(format!("--max-error-px {px}"));
    }
    if clipmap.vertical_scale != 1.0 {
        add(format!("--vertical-scale {}", clipmap.vertical_scale));
    }
    if let Some(hour) = settings.sun_hour {
        let minutes = (hour * 60.0).round() as i64;
        add(format!("--sun-time {}:{:02}", minutes / 60 % 24, minutes % 60));
    } else if settings.sun != Sun::default() {
        add(format!(
            "--sun {},{}",
            settings.sun.azimuth_deg, settings.sun.altitude_deg
        ));
    }
    if settings.view_mode != ViewMode::Shaded {
        add(format!("--view {}", settings.view_mode.name()));
    }
    if sample_count != 1 {
        add(format!("--msaa {sample_count}"));
    }
    for (flag, asked) in [
        ("--no-tint", !settings.tint),
        ("--no-haze", !settings.haze),
        ("--no-cull", !clipmap.cull),
    ] {
        if asked {
            add(flag.into());
        }
    }
    flags
}

/// A word as a shell reads it.
pub fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "/._-+:,=@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.into()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

/// A number with its thousands apart.
pub(super) fn count(n: u64) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (k, digit) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// Bytes in a unit that leaves few digits.
pub(super) fn bytes(n: u64) -> String {
    let mut value = n as f64;
    for unit in ["B", "KiB", "MiB", "GiB"] {
        if value < 1000.0 {
            return if unit == "B" {
                format!("{n} B")
            } else {
                format!("{value:.1} {unit}")
            };
        }
        value /= 1024.0;
    }
    format!("{value:.1} TiB")
}

/// A length in a unit that leaves few digits.
pub(super) fn metres(m: f64) -> String {
    match m.abs() {
        a if a >= 1e7 => format!("{:.0} km", m / 1e3),
        a if a >= 1e4 => format!("{:.1} km", m / 1e3),
        a if a >= 100.0 => format!("{m:.0} m"),
        a if a >= 1.0 => format!("{m:.1} m"),
        0.0 => "0 m".into(),
        a if a >= 0.01 => format!("{m:.3} m"),
        _ => format!("{m:.1e} m"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clipmap::{ClipmapOptions, Uncertified};
    use crate::source::Registration;

    #[test]
    fn numbers_are_short_and_have_units() {
        assert_eq!(
            [0, 999, 1000, 1_234_567].map(count),
            ["0", "999", "1,000", "1,234,567"]
        );
        assert_eq!(
            [0, 999, 1000, 1536, 3 << 20, 5 << 30].map(bytes),
            ["0 B", "999 B", "1.0 KiB", "1.5 KiB", "3.0 MiB", "5.0 GiB"]
        );
        assert_eq!(
            [0.0, 0.002, 0.25, -3.12, 250.4, 12_340.0, 3e7].map(metres),
            [
                "0 m", "2.0e-3 m", "0.250 m", "-3.1 m", "250 m", "12.3 km", "30000 km"
            ]
        );
    }

    #[test]
    fn places_are_those_of_the_file() {
        let grid = Grid::new(101, 101, [70.0, 90.0]);
        let point = DVec3::new(700.0, 55.0, 1800.0);
        assert_eq!(place(point, &grid, None), "x 700.0 m, z 1800.0 m");
        let mut reference = Georeference {
            crs: Some("EPSG:4326".into()),
            origin: [-179.999, 0.01],
            pixel: [-0.001, -0.001],
            registration: Registration::Point,
            geographic: true,
        };
        assert_eq!(
            place(point, &grid, Some(&reference)),
            "0.01000\u{b0} S, 179.99100\u{b0} E (EPSG:4326)"
        );
        reference.geographic = false;
        reference.crs = Some("PROJCS[".repeat(9));
        reference.origin = [500_000.0, 4.6e6];
        reference.pixel = [70.0, -90.0];
        assert_eq!(place(point, &grid, Some(&reference)), "E 500700.0, N 4598200.0");
    }

    #[test]
    fn flags_say_what_differs_from_what_render_does_anyway() {
        let mut settings = Settings {
            clipmap: ClipmapOptions::default(),
            view_mode: ViewMode::Shaded,
            tint: true,
            haze: true,
            sun: Sun::default(),
            sun_hour: None,
        };
        assert_eq!(render_flags(&settings, [3, 2], 1), " --size 3x2 --clip-size 256");
        settings.clipmap.levels = Some(3);
        settings.clipmap.transition = Some(0);
        settings.clipmap.max_error_px = Some(0.5);
        settings.clipmap.vertical_scale = -2.0;
        settings.clipmap.cull = false;
        settings.sun.altitude_deg = 10.5;
        settings.view_mode = ViewMode::Wire;
        (settings.tint, settings.haze) = (false, false);
        assert_eq!(
            render_flags(&settings, [3, 2], 4),
            " --size 3x2 --clip-size 256 --levels 3 --transition 0 --max-error-px 0.5 --vertical-scale -2 \
             --sun 315,10.5 --view wire --msaa 4 --no-tint --no-haze --no-cull"
        );
        assert_eq!(
            ["a/b-1.tif", "a b", "it's", ""].map(quoted),
            ["a/b-1.tif", "'a b'", "'it'\\''s'", "''"]
        );
    }

    #[test]
    fn the_panel_says_how_the_frame_is() {
        let mut facts = Facts {
            frame_ms: Some(12.5),
            cpu_ms: 3.0,
            triangles: 123_456,
            heading_deg: 359.7,
            pitch_deg: -12.0,
            above_m: 512.0,
            ..Default::default()
        };
        facts.update.patches = 964;
        facts.update.complete = true;
        let text = |facts: &Facts| {
            let lines = lines(facts);
            lines
                .iter()
                .map(|(k, v)| format!("{k}: {v}\n"))
                .collect::<String>()
        };
        let said = text(&facts);
        for part in [
            "Frame: 12.5 ms (80/s), of it 3.0 prepared\n",
            "Triangles: 123,456 in 964 patches, 0 calls\n",
            "Data: complete\n",
            "Certified: not looked at yet\n",
            "Camera: 512 m above ground, heading 0\u{b0}, pitch -12\u{b0}\n",
            "Pointer: no ground\n",
        ] {
            assert!(said.contains(part), "{said} should say {part}");
        }
        let height = lines(&facts).len();
        facts.under = Some(Under {
            place: "x 1.0 m, z 2.0 m".into(),
            height_m: 77.25,
            distance_m: 1500.0,
            level: 2,
        });
        facts.update.complete = false;
        facts.update.provisional = true;
        assert!(text(&facts).contains("Data: a draft, while the terrain file is built\n"));
        facts.update.stale_levels = 3;
        facts.certificate = Some(Certificate {
            error_px: Ok(0.456),
            patch: None,
        });
        let said = text(&facts);
        for part in [
            "Pointer: x 1.0 m, z 2.0 m\n",
            ": height 77.2 m, 1500 m away, level 2\n",
            "Data: 3 levels behind\n",
            "Certified: at most 0.46 px\n",
        ] {
            assert!(said.contains(part), "{said} should say {part}");
        }
        assert_eq!(lines(&facts).len(), height, "the panel keeps its height");
        let none = Certificate {
            error_px: Err(Uncertified::CameraPlane),
            patch: None,
        };
        assert_eq!(
            certified(Some(&none)),
            "nothing: the error may reach the camera plane"
        );
    }
}
