//! What is known of the detector from the scan's own calibration readings: its dark counts and its curvature.

use super::USABLE;
use crate::detector::Shot;
use crate::rig::DetectorData;

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
