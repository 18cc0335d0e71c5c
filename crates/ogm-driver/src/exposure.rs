//! Exposure bracketing and the merge of many exposures into one rate, with the noise model of the detector.

use serde::{Deserialize, Serialize};

use crate::detector::Shot;
use crate::error::{Error, Result};
use crate::rig::DetectorData;

/// The exposures a plan may use, all at one f-number.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Exposures {
    /// Exposure times in milliseconds, growing.
    pub ladder_ms: Vec<f64>,
    /// The f-number; exposures are merged only at one.
    pub f_number: f64,
    /// How often the best exposure is taken at each pose.
    pub repeats: u32,
}

impl Default for Exposures {
    fn default() -> Self {
        Exposures {
            ladder_ms: vec![1.0, 4.0, 16.0, 64.0, 256.0, 1024.0, 4096.0],
            f_number: 4.0,
            repeats: 1,
        }
    }
}

/// Above this share of full scale a reading is not used.
pub const USABLE: f64 = 0.9;
/// The bracketing aims at this share of full scale at most.
const AIM: f64 = 0.7;

impl Exposures {
    /// Checks the numbers.
    ///
    /// # Errors
    /// [`Error::Plan`].
    pub fn validate(&self) -> Result<()> {
        let ladder = &self.ladder_ms;
        let good = !ladder.is_empty()
            && ladder.len() <= 32
            && ladder.iter().all(|t| (0.001..=600_000.0).contains(t))
            && ladder.windows(2).all(|w| w[0] < w[1]);
        if !good {
            return Err(Error::Plan(
                "exposure.ladder_ms must be 1 to 32 growing times between 0.001 and 600000 ms."
                    .into(),
            ));
        }
        if !((0.5..=64.0).contains(&self.f_number) && (1..=100).contains(&self.repeats)) {
            return Err(Error::Plan(
                "exposure.f_number must be 0.5..64 and exposure.repeats 1..100.".into(),
            ));
        }
        Ok(())
    }

    /// The rung of the ladder to take next, given the shots taken so far at this pose; `None` when the bracket is complete.
    /// The shortest exposure is taken first: it costs nothing and tells which is the longest that will not saturate.
    pub fn next(&self, shots: &[Shot], detector: &DetectorData) -> Option<usize> {
        let Some(probe) = shots.first() else {
            return Some(0);
        };
        let rung = |t: f64| self.ladder_ms.iter().position(|x| *x == t);
        let usable = |s: &Shot| !s.saturated && s.counts <= USABLE * detector.full_scale;
        if !usable(probe) {
            return None; // even the shortest is too bright: nothing better can be had at this f-number
        }
        // Upper bound of the count rate: the probe's offset counts as light, which only errs to the safe side.
        let sigma = (probe.counts.max(0.0) / detector.electrons_per_count
            + detector.read_noise.powi(2))
        .sqrt();
        let rate = (probe.counts + 3.0 * sigma).max(1.0) / self.ladder_ms[0];
        let mut best = self
            .ladder_ms
            .iter()
            .rposition(|t| rate * t <= AIM * detector.full_scale)
            .unwrap_or(0);
        // A shot that was too bright all the same limits those after it.
        for s in shots.iter().filter(|s| !usable(s)) {
            best = best.min(rung(s.exposure_ms).unwrap_or(0).saturating_sub(1));
        }
        // An improbably high probe is corrected upwards by what a longer, better shot tells.
        if let Some(s) = shots.iter().skip(1).rfind(|s| usable(s)) {
            let here = rung(s.exposure_ms).unwrap_or(0);
            let rate = s.counts.max(1.0) / s.exposure_ms;
            let ceiling = shots
                .iter()
                .filter(|s| !usable(s))
                .filter_map(|s| rung(s.exposure_ms))
                .min()
                .unwrap_or(self.ladder_ms.len());
            let better = self
                .ladder_ms
                .iter()
                .rposition(|t| rate * 1.05 * t <= AIM * detector.full_scale)
                .unwrap_or(0)
                .min(ceiling.saturating_sub(1));
            best = best.max(here).max(better).min(ceiling.saturating_sub(1));
        }
        let taken = shots
            .iter()
            .filter(|s| rung(s.exposure_ms) == Some(best))
            .count() as u32;
        (taken < self.repeats).then_some(best)
    }
}

