//! From a measurement to ranked models: many starts on a thinned copy, the best ones on everything, then honesty.

use crate::measurement::{Detail, Measurement, Point, Points};
use crate::problem::{Evaluator, Joint, Metric, Separable, Spec};
use crate::rank;
use crate::robust::Loss;
use crate::solve::{Outcome, Residuals, Settings, Solution, solve};
use crate::starts::sobol;
use crate::uncertainty::{Uncertainty, student, uncertainty};
use anyhow::{Result, bail};
use rayon::prelude::*;
use serde::Serialize;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use woven_bsdf::dual::Dual;
use woven_bsdf::model::{self, MODELS, ModelInfo};
use woven_bsdf::vec3::Vec3;
use woven_bsdf::weave::openness;

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
    /// Weights of the residuals beyond the measurement's own standard errors.
    pub cosine_weights: bool,
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
        }
    }
}

/// A fitted parameter.
#[derive(Clone, Debug, Serialize)]
pub struct Parameter {
    /// Its name.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// Its standard error; none where the data cannot see it.
    pub standard_error: Option<f64>,
    /// 95 % interval; none like the standard error. For log-scaled parameters it is symmetric in the logarithm.
    pub interval95: Option<(f64, f64)>,
    /// Why there is no error bar, or empty.
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
    /// Sum of squares in the metric that was fitted, in units of the best model's scatter, apart for peaks and the rest:
    /// about the number of points for the best model. The table is sorted by it.
    pub misfit: f64,
    /// Akaike's criterion, corrected for small samples (Hurvich and Tsai 1989), in the metric that was fitted.
    pub aicc: f64,
    /// Schwarz's criterion.
    pub bic: f64,
    /// Root mean square × 10⁴ over incidences that the fit had not seen; none without several incidences.
    pub cross_validation_e4: Option<f64>,
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
    let coarse = data.points(true, Detail::Coarse, options.normal_only);
    let full = data.points(true, Detail::Full, options.normal_only);
    let file = data
        .path
        .file_name()
        .map(|f| f.to_string_lossy().into_owned())
        .unwrap_or_default();
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

