//! The simulated device at the end of the line: bytes in, bytes out, on its own clock; controller, photodiode head, and faults on the way.

use super::bench::Bench;
use super::fault::{Fault, FaultPlan};
use super::firmware_grbl::{GrblFirmware, WELCOME};
use super::firmware_shot::ShotFirmware;
use super::noise::Noise;
use crate::protocol::head::{self, Reply, Request};
use crate::rig::Language;

/// A line the device will send.
#[derive(Debug, Clone)]
pub(crate) struct Answer {
    /// When, seconds of the simulation.
    pub(crate) due: f64,
    /// Without its line end.
    pub(crate) text: String,
}

impl Answer {
    pub(crate) fn now(due: f64, text: String) -> Self {
        Answer { due, text }
    }
}

/// A controller's inside.
pub(crate) trait Firmware: Send {
    /// A whole line arrived. `mishap` is a fault that waits for the next move; whoever acts on it takes it.
    fn line(
        &mut self,
        line: &str,
        now: f64,
        bench: &mut Bench,
        mishap: &mut Option<Fault>,
    ) -> Vec<Answer>;
    /// A byte that acts at once; `None` when the byte is an ordinary one.
    fn real_time(&mut self, byte: u8, now: f64, bench: &mut Bench) -> Option<Vec<Answer>>;
    /// Time went by.
    fn tick(&mut self, now: f64, bench: &mut Bench) -> Vec<Answer>;
}

/// What went over the wire, for tests: the moment, whether towards the rig, the line.
#[derive(Debug, Clone, PartialEq)]
pub struct WireLine {
    /// Seconds of the simulation.
    pub at: f64,
    /// The wall clock's moment.
    pub wall: std::time::Instant,
    /// Sent by the host.
    pub to_rig: bool,
    /// Without its line end.
    pub text: String,
}

/// The whole simulated device.
pub struct Device {
    /// Arms, lamp, detector.
    pub bench: Bench,
    /// Whether exposures take their time.
    pub real_exposures: bool,
    /// Bits a second when the line's own time is simulated.
    pub wire_baud: Option<u32>,
    /// Everything said, when kept.
    pub journal: Option<Vec<WireLine>>,
    firmware: Box<dyn Firmware>,
    line: Vec<u8>,
    out: Vec<(f64, Vec<u8>)>,
    last_due: f64,
    faults: FaultPlan,
    lines: u64,
    mishap: Option<Fault>,
    vanished: bool,
    jump: f64,
}

impl Device {
    /// A device around a bench.
    pub fn new(bench: Bench, faults: FaultPlan) -> Self {
        let grbl = bench.rig.language == Language::Grbl;
        let firmware: Box<dyn Firmware> = if grbl {
            Box::new(GrblFirmware::new())
        } else {
            Box::new(ShotFirmware::new(bench.rig.model))
        };
        let mut device = Device {
            bench,
            real_exposures: true,
            wire_baud: None,
            journal: None,
            firmware,
            line: Vec::new(),
            out: Vec::new(),
            last_due: 0.0,
            faults,
            lines: 0,
            mishap: None,
            vanished: false,
            jump: 0.0,
        };
        if grbl {
            device.send(Answer::now(0.0, WELCOME.into()), &[]);
        }
        device
    }

    /// The device's own clock: the simulation's, and what it has jumped ahead.
    pub fn time(&self, now: f64) -> f64 {
        now + self.jump
    }

    /// Whether the port has gone away.
    pub fn vanished(&self) -> bool {
        self.vanished
    }

    /// Bytes from the host, at `now`.
    pub fn receive(&mut self, bytes: &[u8], now: f64) {
        let now = now
            + self.jump
            + self
                .wire_baud
                .map_or(0.0, |b| bytes.len() as f64 * 10.0 / f64::from(b));
        for &byte in bytes {
            if self.vanished {
                return;
            }
            if let Some(answers) = self.firmware.real_time(byte, now, &mut self.bench) {
                // A status question is a line of the conversation for the fault script too.
                let strikes = if byte == b'?' {
                    self.next_line(now)
                } else {
                    Vec::new()
                };
                self.note(now, true, || format!("{:?}", char::from(byte)));
                if byte == 0x18 {
                    self.line.clear();
                }
                if strikes.contains(&Fault::Lose) {
                    continue;
                }
                for answer in answers {
                    self.send(answer, &strikes);
                }
                continue;
            }
            match byte {
                b'\n' | b'\r' => {
                    let line = std::mem::take(&mut self.line);
                    if !line.is_empty() {
                        self.whole_line(line, now);
                    }
                }
                _ if self.line.len() < 1024 => self.line.push(byte),
                _ => {}
            }
        }
    }

    /// Counts a line and returns the faults that strike it; those that wait for a move are put aside.
    fn next_line(&mut self, now: f64) -> Vec<Fault> {
        self.lines += 1;
        let mut here = Vec::new();
        for fault in self.faults.at(self.lines) {
            match fault {
                Fault::Ng
                | Fault::Alarm
                | Fault::Limit
                | Fault::Stall
                | Fault::Overshoot
                | Fault::PowerCycle => self.mishap = Some(fault),
                Fault::Vanish => self.vanished = true,
                Fault::LampOff => self.bench.lamp_off_at = Some(now),
                Fault::ClockJump(s) => self.jump += s,
                other => here.push(other),
            }
        }
        here
    }

