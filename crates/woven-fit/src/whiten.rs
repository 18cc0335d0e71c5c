//! Errors that all rows share, taken into a fit: nuisance parameters with unit priors, marginalised.
//!
//! With G the change of the weighted rows per standard deviation of each shared error, and s the scatter of the rows
//! themselves, the rows have the covariance s² 1 + G Gᵀ. Residuals and Jacobian times s (s² 1 + G Gᵀ)^-½ are independent
//! again, so the solver, the covariance and the profiles need not know. What the data see of an offset (a lobe's centre tells
//! that of an axis) moves the estimate; what they cannot see (the scale) widens the intervals.

use crate::linalg::dot;
use crate::measurement::shared::{Kind, shifted};
use crate::measurement::{Point, Points};
use crate::problem::{Evaluator, Joint};
use crate::solve::{Residuals, Settings, Solution, solve};
use nalgebra::{DMatrix, DVector};

/// s (s² 1 + G Gᵀ)^-½, which is 1 less a few directions.
#[derive(Clone, Debug, Default)]
pub(crate) struct Whitening {
    /// Unit vectors with what is taken away along each.
    directions: Vec<(Vec<f64>, f64)>,
}

/// Shared errors that outweigh the scatter beyond this are as good as unknown; more would hide parameters from the rank.
const UNKNOWN: f64 = 1e6;

impl Whitening {
    /// From the columns of G, each of `m` rows, and the scatter; none if a number is not finite.
    pub(crate) fn new(columns: &[f64], m: usize, scatter: f64) -> Option<Self> {
        if m == 0 || !columns.iter().all(|v| v.is_finite()) || !scatter.is_finite() {
            return None;
        }
        if columns.is_empty() {
            return Some(Self::default());
        }
        // U and singular values by GᵀG = V S² Vᵀ: what is lost of singular values below 1e-7 of the greatest is nothing here.
        let g = DMatrix::from_column_slice(m, columns.len() / m, columns);
        let eigen = (g.transpose() * &g).symmetric_eigen();
        let greatest = eigen.eigenvalues.max().max(0.0).sqrt();
        let floor = scatter.max(greatest / UNKNOWN);
        let mut directions = Vec::new();
        for (v, square) in eigen.eigenvectors.column_iter().zip(&eigen.eigenvalues) {
            let value = square.max(0.0).sqrt();
            if value > 1e-7 * greatest {
                let u = (&g * v / value).iter().copied().collect();
                directions.push((u, 1.0 - 1.0 / f64::hypot(1.0, value / floor)));
            }
        }
        Some(Self { directions })
    }

    /// Whitens a column.
    pub(crate) fn apply(&self, column: &mut [f64]) {
        for (u, take) in &self.directions {
            let along = take * dot(u, column);
            column.iter_mut().zip(u).for_each(|(c, u)| *c -= along * u);
        }
    }
}

/// A problem with its rows made independent.
pub(crate) struct Whitened<'a, P> {
    /// The problem itself.
    pub(crate) inner: &'a mut P,
    /// What its rows share.
    pub(crate) whitening: &'a Whitening,
}

impl<P: Residuals> Residuals for Whitened<'_, P> {
    fn rows(&self) -> usize {
        self.inner.rows()
    }
    fn params(&self) -> usize {
        self.inner.params()
    }
    fn bounds(&self, j: usize) -> (f64, f64) {
        self.inner.bounds(j)
    }
    fn evaluate(&mut self, x: &[f64], r: &mut [f64], jac: Option<&mut [f64]>) -> bool {
        let Some(jac) = jac else {
            let good = self.inner.evaluate(x, r, None);
            self.whitening.apply(r);
            return good;
        };
        let good = self.inner.evaluate(x, r, Some(&mut *jac));
        self.whitening.apply(r);
        jac.chunks_exact_mut(r.len())
            .for_each(|column| self.whitening.apply(column));
        good
    }
}

/// The rows' model values with one shared error a standard deviation up, and down.
type Sides = (Vec<f64>, Vec<f64>);

