//! The next-best measurement: the poses that tell most about a model's parameters, by the Fisher information of the fit so far (D-optimal, greedy).
//!
//! Fedorov 1972: adding a reading with gradient j and variance σ² multiplies the determinant of the information by 1 + jᵀ M⁻¹ j / σ².

use woven_bsdf::fabric::Fabric;
use woven_bsdf::model::{self, Role};
use woven_bsdf::vec3::Vec3;

use crate::error::{Error, Result};
use crate::exposure::Exposures;
use crate::pose::Pose;
use crate::rig::DetectorData;

/// A model at the parameters of the fit so far, and the noise of a reading.
pub struct Design {
    model: &'static model::ModelInfo,
    values: Vec<f64>,
    scales: Vec<f64>,
    detector: DetectorData,
    exposures: Exposures,
    beam: f64,
}

/// Relative error of a reading that no exposure takes away: lamp, angles, linearity.
const FLOOR: f64 = 0.002;

impl Design {
    /// Around the optics of a fabric file; `beam` is the count rate of the direct beam, counts a millisecond.
    ///
    /// # Errors
    /// [`Error::Plan`] when the fabric has no sound optics or the rate is not positive.
    pub fn new(
        fabric: &Fabric,
        detector: &DetectorData,
        exposures: &Exposures,
        beam: f64,
    ) -> Result<Self> {
        fabric.optics().map_err(|e| {
            Error::Plan(format!(
                "The fabric {:?} cannot guide a plan: {e}.",
                fabric.name
            ))
        })?;
        let model = model::find(&fabric.optics.model)
            .ok_or_else(|| Error::Plan(format!("There is no model {:?}.", fabric.optics.model)))?;
        if !(beam.is_finite() && beam > 0.0) {
            return Err(Error::Plan(
                "The direct beam's count rate must be positive.".into(),
            ));
        }
        let start = |p: &model::Param| if p.role == Role::Linear { 0.0 } else { p.start };
        let values: Vec<f64> = model
            .params
            .iter()
            .map(|p| {
                fabric
                    .optics
                    .parameters
                    .get(p.name)
                    .copied()
                    .unwrap_or(start(p))
            })
            .collect();
        let scales = values.iter().map(|v| v.abs().max(1e-2)).collect();
        Ok(Design {
            model,
            values,
            scales,
            detector: detector.clone(),
            exposures: exposures.clone(),
            beam,
        })
    }

    /// Names of the parameters, in the order of [`Design::errors`].
    pub fn names(&self) -> Vec<&'static str> {
        self.model.params.iter().map(|p| p.name).collect()
    }

    fn f(&self, values: &[f64], pose: &Pose) -> f64 {
        let vec = |d: [f64; 3]| Vec3::new(d[0], d[1], d[2]);
        self.model.eval(values, vec(pose.light()), vec(pose.view()))
    }

    /// Standard error of one reading of f at a pose, 1/sr: shot and read noise at the longest exposure that fits, and the floor.
    fn sigma(&self, pose: &Pose, f: f64) -> f64 {
        let d = &self.detector;
        let per_ms = self.beam * d.solid_angle() * pose.view()[2].abs().max(1e-3);
        let fits = |t: &f64| per_ms * f.max(0.0) * t <= 0.7 * d.full_scale;
        let t = self
            .exposures
            .ladder_ms
            .iter()
            .copied()
            .rfind(fits)
            .unwrap_or(self.exposures.ladder_ms[0]);
        let noise = (per_ms * f.max(0.0) * t / d.electrons_per_count + d.read_noise.powi(2)).sqrt();
        (noise / (per_ms * t)).hypot(FLOOR * f)
    }

    /// Gradient of f over the scaled parameters, divided by the reading's standard error.
    fn row(&self, pose: &Pose) -> Vec<f64> {
        let f = self.f(&self.values, pose);
        let sigma = self.sigma(pose, f);
        (0..self.values.len())
            .map(|k| {
                // Central difference; 1e-5 of the scale balances rounding and curvature.
                let h = 1e-5 * self.scales[k];
                let at = |sign: f64| {
                    let mut v = self.values.clone();
                    v[k] += sign * h;
                    self.f(&v, pose)
                };
                let slope = (at(1.0) - at(-1.0)) / (2.0 * h) * self.scales[k] / sigma;
                if slope.is_finite() { slope } else { 0.0 }
            })
            .collect()
    }

    /// Standard errors of the parameters after readings at `poses`; infinite for what they cannot see.
    pub fn errors(&self, poses: &[Pose]) -> Vec<f64> {
        let inverse = self.inverse_after(poses);
        let n = self.values.len();
        (0..n)
            .map(|k| {
                let variance = inverse[k * n + k];
                // The prior of variance 1e6 is left standing where nothing was learned.
                if variance > 1e5 {
                    f64::INFINITY
                } else {
                    variance.max(0.0).sqrt() * self.scales[k]
                }
            })
            .collect()
    }

    fn inverse_after(&self, poses: &[Pose]) -> Vec<f64> {
        let n = self.values.len();
        let mut inverse = vec![0.0; n * n];
        for k in 0..n {
            inverse[k * n + k] = 1e6;
        }
        for pose in poses {
            update(&mut inverse, &self.row(pose));
        }
        inverse
    }

    /// `count` poses out of `candidates` (the same may come again), each the one that tells most after `known` and those before it.
    ///
    /// # Errors
    /// [`Error::Plan`] without candidates.
    pub fn choose(&self, candidates: &[Pose], known: &[Pose], count: usize) -> Result<Vec<Pose>> {
        if candidates.is_empty() {
            return Err(Error::Plan("There is no pose to choose from.".into()));
        }
        let rows: Vec<Vec<f64>> = candidates.iter().map(|p| self.row(p)).collect();
        let mut inverse = self.inverse_after(known);
        let mut out = Vec::with_capacity(count);
        for _ in 0..count {
            let gain = |i: &usize| quadratic(&inverse, &rows[*i]);
            let best = (0..rows.len())
                .max_by(|a, b| gain(a).total_cmp(&gain(b)))
                .unwrap_or(0);
            update(&mut inverse, &rows[best]);
            out.push(candidates[best]);
        }
        Ok(out)
    }
}

