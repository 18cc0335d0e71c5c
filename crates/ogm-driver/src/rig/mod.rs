//! The rig file: which controller, which axes with which limits, which detector, which outputs.

use std::path::Path;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::axis::Axis;
use crate::error::{Error, Result};
use crate::pose::{AXES, Pose, safe_way};
use crate::protocol::shot;

mod parts;

pub use parts::{DetectorData, Holder, Sight, output_bits};

/// The language of the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Language {
    /// SIGMA KOKI SHOT/GSC.
    Shot,
    /// GRBL 1.1 / grblHAL.
    Grbl,
}

/// A whole rig as its file describes it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Rig {
    /// Name for the log.
    pub name: String,
    /// Language of the controller.
    pub language: Language,
    /// SHOT model (SHOT only).
    pub model: shot::Model,
    /// Line speed.
    pub baud: u32,
    /// Hardware flow control.
    pub rts_cts: bool,
    /// Light theta, light phi, view theta, view phi.
    pub axes: [Axis; AXES],
    /// The arms are never brought nearer than this, degrees.
    pub zone_deg: f64,
    /// Angle of view theta out of the light's way, degrees.
    pub park_deg: f64,
    /// Pause after a verified move before the exposure, milliseconds.
    pub settle_ms: u64,
    /// Deadline of a command's answer, milliseconds.
    pub reply_ms: u64,
    /// Deadline of homing, seconds.
    pub home_s: u64,
    /// The detector.
    pub detector: DetectorData,
}

impl Default for Rig {
    fn default() -> Self {
        Rig {
            name: "four-axis rig, SHOT-304GS".into(),
            language: Language::Shot,
            model: shot::Model::Shot304,
            baud: 38_400,
            rts_cts: true,
            axes: [
                Axis::yaw("light_theta", -2.0, 182.0),
                Axis::yaw("light_phi", -185.0, 185.0),
                Axis {
                    home_deg: 180.0,
                    ..Axis::yaw("view_theta", -2.0, 182.0)
                },
                Axis::yaw("view_phi", -185.0, 185.0),
            ],
            zone_deg: 10.0,
            park_deg: 180.0,
            settle_ms: 20,
            reply_ms: 1000,
            home_s: 180,
            detector: DetectorData::default(),
        }
    }
}

impl Rig {
    /// The default rig with a GRBL controller: 1 "mm" = 1 degree, reports to 0.001 degree.
    pub fn grbl() -> Self {
        let mut rig = Rig {
            name: "four-axis rig, grblHAL".into(),
            language: Language::Grbl,
            baud: 115_200,
            rts_cts: false,
            ..Rig::default()
        };
        for axis in &mut rig.axes {
            axis.degrees_per_pulse = 0.001;
        }
        rig
    }

    /// Reads and checks a rig from TOML text.
    ///
    /// # Errors
    /// [`Error::Rig`] with the place in the file.
    pub fn from_toml(text: &str) -> Result<Self> {
        let rig: Rig = toml::from_str(text).map_err(|e| {
            Error::Rig(format!(
                "The rig file cannot be used: {}.",
                e.to_string().trim()
            ))
        })?;
        rig.validate()?;
        Ok(rig)
    }

