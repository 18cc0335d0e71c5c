//! Random fault scripts on virtual time: every one ends in a sentence within the deadlines or in a complete scan; no point at an unverified pose,
//! no move sent twice, and afterwards a healthy session completes the same log.
//!
//! `OGM_FAULT_SCRIPTS` sets the number of scripts (the suite runs 500); `OGM_SCRIPT=n` runs script n alone and prints its conversation.

mod common;

use std::path::Path;
use std::sync::{Arc, Mutex};

use ogm_driver::error::Error;
use ogm_driver::log::{self, Reading, Record, What};
use ogm_driver::plan::Plan;
use ogm_driver::rig::{Language, Rig};
use ogm_driver::scan::{self, Quiet};
use ogm_driver::sim::device::WireLine;
use ogm_driver::sim::optics::PlainCloth;
use ogm_driver::sim::{Bench, Device, FaultPlan, Imperfections, MemoryTransport};
use ogm_driver::transport::StopToken;

fn plan() -> Plan {
    Plan::from_toml(
        "name = 'faults'\n[grid]\nkind = 'list'\nposes = [[0, 0, 150, 0], [0, 0, 170, 0], [20, 0, 160, 90], [20, 0, 160, -90], [45, 30, 120, 10]]\n\
         [exposure]\nladder_ms = [1, 8, 64]\n[calibration]\ndark = 1\ndirect = 2\nreference_every = 3",
    )
    .unwrap()
}

fn device(rig: &Rig, seed: u64, faults: FaultPlan) -> Arc<Mutex<Device>> {
    let wrong = Imperfections {
        seed,
        ..Imperfections::default()
    };
    let mut device = Device::new(Bench::new(rig.clone(), Arc::new(PlainCloth), wrong), faults);
    device.journal = Some(Vec::new());
    device.bench.exposures = Some(Vec::new());
    Arc::new(Mutex::new(device))
}

fn session(
    device: &Arc<Mutex<Device>>,
    rig: &Rig,
    log: &Path,
) -> (Result<scan::Outcome, Error>, f64) {
    // The clock's last value is kept, so that a hang after the last byte is seen too.
    struct Clocked(MemoryTransport, Arc<Mutex<f64>>);
    impl ogm_driver::transport::Transport for Clocked {
        fn write(&mut self, bytes: &[u8], t: std::time::Duration) -> Result<usize, Error> {
            self.0.write(bytes, t)
        }
        fn read(&mut self, into: &mut Vec<u8>, t: std::time::Duration) -> Result<usize, Error> {
            let n = self.0.read(into, t);
            *self.1.lock().unwrap() = self.0.now().as_secs_f64();
            n
        }
        fn now(&self) -> std::time::Duration {
            self.0.now()
        }
        fn wait(&mut self, t: std::time::Duration) {
            self.0.wait(t);
        }
        fn name(&self) -> String {
            self.0.name()
        }
    }
    let end = Arc::new(Mutex::new(0.0));
    let transport = Box::new(Clocked(MemoryTransport::new(device.clone()), end.clone()));
    let result = scan::run(transport, rig, &plan(), log, &StopToken::new(), &mut Quiet);
    let end = *end.lock().unwrap();
    (result, end)
}

/// Longest time the host may be silent after a line: its deadline, and the time it knows a move takes.
fn patience(rig: &Rig, line: &str) -> f64 {
    match line {
        l if l.starts_with("$H") => rig.home_s as f64,
        l if l.starts_with("@R") => 1.0 + 0.064 * 1.1,
        // After the go-ahead of a move the host sleeps through the travel it expects: at most 370° at 20°/s.
        l if l.starts_with("G:") || l.starts_with("$J") => 1.0 + 370.0 / 20.0 + 0.4,
        _ => 1.0,
    }
}

fn check_journal(rig: &Rig, journal: &[WireLine], end: f64, script: u64) {
    let sent: Vec<&WireLine> = journal.iter().filter(|l| l.to_rig).collect();
    for pair in sent.windows(2) {
        let gap = pair[1].at - pair[0].at;
        // A jump of the simulation's clock by an hour (or two jumps) is not a wait.
        let gap = gap - 3600.0 * ((gap + 1.0) / 3600.0).floor();
        assert!(
            gap <= 2.0 * patience(rig, &pair[0].text),
            "script {script}: silent for {gap} s after {:?}",
            pair[0].text
        );
    }
    if let Some(last) = sent.last() {
        assert!(
            end - last.at <= 2.0 * patience(rig, &last.text),
            "script {script}: returned {} s after the last line",
            end - last.at
        );
    }
    let moves: Vec<&str> = sent
        .iter()
        .map(|l| l.text.as_str())
        .filter(|t| t.starts_with("A:") || t.starts_with("$J="))
        .collect();
    for pair in moves.windows(2) {
        assert_ne!(pair[0], pair[1], "script {script}: a move was repeated");
    }
    let goes = sent
        .windows(2)
        .filter(|p| p[0].text == "G:" && p[1].text == "G:")
        .count();
    assert_eq!(goes, 0, "script {script}: a start was repeated");
}

fn readings(log: &Path) -> Vec<Reading> {
    let contents = log::read(log).unwrap();
    assert!(contents.damage.is_empty());
    contents
        .records
        .into_iter()
        .filter_map(|r| {
            if let Record::Reading(r) = r {
                Some(r)
            } else {
                None
            }
        })
        .collect()
}

