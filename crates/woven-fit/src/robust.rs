//! Losses that let an outlier count less: Huber and Cauchy, with the scale from the median absolute deviation.

use serde::{Deserialize, Serialize};

/// How a misfit counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Loss {
    /// By its square.
    #[default]
    Squares,
    /// By its square up to 1.345 standard deviations, linearly beyond (95 % efficient on normal noise).
    Huber,
    /// By log(1 + (r/2.385 s)²): far outliers hardly count (95 % efficient on normal noise).
    Cauchy,
}

impl Loss {
    /// Multiplies square roots of weights so that weighted squares have the loss's gradient.
    pub fn reweight(self, weights: &mut [f64], misfit: &[f64]) {
        if self == Loss::Squares {
            return;
        }
        let weighted: Vec<f64> = weights
            .iter()
            .zip(misfit)
            .map(|(w, r)| (w * r).abs())
            .collect();
        let mut sorted = weighted.clone();
        sorted.sort_by(f64::total_cmp);
        // The median of |r| of a normal distribution is 0.6745 standard deviations.
        let scale = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0) / 0.6745;
        if scale == 0.0 {
            return;
        }
        for (w, r) in weights.iter_mut().zip(weighted) {
            let t = r / scale;
            *w *= match self {
                Loss::Squares => 1.0,
                Loss::Huber => (1.345 / t.max(1.345)).sqrt(),
                Loss::Cauchy => (1.0 / (1.0 + (t / 2.385).powi(2))).sqrt(),
            };
        }
    }
}
