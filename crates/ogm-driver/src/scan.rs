//! The scan: home, warm up, calibrate, then each pose: move, verify, settle, expose, log; resumed from the log, stopped by the token.

use std::path::Path;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use sha2::{Digest, Sha256};

use crate::controller::{Controller, controller_for};
use crate::detector::{Detector, SerialPhotodiode, Shot};
use crate::error::{Error, Result};
use crate::log::{FORMAT, Reading, Record, What, Worker, Writer};
use crate::plan::Plan;
use crate::pose::{AXES, Pose};
use crate::rig::{Holder, Rig, output_bits};
use crate::transport::{Link, StopToken, Transport};

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

/// The rig in use: the one owner of the port.
struct Bench<'a> {
    link: Link,
    controller: Box<dyn Controller>,
    detector: Box<dyn Detector>,
    rig: &'a Rig,
    plan: &'a Plan,
    here: [i64; AXES],
    outputs: Option<u8>,
    homed: bool,
    scan_s: f64,
    begun: Duration,
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
    let (points, found) = (route.poses.len(), start.done.iter().filter(|d| **d).count());
    let outcome = |stored| Outcome {
        points,
        stored,
        found,
    };
    if start.complete {
        watcher.say("The scan is complete; nothing is left to measure.");
        return Ok(outcome(found));
    }
    let mut log = Worker::new(log)?;
    let controller = controller_for(rig);
    let link = Link::new(transport, stop.clone(), controller.stop_bytes());
    let mut bench = Bench {
        begun: link.now(),
        link,
        controller,
        detector,
        rig,
        plan,
        here: [0; AXES],
        outputs: None,
        homed: false,
        scan_s: start.scan_s,
    };
    let result = bench.session(&mut log, &route.poses, start, contents.torn_bytes, watcher);
    if let Err(e) = &result
        && !matches!(e, Error::Stopped | Error::Limit { .. } | Error::Zone { .. })
    {
        bench.link.send_stop();
    }
    result.map(outcome)
}

/// What the log says at the start.
struct Start {
    sessions: u32,
    done: Vec<bool>,
    readings: Vec<Reading>,
    scan_s: f64,
    complete: bool,
}

fn fingerprint(plan: &str, rig: &str) -> String {
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
        done: vec![false; points],
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
                if r.what == What::Sample && r.index < points {
                    start.done[r.index] = true;
                }
                start.readings.push(r.clone());
            }
            Record::End { .. } => start.complete = true,
            Record::Header { .. } => {}
        }
    }
    Ok(start)
}

fn wall_seconds() -> f64 {
    SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0.0, |d| d.as_secs_f64())
}

