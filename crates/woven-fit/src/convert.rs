//! Between measurement formats, and the one way in which this crate writes files.

use crate::measurement::{Measurement, Source};
use anyhow::{Context, Result, bail};
use std::io::Write;
use std::path::Path;
use woven_bsdf::measured::csv::{Direct, Sample, Scan};
use woven_bsdf::measured::klems::{Kind, Klems};

/// Writes a file whole or not at all: into a temporary file in the same folder, then renamed.
///
/// # Errors
/// A sentence that names the file.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    let folder = path
        .parent()
        .filter(|p| !p.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let attempt = || -> std::io::Result<()> {
        let mut file = tempfile::NamedTempFile::new_in(folder)?;
        file.write_all(bytes)?;
        file.as_file().sync_all()?;
        // Temporary files are private to their maker; results are for everyone who may read the folder.
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            file.as_file()
                .set_permissions(std::fs::Permissions::from_mode(0o644))?;
        }
        file.persist(path).map_err(|e| e.error)?;
        Ok(())
    };
    attempt().with_context(|| {
        format!(
            "cannot write {}; is the folder there and writable?",
            path.display()
        )
    })
}

/// Reads one format and writes another, by the endings of the file names.
///
/// # Errors
/// A sentence when the way is not known or a file cannot be read or written.
pub fn convert(input: &Path, output: &Path) -> Result<()> {
    let data = Measurement::read(input)?;
    let end = output
        .extension()
        .map(|e| e.to_string_lossy().to_lowercase())
        .unwrap_or_default();
    let scan = match (&data.source, end.as_str()) {
        (Source::Scan(scan), "csv") => scan.clone(),
        (Source::Klems(k), "csv") => scan_of(k, &data)?,
        (Source::Klems(_) | Source::Scan(_), _) => bail!(
            "cannot write {}: from {} only .csv can be made",
            output.display(),
            input.display()
        ),
    };
    write_atomically(output, scan.to_text().as_bytes())
}

/// The fitted band of a matrix file as scattered points at the patches' centres; the straight-through patches become
/// `direct` lines with their whole transmittance.
fn scan_of(k: &Klems, data: &Measurement) -> Result<Scan> {
    let file = data
        .path
        .file_name()
        .map(|f| f.to_string_lossy().into_owned())
        .unwrap_or_default();
    let mut scan = Scan {
        comments: vec![
            format!("woven-fit convert {file}"),
            format!("fabric {}; sha256 {}", data.name, data.sha256),
            "averages over patches of the matrix file, placed at the patches' centres".to_owned(),
        ],
        ..Scan::default()
    };
    for kind in [
        Kind::TransmissionFront,
        Kind::TransmissionBack,
        Kind::ReflectionFront,
        Kind::ReflectionBack,
    ] {
        let Some((_, block)) = data.block(kind) else {
            continue;
        };
        for (i, incident) in k.patches.iter().enumerate() {
            let l = kind.l((incident.theta(), incident.phi));
            for (o, outgoing) in k.patches.iter().enumerate() {
                if kind.transmits() && i == o {
                    scan.direct.push(Direct {
                        l,
                        transmittance: k.straight(block, i),
                        sigma: None,
                    });
                    continue;
                }
                scan.samples.push(Sample {
                    l,
                    v: kind.v((outgoing.theta(), outgoing.phi)),
                    f: k.value(block, o, i),
                    sigma: None,
                });
            }
        }
    }
    if scan.samples.is_empty() {
        bail!("{file} holds no known block to convert");
    }
    Ok(scan)
}
