//! The whole path over a real pseudo-terminal with the real serialport crate: scan, log, resume, merge.

mod common;

use std::path::Path;
use std::sync::Arc;

use ogm_driver::error::Error;
use ogm_driver::log::{self, Record, What};
use ogm_driver::merge::merge_log;
use ogm_driver::plan::Plan;
use ogm_driver::rig::Rig;
use ogm_driver::scan::{self, Outcome, Quiet};
use ogm_driver::serial::SerialTransport;
use ogm_driver::sim::optics::PlainCloth;
use ogm_driver::sim::{Bench, Device, FaultPlan, Imperfections, PtyRig};
use ogm_driver::transport::StopToken;

fn start(rig: &Rig, faults: &[&str]) -> PtyRig {
    let faults: Vec<String> = faults.iter().map(ToString::to_string).collect();
    let bench = Bench::new(rig.clone(), Arc::new(PlainCloth), Imperfections::default());
    let device = Device::new(bench, FaultPlan::parse(&faults, 1).unwrap());
    // A thousand times faster than the wall clock: exposures of seconds take milliseconds.
    PtyRig::start(device, 1000.0).unwrap()
}

fn scan_over(sim: &PtyRig, rig: &Rig, plan: &Plan, log: &Path) -> Result<Outcome, Error> {
    let port = SerialTransport::open(sim.port(), rig.baud, rig.rts_cts)?;
    scan::run(
        Box::new(port),
        rig,
        plan,
        log,
        &StopToken::new(),
        &mut Quiet,
    )
}

fn paper() -> Plan {
    Plan::from_toml("name = 'paper'\n[grid]\nkind = 'paper'\nlight_elevations = [180]\n[calibration]\nreference_every = 20").unwrap()
}

fn check_cloth(log: &Path) {
    let m = merge_log(log).unwrap();
    assert_eq!((m.samples.len(), m.direct.len()), (78, 1));
    common::check_plain_cloth(&m);
    let t = m.direct[0];
    assert!(
        (t.transmittance - 0.05).abs() < 5.0 * t.sigma + 1e-4,
        "{t:?}"
    );
    let (white, sigma) = m.white.unwrap();
    assert!((white - 1.0).abs() < 5.0 * sigma + 1e-3, "{white} {sigma}");
}

#[test]
fn a_scan_of_the_papers_grid_over_shot_and_over_grbl() {
    for rig in [
        Rig::default().with_instant_motors(),
        Rig::grbl().with_instant_motors(),
    ] {
        let (folder, sim) = (tempfile::tempdir().unwrap(), start(&rig, &[]));
        let log = folder.path().join("scan.ogm");
        let outcome = scan_over(&sim, &rig, &paper(), &log).unwrap();
        assert_eq!(
            outcome,
            Outcome {
                points: 79,
                stored: 79,
                found: 0
            },
            "{}",
            rig.name
        );
        check_cloth(&log);
        // Once complete, nothing is measured again and nothing is written.
        let before = std::fs::read(&log).unwrap();
        assert_eq!(scan_over(&sim, &rig, &paper(), &log).unwrap().found, 79);
        assert_eq!(std::fs::read(&log).unwrap(), before);
    }
}

#[test]
fn a_scan_cut_by_a_vanished_port_goes_on_where_it_was() {
    let rig = Rig::default().with_instant_motors();
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("scan.ogm");
    let sim = start(&rig, &["vanish@300"]);
    let e = scan_over(&sim, &rig, &paper(), &log).unwrap_err();
    assert!(matches!(e, Error::PortLost { .. }), "{e}");
    let samples = |log: &Path| {
        let records = log::read(log).unwrap().records;
        records
            .iter()
            .filter(|r| matches!(r, Record::Reading(r) if r.what == What::Sample))
            .count()
    };
    let before = samples(&log);
    assert!(before > 5 && before < 79, "{before}");
    let sim = start(&rig, &[]);
    let outcome = scan_over(&sim, &rig, &paper(), &log).unwrap();
    assert_eq!(
        outcome,
        Outcome {
            points: 79,
            stored: 79,
            found: before
        }
    );
    assert_eq!(samples(&log), 79);
    check_cloth(&log);
}

#[test]
fn another_plan_or_a_damaged_log_is_refused_before_a_byte_is_sent() {
    let rig = Rig::default().with_instant_motors();
    let (folder, sim) = (tempfile::tempdir().unwrap(), start(&rig, &[]));
    let log = folder.path().join("scan.ogm");
    let small =
        Plan::from_toml("name = 'a'\n[grid]\nkind = 'list'\nposes = [[0, 0, 150, 0]]").unwrap();
    scan_over(&sim, &rig, &small, &log).unwrap();
    let e = scan_over(&sim, &rig, &paper(), &log)
        .unwrap_err()
        .to_string();
    assert!(e.contains("another plan or rig"), "{e}");
    let mut bytes = std::fs::read(&log).unwrap();
    bytes[2000] ^= 1;
    std::fs::write(&log, &bytes).unwrap();
    let e = scan_over(&sim, &rig, &small, &log).unwrap_err().to_string();
    assert!(e.contains("damaged in the middle"), "{e}");
    assert!(
        merge_log(&log)
            .unwrap_err()
            .to_string()
            .contains("damaged in the middle")
    );
}

#[test]
fn a_port_that_is_not_there_or_taken_is_a_sentence() {
    let e = SerialTransport::open("/dev/nothing-here", 9600, false)
        .err()
        .unwrap()
        .to_string();
    assert!(e.contains("/dev/nothing-here") && e.ends_with('.'), "{e}");
    let rig = Rig::default();
    let sim = start(&rig, &[]);
    let _first = SerialTransport::open(sim.port(), rig.baud, rig.rts_cts).unwrap();
    let e = SerialTransport::open(sim.port(), rig.baud, rig.rts_cts)
        .err()
        .unwrap()
        .to_string();
    assert!(e.contains("Cannot open"), "{e}");
}

#[test]
fn a_plan_beyond_the_limits_sends_nothing() {
    let rig = Rig::default();
    let (folder, sim) = (tempfile::tempdir().unwrap(), start(&rig, &[]));
    sim.device.lock().unwrap().journal = Some(Vec::new());
    for pose in ["[0, 0, 190, 0]", "[30, 0, 32, 0]"] {
        let plan = Plan::from_toml(&format!(
            "name = 'a'\n[grid]\nkind = 'list'\nposes = [[0, 0, 150, 0], {pose}]"
        ))
        .unwrap();
        let log = folder.path().join("never.ogm");
        let e = scan_over(&sim, &rig, &plan, &log).unwrap_err();
        assert!(matches!(e, Error::Limit { .. } | Error::Zone { .. }), "{e}");
        assert!(!log.exists());
    }
    assert_eq!(sim.device.lock().unwrap().journal.as_deref(), Some(&[][..]));
}
