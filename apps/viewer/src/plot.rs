//! The polar plot: the BSDF in the plane of incidence, measured data over it, pinned curves beside it.

mod drawing;

use egui::{RichText, Slider, Ui};

use crate::cloth::Cloth;
use crate::measurement::{Measurement, Slice};
use crate::polar::{self, Plane, Scale, Value};
use crate::style;
use drawing::Drawing;

/// Powers of ten on the logarithmic plot.
const DECADES: f64 = 4.0;
/// A curve that stays while the sliders move on.
#[derive(Clone, Debug)]
pub struct Pin {
    /// What it was.
    pub name: String,
    cloth: Cloth,
}

/// What the plot shows and how.
#[derive(Clone, Debug)]
pub struct PolarPlot {
    /// Polar angle of the light [°].
    pub theta_deg: f64,
    /// Azimuth of the plane of incidence from the weft [°].
    pub phi_deg: f64,
    /// Logarithmic radius.
    pub log: bool,
    /// Curves beside the cloth's.
    pub pins: Vec<Pin>,
}

impl Default for PolarPlot {
    fn default() -> Self {
        Self {
            theta_deg: 0.0,
            phi_deg: 0.0,
            log: true,
            pins: Vec::new(),
        }
    }
}

impl PolarPlot {
    /// The plane of incidence.
    #[must_use]
    pub fn plane(&self) -> Plane {
        Plane {
            theta: self.theta_deg.to_radians(),
            phi: self.phi_deg.to_radians(),
        }
    }

    /// Keeps the cloth's curve as it is now.
    pub fn pin(&mut self, cloth: &Cloth) {
        if self.pins.len() == style::PINNED.len() {
            self.pins.remove(0);
        }
        let name = format!("{} {}", self.pins.len() + 1, cloth.model.name);
        self.pins.push(Pin {
            name,
            cloth: cloth.clone(),
        });
    }

    /// Controls, plot and the numbers under it.
    pub fn show(&mut self, ui: &mut Ui, cloth: &Cloth, measurement: Option<&Measurement>) {
        self.controls(ui, cloth);
        let wanted = self.plane();
        let slice = measurement.map(|m| m.slice(wanted)).unwrap_or_default();
        // The model is drawn for the incidence that was really measured, so that the two can be compared.
        let plane = slice.plane.unwrap_or(wanted);
        let (linear, shape) = cloth.gray();
        let curve = polar::curve(cloth.model, &linear, &shape, plane);
        let pins: Vec<_> = self
            .pins
            .iter()
            .map(|p| (p.name.clone(), pinned(&p.cloth, plane)))
            .collect();
        let values = curve
            .iter()
            .chain(pins.iter().flat_map(|(_, c)| c))
            .map(|v| v.f);
        let greatest = values
            .chain(slice.readings.iter().map(|r| r.f))
            .fold(0.0, f64::max);
        let scale = Scale::fitting(greatest, self.log.then_some(DECADES));
        let drawing = Drawing {
            plane,
            scale,
            curve: &curve,
            pins: &pins,
            slice: &slice,
            gap: cloth.gap(plane.light()),
        };
        drawing.show(ui);
        numbers(ui, cloth, plane, &slice, measurement);
    }

    fn controls(&mut self, ui: &mut Ui, cloth: &Cloth) {
        ui.horizontal(|ui| {
            ui.label(style::group("BTDF")).on_hover_text(
                "BSDF in 1/sr around the plane of incidence: reflection above the sheet, transmission below. \
                 Light comes along the dashed line. The gap, a delta, is the arrow below.",
            );
            for (log, name, about) in [(true, "log", "Logarithmic radius over four decades (L)"), (false, "linear", "Linear radius (L)")] {
                if ui.selectable_label(self.log == log, name).on_hover_text(about).clicked() {
                    self.log = log;
                }
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let pin = ui.button("Pin").on_hover_text("Keep this curve to compare others with it; five at most (P)");
                if pin.clicked() {
                    self.pin(cloth);
                }
                if !self.pins.is_empty() && ui.button("Clear").on_hover_text("Remove the pinned curves").clicked() {
                    self.pins.clear();
                }
            });
        });
        ui.horizontal(|ui| {
            ui.spacing_mut().slider_width = 100.0;
            let label = ui.label("incidence");
            ui.add(
                Slider::new(&mut self.theta_deg, 0.0..=80.0)
                    .suffix("°")
                    .max_decimals(1),
            )
            .labelled_by(label.id)
            .on_hover_text("Angle between the light and the cloth's normal");
            for (phi, name, about) in [
                (0.0, "weft", "The plane of incidence contains the weft (x)"),
                (90.0, "warp", "The plane of incidence contains the warp (y)"),
            ] {
                if ui
                    .selectable_label(self.phi_deg == phi, name)
                    .on_hover_text(about)
                    .clicked()
                {
                    self.phi_deg = phi;
                }
            }
        });
    }
}

fn pinned(cloth: &Cloth, plane: Plane) -> Vec<Value> {
    let (linear, shape) = cloth.gray();
    polar::curve(cloth.model, &linear, &shape, plane)
}

/// The sums below the plot.
fn numbers(
    ui: &mut Ui,
    cloth: &Cloth,
    plane: Plane,
    slice: &Slice,
    measurement: Option<&Measurement>,
) {
    let (linear, shape) = cloth.gray();
    let l = plane.light();
    let [t, r] = polar::albedo(cloth.model, &linear, &shape, l);
    let gap = cloth.gap(l);
    let model = format!(
        "at {:.0}°: transmits {} (gap {}), reflects {}",
        plane.theta.to_degrees(),
        number(t + gap),
        number(gap),
        number(r)
    );
    ui.label(style::weak(model)).on_hover_text("Shares of the light at this incidence that the model passes (through the gap alone) and reflects, luminance");
    let Some(measurement) = measurement else {
        return;
    };
    let mut told = format!("{}: ", measurement.name());
    match (slice.transmittance, slice.direct) {
        (None, None) => told += &format!("{} readings in this plane", slice.readings.len()),
        (whole, direct) => {
            let parts = [
                whole.map(|t| format!("transmits {}", number(t))),
                direct.map(|d| format!("straight {}", number(d))),
            ];
            told += &parts.into_iter().flatten().collect::<Vec<_>>().join(", ");
        }
    }
    ui.label(RichText::new(told).size(11.5).color(style::MEASURED))
        .on_hover_text("The measurement, at the measured incidence nearest to the slider's");
}

/// A number in three digits.
fn number(x: f64) -> String {
    if x == 0.0 {
        return "0".to_owned();
    }
    let places = (2 - x.abs().log10().floor() as i32).clamp(0, 6) as usize;
    let text = format!("{x:.places$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        for (x, text) in [
            (0.0, "0"),
            (0.0179, "0.0179"),
            (1.0, "1"),
            (0.5, "0.5"),
            (0.000_123_4, "0.000123"),
            (12.34, "12.3"),
            (1234.0, "1234"),
        ] {
            assert_eq!(number(x), text);
        }
    }
}
