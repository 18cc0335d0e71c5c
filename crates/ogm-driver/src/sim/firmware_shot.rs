//! The simulated SHOT/GSC controller: what it answers to a line, and what its arms then do.

use super::bench::Bench;
use super::device::{Answer, Firmware};
use super::fault::Fault;
use crate::protocol::shot::{
    self, COORDINATE_LIMIT, Command, Model, Query, Sense, Speed, Status, Which,
};

/// A controller of a given model.
pub(crate) struct ShotFirmware {
    model: Model,
    speeds: Vec<Speed>,
    divisions: Vec<u16>,
    held: Vec<bool>,
    staged: Vec<Option<i64>>,
    accepted: bool,
    alert: bool,
    homing: bool,
}

impl ShotFirmware {
    pub(crate) fn new(model: Model) -> Self {
        let n = model.axes();
        ShotFirmware {
            model,
            speeds: vec![
                Speed {
                    start: 500,
                    top: 5000,
                    ramp_ms: 200
                };
                n
            ],
            divisions: vec![2; n],
            held: vec![true; n],
            staged: vec![None; n],
            accepted: true,
            alert: false,
            homing: false,
        }
    }

    fn axes(&self, which: Which) -> Vec<usize> {
        match which {
            Which::All => (0..self.model.axes()).collect(),
            Which::One(a) => vec![usize::from(a) - 1],
        }
    }

    fn busy(&mut self, now: f64, bench: &mut Bench) -> bool {
        let busy = bench.update(now);
        self.homing &= busy;
        busy
    }

    fn stage(&mut self, which: Which, to: impl Fn(usize, usize) -> i64) -> bool {
        let axes = self.axes(which);
        if axes.iter().any(|&a| !self.held[a]) {
            return false;
        }
        let targets: Vec<(usize, i64)> = axes
            .iter()
            .enumerate()
            .map(|(k, &a)| (a, to(k, a)))
            .collect();
        if targets.iter().any(|(_, t)| t.abs() > COORDINATE_LIMIT) {
            return false;
        }
        self.staged = vec![None; self.model.axes()];
        for (axis, target) in targets {
            self.staged[axis] = Some(target);
        }
        true
    }

    fn start(&mut self, now: f64, bench: &mut Bench, mishap: &mut Option<Fault>) -> bool {
        let staged = std::mem::replace(&mut self.staged, vec![None; self.model.axes()]);
        if staged.iter().all(Option::is_none) {
            return false;
        }
        for (axis, target) in staged.into_iter().enumerate() {
            let Some(mut to) = target.map(|t| t as f64) else {
                continue;
            };
            let here = bench.motors[axis].count() as f64;
            if to != here {
                match mishap.take() {
                    Some(Fault::Stall) => to = (here + 0.6 * (to - here)).round(),
                    Some(Fault::Overshoot) => to += 40.0 * (to - here).signum(),
                    Some(Fault::Limit) => to = 1e9 * (to - here).signum(),
                    other => *mishap = other,
                }
            }
            let s = self.speeds[axis];
            bench.motors[axis].go(
                to,
                now,
                f64::from(s.start),
                f64::from(s.top),
                f64::from(s.ramp_ms) / 1000.0,
            );
        }
        true
    }

