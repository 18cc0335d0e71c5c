//! The scan: home, warm up, calibrate, then each pose: move, verify, settle, expose, log; resumed from the log, stopped by the token.

mod bench;
mod session;

use std::collections::BTreeSet;
use std::path::Path;

use sha2::{Digest, Sha256};

use crate::controller::controller_for;
use crate::detector::{Detector, SerialPhotodiode};
use crate::error::{Error, Result};
use crate::log::{FORMAT, Reading, Record, What, Worker, Writer};
use crate::plan::Plan;
use crate::rig::Rig;
use crate::transport::{Link, StopToken, Transport};

use bench::Bench;

/// Told what happens; the command line shows it, tests count it.
pub trait Watcher {
    /// A sentence for the operator.
    fn say(&mut self, _text: &str) {}
    /// A reading is on the disk: `done` of `total` sample poses.
    fn stored(&mut self, _reading: &Reading, _done: usize, _total: usize) {}
}

/// Says nothing.
pub struct Quiet;
impl Watcher for Quiet {}

/// How a scan ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Outcome {
    /// Sample poses in the route.
    pub points: usize,
    /// Sample readings in the log.
    pub stored: usize,
    /// Of these, found in the log at the start.
    pub found: usize,
}

/// Runs or resumes a scan over `transport` into the log at `path`, with the photodiode head as detector.
///
/// # Errors
/// Any of [`Error`]; whatever happened, the arms were told to stop, and everything in the log stays valid.
pub fn run(
    transport: Box<dyn Transport>,
    rig: &Rig,
    plan: &Plan,
    path: &Path,
    stop: &StopToken,
    watcher: &mut dyn Watcher,
) -> Result<Outcome> {
    run_with(
        transport,
        Box::new(SerialPhotodiode),
        rig,
        plan,
        path,
        stop,
        watcher,
    )
}

/// [`run`] with any detector.
///
/// # Errors
/// See [`run`].
pub fn run_with(
    transport: Box<dyn Transport>,
    detector: Box<dyn Detector>,
    rig: &Rig,
    plan: &Plan,
    path: &Path,
    stop: &StopToken,
    watcher: &mut dyn Watcher,
) -> Result<Outcome> {
    rig.validate()?;
    plan.validate()?;
    let route = plan.route(rig)?; // everything that can be refused is refused before a byte is sent
    let (mut log, contents) = Writer::open(path)?;
    let start = begin(
        &mut log,
        &contents.records,
        rig,
        plan,
        route.poses.len(),
        path,
    )?;
    let found = start.done.len();
    if start.complete {
        watcher.say("The scan is complete; nothing is left to measure.");
        return Ok(Outcome {
            points: found,
            stored: found,
            found,
        });
    }
    let log = Worker::new(log)?;
    let controller = controller_for(rig);
    let link = Link::new(transport, stop.clone(), controller.stop_bytes());
    let mut bench = Bench::new(link, controller, detector, rig, plan, log, start.scan_s);
    let result = session::run(&mut bench, route.poses, start, contents.torn_bytes, watcher);
    if let Err(e) = &result
        && !matches!(e, Error::Stopped | Error::Limit { .. } | Error::Zone { .. })
    {
        bench.link.send_stop();
    }
    result.map(|points| Outcome {
        points,
        stored: points,
        found,
    })
}

/// What the log says at the start.
struct Start {
    sessions: u32,
    /// Places in the route that have a sample reading.
    done: BTreeSet<usize>,
    readings: Vec<Reading>,
    scan_s: f64,
    complete: bool,
}

impl Start {
    fn had(&self, what: What, index: usize) -> bool {
        self.readings
            .iter()
            .any(|r| r.what == what && r.index == index)
    }
}

/// SHA-256 of a plan's and a rig's text, hexadecimal.
pub fn fingerprint(plan: &str, rig: &str) -> String {
    let digest = Sha256::digest(format!("{plan}\n--\n{rig}").as_bytes());
    digest.iter().map(|b| format!("{b:02x}")).collect()
}

fn begin(
    log: &mut Writer,
    records: &[Record],
    rig: &Rig,
    plan: &Plan,
    points: usize,
    path: &Path,
) -> Result<Start> {
    let text = |r: std::result::Result<String, toml::ser::Error>| {
        r.map_err(|e| Error::Plan(format!("The plan cannot be written into the log: {e}.")))
    };
    let (plan_text, rig_text) = (text(toml::to_string(plan))?, text(toml::to_string(rig))?);
    let mine = fingerprint(&plan_text, &rig_text);
    let mut start = Start {
        sessions: 0,
        done: BTreeSet::new(),
        readings: Vec::new(),
        scan_s: 0.0,
        complete: false,
    };
    match records.first() {
        None => log.append(&Record::Header {
            format: FORMAT,
            software: concat!("ogm ", env!("CARGO_PKG_VERSION")).into(),
            plan: plan_text,
            rig: rig_text,
            fingerprint: mine,
            points,
        })?,
        Some(Record::Header { format, .. }) if *format != FORMAT => {
            return Err(Error::Log(format!(
                "The log {} has format {format}, this program writes {FORMAT}; choose another file.",
                path.display()
            )));
        }
        Some(Record::Header { fingerprint, .. }) if *fingerprint == mine => {}
        Some(Record::Header { .. }) => {
            return Err(Error::Log(format!(
                "The log {} belongs to another plan or rig; give it another name or use the files it began with.",
                path.display()
            )));
        }
        Some(_) => {
            return Err(Error::Log(format!(
                "The log {} does not begin with its header; choose another file.",
                path.display()
            )));
        }
    }
    for record in records {
        match record {
            Record::Session { number, scan_s, .. } => {
                start.sessions = number + 1;
                start.scan_s = start.scan_s.max(*scan_s);
            }
            Record::Reading(r) => {
                start.scan_s = start.scan_s.max(r.scan_s);
                if r.what == What::Sample {
                    start.done.insert(r.index);
                }
                start.readings.push(r.clone());
            }
            Record::End { .. } => start.complete = true,
            Record::Header { .. } => {}
        }
    }
    Ok(start)
}
