//! Driving a SHOT-304GS: set speeds, home, `A:W` and `G:` once, poll `!:`, then believe only a `Q:` that shows the target at rest.

use std::time::Duration;

use super::{Controller, four, named, question, verify};
use crate::axis::Axis;
use crate::error::{Error, Result};
use crate::pose::AXES;
use crate::protocol::shot::{self, Command, Model, Query, Speed, Status, Which};
use crate::rig::Rig;
use crate::transport::Link;

/// A four-axis SHOT controller with COMM/ACK = MAIN (every command is answered OK or NG).
pub struct ShotController {
    model: Model,
    /// The controller's own account of its speeds after homing.
    speeds: Option<String>,
}

impl ShotController {
    /// A controller of the given model.
    pub fn new(model: Model) -> Self {
        ShotController {
            model,
            speeds: None,
        }
    }

    fn bytes(&self, command: &Command) -> Result<Vec<u8>> {
        shot::encode(command, self.model).map_err(|e| Error::Rig(e.to_string()))
    }

    fn status(&self, link: &mut Link, rig: &Rig) -> Result<Status> {
        question(link, rig, &self.bytes(&Command::Status)?, |line| {
            Ok(shot::parse_status(line).filter(|s| s.positions.len() == AXES))
        })
    }

    fn busy(&self, link: &mut Link, rig: &Rig) -> Result<bool> {
        question(link, rig, &self.bytes(&Command::Busy)?, |line| {
            Ok(shot::parse_busy(line))
        })
    }

    /// Sends a command that changes something: once. `NG` is explained by a status question.
    fn order(&self, link: &mut Link, rig: &Rig, command: &Command) -> Result<()> {
        let bytes = self.bytes(command)?;
        if link.ask(&bytes, rig.reply(), 1, |line| Ok(shot::parse_ack(line)))? {
            return Ok(());
        }
        let name = named(&bytes);
        let why = match self.status(link, rig) {
            Ok(s) if s.busy => "the arms are still moving".into(),
            Ok(s) if s.limits != 0 => {
                return Err(Error::LimitSensor {
                    axis: axes_of(rig, s.limits),
                    command: name,
                });
            }
            Ok(_) => {
                "it answered NG; look for a free motor, an emergency stop or a coordinate overflow"
                    .into()
            }
            Err(e) => format!("it answered NG, and then: {e}"),
        };
        Err(Error::Refused { command: name, why })
    }

    /// The answer to `?:DW`, as text.
    fn speeds(&self, link: &mut Link, rig: &Rig) -> Result<String> {
        let bytes = self.bytes(&Command::Ask(Query::Speeds))?;
        question(link, rig, &bytes, |line| {
            Ok(line.starts_with('S').then(|| line.to_string()))
        })
    }

    /// A power cut sets the counters to 0 wherever the arms are, and a move after it "arrives" at a false place: only the speeds, set before homing
    /// and lost with the power, tell.
    fn still_powered(&self, link: &mut Link, rig: &Rig, command: &str) -> Result<()> {
        if self.speeds.is_some() && self.speeds != Some(self.speeds(link, rig)?) {
            return Err(Error::Restarted {
                command: command.into(),
            });
        }
        Ok(())
    }

    /// Waits until the arms rest, then returns the status that says so. `expected` is how long it should take.
    fn rest(
        &self,
        link: &mut Link,
        rig: &Rig,
        name: &str,
        expected: f64,
        deadline: Duration,
    ) -> Result<Status> {
        let start = link.now();
        let soon = Duration::from_secs_f64((expected - 0.05).clamp(0.0, 3600.0));
        link.wait(soon.min(deadline))?;
        let mut pause = Duration::from_millis(1);
        loop {
            if !self.busy(link, rig)? {
                let status = self.status(link, rig)?;
                if !status.busy {
                    return Ok(status);
                }
            }
            if link.now() - start > deadline {
                link.send_stop();
                return Err(Error::StillMoving {
                    command: name.into(),
                    within: deadline,
                });
            }
            link.wait(pause)?;
            pause = (pause * 2).min(Duration::from_millis(50));
        }
    }
}

