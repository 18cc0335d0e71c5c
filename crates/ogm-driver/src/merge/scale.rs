//! The scale of a log: dark level, lamp, curvature of the detector and direct beam; what turns counts into shares of the beam.

use crate::detector::Shot;
use crate::error::{Error, Result};
use crate::exposure::{Dark, Linearity, Rate, merge as merge_shots};
use crate::log::{Reading, What};
use crate::plan::{Drift, Plan};
use crate::rig::Rig;
use crate::sim::optics::WHITE_REFLECTANCE;

use super::shared::Shared;

/// Dark, lamp and direct beam of a log: what turns counts into shares of the beam.
pub(super) struct Scale {
    rig: Rig,
    dark: Dark,
    pub(super) linearity: Linearity,
    drift: Drift,
    reference0: f64,
    /// Seconds and relative lamp power, by the reference readings.
    lamp: Vec<(f64, f64)>,
    pub(super) direct: Rate,
}

impl Scale {
    pub(super) fn new(readings: &[&Reading], plan: &Plan, rig: &Rig) -> Result<Self> {
        let of = |what: What| readings.iter().copied().filter(move |r| r.what == what);
        let dark = Dark::from_shots(of(What::Dark).flat_map(|r| &r.shots), &rig.detector);
        let Some(first) = of(What::Direct).next() else {
            return Err(Error::Merge("The log has no direct-beam reading, so there is no scale; let the scan go on first.".into()));
        };
        if readings.iter().any(|r| r.f_number != first.f_number) {
            return Err(Error::Merge(
                "The log mixes f-numbers; exposures are merged only at one, so split the scan."
                    .into(),
            ));
        }
        let reference0 = first.shots.first().map_or(0.0, |s| s.reference);
        if plan.calibration.drift == Drift::Diode && reference0 <= 0.0 {
            return Err(Error::Merge("The plan corrects the lamp by its diode, but the log has no diode counts; set calibration.drift.".into()));
        }
        let brackets: Vec<(Shot, f64)> = of(What::Linearity)
            .flat_map(|r| &r.shots)
            .map(|s| match plan.calibration.drift {
                Drift::Diode => (*s, (s.reference / reference0).max(1e-6)),
                // A bracket takes seconds: the lamp is taken as constant for its time.
                Drift::Reference | Drift::None => (*s, 1.0),
            })
            .collect();
        let linearity = Linearity::from_shots(&brackets, &dark, &rig.detector);
        let mut scale = Scale {
            rig: rig.clone(),
            dark,
            linearity,
            drift: plan.calibration.drift,
            reference0,
            lamp: Vec::new(),
            direct: Rate {
                value: 1.0,
                sigma: 0.0,
                noise: 0.0,
                dark: 0.0,
                depth: 0.0,
                saturated: false,
            },
        };
        if scale.drift == Drift::Reference {
            let mut points = Vec::new();
            for r in readings
                .iter()
                .filter(|r| matches!(r.what, What::Direct | What::Reference | What::Check))
            {
                points.push((r.scan_s, scale.rate(r)?.value));
            }
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            let first = points.first().map_or(1.0, |p| p.1);
            if first.is_nan() || first <= 0.0 {
                return Err(Error::Merge(
                    "The direct beam reads nothing: was the sample left in, or the shutter closed?"
                        .into(),
                ));
            }
            scale.lamp = points.into_iter().map(|(t, v)| (t, v / first)).collect();
        }
        let mut rates = Vec::new();
        for r in of(What::Direct) {
            let rate = scale.rate(r)?;
            if rate.saturated {
                return Err(Error::Merge("The direct beam is saturated at the shortest exposure; choose a larger f-number or shorter exposures.".into()));
            }
            rates.push(rate);
        }
        let direct = mean(&rates, linearity);
        if direct.value.is_nan() || direct.value <= 5.0 * direct.sigma {
            return Err(Error::Merge("The direct beam is not above its noise: was the sample left in, or the shutter closed?".into()));
        }
        scale.direct = direct;
        Ok(scale)
    }

