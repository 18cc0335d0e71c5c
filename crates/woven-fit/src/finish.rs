//! The end of one fit: from a good start to the minimum on all points, its profiles, and how well it foretells incidences
//! that it did not see.

use crate::fit::{Options, Profiles};
use crate::linalg::dot;
use crate::measurement::{Point, Points};
use crate::problem::{Evaluator, Joint, Metric, Separable, Spec};
use crate::profile::{self, Range};
use crate::robust::Loss;
use crate::solve::{Outcome, Residuals, Settings, solve};
use crate::uncertainty::uncertainty;
use crate::whiten::{Whitened, Whitening, settle};

/// Beyond this many kernel nodes a fit stops at fewer digits, and cross-validates and profiles only on demand.
pub(crate) const LARGE: usize = 20_000;

/// The end of a fit in the solver's coordinates.
pub(crate) struct Finished {
    /// Linear factors.
    pub(crate) k: Vec<f64>,
    /// Solver coordinates of the shape.
    pub(crate) x: Vec<f64>,
    /// Square roots of the weights of the last round.
    pub(crate) weights: Vec<f64>,
    /// Jacobian of the weighted residuals over factors and shape.
    pub(crate) jacobian: Vec<f64>,
    /// Weighted sum of squares.
    pub(crate) sse: f64,
    /// Which parameters stand at their bounds.
    pub(crate) at_bound: Vec<bool>,
    /// How the solver ended.
    pub(crate) outcome: Outcome,
    /// Evaluations spent.
    pub(crate) evaluations: usize,
    /// Starts that reached the best minimum.
    pub(crate) agreeing: usize,
    /// Root mean square × 10⁴ over incidences left out.
    pub(crate) cross_validation_e4: Option<f64>,
    /// The points as the fit takes them, where errors that they share change that.
    pub(crate) points: Option<Points>,
    /// How the rows were made independent of errors that they share.
    pub(crate) whitening: Whitening,
    /// What the data say of each shared error, in its standard deviations.
    pub(crate) offsets: Vec<f64>,
    /// Profiles of the parameters for which the covariance misleads, in the order of the spec's names.
    pub(crate) ranges: Vec<Option<Range>>,
}

/// Square roots of the weights that come with the data: each point's share of the light, 1/σ where all rows have one,
/// √cosθ if wished.
pub(crate) fn base_weights(points: &Points, options: &Options) -> Vec<f64> {
    let sigmas = sigmas(points, options.metric);
    let weight = |(i, p): (usize, &Point)| {
        let sigma = sigmas.as_ref().map_or(1.0, |s| s[i]);
        let cosine = if options.cosine_weights {
            p.v.z.abs().sqrt()
        } else {
            1.0
        };
        cosine * p.share.sqrt() / sigma
    };
    points.points.iter().enumerate().map(weight).collect()
}

/// Standard errors by which the rows are weighted: in the linear metric, where all rows have one.
pub(crate) fn sigmas(points: &Points, metric: Metric) -> Option<Vec<f64>> {
    let one = |p: &Point| p.sigma.filter(|&s| s > 0.0 && metric == Metric::Linear);
    points.points.iter().map(one).collect()
}

/// Misfits in the metric, unweighted.
fn misfit(points: &Points, fitted: &[f64], metric: Metric, floor: f64) -> Vec<f64> {
    let one = |(p, f): (&Point, &f64)| metric.apply(*f, floor).0 - metric.apply(p.f, floor).0;
    points.points.iter().zip(fitted).map(one).collect()
}

/// Weights that make the linear metric agree with `metric` to first order around the data.
pub(crate) fn linearised(points: &Points, base: &[f64], metric: Metric, floor: f64) -> Vec<f64> {
    points
        .points
        .iter()
        .zip(base)
        .map(|(p, w)| w * metric.apply(p.f, floor).1)
        .collect()
}

/// Which values stand at their bounds.
pub(crate) fn at_bounds(problem: &impl Residuals, x: &[f64]) -> Vec<bool> {
    let at = |(j, &x): (usize, &f64)| {
        let (lo, hi) = problem.bounds(j);
        x <= lo || x >= hi
    };
    x.iter().enumerate().map(at).collect()
}

