//! The simulated bench behind the controllers: four arms, lamp, shutter, holder and detector, with what is wrong with them.

use std::sync::Arc;

use super::motor::Motor;
use super::noise::Noise;
use super::optics::{Sample, flux};
use crate::pose::{AXES, Pose};
use crate::rig::{Holder, Rig};

/// What is wrong with the simulated rig; the default is a good instrument on a quiet day.
#[derive(Debug, Clone)]
pub struct Imperfections {
    /// Seed of all noise.
    pub seed: u64,
    /// Whether readings are noisy at all.
    pub noise: bool,
    /// Share of the final lamp power missing at the moment it is switched on.
    pub warm_up_share: f64,
    /// Time constant of warming up, seconds.
    pub warm_up_s: f64,
    /// Seconds the lamp has been on when the simulation starts.
    pub lamp_on_s: f64,
    /// Lamp drift after warm-up, share per hour.
    pub drift_per_hour: f64,
    /// The reference diode sees the lamp's changes.
    pub reference_diode: bool,
    /// Dark counts without exposure.
    pub dark_offset: f64,
    /// Dark counts a millisecond.
    pub dark_rate: f64,
    /// Counts become c (1 - x c / full scale).
    pub nonlinearity: f64,
    /// True angle minus commanded angle of each axis, degrees.
    pub misalignment_deg: [f64; AXES],
    /// True full angle of the aperture minus the one the rig file states, degrees.
    pub aperture_error_deg: f64,
    /// Counts a millisecond of the whole beam at f/4.
    pub counts_per_ms: f64,
}

impl Default for Imperfections {
    fn default() -> Self {
        Imperfections {
            seed: 1,
            noise: true,
            warm_up_share: 0.1,
            warm_up_s: 600.0,
            lamp_on_s: 7200.0,
            drift_per_hour: 0.0,
            reference_diode: true,
            dark_offset: 120.0,
            dark_rate: 0.05,
            nonlinearity: 0.0,
            misalignment_deg: [0.0; AXES],
            aperture_error_deg: 0.0,
            counts_per_ms: 600_000.0,
        }
    }
}

impl Imperfections {
    /// No noise, no drift, no dark counts.
    pub fn none() -> Self {
        Imperfections {
            noise: false,
            warm_up_share: 0.0,
            dark_offset: 0.0,
            dark_rate: 0.0,
            ..Imperfections::default()
        }
    }
}

/// One exposure's outcome.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shot {
    /// ADC counts.
    pub counts: i64,
    /// Counts of the reference diode.
    pub reference: i64,
    /// The ADC was at its end.
    pub saturated: bool,
}

/// The bench. Times are seconds of the simulation's own clock.
pub struct Bench {
    /// Its data sheet.
    pub rig: Rig,
    /// The arms.
    pub motors: [Motor; AXES],
    /// The output word.
    pub outputs: u8,
    /// What is wrong.
    pub wrong: Imperfections,
    /// When the lamp went off, if it did.
    pub lamp_off_at: Option<f64>,
    /// Every exposure, when kept: its tag, the true pose, whether an arm moved.
    pub exposures: Option<Vec<(u64, Pose, bool)>>,
    sample: Arc<dyn Sample>,
}

impl Bench {
    /// A bench just switched on: the arms rest somewhere, the counters say 0.
    pub fn new(rig: Rig, sample: Arc<dyn Sample>, wrong: Imperfections) -> Self {
        let mut noise = Noise::at(&[wrong.seed, 0x61_726d]);
        let motors = std::array::from_fn(|i| {
            let axis = &rig.axes[i];
            let pulses = |deg: f64| (deg - axis.home_deg) / axis.degrees_per_pulse;
            // The sensors sit one degree beyond the soft limits.
            let (a, b) = (pulses(axis.min_deg - 1.0), pulses(axis.max_deg + 1.0));
            let (low, high) = (a.min(b).round(), a.max(b).round());
            let rest = (noise.uniform() * 0.1 * (high - low) + low.max(-1.0))
                .clamp(low, high)
                .round();
            Motor::new(rest, low, high)
        });
        Bench {
            rig,
            motors,
            outputs: 0,
            wrong,
            lamp_off_at: None,
            exposures: None,
            sample,
        }
    }

    /// Brings all arms to `now`; true while one moves.
    pub fn update(&mut self, now: f64) -> bool {
        // Every arm is brought up, so no short cut.
        let mut busy = false;
        for m in &mut self.motors {
            busy |= m.update(now);
        }
        busy
    }

