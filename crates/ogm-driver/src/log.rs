//! The scan log: append-only, one line a record, each with its number and checksum, on the disk before the arms move on.
//!
//! A line is `#<number> <crc32> <json>`: the number counts from 0 in eight digits, the CRC-32 (IEEE) in eight hexadecimal digits covers
//! `<number> <json>`. A new line followed by `#` is the mark from which reading starts again after damage.
//! What follows the last whole record is a torn tail: it was never acknowledged and is cut off when the scan goes on.
//! A bad or missing record *before* a good one is damage, which is an error: somebody should know.

use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc;

use serde::{Deserialize, Serialize};

use crate::detector::Shot;
use crate::error::{Error, Result};
use crate::pose::Pose;

/// The format's number; a reader refuses others.
pub const FORMAT: u32 = 1;
/// No record is longer.
const LONGEST_RECORD: usize = 1 << 20;

/// What a reading is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum What {
    /// Shutter closed.
    Dark,
    /// The direct beam, without the sample: the scale.
    Direct,
    /// The direct beam at exposures over the detector's range.
    Linearity,
    /// The white standard.
    White,
    /// The direct beam again, to follow the lamp.
    Reference,
    /// The direct beam after a resume, to see that the rig is as it was.
    Check,
    /// The sample.
    Sample,
}

/// One pose's reading.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// What was in the beam.
    pub what: What,
    /// Number within its kind; for the sample the place in the route.
    pub index: usize,
    /// The pose of the plan.
    pub asked: Pose,
    /// The pose that the controller reported at rest.
    pub reached: Pose,
    /// The f-number of all shots.
    pub f_number: f64,
    /// The exposures.
    pub shots: Vec<Shot>,
    /// Wall clock, seconds since 1970.
    pub wall_s: f64,
    /// Seconds since the first session began, by a clock that does not jump while a session lasts.
    pub scan_s: f64,
}

/// A record of the log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Record {
    /// The first record.
    Header {
        /// [`FORMAT`].
        format: u32,
        /// Program and version.
        software: String,
        /// The plan as TOML.
        plan: String,
        /// The rig as TOML.
        rig: String,
        /// SHA-256 of plan and rig text.
        fingerprint: String,
        /// Poses of the route.
        points: usize,
    },
    /// The scan was started or resumed.
    Session {
        /// From 0.
        number: u32,
        /// Wall clock, seconds since 1970.
        wall_s: f64,
        /// Seconds of [`Reading::scan_s`] at the session's start.
        scan_s: f64,
        /// Controller and firmware.
        controller: String,
        /// Detector and serial number.
        detector: String,
        /// Seconds the lamp had been on, if known.
        lamp_s: Option<f64>,
        /// Bytes of a torn tail that were cut off.
        torn_bytes: u64,
    },
    /// A reading.
    Reading(Reading),
    /// The scan is complete.
    End {
        /// Sample readings in the log.
        points: usize,
    },
}

/// A record as a line with its line end.
pub fn encode(number: u64, record: &Record) -> Result<Vec<u8>> {
    let json = serde_json::to_string(record)
        .map_err(|e| Error::Log(format!("A record cannot be written: {e}.")))?;
    let body = format!("{number:08} {json}");
    Ok(format!(
        "#{number:08} {:08x} {json}\n",
        crc32fast::hash(body.as_bytes())
    )
    .into_bytes())
}

/// A line (without its line end) as number and record; `None` when it is damaged.
pub fn decode(line: &[u8]) -> Option<(u64, Record)> {
    let text = std::str::from_utf8(line).ok()?.strip_prefix('#')?;
    let (number, rest) = text.split_once(' ')?;
    let (crc, json) = rest.split_once(' ')?;
    if number.len() < 8 || crc.len() != 8 {
        return None;
    }
    let sum = u32::from_str_radix(crc, 16).ok()?;
    if crc32fast::hash(format!("{number} {json}").as_bytes()) != sum {
        return None;
    }
    Some((number.parse().ok()?, serde_json::from_str(json).ok()?))
}

/// What was found in a log.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Contents {
    /// Every good record.
    pub records: Vec<Record>,
    /// Bytes up to the end of the last good record.
    pub good_bytes: u64,
    /// Bytes after it: torn by the end of power, never acknowledged.
    pub torn_bytes: u64,
    /// Damage before the last good record, each a sentence.
    pub damage: Vec<String>,
}