    fn whole_line(&mut self, mut line: Vec<u8>, now: f64) {
        let strikes = self.next_line(now);
        if strikes.contains(&Fault::Garble) {
            let mut noise = Noise::at(&[self.lines, 0x67]);
            let at = noise.below(line.len() as u64) as usize;
            line[at] = 33 + noise.below(90) as u8;
        }
        let text = String::from_utf8_lossy(&line).into_owned();
        self.note(now, true, || text.clone());
        if self.vanished || strikes.contains(&Fault::Lose) {
            return;
        }
        if strikes.contains(&Fault::Banner) {
            let banner = if self.bench.rig.language == Language::Grbl {
                "[MSG:Pgm End]"
            } else {
                "SHOT-304GS READY"
            };
            self.send(Answer::now(now, banner.into()), &[]);
        }
        let mut answers = self.firmware.tick(now, &mut self.bench);
        if text.starts_with('@') {
            answers.extend(self.head(&text, now));
        } else {
            answers.extend(
                self.firmware
                    .line(&text, now, &mut self.bench, &mut self.mishap),
            );
        }
        for answer in answers {
            self.send(answer, &strikes);
        }
    }

    fn head(&mut self, line: &str, now: f64) -> Option<Answer> {
        let (due, reply) = match head::parse_request(line)? {
            Request::Identify => (now, Reply::Identity("ogm-photodiode SIM-1".into())),
            Request::Lamp => (now, Reply::Lamp(self.bench.lamp_seconds(now) as u64)),
            Request::Read {
                tag,
                exposure_us,
                aperture,
            } => {
                if exposure_us == 0 || exposure_us > 600_000_000 || !(5..=640).contains(&aperture) {
                    return None;
                }
                let ms = exposure_us as f64 / 1000.0;
                let shot = self.bench.expose(now, ms, f64::from(aperture) / 10.0, tag);
                let due = if self.real_exposures {
                    now + ms / 1000.0
                } else {
                    now
                };
                (
                    due,
                    Reply::Value {
                        tag,
                        counts: shot.counts,
                        reference: shot.reference,
                        saturated: shot.saturated,
                    },
                )
            }
        };
        Some(Answer::now(
            due,
            head::encode_reply(&reply).trim_end().into(),
        ))
    }

    fn send(&mut self, answer: Answer, strikes: &[Fault]) {
        if strikes.contains(&Fault::Drop) {
            return;
        }
        let mut bytes = answer.text.clone().into_bytes();
        bytes.extend_from_slice(b"\r\n");
        let mut due = answer.due;
        let mut noise = Noise::at(&[self.lines, 0x73]);
        let mut copies = 1;
        let mut cut = None;
        for strike in strikes {
            match strike {
                Fault::Corrupt => {
                    let at = noise.below(bytes.len() as u64) as usize;
                    bytes[at] ^= 1 << noise.below(7);
                }
                Fault::Duplicate => copies = 2,
                Fault::Delay(s) => due += s,
                Fault::Split => cut = Some(noise.below(bytes.len() as u64) as usize),
                _ => {}
            }
        }
        for _ in 0..copies {
            // Ten bits a byte; a line waits until the one before it is through. An answer that is still an exposure away holds nobody up.
            let wire = self
                .wire_baud
                .map_or(0.0, |b| bytes.len() as f64 * 10.0 / f64::from(b));
            let through = self.last_due - due;
            let end = if through > 0.0 && through <= 8.0 * wire {
                self.last_due + wire
            } else {
                due + wire
            };
            match cut {
                Some(at) if at > 0 => {
                    self.out.push((end, bytes[..at].to_vec()));
                    self.out.push((end + 0.04, bytes[at..].to_vec()));
                }
                _ => self.out.push((end, bytes.clone())),
            }
            self.last_due = end;
        }
        self.note(due, false, || answer.text.clone());
    }

    fn note(&mut self, at: f64, to_rig: bool, text: impl FnOnce() -> String) {
        if let Some(journal) = &mut self.journal {
            journal.push(WireLine {
                at,
                wall: std::time::Instant::now(),
                to_rig,
                text: text(),
            });
        }
    }

    /// Bytes due for the host at `now`.
    pub fn emit(&mut self, now: f64) -> Vec<u8> {
        let now = now + self.jump;
        for answer in self.firmware.tick(now, &mut self.bench) {
            self.send(answer, &[]);
        }
        if self.vanished {
            return Vec::new();
        }
        self.out.sort_by(|a, b| a.0.total_cmp(&b.0));
        let ready = self.out.iter().take_while(|(due, _)| *due <= now).count();
        self.out
            .drain(..ready)
            .flat_map(|(_, bytes)| bytes)
            .collect()
    }

    /// When something will be due: the next answer or the end of a move.
    pub fn next_due(&self) -> Option<f64> {
        let answers = self.out.iter().map(|(due, _)| *due);
        let moves = self
            .bench
            .motors
            .iter()
            .filter_map(super::motor::Motor::end);
        answers
            .chain(moves)
            .map(|t| t - self.jump)
            .min_by(f64::total_cmp)
    }
}