fn check_poses(device: &Arc<Mutex<Device>>, new: &[Reading], script: u64) {
    let device = device.lock().unwrap();
    let exposures = device.bench.exposures.as_deref().unwrap();
    for r in new.iter().filter(|r| r.what != What::Dark) {
        let kind = if r.what == What::Sample { 6 } else { continue };
        let first = (kind << 40) | ((r.index as u64) << 8);
        let mine: Vec<_> = exposures
            .iter()
            .filter(|(tag, _, _)| (first..first + 256).contains(tag))
            .collect();
        assert!(!mine.is_empty());
        for (_, pose, moving) in mine {
            let off = pose
                .angles()
                .iter()
                .zip(r.reached.angles())
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max);
            assert!(
                off < 1e-6 && !moving,
                "script {script}: point {} stored as {} but the arms were at {pose}",
                r.index,
                r.reached
            );
        }
    }
}

fn run_script(script: u64, folder: &Path, show: bool) -> (bool, String) {
    let mut rig = if script.is_multiple_of(2) {
        Rig::default()
    } else {
        Rig::grbl()
    };
    if script % 4 < 2 {
        rig = rig.with_instant_motors();
    }
    rig.home_s = 60;
    let lines = if rig.language == Language::Shot {
        260
    } else {
        330
    };
    let log = folder.join(format!("{script}.ogm"));
    let faults = FaultPlan::random(script, lines);
    if show {
        println!("{faults:?}");
    }
    let first = device(&rig, script, faults);
    let (result, end) = session(&first, &rig, &log);
    let journal = first.lock().unwrap().journal.take().unwrap();
    if show {
        for l in &journal {
            println!(
                "{:9.3} {} {}",
                l.at,
                if l.to_rig { '>' } else { '<' },
                l.text
            );
        }
        println!("{result:?}");
    }
    check_journal(&rig, &journal, end, script);
    let before = if log.exists() {
        readings(&log)
    } else {
        Vec::new()
    };
    check_poses(&first, &before, script);
    let text = match &result {
        Ok(_) => String::new(),
        Err(e) => e.to_string(),
    };
    assert!(
        text.is_empty() || (text.ends_with('.') && text.len() > 30),
        "script {script}: {text:?} is no sentence"
    );
    // A healthy rig completes the log.
    let second = device(&rig, script, FaultPlan::none());
    let (again, _) = session(&second, &rig, &log);
    let outcome = again.unwrap_or_else(|e| panic!("script {script}: no recovery: {e}"));
    assert_eq!((outcome.points, outcome.stored), (8, 8));
    let all = readings(&log);
    check_poses(&second, &all[before.len()..], script);
    let mut indices: Vec<usize> = all
        .iter()
        .filter(|r| r.what == What::Sample)
        .map(|r| r.index)
        .collect();
    indices.sort_unstable();
    assert_eq!(
        indices,
        (0..8).collect::<Vec<_>>(),
        "script {script}: each point once"
    );
    std::fs::remove_file(&log).unwrap();
    // The variant's name is enough for the table.
    let kind = result.as_ref().err().map_or_else(String::new, |e| {
        format!("{e:?}")
            .chars()
            .take_while(char::is_ascii_alphanumeric)
            .collect()
    });
    (result.is_ok(), kind)
}

#[test]
fn random_fault_scripts_end_in_a_sentence_and_are_recovered_from() {
    let count = common::number("OGM_FAULT_SCRIPTS", 500);
    let folder = common::quick_folder();
    if let Some(script) = std::env::var("OGM_SCRIPT")
        .ok()
        .and_then(|s| s.parse().ok())
    {
        run_script(script, folder.path(), true);
        return;
    }
    let mut unharmed = 0;
    let mut sentences = std::collections::BTreeMap::new();
    for script in 0..count {
        let (ok, text) = run_script(script, folder.path(), false);
        unharmed += u64::from(ok);
        *sentences.entry(text).or_insert(0_u32) += 1;
    }
    println!("{count} scripts: {unharmed} scans completed in spite of them; the others ended so:");
    for (text, n) in &sentences {
        println!("{n:6}  {text}");
    }
    assert!(
        unharmed > 0 && sentences.len() > 8,
        "the scripts should do both: pass and fail in many ways"
    );
}

#[test]
fn named_faults_have_their_sentence() {
    let folder = common::quick_folder();
    for (fault, word) in [
        ("vanish@20", "went away"),
        ("limit@20", "limit sensor stopped"),
        ("stall@20", "should be at"),
        ("overshoot@20", "should be at"),
        ("ng@20", "refused"),
        ("power-cycle@50", "longer than the move can take"),
        ("lamp-off@60", "lamp went out"),
        ("drop~1", "No reply from the rig within 1 s after ?:N"),
    ] {
        let rig = Rig::default().with_instant_motors();
        let log = folder.path().join("x.ogm");
        let device = device(&rig, 1, FaultPlan::parse(&[fault.into()], 1).unwrap());
        let text = session(&device, &rig, &log).0.unwrap_err().to_string();
        assert!(text.contains(word), "{fault}: {text}");
        let _ = std::fs::remove_file(&log);
    }
}

#[test]
fn a_cold_lamp_is_waited_for_and_a_dark_one_refused() {
    let folder = common::quick_folder();
    let rig = Rig::default().with_instant_motors();
    let log = folder.path().join("x.ogm");
    let cold = device(&rig, 1, FaultPlan::none());
    cold.lock().unwrap().bench.wrong.lamp_on_s = 60.0;
    let (result, end) = session(&cold, &rig, &log);
    result.unwrap();
    assert!(end > 29.0 * 60.0, "the scan began after {end} s");
    let log = folder.path().join("y.ogm");
    let dark = device(&rig, 1, FaultPlan::none());
    dark.lock().unwrap().bench.lamp_off_at = Some(0.0);
    let text = session(&dark, &rig, &log).0.unwrap_err().to_string();
    assert!(text.contains("The lamp is off"), "{text}");
}
