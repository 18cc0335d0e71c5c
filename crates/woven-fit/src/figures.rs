//! The figures of a fit: slices through the measurement with the models on top, polar plots, residuals.
//!
//! Pages put them in line as SVG text; [`all`] gives them as drawings, which can become pixels too. Model curves are the
//! kernel-averaged values that were compared with the data, joined by lines, not the bare formula.

use crate::fit::{FitResult, ModelFit};
use crate::measurement::{Point, Points};
use crate::plot::{BLACK, COLORS, Color, Drawing, Mark, Scale, Series, chart, polar};
use std::f64::consts::PI;
use woven_bsdf::angles::degrees;
use woven_bsdf::vec3::Vec3;

/// Points this near to a plane (sine of the azimuth difference) belong to its slice.
const PLANE: f64 = 0.07;
/// Fewest directions of a plane that make a plot.
const FEWEST: usize = 5;

/// One measured plane of outgoing directions: rows of the points with their signed angle.
#[derive(Clone, Debug)]
pub struct Slice {
    /// Incidence index.
    pub incidence: usize,
    /// Polar angle of incidence, degrees.
    pub theta_deg: f64,
    /// Azimuth of the plane, degrees.
    pub phi_deg: f64,
    /// (signed polar angle of v from the straight-through normal in radians, row).
    pub rows: Vec<(f64, usize)>,
}

/// The slice of an incidence along the azimuth `phi` (radians).
pub fn slice(points: &Points, incidence: usize, phi: f64) -> Slice {
    let t = Vec3::new(phi.cos(), phi.sin(), 0.0);
    let mut rows: Vec<(f64, usize)> = points
        .points
        .iter()
        .enumerate()
        .filter(|(_, p)| p.incidence == incidence && !p.direct_only)
        .filter_map(|(i, p)| {
            let across = p.v.x * -t.y + p.v.y * t.x;
            let along = p.v.dot(t);
            let flat = (p.v.x * p.v.x + p.v.y * p.v.y).sqrt();
            (flat < 1e-6 || across.abs() < PLANE * flat).then(|| (along.atan2(p.v.z.abs()), i))
        })
        .collect();
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    let l = points.incidences[incidence];
    Slice {
        incidence,
        theta_deg: degrees(l.z.abs().min(1.0).acos()),
        phi_deg: degrees(phi),
        rows,
    }
}

/// The slices worth showing: along weft and warp at up to four incidences each.
pub fn slices(points: &Points) -> Vec<Slice> {
    let mut out = Vec::new();
    let angle = |i: usize| degrees(points.incidences[i].z.abs().min(1.0).acos());
    for (axis, phi) in [0.0, PI / 2.0].into_iter().enumerate() {
        for target in [0.0, 20.0, 40.0, 60.0] {
            // The incidence in this plane nearest to the wanted angle.
            let best = (0..points.incidences.len())
                .filter(|&i| {
                    let l = points.incidences[i];
                    let across = if axis == 0 { l.y } else { l.x };
                    across.abs() < 0.02
                })
                .min_by(|&a, &b| {
                    (angle(a) - target)
                        .abs()
                        .total_cmp(&(angle(b) - target).abs())
                });
            let Some(best) = best else { continue };
            if (angle(best) - target).abs() > 7.0 {
                continue;
            }
            let s = slice(points, best, phi);
            if s.rows.len() >= FEWEST
                && !out
                    .iter()
                    .any(|o: &Slice| o.incidence == best && (o.phi_deg - s.phi_deg).abs() < 1.0)
            {
                out.push(s);
            }
        }
    }
    if out.is_empty() && !points.incidences.is_empty() {
        // Scans in an odd plane: the plane of the first point that is not on the normal.
        let first = points.points.iter().find(|p| p.v.x.hypot(p.v.y) > 0.05);
        out.push(slice(points, 0, first.map_or(0.0, |p| p.v.y.atan2(p.v.x))));
    }
    out
}

fn series(
    name: &str,
    color: Color,
    mark: Mark,
    slice: &Slice,
    value: &dyn Fn(usize) -> f64,
) -> Series {
    Series {
        name: name.to_owned(),
        color,
        mark,
        points: slice
            .rows
            .iter()
            .map(|&(a, i)| (degrees(a), value(i)))
            .collect(),
    }
}

