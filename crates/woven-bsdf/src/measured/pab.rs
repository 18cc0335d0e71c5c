//! PAB text: what goniophotometers of the pgII kind write, one file for each incidence.
//!
//! ```text
//! #sample_name "lace"
//! #incident_angle 30 0                      or #intheta 30 and #inphi 0
//! #upphi 90                                 azimuth that points up along the cloth's warp; 90 here when absent
//! #colorimetry: CIE-Y                       or CIE-XYZ: three numbers a line
//! #format: theta phi BSDF                   or BRDF, BTDF; DSF: the value times |cosθ|
//! 150 180 0.52
//! ```
//! Angles are degrees; θ is the polar angle from the front normal, 0…180°, towards the lamp and towards the detector, so
//! that light which goes straight on at 30°, 0° is seen at 150°, 180°. Radiance's `pabopto2bsdf` reads the same.

use super::csv::{Sample, Scan};
use super::{Refused, read_text};
use crate::angles::{degrees, radians};
use crate::vec3::Vec3;
use std::fmt::Write;
use std::path::Path;

/// What the numbers of a file are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// The BSDF in 1/sr.
    Bsdf,
    /// The BSDF times |cosθ| of the detector.
    Dsf,
}

/// The scattered light of one incidence.
#[derive(Clone, Debug, PartialEq)]
pub struct Pab {
    /// Name of the sample; may be empty.
    pub name: String,
    /// Polar angle and azimuth of the lamp in degrees, as in the file.
    pub incident: [f64; 2],
    /// Azimuth in degrees that points up on the sample.
    pub up_phi: f64,
    /// What the values are.
    pub quantity: Quantity,
    /// Numbers on a line: 1, or 3 for X, Y, Z.
    pub channels: usize,
    /// θ and φ of the detector in degrees, then the values; behind one channel zeros.
    pub points: Vec<[f64; 5]>,
}

impl Pab {
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
    /// A sentence with the line, or with the part of the header that is missing.
    pub fn parse(text: &str) -> Result<Self, Refused> {
        let (mut theta, mut phi, mut quantity) = (None, None, None);
        let mut pab = Pab {
            name: String::new(),
            incident: [0.0; 2],
            up_phi: 90.0,
            quantity: Quantity::Bsdf,
            channels: 1,
            points: Vec::new(),
        };
        for (n, line) in text.lines().enumerate() {
            let at = |what: String| Refused::new(format!("line {}: {what}", n + 1));
            let line = line.trim();
            if let Some(header) = line.strip_prefix('#') {
                let (key, rest) = header
                    .trim()
                    .split_once(|c: char| c.is_whitespace() || c == ':')
                    .unwrap_or((header.trim(), ""));
                let rest = rest.trim_start_matches([':', ' ', '\t']).trim();
                const KEYS: [&str; 7] = [
                    "sample_name",
                    "intheta",
                    "inphi",
                    "upphi",
                    "incident_angle",
                    "colorimetry",
                    "format",
                ];
                if !pab.points.is_empty() && KEYS.contains(&key) {
                    return Err(at(format!(
                        "{key:?} stands behind the first numbers; one file holds one incidence"
                    )));
                }
                match key {
                    "sample_name" => pab.name = rest.trim_matches('"').to_owned(),
                    "intheta" => theta = Some(numbers::<1>(rest).map_err(at)?[0]),
                    "inphi" => phi = Some(numbers::<1>(rest).map_err(at)?[0]),
                    "upphi" => pab.up_phi = numbers::<1>(rest).map_err(at)?[0],
                    "incident_angle" => {
                        let [t, p] = numbers::<2>(rest).map_err(at)?;
                        (theta, phi) = (Some(t), Some(p));
                    }
                    "colorimetry" => {
                        pab.channels = match rest.to_uppercase().as_str() {
                            "CIE-Y" => 1,
                            "CIE-XYZ" => 3,
                            _ => {
                                return Err(at(format!(
                                    "the colorimetry {rest:?} is unknown; there are CIE-Y and CIE-XYZ"
                                )));
                            }
                        }
                    }
                    "format" => quantity = Some(format(rest).map_err(at)?),
                    _ => {}
                }
            } else if !line.is_empty() {
                let point = if pab.channels == 3 {
                    numbers::<5>(line).map_err(at)?
                } else {
                    let [t, p, f] = numbers::<3>(line).map_err(at)?;
                    [t, p, f, 0.0, 0.0]
                };
                if !(0.0..=180.0).contains(&point[0]) {
                    return Err(at(format!("theta = {}° lies outside 0…180°", point[0])));
                }
                pab.points.push(point);
            }
        }
        let (Some(theta), Some(phi)) = (theta, phi) else {
            return Err(Refused::new(
                "the header gives no incidence: a line `#incident_angle THETA PHI` is needed",
            ));
        };
        if !(0.0..=180.0).contains(&theta) {
            return Err(Refused::new(format!(
                "the incidence theta = {theta}° lies outside 0…180°"
            )));
        }
        pab.incident = [theta, phi];
        pab.quantity = quantity.ok_or_else(|| {
            Refused::new("the header gives no format: a line `#format: theta phi BSDF` is needed")
        })?;
        Ok(pab)
    }

