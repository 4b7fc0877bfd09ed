//! What the window's system calls: keys, buttons, wheel and pointer to the camera and the panel, and frames when they are
//! wanted.

use std::time::{Duration, Instant};

use glam::DVec2;
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalPosition;
use winit::event::{DeviceEvent, DeviceId, ElementState, MouseScrollDelta, StartCause, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow};
use winit::keyboard::{KeyCode, PhysicalKey};
use winit::window::{CursorGrabMode, Fullscreen, WindowId};

use super::super::controls::{self, Action, Does, Motion};
use super::{App, LOOK};
use crate::error::Error;

/// How often the window looks how far loading is.
const LOOK_LOADING: Duration = Duration::from_millis(40);

/// Pixels of a touchpad that are a notch of a wheel.
const NOTCH_PX: f64 = 40.0;

impl App<'_> {
    fn key(&mut self, events: &ActiveEventLoop, code: KeyCode, down: bool, repeat: bool) {
        if code == KeyCode::F12
            && down
            && self.options.loses_device
            && let Some(graphics) = &self.graphics
        {
            graphics.gpu.device.destroy();
        }
        match controls::does(code) {
            Some(Does::Move(_)) => self.held.set(code, down),
            Some(Does::Act(action)) if down && (!repeat || action.repeats()) => self.act(events, action),
            _ => {}
        }
    }

    fn act(&mut self, events: &ActiveEventLoop, action: Action) {
        let now_s = self.now_s();
        let less = self.held.is(Motion::Fast);
        match action {
            Action::Help => self.help_shown = !self.help_shown,
            Action::Panel => self.panel_shown = !self.panel_shown,
            Action::FullScreen => self.full_screen(None),
            Action::Leave => self.leave(events),
            Action::Capture => self.capture(!self.pointer.captured),
            Action::Show(mode) => self.settings.view_mode = mode,
            Action::Tint => self.settings.tint = !self.settings.tint,
            Action::Haze => self.settings.haze = !self.settings.haze,
            Action::Turn(dial) => self.settings.turn(dial, !less),
            Action::Picture => self.picture_wanted = self.flying.is_some(),
            Action::Record => self.record(),
            Action::WholeView | Action::BelowGround | Action::Faster | Action::Slower => {
                let (Some(flying), Some(graphics)) = (&mut self.flying, &self.graphics) else {
                    return;
                };
                match action {
                    Action::WholeView => flying.show_whole(&self.settings, graphics.size_px(), now_s),
                    Action::BelowGround => flying.pilot.below_ground = !flying.pilot.below_ground,
                    Action::Faster => flying.pilot.shift_speed(1),
                    _ => flying.pilot.shift_speed(-1),
                }
            }
        }
    }

    /// Lets the mouse go, closes the help, leaves full screen; or where there is nothing of these, quits.
    fn leave(&mut self, events: &ActiveEventLoop) {
        let full = self.window.as_ref().is_some_and(|w| w.fullscreen().is_some());
        if self.pointer.captured {
            self.capture(false);
        } else if self.help_shown {
            self.help_shown = false;
        } else if full {
            self.full_screen(Some(false));
        } else {
            self.end(events, Ok(()));
        }
    }

    fn full_screen(&self, full: Option<bool>) {
        if let Some(window) = &self.window {
            let full = full.unwrap_or(window.fullscreen().is_none());
            window.set_fullscreen(full.then_some(Fullscreen::Borderless(None)));
        }
    }

    /// Holds the pointer, or lets it go. Where the system does not allow it, it is looked around by dragging.
    fn capture(&mut self, captured: bool) {
        let Some(window) = &self.window else { return };
        let held = captured
            && (window.set_cursor_grab(CursorGrabMode::Locked))
                .or_else(|_| window.set_cursor_grab(CursorGrabMode::Confined))
                .is_ok();
        if !held {
            // Where it was not held, there is nothing to be let go.
            let _ = window.set_cursor_grab(CursorGrabMode::None);
        }
        window.set_cursor_visible(!held);
        self.pointer.captured = held;
        if captured && !held {
            self.say("The mouse cannot be held here; drag with a button instead");
        }
    }

    fn look(&mut self, moved: DVec2) {
        let (Some(flying), Some(graphics)) = (&mut self.flying, &self.graphics) else {
            return;
        };
        flying
            .pilot
            .look(moved.to_array(), f64::from(graphics.size_px()[1]));
    }

    fn pointer_moved(&mut self, to: PhysicalPosition<f64>) {
        let from = self.pointer.at.replace(to);
        if let Some(from) = from.filter(|_| self.pointer.dragging > 0 && !self.pointer.captured) {
            self.look(DVec2::new(to.x - from.x, to.y - from.y));
        }
    }

    fn wheel(&mut self, delta: MouseScrollDelta) {
        self.pointer.wheel += match delta {
            MouseScrollDelta::LineDelta(_, lines) => f64::from(lines),
            MouseScrollDelta::PixelDelta(pixels) => pixels.y / NOTCH_PX,
        };
        let notches = self.pointer.wheel.trunc();
        self.pointer.wheel -= notches;
        if let Some(flying) = &mut self.flying {
            flying.pilot.shift_speed(notches as i32);
        }
    }

    /// Whether frames follow each other without anything happening.
    fn goes_on(&self) -> bool {
        self.follows && !self.hidden
    }
}

