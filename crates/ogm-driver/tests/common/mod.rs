//! Shared by the tests.
#![allow(dead_code, reason = "each test uses its share")]

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};

use ogm_driver::merge::{Measurement, merge_log};
use ogm_driver::plan::Plan;
use ogm_driver::rig::Rig;
use ogm_driver::scan::{self, Quiet};
use ogm_driver::sim::optics::{PlainCloth, Sample};
use ogm_driver::sim::{Bench, Device, FaultPlan, Imperfections, MemoryTransport, PtyRig};
use ogm_driver::transport::StopToken;

/// A temporary folder in memory where the system has one: tests on virtual time are about the log's contents, not about how fast a disk syncs.
pub(crate) fn quick_folder() -> tempfile::TempDir {
    tempfile::tempdir_in("/dev/shm")
        .or_else(|_| tempfile::tempdir())
        .unwrap()
}

/// A size set by an environment variable, or the suite's usual one.
pub(crate) fn number(name: &str, usual: u64) -> u64 {
    std::env::var(name)
        .ok()
        .and_then(|s| s.parse().ok())
        .unwrap_or(usual)
}

/// A lamp without warm-up: readings do not depend on when they are taken, so that an interrupted scan can equal an undisturbed one.
pub(crate) fn timeless() -> Imperfections {
    Imperfections {
        warm_up_share: 0.0,
        ..Imperfections::default()
    }
}

/// A plain cloth on a simulated rig behind a pseudo-terminal, `speed` times as fast as the wall clock.
pub(crate) fn rig_behind_pty(rig: &Rig, speed: f64, faults: &[String]) -> PtyRig {
    let bench = Bench::new(rig.clone(), Arc::new(PlainCloth), timeless());
    let device = Device::new(bench, FaultPlan::parse(faults, 1).unwrap());
    PtyRig::start(device, speed).unwrap()
}

/// Every scattered value of the merged log is the plain cloth's: the aperture of one degree blurs a 12° Gaussian by under 0.1 %; five
/// standard errors beside it.
pub(crate) fn check_plain_cloth(measurement: &Measurement) {
    for s in &measurement.samples {
        let truth = PlainCloth.bsdf(s.pose.light(), s.pose.view());
        assert!(
            (s.f - truth).abs() < 0.001 * truth + 5.0 * s.sigma,
            "{}: {} +- {} for {truth}",
            s.pose,
            s.f,
            s.sigma
        );
    }
}

/// The program under test; `OGM_PROGRAM` names another build of it.
pub(crate) fn program() -> String {
    std::env::var("OGM_PROGRAM").unwrap_or_else(|_| env!("CARGO_BIN_EXE_ogm").into())
}

/// `ogm` with arguments, in a folder.
pub(crate) fn start_ogm(folder: &Path, arguments: &[&str]) -> Child {
    Command::new(program())
        .args(arguments)
        .current_dir(folder)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// Runs `ogm` to its end; returns its standard output.
pub(crate) fn ogm(folder: &Path, arguments: &[&str]) -> String {
    let done = start_ogm(folder, arguments).wait_with_output().unwrap();
    let error = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success(), "ogm {arguments:?}: {error}");
    String::from_utf8_lossy(&done.stdout).into_owned()
}

/// Scans a sample in memory, on virtual time, and merges the log.
pub(crate) fn measure(
    rig: &Rig,
    sample: Arc<dyn Sample>,
    wrong: Imperfections,
    plan: &Plan,
) -> Measurement {
    let device = Arc::new(Mutex::new(Device::new(
        Bench::new(rig.clone(), sample, wrong),
        FaultPlan::none(),
    )));
    let folder = quick_folder();
    let log = folder.path().join("x.ogm");
    scan::run(
        Box::new(MemoryTransport::new(device)),
        rig,
        plan,
        &log,
        &StopToken::new(),
        &mut Quiet,
    )
    .unwrap();
    merge_log(&log).unwrap()
}
