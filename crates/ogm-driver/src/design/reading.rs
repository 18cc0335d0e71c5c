//! What one reading tells: its slope over the parameters in units of its standard error.

use woven_bsdf::model::Model;
use woven_bsdf::sheet::Sheet;
use woven_bsdf::vec3::Vec3;

use super::Design;
use crate::pose::Pose;
use crate::rig::Sight;

impl Design {
    fn f(&self, values: &[f64], l: [f64; 3], v: [f64; 3]) -> f64 {
        let vec = |d: [f64; 3]| Vec3::new(d[0], d[1], d[2]);
        self.model.eval(values, vec(l), vec(v))
    }

    /// What is its own of the standard error of one reading of f at a pose, 1/sr: what all readings share (scale, offsets of the axes) the fit takes apart,
    /// and it averages over the aperture itself.
    pub(super) fn sigma(&self, pose: &Pose, f: f64) -> f64 {
        self.noise(
            f,
            self.detector.solid_angle() * pose.view()[2].abs().max(1e-3),
        )
    }

    /// Standard error of `value`, of which a share `seen` times the direct beam reaches the detector: shot and read noise at the longest exposure that
    /// fits, and the noise of the reference diode.
    fn noise(&self, value: f64, seen: f64) -> f64 {
        let (d, per_ms) = (&self.detector, self.beam * seen);
        let rate = per_ms * value.max(0.0);
        let ladder = &self.exposures.ladder_ms;
        let fits = |t: &f64| rate * t <= 0.7 * d.full_scale;
        let t = ladder.iter().copied().rfind(fits).unwrap_or(ladder[0]);
        let noise = (rate * t / d.electrons_per_count + d.read_noise.powi(2)).sqrt();
        (d.reference_noise * value).hypot(noise / (per_ms * t))
    }

    /// Share of the beam that goes straight through: only the sheet has gaps.
    fn straight(&self, values: &[f64], l: [f64; 3]) -> f64 {
        if self.model.name == Sheet::NAME {
            let (_, shape) = self.model.split(values);
            Sheet::gap(&shape, Vec3::new(l[0], l[1], l[2]))
        } else {
            0.0
        }
    }

    /// Gradient of a reading over the scaled parameters, divided by its standard error: of f, or of the transmittance where the whole beam falls into
    /// the aperture; nothing where the beam is cut.
    pub(super) fn row(&self, pose: &Pose) -> Vec<f64> {
        let (l, v) = (pose.light(), pose.view());
        let read = |values: &[f64], sight| match sight {
            Sight::Scattered => self.f(values, l, v),
            Sight::Straight => self.straight(values, l),
            Sight::Cut => 0.0,
        };
        let sight = self.detector.sight(pose.from_straight());
        let here = read(&self.values, sight);
        let sigma = match sight {
            Sight::Scattered => self.sigma(pose, here),
            Sight::Straight | Sight::Cut => self.noise(here, 1.0),
        };
        (0..self.values.len())
            .map(|k| {
                // Central difference; 1e-5 of the scale balances rounding and curvature.
                let h = 1e-5 * self.scales[k];
                let at = |sign: f64| {
                    let mut values = self.values.clone();
                    values[k] += sign * h;
                    read(&values, sight)
                };
                let slope = (at(1.0) - at(-1.0)) / (2.0 * h) * self.scales[k] / sigma;
                if slope.is_finite() { slope } else { 0.0 }
            })
            .collect()
    }
}