impl ApplicationHandler for App<'_> {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if self.window.is_none()
            && let Err(error) = self.open_window(events)
        {
            self.end(events, Err(error));
        }
    }

    fn new_events(&mut self, events: &ActiveEventLoop, _: StartCause) {
        if self.progress.cancelled() {
            self.end(events, Err(Error::cancelled("fly")));
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let (Some(window), Some(overlay)) = (&self.window, &mut self.overlay) else {
            return;
        };
        let window = window.clone();
        // A drag that began over the terrain goes on over the panel.
        let kept = overlay.event(&window, &event) && self.pointer.dragging == 0 && !self.pointer.captured;
        if !matches!(event, WindowEvent::RedrawRequested) {
            window.request_redraw();
        }
        match event {
            WindowEvent::CloseRequested | WindowEvent::Destroyed => self.end(events, Ok(())),
            WindowEvent::RedrawRequested => {
                if let Err(error) = self.draw() {
                    self.end(events, Err(error));
                }
            }
            WindowEvent::Occluded(hidden) => self.hidden = hidden,
            WindowEvent::Focused(false) => {
                self.held.clear();
                self.pointer.dragging = 0;
                if self.pointer.captured {
                    self.capture(false);
                }
            }
            WindowEvent::KeyboardInput { event, .. } => {
                if let PhysicalKey::Code(code) = event.physical_key {
                    // A key may be released over the panel that went down over the terrain.
                    let down = event.state == ElementState::Pressed;
                    if !(kept && down) {
                        self.key(events, code, down, event.repeat);
                    }
                }
            }
            WindowEvent::MouseInput { state, .. } => {
                self.pointer.dragging = match state {
                    ElementState::Pressed if !kept => self.pointer.dragging + 1,
                    ElementState::Pressed => self.pointer.dragging,
                    ElementState::Released => self.pointer.dragging.saturating_sub(1),
                };
            }
            WindowEvent::CursorMoved { position, .. } => self.pointer_moved(position),
            WindowEvent::CursorLeft { .. } if self.pointer.dragging == 0 => self.pointer.at = None,
            WindowEvent::MouseWheel { delta, .. } if !kept => self.wheel(delta),
            _ => {}
        }
    }

    fn device_event(&mut self, _: &ActiveEventLoop, _: DeviceId, event: DeviceEvent) {
        if let DeviceEvent::MouseMotion { delta } = event
            && self.pointer.captured
        {
            self.look(DVec2::from(delta));
            if let Some(window) = &self.window {
                window.request_redraw();
            }
        }
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        let Some(window) = &self.window else { return };
        let (now_s, now) = (self.now_s(), Instant::now());
        if self.goes_on() {
            window.request_redraw();
            events.set_control_flow(ControlFlow::Poll);
            return;
        }
        if now_s >= self.next_s && !self.hidden {
            window.request_redraw();
        }
        let look = if self.loading.is_some() {
            LOOK_LOADING
        } else {
            LOOK
        };
        if self.loading.is_some() {
            window.request_redraw();
        }
        let next = Duration::from_secs_f64((self.next_s - now_s).clamp(0.0, look.as_secs_f64()));
        events.set_control_flow(ControlFlow::WaitUntil(now + next));
    }
}
