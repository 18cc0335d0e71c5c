//! The plan of one measurement: which poses, which exposures, which calibration, in which order, and what it costs in time.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::exposure::Exposures;
use crate::pose::Pose;

mod angles;
mod grid;
mod route;

pub use crate::adaptive::Adaptive;
pub use angles::Angles;
pub(crate) use angles::zero;
pub use grid::{Grid, MOST_POSES, PaperCamera};
pub use route::Route;

/// A plan file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// Name for the log and the measurement.
    pub name: String,
    /// The sample, in the operator's words.
    #[serde(default)]
    pub sample: String,
    /// Who measures.
    #[serde(default)]
    pub operator: String,
    /// Where the detector goes.
    pub grid: Grid,
    /// What to do with poses outside the limits or in the zone of the arms.
    #[serde(default)]
    pub forbidden: Forbidden,
    /// The order of the poses.
    #[serde(default)]
    pub order: Order,
    /// Adds the straight-through pose of every incidence.
    #[serde(default = "yes")]
    pub straight_through: bool,
    /// Exposure ladder.
    #[serde(default)]
    pub exposure: Exposures,
    /// Calibration readings.
    #[serde(default)]
    pub calibration: Calibration,
}

fn yes() -> bool {
    true
}

/// What happens with a pose that the rig must not take.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Forbidden {
    /// The whole plan is refused.
    #[default]
    Refuse,
    /// The pose is left out, and the number of those left out is told. It is never replaced by a nearby one.
    LeaveOut,
}

/// The order of the poses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// From each pose to the one reached soonest, the light arm moving last.
    #[default]
    Travel,
    /// As the grid lists them.
    AsGiven,
}

/// Calibration readings of a scan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Calibration {
    /// The scan begins when the lamp has been on this long, minutes.
    pub warm_up_min: f64,
    /// Dark readings at every exposure, this many each.
    pub dark: u32,
    /// Direct-beam readings without the sample, this many.
    pub direct: u32,
    /// Brackets of the direct beam from a tenth of full scale to the end, which tell the detector's curvature; this many.
    pub linearity: u32,
    /// Measure the white standard.
    pub white: bool,
    /// A reference reading after this many poses; 0 = only at the start.
    pub reference_every: u32,
    /// What corrects the drift of the lamp.
    pub drift: Drift,
    /// After a resume the reference must agree with the first within this share.
    pub resume_tolerance: f64,
}

/// How the drift of the lamp is taken out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Drift {
    /// By the diode that watches the lamp during every reading.
    #[default]
    Diode,
    /// By straight lines in time between reference readings.
    Reference,
    /// Not at all.
    None,
}

impl Default for Calibration {
    fn default() -> Self {
        Calibration {
            warm_up_min: 30.0,
            dark: 4,
            direct: 4,
            linearity: 2,
            white: true,
            reference_every: 50,
            drift: Drift::Diode,
            resume_tolerance: 0.03,
        }
    }
}

/// A sentence about a plan that cannot be used.
pub(crate) fn refused(what: impl std::fmt::Display) -> Error {
    Error::Plan(format!("The plan cannot be used: {what}."))
}

/// The product of lengths, refused before anything of that size is made when no scan can hold it.
pub(crate) fn product(lengths: impl IntoIterator<Item = usize>) -> Result<usize> {
    let product = lengths
        .into_iter()
        .try_fold(1_usize, usize::checked_mul)
        .filter(|n| *n <= MOST_POSES);
    product.ok_or_else(|| refused(format!("the grid has more than {MOST_POSES} poses")))
}

impl Plan {
    /// Reads and checks a plan from TOML text.
    ///
    /// # Errors
    /// [`Error::Plan`] with the place in the file.
    pub fn from_toml(text: &str) -> Result<Self> {
        let plan: Plan = toml::from_str(text)
            .map_err(|e| refused(e.to_string().trim().trim_end_matches('.')))?;
        plan.validate()?;
        Ok(plan)
    }

    /// Reads and checks a plan file.
    ///
    /// # Errors
    /// [`Error::Io`] or [`Error::Plan`].
    pub fn load(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|e| Error::io("read", path, e))?;
        Self::from_toml(&text)
    }

    /// Checks every number that does not depend on the rig.
    ///
    /// # Errors
    /// [`Error::Plan`].
    pub fn validate(&self) -> Result<()> {
        self.exposure.validate()?;
        let c = &self.calibration;
        if !((0.0..=1440.0).contains(&c.warm_up_min) && (0.0..=1.0).contains(&c.resume_tolerance)) {
            return Err(refused(
                "calibration.warm_up_min must be 0..1440 and calibration.resume_tolerance 0..1",
            ));
        }
        if c.direct == 0 || c.direct > 100 || c.dark > 100 || c.linearity > 100 {
            return Err(refused(
                "calibration.direct must be 1..100, calibration.dark and calibration.linearity 0..100; without the direct beam there is no scale",
            ));
        }
        if c.drift == Drift::Reference && c.reference_every == 0 {
            return Err(refused(
                "calibration.drift = \"reference\" needs calibration.reference_every",
            ));
        }
        Ok(())
    }

    /// The reference pose: normal incidence, straight through, without the sample.
    pub const REFERENCE: Pose = Pose::new(0.0, 0.0, 180.0, 0.0);
    /// The pose of the white standard: normal incidence, seen at 45° from the lamp's side.
    pub const WHITE: Pose = Pose::new(0.0, 0.0, 45.0, 0.0);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::Rig;

    #[test]
    fn the_plans_beside_this_crate_can_be_run() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("plans");
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let route = Plan::load(&path).and_then(|p| p.route(&Rig::default()));
            assert!(
                route.is_ok_and(|r| r.poses.len() > 50 && r.left_out == 0),
                "{}",
                path.display()
            );
        }
    }

    #[test]
    fn bad_plans_are_sentences() {
        for text in [
            "",
            "name = 'x'",
            "name = 'x'\n[grid]\nkind = 'spiral'",
            "name = 'x'\n[grid]\nkind = 'list'\nposes = []",
            "name = 'x'\n[grid]\nkind = 'list'\nposes = [[0, 0, nan, 0]]",
            "name = 'x'\n[grid]\nkind = 'klems'\ntheta_l = { from = 0, to = 1, step = 0 }",
            "name = 'x'\n[grid]\nkind = 'random'\ncount = 4000000000\nseed = 1",
            "name = 'x'\ncolour = 1\n[grid]\nkind = 'klems'\ntheta_l = [0]",
            "name = 'x'\n[grid]\nkind = 'klems'\ntheta_l = [0]\n[exposure]\nladder_ms = [4, 2]",
            "name = 'x'\n[grid]\nkind = 'klems'\ntheta_l = [0]\n[calibration]\ndirect = 0",
        ] {
            let e = Plan::from_toml(text)
                .and_then(|p| p.route(&Rig::default()))
                .unwrap_err()
                .to_string();
            assert!(e.ends_with('.') && e.len() > 30, "{e}");
        }
    }
}
