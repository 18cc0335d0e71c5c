//! The project's own measurement file: one line a pair of directions.
//!
//! ```text
//! # ogm merge scan.ogm -o lace.csv          free text: the command, the provenance
//! # direct,0,0,0.113,0.002                  straight-through transmittance of one incidence (θ_l, φ_l, T, σ)
//! theta_l_deg,phi_l_deg,theta_v_deg,phi_v_deg,f,sigma
//! 0,0,170,0,0.0143,0.0002
//! ```
//! θ is the polar angle from the front normal, 0…180°, so that light and viewer on opposite sides mean transmission;
//! f and its standard error σ are in 1/sr. An empty σ means that it is unknown.

use super::{Refused, read_text};
use crate::angles::{degrees, radians};
use crate::vec3::Vec3;
use std::fmt::Write;
use std::path::Path;

/// One measured value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Direction to the light.
    pub l: Vec3<f64>,
    /// Direction to the viewer.
    pub v: Vec3<f64>,
    /// BSDF in 1/sr.
    pub f: f64,
    /// Its standard error in 1/sr, if known.
    pub sigma: Option<f64>,
}

/// The light that passes straight through at one incidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direct {
    /// Direction to the light.
    pub l: Vec3<f64>,
    /// Transmitted share of the beam, 0…1.
    pub transmittance: f64,
    /// Its standard error, if known.
    pub sigma: Option<f64>,
}

/// A scattered measurement.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scan {
    /// Free text lines: what made the file, of which sample.
    pub comments: Vec<String>,
    /// Straight-through transmittances.
    pub direct: Vec<Direct>,
    /// Scattered values.
    pub samples: Vec<Sample>,
}

const HEADER: [&str; 6] = [
    "theta_l_deg",
    "phi_l_deg",
    "theta_v_deg",
    "phi_v_deg",
    "f",
    "sigma",
];

impl Scan {
    /// Reads a file.
    ///
    /// # Errors
    /// A sentence with file and line.
    pub fn read(path: &Path) -> Result<Self, Refused> {
        Self::parse(&read_text(path)?).map_err(|e| Refused::new(format!("{}: {e}", path.display())))
    }

    /// Reads the text of a file.
    ///
    /// # Errors
    /// A sentence with the line.
    pub fn parse(text: &str) -> Result<Self, Refused> {
        let mut scan = Scan::default();
        let mut header_seen = false;
        for (n, line) in text.lines().enumerate() {
            let line = line.trim();
            let at = |what: String| Refused::new(format!("line {}: {what}", n + 1));
            if line.is_empty() {
                continue;
            }
            if let Some(comment) = line.strip_prefix('#') {
                let comment = comment.trim();
                match comment.strip_prefix("direct,") {
                    Some(rest) => scan.direct.push(direct(rest).map_err(at)?),
                    None => scan.comments.push(comment.to_owned()),
                }
            } else if header_seen {
                scan.samples.push(sample(line).map_err(at)?);
            } else if line.split(',').map(str::trim).eq(HEADER) {
                header_seen = true;
            } else {
                return Err(at(format!(
                    "expected the header {:?}, found {line:?}",
                    HEADER.join(",")
                )));
            }
        }
        if !header_seen {
            return Err(Refused::new(format!(
                "there is no header line {:?}",
                HEADER.join(",")
            )));
        }
        Ok(scan)
    }

    /// The text of the file; reading it back gives the same numbers to 1e-12.
    pub fn to_text(&self) -> String {
        let mut out = String::new();
        let sigma = |s: Option<f64>| s.map_or(String::new(), |s| s.to_string());
        let ok = "a string grows";
        for c in &self.comments {
            writeln!(out, "# {c}").expect(ok);
        }
        for d in &self.direct {
            let (theta, phi) = d.l.to_angles();
            writeln!(
                out,
                "# direct,{},{},{},{}",
                degrees(theta),
                degrees(phi),
                d.transmittance,
                sigma(d.sigma)
            )
            .expect(ok);
        }
        writeln!(out, "{}", HEADER.join(",")).expect(ok);
        for s in &self.samples {
            let ((tl, pl), (tv, pv)) = (s.l.to_angles(), s.v.to_angles());
            let angles = [tl, pl, tv, pv].map(|a| degrees(a).to_string()).join(",");
            writeln!(out, "{angles},{},{}", s.f, sigma(s.sigma)).expect(ok);
        }
        out
    }
}

/// Splits a line into finite numbers; the last may be empty.
fn numbers<const N: usize>(line: &str) -> Result<[Option<f64>; N], String> {
    let fields: Vec<&str> = line.split(',').map(str::trim).collect();
    if fields.len() != N {
        return Err(format!("{} columns where {N} are needed", fields.len()));
    }
    let mut out = [None; N];
    for (i, field) in fields.iter().enumerate() {
        if field.is_empty() && i + 1 == N {
            continue;
        }
        match field.parse::<f64>() {
            Ok(x) if x.is_finite() => out[i] = Some(x),
            _ => return Err(format!("{field:?} in column {} is not a number", i + 1)),
        }
    }
    Ok(out)
}

fn direction(theta: f64, phi: f64) -> Result<Vec3<f64>, String> {
    if !(0.0..=180.0).contains(&theta) {
        return Err(format!("theta = {theta}° lies outside 0…180°"));
    }
    Ok(Vec3::from_angles(radians(theta), radians(phi)))
}

fn positive(sigma: Option<f64>) -> Result<Option<f64>, String> {
    match sigma {
        Some(s) if s <= 0.0 => Err(format!("sigma = {s} must be positive, or empty if unknown")),
        s => Ok(s),
    }
}

fn sample(line: &str) -> Result<Sample, String> {
    let [tl, pl, tv, pv, f, sigma] = numbers::<6>(line)?;
    let get = |x: Option<f64>| x.ok_or_else(|| "an empty column".to_owned());
    Ok(Sample {
        l: direction(get(tl)?, get(pl)?)?,
        v: direction(get(tv)?, get(pv)?)?,
        f: get(f)?,
        sigma: positive(sigma)?,
    })
}

fn direct(rest: &str) -> Result<Direct, String> {
    let [theta, phi, t, sigma] = numbers::<4>(rest)?;
    let get = |x: Option<f64>| x.ok_or_else(|| "an empty column".to_owned());
    Ok(Direct {
        l: direction(get(theta)?, get(phi)?)?,
        transmittance: get(t)?,
        sigma: positive(sigma)?,
    })
}
