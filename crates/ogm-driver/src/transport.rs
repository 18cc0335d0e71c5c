//! Carrying bytes: the trait, the link with its own line buffer, deadlines, and the stop that goes out before anything else.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::error::{Error, Result};

/// Bytes there and back, and the clock that belongs to them (a simulated rig brings its own).
pub trait Transport: Send {
    /// Writes some of `bytes`, waiting at most `timeout`; returns how many went out (0 = none in time).
    ///
    /// # Errors
    /// [`Error::PortLost`] when the other side is gone.
    fn write(&mut self, bytes: &[u8], timeout: Duration) -> Result<usize>;
    /// Appends what arrives within `timeout` to `into`; returns how many bytes (0 = none in time).
    ///
    /// # Errors
    /// [`Error::PortLost`] when the other side is gone.
    fn read(&mut self, into: &mut Vec<u8>, timeout: Duration) -> Result<usize>;
    /// Time since the transport was opened; never goes back.
    fn now(&self) -> Duration;
    /// Waits.
    fn wait(&mut self, time: Duration);
    /// Name of the port for messages.
    fn name(&self) -> String;
}

/// A request to stop, shared between the signal handler and the thread that owns the port.
#[derive(Debug, Clone, Default)]
pub struct StopToken(Arc<AtomicBool>);

impl StopToken {
    /// A token nobody has pulled yet.
    pub fn new() -> Self {
        Self::default()
    }
    /// Asks the owner of the port to stop the arms.
    pub fn stop(&self) {
        self.0.store(true, Ordering::SeqCst);
    }
    /// Whether a stop was asked for.
    pub fn is_set(&self) -> bool {
        self.0.load(Ordering::SeqCst)
    }
}

/// Every wait is cut into slices of this length, so that a stop goes out within it (the promise is 50 ms).
pub const SLICE: Duration = Duration::from_millis(5);
/// No reply of any protocol here is longer; more without a line end is noise.
const LONGEST_LINE: usize = 1024;

/// The one owner of a port: sends lines, collects lines, and sends the stop bytes when asked to.
pub struct Link {
    transport: Box<dyn Transport>,
    buffer: Vec<u8>,
    stop: StopToken,
    stop_bytes: Vec<u8>,
    stopped: bool,
    mid_line: bool,
}

impl Link {
    /// A link over a transport; `stop_bytes` is what stops the arms of this controller.
    pub fn new(transport: Box<dyn Transport>, stop: StopToken, stop_bytes: &[u8]) -> Self {
        Link {
            transport,
            buffer: Vec::new(),
            stop,
            stop_bytes: stop_bytes.to_vec(),
            stopped: false,
            mid_line: false,
        }
    }

    /// The transport's clock.
    pub fn now(&self) -> Duration {
        self.transport.now()
    }

    /// Name of the port.
    pub fn name(&self) -> String {
        self.transport.name()
    }

    /// Whether a stop was asked for; the first time it also sends the stop bytes.
    ///
    /// # Errors
    /// [`Error::Stopped`] when a stop was asked for.
    pub fn check_stop(&mut self) -> Result<()> {
        if !self.stop.is_set() {
            return Ok(());
        }
        if !self.stopped {
            self.stopped = true;
            self.send_stop();
        }
        Err(Error::Stopped)
    }

    /// Sends the stop bytes if a stop was asked for, for places that cannot end in the middle.
    pub fn stop_if_asked(&mut self) {
        // The error is raised again by the next call that may end.
        let _ = self.check_stop();
    }

    /// Sends the stop bytes now, whatever else is going on; a port that is gone is no error here.
    pub fn send_stop(&mut self) {
        let mut bytes = if self.mid_line {
            b"\r\n".to_vec()
        } else {
            Vec::new()
        };
        bytes.extend_from_slice(&self.stop_bytes);
        let give_up = self.now() + Duration::from_millis(500);
        let mut sent = 0;
        while sent < bytes.len() && self.now() < give_up {
            match self.transport.write(&bytes[sent..], SLICE) {
                Ok(0) => self.transport.wait(Duration::from_millis(1)),
                Ok(n) => sent += n,
                Err(_) => return,
            }
        }
        self.mid_line = false;
    }

