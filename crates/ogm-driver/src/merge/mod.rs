//! From a log to a measurement: dark and lamp taken out, exposures merged, divided by the direct beam, with standard errors and provenance.
//!
//! The beam is narrower than the detector's field, so a reading is a share of the beam's power: f = S / (S₀ Ω |cos θ_v|) with S₀ the direct beam
//! measured without the sample and Ω the aperture's solid angle. The straight-through beam is a delta smeared by source and aperture; where it falls
//! into the aperture the reading is reported as a transmittance, with the scattered light under it interpolated from its neighbours.

mod budget;
mod export;
mod klems;
mod scale;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::exposure::Rate;
use crate::log::{self, Contents, Reading, Record, What};
use crate::plan::Plan;
use crate::pose::Pose;
use crate::rig::Rig;
use crate::sim::optics::beam_share;

pub use export::write_whole;
use scale::Scale;

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
    /// The scattered BSDF in this direction, from the neighbours, 1/sr.
    pub scattered: f64,
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
    /// The detector's curvature that was found and taken out, and its standard error.
    pub linearity: Option<(f64, f64)>,
    /// Count rate of the direct beam at the plan's f-number, counts a millisecond.
    pub beam: f64,
    /// The white standard over what it should read, and the standard error.
    pub white: Option<(f64, f64)>,
}

impl Measurement {
    /// Adds the values of another scan of the same sample; the scale (beam, curvature, white standard) stays that of the first.
    pub fn append(&mut self, other: Measurement) {
        self.comments.extend(other.comments);
        self.samples.extend(other.samples);
        self.direct.extend(other.direct);
        self.saturated.extend(other.saturated);
        self.cut.extend(other.cut);
    }
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

/// Merges several logs of one sample, each on its own scale, into one measurement.
///
/// # Errors
/// As [`merge_log`], and [`Error::Merge`] without any log.
pub fn merge_logs(paths: &[PathBuf]) -> Result<Measurement> {
    let Some((first, more)) = paths.split_first() else {
        return Err(Error::Merge("There is no log to merge.".into()));
    };
    let mut out = merge_log(first)?;
    for path in more {
        out.append(merge_log(path)?);
    }
    Ok(out)
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
    let mut out = merge_readings(&readings, &plan, &rig)?;
    out.comments = comments(contents, &plan, &rig, fingerprint, software, &out);
    Ok(out)
}

/// Merges readings, without comments. A pose that stands in the list twice counts once.
///
/// # Errors
/// [`Error::Merge`] without a usable direct beam.
pub fn merge_readings(readings: &[&Reading], plan: &Plan, rig: &Rig) -> Result<Measurement> {
    let scale = Scale::new(readings, plan, rig)?;
    let mut out = Measurement {
        linearity: Some((scale.linearity.x, scale.linearity.sigma)),
        beam: scale.direct.value,
        ..Measurement::default()
    };
    let mut straight: Vec<(Pose, Rate)> = Vec::new();
    let d = &rig.detector;
    let mut seen = BTreeSet::new();
    for r in readings.iter().filter(|r| r.what == What::Sample) {
        if !seen.insert(r.index) {
            continue;
        }
        let rate = scale.rate(r)?;
        if rate.saturated {
            out.saturated.push(r.reached);
            continue;
        }
        let share = scale.share(rate);
        let off = r.reached.from_straight();
        // How far the arms may be from where they are thought to be: three standard deviations of both.
        let margin = 3.0 * std::f64::consts::SQRT_2 * d.angle_deg;
        if off < d.aperture_deg / 2.0 + d.beam_half_deg + margin {
            // A pose meant to be straight through counts as such; others only where the whole beam surely is in the aperture.
            if off <= (d.aperture_deg / 2.0 - d.beam_half_deg - margin).max(0.01) {
                straight.push((r.reached, share));
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
    budget::widen(&mut out.samples, d);
    for (pose, share) in straight {
        let projected = d.solid_angle() * pose.view()[2].abs();
        let (under, under_sigma) = scattered_under(&out.samples, pose);
        // Arms that are off by two standard deviations may lose a part of the beam at the aperture's edge.
        let off = 2.0 * std::f64::consts::SQRT_2 * d.angle_deg;
        let whole = beam_share(0.0, d.aperture_deg / 2.0, d.beam_half_deg);
        let lost = 1.0 - beam_share(off, d.aperture_deg / 2.0, d.beam_half_deg) / whole;
        let sigma = share
            .sigma
            .hypot(under_sigma * projected)
            .hypot(0.5 * lost * share.value);
        out.direct.push(Straight {
            pose,
            transmittance: share.value - under * projected,
            sigma,
            scattered: under,
        });
    }
    out.white = scale.white(readings, rig)?;
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
    if let Some((x, sigma)) = m.linearity.filter(|l| l.1 > 0.0) {
        line(
            "curvature of the detector, taken out",
            &format!("{x:.5} +- {sigma:.5} of full scale"),
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
    // For the fit, which averages a model over the aperture: its half angle.
    out.push(format!("aperture_deg,{}", rig.detector.aperture_deg / 2.0));
    out
}
