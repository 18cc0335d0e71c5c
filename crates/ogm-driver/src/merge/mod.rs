//! From a log to a measurement: dark and lamp taken out, exposures merged, divided by the direct beam, with standard errors and provenance.
//!
//! The beam is narrower than the detector's field, so a reading is a share of the beam's power: f = S / (S₀ Ω |cos θ_v|) with S₀ the direct beam
//! measured without the sample and Ω the aperture's solid angle. The straight-through beam is a delta smeared by source and aperture; where it falls
//! into the aperture the reading is reported as a transmittance, with the scattered light under it interpolated from its neighbours.

mod budget;
mod export;
mod klems;
mod provenance;
mod scale;
mod shared;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::exposure::Rate;
use crate::log::{self, Contents, Reading, Record, What};
use crate::plan::Plan;
use crate::pose::Pose;
use crate::rig::{Rig, Sight};
use crate::sim::optics::beam_share;

pub use export::write_whole;
use scale::Scale;
pub use shared::Shared;

/// One merged value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Value {
    /// Where, as reported by the controller.
    pub pose: Pose,
    /// BSDF, 1/sr.
    pub f: f64,
    /// Its standard error, 1/sr.
    pub sigma: f64,
    /// The part of it that no other value shares, 1/sr.
    pub own: f64,
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
    /// The part of it that no other value shares.
    pub own: f64,
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
    /// What all values are wrong by together.
    pub shared: Shared,
}

impl Measurement {
    /// Adds the values of another scan of the same sample; beam, curvature and white standard stay those of the first. Each scan has its own direct beam:
    /// the larger of the shared errors is stated, as if it were common to both.
    pub fn append(&mut self, other: Measurement) {
        self.comments.extend(other.comments);
        self.samples.extend(other.samples);
        self.direct.extend(other.direct);
        self.saturated.extend(other.saturated);
        self.cut.extend(other.cut);
        self.shared = self.shared.larger(other.shared);
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
    out.comments = provenance::comments(contents, &plan, &rig, fingerprint, software, &out);
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
    let mut scattered: Vec<Rate> = Vec::new();
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
        match d.sight(r.reached.from_straight()) {
            Sight::Scattered => {}
            Sight::Straight => {
                straight.push((r.reached, share));
                continue;
            }
            Sight::Cut => {
                out.cut.push(r.reached);
                continue;
            }
        }
        let projected = d.solid_angle() * r.reached.view()[2].abs();
        if projected <= 1e-6 * d.solid_angle() {
            continue; // seen edge-on there is no BSDF
        }
        out.samples.push(Value {
            pose: r.reached,
            f: share.value / projected,
            sigma: share.sigma / projected,
            own: share.noise / projected,
        });
        scattered.push(share);
    }
    let depth = scale.mean_depth(&scattered);
    for (value, share) in out.samples.iter_mut().zip(&scattered) {
        // The exposures bring each value to another depth of the detector's range: what the curvature does beside its mean is the row's own.
        value.own = value.own.hypot(value.f * scale.bend(share.depth - depth));
    }
    out.shared = scale.shared(&scattered);
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
            own: share
                .noise
                .hypot(share.value * scale.bend(share.depth - depth)),
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
