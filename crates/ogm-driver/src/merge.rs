//! From a log to a measurement: dark and lamp taken out, exposures merged, divided by the direct beam, with standard errors and provenance.
//!
//! The beam is narrower than the detector's field, so a reading is a share of the beam's power: f = S / (S₀ Ω |cos θ_v|) with S₀ the direct beam
//! measured without the sample and Ω the aperture's solid angle. The straight-through beam is a delta smeared by source and aperture; where it falls
//! into the aperture the reading is reported as a transmittance, with the scattered light under it interpolated from its neighbours.

use std::path::Path;

use woven_bsdf::measured::csv::{Direct, Sample, Scan};
use woven_bsdf::vec3::Vec3;

use crate::error::{Error, Result};
use crate::exposure::{Dark, Rate, merge as merge_shots};
use crate::log::{self, Contents, Reading, Record, What};
use crate::plan::{Drift, Plan};
use crate::pose::Pose;
use crate::rig::Rig;
use crate::sim::optics::WHITE_REFLECTANCE;

/// One merged value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Value {
    /// Where, as reported by the controller.
    pub pose: Pose,
    /// BSDF, 1/sr.
    pub f: f64,
    /// Its standard error, 1/sr.
    pub sigma: f64,
}

/// The straight-through transmittance at one incidence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Straight {
    /// The straight-through pose.
    pub pose: Pose,
    /// Share of the beam, dimensionless.
    pub transmittance: f64,
    /// Its standard error.
    pub sigma: f64,
}

/// A merged scan.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Measurement {
    /// What made it, of which sample, with which devices; one line each.
    pub comments: Vec<String>,
    /// BSDF values.
    pub samples: Vec<Value>,
    /// Straight-through transmittances.
    pub direct: Vec<Straight>,
    /// Poses whose shortest exposure was saturated; no value is given for them.
    pub saturated: Vec<Pose>,
    /// Readings where the straight-through beam is cut by the aperture's edge; no value is given for them.
    pub cut: Vec<Pose>,
    /// The white standard over what it should read, and the standard error.
    pub white: Option<(f64, f64)>,
}

/// Merges a log file; damage in the middle is an error.
///
/// # Errors
/// [`Error::Io`], [`Error::Log`], [`Error::Merge`].
pub fn merge_log(path: &Path) -> Result<Measurement> {
    let contents = log::read(path)?;
    if let Some(first) = contents.damage.first() {
        return Err(Error::Log(format!(
            "The log {} is damaged in the middle ({} places; the first: {first}) `ogm merge --salvage` uses what is readable.",
            path.display(),
            contents.damage.len()
        )));
    }
    merge_contents(&contents)
}

/// Merges what was read of a log, damaged or not; damage is told in the comments.
///
/// # Errors
/// [`Error::Log`] without a header, [`Error::Merge`] without a direct beam.
pub fn merge_contents(contents: &Contents) -> Result<Measurement> {
    let Some(Record::Header {
        software,
        plan,
        rig,
        fingerprint,
        points,
        ..
    }) = contents.records.first()
    else {
        return Err(Error::Log(
            "The file does not begin with the header of a scan log.".into(),
        ));
    };
    let (plan, rig) = (Plan::from_toml(plan)?, Rig::from_toml(rig)?);
    let readings: Vec<&Reading> = contents
        .records
        .iter()
        .filter_map(|r| {
            if let Record::Reading(r) = r {
                Some(r)
            } else {
                None
            }
        })
        .collect();
    let scale = Scale::new(&readings, &plan, &rig)?;
    let mut out = Measurement::default();
    let mut straight: Vec<(Pose, Rate, f64)> = Vec::new();
    let d = &rig.detector;
    let mut seen = vec![false; *points];
    for r in readings.iter().filter(|r| r.what == What::Sample) {
        if r.index >= *points || std::mem::replace(&mut seen[r.index], true) {
            continue;
        }
        let rate = scale.rate(r)?;
        if rate.saturated {
            out.saturated.push(r.reached);
            continue;
        }
        let share = scale.share(rate);
        let off = r.reached.from_straight();
        if off < d.aperture_deg / 2.0 + d.beam_half_deg {
            if off <= d.aperture_deg / 2.0 - d.beam_half_deg {
                straight.push((r.reached, share, off));
            } else {
                out.cut.push(r.reached);
            }
            continue;
        }
        let projected = d.solid_angle() * r.reached.view()[2].abs();
        if projected <= 1e-6 * d.solid_angle() {
            continue; // seen edge-on there is no BSDF
        }
        out.samples.push(Value {
            pose: r.reached,
            f: share.value / projected,
            sigma: share.sigma / projected,
        });
    }
    for (pose, share, _) in straight {
        let projected = d.solid_angle() * pose.view()[2].abs();
        let (under, under_sigma) = scattered_under(&out.samples, pose);
        let sigma = share.sigma.hypot(under_sigma * projected);
        out.direct.push(Straight {
            pose,
            transmittance: share.value - under * projected,
            sigma,
        });
    }
    out.white = scale.white(&readings, &rig)?;
    out.comments = comments(contents, &plan, &rig, fingerprint, software, &out);
    Ok(out)
}

