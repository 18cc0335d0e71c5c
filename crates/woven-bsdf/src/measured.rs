//! Measurements: files of goniometers and databases, read with care and written back.
//!
//! | file | reader | what it becomes |
//! |---|---|---|
//! | Klems XML of WINDOW and Radiance | [`klems`], written by [`klems_write`] | a matrix of patches |
//! | tensor tree XML of Radiance | [`tensor_tree`], also by [`klems`] | cells of any size, or a Klems matrix |
//! | PAB text of pgII goniophotometers | [`pab`], written there too | a scan |
//! | the project's CSV | [`csv`], written there too | a scan |
//! | MERL `.binary` | [`merl`] | reflectance in three colours |
//! | RGL `.bsdf` | [`rgl`] | reflectance in colours or wavelengths |
//!
//! A scan becomes a BSDF by [`scattered`], any BSDF a Klems matrix by [`resample`], and a matrix a model with a sampler,
//! its gap kept apart, by [`table`]. Sizes are checked before anything is allocated: no file costs more than 512 MiB.

pub mod csv;
pub mod klems;
mod klems_check;
pub mod klems_write;
pub mod merl;
pub mod pab;
pub mod resample;
pub mod rgl;
pub mod scattered;
pub mod shop;
pub mod table;
mod tensor_file;
pub mod tensor_tree;
mod xml;

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
    read_bytes_at_most(path, 256 << 20)
}

/// Reads a file whose size is checked first.
pub(crate) fn read_bytes_at_most(path: &std::path::Path, limit: u64) -> Result<Vec<u8>, Refused> {
    let fail = |e: std::io::Error| Refused::new(format!("cannot read {}: {e}", path.display()));
    let length = std::fs::metadata(path).map_err(fail)?.len();
    if length > limit {
        return Err(Refused::new(format!(
            "{} has {length} bytes; the limit is {limit}",
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