impl Bench<'_> {
    /// One session from homing to the end or the first failure; returns the number of stored points.
    fn session(
        &mut self,
        log: &mut Worker,
        poses: &[Pose],
        start: Start,
        torn_bytes: u64,
        watcher: &mut dyn Watcher,
    ) -> Result<usize> {
        let controller = self.controller.identify(&mut self.link, self.rig)?;
        let detector = self.detector.identify(&mut self.link, self.rig)?;
        let lamp_s = self.warm_up(watcher)?;
        watcher.say("Homing.");
        self.here = self.controller.home(&mut self.link, self.rig)?;
        self.homed = true;
        let session = Record::Session {
            number: start.sessions,
            wall_s: wall_seconds(),
            scan_s: start.scan_s,
            controller,
            detector,
            lamp_s,
            torn_bytes,
        };
        log.append(&session, || self.link.stop_if_asked())?;
        self.calibrate(log, &start, watcher)?;
        let mut stored = start.done.iter().filter(|d| **d).count();
        for (index, pose) in poses.iter().enumerate() {
            let every = self.plan.calibration.reference_every as usize;
            let had = |what: What| {
                start
                    .readings
                    .iter()
                    .any(|r| r.what == what && r.index == index)
            };
            if every > 0
                && index % every == 0
                && index > 0
                && !had(What::Reference)
                && !start.done[index]
            {
                self.reading(
                    log,
                    What::Reference,
                    index,
                    Plan::REFERENCE,
                    Holder::Empty,
                    true,
                    watcher,
                    (stored, poses.len()),
                )?;
            }
            if !start.done[index] {
                stored += 1;
                self.reading(
                    log,
                    What::Sample,
                    index,
                    *pose,
                    Holder::Sample,
                    true,
                    watcher,
                    (stored, poses.len()),
                )?;
            }
        }
        log.append(&Record::End { points: stored }, || {
            self.link.stop_if_asked();
        })?;
        self.outputs(output_bits(false, Holder::Sample))?;
        Ok(stored)
    }

    /// Waits for the lamp. A lamp that is off is an error, not something to wait for.
    fn warm_up(&mut self, watcher: &mut dyn Watcher) -> Result<Option<f64>> {
        let needed = self.plan.calibration.warm_up_min * 60.0;
        let mut told = false;
        loop {
            let Some(on) = self.detector.lamp_seconds(&mut self.link, self.rig)? else {
                return Ok(None);
            };
            if on >= needed && on > 0.0 {
                return Ok(Some(on));
            }
            if on <= 0.0 {
                return Err(Error::Lamp("The lamp is off; switch it on and start again, the scan waits until it is warm.".into()));
            }
            if !told {
                told = true;
                watcher.say(&format!(
                    "The lamp has been on for {:.0} min; waiting until it has been {:.0} min.",
                    on / 60.0,
                    needed / 60.0
                ));
            }
            self.link
                .wait(Duration::from_secs_f64((needed - on).clamp(0.1, 5.0)))?;
        }
    }

    /// Dark, direct and white readings that the log does not have yet; after a resume one reference check.
    fn calibrate(
        &mut self,
        log: &mut Worker,
        start: &Start,
        watcher: &mut dyn Watcher,
    ) -> Result<()> {
        let count = (0, start.done.len());
        let had = |what: What, index: usize| {
            start
                .readings
                .iter()
                .any(|r| r.what == what && r.index == index)
        };
        let plan = self.plan;
        let c = &plan.calibration;
        for index in 0..c.dark as usize {
            if !had(What::Dark, index) {
                self.reading(
                    log,
                    What::Dark,
                    index,
                    Plan::REFERENCE,
                    Holder::Sample,
                    false,
                    watcher,
                    count,
                )?;
            }
        }
        for index in 0..c.direct as usize {
            if !had(What::Direct, index) {
                self.reading(
                    log,
                    What::Direct,
                    index,
                    Plan::REFERENCE,
                    Holder::Empty,
                    true,
                    watcher,
                    count,
                )?;
            }
        }
        if c.white && !had(What::White, 0) {
            self.reading(
                log,
                What::White,
                0,
                Plan::WHITE,
                Holder::White,
                true,
                watcher,
                count,
            )?;
        }
        let Some(first) = start.readings.iter().find(|r| r.what == What::Direct) else {
            return Ok(());
        };
        let check = self.reading(
            log,
            What::Check,
            start.sessions as usize,
            Plan::REFERENCE,
            Holder::Empty,
            true,
            watcher,
            count,
        )?;
        let ratio = rough_rate(&check) / rough_rate(first);
        if (ratio - 1.0).abs() <= c.resume_tolerance {
            return Ok(());
        }
        Err(Error::Lamp(format!(
            "After the resume the reference reads {ratio:.3} of what it read at the start, more than {} away; see to the lamp and the alignment, or begin a new log.",
            c.resume_tolerance
        )))
    }

    /// Moves, verifies, settles, exposes, and returns when the reading is on the disk.
    fn reading(
        &mut self,
        log: &mut Worker,
        what: What,
        index: usize,
        pose: Pose,
        holder: Holder,
        open: bool,
        watcher: &mut dyn Watcher,
        count: (usize, usize),
    ) -> Result<Reading> {
        self.go(pose)?;
        self.outputs(output_bits(open, holder))?;
        self.link.wait(Duration::from_millis(self.rig.settle_ms))?;
        let f_number = self.plan.exposure.f_number;
        let mut shots: Vec<Shot> = Vec::new();
        let ladder = &self.plan.exposure.ladder_ms;
        if what == What::Dark {
            for (k, ms) in ladder.iter().enumerate() {
                shots.push(self.detector.expose(
                    &mut self.link,
                    self.rig,
                    tag(what, index, k),
                    *ms,
                    f_number,
                )?);
            }
        } else {
            while let Some(rung) = self.plan.exposure.next(&shots, &self.rig.detector) {
                if shots.len() >= ladder.len() + 2 + self.plan.exposure.repeats as usize {
                    break;
                }
                shots.push(self.detector.expose(
                    &mut self.link,
                    self.rig,
                    tag(what, index, shots.len()),
                    ladder[rung],
                    f_number,
                )?);
            }
        }
        self.lamp_is_on(what, &shots)?;
        // The arms must still be where they were when the light was read.
        let reached = self.controller.positions(&mut self.link, self.rig)?;
        crate::controller::verify(self.rig, "the exposure", &self.here, &reached)?;
        let scan_s = self.scan_s + (self.link.now() - self.begun).as_secs_f64();
        let reading = Reading {
            what,
            index,
            asked: pose,
            reached: self.rig.pose(&reached),
            f_number,
            shots,
            wall_s: wall_seconds(),
            scan_s,
        };
        log.append(&Record::Reading(reading.clone()), || {
            self.link.stop_if_asked();
        })?;
        watcher.stored(&reading, count.0, count.1);
        Ok(reading)
    }

    /// A lamp that went out must not be stored as a dark sample: the reference diode tells, where there is one.
    fn lamp_is_on(&mut self, what: What, shots: &[Shot]) -> Result<()> {
        let diode = self.plan.calibration.drift == crate::plan::Drift::Diode;
        let weak = |s: &Shot| diode && s.reference <= 1000.0;
        if what != What::Dark && shots.iter().any(weak) {
            return Err(Error::Lamp(format!(
                "The reference diode reads {} counts: the lamp went out or its diode is unplugged. The reading was not stored; see to it and start again.",
                shots.last().map_or(0.0, |s| s.reference)
            )));
        }
        Ok(())
    }

    fn outputs(&mut self, bits: u8) -> Result<()> {
        if self.outputs != Some(bits) {
            self.outputs = None; // unknown until the controller has said OK
            self.controller
                .set_outputs(&mut self.link, self.rig, bits)?;
            self.outputs = Some(bits);
        }
        Ok(())
    }

    /// Moves along a safe way; each leg is sent once and verified.
    fn go(&mut self, pose: Pose) -> Result<()> {
        if !self.homed {
            return Err(Error::Plan(
                "The rig has not been homed, so no move is made.".into(),
            ));
        }
        for leg in self.rig.way(&self.here, pose)? {
            if leg == self.here {
                continue;
            }
            let seconds = self.rig.leg_seconds(&self.here, &leg);
            self.here = self
                .controller
                .move_to(&mut self.link, self.rig, &leg, seconds)?;
        }
        Ok(())
    }
}

/// The name of a shot: its kind, its place, its number. The same in every session, so that a simulated rig repeats itself exactly.
fn tag(what: What, index: usize, shot: usize) -> u64 {
    let kind = match what {
        What::Dark => 1,
        What::Direct => 2,
        What::White => 3,
        What::Reference => 4,
        What::Check => 5,
        What::Sample => 6,
    };
    (kind << 40) | ((index as u64) << 8) | shot as u64
}

/// Counts a millisecond of the longest unsaturated shot over the reference diode: good enough to compare two direct beams.
fn rough_rate(reading: &Reading) -> f64 {
    let best = reading
        .shots
        .iter()
        .filter(|s| !s.saturated)
        .max_by(|a, b| a.exposure_ms.total_cmp(&b.exposure_ms));
    best.map_or(0.0, |s| s.counts / s.exposure_ms / s.reference.max(1.0))
}
