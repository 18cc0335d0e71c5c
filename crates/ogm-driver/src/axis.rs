//! One arm's axis: pulses to degrees and back, its soft limits and its speed.

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};

/// A rotation axis driven in whole pulses. Angles in degrees, as a person reads them on the stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Axis {
    /// Name used in messages and in the log.
    pub name: String,
    /// Degrees of one pulse; SIGMA KOKI OSMS-60YAW at half step: 0.0025.
    pub degrees_per_pulse: f64,
    /// Angle of the mechanical origin, where the controller counts 0, in degrees.
    pub home_deg: f64,
    /// Least angle that may be commanded.
    pub min_deg: f64,
    /// Greatest angle that may be commanded.
    pub max_deg: f64,
    /// Top speed, degrees a second.
    pub speed_deg_s: f64,
    /// Speed at which a ramp begins, degrees a second.
    pub start_speed_deg_s: f64,
    /// Time of a whole ramp, milliseconds.
    pub ramp_ms: u32,
}

impl Axis {
    /// A stage like the OSMS-60YAW with the given name and limits.
    pub fn yaw(name: &str, min_deg: f64, max_deg: f64) -> Self {
        Axis {
            name: name.into(),
            degrees_per_pulse: 0.0025,
            home_deg: 0.0,
            min_deg,
            max_deg,
            speed_deg_s: 20.0,
            start_speed_deg_s: 1.0,
            ramp_ms: 200,
        }
    }

    /// Checks the numbers of a rig file.
    ///
    /// # Errors
    /// [`Error::Rig`] when a number cannot be meant.
    pub fn validate(&self) -> Result<()> {
        let finite = [
            self.degrees_per_pulse,
            self.home_deg,
            self.min_deg,
            self.max_deg,
            self.speed_deg_s,
            self.start_speed_deg_s,
        ];
        if finite.iter().any(|x| !x.is_finite()) {
            return Err(Error::Rig(format!(
                "The axis {} has a number that is not finite.",
                self.name
            )));
        }
        if self.degrees_per_pulse.abs() < 1e-6 || self.degrees_per_pulse.abs() > 10.0 {
            return Err(Error::Rig(format!(
                "The axis {} has degrees_per_pulse = {}; give 0.000001 to 10.",
                self.name, self.degrees_per_pulse
            )));
        }
        if self.min_deg > self.max_deg || self.min_deg < -720.0 || self.max_deg > 720.0 {
            return Err(Error::Rig(format!(
                "The axis {} has limits {}..{} deg; give least, then greatest, within -720..720.",
                self.name, self.min_deg, self.max_deg
            )));
        }
        if !(self.home_deg >= -720.0 && self.home_deg <= 720.0) {
            return Err(Error::Rig(format!(
                "The axis {} has home_deg = {}; give -720..720.",
                self.name, self.home_deg
            )));
        }
        if self.start_speed_deg_s <= 0.0 || self.speed_deg_s < self.start_speed_deg_s {
            return Err(Error::Rig(format!(
                "The axis {} needs 0 < start_speed_deg_s <= speed_deg_s.",
                self.name
            )));
        }
        Ok(())
    }

    /// Angle of a pulse count, degrees.
    pub fn degrees(&self, pulses: i64) -> f64 {
        // Counting in fractions of 1e-7 deg takes the last-bit noise of the product away: 14000 pulses are 35 deg.
        let deg = pulses as f64 * self.degrees_per_pulse + self.home_deg;
        (deg * 1e7).round() / 1e7
    }

    /// The pulse count nearest to `deg`. A target outside the soft limits is refused, never clamped;
    /// a target within them whose nearest pulse lies outside takes the neighbouring pulse inside.
    ///
    /// # Errors
    /// [`Error::Limit`] when `deg` lies outside the limits or is not a number.
    pub fn pulses(&self, deg: f64) -> Result<i64> {
        self.check(deg)?;
        let exact = (deg - self.home_deg) / self.degrees_per_pulse;
        let nearest = exact.round() as i64;
        for p in [nearest, nearest - 1, nearest + 1] {
            if self.check(self.degrees(p)).is_ok() {
                return Ok(p);
            }
        }
        Err(self.limit(deg))
    }

