//! A conversation with the rig kept in a file, and played back later without the rig: what a user sends when something went wrong at night.
//!
//! A line of the file is `> seconds bytes` (sent) or `< seconds bytes` (received), the bytes as Rust escapes them, seconds on the transport's clock.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::error::{Error, Result};
use crate::transport::Transport;

/// A transport that writes down everything that passes.
pub struct Recorder {
    inner: Box<dyn Transport>,
    file: BufWriter<File>,
    path: PathBuf,
}

impl Recorder {
    /// Writes what passes over `inner` into a new file.
    ///
    /// # Errors
    /// [`Error::Io`]; a file that is there already is not overwritten.
    pub fn new(inner: Box<dyn Transport>, path: &Path) -> Result<Self> {
        let file = File::create_new(path).map_err(|e| Error::io("make", path, e))?;
        Ok(Recorder {
            inner,
            file: BufWriter::new(file),
            path: path.into(),
        })
    }

    fn note(&mut self, way: char, bytes: &[u8]) -> Result<()> {
        let seconds = self.inner.now().as_secs_f64();
        writeln!(self.file, "{way} {seconds:.6} {}", bytes.escape_ascii())
            .map_err(|e| Error::io("write", &self.path, e))
    }
}

impl Transport for Recorder {
    fn write(&mut self, bytes: &[u8], timeout: Duration) -> Result<usize> {
        let n = self.inner.write(bytes, timeout)?;
        if n > 0 {
            self.note('>', &bytes[..n])?;
        }
        Ok(n)
    }

    fn read(&mut self, into: &mut Vec<u8>, timeout: Duration) -> Result<usize> {
        let n = self.inner.read(into, timeout)?;
        if n > 0 {
            let new = into[into.len() - n..].to_vec();
            self.note('<', &new)?;
        }
        Ok(n)
    }

    fn now(&self) -> Duration {
        self.inner.now()
    }

    fn wait(&mut self, time: Duration) {
        self.inner.wait(time);
    }

    fn name(&self) -> String {
        self.inner.name()
    }
}

/// One line of a recording.
#[derive(Debug, Clone, PartialEq)]
struct Entry {
    sent: bool,
    at: Duration,
    bytes: Vec<u8>,
}

/// A transport that answers what a recording says, on the recording's clock, as long as it is asked what was asked then.
pub struct Playback {
    entries: Vec<Entry>,
    next: usize,
    /// How much of the bytes of `next` were sent by now.
    gone: usize,
    now: Duration,
    name: String,
}

impl Playback {
    /// Reads a recording.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Log`] naming the line that cannot be read.
    pub fn open(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|e| Error::io("read", path, e))?;
        let name = path.display().to_string();
        let mut entries = Vec::new();
        for (number, line) in text.lines().enumerate() {
            let entry = parse(line).ok_or_else(|| {
                Error::Log(format!(
                    "Line {} of the recording {name} cannot be read; it should be like `> 0.100000 Q:\\r\\n`.",
                    number + 1
                ))
            })?;
            entries.push(entry);
        }
        Ok(Playback {
            entries,
            next: 0,
            gone: 0,
            now: Duration::ZERO,
            name,
        })
    }

    fn differs(&self, said: &[u8]) -> Error {
        let then = match self.entries.get(self.next) {
            None => "has ended".to_string(),
            Some(e) => format!(
                "has {:?}",
                e.bytes[self.gone.min(e.bytes.len())..]
                    .escape_ascii()
                    .to_string()
            ),
        };
        Error::PortLost {
            port: self.name.clone(),
            why: format!(
                "the driver says {:?} where the recording {then}, line {}",
                said.escape_ascii().to_string(),
                self.next + 1
            ),
        }
    }
}

fn parse(line: &str) -> Option<Entry> {
    let mut words = line.splitn(3, ' ');
    let sent = match words.next()? {
        ">" => true,
        "<" => false,
        _ => return None,
    };
    let seconds: f64 = words.next()?.parse().ok()?;
    let at = Duration::try_from_secs_f64(seconds).ok()?;
    let bytes = unescape(words.next()?)?;
    (!bytes.is_empty()).then_some(Entry { sent, at, bytes })
}

