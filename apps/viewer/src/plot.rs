//! The polar plot: the BSDF in the plane of incidence, measured data over it, pinned curves beside it.

use egui::{Align2, Color32, RichText, Slider, Stroke, Ui};
use egui_plot::{Arrows, Line, LineStyle, MarkerShape, Plot, PlotPoint, PlotPoints, PlotUi, Points, Polygon, Text};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::cloth::Cloth;
use crate::measurement::{Measurement, Slice};
use crate::polar::{self, Plane, Scale, Value};
use crate::style;

/// Powers of ten on the logarithmic plot.
const DECADES: f64 = 4.0;
/// Room around the unit circle for the labels.
const EDGE: f64 = 1.16;

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
        Self { theta_deg: 0.0, phi_deg: 0.0, log: true, pins: Vec::new() }
    }
}

impl PolarPlot {
    /// The plane of incidence.
    #[must_use]
    pub fn plane(&self) -> Plane {
        Plane { theta: self.theta_deg.to_radians(), phi: self.phi_deg.to_radians() }
    }

    /// Keeps the cloth's curve as it is now.
    pub fn pin(&mut self, cloth: &Cloth) {
        if self.pins.len() == style::PINNED.len() {
            self.pins.remove(0);
        }
        let name = format!("{} {}", self.pins.len() + 1, cloth.model.name);
        self.pins.push(Pin { name, cloth: cloth.clone() });
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
        let pins: Vec<_> = self.pins.iter().map(|p| (p.name.clone(), pinned(&p.cloth, plane))).collect();
        let values = curve.iter().chain(pins.iter().flat_map(|(_, c)| c)).map(|v| v.f);
        let greatest = values.chain(slice.readings.iter().map(|r| r.f)).fold(0.0, f64::max);
        let scale = Scale::fitting(greatest, self.log.then_some(DECADES));
        let drawing = Drawing { plane, scale, curve: &curve, pins: &pins, slice: &slice, gap: cloth.gap(plane.light()) };
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
            ui.add(Slider::new(&mut self.theta_deg, 0.0..=80.0).suffix("°").max_decimals(1))
                .labelled_by(label.id)
                .on_hover_text("Angle between the light and the cloth's normal");
            for (phi, name, about) in [
                (0.0, "weft", "The plane of incidence contains the weft (x)"),
                (90.0, "warp", "The plane of incidence contains the warp (y)"),
            ] {
                if ui.selectable_label(self.phi_deg == phi, name).on_hover_text(about).clicked() {
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

/// Everything that is on one plot.
struct Drawing<'a> {
    plane: Plane,
    scale: Scale,
    curve: &'a [Value],
    pins: &'a [(String, Vec<Value>)],
    slice: &'a Slice,
    gap: f64,
}

impl Drawing<'_> {
    fn show(&self, ui: &mut Ui) {
        let side = ui.available_width().min(ui.available_height() - if self.slice.plane.is_some() { 66.0 } else { 22.0 }).max(120.0);
        let scale = self.scale;
        ui.vertical_centered(|ui| {
            Plot::new("polar")
                .width(side)
                .height(side)
                .data_aspect(1.0)
                .show_axes(false)
                .show_grid(false)
                .allow_drag(false)
                .allow_zoom(false)
                .allow_scroll(false)
                .allow_boxed_zoom(false)
                .allow_double_click_reset(false)
                .show_x(false)
                .show_y(false)
                .default_x_bounds(-EDGE, EDGE)
                .default_y_bounds(-EDGE, EDGE)
                .label_formatter(move |_| None)
                .coordinates_formatter(
                    egui_plot::Corner::LeftBottom,
                    egui_plot::CoordinatesFormatter::new(move |p, _| under_pointer(scale, p)),
                )
                .show(ui, |plot| {
                    self.ground(plot);
                    for (i, (name, curve)) in self.pins.iter().enumerate() {
                        self.line(plot, name, curve, style::PINNED[i % style::PINNED.len()], 1.2);
                    }
                    self.line(plot, "model", self.curve, style::ACCENT, 2.0);
                    self.readings(plot);
                    self.legend(plot);
                });
        });
    }

    /// Circles with their values, the sheet, the light.
    fn ground(&self, plot: &mut PlotUi<'_>) {
        let circle = |r: f64| -> PlotPoints<'static> { (0..=96).map(|i| f64::from(i) / 96.0 * TAU).map(|a| [r * a.cos(), r * a.sin()]).collect() };
        let disc = Polygon::new("ground", circle(1.0)).fill_color(style::DEEP).stroke(Stroke::new(1.0, style::LINE)).allow_hover(false);
        plot.polygon(disc);
        for value in self.scale.circles() {
            let r = self.scale.radius(value);
            plot.line(Line::new("circle", circle(r)).color(style::LINE).width(0.7).allow_hover(false));
            let text = RichText::new(number(value)).size(10.0).color(style::WEAK);
            plot.text(Text::new("value", PlotPoint::new(-0.015, r - 0.005), text).anchor(Align2::RIGHT_TOP).allow_hover(false));
        }
        for degrees in (0..360).step_by(30) {
            let (sin, cos) = f64::from(degrees).to_radians().sin_cos();
            let ray = Line::new("ray", PlotPoints::from(vec![[0.0, 0.0], [sin, cos]]));
            plot.line(ray.color(style::LINE.gamma_multiply(0.55)).width(0.7).allow_hover(false));
            let shown = if degrees > 180 { 360 - degrees } else { degrees };
            if shown % 90 != 0 {
                let text = RichText::new(format!("{shown}°")).size(10.0).color(style::WEAK);
                plot.text(Text::new("angle", PlotPoint::new(1.08 * sin, 1.08 * cos), text).allow_hover(false));
            }
        }
        let sheet = Line::new("sheet", PlotPoints::from(vec![[-1.0, 0.0], [1.0, 0.0]]));
        plot.line(sheet.color(style::TEXT.gamma_multiply(0.7)).width(1.6).allow_hover(false));
        let [x, y] = Scale { top: 1.0, decades: None }.place(Value { psi: self.plane.theta, f: 1.0 });
        let light = Line::new("light", PlotPoints::from(vec![[x, y], [0.0, 0.0]]));
        plot.line(light.color(Color32::from_rgb(240, 226, 170)).style(LineStyle::dashed_loose()).width(1.2).allow_hover(false));
    }

    /// A curve in its two halves: nothing joins them through the sheet.
    fn line(&self, plot: &mut PlotUi<'_>, name: &str, curve: &[Value], color: Color32, width: f32) {
        let parts: [&dyn Fn(f64) -> bool; 3] = [&|p| p < -FRAC_PI_2, &|p| p.abs() < FRAC_PI_2, &|p| p > FRAC_PI_2];
        for part in parts {
            let points: Vec<_> = curve.iter().filter(|v| part(v.psi)).map(|v| self.scale.place(*v)).collect();
            if points.iter().any(|p| p[0].hypot(p[1]) > 1e-4) {
                plot.line(Line::new(name, PlotPoints::new(points)).color(color).width(width).allow_hover(false));
            }
        }
    }

    fn readings(&self, plot: &mut PlotUi<'_>) {
        let places = |straight: bool| -> Vec<[f64; 2]> {
            let chosen = self.slice.readings.iter().filter(|r| r.straight == straight);
            chosen.map(|r| self.scale.place(Value { psi: r.psi, f: r.f })).collect()
        };
        let marks = Points::new("measured", PlotPoints::new(places(false))).color(style::MEASURED).radius(3.0);
        plot.points(marks.allow_hover(false));
        let peak = Points::new("straight", PlotPoints::new(places(true))).color(style::MEASURED).radius(4.5);
        plot.points(peak.shape(MarkerShape::Diamond).filled(false).allow_hover(false));
        if self.gap > 0.0 {
            // The delta has no height: its arrow's length is the share, from a tenth of the radius to all of it.
            let length = 0.1 + 0.9 * self.gap;
            let [x, y] = Scale { top: 1.0, decades: None }.place(Value { psi: self.plane.straight(), f: length });
            let arrow = Arrows::new("gap", PlotPoints::from(vec![[0.0, 0.0]]), PlotPoints::from(vec![[x, y]]));
            plot.arrows(arrow.color(style::TEXT).tip_length(8.0).allow_hover(false));
        }
    }

    fn legend(&self, plot: &mut PlotUi<'_>) {
        let mut lines = vec![("model".to_owned(), style::ACCENT)];
        if !self.slice.readings.is_empty() {
            lines.push(("measured".to_owned(), style::MEASURED));
        }
        lines.extend(self.pins.iter().enumerate().map(|(i, (n, _))| (n.clone(), style::PINNED[i % style::PINNED.len()])));
        for (i, (name, color)) in lines.into_iter().enumerate() {
            let place = PlotPoint::new(-EDGE + 0.02, EDGE - 0.02 - 0.105 * i as f64);
            let text = RichText::new(name).size(11.0).color(color);
            plot.text(Text::new("legend", place, text).anchor(Align2::LEFT_TOP).allow_hover(false));
        }
    }
}

/// The value and the angle at a point of the plot.
fn under_pointer(scale: Scale, p: &PlotPoint) -> String {
    let r = p.x.hypot(p.y);
    if r > 1.0 {
        return String::new();
    }
    let psi = (-p.x).atan2(p.y);
    let behind = psi.abs() > FRAC_PI_2;
    let theta = if behind { PI - psi.abs() } else { psi.abs() };
    let what = if behind { "transmitted" } else { "reflected" };
    format!("{what} at {:.0}°: {} /sr", theta.to_degrees(), number(scale.value(r)))
}

/// The sums below the plot.
fn numbers(ui: &mut Ui, cloth: &Cloth, plane: Plane, slice: &Slice, measurement: Option<&Measurement>) {
    let (linear, shape) = cloth.gray();
    let l = plane.light();
    let [t, r] = polar::albedo(cloth.model, &linear, &shape, l);
    let gap = cloth.gap(l);
    let model = format!("at {:.0}°: transmits {} (gap {}), reflects {}", plane.theta.to_degrees(), number(t + gap), number(gap), number(r));
    ui.label(style::weak(model)).on_hover_text("Shares of the light at this incidence that the model passes (through the gap alone) and reflects, luminance");
    let Some(measurement) = measurement else { return };
    let mut told = format!("{}: ", measurement.name());
    match (slice.transmittance, slice.direct) {
        (None, None) => told += &format!("{} readings in this plane", slice.readings.len()),
        (whole, direct) => {
            let parts = [whole.map(|t| format!("transmits {}", number(t))), direct.map(|d| format!("straight {}", number(d)))];
            told += &parts.into_iter().flatten().collect::<Vec<_>>().join(", ");
        }
    }
    ui.label(RichText::new(told).size(11.5).color(style::MEASURED)).on_hover_text("The measurement, at the measured incidence nearest to the slider's");
}

/// A number in three digits.
fn number(x: f64) -> String {
    if x == 0.0 {
        return "0".to_owned();
    }
    let places = (2 - x.abs().log10().floor() as i32).clamp(0, 6) as usize;
    let text = format!("{x:.places$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        for (x, text) in [(0.0, "0"), (0.0179, "0.0179"), (1.0, "1"), (0.5, "0.5"), (0.000_123_4, "0.000123"), (12.34, "12.3"), (1234.0, "1234")] {
            assert_eq!(number(x), text);
        }
    }

    #[test]
    fn the_pointer_reads_what_the_curve_draws() {
        let scale = Scale { top: 1.0, decades: Some(4.0) };
        let [x, y] = scale.place(Value { psi: -2.6, f: 0.02 });
        assert_eq!(under_pointer(scale, &PlotPoint::new(x, y)), "transmitted at 31°: 0.02 /sr");
    }
}
