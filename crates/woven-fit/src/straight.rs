//! What a fit says of the light that passes straight on, beside what was measured: the peak, the skirt and the floor.

use crate::fit::ModelFit;
use crate::info::{Parts, parts_of};
use crate::measurement::{Measurement, Points, Source};
use crate::text::number;
use serde::Serialize;
use std::f64::consts::PI;
use woven_bsdf::angles::degrees;
use woven_bsdf::model;
use woven_bsdf::sheet::Sheet;

/// Straight-through light at the incidence nearest to the normal.
#[derive(Clone, Debug, Serialize)]
pub struct Straight {
    /// Angle of incidence in degrees.
    pub theta_deg: f64,
    /// Measured direct-hemispherical transmittance; none for scattered points.
    pub transmittance: Option<f64>,
    /// Measured straight-through part.
    pub measured: f64,
    /// Measured share of the transmittance.
    pub measured_share: Option<f64>,
    /// Openness of the fitted sheet.
    pub openness: Option<f64>,
    /// Straight-through patch of the fitted sheet over its transmittance.
    pub model_share: Option<f64>,
    /// Measured peak, skirt and floor; of matrices.
    pub measured_parts: Option<Parts>,
    /// Peak, skirt and floor of the fitted sheet, by the same sums.
    pub model_parts: Option<Parts>,
    /// Measured straight-through share under even light from all incidences.
    pub measured_share_all: Option<f64>,
    /// The same of the fitted sheet.
    pub model_share_all: Option<f64>,
    /// Measured scattered transmittance under even light from all incidences.
    pub measured_scattered_all: Option<f64>,
    /// The same of the fitted sheet.
    pub model_scattered_all: Option<f64>,
}

impl Straight {
    /// Why the fitted share differs from the measured one, where it does by more than three hundredths.
    pub(crate) fn remark(&self) -> Option<String> {
        let (measured, model) = (self.measured_parts?, self.model_parts?);
        let off = self.model_share? - self.measured_share?;
        let (m, f) = (self.measured_scattered_all?, self.model_scattered_all?);
        (off.abs() > 0.03).then(|| {
            format!(
                "The sheet scatters {} at {:.0}° where {} was measured, and {} under light from all sides where {} was measured: one set of factors serves all incidences, so where the measured scattering changes more with the incidence than the sheet's, its shares at one incidence are off. `--plane normal` fits the normal alone.",
                number(model.total() - model.peak),
                self.theta_deg,
                number(measured.total() - measured.peak),
                number(f),
                number(m)
            )
        })
    }
}

/// Measured and fitted straight-through light; none where no row holds any.
pub(crate) fn straight(
    data: &Measurement,
    ranking: &[ModelFit],
    points: &Points,
) -> Option<Straight> {
    let list = &points.points;
    let index = (0..list.len())
        .filter(|&i| list[i].is_peak())
        .max_by(|&a, &b| list[a].l.z.abs().total_cmp(&list[b].l.z.abs()))?;
    let peak = list[index];
    let measured = peak.f / peak.gap_density;
    let is_matrix = matches!(data.source, Source::Klems(_));
    let sheet = ranking.iter().find(|f| f.label == "sheet" && f.has_gap);
    let openness = sheet.and_then(|f| {
        let (_, shape) = model::find(f.model)?.split(&f.values);
        Some(Sheet::gap(&shape, peak.l))
    });
    let parts = |value: &dyn Fn(usize) -> f64| {
        let rows: Vec<usize> = (0..list.len())
            .filter(|&i| list[i].incidence == peak.incidence)
            .collect();
        let values: Vec<f64> = rows.iter().map(|&i| value(i)).collect();
        let areas: Vec<f64> = rows.iter().map(|&i| list[i].area).collect();
        let at = rows.iter().position(|&i| i == index).unwrap_or(0);
        parts_of(&values, &areas, at)
    };
    // Shares of a matrix are products of projected solid angles, whose sum is π² times their mean.
    let all = |value: &dyn Fn(usize) -> f64, peaks: bool| -> f64 {
        let rows = (0..list.len()).filter(|&i| list[i].is_peak() == peaks);
        rows.map(|i| value(i) * list[i].share).sum::<f64>() * PI / list.len() as f64
    };
    let share_all = |value: &dyn Fn(usize) -> f64| {
        let (through, scattered) = (all(value, true), all(value, false));
        through / (through + scattered).max(f64::MIN_POSITIVE)
    };
    let data_of = |i: usize| list[i].f;
    let measured_parts = is_matrix.then(|| parts(&data_of));
    let sheet = sheet.filter(|_| is_matrix);
    let model_parts = sheet.map(|f| parts(&|i| f.fitted[i]));
    Some(Straight {
        theta_deg: degrees(peak.l.z.abs().min(1.0).acos()),
        transmittance: measured_parts.map(|p| p.total()),
        measured,
        measured_share: measured_parts.map(|p| measured / p.total()),
        openness,
        model_share: model_parts.map(|p| p.peak / p.total()),
        measured_parts,
        model_parts,
        measured_share_all: is_matrix.then(|| share_all(&data_of)),
        model_share_all: sheet.map(|f| share_all(&|i| f.fitted[i])),
        measured_scattered_all: is_matrix.then(|| all(&data_of, false)),
        model_scattered_all: sheet.map(|f| all(&|i| f.fitted[i], false)),
    })
}
