//! From a measurement to a fabric, or a fabric file as it is: the fit, and what the page tells of it.

use std::path::Path;

use anyhow::{Context as _, Result};
use serde::{Deserialize, Serialize};
use woven_bsdf::fabric::Fabric;
use woven_bsdf::measured::shop::Shop;
use woven_fit::figures::{gap_chart, polar_plot, slice_chart, slices};
use woven_fit::fit::{FitResult, ModelFit, Options, fit_measurement};
use woven_fit::plot::Scale;
use woven_fit::report;
use woven_render::scene::fabric::openness_map;

use crate::catalog::{FabricSpec, Fit};

/// What is kept of a fit, beside the fabric file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// The fabric's name in the measurement.
    pub name: String,
    /// Transmittance at the most normal incidence, with the angle in degrees.
    pub transmittance: Option<(f64, f64)>,
    /// Share that passes straight through the fitted sheet at normal incidence.
    pub openness: f64,
    /// Parameters of the fitted sheet.
    pub parameters: Vec<Parameter>,
    /// The ranking of models.
    pub ranking: Vec<Ranked>,
    /// What a reader should know.
    pub notes: Vec<String>,
    /// Plots: (caption, SVG).
    pub plots: Vec<(String, String)>,
}

/// A fitted parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// Its name in the fabric file.
    pub name: String,
    /// What it means.
    pub meaning: String,
    /// Its value.
    pub value: f64,
    /// Its standard error, where the data can see it.
    pub error: Option<f64>,
}

/// A line of the ranking.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ranked {
    /// Place, from 1; equals share one.
    pub place: usize,
    /// The model as the table calls it.
    pub label: String,
    /// Root mean square of peak-normalised misfits × 10⁴.
    pub rms_e4: f64,
    /// The same for incidences that the fit had not seen.
    pub cross_e4: Option<f64>,
    /// Akaike's criterion.
    pub aicc: f64,
}

/// What comes out of a fit.
pub struct Fitted {
    /// The fabric, with its colour.
    pub fabric: Fabric,
    /// What the page tells.
    pub summary: Summary,
    /// The whole report as one HTML page, where something was fitted.
    pub report: Option<String>,
}

/// Takes the fabric file at `path` as it is.
///
/// # Errors
/// A sentence when it cannot be used.
pub fn ready(path: &Path, spec: &FabricSpec) -> Result<Fitted> {
    let mut fabric = Fabric::read(path)?;
    let own = std::mem::replace(&mut fabric.name, spec.name.clone());
    if let Some(tint) = spec.tint {
        color(&mut fabric, tint);
    }
    let optics = fabric.optics()?;
    let [_, shop, _] = Shop::of_sheet(&optics)
        .with_context(|| format!("Fabric \"{}\" cannot be rendered", spec.id))?;
    let mut openness = shop.tau_nn;
    if let Some(weave) = fabric.weave.as_ref().filter(|w| !w.openness_map.is_empty()) {
        let folder = path.parent().unwrap_or_else(|| Path::new(""));
        let holes = openness_map(folder, &weave.openness_map)?.mean();
        openness = if weave.map_multiplies {
            holes * openness
        } else {
            1.0 - (1.0 - holes) * (1.0 - openness)
        };
    }
    let parameters = optics.model.params.iter().filter_map(|p| {
        Some(Parameter {
            name: p.name.to_owned(),
            meaning: p.meaning.to_owned(),
            value: *fabric.optics.parameters.get(p.name)?,
            error: None,
        })
    });
    let summary = Summary {
        name: own,
        openness,
        parameters: parameters.collect(),
        ..Summary::default()
    };
    Ok(Fitted {
        fabric,
        summary,
        report: None,
    })
}

/// Fits the measurement at `path`. `progress(share)` answers false to stop.
///
/// # Errors
/// A sentence when the file cannot be used, or on request.
pub fn fit(
    path: &Path,
    spec: &FabricSpec,
    how: &Fit,
    progress: &(dyn Fn(f64) -> bool + Sync),
) -> Result<Fitted> {
    let mut models = how.models.clone();
    if !models.iter().any(|m| m == "sheet") {
        models.push("sheet".to_owned());
    }
    let command = format!(
        "woven-fit fit {} --model {} --seed {}",
        path.file_name().unwrap_or_default().to_string_lossy(),
        models.join(","),
        how.seed
    );
    let options = Options {
        models: Some(models),
        starts: how.starts,
        seed: how.seed,
        ..Options::default()
    };
    let result = fit_measurement(path, &options, &|done, total, _| {
        progress(done as f64 / total.max(1) as f64)
    })
    .with_context(|| format!("Fabric \"{}\" could not be fitted", spec.id))?;
    let mut fabric = result.fabric(&command).with_context(|| {
        format!(
            "Fabric \"{}\": no sheet came out of the fit, so there is nothing to render",
            spec.id
        )
    })?;
    fabric.name.clone_from(&spec.name);
    if !spec.maker.is_empty() {
        fabric.maker.clone_from(&spec.maker);
    }
    if let Some(tint) = spec.tint {
        color(&mut fabric, tint);
    }
    fabric.optics()?;
    let mut summary = summary(&result);
    summary
        .notes
        .extend(fabric.provenance.get("remark").cloned());
    Ok(Fitted {
        fabric,
        summary,
        report: Some(report::html(&result, &command)),
    })
}

