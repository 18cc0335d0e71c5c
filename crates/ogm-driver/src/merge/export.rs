//! A measurement as files: the project's CSV, and the text that pgII goniometers write and Radiance's `pabopto2bsdf` reads.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use woven_bsdf::measured::csv::{Direct, Sample, Scan};
use woven_bsdf::vec3::Vec3;

use super::Measurement;
use crate::error::{Error, Result};

impl Measurement {
    /// The project's measurement file.
    pub fn to_scan(&self) -> Scan {
        let vec = |d: [f64; 3]| Vec3::new(d[0], d[1], d[2]);
        Scan {
            comments: self.comments.clone(),
            direct: self
                .direct
                .iter()
                .map(|d| Direct {
                    l: vec(d.pose.light()),
                    transmittance: d.transmittance,
                    sigma: Some(d.sigma),
                })
                .collect(),
            samples: self
                .samples
                .iter()
                .map(|s| Sample {
                    l: vec(s.pose.light()),
                    v: vec(s.pose.view()),
                    f: s.f,
                    sigma: Some(s.sigma),
                })
                .collect(),
        }
    }

    /// Writes the CSV: to a temporary file in the same folder, synced, renamed.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write_csv(&self, path: &Path) -> Result<()> {
        write_whole(path, self.to_scan().to_text().as_bytes())
    }

    /// Writes one text file for each incidence, as pgII does: `NAME_THETA_PHI.txt` beside `path`, lines of theta, phi and BSDF.
    /// Theta is the polar angle from the front normal (over 90 is transmission), as `pabopto2bsdf` expects. Returns the files written.
    ///
    /// # Errors
    /// [`Error::Merge`] when there is no value, [`Error::Io`].
    pub fn write_pab(&self, path: &Path) -> Result<Vec<PathBuf>> {
        let mut incidences: Vec<(f64, f64)> = Vec::new();
        for s in &self.samples {
            let here = (s.pose.theta_l, s.pose.phi_l);
            if !incidences.contains(&here) {
                incidences.push(here);
            }
        }
        if incidences.is_empty() {
            return Err(Error::Merge(
                "The measurement has no value to write.".into(),
            ));
        }
        let stem = path
            .file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        let mut files = Vec::new();
        for (theta, phi) in incidences {
            let mut text = String::new();
            for c in &self.comments {
                // A string takes everything that is written to it.
                let _ = writeln!(text, "#comment \"{}\"", c.replace('"', "'"));
            }
            let _ = writeln!(text, "#sample_name \"{stem}\"");
            let _ = writeln!(
                text,
                "#intheta {theta}\n#inphi {phi}\n#incident_side front\n#format: theta phi BSDF"
            );
            for s in self
                .samples
                .iter()
                .filter(|s| (s.pose.theta_l, s.pose.phi_l) == (theta, phi))
            {
                let azimuth = s.pose.phi_v.rem_euclid(360.0);
                let _ = writeln!(text, "{} {azimuth} {}", s.pose.theta_v, s.f);
            }
            let file = path.with_file_name(format!(
                "{stem}_{theta:06.2}_{:06.2}.txt",
                phi.rem_euclid(360.0)
            ));
            write_whole(&file, text.as_bytes())?;
            files.push(file);
        }
        Ok(files)
    }
}

/// Writes a whole file: a temporary file in the same folder, synced, then renamed.
///
/// # Errors
/// [`Error::Io`].
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    use std::io::Write;
    let folder = path
        .parent()
        .filter(|p| !p.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let mut file =
        tempfile::NamedTempFile::new_in(folder).map_err(|e| Error::io("write into", folder, e))?;
    file.write_all(bytes)
        .and_then(|()| file.as_file().sync_all())
        .map_err(|e| Error::io("write", path, e))?;
    file.persist(path)
        .map_err(|e| Error::io("write", path, e.error))?;
    Ok(())
}
