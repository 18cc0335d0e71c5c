//! Detectors: one trait; a photodiode head on the controller's line, and any camera behind a command of the lab's own.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::rig::Rig;
use crate::transport::Link;

mod external;
mod photodiode;

pub use external::ExternalDetector;
pub use photodiode::SerialPhotodiode;

/// One exposure as it came from the detector, and as it stands in the log.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Shot {
    /// Exposure, milliseconds.
    #[serde(rename = "ms")]
    pub exposure_ms: f64,
    /// Raw counts.
    pub counts: f64,
    /// Raw counts of the reference diode; 0 when there is none.
    #[serde(rename = "ref")]
    pub reference: f64,
    /// At the end of its range.
    #[serde(rename = "sat")]
    pub saturated: bool,
}

/// One exposure asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exposure {
    /// Names the exposure and comes back with it, so that a late answer is never taken for the right one.
    pub tag: u64,
    /// Exposure time, milliseconds.
    pub ms: f64,
    /// The f-number.
    pub f_number: f64,
}

impl Exposure {
    /// Deadline of its answer: the rig's own, and the exposure with a tenth of grace.
    pub fn deadline(&self, rig: &Rig) -> Duration {
        rig.reply() + Duration::from_secs_f64(self.ms / 1000.0 * 1.1)
    }

    /// Its outcome.
    pub fn shot(&self, counts: f64, reference: f64, saturated: bool) -> Shot {
        Shot {
            exposure_ms: self.ms,
            counts,
            reference,
            saturated,
        }
    }
}

/// Takes exposures. A detector on the rig's own line uses the link it is lent; others ignore it except for the stop.
pub trait Detector: Send {
    /// Name and serial number.
    ///
    /// # Errors
    /// No or no sensible reply.
    fn identify(&mut self, link: &mut Link, rig: &Rig) -> Result<String>;
    /// Seconds the lamp has been on, if the detector knows; 0 when it is off.
    ///
    /// # Errors
    /// No or no sensible reply.
    fn lamp_seconds(&mut self, link: &mut Link, rig: &Rig) -> Result<Option<f64>>;
    /// Takes an exposure. It moves nothing and may be repeated.
    ///
    /// # Errors
    /// No or no sensible reply.
    fn expose(&mut self, link: &mut Link, rig: &Rig, exposure: &Exposure) -> Result<Shot>;
}