/// The scattered BSDF at the straight-through direction of `pose`, and its standard error: a parabola in the angle from straight through over the
/// nearest clean values of the same incidence; half of what the parabola adds counts as error.
fn scattered_under(samples: &[Value], pose: Pose) -> (f64, f64) {
    let mut near: Vec<(f64, f64, f64)> = samples
        .iter()
        .filter(|s| {
            crate::pose::angle_between(s.pose.light(), pose.light()) < 0.1
                && s.pose.view()[2] * pose.view()[2] > 0.0
        })
        .map(|s| (s.pose.from_straight(), s.f, s.sigma))
        .collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    near.truncate(6);
    match near.as_slice() {
        [] => (0.0, 0.0),
        [only] => (only.1, only.1.abs()),
        all => {
            let n = all.len() as f64;
            let (mx, my) = (
                all.iter().map(|p| p.0 * p.0).sum::<f64>() / n,
                all.iter().map(|p| p.1).sum::<f64>() / n,
            );
            let sxx: f64 = all.iter().map(|p| (p.0 * p.0 - mx).powi(2)).sum();
            let sxy: f64 = all.iter().map(|p| (p.0 * p.0 - mx) * (p.1 - my)).sum();
            let slope = if sxx > 1e-6 * mx * mx { sxy / sxx } else { 0.0 };
            let at_zero = my - slope * mx;
            let noise = all.iter().map(|p| p.2 * p.2).sum::<f64>().sqrt() / n;
            (at_zero.max(0.0), noise.hypot(0.5 * (at_zero - all[0].1)))
        }
    }
}

/// Dark, lamp and direct beam of a log: what turns counts into shares of the beam.
struct Scale {
    rig: Rig,
    dark: Dark,
    drift: Drift,
    reference0: f64,
    /// Seconds and relative lamp power, by the reference readings.
    lamp: Vec<(f64, f64)>,
    direct: Rate,
}

impl Scale {
    fn new(readings: &[&Reading], plan: &Plan, rig: &Rig) -> Result<Self> {
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
        let mut scale = Scale {
            rig: rig.clone(),
            dark,
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
    fn rate(&self, reading: &Reading) -> Result<Rate> {
        let at = self.lamp_at(reading.scan_s);
        merge_shots(
            &reading.shots,
            &self.dark,
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
    fn share(&self, rate: Rate) -> Rate {
        let value = rate.value / self.direct.value;
        let relative = (self.direct.sigma / self.direct.value).hypot(self.rig.detector.linearity);
        Rate {
            value,
            sigma: (rate.sigma / self.direct.value).hypot(value * relative),
            saturated: rate.saturated,
        }
    }

    fn white(&self, readings: &[&Reading], rig: &Rig) -> Result<Option<(f64, f64)>> {
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

fn comments(
    contents: &Contents,
    plan: &Plan,
    rig: &Rig,
    fingerprint: &str,
    software: &str,
    m: &Measurement,
) -> Vec<String> {
    let mut out = vec![format!(
        "BSDF measured by a goniometer, merged by ogm {}, logged by {software}",
        env!("CARGO_PKG_VERSION")
    )];
    let mut line = |name: &str, value: &str| {
        if !value.is_empty() {
            out.push(format!("{name}: {}", value.replace(['\n', '\r'], " ")));
        }
    };
    line("plan", &plan.name);
    line("sample", &plan.sample);
    line("operator", &plan.operator);
    line("rig", &rig.name);
    for record in &contents.records {
        if let Record::Session {
            number: 0,
            controller,
            detector,
            ..
        } = record
        {
            line("controller", controller);
            line("detector", detector);
        }
    }
    line("sha256 of plan and rig", fingerprint);
    line(
        "aperture",
        &format!(
            "{} deg full angle, f/{}",
            rig.detector.aperture_deg, plan.exposure.f_number
        ),
    );
    line(
        "lamp corrected by",
        &format!("{:?}", plan.calibration.drift).to_lowercase(),
    );
    if let Some((ratio, sigma)) = m.white {
        line(
            "white standard over expected",
            &format!("{ratio:.4} +- {sigma:.4}"),
        );
    }
    if !m.saturated.is_empty() {
        line(
            "saturated and left out",
            &format!("{} poses", m.saturated.len()),
        );
    }
    if !m.cut.is_empty() {
        line(
            "straight beam cut by the aperture, left out",
            &format!("{} poses", m.cut.len()),
        );
    }
    for damage in &contents.damage {
        line("damage in the log", damage);
    }
    out
}

impl Measurement {
    /// The project's measurement file.
    pub fn to_scan(&self) -> Scan {
        let vec = |d: [f64; 3]| Vec3::new(d[0], d[1], d[2]);
        Scan {
            comments: self.comments.clone(),
            direct: self
                .direct
                .iter()
                .map(|d| Direct {
                    l: vec(d.pose.light()),
                    transmittance: d.transmittance,
                    sigma: Some(d.sigma),
                })
                .collect(),
            samples: self
                .samples
                .iter()
                .map(|s| Sample {
                    l: vec(s.pose.light()),
                    v: vec(s.pose.view()),
                    f: s.f,
                    sigma: Some(s.sigma),
                })
                .collect(),
        }
    }

    /// Writes the CSV: to a temporary file in the same folder, synced, renamed.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write_csv(&self, path: &Path) -> Result<()> {
        write_whole(path, self.to_scan().to_text().as_bytes())
    }
}

/// Writes a whole file: a temporary file in the same folder, synced, then renamed.
///
/// # Errors
/// [`Error::Io`].
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    use std::io::Write;
    let folder = path
        .parent()
        .filter(|p| !p.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let mut file =
        tempfile::NamedTempFile::new_in(folder).map_err(|e| Error::io("write into", folder, e))?;
    file.write_all(bytes)
        .and_then(|()| file.as_file().sync_all())
        .map_err(|e| Error::io("write", path, e))?;
    file.persist(path)
        .map_err(|e| Error::io("write", path, e.error))?;
    Ok(())
}