    let mut notes = Vec::new();
    let mut reflection = None;
    if let Some(model) = sheet.filter(|_| with_reflection)
        && let Some(best) = ranking.iter().find(|f| f.label == "sheet")
    {
        let mut spec = Spec::reflection(model, &best.values);
        let coarse = data.points(false, Detail::Coarse, options.normal_only);
        let mut fit = fit_spec(&spec, &coarse, &reflection_points, options)?;
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
            fit = fit_spec(&spec, &coarse, &reflection_points, &options)?;
        }
        if wanted > 1.0 + 1e-4 {
            notes.push(format!(
                "Fitted freely, the factors of the sheet sum to {wanted:.3}, more than the light it gets; k_r was held at {} so that they sum to 1.",
                crate::text::number(fit.values[k_r])
            ));
        }
        fit.place = 1;
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

/// Square roots of the weights that come with the data: each point's share of the light, 1/σ where all rows have one, √cosθ if
/// wished.
fn base_weights(points: &Points, options: &Options) -> (Vec<f64>, bool) {
    let all_sigma = options.metric == Metric::Linear
        && points
            .points
            .iter()
            .all(|p| p.sigma.is_some_and(|s| s > 0.0));
    let weights = points
        .points
        .iter()
        .map(|p| {
            let sigma = if all_sigma {
                p.sigma.unwrap_or(1.0)
            } else {
                1.0
            };
            let cosine = if options.cosine_weights {
                p.v.z.abs().sqrt()
            } else {
                1.0
            };
            cosine * p.share.sqrt() / sigma
        })
        .collect();
    (weights, all_sigma)
}

fn is_peak(p: &Point) -> bool {
    p.gap_density > 0.0
}

/// Weights for two groups with their own scatter, the straight-through rows and the rest (feasible generalised
/// least squares): the gap's law misses a peak by more than the lobe's whole height, and must not bend the lobe.
fn group_weights(points: &Points, base: &[f64], misfit: &[f64], gap_parameters: usize) -> Vec<f64> {
    let variance = |peak: bool, spent: usize| {
        let (n, sum) = group_sum(points, misfit, peak);
        let values: Vec<f64> = points.points.iter().map(|p| p.f).collect();
        let level = group_sum(points, &values, peak).1 / n.max(1) as f64;
        // With hardly more rows than parameters the scatter is unknown: 2 % of the level is taken instead.
        if n > 2 * spent {
            (sum / (n - spent) as f64).max(1e-10 * level)
        } else {
            4e-4 * level
        }
    };
    let (peak, rest) = (variance(true, gap_parameters), variance(false, 0));
    let ratio = if peak > 0.0 && rest > 0.0 {
        (rest / peak).sqrt()
    } else {
        1.0
    };
    points
        .points
        .iter()
        .zip(base)
        .map(|(p, w)| if is_peak(p) { w * ratio } else { *w })
        .collect()
}

/// Number and sum of squares of a group's misfits.
fn group_sum(points: &Points, misfit: &[f64], peak: bool) -> (usize, f64) {
    let group = points
        .points
        .iter()
        .zip(misfit)
        .filter(|(p, _)| is_peak(p) == peak);
    group.fold((0, 0.0), |(n, s), (_, r)| (n + 1, s + r * r))
}

/// Where the search of coordinate values starts: the model's own start first, then a Sobol sequence; the gap at what
/// the straight-through rows say by themselves.
fn start_points(spec: &Spec, gap: [f64; 3], options: &Options) -> Vec<Vec<f64>> {
    let cube = sobol(options.starts.max(1), spec.coordinates.len(), options.seed);
    cube.iter()
        .enumerate()
        .map(|(i, u)| {
            spec.coordinates
                .iter()
                .enumerate()
                .map(|(c, coordinate)| {
                    let (lo, hi) = spec.range(c);
                    match coordinate.name {
                        "gamma_warp" => gap[0],
                        "gamma_weft" => gap[1],
                        "section" => gap[2],
                        _ if i > 0 => lo + u[c] * (hi - lo),
                        _ if coordinate.log => coordinate.start.ln(),
                        _ => coordinate.start,
                    }
                })
                .collect()
        })
        .collect()
}

/// Weighted misfit of the metric, weights without the group factor.
fn misfit(points: &Points, fitted: &[f64], metric: Metric, floor: f64) -> Vec<f64> {
    points
        .points
        .iter()
        .zip(fitted)
        .map(|(p, f)| metric.apply(*f, floor).0 - metric.apply(p.f, floor).0)
        .collect()
}

/// Weights that make the linear metric agree with `metric` to first order around the data.
fn linearised(points: &Points, base: &[f64], metric: Metric, floor: f64) -> Vec<f64> {
    points
        .points
        .iter()
        .zip(base)
        .map(|(p, w)| w * metric.apply(p.f, floor).1)
        .collect()
}

/// Fits one spec: search on `coarse`, then everything on `full`.
///
/// # Errors
/// A sentence when the model cannot be evaluated on these points.
pub fn fit_spec(
    spec: &Spec,
    coarse: &Points,
    full: &Points,
    options: &Options,
) -> Result<ModelFit> {
    let floor = rank::floor_of(full, options.metric);
    let groups = Groups {
        count: spec
            .coordinates
            .iter()
            .filter(|c| ["gamma_warp", "gamma_weft", "section"].contains(&c.name))
            .count(),
        wanted: spec.gap,
        metric: options.metric,
        floor,
    };
    let gap = if spec.gap { gap_alone(full) } else { [0.5; 3] };
    // Search. The scatter is guessed: the gap's law alone for the peaks, half of the values for the rest.
    let (base, known) = base_weights(coarse, options);
    let weights = groups.weights(coarse, &base, &guess(coarse, gap), known);
    let weights = linearised(coarse, &weights, options.metric, floor);
    let settings = Settings {
        max_evaluations: 50,
        polish: 0,
        offset_tol: 1e-4,
        ..Settings::default()
    };
    let eval = Evaluator {
        spec,
        points: coarse,
    };
    let mut found: Vec<(f64, Vec<f64>)> = start_points(spec, gap, options)
        .iter()
        .map(|x| {
            let mut problem = Separable::new(eval, weights.clone());
            let s = solve(&mut problem, x, &settings);
            (
                if s.outcome == Outcome::NotFinite {
                    f64::INFINITY
                } else {
                    s.sse
                },
                s.x,
            )
        })
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let best = found[0].0;
    let agreeing = found
        .iter()
        .filter(|(sse, _)| *sse <= best * 1.001 + 1e-30)
        .count();
    // A rival within 10 % goes on too: the thinned copy may have the two in the wrong order.
    let mut candidates = vec![found[0].1.clone()];
    if !std::ptr::eq(coarse, full)
        && let Some(other) = found
            .iter()
            .find(|(sse, _)| *sse > best * 1.001 && *sse < best * 1.1)
    {
        candidates.push(other.1.clone());
    }
    let fits: Vec<Finished> = candidates
        .iter()
        .filter_map(|x| finish(spec, full, options, floor, x, gap, &groups))
        .collect();
    let Some(best) = fits
        .into_iter()
        .min_by(|a, b| a.criterion.total_cmp(&b.criterion))
    else {
        bail!("{} cannot be evaluated on these points", spec.label);
    };
    Ok(report(
        spec,
        full,
        options,
        floor,
        best,
        agreeing,
        found.len(),
    ))
}

/// How rows are weighted by group.
struct Groups {
    count: usize,
    wanted: bool,
    metric: Metric,
    floor: f64,
}

impl Groups {
    fn weights(&self, points: &Points, base: &[f64], fitted: &[f64], known: bool) -> Vec<f64> {
        if self.wanted && !known {
            group_weights(points, base, &self.weighted(points, fitted), self.count)
        } else {
            base.to_vec()
        }
    }
    /// Misfits, each with the root of its point's share.
    fn weighted(&self, points: &Points, fitted: &[f64]) -> Vec<f64> {
        let r = misfit(points, fitted, self.metric, self.floor);
        r.iter()
            .zip(&points.points)
            .map(|(r, p)| r * p.share.sqrt())
            .collect()
    }
    /// Minus twice the log-likelihood, up to a constant, with one scatter per group.
    fn criterion(&self, points: &Points, fitted: &[f64]) -> f64 {
        let r = self.weighted(points, fitted);
        let term = |peak: bool| {
            let (n, sum) = group_sum(points, &r, peak);
            if n == 0 {
                0.0
            } else {
                n as f64 * (sum / n as f64).max(f64::MIN_POSITIVE).ln()
            }
        };
        term(true) + term(false)
    }
}

/// Openness of a weave at the straight-through rows, for a first idea of the gap.
fn guess(points: &Points, gap: [f64; 3]) -> Vec<f64> {
    let [a, b, c] = gap;
    points
        .points
        .iter()
        .map(|p| {
            if is_peak(p) {
                p.gap_density * openness(a, b, c, p.l)
            } else {
                0.5 * p.f
            }
        })
        .collect()
}

/// The weave whose openness comes nearest to the straight-through rows alone.
fn gap_alone(points: &Points) -> [f64; 3] {
    struct Rows(Vec<(Vec3<f64>, f64)>);
    impl Residuals for Rows {
        fn rows(&self) -> usize {
            self.0.len()
        }
        fn params(&self) -> usize {
            3
        }
        fn bounds(&self, j: usize) -> (f64, f64) {
            (0.0, if j == 2 { 2.0 } else { 1.0 })
        }
        fn evaluate(&mut self, x: &[f64], r: &mut [f64], jac: Option<&mut [f64]>) -> bool {
            let m = r.len();
            let x: [Dual<3>; 3] = std::array::from_fn(|i| Dual::variable(x[i], i));
            let mut slopes = jac;
            for (i, (l, t)) in self.0.iter().enumerate() {
                let o = openness(x[0], x[1], x[2], l.cast());
                r[i] = o.v - t;
                if let Some(jac) = slopes.as_deref_mut() {
                    for j in 0..3 {
                        jac[j * m + i] = o.d[j];
                    }
                }
            }
            true
        }
    }
    let mut rows = Rows(
        points
            .points
            .iter()
            .filter(|p| is_peak(p))
            .map(|p| (p.l, p.f / p.gap_density))
            .collect(),
    );
    let near = rows
        .0
        .iter()
        .max_by(|a, b| a.0.z.abs().total_cmp(&b.0.z.abs()));
    let Some(&(_, t)) = near else { return [0.5; 3] };
    // A square weave of this openness, and two that are closer along one yarn.
    let square = 1.0 - t.clamp(0.0, 1.0).sqrt();
    let tries = [0.2, 0.5, 1.0].into_iter().flat_map(|s| {
        [
            [square, square, s],
            [0.9 * square, square, s],
            [square, 0.9 * square, s],
        ]
    });
    let settings = Settings {
        max_evaluations: 300,
        polish: 0,
        ..Settings::default()
    };
    let best = tries
        .map(|x| solve(&mut rows, &x, &settings))
        .min_by(|a, b| a.sse.total_cmp(&b.sse));
    best.map_or([square, square, 0.5], |s| [s.x[0], s.x[1], s.x[2]])
}

struct Finished {
    k: Vec<f64>,
    x: Vec<f64>,
    joint: Solution,
    criterion: f64,
}

fn finish(
    spec: &Spec,
    full: &Points,
    options: &Options,
    floor: f64,
    start: &[f64],
    gap: [f64; 3],
    groups: &Groups,
) -> Option<Finished> {
    let eval = Evaluator { spec, points: full };
    let (base, known) = base_weights(full, options);
    // Thousands of rows with some per cent of scatter: the twelfth digit is not worth its time.
    let settings = if full.points.len() > 2000 {
        Settings {
            offset_tol: 1e-5,
            polish: 2,
            ..Settings::default()
        }
    } else {
        Settings::default()
    };
    let quick = Settings {
        max_evaluations: 10,
        polish: 0,
        offset_tol: 1e-3,
        ..Settings::default()
    };
    let mut weights = groups.weights(full, &base, &guess(full, gap), known);
    let mut x = start.to_vec();
    let mut k = Vec::new();
    // Weights by groups and by the robust loss depend on the misfit: a few rounds settle them.
    let rounds = if options.loss != Loss::Squares {
        12
    } else if spec.gap && !known {
        3
    } else {
        0
    };
    let reweight = |k: &[f64], x: &[f64]| {
        let fitted = eval.model(k, x);
        let mut weights = groups.weights(full, &base, &fitted, known);
        options
            .loss
            .reweight(&mut weights, &misfit(full, &fitted, options.metric, floor));
        weights
    };
    for _ in 0..rounds {
        let mut problem = Separable::new(eval, linearised(full, &weights, options.metric, floor));
        let s = solve(&mut problem, &x, &quick);
        (x, k) = (s.x, problem.k);
        weights = reweight(&k, &x);
    }
    let last = if options.metric == Metric::Linear {
        &settings
    } else {
        &quick
    };
    let mut problem = Separable::new(eval, linearised(full, &weights, options.metric, floor));
    let s = solve(&mut problem, &x, last);
    if s.outcome == Outcome::NotFinite {
        return None;
    }
    let (evaluations, outcome) = (s.evaluations, s.outcome);
    k.clone_from(&problem.k);
    x = s.x;
    // Factors and shape together: the other metrics need it, and the covariance always.
    let mut joint = Joint::new(eval, weights, options.metric, floor);
    let start: Vec<f64> = k.iter().chain(&x).copied().collect();
    let mut solution = if options.metric == Metric::Linear {
        at(&mut joint, &start, outcome)
    } else {
        let mut s = solve(&mut joint, &start, &settings);
        for _ in 0..rounds {
            let (k, x) = s.x.split_at(k.len());
            joint = Joint::new(eval, reweight(k, x), options.metric, floor);
            s = solve(&mut joint, &s.x, &settings);
        }
        s
    };
    solution.evaluations += evaluations;
    let (k, x) = solution.x.split_at(k.len());
    let (k, x) = (k.to_vec(), x.to_vec());
    let criterion = groups.criterion(full, &eval.model(&k, &x));
    Some(Finished {
        k,
        x,
        joint: solution,
        criterion,
    })
}

/// The joint problem evaluated at a known minimum, with the parameters that stand at their bounds marked.
fn at(problem: &mut Joint<'_>, x: &[f64], outcome: Outcome) -> Solution {
    let (m, n) = (problem.rows(), problem.params());
    let (mut r, mut jac) = (vec![0.0; m], vec![0.0; m * n]);
    problem.evaluate(x, &mut r, Some(&mut jac));
    let at_bound = (0..n)
        .map(|j| {
            let (lo, hi) = problem.bounds(j);
            x[j] <= lo || x[j] >= hi
        })
        .collect();
    Solution {
        sse: crate::linalg::dot(&r, &r),
        x: x.to_vec(),
        residuals: r,
        jacobian: jac,
        outcome,
        evaluations: 0,
        at_bound,
    }
}

fn report(
    spec: &Spec,
    full: &Points,
    options: &Options,
    floor: f64,
    best: Finished,
    agreeing: usize,
    starts: usize,
) -> ModelFit {
    let m = full.points.len();
    let names = spec.names();
    let n_linear = spec.linear.len();
    let natural: Vec<f64> = best
        .k
        .iter()
        .copied()
        .chain(
            spec.coordinates
                .iter()
                .zip(&best.x)
                .map(|(c, &x)| if c.log { x.exp() } else { x }),
        )
        .collect();
    // Slopes with respect to the natural values, for the words; logs go through the chain rule afterwards.
    let mut jac = best.joint.jacobian.clone();
    for (j, c) in spec.coordinates.iter().enumerate() {
        if c.log {
            let column = &mut jac[(n_linear + j) * m..(n_linear + j + 1) * m];
            column.iter_mut().for_each(|v| *v /= natural[n_linear + j]);
        }
    }
    let u = uncertainty(
        &jac,
        m,
        &names,
        &natural,
        &best.joint.at_bound,
        best.joint.sse,
        true,
    );
    let t95 = student(0.95, u.dof);
    let parameters = names
        .iter()
        .enumerate()
        .map(|(j, &name)| {
            let (value, se) = (natural[j], u.standard_error[j]);
            let log = j >= n_linear && spec.coordinates[j - n_linear].log;
            let interval95 = se.map(|se| {
                if log {
                    let half = (t95 * se / value).min(50.0);
                    (value * (-half).exp(), value * half.exp())
                } else {
                    (value - t95 * se, value + t95 * se)
                }
            });
            let remark = if best.joint.at_bound[j] {
                "stands at its bound".to_owned()
            } else if se.is_none() {
                "the data cannot see it alone".to_owned()
            } else {
                String::new()
            };
            Parameter {
                name,
                value,
                standard_error: se,
                interval95,
                remark,
            }
        })
        .collect();
    let fitted = Evaluator { spec, points: full }.model(&best.k, &best.x);
    let (_, gap) = spec.shape_at(&best.x);
    let own_gap = spec.model.params.iter().any(|p| p.name == "gamma_warp");
    let outcome = match best.joint.outcome {
        Outcome::Converged => "converged".to_owned(),
        Outcome::OutOfPatience => "out of patience".to_owned(),
        Outcome::Degenerate { .. } => "degenerate".to_owned(),
        Outcome::NotFinite => "not finite".to_owned(),
    };
    let mut fit = ModelFit {
        label: spec.label.clone(),
        model: spec.model.name,
        parameters,
        values: spec.values(&best.k, &best.x),
        gap: (spec.gap && !own_gap).then_some(gap),
        has_gap: spec.gap,
        points: m,
        sse_e4: 0.0,
        rms_e4: 0.0,
        rms_off_peak_e4: 0.0,
        misfit: 0.0,
        aicc: 0.0,
        bic: 0.0,
        cross_validation_e4: None,
        outcome,
        evaluations: best.joint.evaluations,
        starts_agreeing: agreeing,
        starts,
        place: 0,
        stability: 1.0,
        uncertainty: u,
        names,
        fitted,
        spec: Some(spec.clone()),
        state: (best.k, best.x),
    };
    rank::score(&mut fit, full, options.metric, floor);
    fit
}

fn straight(data: &Measurement, ranking: &[ModelFit], points: &Points) -> Option<Straight> {
    let index = (0..points.points.len())
        .filter(|&i| is_peak(&points.points[i]))
        .max_by(|&a, &b| {
            points.points[a]
                .l
                .z
                .abs()
                .total_cmp(&points.points[b].l.z.abs())
        })?;
    let peak = points.points[index];
    let measured = peak.f / peak.gap_density;
    let whole = |value: &dyn Fn(usize) -> f64| {
        let rows =
            (0..points.points.len()).filter(|&i| points.points[i].incidence == peak.incidence);
        rows.map(|i| value(i) * points.points[i].area).sum::<f64>()
    };
    let is_klems = matches!(data.source, crate::measurement::Source::Klems(_));
    let transmittance = is_klems.then(|| whole(&|i| points.points[i].f));
    let sheet = ranking.iter().find(|f| f.model == "sheet" && f.has_gap);
    let openness = sheet.map(|f| {
        let (_, s) = woven_bsdf::model::find("sheet")
            .expect("in the list")
            .split(&f.values);
        woven_bsdf::sheet::Sheet::gap(&s, peak.l)
    });
    let model_share = sheet
        .filter(|_| is_klems)
        .map(|f| f.fitted[index] / peak.gap_density / whole(&|i| f.fitted[i]));
    Some(Straight {
        theta_deg: woven_bsdf::angles::degrees(peak.l.z.abs().min(1.0).acos()),
        transmittance,
        measured,
        measured_share: transmittance.map(|t| measured / t),
        openness,
        model_share,
    })
}