/// The bytes behind [`slice::escape_ascii`].
fn unescape(text: &str) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(text.len());
    let mut bytes = text.bytes();
    while let Some(b) = bytes.next() {
        out.push(match b {
            b'\\' => match bytes.next()? {
                b't' => b'\t',
                b'r' => b'\r',
                b'n' => b'\n',
                b'x' => {
                    let digit = |b: u8| char::from(b).to_digit(16);
                    (digit(bytes.next()?)? * 16 + digit(bytes.next()?)?) as u8
                }
                plain @ (b'\\' | b'\'' | b'"') => plain,
                _ => return None,
            },
            b if b.is_ascii() => b,
            _ => return None,
        });
    }
    Some(out)
}

impl Transport for Playback {
    fn write(&mut self, bytes: &[u8], _timeout: Duration) -> Result<usize> {
        // What was not read before the next line went out was thrown away then, too.
        let unread = self.entries[self.next..].iter().take_while(|e| !e.sent);
        self.next += unread.count();
        for (k, byte) in bytes.iter().enumerate() {
            match self.entries.get(self.next) {
                Some(e) if e.sent && e.bytes[self.gone] == *byte => {
                    self.now = self.now.max(e.at);
                    self.gone += 1;
                    if self.gone == e.bytes.len() {
                        (self.next, self.gone) = (self.next + 1, 0);
                    }
                }
                _ => return Err(self.differs(&bytes[k..])),
            }
        }
        Ok(bytes.len())
    }

    fn read(&mut self, into: &mut Vec<u8>, timeout: Duration) -> Result<usize> {
        let end = self.now + timeout;
        match self.entries.get(self.next) {
            Some(e) if !e.sent && e.at <= end => {
                self.now = self.now.max(e.at);
                self.next += 1;
                into.extend_from_slice(&e.bytes);
                Ok(e.bytes.len())
            }
            _ => {
                self.now = end;
                Ok(0)
            }
        }
    }

    fn now(&self) -> Duration {
        self.now
    }

    fn wait(&mut self, time: Duration) {
        self.now += time;
    }

    fn name(&self) -> String {
        self.name.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_survives_the_file() {
        let all: Vec<u8> = (0..=255).collect();
        let line = format!("> 1.500000 {}", all.escape_ascii());
        let entry = parse(&line).unwrap();
        assert_eq!((entry.bytes, entry.at), (all, Duration::from_millis(1500)));
        for bad in [
            "",
            "> 1.0",
            "> x Q:",
            "= 1.0 Q:",
            "> -1 Q:",
            "> 1.0 \\q",
            "> 1.0 \\x4",
            "> 1.0 ",
        ] {
            assert_eq!(parse(bad), None, "{bad:?}");
        }
    }

    #[test]
    fn another_conversation_is_told_apart() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("wire.txt");
        std::fs::write(&path, "> 0.1 Q:\\r\\n\n< 0.2 answer\\r\\n\n").unwrap();
        let slice = Duration::from_millis(5);
        let mut p = Playback::open(&path).unwrap();
        let e = p.write(b"!:\r\n", slice).unwrap_err().to_string();
        assert!(
            e.contains("!:") && e.contains("Q:") && e.contains("line 1"),
            "{e}"
        );
        let mut p = Playback::open(&path).unwrap();
        let mut heard = Vec::new();
        assert_eq!(p.write(b"Q:\r\n", slice).unwrap(), 4);
        assert_eq!(
            p.read(&mut heard, slice).unwrap(),
            0,
            "0.2 s is not reached yet"
        );
        assert_eq!(p.read(&mut heard, Duration::from_secs(1)).unwrap(), 8);
        assert_eq!(
            (heard.as_slice(), p.now()),
            (&b"answer\r\n"[..], Duration::from_millis(200))
        );
    }
}
