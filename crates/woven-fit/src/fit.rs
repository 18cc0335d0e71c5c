//! From a measurement to ranked models: what is asked, what comes back, and the way through all models.

use crate::measurement::shared::Kind;
use crate::measurement::{Detail, Measurement, Points, Source, check};
use crate::problem::{Metric, Spec};
use crate::rank;
use crate::reflection::reflected;
use crate::robust::Loss;
use crate::search::fit_spec;
use crate::straight::{Straight, straight};
use crate::uncertainty::Uncertainty;
use anyhow::{Result, bail};
use rayon::prelude::*;
use serde::Serialize;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use woven_bsdf::model::{self, MODELS, ModelInfo};
use woven_bsdf::vec3::Vec3;

/// What to fit and how.
#[derive(Clone, Debug)]
pub struct Options {
    /// Names of models; none means all.
    pub models: Option<Vec<String>>,
    /// In which measure misfits are squared.
    pub metric: Metric,
    /// Only normal incidence, as the paper did.
    pub normal_only: bool,
    /// Seed of the starts and of the bootstrap.
    pub seed: u64,
    /// Starts per model, evenly spread over its bounds.
    pub starts: usize,
    /// How outliers count.
    pub loss: Loss,
    /// Weight each value with the cosine of its outgoing angle (Lafortune et al. 1997).
    pub cosine_weights: bool,
    /// Cross-validate over incidences also where that takes long (matrices of thousands of values).
    pub cross_validate: bool,
    /// Where to look whether the covariance misleads.
    pub profiles: Profiles,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            models: None,
            metric: Metric::Linear,
            normal_only: false,
            seed: 1,
            starts: 8,
            loss: Loss::Squares,
            cosine_weights: false,
            cross_validate: false,
            profiles: Profiles::Auto,
        }
    }
}

/// Where profiles of the sum of squares are looked at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Profiles {
    /// Where that is quick: not in matrices of thousands of values.
    #[default]
    Auto,
    /// Everywhere.
    Always,
    /// Nowhere: scores alone are wanted.
    Never,
}

/// A fitted parameter.
#[derive(Clone, Debug, Serialize)]
pub struct Parameter {
    /// Its name.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// Its standard error; none where the data cannot see it or only limit it. Where the covariance misleads, the least
    /// number of which one, two and three hold the profile's intervals on either side.
    pub standard_error: Option<f64>,
    /// 68.27 % interval, like the next.
    pub interval68: Option<(f64, f64)>,
    /// 95 % interval; none where the data cannot see the parameter. Where it ends at a bound it is a limit, and the remark says
    /// so. For log-scaled parameters that of the covariance is symmetric in the logarithm.
    pub interval95: Option<(f64, f64)>,
    /// 99.73 % interval, like the others.
    pub interval997: Option<(f64, f64)>,
    /// Whether the intervals come from the profile of the sum of squares, because the covariance misleads.
    pub profiled: bool,
    /// Why there is no error bar, or what is odd about it; mostly empty.
    pub remark: String,
}

