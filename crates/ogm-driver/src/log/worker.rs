//! The log's own thread.

use std::sync::mpsc;

use super::{Record, Writer};
use crate::error::{Error, Result};

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
