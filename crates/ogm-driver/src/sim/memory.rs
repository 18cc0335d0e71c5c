//! A transport straight into a simulated device, on virtual time: a six-hour scan in the blink of an eye, the same bytes as over a port.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::device::Device;
use crate::error::{Error, Result};
use crate::transport::Transport;

/// Owns the virtual clock; the device is shared so that a test can look inside.
pub struct MemoryTransport {
    device: Arc<Mutex<Device>>,
    now: f64,
}

impl MemoryTransport {
    /// A transport into `device`.
    pub fn new(device: Arc<Mutex<Device>>) -> Self {
        MemoryTransport { device, now: 0.0 }
    }

    /// A transport that begins at a later moment, as after a restart of the host.
    pub fn starting_at(device: Arc<Mutex<Device>>, now: f64) -> Self {
        MemoryTransport { device, now }
    }

    fn device(&self) -> MutexGuard<'_, Device> {
        self.device.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn alive(&self) -> Result<MutexGuard<'_, Device>> {
        let device = self.device();
        if device.vanished() {
            Err(Error::PortLost {
                port: "simulated".into(),
                why: "the port vanished".into(),
            })
        } else {
            Ok(device)
        }
    }
}

impl Transport for MemoryTransport {
    fn write(&mut self, bytes: &[u8], _timeout: Duration) -> Result<usize> {
        let now = self.now;
        self.alive()?.receive(bytes, now);
        Ok(bytes.len())
    }

    fn read(&mut self, into: &mut Vec<u8>, timeout: Duration) -> Result<usize> {
        let end = self.now + timeout.as_secs_f64();
        loop {
            let mut device = self.alive()?;
            let bytes = device.emit(self.now);
            let due = device.next_due();
            drop(device);
            if !bytes.is_empty() {
                into.extend_from_slice(&bytes);
                return Ok(bytes.len());
            }
            match due {
                Some(t) if t <= end && t > self.now => self.now = t,
                _ => {
                    self.now = end;
                    return Ok(0);
                }
            }
        }
    }

    fn now(&self) -> Duration {
        Duration::from_secs_f64(self.now.max(0.0))
    }

    fn wait(&mut self, time: Duration) {
        self.now += time.as_secs_f64();
    }

    fn name(&self) -> String {
        "simulated".into()
    }
}