/// One model fitted.
#[derive(Clone, Debug, Serialize)]
pub struct ModelFit {
    /// How the table calls it.
    pub label: String,
    /// The model's name.
    pub model: &'static str,
    /// Free parameters.
    pub parameters: Vec<Parameter>,
    /// All parameters of the model in its own order.
    pub values: Vec<f64>,
    /// (gamma_warp, gamma_weft, section) of a gap added to the model.
    pub gap: Option<[f64; 3]>,
    /// Whether light passes through gaps in this fit.
    pub has_gap: bool,
    /// Number of points.
    pub points: usize,
    /// Sum of squares of peak-normalised misfits × 10⁴, as the paper's table 2 may have it.
    pub sse_e4: f64,
    /// Root mean square of peak-normalised misfits × 10⁴.
    pub rms_e4: f64,
    /// The same without the straight-through patches.
    pub rms_off_peak_e4: f64,
    /// Root mean square misfit in the metric that was fitted, not normalised: in the logarithmic one about a relative error.
    pub rms_metric: f64,
    /// Sum of squares in the metric that was fitted, in units of the best model's scatter, apart for peaks and the rest:
    /// about the number of points for the best model. The table is sorted by it.
    pub misfit: f64,
    /// Akaike's criterion, corrected for small samples (Hurvich and Tsai 1989), in the metric that was fitted.
    pub aicc: f64,
    /// Schwarz's criterion.
    pub bic: f64,
    /// Root mean square × 10⁴ over incidences that the fit had not seen; none without several incidences.
    pub cross_validation_e4: Option<f64>,
    /// What the data say of errors that all rows share: kind, value, standard deviation before the fit.
    pub offsets: Vec<(Kind, f64, f64)>,
    /// How the solver ended, in a word.
    pub outcome: String,
    /// Evaluations of the last fit.
    pub evaluations: usize,
    /// How many of the starts reached the best minimum (within 0.1 % of the sum of squares).
    pub starts_agreeing: usize,
    /// How many starts there were.
    pub starts: usize,
    /// Place in the table, from 1; models that cannot be told apart share one.
    pub place: usize,
    /// Share of bootstrap samples in which the model keeps this place or a better one.
    pub stability: f64,
    /// Precision.
    pub uncertainty: Uncertainty,
    /// Names of the free parameters, for the correlations.
    pub names: Vec<&'static str>,
    /// Model values at the points, 1/sr.
    #[serde(skip)]
    pub fitted: Vec<f64>,
    /// The spec that was fitted.
    #[serde(skip)]
    pub spec: Option<Spec>,
    /// Factors and solver coordinates.
    #[serde(skip)]
    pub state: (Vec<f64>, Vec<f64>),
}

/// Told to the caller while fitting; return false to stop.
pub type Progress<'a> = &'a (dyn Fn(usize, usize, &str) -> bool + Sync);

/// A callback that never stops and says nothing.
pub fn quiet(_done: usize, _total: usize, _what: &str) -> bool {
    true
}

/// Everything that came out of a measurement.
#[derive(Clone, Debug, Serialize)]
pub struct FitResult {
    /// The fabric's name.
    pub name: String,
    /// Who made it.
    pub maker: String,
    /// File name of the measurement (no folders).
    pub file: String,
    /// SHA-256 of the measurement.
    pub sha256: String,
    /// The metric.
    pub metric: Metric,
    /// Only normal incidence was used.
    pub normal_only: bool,
    /// Seed.
    pub seed: u64,
    /// Fits of the transmission, best first.
    pub ranking: Vec<ModelFit>,
    /// The sheet's reflection, where measured.
    pub reflection: Option<ModelFit>,
    /// Straight-through light at the most normal incidence.
    pub straight: Option<Straight>,
    /// What a reader should know.
    pub notes: Vec<String>,
    /// The measured transmission with its kernels.
    #[serde(skip)]
    pub transmission_points: Points,
    /// The measured reflection.
    #[serde(skip)]
    pub reflection_points: Points,
}

/// Reads a measurement and fits it.
///
/// # Errors
/// A sentence when the file cannot be used or a model is unknown, or when `progress` asked to stop.
pub fn fit_measurement(
    path: &Path,
    options: &Options,
    progress: Progress<'_>,
) -> Result<FitResult> {
    fit(&Measurement::read(path)?, options, progress)
}

/// The models by name, or all of them.
///
/// # Errors
/// A sentence with the known names.
pub fn models_named(names: Option<&[String]>) -> Result<Vec<&'static ModelInfo>> {
    let Some(names) = names else {
        return Ok(MODELS.iter().collect());
    };
    names
        .iter()
        .map(|name| {
            model::find(name).ok_or_else(|| {
                let known: Vec<&str> = MODELS.iter().map(|m| m.name).collect();
                anyhow::anyhow!(
                    "there is no model {name:?}; choose from {}",
                    known.join(", ")
                )
            })
        })
        .collect()
}

