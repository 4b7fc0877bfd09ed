use super::super::overlay;
use super::*;
use crate::clipmap::ClipmapOptions;

/// All texts of a pass with what is shown, and where they stand.
fn texts(size: [f32; 2], shown: &Shown, changed: &mut Changed) -> Vec<(String, egui::Rect)> {
    let ctx = overlay::context();
    let input = || egui::RawInput {
        screen_rect: Some(egui::Rect::from_min_size(egui::Pos2::ZERO, size.into())),
        ..Default::default()
    };
    // A window knows its size from the second pass on, and has faded in a little later.
    let mut output = egui::FullOutput::default();
    for _ in 0..8 {
        output.textures_delta.clear();
        output = ctx.run_ui(input(), |ui| show(ui, shown, changed));
    }
    output.textures_delta.clear();
    let mut texts = Vec::new();
    for clipped in &output.shapes {
        collect(&clipped.shape, &mut texts);
    }
    texts
}

fn collect(shape: &egui::Shape, texts: &mut Vec<(String, egui::Rect)>) {
    match shape {
        // A text without a letter stands nowhere.
        egui::Shape::Text(text) if !text.galley.text().is_empty() => {
            texts.push((text.galley.text().to_string(), text.visual_bounding_rect()));
        }
        egui::Shape::Vec(shapes) => shapes.iter().for_each(|s| collect(s, texts)),
        _ => {}
    }
}

fn settings() -> Settings {
    Settings {
        clipmap: ClipmapOptions::default(),
        view_mode: ViewMode::Shaded,
        tint: true,
        haze: true,
        sun: Sun::default(),
        sun_hour: None,
    }
}

fn shown<'a>(facts: &'a Facts, notices: &'a [String]) -> Shown<'a> {
    Shown {
        title: "synth:64",
        loading: None,
        facts,
        traced_sun: None,
        recording_s: None,
        notices,
        measuring: None,
        errors: None,
    }
}

#[test]
fn panel_help_and_notices_stand_within_a_window_of_the_usual_size() {
    let (facts, notices) = (Facts::default(), vec!["a.png is written".to_string()]);
    let (mut settings, mut below, mut panel, mut help) = (settings(), false, true, true);
    let before = settings;
    let shown = Shown {
        recording_s: Some(2.0),
        ..shown(&facts, &notices)
    };
    let mut changed = Changed {
        settings: &mut settings,
        below_ground: &mut below,
        panel: &mut panel,
        help: &mut help,
    };
    let texts = texts([1280.0, 720.0], &shown, &mut changed);
    let all: String = texts.iter().map(|(t, _)| format!("{t}\n")).collect();
    for (text, rect) in &texts {
        assert!(
            rect.min.x >= 0.0 && rect.min.y >= 0.0 && rect.max.x <= 1280.0 && rect.max.y <= 720.0,
            "{text} at {rect:?}"
        );
    }
    let lines = text::lines(&facts);
    let words = BINDINGS.iter().map(|b| b.words).chain(lines.iter().map(|l| l.0));
    for word in words.chain([
        "a.png is written",
        "Recording 2.0 s; R writes the flight",
        "synth:64",
    ]) {
        assert!(all.contains(word), "{word} is not shown:\n{all}");
    }
    assert_eq!(settings, before, "what is only shown changes nothing");
}

#[test]
fn the_sun_of_traced_light_is_no_dial() {
    let facts = Facts::default();
    for traced_sun in [None, Some(Sun::default())] {
        let (mut settings, mut below, mut panel, mut help) = (settings(), false, true, false);
        let mut changed = Changed {
            settings: &mut settings,
            below_ground: &mut below,
            panel: &mut panel,
            help: &mut help,
        };
        let shown = Shown {
            traced_sun,
            ..shown(&facts, &[])
        };
        let texts = texts([1280.0, 720.0], &shown, &mut changed);
        let dial = texts.iter().any(|(t, _)| t == "Sun's azimuth (U)");
        assert_eq!(dial, traced_sun.is_none());
    }
}

#[test]
fn flags_beyond_the_sliders_ends_stay() {
    let facts = Facts::default();
    let mut settings = settings();
    settings.clipmap.vertical_scale = -40.0;
    settings.clipmap.max_error_px = Some(0.001);
    settings.sun.azimuth_deg = -45.0;
    let before = settings;
    let (mut below, mut panel, mut help) = (false, true, false);
    let mut changed = Changed {
        settings: &mut settings,
        below_ground: &mut below,
        panel: &mut panel,
        help: &mut help,
    };
    texts([1280.0, 720.0], &shown(&facts, &[]), &mut changed);
    assert_eq!(settings, before);
}

#[test]
fn all_words_have_letters_in_the_font() {
    let font = include_bytes!("../../../data/fonts/Roboto-Latin.ttf");
    assert!(font.len() < 100_000);
    let ctx = overlay::context();
    ctx.run_ui(Default::default(), |_| {}).textures_delta.clear();
    let words: Vec<String> = BINDINGS
        .iter()
        .flat_map(|b| [b.keys.to_string(), b.words.to_string()])
        .chain(["\u{b0} \u{d7} \u{e9}\u{df}\u{142} 0123456789 .,;:()".to_string()])
        .collect();
    let id = egui::FontId::proportional(14.0);
    ctx.fonts_mut(|fonts| {
        for word in &words {
            for c in word.chars() {
                assert!(fonts.has_glyph(&id, c), "{c:?} of {word}");
            }
        }
        assert!(
            !fonts.has_glyph(&id, '\u{4e2d}'),
            "control: a letter that is not there"
        );
    });
}
