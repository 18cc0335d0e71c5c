//! One model against one set of points: residuals with exact slopes, linear factors separated.
//!
//! Every model is f = Σ_j k_j basis_j(shape), so for a given shape the best factors k ≥ 0 follow from a small
//! non-negative linear problem, and the solver only sees the shape: variable projection (Golub and Pereyra 1973, with
//! their full derivative, not Kaufman's short cut). A gap adds openness(shape) in the straight-through patches with
//! the fixed factor 1. In a metric that bends the values (log, cube root) nothing is linear any more; [`Joint`] then
//! fits factors and shape together.

mod evaluate;
mod residuals;
mod spec;

pub use evaluate::{Evaluator, Table};
pub use residuals::{Joint, Separable};
pub use spec::{Coordinate, GAP, Place, Spec};

use serde::{Deserialize, Serialize};

/// In which measure misfits are squared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Metric {
    /// The values themselves, as in the paper's table 2.
    #[default]
    Linear,
    /// Their logarithms: the tail counts as much as the peak (Löw et al. 2012).
    Log,
    /// Their cube roots (Fores, Ferwerda and Gu 2012).
    Cbrt,
}

impl Metric {
    /// The transformed value and its slope; `floor` keeps logarithms finite.
    pub fn apply(self, f: f64, floor: f64) -> (f64, f64) {
        match self {
            Metric::Linear => (f, 1.0),
            Metric::Log => {
                let t = f.max(0.0) + floor;
                (t.ln(), 1.0 / t)
            }
            Metric::Cbrt => {
                let t = f.max(0.0) + floor;
                (t.cbrt(), 1.0 / (3.0 * t.cbrt().powi(2)))
            }
        }
    }

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Metric::Linear => "linear",
            Metric::Log => "log",
            Metric::Cbrt => "cbrt",
        }
    }
}
