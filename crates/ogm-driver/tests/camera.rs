//! A scan with the simulated camera behind an external command: the whole way of any camera, with the real program as the command.

mod common;

use ogm_driver::detector::ExternalDetector;
use ogm_driver::log::{self, Reading, Record, What};
use ogm_driver::merge::merge_log;
use ogm_driver::plan::Plan;
use ogm_driver::rig::Rig;
use ogm_driver::scan::{self, Quiet};
use ogm_driver::serial::SerialTransport;
use ogm_driver::sim::camera::CameraServer;
use ogm_driver::transport::StopToken;

#[test]
fn a_camera_behind_a_command_measures_the_cloth() {
    let rig = Rig::default().with_instant_motors();
    let sim = common::rig_behind_pty(&rig, 1000.0, &[]);
    let folder = tempfile::tempdir().unwrap();
    let socket = folder.path().join("cam0");
    let _camera = CameraServer::start(&socket, sim.device.clone(), sim.clock).unwrap();
    let command = format!("{:?} camera {socket:?}", common::program());
    let plan = Plan::from_toml("name = 'c'\n[grid]\nkind = 'paper'\nlight_elevations = [180]\n[exposure]\nladder_ms = [0.25, 1, 4, 16, 64, 256, 1024]\nf_number = 2.8\n[calibration]\ndark = 2").unwrap();
    let log = folder.path().join("scan.ogm");
    let port = SerialTransport::open(sim.port(), rig.baud, rig.rts_cts).unwrap();
    let detector = Box::new(ExternalDetector::start(&command).unwrap());
    let stop = StopToken::new();
    let outcome = scan::run_with(
        Box::new(port),
        detector,
        &rig,
        &plan,
        &log,
        &stop,
        &mut Quiet,
    )
    .unwrap();
    assert_eq!((outcome.points, outcome.stored), (79, 79));
    let records = log::read(&log).unwrap().records;
    let named = |r: &Record| matches!(r, Record::Session { detector, .. } if detector.contains("simulated camera"));
    assert!(records.iter().any(named));
    let readings: Vec<&Reading> = records
        .iter()
        .filter_map(|r| match r {
            Record::Reading(r) => Some(r),
            _ => None,
        })
        .collect();
    // The f-number stands beside every reading, and the dim poses were bracketed: a probe and a longer exposure.
    assert!(readings.iter().all(|r| r.f_number == 2.8));
    let samples = readings.iter().filter(|r| r.what == What::Sample);
    assert!(
        samples
            .clone()
            .all(|r| r.shots[0].exposure_ms == 0.25 && r.shots.len() >= 2)
    );
    assert!(
        samples
            .clone()
            .any(|r| r.shots.iter().any(|s| s.exposure_ms == 1024.0))
    );
    common::check_plain_cloth(&merge_log(&log).unwrap());
}