/// Reads everything that can be read of a log's bytes.
pub fn parse(bytes: &[u8]) -> Contents {
    let mut out = Contents::default();
    let (mut at, mut next, mut bad_since) = (0_usize, 0_u64, None::<usize>);
    while at < bytes.len() {
        let Some(length) = bytes[at..].iter().position(|&b| b == b'\n') else {
            break;
        };
        let line = &bytes[at..at + length];
        let end = at + length + 1;
        // A damaged line end hides the record after it: reading starts again at every mark inside the line.
        let marks = line.iter().enumerate().filter(|(_, b)| **b == b'#');
        let found = marks
            .take(64)
            .find_map(|(start, _)| Some((start, decode(&line[start..])?)))
            .filter(|_| line.len() <= 2 * LONGEST_RECORD);
        match found {
            Some((start, (number, record))) => {
                if start > 0 {
                    bad_since = bad_since.or(Some(at));
                }
                if let Some(since) = bad_since.take() {
                    out.damage
                        .push(format!("Bytes {since} to {} cannot be read.", at + start));
                }
                match number.cmp(&next) {
                    std::cmp::Ordering::Equal => out.records.push(record),
                    std::cmp::Ordering::Greater => {
                        out.damage.push(format!(
                            "Records {next} to {} are missing before byte {at}.",
                            number - 1
                        ));
                        out.records.push(record);
                    }
                    std::cmp::Ordering::Less => out.damage.push(format!(
                        "Record {number} stands a second time at byte {at}; it was passed over."
                    )),
                }
                next = next.max(number + 1);
                out.good_bytes = end as u64;
            }
            None => bad_since = bad_since.or(Some(at)),
        }
        at = end;
    }
    out.torn_bytes = bytes.len() as u64 - out.good_bytes;
    out
}

/// Reads a log file.
///
/// # Errors
/// [`Error::Io`].
pub fn read(path: &Path) -> Result<Contents> {
    let mut bytes = Vec::new();
    File::open(path)
        .and_then(|mut f| f.read_to_end(&mut bytes))
        .map_err(|e| Error::io("read", path, e))?;
    Ok(parse(&bytes))
}

/// Where the bytes of a log go; a test records what a disk would see.
pub trait Sink: Send {
    /// Appends.
    ///
    /// # Errors
    /// The system's.
    fn append(&mut self, bytes: &[u8]) -> std::io::Result<()>;
    /// Returns when everything appended is on the disk.
    ///
    /// # Errors
    /// The system's.
    fn sync(&mut self) -> std::io::Result<()>;
}

impl Sink for File {
    fn append(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        self.write_all(bytes)
    }
    fn sync(&mut self) -> std::io::Result<()> {
        self.sync_data()
    }
}

/// A log open for appending.
pub struct Writer {
    sink: Box<dyn Sink>,
    path: PathBuf,
    next: u64,
    broken: bool,
}

impl Writer {
    /// Opens a log, making it if there is none. A torn tail is cut off; damage in the middle refuses.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Log`] when the file is damaged, is not a log, or another scan is writing it.
    pub fn open(path: &Path) -> Result<(Self, Contents)> {
        let io = |verb| move |e| Error::io(verb, path, e);
        let mut file = OpenOptions::new()
            .read(true)
            .append(true)
            .create(true)
            .open(path)
            .map_err(io("open"))?;
        rustix::fs::flock(&file, rustix::fs::FlockOperation::NonBlockingLockExclusive).map_err(
            |_| {
                Error::Log(format!(
                    "Another scan is writing {}; wait for it or choose another file.",
                    path.display()
                ))
            },
        )?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(io("read"))?;
        let contents = parse(&bytes);
        if let Some(first) = contents.damage.first() {
            return Err(Error::Log(format!(
                "The log {} is damaged in the middle ({} places; the first: {first}) and is not continued. `ogm merge --salvage` uses what is readable.",
                path.display(),
                contents.damage.len()
            )));
        }
        if contents.records.is_empty() && contents.torn_bytes > 0 && !could_be_torn_header(&bytes) {
            return Err(Error::Log(format!(
                "{} is not a scan log and is left alone; choose another file.",
                path.display()
            )));
        }
        if contents.torn_bytes > 0 {
            file.set_len(contents.good_bytes)
                .map_err(io("cut the torn end of"))?;
            file.sync_all().map_err(io("sync"))?;
        }
        file.seek(SeekFrom::End(0)).map_err(io("seek in"))?;
        sync_folder(path);
        let next = contents.records.len() as u64;
        Ok((
            Writer {
                sink: Box::new(file),
                path: path.into(),
                next,
                broken: false,
            },
            contents,
        ))
    }

    /// A log into any sink, beginning with record 0.
    pub fn over(sink: Box<dyn Sink>) -> Self {
        Writer {
            sink,
            path: "log".into(),
            next: 0,
            broken: false,
        }
    }

    /// Appends a record and returns when it is on the disk.
    ///
    /// # Errors
    /// [`Error::Io`]; after it the writer refuses everything, because the file's end is unknown.
    pub fn append(&mut self, record: &Record) -> Result<()> {
        if self.broken {
            return Err(Error::Log(format!(
                "The log {} failed before; start again, the scan resumes.",
                self.path.display()
            )));
        }
        let line = encode(self.next, record)?;
        if let Err(e) = self.sink.append(&line).and_then(|()| self.sink.sync()) {
            self.broken = true;
            return Err(Error::io("write", &self.path, e));
        }
        self.next += 1;
        Ok(())
    }
}

