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
use crate::sim::optics::crossways;

/// A model at the parameters of the fit so far, and the noise of a reading.
pub struct Design {
    model: &'static model::ModelInfo,
    values: Vec<f64>,
    scales: Vec<f64>,
    detector: DetectorData,
    exposures: Exposures,
    beam: f64,
}

/// Relative error of a reading that no exposure takes away, beside what the rig file states: what repeats of one pose differ by on a good day.
const FLOOR: f64 = 5e-4;
/// Step for slopes over directions, radians.
const TILT: f64 = 2e-3;

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

    fn f(&self, values: &[f64], l: [f64; 3], v: [f64; 3]) -> f64 {
        let vec = |d: [f64; 3]| Vec3::new(d[0], d[1], d[2]);
        self.model.eval(values, vec(l), vec(v))
    }

    /// Standard error of one reading of f at a pose, 1/sr, as the merge states it: shot and read noise at the longest exposure that fits, the floor,
    /// the angles' error times the slope, and the aperture's blur.
    fn sigma(&self, pose: &Pose, f: f64) -> f64 {
        let d = &self.detector;
        let per_ms = self.beam * d.solid_angle() * pose.view()[2].abs().max(1e-3);
        let fits = |t: &f64| per_ms * f.max(0.0) * t <= 0.7 * d.full_scale;
        let ladder = &self.exposures.ladder_ms;
        let t = ladder.iter().copied().rfind(fits).unwrap_or(ladder[0]);
        let noise = (per_ms * f.max(0.0) * t / d.electrons_per_count + d.read_noise.powi(2)).sqrt();
        let floor = FLOOR.hypot(d.reference_noise).hypot(d.linearity) * f;
        let (slope, curvature) = self.shape(pose, f);
        let radius = (d.aperture_deg / 2.0).to_radians();
        let angle = d.angle_deg.to_radians() * std::f64::consts::SQRT_2;
        [floor, slope * angle, radius * radius / 8.0 * curvature]
            .into_iter()
            .fold(noise / (per_ms * t), f64::hypot)
    }

    /// Magnitudes of the slope of f over the view direction (per radian) and of its Laplacian (per square radian).
    fn shape(&self, pose: &Pose, f: f64) -> (f64, f64) {
        let (l, v) = (pose.light(), pose.view());
        let (x, y) = crossways(v);
        let tilted = |t: [f64; 3], angle: f64| {
            let (s, c) = angle.sin_cos();
            self.f(&self.values, l, [0, 1, 2].map(|i| c * v[i] + s * t[i]))
        };
        let [east, west, north, south] =
            [(x, TILT), (x, -TILT), (y, TILT), (y, -TILT)].map(|(t, angle)| tilted(t, angle));
        let slope = (east - west).hypot(north - south) / (2.0 * TILT);
        let laplacian = (east + west + north + south - 4.0 * f) / (TILT * TILT);
        let known = |x: f64| if x.is_finite() { x.abs() } else { 0.0 };
        (known(slope), known(laplacian))
    }

    /// Gradient of f over the scaled parameters, divided by the reading's standard error.
    fn row(&self, pose: &Pose) -> Vec<f64> {
        let (l, v) = (pose.light(), pose.view());
        let f = self.f(&self.values, l, v);
        let sigma = self.sigma(pose, f);
        (0..self.values.len())
            .map(|k| {
                // Central difference; 1e-5 of the scale balances rounding and curvature.
                let h = 1e-5 * self.scales[k];
                let at = |sign: f64| {
                    let mut values = self.values.clone();
                    values[k] += sign * h;
                    self.f(&values, l, v)
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
}
