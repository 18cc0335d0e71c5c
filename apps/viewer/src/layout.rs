//! Where things are in the window: a bar above, the picture, sliders and plot on the right, the status below.

use std::path::Path;

use egui::{
    Align, ComboBox, Frame, Key, Layout, Margin, Modifiers, Panel, RichText, ScrollArea, Slider, Ui,
};
use woven_catalog::stage::Preset;

use crate::app::Viewer;
use crate::files::Purpose;
use crate::{sliders, style};

/// Width of the right panel.
const SIDE: f32 = 348.0;
/// Height of the plot with its controls and numbers.
const PLOT: f32 = 430.0;

impl Viewer {
    /// The whole window.
    pub fn show(&mut self, ui: &mut Ui) {
        let ctx = ui.ctx().clone();
        self.update(&ctx);
        self.keys(&ctx);
        let bar = Frame::new()
            .fill(style::GROUND)
            .inner_margin(Margin::symmetric(10, 6));
        Panel::top("bar").frame(bar).show(ui, |ui| self.bar(ui));
        if !self.messages.is_empty() {
            Panel::top("messages")
                .frame(bar)
                .show(ui, |ui| self.told(ui));
        }
        Panel::bottom("status")
            .frame(bar.inner_margin(Margin::symmetric(10, 4)))
            .show(ui, |ui| self.status(ui));
        let side = Frame::new().fill(style::GROUND).inner_margin(Margin {
            left: 10,
            right: 10,
            top: 2,
            bottom: 4,
        });
        Panel::right("side")
            .frame(side)
            .exact_size(SIDE)
            .resizable(false)
            .show(ui, |ui| self.side(ui));
        let mut orbit = self.orbit;
        let detail = self.detail;
        let size = egui::CentralPanel::no_frame()
            .show(ui, |ui| self.view.show(ui, &mut orbit, detail))
            .inner;
        self.look_from(orbit, size);
        self.show_chooser(&ctx);
        self.update(&ctx);
    }

