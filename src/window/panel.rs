//! What lies over the terrain: the panel with figures and dials, the help, notices, and how far loading has come.

use egui::{Align2, Color32, Context, RichText, Ui};

use super::controls::BINDINGS;
use super::loading::Stage;
use super::settings::{CLIP_SIZES, Settings};
use super::text::{self, Facts};
use crate::clipmap::Ring;
use crate::light::Sun;
use crate::shade::ViewMode;

/// The promised error that the dial begins with where none was promised, in pixels.
const FIRST_MAX_ERROR_PX: f64 = 1.0;

/// Distance of the panel and of notices from the window's border, in points.
const MARGIN: f32 = 12.0;

/// Width of a window from which on the help stands in two columns, in points.
const TWO_COLUMNS: f32 = 900.0;

/// Width of a slider in points.
const SLIDER_WIDTH: f32 = 130.0;

/// What is shown.
pub(super) struct Shown<'a> {
    /// The terrain's name.
    pub(super) title: &'a str,
    /// How far opening the terrain has come; none once it is there.
    pub(super) loading: Option<Stage>,
    pub(super) facts: &'a Facts,
    /// The sun of the traced light, where there is one: then it cannot be moved.
    pub(super) traced_sun: Option<Sun>,
    /// Seconds of the flight that is being recorded.
    pub(super) recording_s: Option<f64>,
    /// What was written, or went wrong.
    pub(super) notices: &'a [String],
    /// What the view of errors waits for.
    pub(super) measuring: Option<&'a str>,
    /// The picture of errors, in place of the terrain's.
    pub(super) errors: Option<egui::TextureId>,
}

/// What the panel changes.
pub(super) struct Changed<'a> {
    pub(super) settings: &'a mut Settings,
    pub(super) below_ground: &'a mut bool,
    pub(super) panel: &'a mut bool,
    pub(super) help: &'a mut bool,
}

/// Lays all of it out.
pub(super) fn show(ui: &mut Ui, shown: &Shown, changed: &mut Changed) {
    if let Some(texture) = shown.errors {
        let whole = egui::Rect::from_min_max(egui::Pos2::ZERO, egui::Pos2::new(1.0, 1.0));
        let screen = ui.ctx().content_rect();
        ui.painter().image(texture, screen, whole, Color32::WHITE);
    }
    let ctx = &ui.ctx().clone();
    if let Some(stage) = &shown.loading {
        loading(ctx, shown.title, stage);
    } else if *changed.panel {
        panel(ctx, shown, changed);
    }
    if *changed.help {
        help(ctx);
    }
    notices(ctx, shown);
}

fn loading(ctx: &Context, title: &str, stage: &Stage) {
    egui::Window::new("loading")
        .title_bar(false)
        .resizable(false)
        .anchor(Align2::CENTER_CENTER, [0.0, 0.0])
        .show(ctx, |ui| {
            ui.set_width(320.0);
            ui.add(egui::Label::new(RichText::new(title).strong()).truncate());
            let name = if stage.name.is_empty() {
                "opening"
            } else {
                &stage.name
            };
            ui.add(egui::ProgressBar::new(stage.share).text(format!("{name} {:.0} %", 100.0 * stage.share)));
            ui.label("Esc quits");
        });
}

fn panel(ctx: &Context, shown: &Shown, changed: &mut Changed) {
    egui::Window::new(RichText::new(shown.title).strong())
        .id(egui::Id::unique("clipscape panel"))
        .anchor(Align2::LEFT_TOP, [MARGIN, MARGIN])
        .resizable(false)
        .show(ctx, |ui| {
            scrolled(ui, |ui| {
                egui::Grid::new("figures").num_columns(2).show(ui, |ui| {
                    for (what, how_much) in text::lines(shown.facts) {
                        ui.label(RichText::new(what).weak());
                        ui.label(how_much);
                        ui.end_row();
                    }
                });
                ui.separator();
                views(ui, changed.settings);
                dials(ui, shown, changed);
                ui.separator();
                ui.label(RichText::new("H: all keys   Tab: hide this   R: record   P: picture").weak());
            });
        });
}

/// What is as high as it must be, but no higher than the window.
fn scrolled(ui: &mut Ui, add: impl FnOnce(&mut Ui)) {
    let most = ui.ctx().content_rect().height() - 6.0 * MARGIN;
    egui::ScrollArea::vertical()
        .max_height(most.max(60.0))
        .min_scrolled_height(most.max(60.0))
        .show(ui, add);
}

fn views(ui: &mut Ui, settings: &mut Settings) {
    ui.horizontal(|ui| {
        for ((name, mode), key) in ViewMode::NAMED.into_iter().zip(1..) {
            ui.selectable_value(&mut settings.view_mode, mode, format!("{key} {name}"));
        }
    });
}