    /// The rate of a reading, dark and lamp taken out.
    pub(super) fn rate(&self, reading: &Reading) -> Result<Rate> {
        let at = self.lamp_at(reading.scan_s);
        merge_shots(
            &reading.shots,
            &self.dark,
            self.linearity,
            &self.rig.detector,
            |s| match self.drift {
                Drift::Diode => (s.reference / self.reference0).max(1e-6),
                Drift::Reference => at,
                Drift::None => 1.0,
            },
        )
    }

    fn lamp_at(&self, t: f64) -> f64 {
        match self.lamp.as_slice() {
            [] => 1.0,
            [only] => only.1,
            all => {
                let i = all.partition_point(|p| p.0 < t).clamp(1, all.len() - 1);
                let (a, b) = (all[i - 1], all[i]);
                let share = if b.0 > a.0 {
                    ((t - a.0) / (b.0 - a.0)).clamp(0.0, 1.0)
                } else {
                    0.0
                };
                (a.1 + share * (b.1 - a.1)).max(1e-6)
            }
        }
    }

    /// A rate as a share of the direct beam. The curvature bends both, so only the difference of their depths counts.
    pub(super) fn share(&self, rate: Rate) -> Rate {
        let unit = self.direct.value;
        let value = rate.value / unit;
        let bent = self.bend(rate.depth - self.direct.depth);
        let relative = self.direct_relative().hypot(bent);
        Rate {
            value,
            sigma: (rate.noise / unit)
                .hypot(rate.dark / unit)
                .hypot(value * relative),
            noise: rate.noise / unit,
            dark: rate.dark / unit,
            ..rate
        }
    }

    /// Relative standard error of the direct beam beside the curvature's: its own noise, its dark level, and what the rig file says of the detector.
    fn direct_relative(&self) -> f64 {
        (self.direct.noise.hypot(self.direct.dark) / self.direct.value)
            .hypot(self.rig.detector.linearity)
    }

    /// Mean depth of the scattered light's readings in the detector's range.
    pub(super) fn mean_depth(&self, shares: &[Rate]) -> f64 {
        match shares {
            [] => self.direct.depth,
            all => all.iter().map(|s| s.depth).sum::<f64>() / all.len() as f64,
        }
    }

    /// Relative standard error that the curvature's uncertainty makes over a difference in depth.
    pub(super) fn bend(&self, depth: f64) -> f64 {
        (self.linearity.sigma * depth).abs()
    }

    /// What all values of the log are wrong by together; `shares` are those of the scattered light.
    pub(super) fn shared(&self, shares: &[Rate]) -> Shared {
        let d = &self.rig.detector;
        let n = shares.len().max(1) as f64;
        let dark = (shares.iter().map(|s| s.dark * s.dark).sum::<f64>() / n).sqrt();
        Shared {
            scale: self
                .direct_relative()
                .hypot(self.bend(self.mean_depth(shares) - self.direct.depth)),
            solid_angle: d.solid_angle_sigma(),
            floor: dark / d.solid_angle(),
            angle_deg: d.angle_deg,
        }
    }

    pub(super) fn white(&self, readings: &[&Reading], rig: &Rig) -> Result<Option<(f64, f64)>> {
        let Some(r) = readings.iter().find(|r| r.what == What::White) else {
            return Ok(None);
        };
        let share = self.share(self.rate(r)?);
        let expected = WHITE_REFLECTANCE / std::f64::consts::PI
            * rig.detector.solid_angle()
            * r.reached.view()[2].abs();
        Ok(Some((share.value / expected, share.sigma / expected)))
    }
}

/// The mean of several readings of one light: their noise averages out, what they share does not.
fn mean(rates: &[Rate], linearity: Linearity) -> Rate {
    let weight = |r: &Rate| 1.0 / r.noise.powi(2).max(1e-300);
    let all: f64 = rates.iter().map(weight).sum();
    let of =
        |part: &dyn Fn(&Rate) -> f64| rates.iter().map(|r| weight(r) * part(r)).sum::<f64>() / all;
    let (value, noise) = (of(&|r| r.value), all.sqrt().recip());
    let (dark, depth) = (of(&|r| r.dark), of(&|r| r.depth));
    Rate {
        value,
        sigma: noise.hypot(dark).hypot(value * linearity.sigma * depth),
        noise,
        dark,
        depth,
        saturated: false,
    }
}