    /// Whether `deg` may be commanded.
    ///
    /// # Errors
    /// [`Error::Limit`] otherwise.
    pub fn check(&self, deg: f64) -> Result<()> {
        // Written so that NaN fails.
        if deg >= self.min_deg && deg <= self.max_deg {
            Ok(())
        } else {
            Err(self.limit(deg))
        }
    }

    fn limit(&self, angle: f64) -> Error {
        Error::Limit {
            axis: self.name.clone(),
            angle,
            min: self.min_deg,
            max: self.max_deg,
        }
    }

    /// Top speed in pulses a second, at least 1.
    pub fn speed_pps(&self) -> u32 {
        ((self.speed_deg_s / self.degrees_per_pulse.abs()).round() as i64).clamp(1, 500_000) as u32
    }

    /// Start speed in pulses a second, at least 1 and at most the top speed.
    pub fn start_pps(&self) -> u32 {
        ((self.start_speed_deg_s / self.degrees_per_pulse.abs()).round() as i64)
            .clamp(1, i64::from(self.speed_pps())) as u32
    }

    /// Time of a move by `pulses` with the trapezoid of this axis, seconds.
    pub fn travel_seconds(&self, pulses: i64) -> f64 {
        let (s, f, t) = (
            f64::from(self.start_pps()),
            f64::from(self.speed_pps()),
            f64::from(self.ramp_ms) / 1000.0,
        );
        let distance = pulses.unsigned_abs() as f64;
        if t <= 0.0 || f <= s {
            return distance / f;
        }
        let ramps = (s + f) * t; // both ramps together
        if distance >= ramps {
            return 2.0 * t + (distance - ramps) / f;
        }
        let a = (f - s) / t;
        // distance = 2 (s τ + a τ²/2) with τ the time of one ramp.
        2.0 * ((s * s + a * distance).sqrt() - s) / a
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thirty_five_degrees_are_fourteen_thousand_pulses() {
        let a = Axis::yaw("view_theta", -5.0, 185.0);
        assert_eq!(a.pulses(35.0).unwrap(), 14_000);
        assert_eq!(a.degrees(14_000), 35.0);
        assert_eq!(a.degrees(-3), -0.0075);
    }

    #[test]
    fn outside_is_refused_with_a_sentence_and_never_clamped() {
        let a = Axis::yaw("view_theta", 0.0, 90.0);
        for deg in [90.001, -0.0001, f64::NAN, f64::INFINITY] {
            let text = a.pulses(deg).unwrap_err().to_string();
            assert!(
                text.contains("view_theta")
                    && text.contains("0..90")
                    && text.contains("nothing was moved"),
                "{text}"
            );
        }
        assert_eq!(a.pulses(90.0).unwrap(), 36_000);
    }

    #[test]
    fn rounding_does_not_step_over_a_limit() {
        let mut a = Axis::yaw("x", 0.0, 0.999);
        a.degrees_per_pulse = 0.4;
        // 0.99 / 0.4 = 2.475 -> 2 -> 0.8; 0.999 -> 2.4975 -> 2. With max 0.999 pulse 3 would be 1.2.
        assert_eq!(a.pulses(0.99).unwrap(), 2);
        a.max_deg = 1.0;
        assert_eq!(
            a.pulses(1.0).unwrap(),
            2,
            "2.5 rounds to 3, which is outside"
        );
    }

    #[test]
    fn travel_time_of_long_and_short_moves() {
        let a = Axis::yaw("x", -180.0, 180.0); // 400..8000 pps, 0.2 s ramps: the ramps take 1680 pulses
        assert!((a.travel_seconds(1680) - 0.4).abs() < 1e-12);
        assert!((a.travel_seconds(1680 + 8000) - 1.4).abs() < 1e-12);
        assert!(a.travel_seconds(100) < 0.4 && a.travel_seconds(100) > 100.0 / 8000.0);
        assert_eq!(a.travel_seconds(0), 0.0);
    }
}
