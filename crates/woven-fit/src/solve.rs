//! Levenberg–Marquardt with bounds: one default setting for easy and for certified-hard problems.
//!
//! The scheme is Moré's (1978, "The Levenberg–Marquardt algorithm: implementation and theory"; MINPACK's
//! `lmder`): a trust region scaled by the largest column norms seen, its multiplier found by Newton steps on
//! the secular equation. Four things are added, because fits of cloth and the NIST problems need them:
//!
//! - **bent steps**: after a dozen steps without an end the problem is a curved valley, and steps are bent along it (geodesic
//!   acceleration, Transtrum and Sethna 2012): a sixth of the evaluations on the hard NIST problems;
//! - **bounds**: a variable at its bound that wants to go out is held; a step that would leave is cut at the
//!   bound and the others are solved again with that part of the step fixed;
//! - **the stop asks the right question**: not "did the last step gain little", which a curved valley fools, but
//!   "how much of the residual could a full Gauss–Newton step still explain" (Bates and Watts 1981);
//! - **polish**: full Gauss–Newton steps at the end, accepted by their own shrinking length. The sum of squares
//!   fixes a minimum to half of the digits only; the gradient fixes it to nearly all.

#![expect(
    clippy::needless_range_loop,
    reason = "matrix indices read like the algorithms' papers"
)]

use crate::linalg::{
    PivotedR, back_substitute, dot, forward_substitute_transposed, norm, qr_in_place,
};

/// A least-squares problem: minimise Σ r_i(x)² over x within bounds.
pub trait Residuals {
    /// Number of residuals.
    fn rows(&self) -> usize;

    /// Number of parameters.
    fn params(&self) -> usize;

    /// Fills `r` and, when asked, the column-major Jacobian `jac[j * rows + i] = ∂r_i/∂x_j`.
    ///
    /// Returns false where the model cannot be evaluated; the solver then takes a shorter step.
    fn evaluate(&mut self, x: &[f64], r: &mut [f64], jac: Option<&mut [f64]>) -> bool;

    /// Least and greatest allowed value of parameter `j`; without bounds by default.
    fn bounds(&self, _j: usize) -> (f64, f64) {
        (f64::NEG_INFINITY, f64::INFINITY)
    }
}

/// What the solver may spend and when it is content. The default is meant for everything.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Most evaluations of the residuals.
    pub max_evaluations: usize,
    /// First trust region, in units of the scaled length of the start.
    pub factor: f64,
    /// Content when a Gauss–Newton step could explain less than this share of the residual's length.
    pub offset_tol: f64,
    /// Content when the relative gain, real and predicted, is below this.
    pub gain_tol: f64,
    /// Content when the trust region, relative to x, is below this.
    pub step_tol: f64,
    /// Most Gauss–Newton steps at the end.
    pub polish: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            max_evaluations: 4000,
            factor: 1.0,
            offset_tol: 1e-7,
            gain_tol: 4.0 * f64::EPSILON,
            step_tol: 4.0 * f64::EPSILON,
            polish: 40,
        }
    }
}

/// How a fit ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// A minimum: no step allowed by the bounds gains anything.
    Converged,
    /// The number of evaluations was used up; x is the best found.
    OutOfPatience,
    /// A minimum along the directions that the data see; the named parameter is (part of) one they do not see.
    Degenerate {
        /// Index of the parameter with the greatest share in the invisible direction.
        parameter: usize,
    },
    /// No shorter step gains anything although this is no minimum: a pole, a kink or a model that cannot be evaluated beyond.
    Stuck,
    /// The model could not be evaluated at the start.
    NotFinite,
}

/// The end of a fit.
#[derive(Clone, Debug)]
pub struct Solution {
    /// The parameters.
    pub x: Vec<f64>,
    /// Residuals at `x`.
    pub residuals: Vec<f64>,
    /// Column-major Jacobian at `x`.
    pub jacobian: Vec<f64>,
    /// Sum of squared residuals.
    pub sse: f64,
    /// How it ended.
    pub outcome: Outcome,
    /// Evaluations spent, with and without Jacobian.
    pub evaluations: usize,
    /// True for a parameter that is held by its bound.
    pub at_bound: Vec<bool>,
}

