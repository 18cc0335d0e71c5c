//! Any camera as a detector: a command of the lab's own that answers the JSON lines of [`crate::protocol::camera`], so that no camera library is
//! needed here. What it says on standard error goes to the terminal.

use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::{Duration, Instant};

use super::{Detector, Exposure, Shot};
use crate::error::{Error, Result};
use crate::protocol::camera::{self, Answer, Question};
use crate::rig::Rig;
use crate::transport::{Link, SLICE};

/// A line longer than this is not an answer.
const LONGEST_LINE: u64 = 1 << 16;

/// A running detector command; it is ended when this is dropped.
pub struct ExternalDetector {
    command: String,
    child: Child,
    stdin: ChildStdin,
    lines: Receiver<String>,
}

impl ExternalDetector {
    /// Starts `command` by the shell.
    ///
    /// # Errors
    /// [`Error::Detector`] when it cannot be started.
    pub fn start(command: &str) -> Result<Self> {
        let failed = |why: String| {
            Error::Detector(format!(
                "The detector command {command:?} cannot be started: {why}."
            ))
        };
        let mut child = Command::new("sh")
            .args(["-c", command])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|e| failed(e.to_string()))?;
        let (Some(stdin), Some(stdout)) = (child.stdin.take(), child.stdout.take()) else {
            return Err(failed("it has no standard input or output".into()));
        };
        let (to, lines) = sync_channel(16);
        std::thread::Builder::new()
            .name("detector".into())
            .spawn(move || {
                let mut reader = BufReader::new(stdout);
                loop {
                    let mut line = Vec::new();
                    match reader
                        .by_ref()
                        .take(LONGEST_LINE)
                        .read_until(b'\n', &mut line)
                    {
                        Ok(n) if n > 0 => {}
                        _ => return,
                    }
                    if to
                        .send(String::from_utf8_lossy(&line).trim().to_string())
                        .is_err()
                    {
                        return;
                    }
                }
            })
            .map_err(|e| failed(e.to_string()))?;
        Ok(ExternalDetector {
            command: command.into(),
            child,
            stdin,
            lines,
        })
    }

    fn trouble(&self, what: &str) -> Error {
        Error::Detector(format!(
            "The detector command {:?} {what}; look at its own messages, then start again.",
            self.command
        ))
    }

    /// Asks once and waits for the first answer that `pick` takes; the arms are stopped at once when asked to meanwhile.
    fn ask<T>(
        &mut self,
        link: &mut Link,
        question: Question,
        deadline: Duration,
        pick: impl Fn(Answer) -> Option<T>,
    ) -> Result<T> {
        while self.lines.try_recv().is_ok() {} // late answers to earlier questions
        let question = camera::encode(&question);
        if writeln!(self.stdin, "{question}")
            .and_then(|()| self.stdin.flush())
            .is_err()
        {
            return Err(self.trouble("has ended"));
        }
        let end = Instant::now() + deadline;
        let mut strange = None;
        loop {
            link.check_stop()?;
            match self.lines.recv_timeout(SLICE) {
                Ok(line) => match camera::parse_answer(&line) {
                    Some(Answer::Trouble { error }) => {
                        return Err(self.trouble(&format!("reports: {error}")));
                    }
                    answer => match answer.and_then(&pick) {
                        Some(value) => return Ok(value),
                        None => strange = Some(line),
                    },
                },
                Err(RecvTimeoutError::Timeout) if Instant::now() < end => {}
                Err(RecvTimeoutError::Timeout) => {
                    return Err(self.trouble(&match strange {
                        Some(line) => format!("answered {question} with {line:?}"),
                        None => format!(
                            "gave no answer within {} s to {question}",
                            deadline.as_secs_f64()
                        ),
                    }));
                }
                Err(RecvTimeoutError::Disconnected) => return Err(self.trouble("has ended")),
            }
        }
    }
}

impl Drop for ExternalDetector {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A camera may need this long to wake up.
const WAKING: Duration = Duration::from_secs(30);
/// A camera reads out: this long beyond the exposure.
const READING_OUT: Duration = Duration::from_secs(2);

impl Detector for ExternalDetector {
    fn identify(&mut self, link: &mut Link, _rig: &Rig) -> Result<String> {
        self.ask(link, Question::Identify, WAKING, |a| match a {
            Answer::Identity { name } => Some(name),
            _ => None,
        })
    }

