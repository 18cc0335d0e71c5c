//! Where a measurement comes from, as comment lines: program, plan, sample, rig, devices, corrections, what was left out.

use super::Measurement;
use crate::log::{Contents, Record};
use crate::plan::Plan;
use crate::rig::Rig;

/// The comment lines of a measurement: what made it, of which sample, with which devices, how it was corrected.
pub(super) fn comments(
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
