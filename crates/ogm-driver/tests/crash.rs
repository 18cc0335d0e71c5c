//! Crashes: `kill -9` of a real scan over a real pseudo-terminal, every prefix of the log's write and fsync sequence, and the stop on request.
//!
//! `OGM_KILLS` and `OGM_KILL_POINTS` set the size of the kill test (the suite: 8 kills in 150 points), `OGM_STOPS` the number of stops (24).

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use ogm_driver::error::Error;
use ogm_driver::log::{self, Record, Sink, What, Writer};
use ogm_driver::plan::Plan;
use ogm_driver::rig::Rig;
use ogm_driver::scan::{self, Quiet};
use ogm_driver::serial::SerialTransport;
use ogm_driver::sim::noise::Noise;
use ogm_driver::sim::optics::PlainCloth;
use ogm_driver::sim::{Bench, Device, FaultPlan, Imperfections, PtyRig};
use ogm_driver::transport::StopToken;

fn number(name: &str, usual: u64) -> u64 {
    std::env::var(name)
        .ok()
        .and_then(|s| s.parse().ok())
        .unwrap_or(usual)
}

/// The program under test; `OGM_PROGRAM` names another build of it.
fn program() -> String {
    std::env::var("OGM_PROGRAM").unwrap_or_else(|_| env!("CARGO_BIN_EXE_ogm").into())
}

fn rig_behind_pty(rig: &Rig, speed: f64, faults: &[String]) -> PtyRig {
    // A lamp without warm-up: the readings do not depend on when they are taken, so that an interrupted scan can equal an undisturbed one.
    let wrong = Imperfections {
        warm_up_share: 0.0,
        ..Imperfections::default()
    };
    let bench = Bench::new(rig.clone(), Arc::new(PlainCloth), wrong);
    PtyRig::start(
        Device::new(bench, FaultPlan::parse(faults, 1).unwrap()),
        speed,
    )
    .unwrap()
}