/// A writer on a thread of its own: a disk that takes its time must not keep the owner of the port from sending a stop.
pub struct Worker {
    to: Option<mpsc::Sender<Record>>,
    from: mpsc::Receiver<Result<()>>,
    thread: Option<std::thread::JoinHandle<()>>,
}

impl Worker {
    /// Gives the writer its thread.
    ///
    /// # Errors
    /// [`Error::Log`] when the system gives no thread.
    pub fn new(mut writer: Writer) -> Result<Self> {
        let (to, records) = mpsc::channel::<Record>();
        let (answers, from) = mpsc::channel();
        let thread = std::thread::Builder::new()
            .name("log".into())
            .spawn(move || {
                for record in records {
                    if answers.send(writer.append(&record)).is_err() {
                        return;
                    }
                }
            })
            .map_err(|e| Error::Log(format!("The log's thread cannot be started: {e}.")))?;
        Ok(Worker {
            to: Some(to),
            from,
            thread: Some(thread),
        })
    }

    /// Appends a record and returns when it is on the disk; `meanwhile` is called every 5 ms and cannot end the waiting.
    ///
    /// # Errors
    /// As [`Writer::append`].
    pub fn append(&mut self, record: &Record, mut meanwhile: impl FnMut()) -> Result<()> {
        let gone =
            || Error::Log("The log's thread has ended; start again, the scan resumes.".into());
        let to = self.to.as_ref().ok_or_else(gone)?;
        to.send(record.clone()).map_err(|_| gone())?;
        loop {
            match self.from.recv_timeout(std::time::Duration::from_millis(5)) {
                Ok(result) => return result,
                Err(mpsc::RecvTimeoutError::Timeout) => meanwhile(),
                Err(mpsc::RecvTimeoutError::Disconnected) => return Err(gone()),
            }
        }
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.to = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Whether the bytes can be the beginning of record 0 cut by the end of power: its first characters, or zeros the disk filled in.
fn could_be_torn_header(bytes: &[u8]) -> bool {
    let start = b"#00000000 ";
    let n = bytes.len().min(start.len());
    bytes[..n] == start[..n] || bytes.iter().all(|b| *b == 0)
}

/// Makes a new file's name durable; where folders cannot be synced this does nothing.
fn sync_folder(path: &Path) {
    let folder = path
        .parent()
        .filter(|p| !p.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    if let Ok(folder) = File::open(folder) {
        let _ = folder.sync_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn end(points: usize) -> Record {
        Record::End { points }
    }

    fn three() -> Vec<u8> {
        (0..3)
            .flat_map(|n| encode(n, &end(n as usize)).unwrap())
            .collect()
    }

    #[test]
    fn every_cut_is_a_torn_tail() {
        let whole = three();
        let one = encode(0, &end(0)).unwrap().len();
        for cut in 0..=whole.len() {
            let c = parse(&whole[..cut]);
            assert_eq!(c.records.len(), cut / one, "{cut}");
            assert!(c.damage.is_empty());
            assert_eq!(c.good_bytes + c.torn_bytes, cut as u64);
        }
    }

    #[test]
    fn every_changed_byte_is_told_and_the_rest_is_read() {
        let whole = three();
        let one = whole.len() / 3;
        for at in 0..whole.len() {
            let mut bad = whole.clone();
            bad[at] ^= 0x04;
            let c = parse(&bad);
            if at < 2 * one {
                assert!(!c.damage.is_empty(), "byte {at} changed and nobody noticed");
                assert!(c.records.contains(&end(2)), "{at}");
            } else {
                // In the last record, damage and a torn tail look alike: the point is measured again.
                assert_eq!((c.records.len(), c.damage.len()), (2, 0), "{at}");
            }
        }
    }

    #[test]
    fn a_lost_record_is_damage() {
        let whole = three();
        let one = whole.len() / 3;
        let c = parse(&[&whole[..one], &whole[2 * one..]].concat());
        assert_eq!(
            c.damage,
            vec![format!("Records 1 to 1 are missing before byte {one}.")]
        );
    }

    #[test]
    fn a_file_of_somebody_else_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("letter.txt");
        std::fs::write(&path, "Dear Sir").unwrap();
        let e = Writer::open(&path).err().unwrap().to_string();
        assert!(e.contains("not a scan log"), "{e}");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "Dear Sir");
    }

    #[test]
    fn a_torn_tail_is_cut_and_writing_goes_on() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ogm");
        let whole = three();
        std::fs::write(&path, &whole[..whole.len() - 5]).unwrap();
        let (mut w, c) = Writer::open(&path).unwrap();
        assert_eq!(c.records.len(), 2);
        assert!(
            Writer::open(&path)
                .err()
                .unwrap()
                .to_string()
                .contains("Another scan")
        );
        w.append(&end(2)).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), whole);
    }
}