/// Data and models over the outgoing angle of one slice, as SVG text.
pub fn slice_chart(points: &Points, slice: &Slice, models: &[&ModelFit], scale: Scale) -> String {
    slice_drawing(points, slice, models, scale).to_string()
}

fn slice_drawing(points: &Points, slice: &Slice, models: &[&ModelFit], scale: Scale) -> Drawing {
    let mut list: Vec<Series> = models
        .iter()
        .zip(COLORS)
        .map(|(m, color)| series(&m.label, color, Mark::Line, slice, &|i| m.fitted[i]))
        .collect();
    list.push(series("measured", BLACK, Mark::Dots, slice, &|i| {
        points.points[i].f
    }));
    let title = format!(
        "incidence {:.0}°, plane φ = {:.0}°{}",
        slice.theta_deg,
        slice.phi_deg,
        if scale == Scale::Log { ", log" } else { "" }
    );
    chart(&title, "outgoing angle θ (°)", "f (1/sr)", &list, scale)
}

/// Misfit over value, in per cent, of one slice.
pub fn residual_chart(points: &Points, slice: &Slice, models: &[&ModelFit]) -> Drawing {
    let ratio = |m: &ModelFit, i: usize| {
        100.0 * (m.fitted[i] / points.points[i].f.max(1e-12) - 1.0).clamp(-2.0, 5.0)
    };
    let list: Vec<Series> = models
        .iter()
        .zip(COLORS)
        .map(|(m, color)| series(&m.label, color, Mark::Dots, slice, &|i| ratio(m, i)))
        .collect();
    let title = format!(
        "model / measured - 1, incidence {:.0}°, plane φ = {:.0}°",
        slice.theta_deg, slice.phi_deg
    );
    chart(&title, "outgoing angle θ (°)", "%", &list, Scale::Linear)
}

/// Every figure of the report with a name for its file.
pub fn all(result: &FitResult) -> Vec<(String, Drawing)> {
    let points = &result.transmission_points;
    let models = shown(result);
    let mut out = polar_plots(result);
    for slice in slices(points) {
        let name = format!("{:.0}-{:.0}", slice.theta_deg, slice.phi_deg);
        let linear = slice_drawing(points, &slice, &models, Scale::Linear);
        let log = slice_drawing(points, &slice, &models, Scale::Log);
        out.push((format!("slice-{name}"), linear));
        out.push((format!("slice-{name}-log"), log));
        out.push((
            format!("residuals-{name}"),
            residual_chart(points, &slice, &models),
        ));
    }
    if let Some(fit) = result.sheet().filter(|f| f.has_gap) {
        out.push(("gap".to_owned(), gap_drawing(points, fit)));
    }
    out
}

/// Polar plots at the normal and at 40° in both planes, with names for their files; those of planes that were measured.
pub fn polar_plots(result: &FitResult) -> Vec<(String, Drawing)> {
    let points = &result.transmission_points;
    let mut out = Vec::new();
    for theta in [0.0, 40.0] {
        if theta > 0.0 && points.incidences.len() == 1 {
            continue;
        }
        for (phi, plane) in [(0.0, "weft"), (PI / 2.0, "warp")] {
            let measured = nearest(points, theta, phi)
                .is_some_and(|i| slice(points, i, phi).rows.len() >= FEWEST);
            if measured {
                let drawing = polar_drawing(result, theta, phi);
                out.push((format!("polar-{theta:.0}-{plane}"), drawing));
            }
        }
    }
    out
}

/// Measured and fitted scattering of one incidence in one plane, transmitted below and reflected above the sheet.
///
/// `theta_deg` picks the nearest incidence in the weft plane (`phi` = 0) or another plane of azimuth `phi` radians. SVG text.
pub fn polar_plot(result: &FitResult, theta_deg: f64, phi: f64) -> String {
    polar_drawing(result, theta_deg, phi).to_string()
}