/// From a good start to the minimum on all of `full`, with the Jacobian over factors and shape.
pub(crate) fn finish(
    spec: &Spec,
    full: &Points,
    options: &Options,
    floor: f64,
    start: &[f64],
) -> Option<Finished> {
    let eval = Evaluator { spec, points: full };
    let base = base_weights(full, options);
    let quick = Settings {
        max_evaluations: 10,
        polish: 0,
        offset_tol: 1e-3,
        ..Settings::default()
    };
    // Thousands of rows with some per cent of scatter: the twelfth digit is not worth its time.
    let large = Settings {
        offset_tol: 1e-5,
        polish: 2,
        ..Settings::default()
    };
    let settings = if full.nodes.len() > LARGE {
        large
    } else {
        Settings::default()
    };
    // The robust loss's weights depend on the misfit: a few rounds settle them.
    let rounds = if options.loss == Loss::Squares { 0 } else { 12 };
    let reweight = |k: &[f64], x: &[f64]| {
        let mut weights = base.clone();
        options.loss.reweight(
            &mut weights,
            &misfit(full, &eval.model(k, x), options.metric, floor),
        );
        weights
    };
    let (mut weights, mut x) = (base.clone(), start.to_vec());
    for _ in 0..rounds {
        let mut problem = Separable::new(eval, linearised(full, &weights, options.metric, floor));
        let s = solve(&mut problem, &x, &quick);
        weights = reweight(&problem.factors_at(&s.x), &s.x);
        x = s.x;
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
    // Factors and shape together: the other metrics need it, and the covariance always.
    let mut both = problem.factors_at(&s.x);
    let n = both.len();
    both.extend(&s.x);
    let (mut outcome, mut evaluations) = (s.outcome, s.evaluations);
    let mut joint = Joint::new(eval, weights, options.metric, floor);
    if options.metric != Metric::Linear {
        for round in 0..=rounds {
            if round > 0 {
                joint = Joint::new(
                    eval,
                    reweight(&both[..n], &both[n..]),
                    options.metric,
                    floor,
                );
            }
            let s = solve(&mut joint, &both, &settings);
            (both, outcome) = (s.x, s.outcome);
            evaluations += s.evaluations;
        }
    }
    // Errors that the rows share change what the minimum is.
    let known = sigmas(full, options.metric).is_some();
    let settled = settle(&mut joint, known, &both, &settings);
    let (mut whitening, mut offsets, mut points) = (Whitening::default(), Vec::new(), None);
    if let Some(s) = settled {
        (both, outcome) = (s.solution.x, s.solution.outcome);
        evaluations += s.solution.evaluations;
        (whitening, offsets) = (s.whitening, s.found);
        joint.weights = s.weights;
        points = Some(s.points);
    }
    joint.eval.points = points.as_ref().unwrap_or(full);
    let (m, columns) = (joint.rows(), joint.params());
    let (mut r, mut jacobian) = (vec![0.0; m], vec![0.0; m * columns]);
    let inner = &mut joint;
    Whitened {
        inner,
        whitening: &whitening,
    }
    .evaluate(&both, &mut r, Some(&mut jacobian));
    let at_bound = at_bounds(&joint, &both);
    let x = both.split_off(n);
    Some(Finished {
        k: both,
        x,
        jacobian,
        sse: dot(&r, &r),
        at_bound,
        outcome,
        evaluations,
        agreeing: 0,
        cross_validation_e4: None,
        ranges: vec![None; columns],
        weights: joint.weights,
        whitening,
        offsets,
        points,
    })
}

/// [`finish`] with profiles of the parameters for which the covariance misleads; where a profile meets a better minimum
/// the fit starts again from there.
pub(crate) fn finish_with_profiles(
    spec: &Spec,
    full: &Points,
    options: &Options,
    floor: f64,
    start: &[f64],
) -> Option<Finished> {
    let mut best = finish(spec, full, options, floor, start)?;
    let wanted = match options.profiles {
        Profiles::Auto => full.nodes.len() <= LARGE,
        Profiles::Always => true,
        Profiles::Never => false,
    };
    if !wanted {
        return Some(best);
    }
    for _ in 0..3 {
        let points = best.points.as_ref().unwrap_or(full);
        let eval = Evaluator { spec, points };
        let mut joint = Joint::new(eval, best.weights.clone(), options.metric, floor);
        let both: Vec<f64> = best.k.iter().chain(&best.x).copied().collect();
        let (m, names) = (full.points.len(), spec.names());
        let u = uncertainty(
            &best.jacobian,
            m,
            &names,
            &both,
            &best.at_bound,
            best.sse,
            true,
        );
        let mut problem = Whitened {
            inner: &mut joint,
            whitening: &best.whitening,
        };
        match profile::ranges(&mut problem, &both, &best.at_bound, &u, best.sse) {
            Ok(ranges) => {
                best.ranges = ranges;
                break;
            }
            Err(better) => best = finish(spec, full, options, floor, &better[best.k.len()..])?,
        }
    }
    Some(best)
}

/// Root mean square × 10⁴ of peak-normalised misfits at incidences that the fit did not see, five blocks of them; none with
/// fewer than five incidences. The gap stays as it is: its law spans all angles.
pub(crate) fn cross_validation(
    spec: &Spec,
    full: &Points,
    options: &Options,
    floor: f64,
    best: &Finished,
) -> Option<f64> {
    if full.incidences.len() < 5 {
        return None;
    }
    let (shape, gap) = spec.shape_at(&best.x);
    let own = spec.model.params.iter().any(|p| p.name == "gamma_warp");
    let gap = if own {
        [shape[0], shape[1], shape[2]]
    } else {
        gap
    };
    let held = if spec.gap {
        spec.holding_gap(gap)
    } else {
        spec.clone()
    };
    let start: Vec<f64> = (0..spec.coordinates.len())
        .filter(|&c| !spec.gap || !spec.is_gap(c))
        .map(|c| best.x[c])
        .collect();
    let peak = full
        .points
        .iter()
        .filter(|p| !p.direct_only)
        .map(|p| p.f)
        .fold(f64::MIN_POSITIVE, f64::max);
    let (mut sum, mut shares) = (0.0, 0.0);
    for fold in 0..5 {
        let seen = full.filter(|p| p.incidence % 5 != fold && !(spec.gap && p.is_peak()));
        let unseen = full.filter(|p| p.incidence % 5 == fold && !p.direct_only);
        let fit = finish(&held, &seen, options, floor, &start)?;
        let fitted = Evaluator {
            spec: &held,
            points: &unseen,
        }
        .model(&fit.k, &fit.x);
        for (p, f) in unseen.points.iter().zip(fitted) {
            sum += p.share * ((f - p.f) / peak).powi(2);
            shares += p.share;
        }
    }
    Some((sum / f64::max(shares, 1e-300)).sqrt() * 1e4)
}
