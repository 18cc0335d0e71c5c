//! Writing a log: the file is locked, a torn tail cut off, each record on the disk before the next.

use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::{Contents, Record, encode, parse};
use crate::error::{Error, Result};

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
