//! The sheet's reflection, on top of what its transmission has fixed.

use crate::fit::{ModelFit, Options};
use crate::measurement::Points;
use crate::problem::Spec;
use crate::search::fit_spec;
use anyhow::Result;
use woven_bsdf::model::ModelInfo;

/// Fits the reflecting parameters of the sheet `model` whose transmission is `best`; says in `notes` when energy held one back.
///
/// # Errors
/// As [`fit_spec`].
pub(crate) fn reflected(
    model: &'static ModelInfo,
    best: &ModelFit,
    coarse: &Points,
    full: &Points,
    options: &Options,
    notes: &mut Vec<String>,
) -> Result<ModelFit> {
    let mut spec = Spec::reflection(model, &best.values);
    let mut fit = fit_spec(&spec, coarse, full, options)?;
    // The yarn cannot give more light than it gets: what the lobe would take beyond that is withheld from it, and
    // the even part is fitted again.
    let sum = |fit: &ModelFit| model.split(&fit.values).0.iter().sum::<f64>();
    let k_r = model
        .params
        .iter()
        .position(|p| p.name == "k_r")
        .unwrap_or(0);
    let wanted = sum(&fit);
    for _ in 0..6 {
        let excess = sum(&fit) - 1.0;
        if excess <= 1e-4 {
            break;
        }
        let held = (fit.values[k_r] - excess).max(0.0);
        spec.hold("k_r", held);
        let options = Options {
            starts: 2,
            ..options.clone()
        };
        fit = fit_spec(&spec, coarse, full, &options)?;
    }
    if wanted > 1.0 + 1e-4 {
        notes.push(format!(
            "Fitted freely, the factors of the sheet sum to {wanted:.3}, more than the light it gets; k_r was held at {} so that they sum to 1.",
            crate::text::number(fit.values[k_r])
        ));
    }
    fit.place = 1;
    Ok(fit)
}
