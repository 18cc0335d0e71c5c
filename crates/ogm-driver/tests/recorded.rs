//! A recorded conversation played back without the rig gives the same log.

mod common;

use std::sync::{Arc, Mutex};

use ogm_driver::log::{self, Record};
use ogm_driver::plan::Plan;
use ogm_driver::recorded::{Playback, Recorder};
use ogm_driver::rig::Rig;
use ogm_driver::scan::{self, Quiet};
use ogm_driver::serial::SerialTransport;
use ogm_driver::sim::optics::PlainCloth;
use ogm_driver::sim::{Bench, Device, FaultPlan, MemoryTransport};
use ogm_driver::transport::{StopToken, Transport};

const PLAN: &str = "name = 'w'\n[grid]\nkind = 'list'\nposes = [[0, 0, 150, 0], [20, 0, 160, 90], [45, 30, 120, 10]]\n[exposure]\nladder_ms = [1, 8, 64]\n[calibration]\ndark = 1\ndirect = 1\nlinearity = 1";

/// The records without the moments of the wall clock, which a playback cannot know.
fn records(path: &std::path::Path) -> Vec<Record> {
    let mut records = log::read(path).unwrap().records;
    for r in &mut records {
        match r {
            Record::Session { wall_s, .. } => *wall_s = 0.0,
            Record::Reading(r) => (r.wall_s, r.scan_s) = (0.0, 0.0),
            _ => {}
        }
    }
    records
}

#[test]
fn a_recording_gives_the_same_log_again() {
    let plan = Plan::from_toml(PLAN).unwrap();
    for (k, rig) in [Rig::default(), Rig::grbl(), Rig::default()]
        .into_iter()
        .enumerate()
    {
        let folder = common::quick_folder();
        let (wire, first, again) = (
            folder.path().join("wire.txt"),
            folder.path().join("a.ogm"),
            folder.path().join("b.ogm"),
        );
        let rig = rig.with_instant_motors();
        // Twice on virtual time with mishaps on the line, once over a pseudo-terminal on real time.
        let faults = FaultPlan::parse(
            &[
                "duplicate~0.1".into(),
                "delay:0.2~0.1".into(),
                "split~0.2".into(),
            ],
            1,
        )
        .unwrap();
        let bench = Bench::new(rig.clone(), Arc::new(PlainCloth), common::timeless());
        let device = Arc::new(Mutex::new(Device::new(bench, faults)));
        let sim = common::rig_behind_pty(&rig, 1000.0, &[]);
        let inner: Box<dyn Transport> = if k < 2 {
            Box::new(MemoryTransport::new(device))
        } else {
            Box::new(SerialTransport::open(sim.port(), rig.baud, rig.rts_cts).unwrap())
        };
        let run = |transport, log| {
            scan::run(transport, &rig, &plan, log, &StopToken::new(), &mut Quiet).unwrap()
        };
        let recorder = Box::new(Recorder::new(inner, &wire).unwrap());
        let outcome = run(recorder, &first);
        assert_eq!(outcome.stored, 6);
        assert_eq!(
            run(Box::new(Playback::open(&wire).unwrap()), &again),
            outcome
        );
        assert_eq!(records(&again), records(&first), "{}", rig.name);
        // Another plan says something else on the wire, and is told where.
        let other = Plan::from_toml(&PLAN.replace("150", "151")).unwrap();
        let playback = Box::new(Playback::open(&wire).unwrap());
        let log = folder.path().join("c.ogm");
        let e = scan::run(playback, &rig, &other, &log, &StopToken::new(), &mut Quiet)
            .unwrap_err()
            .to_string();
        assert!(e.contains("the driver says") && e.contains("line "), "{e}");
    }
}