    /// The text of the file; reading it back gives the same numbers to the bit.
    pub fn to_text(&self) -> String {
        let ok = "a string grows";
        let mut out = String::new();
        if !self.name.is_empty() {
            let name: String = self.name.replace(['"', '\n', '\r'], " ");
            writeln!(out, "#sample_name \"{}\"", name.trim()).expect(ok);
        }
        writeln!(
            out,
            "#incident_angle {} {}",
            self.incident[0], self.incident[1]
        )
        .expect(ok);
        writeln!(out, "#upphi {}", self.up_phi).expect(ok);
        let colour = if self.channels == 3 {
            "CIE-XYZ"
        } else {
            "CIE-Y"
        };
        writeln!(out, "#colorimetry: {colour}").expect(ok);
        let quantity = match self.quantity {
            Quantity::Bsdf => "BSDF",
            Quantity::Dsf => "DSF",
        };
        writeln!(out, "#format: theta phi {quantity}").expect(ok);
        for p in &self.points {
            let numbers: Vec<String> = p[..2 + self.channels].iter().map(f64::to_string).collect();
            writeln!(out, "{}", numbers.join(" ")).expect(ok);
        }
        out
    }

    fn direction(&self, theta: f64, phi: f64) -> Vec3<f64> {
        Vec3::from_angles(radians(theta), radians(phi + 90.0 - self.up_phi))
    }

    /// The points as a scan in the cloth's frame (warp up), of luminance. Values of a detector within a degree of
    /// grazing are left out of a DSF, whose division by |cosθ| means nothing there.
    pub fn scan(&self) -> Scan {
        let l = self.direction(self.incident[0], self.incident[1]);
        let value = |p: &[f64; 5]| if self.channels == 3 { p[3] } else { p[2] };
        let samples = self.points.iter().filter_map(|p| {
            let v = self.direction(p[0], p[1]);
            let f = match self.quantity {
                Quantity::Bsdf => value(p),
                Quantity::Dsf if v.z.abs() > 0.0175 => value(p) / v.z.abs(),
                Quantity::Dsf => return None,
            };
            Some(Sample {
                l,
                v,
                f,
                sigma: None,
            })
        });
        Scan {
            comments: vec![format!("sample {}", self.name)],
            direct: Vec::new(),
            samples: samples.collect(),
        }
    }

    /// Files, one for each incidence, from a scan: the way back of [`Pab::scan`]. Samples of one incidence need not be
    /// neighbours; the order of incidences is that of their first samples.
    pub fn from_scan(name: &str, scan: &Scan) -> Vec<Self> {
        let mut out: Vec<(Vec3<f64>, Self)> = Vec::new();
        for s in &scan.samples {
            let (t, p) = s.v.to_angles();
            let point = [degrees(t), degrees(p), s.f, 0.0, 0.0];
            match out
                .iter_mut()
                .find(|(l, _)| (*l - s.l).length_sqr() < 1e-16)
            {
                Some((_, pab)) => pab.points.push(point),
                None => {
                    let (t, p) = s.l.to_angles();
                    let pab = Pab {
                        name: name.to_owned(),
                        incident: [degrees(t), degrees(p)],
                        up_phi: 90.0,
                        quantity: Quantity::Bsdf,
                        channels: 1,
                        points: vec![point],
                    };
                    out.push((s.l, pab));
                }
            }
        }
        out.into_iter().map(|(_, pab)| pab).collect()
    }
}

/// Exactly `N` finite numbers between blanks.
fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let mut out = [0.0; N];
    let mut words = text.split_whitespace();
    for (i, x) in out.iter_mut().enumerate() {
        let word = words
            .next()
            .ok_or_else(|| format!("{i} numbers where {N} are needed"))?;
        *x = match word.parse::<f64>() {
            Ok(x) if x.abs() < 1e12 => x,
            _ => return Err(format!("{word:?} is not a number")),
        };
    }
    match words.next() {
        None => Ok(out),
        Some(word) => Err(format!("{word:?} behind the {N} numbers that are needed")),
    }
}

/// `theta phi BSDF` and its kin.
fn format(text: &str) -> Result<Quantity, String> {
    let words: Vec<String> = text.split_whitespace().map(str::to_uppercase).collect();
    match words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["THETA", "PHI", "BSDF" | "BRDF" | "BTDF"] => Ok(Quantity::Bsdf),
        ["THETA", "PHI", "DSF"] => Ok(Quantity::Dsf),
        _ => Err(format!(
            "the format {text:?} is unknown; there are theta phi BSDF, BRDF, BTDF and DSF"
        )),
    }
}