/// [`Sides`] of each shared error; none if the model cannot be evaluated there. `both` holds factors and shape.
fn changes(eval: Evaluator<'_>, both: &[f64]) -> Option<Vec<Sides>> {
    let (k, x) = both.split_at(eval.spec.linear.len());
    let points = eval.points;
    let here = eval.values(k, x)?;
    let along = |kind: Kind, sigma: f64| -> Option<Vec<f64>> {
        Some(match kind {
            Kind::Scale => here.iter().map(|f| f * (1.0 + sigma)).collect(),
            Kind::SolidAngle => {
                let rows = here.iter().zip(&points.points);
                rows.map(|(f, p)| if p.direct_only { *f } else { f * (1.0 + sigma) })
                    .collect()
            }
            Kind::Floor => {
                let rows = here.iter().zip(&points.points);
                rows.map(|(f, p)| match p.direct_only {
                    true => *f,
                    false => f + sigma / p.v.z.abs(),
                })
                .collect()
            }
            _ => {
                let (points, factors) = shifted(points, kind, sigma);
                let values = Evaluator {
                    points: &points,
                    ..eval
                }
                .values(k, x)?;
                values.iter().zip(factors).map(|(v, f)| v * f).collect()
            }
        })
    };
    let shared = points.shared.iter();
    shared
        .map(|s| Some((along(s.kind, s.sigma)?, along(s.kind, -s.sigma)?)))
        .collect()
}

/// G of a problem at `both`, column by column: half the difference between one standard deviation up and one down.
pub(crate) fn columns(joint: &Joint<'_>, both: &[f64]) -> Option<Vec<f64>> {
    let value = |f: f64| joint.metric.apply(f, joint.floor).0;
    let sides = changes(joint.eval, both)?;
    let column = |(up, down): Sides| {
        let rows = up.into_iter().zip(down).zip(&joint.weights);
        rows.map(|((a, b), w)| 0.5 * w * (value(a) - value(b)))
            .collect::<Vec<f64>>()
    };
    Some(sides.into_iter().flat_map(column).collect())
}

/// The end of a fit with shared errors.
pub(crate) struct Settled {
    /// The rows as the axes really stood, as far as the data tell, bent so that the problem is linear in all shared errors.
    pub(crate) points: Points,
    /// Square roots of the weights for the rows' own noise.
    pub(crate) weights: Vec<f64>,
    /// The solver's last answer, factors and shape together.
    pub(crate) solution: Solution,
    /// How the rows were made independent.
    pub(crate) whitening: Whitening,
    /// What the data say of each shared error, in its standard deviations.
    pub(crate) found: Vec<f64>,
}

/// From the minimum without shared errors to that with them; none if there are none or nothing can be evaluated. With
/// `weighted` the weights are those of the rows' whole standard errors, and become those of what is their own.
///
/// G and the scatter depend on the answer, and an axis that is off moves a narrow lobe by more than its slope tells, so a
/// few rounds settle all three.
pub(crate) fn settle(
    joint: &mut Joint<'_>,
    weighted: bool,
    start: &[f64],
    settings: &Settings,
) -> Option<Settled> {
    let full = joint.eval.points;
    let (m, n) = (joint.rows(), joint.params());
    if full.shared.is_empty() || m <= n {
        return None;
    }
    let own = |p: &Point| if weighted { p.own } else { 1.0 };
    let weights = joint.weights.iter().zip(&full.points);
    let weights: Vec<f64> = weights.map(|(w, p)| w / own(p)).collect();
    let mut r = vec![0.0; m];
    if !joint.evaluate(start, &mut r, None) {
        return None;
    }
    let rows = r.iter_mut().zip(&full.points);
    rows.for_each(|(r, p)| *r /= own(p));
    let dof = (m - n) as f64;
    let mut scatter = (dot(&r, &r) / dof).sqrt();
    let (mut x, mut z) = (start.to_vec(), vec![0.0; full.shared.len()]);
    let mut points = full.clone();
    let mut round = 0;
    loop {
        round += 1;
        let eval = Evaluator {
            points: &points,
            ..joint.eval
        };
        let mut inner = Joint::new(eval, weights.clone(), joint.metric, joint.floor);
        let g = columns(&inner, &x)?;
        let whitening = Whitening::new(&g, m, scatter)?;
        let problem = &mut Whitened {
            inner: &mut inner,
            whitening: &whitening,
        };
        let solution = solve(problem, &x, settings);
        x.clone_from(&solution.x);
        let before = std::mem::replace(&mut scatter, (solution.sse / dof).sqrt());
        inner.evaluate(&x, &mut r, None);
        let found = estimates(&g, &r, scatter);
        let moved = found.iter().zip(&z).map(|(a, b)| f64::abs(a - b));
        let moved = moved.zip(&full.shared).filter(|(_, s)| s.kind.is_axis());
        let still = moved.fold(0.0, |most, (d, _)| f64::max(most, d)) < STILL;
        if round == 8 || (still && (scatter - before).abs() <= 1e-3 * before) {
            return Some(Settled {
                points,
                weights,
                solution,
                whitening,
                found,
            });
        }
        let there = displaced(joint.eval, full, &found, &x)?;
        (points, z) = (there, found);
    }
}

