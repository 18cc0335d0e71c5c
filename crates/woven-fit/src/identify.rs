//! What a scan can see of the parameters as a paper prints them.
//!
//! The paper writes HGF with (k_d, k_s, g_d, g_s, τ, ρ) and its microfacet model with (r, n, k_t, τ, ρ). In both the yarn's
//! density ρ and optical depth τ only appear as ρ e^-τ times a k, so one scan cannot tell them apart. The fits here use what
//! is seen; this module goes back to the printed parameters and says what is lost.

use crate::fit::ModelFit;
use crate::measurement::Points;
use crate::problem::{Evaluator, Joint, Metric};
use crate::solve::Residuals;
use crate::uncertainty::{Uncertainty, uncertainty};
use serde::Serialize;

/// The rank of a fit in the paper's own parameters.
#[derive(Clone, Debug, Serialize)]
pub struct Printed {
    /// The parameters as printed.
    pub names: Vec<&'static str>,
    /// Values used: ρ and τ at one place out of infinitely many that fit as well.
    pub values: Vec<f64>,
    /// What the data see of them.
    pub uncertainty: Uncertainty,
}

impl Printed {
    /// One line for a report.
    pub fn to_text(&self) -> String {
        let u = &self.uncertainty;
        let mut lines = vec![format!(
            "as printed, ({}): rank {} of {}",
            self.names.join(", "),
            u.rank,
            u.free
        )];
        lines.extend(u.invisible.iter().chain(&u.entangled).cloned());
        lines.join("; ")
    }
}

/// The fit of `hgf` or `ggx-walter` in the paper's parameters; none for other models.
pub fn printed(fit: &ModelFit, points: &Points) -> Option<Printed> {
    // Any yarn density and depth do; those of a usual curtain.
    const RHO: f64 = 0.8;
    const TAU: f64 = 0.5;
    let spec = fit.spec.as_ref().filter(|s| !s.gap)?;
    let (k, x) = &fit.state;
    let (m, n) = (points.points.len(), k.len() + x.len());
    let mut joint = Joint::new(
        Evaluator { spec, points },
        vec![1.0; m],
        Metric::Linear,
        0.0,
    );
    let both: Vec<f64> = k.iter().chain(x).copied().collect();
    let (mut r, mut jac) = (vec![0.0; m], vec![0.0; m * n]);
    if !joint.evaluate(&both, &mut r, Some(&mut jac)) {
        return None;
    }
    let seen = RHO * (-TAU).exp();
    let names = spec.names();
    // ∂r/∂name in natural units; zeros for a parameter that this fit does not have.
    let column = |name: &str| -> Vec<f64> {
        let Some(j) = names.iter().position(|n| *n == name) else {
            return vec![0.0; m];
        };
        let log = j >= k.len() && spec.coordinates[j - k.len()].log;
        let scale = if log { 1.0 / both[j].exp() } else { 1.0 };
        jac[j * m..(j + 1) * m].iter().map(|v| v * scale).collect()
    };
    let value = |name: &str| {
        fit.parameters
            .iter()
            .find(|p| p.name == name)
            .map_or(0.0, |p| p.value)
    };
    // Column of a printed factor: ρ e^-τ times that of what is seen.
    let times = |c: Vec<f64>, s: f64| -> Vec<f64> { c.into_iter().map(|v| v * s).collect() };
    let sum = |a: Vec<f64>, b: Vec<f64>| -> Vec<f64> {
        a.into_iter().zip(b).map(|(a, b)| a + b).collect()
    };
    let (printed_names, values, columns): (Vec<&'static str>, Vec<f64>, Vec<Vec<f64>>) =
        match spec.model.name {
            "hgf" => {
                let lobes = sum(
                    times(column("a_d"), value("a_d")),
                    times(column("a_s"), value("a_s")),
                );
                (
                    vec!["k_d", "k_s", "g_d", "g_s", "tau", "rho"],
                    vec![
                        value("a_d") / seen,
                        value("a_s") / seen,
                        value("g_d"),
                        value("g_s"),
                        TAU,
                        RHO,
                    ],
                    vec![
                        times(column("a_d"), seen),
                        times(column("a_s"), seen),
                        column("g_d"),
                        column("g_s"),
                        times(lobes.clone(), -1.0),
                        times(lobes, 1.0 / RHO),
                    ],
                )
            }
            "ggx-walter" | "paper" => {
                let lobe = times(column("k_t"), value("k_t"));
                (
                    vec!["r", "n", "k_t", "tau", "rho"],
                    vec![value("alpha"), value("n"), value("k_t") / seen, TAU, RHO],
                    vec![
                        column("alpha"),
                        column("n"),
                        times(column("k_t"), seen),
                        times(lobe.clone(), -1.0),
                        times(lobe, 1.0 / RHO),
                    ],
                )
            }
            _ => return None,
        };
    let held = vec![false; printed_names.len()];
    let sse = r.iter().map(|r| r * r).sum();
    let u = uncertainty(
        &columns.concat(),
        m,
        &printed_names,
        &values,
        &held,
        sse,
        true,
    );
    Some(Printed {
        names: printed_names,
        values,
        uncertainty: u,
    })
}