fn times(inverse: &[f64], j: &[f64]) -> Vec<f64> {
    inverse
        .chunks(j.len())
        .map(|row| row.iter().zip(j).map(|(a, b)| a * b).sum())
        .collect()
}

fn quadratic(inverse: &[f64], j: &[f64]) -> f64 {
    times(inverse, j).iter().zip(j).map(|(a, b)| a * b).sum()
}

/// Sherman and Morrison 1950: the inverse after one more reading.
fn update(inverse: &mut [f64], j: &[f64]) {
    let n = j.len();
    let m = times(inverse, j);
    let denominator = 1.0 + m.iter().zip(j).map(|(a, b)| a * b).sum::<f64>();
    for a in 0..n {
        for b in 0..n {
            inverse[a * n + b] -= m[a] * m[b] / denominator;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn design() -> Design {
        let fabric = Fabric::from_toml("name = 'g'\n[optics]\nmodel = 'ggx-mirrored'\nparameters = { k_d = 0.2, k_t = 0.3, alpha_x = 0.06, alpha_y = 0.1 }").unwrap();
        Design::new(
            &fabric,
            &DetectorData::default(),
            &Exposures::default(),
            6e5,
        )
        .unwrap()
    }

    #[test]
    fn the_stated_errors_are_those_of_a_linear_fit() {
        // Two parameters that enter linearly, read at two poses: the errors follow from solving two equations.
        let fabric = Fabric::from_toml(
            "name = 'l'\n[optics]\nmodel = 'lambert'\nparameters = { k_d = 0.3 }",
        )
        .unwrap();
        let d = Design::new(
            &fabric,
            &DetectorData::default(),
            &Exposures::default(),
            6e5,
        )
        .unwrap();
        let pose = Pose::new(0.0, 0.0, 150.0, 0.0);
        let sigma = d.sigma(&pose, 0.3 / std::f64::consts::PI);
        // f = k_d/π, so n readings give π σ/√n.
        let expected = std::f64::consts::PI * sigma / 3.0;
        assert!((d.errors(&[pose; 9])[0] / expected - 1.0).abs() < 1e-3);
    }

    #[test]
    fn what_cannot_be_seen_has_no_error_bar() {
        // One plane along x at normal incidence says nothing of alpha_y.
        let line: Vec<Pose> = (0..50)
            .map(|k| Pose::new(0.0, 0.0, 178.0 - f64::from(k), 0.0))
            .collect();
        let d = design();
        let at = |name: &str| d.names().iter().position(|n| *n == name).unwrap();
        let e = d.errors(&line);
        assert!(
            e[at("alpha_x")].is_finite() && e[at("alpha_y")] > 10.0 * e[at("alpha_x")],
            "{e:?}"
        );
    }
}