    fn lamp_seconds(&mut self, link: &mut Link, rig: &Rig) -> Result<Option<f64>> {
        self.ask(link, Question::Lamp, rig.reply(), |a| match a {
            Answer::Lamp { seconds } => Some(seconds),
            _ => None,
        })
    }

    fn expose(&mut self, link: &mut Link, rig: &Rig, exposure: &Exposure) -> Result<Shot> {
        let Exposure { tag, ms, f_number } = *exposure;
        let question = Question::Expose { tag, ms, f_number };
        let deadline = exposure.deadline(rig) + READING_OUT;
        self.ask(link, question, deadline, |a| match a {
            Answer::Exposed {
                tag: t,
                counts,
                reference,
                saturated,
            } if t == tag => Some(exposure.shot(counts, reference, saturated)),
            _ => None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::optics::PlainCloth;
    use crate::sim::{Bench, Device, FaultPlan, Imperfections, MemoryTransport};
    use crate::transport::StopToken;
    use std::sync::{Arc, Mutex};

    fn link(stop: &StopToken) -> (Link, Rig) {
        let rig = Rig {
            reply_ms: 300,
            ..Rig::default()
        };
        let bench = Bench::new(rig.clone(), Arc::new(PlainCloth), Imperfections::none());
        let device = Arc::new(Mutex::new(Device::new(bench, FaultPlan::none())));
        (
            Link::new(
                Box::new(MemoryTransport::new(device)),
                stop.clone(),
                b"L:E\r\n",
            ),
            rig,
        )
    }

    fn exposure(tag: u64, ms: f64) -> Exposure {
        Exposure {
            tag,
            ms,
            f_number: 4.0,
        }
    }

    /// A camera in eight lines of shell.
    const CAMERA: &str = r#"while read line; do case "$line" in
        *identify*) echo noise; echo '{"name":"shell camera 1"}';;
        *lamp*) echo '{"seconds":null}';;
        *) tag=${line##*\"tag\":}; tag=${tag%%[,\}]*}; echo "{\"tag\":$tag,\"counts\":1234.5,\"saturated\":false}";;
    esac; done"#;

    #[test]
    fn a_camera_in_shell_is_a_detector() {
        let stop = StopToken::new();
        let (mut link, rig) = link(&stop);
        let mut d = ExternalDetector::start(CAMERA).unwrap();
        assert_eq!(d.identify(&mut link, &rig).unwrap(), "shell camera 1");
        assert_eq!(d.lamp_seconds(&mut link, &rig).unwrap(), None);
        let shot = d.expose(&mut link, &rig, &exposure(7, 16.0)).unwrap();
        assert_eq!(
            shot,
            Shot {
                exposure_ms: 16.0,
                counts: 1234.5,
                reference: 0.0,
                saturated: false
            }
        );
    }

    #[test]
    fn silence_death_nonsense_and_its_own_errors_are_sentences() {
        let stop = StopToken::new();
        let (mut link, rig) = link(&stop);
        for (command, word) in [
            ("cat > /dev/null", "no answer within 0.3 s"),
            ("exit 3", "has ended"),
            (
                "while read l; do echo '{\"seconds\":\"many\"}'; done",
                "answered",
            ),
            (
                "while read l; do echo '{\"error\":\"lens cap on\"}'; done",
                "lens cap on",
            ),
        ] {
            let begun = Instant::now();
            let e = ExternalDetector::start(command)
                .and_then(|mut d| d.lamp_seconds(&mut link, &rig))
                .unwrap_err()
                .to_string();
            assert!(e.contains(word) && e.ends_with('.'), "{e}");
            assert!(begun.elapsed() < Duration::from_secs(5));
        }
    }

    #[test]
    fn a_stop_does_not_wait_for_the_camera() {
        let stop = StopToken::new();
        let (mut link, rig) = link(&stop);
        let mut d = ExternalDetector::start("cat > /dev/null").unwrap();
        let token = stop.clone();
        std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(50));
            token.stop();
        });
        assert!(matches!(
            d.expose(&mut link, &rig, &exposure(1, 60_000.0)),
            Err(Error::Stopped)
        ));
    }
}