/// Minimises from `start` (moved into the bounds first).
pub fn solve<P: Residuals + ?Sized>(
    problem: &mut P,
    start: &[f64],
    settings: &Settings,
) -> Solution {
    let mut state = State::new(problem, start);
    let outcome = state.descend(problem, settings);
    state.finish(problem, outcome, settings)
}

/// Relative size below which a pivot of the scaled R counts as zero when judging the rank.
const RANK_TOL: f64 = 1e-11;

/// Accepted steps after which a problem counts as a curved valley and steps are bent along it.
const BEND_AFTER: usize = 12;

struct State {
    m: usize,
    n: usize,
    x: Vec<f64>,
    r: Vec<f64>,
    jac: Vec<f64>,
    fnorm: f64,
    bounds: Vec<(f64, f64)>,
    scale: Vec<f64>,
    work: Vec<f64>,
    /// n×n upper triangle of the QR of the Jacobian at x, and Qᵀr.
    rr: Vec<f64>,
    z: Vec<f64>,
    evaluations: usize,
    finite: bool,
}

impl State {
    fn new<P: Residuals + ?Sized>(problem: &mut P, start: &[f64]) -> Self {
        let (m, n) = (problem.rows(), problem.params());
        let bounds: Vec<(f64, f64)> = (0..n).map(|j| problem.bounds(j)).collect();
        let x: Vec<f64> = start
            .iter()
            .zip(&bounds)
            .map(|(&v, &(lo, hi))| v.max(lo).min(hi))
            .collect();
        let mut r = vec![0.0; m];
        let mut jac = vec![0.0; m * n];
        let ok = problem.evaluate(&x, &mut r, Some(&mut jac));
        let fnorm = norm(&r);
        let finite = ok && fnorm.is_finite() && jac.iter().all(|v| v.is_finite());
        Self {
            m,
            n,
            x,
            r,
            jac,
            fnorm,
            bounds,
            scale: vec![0.0; n],
            work: Vec::with_capacity(m * (n + 1)),
            rr: vec![0.0; n * n],
            z: vec![0.0; n],
            evaluations: 1,
            finite,
        }
    }

    /// QR of [J | r]; updates the scales with the column norms.
    fn factorise(&mut self) {
        let (m, n) = (self.m, self.n);
        for j in 0..n {
            let length = norm(&self.jac[j * m..(j + 1) * m]);
            self.scale[j] = self.scale[j].max(length);
        }
        // With fewer residuals than parameters, rows of zeros make the triangle square.
        let rows = m.max(n);
        self.work.clear();
        self.work.resize(rows * (n + 1), 0.0);
        for j in 0..n {
            self.work[j * rows..j * rows + m].copy_from_slice(&self.jac[j * m..(j + 1) * m]);
        }
        self.work[n * rows..n * rows + m].copy_from_slice(&self.r);
        qr_in_place(&mut self.work, rows, n, n + 1);
        self.rr.fill(0.0);
        for j in 0..n {
            self.rr[j * n..=j * n + j].copy_from_slice(&self.work[j * rows..=j * rows + j]);
        }
        self.z.copy_from_slice(&self.work[n * rows..n * rows + n]);
    }

    fn scale_of(&self, j: usize) -> f64 {
        if self.scale[j] > 0.0 {
            self.scale[j]
        } else {
            1.0
        }
    }

    fn scaled_norm(&self, v: &[f64]) -> f64 {
        norm(
            &(0..self.n)
                .map(|j| self.scale_of(j) * v[j])
                .collect::<Vec<_>>(),
        )
    }

    /// Indices that may move: not at a bound with the gradient pointing out.
    fn free(&self) -> Vec<usize> {
        (0..self.n)
            .filter(|&j| {
                let (lo, hi) = self.bounds[j];
                // Jᵀr = Rᵀz.
                let slope = dot(&self.rr[j * self.n..=j * self.n + j], &self.z[..=j]);
                !((self.x[j] <= lo && slope >= 0.0) || (self.x[j] >= hi && slope <= 0.0))
            })
            .collect()
    }

    fn triangle_of(&self, free: &[usize], z: &[f64]) -> PivotedR {
        let n = self.n;
        let mut sub = Vec::with_capacity(free.len() * n);
        for &j in free {
            // Scaled columns: the pivots then tell the rank, whatever the units.
            let d = 1.0 / self.scale_of(j);
            sub.extend(self.rr[j * n..(j + 1) * n].iter().map(|v| v * d));
        }
        let b: Vec<f64> = z.iter().map(|v| -v).collect();
        PivotedR::new(&sub, n, free.len(), &b)
    }

