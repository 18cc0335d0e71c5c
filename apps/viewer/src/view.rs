//! The picture in the middle of the window, and the mouse on it.

use egui::{Color32, ColorImage, Key, Rect, Sense, TextureHandle, TextureOptions, Ui};
use glam::Vec2;

use crate::camera::Orbit;
use crate::darkroom::Print;
use crate::style;

/// The picture as the window has it.
#[derive(Default)]
pub struct View {
    texture: Option<TextureHandle>,
    /// The number of the print that is shown.
    pub shown: u64,
    /// The print itself, for saving.
    pub print: Option<Print>,
}

impl View {
    /// Takes over a new print.
    pub fn set(&mut self, ctx: &egui::Context, print: Print) {
        let image = ColorImage::from_rgb(print.size, &print.rgb);
        match &mut self.texture {
            Some(texture) => texture.set(image, TextureOptions::LINEAR),
            None => self.texture = Some(ctx.load_texture("picture", image, TextureOptions::LINEAR)),
        }
        self.shown = print.number;
        self.print = Some(print);
    }

    /// Shows the picture over all the room there is and turns drags into another camera. Gives the size in pixels at which
    /// the picture should be rendered.
    pub fn show(&self, ui: &mut Ui, orbit: &mut Orbit, detail: f32) -> [usize; 2] {
        let area = ui.available_rect_before_wrap();
        let response = ui.allocate_rect(area, Sense::click_and_drag());
        ui.painter().rect_filled(area, 0.0, style::DEEP);
        match &self.texture {
            Some(texture) => {
                let uv = Rect::from_min_max(egui::pos2(0.0, 0.0), egui::pos2(1.0, 1.0));
                ui.painter().image(texture.id(), area, uv, Color32::WHITE);
            }
            None => {
                let font = egui::FontId::proportional(14.0);
                ui.painter().text(
                    area.center(),
                    egui::Align2::CENTER_CENTER,
                    "The curtain is being hung …",
                    font,
                    style::WEAK,
                );
            }
        }
        let height = area.height();
        let drag = response.drag_delta();
        let shift = ui.input(|i| i.modifiers.shift);
        if drag != egui::Vec2::ZERO {
            let pixels = Vec2::new(drag.x, drag.y);
            let pans = shift
                || response.dragged_by(egui::PointerButton::Secondary)
                || response.dragged_by(egui::PointerButton::Middle);
            *orbit = if pans {
                orbit.pan(pixels, height)
            } else {
                orbit.orbit(pixels, height)
            };
        }
        if response.hovered() {
            let (scroll, pinch) = ui.input(|i| (i.smooth_scroll_delta().y, i.zoom_delta()));
            let factor = (-scroll * 0.002).exp() / pinch.max(1e-3);
            if (factor - 1.0).abs() > 1e-5 {
                *orbit = orbit.zoom(factor);
            }
        }
        keys(ui, orbit, height);
        let pixels = area.size() * ui.ctx().pixels_per_point() * detail;
        [pixels.x, pixels.y].map(|p| p.round().clamp(16.0, 4096.0) as usize)
    }
}

/// Arrows turn, with shift they move; + and - come nearer and go away.
fn keys(ui: &Ui, orbit: &mut Orbit, height: f32) {
    if ui.ctx().memory(|m| m.focused().is_some()) {
        return;
    }
    ui.input(|i| {
        // A sixtieth of a half turn a stroke.
        let step = height / 30.0;
        let mut way = Vec2::ZERO;
        for (key, d) in [
            (Key::ArrowLeft, Vec2::NEG_X),
            (Key::ArrowRight, Vec2::X),
            (Key::ArrowUp, Vec2::NEG_Y),
            (Key::ArrowDown, Vec2::Y),
        ] {
            if i.key_pressed(key) {
                way += d * step;
            }
        }
        if way != Vec2::ZERO {
            *orbit = if i.modifiers.shift {
                orbit.pan(way, height)
            } else {
                orbit.orbit(way, height)
            };
        }
        if i.key_pressed(Key::Plus) || i.key_pressed(Key::Equals) {
            *orbit = orbit.zoom(0.9);
        }
        if i.key_pressed(Key::Minus) {
            *orbit = orbit.zoom(1.0 / 0.9);
        }
    });
}
