//! What the driver adds to a point beyond what the line, the arms and the exposures take: `cargo run --release -p ogm-driver --example overhead`.
//!
//! A simulated rig behind a pseudo-terminal answers with the timing of its line; every line that passed is counted in bits. The same scan without the
//! line's timing gives the time of 79 points on instant motors. Run it on a quiet machine.

use std::sync::Arc;
use std::time::{Duration, Instant};

use ogm_driver::error::Result;
use ogm_driver::log::{self, Reading, Record, What, Writer};
use ogm_driver::plan::Plan;
use ogm_driver::rig::Rig;
use ogm_driver::scan::{self, Watcher};
use ogm_driver::serial::SerialTransport;
use ogm_driver::sim::optics::PlainCloth;
use ogm_driver::sim::{Bench, Device, FaultPlan, Imperfections, PtyRig};
use ogm_driver::transport::StopToken;

const PLAN: &str = "name = '79 points'\n[grid]\nkind = 'paper'\nlight_elevations = [180]\n[exposure]\nladder_ms = [1]\n[calibration]\nreference_every = 0\nwhite = false";

/// The moments at which points were on the disk.
struct Moments(Vec<(Instant, f64)>);

impl Watcher for Moments {
    fn stored(&mut self, reading: &Reading, _: usize, _: usize) {
        if reading.what == What::Sample {
            let exposed = reading.shots.iter().map(|s| s.exposure_ms).sum();
            self.0.push((Instant::now(), exposed));
        }
    }
}

fn main() -> Result<()> {
    for rig in [Rig::default(), Rig::grbl()] {
        let rig = rig.with_instant_motors();
        let (whole, _, readings) = run(&rig, false)?;
        println!(
            "{}: 79 points in {:.2} s, homing and calibration apart",
            rig.name,
            whole.as_secs_f64()
        );
        let (_, mut points, _) = run(&rig, true)?;
        points.sort_by(f64::total_cmp);
        let n = points.len();
        let mean = points.iter().sum::<f64>() / n as f64;
        println!(
            "  above line, exposure and travel at {} baud: median {:.2} ms, mean {mean:.2} ms, p90 {:.2} ms a point",
            rig.baud,
            points[n / 2],
            points[n * 9 / 10]
        );
        println!(
            "  of that, writing and syncing a record takes {:.2} ms (median)",
            disk(&readings)?
        );
    }
    Ok(())
}

/// Runs the scan; returns the time from the first point to the last, the rest of every point in milliseconds, and the records.
fn run(rig: &Rig, wire: bool) -> Result<(Duration, Vec<f64>, Vec<Record>)> {
    let plan = Plan::from_toml(PLAN)?;
    let bench = Bench::new(rig.clone(), Arc::new(PlainCloth), Imperfections::default());
    let mut device = Device::new(bench, FaultPlan::none());
    device.wire_baud = wire.then_some(rig.baud);
    device.journal = Some(Vec::new());
    let sim = PtyRig::start(device, 1.0).expect("a pseudo-terminal");
    let folder = tempfile::tempdir_in(".").expect("a folder on this disk");
    let log = folder.path().join("scan.ogm");
    let port = Box::new(SerialTransport::open(sim.port(), rig.baud, rig.rts_cts)?);
    let mut moments = Moments(Vec::new());
    scan::run(port, rig, &plan, &log, &StopToken::new(), &mut moments)?;
    let device = sim.device.lock().expect("the device");
    let journal = device.journal.as_deref().expect("a journal");
    let poses = plan.route(rig)?.poses;
    let mut rest = Vec::new();
    for (k, pair) in moments.0.windows(2).enumerate() {
        let (from, to) = (pair[0].0, pair[1].0);
        // Real-time bytes are noted as a quoted character and have no line end.
        let bits = |text: &str| {
            if text.starts_with('\'') {
                10
            } else {
                10 * (text.len() + 2)
            }
        };
        let between = journal.iter().filter(|l| l.wall > from && l.wall <= to);
        let line: usize = between.map(|l| bits(&l.text)).sum();
        let travel = rig.leg_seconds(&rig.pulses(poses[k])?, &rig.pulses(poses[k + 1])?);
        let whole = (to - from).as_secs_f64() * 1000.0;
        rest.push(whole - line as f64 * 1000.0 / f64::from(rig.baud) - travel * 1000.0 - pair[1].1);
    }
    let first = moments.0.first().map_or_else(Instant::now, |m| m.0);
    let last = moments.0.last().map_or(first, |m| m.0);
    Ok((last - first, rest, log::read(&log)?.records))
}

/// Milliseconds of writing and syncing one record, by the median.
fn disk(records: &[Record]) -> Result<f64> {
    let folder = tempfile::tempdir_in(".").expect("a folder on this disk");
    let (mut writer, _) = Writer::open(&folder.path().join("again.ogm"))?;
    let mut times = Vec::new();
    for record in records {
        let begun = Instant::now();
        writer.append(record)?;
        times.push(begun.elapsed().as_secs_f64() * 1000.0);
    }
    times.sort_by(f64::total_cmp);
    Ok(times[times.len() / 2])
}