    /// Step within the trust region and the bounds, whether it is a full Gauss–Newton step, and, where no bound cut it,
    /// the triangle it was solved with.
    fn step(&self, free: &[usize], delta: f64) -> (Vec<f64>, bool, Option<PivotedR>) {
        let n = self.n;
        let mut p = vec![0.0; n];
        let mut free = free.to_vec();
        let mut z = self.z.clone();
        let mut full = true;
        let asked = free.len();
        while !free.is_empty() {
            let qr = self.triangle_of(&free, &z);
            let (scaled, newton, triangle) = trust_region_step(&qr, delta);
            full &= newton;
            let mut cut = Vec::new();
            for (k, &j) in free.iter().enumerate() {
                p[j] = scaled[k] / self.scale_of(j);
                let (lo, hi) = self.bounds[j];
                let target = self.x[j] + p[j];
                if target < lo || target > hi {
                    p[j] = target.max(lo).min(hi) - self.x[j];
                    cut.push(j);
                }
            }
            if cut.is_empty() {
                let whole = free.len() == asked;
                let damped = PivotedR { r: triangle, ..qr };
                return (p, full, whole.then_some(damped));
            }
            full = false;
            for &j in &cut {
                for i in 0..n {
                    z[i] += self.rr[j * n + i] * p[j];
                }
            }
            free.retain(|j| !cut.contains(j));
        }
        (p, full, None)
    }

    /// Bends the step along the valley (geodesic acceleration, Transtrum and Sethna 2012): half the second derivative of the
    /// residuals along the step, from one more evaluation, solved with the step's own triangle. None when the curvature is
    /// too large to be trusted or the bent step would leave the bounds.
    fn bend<P: Residuals + ?Sized>(
        &mut self,
        problem: &mut P,
        free: &[usize],
        p: &[f64],
        damped: &PivotedR,
        trial_r: &mut [f64],
    ) -> Option<Vec<f64>> {
        const H: f64 = 0.1;
        let ahead: Vec<f64> = self.x.iter().zip(p).map(|(x, p)| x + H * p).collect();
        self.evaluations += 1;
        if !problem.evaluate(&ahead, trial_r, None) {
            return None;
        }
        // r'' ≈ (2/h) ((r(x + h p) - r)/h - J p).
        for (t, r) in trial_r.iter_mut().zip(&self.r) {
            *t = (*t - r) / H;
        }
        for (column, p) in self.jac.chunks_exact(self.m).zip(p) {
            if *p != 0.0 {
                trial_r
                    .iter_mut()
                    .zip(column)
                    .for_each(|(t, c)| *t -= c * p);
            }
        }
        let slope = |j: usize| {
            let column = &self.jac[j * self.m..(j + 1) * self.m];
            -2.0 / H * dot(column, trial_r) / self.scale_of(j)
        };
        let mut y: Vec<f64> = damped.order.iter().map(|&k| slope(free[k])).collect();
        forward_substitute_transposed(&damped.r, damped.n, &mut y)?;
        back_substitute(&damped.r, damped.n, &mut y)?;
        let scaled = damped.unpermute(&y);
        let mut bent = p.to_vec();
        for (k, &j) in free.iter().enumerate() {
            bent[j] += 0.5 * scaled[k] / self.scale_of(j);
            let target = self.x[j] + bent[j];
            if !(self.bounds[j].0..=self.bounds[j].1).contains(&target) {
                return None;
            }
        }
        (2.0 * norm(&scaled) <= 0.75 * self.scaled_norm(p)).then_some(bent)
    }

    /// The relative gain that the linear model promises for the step p.
    fn predicted(&self, p: &[f64]) -> f64 {
        let n = self.n;
        let mut rp = vec![0.0; n];
        for j in 0..n {
            for i in 0..=j {
                rp[i] += self.rr[j * n + i] * p[j];
            }
        }
        let f = self.fnorm;
        let scaled = |v: f64| v / f;
        let mut gain = 0.0;
        for i in 0..n {
            gain -= scaled(rp[i]) * (2.0 * scaled(self.z[i]) + scaled(rp[i]));
        }
        gain
    }