    /// Whether the command was accepted.
    fn obey(
        &mut self,
        command: &Command,
        now: f64,
        bench: &mut Bench,
        mishap: &mut Option<Fault>,
    ) -> bool {
        let busy = self.busy(now, bench);
        if self.alert
            && !matches!(
                command,
                Command::Stop(_) | Command::StopNow | Command::Zero(_)
            )
        {
            return false;
        }
        match command {
            Command::StopNow | Command::Stop(Which::All) => {
                self.freeze(&self.axes(Which::All), now, bench);
            }
            // GSC-02: a single axis cannot be stopped while homing.
            Command::Stop(w) if !(self.homing && self.model == Model::Gsc02) => {
                self.freeze(&self.axes(*w), now, bench);
            }
            Command::Stop(_) => {}
            _ if busy => return false,
            Command::Home(w, _) => {
                self.staged.fill(None);
                for a in self.axes(*w) {
                    if !self.held[a] {
                        return false;
                    }
                    let s = self.speeds[a];
                    bench.motors[a].go_home(
                        now,
                        f64::from(s.start),
                        f64::from(s.top),
                        f64::from(s.ramp_ms) / 1000.0,
                    );
                }
                self.homing = true;
            }
            Command::MoveTo(w, to) => return self.stage(*w, |k, _| to[k]),
            Command::MoveBy(w, by) => {
                let counts = bench.counts();
                return self.stage(*w, |k, a| counts[a] + by[k]);
            }
            Command::Jog(w, senses) => {
                return self.stage(*w, |k, _| {
                    if senses[k] == Sense::Plus {
                        268_435_455
                    } else {
                        -268_435_455
                    }
                });
            }
            Command::Go => return self.start(now, bench, mishap),
            Command::Zero(w) => {
                self.alert = false;
                for a in self.axes(*w) {
                    bench.motors[a].zero_here(now);
                }
            }
            Command::Speeds(w, speeds) => {
                for (k, a) in self.axes(*w).into_iter().enumerate() {
                    self.speeds[a] = speeds[k];
                }
            }
            Command::Divide(a, d) => self.divisions[usize::from(*a) - 1] = *d,
            Command::Hold(w, on) => {
                for a in self.axes(*w) {
                    self.held[a] = *on;
                }
            }
            Command::Output(bits) => bench.outputs = *bits,
            Command::Status | Command::Busy | Command::Ask(_) | Command::Input => {}
        }
        true
    }

    fn freeze(&self, axes: &[usize], now: f64, bench: &mut Bench) {
        for &a in axes {
            bench.motors[a].freeze(now);
        }
    }

    fn status(&mut self, now: f64, bench: &mut Bench) -> String {
        let busy = self.busy(now, bench);
        let n = self.model.axes();
        let limits = (0..n)
            .filter(|&a| bench.motors[a].at_limit)
            .fold(0, |m, a| m | (1 << a));
        shot::format_status(&Status {
            positions: bench.counts()[..n].to_vec(),
            accepted: self.accepted,
            limits,
            busy,
        })
    }

    fn list(&self, each: impl Fn(usize) -> String) -> String {
        (0..self.model.axes())
            .map(each)
            .collect::<Vec<_>>()
            .join(",")
    }
}

impl Firmware for ShotFirmware {
    fn line(
        &mut self,
        line: &str,
        now: f64,
        bench: &mut Bench,
        mishap: &mut Option<Fault>,
    ) -> Vec<Answer> {
        let refuse = *mishap == Some(Fault::Ng);
        match *mishap {
            Some(Fault::Alarm) => {
                *mishap = None;
                self.alert = true;
                self.freeze(&self.axes(Which::All), now, bench);
            }
            Some(Fault::PowerCycle) => {
                *mishap = None;
                *self = ShotFirmware::new(self.model);
                bench.lose_power(now);
            }
            _ => {}
        }
        let command = shot::parse_command(line, self.model);
        let answer = match &command {
            Some(Command::Status) => Some(self.status(now, bench)),
            Some(Command::Busy) => Some(if self.busy(now, bench) { "B" } else { "R" }.to_string()),
            Some(Command::Ask(q)) => Some(match q {
                Query::Version => "V1.00".into(),
                Query::Name => self.model.name().into(),
                Query::PulseRate => self.list(|_| "1".into()),
                Query::Divisions => self.list(|a| self.divisions[a].to_string()),
                Query::Speeds => self.list(|a| {
                    let s = self.speeds[a];
                    format!("S{}F{}R{}", s.start, s.top, s.ramp_ms)
                }),
            }),
            Some(Command::Input) => Some("0".into()),
            _ => None,
        };
        if let Some(text) = answer {
            return vec![Answer::now(now, text)];
        }
        self.accepted = match command {
            Some(command) if !refuse => self.obey(&command, now, bench, mishap),
            _ => false,
        };
        if refuse {
            *mishap = None;
        }
        if self.model.acknowledges() {
            vec![Answer::now(
                now,
                if self.accepted { "OK" } else { "NG" }.into(),
            )]
        } else {
            Vec::new()
        }
    }

    fn real_time(&mut self, _byte: u8, _now: f64, _bench: &mut Bench) -> Option<Vec<Answer>> {
        None
    }

    fn tick(&mut self, _now: f64, _bench: &mut Bench) -> Vec<Answer> {
        Vec::new()
    }
}