    /// Reads and checks a rig file.
    ///
    /// # Errors
    /// [`Error::Io`] or [`Error::Rig`].
    pub fn load(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|e| Error::io("read", path, e))?;
        Self::from_toml(&text)
    }

    /// Checks every number.
    ///
    /// # Errors
    /// [`Error::Rig`].
    pub fn validate(&self) -> Result<()> {
        for axis in &self.axes {
            axis.validate()?;
        }
        let wrong = |what: &str| {
            Err(Error::Rig(format!(
                "The rig {:?} cannot be used: {what}.",
                self.name
            )))
        };
        if self.language == Language::Shot && self.model.axes() != AXES {
            return wrong("the goniometer has four axes, choose model = \"shot304\"");
        }
        if self.language == Language::Shot && !self.model.bauds().contains(&self.baud) {
            return wrong("the controller does not know this baud rate");
        }
        if !(0.0..=90.0).contains(&self.zone_deg) {
            return wrong("zone_deg must be 0..90");
        }
        if self.axes[2].check(self.park_deg).is_err() {
            return wrong("park_deg lies outside the limits of view_theta");
        }
        if let Some(what) = self.detector.broken_rule() {
            return wrong(what);
        }
        if self.reply_ms == 0
            || self.reply_ms > 60_000
            || self.home_s == 0
            || self.home_s > 3600
            || self.settle_ms > 60_000
        {
            return wrong("reply_ms must be 1..60000, home_s 1..3600, settle_ms 0..60000");
        }
        Ok(())
    }

    /// Deadline of an answer.
    pub fn reply(&self) -> Duration {
        Duration::from_millis(self.reply_ms)
    }

    /// Pulses of a pose; refused outside the limits or in the zone.
    ///
    /// # Errors
    /// [`Error::Limit`] or [`Error::Zone`].
    pub fn pulses(&self, pose: Pose) -> Result<[i64; AXES]> {
        let mut out = [0; AXES];
        for ((o, axis), deg) in out.iter_mut().zip(&self.axes).zip(pose.angles()) {
            *o = axis.pulses(deg)?;
        }
        if pose.separation() < self.zone_deg {
            return Err(Error::Zone {
                what: format!("The pose {pose}"),
                least: pose.separation(),
                zone: self.zone_deg,
            });
        }
        Ok(out)
    }

    /// The pose of pulse counts.
    pub fn pose(&self, pulses: &[i64]) -> Pose {
        let mut a = [0.0; AXES];
        for ((a, axis), p) in a.iter_mut().zip(&self.axes).zip(pulses) {
            *a = axis.degrees(*p);
        }
        Pose::from_angles(a)
    }

    /// The legs from one set of pulses to a pose, each within the limits and out of the zone whatever the speeds of the axes.
    ///
    /// # Errors
    /// [`Error::Limit`] or [`Error::Zone`]; nothing is sent then.
    pub fn way(&self, from: &[i64; AXES], to: Pose) -> Result<Vec<[i64; AXES]>> {
        let target = self.pulses(to)?;
        let from_pose = self.pose(from);
        let to_pose = self.pose(&target);
        // Half a pulse on each axis may separate a rounded pose from the asked one: it must keep the zone by itself.
        let mut detours = vec![(self.park_deg, f64::NAN)];
        for phi in [90.0, -90.0, 180.0, -180.0, 0.0] {
            if self.axes[3].check(phi).is_ok() {
                detours.extend([(f64::NAN, phi), (self.park_deg, phi)]);
            }
        }
        let legs = safe_way(
            from_pose.angles(),
            to_pose.angles(),
            self.zone_deg,
            &detours,
        )?;
        legs.into_iter()
            .map(|leg| self.pulses(Pose::from_angles(leg)))
            .collect()
    }

    /// Time of one leg, seconds: the slowest axis.
    pub fn leg_seconds(&self, from: &[i64; AXES], to: &[i64; AXES]) -> f64 {
        (0..AXES)
            .map(|i| self.axes[i].travel_seconds(to[i] - from[i]))
            .fold(0.0, f64::max)
    }

    /// The same rig with arms that arrive at once, for tests and trials.
    pub fn with_instant_motors(mut self) -> Self {
        for axis in &mut self.axes {
            axis.speed_deg_s = 500_000.0 * axis.degrees_per_pulse.abs();
            axis.start_speed_deg_s = axis.speed_deg_s;
            axis.ramp_ms = 0;
        }
        self.settle_ms = 0;
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_rigs_are_valid_and_survive_toml() {
        for rig in [Rig::default(), Rig::grbl()] {
            rig.validate().unwrap();
            let text = toml::to_string(&rig).unwrap();
            assert_eq!(Rig::from_toml(&text).unwrap(), rig);
        }
    }

    #[test]
    fn solid_angle_of_one_degree() {
        // π (0.5°)² = 2.3925e-4 sr to first order.
        let omega = DetectorData::default().solid_angle();
        assert!((omega - 2.392_45e-4).abs() < 1e-8, "{omega}");
    }

    #[test]
    fn bad_files_are_sentences() {
        for (text, word) in [
            ("baud = 12345", "baud"),
            ("nonsense = 1", "nonsense"),
            ("zone_deg = nan", "zone_deg"),
            ("model = \"gsc02\"", "four axes"),
            ("[detector]\naperture_deg = -1", "aperture_deg"),
        ] {
            let e = Rig::from_toml(text).unwrap_err().to_string();
            assert!(e.contains(word) && e.ends_with('.'), "{e}");
        }
    }

    #[test]
    fn ways_refuse_the_zone_and_the_limits() {
        let rig = Rig::default();
        let home = [0, 0, 0, 0];
        assert_eq!(rig.pose(&home), Pose::new(0.0, 0.0, 180.0, 0.0));
        assert!(matches!(
            rig.way(&home, Pose::new(30.0, 0.0, 35.0, 0.0)),
            Err(Error::Zone { .. })
        ));
        assert!(matches!(
            rig.way(&home, Pose::new(30.0, 0.0, 190.0, 0.0)),
            Err(Error::Limit { .. })
        ));
        assert_eq!(
            rig.way(&home, Pose::new(0.0, 0.0, 145.0, 0.0)).unwrap(),
            vec![[0, 0, -14_000, 0]]
        );
    }
}