/// The variants of a model that the table shows: with and without diffuse term, with and without gap.
pub fn variants(model: &'static ModelInfo, measured_gap: bool) -> Vec<Spec> {
    let full = Spec::transmission(model, true, false);
    let bare = Spec::transmission(model, false, false);
    let has_diffuse = full.linear.len() > bare.linear.len();
    let own_gap = model.params.iter().any(|p| p.name == "gamma_warp");
    let mut out = Vec::new();
    if own_gap {
        let with = Spec::transmission(model, true, measured_gap);
        if let Some(isotropic) = with.isotropic() {
            out.push(isotropic);
        }
        out.push(with);
        return out;
    }
    let bare_isotropic = bare.isotropic();
    if has_diffuse && !bare.linear.is_empty() {
        out.push(bare);
    }
    if has_diffuse && let Some(isotropic) = bare_isotropic {
        out.push(isotropic);
    }
    out.push(full);
    if measured_gap {
        out.push(Spec::transmission(model, true, true));
    }
    out
}

/// Fits all wanted models to a measurement.
///
/// # Errors
/// As [`fit_measurement`].
pub fn fit(data: &Measurement, options: &Options, progress: Progress<'_>) -> Result<FitResult> {
    let models = models_named(options.models.as_deref())?;
    if let Source::Scan(scan) = &data.source {
        check(scan)?;
    }
    let coarse = data.points(true, Detail::Coarse, options.normal_only);
    let full = data.points(true, Detail::Full, options.normal_only);
    let file = data.path.file_name().unwrap_or_default();
    let file = file.to_string_lossy().into_owned();
    if full.points.len() < 3 {
        bail!(
            "{}: only {} usable transmission values{}; a fit needs more",
            data.path.display(),
            full.points.len(),
            if options.normal_only {
                " at normal incidence"
            } else {
                ""
            }
        );
    }
    let gap = full.points.iter().any(|p| p.gap_density > 0.0);
    let specs: Vec<Spec> = models.iter().flat_map(|m| variants(m, gap)).collect();
    let reflection_points = data.points(false, Detail::Full, options.normal_only);
    let sheet = models.iter().find(|m| m.name == "sheet");
    let with_reflection = sheet.is_some() && reflection_points.points.len() > 20;
    let total = specs.len() + usize::from(with_reflection);
    let done = AtomicUsize::new(0);
    let mut ranking: Vec<ModelFit> = specs
        .par_iter()
        .map(|spec| {
            if !progress(done.load(Ordering::Relaxed), total, &spec.label) {
                bail!("stopped");
            }
            let fit = fit_spec(spec, &coarse, &full, options);
            let n = done.fetch_add(1, Ordering::Relaxed) + 1;
            progress(n, total, &spec.label);
            fit
        })
        .collect::<Result<_>>()?;
    rank::sort(&mut ranking, &full, options);

    let mut notes = data.remarks();
    let mut reflection = None;
    if let Some(model) = sheet.filter(|_| with_reflection)
        && let Some(best) = ranking.iter().find(|f| f.label == "sheet")
    {
        let coarse = data.points(false, Detail::Coarse, options.normal_only);
        let fit = reflected(
            model,
            best,
            &coarse,
            &reflection_points,
            options,
            &mut notes,
        )?;
        reflection = Some(fit);
        progress(total, total, "reflection");
    }
    let slanted = |l: &Vec3<f64>| l.z.abs() < 0.999;
    if full.incidences.len() == 1 || !full.incidences.iter().any(slanted) {
        notes.push(
            "Not oblique-safe: all points belong to one incidence, so nothing is known about how the cloth changes under slanted light.".to_owned(),
        );
    }
    if !gap && sheet.is_some() {
        notes.push("The data hold no straight-through light of their own, so no gap was fitted; openness comes from the weave, if known.".to_owned());
    }
    let straight = straight(data, &ranking, &full);
    notes.extend(straight.as_ref().and_then(Straight::remark));
    Ok(FitResult {
        name: data.name.clone(),
        maker: data.maker.clone(),
        file,
        sha256: data.sha256.clone(),
        metric: options.metric,
        normal_only: options.normal_only,
        seed: options.seed,
        ranking,
        reflection,
        straight,
        notes,
        transmission_points: full,
        reflection_points,
    })
}
