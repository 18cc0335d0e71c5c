//! `kill -9` of real scans over a real pseudo-terminal: no acknowledged point is lost, none stands twice, and the measurement is that of an
//! undisturbed scan to the last byte.
//!
//! `OGM_KILLS` and `OGM_KILL_POINTS` set the size (the suite: 8 kills in 150 points; the promise: 1000 in 4800).

mod common;

use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::Child;
use std::time::Duration;

use ogm_driver::log::{self, Record, What};
use ogm_driver::rig::Rig;
use ogm_driver::sim::PtyRig;
use ogm_driver::sim::noise::Noise;

/// When the power fails in a session.
enum Moment {
    /// This long after the start: reading the log, opening the port, homing, calibrating.
    After(Duration),
    /// This long after so many points were acknowledged: moving, exposing, writing, syncing.
    Points(u64, Duration),
    /// Never.
    Never,
}

fn moment(noise: &mut Noise) -> Moment {
    if noise.below(4) == 0 {
        Moment::After(Duration::from_secs_f64(0.12 * noise.uniform()))
    } else {
        let within_a_point = Duration::from_secs_f64(0.008 * noise.uniform());
        Moment::Points(noise.below(10), within_a_point)
    }
}

/// How a session ended, and the points it acknowledged.
struct Session {
    killed: bool,
    acknowledged: Vec<usize>,
    error: String,
    success: bool,
}

fn session(mut child: Child, moment: &Moment) -> Session {
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let (mut acknowledged, mut killed) = (Vec::new(), false);
    if let Moment::After(time) = moment {
        std::thread::sleep(*time);
        killed = child.kill().is_ok(); // SIGKILL
    }
    // What stood in the pipe before the kill was acknowledged, too.
    while let Some(Ok(line)) = lines.next() {
        if let Some(n) = line.strip_prefix("stored Sample ") {
            acknowledged.push(n.parse().unwrap());
        }
        if let Moment::Points(n, time) = moment
            && !killed
            && acknowledged.len() as u64 >= *n
        {
            std::thread::sleep(*time);
            killed = child.kill().is_ok();
        }
    }
    let status = child.wait().unwrap();
    let mut error = String::new();
    child
        .stderr
        .take()
        .unwrap()
        .read_to_string(&mut error)
        .unwrap();
    Session {
        killed: killed && status.code().is_none(),
        acknowledged,
        error,
        success: status.success(),
    }
}

fn scan(sim: &PtyRig, folder: &Path, log: &str) -> Child {
    let arguments = [
        "scan",
        "--verbose",
        "--rig",
        "rig.toml",
        "--port",
        sim.port(),
        "--plan",
        "plan.toml",
        "-o",
        log,
    ];
    common::start_ogm(folder, &arguments)
}

fn export(folder: &Path, log: &str) -> Vec<u8> {
    common::ogm(folder, &["merge", log, "-o", "out.csv"]);
    std::fs::read(folder.join("out.csv")).unwrap()
}

#[test]
fn kill_9_loses_nothing_doubles_nothing_and_changes_nothing() {
    let kills = common::number("OGM_KILLS", 8);
    let points = common::number("OGM_KILL_POINTS", 150);
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let plan = format!(
        "straight_through = false\nname = 'kill'\n[grid]\nkind = 'random'\ncount = {points}\nseed = 4\ntheta_max = 70\n[exposure]\nladder_ms = [1, 16, 256]\n"
    );
    std::fs::write(folder.join("plan.toml"), plan).unwrap();
    let mut rig = Rig::default();
    for axis in &mut rig.axes {
        axis.degrees_per_pulse = 0.02; // half a turn in 20 ms at the fastest pulse rate the controller knows
    }
    let rig = rig.with_instant_motors();
    std::fs::write(folder.join("rig.toml"), toml::to_string(&rig).unwrap()).unwrap();
    let sim = common::rig_behind_pty(&rig, 1000.0, &[]);
    let whole = session(scan(&sim, folder, "whole.ogm"), &Moment::Never);
    assert!(whole.success, "{}", whole.error);
    let undisturbed = export(folder, "whole.ogm");

    let (mut acknowledged, mut noise) = (Vec::new(), Noise::at(&[77]));
    let (mut killed, mut torn, mut starved) = (0, 0, 0);
    loop {
        let moment = if killed < kills {
            moment(&mut noise)
        } else {
            Moment::Never
        };
        let end = session(scan(&sim, folder, "cut.ogm"), &moment);
        acknowledged.extend(end.acknowledged);
        if let Ok(contents) = log::read(&folder.join("cut.ogm")) {
            assert!(contents.damage.is_empty(), "{:?}", contents.damage);
            torn += u32::from(contents.torn_bytes > 0);
        }
        if end.killed {
            killed += 1;
        } else if end.success {
            break;
        } else {
            // A machine too busy to serve the simulated rig within a second ends a scan as a kill does; a healthy one never.
            assert!(end.error.contains("No reply from the rig"), "{}", end.error);
            starved += 1;
            assert!(starved <= 20, "{}", end.error);
        }
    }
    let contents = log::read(&folder.join("cut.ogm")).unwrap();
    let mut stored: Vec<usize> = contents
        .records
        .iter()
        .filter_map(|r| match r {
            Record::Reading(r) if r.what == What::Sample => Some(r.index),
            _ => None,
        })
        .collect();
    stored.sort_unstable();
    assert_eq!(
        stored,
        (0..points as usize).collect::<Vec<_>>(),
        "every point once"
    );
    acknowledged.sort_unstable();
    let doubled = acknowledged.windows(2).find(|w| w[0] == w[1]);
    assert_eq!(doubled, None, "a point was acknowledged twice");
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
        "{killed} kills in {points} points: {} acknowledged, {torn} torn tails, 0 lost, 0 twice, {starved} starved, export identical",
        acknowledged.len()
    );
    assert!(killed > 0);
}