fn speed(axis: &Axis) -> Speed {
    let top = axis.speed_pps();
    let least = if top >= 8000 { 64 } else { 1 };
    Speed {
        start: axis.start_pps().max(least).min(top),
        top,
        ramp_ms: axis.ramp_ms.min(1000),
    }
}

fn axes_of(rig: &Rig, mask: u8) -> String {
    let names: Vec<&str> = (0..AXES)
        .filter(|i| mask & (1 << i) != 0)
        .map(|i| rig.axes[i].name.as_str())
        .collect();
    names.join(" and ")
}

impl Controller for ShotController {
    fn identify(&mut self, link: &mut Link, rig: &Rig) -> Result<String> {
        let mut ask = |q| {
            question(link, rig, &self.bytes(&Command::Ask(q))?, |line| {
                let plain =
                    line.len() > 2 && line.bytes().all(|b| b.is_ascii_graphic() || b == b' ');
                let stray = line.starts_with('@') || shot::parse_status(line).is_some();
                Ok((plain && !stray).then(|| line.trim().to_string()))
            })
        };
        let name = ask(Query::Name)?;
        let version = ask(Query::Version)?;
        if name != self.model.name() {
            return Err(Error::Rig(format!(
                "The controller says it is a {name}, the rig file says {}; correct `model` in the rig file.",
                self.model.name()
            )));
        }
        Ok(format!("{name} {version}"))
    }

    fn home(&mut self, link: &mut Link, rig: &Rig) -> Result<[i64; AXES]> {
        // An earlier session may have died in the middle of a move.
        self.speeds = None;
        self.order(link, rig, &Command::StopNow)?;
        self.rest(link, rig, "L:E", 0.0, rig.reply())?;
        let mut speeds: Vec<Speed> = rig.axes.iter().map(speed).collect();
        // The last ramp differs by a millisecond from what anybody would have stored as the default: the mark by which a power cut is seen.
        if let Some(last) = speeds.last_mut() {
            last.ramp_ms = last.ramp_ms.min(998) ^ 1;
        }
        self.order(link, rig, &Command::Speeds(Which::All, speeds))?;
        let speeds = self.speeds(link, rig)?;
        self.order(link, rig, &Command::Home(Which::All, Vec::new()))?;
        let status = self.rest(link, rig, "H:W", 0.0, Duration::from_secs(rig.home_s))?;
        let positions = four(&status.positions);
        verify(rig, "H:W", &[0; AXES], &positions)?;
        self.speeds = Some(speeds);
        self.still_powered(link, rig, "H:W")?;
        Ok(positions)
    }

    fn move_to(
        &mut self,
        link: &mut Link,
        rig: &Rig,
        target: &[i64; AXES],
        seconds: f64,
    ) -> Result<[i64; AXES]> {
        let command = Command::MoveTo(Which::All, target.to_vec());
        let name = named(&self.bytes(&command)?);
        self.order(link, rig, &command)?;
        self.order(link, rig, &Command::Go)?;
        let deadline = Duration::from_secs_f64(seconds * 1.5 + 2.0);
        let status = self.rest(link, rig, &name, seconds, deadline)?;
        if status.limits != 0 {
            return Err(Error::LimitSensor {
                axis: axes_of(rig, status.limits),
                command: name,
            });
        }
        let mut reached = four(&status.positions);
        if verify(rig, &name, target, &reached).is_err() {
            // A damaged digit must not cost the scan: the question may be repeated, the move not.
            reached = four(&self.status(link, rig)?.positions);
            verify(rig, &name, target, &reached)?;
        }
        self.still_powered(link, rig, &name)?;
        Ok(reached)
    }

    fn positions(&mut self, link: &mut Link, rig: &Rig) -> Result<[i64; AXES]> {
        let status = self.status(link, rig)?;
        if status.busy {
            return Err(Error::Refused {
                command: "Q:".into(),
                why: "the arms are moving although nothing was asked of them".into(),
            });
        }
        let positions = four(&status.positions);
        if positions == [0; AXES] {
            self.still_powered(link, rig, "Q:")?;
        }
        Ok(positions)
    }

    fn set_outputs(&mut self, link: &mut Link, rig: &Rig, bits: u8) -> Result<()> {
        self.order(link, rig, &Command::Output(bits))
    }

    fn stop_bytes(&self) -> &'static [u8] {
        b"L:E\r\n"
    }
}