    /// Sends bytes within `deadline`.
    ///
    /// # Errors
    /// [`Error::Stopped`], [`Error::PortLost`], or [`Error::NoReply`] when the port does not take them.
    pub fn send(&mut self, bytes: &[u8], deadline: Duration) -> Result<()> {
        let end = self.now() + deadline;
        let mut sent = 0;
        while sent < bytes.len() {
            self.check_stop()?;
            let n = self.transport.write(&bytes[sent..], SLICE)?;
            sent += n;
            self.mid_line = sent < bytes.len() && sent > 0;
            if n == 0 {
                if self.now() >= end {
                    let command = String::from_utf8_lossy(bytes).trim_end().to_string();
                    return Err(Error::NoReply {
                        command,
                        within: deadline,
                    });
                }
                self.transport.wait(Duration::from_millis(1));
            }
        }
        Ok(())
    }

    /// The next whole line without its line end, or `None` when `end` (on the transport's clock) passes.
    ///
    /// # Errors
    /// [`Error::Stopped`] or [`Error::PortLost`].
    pub fn line_until(&mut self, end: Duration) -> Result<Option<String>> {
        loop {
            self.check_stop()?;
            while let Some(at) = self.buffer.iter().position(|&b| b == b'\n' || b == b'\r') {
                let line: Vec<u8> = self.buffer.drain(..=at).collect();
                if at > 0 {
                    return Ok(Some(String::from_utf8_lossy(&line[..at]).into_owned()));
                }
            }
            if self.buffer.len() > LONGEST_LINE {
                self.buffer.clear();
            }
            let now = self.now();
            if now >= end {
                return Ok(None);
            }
            self.transport
                .read(&mut self.buffer, SLICE.min(end - now))?;
        }
    }

    /// Throws away what has already arrived: late answers to earlier questions.
    ///
    /// # Errors
    /// [`Error::PortLost`].
    pub fn discard_input(&mut self) -> Result<()> {
        self.buffer.clear();
        for _ in 0..64 {
            if self.transport.read(&mut self.buffer, Duration::ZERO)? == 0 {
                break;
            }
            self.buffer.clear();
        }
        Ok(())
    }

    /// Asks and returns the first line that `read` understands; lines it does not understand are skipped until the deadline.
    /// `tries` > 1 only for questions that change nothing.
    ///
    /// # Errors
    /// [`Error::NoReply`], [`Error::Garbled`] (something came, nothing fitted), [`Error::Stopped`], [`Error::PortLost`], or what `read` returns.
    pub fn ask<T>(
        &mut self,
        question: &[u8],
        deadline: Duration,
        tries: u32,
        mut read: impl FnMut(&str) -> Result<Option<T>>,
    ) -> Result<T> {
        let command = String::from_utf8_lossy(question).trim_end().to_string();
        let mut strange = None;
        for _ in 0..tries.max(1) {
            self.check_stop()?;
            self.discard_input()?;
            let end = self.now() + deadline;
            self.send(question, deadline)?;
            while let Some(line) = self.line_until(end)? {
                match read(&line)? {
                    Some(value) => return Ok(value),
                    None => strange = Some(line),
                }
            }
        }
        Err(match strange {
            Some(got) => Error::Garbled { command, got },
            None => Error::NoReply {
                command,
                within: deadline,
            },
        })
    }

    /// Waits in slices.
    ///
    /// # Errors
    /// [`Error::Stopped`].
    pub fn wait(&mut self, time: Duration) -> Result<()> {
        let end = self.now() + time;
        loop {
            self.check_stop()?;
            let now = self.now();
            if now >= end {
                return Ok(());
            }
            self.transport.wait(SLICE.min(end - now));
        }
    }
}
