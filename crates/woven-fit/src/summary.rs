//! From a solver's answer to what a table shows: natural units, error bars, intervals, remarks, scores.

use crate::fit::{ModelFit, Options, Parameter};
use crate::measurement::Points;
use crate::problem::{Evaluator, Spec};
use crate::rank;
use crate::solve::Outcome;
use crate::uncertainty::{student, uncertainty};

/// The end of a fit in the solver's coordinates.
pub(crate) struct Finished {
    /// Linear factors.
    pub(crate) k: Vec<f64>,
    /// Solver coordinates of the shape.
    pub(crate) x: Vec<f64>,
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
    /// Starts.
    pub(crate) starts: usize,
    /// Root mean square × 10⁴ over incidences left out.
    pub(crate) cross_validation_e4: Option<f64>,
}

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
            let remark = if best.at_bound[j] {
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
        misfit: 0.0,
        aicc: 0.0,
        bic: 0.0,
        cross_validation_e4: best.cross_validation_e4,
        outcome,
        evaluations: best.evaluations,
        starts_agreeing: best.agreeing,
        starts: best.starts,
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
