//! The scale of a log: dark level, lamp, curvature of the detector and direct beam; what turns counts into shares of the beam.

use crate::detector::Shot;
use crate::error::{Error, Result};
use crate::exposure::{Dark, Linearity, Rate, merge as merge_shots};
use crate::log::{Reading, What};
use crate::plan::{Drift, Plan};
use crate::rig::Rig;
use crate::sim::optics::WHITE_REFLECTANCE;

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
        let mut weights = (0.0, 0.0);
        for r in of(What::Direct) {
            let rate = scale.rate(r)?;
            if rate.saturated {
                return Err(Error::Merge("The direct beam is saturated at the shortest exposure; choose a larger f-number or shorter exposures.".into()));
            }
            let w = 1.0 / rate.sigma.powi(2).max(1e-300);
            weights = (weights.0 + w * rate.value, weights.1 + w);
        }
        let direct = Rate {
            value: weights.0 / weights.1,
            sigma: weights.1.sqrt().recip(),
            saturated: false,
        };
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

    /// A rate as a share of the direct beam, with the detector's linearity in its error.
    pub(super) fn share(&self, rate: Rate) -> Rate {
        let value = rate.value / self.direct.value;
        let relative = (self.direct.sigma / self.direct.value).hypot(self.rig.detector.linearity);
        Rate {
            value,
            sigma: (rate.sigma / self.direct.value).hypot(value * relative),
            saturated: rate.saturated,
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