/// A count rate with its standard error, counts a millisecond.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rate {
    /// Counts a millisecond, dark subtracted.
    pub value: f64,
    /// Standard error.
    pub sigma: f64,
    /// Whether it stands only on shots near the end of the range: a lower bound, not a value.
    pub saturated: bool,
}

/// Dark counts as a function of the exposure.
#[derive(Debug, Clone, Default)]
pub struct Dark {
    /// Exposure in ms, mean counts, standard error of the mean.
    pub steps: Vec<(f64, f64, f64)>,
}

impl Dark {
    /// Mean dark counts of every exposure among `shots`.
    pub fn from_shots<'a>(shots: impl Iterator<Item = &'a Shot>, detector: &DetectorData) -> Self {
        let mut groups: Vec<(f64, Vec<f64>)> = Vec::new();
        for s in shots {
            match groups.iter_mut().find(|g| g.0 == s.exposure_ms) {
                Some(g) => g.1.push(s.counts),
                None => groups.push((s.exposure_ms, vec![s.counts])),
            }
        }
        groups.sort_by(|a, b| a.0.total_cmp(&b.0));
        let steps = groups
            .into_iter()
            .map(|(ms, c)| {
                let n = c.len() as f64;
                let mean = c.iter().sum::<f64>() / n;
                (ms, mean, detector.read_noise.max(0.3) / n.sqrt())
            })
            .collect();
        Dark { steps }
    }

    /// Dark counts and their standard error at an exposure; between measured exposures by straight lines.
    pub fn at(&self, ms: f64) -> (f64, f64) {
        match self.steps.as_slice() {
            [] => (0.0, 0.0),
            [only] => (only.1, only.2),
            steps => {
                let i = steps
                    .partition_point(|s| s.0 < ms)
                    .clamp(1, steps.len() - 1);
                let (a, b) = (steps[i - 1], steps[i]);
                let t = (ms - a.0) / (b.0 - a.0);
                (a.1 + t * (b.1 - a.1), ((1.0 - t) * a.2).hypot(t * b.2))
            }
        }
    }
}

/// The detector's curvature: it reads c (1 - x c / full scale) where c would be right.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Linearity {
    /// x, dimensionless.
    pub x: f64,
    /// Its standard error.
    pub sigma: f64,
}

impl Linearity {
    /// From readings of one constant light at several exposures (dark already subtracted): a weighted straight line of count rate over counts.
    /// With fewer than three points nothing is known and nothing is corrected.
    pub fn from_shots(shots: &[(Shot, f64)], dark: &Dark, detector: &DetectorData) -> Self {
        let points: Vec<(f64, f64, f64)> = shots
            .iter()
            .filter(|(s, _)| !s.saturated && s.counts <= USABLE * detector.full_scale)
            .map(|(s, lamp)| {
                let counts = s.counts - dark.at(s.exposure_ms).0;
                let scale = s.exposure_ms * lamp;
                let noise = counts.max(0.0) / detector.electrons_per_count
                    + detector.read_noise.powi(2)
                    + (counts * detector.reference_noise).powi(2);
                (
                    counts / detector.full_scale,
                    counts / scale,
                    scale * scale / noise.max(1e-9),
                )
            })
            .collect();
        if points.len() < 3 {
            return Linearity::default();
        }
        let w: f64 = points.iter().map(|p| p.2).sum();
        let mean = |g: &dyn Fn(&(f64, f64, f64)) -> f64| {
            points.iter().map(|p| p.2 * g(p)).sum::<f64>() / w
        };
        let (mx, my) = (mean(&|p| p.0), mean(&|p| p.1));
        let sxx = mean(&|p| (p.0 - mx).powi(2));
        if sxx < 1e-4 || my <= 0.0 {
            return Linearity::default();
        }
        let slope = mean(&|p| (p.0 - mx) * (p.1 - my)) / sxx;
        let at_zero = my - slope * mx;
        Linearity {
            x: -slope / at_zero,
            sigma: (1.0 / (w * sxx)).sqrt() / at_zero,
        }
    }