    fn descend<P: Residuals + ?Sized>(&mut self, problem: &mut P, settings: &Settings) -> Outcome {
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

    /// Whether the residual stands at right angles on all free columns, or a full step would be rounding.
    fn is_flat(&self) -> bool {
        let free = self.free();
        let cosine = |&j: &usize| {
            let column = &self.rr[j * self.n..=j * self.n + j];
            let length = norm(column) * self.fnorm;
            length == 0.0 || dot(column, &self.z[..=j]).abs() <= 1e-5 * length
        };
        let short = || {
            let step = self.triangle_of(&free, &self.z).solve();
            step.is_none_or(|s| norm(&s) <= 1e-6 * self.scaled_norm(&self.x))
        };
        free.iter().all(cosine) || short()
    }

    /// Gauss–Newton steps as long as each is clearly shorter than the one before.
    fn polish<P: Residuals + ?Sized>(&mut self, problem: &mut P, settings: &Settings) {
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

    fn finish<P: Residuals + ?Sized>(
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

/// Minimises |A s - b| with |s| ≤ delta, A given by its pivoted QR (columns already scaled).
///
/// Returns the step, whether it is the full Gauss–Newton step, and the triangle of the (damped) system in pivoted order.
fn trust_region_step(qr: &PivotedR, delta: f64) -> (Vec<f64>, bool, Vec<f64>) {
    let n = qr.n;
    let full_rank = qr.rank(1e-15) == n;
    let mut lower = 0.0;
    if full_rank && let Some(s) = qr.solve() {
        let length = norm(&s);
        if length <= 1.1 * delta {
            return (s, true, qr.r.clone());
        }
        // Slope of the secular function at 0 gives a lower bound of the multiplier.
        let mut w: Vec<f64> = qr.order.iter().map(|&j| s[j] / length).collect();
        if forward_substitute_transposed(&qr.r, n, &mut w).is_some() {
            lower = (length - delta) / (delta * dot(&w, &w));
        }
    }
    // g = Rᵀ qtb; |g| / delta bounds the multiplier from above.
    let g: Vec<f64> = (0..n)
        .map(|j| dot(&qr.r[j * n..=j * n + j], &qr.qtb[..=j]))
        .collect();
    let g_length = norm(&g);
    if g_length == 0.0 {
        return (vec![0.0; n], false, qr.r.clone());
    }
    let mut upper = g_length / delta;
    let mut lambda = if lower > 0.0 { lower } else { 1e-3 * upper };
    let mut best = vec![0.0; n];
    let mut last = qr.r.clone();
    for _ in 0..12 {
        if !(lambda > lower && lambda < upper) {
            lambda = (1e-3 * upper).max((lower * upper).sqrt());
        }
        let (y, triangle) = damped_solve(qr, lambda);
        let length = norm(&y);
        best = y;
        last = triangle;
        if (length - delta).abs() <= 0.1 * delta || !length.is_finite() {
            break;
        }
        let mut w: Vec<f64> = best.iter().map(|v| v / length).collect();
        if forward_substitute_transposed(&last, n, &mut w).is_none() {
            break;
        }
        let newton = (length - delta) / (delta * dot(&w, &w));
        if length > delta {
            lower = lower.max(lambda);
        } else {
            upper = upper.min(lambda);
        }
        lambda = (lambda + newton).max(lower);
    }
    (qr.unpermute(&best), false, last)
}

/// Solves min |R y - qtb|² + λ|y|² in pivoted order; also the triangle of the augmented system.
fn damped_solve(qr: &PivotedR, lambda: f64) -> (Vec<f64>, Vec<f64>) {
    let n = qr.n;
    let rows = 2 * n;
    let mut a = vec![0.0; rows * (n + 1)];
    for j in 0..n {
        a[j * rows..=j * rows + j].copy_from_slice(&qr.r[j * n..=j * n + j]);
        a[j * rows + n + j] = lambda.sqrt();
    }
    a[n * rows..n * rows + n].copy_from_slice(&qr.qtb);
    qr_in_place(&mut a, rows, n, n + 1);
    let mut triangle = vec![0.0; n * n];
    for j in 0..n {
        triangle[j * n..=j * n + j].copy_from_slice(&a[j * rows..=j * rows + j]);
    }
    let mut y = a[n * rows..n * rows + n].to_vec();
    if back_substitute(&triangle, n, &mut y).is_none() {
        y.fill(0.0);
    }
    (y, triangle)
}