fn dials(ui: &mut Ui, shown: &Shown, changed: &mut Changed) {
    ui.spacing_mut().slider_width = SLIDER_WIDTH;
    egui::Grid::new("dials").num_columns(2).show(ui, |ui| {
        let settings = &mut *changed.settings;
        let mut promised = settings.clipmap.max_error_px.is_some();
        ui.checkbox(&mut promised, "Max error (X)");
        let mut px = settings.clipmap.max_error_px.unwrap_or(FIRST_MAX_ERROR_PX);
        let slider = egui::Slider::new(&mut px, 0.05..=32.0)
            .logarithmic(true)
            .suffix(" px");
        ui.add_enabled(promised, free(slider));
        settings.clipmap.max_error_px = promised.then_some(px);
        ui.end_row();

        ui.label("Clip size (C)");
        let mut exponent = settings.clipmap.clip_size.ilog2();
        let exponents = CLIP_SIZES[0].ilog2()..=CLIP_SIZES[1].ilog2();
        let slider = egui::Slider::new(&mut exponent, exponents)
            .custom_formatter(|e, _| format!("{}", 1i64 << e as u32))
            .custom_parser(|text| {
                text.trim()
                    .parse()
                    .ok()
                    .filter(|n: &f64| *n >= 1.0)
                    .map(f64::log2)
            });
        if ui.add(slider).changed() {
            settings.set_clip_size(1 << exponent);
        }
        ui.end_row();

        ui.label("Transition (B)");
        let mut transition = settings.transition();
        let limit = Ring::transition_limit(settings.clipmap.clip_size);
        let slider = egui::Slider::new(&mut transition, 0..=limit).suffix(" steps");
        if ui.add(slider).changed() {
            settings.set_transition(transition);
        }
        ui.end_row();

        ui.label("Exaggeration (V)");
        let slider = egui::Slider::new(&mut settings.clipmap.vertical_scale, 0.0..=10.0).prefix("\u{d7} ");
        ui.add(free(slider));
        ui.end_row();

        sun(ui, shown.traced_sun, settings);
    });
    ui.horizontal(|ui| {
        ui.checkbox(&mut changed.settings.tint, "Tint (T)");
        ui.checkbox(&mut changed.settings.haze, "Haze (Y)");
        ui.checkbox(changed.below_ground, "Below ground (G)");
    });
}

fn sun(ui: &mut Ui, traced: Option<Sun>, settings: &mut Settings) {
    if let Some(hour) = &mut settings.sun_hour {
        ui.label("Time of day (U)");
        ui.add(free(egui::Slider::new(hour, 0.0..=24.0).suffix(" h")));
        ui.end_row();
        return;
    }
    let sun = &mut settings.sun;
    if let Some(Sun {
        azimuth_deg,
        altitude_deg,
    }) = traced
    {
        ui.label("Sun");
        ui.label(format!(
            "{azimuth_deg:.0}\u{b0}, {altitude_deg:.0}\u{b0} high, as it was traced"
        ));
        ui.end_row();
        return;
    }
    ui.label("Sun's azimuth (U)");
    ui.add(free(
        egui::Slider::new(&mut sun.azimuth_deg, 0.0..=360.0).suffix("\u{b0}"),
    ));
    ui.end_row();
    ui.label("Sun's altitude (O)");
    ui.add(egui::Slider::new(&mut sun.altitude_deg, -90.0..=90.0).suffix("\u{b0}"));
    ui.end_row();
}

/// A slider that leaves alone what a flag or key has set beyond its ends, until it is moved.
fn free(slider: egui::Slider<'_>) -> egui::Slider<'_> {
    slider.clamping(egui::SliderClamping::Edits).max_decimals(2)
}

fn help(ctx: &Context) {
    egui::Window::new("Keys")
        .id(egui::Id::unique("clipscape help"))
        .anchor(Align2::CENTER_CENTER, [0.0, 0.0])
        .collapsible(false)
        .resizable(false)
        .show(ctx, |ui| {
            scrolled(ui, |ui| {
                let columns = if ctx.content_rect().width() < TWO_COLUMNS {
                    1
                } else {
                    2
                };
                let rows = BINDINGS.len().div_ceil(columns);
                ui.horizontal_top(|ui| {
                    for (k, bindings) in BINDINGS.chunks(rows).enumerate() {
                        egui::Grid::new(("keys", k))
                            .num_columns(2)
                            .striped(true)
                            .show(ui, |ui| {
                                for binding in bindings {
                                    ui.label(RichText::new(binding.keys).strong());
                                    ui.label(binding.words);
                                    ui.end_row();
                                }
                            });
                    }
                });
                ui.separator();
                ui.label(
                    "Drag with a mouse button held to look. Keys are named by their place on a US keyboard.",
                );
            });
        });
}

fn notices(ctx: &Context, shown: &Shown) {
    if shown.notices.is_empty() && shown.recording_s.is_none() && shown.measuring.is_none() {
        return;
    }
    egui::Area::new(egui::Id::unique("clipscape notices"))
        .anchor(Align2::CENTER_BOTTOM, [0.0, -MARGIN])
        .interactable(false)
        .show(ctx, |ui| {
            egui::Frame::popup(ui.style()).show(ui, |ui| {
                ui.set_max_width((ctx.content_rect().width() - 6.0 * MARGIN).max(60.0));
                if let Some(s) = shown.recording_s {
                    let text = format!("Recording {s:.1} s; R writes the flight");
                    ui.label(RichText::new(text).color(Color32::from_rgb(255, 110, 90)));
                }
                if let Some(what) = shown.measuring {
                    ui.label(what);
                }
                for notice in shown.notices {
                    ui.label(notice);
                }
            });
        });
}

#[cfg(test)]
mod tests;