fn polar_drawing(result: &FitResult, theta_deg: f64, phi: f64) -> Drawing {
    let sheet = result.sheet().or(result.ranking.first());
    let mut data = Vec::new();
    let mut model = Vec::new();
    let mut found_deg = 0.0;
    let halves: [(&Points, Option<&ModelFit>, bool); 2] = [
        (&result.transmission_points, sheet, true),
        (&result.reflection_points, result.reflection.as_ref(), false),
    ];
    for (points, fit, transmits) in halves {
        let Some(incidence) = nearest(points, theta_deg, phi) else {
            continue;
        };
        let s = slice(points, incidence, phi);
        if transmits {
            found_deg = s.theta_deg;
        }
        // Light comes from the upper left: the straight-through direction has a positive angle.
        let l = points.incidences[incidence];
        let sign = if l.x * phi.cos() + l.y * phi.sin() > 1e-9 {
            -1.0
        } else {
            1.0
        };
        let angle = |a: f64| if transmits { sign * a } else { PI - sign * a };
        data.extend(s.rows.iter().map(|&(a, i)| (angle(a), points.points[i].f)));
        if let Some(fit) = fit {
            let mut line: Vec<(f64, f64)> = s
                .rows
                .iter()
                .map(|&(a, i)| (angle(a), fit.fitted[i]))
                .collect();
            line.sort_by(|a, b| a.0.total_cmp(&b.0));
            model.push(line);
        }
    }
    let mut list: Vec<Series> = model
        .into_iter()
        .enumerate()
        .map(|(i, points)| Series {
            name: if i == 0 {
                sheet.map_or(String::new(), |f| f.label.clone())
            } else {
                String::new()
            },
            color: COLORS[0],
            mark: Mark::Line,
            points,
        })
        .collect();
    list.push(Series {
        name: "measured".into(),
        color: BLACK,
        mark: Mark::Dots,
        points: data,
    });
    let title = format!("incidence {found_deg:.0}°, plane φ = {:.0}°", degrees(phi));
    polar(&title, &list, found_deg.to_radians())
}

fn nearest(points: &Points, theta_deg: f64, phi: f64) -> Option<usize> {
    let off = |p: &Vec3<f64>| {
        let across = (p.x * -phi.sin() + p.y * phi.cos()).abs();
        (degrees(p.z.abs().min(1.0).acos()) - theta_deg).abs() + 200.0 * across
    };
    (0..points.incidences.len())
        .min_by(|&a, &b| off(&points.incidences[a]).total_cmp(&off(&points.incidences[b])))
}

/// The models that the figures show: the best one, the sheet, and the best of other families, at most four.
pub fn shown(result: &FitResult) -> Vec<&ModelFit> {
    let mut out: Vec<&ModelFit> = result.sheet().into_iter().collect();
    for fit in &result.ranking {
        if out.len() < 4 && !out.iter().any(|o| o.model == fit.model) {
            out.push(fit);
        }
    }
    out
}

/// Straight-through transmittance over the angle of incidence, measured and fitted, as SVG text.
pub fn gap_chart(points: &Points, fit: &ModelFit) -> String {
    gap_drawing(points, fit).to_string()
}

fn gap_drawing(points: &Points, fit: &ModelFit) -> Drawing {
    let rows: Vec<(usize, &Point)> = points
        .points
        .iter()
        .enumerate()
        .filter(|(_, p)| p.gap_density > 0.0)
        .collect();
    let of = |value: &dyn Fn(usize, &Point) -> f64| -> Vec<(f64, f64)> {
        rows.iter()
            .map(|&(i, p)| {
                (
                    degrees(p.l.z.abs().min(1.0).acos()),
                    value(i, p) / p.gap_density,
                )
            })
            .collect()
    };
    let list = [
        Series {
            name: fit.label.clone(),
            color: COLORS[0],
            mark: Mark::Dots,
            points: of(&|i, _| fit.fitted[i]),
        },
        Series {
            name: "measured".into(),
            color: BLACK,
            mark: Mark::Dots,
            points: of(&|_, p| p.f),
        },
    ];
    chart(
        "straight-through patch, all azimuths",
        "angle of incidence (°)",
        "transmitted share",
        &list,
        Scale::Linear,
    )
}
