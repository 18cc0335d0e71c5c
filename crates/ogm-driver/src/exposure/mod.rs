//! Exposure bracketing and the merge of many exposures into one rate, with the noise model of the detector.

use serde::{Deserialize, Serialize};

use crate::detector::Shot;
use crate::error::{Error, Result};
use crate::rig::DetectorData;

mod calibration;
mod hdr;

pub use calibration::{Dark, Linearity};
pub use hdr::{Rate, merge};

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
