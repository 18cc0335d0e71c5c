//! The fit of one model: many starts on a thinned copy, the best on everything, the gap by the rows that see it.
//!
//! A gap's law misses real peaks by more than a lobe is high, so in one common sum of squares the peaks would bend
//! the lobe, and the thousands of other values would bend the gap. Therefore the straight-through rows alone decide the gap, the
//! other rows alone decide the scattering, each given the other, in turn until both stand.

use crate::fit::{ModelFit, Options};
use crate::linalg::dot;
use crate::measurement::Points;
use crate::problem::{Evaluator, Joint, Metric, Separable, Spec};
use crate::rank;
use crate::robust::Loss;
use crate::solve::{Outcome, Residuals, Settings, solve};
use crate::starts::sobol;
use crate::summary::{Finished, summary};
use anyhow::{Result, bail};
use woven_bsdf::dual::Dual;
use woven_bsdf::vec3::Vec3;
use woven_bsdf::weave::openness;

/// Beyond this many kernel nodes a fit stops at fewer digits and cross-validates only on demand.
const LARGE: usize = 20_000;

/// Square roots of the weights that come with the data: each point's share of the light, 1/σ where all rows have one,
/// √cosθ if wished.
fn base_weights(points: &Points, options: &Options) -> Vec<f64> {
    let known = |s: Option<f64>| s.is_some_and(|s| s > 0.0);
    let all_sigma =
        options.metric == Metric::Linear && points.points.iter().all(|p| known(p.sigma));
    let weight = |p: &crate::measurement::Point| {
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
    };
    points.points.iter().map(weight).collect()
}

