//! The simulated grblHAL controller with four axes: planner of one line, homing that answers late, alarms that lock.

use super::bench::Bench;
use super::device::{Answer, Firmware};
use super::fault::Fault;
use super::motor::Motor;
use crate::pose::AXES;
use crate::protocol::grbl::{self, Line, RealTime, Report, State};

/// What a fresh or reset controller says first.
pub(crate) const WELCOME: &str = "Grbl 1.1h ['$' for help]";

/// A controller with homing switched on: it starts locked in Alarm.
pub(crate) struct GrblFirmware {
    state: State,
    /// The alarm to report when the running move ends at a limit.
    pending_alarm: Option<u32>,
    locked: bool,
    settings: Vec<(u16, i64)>,
}

impl GrblFirmware {
    pub(crate) fn new() -> Self {
        let switched_on = [10, 20, 21, 22].map(|n| (n, 1000));
        let travel = [130, 131, 132].map(|n| (n, 360_000));
        let settings = [&switched_on[..], &travel].concat();
        GrblFirmware {
            state: State::Alarm,
            pending_alarm: None,
            locked: true,
            settings,
        }
    }

    fn report(&self, bench: &Bench) -> String {
        let pins = (0..AXES)
            .filter(|&a| bench.motors[a].at_limit)
            .map(|a| grbl::LETTERS[a])
            .collect();
        grbl::format_report(&Report {
            state: self.state,
            machine: bench.counts().to_vec(),
            pins,
        })
    }

    fn outside(&self, to: &[i64], bench: &Bench) -> bool {
        to.len() > AXES
            || to.iter().enumerate().any(|(i, t)| {
                let axis = &bench.rig.axes[i];
                let deg = axis.degrees(*t);
                deg < axis.min_deg - 0.5 || deg > axis.max_deg + 0.5
            })
    }

    fn go(
        &mut self,
        to: &[i64],
        feed: u32,
        now: f64,
        bench: &mut Bench,
        mishap: &mut Option<Fault>,
    ) {
        // The feed holds along the vector: every axis starts and ends together.
        let distance = to
            .iter()
            .enumerate()
            .map(|(i, t)| (*t - bench.motors[i].count()) as f64)
            .fold(0.0, |s, d| s + d * d)
            .sqrt();
        for (i, t) in to.iter().enumerate() {
            let here = bench.motors[i].count() as f64;
            let mut target = *t as f64;
            if target == here {
                continue;
            }
            let share = (target - here).abs() / distance;
            match mishap.take() {
                Some(Fault::Stall) => target = (here + 0.6 * (target - here)).round(),
                Some(Fault::Overshoot) => target += 40.0 * (target - here).signum(),
                Some(Fault::Limit) => {
                    target = 1e9 * (target - here).signum();
                    self.pending_alarm = Some(1);
                }
                other => *mishap = other,
            }
            let speed = f64::from(feed) * 1000.0 / 60.0 * share;
            let axis = &bench.rig.axes[i];
            let ramp = f64::from(axis.ramp_ms) / 1000.0;
            bench.motors[i].go(
                target,
                now,
                if ramp > 0.0 { 0.05 * speed } else { speed },
                speed,
                ramp,
            );
        }
    }

    fn alarm(&mut self, code: u32, now: f64, bench: &mut Bench) -> Vec<Answer> {
        bench.freeze(now);
        self.state = State::Alarm;
        self.locked = true;
        vec![
            Answer::now(now, format!("ALARM:{code}")),
            Answer::now(now, "[MSG:Reset to continue]".into()),
        ]
    }