    fn bar(&mut self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            self.fabric_choice(ui);
            if ui
                .button("Open…")
                .on_hover_text(
                    "Open a fabric file (Ctrl+O); files can also be dropped onto the window",
                )
                .clicked()
            {
                self.choose_file(Purpose::OpenFabric);
            }
            if ui
                .button("Save fabric…")
                .on_hover_text("Write a .toml of the sliders (Ctrl+S)")
                .clicked()
            {
                self.choose_file(Purpose::SaveFabric);
            }
            let measure = ui.button("Measurement…").on_hover_text(
                "Lay measured data over the plot: Klems .xml or the rig's .csv (Ctrl+M)",
            );
            if measure.clicked() {
                self.choose_file(Purpose::OpenMeasurement);
            }
            ui.separator();
            for preset in Preset::CATALOG {
                let about = match preset {
                    Preset::Day => "Sun and sky outside (D)",
                    _ => "Lamps inside, dusk outside (E)",
                };
                if ui
                    .selectable_label(self.preset == preset, preset.title())
                    .on_hover_text(about)
                    .clicked()
                {
                    self.set_preset(preset);
                }
            }
            ui.separator();
            if ui
                .selectable_label(self.wind, "Wind")
                .on_hover_text("Let the wind in: the curtain moves (W)")
                .clicked()
            {
                self.set_wind(!self.wind);
            }
            ui.separator();
            ui.spacing_mut().slider_width = 96.0;
            let label = ui.label("exposure");
            let slider = Slider::new(&mut self.exposure, -4.0..=4.0)
                .step_by(0.1)
                .suffix(" EV")
                .fixed_decimals(1);
            let exposure = ui.add(slider).labelled_by(label.id);
            if exposure
                .on_hover_text("Stops by which the picture is brighter ([ and ]); double click: 0")
                .double_clicked()
            {
                self.exposure = 0.0;
            }
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                if ui
                    .button("Save picture…")
                    .on_hover_text("Write the picture as a .png (Ctrl+P)")
                    .clicked()
                {
                    self.choose_file(Purpose::SavePicture);
                }
                if ui
                    .button("Home")
                    .on_hover_text("Back to where the eye was at first (H)")
                    .clicked()
                {
                    self.go_home();
                }
            });
        });
    }

    fn fabric_choice(&mut self, ui: &mut Ui) {
        let name = |path: &Path| {
            path.file_stem()
                .map(|n| n.to_string_lossy().into_owned())
                .unwrap_or_default()
        };
        let mut chosen = None;
        let shown = if self.cloth.changed() {
            format!("{} *", self.cloth.name())
        } else {
            self.cloth.name().to_owned()
        };
        let combo = ComboBox::from_id_salt("fabric")
            .width(200.0)
            .truncate()
            .selected_text(shown)
            .show_ui(ui, |ui| {
                if self.fabrics.is_empty() {
                    ui.label(style::weak(
                        "No fabric file yet; open one, or save this one.",
                    ));
                }
                for path in &self.fabrics {
                    if ui
                        .selectable_label(false, name(path))
                        .on_hover_text(path.display().to_string())
                        .clicked()
                    {
                        chosen = Some(path.clone());
                    }
                }
            });
        combo
            .response
            .on_hover_text("The fabric; a star says that sliders stand elsewhere than in its file");
        if let Some(path) = chosen {
            self.open_fabric(&path);
        }
    }

    fn told(&mut self, ui: &mut Ui) {
        let mut closed = None;
        for (i, message) in self.messages.iter().enumerate() {
            ui.horizontal(|ui| {
                if ui
                    .small_button("OK")
                    .on_hover_text("Close this sentence")
                    .clicked()
                {
                    closed = Some(i);
                }
                let color = if message.wrong {
                    style::WRONG
                } else {
                    style::TEXT
                };
                ui.add(egui::Label::new(RichText::new(&message.text).color(color)).wrap());
            });
        }
        if let Some(i) = closed {
            self.messages.remove(i);
        }
    }

    fn side(&mut self, ui: &mut Ui) {
        let plot = Frame::new().inner_margin(Margin {
            top: 6,
            ..Margin::ZERO
        });
        Panel::bottom("plot")
            .frame(plot)
            .exact_size(PLOT.min(ui.available_height() * 0.6))
            .resizable(false)
            .show(ui, |ui| {
                self.plot.show(ui, &self.cloth, self.measurement.as_ref());
                self.fit_button(ui);
            });
        ScrollArea::vertical()
            .auto_shrink([false, false])
            .show(ui, |ui| {
                ui.add_space(4.0);
                if sliders::show(ui, &mut self.cloth, self.woven.misfit) {
                    self.cloth_changed();
                }
                ui.add_space(4.0);
            });
    }

    fn fit_button(&mut self, ui: &mut Ui) {
        if self.measurement.is_none() {
            return;
        }
        ui.horizontal(|ui| match &self.fitting {
            None => {
                let button = ui.button(format!("Fit {}", self.cloth.model.name));
                if button.on_hover_text("Fit this model to the measurement (Levenberg–Marquardt) and put the sliders there").clicked() {
                    let ctx = ui.ctx().clone();
                    self.fit(&ctx);
                }
            }
            Some(fitting) => {
                let bar = egui::ProgressBar::new(fitting.share()).desired_width(180.0).desired_height(12.0);
                ui.add(bar.fill(style::MEASURED.gamma_multiply(0.7)));
                if ui.button("Stop").clicked() {
                    self.fitting = None;
                }
            }
        });
    }

    fn status(&mut self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            let text = match &self.picture {
                None => "starting …".to_owned(),
                Some(p) => {
                    let [w, h] = p.size;
                    let state = if p.finished {
                        "finished"
                    } else if p.full {
                        "refining"
                    } else {
                        "coarse"
                    };
                    format!(
                        "{w} × {h} · {} samples a pixel · {} samples/s · {} · {state}",
                        p.passes,
                        large(p.rate),
                        p.backend
                    )
                }
            };
            ui.label(style::weak(text));
            if self.hung == [true, false] {
                ui.label(style::weak("· the curtain is coming to rest"));
            }
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                for (detail, name) in [(0.5, "half"), (1.0, "full")] {
                    let chosen = ui.selectable_label(self.detail == detail, style::weak(name));
                    if chosen
                        .on_hover_text(
                            "Pixels of the picture for a pixel of the screen along a side",
                        )
                        .clicked()
                    {
                        self.detail = detail;
                    }
                }
                if ui
                    .selectable_label(self.smooth, style::weak("smooth"))
                    .on_hover_text("Filter the noise (N)")
                    .clicked()
                {
                    self.smooth = !self.smooth;
                }
                ui.label(style::weak(
                    "drag: turn · shift+drag: move · wheel: nearer        ",
                ));
            });
        });
    }

    fn keys(&mut self, ctx: &egui::Context) {
        if self.choosing() || ctx.text_edit_focused() {
            return;
        }
        let pressed = |modifiers: Modifiers, key| ctx.input_mut(|i| i.consume_key(modifiers, key));
        for (key, purpose) in [
            (Key::O, Purpose::OpenFabric),
            (Key::S, Purpose::SaveFabric),
            (Key::M, Purpose::OpenMeasurement),
            (Key::P, Purpose::SavePicture),
        ] {
            if pressed(Modifiers::COMMAND, key) {
                self.choose_file(purpose);
            }
        }
        let plain = |key| pressed(Modifiers::NONE, key);
        if plain(Key::D) {
            self.set_preset(Preset::Day);
        }
        if plain(Key::E) {
            self.set_preset(Preset::Evening);
        }
        if plain(Key::W) {
            self.set_wind(!self.wind);
        }
        if plain(Key::N) {
            self.smooth = !self.smooth;
        }
        if plain(Key::H) {
            self.go_home();
        }
        if plain(Key::L) {
            self.plot.log = !self.plot.log;
        }
        if plain(Key::P) {
            self.plot.pin(&self.cloth);
        }
        for (key, step) in [(Key::OpenBracket, -0.2), (Key::CloseBracket, 0.2)] {
            if plain(key) {
                self.exposure = (self.exposure + step).clamp(-4.0, 4.0);
            }
        }
    }
}

/// A large number in words a person reads.
fn large(x: f64) -> String {
    match x {
        x if x >= 1e6 => format!("{:.2} M", x * 1e-6),
        x if x >= 1e3 => format!("{:.0} k", x * 1e-3),
        x => format!("{x:.0}"),
    }
}
