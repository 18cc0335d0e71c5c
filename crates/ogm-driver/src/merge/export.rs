//! A measurement as files: the project's CSV, and the text that pgII goniometers write and Radiance's `pabopto2bsdf` reads.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use woven_bsdf::measured::csv::{Direct, Sample, Scan};
use woven_bsdf::vec3::Vec3;

use super::{Measurement, Value, shared};
use crate::error::{Error, Result};

impl Measurement {
    /// The project's measurement file.
    pub fn to_scan(&self) -> Scan {
        let vec = |d: [f64; 3]| Vec3::new(d[0], d[1], d[2]);
        Scan {
            comments: self
                .comments
                .iter()
                .cloned()
                .chain(self.shared.lines())
                .chain(shared::own_lines(
                    "own",
                    self.samples.iter().map(|s| s.own / s.sigma),
                ))
                .chain(shared::own_lines(
                    "own_direct",
                    self.direct.iter().map(|d| d.own / d.sigma),
                ))
                .collect(),
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

    /// Writes one text file for each incidence, as pgII does: `NAME_THETA_PHI.txt` beside `path`, lines of theta, phi and BSDF, and for each
    /// `NAME_THETA_PHI_sigma.txt` with the standard errors in the place of the values.
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
            let file = path.with_file_name(format!(
                "{stem}_{theta:06.2}_{:06.2}.txt",
                phi.rem_euclid(360.0)
            ));
            let values = self.pab_text(&stem, theta, phi, |s| s.f);
            let errors = self.pab_text(&stem, theta, phi, |s| s.sigma);
            let sigma = beside(&file, "_sigma");
            write_whole(&file, values.as_bytes())?;
            write_whole(&sigma, errors.as_bytes())?;
            files.extend([file, sigma]);
        }
        Ok(files)
    }

    /// The text of one incidence, with what `of` takes from each value.
    fn pab_text(&self, stem: &str, theta: f64, phi: f64, of: impl Fn(&Value) -> f64) -> String {
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
        let here = |s: &&Value| (s.pose.theta_l, s.pose.phi_l) == (theta, phi);
        for s in self.samples.iter().filter(here) {
            let azimuth = s.pose.phi_v.rem_euclid(360.0);
            let _ = writeln!(text, "{} {azimuth} {}", s.pose.theta_v, of(s));
        }
        text
    }
}

/// The same file with a word added to its name.
pub(super) fn beside(path: &Path, word: &str) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let end = path.extension().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{stem}{word}.{end}"))
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
