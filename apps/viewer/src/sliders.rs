//! The sliders of the cloth, made from the model's list of parameters: a new parameter needs no line here.

use egui::{Button, ComboBox, Grid, Slider, SliderClamping, Ui};
use woven_bsdf::model::{MODELS, Param, Role};

use crate::cloth::Cloth;
use crate::style;

/// Width of the name's column and of a slider's rail.
const NAME: f32 = 76.0;
/// See [`NAME`].
const RAIL: f32 = 132.0;

/// The tooltip of a parameter: what it means, its unit, its range and the model's equation.
#[must_use]
pub fn tooltip(param: &Param, equation: &str) -> String {
    let unit = if param.unit.is_empty() {
        "a pure number"
    } else {
        param.unit
    };
    let scale = if param.log { ", logarithmic" } else { "" };
    format!(
        "{}: {}\n{unit}, {} … {}{scale}\n\nf = {equation}",
        param.name, param.meaning, param.min, param.max
    )
}

/// The model's choice, its equation and all sliders; true when the cloth is another than before.
///
/// `misfit` is what [`crate::nearest`] tells of the sheet in the picture.
pub fn show(ui: &mut Ui, cloth: &mut Cloth, misfit: f64) -> bool {
    let mut changed = model(ui, cloth);
    ui.add_space(2.0);
    for (role, title, about) in [
        (
            Role::Linear,
            "Linear factors",
            "How much light goes each way; a fit separates them. The swatch colours a factor.",
        ),
        (
            Role::Shape,
            "Shape",
            "What the lobes and the weave look like.",
        ),
    ] {
        if cloth.params(role).next().is_none() {
            continue;
        }
        ui.add_space(4.0);
        ui.label(style::group(title)).on_hover_text(about);
        Grid::new(title)
            .num_columns(3)
            .spacing([6.0, 4.0])
            .show(ui, |ui| {
                for (index, param) in cloth.params(role) {
                    changed |= row(ui, cloth, index, param);
                    ui.end_row();
                }
            });
    }
    if cloth.model.name != "sheet" {
        changed |= stand_in(ui, cloth, misfit);
    } else if cloth.given() > 1.0 + 1e-9 {
        let told = format!(
            "The factors sum to {:.2}; drawn and saved scaled to 1, for the yarn gives no more than it gets.",
            cloth.given()
        );
        ui.label(egui::RichText::new(told).size(11.5).color(style::WRONG));
    }
    changed
}

fn model(ui: &mut Ui, cloth: &mut Cloth) -> bool {
    let mut chosen = cloth.model;
    let mut changed = false;
    ui.horizontal(|ui| {
        ui.label(style::group("Model"));
        let combo = ComboBox::from_id_salt("model")
            .width(150.0)
            .selected_text(chosen.name)
            .show_ui(ui, |ui| {
                for model in MODELS {
                    if ui
                        .selectable_label(model.name == chosen.name, model.name)
                        .on_hover_text(model.doc)
                        .clicked()
                    {
                        chosen = model;
                    }
                }
            });
        combo.response.on_hover_text(cloth.model.doc);
        let back = ui
            .add(Button::new("Reset all"))
            .on_hover_text("All sliders back to the fabric's file, or to the model's start");
        if back.clicked() {
            cloth.reset();
            changed = true;
        }
    });
    if chosen.name != cloth.model.name {
        cloth.choose(chosen);
        changed = true;
    }
    let equation = egui::RichText::new(format!("f = {}", cloth.model.equation))
        .size(11.0)
        .color(style::WEAK);
    ui.add(egui::Label::new(equation).truncate())
        .on_hover_text(format!(
            "f = {}\n\n{}",
            cloth.model.equation, cloth.model.doc
        ));
    changed
}

/// Name, slider and, for factors, colour; a double click on the name puts the slider back.
fn row(ui: &mut Ui, cloth: &mut Cloth, index: usize, param: &'static Param) -> bool {
    let mut changed = false;
    let tip = tooltip(param, cloth.model.equation);
    let start = cloth.start_of(index);
    let differs = cloth.values[index] != start;
    let name =
        egui::RichText::new(param.name).color(if differs { style::ACCENT } else { style::TEXT });
    let label = named(ui, egui::Label::new(name).sense(egui::Sense::click()))
        .on_hover_text(format!("{tip}\n\nDouble click: back to {start:.4}"));
    if label.double_clicked() && differs {
        cloth.values[index] = start;
        changed = true;
    }
    ui.spacing_mut().slider_width = RAIL;
    let slider = Slider::new(&mut cloth.values[index], param.min..=param.max)
        .logarithmic(param.log)
        // A value read from a file keeps its digits until the slider is moved.
        .clamping(SliderClamping::Edits)
        .max_decimals(4)
        .suffix(if param.unit.is_empty() {
            String::new()
        } else {
            format!(" {}", param.unit)
        });
    changed |= ui
        .add(slider)
        .labelled_by(label.id)
        .on_hover_text(tip)
        .changed();
    if param.role == Role::Linear {
        ui.spacing_mut().interact_size.x = 26.0;
        changed |= color(ui, &mut cloth.colors[index], param.name);
    }
    changed
}

/// A label in the column of names.
fn named(ui: &mut Ui, label: egui::Label) -> egui::Response {
    ui.horizontal(|ui| {
        ui.set_min_width(NAME);
        ui.add(label)
    })
    .inner
}

/// A swatch of a factor's colour; egui's button works in f32.
fn color(ui: &mut Ui, color: &mut [f64; 3], name: &str) -> bool {
    // Colours above 1 are legal in files; the swatch shows them scaled and leaves them alone until it is used.
    let top = color.iter().copied().fold(1.0, f64::max);
    let mut rgb = color.map(|c| (c / top) as f32);
    let response = ui
        .color_edit_button_rgb(&mut rgb)
        .on_hover_text(format!("Colour of {name}, linear Rec. 709"));
    if response.changed() {
        *color = rgb.map(|c| f64::from(c) * top);
    }
    response.changed()
}

/// For models of transmission alone: what the curtain reflects, and how well the sheet stands in for the model.
fn stand_in(ui: &mut Ui, cloth: &mut Cloth, misfit: f64) -> bool {
    ui.add_space(4.0);
    ui.label(style::group("In the picture"));
    let mut changed = false;
    Grid::new("stand-in").num_columns(2).spacing([6.0, 4.0]).show(ui, |ui| {
        let label = named(ui, egui::Label::new("reflection"));
        ui.spacing_mut().slider_width = RAIL;
        let slider = ui.add(Slider::new(&mut cloth.reflect, 0.0..=1.0).max_decimals(3)).labelled_by(label.id);
        changed |= slider.on_hover_text("Share of the light that the curtain reflects evenly; this model knows transmission only").changed();
    });
    let told = format!(
        "The curtain is drawn with the sheet nearest to {}: {:.0} % off in the mean.",
        cloth.model.name,
        misfit * 100.0
    );
    ui.add(egui::Label::new(style::weak(told)).wrap()).on_hover_text(
        "The renderer draws sheets. This is the root mean square of the difference as a share of the model's own, over directions behind the cloth.",
    );
    changed
}
