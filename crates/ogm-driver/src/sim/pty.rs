//! The simulated rig behind a pseudo-terminal: a thread that owns the device and the master side; any serial program may open the other side.

use std::io;
use std::os::fd::OwnedFd;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

use super::device::Device;

/// The clock of a simulation that runs beside the wall's.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    begun: Instant,
    /// How many times faster than the wall's.
    pub speed: f64,
}

impl Clock {
    /// Seconds of the simulation.
    pub fn now(&self) -> f64 {
        self.begun.elapsed().as_secs_f64() * self.speed
    }
}

/// A running simulated rig. Dropping it stops the thread and closes the port.
pub struct PtyRig {
    port: String,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<io::Result<()>>>,
    /// The simulation's clock.
    pub clock: Clock,
    /// The device, to look inside from a test.
    pub device: Arc<Mutex<Device>>,
}

impl PtyRig {
    /// Opens a pseudo-terminal and serves `device` behind it; the simulation's clock runs `speed` times as fast as the wall's.
    ///
    /// # Errors
    /// When the system gives no pseudo-terminal.
    pub fn start(device: Device, speed: f64) -> io::Result<Self> {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
        grantpt(&master)?;
        unlockpt(&master)?;
        let port = ptsname(&master, Vec::new())?.to_string_lossy().into_owned();
        let mut raw = tcgetattr(&master)?;
        raw.make_raw();
        tcsetattr(&master, OptionalActions::Now, &raw)?;
        fcntl_setfl(&master, fcntl_getfl(&master)? | OFlags::NONBLOCK)?;
        let stop = Arc::new(AtomicBool::new(false));
        let device = Arc::new(Mutex::new(device));
        let clock = Clock {
            begun: Instant::now(),
            speed,
        };
        let (flag, shared) = (stop.clone(), device.clone());
        let thread = std::thread::Builder::new()
            .name("simulated rig".into())
            .spawn(move || serve(&master, &shared, &flag, clock))?;
        Ok(PtyRig {
            port,
            stop,
            thread: Some(thread),
            clock,
            device,
        })
    }

    /// Name of the port to open.
    pub fn port(&self) -> &str {
        &self.port
    }

    /// Whether the device has gone away by itself.
    pub fn is_over(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }
}

impl Drop for PtyRig {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::SeqCst);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn serve(
    master: &OwnedFd,
    device: &Mutex<Device>,
    stop: &AtomicBool,
    clock: Clock,
) -> io::Result<()> {
    let now = || clock.now();
    let mut pending: Vec<u8> = Vec::new();
    let mut chunk = [0_u8; 4096];
    while !stop.load(Ordering::SeqCst) {
        let due = {
            let mut device = device.lock().unwrap_or_else(PoisonError::into_inner);
            if device.vanished() {
                return Ok(()); // closes the master: the other side sees the port vanish
            }
            pending.extend(device.emit(now()));
            device.next_due()
        };
        if !pending.is_empty() {
            match rustix::io::write(master, &pending) {
                Ok(n) => drop(pending.drain(..n)),
                Err(rustix::io::Errno::AGAIN) => {}
                // Nobody has the port open: a serial line loses what nobody reads.
                Err(_) => pending.clear(),
            }
        }
        // At most 5 ms, so that a stop is noticed; less when an answer is due.
        let wait = due.map_or(5e-3, |t| ((t - now()) / clock.speed).clamp(0.0, 5e-3));
        let wait = if pending.is_empty() {
            wait
        } else {
            wait.min(1e-3)
        };
        let timeout = Timespec {
            tv_sec: 0,
            tv_nsec: (wait * 1e9) as i64,
        };
        let mut fds = [PollFd::new(master, PollFlags::IN)];
        match poll(&mut fds, Some(&timeout)) {
            Ok(_) | Err(rustix::io::Errno::INTR) => {}
            Err(e) => return Err(e.into()),
        }
        let events = fds[0].revents();
        if events.contains(PollFlags::IN) {
            match rustix::io::read(master, &mut chunk) {
                Ok(n) => device
                    .lock()
                    .unwrap_or_else(PoisonError::into_inner)
                    .receive(&chunk[..n], now()),
                Err(rustix::io::Errno::AGAIN | rustix::io::Errno::INTR) => {}
                Err(_) => std::thread::sleep(Duration::from_millis(2)), // the host closed the port; it may come back
            }
        } else if events.contains(PollFlags::HUP) {
            std::thread::sleep(Duration::from_millis(2));
        }
    }
    Ok(())
}
