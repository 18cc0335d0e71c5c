//! Measurements: files of goniometers, read with care and written back.

pub mod csv;
pub mod klems;
pub mod klems_write;
pub mod shop;
pub mod table;

/// Why a measurement file was refused; the text says what, where and what to do.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct Refused(pub String);

impl Refused {
    /// A refusal with the sentence `text`.
    pub fn new(text: impl Into<String>) -> Self {
        Refused(text.into())
    }
}

/// Reads a file of at most 256 MiB, with a sentence when it cannot.
pub(crate) fn read_bytes(path: &std::path::Path) -> Result<Vec<u8>, Refused> {
    const LIMIT: u64 = 256 << 20;
    let fail = |e: std::io::Error| Refused::new(format!("cannot read {}: {e}", path.display()));
    let length = std::fs::metadata(path).map_err(fail)?.len();
    if length > LIMIT {
        return Err(Refused::new(format!(
            "{} has {length} bytes; the limit is {LIMIT}",
            path.display()
        )));
    }
    std::fs::read(path).map_err(fail)
}

/// [`read_bytes`] as text.
pub(crate) fn read_text(path: &std::path::Path) -> Result<String, Refused> {
    String::from_utf8(read_bytes(path)?).map_err(|e| {
        Refused::new(format!(
            "{} is not UTF-8 text (byte {})",
            path.display(),
            e.utf8_error().valid_up_to()
        ))
    })
}