fn child(port: &str, folder: &Path, log: &str) -> Child {
    Command::new(program())
        .args([
            "scan",
            "--verbose",
            "--rig",
            "instant",
            "--port",
            port,
            "--plan",
            "plan.toml",
            "-o",
            log,
        ])
        .current_dir(folder)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn export(folder: &Path, log: &str) -> Vec<u8> {
    let done = Command::new(program())
        .args(["merge", log, "-o", "out.csv"])
        .current_dir(folder)
        .output()
        .unwrap();
    assert!(
        done.status.success(),
        "{}",
        String::from_utf8_lossy(&done.stderr)
    );
    std::fs::read(folder.join("out.csv")).unwrap()
}

#[test]
fn kill_9_loses_nothing_doubles_nothing_and_changes_nothing() {
    let (kills, points) = (number("OGM_KILLS", 8), number("OGM_KILL_POINTS", 150));
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let plan = format!(
        "name = 'kill'\n[grid]\nkind = 'random'\ncount = {points}\nseed = 4\ntheta_max = 70\n[exposure]\nladder_ms = [1, 16, 256]\n"
    );
    std::fs::write(
        folder.join("plan.toml"),
        format!("straight_through = false\n{plan}"),
    )
    .unwrap();
    let rig = Rig::default().with_instant_motors();
    let sim = rig_behind_pty(&rig, 1000.0, &[]);

    let whole = child(sim.port(), folder, "whole.ogm")
        .wait_with_output()
        .unwrap();
    assert!(
        whole.status.success(),
        "{}",
        String::from_utf8_lossy(&whole.stderr)
    );
    let undisturbed = export(folder, "whole.ogm");

    let mut acknowledged: Vec<usize> = Vec::new();
    let (mut noise, mut torn, mut killed, mut starved) = (Noise::at(&[77]), 0, 0, 0);
    loop {
        let mut c = child(sim.port(), folder, "cut.ogm");
        let out = BufReader::new(c.stdout.take().unwrap());
        // Half of the kills fall anywhere, half within the first stored points after a restart.
        let wait = if killed >= kills {
            3600.0
        } else {
            noise.uniform() * if killed % 2 == 0 { 0.4 } else { 0.15 }
        };
        let pid = c.id();
        let reader = std::thread::spawn(move || {
            let lines = out.lines().map_while(Result::ok);
            lines
                .filter_map(|l| {
                    l.strip_prefix("stored Sample ")
                        .map(|n| n.parse::<usize>().unwrap())
                })
                .collect::<Vec<_>>()
        });
        let end = Instant::now() + Duration::from_secs_f64(wait);
        let status = loop {
            if let Some(status) = c.try_wait().unwrap() {
                break Some(status);
            }
            if Instant::now() >= end {
                c.kill().unwrap(); // SIGKILL
                c.wait().unwrap();
                break None;
            }
            std::thread::sleep(Duration::from_millis(1));
        };
        acknowledged.extend(reader.join().unwrap());
        match status {
            Some(s) => {
                let mut text = String::new();
                std::io::Read::read_to_string(&mut c.stderr.take().unwrap(), &mut text).unwrap();
                if s.success() {
                    break;
                }
                // A machine too busy to serve the simulated rig within a second ends a scan as a kill does; a healthy one never.
                assert!(
                    text.starts_with("No reply from the rig"),
                    "process {pid}: {text}"
                );
                starved += 1;
                assert!(starved <= 20, "process {pid}: {text}");
                continue;
            }
            None => killed += 1,
        }
        if let Ok(contents) = log::read(&folder.join("cut.ogm")) {
            assert!(contents.damage.is_empty());
            torn += u32::from(contents.torn_bytes > 0);
        }
    }
    let contents = log::read(&folder.join("cut.ogm")).unwrap();
    let mut stored: Vec<usize> = contents
        .records
        .iter()
        .filter_map(|r| {
            if let Record::Reading(r) = r {
                Some(r)
            } else {
                None
            }
        })
        .filter(|r| r.what == What::Sample)
        .map(|r| r.index)
        .collect();
    stored.sort_unstable();
    acknowledged.sort_unstable();
    assert_eq!(
        stored,
        (0..points as usize).collect::<Vec<_>>(),
        "every point once"
    );
    let mut once = acknowledged.clone();
    once.dedup();
    assert_eq!(
        once.len(),
        acknowledged.len(),
        "a point was acknowledged twice"
    );
    assert!(
        acknowledged.iter().all(|a| stored.binary_search(a).is_ok()),
        "an acknowledged point is not in the log"
    );
    assert_eq!(
        export(folder, "cut.ogm"),
        undisturbed,
        "the measurement differs from the undisturbed one"
    );
    println!(
        "{killed} kills in {points} points: {} acknowledged, {torn} torn tails, 0 lost, {starved} starved, export identical",
        acknowledged.len()
    );
    assert!(killed > 0);
}

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

#[test]
fn every_prefix_of_writes_and_syncs_recovers() {
    let ops = Arc::new(Mutex::new(Vec::new()));
    let mut writer = Writer::over(Box::new(Recorder(ops.clone())));
    let records: Vec<Record> = (0..40).map(|points| Record::End { points }).collect();
    for r in &records {
        writer.append(r).unwrap();
    }
    let ops = ops.lock().unwrap().clone();
    let (mut synced, mut acknowledged, mut states) = (Vec::new(), 0, 0);
    let mut pending: Vec<u8> = Vec::new();
    for op in &ops {
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
            }
        }
    }
    assert_eq!(acknowledged, records.len());
    println!("{states} states of the disk");
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
    assert!(
        w.append(&Record::End { points: 2 })
            .unwrap_err()
            .to_string()
            .contains("no space left")
    );
    assert!(
        w.append(&Record::End { points: 3 })
            .unwrap_err()
            .to_string()
            .contains("failed before")
    );
}

