//! The fit of one model: many starts on a thinned copy, the best on everything.

use crate::finish::{LARGE, base_weights, cross_validation, finish_with_profiles, linearised};
use crate::fit::{ModelFit, Options};
use crate::gap::with_gap;
use crate::linalg::dot;
use crate::measurement::Points;
use crate::problem::{Evaluator, Separable, Spec};
use crate::rank;
use crate::solve::{Outcome, Residuals, Settings, solve};
use crate::starts::sobol;
use crate::summary::summary;
use anyhow::{Result, bail};

/// Where the search starts: the model's own start first, then a Sobol sequence.
pub fn start_points(spec: &Spec, count: usize, seed: u64) -> Vec<Vec<f64>> {
    let cube = sobol(count, spec.coordinates.len(), seed);
    let place = |i: usize, c: usize, u: f64| {
        let (lo, hi) = spec.range(c);
        let coordinate = &spec.coordinates[c];
        match (i, coordinate.log) {
            (0, true) => coordinate.start.ln(),
            (0, false) => coordinate.start,
            _ => lo + u * (hi - lo),
        }
    };
    let point =
        |(i, u): (usize, &Vec<f64>)| u.iter().enumerate().map(|(c, &u)| place(i, c, u)).collect();
    cube.iter().enumerate().map(point).collect()
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
    let failed = || anyhow::anyhow!("{} cannot be evaluated on these points", spec.label);
    let mut best = if spec.gap && full.points.iter().any(|p| p.is_peak()) {
        with_gap(spec, coarse, full, options, floor).ok_or_else(failed)?
    } else {
        let (start, agreeing) = search(spec, coarse, full, options, floor);
        let mut best =
            finish_with_profiles(spec, full, options, floor, &start).ok_or_else(failed)?;
        best.agreeing = agreeing;
        best
    };
    if options.cross_validate || full.nodes.len() < LARGE {
        best.cross_validation_e4 = cross_validation(spec, full, options, floor, &best);
    }
    if best.outcome == Outcome::NotFinite {
        bail!(failed());
    }
    Ok(summary(spec, full, options, floor, best))
}

/// Best starts on the thinned copy, finished on everything by the caller; also how many starts agree.
pub(crate) fn search(
    spec: &Spec,
    coarse: &Points,
    full: &Points,
    options: &Options,
    floor: f64,
) -> (Vec<f64>, usize) {
    let weights = linearised(
        coarse,
        &base_weights(coarse, options),
        options.metric,
        floor,
    );
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
    let run = |x: &Vec<f64>| {
        let s = solve(&mut Separable::new(eval, weights.clone()), x, &settings);
        (
            if s.outcome == Outcome::NotFinite {
                f64::INFINITY
            } else {
                s.sse
            },
            s.x,
        )
    };
    let mut found: Vec<(f64, Vec<f64>)> = start_points(spec, options.starts.max(1), options.seed)
        .iter()
        .map(run)
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let best = found[0].0;
    let agreeing = found
        .iter()
        .filter(|(sse, _)| *sse <= best * 1.001 + 1e-30)
        .count();
    // A rival within 10 % is compared on everything: the thinned copy may have the two in the wrong order.
    let rival = found
        .iter()
        .find(|(sse, _)| *sse > best * 1.001 && *sse < best * 1.1);
    if let Some((_, rival)) = rival.filter(|_| coarse.points.len() < full.points.len()) {
        let weights = linearised(full, &base_weights(full, options), options.metric, floor);
        let mut problem = Separable::new(Evaluator { spec, points: full }, weights);
        let mut r = vec![0.0; full.points.len()];
        let mut cost = |x: &[f64]| {
            if problem.evaluate(x, &mut r, None) {
                dot(&r, &r)
            } else {
                f64::INFINITY
            }
        };
        if cost(rival) < cost(&found[0].1) {
            return (ordered(spec, rival.clone()), agreeing);
        }
    }
    (ordered(spec, found.swap_remove(0).1), agreeing)
}

/// Two lobes of one kind fit as well with their names exchanged: the broad one of `hgf` is called g_d.
fn ordered(spec: &Spec, mut x: Vec<f64>) -> Vec<f64> {
    let find = |name: &str| spec.coordinates.iter().position(|c| c.name == name);
    if let (Some(d), Some(s)) = (find("g_d"), find("g_s"))
        && x[d] > x[s]
    {
        x.swap(d, s);
        for c in [d, s] {
            let (lo, hi) = spec.range(c);
            x[c] = x[c].clamp(lo, hi);
        }
    }
    x
}