    /// The counts a straight detector would have read.
    pub fn straighten(&self, counts: f64, full_scale: f64) -> f64 {
        // The root of c (1 - x c/F) = counts that is near it.
        let q = 1.0 - 4.0 * self.x * counts / full_scale;
        counts * 2.0 / (1.0 + q.max(0.0).sqrt())
    }
}

/// Merges the exposures of one pose into a rate: each is dark-corrected, straightened, divided by its time and by `lamp(shot)`, and weighted by the
/// inverse of its variance. The variance comes from the merged rate, not from the single noisy count (which would favour low readings), so two rounds
/// are run.
///
/// # Errors
/// [`Error::Merge`] when there is no shot at all.
pub fn merge(
    shots: &[Shot],
    dark: &Dark,
    linearity: Linearity,
    detector: &DetectorData,
    lamp: impl Fn(&Shot) -> f64,
) -> Result<Rate> {
    let full = detector.full_scale;
    let usable = |s: &&Shot| !s.saturated && s.counts <= USABLE * full;
    let saturated = !shots.iter().any(|s| usable(&s));
    let shortest = shots
        .iter()
        .map(|s| s.exposure_ms)
        .fold(f64::INFINITY, f64::min);
    let used: Vec<&Shot> = shots
        .iter()
        .filter(|s| {
            if saturated {
                s.exposure_ms == shortest
            } else {
                usable(s)
            }
        })
        .collect();
    if used.is_empty() {
        return Err(Error::Merge(
            "A reading without a single exposure cannot be merged.".into(),
        ));
    }
    let longest = used.iter().map(|s| s.exposure_ms).fold(0.0, f64::max);
    let rate_of = |s: &Shot| {
        linearity.straighten(s.counts - dark.at(s.exposure_ms).0, full) / s.exposure_ms / lamp(s)
    };
    let best: Vec<f64> = used
        .iter()
        .filter(|s| s.exposure_ms == longest)
        .map(|s| rate_of(s))
        .collect();
    let mut value = best.iter().sum::<f64>() / best.len() as f64;
    let mut sigma = 0.0;
    for _ in 0..2 {
        let (mut top, mut weights, mut dark_part) = (0.0, 0.0, 0.0);
        for s in &used {
            let (dark_counts, dark_sigma) = dark.at(s.exposure_ms);
            let counts = (value * lamp(s) * s.exposure_ms).max(0.0);
            // Shot noise, read noise, the ADC's step (1/12), and the noise of the reference diode.
            let var = (counts + dark_counts.clamp(0.0, counts)) / detector.electrons_per_count
                + detector.read_noise.powi(2)
                + 1.0 / 12.0
                + (counts * detector.reference_noise).powi(2);
            let scale = s.exposure_ms * lamp(s);
            let weight = scale * scale / var;
            top += weight * rate_of(s);
            weights += weight;
            dark_part += weight * dark_sigma / scale;
        }
        value = top / weights;
        // The dark level is shared by all shots of one exposure: its error adds up, it does not average out. So does the curvature's.
        let bent = value * linearity.sigma * value.abs() * longest / full;
        sigma = (1.0 / weights + (dark_part / weights).powi(2) + bent.powi(2)).sqrt();
    }
    Ok(Rate {
        value,
        sigma,
        saturated,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::noise::Noise;

    fn shot(ms: f64, counts: f64, full: f64) -> Shot {
        Shot {
            exposure_ms: ms,
            counts: counts.min(full).round(),
            reference: 0.0,
            saturated: counts >= full,
        }
    }

    #[test]
    fn five_decades_within_one_percent() {
        let (d, e) = (DetectorData::default(), Exposures::default());
        let mut worst = 0.0_f64;
        for k in 0..=50 {
            let rate = 6.0 * 10_f64.powf(f64::from(k) / 10.0); // 6 .. 600 000 counts a millisecond
            let mut noise = Noise::at(&[k as u64]);
            let mut shots = Vec::new();
            while let Some(rung) = e.next(&shots, &d) {
                let ms = e.ladder_ms[rung];
                let light = rate * ms;
                let sigma = (light / d.electrons_per_count + d.read_noise.powi(2)).sqrt();
                shots.push(shot(
                    ms,
                    light + 120.0 + noise.normal() * sigma,
                    d.full_scale,
                ));
                assert!(shots.len() < 12);
            }
            let dark = Dark {
                steps: vec![(1.0, 120.0, 0.0), (4096.0, 120.0, 0.0)],
            };
            let merged = merge(&shots, &dark, Linearity::default(), &d, |_| 1.0).unwrap();
            assert!(!merged.saturated);
            worst = worst.max((merged.value / rate - 1.0).abs());
        }
        assert!(worst < 0.01, "{worst}");
    }

    #[test]
    fn a_saturated_bracket_says_so() {
        let d = DetectorData::default();
        let shots = [shot(1.0, 2e6, d.full_scale)];
        assert_eq!(Exposures::default().next(&shots, &d), None);
        assert!(
            merge(&shots, &Dark::default(), Linearity::default(), &d, |_| 1.0)
                .unwrap()
                .saturated
        );
    }

    #[test]
    fn the_stated_error_is_the_spread() {
        let d = DetectorData {
            reference_noise: 0.0,
            ..DetectorData::default()
        };
        let (d, e) = (
            d,
            Exposures {
                ladder_ms: vec![10.0, 100.0],
                ..Exposures::default()
            },
        );
        let rate = 8.0;
        let dark = Dark {
            steps: vec![(10.0, 0.0, 0.0), (100.0, 0.0, 0.0)],
        };
        let z: Vec<f64> = (0..4000)
            .map(|k| {
                let mut noise = Noise::at(&[k, 9]);
                let shots: Vec<Shot> = e
                    .ladder_ms
                    .iter()
                    .map(|ms| {
                        let c = rate * ms;
                        let c = c + noise.normal()
                            * (c / d.electrons_per_count + d.read_noise.powi(2)).sqrt();
                        Shot {
                            exposure_ms: *ms,
                            counts: c.round(),
                            reference: 0.0,
                            saturated: false,
                        }
                    })
                    .collect();
                let m = merge(&shots, &dark, Linearity::default(), &d, |_| 1.0).unwrap();
                (m.value - rate) / m.sigma
            })
            .collect();
        let mean = z.iter().sum::<f64>() / 4000.0;
        let spread = (z.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 4000.0).sqrt();
        // Standard errors 0.016 and 0.011; four of them.
        assert!(
            mean.abs() < 0.064 && (spread - 1.0).abs() < 0.045,
            "{mean} {spread}"
        );
    }

    #[test]
    fn the_curvature_is_found_and_taken_out() {
        let d = DetectorData::default();
        let mut shots = Vec::new();
        for k in 1..=10 {
            let ms = 0.15 * f64::from(k);
            let c = 600_000.0 * ms;
            let mut noise = Noise::at(&[k as u64, 3]);
            let read = c * (1.0 - 0.005 * c / d.full_scale)
                + noise.normal() * (c / d.electrons_per_count).sqrt();
            shots.push((shot(ms, read, d.full_scale), 1.0));
        }
        let l = Linearity::from_shots(&shots, &Dark::default(), &d);
        assert!(
            (l.x - 0.005).abs() < 4.0 * l.sigma && l.sigma < 0.001,
            "{l:?}"
        );
        for c in [0.0, 1e3, 5e5, 9e5] {
            let exact = Linearity {
                x: 0.005,
                sigma: 0.0,
            };
            assert!(
                (exact.straighten(c * (1.0 - 0.005 * c / 1e6), 1e6) - c).abs() < 1e-6 * c.max(1.0)
            );
        }
    }
}
