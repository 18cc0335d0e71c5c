//! The log on a failing disk: every state that a cut of the power can leave behind, byte by byte, and disks that refuse.

mod common;

use std::path::Path;
use std::sync::{Arc, Mutex};

use ogm_driver::log::{self, Record, Sink, Writer};
use ogm_driver::merge::merge_log;
use ogm_driver::plan::Plan;
use ogm_driver::rig::Rig;
use ogm_driver::scan::{self, Outcome, Quiet};
use ogm_driver::sim::optics::PlainCloth;
use ogm_driver::sim::{Bench, Device, FaultPlan, MemoryTransport};
use ogm_driver::transport::StopToken;

/// What a disk is asked to do.
#[derive(Clone)]
enum Op {
    Write(Vec<u8>),
    Sync,
}

struct Recorder(Arc<Mutex<Vec<Op>>>);

impl Sink for Recorder {
    fn append(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        self.0.lock().unwrap().push(Op::Write(bytes.to_vec()));
        Ok(())
    }
    fn sync(&mut self) -> std::io::Result<()> {
        self.0.lock().unwrap().push(Op::Sync);
        Ok(())
    }
}

fn scan(log: &Path) -> Outcome {
    let plan = Plan::from_toml("name = 'd'\n[grid]\nkind = 'list'\nposes = [[0, 0, 150, 0], [0, 0, 170, 0], [20, 0, 160, 90]]\n[exposure]\nladder_ms = [1, 8]\n[calibration]\ndark = 1\ndirect = 1\nlinearity = 0\nwhite = false").unwrap();
    let rig = Rig::default().with_instant_motors();
    let bench = Bench::new(rig.clone(), Arc::new(PlainCloth), common::timeless());
    let device = Arc::new(Mutex::new(Device::new(bench, FaultPlan::none())));
    let transport = Box::new(MemoryTransport::new(device));
    scan::run(transport, &rig, &plan, log, &StopToken::new(), &mut Quiet).unwrap()
}

/// The writes and syncs of a whole scan.
fn recorded(records: &[Record]) -> Vec<Op> {
    let ops = Arc::new(Mutex::new(Vec::new()));
    let mut writer = Writer::over(Box::new(Recorder(ops.clone())));
    for r in records {
        writer.append(r).unwrap();
    }
    ops.lock().unwrap().clone()
}

#[test]
fn every_prefix_of_writes_and_syncs_recovers() {
    let folder = common::quick_folder();
    let whole = folder.path().join("whole.ogm");
    assert_eq!(
        scan(&whole).stored,
        5,
        "three poses and two straight through"
    );
    let records = log::read(&whole).unwrap().records;
    let undisturbed = merge_log(&whole).unwrap().to_scan().to_text();
    let (mut synced, mut acknowledged, mut states, mut resumed) = (Vec::new(), 0, 0, 0);
    let mut pending: Vec<u8> = Vec::new();
    for op in recorded(&records) {
        match op {
            Op::Write(bytes) => pending.extend(bytes),
            Op::Sync => {
                synced.append(&mut pending);
                acknowledged += 1;
            }
        }
        // The power fails here: of what was not synced, any beginning may be on the disk, and what follows it may read as zeros.
        for cut in 0..=pending.len() {
            for zeros in [0, 7, pending.len() - cut] {
                let disk = [&synced[..], &pending[..cut], &vec![0; zeros]].concat();
                let found = log::parse(&disk);
                states += 1;
                assert!(found.damage.is_empty(), "a torn tail was taken for damage");
                let n = found.records.len();
                assert!(
                    n == acknowledged || (n == acknowledged + 1 && cut == pending.len()),
                    "{n} of {acknowledged}"
                );
                assert_eq!(found.records[..], records[..n]);
                assert_eq!(found.good_bytes + found.torn_bytes, disk.len() as u64);
                // From the ends and the middle of every write the scan goes on, and nobody sees a difference in the measurement.
                if zeros != 7 && [0, pending.len() / 2, pending.len()].contains(&cut) {
                    let log = folder.path().join("cut.ogm");
                    std::fs::write(&log, &disk).unwrap();
                    assert_eq!(scan(&log).stored, 5);
                    assert!(log::read(&log).unwrap().damage.is_empty());
                    assert_eq!(merge_log(&log).unwrap().to_scan().to_text(), undisturbed);
                    resumed += 1;
                }
            }
        }
    }
    assert_eq!(acknowledged, records.len());
    println!("{states} states of the disk, {resumed} of them resumed to the same measurement");
}

#[test]
fn a_disk_that_fails_ends_the_writing() {
    struct Full(u32);
    impl Sink for Full {
        fn append(&mut self, _: &[u8]) -> std::io::Result<()> {
            self.0 += 1;
            if self.0 > 2 {
                Err(std::io::Error::other("no space left"))
            } else {
                Ok(())
            }
        }
        fn sync(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    let mut w = Writer::over(Box::new(Full(0)));
    w.append(&Record::End { points: 0 }).unwrap();
    w.append(&Record::End { points: 1 }).unwrap();
    let mut refused = |points| w.append(&Record::End { points }).unwrap_err().to_string();
    assert!(refused(2).contains("no space left"));
    assert!(refused(3).contains("failed before"));
}
