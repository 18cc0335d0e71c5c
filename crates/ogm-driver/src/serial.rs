//! The real port: the only file that names the serialport crate.
//!
//! No `flush` (it has no deadline), no blocking read, no clone of the port: one owner, short timeouts, own line buffer above.

use std::io::{ErrorKind, Read, Write};
use std::time::{Duration, Instant};

use serialport::{ClearBuffer, FlowControl, SerialPort};

use crate::error::{Error, Result};
use crate::transport::Transport;

/// A serial port (or a pseudo-terminal) opened exclusively, 8N1.
pub struct SerialTransport {
    port: Box<dyn SerialPort>,
    name: String,
    opened: Instant,
    timeout: Duration,
}

impl SerialTransport {
    /// Opens `name` at `baud`; `rts_cts` switches hardware flow control on (SIGMA KOKI wants it). Old input is thrown away.
    ///
    /// # Errors
    /// [`Error::PortOpen`].
    pub fn open(name: &str, baud: u32, rts_cts: bool) -> Result<Self> {
        let timeout = Duration::from_millis(5);
        let failed = |e: serialport::Error| Error::PortOpen {
            port: name.into(),
            baud,
            why: e.to_string(),
        };
        let port = serialport::new(name, baud)
            .flow_control(if rts_cts {
                FlowControl::Hardware
            } else {
                FlowControl::None
            })
            .timeout(timeout)
            .open()
            .map_err(failed)?;
        port.clear(ClearBuffer::Input).map_err(failed)?;
        Ok(SerialTransport {
            port,
            name: name.into(),
            opened: Instant::now(),
            timeout,
        })
    }

    fn set_timeout(&mut self, timeout: Duration) -> Result<()> {
        if timeout != self.timeout {
            self.port
                .set_timeout(timeout)
                .map_err(|e| self.lost(&e.to_string()))?;
            self.timeout = timeout;
        }
        Ok(())
    }

    fn lost(&self, why: &str) -> Error {
        Error::PortLost {
            port: self.name.clone(),
            why: why.into(),
        }
    }

    fn outcome(&self, result: std::io::Result<usize>) -> Result<usize> {
        match result {
            Ok(n) => Ok(n),
            Err(e)
                if matches!(
                    e.kind(),
                    ErrorKind::TimedOut | ErrorKind::Interrupted | ErrorKind::WouldBlock
                ) =>
            {
                Ok(0)
            }
            Err(e) => Err(self.lost(&e.to_string())),
        }
    }
}

impl Transport for SerialTransport {
    fn write(&mut self, bytes: &[u8], timeout: Duration) -> Result<usize> {
        self.set_timeout(timeout)?;
        let result = self.port.write(bytes);
        self.outcome(result)
    }

    fn read(&mut self, into: &mut Vec<u8>, timeout: Duration) -> Result<usize> {
        self.set_timeout(timeout)?;
        let mut chunk = [0_u8; 512];
        let result = self.port.read(&mut chunk);
        if matches!(result, Ok(0)) {
            return Err(self.lost("end of file"));
        }
        let n = self.outcome(result)?;
        into.extend_from_slice(&chunk[..n]);
        Ok(n)
    }

    fn now(&self) -> Duration {
        self.opened.elapsed()
    }

    fn wait(&mut self, time: Duration) {
        std::thread::sleep(time);
    }

    fn name(&self) -> String {
        self.name.clone()
    }
}