    /// Stops every arm where it is.
    pub fn freeze(&mut self, now: f64) {
        for m in &mut self.motors {
            m.freeze(now);
        }
    }

    /// The controller lost its power for an instant: arms stopped, counters 0, outputs off.
    pub fn lose_power(&mut self, now: f64) {
        for m in &mut self.motors {
            m.freeze(now);
            m.zero_here(now);
        }
        self.outputs = 0;
    }

    /// What the controller believes of every arm, pulses.
    pub fn counts(&self) -> [i64; AXES] {
        std::array::from_fn(|i| self.motors[i].count())
    }

    /// The pose the arms really have.
    pub fn true_pose(&mut self, now: f64) -> Pose {
        self.update(now);
        let mut a = [0.0; AXES];
        for (i, a) in a.iter_mut().enumerate() {
            let axis = &self.rig.axes[i];
            *a = self.motors[i].place() * axis.degrees_per_pulse
                + axis.home_deg
                + self.wrong.misalignment_deg[i];
        }
        Pose::from_angles(a)
    }

    /// Seconds the lamp has been on; 0 when it is off.
    pub fn lamp_seconds(&self, now: f64) -> f64 {
        if self.lamp_off_at.is_some_and(|t| now >= t) {
            0.0
        } else {
            now + self.wrong.lamp_on_s
        }
    }

    /// Lamp power, 1 = warm and fresh.
    pub fn lamp(&self, now: f64) -> f64 {
        let on = self.lamp_seconds(now);
        if on <= 0.0 {
            return 0.0;
        }
        let w = &self.wrong;
        (1.0 - w.warm_up_share * (-on / w.warm_up_s).exp())
            * (1.0 + w.drift_per_hour * now / 3600.0)
    }

    /// Counts of an ideal, endless detector exposed for `exposure_ms` at `f_number`, beginning at `now`. `tag` names the exposure.
    pub fn light(&mut self, now: f64, exposure_ms: f64, f_number: f64, tag: u64) -> f64 {
        let moving = self.update(now);
        let pose = self.true_pose(now);
        if let Some(list) = &mut self.exposures {
            list.push((tag, pose, moving));
        }
        if self.outputs & 1 == 0 {
            return 0.0;
        }
        let holder = match self.outputs & 6 {
            0 => Holder::Sample,
            2 => Holder::Empty,
            _ => Holder::White,
        };
        let d = &self.rig.detector;
        let aperture = d.aperture_deg + self.wrong.aperture_error_deg;
        let share = flux(&*self.sample, holder, pose, aperture, d.beam_half_deg);
        let stop = (4.0 / f_number.max(0.5)).powi(2);
        let lamp = self.lamp(now + exposure_ms / 2000.0);
        self.wrong.counts_per_ms * exposure_ms * stop * share * lamp
    }

    /// Counts of the diode that watches the lamp.
    pub fn reference(&self, now: f64, tag: u64) -> i64 {
        let lamp = if self.wrong.reference_diode {
            self.lamp(now)
        } else {
            1.0
        };
        let mut noise = Noise::at(&[self.wrong.seed, tag, 0x0072_6566]);
        let noise = if self.wrong.noise {
            noise.normal()
        } else {
            0.0
        };
        (800_000.0 * lamp + 80.0 * noise).round() as i64
    }

    /// Exposes the photodiode for `exposure_ms` at `f_number`, beginning at `now`. `tag` is the counter of the noise.
    pub fn expose(&mut self, now: f64, exposure_ms: f64, f_number: f64, tag: u64) -> Shot {
        let light = self.light(now, exposure_ms, f_number, tag);
        let (d, wrong) = (&self.rig.detector, &self.wrong);
        let mut counts = light * (1.0 - wrong.nonlinearity * (light / d.full_scale).min(1.0));
        let dark = wrong.dark_rate * exposure_ms;
        if wrong.noise {
            // Shot noise of light and dark current, plus the read noise.
            let variance = (counts + dark) / d.electrons_per_count + d.read_noise.powi(2);
            let key = [wrong.seed, tag, (exposure_ms * 1000.0) as u64];
            counts += Noise::at(&key).normal() * variance.sqrt();
        }
        counts += wrong.dark_offset + dark;
        Shot {
            counts: counts.clamp(-1e6, d.full_scale).round() as i64,
            reference: self.reference(now + exposure_ms / 2000.0, tag),
            saturated: counts >= d.full_scale,
        }
    }
}
