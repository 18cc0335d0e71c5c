//! Driving grblHAL with four axes: `$H`, one `$J=` at a time, and only a report of `Idle` at the target counts as arrived.

use std::time::Duration;

use super::{Controller, four, named, question, verify};
use crate::error::{Error, Result};
use crate::pose::AXES;
use crate::protocol::grbl::{self, Line, RealTime, Reply, Report, State};
use crate::rig::Rig;
use crate::transport::Link;

/// A grblHAL controller; pulses are thousandths of a degree.
#[derive(Default)]
pub struct GrblController {
    work_offset: Vec<i64>,
}

impl GrblController {
    /// A controller of which nothing is known yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Sends a line once and waits for its `ok`; reports and messages in between are passed over.
    fn order(&mut self, link: &mut Link, line: &Line, deadline: Duration) -> Result<()> {
        let bytes = grbl::encode(line)
            .ok_or_else(|| Error::Rig(format!("The line {line:?} is too long for GRBL.")))?;
        let name = named(&bytes);
        let offset = &mut self.work_offset;
        link.ask(&bytes, deadline, 1, |text| {
            match grbl::parse_reply(text, offset) {
                Some(Reply::Ok) => Ok(Some(())),
                Some(Reply::Error(n)) => Err(Error::Refused {
                    command: name.clone(),
                    why: format!("error {n}, {}", grbl::error_meaning(n)),
                }),
                Some(other) => unexpected(&other, &name).map_or(Ok(None), Err),
                None => Ok(None),
            }
        })
    }

    fn report(&mut self, link: &mut Link, rig: &Rig, command: &str) -> Result<Report> {
        let offset = &mut self.work_offset;
        question(
            link,
            rig,
            &[RealTime::Status.byte()],
            |text| match grbl::parse_reply(text, offset) {
                Some(Reply::Report(r)) if r.machine.len() >= AXES => Ok(Some(r)),
                Some(other) => unexpected(&other, command).map_or(Ok(None), Err),
                None => Ok(None),
            },
        )
        .map_err(|e| match e {
            Error::NoReply { within, .. } => Error::NoReply {
                command: format!("? (after {command})"),
                within,
            },
            e => e,
        })
    }
}

/// Alarms and restarts end whatever was going on.
fn unexpected(reply: &Reply, command: &str) -> Option<Error> {
    match reply {
        Reply::Alarm(code) => Some(Error::Alarm {
            code: *code,
            meaning: grbl::alarm_meaning(*code),
            command: command.into(),
        }),
        Reply::Welcome(_) => Some(Error::Restarted {
            command: command.into(),
        }),
        _ => None,
    }
}

impl Controller for GrblController {
    fn identify(&mut self, link: &mut Link, rig: &Rig) -> Result<String> {
        question(link, rig, b"$I\n", |text| {
            Ok(text
                .starts_with("[VER:")
                .then(|| text.trim_matches(['[', ']']).to_string()))
        })
        .map(|v| format!("GRBL {v}"))
    }

    fn home(&mut self, link: &mut Link, rig: &Rig) -> Result<[i64; AXES]> {
        // An earlier session may have died in the middle of a move: a reset ends it, and homing finds the positions again.
        link.send(&[RealTime::Reset.byte()], rig.reply())?;
        link.wait(Duration::from_millis(50))?;
        link.discard_input()?;
        self.order(link, &Line::Home, Duration::from_secs(rig.home_s))?;
        let report = self.report(link, rig, "$H")?;
        if report.state != State::Idle {
            return Err(Error::Refused {
                command: "$H".into(),
                why: format!("it is {:?} after homing, not Idle", report.state),
            });
        }
        let positions = four(&report.machine);
        verify(rig, "$H", &[0; AXES], &positions)?;
        Ok(positions)
    }

    fn move_to(
        &mut self,
        link: &mut Link,
        rig: &Rig,
        target: &[i64; AXES],
        seconds: f64,
    ) -> Result<[i64; AXES]> {
        let feed = rig
            .axes
            .iter()
            .map(|a| a.speed_deg_s * 60.0)
            .fold(f64::INFINITY, f64::min)
            .clamp(1.0, 1e6) as u32;
        let line = Line::Jog(target.to_vec(), feed);
        let name = named(&grbl::encode(&line).unwrap_or_default());
        self.order(link, &line, rig.reply())?;
        let start = link.now();
        // The feed holds for the whole vector of four axes, so the path may be up to twice as long as its longest axis.
        let deadline = Duration::from_secs_f64(seconds * 3.0 + 2.0);
        link.wait(Duration::from_secs_f64((seconds - 0.05).clamp(0.0, 3600.0)).min(deadline))?;
        let mut pause = Duration::from_millis(1);
        loop {
            let report = self.report(link, rig, &name)?;
            match report.state {
                State::Idle => {
                    let mut reached = four(&report.machine);
                    if verify(rig, &name, target, &reached).is_err() {
                        reached = four(&self.report(link, rig, &name)?.machine);
                        verify(rig, &name, target, &reached)?;
                    }
                    return Ok(reached);
                }
                State::Jog | State::Run => {}
                State::Alarm => {
                    return Err(Error::Alarm {
                        code: 0,
                        meaning: "locked; the number was lost on the line",
                        command: name,
                    });
                }
                other => {
                    return Err(Error::Refused {
                        command: name,
                        why: format!("it went into {other:?}"),
                    });
                }
            }
            if link.now() - start > deadline {
                link.send_stop();
                return Err(Error::StillMoving {
                    command: name,
                    within: deadline,
                });
            }
            link.wait(pause)?;
            pause = (pause * 2).min(Duration::from_millis(100)); // at most ten questions a second on a long move
        }
    }

    fn positions(&mut self, link: &mut Link, rig: &Rig) -> Result<[i64; AXES]> {
        let report = self.report(link, rig, "?")?;
        match report.state {
            State::Idle => Ok(four(&report.machine)),
            other => Err(Error::Refused {
                command: "?".into(),
                why: format!("it is {other:?} although nothing was asked of it"),
            }),
        }
    }

    fn set_outputs(&mut self, link: &mut Link, rig: &Rig, bits: u8) -> Result<()> {
        for port in 0..4 {
            self.order(
                link,
                &Line::Output(port, bits & (1 << port) != 0),
                rig.reply(),
            )?;
        }
        Ok(())
    }

    fn stop_bytes(&self) -> &'static [u8] {
        // Cancel the jog (slows down, keeps the position), hold anything else, then reset so that nothing goes on by itself.
        &[0x85, b'!', 0x18]
    }
}
