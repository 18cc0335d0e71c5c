//! From a solver's answer to what a table shows: natural units, error bars, intervals, remarks, scores.

use crate::finish::Finished;
use crate::fit::{ModelFit, Options, Parameter};
use crate::measurement::Points;
use crate::problem::{Evaluator, Spec};
use crate::profile::{End, LEVELS, Range};
use crate::quantile::student;
use crate::rank;
use crate::solve::Outcome;
use crate::text::number;
use crate::uncertainty::uncertainty;

/// Puts a finished fit into words and numbers.
pub(crate) fn summary(
    spec: &Spec,
    full: &Points,
    options: &Options,
    floor: f64,
    best: Finished,
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
    let mut jac = best.jacobian.clone();
    for (j, c) in spec.coordinates.iter().enumerate() {
        if c.log {
            let column = &mut jac[(n_linear + j) * m..(n_linear + j + 1) * m];
            column.iter_mut().for_each(|v| *v /= natural[n_linear + j]);
        }
    }
    let u = uncertainty(&jac, m, &names, &natural, &best.at_bound, best.sse, true);
    let quantiles = LEVELS.map(|level| student(level, u.dof));
    let parameters = (0..names.len())
        .map(|j| {
            let log = j >= n_linear && spec.coordinates[j - n_linear].log;
            let mut p = Parameter {
                name: names[j],
                value: natural[j],
                standard_error: None,
                interval68: None,
                interval95: None,
                interval997: None,
                profiled: false,
                remark: String::new(),
            };
            match (best.ranges[j], u.standard_error[j]) {
                (Some(range), _) => profiled(&mut p, &range, &quantiles, log),
                (None, Some(se)) => normal(&mut p, se, &quantiles, log),
                (None, None) if !best.at_bound[j] => {
                    p.remark = "the data cannot see it alone".to_owned();
                }
                (None, None) => {}
            }
            if best.at_bound[j] {
                p.remark = ["stands at its bound", &p.remark]
                    .iter()
                    .filter(|s| !s.is_empty())
                    .copied()
                    .collect::<Vec<_>>()
                    .join("; ");
            }
            p
        })
        .collect();
    let fitted = Evaluator { spec, points: full }.model(&best.k, &best.x);
    let (_, gap) = spec.shape_at(&best.x);
    let own_gap = spec.model.params.iter().any(|p| p.name == "gamma_warp");
    let outcome = match best.outcome {
        Outcome::Converged => "converged".to_owned(),
        Outcome::OutOfPatience => "out of patience".to_owned(),
        Outcome::Degenerate { .. } => "degenerate".to_owned(),
        Outcome::Stuck => "stuck at a kink".to_owned(),
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
        rms_metric: 0.0,
        misfit: 0.0,
        aicc: 0.0,
        bic: 0.0,
        cross_validation_e4: best.cross_validation_e4,
        offsets: full
            .shared
            .iter()
            .zip(&best.offsets)
            .map(|(s, z)| (s.kind, z * s.sigma, s.sigma))
            .collect(),
        outcome,
        evaluations: best.evaluations,
        starts_agreeing: best.agreeing,
        starts: options.starts.max(1),
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

/// Intervals from the covariance.
fn normal(p: &mut Parameter, se: f64, quantiles: &[f64; 3], log: bool) {
    let interval = |t: f64| {
        if log {
            let half = (t * se / p.value).min(50.0);
            (p.value * (-half).exp(), p.value * half.exp())
        } else {
            (p.value - t * se, p.value + t * se)
        }
    };
    let [i68, i95, i997] = quantiles.map(interval);
    p.standard_error = Some(se);
    (p.interval68, p.interval95, p.interval997) = (Some(i68), Some(i95), Some(i997));
}

/// Intervals from the profile; none, and no error bar, where the profile ends on neither side.
fn profiled(p: &mut Parameter, range: &Range, quantiles: &[f64; 3], log: bool) {
    let natural = |x: f64| if log { x.exp() } else { x };
    let value = |end: End| match end {
        End::Crossed(x) | End::Bound(x) => natural(x),
        End::Open => f64::INFINITY,
    };
    let crossed = |end: End| matches!(end, End::Crossed(_));
    let interval =
        |(lo, hi): (End, End)| (crossed(lo) || crossed(hi)).then(|| (value(lo), value(hi)));
    let finite = |i: Option<(f64, f64)>| i.filter(|(lo, hi)| lo.is_finite() && hi.is_finite());
    let [i68, i95, i997] = range.ends.map(interval);
    (p.interval68, p.interval95, p.interval997) = (finite(i68), finite(i95), finite(i997));
    p.profiled = true;
    let (lo, hi) = range.ends[1];
    p.remark = match (crossed(lo), crossed(hi)) {
        (true, true) => String::new(),
        (false, true) => format!("at most {} (95 %)", number(value(hi))),
        (true, false) => format!("at least {} (95 %)", number(value(lo))),
        (false, false) => "the data cannot see it alone".to_owned(),
    };
    let (lo, hi) = range.ends[0];
    if crossed(lo) && crossed(hi) {
        // One number for what has two sides: so large that one, two and three of it reach to the ends of all intervals.
        let reach = |(i, t): (Option<(f64, f64)>, &f64)| {
            i.map_or(f64::INFINITY, |(lo, hi)| {
                (hi - p.value).max(p.value - lo) / t
            })
        };
        let intervals = [p.interval68, p.interval95, p.interval997];
        let reaches = intervals.into_iter().zip(quantiles).map(reach);
        p.standard_error = Some(reaches.fold(0.0, f64::max)).filter(|s| s.is_finite());
    }
}
