//! Replay: a good scan has no findings; one that was tampered with has.

use std::sync::{Arc, Mutex};

use ogm_driver::log::{self, Record, What};
use ogm_driver::plan::Plan;
use ogm_driver::replay::replay;
use ogm_driver::rig::Rig;
use ogm_driver::scan::{self, Quiet};
use ogm_driver::sim::optics::PlainCloth;
use ogm_driver::sim::{Bench, Device, FaultPlan, Imperfections, MemoryTransport};
use ogm_driver::transport::StopToken;

#[test]
fn a_good_scan_replays_without_findings_and_a_changed_one_with() {
    let plan = Plan::from_toml("name = 'r'\n[grid]\nkind = 'adaptive'\nfirst_step = 40").unwrap();
    let rig = Rig::default().with_instant_motors();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("r.ogm");
    let bench = Bench::new(rig.clone(), Arc::new(PlainCloth), Imperfections::default());
    let device = Arc::new(Mutex::new(Device::new(bench, FaultPlan::none())));
    let outcome = scan::run(
        Box::new(MemoryTransport::new(device)),
        &rig,
        &plan,
        &path,
        &StopToken::new(),
        &mut Quiet,
    )
    .unwrap();
    let contents = log::read(&path).unwrap();
    let r = replay(&contents).unwrap();
    assert_eq!(r.findings, Vec::<String>::new());
    assert!(
        r.complete && r.missing == 0 && r.sessions == 1 && r.readings["sample"] == outcome.points
    );
    assert_eq!(
        r.measurement,
        Some(ogm_driver::merge::merge_log(&path).unwrap())
    );

    let mut moved = contents.clone();
    let reading = moved.records.iter_mut().find_map(|r| match r {
        Record::Reading(r) if r.what == What::Sample => Some(r),
        _ => None,
    });
    reading.unwrap().reached.theta_v -= 1.0;
    assert!(replay(&moved).unwrap().findings[0].contains("was asked at"));

    let mut twice = contents.clone();
    let last = twice
        .records
        .iter()
        .rfind(|r| matches!(r, Record::Reading(_)))
        .unwrap()
        .clone();
    twice.records.push(last);
    assert!(
        replay(&twice)
            .unwrap()
            .findings
            .iter()
            .any(|f| f.contains("twice"))
    );

    let mut header = contents;
    if let Record::Header { plan, .. } = &mut header.records[0] {
        *plan = plan.replace("'r'", "'s'").replace("\"r\"", "\"s\"");
    }
    assert!(replay(&header).unwrap().findings[0].contains("fingerprint"));
}
