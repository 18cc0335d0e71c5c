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

mod descend;
mod state;
mod trust;

use state::State;

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
