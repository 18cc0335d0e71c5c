//! Many exposures of one pose merged into one count rate with its standard error.

use super::{Dark, Linearity, USABLE};
use crate::detector::Shot;
use crate::error::{Error, Result};
use crate::rig::DetectorData;

/// A count rate with its standard error, counts a millisecond.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rate {
    /// Counts a millisecond, dark subtracted.
    pub value: f64,
    /// Standard error, of everything below.
    pub sigma: f64,
    /// The part of it that is this reading's own: light, electronics, ADC, reference diode.
    pub noise: f64,
    /// The part of the dark level, which all readings of the same exposures share.
    pub dark: f64,
    /// How deep in the detector's range it was read, 0..1 of full scale: times the curvature's error this is a relative error that all readings share.
    pub depth: f64,
    /// Whether it stands only on shots near the end of the range: a lower bound, not a value.
    pub saturated: bool,
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
    let (mut noise, mut dark_level, mut depth) = (0.0, 0.0, 0.0);
    for _ in 0..2 {
        let (mut top, mut weights, mut dark_part, mut deep) = (0.0, 0.0, 0.0, 0.0);
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
            deep += weight * counts / full;
        }
        value = top / weights;
        // The dark level is shared by all shots of one exposure: its error adds up, it does not average out. So does the curvature's.
        (noise, dark_level, depth) = (weights.sqrt().recip(), dark_part / weights, deep / weights);
    }
    Ok(Rate {
        value,
        sigma: noise
            .hypot(dark_level)
            .hypot(value * linearity.sigma * depth),
        noise,
        dark: dark_level,
        depth,
        saturated,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exposure::Exposures;
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
