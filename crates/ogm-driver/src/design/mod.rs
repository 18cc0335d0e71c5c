//! The next-best measurement: the poses that tell most about a model's parameters, by the Fisher information of the fit so far (D-optimal, greedy).
//!
//! Fedorov 1972: adding a reading with gradient j and variance σ² multiplies the determinant of the information by 1 + jᵀ M⁻¹ j / σ².

use woven_bsdf::fabric::Fabric;
use woven_bsdf::model::{self, Role};

use crate::error::{Error, Result};
use crate::exposure::Exposures;
use crate::pose::Pose;
use crate::rig::DetectorData;

mod reading;

/// A model at the parameters of the fit so far, and the noise of a reading.
pub struct Design {
    model: &'static model::ModelInfo,
    values: Vec<f64>,
    scales: Vec<f64>,
    detector: DetectorData,
    exposures: Exposures,
    beam: f64,
}

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

    /// `count` poses out of `candidates` (the same may come again), each the one that tells most after `known` and those before it: most about all
    /// parameters together, or, with names in `aims`, what lowers the sum of these parameters' squared relative errors most.
    ///
    /// # Errors
    /// [`Error::Plan`] without candidates, or with a name that is no parameter.
    pub fn choose(
        &self,
        candidates: &[Pose],
        known: &[Pose],
        count: usize,
        aims: &[String],
    ) -> Result<Vec<Pose>> {
        if candidates.is_empty() {
            return Err(Error::Plan("There is no pose to choose from.".into()));
        }
        let names = self.names();
        let mut aimed = Vec::new();
        for aim in aims {
            let at = names.iter().position(|n| n == aim).ok_or_else(|| {
                Error::Plan(format!(
                    "The model {} has no parameter {aim:?}; it has {}.",
                    self.model.name,
                    names.join(", ")
                ))
            })?;
            aimed.push(at);
        }
        let rows: Vec<Vec<f64>> = candidates.iter().map(|p| self.row(p)).collect();
        let mut inverse = self.inverse_after(known);
        let mut out = Vec::with_capacity(count);
        for _ in 0..count {
            let gain = |row: &Vec<f64>| {
                let m = times(&inverse, row);
                let information = dot(&m, row);
                if aimed.is_empty() {
                    information
                } else {
                    aimed.iter().map(|&k| m[k] * m[k]).sum::<f64>() / (1.0 + information)
                }
            };
            let gains = rows.iter().map(gain).enumerate();
            let best = gains
                .max_by(|a, b| a.1.total_cmp(&b.1))
                .map_or(0, |(i, _)| i);
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

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Sherman and Morrison 1950: the inverse after one more reading.
fn update(inverse: &mut [f64], j: &[f64]) {
    let n = j.len();
    let m = times(inverse, j);
    let denominator = 1.0 + dot(&m, j);
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

    /// Two planes of 200 poses each, even over the angle.
    fn grid() -> Vec<Pose> {
        let text = "name = 'g'\n[grid]\nkind = 'uniform'\ntheta_l = [0]\nphi_l = [0]\ntheta_v = { from = 100, to = 178, step = 0.78787878 }\nphi_v = [0, 90, 180, -90]";
        crate::plan::Plan::from_toml(text)
            .unwrap()
            .grid
            .poses()
            .unwrap()
    }

    #[test]
    fn half_of_the_readings_give_the_same_intervals_of_the_widths() {
        let (design, grid) = (design(), grid());
        assert_eq!(grid.len(), 400);
        let aims = ["alpha_x".to_string(), "alpha_y".to_string()];
        let all = design.errors(&grid);
        let half = design.errors(&design.choose(&grid, &[], 200, &aims).unwrap());
        let every_other: Vec<Pose> = grid.iter().copied().step_by(2).collect();
        let plain = design.errors(&every_other);
        println!(
            "{:?}: grid {all:?}, 200 chosen {half:?}, every other {plain:?}",
            design.names()
        );
        for aim in &aims {
            let k = design.names().iter().position(|n| n == aim).unwrap();
            assert!(half[k] <= all[k] && all[k] < plain[k], "{aim}");
        }
        assert!(design.choose(&grid, &[], 1, &["alpha_z".into()]).is_err());
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

    #[test]
    fn straight_through_readings_tell_of_the_gap_alone() {
        let fabric = Fabric::from_toml("name = 's'\n[optics]\nmodel = 'sheet'\nparameters = { t_d = 0.25, k_t = 0.2, gamma_warp = 0.6, gamma_weft = 0.5, section = 1.0, alpha_x = 0.3, alpha_y = 0.15 }").unwrap();
        let design = Design::new(
            &fabric,
            &DetectorData::default(),
            &Exposures::default(),
            6e5,
        )
        .unwrap();
        let at = |name: &str| design.names().iter().position(|n| *n == name).unwrap();
        let straight: Vec<Pose> = [
            (0.0, 0.0),
            (20.0, 0.0),
            (40.0, 0.0),
            (20.0, 90.0),
            (40.0, 90.0),
        ]
        .map(|(theta, phi): (f64, f64)| Pose::new(theta, phi, 180.0 - theta, phi - 180.0))
        .to_vec();
        let e = design.errors(&straight);
        assert!(
            e[at("gamma_warp")] < 0.01 && e[at("gamma_weft")] < 0.01,
            "{e:?}"
        );
        assert!(
            e[at("k_t")].is_infinite() && e[at("alpha_x")].is_infinite(),
            "{e:?}"
        );
        // The lobe's width is told by poses that see the lobe, and with the gap well known by them alone; never by one where the aperture cuts the beam.
        let cut = Pose::new(0.0, 0.0, 179.5, 0.0);
        let lobe: Vec<Pose> = (1..20)
            .map(|k| Pose::new(0.0, 0.0, 180.0 - 4.0 * f64::from(k), 0.0))
            .collect();
        let all: Vec<Pose> = straight
            .iter()
            .chain([&cut])
            .chain(&lobe)
            .copied()
            .collect();
        let choose = |known: &[Pose]| design.choose(&all, known, 12, &["alpha_x".into()]).unwrap();
        let (first, later) = (choose(&[]), choose(&straight.repeat(10_000)));
        assert!(!first.contains(&cut) && first.iter().any(|p| lobe.contains(p)));
        assert!(later.iter().all(|p| lobe.contains(p)), "{later:?}");
    }
}
