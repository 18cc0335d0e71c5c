//! What can go wrong, told in sentences: which field of a curtain file, which file, and what to do about it.

use std::path::PathBuf;

/// Why a curtain could not be built, simulated, written or read.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A value in the curtain's description makes no sense.
    #[error("{field}: {message}")]
    Spec {
        /// The field as it is spelled in the `.toml`, for example `wind.speed`.
        field: String,
        /// What is wrong with it and what is allowed.
        message: String,
    },
    /// The text is not the TOML of a curtain.
    #[error("the curtain's description cannot be read: {0}")]
    Toml(String),
    /// The simulation left the ground it can stand on; nothing was written.
    #[error(
        "the cloth blew up at {time:.3} s ({what}); lower the wind or the stiffness, or ask for more steps with `substeps`"
    )]
    Diverged {
        /// Simulated time, s.
        time: f64,
        /// What was seen, for example a position that is not a number.
        what: String,
    },
    /// A saved state does not belong to this curtain or is damaged.
    #[error("the saved state cannot be used: {0}")]
    Checkpoint(String),
    /// A cache file is damaged or not one of ours.
    #[error("the cloth cache cannot be used: {0}")]
    Cache(String),
    /// Reading or writing failed.
    #[error("{path}: {source}")]
    Io {
        /// The file concerned.
        path: PathBuf,
        /// The system's own words.
        source: std::io::Error,
    },
    /// The caller asked to stop.
    #[error("stopped on request after {frames} frames; run the same command again to go on")]
    Stopped {
        /// Frames finished before the stop.
        frames: usize,
    },
}

/// The result of everything in this crate that can fail.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    pub(crate) fn spec(field: impl Into<String>, message: impl Into<String>) -> Self {
        Self::Spec {
            field: field.into(),
            message: message.into(),
        }
    }

    pub(crate) fn io(path: impl Into<PathBuf>, source: std::io::Error) -> Self {
        Self::Io {
            path: path.into(),
            source,
        }
    }
}
