//! A scan looked at again without the rig: every record of the log is checked against the plan and the rig it names, and everything is recomputed.

use std::collections::BTreeMap;

use crate::adaptive;
use crate::error::{Error, Result};
use crate::exposure::USABLE;
use crate::log::{Contents, Reading, Record, What};
use crate::merge::{Measurement, merge_contents};
use crate::plan::Plan;
use crate::rig::Rig;
use crate::scan::fingerprint;

/// What a replay found.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Replay {
    /// Sessions of the scan.
    pub sessions: usize,
    /// Readings of each kind.
    pub readings: BTreeMap<String, usize>,
    /// Poses that the plan asked for and the log lacks.
    pub missing: usize,
    /// Whether the scan was completed.
    pub complete: bool,
    /// Readings with a saturated shortest exposure.
    pub saturated: usize,
    /// What should not be, each a sentence.
    pub findings: Vec<String>,
    /// The measurement, if the log has its scale.
    pub measurement: Option<Measurement>,
}

/// Goes through a log's contents.
///
/// # Errors
/// [`Error::Log`] without a header; [`Error::Plan`], [`Error::Rig`] when the header's texts cannot be read.
pub fn replay(contents: &Contents) -> Result<Replay> {
    let Some(Record::Header {
        plan,
        rig,
        fingerprint: print,
        ..
    }) = contents.records.first()
    else {
        return Err(Error::Log(
            "The file does not begin with the header of a scan log.".into(),
        ));
    };
    let mut out = Replay {
        findings: contents.damage.clone(),
        ..Replay::default()
    };
    if fingerprint(plan, rig) != *print {
        out.findings.push("The plan and the rig in the header do not have the fingerprint that stands beside them.".into());
    }
    let (plan, rig) = (Plan::from_toml(plan)?, Rig::from_toml(rig)?);
    let mut poses = plan.route(&rig)?.poses;
    let readings: Vec<Reading> = contents
        .records
        .iter()
        .filter_map(|r| {
            if let Record::Reading(r) = r {
                Some(r.clone())
            } else {
                None
            }
        })
        .collect();
    // The adaptive part is chosen again from the readings, stage by stage, as the scan did.
    loop {
        let known = |r: &&Reading| r.what == What::Sample && r.index < poses.len();
        let count = readings.iter().filter(known).count();
        if count < poses.len() {
            break;
        }
        let more = adaptive::refine(&plan, &rig, &readings, &poses)?;
        if more.is_empty() {
            break;
        }
        poses.extend(more);
    }
    let mut seen = vec![false; poses.len()];
    let mut before = f64::NEG_INFINITY;
    for r in &readings {
        *out.readings
            .entry(format!("{:?}", r.what).to_lowercase())
            .or_insert(0) += 1;
        check(r, &plan, &rig, &mut out);
        if r.scan_s < before {
            out.findings.push(format!(
                "{:?} {} was read before the record above it.",
                r.what, r.index
            ));
        }
        before = r.scan_s;
        if r.what == What::Sample {
            match seen.get_mut(r.index) {
                Some(s) if *s => out
                    .findings
                    .push(format!("Pose {} stands twice in the log.", r.index)),
                Some(s) => *s = true,
                None => out
                    .findings
                    .push(format!("Pose {} is not in the plan.", r.index)),
            }
            if poses.get(r.index).is_some_and(|p| *p != r.asked) {
                out.findings.push(format!(
                    "Pose {} was asked at {}, the plan has another.",
                    r.index, r.asked
                ));
            }
        }
    }
    out.missing = seen.iter().filter(|s| !**s).count();
    out.sessions = contents
        .records
        .iter()
        .filter(|r| matches!(r, Record::Session { .. }))
        .count();
    out.complete = matches!(contents.records.last(), Some(Record::End { .. }));
    out.measurement = merge_contents(contents).ok();
    Ok(out)
}

fn check(r: &Reading, plan: &Plan, rig: &Rig, out: &mut Replay) {
    let name = format!("{:?} {}", r.what, r.index);
    match rig.pulses(r.asked) {
        Err(e) => out.findings.push(format!("{name}: {e}")),
        Ok(p) if rig.pose(&p) != r.reached => out.findings.push(format!(
            "{name} was asked at {} and stored at {}.",
            r.asked, r.reached
        )),
        Ok(_) => {}
    }
    if r.f_number != plan.exposure.f_number {
        out.findings.push(format!(
            "{name} was taken at f/{}, the plan has f/{}.",
            r.f_number, plan.exposure.f_number
        ));
    }
    let bright =
        |s: &crate::detector::Shot| s.saturated || s.counts > USABLE * rig.detector.full_scale;
    if !r.shots.is_empty() && r.shots.iter().all(bright) {
        out.saturated += 1;
    }
    if r.shots.is_empty() {
        out.findings.push(format!("{name} has no exposure."));
    }
}