/// Pulls the token at `when` after the scan's start and returns the time until the stop bytes arrived at the rig, and the last line before them.
fn one_stop(
    rig: &Rig,
    plan: &Plan,
    when: Duration,
    faults: &[String],
    folder: &Path,
) -> Option<(Duration, String, Duration)> {
    let sim = rig_behind_pty(rig, 1.0, faults);
    sim.device.lock().unwrap().journal = Some(Vec::new());
    let port = SerialTransport::open(sim.port(), rig.baud, rig.rts_cts).unwrap();
    let stop = StopToken::new();
    let (token, log) = (
        stop.clone(),
        folder.join(format!("{:?}.ogm", std::thread::current().id())),
    );
    let pulled = std::thread::spawn(move || {
        std::thread::sleep(when);
        let moment = Instant::now();
        token.stop();
        // What this machine does to a thread that merely sleeps two slices, at this very moment.
        std::thread::sleep(Duration::from_millis(10));
        (
            moment,
            moment.elapsed().saturating_sub(Duration::from_millis(10)),
        )
    });
    let result = scan::run(Box::new(port), rig, plan, &log, &stop, &mut Quiet);
    let (moment, control) = pulled.join().unwrap();
    let _ = std::fs::remove_file(&log);
    if !matches!(result, Err(Error::Stopped)) {
        return None; // it had ended before
    }
    let end = Instant::now() + Duration::from_secs(2);
    loop {
        let device = sim.device.lock().unwrap();
        let journal = device.journal.as_deref().unwrap();
        if let Some(at) = journal
            .iter()
            .position(|l| l.to_rig && (l.text == "L:E" || l.text == "'!'"))
        {
            // During `home` a stop is part of the procedure: only one sent after the request counts.
            let late = journal[at..]
                .iter()
                .find(|l| l.wall >= moment && l.to_rig && (l.text == "L:E" || l.text == "'!'"));
            if let Some(line) = late {
                let before = journal
                    .iter()
                    .rfind(|l| l.to_rig && l.wall < moment)
                    .map_or(String::new(), |l| l.text.clone());
                return Some((line.wall - moment, before, control));
            }
        }
        assert!(Instant::now() < end, "no stop bytes within two seconds");
        drop(device);
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn stop_bytes_go_out_within_50_ms_homing_moving_exposing_or_waiting() {
    let count = number("OGM_STOPS", 24);
    let folder = tempfile::tempdir().unwrap();
    let plan = Plan::from_toml("name = 's'\n[grid]\nkind = 'random'\ncount = 20\nseed = 1\n[exposure]\nladder_ms = [1, 50, 200]\n[calibration]\ndark = 1\ndirect = 1\nwhite = false").unwrap();
    let results: Mutex<Vec<(Duration, String, Duration)>> = Mutex::new(Vec::new());
    let next = std::sync::atomic::AtomicU64::new(0);
    std::thread::scope(|s| {
        for _ in 0..4 {
            s.spawn(|| {
                loop {
                    let k = next.fetch_add(1, std::sync::atomic::Ordering::SeqCst);
                    if k >= count {
                        return;
                    }
                    let mut noise = Noise::at(&[k, 5]);
                    let rig = if k.is_multiple_of(2) {
                        Rig::default()
                    } else {
                        Rig::grbl()
                    };
                    // Every fourth rig falls silent at some line: the stop comes while the driver waits for an answer.
                    let faults = if k % 4 == 1 || k % 4 == 2 {
                        (0..40)
                            .map(|i| format!("drop@{}", 8 + noise.below(10) + i))
                            .collect()
                    } else {
                        Vec::new()
                    };
                    let when = Duration::from_secs_f64(0.05 + 1.5 * noise.uniform());
                    if let Some(r) = one_stop(&rig, &plan, when, &faults, folder.path()) {
                        results.lock().unwrap().push(r);
                    }
                }
            });
        }
    });
    let mut results = results.into_inner().unwrap();
    results.sort();
    let n = results.len();
    assert!(
        n as u64 * 10 >= count * 7,
        "{n} of {count} scans were still running when stopped"
    );
    let (median, p99, worst) = (
        results[n / 2].0,
        results[(n * 99).div_ceil(100) - 1].0,
        results[n - 1].0,
    );
    let mut places = std::collections::BTreeMap::new();
    for (_, line, _) in &results {
        *places
            .entry(line.chars().take(3).collect::<String>())
            .or_insert(0) += 1;
    }
    let mut control: Vec<Duration> = results.iter().map(|r| r.2).collect();
    control.sort();
    let control = control[(n * 99).div_ceil(100) - 1];
    println!("a thread that only sleeps was late by {control:?} (p99) on this machine");
    println!(
        "{n} stops: median {median:?}, p99 {p99:?}, worst {worst:?}; last line before the stop: {places:?}"
    );
    // A suite shares its cores with other tests, so it holds the median to the promise: a stop that waited for an answer or
    // a deadline would miss it by far. The 99th percentile is measured on a quiet machine with OGM_STOPS=1000.
    let held = if n >= 100 { p99 } else { median };
    assert!(
        held <= Duration::from_millis(50) + control,
        "median {median:?}, p99 {p99:?}"
    );
}