    fn obey(
        &mut self,
        line: Line,
        now: f64,
        bench: &mut Bench,
        mishap: &mut Option<Fault>,
    ) -> Result<Vec<Answer>, u32> {
        let moving = bench.update(now);
        let ok = vec![Answer::now(now, "ok".into())];
        match line {
            Line::Build => {
                return Ok(vec![
                    Answer::now(now, "[VER:1.1h.20190825:OGM]".into()),
                    Answer::now(now, "[OPT:VNMH,35,255,4]".into()),
                    ok[0].clone(),
                ]);
            }
            Line::Settings => {
                let mut all: Vec<Answer> = self
                    .settings
                    .iter()
                    .map(|(n, v)| Answer::now(now, format!("${n}={}", grbl::decimal(*v))))
                    .collect();
                all.push(ok[0].clone());
                return if moving { Err(8) } else { Ok(all) };
            }
            Line::Unlock => {
                self.locked = false;
                if self.state == State::Alarm {
                    self.state = State::Idle;
                }
                return Ok(vec![
                    Answer::now(now, "[MSG:Caution: Unlocked]".into()),
                    ok[0].clone(),
                ]);
            }
            Line::Home => {
                if moving {
                    return Err(8);
                }
                self.locked = false;
                self.state = State::Home;
                for (motor, axis) in bench.motors.iter_mut().zip(&bench.rig.axes) {
                    let (start, top) = (axis.start_pps().into(), axis.speed_pps().into());
                    motor.go_home(now, start, top, f64::from(axis.ramp_ms) / 1000.0);
                }
                return Ok(Vec::new()); // "ok" comes when all are home
            }
            _ if self.locked => return Err(9),
            Line::Jog(to, feed) => {
                if moving {
                    return Err(8); // one move in flight: the planner of this rig is not for queues
                }
                if self.outside(&to, bench) {
                    return Err(15);
                }
                if self.state != State::Check {
                    self.go(&to, feed, now, bench, mishap);
                    self.state = State::Jog;
                }
            }
            Line::Rapid(to) => {
                if self.outside(&to, bench) {
                    return Ok(self.alarm(2, now, bench));
                }
                if self.state != State::Check {
                    self.go(&to, 100_000, now, bench, mishap);
                    self.state = State::Run;
                }
            }
            Line::Check => {
                if moving {
                    return Err(8);
                }
                let (state, word) = match self.state {
                    State::Check => (State::Idle, "[MSG:Disabled]"),
                    _ => (State::Check, "[MSG:Enabled]"),
                };
                self.state = state;
                return Ok(vec![Answer::now(now, word.into()), ok[0].clone()]);
            }
            Line::Sleep => self.state = State::Sleep,
            Line::Set(n, value) => {
                if moving {
                    return Err(8);
                }
                self.settings.retain(|s| s.0 != n);
                self.settings.push((n, value));
                self.settings.sort_unstable();
            }
            Line::Output(port, on) => {
                if port > 3 {
                    return Err(39);
                }
                bench.outputs = if on {
                    bench.outputs | (1 << port)
                } else {
                    bench.outputs & !(1 << port)
                };
            }
            Line::Dwell => {
                let ends = bench.motors.iter().filter_map(Motor::end);
                let end = ends.fold(now, f64::max);
                return Ok(vec![Answer {
                    due: end + 0.01,
                    text: "ok".into(),
                }]);
            }
        }
        Ok(ok)
    }
}

impl Firmware for GrblFirmware {
    fn line(
        &mut self,
        line: &str,
        now: f64,
        bench: &mut Bench,
        mishap: &mut Option<Fault>,
    ) -> Vec<Answer> {
        match *mishap {
            Some(Fault::Ng) => {
                *mishap = None;
                return vec![Answer::now(now, "error:8".into())];
            }
            Some(Fault::Alarm) => {
                *mishap = None;
                return self.alarm(1, now, bench);
            }
            Some(Fault::PowerCycle) => {
                *mishap = None;
                *self = GrblFirmware::new();
                bench.lose_power(now);
                return vec![Answer::now(now, WELCOME.into())];
            }
            _ => {}
        }
        if line.is_empty() {
            return vec![Answer::now(now, "ok".into())];
        }
        let outcome = grbl::parse_line(line).and_then(|l| self.obey(l, now, bench, mishap));
        outcome.unwrap_or_else(|n| vec![Answer::now(now, format!("error:{n}"))])
    }

    fn real_time(&mut self, byte: u8, now: f64, bench: &mut Bench) -> Option<Vec<Answer>> {
        let byte = RealTime::from_byte(byte)?;
        let moving = bench.update(now);
        Some(match byte {
            RealTime::Status => {
                let mut out = self.tick(now, bench);
                if self.state != State::Home {
                    out.push(Answer::now(now, self.report(bench)));
                }
                out
            }
            RealTime::JogCancel => {
                if self.state == State::Jog {
                    bench.freeze(now);
                    self.state = State::Idle;
                }
                Vec::new()
            }
            RealTime::Hold | RealTime::Door => {
                if matches!(self.state, State::Jog | State::Run) {
                    bench.freeze(now);
                    self.state = if byte == RealTime::Door {
                        State::Door(0)
                    } else {
                        State::Hold(0)
                    };
                }
                Vec::new()
            }
            RealTime::Resume => {
                if matches!(self.state, State::Hold(_) | State::Door(_)) {
                    self.state = State::Idle;
                }
                Vec::new()
            }
            RealTime::Reset => {
                let lost = moving;
                bench.freeze(now);
                let mut out = Vec::new();
                if lost {
                    let code = if self.state == State::Home { 6 } else { 3 };
                    out.push(Answer::now(now, format!("ALARM:{code}")));
                }
                self.locked |= lost;
                self.state = if self.locked {
                    State::Alarm
                } else {
                    State::Idle
                };
                out.push(Answer::now(now, String::new()));
                out.push(Answer::now(now, WELCOME.into()));
                out
            }
        })
    }

    fn tick(&mut self, now: f64, bench: &mut Bench) -> Vec<Answer> {
        let moving = bench.update(now);
        if moving {
            return Vec::new();
        }
        if let Some(code) = self
            .pending_alarm
            .take_if(|_| bench.motors.iter().any(|m| m.at_limit))
        {
            return self.alarm(code, now, bench);
        }
        match self.state {
            State::Home => {
                self.state = State::Idle;
                vec![Answer::now(now, "ok".into())]
            }
            State::Jog | State::Run => {
                self.state = State::Idle;
                Vec::new()
            }
            _ => Vec::new(),
        }
    }
}