/// Colours every linear factor by `tint`, brought to luminance 1 so that the measured level stays, and paled until no channel of the
/// yarn gives more light than it gets.
fn color(fabric: &mut Fabric, tint: [f64; 3]) {
    let luminance = 0.2126 * tint[0] + 0.7152 * tint[1] + 0.0722 * tint[2];
    if luminance <= 0.0 {
        return;
    }
    let tint = tint.map(|c| c / luminance);
    let names = ["t_d", "k_t", "r_d", "k_r", "sheen"];
    let sum: f64 = names
        .iter()
        .filter_map(|n| fabric.optics.parameters.get(*n))
        .sum();
    let most = tint.iter().copied().fold(0.0, f64::max);
    // 1 + s (most - 1) times the sum may not exceed 1.
    let share = if most > 1.0 && sum > 0.0 {
        ((1.0 / sum - 1.0) / (most - 1.0)).clamp(0.0, 1.0)
    } else {
        1.0
    };
    let color = tint.map(|c| 1.0 + share * (c - 1.0));
    for name in names {
        if fabric.optics.parameters.contains_key(name) {
            fabric.optics.colors.insert(name.to_owned(), color);
        }
    }
}

fn summary(result: &FitResult) -> Summary {
    let sheet = result.ranking.iter().find(|f| f.label == "sheet");
    let parameters = sheet
        .into_iter()
        .chain(&result.reflection)
        .flat_map(rows)
        .collect();
    let ranked = |f: &ModelFit| Ranked {
        place: f.place,
        label: f.label.clone(),
        rms_e4: f.rms_e4,
        cross_e4: f.cross_validation_e4,
        aicc: f.aicc,
    };
    let straight = result.straight.as_ref();
    Summary {
        name: result.name.clone(),
        transmittance: straight.and_then(|s| s.transmittance.map(|t| (t, s.theta_deg))),
        openness: straight.and_then(|s| s.openness).unwrap_or(0.0),
        parameters,
        ranking: result.ranking.iter().map(ranked).collect(),
        notes: result.notes.clone(),
        plots: plots(result),
    }
}

/// Polar plots at normal and oblique incidence, the sheet over a slice on a logarithmic scale, and the straight-through share.
fn plots(result: &FitResult) -> Vec<(String, String)> {
    let points = &result.transmission_points;
    let mut plots = vec![("Scattered light at normal incidence, measured and fitted: transmitted below the sheet, reflected above".to_owned(), polar_plot(result, 0.0, 0.0))];
    if points.incidences.len() > 1 {
        plots.push(("The same at 40°".to_owned(), polar_plot(result, 40.0, 0.0)));
    }
    let sheet: Vec<&ModelFit> = result
        .ranking
        .iter()
        .filter(|f| f.label == "sheet")
        .collect();
    if let (Some(slice), false) = (slices(points).first(), sheet.is_empty()) {
        plots.push((
            "Transmission at normal incidence on a logarithmic scale".to_owned(),
            slice_chart(points, slice, &sheet, Scale::Log),
        ));
    }
    if let Some(fit) = sheet.iter().find(|f| f.has_gap) {
        plots.push((
            "Light that passes straight through, over the angle of incidence".to_owned(),
            gap_chart(points, fit),
        ));
    }
    plots
}

/// The free parameters of a fit, with the meaning that the model's list gives them.
fn rows(fit: &ModelFit) -> impl Iterator<Item = Parameter> + '_ {
    let model = woven_bsdf::model::find(fit.model);
    fit.parameters.iter().map(move |p| {
        let meaning = model
            .and_then(|m| m.params.iter().find(|q| q.name == p.name))
            .map_or("", |q| q.meaning);
        Parameter {
            name: p.name.to_owned(),
            meaning: meaning.to_owned(),
            value: p.value,
            error: p.standard_error,
        }
    })
}
