//! The panel's way onto the screen: input from the window, and what is laid out as triangles over the terrain.

use std::sync::Arc;

use egui::{FontData, FontDefinitions, FontFamily};
use winit::event::WindowEvent;
use winit::window::Window;

use super::graphics::Graphics;
use super::panel::{self, Changed, Shown};

/// Roboto's Latin letters: what the panel says, and names of files of most of Europe's languages.
const FONT: &[u8] = include_bytes!("../../data/fonts/Roboto-Latin.ttf");

/// The opacity of the panel, of 255.
const OPACITY: u8 = 225;

/// What lays out and draws the panel on one device.
pub(super) struct Overlay {
    ctx: egui::Context,
    state: egui_winit::State,
    renderer: egui_wgpu::Renderer,
    pixels_per_point: f32,
    jobs: Vec<egui::ClippedPrimitive>,
    pending: Vec<(egui::TextureId, egui::epaint::ImageDelta)>,
    freed: Vec<egui::TextureId>,
    errors: Option<egui::TextureHandle>,
}

/// What the panel asks of the window.
pub(super) struct Asked {
    /// Seconds until it wants to be drawn again.
    pub(super) again_s: f64,
}

/// A context with the font and the looks of the panel.
pub(super) fn context() -> egui::Context {
    let ctx = egui::Context::default();
    let mut fonts = FontDefinitions::empty();
    fonts
        .font_data
        .insert("Roboto".into(), Arc::new(FontData::from_static(FONT)));
    for family in [FontFamily::Proportional, FontFamily::Monospace] {
        fonts.families.insert(family, vec!["Roboto".into()]);
    }
    ctx.set_fonts(fonts);
    ctx.set_theme(egui::Theme::Dark);
    ctx.all_styles_mut(|style| {
        let fill = style.visuals.window_fill;
        style.visuals.window_fill =
            egui::Color32::from_rgba_unmultiplied(fill.r(), fill.g(), fill.b(), OPACITY);
        style.visuals.override_text_color = Some(egui::Color32::from_gray(225));
        style.interaction.selectable_labels = false;
    });
    ctx
}

impl Overlay {
    pub(super) fn new(window: &Window, graphics: &Graphics) -> Self {
        let ctx = context();
        let device = &graphics.gpu.device;
        let state = egui_winit::State::new(
            ctx.clone(),
            egui::ViewportId::ROOT,
            window,
            Some(window.scale_factor() as f32),
            None,
            Some(device.limits().max_texture_dimension_2d as usize),
        );
        let renderer = egui_wgpu::Renderer::new(device, graphics.format(), Default::default());
        Self {
            pixels_per_point: window.scale_factor() as f32,
            ctx,
            state,
            renderer,
            jobs: Vec::new(),
            pending: Vec::new(),
            freed: Vec::new(),
            errors: None,
        }
    }

    /// Tells the panel of an event. Whether it keeps it for itself: then it is none for the camera.
    pub(super) fn event(&mut self, window: &Window, event: &WindowEvent) -> bool {
        // Letters are the camera's, but where a number is being typed.
        let typing = self.ctx.egui_wants_keyboard_input();
        if matches!(event, WindowEvent::KeyboardInput { .. } | WindowEvent::Ime(_)) && !typing {
            return false;
        }
        self.state.on_window_event(window, event).consumed
    }

    /// Lays out what is shown, with what has been clicked since.
    pub(super) fn lay_out(&mut self, window: &Window, shown: &Shown, changed: &mut Changed) -> Asked {
        let input = self.state.take_egui_input(window);
        let mut output = self.ctx.run_ui(input, |ui| panel::show(ui, shown, changed));
        self.state.handle_platform_output(window, output.platform_output);
        self.pixels_per_point = output.pixels_per_point;
        self.jobs = self.ctx.tessellate(output.shapes, output.pixels_per_point);
        self.freed.extend(output.textures_delta.free.drain());
        for (id, deltas) in output.textures_delta.set.drain() {
            self.pending.extend(deltas.into_iter().map(|delta| (id, delta)));
        }
        let root = output.viewport_output.get(&egui::ViewportId::ROOT);
        Asked {
            again_s: root.map_or(f64::INFINITY, |v| v.repaint_delay.as_secs_f64()),
        }
    }

    /// Records what was laid out over `view`, a picture of `size_px` pixels.
    pub(super) fn record(
        &mut self,
        graphics: &Graphics,
        encoder: &mut wgpu::CommandEncoder,
        view: &wgpu::TextureView,
        size_px: [u32; 2],
    ) {
        let (device, queue) = (&graphics.gpu.device, &graphics.gpu.queue);
        for (id, delta) in self.pending.drain(..) {
            self.renderer.update_texture(device, queue, id, &delta);
        }
        let screen = egui_wgpu::ScreenDescriptor {
            size_in_pixels: size_px,
            pixels_per_point: self.pixels_per_point,
        };
        self.renderer
            .update_buffers(device, queue, encoder, &self.jobs, &screen);
        let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("clipscape panel"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Load,
                    store: wgpu::StoreOp::Store,
                },
            })],
            ..Default::default()
        });
        self.renderer
            .render(&mut pass.forget_lifetime(), &self.jobs, &screen);
        for id in self.freed.drain(..) {
            self.renderer.free_texture(&id);
        }
    }

    /// Whether the pointer is over the panel or the help.
    pub(super) fn has_pointer(&self) -> bool {
        self.ctx.is_pointer_over_egui()
    }

    /// Shows a picture of errors over the terrain, or none.
    pub(super) fn set_errors(&mut self, picture: Option<([u32; 2], &[u8])>) {
        self.errors = picture.map(|(size_px, rgba8)| {
            let image = egui::ColorImage::from_rgba_unmultiplied(size_px.map(|s| s as usize), rgba8);
            self.ctx
                .load_texture("clipscape errors", image, egui::TextureOptions::NEAREST)
        });
    }

    /// The picture of errors that is shown.
    pub(super) fn errors(&self) -> Option<egui::TextureId> {
        self.errors.as_ref().map(egui::TextureHandle::id)
    }
}
