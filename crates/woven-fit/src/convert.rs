//! Between measurement formats, and the one way in which this crate writes files.

use crate::measurement::{Measurement, Source};
use anyhow::{Context, Result, bail};
use std::io::Write;
use std::path::Path;
use woven_bsdf::measured::csv::{Direct, Sample, Scan};
use woven_bsdf::measured::klems::{Kind, Klems};
use woven_bsdf::measured::pab::Pab;

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

/// Reads one format and writes another, by the endings of the file names; says what was written.
///
/// # Errors
/// A sentence when the way is not known or a file cannot be read or written.
pub fn convert(input: &Path, output: &Path) -> Result<String> {
    let data = Measurement::read(input)?;
    let end = output
        .extension()
        .map(|e| e.to_string_lossy().to_lowercase())
        .unwrap_or_default();
    if !["csv", "pab"].contains(&end.as_str()) {
        bail!(
            "cannot write {}: from {} only .csv and .pab can be made",
            output.display(),
            input.display()
        );
    }
    let scan = match &data.source {
        Source::Scan(scan) => scan.clone(),
        Source::Klems(k) => scan_of(k, &data)?,
    };
    if end == "pab" {
        return write_pab(output, &data.name, &scan);
    }
    write_atomically(output, scan.to_text().as_bytes())?;
    Ok(format!(
        "written: {}, {} values and {} straight-through rows\n",
        output.display(),
        scan.samples.len(),
        scan.direct.len()
    ))
}

/// A file for each incidence: `output` itself where there is one, else with a number behind its name.
fn write_pab(output: &Path, name: &str, scan: &Scan) -> Result<String> {
    let files = Pab::from_scan(name, scan);
    let numbered = |i: usize| {
        let stem = output.file_stem().unwrap_or_default().to_string_lossy();
        output.with_file_name(format!("{stem}_{:03}.pab", i + 1))
    };
    let path = |i: usize| match files.len() {
        1 => output.to_owned(),
        _ => numbered(i),
    };
    for (i, file) in files.iter().enumerate() {
        write_atomically(&path(i), file.to_text().as_bytes())?;
    }
    let mut said = match files.len() {
        0 => bail!("there are no values to write"),
        1 => format!("written: {}\n", path(0).display()),
        n => format!(
            "written: {} to {}, one incidence each\n",
            path(0).display(),
            path(n - 1).display()
        ),
    };
    let errors = scan.samples.iter().filter(|s| s.sigma.is_some()).count();
    if scan.direct.len() + errors > 0 {
        said += &format!(
            "left out, as PAB has no place for them: {} straight-through rows, {errors} standard errors\n",
            scan.direct.len()
        );
    }
    Ok(said)
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
