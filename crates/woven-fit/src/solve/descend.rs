//! The descent: trust-region steps until nothing is left to gain, then the polish, then the verdict.

use super::state::State;
use super::{Outcome, Residuals, Settings, Solution};
use crate::linalg::{dot, norm};

/// Relative size below which a pivot of the scaled R counts as zero when judging the rank.
const RANK_TOL: f64 = 1e-11;

/// Accepted steps after which a problem counts as a curved valley and steps are bent along it.
const BEND_AFTER: usize = 12;

impl State {
    pub(super) fn descend<P: Residuals + ?Sized>(
        &mut self,
        problem: &mut P,
        settings: &Settings,
    ) -> Outcome {
        if !self.finite {
            return Outcome::NotFinite;
        }
        let mut trial_r = vec![0.0; self.m];
        self.factorise();
        let start = self.scaled_norm(&self.x.clone());
        let mut accepted = 0;
        let mut delta = settings.factor * if start > 0.0 { start } else { 1.0 };
        loop {
            if self.fnorm == 0.0 {
                return Outcome::Converged;
            }
            let free = self.free();
            if free.is_empty() {
                return Outcome::Converged;
            }
            let qr = self.triangle_of(&free, &self.z);
            // Share of the residual that a Gauss–Newton step could explain.
            if norm(&qr.qtb) <= settings.offset_tol * self.fnorm && qr.rank(RANK_TOL) == free.len()
            {
                return Outcome::Converged;
            }
            loop {
                if self.evaluations >= settings.max_evaluations {
                    return Outcome::OutOfPatience;
                }
                let (mut p, full, damped) = self.step(&free, delta);
                let length = self.scaled_norm(&p);
                let predicted = self.predicted(&p);
                if accepted >= BEND_AFTER
                    && let Some(damped) = damped
                    && let Some(bent) = self.bend(problem, &free, &p, &damped, &mut trial_r)
                {
                    p = bent;
                }
                let trial: Vec<f64> = (0..self.n)
                    .map(|j| {
                        (self.x[j] + p[j])
                            .max(self.bounds[j].0)
                            .min(self.bounds[j].1)
                    })
                    .collect();
                let ok = problem.evaluate(&trial, &mut trial_r, None);
                self.evaluations += 1;
                let trial_norm = norm(&trial_r);
                let gain = if ok && trial_norm.is_finite() {
                    1.0 - (trial_norm / self.fnorm).powi(2)
                } else {
                    f64::NEG_INFINITY
                };
                let ratio = if predicted > 0.0 {
                    gain / predicted
                } else {
                    -1.0
                };
                if ratio <= 0.25 {
                    // MINPACK: the minimum of the parabola through both values and the slope.
                    let shrink = if gain >= 0.0 {
                        0.5
                    } else if gain.is_finite() && predicted > 0.0 {
                        (0.5 * predicted / (predicted - 0.5 * gain)).clamp(0.1, 0.5)
                    } else {
                        0.1
                    };
                    delta = shrink * delta.min(length / 0.1);
                } else if ratio >= 0.75 || full {
                    delta = 2.0 * length.max(if full { 0.0 } else { 0.5 * delta });
                }
                if ratio >= 1e-4 {
                    accepted += 1;
                    self.x = trial;
                    self.fnorm = trial_norm;
                    let ok = problem.evaluate(&self.x, &mut self.r, Some(&mut self.jac));
                    self.evaluations += 1;
                    if !ok || self.jac.iter().any(|v| !v.is_finite()) {
                        return Outcome::OutOfPatience;
                    }
                    self.factorise();
                }
                let small_gain = gain.abs() <= settings.gain_tol
                    && predicted <= settings.gain_tol
                    && ratio <= 2.0;
                if small_gain || delta <= settings.step_tol * self.scaled_norm(&self.x) {
                    return if self.is_flat() {
                        Outcome::Converged
                    } else {
                        Outcome::Stuck
                    };
                }
                if ratio >= 1e-4 {
                    break;
                }
            }
        }
    }

    /// Whether the residual stands at right angles on all free columns that are more than rounding, or a full step would be
    /// rounding.
    pub(super) fn is_flat(&self) -> bool {
        let free = self.free();
        let cosine = |&j: &usize| {
            let column = &self.rr[j * self.n..=j * self.n + j];
            let length = norm(column) * self.fnorm;
            // Doubling the parameter would not show in the residual: what the slope of such a column says is rounding.
            let unseen = length * self.x[j].abs() <= 1e-9 * self.fnorm * self.fnorm;
            length == 0.0 || unseen || dot(column, &self.z[..=j]).abs() <= 1e-5 * length
        };
        let short = || {
            let step = self.triangle_of(&free, &self.z).solve();
            step.is_none_or(|s| norm(&s) <= 1e-6 * self.scaled_norm(&self.x))
        };
        free.iter().all(cosine) || short()
    }

    /// Gauss–Newton steps as long as each is clearly shorter than the one before.
    pub(super) fn polish<P: Residuals + ?Sized>(&mut self, problem: &mut P, settings: &Settings) {
        let mut last = f64::INFINITY;
        for _ in 0..settings.polish {
            if self.fnorm == 0.0 {
                return;
            }
            let free = self.free();
            let qr = self.triangle_of(&free, &self.z);
            if free.is_empty() || qr.rank(RANK_TOL) < free.len() {
                return;
            }
            let Some(scaled) = qr.solve() else { return };
            let mut trial = self.x.clone();
            for (k, &j) in free.iter().enumerate() {
                trial[j] += scaled[k] / self.scale_of(j);
                if trial[j] < self.bounds[j].0 || trial[j] > self.bounds[j].1 {
                    return;
                }
            }
            let length = norm(&scaled) / self.scaled_norm(&self.x).max(f64::MIN_POSITIVE);
            if length.is_nan() || length >= 0.7 * last || trial == self.x {
                return;
            }
            let (mut r, mut jac) = (vec![0.0; self.m], vec![0.0; self.m * self.n]);
            let ok = problem.evaluate(&trial, &mut r, Some(&mut jac));
            self.evaluations += 1;
            let fnorm = norm(&r);
            // Near the minimum the sum of squares is flat: rounding may raise it a little.
            if !ok
                || fnorm.is_nan()
                || fnorm > self.fnorm * (1.0 + 1e-7)
                || jac.iter().any(|v| !v.is_finite())
            {
                return;
            }
            last = length;
            (self.x, self.r, self.jac, self.fnorm) = (trial, r, jac, fnorm);
            self.factorise();
            if length < f64::EPSILON {
                return;
            }
        }
    }

    pub(super) fn finish<P: Residuals + ?Sized>(
        mut self,
        problem: &mut P,
        outcome: Outcome,
        settings: &Settings,
    ) -> Solution {
        let mut outcome = outcome;
        let mut at_bound = vec![false; self.n];
        if self.finite {
            if outcome == Outcome::Converged {
                self.polish(problem, settings);
            }
            let free = self.free();
            at_bound = (0..self.n).map(|j| !free.contains(&j)).collect();
            if outcome == Outcome::Converged && !free.is_empty() {
                let qr = self.triangle_of(&free, &self.z);
                let rank = qr.rank(RANK_TOL);
                if rank < free.len() {
                    outcome = Outcome::Degenerate {
                        parameter: free[qr.order[rank]],
                    };
                }
            }
        }
        Solution {
            sse: self.fnorm * self.fnorm,
            x: self.x,
            residuals: self.r,
            jacobian: self.jac,
            outcome,
            evaluations: self.evaluations,
            at_bound,
        }
    }
}
