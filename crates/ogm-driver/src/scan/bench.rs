//! The rig in use: the one owner of port, controller, detector and log; a reading is a move, a check, light, a check, and a record on the disk.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use super::Watcher;
use crate::controller::{Controller, verify};
use crate::detector::{Detector, Exposure, Shot};
use crate::error::{Error, Result};
use crate::log::{Reading, Record, What, Worker};
use crate::plan::{Drift, Plan};
use crate::pose::{AXES, Pose};
use crate::rig::{Holder, Rig, output_bits};
use crate::transport::Link;

/// A reading to be taken.
pub(super) struct Task {
    pub(super) what: What,
    pub(super) index: usize,
    pub(super) pose: Pose,
    /// Fixed exposures; empty means bracketing.
    pub(super) exposures: Vec<f64>,
}

impl Task {
    pub(super) fn new(what: What, index: usize, pose: Pose) -> Self {
        Task {
            what,
            index,
            pose,
            exposures: Vec::new(),
        }
    }

    /// The output word: shutter and holder.
    fn outputs(&self) -> u8 {
        let holder = match self.what {
            What::Dark | What::Sample => Holder::Sample,
            What::White => Holder::White,
            What::Direct | What::Linearity | What::Reference | What::Check => Holder::Empty,
        };
        output_bits(self.what != What::Dark, holder)
    }
}

pub(super) struct Bench<'a> {
    pub(super) link: Link,
    pub(super) controller: Box<dyn Controller>,
    pub(super) detector: Box<dyn Detector>,
    pub(super) rig: &'a Rig,
    pub(super) plan: &'a Plan,
    log: Worker,
    here: Option<[i64; AXES]>,
    outputs: Option<u8>,
    scan_s: f64,
    begun: Duration,
}

pub(super) fn wall_seconds() -> f64 {
    SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .map_or(0.0, |d| d.as_secs_f64())
}

impl<'a> Bench<'a> {
    pub(super) fn new(
        link: Link,
        controller: Box<dyn Controller>,
        detector: Box<dyn Detector>,
        rig: &'a Rig,
        plan: &'a Plan,
        log: Worker,
        scan_s: f64,
    ) -> Self {
        Bench {
            begun: link.now(),
            link,
            controller,
            detector,
            rig,
            plan,
            log,
            here: None,
            outputs: None,
            scan_s,
        }
    }

    /// Homes every axis; before it no move is made.
    pub(super) fn home(&mut self) -> Result<()> {
        self.here = Some(self.controller.home(&mut self.link, self.rig)?);
        Ok(())
    }

    /// Appends a record; a stop asked for meanwhile goes out at once.
    pub(super) fn append(&mut self, record: &Record) -> Result<()> {
        self.log.append(record, || self.link.stop_if_asked())
    }

    /// Moves, verifies, settles, exposes, verifies again, and returns when the reading is on the disk.
    pub(super) fn reading(
        &mut self,
        task: Task,
        watcher: &mut dyn Watcher,
        count: (usize, usize),
    ) -> Result<Reading> {
        self.go(task.pose)?;
        self.set_outputs(task.outputs())?;
        self.link.wait(Duration::from_millis(self.rig.settle_ms))?;
        let shots = self.expose(&task)?;
        self.lamp_is_on(task.what, &shots)?;
        // The arms must still be where they were when the light was read.
        let reached = self.controller.positions(&mut self.link, self.rig)?;
        verify(
            self.rig,
            "the exposure",
            &self.here.unwrap_or(reached),
            &reached,
        )?;
        let reading = Reading {
            what: task.what,
            index: task.index,
            asked: task.pose,
            reached: self.rig.pose(&reached),
            f_number: self.plan.exposure.f_number,
            shots,
            wall_s: wall_seconds(),
            scan_s: self.scan_s + (self.link.now() - self.begun).as_secs_f64(),
        };
        self.append(&Record::Reading(reading.clone()))?;
        watcher.stored(&reading, count.0, count.1);
        Ok(reading)
    }

    fn expose(&mut self, task: &Task) -> Result<Vec<Shot>> {
        let plan = self.plan;
        let mut shots: Vec<Shot> = Vec::new();
        let most = plan.exposure.ladder_ms.len() + 2 + plan.exposure.repeats as usize;
        loop {
            let ms = if !task.exposures.is_empty() {
                task.exposures.get(shots.len()).copied()
            } else if shots.len() < most {
                let rung = plan.exposure.next(&shots, &self.rig.detector);
                rung.map(|r| plan.exposure.ladder_ms[r])
            } else {
                None
            };
            let Some(ms) = ms else { return Ok(shots) };
            let exposure = Exposure {
                tag: tag(task.what, task.index, shots.len()),
                ms,
                f_number: plan.exposure.f_number,
            };
            let shot = self.detector.expose(&mut self.link, self.rig, &exposure)?;
            shots.push(shot);
        }
    }

    /// A lamp that went out must not be stored as a dark sample: the reference diode tells, where there is one.
    fn lamp_is_on(&mut self, what: What, shots: &[Shot]) -> Result<()> {
        let diode = self.plan.calibration.drift == Drift::Diode;
        let weak = |s: &Shot| diode && s.reference <= 1000.0;
        if what != What::Dark && shots.iter().any(weak) {
            return Err(Error::Lamp(format!(
                "The reference diode reads {} counts: the lamp went out or its diode is unplugged. The reading was not stored; see to it and start again.",
                shots.last().map_or(0.0, |s| s.reference)
            )));
        }
        Ok(())
    }

    pub(super) fn set_outputs(&mut self, bits: u8) -> Result<()> {
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
        let Some(mut here) = self.here else {
            return Err(Error::Plan(
                "The rig has not been homed, so no move is made.".into(),
            ));
        };
        for leg in self.rig.way(&here, pose)? {
            if leg == here {
                continue;
            }
            let seconds = self.rig.leg_seconds(&here, &leg);
            self.here = None; // unknown until the controller has shown it
            here = self
                .controller
                .move_to(&mut self.link, self.rig, &leg, seconds)?;
            self.here = Some(here);
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
        What::Linearity => 7,
    };
    (kind << 40) | ((index as u64) << 8) | shot as u64
}
