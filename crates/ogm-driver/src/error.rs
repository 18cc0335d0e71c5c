//! What can go wrong between a plan and a reading, each as a sentence that says what, where and what to do.

use std::path::PathBuf;
use std::time::Duration;

/// Result of everything that may fail in this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// Every failure of the driver. `Display` gives a whole sentence for the operator.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The operator (or a signal) asked to stop; the stop bytes went out.
    #[error(
        "Stopped by request: the arms were told to stop. Run the same command again to go on from the last stored point."
    )]
    Stopped,
    /// No answer within the deadline.
    #[error("No reply from the rig within {} s after {command}; check the cable, the baud rate and the emergency stop.", .within.as_secs_f64())]
    NoReply {
        /// The command that stayed unanswered.
        command: String,
        /// Its deadline.
        within: Duration,
    },
    /// The answer could not be read.
    #[error(
        "The rig answered {command} with {got:?}, which is not what this controller answers; check the protocol and the baud rate in the rig file."
    )]
    Garbled {
        /// The command.
        command: String,
        /// What came back.
        got: String,
    },
    /// The controller refused a command.
    #[error("The controller refused {command}: {why}.")]
    Refused {
        /// The command.
        command: String,
        /// What the controller said about it.
        why: String,
    },
    /// A limit sensor stopped an arm.
    #[error(
        "A limit sensor stopped {axis} during {command}; clear the arm by hand, then start again (the scan re-homes and resumes)."
    )]
    LimitSensor {
        /// Names of the axes at a limit.
        axis: String,
        /// The command.
        command: String,
    },
    /// The controller is in alarm.
    #[error(
        "The controller raised alarm {code} ({meaning}) during {command}; positions may be lost, so start again (the scan re-homes and resumes)."
    )]
    Alarm {
        /// Number of the alarm.
        code: u32,
        /// What the number means.
        meaning: &'static str,
        /// The command.
        command: String,
    },
    /// The controller restarted by itself.
    #[error(
        "The controller restarted during {command} (a reset or a cut of its power), so its positions are lost; start again (the scan re-homes and resumes)."
    )]
    Restarted {
        /// The command.
        command: String,
    },
    /// A move ended elsewhere.
    #[error(
        "{axis} should be at {wanted:.4} deg after {command} but reports {got:.4} deg; the reading was not taken. Look for a stall, then start again."
    )]
    NotThere {
        /// Name of the axis.
        axis: String,
        /// Target in degrees.
        wanted: f64,
        /// Reported angle in degrees.
        got: f64,
        /// The command.
        command: String,
    },
    /// A move took longer than its profile allows.
    #[error("The arms were still moving {} s after {command}, longer than the move can take; they were told to stop.", .within.as_secs_f64())]
    StillMoving {
        /// The command.
        command: String,
        /// The deadline.
        within: Duration,
    },
    /// A target outside the soft limits. Nothing was sent.
    #[error(
        "{axis} = {angle} deg lies outside its limits {min}..{max} deg; nothing was moved. Change the plan or the limits in the rig file."
    )]
    Limit {
        /// Name of the axis.
        axis: String,
        /// The refused angle in degrees.
        angle: f64,
        /// Least angle allowed.
        min: f64,
        /// Greatest angle allowed.
        max: f64,
    },
    /// A target or a way inside the zone where the arms touch. Nothing was sent.
    #[error(
        "{what} brings the arms within {least:.2} deg of each other, the zone is {zone} deg; nothing was moved."
    )]
    Zone {
        /// The pose or the way.
        what: String,
        /// Smallest separation in degrees.
        least: f64,
        /// Forbidden separation in degrees.
        zone: f64,
    },
    /// The port went away.
    #[error(
        "The port {port} went away ({why}); plug it in and start again (the scan re-homes and resumes)."
    )]
    PortLost {
        /// Name of the port.
        port: String,
        /// Reason given by the system.
        why: String,
    },
    /// The port could not be opened.
    #[error("Cannot open the port {port} at {baud} baud: {why}.")]
    PortOpen {
        /// Name of the port.
        port: String,
        /// Speed asked for.
        baud: u32,
        /// Reason given by the system.
        why: String,
    },
    /// The lamp is off, cold or too weak.
    #[error("{0}")]
    Lamp(String),
    /// The detector misbehaved.
    #[error("{0}")]
    Detector(String),
    /// A plan that cannot be used.
    #[error("{0}")]
    Plan(String),
    /// A rig file that cannot be used.
    #[error("{0}")]
    Rig(String),
    /// A log that cannot be used.
    #[error("{0}")]
    Log(String),
    /// A merge that cannot be done.
    #[error("{0}")]
    Merge(String),
    /// A file could not be read or written.
    #[error("Cannot {verb} {}: {source}.", .path.display())]
    Io {
        /// "read", "write", ...
        verb: &'static str,
        /// Which file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
}

impl Error {
    /// Wraps a file error into a sentence.
    pub fn io(verb: &'static str, path: impl Into<PathBuf>, source: std::io::Error) -> Self {
        Error::Io {
            verb,
            path: path.into(),
            source,
        }
    }
}