/// Where the search starts: the model's own start first, then a Sobol sequence.
fn start_points(spec: &Spec, options: &Options) -> Vec<Vec<f64>> {
    let cube = sobol(options.starts.max(1), spec.coordinates.len(), options.seed);
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

/// Misfits in the metric, unweighted.
fn misfit(points: &Points, fitted: &[f64], metric: Metric, floor: f64) -> Vec<f64> {
    let one = |(p, f): (&crate::measurement::Point, &f64)| {
        metric.apply(*f, floor).0 - metric.apply(p.f, floor).0
    };
    points.points.iter().zip(fitted).map(one).collect()
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
    let failed = || anyhow::anyhow!("{} cannot be evaluated on these points", spec.label);
    let mut best = if spec.gap && full.points.iter().any(|p| p.is_peak()) {
        with_gap(spec, coarse, full, options, floor).ok_or_else(failed)?
    } else {
        let (start, agreeing) = search(spec, coarse, full, options, floor);
        let mut best = finish(spec, full, options, floor, &start).ok_or_else(failed)?;
        best.agreeing = agreeing;
        best
    };
    best.starts = options.starts.max(1);
    if options.cross_validate || full.nodes.len() < LARGE {
        best.cross_validation_e4 = cross_validation(spec, full, options, floor, &best);
    }
    if best.outcome == Outcome::NotFinite {
        bail!(failed());
    }
    Ok(summary(spec, full, options, floor, best))
}

/// Best starts on the thinned copy, finished on everything by the caller; also how many starts agree.
fn search(
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
    let mut found: Vec<(f64, Vec<f64>)> = start_points(spec, options).iter().map(run).collect();
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

/// Gap and scattering in turn; then one Jacobian with each row counting for what it decides.
fn with_gap(
    spec: &Spec,
    coarse: &Points,
    full: &Points,
    options: &Options,
    floor: f64,
) -> Option<Finished> {
    let off = |points: &Points| points.filter(|p| !p.is_peak());
    let (coarse_off, full_off) = (off(coarse), off(full));
    let mut gap = gap_alone(full, None);
    let mut held = spec.holding_gap(gap);
    let (mut x, agreeing) = search(&held, &coarse_off, &full_off, options, floor);
    let mut part = None;
    for _ in 0..2 {
        let fit = finish(&held, &full_off, options, floor, &x)?;
        // What the yarns scatter into the straight-through patches is not the gap's.
        let mut scattering = held.clone();
        scattering.gap = false;
        let peaks = full.filter(|p| p.is_peak());
        let scattered = Evaluator {
            spec: &scattering,
            points: &peaks,
        }
        .model(&fit.k, &fit.x);
        gap = gap_alone(full, Some(&scattered));
        held = spec.holding_gap(gap);
        x.clone_from(&fit.x);
        part = Some(fit);
    }
    let part = part?;
    // Put the coordinates together in the spec's order.
    let mut rest = part.x.iter().copied();
    let x: Vec<f64> = (0..spec.coordinates.len())
        .map(|c| {
            match ["gamma_warp", "gamma_weft", "section"]
                .iter()
                .position(|g| *g == spec.coordinates[c].name)
            {
                Some(i) => gap[i],
                None => rest.next().unwrap_or(0.0),
            }
        })
        .collect();
    let (k, m, n) = (part.k.clone(), full.points.len(), part.k.len() + x.len());
    let mut joint = Joint::new(
        Evaluator { spec, points: full },
        base_weights(full, options),
        options.metric,
        floor,
    );
    let start: Vec<f64> = k.iter().chain(&x).copied().collect();
    let (mut r, mut jacobian) = (vec![0.0; m], vec![0.0; m * n]);
    joint.evaluate(&start, &mut r, Some(&mut jacobian));
    // Each group in units of its own scatter; with hardly more rows than parameters 2 % of the level is taken for it.
    let sum = |peaks: bool, value: &dyn Fn(usize) -> f64| {
        let rows = (0..m).filter(|&i| full.points[i].is_peak() == peaks);
        rows.fold((0usize, 0.0), |(n, s), i| (n + 1, s + value(i) * value(i)))
    };
    let scatter = |peaks: bool, spent: usize| {
        let (rows, squares) = sum(peaks, &|i| r[i]);
        let level = sum(peaks, &|i| full.points[i].f).1 / rows.max(1) as f64;
        let variance = if rows > 2 * spent {
            (squares / (rows - spent) as f64).max(1e-24 * level)
        } else {
            4e-4 * level
        };
        variance.max(f64::MIN_POSITIVE).sqrt()
    };
    let scales = [scatter(false, n - 3), scatter(true, 3)];
    for (j, column) in jacobian.chunks_exact_mut(m).enumerate() {
        let of_gap = j >= k.len() && spec.is_gap(j - k.len());
        for (value, p) in column.iter_mut().zip(&full.points) {
            *value = if p.is_peak() == of_gap {
                *value / scales[usize::from(of_gap)]
            } else {
                0.0
            };
        }
    }
    let dof = m.saturating_sub(n).max(1) as f64;
    let at_bound = at_bounds(&joint, &start);
    Some(Finished {
        x,
        jacobian,
        sse: dof,
        at_bound,
        agreeing,
        ..part
    })
}

fn at_bounds(problem: &impl Residuals, x: &[f64]) -> Vec<bool> {
    let at = |(j, &x): (usize, &f64)| {
        let (lo, hi) = problem.bounds(j);
        x <= lo || x >= hi
    };
    x.iter().enumerate().map(at).collect()
}

/// The weave whose openness comes nearest to the straight-through rows, less what is `scattered` into them.
fn gap_alone(points: &Points, scattered: Option<&[f64]>) -> [f64; 3] {
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
        fn evaluate(&mut self, x: &[f64], r: &mut [f64], mut jac: Option<&mut [f64]>) -> bool {
            let m = r.len();
            let x: [Dual<3>; 3] = std::array::from_fn(|i| Dual::variable(x[i], i));
            for (i, (l, t)) in self.0.iter().enumerate() {
                let o = openness(x[0], x[1], x[2], l.cast());
                r[i] = o.v - t;
                if let Some(jac) = jac.as_deref_mut() {
                    for (j, d) in o.d.iter().enumerate() {
                        jac[j * m + i] = *d;
                    }
                }
            }
            true
        }
    }
    let peaks = points.points.iter().filter(|p| p.is_peak()).enumerate();
    let value =
        |i: usize, f: f64, direct: bool| f - scattered.filter(|_| !direct).map_or(0.0, |s| s[i]);
    let mut rows = Rows(
        peaks
            .map(|(i, p)| (p.l, value(i, p.f, p.direct_only) / p.gap_density))
            .collect(),
    );
    let near = rows
        .0
        .iter()
        .max_by(|a, b| a.0.z.abs().total_cmp(&b.0.z.abs()));
    let Some(&(_, t)) = near else { return [0.5; 3] };
    // A square weave of this openness, and two that are closer along one yarn.
    let g = 1.0 - t.clamp(0.0, 1.0).sqrt();
    let tries = [0.2, 0.5, 1.0]
        .into_iter()
        .flat_map(|s| [[g, g, s], [0.9 * g, g, s], [g, 0.9 * g, s]]);
    let settings = Settings {
        max_evaluations: 300,
        ..Settings::default()
    };
    let best = tries
        .map(|x| solve(&mut rows, &x, &settings))
        .min_by(|a, b| a.sse.total_cmp(&b.sse));
    best.map_or([g, g, 0.5], |s| [s.x[0], s.x[1], s.x[2]])
}

/// From a good start to the minimum on all of `full`, with the Jacobian over factors and shape.
fn finish(
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
        weights = reweight(&problem.k, &s.x);
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
    let n = problem.k.len();
    let mut both: Vec<f64> = problem.k.iter().chain(&s.x).copied().collect();
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
    let (mut r, mut jacobian) = (
        vec![0.0; joint.rows()],
        vec![0.0; joint.rows() * joint.params()],
    );
    joint.evaluate(&both, &mut r, Some(&mut jacobian));
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
        starts: 0,
        cross_validation_e4: None,
    })
}

/// Root mean square × 10⁴ of peak-normalised misfits at incidences that the fit did not see, five blocks of them; none with
/// fewer than five incidences. The gap stays as it is: its law spans all angles.
fn cross_validation(
    spec: &Spec,
    full: &Points,
    options: &Options,
    floor: f64,
    best: &Finished,
) -> Option<f64> {
    if full.incidences.len() < 5 {
        return None;
    }
    let (_, gap) = spec.shape_at(&best.x);
    let (shape, _) = spec.shape_at(&best.x);
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
