//! The parts of a rig beside its axes: the detector, the shutter and the holder.

use serde::{Deserialize, Serialize};

/// The detector and what is known of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DetectorData {
    /// Full angle of the round aperture seen from the sample, degrees.
    pub aperture_deg: f64,
    /// Standard uncertainty of that angle, degrees.
    #[serde(skip_serializing_if = "is_zero")]
    pub aperture_sigma_deg: f64,
    /// Counts at which the ADC ends.
    pub full_scale: f64,
    /// Standard deviation of one reading in the dark, counts.
    pub read_noise: f64,
    /// Electrons of one count (shot noise: variance = counts / electrons_per_count).
    pub electrons_per_count: f64,
    /// Half the full angle of the light's divergence, degrees: the straight-through beam is this wide.
    pub beam_half_deg: f64,
    /// Relative standard deviation of one reading of the reference diode.
    pub reference_noise: f64,
    /// Relative standard uncertainty of the detector's linearity over its range, beyond the curvature that is measured.
    pub linearity: f64,
    /// Standard uncertainty of each axis angle, degrees.
    pub angle_deg: f64,
}

impl Default for DetectorData {
    fn default() -> Self {
        DetectorData {
            aperture_deg: 1.0,
            aperture_sigma_deg: 0.0,
            full_scale: 1_048_575.0,
            read_noise: 3.0,
            electrons_per_count: 20.0,
            beam_half_deg: 0.2,
            reference_noise: 1e-4,
            linearity: 0.0,
            angle_deg: 0.0,
        }
    }
}

impl DetectorData {
    /// The rule that a number breaks, if any.
    pub(super) fn broken_rule(&self) -> Option<&'static str> {
        let in_range = |x: f64, most: f64| x > 0.0 && x <= most;
        if !(in_range(self.aperture_deg, 30.0) && in_range(self.full_scale, f64::MAX)) {
            return Some("detector.aperture_deg must be in 0..30 and detector.full_scale positive");
        }
        let at_least_zero = [
            self.reference_noise,
            self.read_noise,
            self.beam_half_deg,
            self.linearity,
            self.angle_deg,
            self.aperture_sigma_deg,
        ];
        let good = at_least_zero.iter().all(|x| *x >= 0.0 && x.is_finite())
            && in_range(self.electrons_per_count, f64::MAX);
        (!good).then_some(
            "the detector's noise numbers must be finite and not negative, electrons_per_count positive",
        )
    }

    /// Solid angle of the aperture, sr.
    pub fn solid_angle(&self) -> f64 {
        let half = (self.aperture_deg / 2.0).to_radians();
        // 2π (1 - cos) without cancellation.
        4.0 * std::f64::consts::PI * (half / 2.0).sin().powi(2)
    }

    /// How far the arms may be from where they are thought to be, degrees: three standard deviations of both.
    fn margin_deg(&self) -> f64 {
        3.0 * std::f64::consts::SQRT_2 * self.angle_deg
    }

    /// Within this angle of straight through some of the beam may fall into the aperture, degrees.
    pub fn blind_deg(&self) -> f64 {
        self.aperture_deg / 2.0 + self.beam_half_deg + self.margin_deg()
    }

    /// What is seen of the beam at `off` degrees from straight through. A pose meant to be straight through counts as such; others only where the
    /// whole beam surely is in the aperture.
    pub fn sight(&self, off: f64) -> Sight {
        if off >= self.blind_deg() {
            Sight::Scattered
        } else if off
            <= (self.aperture_deg / 2.0 - self.beam_half_deg - self.margin_deg()).max(0.01)
        {
            Sight::Straight
        } else {
            Sight::Cut
        }
    }

    /// Relative standard uncertainty of the solid angle.
    pub fn solid_angle_sigma(&self) -> f64 {
        2.0 * self.aperture_sigma_deg / self.aperture_deg
    }
}

/// What the detector sees of the straight-through beam.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sight {
    /// Nothing: scattered light alone.
    Scattered,
    /// The whole beam, surely.
    Straight,
    /// An unknown part of it, cut by the aperture's edge.
    Cut,
}

/// A number that a rig file need not name.
fn is_zero(x: &f64) -> bool {
    *x == 0.0
}

/// What the controller's output bits switch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Holder {
    /// The sample is in the beam.
    Sample,
    /// Nothing is in the beam: the direct beam.
    Empty,
    /// The white standard is in the beam.
    White,
}

/// The word on the output port for a shutter and a holder: bit 0 shutter open, bits 1 and 2 the holder.
pub fn output_bits(open: bool, holder: Holder) -> u8 {
    u8::from(open)
        | match holder {
            Holder::Sample => 0,
            Holder::Empty => 2,
            Holder::White => 4,
        }
}