/// Axes that move by less than this share of their standard deviation stand where they are.
const STILL: f64 = 0.02;

/// The rows with the axes where `z` (in standard deviations) puts them, values bent so that the shared errors count from zero.
fn displaced(eval: Evaluator<'_>, full: &Points, z: &[f64], both: &[f64]) -> Option<Points> {
    let mut points = full.clone();
    for (s, z) in full.shared.iter().zip(z).filter(|(s, _)| s.kind.is_axis()) {
        let (moved, factors) = shifted(&points, s.kind, z * s.sigma);
        points = moved;
        for (p, factor) in points.points.iter_mut().zip(factors) {
            p.f /= factor;
        }
    }
    let sides = changes(
        Evaluator {
            points: &points,
            ..eval
        },
        both,
    )?;
    for ((s, z), (up, down)) in full.shared.iter().zip(z).zip(&sides) {
        if s.kind.is_axis() {
            for ((p, up), down) in points.points.iter_mut().zip(up).zip(down) {
                p.f += 0.5 * z * (up - down);
            }
        }
    }
    Some(points)
}

/// (GᵀG + s²)⁻¹ Gᵀ (-r): the shared errors that explain the residuals r best, in their standard deviations.
fn estimates(g: &[f64], r: &[f64], scatter: f64) -> Vec<f64> {
    let (m, q) = (r.len(), g.len() / r.len());
    let g = DMatrix::from_column_slice(m, q, g);
    let pull = -(g.transpose() * DVector::from_column_slice(r));
    let system =
        g.transpose() * &g + DMatrix::identity(q, q) * scatter.powi(2).max(f64::MIN_POSITIVE);
    system
        .cholesky()
        .map_or(vec![0.0; q], |c| c.solve(&pull).iter().copied().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whitened_rows_have_the_inverse_covariance() {
        // Two shared errors over three rows, scatter 0.5: apply twice = s² (s² 1 + G Gᵀ)⁻¹. The second pair moves the rows alike,
        // as a factor on all values and one on nearly all do.
        for g in [
            [1.0, 2.0, -1.0, 0.3, 0.0, 0.7],
            [1.0, 2.0, -1.0, 0.3, 0.6, -0.3],
        ] {
            let w = Whitening::new(&g, 3, 0.5).unwrap();
            let gm = DMatrix::from_column_slice(3, 2, &g);
            let cov = &gm * gm.transpose() + DMatrix::identity(3, 3) * 0.25;
            let want = cov.try_inverse().unwrap() * 0.25;
            for j in 0..3 {
                let mut e = [0.0; 3];
                e[j] = 1.0;
                w.apply(&mut e);
                w.apply(&mut e);
                for (i, e) in e.iter().enumerate() {
                    assert!((e - want[(i, j)]).abs() < 1e-12, "{i} {j}");
                }
            }
        }
    }
}
