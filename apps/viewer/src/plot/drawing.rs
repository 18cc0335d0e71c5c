//! The drawing of the polar plot: circles, the sheet, the light, curves, readings, legend.

use egui::{Align2, Color32, RichText, Stroke, Ui};
use egui_plot::{
    Arrows, Line, LineStyle, MarkerShape, Plot, PlotPoint, PlotPoints, PlotUi, Points, Polygon,
    Text,
};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::number;
use crate::measurement::Slice;
use crate::polar::{Plane, Scale, Value};
use crate::style;

/// Room around the unit circle for the labels.
const EDGE: f64 = 1.16;

/// Everything that is on one plot.
pub(super) struct Drawing<'a> {
    pub(super) plane: Plane,
    pub(super) scale: Scale,
    pub(super) curve: &'a [Value],
    pub(super) pins: &'a [(String, Vec<Value>)],
    pub(super) slice: &'a Slice,
    pub(super) gap: f64,
}

impl Drawing<'_> {
    /// Draws into a square as large as there is room.
    pub(super) fn show(&self, ui: &mut Ui) {
        let side = ui
            .available_width()
            .min(
                ui.available_height()
                    - if self.slice.plane.is_some() {
                        66.0
                    } else {
                        22.0
                    },
            )
            .max(120.0);
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
                        self.line(
                            plot,
                            name,
                            curve,
                            style::PINNED[i % style::PINNED.len()],
                            1.2,
                        );
                    }
                    self.line(plot, "model", self.curve, style::ACCENT, 2.0);
                    self.readings(plot);
                    self.legend(plot);
                });
        });
    }

    /// Circles with their values, the sheet, the light.
    fn ground(&self, plot: &mut PlotUi<'_>) {
        let circle = |r: f64| -> PlotPoints<'static> {
            (0..=96)
                .map(|i| f64::from(i) / 96.0 * TAU)
                .map(|a| [r * a.cos(), r * a.sin()])
                .collect()
        };
        let disc = Polygon::new("ground", circle(1.0))
            .fill_color(style::DEEP)
            .stroke(Stroke::new(1.0, style::LINE))
            .allow_hover(false);
        plot.polygon(disc);
        for value in self.scale.circles() {
            let r = self.scale.radius(value);
            plot.line(
                Line::new("circle", circle(r))
                    .color(style::LINE)
                    .width(0.7)
                    .allow_hover(false),
            );
            let text = RichText::new(number(value)).size(10.0).color(style::WEAK);
            plot.text(
                Text::new("value", PlotPoint::new(-0.015, r - 0.005), text)
                    .anchor(Align2::RIGHT_TOP)
                    .allow_hover(false),
            );
        }
        for degrees in (0..360).step_by(30) {
            let (sin, cos) = f64::from(degrees).to_radians().sin_cos();
            let ray = Line::new("ray", PlotPoints::from(vec![[0.0, 0.0], [sin, cos]]));
            plot.line(
                ray.color(style::LINE.gamma_multiply(0.55))
                    .width(0.7)
                    .allow_hover(false),
            );
            let shown = if degrees > 180 {
                360 - degrees
            } else {
                degrees
            };
            if shown % 90 != 0 {
                let text = RichText::new(format!("{shown}°"))
                    .size(10.0)
                    .color(style::WEAK);
                plot.text(
                    Text::new("angle", PlotPoint::new(1.08 * sin, 1.08 * cos), text)
                        .allow_hover(false),
                );
            }
        }
        let sheet = Line::new("sheet", PlotPoints::from(vec![[-1.0, 0.0], [1.0, 0.0]]));
        plot.line(
            sheet
                .color(style::TEXT.gamma_multiply(0.7))
                .width(1.6)
                .allow_hover(false),
        );
        let [x, y] = Scale {
            top: 1.0,
            decades: None,
        }
        .place(Value {
            psi: self.plane.theta,
            f: 1.0,
        });
        let light = Line::new("light", PlotPoints::from(vec![[x, y], [0.0, 0.0]]));
        plot.line(
            light
                .color(Color32::from_rgb(240, 226, 170))
                .style(LineStyle::dashed_loose())
                .width(1.2)
                .allow_hover(false),
        );
    }

    /// A curve in its two halves: nothing joins them through the sheet.
    fn line(&self, plot: &mut PlotUi<'_>, name: &str, curve: &[Value], color: Color32, width: f32) {
        let parts: [&dyn Fn(f64) -> bool; 3] =
            [&|p| p < -FRAC_PI_2, &|p| p.abs() < FRAC_PI_2, &|p| {
                p > FRAC_PI_2
            }];
        for part in parts {
            let points: Vec<_> = curve
                .iter()
                .filter(|v| part(v.psi))
                .map(|v| self.scale.place(*v))
                .collect();
            if points.iter().any(|p| p[0].hypot(p[1]) > 1e-4) {
                plot.line(
                    Line::new(name, PlotPoints::new(points))
                        .color(color)
                        .width(width)
                        .allow_hover(false),
                );
            }
        }
    }

    fn readings(&self, plot: &mut PlotUi<'_>) {
        let places = |straight: bool| -> Vec<[f64; 2]> {
            let chosen = self
                .slice
                .readings
                .iter()
                .filter(|r| r.straight == straight);
            chosen
                .map(|r| self.scale.place(Value { psi: r.psi, f: r.f }))
                .collect()
        };
        let marks = Points::new("measured", PlotPoints::new(places(false)))
            .color(style::MEASURED)
            .radius(3.0);
        plot.points(marks.allow_hover(false));
        let peak = Points::new("straight", PlotPoints::new(places(true)))
            .color(style::MEASURED)
            .radius(4.5);
        plot.points(
            peak.shape(MarkerShape::Diamond)
                .filled(false)
                .allow_hover(false),
        );
        if self.gap > 0.0 {
            // The delta has no height: its arrow's length is the share, from a tenth of the radius to all of it.
            let length = 0.1 + 0.9 * self.gap;
            let [x, y] = Scale {
                top: 1.0,
                decades: None,
            }
            .place(Value {
                psi: self.plane.straight(),
                f: length,
            });
            let arrow = Arrows::new(
                "gap",
                PlotPoints::from(vec![[0.0, 0.0]]),
                PlotPoints::from(vec![[x, y]]),
            );
            plot.arrows(arrow.color(style::TEXT).tip_length(8.0).allow_hover(false));
        }
    }

    fn legend(&self, plot: &mut PlotUi<'_>) {
        let mut lines = vec![("model".to_owned(), style::ACCENT)];
        if !self.slice.readings.is_empty() {
            lines.push(("measured".to_owned(), style::MEASURED));
        }
        lines.extend(
            self.pins
                .iter()
                .enumerate()
                .map(|(i, (n, _))| (n.clone(), style::PINNED[i % style::PINNED.len()])),
        );
        for (i, (name, color)) in lines.into_iter().enumerate() {
            let place = PlotPoint::new(-EDGE + 0.02, EDGE - 0.02 - 0.105 * i as f64);
            let text = RichText::new(name).size(11.0).color(color);
            plot.text(
                Text::new("legend", place, text)
                    .anchor(Align2::LEFT_TOP)
                    .allow_hover(false),
            );
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
    format!(
        "{what} at {:.0}°: {} /sr",
        theta.to_degrees(),
        number(scale.value(r))
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pointer_reads_what_the_curve_draws() {
        let scale = Scale {
            top: 1.0,
            decades: Some(4.0),
        };
        let [x, y] = scale.place(Value { psi: -2.6, f: 0.02 });
        assert_eq!(
            under_pointer(scale, &PlotPoint::new(x, y)),
            "transmitted at 31°: 0.02 /sr"
        );
    }
}
